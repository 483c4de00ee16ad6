//! Motion of a batch of variants, and its norm.

use crate::time::method::Motion;
use bimorph_multibody::batch::{LANES, Lane8, LaneModel, LanePose, SimdReal, ZERO_POSE, load};
use bimorph_multibody::planar::{DOF, Pose};
use bimorph_multibody::scalar::StoredReal;

/// Displacements and rates in each variant.
#[derive(Debug, Clone)]
pub struct LaneMotion {
    /// Displacements.
    pub q: Vec<LanePose>,
    /// Rates.
    pub v: Vec<LanePose>,
}

impl LaneMotion {
    pub(super) fn zeros(bodies: usize) -> Self {
        Self { q: vec![ZERO_POSE; bodies], v: vec![ZERO_POSE; bodies] }
    }

    /// Puts a motion into one lane.
    pub fn set_lane(&mut self, lane: usize, motion: &Motion) {
        for (to, from) in [(&mut self.q, &motion.q), (&mut self.v, &motion.v)] {
            for (to, from) in to.iter_mut().zip(from) {
                for i in 0..DOF {
                    to[i].set_lane(lane, from[i]);
                }
            }
        }
    }

    /// The motion of one lane.
    pub fn take(&self, lane: usize, motion: &mut Motion) {
        for (from, to) in [(&self.q, &mut motion.q), (&self.v, &mut motion.v)] {
            for (from, to) in from.iter().zip(to) {
                *to = Pose::new(from[0].lane(lane), from[1].lane(lane), from[2].lane(lane));
            }
        }
    }

    /// Copies one lane of another motion.
    pub fn copy_lane(&mut self, lane: usize, other: &Self) {
        for (to, from) in self.q.iter_mut().zip(&other.q).chain(self.v.iter_mut().zip(&other.v)) {
            for i in 0..DOF {
                to[i].set_lane(lane, from[i].lane(lane));
            }
        }
    }
}

/// √(xᵀMx) of what the length of a step follows from, in each lane.
#[derive(Debug, Clone, Copy)]
pub struct Norms {
    /// Displacements at the start of the step.
    pub before: [f64; LANES],
    /// Displacements at its end.
    pub after: [f64; LANES],
    /// Error of the displacements.
    pub error_q: [f64; LANES],
    /// Error of the rates.
    pub error_v: [f64; LANES],
}

impl Default for Norms {
    fn default() -> Self {
        Self { before: [0.0; LANES], after: [0.0; LANES], error_q: [0.0; LANES], error_v: [0.0; LANES] }
    }
}

/// √(xᵀMx).
#[inline(always)]
pub(super) fn mass_norm<W: SimdReal>(simd: W::Simd, model: &LaneModel, x: &[LanePose]) -> [f64; LANES] {
    let mut sum = W::splat(simd, 0.0);
    for (x, body) in x.iter().zip(&model.bodies) {
        let (x, mass) = (load::<W, DOF>(simd, x), load::<W, DOF>(simd, &body.mass));
        sum += x[0] * (mass[0] * x[0]) + x[1] * (mass[1] * x[1]) + x[2] * (mass[2] * x[2]);
    }
    let mut square = Lane8::NONE;
    sum.store(&mut square);
    square.0.map(f64::sqrt)
}
