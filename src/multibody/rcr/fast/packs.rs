//! Equal subtrees of one mechanism reduced side by side.
//!
//! Subtrees that are equal in structure ([`super::subtrees`]) are laid into packs of eight, one to a lane, and all packs into
//! one linkage over lanes, with the bodies that they share with the rest at its end. That linkage runs through the same
//! recursion as lanes of variants:
//!
//! - outward, the shared bodies' poses are copied into it, and its subtrees are placed;
//! - inward, its subtrees are reduced; what each of its bodies hands to a shared body is kept, and the recursion over the rest
//!   adds it when that body's turn would have been: every sum has its terms in the order of the elimination, so every bit is
//!   the one that the recursion without packs gives;
//! - outward, the shared bodies' accelerations are copied into it, and its own go back.
//!
//! Poses and rates stay in the lanes until someone asks for them. A pack that is not full repeats its last subtree.

use crate::multibody::rcr::closures::ClosureData;
use crate::multibody::rcr::kinematics::{Hanging, JointData, Placed};
use crate::multibody::rcr::reduction::{Reduction, Task};
use crate::multibody::rcr::tree::Linkage;
use crate::multibody::rcr::{Lanes, Real};
use pulp::{Arch, Simd, WithSimd};
use std::ops::Range;

/// Subtrees side by side.
pub(super) const WIDTH: usize = 8;
/// A number of each of them.
pub(super) type Wide = Lanes<WIDTH>;

/// A subtree's first body, coordinate, closure and joint (that is no pin), in the mechanism or among the packs.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct First {
    pub(super) body: usize,
    pub(super) coordinate: usize,
    pub(super) closure: usize,
    pub(super) joint: usize,
}

/// Eight equal subtrees.
#[derive(Debug, Clone)]
pub(super) struct Pack {
    /// Where they lie among the packs.
    pub(super) at: First,
    /// How many bodies, coordinates, closures and joints one of them has.
    pub(super) size: First,
    /// Where each lies in the mechanism.
    pub(super) of: [First; WIDTH],
}

/// A body of the packs whose front holds shared bodies, and where what it hands to them is kept.
#[derive(Debug, Clone)]
pub(super) struct Hand {
    pub(super) body: usize,
    /// Among [`Packs::nodes`].
    pub(super) nodes: Range<usize>,
    /// Among [`Packs::blocks`].
    pub(super) blocks: Range<usize>,
}

/// What the recursion over the rest does, in elimination order.
#[derive(Debug, Clone)]
pub(super) enum Item {
    /// Takes the turns of these bodies.
    Turns(Range<usize>),
    /// Adds what was kept for a body, the numbers of this range of [`Packs::order`].
    Node(usize, Range<usize>),
    /// Adds what was kept for a block of couplings.
    Block(usize, Range<usize>),
}

/// The packs of a mechanism with their recursion.
#[derive(Debug, Clone)]
pub(super) struct Packs {
    /// The first lane's subtrees, with the shared bodies as roots at the end.
    pub(super) linkage: Linkage,
    pub(super) lanes: Reduction<Wide>,
    pub(super) packs: Vec<Pack>,
    /// Bodies of all packs; the shared ones follow.
    pub(super) bodies: usize,
    /// Which bodies of the mechanism each shared body is, lane by lane.
    pub(super) shared: Vec<[u32; WIDTH]>,
    pub(super) hands: Vec<Hand>,
    /// The shared bodies that something is handed to.
    pub(super) nodes: Vec<usize>,
    /// The couplings between shared bodies that something is handed to.
    pub(super) blocks: Vec<usize>,
    pub(super) items: Vec<Item>,
    /// Which of what is kept is added, times the lanes, plus the lane.
    pub(super) order: Vec<u32>,
    /// Bodies of the mechanism that are in no pack.
    pub(super) rest: Vec<Range<usize>>,
    /// Closures of the mechanism that are in no pack.
    pub(super) rest_closures: Vec<Range<usize>>,
    /// Each body's place in the packs, times the lanes, plus the lane; `u32::MAX`: in none.
    pub(super) place: Vec<u32>,
    pub(super) q: Vec<Wide>,
    pub(super) v: Vec<Wide>,
    pub(super) out: Vec<Wide>,
    /// Inertia and wrench handed to shared bodies.
    pub(super) kept: Vec<[Wide; 9]>,
    /// Couplings handed to pairs of shared bodies.
    pub(super) kept_blocks: Vec<[Wide; 9]>,
}

