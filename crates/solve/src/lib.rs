//! Solvers: they advance or balance a system.
//!
//! | folder | what it holds |
//! |---|---|
//! | [`equilibrium`] | static equilibrium along a path of loads: Newton, load stepping, folds and jumps |
//! | [`continuation`] | equilibrium paths by arc length: folds, bifurcations, branches |
//! | [`frequency`] | natural frequencies, and the response at one frequency |
//! | [`time`] | motion: integrators, their drivers, and events |
//! | [`reduced`] | reduced models in joint coordinates |
//! | [`baseline`] | other solvers and models, to compare with |
//!
//! **Architecture invariant.** Below are [`bimorph_domains`] and [`bimorph_multibody`]. Solvers read no options of the
//! command and no text, and they choose no mesh. Within the crate [`equations`] stands below the methods.

pub mod baseline;
pub mod continuation;
pub mod equations;
pub mod equilibrium;
pub mod frequency;
pub mod reduced;
pub mod time;

// the same modules by the names that they had before there were folders
pub use continuation::family;
pub use equilibrium::path;
pub use frequency::{eigen, fastest, harmonic, subspace};
pub use time::interpolation as dense;
pub use time::{
    adaptive, alpha, average_field, dirk, dormand_prince, doubling, event, explicit, joint_motion, method, radau5,
    rodas4,
};

use bimorph_multibody::factor::ZeroPivot;
use thiserror::Error;

/// Why a solve has no answer.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SolveError {
    /// A body can move in a direction that nothing resists.
    #[error(
        "body \"{body}\" can move {direction} and nothing resists it: hold it (`anchor`, `hinge`, `slider`, a spring), or remove what moves it; \
         `tran` runs what moves freely and has mass"
    )]
    Singular {
        /// Name of the body.
        body: String,
        /// Which way.
        direction: &'static str,
    },
    /// No stable equilibrium was found beyond some load.
    #[error("the last stable equilibrium that was found bears {share:.4} of the load{passed}: {reason}")]
    Lost {
        /// Fraction of the load path that was reached (1).
        share: f64,
        /// Previous losses of stability, as text; empty without any.
        passed: String,
        /// Reason why there is no equilibrium beyond.
        reason: String,
        /// Beams whose segments bent so far there that shorter ones are needed, by index.
        coarse: Vec<usize>,
        /// True where a beam bends to a radius below half its width, which shorter segments do not change.
        overbent: bool,
    },
    /// The integrator's steps became too small.
    #[error(
        "step size fell to {dt:.3e} s at {t:.6e} s after {rejected} rejections in a row; worst body \"{body}\" {direction}"
    )]
    StepTooSmall {
        /// Time reached since the start of the step (s).
        t: f64,
        /// Last step tried (s).
        dt: f64,
        /// Rejections in a row.
        rejected: usize,
        /// Body with the largest error.
        body: String,
        /// Its direction.
        direction: &'static str,
    },
    /// The integrator could not take a step at all.
    #[error("step of {dt:.3e} s at {t:.6e} s failed: {why}; worst body \"{body}\" {direction}")]
    StepFailed {
        /// Time reached since the start (s).
        t: f64,
        /// The step (s).
        dt: f64,
        /// Why.
        why: WhyFailed,
        /// Body where it shows.
        body: String,
        /// Its direction.
        direction: &'static str,
    },
    /// An explicit integrator needs inertia in every direction that is free.
    #[error(
        "an explicit integrator needs inertia in every free direction: body \"{body}\" has none {direction} \
         (--rotary-inertia, the compile option rotary_inertia, gives beam segments that of their section)"
    )]
    Massless {
        /// Name of the body.
        body: String,
        /// Its direction.
        direction: &'static str,
    },
}

/// Reason why an integrator failed to take a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum WhyFailed {
    /// A vanished pivot.
    #[error(
        "its matrix is singular: something moves there that has neither mass nor stiffness (`mass2d` gives a node m and J, `spring2d` a stiffness)"
    )]
    Singular,
    /// No convergence.
    #[error("Newton's iteration did not settle in {iterations} iterations")]
    Diverged {
        /// Iterations made.
        iterations: usize,
    },
    /// A body that forces move and no mass holds back.
    #[error("no finite acceleration; give the body mass, or lock its direction")]
    NoInertia,
    /// Infinite or not a number.
    #[error("the motion is no longer finite")]
    NotFinite,
}

pub use crate::equations::bodies::DIRECTIONS;
pub use crate::equations::linear;

impl SolveError {
    /// The same with times counted from when the integration began, `start` (s) after what its reader calls 0.
    pub fn begun_at(mut self, start: f64) -> Self {
        if let Self::StepTooSmall { t, .. } | Self::StepFailed { t, .. } = &mut self {
            *t += start;
        }
        self
    }

    /// A matrix with a zero pivot at a body of the system.
    pub fn singular(system: &bimorph_domains::System, pivot: ZeroPivot) -> Self {
        Self::Singular {
            body: system.model.bodies[pivot.body].name.to_string(),
            direction: DIRECTIONS[pivot.direction],
        }
    }
}
