//! Error against work, and work against size: how the methods, formulations, model orders and solvers compare on a mechanism.
//!
//! | part | what varies | what it is measured against |
//! |---|---|---|
//! | precision | integration method, tolerance, formulation | the same model, integrated far more tightly |
//! | order | the band that the model resolves, formulation | the finest model of the list |
//! | solvers | the solver of the linear systems, the band | nothing: the time of a step |
//! | defaults | the tolerance alone, of `static`, `modes` and `tran` as commands make them | the same at a tenth of the tightest |
//!
//! Errors are root mean squares over output times and signals, relative to the amplitude of the reference ([`error`]).
//! They and the counters are the same on every run. Times are wall-clock times, medians over repeats, and are not. A run
//! that fails is a point with its reason and without numbers.
//!
//! The reference is Radau5 at a hundredth of the tightest tolerance. It is itself checked: Rodas4 at ten times its tolerance
//! gives the same motion but for a difference that is part of the result. In joint coordinates both are Rodas4's. Errors below
//! it mean nothing.

mod defaults;
pub mod error;
mod runs;
pub mod steps;
mod variant;

pub use variant::released;

use super::integrator::Integrator;
use super::modes::modes;
use super::{AnalysisError, PortVoltages, Watch};
use crate::compile::{CompileError, CompileOptions, Formulation as Compiled};
use crate::netlist::Bundle;
use crate::solve::baseline::SolverKind;
use runs::{Progress, Request, order, precision};
use serde::Serialize;
use thiserror::Error;
use variant::{Models, Variant};

/// Periods of the lowest mode that a run lasts when no end is given.
const PERIODS: f64 = 5.0;
/// Bands that are tried when none are given, as multiples of the lowest frequency.
const BANDS: [f64; 6] = [2.0, 8.0, 32.0, 128.0, 512.0, 2048.0];

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
    /// What is charted unless said otherwise.
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

    /// What a model in it is compiled as; none: as the compliant one.
    fn compiled_as(self) -> Option<Compiled> {
        match self {
            Self::Compliant | Self::Frame => None,
            Self::Rcr => Some(Compiled::Rcr),
            Self::RcrElastic => Some(Compiled::RcrElastic),
        }
    }

    /// The methods that it can be integrated by, of those asked for; joint coordinates always have Rodas4, and
    /// where every direction is elastic those that reduce constraints; a frame has none.
    fn methods(self, asked: &[Integrator]) -> Vec<Integrator> {
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
pub enum Part {
    /// Methods and tolerances on one model.
    Precision,
    /// Models of growing order.
    Order,
    /// Solvers on models of growing order.
    Solvers,
    /// Default analyses by tolerance: what is asked for and what comes out.
    Defaults,
}

impl Part {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Precision, Self::Order, Self::Solvers, Self::Defaults];
    /// What is charted unless said otherwise.
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

/// What a chart is asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct ChartSpec {
    /// Parts wanted.
    pub parts: Vec<Part>,
    /// Signals whose error counts, see [`super::signal::Signal::find`].
    pub signals: Vec<String>,
    /// End time [s]; none: five periods of the lowest mode.
    pub stop: Option<f64>,
    /// Output times at which errors are taken, ends included.
    pub points: usize,
    /// Voltages held during a run, by port name [V].
    pub voltages: Vec<(String, f64)>,
    /// A parameter of the netlist that is let go at t = 0, from the equilibrium at its value.
    pub release: Option<String>,
    /// Formulations.
    pub formulations: Vec<Formulation>,
    /// Integration methods.
    pub methods: Vec<Integrator>,
    /// Tolerances of the precision part [1].
    pub tols: Vec<f64>,
    /// Bands of the order and solver parts [Hz]; empty: 2 to 2048 times the lowest frequency.
    pub bands: Vec<f64>,
    /// Solvers.
    pub solvers: Vec<SolverKind>,
    /// Runs of which a time is the median.
    pub repeat: usize,
}

/// Numbers of a run that succeeded.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Measured {
    /// Relative error [1]; none where nothing is compared.
    pub error: Option<f64>,
    /// Default part: the error that the analysis itself tells [1].
    pub told: Option<f64>,
    /// Wall-clock time: of the whole run, or of one step in the solver part [s].
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

impl Measured {
    /// Work without a clock: passes over the model (force evaluations, factorizations and solves together), or
    /// multiplications where those were counted.
    pub fn count(&self) -> u64 {
        self.multiplications.unwrap_or(self.factorizations + self.solves + self.forces)
    }
}

/// One point of a chart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChartPoint {
    /// Which part it belongs to.
    pub part: Part,
    /// Formulation.
    pub formulation: Formulation,
    /// Integration method.
    pub method: &'static str,
    /// Solver of the linear systems.
    pub solver: &'static str,
    /// Tolerance of the integration [1].
    pub tol: f64,
    /// Band that the model resolves [Hz]; none: by slenderness.
    pub band_hz: Option<f64>,
    /// Mechanical unknowns.
    pub unknowns: usize,
    /// The numbers; none when it failed.
    pub measured: Option<Measured>,
    /// Why it failed.
    pub failed: Option<String>,
}

