//! Schedule of the recursion, computed once: the front of each body, the constraint rows that reach it and their next
//! bodies, and all arena offsets.
//!
//! Constraint rows enter at the body of their closure that is eliminated first. There and at every body they pass, each
//! joint coordinate takes one row with it (a dependent coordinate, in the words of the reduction), and the rest moves
//! to the next body that it touches. A row that reaches no body any more is redundant by count.
//!
//! It is read at every reduction, so its indices are 32 bits wide.

mod slots;
mod symbolic;

use super::fast::SmallFront;

/// No place.
pub(super) const NONE: usize = usize::MAX;

/// Which code a body's turn takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum EliminationKind {
    /// A pin to ground or to one parent, no loop.
    Pin,
    /// One coordinate, a small front and few rows: in closed form.
    Small(SmallFront),
    /// Anything else.
    Any,
}

/// Data that the passes over all bodies read first.
#[derive(Debug, Clone, Copy)]
pub(super) struct EliminationStep {
    pub kind: EliminationKind,
    /// A pin: its one coordinate turns it.
    pub pin: bool,
    /// Other bodies than the one before in a run of pins hand something to it.
    pub gathers: bool,
    /// Its parent is the body after it, and both are of a run of pins.
    pub hands_on: bool,
    /// Parent body; `u32::MAX`: ground or free.
    parent: u32,
    /// Its last coordinate turns it.
    turns: bool,
    /// See [`BodyElimination::coupled`].
    pub coupled: bool,
    /// See [`BodyElimination::freedom`].
    pub freedom: u8,
    /// First coordinate.
    pub first: u32,
    /// Its place among the joints that are no pins.
    pub joint: u32,
    /// Accumulator of its contributions.
    pub node: u32,
    /// See [`BodyElimination::column`].
    pub column: u32,
    /// See [`BodyElimination::coefficient_start`].
    pub coefficient_start: u32,
}

impl EliminationStep {
    /// Parent body; none: ground or free.
    #[inline(always)]
    pub(super) fn parent(&self) -> Option<usize> {
        (self.parent != u32::MAX).then_some(self.parent as usize)
    }

    /// The coordinate that turns it, if one does.
    #[inline(always)]
    pub(super) fn turning(&self) -> Option<usize> {
        self.turns.then(|| (self.first + u32::from(self.freedom)) as usize - 1)
    }
}

/// Where the rows of a closure enter.
#[derive(Debug, Clone, Copy)]
pub(super) struct ClosureEntry {
    /// The body.
    pub body: usize,
    /// First of its rows there.
    pub row: usize,
    /// Place of the other body in the front; none: ground.
    pub other: usize,
    /// Number of rows.
    pub count: usize,
    /// Bodies a and b of the joint; none: ground.
    pub ends: [Option<u32>; 2],
}

/// Request for a schedule.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plan {
    /// Every pair of the pattern may be coupled, not those alone that loops couple: stages of implicit methods.
    pub coupled: bool,
    /// With what is there for speed alone ([`super::fast`]).
    pub fast: bool,
}

/// The whole schedule.
#[derive(Debug, Clone)]
pub(super) struct Schedule {
    pub plan: Plan,
    turns: Vec<PackedElimination>,
    pub steps: Vec<EliminationStep>,
    /// Bodies of all fronts.
    pub fronts: Vec<u32>,
    /// Accumulators of their contributions: [`EliminationStep::node`] of each.
    pub nodes: Vec<u32>,
    /// Where the couplings of a body to them gather.
    pub blocks: Vec<u32>,
    /// Where the couplings gather that updates change, in the order of [`crate::Pattern::targets`].
    pub targets: Vec<u32>,
    /// Nodes in use at one time.
    pub node_count: usize,
    /// Couplings in use at one time.
    pub block_count: usize,
    pub entries: Vec<ClosureEntry>,
    /// Place of each front body at the body the rows go to: 0 itself, 1 + slot of its front.
    maps: Vec<u32>,
    pub row_entries: usize,
    pub coefficient_entries: usize,
    /// Rows that reach no body: more constraints than coordinates in some loop.
    pub redundant: usize,
    /// Multiplications of one reduction.
    pub multiplications: u64,
}

/// One body's turn.
#[derive(Debug, Clone, Copy)]
pub(super) struct BodyElimination {
    /// Coordinates of its joint.
    pub freedom: usize,
    /// Bodies of its front: rows of its column in the pattern.
    pub front: usize,
    /// Constraint rows that reach it.
    pub rows: usize,
    /// Place of its parent in the front; none: ground or free.
    pub parent: usize,
    /// A loop that was closed before couples it to its front.
    pub coupled: bool,
    /// Start of its front among the schedule's fronts, nodes and blocks.
    pub column: usize,
    /// Start of the couplings that its front's update changes.
    pub targets: usize,
    /// First coordinate.
    pub first: usize,
    /// Start of its rows in the row arena; each row has 3 + 3·front + 1 entries.
    pub row_start: usize,
    /// Start of its coefficients in the coefficient arena: two of a pin, 3·front of any other coordinate that is alone,
    /// `freedom` rows of freedom + 3·front entries where [`EliminationKind::Any`] takes them out.
    pub coefficient_start: usize,
    /// Start of its row transformation in the transformation arena.
    pub next: usize,
    /// Where the rows that are left go within the next body's rows.
    pub next_row: usize,
    /// Start of the map from this front's bodies to places at the next body.
    pub map_start: usize,
}

/// Data of a body's elimination besides its step; the meanings are those of [`BodyElimination`].
#[derive(Debug, Clone, Copy)]
struct PackedElimination {
    front: u32,
    rows: u32,
    parent: u32,
    targets: u32,
    row_start: u32,
    next: u32,
    next_row: u32,
    map_start: u32,
}

impl Schedule {
    /// One body's turn.
    #[inline(always)]
    pub(super) fn turn(&self, body: usize) -> BodyElimination {
        let (step, packed) = (&self.steps[body], &self.turns[body]);
        BodyElimination {
            freedom: step.freedom as usize,
            front: packed.front as usize,
            rows: packed.rows as usize,
            parent: wide(packed.parent),
            coupled: step.coupled,
            column: step.column as usize,
            targets: packed.targets as usize,
            first: step.first as usize,
            row_start: packed.row_start as usize,
            coefficient_start: step.coefficient_start as usize,
            next: wide(packed.next),
            next_row: packed.next_row as usize,
            map_start: packed.map_start as usize,
        }
    }

    /// The turns of all bodies.
    pub(super) fn turns(&self) -> impl Iterator<Item = BodyElimination> {
        (0..self.steps.len()).map(|body| self.turn(body))
    }

    /// Place of a front body at the body its rows go to, by the index from [`BodyElimination::map_start`] on; none: not there.
    #[inline(always)]
    pub(super) fn map(&self, index: usize) -> usize {
        wide(self.maps[index])
    }
}

/// The index again.
#[inline(always)]
fn wide(x: u32) -> usize {
    if x == u32::MAX { NONE } else { x as usize }
}
