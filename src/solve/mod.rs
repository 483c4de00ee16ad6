//! What advances or balances a system.
//!
//! | file | what it holds |
//! |---|---|
//! | [`equilibrium`] | static equilibrium along a path of loads: Newton, load stepping, folds and jumps |
//! | [`continuation`] | equilibrium paths by arc length: folds, bifurcations, branches |
//! | [`family`] | systems whose loads, strains and voltages depend on one number |
//! | [`path`] | source voltages and loads along which an equilibrium is followed |
//! | [`method`] | what every integrator is: one step, its estimated error, its work |
//! | [`rodas4`] | the default integrator: a Rosenbrock method with one factorization a step, and its sensitivities |
//! | [`avf`] | average vector field: keeps the energy |
//! | [`midpoint`] | implicit midpoint rule |
//! | [`tr_bdf2`] | TR-BDF2: order 2, L-stable |
//! | [`sdirk4`] | a diagonally implicit Runge–Kutta method of order 4, L-stable |
//! | [`generalized_alpha`] | generalized-α with a chosen damping of fast motions, and Newmark's rule |
//! | [`radau5`] | Radau IIA of order 5: one real and one complex block factorization a step |
//! | [`rk45`] | Dormand–Prince on bodies: explicit |
//! | [`dense`] | the motion inside a step |
//! | [`event`] | when a quantity crosses zero during a step |
//! | [`doubling`] | error control by step doubling for methods without an estimate |
//! | [`linear`] | what solves with the tangent: the block recursion, and the baselines it is measured against |
//! | [`adaptive`] | drives any of them: error control, or equal steps |
//! | `step_size` | how long the next step is |
//! | [`dormand_prince`] | an explicit Runge–Kutta pair on flat slices, for any formulation that tells its accelerations |
//! | [`consistent`] | natural frequencies of a linear frame with a full mass matrix, densely: a baseline |
//! | [`newmark`] | linear motion by the trapezoidal rule: a baseline |
//! | [`eigen`] | lowest natural frequencies: shift-invert Lanczos on the same factor |
//! | [`fastest`] | the highest natural frequency in joint coordinates |
//! | [`joint_loads`] | what acts on a system, for a motion in joint coordinates |
//! | [`joint_motion`] | motion in joint coordinates, loops closed after each step |
//! | `anderson` | acceleration of an iteration that contracts slowly |
//! | [`joint_stage`] | the stages of implicit methods in joint coordinates |
//! | [`joint_dirk`] | implicit methods in joint coordinates |
//! | [`joint_adaptive`] | drives them: error control, or equal steps |
//! | [`harmonic`] | small-signal response at one frequency: the same factorization over complex numbers |

pub mod adaptive;
mod anderson;
pub mod avf;
pub mod centred;
pub mod consistent;
pub mod continuation;
pub mod dense;
pub mod dormand_prince;
pub mod doubling;
pub mod eigen;
pub mod equilibrium;
pub mod event;
pub mod family;
pub mod fastest;
pub mod generalized_alpha;
pub mod harmonic;
mod implicit;
pub mod joint_adaptive;
pub mod joint_dirk;
pub mod joint_loads;
pub mod joint_motion;
pub mod joint_stage;
pub mod linear;
pub mod method;
pub mod midpoint;
pub mod newmark;
pub mod path;
pub mod radau5;
pub mod rk45;
pub mod rodas4;
pub mod sdirk4;
mod step_size;
pub mod subspace;
pub mod tr_bdf2;

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
    /// The integrator could not take a step at all.
    #[error("step of {dt:.3e} s at {t:.6e} s failed: {why}; worst body \"{body}\" {direction}")]
    StepFailed {
        /// Time reached since the start [s].
        t: f64,
        /// The step [s].
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

/// What kept an integrator from taking a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum WhyFailed {
    /// A vanished pivot.
    #[error("its matrix is singular")]
    Singular,
    /// No convergence.
    #[error("Newton's iteration did not settle in {iterations} iterations")]
    Diverged {
        /// Iterations made.
        iterations: usize,
    },
    /// Infinite or not a number.
    #[error("the motion is no longer finite")]
    NotFinite,
}

/// Names of a planar body's directions, for messages.
pub const DIRECTIONS: [&str; 3] = ["along x", "along y", "about z"];

impl SolveError {
    pub(crate) fn step_failed(
        system: &crate::gaps::System,
        t: f64,
        dt: f64,
        why: WhyFailed,
        body: usize,
        direction: usize,
    ) -> Self {
        let body = system.model.bodies[body].name.to_string();
        Self::StepFailed { t, dt, why, body, direction: DIRECTIONS[direction] }
    }

    pub(crate) fn singular(system: &crate::gaps::System, pivot: ZeroPivot) -> Self {
        Self::Singular {
            body: system.model.bodies[pivot.body].name.to_string(),
            direction: DIRECTIONS[pivot.direction],
        }
    }
}
