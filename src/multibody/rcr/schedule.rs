//! What the recursion does at each body, laid out once: which bodies its front holds, how many constraint rows reach it,
//! where they go from there, and where everything lies in the arenas.
//!
//! Constraint rows enter at the body of their closure that is eliminated first. There and at every body they pass, each
//! joint coordinate takes one row with it (a dependent coordinate, in the words of the reduction), and the rest goes on to
//! the next body that it touches. A row that reaches no body any more is redundant by count.

use super::linkage::{Closure, Linkage, Parent};
use crate::multibody::BodyId;

/// No place.
pub(super) const NONE: usize = usize::MAX;

/// Which code a body's turn takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    /// A pin to ground or to one parent, no loop.
    Pin,
    /// One coordinate, a front of one body, this many rows.
    One(u8),
    /// One coordinate, a front of two bodies, this many rows.
    Two(u8),
    /// Anything else.
    Any,
}

/// What the passes over all bodies read first.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step {
    pub(super) kind: Kind,
    /// A pin: its one coordinate turns it.
    pub(super) pin: bool,
    /// Other bodies than the one before in a run of pins hand something to it.
    pub(super) gathers: bool,
    /// Its parent is the body after it, and both are of a run of pins.
    pub(super) hands_on: bool,
    /// Parent body; `u32::MAX`: ground or free.
    parent: u32,
    /// First coordinate.
    pub(super) first: u32,
    /// The coordinate that turns it; `u32::MAX`: none.
    turning: u32,
    /// Its place among the joints that are no pins.
    pub(super) joint: u32,
}

impl Step {
    /// Parent body; none: ground or free.
    #[inline(always)]
    pub(super) fn parent(&self) -> Option<usize> {
        (self.parent != u32::MAX).then_some(self.parent as usize)
    }

    /// The coordinate that turns it, if one does.
    #[inline(always)]
    pub(super) fn turning(&self) -> Option<usize> {
        (self.turning != u32::MAX).then_some(self.turning as usize)
    }
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
    /// Start of its front among the schedule's, and of its blocks among the couplings.
    pub(super) column: usize,
    /// Start of the couplings that its front's update changes.
    pub(super) targets: usize,
    /// First coordinate.
    pub(super) first: usize,
    /// Start of its rows in the row arena; each row has 3 + 3·front + 1 entries.
    pub(super) row_start: usize,
    /// Start of its coefficients in the coefficient arena; `freedom` rows of freedom + 3·front entries.
    pub(super) coefficient_start: usize,
    /// Start of its row transformation in the transformation arena.
    pub(super) next: usize,
    /// Where the rows that are left go within the next body's rows.
    pub(super) next_row: usize,
    /// Start of the map from this front's bodies to places at the next body.
    pub(super) map_start: usize,
}

/// Where the rows of a closure enter.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entry {
    /// The body.
    pub(super) body: usize,
    /// First of its rows there.
    pub(super) row: usize,
    /// Place of the other body in the front; none: ground.
    pub(super) other: usize,
    /// Number of rows.
    pub(super) count: usize,
    /// Bodies a and b of the joint; none: ground.
    pub(super) ends: [Option<u32>; 2],
}

/// The whole schedule.
#[derive(Debug, Clone)]
pub(super) struct Schedule {
    pub(super) turns: Vec<Turn>,
    pub(super) steps: Vec<Step>,
    /// Bodies of all fronts.
    pub(super) fronts: Vec<u32>,
    /// Couplings that updates change, see [`crate::multibody::Pattern::targets`].
    pub(super) targets: Vec<u32>,
    pub(super) entries: Vec<Entry>,
    /// Place of each front body at the body the rows go to: 0 itself, 1 + slot of its front.
    pub(super) maps: Vec<usize>,
    pub(super) row_entries: usize,
    pub(super) coefficient_entries: usize,
    /// Rows that reach no body: more constraints than coordinates in some loop.
    pub(super) redundant: usize,
    /// Multiplications of one reduction.
    pub(super) multiplications: u64,
}

