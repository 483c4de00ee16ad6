//! Equal subtrees of one mechanism, reduced together with one subtree per lane.
//!
//! Structurally equal subtrees (`subtrees`) are placed into packs of eight (`packing`), one to a lane. All packs form
//! one linkage over lanes, with the bodies that they share with the rest at its end. That linkage runs through the same
//! recursion as lanes of variants:
//!
//! - outward, the shared bodies' poses are copied into it, and its subtrees are placed;
//! - inward, its subtrees are reduced. The contribution of each body to a shared body is stored, and the recursion over
//!   the rest adds it at the position of that body's elimination. Every sum thus has its terms in elimination order,
//!   and all results are bit-identical to the recursion without packs;
//! - outward, the shared bodies' accelerations are copied into it, and its own go back.
//!
//! Poses and rates stay in the lanes until they are requested. A pack that is not full repeats its last subtree.

mod exchange;
mod packing;
mod subtrees;

use super::dispatch::{self, across};
use crate::joint_coordinates::constrained_loops::data::{Offsets, ReductionTask};
use crate::joint_coordinates::constrained_loops::poses::{BodyKinematics, MechanismKinematics};
use crate::joint_coordinates::constrained_loops::reduction::{Reduction, Traversal, Traversed};
use crate::joint_coordinates::constrained_loops::tree::Linkage;
use crate::scalar::Lanes;
use crate::scalar::StoredReal;
use pulp::{Simd, WithSimd};
use std::ops::Range;
use std::slice::from_ref;
use std::sync::Arc;

/// Number of subtrees in a pack.
const WIDTH: usize = 8;
/// A number of each of them.
type PackedReal = Lanes<WIDTH>;

/// A subtree's first body, coordinate, closure and joint (that is no pin), in the mechanism or among the packs.
#[derive(Debug, Clone, Copy, Default)]
struct FirstOfSubtree {
    body: usize,
    coordinate: usize,
    closure: usize,
    joint: usize,
}

/// Eight equal subtrees.
#[derive(Debug)]
struct SubtreePack {
    /// Where they lie among the packs.
    at: FirstOfSubtree,
    /// How many bodies, coordinates, closures and joints one of them has.
    size: FirstOfSubtree,
    /// Where each lies in the mechanism.
    of: [FirstOfSubtree; WIDTH],
}

/// A body of the packs whose front holds shared bodies, and where what it hands to them is kept.
#[derive(Debug)]
struct PackContribution {
    body: usize,
    /// Among [`Packing::nodes`].
    nodes: Range<usize>,
    /// Among [`Packing::blocks`].
    blocks: Range<usize>,
}

/// Steps of the recursion over the remaining bodies, in elimination order.
#[derive(Debug)]
enum RemainingStep {
    /// Takes the turns of these bodies.
    Turns(Range<usize>),
    /// Adds what was kept for a body, the numbers of this range of [`Packing::order`].
    Node(usize, Range<usize>),
    /// Adds what was kept for a block of couplings.
    Block(usize, Range<usize>),
}

/// How the equal subtrees of a mechanism lie in packs. Immutable.
#[derive(Debug)]
struct Packing {
    packs: Vec<SubtreePack>,
    /// Bodies of all packs; the shared ones follow.
    bodies: usize,
    /// Which bodies of the mechanism each shared body is, lane by lane.
    shared: Vec<[u32; WIDTH]>,
    hands: Vec<PackContribution>,
    /// The shared bodies that receive a contribution.
    nodes: Vec<usize>,
    /// Their pairs, as blocks of the packs' pattern.
    blocks: Vec<usize>,
    items: Vec<RemainingStep>,
    /// Which of what is kept is added, times the lanes, plus the lane.
    order: Vec<u32>,
    /// Bodies of the mechanism that are in no pack.
    rest: Vec<Range<usize>>,
    /// Closures of the mechanism that are in no pack.
    rest_closures: Vec<Range<usize>>,
    /// Each body's place in the packs, times the lanes, plus the lane; `u32::MAX`: in none.
    place: Vec<u32>,
}

