//! Batch of the lowest modes of variants of one mechanism, from the modes of one of them.
//!
//! Every variant begins with the same shapes, so that a lane has the same bits with any neighbours:
//!
//! 1. inverse iteration of all shapes with K, and the best modes in their span (Rayleigh–Ritz);
//! 2. for each mode wanted, inverse iteration with K − σM, σ a little below its λ, twice;
//! 3. λ and the residual in extended precision, as [`super::inverse_iteration`] has it. The residual is measured with K⁻¹, which
//!    is more than with (K + λM)⁻¹.
//!
//! The pivots of the last K − σM count the modes below σ (Sylvester): with exactly k of them below each σ, and a mode near it, no
//! mode is lost. Where a lane does not come to that (equal frequencies, a variant far from the first), it has no modes here, and those
//! of [`super::eigen`] stand.
//!
//! Reference: K.-J. Bathe, "Finite Element Procedures" (2014), §11.6; B. N. Parlett, "The symmetric eigenvalue problem" (1998), §4.

mod kernels;
mod ritz;
mod storage;
mod vectors;

pub use ritz::RitzMatrices;
pub use storage::LaneModes;
pub use vectors::{dot, weigh};

use super::eigen::Modes;
use bimorph_domains::System;
use bimorph_multibody::batch::{LANES, Lane8, LanePose, across};
use bimorph_multibody::planar::Pose;
use bimorph_multibody::scalar::StoredReal;
use kernels::{ModesKernel, ModesPass};
use storage::Which;

/// Inverse iterations of all shapes before the best modes in their span are taken.
const SPREAD: usize = 2;
/// How far below its λ a mode is iterated: as near as a pivot stays a number, and farther than rounding (1).
const SHIFT_OFFSET: f64 = 1e-4;
/// Inverse iterations of a mode, first with a σ that is about right, then with one that is.
const NEAR: [usize; 2] = [2, 3];
/// A mode with a larger residual has not settled here (1).
const SETTLED: f64 = 1e-9;

impl LaneModes {
    /// The `wanted` lowest modes about the drawn geometry of each of these variants that fit, [`LANES`] at most, with nothing that acts on
    /// them; those of the other shapes follow as they are. None for a variant whose modes have to be found alone.
    pub fn find(&mut self, systems: &[&System], wanted: usize) -> Vec<Option<Modes>> {
        let Some(&last) = systems.last() else { return Vec::new() };
        bimorph_base::budget::check();
        for lane in 0..LANES {
            let system = systems.get(lane).copied().unwrap_or(last);
            self.model.set_lane(lane, &system.model);
            let q = vec![Pose::zeros(); system.bodies()];
            self.precise.set_lane(lane, &system.model, &q, &system.electrics.drive().rest());
        }
        for (x, start) in self.x.iter_mut().zip(&self.start) {
            for (x, start) in x.iter_mut().zip(start) {
                *x = [Lane8::of(start.x), Lane8::of(start.y), Lane8::of(start.z)];
            }
        }
        let mut sound = self.spread();
        for k in 0..wanted.min(self.start.len()) {
            bimorph_base::budget::check();
            for (pass, iterations) in NEAR.into_iter().enumerate() {
                for (shift, lambda) in self.shift.0.iter_mut().zip(self.lambda[k].0) {
                    *shift = lambda * (1.0 - SHIFT_OFFSET);
                }
                self.factor(Which::Shifted);
                for (lane, sound) in sound.iter_mut().enumerate() {
                    let counted = pass == 0 || self.below.lane(lane) == k as f64;
                    *sound &= counted && !self.vanished[lane];
                }
                for _ in 0..iterations {
                    self.run(ModesPass::Invert(Which::Shifted, k));
                }
            }
            self.run(ModesPass::Measure(k));
        }
        (0..systems.len()).map(|lane| sound[lane].then(|| self.modes(lane, wanted)).flatten()).collect()
    }

    /// The best modes in the span of all shapes after some inverse iterations; answers the lanes that have them.
    fn spread(&mut self) -> [bool; LANES] {
        self.run(ModesPass::Stiffness);
        self.factor(Which::Plain);
        let sound = std::array::from_fn(|lane| !self.vanished[lane] && self.below.lane(lane) == 0.0);
        for k in 0..self.start.len() {
            for _ in 0..SPREAD {
                self.run(ModesPass::Invert(Which::Plain, k));
            }
        }
        self.run(ModesPass::Ritz);
        self.small.sort(&mut self.lambda);
        self.run(ModesPass::Combine);
        sound
    }

    /// Factors K, or K − σM.
    fn factor(&mut self, which: Which) {
        let (shift, matrix) = match which {
            Which::Plain => (Lane8::NONE, &mut self.plain),
            Which::Shifted => (self.shift, &mut self.shifted),
        };
        matrix.diagonal.copy_from_slice(&self.stiffness.diagonal);
        matrix.below.copy_from_slice(&self.stiffness.below);
        for (block, body) in matrix.diagonal.iter_mut().zip(&self.model.bodies) {
            for (i, (column, mass)) in block.iter_mut().zip(&body.mass).enumerate() {
                for ((entry, shift), mass) in column[i].0.iter_mut().zip(shift.0).zip(mass.0) {
                    *entry -= shift * mass;
                }
            }
        }
        self.run(ModesPass::Factor(which));
    }

    /// Result of a lane.
    fn modes(&self, lane: usize, wanted: usize) -> Option<Modes> {
        let of = |numbers: &[Lane8]| numbers.iter().map(|x| x.lane(lane)).collect::<Vec<f64>>();
        let lambda = of(&self.lambda);
        let residuals = of(&self.residual[..wanted.min(lambda.len())]);
        let settled = residuals.iter().all(|r| *r <= SETTLED);
        let ascending = lambda.windows(2).take(wanted).all(|pair| pair[0] < pair[1]);
        if !settled || !ascending || lambda.iter().any(|l| !l.is_finite()) {
            return None;
        }
        let pose = |p: &LanePose| Pose::new(p[0].lane(lane), p[1].lane(lane), p[2].lane(lane));
        let shapes = self.x.iter().map(|x| x.iter().map(pose).collect()).collect();
        // the error of the factor is less than the residual that its modes keep
        let rounding = residuals.iter().fold(0.0, |m: f64, r| m.max(*r));
        Some(Modes { lambda, shapes, residuals, missed: false, rounding })
    }

    fn run(&mut self, task: ModesPass) {
        across(ModesKernel(self, task));
    }
}
