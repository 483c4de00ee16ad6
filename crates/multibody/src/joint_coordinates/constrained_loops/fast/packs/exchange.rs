//! Exchange of contributions between packs and the rest of the mechanism.

use super::{PackedReal, Packs, WIDTH};
use crate::joint_coordinates::constrained_loops::data::{FrontAccumulator, Offsets};
use crate::joint_coordinates::constrained_loops::poses::{BodyKinematics, MechanismKinematics};
use std::ops::Range;

/// Copies the numbers of each lane, from where its subtree starts.
#[inline(always)]
fn gather(to: &mut [PackedReal], from: &[f64], starts: [usize; WIDTH]) {
    for (lane, start) in starts.into_iter().enumerate() {
        for (to, from) in to.iter_mut().zip(&from[start..]) {
            to.0[lane] = *from;
        }
    }
}

impl Packs {
    /// Takes coordinates `q` and rates `v` of the mechanism over, and where the shared bodies are.
    #[inline(always)]
    pub(super) fn take_motion(&mut self, placed: &[BodyKinematics<f64>], q: &[f64], v: &[f64]) {
        let Self { packing, lanes, .. } = self;
        for pack in &packing.packs {
            let range = pack.at.coordinate..pack.at.coordinate + pack.size.coordinate;
            let starts = pack.of.map(|f| f.coordinate);
            gather(&mut self.q[range.clone()], q, starts);
            gather(&mut self.v[range], v, starts);
        }
        for (to, of) in lanes.placement.placed[packing.bodies..].iter_mut().zip(&packing.shared) {
            for (lane, &body) in of.iter().enumerate() {
                to.set_lane(lane, &placed[body as usize]);
            }
        }
    }

    /// Takes the wrenches on the bodies and the forces on the coordinates of the mechanism over.
    #[inline(always)]
    pub(super) fn take_loads(&mut self, force: &[[f64; 3]], torque: &[f64]) {
        for pack in &self.packing.packs {
            let (at, size) = (pack.at, pack.size);
            for (lane, of) in pack.of.iter().enumerate() {
                let to = &mut self.lanes.force[at.body..at.body + size.body];
                for (to, from) in to.iter_mut().zip(&force[of.body..]) {
                    for (to, from) in to.iter_mut().zip(from) {
                        to.0[lane] = *from;
                    }
                }
            }
            let to = &mut self.lanes.torque[at.coordinate..at.coordinate + size.coordinate];
            gather(to, torque, pack.of.map(|f| f.coordinate));
        }
    }

    /// Takes the offsets of locked directions over.
    pub(super) fn take_offsets(&mut self, offsets: &Offsets<f64>) {
        let lanes = &mut self.lanes.offsets;
        for pack in &self.packing.packs {
            let (joint, closure) = (pack.at.joint, pack.at.closure);
            gather(&mut lanes.joints[joint..joint + pack.size.joint], &offsets.joints, pack.of.map(|f| f.joint));
            let to = &mut lanes.closures[closure..closure + pack.size.closure];
            gather(to, &offsets.closures, pack.of.map(|f| f.closure));
        }
    }

    /// How near the worst of the subtrees is to a singular configuration.
    #[inline(always)]
    pub(super) fn nearness(&self) -> f64 {
        self.lanes.work.nearness.0.into_iter().fold(0.0, f64::max)
    }

    /// The sum of what was kept in `kept` and `sum`, one term after the other.
    #[inline(always)]
    fn sum(kept: &[[PackedReal; 9]], order: &[u32], mut sum: [f64; 9]) -> [f64; 9] {
        for &k in order {
            let (kept, lane) = (&kept[k as usize / WIDTH], k as usize % WIDTH);
            for (sum, x) in sum.iter_mut().zip(kept) {
                *sum += x.0[lane];
            }
        }
        sum
    }

    /// Adds the terms of `range` to what gathers at a body.
    #[inline(always)]
    pub(super) fn add_node(&self, range: Range<usize>, node: &mut FrontAccumulator<f64>) {
        let ([a, b, c, d, e, f], [x, y, w]) = (node.inertia, node.momentum);
        let order = &self.packing.order[range];
        let [a, b, c, d, e, f, x, y, w] = Self::sum(&self.kept, order, [a, b, c, d, e, f, x, y, w]);
        *node = FrontAccumulator { inertia: [a, b, c, d, e, f], momentum: [x, y, w] };
    }

    /// Adds the terms of `range` to a block of couplings.
    #[inline(always)]
    pub(super) fn add_block(&self, range: Range<usize>, block: &mut [f64; 9]) {
        *block = Self::sum(&self.kept_blocks, &self.packing.order[range], *block);
    }

    /// Takes the accelerations of the shared bodies over.
    #[inline(always)]
    pub(super) fn take_accelerations(&mut self, accelerations: &[[f64; 3]]) {
        let Self { packing, lanes, .. } = self;
        for (to, of) in lanes.accelerations[packing.bodies..].iter_mut().zip(&packing.shared) {
            for (lane, &body) in of.iter().enumerate() {
                for (to, from) in to.iter_mut().zip(&accelerations[body as usize]) {
                    to.0[lane] = *from;
                }
            }
        }
    }

    /// Gives the accelerations of the subtrees' bodies and coordinates to the mechanism.
    #[inline(always)]
    pub(super) fn give_accelerations(&self, accelerations: &mut [[f64; 3]], out: &mut [f64]) {
        for pack in &self.packing.packs {
            let (at, size) = (pack.at, pack.size);
            for (lane, of) in pack.of.iter().enumerate() {
                let from = &self.out[at.coordinate..at.coordinate + size.coordinate];
                for (to, from) in out[of.coordinate..].iter_mut().zip(from) {
                    *to = from.0[lane];
                }
                let from = &self.lanes.accelerations[at.body..at.body + size.body];
                for (to, from) in accelerations[of.body..].iter_mut().zip(from) {
                    *to = from.map(|x| x.0[lane]);
                }
            }
        }
    }

    /// Gives places, levers and joint axes of all subtrees to the mechanism.
    pub(super) fn give_placement(&self, to: &mut MechanismKinematics<f64>) {
        let from = &self.lanes.placement;
        for pack in &self.packing.packs {
            let (at, size) = (pack.at, pack.size);
            for (lane, of) in pack.of.iter().enumerate() {
                for k in 0..size.body {
                    to.placed[of.body + k] = from.placed[at.body + k].lane(lane);
                    to.hanging[of.body + k] = from.hanging[at.body + k].lane(lane);
                }
                // a mechanism of pins alone has none
                let axed = if to.axes.is_empty() { 0 } else { size.coordinate };
                for k in 0..axed {
                    to.axes[of.coordinate + k] = from.axes[at.coordinate + k].map(|x| x.0[lane]);
                }
            }
        }
    }

    /// Place and lane of a body, if it is in a pack.
    pub(super) fn lane_of(&self, body: usize) -> Option<(usize, usize)> {
        let place = self.packing.place[body];
        (place != u32::MAX).then_some((place as usize / WIDTH, place as usize % WIDTH))
    }
}
