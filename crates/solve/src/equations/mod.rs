//! The equations of motion in each formulation, as integrators see them: unknowns, error norm, forcing, and the
//! operations of an implicit step.
//!
//! A method in time is written once, against [`Equations`] and [`Staged`], and knows neither bodies nor joints:
//! ```text
//! q̈ = A(t, q, q̇)                          an evaluation
//! a = A(t, q + β·a, q̇ + γ·a)              a stage of an implicit method
//! (I − γ·J)·(e_q, e_v) = raw estimate      errors that motions much faster than the step do not spoil
//! ```
//!
//! | file | what it holds |
//! |---|---|
//! | [`motion`] | unknowns; displacements and rates over unknowns |
//! | [`bodies`] | every body's own coordinates: a system while its sources go along a ramp |
//! | [`newton`] | Newton's method with the exact tangent, for implicit steps over bodies |
//! | [`linear`] | linear solvers for that tangent |
//! | [`constrained`] | joint coordinates, loops reduced in the recursion as constraints |
//! | [`loads`] | loads in joint coordinates |
//! | `acted_bodies` | bodies of a batch that gaps and loads act on, variant by variant |
//! | `anderson` | acceleration of an iteration that contracts slowly |
//! | [`joints`] | joint coordinates, loops closed by springs: a tree, and the system of what is left to the bodies |

pub(crate) mod acted_bodies;
mod anderson;
pub mod bodies;
pub mod constrained;
pub mod joints;
pub mod linear;
pub mod loads;
pub mod motion;
pub mod newton;

pub use bodies::Bodies;
pub use joints::Joints;
pub use motion::{Motion, Unknown};

use bimorph_multibody::factor::ZeroPivot;
use serde::Serialize;

/// Work done.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct SolverCounters {
    /// Accepted steps.
    pub steps: u64,
    /// Rejected steps.
    pub rejected: u64,
    /// Factorizations; a complex one counts once, and so does a reduction of an implicit stage.
    pub factorizations: u64,
    /// Solves with a factor.
    pub solves: u64,
    /// Evaluations of the forces, with or without their tangent.
    pub forces: u64,
    /// Newton iterations.
    pub iterations: u64,
}

impl SolverCounters {
    /// Both together.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            steps: self.steps + other.steps,
            rejected: self.rejected + other.rejected,
            factorizations: self.factorizations + other.factorizations,
            solves: self.solves + other.solves,
            forces: self.forces + other.forces,
            iterations: self.iterations + other.iterations,
        }
    }
}

/// A body, by its number in elimination order, and one of its directions.
pub type DegreeOfFreedom = (usize, usize);

/// Result of a step, or of a part of one.
pub type StepResult = Result<(), StepFailure>;

/// Why a step of this length could not be taken; a shorter one may.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StepFailure {
    /// The step's matrix cannot be factored.
    Singular(ZeroPivot),
    /// Newton's iteration did not settle.
    Diverged {
        /// Iterations made.
        iterations: usize,
        /// Body with the largest correction.
        body: usize,
        /// Its direction.
        direction: usize,
    },
    /// No finite acceleration: forces are finite, so this body can move without inertia.
    NoInertia {
        /// The body.
        body: usize,
    },
}

impl From<ZeroPivot> for StepFailure {
    fn from(pivot: ZeroPivot) -> Self {
        Self::Singular(pivot)
    }
}

impl StepFailure {
    /// Fraction of the step to try next.
    pub fn shorter(self) -> f64 {
        match self {
            Self::Diverged { .. } => 0.25,
            Self::Singular(_) | Self::NoInertia { .. } => 0.1,
        }
    }
}

/// Criterion that determines the length of steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Control {
    /// Relative error that a step may make (1).
    Tolerance(f64),
    /// Equal steps, as many as are needed for none to be longer than this (s).
    Fixed(f64),
}

/// One stage of an implicit method: a = A(t, q + β·a, v + γ·a).
#[derive(Debug, Clone, Copy)]
pub struct Stage<'a, X> {
    /// Time (s).
    pub t: f64,
    /// Displacements without the stage's own acceleration.
    pub q: &'a [X],
    /// Rates without it.
    pub v: &'a [X],
    /// Displacements near those of the stage, to begin with.
    pub near: &'a [X],
    /// β (s²).
    pub beta: f64,
    /// γ (s).
    pub gamma: f64,
}

/// Equations of motion of the second order, from time 0 on. See the module.
pub trait Equations {
    /// Type of one unknown.
    type Unknown: Unknown;

    /// How many there are.
    fn unknowns(&self) -> usize;

    /// When the motion ends (s).
    fn end(&self) -> f64;

    /// A motion begins, whose steps `control` sets.
    fn begin(&mut self, control: Control) {
        let _ = control;
    }

    /// The estimated error of a step of length `h` (s) over the relative error `tol` that it may make: 1 is just allowed.
    fn share(&self, ends: [&Motion<Self::Unknown>; 2], error: &Motion<Self::Unknown>, h: f64, tol: f64) -> f64;

    /// Takes the end of a step to the constraints as they are at time `t` (s). Returns how far that moved it, of what a step from
    /// `before` may be wrong at a relative error of `tol`.
    fn close(&mut self, t: f64, before: &[Self::Unknown], end: &mut Motion<Self::Unknown>, tol: f64) -> f64 {
        let _ = (t, before, end, tol);
        0.0
    }

    /// Where an error is largest.
    fn worst(&self, error: &[Self::Unknown]) -> DegreeOfFreedom;

    /// Name of a body, and words for a direction.
    fn named(&self, place: DegreeOfFreedom) -> (String, &'static str);

    /// Work since this was last asked.
    fn work(&mut self) -> SolverCounters {
        SolverCounters::default()
    }
}

/// Extra operations required by explicit and diagonally implicit methods.
pub trait Staged: Equations {
    /// `a` becomes q̈ at time `t` (s), displacements `q` and rates `v`; zero where there is no inertia and springs decide.
    ///
    /// # Errors
    /// [`StepFailure`].
    fn accelerations(
        &mut self,
        t: f64,
        q: &[Self::Unknown],
        v: &[Self::Unknown],
        a: &mut [Self::Unknown],
    ) -> StepResult;

    /// Solves a stage. `a` holds a guess and becomes its acceleration, `at` its displacements and rates.
    ///
    /// # Errors
    /// [`StepFailure`].
    fn stage(
        &mut self,
        stage: &Stage<'_, Self::Unknown>,
        a: &mut [Self::Unknown],
        at: &mut Motion<Self::Unknown>,
    ) -> StepResult;

    /// Takes an estimated error through (I − γ·J)⁻¹, with the J that the last stage left, which had this γ (s); the step ends at time
    /// `t` (s) and displacements `q`.
    ///
    /// # Errors
    /// [`StepFailure`].
    fn smooth(&mut self, at: (f64, f64), q: &[Self::Unknown], error: &mut Motion<Self::Unknown>) -> StepResult;

    /// A rate without inertia is no state: after a step of length `h` (s) from displacements `before` it becomes the mean of the step, and
    /// its accelerations nothing. A rule that takes it from the last one would ring on.
    fn follow(
        &self,
        h: f64,
        before: &[Self::Unknown],
        end: &mut Motion<Self::Unknown>,
        accelerations: &mut [Motion<Self::Unknown>],
    ) {
        let _ = (h, before, end, accelerations);
    }
}
