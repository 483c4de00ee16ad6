//! Computes the schedule: one sweep over the bodies in elimination order.

use super::slots::Slots;
use super::{ClosureEntry, EliminationKind, EliminationStep, NONE, PackedElimination, Plan, Schedule};
use crate::joint_coordinates::TreeParent;
use crate::joint_coordinates::constrained_loops::fast::SmallFront;
use crate::joint_coordinates::constrained_loops::tree::{Closure, Linkage};
use crate::{BodyId, Pattern};

impl Schedule {
    /// The schedule of a linkage.
    pub(in crate::joint_coordinates::constrained_loops) fn new(linkage: &Linkage, plan: Plan) -> Self {
        let mut sweep = SymbolicSweep::new(linkage, plan);
        for body in 0..linkage.links.len() {
            sweep.lay(body);
        }
        let mut schedule = sweep.schedule;
        (schedule.node_count, schedule.block_count) = (sweep.nodes.count(), sweep.blocks.count());
        schedule.mark_runs(&linkage.pattern);
        schedule
    }

    /// Marks contributions passed from pin to pin within a run, and the receivers of all others.
    fn mark_runs(&mut self, pattern: &Pattern) {
        for body in 0..self.steps.len() {
            let pin = |k: usize| self.steps.get(k).is_some_and(|s| s.kind == EliminationKind::Pin);
            let hands_on = self.steps[body].parent() == Some(body + 1) && pin(body) && pin(body + 1);
            self.steps[body].hands_on = hands_on;
            for k in pattern.column(body).filter(|_| !hands_on) {
                self.steps[pattern.row(k)].gathers = true;
            }
        }
    }
}

/// The sweep on its way.
struct SymbolicSweep<'a> {
    linkage: &'a Linkage,
    /// Which blocks of the pattern couple.
    coupled: Vec<bool>,
    /// Rows that have come to each body.
    incoming: Vec<usize>,
    /// Bodies that the rows at each body touch beside it.
    support: Vec<Vec<usize>>,
    nodes: Slots,
    blocks: Slots,
    /// Joints other than pins so far.
    joint: u32,
    schedule: Schedule,
}

impl<'a> SymbolicSweep<'a> {
    /// Before the first body: closures stand at the bodies where their rows begin.
    fn new(linkage: &'a Linkage, plan: Plan) -> Self {
        let pattern = &linkage.pattern;
        let count = linkage.links.len();
        let mut incoming = vec![0usize; count];
        let mut coupled = vec![plan.coupled; pattern.off_blocks()];
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
            entries.push(ClosureEntry { body, row: incoming[body], other: slot, count: closure.constraints(), ends });
            incoming[body] += closure.constraints();
            if closure.constraints() > 0 {
                support[body].extend(other);
            }
        }
        let schedule = Schedule {
            plan,
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
        let (nodes, blocks) = (Slots::new(count), Slots::new(pattern.off_blocks()));
        Self { linkage, coupled, incoming, support, nodes, blocks, joint: 0, schedule }
    }

    /// The turn and the step of a body.
    fn lay(&mut self, body: usize) {
        let linkage = self.linkage;
        let (link, pattern) = (&linkage.links[body], &linkage.pattern);
        let (freedom, front, rows) = (link.freedom(), pattern.column(body).len(), self.incoming[body]);
        let (parent, bodies) = self.touched(body);
        let coupled = pattern.column(body).any(|k| self.coupled[k]);
        let schedule = &mut self.schedule;
        let mut turn = PackedElimination {
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
        let left = rows.saturating_sub(freedom);
        if left > 0 {
            match bodies.split_first() {
                None => schedule.redundant += left,
                Some((&next, others)) => {
                    (turn.next, turn.next_row) = (narrow(next), narrow(self.incoming[next]));
                    self.hand_on(body, left, next, others);
                }
            }
        }
        let node = self.place(body);
        let schedule = &mut self.schedule;
        let alone = rows == 0 && !coupled && !schedule.plan.coupled;
        let pin = link.pin && alone && (front == 0 || front == 1 && parent != NONE);
        let small = SmallFront::of(freedom, front, rows).filter(|_| schedule.plan.fast);
        let kind = if pin { EliminationKind::Pin } else { small.map_or(EliminationKind::Any, EliminationKind::Small) };
        schedule.steps.push(EliminationStep {
            kind,
            pin: link.pin,
            gathers: false,
            hands_on: false,
            parent: match link.parent {
                TreeParent::Body(p) => p,
                TreeParent::Ground | TreeParent::Free => u32::MAX,
            },
            turns: link.moving[2],
            coupled,
            freedom: freedom as u8,
            first: narrow(link.first),
            joint: self.joint,
            node,
            column: narrow(pattern.column(body).start),
            coefficient_start: narrow(schedule.coefficient_entries),
        });
        schedule.coefficient_entries += match kind {
            EliminationKind::Pin => 2,
            EliminationKind::Small(_) => 3 * front,
            EliminationKind::Any => freedom * (freedom + 3 * front),
        };
        self.joint += u32::from(!link.pin);
        schedule.turns.push(turn);
    }

    /// The parent's place in the front of a body, and the bodies that its rows touch, ascending.
    fn touched(&mut self, body: usize) -> (usize, Vec<usize>) {
        let mut bodies = std::mem::take(&mut self.support[body]);
        let mut parent = NONE;
        if let TreeParent::Body(p) = self.linkage.links[body].parent {
            let p = p as usize;
            parent = slot_of(&self.linkage.pattern, body, p);
            if self.incoming[body] > 0 {
                bodies.push(p);
            }
        }
        bodies.sort_unstable();
        bodies.dedup();
        (parent, bodies)
    }

    /// Gives the rows that are left at a body to the next one that they touch.
    fn hand_on(&mut self, body: usize, left: usize, next: usize, others: &[usize]) {
        let pattern = &self.linkage.pattern;
        self.incoming[next] += left;
        self.support[next].extend(others);
        for k in pattern.column(body) {
            let b = pattern.row(k);
            self.schedule.maps.push(match b.cmp(&next) {
                std::cmp::Ordering::Equal => 0,
                std::cmp::Ordering::Greater => narrow(1 + slot_of(pattern, next, b)),
                // not touched by these rows: its entries are zero
                std::cmp::Ordering::Less => u32::MAX,
            });
        }
    }

    /// Storage of a body and of the blocks of its column; what has gathered for it is taken before it hands anything on.
    fn place(&mut self, body: usize) -> u32 {
        let (pattern, schedule) = (&self.linkage.pattern, &mut self.schedule);
        let node = self.nodes.hold(body);
        self.nodes.release(body);
        let column = pattern.column(body);
        schedule.blocks.extend(column.clone().map(|k| self.blocks.hold(k)));
        column.clone().for_each(|k| self.blocks.release(k));
        schedule.fronts.extend(column.clone().map(|k| pattern.row(k) as u32));
        schedule.nodes.extend(column.map(|k| self.nodes.hold(pattern.row(k))));
        schedule.targets.extend(pattern.targets(body).iter().map(|&k| self.blocks.hold(k as usize)));
        node
    }
}

fn slot_of(pattern: &Pattern, body: usize, other: usize) -> usize {
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

/// An index or count in 32 bits; [`NONE`] stays none.
fn narrow(x: usize) -> u32 {
    debug_assert!(x == NONE || x < u32::MAX as usize, "more than four thousand million entries");
    x as u32
}
