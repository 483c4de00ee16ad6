//! One body's turn as the recursion reads it, and as the schedule keeps it: in 32-bit indices, since every reduction reads it
//! for every body.

use super::{NONE, Step};

/// What a body's turn needs besides its step; the meanings are those of [`Turn`].
#[derive(Debug, Clone, Copy)]
pub(in crate::multibody::rcr) struct Packed {
    pub(in crate::multibody::rcr) front: u32,
    pub(in crate::multibody::rcr) rows: u32,
    pub(in crate::multibody::rcr) parent: u32,
    pub(in crate::multibody::rcr) targets: u32,
    pub(in crate::multibody::rcr) row_start: u32,
    pub(in crate::multibody::rcr) next: u32,
    pub(in crate::multibody::rcr) next_row: u32,
    pub(in crate::multibody::rcr) map_start: u32,
}

/// One body's turn.
#[derive(Debug, Clone, Copy)]
pub(in crate::multibody::rcr) struct Turn {
    /// Coordinates of its joint.
    pub(in crate::multibody::rcr) freedom: usize,
    /// Bodies of its front: rows of its column in the pattern.
    pub(in crate::multibody::rcr) front: usize,
    /// Constraint rows that reach it.
    pub(in crate::multibody::rcr) rows: usize,
    /// Place of its parent in the front; none: ground or free.
    pub(in crate::multibody::rcr) parent: usize,
    /// A loop that was closed before couples it to its front.
    pub(in crate::multibody::rcr) coupled: bool,
    /// Start of its front among the schedule's fronts, nodes and blocks.
    pub(in crate::multibody::rcr) column: usize,
    /// Start of the couplings that its front's update changes.
    pub(in crate::multibody::rcr) targets: usize,
    /// First coordinate.
    pub(in crate::multibody::rcr) first: usize,
    /// Start of its rows in the row arena; each row has 3 + 3·front + 1 entries.
    pub(in crate::multibody::rcr) row_start: usize,
    /// Start of its coefficients in the coefficient arena: two of a pin, 3·front of any other coordinate that is alone,
    /// `freedom` rows of freedom + 3·front entries where [`Kind::Any`] takes them out.
    pub(in crate::multibody::rcr) coefficient_start: usize,
    /// Start of its row transformation in the transformation arena.
    pub(in crate::multibody::rcr) next: usize,
    /// Where the rows that are left go within the next body's rows.
    pub(in crate::multibody::rcr) next_row: usize,
    /// Start of the map from this front's bodies to places at the next body.
    pub(in crate::multibody::rcr) map_start: usize,
}

impl Packed {
    /// The turn of the body with this step.
    #[inline(always)]
    pub(in crate::multibody::rcr) fn unpack(&self, step: &Step) -> Turn {
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
pub(in crate::multibody::rcr) fn narrow(x: usize) -> u32 {
    debug_assert!(x == NONE || x < u32::MAX as usize, "more than four thousand million entries");
    x as u32
}

/// The index again.
#[inline(always)]
pub(in crate::multibody::rcr) fn wide(x: u32) -> usize {
    if x == u32::MAX { NONE } else { x as usize }
}
