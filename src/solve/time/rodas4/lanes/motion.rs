//! The motion of variants side by side, and its measure.

use crate::multibody::lanes::{LaneModel, LanePose, Lanes, Real, zero};
use crate::multibody::planar::Pose;
use crate::solve::time::method::Motion;

/// Displacements and rates in each variant.
#[derive(Debug, Clone)]
pub struct LaneMotion<const N: usize> {
    /// Displacements.
    pub q: Vec<LanePose<N>>,
    /// Rates.
    pub v: Vec<LanePose<N>>,
}

impl<const N: usize> LaneMotion<N> {
    pub(super) fn zeros(bodies: usize) -> Self {
        Self { q: vec![zero(); bodies], v: vec![zero(); bodies] }
    }

    /// Puts a motion into one lane.
    pub fn put(&mut self, lane: usize, motion: &Motion) {
        for (to, from) in [(&mut self.q, &motion.q), (&mut self.v, &motion.v)] {
            for (to, from) in to.iter_mut().zip(from) {
                for i in 0..3 {
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
            for i in 0..3 {
                to[i].set_lane(lane, from[i].lane(lane));
            }
        }
    }
}

/// √(xᵀMx) of what the length of a step follows from, in each lane.
#[derive(Debug, Clone, Copy)]
pub struct Norms<const N: usize> {
    /// Displacements at the start of the step.
    pub before: [f64; N],
    /// Displacements at its end.
    pub after: [f64; N],
    /// Error of the displacements.
    pub error_q: [f64; N],
    /// Error of the rates.
    pub error_v: [f64; N],
}

impl<const N: usize> Default for Norms<N> {
    fn default() -> Self {
        Self { before: [0.0; N], after: [0.0; N], error_q: [0.0; N], error_v: [0.0; N] }
    }
}

/// √(xᵀMx).
#[inline(always)]
pub(super) fn mass_norm<const N: usize>(model: &LaneModel<N>, x: &[LanePose<N>]) -> [f64; N] {
    let mut sum = Lanes::ZERO;
    for (x, body) in x.iter().zip(&model.bodies) {
        let y: LanePose<N> = std::array::from_fn(|i| body.mass[i] * x[i]);
        sum += x[0] * y[0] + x[1] * y[1] + x[2] * y[2];
    }
    sum.sqrt().0
}
