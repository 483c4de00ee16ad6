//! What the recursion does at each body, laid out once: which bodies its front holds, how many constraint rows reach it,
//! where they go from there, and where everything lies in the arenas.
//!
//! Constraint rows enter at the body of their closure that is eliminated first. There and at every body they pass, each
//! joint coordinate takes one row with it (a dependent coordinate, in the words of the reduction), and the rest goes on to
//! the next body that it touches. A row that reaches no body any more is redundant by count.
//!
//! It is read at every reduction, so its indices are 32 bits wide (`turn`).

use super::tree::{Closure, Linkage, Parent};
use slots::Slots;
pub(super) use turn::Turn;
use turn::{Packed, narrow, wide};
mod slots;
mod turn;

use crate::multibody::BodyId;

/// No place.
pub(super) const NONE: usize = usize::MAX;
/// Pins that are looked for at a time.
const PIECE: usize = 256;

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
    /// Its last coordinate turns it.
    turns: bool,
    /// See [`Turn::coupled`].
    pub(super) coupled: bool,
    /// See [`Turn::freedom`].
    pub(super) freedom: u8,
    /// First coordinate.
    pub(super) first: u32,
    /// Its place among the joints that are no pins.
    pub(super) joint: u32,
    /// Where what is handed to it gathers.
    pub(super) node: u32,
    /// See [`Turn::column`].
    pub(super) column: u32,
    /// See [`Turn::coefficient_start`].
    pub(super) coefficient_start: u32,
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
        self.turns.then_some((self.first + u32::from(self.freedom)) as usize - 1)
    }
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
    turns: Vec<Packed>,
    pub(super) steps: Vec<Step>,
    /// Bodies of all fronts.
    pub(super) fronts: Vec<u32>,
    /// Where what is handed to them gathers: [`Step::node`] of each.
    pub(super) nodes: Vec<u32>,
    /// Where the couplings of a body to them gather.
    pub(super) blocks: Vec<u32>,
    /// Where the couplings gather that updates change, in the order of [`crate::multibody::Pattern::targets`].
    pub(super) targets: Vec<u32>,
    /// Nodes in use at one time.
    pub(super) node_count: usize,
    /// Couplings in use at one time.
    pub(super) block_count: usize,
    pub(super) entries: Vec<Entry>,
    /// Place of each front body at the body the rows go to: 0 itself, 1 + slot of its front.
    maps: Vec<u32>,
    pub(super) row_entries: usize,
    pub(super) coefficient_entries: usize,
    /// Rows that reach no body: more constraints than coordinates in some loop.
    pub(super) redundant: usize,
    /// Multiplications of one reduction.
    pub(super) multiplications: u64,
}

impl Schedule {
    pub(super) fn new(linkage: &Linkage) -> Self {
        Self::with_couplings(linkage, false)
    }