/// A finished chart.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Chart {
    /// End time of every run [s].
    pub stop: f64,
    /// Signals whose error counts.
    pub signals: Vec<String>,
    /// How far the reference of the precision part is off, as far as a second one tells [1].
    pub reference_error: Option<f64>,
    /// All points, in the order of the parts and of the lists asked for.
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

/// Makes a chart.
///
/// # Errors
/// See [`ChartError`]; a single run that fails is a point that says so.
pub fn chart(
    bundle: &Bundle,
    options: &CompileOptions,
    spec: &ChartSpec,
    watch: Watch<'_>,
) -> Result<Chart, ChartError> {
    check(spec)?;
    let release = spec.release.as_deref();
    let models = |band| Models::new(bundle, options, band, release, &spec.formulations);
    let base = models(options.band)?;
    let lowest = if spec.stop.is_none() || spec.bands.is_empty() {
        Some(lowest_mode(&base.bodies, &spec.voltages)?)
    } else {
        None
    };
    let stop = spec.stop.or(lowest.map(|f| PERIODS / f)).unwrap_or_default();
    let mut bands = match (spec.bands.is_empty(), lowest) {
        (true, Some(f)) => BANDS.iter().map(|k| k * f).collect(),
        _ => spec.bands.clone(),
    };
    bands.sort_by(f64::total_cmp);
    let precise = |f: &Formulation| match f.methods(&spec.methods).len() * spec.tols.len() * spec.repeat {
        0 => 0,
        runs => 2 + runs,
    };
    let count = |part: Part, runs: usize| if spec.parts.contains(&part) { runs } else { 0 };
    let runs = count(Part::Precision, spec.formulations.iter().map(precise).sum())
        + count(Part::Order, spec.formulations.len() * bands.len() * spec.repeat)
        + count(Part::Solvers, spec.solvers.len() * bands.len())
        + count(Part::Defaults, defaults::ANALYSES.len() * (spec.tols.len() + 1));
    let mut progress = Progress { watch, done: 0.0, total: runs.max(1) as f64 };
    let mut chart = Chart { stop, signals: spec.signals.clone(), reference_error: None, points: Vec::new() };
    let request = Request { spec, stop };
    if spec.parts.contains(&Part::Precision) {
        precision(&base, &request, &mut chart, &mut progress)?;
    }
    if spec.parts.contains(&Part::Order) || spec.parts.contains(&Part::Solvers) {
        let models: Vec<Models> = bands.iter().map(|&b| models(Some(b))).collect::<Result<_, _>>()?;
        if spec.parts.contains(&Part::Order) {
            order(&models, &request, &mut chart, &mut progress)?;
        }
        if spec.parts.contains(&Part::Solvers) {
            for model in &models {
                for &solver in &spec.solvers {
                    chart.points.push(steps::measure(&model.bodies, &request, solver)?);
                    progress.done += 1.0;
                    if !progress.run(0.0) {
                        return Err(AnalysisError::Cancelled.into());
                    }
                }
            }
        }
    }
    if spec.parts.contains(&Part::Defaults) {
        defaults::defaults((bundle, options), (spec, stop), &mut chart, &mut progress)?;
    }
    Ok(chart)
}

/// The lowest natural frequency that is not a rigid motion [Hz].
fn lowest_mode(model: &Variant, voltages: &PortVoltages) -> Result<f64, AnalysisError> {
    let found = modes(model.moving(), 4, voltages)?.frequencies_hz;
    let highest = found.last().copied().unwrap_or(0.0);
    found.into_iter().find(|f| *f > 1e-6 * highest && *f > 0.0).ok_or_else(|| AnalysisError::BadRequest {
        what: "stop and bands".into(),
        detail: "the mechanism has no natural frequency to choose them by; give --stop and --bands".into(),
    })
}

fn check(spec: &ChartSpec) -> Result<(), AnalysisError> {
    let bad = |what: &str, detail: &str| Err(AnalysisError::BadRequest { what: what.into(), detail: detail.into() });
    let usable = |list: &[f64]| list.iter().all(|x| x.is_finite() && *x > 0.0);
    if spec.signals.is_empty() {
        return bad("signals", "an error needs a signal, such as NODE.x");
    }
    if spec.tols.is_empty() || !usable(&spec.tols) || spec.tols.iter().any(|t| *t >= 1.0) {
        return bad("tols", "relative errors between 0 and 1 are needed");
    }
    if !usable(&spec.bands) {
        return bad("bands", "frequencies above 0 Hz are needed");
    }
    if spec.repeat == 0 || spec.formulations.is_empty() {
        return bad("repeat and formulations", "at least one run and one formulation are needed");
    }
    Ok(())
}
