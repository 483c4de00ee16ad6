//! The integrators by name, and the one place where a name becomes a type.

use crate::domains::{Ramp, System};
use crate::solve::SolveError;
use crate::solve::adaptive::{Adaptive, Advance, Control, Observer};
use crate::solve::avf::AverageField;
use crate::solve::baseline::Solver;
use crate::solve::doubling::Doubling;
use crate::solve::generalized_alpha::GeneralizedAlpha;
use crate::solve::method::{Method, Motion, Work};
use crate::solve::midpoint::Midpoint;
use crate::solve::radau5::Radau5;
use crate::solve::rk45::Rk45;
use crate::solve::rodas4::Rodas4;
use crate::solve::time::dirk::Dirk;
use crate::solve::time::tableau::{SDIRK4, TR_BDF2};

/// What integrates a motion in time.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[non_exhaustive]
pub enum Integrator {
    /// Rosenbrock, order 4, L-stable: one factorization and six solves a step.
    #[default]
    Rodas4,
    /// Average vector field, order 2: keeps the energy.
    AverageField,
    /// Implicit midpoint rule, order 2.
    Midpoint,
    /// TR-BDF2, order 2, L-stable.
    TrBdf2,
    /// Generalized-α, order 2.
    GeneralizedAlpha {
        /// Factor by which an infinitely fast motion shrinks in a step, from 0 to 1.
        rho: f64,
    },
    /// Newmark's rule with average acceleration, order 2.
    Newmark,
    /// Radau IIA, order 5, L-stable.
    Radau5,
    /// Dormand–Prince, order 5, explicit.
    Rk45,
    /// Diagonally implicit Runge–Kutta, order 4, L-stable.
    Sdirk4,
}

impl Integrator {
    /// Factor by which generalized-α damps infinitely fast motions when nothing is said.
    pub const RHO: f64 = 0.8;

    /// Names in the order of the variants.
    pub const NAMES: [&str; 9] =
        ["rodas4", "avf", "midpoint", "tr-bdf2", "generalized-alpha", "newmark", "radau5", "rk45", "sdirk4"];

    /// Names of those that joint coordinates have: rodas4 with loops closed by springs, the others with constraints reduced
    /// in the recursion. Radau5 couples its stages, and average vector field needs coordinates with constant inertia.
    pub const IN_JOINTS: [&str; 7] =
        ["rodas4", "rk45", "tr-bdf2", "sdirk4", "midpoint", "newmark", "generalized-alpha"];

    /// The integrator of a name, generalized-α with [`Integrator::RHO`].
    pub fn named(name: &str) -> Option<Self> {
        let all = [
            Self::Rodas4,
            Self::AverageField,
            Self::Midpoint,
            Self::TrBdf2,
            Self::GeneralizedAlpha { rho: Self::RHO },
            Self::Newmark,
            Self::Radau5,
            Self::Rk45,
            Self::Sdirk4,
        ];
        Self::NAMES.iter().position(|n| *n == name).map(|k| all[k])
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        Self::NAMES[match self {
            Self::Rodas4 => 0,
            Self::AverageField => 1,
            Self::Midpoint => 2,
            Self::TrBdf2 => 3,
            Self::GeneralizedAlpha { .. } => 4,
            Self::Newmark => 5,
            Self::Radau5 => 6,
            Self::Rk45 => 7,
            Self::Sdirk4 => 8,
        }]
    }

    /// True for methods whose linear systems any solver can have; Radau5 needs complex ones, and rk45 has none.
    pub fn takes_solvers(self) -> bool {
        !matches!(self, Self::Radau5 | Self::Rk45)
    }

    /// Advances `motion` from the start of the ramp to its end; `h` is the first step to try [s]. Methods without an
    /// error estimate go by step doubling under [`Control::Tolerance`]. The work is told even where it ends in an error.
    #[allow(clippy::too_many_arguments)]
    pub fn advance(
        self,
        system: &System,
        solver: Solver,
        ramp: &Ramp<'_>,
        motion: &mut Motion,
        h: f64,
        control: Control,
        observe: Observer<'_>,
    ) -> (Result<Advance, SolveError>, Work) {
        let run = Run { system, ramp, motion, h, control, observe };
        match self {
            Self::Rodas4 => run.with(Rodas4::with_solver(solver, system, &[])),
            Self::AverageField => run.doubled(AverageField::with_solver(solver, system)),
            Self::Midpoint => run.doubled(Midpoint::with_solver(solver, system)),
            Self::TrBdf2 => run.with(Dirk::with_solver(solver, system, &TR_BDF2)),
            Self::GeneralizedAlpha { rho } => run.doubled(GeneralizedAlpha::with_solver(solver, system, rho)),
            Self::Newmark => run.doubled(GeneralizedAlpha::newmark_with_solver(solver, system)),
            Self::Sdirk4 => run.with(Dirk::with_solver(solver, system, &SDIRK4)),
            Self::Radau5 => run.with(Radau5::new(system)),
            Self::Rk45 => match Rk45::new(system) {
                Ok(method) => run.with(method),
                Err(error) => (Err(error), Work::default()),
            },
        }
    }
}

/// What is the same for every method.
struct Run<'a, 'b> {
    system: &'a System,
    ramp: &'a Ramp<'a>,
    motion: &'a mut Motion,
    h: f64,
    control: Control,
    observe: Observer<'b>,
}

impl Run<'_, '_> {
    fn with<M: Method>(mut self, method: M) -> (Result<Advance, SolveError>, Work) {
        let mut stepper = Adaptive::new(self.system, method);
        let h = &mut self.h;
        let end = stepper.advance(self.system, self.ramp, self.motion, h, self.control, usize::MAX, self.observe);
        (end, stepper.work())
    }

    fn doubled<M: Method>(self, method: M) -> (Result<Advance, SolveError>, Work) {
        match self.control {
            Control::Tolerance(_) => {
                let system = self.system;
                self.with(Doubling::new(system, method))
            }
            Control::Fixed(_) => self.with(method),
        }
    }
}
