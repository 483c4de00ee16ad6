//! The product of a tangent with a displacement in extended precision: [`crate::precise`] over lanes.

use super::{LANES, Lane8, LanePose, SimdReal, load, store};
use crate::Model;
use crate::forces::{RestStrain, factored};
use crate::planar::Pose;
use crate::planar::factored::{FactoredTangent, NUMBERS};
use crate::scalar::{Double, StoredReal};
use crate::section::{NONE, PairSlot};

/// A force on each body as a sum of two numbers.
pub type PrecisePose<T = Lane8> = [[T; 2]; 3];

/// ∂²U/∂q² of the joints of each variant, unsummed.
#[derive(Debug, Clone, Default)]
pub struct LanePrecise {
    joints: Vec<(PairSlot, [Lane8; NUMBERS])>,
}

impl LanePrecise {
    /// Puts the tangent of a model at `q` into one lane. All lanes must have the same joints, and none of them couplings.
    #[inline]
    pub fn set_lane(&mut self, lane: usize, model: &Model, q: &[Pose], rest: &RestStrain<'_>) {
        let joints = factored(model, q, rest);
        if self.joints.len() != joints.len() {
            self.joints = joints.iter().map(|(place, _)| (*place, [Lane8::NONE; NUMBERS])).collect();
        }
        debug_assert!(lane < LANES && model.couplings.is_empty());
        for ((_, to), (_, tangent)) in self.joints.iter_mut().zip(&joints) {
            for (to, from) in to.iter_mut().zip(tangent.0) {
                to.set_lane(lane, from);
            }
        }
    }

    /// `y += K·x`.
    #[inline(always)]
    pub fn multiply_add<W: SimdReal>(&self, simd: W::Simd, x: &[LanePose], y: &mut [PrecisePose]) {
        let none = W::splat(simd, 0.0);
        for (place, numbers) in &self.joints {
            let at = |body: u32| if body == NONE { [none; 3] } else { load(simd, &x[body as usize]) };
            let (a, b) = (at(place.a), at(place.b));
            let dx = Double::from(b[0]) - Double::from(a[0]);
            let dy = Double::from(b[1]) - Double::from(a[1]);
            let tangent = FactoredTangent(load::<W, NUMBERS>(simd, numbers));
            let pair = tangent.times([dx, dy], Double::from(a[2]), Double::from(b[2]));
            let [fx, fy] = pair.force;
            for (body, force) in [(place.a, [-fx, -fy, pair.moment_a]), (place.b, [fx, fy, pair.moment_b])] {
                if body != NONE {
                    for (to, force) in y[body as usize].iter_mut().zip(force) {
                        let [high, low] = load::<W, 2>(simd, to);
                        let sum = Double { high, low } + force;
                        store([sum.high, sum.low], to);
                    }
                }
            }
        }
    }
}