/// Places the subtrees.
struct Place<'a>(&'a mut Packs);
/// Writes the rows of their closures, and finds the largest residual.
struct Rows<'a>(&'a mut Packs, Task);
/// Writes the rows and reduces.
struct Inward<'a>(&'a mut Packs, Task);
/// Finds the accelerations.
struct Outward<'a>(&'a mut Packs, Task);

impl WithSimd for Place<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Packs { linkage, lanes, bodies, q, v, .. } = self.0;
        lanes.place_bodies(linkage, 0..*bodies, q, v);
    }
}

impl WithSimd for Rows<'_> {
    type Output = f64;
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f64 {
        let lanes = &mut self.0.lanes;
        let all = 0..lanes.closures.len();
        lanes.rows_of(self.1, all).0.into_iter().fold(0.0, f64::max)
    }
}

impl WithSimd for Inward<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self(packs, task) = self;
        let Packs { lanes, bodies, hands, nodes, blocks, kept, kept_blocks, .. } = packs;
        let all = 0..lanes.closures.len();
        lanes.rows_of(task, all);
        lanes.nearness = Wide::ZERO;
        let mut from = 0;
        for k in 0..=hands.len() {
            let to = hands.get(k).map_or(*bodies, |h| h.body + 1);
            lanes.turns_inward(task, from..to);
            from = to;
            let Some(hand) = hands.get(k) else { break };
            for (kept, &node) in kept[hand.nodes.clone()].iter_mut().zip(&nodes[hand.nodes.clone()]) {
                let node = &mut lanes.nodes[lanes.schedule.steps[node].node as usize];
                let [a, b, c, d, e, f] = std::mem::replace(&mut node.inertia, [Wide::ZERO; 6]);
                let [x, y, w] = std::mem::replace(&mut node.momentum, [Wide::ZERO; 3]);
                *kept = [a, b, c, d, e, f, x, y, w];
            }
            for (kept, &block) in kept_blocks[hand.blocks.clone()].iter_mut().zip(&blocks[hand.blocks.clone()]) {
                *kept = std::mem::replace(&mut lanes.coupling[lanes.schedule.blocks[block] as usize], [Wide::ZERO; 9]);
            }
        }
    }
}

impl WithSimd for Outward<'_> {
    type Output = ();
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self(packs, task) = self;
        let Packs { linkage, lanes, bodies, out, .. } = packs;
        lanes.turns_outward(linkage, task, 0..*bodies, out);
    }
}

/// Copies `size` numbers of each lane, from where its subtree starts.
#[inline(always)]
fn gather<T: Real>(to: &mut [Wide], from: &[T], starts: [usize; WIDTH]) {
    for (lane, start) in starts.into_iter().enumerate() {
        for (to, from) in to.iter_mut().zip(&from[start..]) {
            to.0[lane] = from.lane(0);
        }
    }
}

/// Whether the processor has vector instructions. Without them eight lanes are eight times the work, and nothing is packed.
pub(super) fn vectors() -> bool {
    !matches!(Arch::new(), Arch::Scalar)
}

/// Runs `work` in the widest instructions. It is not compiled for a processor without any: that copy would be the largest, and
/// never run.
#[inline(always)]
fn wide<W: WithSimd<Output: Default>>(work: W) -> W::Output {
    match Arch::new() {
        #[cfg(target_arch = "x86_64")]
        Arch::V4(simd) => Simd::vectorize(simd, work),
        #[cfg(target_arch = "x86_64")]
        Arch::V3(simd) => Simd::vectorize(simd, work),
        #[cfg(target_arch = "aarch64")]
        Arch::Neon(simd) => Simd::vectorize(simd, work),
        _ => W::Output::default(),
    }
}

