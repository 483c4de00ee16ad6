//! Error against work, and work against size: how the methods, formulations, model orders and solvers compare on a mechanism.
//!
//! | part | variable | reference |
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
mod spec;
pub mod steps;
mod variant;

pub use spec::{Chart, ChartError, ChartPart, ChartPoint, ChartSpec, Formulation, RunMeasurement, passes};
pub use variant::released;

use super::modes::modes;
use super::{AnalysisError, PortVoltages, ProgressCallback};
use bimorph_model::compile::CompileOptions;
use bimorph_structure::FrontEnd;
use runs::{ChartProgress, RunSeries, order, precision};
use variant::{ChartVariant, FormulationModels};

/// Periods of the lowest mode that a run lasts when no end is given.
const PERIODS: f64 = 5.0;
/// Bands that are tried when none are given, as multiples of the lowest frequency.
const BANDS: [f64; 6] = [2.0, 8.0, 32.0, 128.0, 512.0, 2048.0];

/// Makes a chart.
///
/// # Errors
/// See [`ChartError`]; a single run that fails is a point that says so.
pub fn chart(
    source: &dyn FrontEnd,
    options: &CompileOptions,
    spec: &ChartSpec,
    watch: ProgressCallback<'_>,
) -> Result<Chart, ChartError> {
    check(spec)?;
    let release = spec.release.as_deref();
    let models = |band| FormulationModels::new(source, options, band, release, &spec.formulations);
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
    let count = |part: ChartPart, runs: usize| if spec.parts.contains(&part) { runs } else { 0 };
    let runs = count(ChartPart::Precision, spec.formulations.iter().map(precise).sum())
        + count(ChartPart::Order, spec.formulations.len() * bands.len() * spec.repeat)
        + count(ChartPart::Solvers, spec.solvers.len() * bands.len())
        + count(ChartPart::Defaults, defaults::ANALYSES.len() * (spec.tols.len() + 1));
    let mut progress = ChartProgress { watch, done: 0.0, total: runs.max(1) as f64 };
    let mut chart = Chart { stop, signals: spec.signals.clone(), reference_error: None, points: Vec::new() };
    let request = RunSeries { spec, stop };
    if spec.parts.contains(&ChartPart::Precision) {
        precision(&base, &request, &mut chart, &mut progress)?;
    }
    if spec.parts.contains(&ChartPart::Order) || spec.parts.contains(&ChartPart::Solvers) {
        let models: Vec<FormulationModels> = bands.iter().map(|&b| models(Some(b))).collect::<Result<_, _>>()?;
        if spec.parts.contains(&ChartPart::Order) {
            order(&models, &request, &mut chart, &mut progress)?;
        }
        if spec.parts.contains(&ChartPart::Solvers) {
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
    if spec.parts.contains(&ChartPart::Defaults) {
        defaults::defaults((source, options), (spec, stop), &mut chart, &mut progress)?;
    }
    Ok(chart)
}

/// The lowest natural frequency that is not a rigid motion (Hz).
fn lowest_mode(model: &ChartVariant, voltages: &PortVoltages) -> Result<f64, AnalysisError> {
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
