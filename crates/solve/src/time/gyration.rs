//! Coriolis' force on a mechanism whose frame turns, and Euler's as far as it depends on the place.
//!
//! A body of mass m feels, on the side of the residual, 2mΩ·e×v and the place's share mΩ̇·e×q, with e×v = (−v_y, v_x).
//! Both are skew: they would make the step's symmetric matrix W unsymmetric, so they stay out of it. An implicit stage
//! needs the term
//! ```text
//! (W + G)·u = f,     G = (2mΩ/(γh) + mΩ̇)·e×
//! ```
//! is solved by a Neumann series u = Σ u_k, u_0 = W⁻¹f, u_{k+1} = −W⁻¹G·u_k. W holds the inertia m/(γh)², so the series falls by
//! 2|Ω|γh + |Ω̇|(γh)² a term, some 10⁻⁵ for a gyroscope at its own steps, and the sum is exact to rounding.

use super::method::StepFailure;
use bimorph_domains::inputs::FrameMotion;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{Body, Model};

/// Most terms of the series; a larger number requires shorter steps.
const MAX_TERMS: usize = 12;
/// Fraction of the solution at which the series ends (1).
const NEGLIGIBLE: f64 = 1e-16;

/// How the frame turns at an instant of a step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Gyration {
    /// Force per mass and rate, 2Ω (rad/s).
    pub rate: f64,
    /// Force per mass and displacement, Ω̇ (rad/s²).
    pub turning: f64,
}

impl Gyration {
    /// Of a frame's motion.
    pub fn new(frame: FrameMotion) -> Self {
        Self { rate: 2.0 * frame.rate, turning: frame.turning }
    }

    /// Whether it does nothing.
    pub fn is_still(&self) -> bool {
        self.rate == 0.0 && self.turning == 0.0
    }

    /// Its contribution to the matrix of a stage, per mass: `gh` is γh (s).
    fn of_stage(&self, gh: f64) -> f64 {
        self.rate / gh + self.turning
    }

    /// Terms that the series takes in a step.
    ///
    /// # Errors
    /// [`StepFailure::Diverged`] where a step is so long that the frame turns by a radian in it.
    pub fn terms(&self, gh: f64) -> Result<usize, StepFailure> {
        if self.is_still() {
            return Ok(0);
        }
        let ratio = self.rate.abs() * gh + self.turning.abs() * gh * gh;
        let terms = (NEGLIGIBLE.ln() / ratio.ln()).ceil();
        if ratio >= 0.5 || terms > MAX_TERMS as f64 {
            return Err(StepFailure::Diverged { iterations: MAX_TERMS, body: 0, direction: 0 });
        }
        Ok(terms.max(1.0) as usize)
    }

    /// Adds the other terms to the first, which `u` holds: `solve` is W⁻¹, in place; held directions are left out.
    pub fn complete(
        &self,
        model: &Model,
        gh: f64,
        terms: usize,
        scratch: &mut [Pose],
        u: &mut [Pose],
        mut solve: impl FnMut(&mut [Pose]),
    ) {
        if terms == 0 {
            return;
        }
        let factor = self.of_stage(gh);
        scratch.copy_from_slice(u);
        for _ in 0..terms {
            for (x, body) in scratch.iter_mut().zip(&model.bodies) {
                *x = held_out(body, -skew(body, factor, x));
            }
            solve(scratch);
            for (u, x) in u.iter_mut().zip(scratch.iter()) {
                *u += x;
            }
        }
    }
}

/// factor·m·e×v of a body.
#[inline]
pub fn skew(body: &Body, factor: f64, v: &Pose) -> Pose {
    let amount = factor * body.mass;
    Pose::new(-amount * v.y, amount * v.x, 0.0)
}

/// Without the directions that supports hold.
#[inline]
pub fn held_out(body: &Body, force: Pose) -> Pose {
    match &body.free {
        Some(free) => **free * force,
        None => force,
    }
}
