//! Specification of a chart of formulations, and its result.

use super::super::AnalysisError;
use super::super::integrator::Integrator;
use bimorph_model::compile::{CompileError, Formulation as Compiled};
use bimorph_solve::baseline::SolverKind;
use serde::Serialize;
use thiserror::Error;

/// A way to turn a drawing into equations of motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Formulation {
    /// Rigid segments and flexible joints.
    Compliant,
    /// A linear frame of cubic beams, integrated by Newmark's rule: a baseline.
    Frame,
    /// Relative joint coordinates, loops closed by springs.
    Rcr,
    /// The same with every elastic direction as a coordinate.
    RcrElastic,
}

impl Formulation {
    /// All of them, the product's own first.
    pub const ALL: [Self; 4] = [Self::Compliant, Self::Frame, Self::Rcr, Self::RcrElastic];
    /// Default selection.
    pub const DEFAULT: [Self; 3] = [Self::Compliant, Self::Frame, Self::Rcr];

    /// Its name on the command line and in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Compliant => "compliant",
            Self::Frame => "frame",
            Self::Rcr => "rcr",
            Self::RcrElastic => "rcr-elastic",
        }
    }

    /// Formulation of its compiled model; `None`: that of the compliant one.
    pub(super) fn compiled_as(self) -> Option<Compiled> {
        match self {
            Self::Compliant | Self::Frame => None,
            Self::Rcr => Some(Compiled::Rcr),
            Self::RcrElastic => Some(Compiled::RcrElastic),
        }
    }

    /// The requested methods that can integrate it. Joint coordinates always have Rodas4, and where every direction is
    /// elastic those that reduce constraints; a frame has none.
    pub(super) fn methods(self, asked: &[Integrator]) -> Vec<Integrator> {
        match self {
            Self::Compliant => asked.to_vec(),
            Self::Rcr => vec![Integrator::Rodas4],
            Self::RcrElastic => {
                let own = |m: &&Integrator| **m != Integrator::Rodas4 && Integrator::IN_JOINTS.contains(&m.name());
                [Integrator::Rodas4].into_iter().chain(asked.iter().filter(own).copied()).collect()
            }
            Self::Frame => Vec::new(),
        }
    }
}

/// A part of a chart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ChartPart {
    /// Methods and tolerances on one model.
    Precision,
    /// Models of growing order.
    Order,
    /// Solvers on models of growing order.
    Solvers,
    /// Default analyses by tolerance: requested against obtained accuracy.
    Defaults,
}

impl ChartPart {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Precision, Self::Order, Self::Solvers, Self::Defaults];
    /// Default selection.
    pub const DEFAULT: [Self; 3] = [Self::Precision, Self::Order, Self::Solvers];

    /// Its name on the command line and in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Precision => "precision",
            Self::Order => "order",
            Self::Solvers => "solvers",
            Self::Defaults => "defaults",
        }
    }
}

/// Specification of a chart.
#[derive(Debug, Clone, PartialEq)]
pub struct ChartSpec {
    /// Parts wanted.
    pub parts: Vec<ChartPart>,
    /// Signals whose error counts, see [`crate::readout::signal::Signal::find`].
    pub signals: Vec<String>,
    /// End time (s); none: five periods of the lowest mode.
    pub stop: Option<f64>,
    /// Output times at which errors are taken, ends included.
    pub points: usize,
    /// Voltages held during a run, by port name (V).
    pub voltages: Vec<(String, f64)>,
    /// A parameter of the netlist that is released at t = 0, from the equilibrium at its value.
    pub release: Option<String>,
    /// Formulations.
    pub formulations: Vec<Formulation>,
    /// Integration methods.
    pub methods: Vec<Integrator>,
    /// Tolerances of the precision part (1).
    pub tols: Vec<f64>,
    /// Bands of the order and solver parts (Hz); empty: 2 to 2048 times the lowest frequency.
    pub bands: Vec<f64>,
    /// Solvers.
    pub solvers: Vec<SolverKind>,
    /// Runs of which a time is the median.
    pub repeat: usize,
}

/// Numbers of a run that succeeded.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct RunMeasurement {
    /// Relative error (1); none where nothing is compared.
    pub error: Option<f64>,
    /// Default part: the error estimate of the analysis itself (1).
    pub told: Option<f64>,
    /// Wall-clock time: of the whole run, or of one step in the solver part (s).
    pub seconds: f64,
    /// Accepted steps.
    pub steps: u64,
    /// Rejected steps.
    pub rejected: u64,
    /// Factorizations.
    pub factorizations: u64,
    /// Solves with a factor.
    pub solves: u64,
    /// Evaluations of the forces.
    pub forces: u64,
    /// Solver part: multiplications of one factorization and the solves of a step.
    pub multiplications: Option<u64>,
}

/// Times of a factorization with its tangent, a solve and a force evaluation, relative to a force evaluation: 1.13 + 1.9, 0.35 and 1.5 µs on the bank of
/// 84 unknowns (`benches/mechanics.rs`).
const PASSES: [f64; 3] = [3.03 / 1.5, 0.35 / 1.5, 1.0];

/// Work without a clock, in force evaluations of one model: each factorization has a tangent.
pub fn passes(factorizations: u64, solves: u64, forces: u64) -> f64 {
    PASSES[0] * factorizations as f64 + PASSES[1] * solves as f64 + PASSES[2] * forces as f64
}

impl RunMeasurement {
    /// Work without a clock: [`passes`] over the model, or multiplications where those were counted.
    pub fn work(&self) -> f64 {
        self.multiplications.map_or_else(|| passes(self.factorizations, self.solves, self.forces), |count| count as f64)
    }
}

/// One point of a chart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChartPoint {
    /// Which part it belongs to.
    pub part: ChartPart,
    /// Formulation.
    pub formulation: Formulation,
    /// Integration method.
    pub method: &'static str,
    /// Solver of the linear systems.
    pub solver: &'static str,
    /// Tolerance of the integration (1).
    pub tol: f64,
    /// Band that the model resolves (Hz); none: by slenderness.
    pub band_hz: Option<f64>,
    /// Mechanical unknowns.
    pub unknowns: usize,
    /// The numbers; none when it failed.
    pub measured: Option<RunMeasurement>,
    /// Why it failed.
    pub failed: Option<String>,
}

/// A finished chart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Chart {
    /// End time of every run (s).
    pub stop: f64,
    /// Signals whose error counts.
    pub signals: Vec<String>,
    /// Estimated error of the reference of the precision part, from a second reference (1).
    pub reference_error: Option<f64>,
    /// All points, in the order of the parts and of the requested lists.
    pub points: Vec<ChartPoint>,
}

/// Why there is no chart.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ChartError {
    /// The netlist makes no model.
    #[error(transparent)]
    Compile(#[from] CompileError),
    /// The request does not fit the mechanism, a reference run failed, or it was cancelled.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
}