// compiled once, whoever calls
impl Packs {
    #[inline(never)]
    fn place_lanes(&mut self) {
        wide(Place(self));
    }

    #[inline(never)]
    fn inward_lanes(&mut self, task: Task) {
        wide(Inward(self, task));
    }

    #[inline(never)]
    fn outward_lanes(&mut self, task: Task) {
        wide(Outward(self, task));
    }

    /// Writes the rows of the subtrees' closures for `task`. Returns the largest residual.
    #[inline(never)]
    pub(super) fn rows(&mut self, task: Task) -> f64 {
        if self.lanes.closures.is_empty() { 0.0 } else { wide(Rows(self, task)) }
    }
}

impl Packs {
    /// Places the subtrees for coordinates `q` and rates `v` of the mechanism, whose other bodies are `placed`.
    #[inline(always)]
    pub(super) fn place<T: Real>(&mut self, placed: &[Placed<T>], q: &[T], v: &[T]) {
        for pack in &self.packs {
            let range = pack.at.coordinate..pack.at.coordinate + pack.size.coordinate;
            let starts = pack.of.map(|f| f.coordinate);
            gather(&mut self.q[range.clone()], q, starts);
            gather(&mut self.v[range], v, starts);
        }
        for (to, of) in self.lanes.placed[self.bodies..].iter_mut().zip(&self.shared) {
            for (lane, &body) in of.iter().enumerate() {
                to.set_lane(lane, &placed[body as usize]);
            }
        }
        self.place_lanes();
    }

    /// Reduces the subtrees, with `force` on the bodies and `torque` on the coordinates of the mechanism. Returns how near
    /// the worst of them is to a singular configuration.
    #[inline(always)]
    pub(super) fn inward<T: Real>(&mut self, task: Task, force: &[[T; 3]], torque: &[T]) -> f64 {
        if task == Task::Accelerations {
            for pack in &self.packs {
                let (at, size) = (pack.at, pack.size);
                for (lane, of) in pack.of.iter().enumerate() {
                    let to = &mut self.lanes.force[at.body..at.body + size.body];
                    for (to, from) in to.iter_mut().zip(&force[of.body..]) {
                        for (to, from) in to.iter_mut().zip(from) {
                            to.0[lane] = from.lane(0);
                        }
                    }
                }
                let to = &mut self.lanes.torque[at.coordinate..at.coordinate + size.coordinate];
                gather(to, torque, pack.of.map(|f| f.coordinate));
            }
        }
        self.inward_lanes(task);
        self.lanes.nearness.0.into_iter().fold(0.0, f64::max)
    }

    /// The sum of what was kept in `kept` and `sum`, one term after the other.
    #[inline(always)]
    fn sum<T: Real>(kept: &[[Wide; 9]], order: &[u32], mut sum: [T; 9]) -> [T; 9] {
        for &k in order {
            let (kept, lane) = (&kept[k as usize / WIDTH], k as usize % WIDTH);
            for (sum, x) in sum.iter_mut().zip(kept) {
                *sum += T::splat(x.0[lane]);
            }
        }
        sum
    }

    /// What a body's inertia and momentum become with the terms of `range`.
    #[inline(always)]
    pub(super) fn add_node<T: Real>(&self, range: Range<usize>, inertia: &mut [T; 6], momentum: &mut [T; 3]) {
        let ([a, b, c, d, e, f], [x, y, w]) = (*inertia, *momentum);
        let [a, b, c, d, e, f, x, y, w] = Self::sum(&self.kept, &self.order[range], [a, b, c, d, e, f, x, y, w]);
        (*inertia, *momentum) = ([a, b, c, d, e, f], [x, y, w]);
    }

