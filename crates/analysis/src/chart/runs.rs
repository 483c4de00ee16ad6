//! The runs of the precision and order parts, each with its reference.

use super::error::relative_error;
use super::spec::{Chart, ChartError, ChartPart, ChartPoint, ChartSpec, Formulation, RunMeasurement};
use super::variant::{ChartVariant, FormulationModels};
use crate::formulation::Formulation as Joints;
use crate::frame::{frame, frame_transient};
use crate::integrator::Integrator;
use crate::joint_transient::joint_transient;
use crate::transient::{TransientOptions, TransientResult, transient};
use crate::{AnalysisError, ProgressCallback};
use bimorph_solve::baseline::SolverKind;
use std::time::Instant;

/// Integrator of references.
const REFERENCE: Integrator = Integrator::Radau5;
/// Integrator that checks them.
const SECOND: Integrator = Integrator::Rodas4;
/// How much tighter than the tightest tolerance of the list a reference is.
const TIGHTER: f64 = 1e-2;

/// Counts runs, and reports progress.
pub(super) struct ChartProgress<'a> {
    pub(super) watch: ProgressCallback<'a>,
    pub(super) done: f64,
    pub(super) total: f64,
}

impl ChartProgress<'_> {
    /// Reports the progress of the current run; returns whether to continue.
    pub(super) fn run(&mut self, fraction: f64) -> bool {
        (self.watch)(((self.done + fraction) / self.total).min(1.0))
    }
}

/// Data shared by all runs of a chart.
pub(super) struct RunSeries<'a> {
    pub(super) spec: &'a ChartSpec,
    pub(super) stop: f64,
}

impl RunSeries<'_> {
    fn options<'a>(&self, model: &'a ChartVariant, method: Integrator, tol: f64) -> TransientOptions<'a> {
        TransientOptions {
            stop: self.stop,
            signals: self.spec.signals.clone(),
            points: self.spec.points,
            tol,
            voltages: self.spec.voltages.clone(),
            release: model.held(),
            method,
            ..TransientOptions::default()
        }
    }

    /// One run with its wall-clock time (s).
    fn run(
        &self,
        formulation: Formulation,
        model: &ChartVariant,
        (method, tol): (Integrator, f64),
        progress: &mut ChartProgress<'_>,
    ) -> Result<(TransientResult, f64), AnalysisError> {
        // a reference method may be unavailable in joint coordinates: then Rodas4
        let method = formulation.methods(&[method]).last().copied().unwrap_or(method);
        let options = self.options(model, method, tol);
        let begun = Instant::now();
        let result = match formulation {
            Formulation::Compliant => {
                transient(model.moving(), &options, &mut |_, _| {}, &mut |fraction| progress.run(fraction))
            }
            Formulation::Rcr | Formulation::RcrElastic => {
                let joints = if formulation == Formulation::Rcr { Joints::Rcr } else { Joints::RcrElastic };
                joint_transient(model.moving(), joints, &options, &mut |_, _| {}, &mut |f| progress.run(f)).map(|r| r.0)
            }
            Formulation::Frame => frame(model.moving()).and_then(|frame| {
                frame_transient(model.moving(), &frame, &options, &mut |fraction| progress.run(fraction))
            }),
        };
        progress.done += 1.0;
        Ok((result?, begun.elapsed().as_secs_f64()))
    }

    /// A run and its repeats: the result, or the reason for its failure.
    ///
    /// # Errors
    /// `Cancelled` only.
    fn point(
        &self,
        formulation: Formulation,
        model: &ChartVariant,
        choice: (Integrator, f64),
        progress: &mut ChartProgress<'_>,
    ) -> Result<Result<(TransientResult, f64), AnalysisError>, AnalysisError> {
        let mut seconds = Vec::with_capacity(self.spec.repeat);
        let mut kept = None;
        for _ in 0..self.spec.repeat {
            match self.run(formulation, model, choice, progress) {
                Ok((result, time)) => {
                    seconds.push(time);
                    kept = Some(result);
                }
                Err(AnalysisError::Cancelled) => return Err(AnalysisError::Cancelled),
                Err(error) => {
                    progress.done += (self.spec.repeat - seconds.len() - 1) as f64;
                    return Ok(Err(error));
                }
            }
        }
        let time = median(&mut seconds);
        kept.map(|result| Ok((result, time))).ok_or(AnalysisError::Cancelled)
    }
}

