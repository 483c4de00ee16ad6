//! The runs of the precision and order parts, each with its reference.

use super::error::relative_error;
use super::variant::Variant;
use super::{Chart, ChartError, ChartPoint, ChartSpec, Formulation, Measured, Part};
use crate::analysis::formulation::Formulation as Joints;
use crate::analysis::frame::{frame, frame_transient};
use crate::analysis::integrator::Integrator;
use crate::analysis::joint_transient::joint_transient;
use crate::analysis::transient::{TransientOptions, TransientResult, transient};
use crate::analysis::{AnalysisError, Watch};
use crate::solve::baseline::SolverKind;
use std::time::Instant;

/// What integrates references.
const REFERENCE: Integrator = Integrator::Radau5;
/// What checks them.
const SECOND: Integrator = Integrator::Rodas4;
/// How much tighter than the tightest tolerance of the list a reference is.
const TIGHTER: f64 = 1e-2;

/// Counts runs, and tells the watch.
pub(super) struct Progress<'a> {
    pub(super) watch: Watch<'a>,
    pub(super) done: f64,
    pub(super) total: f64,
}

impl Progress<'_> {
    /// Tells how far the present run has come; answers whether to go on.
    pub(super) fn run(&mut self, fraction: f64) -> bool {
        (self.watch)(((self.done + fraction) / self.total).min(1.0))
    }
}

/// What all runs of a chart share.
pub(super) struct Request<'a> {
    pub(super) spec: &'a ChartSpec,
    pub(super) stop: f64,
}

impl Request<'_> {
    fn options<'a>(&self, model: &'a Variant, method: Integrator, tol: f64) -> TransientOptions<'a> {
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

    /// One run with its wall-clock time [s].
    fn run(
        &self,
        formulation: Formulation,
        model: &Variant,
        (method, tol): (Integrator, f64),
        progress: &mut Progress<'_>,
    ) -> Result<(TransientResult, f64), AnalysisError> {
        // references are asked for by a method that joint coordinates may not have: then Rodas4
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

    /// A run and its repeats: the result, or the reason why there is none.
    ///
    /// # Errors
    /// `Cancelled` only.
    fn point(
        &self,
        formulation: Formulation,
        model: &Variant,
        choice: (Integrator, f64),
        progress: &mut Progress<'_>,
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
    model: &Variant,
    request: &Request<'_>,
    chart: &mut Chart,
    progress: &mut Progress<'_>,
) -> Result<(), ChartError> {
    let spec = request.spec;
    let tight = TIGHTER * spec.tols.iter().copied().fold(f64::INFINITY, f64::min);
    for &formulation in &spec.formulations {
        let methods = formulation.methods(&spec.methods);
        if methods.is_empty() {
            continue;
        }
        let (reference, _) = request.run(formulation, model, (REFERENCE, tight), progress)?;
        let (second, _) = request.run(formulation, model, (SECOND, 10.0 * tight), progress)?;
        let apart = relative_error(&reference, &second);
        chart.reference_error = Some(chart.reference_error.unwrap_or(0.0).max(apart));
        for method in methods {
            for &tol in &spec.tols {
                let found = request.point(formulation, model, (method, tol), progress)?;
                chart.points.push(ChartPoint {
                    part: Part::Precision,
                    formulation,
                    method: method.name(),
                    solver: SolverKind::Recursion.name(),
                    tol,
                    band_hz: model.moving().options.band,
                    unknowns: reference.unknowns,
                    ..compared(found, &reference)
                });
            }
        }
    }
    Ok(())
}

/// Models of growing order, against the finest.
pub(super) fn order(
    models: &[Variant],
    request: &Request<'_>,
    chart: &mut Chart,
    progress: &mut Progress<'_>,
) -> Result<(), ChartError> {
    let spec = request.spec;
    let tol = spec.tols.iter().copied().fold(f64::INFINITY, f64::min);
    let Some(last) = models.len().checked_sub(1) else { return Ok(()) };
    let (finest, _) = request.run(Formulation::Compliant, &models[last], (REFERENCE, tol), progress)?;
    for &formulation in &spec.formulations {
        let method = formulation.methods(&[REFERENCE]).first().map_or("newmark", |m| m.name());
        let solver = if formulation == Formulation::Frame { SolverKind::Sparse } else { SolverKind::Recursion };
        for (k, model) in models.iter().enumerate() {
            if formulation == Formulation::Compliant && k == last {
                continue;
            }
            let found = request.point(formulation, model, (REFERENCE, tol), progress)?;
            let unknowns = found.as_ref().map_or(model.moving().parts.system.model.unknowns(), |f| f.0.unknowns);
            chart.points.push(ChartPoint {
                part: Part::Order,
                formulation,
                method,
                solver: solver.name(),
                tol,
                band_hz: model.moving().options.band,
                unknowns,
                ..compared(found, &finest)
            });
        }
    }
    Ok(())
}

/// The numbers or the reason of a point; the rest is to be filled in.
fn compared(found: Result<(TransientResult, f64), AnalysisError>, reference: &TransientResult) -> ChartPoint {
    let empty = ChartPoint {
        part: Part::Precision,
        formulation: Formulation::Compliant,
        method: "",
        solver: "",
        tol: 0.0,
        band_hz: None,
        unknowns: 0,
        measured: None,
        failed: None,
    };
    match found {
        Ok((result, seconds)) => {
            let error = relative_error(reference, &result);
            if !error.is_finite() {
                return ChartPoint { failed: Some("the motion is not finite".into()), ..empty };
            }
            let c = result.counters;
            let measured = Measured {
                error: Some(error),
                seconds,
                steps: c.steps,
                rejected: c.rejected,
                factorizations: c.factorizations,
                solves: c.solves,
                forces: c.forces,
                multiplications: None,
            };
            ChartPoint { measured: Some(measured), ..empty }
        }
        Err(error) => ChartPoint { failed: Some(error.to_string()), ..empty },
    }
}

/// The middle of the sorted values; 0 of none.
pub(super) fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}