/// The packs of a mechanism with their recursion.
#[derive(Debug, Clone)]
pub struct Packs {
    packing: Arc<Packing>,
    /// The subtrees, with the shared bodies as roots at the end.
    lanes: Reduction<PackedReal>,
    q: Vec<PackedReal>,
    v: Vec<PackedReal>,
    out: Vec<PackedReal>,
    /// Inertia and wrench handed to shared bodies.
    kept: Vec<[PackedReal; 9]>,
    /// Couplings handed to pairs of shared bodies.
    kept_blocks: Vec<[PackedReal; 9]>,
}

/// Only plain numbers pack equal subtrees into lanes.
impl Traversed for f64 {
    type Traversal = Packs;

    fn place(reduction: &mut Reduction<f64>, q: &[f64], v: &[f64]) {
        dispatch::place(reduction, q, v);
    }

    fn reduce(reduction: &mut Reduction<f64>, task: ReductionTask, out: &mut [f64]) {
        dispatch::reduce(reduction, task, out);
    }
}

impl Traversal<f64> for Packs {
    fn new(linkage: &Linkage, reduction: &Reduction<f64>) -> Option<Box<Self>> {
        Self::lay(linkage, &reduction.mechanism.schedule).map(Box::new)
    }

    #[inline(always)]
    fn place(reduction: &mut Reduction<f64>, q: &[f64], v: &[f64]) {
        let Reduction { mechanism, offsets, placement, traversal, .. } = reduction;
        let all = 0..mechanism.bodies();
        for range in traversal.as_ref().map_or(from_ref(&all), |t| &t.packing.rest).iter().rev() {
            placement.place(mechanism, &offsets.joints, q, v, range.clone());
        }
        if let Some(packs) = traversal {
            packs.take_motion(&placement.placed, q, v);
            packs.place_lanes();
        }
    }

    #[inline(always)]
    fn rows(reduction: &mut Reduction<f64>, task: ReductionTask) -> f64 {
        let mut traversal = reduction.traversal.take();
        let mut largest = traversal.as_mut().map_or(0.0, |packs| packs.rows_of_lanes(task));
        let (given, work, _) = reduction.parts(task);
        let all = 0..given.mechanism.closures.len();
        for range in traversal.as_ref().map_or(from_ref(&all), |t| &t.packing.rest_closures) {
            largest = largest.max(work.write_rows(given, range.clone()));
        }
        reduction.traversal = traversal;
        largest
    }

    #[inline(always)]
    fn reduce(reduction: &mut Reduction<f64>, task: ReductionTask, out: &mut [f64]) {
        let mut traversal = reduction.traversal.take();
        let (given, work, accelerations) = reduction.parts(task);
        let schedule = &given.mechanism.schedule;
        let (bodies, closures) = (0..given.mechanism.bodies(), 0..given.mechanism.closures.len());
        let all = RemainingStep::Turns(bodies.clone());
        work.nearness = 0.0;
        if let Some(packs) = &mut traversal {
            if task == ReductionTask::Accelerations {
                packs.take_loads(given.force, given.torque);
            }
            packs.lanes_inward(task);
            work.nearness = packs.nearness();
        }
        for range in traversal.as_ref().map_or(from_ref(&closures), |t| &t.packing.rest_closures) {
            work.write_rows(given, range.clone());
        }
        for item in traversal.as_ref().map_or(from_ref(&all), |t| &t.packing.items) {
            match (item, &traversal) {
                (RemainingStep::Turns(range), _) => work.inward(given, range.clone()),
                (RemainingStep::Node(to, terms), Some(packs)) => {
                    packs.add_node(terms.clone(), &mut work.nodes[schedule.steps[*to].node as usize]);
                }
                (RemainingStep::Block(to, terms), Some(packs)) => {
                    packs.add_block(terms.clone(), &mut work.coupling[schedule.blocks[*to] as usize]);
                }
                (_, None) => {}
            }
        }
        for range in traversal.as_ref().map_or(from_ref(&bodies), |t| &t.packing.rest).iter().rev() {
            work.outward(given, range.clone(), accelerations, out);
        }
        if let Some(packs) = &mut traversal {
            packs.take_accelerations(accelerations);
            packs.lanes_outward(task);
            packs.give_accelerations(accelerations, out);
        }
        reduction.traversal = traversal;
        reduction.nearness = reduction.work.nearness;
    }