impl Schedule {
    pub(super) fn new(linkage: &Linkage) -> Self {
        let pattern = &linkage.pattern;
        let count = linkage.links.len();
        let mut incoming = vec![0usize; count];
        let mut coupled = vec![false; pattern.off_blocks()];
        for body in 0..count {
            for &block in pattern.targets(body) {
                coupled[block as usize] = true;
            }
        }
        let mut support: Vec<Vec<usize>> = vec![Vec::new(); count];
        let mut entries = Vec::with_capacity(linkage.closures.len());
        for closure in &linkage.closures {
            let (body, other) = closure.bodies();
            let slot = other.map_or(NONE, |o| slot_of(pattern, body, o));
            let free = |id| if let BodyId::Free(k) = id { Some(k as u32) } else { None };
            let ends = match closure {
                Closure::Joint(joint) => [free(joint.a), free(joint.b)],
                Closure::Held { body, .. } => [Some(*body as u32), None],
            };
            entries.push(Entry { body, row: incoming[body], other: slot, count: closure.constraints(), ends });
            incoming[body] += closure.constraints();
            if closure.constraints() > 0 {
                support[body].extend(other);
            }
        }
        let mut schedule = Self {
            turns: Vec::with_capacity(count),
            steps: Vec::with_capacity(count),
            fronts: Vec::with_capacity(pattern.off_blocks()),
            targets: Vec::new(),
            entries,
            maps: Vec::new(),
            row_entries: 0,
            coefficient_entries: 0,
            redundant: 0,
            multiplications: 0,
        };
        let mut joint = 0;
        for body in 0..count {
            let link = &linkage.links[body];
            let freedom = link.freedom();
            let front = pattern.column(body).len();
            let rows = incoming[body];
            let left = rows.saturating_sub(freedom);
            let mut bodies = std::mem::take(&mut support[body]);
            let mut parent = NONE;
            if let Parent::Body(p) = link.parent {
                parent = slot_of(pattern, body, p);
                if rows > 0 {
                    bodies.push(p);
                }
            }
            bodies.sort_unstable();
            bodies.dedup();
            let mut turn = Turn {
                freedom,
                front,
                rows,
                parent,
                coupled: pattern.column(body).any(|k| coupled[k]),
                column: pattern.column(body).start,
                targets: schedule.targets.len(),
                first: link.first,
                row_start: schedule.row_entries,
                coefficient_start: schedule.coefficient_entries,
                next: NONE,
                next_row: 0,
                map_start: schedule.maps.len(),
            };
            schedule.row_entries += rows * (3 + 3 * front + 1);
            let local = freedom + 3 * front;
            schedule.coefficient_entries += freedom * local;
            schedule.multiplications += multiplications(freedom, front, rows, parent != NONE);
            if left > 0 {
                match bodies.first() {
                    None => schedule.redundant += left,
                    Some(&next) => {
                        turn.next = next;
                        turn.next_row = incoming[next];
                        incoming[next] += left;
                        support[next].extend(bodies.iter().skip(1));
                        for k in pattern.column(body) {
                            let b = pattern.row(k);
                            schedule.maps.push(match b.cmp(&next) {
                                std::cmp::Ordering::Equal => 0,
                                std::cmp::Ordering::Greater => 1 + slot_of(pattern, next, b),
                                // not touched by these rows: its entries are zero
                                std::cmp::Ordering::Less => NONE,
                            });
                        }
                    }
                }
            }
            schedule.fronts.extend(pattern.column(body).map(|k| pattern.row(k) as u32));
            schedule.targets.extend_from_slice(pattern.targets(body));
            let kind = match (freedom, front, rows) {
                (1, 0, 0) | (1, 1, 0) if link.pin && !turn.coupled && (front == 0 || parent != NONE) => Kind::Pin,
                (1, 1, 0..=3) => Kind::One(rows as u8),
                (1, 2, 0..=3) => Kind::Two(rows as u8),
                _ => Kind::Any,
            };
            let parent = match link.parent {
                Parent::Body(p) => p as u32,
                Parent::Ground | Parent::Free => u32::MAX,
            };
            let turning = if link.moving[2] { (link.first + freedom - 1) as u32 } else { u32::MAX };
            let step = Step {
                kind,
                pin: link.pin,
                gathers: false,
                hands_on: false,
                parent,
                first: link.first as u32,
                turning,
                joint,
            };
            joint += u32::from(!link.pin);
            schedule.steps.push(step);
            schedule.turns.push(turn);
        }
        schedule.mark_runs(pattern);
        schedule
    }
}

impl Schedule {
    /// Marks what goes from pin to pin within a run, and who receives anything else.
    fn mark_runs(&mut self, pattern: &crate::multibody::Pattern) {
        for body in 0..self.steps.len() {
            let pin = |k: usize| self.steps.get(k).is_some_and(|s| s.kind == Kind::Pin);
            let hands_on = self.steps[body].parent() == Some(body + 1) && pin(body) && pin(body + 1);
            self.steps[body].hands_on = hands_on;
            for k in pattern.column(body).filter(|_| !hands_on) {
                self.steps[pattern.row(k)].gathers = true;
            }
        }
    }

    /// The bodies after `first` and before `end` that are pins of its run, itself included.
    #[inline(always)]
    pub(super) fn run(&self, first: usize, end: usize) -> std::ops::Range<usize> {
        let steps = &self.steps[first..end];
        first..first + steps.iter().position(|s| s.kind != Kind::Pin).unwrap_or(steps.len())
    }
}

fn slot_of(pattern: &crate::multibody::Pattern, body: usize, other: usize) -> usize {
    pattern.column(body).position(|k| pattern.row(k) == other).unwrap_or(NONE)
}

/// Multiplications at one body, as the general front does them.
fn multiplications(freedom: usize, front: usize, rows: usize, hangs: bool) -> u64 {
    let local = freedom + 3 * front;
    let shift = if hangs { 12 + 9 * front } else { 0 };
    let assemble = 9 * freedom + 3 * freedom * freedom + 9 * freedom * front + shift + rows * (3 * freedom + 2);
    let dependent = freedom.min(rows);
    let mut eliminate = 0;
    for e in 0..freedom {
        let left = local - e - 1;
        eliminate += if e < dependent { left * (left + 3) + (rows - e) * (left + 1) } else { left * (left + 3) / 2 };
    }
    (assemble + eliminate + freedom * local) as u64
}