    /// The schedule where more than loops may couple a body to its front: every pair of the pattern, if `all`.
    pub(super) fn with_couplings(linkage: &Linkage, all: bool) -> Self {
        let pattern = &linkage.pattern;
        let count = linkage.links.len();
        let mut incoming = vec![0usize; count];
        let mut coupled = vec![all; pattern.off_blocks()];
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
            nodes: Vec::with_capacity(pattern.off_blocks()),
            blocks: Vec::with_capacity(pattern.off_blocks()),
            targets: Vec::new(),
            node_count: 0,
            block_count: 0,
            entries,
            maps: Vec::new(),
            row_entries: 0,
            coefficient_entries: 0,
            redundant: 0,
            multiplications: 0,
        };
        let (mut nodes, mut blocks) = (Slots::new(count), Slots::new(pattern.off_blocks()));
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
            let coupled = pattern.column(body).any(|k| coupled[k]);
            let mut turn = Packed {
                front: narrow(front),
                rows: narrow(rows),
                parent: narrow(parent),
                targets: narrow(schedule.targets.len()),
                row_start: narrow(schedule.row_entries),
                next: u32::MAX,
                next_row: 0,
                map_start: narrow(schedule.maps.len()),
            };
            schedule.row_entries += rows * (3 + 3 * front + 1);
            schedule.multiplications += multiplications(freedom, front, rows, parent != NONE);
            if left > 0 {
                match bodies.first() {
                    None => schedule.redundant += left,
                    Some(&next) => {
                        turn.next = narrow(next);
                        turn.next_row = narrow(incoming[next]);
                        incoming[next] += left;
                        support[next].extend(bodies.iter().skip(1));
                        for k in pattern.column(body) {
                            let b = pattern.row(k);
                            schedule.maps.push(match b.cmp(&next) {
                                std::cmp::Ordering::Equal => 0,
                                std::cmp::Ordering::Greater => narrow(1 + slot_of(pattern, next, b)),
                                // not touched by these rows: its entries are zero
                                std::cmp::Ordering::Less => u32::MAX,
                            });
                        }
                    }
                }
            }
            // what has gathered for this body is taken before it hands anything on
            let node = nodes.hold(body);
            nodes.release(body);
            let column = pattern.column(body);
            schedule.blocks.extend(column.clone().map(|k| blocks.hold(k)));
            column.clone().for_each(|k| blocks.release(k));
            schedule.fronts.extend(column.clone().map(|k| pattern.row(k) as u32));
            schedule.nodes.extend(column.clone().map(|k| nodes.hold(pattern.row(k))));
            schedule.targets.extend(pattern.targets(body).iter().map(|&k| blocks.hold(k as usize)));
            let kind = match (freedom, front, rows) {
                (1, 0, 0) | (1, 1, 0) if link.pin && !coupled && !all && (front == 0 || parent != NONE) => Kind::Pin,
                (1, 1, 0..=3) => Kind::One(rows as u8),
                (1, 2, 0..=3) => Kind::Two(rows as u8),
                _ => Kind::Any,
            };
            let step = Step {
                kind,
                pin: link.pin,
                gathers: false,
                hands_on: false,
                parent: match link.parent {
                    Parent::Body(p) => narrow(p),
                    Parent::Ground | Parent::Free => u32::MAX,
                },
                turns: link.moving[2],
                coupled,
                freedom: freedom as u8,
                first: narrow(link.first),
                joint,
                node,
                column: narrow(column.start),
                coefficient_start: narrow(schedule.coefficient_entries),
            };
            schedule.coefficient_entries += match kind {
                Kind::Pin => 2,
                Kind::One(_) | Kind::Two(_) => 3 * front,
                Kind::Any => freedom * (freedom + 3 * front),
            };
            joint += u32::from(!link.pin);
            schedule.steps.push(step);
            schedule.turns.push(turn);
        }
        (schedule.node_count, schedule.block_count) = (nodes.count(), blocks.count());
        schedule.mark_runs(pattern);
        schedule
    }

    /// One body's turn.
    #[inline(always)]
    pub(super) fn turn(&self, body: usize) -> Turn {
        self.turns[body].unpack(&self.steps[body])
    }

    /// The turns of all bodies.
    pub(super) fn turns(&self) -> impl Iterator<Item = Turn> {
        (0..self.steps.len()).map(|body| self.turn(body))
    }

    /// Place of a front body at the body its rows go to, by the index from [`Turn::map_start`] on; none: not there.
    #[inline(always)]
    pub(super) fn map(&self, index: usize) -> usize {
        wide(self.maps[index])
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

    /// Pins of one run from `first` on and before `end`, at most [`PIECE`]: what is read here is still near when their turn
    /// comes.
    #[inline(always)]
    pub(super) fn run(&self, first: usize, end: usize) -> std::ops::Range<usize> {
        let steps = &self.steps[first..end.min(first + PIECE)];
        first..first + steps.iter().position(|s| s.kind != Kind::Pin).unwrap_or(steps.len())
    }

    /// Pins of one run in `range` that end with it, at most [`PIECE`].
    #[inline(always)]
    pub(super) fn run_before(&self, range: std::ops::Range<usize>) -> std::ops::Range<usize> {
        let end = range.end;
        let start = end.saturating_sub(PIECE).max(range.start);
        let first = self.steps[start..end].iter().rposition(|s| s.kind != Kind::Pin);
        first.map_or(start, |k| start + k + 1)..end
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