    fn placed(&self, body: usize) -> Option<BodyKinematics<f64>> {
        let (at, lane) = self.lane_of(body)?;
        Some(self.lanes.placement.placed[at].lane(lane))
    }

    fn spread(&self, placement: &mut MechanismKinematics<f64>) {
        self.give_placement(placement);
    }

    fn prescribe(&mut self, offsets: &Offsets<f64>) {
        self.take_offsets(offsets);
    }

    fn packed_bodies(&self) -> usize {
        self.packing.place.len() - self.packing.rest.iter().map(Range::len).sum::<usize>()
    }
}

/// Places the subtrees.
struct PlacePacks<'a>(&'a mut Packs);
/// Writes the rows of their closures, and finds the largest residual.
struct WritePackRows<'a>(&'a mut Packs, ReductionTask);
/// Writes the rows and reduces.
struct ReducePacks<'a>(&'a mut Packs, ReductionTask);
/// Finds the accelerations.
struct SolvePacks<'a>(&'a mut Packs, ReductionTask);

impl WithSimd for PlacePacks<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Packs { packing, lanes, q, v, .. } = self.0;
        let Reduction { mechanism, offsets, placement, .. } = lanes;
        placement.place(mechanism, &offsets.joints, q, v, 0..packing.bodies);
    }
}

impl WithSimd for WritePackRows<'_> {
    type Output = f64;
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f64 {
        let (given, work, _) = self.0.lanes.parts(self.1);
        work.write_rows(given, 0..given.mechanism.closures.len()).0.into_iter().fold(0.0, f64::max)
    }
}

impl WithSimd for ReducePacks<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self(Packs { packing, lanes, kept, kept_blocks, .. }, task) = self;
        let Packing { bodies, hands, nodes, blocks, .. } = &**packing;
        let (given, work, _) = lanes.parts(task);
        let schedule = &given.mechanism.schedule;
        work.write_rows(given, 0..given.mechanism.closures.len());
        work.nearness = PackedReal::ZERO;
        let mut from = 0;
        for k in 0..=hands.len() {
            let to = hands.get(k).map_or(*bodies, |h| h.body + 1);
            work.inward(given, from..to);
            from = to;
            let Some(hand) = hands.get(k) else { break };
            for (kept, &node) in kept[hand.nodes.clone()].iter_mut().zip(&nodes[hand.nodes.clone()]) {
                let node = &mut work.nodes[schedule.steps[node].node as usize];
                let [a, b, c, d, e, f] = std::mem::replace(&mut node.inertia, [PackedReal::ZERO; 6]);
                let [x, y, w] = std::mem::replace(&mut node.momentum, [PackedReal::ZERO; 3]);
                *kept = [a, b, c, d, e, f, x, y, w];
            }
            for (kept, &block) in kept_blocks[hand.blocks.clone()].iter_mut().zip(&blocks[hand.blocks.clone()]) {
                *kept = std::mem::replace(&mut work.coupling[schedule.blocks[block] as usize], [PackedReal::ZERO; 9]);
            }
        }
    }
}

impl WithSimd for SolvePacks<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self(Packs { packing, lanes, out, .. }, task) = self;
        let (given, work, accelerations) = lanes.parts(task);
        work.outward(given, 0..packing.bodies, accelerations, out);
    }
}

// compiled once for all callers
impl Packs {
    #[inline(never)]
    fn place_lanes(&mut self) {
        across(PlacePacks(self));
    }

    #[inline(never)]
    fn lanes_inward(&mut self, task: ReductionTask) {
        across(ReducePacks(self, task));
    }

    #[inline(never)]
    fn lanes_outward(&mut self, task: ReductionTask) {
        across(SolvePacks(self, task));
    }

    /// Writes the rows of the subtrees' closures for `task`. Returns the largest residual.
    #[inline(never)]
    fn rows_of_lanes(&mut self, task: ReductionTask) -> f64 {
        if self.lanes.mechanism.closures.is_empty() { 0.0 } else { across(WritePackRows(self, task)) }
    }
}