    /// What a block of couplings becomes with the terms of `range`.
    #[inline(always)]
    pub(super) fn add_block<T: Real>(&self, range: Range<usize>, block: &mut [T; 9]) {
        *block = Self::sum(&self.kept_blocks, &self.order[range], *block);
    }

    /// Finds the accelerations of the subtrees' bodies and coordinates from those of the bodies that they share.
    #[inline(always)]
    pub(super) fn outward<T: Real>(&mut self, task: Task, accelerations: &mut [[T; 3]], out: &mut [T]) {
        for (to, of) in self.lanes.accelerations[self.bodies..].iter_mut().zip(&self.shared) {
            for (lane, &body) in of.iter().enumerate() {
                for (to, from) in to.iter_mut().zip(&accelerations[body as usize]) {
                    to.0[lane] = from.lane(0);
                }
            }
        }
        self.outward_lanes(task);
        for pack in &self.packs {
            let (at, size) = (pack.at, pack.size);
            for (lane, of) in pack.of.iter().enumerate() {
                let from = &self.out[at.coordinate..at.coordinate + size.coordinate];
                for (to, from) in out[of.coordinate..].iter_mut().zip(from) {
                    *to = T::splat(from.0[lane]);
                }
                let from = &self.lanes.accelerations[at.body..at.body + size.body];
                for (to, from) in accelerations[of.body..].iter_mut().zip(from) {
                    *to = from.map(|x| T::splat(x.0[lane]));
                }
            }
        }
    }

    /// Where a body is, if it is in a pack.
    pub(super) fn placed<T: Real>(&self, body: usize) -> Option<Placed<T>> {
        let (at, lane) = self.lane_of(body)?;
        Some(self.lanes.placed[at].one(lane))
    }

    /// Pose of a body, if it is in a pack.
    pub(super) fn pose<T: Real>(&self, body: usize) -> Option<[T; 3]> {
        let (at, lane) = self.lane_of(body)?;
        Some(self.lanes.placed[at].pose.map(|x| T::splat(x.0[lane])))
    }

    /// Rate of a body's pose, if it is in a pack.
    pub(super) fn rate<T: Real>(&self, body: usize) -> Option<[T; 3]> {
        let (at, lane) = self.lane_of(body)?;
        Some(self.lanes.placed[at].rate.map(|x| T::splat(x.0[lane])))
    }

    fn lane_of(&self, body: usize) -> Option<(usize, usize)> {
        let place = self.place[body];
        (place != u32::MAX).then_some((place as usize / WIDTH, place as usize % WIDTH))
    }

    /// Copies places, levers and joint axes of all subtrees back to the mechanism's.
    pub(super) fn spread<T: Real>(&self, placed: &mut [Placed<T>], hanging: &mut [Hanging<T>], axes: &mut [[T; 3]]) {
        for pack in &self.packs {
            let (at, size) = (pack.at, pack.size);
            for (lane, of) in pack.of.iter().enumerate() {
                for k in 0..size.body {
                    placed[of.body + k] = self.lanes.placed[at.body + k].one(lane);
                    hanging[of.body + k] = self.lanes.hanging[at.body + k].one(lane);
                }
                // a mechanism of pins alone has none
                let axed = if axes.is_empty() { 0 } else { size.coordinate };
                for k in 0..axed {
                    axes[of.coordinate + k] = self.lanes.axes[at.coordinate + k].map(|x| T::splat(x.0[lane]));
                }
            }
        }
    }

    /// Takes over the offsets of locked directions.
    pub(super) fn prescribe<T: Real>(&mut self, joints: &[JointData<T>], closures: &[ClosureData<T>]) {
        for pack in &self.packs {
            for (lane, of) in pack.of.iter().enumerate() {
                for k in 0..pack.size.joint {
                    self.lanes.joints[pack.at.joint + k].rest.0[lane] = joints[of.joint + k].rest.lane(0);
                }
                for k in 0..pack.size.closure {
                    self.lanes.closures[pack.at.closure + k].rest.0[lane] = closures[of.closure + k].rest.lane(0);
                }
            }
        }
    }
}
