//! Operations of a stage on one body between the solve of the stage before and its own forces, for one model or a lane of variants.
//!
//! Signs: forces are summed as they stand in M·q̈ + C·q̇ + r = 0, so the solve finds minus the increment.

// blocks of fixed size are indexed as the formulas are written, and no closure stands between a kernel and its instructions
#![allow(clippy::needless_range_loop)]

use super::tableau::{A, C, GAMMA, GAMMA_I, IN_PLACE};
use bimorph_multibody::batch::{LaneBlock, add_scaled, times};
use bimorph_multibody::planar::DOF;
use bimorph_multibody::planar::Vec3;
use bimorph_multibody::scalar::Real;

/// Displacement and rate of one body, or their change in a stage.
#[derive(Debug, Clone, Copy)]
pub(super) struct BodyState<T> {
    pub(super) q: Vec3<T>,
    pub(super) v: Vec3<T>,
}

/// Coefficients of a stage for one length of a step.
#[derive(Debug, Clone, Copy)]
pub(super) struct StageScale<T> {
    /// γh (s).
    pub(super) gh: T,
    /// γ_i·h (s).
    rate: T,
    /// c_ij/h (1/s).
    pub(super) c: [T; 5],
}

impl<T: Real> StageScale<T> {
    /// Of stage `I` in a step of length `h` (s).
    #[inline(always)]
    pub(super) fn of<const I: usize>(h: T) -> Self {
        let mut c = [h; 5];
        for (c, of) in c.iter_mut().zip(C[I]) {
            *c = h.splat_like(of) / h;
        }
        Self { gh: h * GAMMA, rate: h * GAMMA_I[I], c }
    }
}

/// Mass, drag and forcing of a body in a stage.
pub(super) struct BodyTerms<T, D> {
    /// Diagonal of the mass matrix.
    pub(super) mass: Vec3<T>,
    /// Force of drag at a rate.
    pub(super) drag: D,
    /// ∂r/∂t at the start of the step.
    pub(super) forcing: Vec3<T>,
}

/// Data of stage `I` for one body, before its forces.
pub(super) struct BodyStage<T> {
    /// Where the stage evaluates the forces.
    pub(super) place: BodyState<T>,
    /// r₁.
    pub(super) r1: Vec3<T>,
    /// Contribution of inertia, drag and forcing to the force.
    pub(super) force: Vec3<T>,
}

/// Stage `I` of a body from `start`, with the increments that `kept` returns of the stages before it.
#[inline(always)]
pub(super) fn body_stage<T: Real, const I: usize>(
    scale: &StageScale<T>,
    start: BodyState<T>,
    kept: impl Fn(usize) -> BodyState<T>,
    terms: BodyTerms<T, impl FnOnce(&Vec3<T>) -> Vec3<T>>,
) -> BodyStage<T> {
    let StageScale { gh, rate, c } = *scale;
    let mut place = start;
    for j in if I > IN_PLACE { IN_PLACE..I } else { 0..I } {
        let (u, a) = (kept(j), gh.splat_like(A[I][j]));
        add_scaled(&mut place.q, &u.q, a);
        add_scaled(&mut place.v, &u.v, a);
    }
    let mut lag = [gh.splat_like(0.0); DOF];
    for j in 0..I {
        add_scaled(&mut lag, &kept(j).q, c[j]);
    }
    let (mut r1, mut momentum) = (lag, lag);
    for k in 0..DOF {
        r1[k] = place.v[k] + lag[k];
        momentum[k] = r1[k] / gh;
    }
    for j in 0..I {
        add_scaled(&mut momentum, &kept(j).v, c[j]);
    }
    // damping at the argument's rate less that of r₁
    let BodyTerms { mass, drag, forcing } = terms;
    let drag = drag(&lag);
    let mut force = momentum;
    for k in 0..DOF {
        force[k] = forcing[k] * rate - drag[k] - mass[k] * momentum[k];
    }
    BodyStage { place, r1, force }
}

/// Increment of a stage whose solve left `solved`; `free` is the projector onto the directions that supports leave free.
#[inline(always)]
pub(super) fn increment<T: Real>(
    solved: &Vec3<T>,
    r1: &Vec3<T>,
    gh: T,
    free: Option<impl FnOnce() -> LaneBlock<T>>,
) -> BodyState<T> {
    let (mut q, mut v) = (*solved, *r1);
    for k in 0..DOF {
        q[k] = -solved[k];
        v[k] = q[k] / gh - r1[k];
    }
    match free {
        Some(free) => {
            let free = free();
            BodyState { q: times(&free, &q), v: times(&free, &v) }
        }
        None => BodyState { q, v },
    }
}
