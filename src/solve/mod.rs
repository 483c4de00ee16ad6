//! What advances or balances a system.
//!
//! | file | what it holds |
//! |---|---|
//! | [`equilibrium`] | static equilibrium along a path of loads: Newton, load stepping, folds and jumps |
//! | [`path`] | source voltages and loads along which an equilibrium is followed |
//! | [`rodas4`] | the default integrator: a Rosenbrock method with one factorization a step, and its sensitivities |
//! | [`adaptive`] | error control of the integrator |
//! | [`eigen`] | lowest natural frequencies: shift-invert Lanczos on the same factor |
//! | [`harmonic`] | small-signal response at one frequency: the same factorization over complex numbers |

pub mod adaptive;
pub mod eigen;
pub mod equilibrium;
pub mod harmonic;
pub mod path;
pub mod rodas4;

use crate::multibody::factor::ZeroPivot;
use thiserror::Error;

/// Why a solve has no answer.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SolveError {
    /// A body can move in a direction that nothing resists.
    #[error("body \"{body}\" can move {direction} and nothing resists it")]
    Singular {
        /// Name of the body.
        body: String,
        /// Which way.
        direction: &'static str,
    },
    /// Load steps became too small and no other equilibrium was found.
    #[error(
        "equilibrium lost at {share:.6} of the load after {iterations} iterations (residual {residual:.3e} at \"{body}\")"
    )]
    Lost {
        /// Share of the load path that was reached [1].
        share: f64,
        /// Iterations spent.
        iterations: usize,
        /// Largest residual force [N] or moment [N·m].
        residual: f64,
        /// Body where it stands.
        body: String,
    },
    /// The integrator's steps became too small.
    #[error(
        "step size fell to {dt:.3e} s at {t:.6e} s after {rejected} rejections in a row; worst body \"{body}\" in {direction}"
    )]
    StepTooSmall {
        /// Time reached since the start of the step [s].
        t: f64,
        /// Last step tried [s].
        dt: f64,
        /// Rejections in a row.
        rejected: usize,
        /// Body with the largest error.
        body: String,
        /// Its direction.
        direction: &'static str,
    },
}

/// Names of a planar body's directions, for messages.
pub const DIRECTIONS: [&str; 3] = ["along x", "along y", "about z"];

impl SolveError {
    pub(crate) fn singular(system: &crate::gaps::System, pivot: ZeroPivot) -> Self {
        Self::Singular { body: system.model.bodies[pivot.body].name.clone(), direction: DIRECTIONS[pivot.direction] }
    }
}