/// Methods and tolerances on one model.
pub(super) fn precision(
    models: &FormulationModels,
    request: &RunSeries<'_>,
    chart: &mut Chart,
    progress: &mut ChartProgress<'_>,
) -> Result<(), ChartError> {
    let spec = request.spec;
    let tight = TIGHTER * spec.tols.iter().copied().fold(f64::INFINITY, f64::min);
    for &formulation in &spec.formulations {
        let methods = formulation.methods(&spec.methods);
        if methods.is_empty() {
            continue;
        }
        let model = models.of(formulation);
        let bodies = models.bodies.moving();
        let mut push = |method: Integrator, tol: f64, unknowns: usize, point: ChartPoint| {
            chart.points.push(ChartPoint {
                part: ChartPart::Precision,
                formulation,
                method: method.name(),
                solver: SolverKind::Recursion.name(),
                tol,
                band_hz: bodies.options.band,
                unknowns,
                ..point
            });
        };
        let reference = match model {
            Ok(model) => request.run(formulation, model, (REFERENCE, tight), progress).map(|(found, _)| (model, found)),
            Err(reason) => Err(AnalysisError::NotConverged { detail: reason.to_owned() }),
        };
        let (model, reference) = match reference {
            Ok(found) => found,
            // what does not fit a formulation takes no chart from the others
            Err(error) if formulation != Formulation::Compliant && error != AnalysisError::Cancelled => {
                let reason = model.err().map_or_else(|| error.to_string(), str::to_owned);
                for method in methods {
                    for &tol in &spec.tols {
                        push(method, tol, bodies.parts.system.model.unknowns(), failed(reason.clone()));
                    }
                }
                continue;
            }
            Err(error) => return Err(error.into()),
        };
        let (second, _) = request.run(formulation, model, (SECOND, 10.0 * tight), progress)?;
        for method in methods {
            for &tol in &spec.tols {
                let found = request.point(formulation, model, (method, tol), progress)?;
                push(method, tol, reference.unknowns, compared(found, &reference));
            }
        }
        let apart = relative_error(&reference, &second);
        chart.reference_error = Some(chart.reference_error.unwrap_or(0.0).max(apart));
    }
    Ok(())
}

/// Models of growing order, against the finest.
pub(super) fn order(
    models: &[FormulationModels],
    request: &RunSeries<'_>,
    chart: &mut Chart,
    progress: &mut ChartProgress<'_>,
) -> Result<(), ChartError> {
    let spec = request.spec;
    let tol = spec.tols.iter().copied().fold(f64::INFINITY, f64::min);
    let Some(last) = models.len().checked_sub(1) else { return Ok(()) };
    let (finest, _) = request.run(Formulation::Compliant, &models[last].bodies, (REFERENCE, tol), progress)?;
    for &formulation in &spec.formulations {
        let method = formulation.methods(&[REFERENCE]).first().map_or("newmark", |m| m.name());
        let solver = if formulation == Formulation::Frame { SolverKind::Sparse } else { SolverKind::Recursion };
        for (k, models) in models.iter().enumerate() {
            if formulation == Formulation::Compliant && k == last {
                continue;
            }
            let bodies = models.bodies.moving();
            let (unknowns, point) = match models.of(formulation) {
                Ok(model) => {
                    let found = request.point(formulation, model, (REFERENCE, tol), progress)?;
                    let unknowns = found.as_ref().map_or(bodies.parts.system.model.unknowns(), |f| f.0.unknowns);
                    (unknowns, compared(found, &finest))
                }
                Err(reason) => (bodies.parts.system.model.unknowns(), failed(reason.to_owned())),
            };
            chart.points.push(ChartPoint {
                part: ChartPart::Order,
                formulation,
                method,
                solver: solver.name(),
                tol,
                band_hz: bodies.options.band,
                unknowns,
                ..point
            });
        }
    }
    Ok(())
}

/// A point without numbers; the rest is to be filled in.
const EMPTY: ChartPoint = ChartPoint {
    part: ChartPart::Precision,
    formulation: Formulation::Compliant,
    method: "",
    solver: "",
    tol: 0.0,
    band_hz: None,
    unknowns: 0,
    measured: None,
    failed: None,
};

/// A point with the reason why it has no numbers.
fn failed(reason: String) -> ChartPoint {
    ChartPoint { failed: Some(reason), ..EMPTY }
}

/// The numbers or the reason of a point; the rest is to be filled in.
fn compared(found: Result<(TransientResult, f64), AnalysisError>, reference: &TransientResult) -> ChartPoint {
    match found {
        Ok((result, seconds)) => {
            let error = relative_error(reference, &result);
            if !error.is_finite() {
                return failed("the motion is not finite".into());
            }
            let c = result.counters;
            let measured = RunMeasurement {
                error: Some(error),
                told: None,
                seconds,
                steps: c.steps,
                rejected: c.rejected,
                factorizations: c.factorizations,
                solves: c.solves,
                forces: c.forces,
                multiplications: None,
            };
            ChartPoint { measured: Some(measured), ..EMPTY }
        }
        Err(error) => failed(error.to_string()),
    }
}

/// The middle of the sorted values; 0 of none.
pub(super) fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}
