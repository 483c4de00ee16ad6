//! The integrators by name, and the one place where a name becomes a type.

use bimorph_domains::{Ramp, System};
use bimorph_multibody::planar::Pose;
use bimorph_solve::SolveError;
use bimorph_solve::baseline::Solver;
use bimorph_solve::equations::newton::Newton;
use bimorph_solve::equations::{Bodies, Equations, Staged, Unknown};
use bimorph_solve::time::adaptive::{Adaptive, Advance, Control, Observer};
use bimorph_solve::time::alpha::GeneralizedAlpha;
use bimorph_solve::time::average_field::AverageField;
use bimorph_solve::time::defect::{Estimated, Propagates, SeeError};
use bimorph_solve::time::dirk::Dirk;
use bimorph_solve::time::doubling::Doubling;
use bimorph_solve::time::explicit::{self, Rk45};
use bimorph_solve::time::method::{Method, Motion, SolverCounters};
use bimorph_solve::time::radau5::Radau5;
use bimorph_solve::time::rodas4::Rodas4;
use bimorph_solve::time::tableau::{MIDPOINT, SDIRK4, TR_BDF2};

/// Integrator of a motion in time.
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
    /// Default factor by which generalized-α damps infinitely fast motions.
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

    /// True for methods that gain energy without bound where parts touch: they take forces at points of a step, and a contact that begins
    /// inside it gives back more than it took.
    pub fn gains_in_contact(self) -> bool {
        match self {
            Self::Midpoint | Self::Newmark => true,
            Self::GeneralizedAlpha { rho } => rho > 0.0,
            Self::Rodas4 | Self::AverageField | Self::TrBdf2 | Self::Radau5 | Self::Rk45 | Self::Sdirk4 => false,
        }
    }

    /// Advances `motion` over bodies from the start of the ramp to its end; `h` is the first step to try (s). Methods
    /// without an error estimate go by step doubling under [`Control::Tolerance`]. The work is reported also where it
    /// ends in an error.
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
    ) -> (Result<Advance, SolveError>, SolverCounters) {
        let mut bodies = Bodies::new(system, ramp);
        let run = IntegrationRun { motion, h, control, observe, corners: ramp.corners() };
        match self.rule() {
            Some(rule) => match explicit::suits(system).err().filter(|_| rule == IntegrationRule::Rk45) {
                Some(error) => (Err(error), SolverCounters::default()),
                None => rule.advance(&mut Newton::new(bodies, solver), run),
            },
            None => match self {
                Self::AverageField => run.doubled(&mut Newton::new(bodies, solver), AverageField::new(system.bodies())),
                Self::Radau5 => run.with(&mut bodies, Radau5::new(system)),
                _ => run.with(&mut bodies, Rodas4::with_solver(solver, system, &[])),
            },
        }
    }

    /// The rule that it is over the equations of any formulation; none for methods that need what bodies alone have: Rodas4 has the
    /// Jacobian in its formula, Radau5 couples its stages, and average vector field needs constant inertia.
    pub fn rule(self) -> Option<IntegrationRule> {
        match self {
            Self::Rodas4 | Self::AverageField | Self::Radau5 => None,
            Self::Midpoint => Some(IntegrationRule::Midpoint),
            Self::TrBdf2 => Some(IntegrationRule::TrBdf2),
            Self::GeneralizedAlpha { rho } => Some(IntegrationRule::GeneralizedAlpha { rho }),
            Self::Newmark => Some(IntegrationRule::Newmark),
            Self::Rk45 => Some(IntegrationRule::Rk45),
            Self::Sdirk4 => Some(IntegrationRule::Sdirk4),
        }
    }
}

/// A method that any equations can have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum IntegrationRule {
    /// See [`Integrator::Midpoint`].
    Midpoint,
    /// See [`Integrator::TrBdf2`].
    TrBdf2,
    /// See [`Integrator::GeneralizedAlpha`].
    GeneralizedAlpha {
        /// Factor by which an infinitely fast motion shrinks in a step, from 0 to 1.
        rho: f64,
    },
    /// See [`Integrator::Newmark`].
    Newmark,
    /// See [`Integrator::Rk45`].
    Rk45,
    /// See [`Integrator::Sdirk4`].
    Sdirk4,
}

impl IntegrationRule {
    /// Runs an integration.
    pub fn advance<E: Staged>(
        self,
        equations: &mut E,
        run: IntegrationRun<'_, '_, E::Unknown>,
    ) -> (Result<Advance, SolveError>, SolverCounters) {
        let n = equations.unknowns();
        match self {
            Self::TrBdf2 => run.with(equations, Dirk::new(n, &TR_BDF2)),
            Self::Sdirk4 => run.with(equations, Dirk::new(n, &SDIRK4)),
            Self::Midpoint => run.doubled(equations, Dirk::new(n, &MIDPOINT)),
            Self::GeneralizedAlpha { rho } => run.doubled(equations, GeneralizedAlpha::new(n, rho)),
            Self::Newmark => run.doubled(equations, GeneralizedAlpha::newmark(n)),
            Self::Rk45 => run.with(equations, Rk45::new(n)),
        }
    }
}

impl IntegrationRun<'_, '_, Pose> {
    /// Runs a method over bodies, with the error of the motion where something sees it.
    pub(crate) fn with_errors<'s, M: Propagates<'s>>(
        self,
        bodies: &mut Bodies<'s>,
        method: M,
        errors: Option<SeeError<'_>>,
    ) -> (Result<Advance, SolveError>, SolverCounters) {
        match errors {
            Some(see) => self.with(bodies, Estimated::new(method, see)),
            None => self.with(bodies, method),
        }
    }
}

/// Data of a run that do not depend on the method.
pub struct IntegrationRun<'a, 'b, X> {
    /// Where it begins; becomes where it ends.
    pub motion: &'a mut Motion<X>,
    /// First step to try (s).
    pub h: f64,
    /// Criterion for the length of steps.
    pub control: Control,
    /// Sees each accepted step.
    pub observe: Observer<'b, X>,
    /// Times at which steps end (s).
    pub corners: Vec<f64>,
}

impl<X: Unknown> IntegrationRun<'_, '_, X> {
    /// Runs a method, and returns it with its storage.
    pub(crate) fn stepped<E: Equations<Unknown = X>, M: Method<E>>(
        mut self,
        equations: &mut E,
        method: M,
    ) -> (Result<Advance, SolveError>, Adaptive<M, X>) {
        let mut stepper = Adaptive::new(equations.unknowns(), method);
        stepper.corners = self.corners;
        let end = stepper.advance(equations, self.motion, &mut self.h, self.control, usize::MAX, self.observe);
        (end, stepper)
    }

    fn with<E: Equations<Unknown = X>, M: Method<E>>(
        self,
        equations: &mut E,
        method: M,
    ) -> (Result<Advance, SolveError>, SolverCounters) {
        let (end, stepper) = self.stepped(equations, method);
        (end, stepper.work())
    }

    fn doubled<E: Equations<Unknown = X>, M: Method<E>>(
        self,
        equations: &mut E,
        method: M,
    ) -> (Result<Advance, SolveError>, SolverCounters) {
        match self.control {
            Control::Tolerance(_) => {
                let doubled = Doubling::new(equations.unknowns(), method);
                self.with(equations, doubled)
            }
            Control::Fixed(_) => self.with(equations, method),
        }
    }
}
