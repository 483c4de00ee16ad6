//! One body's turn as the recursion reads it, and as the schedule keeps it: in 32-bit indices, since every reduction reads it
//! for every body.

use super::schedule::{NONE, Step};

/// What a body's turn needs besides its step; the meanings are those of [`Turn`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Packed {
    pub(super) front: u32,
    pub(super) rows: u32,
    pub(super) parent: u32,
    pub(super) targets: u32,
    pub(super) row_start: u32,
    pub(super) next: u32,
    pub(super) next_row: u32,
    pub(super) map_start: u32,
}

/// One body's turn.
#[derive(Debug, Clone, Copy)]
pub(super) struct Turn {
    /// Coordinates of its joint.
    pub(super) freedom: usize,
    /// Bodies of its front: rows of its column in the pattern.
    pub(super) front: usize,
    /// Constraint rows that reach it.
    pub(super) rows: usize,
    /// Place of its parent in the front; none: ground or free.
    pub(super) parent: usize,
    /// A loop that was closed before couples it to its front.
    pub(super) coupled: bool,
    /// Start of its front among the schedule's fronts, nodes and blocks.
    pub(super) column: usize,
    /// Start of the couplings that its front's update changes.
    pub(super) targets: usize,
    /// First coordinate.
    pub(super) first: usize,
    /// Start of its rows in the row arena; each row has 3 + 3·front + 1 entries.
    pub(super) row_start: usize,
    /// Start of its coefficients in the coefficient arena: two of a pin, 3·front of any other coordinate that is alone,
    /// `freedom` rows of freedom + 3·front entries where [`Kind::Any`] takes them out.
    pub(super) coefficient_start: usize,
    /// Start of its row transformation in the transformation arena.
    pub(super) next: usize,
    /// Where the rows that are left go within the next body's rows.
    pub(super) next_row: usize,
    /// Start of the map from this front's bodies to places at the next body.
    pub(super) map_start: usize,
}

impl Packed {
    /// The turn of the body with this step.
    #[inline(always)]
    pub(super) fn unpack(&self, step: &Step) -> Turn {
        Turn {
            freedom: step.freedom as usize,
            front: self.front as usize,
            rows: self.rows as usize,
            parent: wide(self.parent),
            coupled: step.coupled,
            column: step.column as usize,
            targets: self.targets as usize,
            first: step.first as usize,
            row_start: self.row_start as usize,
            coefficient_start: step.coefficient_start as usize,
            next: wide(self.next),
            next_row: self.next_row as usize,
            map_start: self.map_start as usize,
        }
    }
}

/// An index or count in 32 bits; [`NONE`] stays none.
pub(super) fn narrow(x: usize) -> u32 {
    debug_assert!(x == NONE || x < u32::MAX as usize, "more than four thousand million entries");
    x as u32
}

/// The index again.
#[inline(always)]
pub(super) fn wide(x: u32) -> usize {
    if x == u32::MAX { NONE } else { x as usize }
}
