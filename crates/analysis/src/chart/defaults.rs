//! Requested against obtained accuracy: default analyses by their tolerance alone, each against one of a tenth of the
//! tightest.
//!
//! Every point is the analysis as a command runs it: from the structure, with the mesh that it chooses, and with its
//! own error estimate. The static equilibrium is that under the loads and voltages of the run, and the modes are those
//! about where the run goes to. Errors are those of the worst node relative to its own displacement (or a thirtieth of
//! the largest), of the worst mode, and of runs as elsewhere ([`relative_error`]).

use super::error::SMALL;
use super::error::relative_error;
use super::runs::ChartProgress;
use super::spec::{Chart, ChartError, ChartPart, ChartPoint, ChartSpec, Formulation, RunMeasurement};
use super::variant::ChartVariant;
use crate::NodeMotion;
use crate::chosen_run::{FittedRun, run_as_chosen};
use crate::integrator::Integrator;
use crate::mesh::{modes_fitted, static_fitted};
use crate::step_error::with_step_error;
use crate::transient::{TransientOptions, TransientResult, transient};
use crate::{AnalysisError, ProgressCallback};
use bimorph_model::compile::CompileOptions;
use bimorph_solve::baseline::SolverKind;
use bimorph_structure::FrontEnd;
use std::time::Instant;

/// Modes that are compared.
const COUNT: usize = 5;
/// How much tighter than the tightest tolerance of the list a reference is.
const TIGHTER: f64 = 0.1;
/// Analyses.
pub(super) const ANALYSES: [&str; 3] = ["static", "modes", "tran"];

/// Output of an analysis.
enum AnalysisOutput {
    Nodes(Vec<(String, NodeMotion)>),
    Frequencies(Vec<f64>),
    Run(Box<TransientResult>),
}

/// One analysis: its output, its error estimate, and its work.
struct CompletedAnalysis {
    found: AnalysisOutput,
    told: Option<f64>,
    unknowns: usize,
    measured: RunMeasurement,
}

/// The points of every analysis and tolerance.
///
/// # Errors
/// Those of a reference; a point that fails says so.
pub(super) fn defaults(
    (source, options): (&dyn FrontEnd, &CompileOptions),
    (spec, stop): (&ChartSpec, f64),
    chart: &mut Chart,
    progress: &mut ChartProgress<'_>,
) -> Result<(), ChartError> {
    let tight = TIGHTER * spec.tols.iter().copied().fold(f64::INFINITY, f64::min);
    for analysis in ANALYSES {
        let mut at = |tol: f64| {
            let done = analyse((source, options), (spec, stop), analysis, tol, &mut |f| progress.run(f));
            progress.done += 1.0;
            if progress.run(0.0) { done } else { Err(AnalysisError::Cancelled.into()) }
        };
        let point = |tol: f64| ChartPoint {
            part: ChartPart::Defaults,
            formulation: Formulation::Compliant,
            method: analysis,
            solver: SolverKind::Recursion.name(),
            tol,
            band_hz: options.band,
            unknowns: 0,
            measured: None,
            failed: None,
        };
        let reference = match at(tight) {
            Ok(reference) if is_motionless(&reference.found) => {
                let still = |&tol| ChartPoint { failed: Some("nothing moves".to_owned()), ..point(tol) };
                chart.points.extend(spec.tols.iter().map(still));
                progress.done += spec.tols.len() as f64;
                continue;
            }
            Err(error @ ChartError::Analysis(AnalysisError::Cancelled)) => return Err(error),
            reference => reference,
        };
        for &tol in &spec.tols {
            let compared = match (&reference, at(tol)) {
                (_, Err(error @ ChartError::Analysis(AnalysisError::Cancelled))) => return Err(error),
                (Err(error), _) => Err(format!("the reference: {error}")),
                (_, Err(error)) => Err(error.to_string()),
                (Ok(reference), Ok(done)) => Ok(CompletedAnalysis {
                    measured: RunMeasurement {
                        error: Some(apart(&reference.found, &done.found)),
                        told: done.told,
                        ..done.measured
                    },
                    ..done
                }),
            };
            chart.points.push(match compared {
                Ok(done) => ChartPoint { unknowns: done.unknowns, measured: Some(done.measured), ..point(tol) },
                Err(reason) => ChartPoint { failed: Some(reason), ..point(tol) },
            });
        }
    }
    Ok(())
}

/// One analysis from the drawing at one tolerance.
fn analyse(
    (source, options): (&dyn FrontEnd, &CompileOptions),
    (spec, stop): (&ChartSpec, f64),
    analysis: &str,
    tol: f64,
    watch: ProgressCallback<'_>,
) -> Result<CompletedAnalysis, ChartError> {
    let begun = Instant::now();
    let options = options.with_tolerance(tol);
    let drawn = ChartVariant::new(source, &options, options.band, spec.release.as_deref())?;
    let mut measured = RunMeasurement::default();
    let (found, told, unknowns) = match analysis {
        "static" => {
            let (fitted, result, _) = static_fitted(drawn.held().unwrap_or(drawn.moving()), &spec.voltages)?;
            (AnalysisOutput::Nodes(result.nodes), fitted.order.estimated_error, result.unknowns)
        }
        "modes" => {
            let (fitted, result, _) = modes_fitted(drawn.moving(), COUNT, &spec.voltages)?;
            (AnalysisOutput::Frequencies(result.frequencies_hz), fitted.order.estimated_error, result.unknowns)
        }
        _ => {
            let asked = TransientOptions {
                stop,
                signals: spec.signals.clone(),
                points: spec.points,
                tol,
                voltages: spec.voltages.clone(),
                release: drawn.held(),
                method: Integrator::default(),
                ..TransientOptions::default()
            };
            let mut attempt = |FittedRun { moving, start, .. }: FittedRun,
                               sample: &mut dyn FnMut(f64, &[f64]),
                               watch: ProgressCallback<'_>| {
                let asked = asked.with_release(start.as_ref());
                let mut run = |options: &TransientOptions<'_>,
                               sample: &mut dyn FnMut(f64, &[f64]),
                               watch: ProgressCallback<'_>| {
                    transient(&moving, options, sample, watch).map(|r| (r, ()))
                };
                with_step_error(&asked, &moving, &mut run, sample, watch)
            };
            let (result, ()) = run_as_chosen(drawn.moving(), &asked, &mut attempt, &mut |_, _| (), watch)?;
            let c = result.counters;
            measured = RunMeasurement {
                steps: c.steps,
                rejected: c.rejected,
                factorizations: c.factorizations,
                solves: c.solves,
                forces: c.forces,
                ..measured
            };
            let told = result.estimated_error.map(|mesh| mesh.max(result.step_error.unwrap_or(0.0)));
            let unknowns = result.unknowns;
            (AnalysisOutput::Run(Box::new(result)), told, unknowns)
        }
    };
    measured.seconds = begun.elapsed().as_secs_f64();
    Ok(CompletedAnalysis { found, told, unknowns, measured })
}

/// Nothing moves: nothing to compare.
fn is_motionless(found: &AnalysisOutput) -> bool {
    match found {
        AnalysisOutput::Nodes(nodes) => nodes.iter().all(|(_, m)| m.x == 0.0 && m.y == 0.0),
        AnalysisOutput::Frequencies(frequencies) => frequencies.is_empty(),
        AnalysisOutput::Run(run) => run.signals.iter().all(|(_, _, values)| values.iter().all(|v| *v == values[0])),
    }
}

/// The relative error of one result against another.
fn apart(reference: &AnalysisOutput, found: &AnalysisOutput) -> f64 {
    match (reference, found) {
        (AnalysisOutput::Nodes(want), AnalysisOutput::Nodes(got)) => {
            let size = |m: &NodeMotion| m.x.hypot(m.y);
            let largest = want.iter().map(|(_, m)| size(m)).fold(0.0, f64::max);
            let one = |((_, w), (_, g)): (&(String, NodeMotion), &(String, NodeMotion))| {
                (w.x - g.x).hypot(w.y - g.y) / size(w).max(SMALL * largest)
            };
            want.iter().zip(got).map(one).fold(0.0, f64::max)
        }
        (AnalysisOutput::Frequencies(want), AnalysisOutput::Frequencies(got)) if want.len() == got.len() => {
            want.iter().zip(got).map(|(w, g)| (g / w - 1.0).abs()).fold(0.0, f64::max)
        }
        (AnalysisOutput::Run(want), AnalysisOutput::Run(got)) => relative_error(want, got),
        _ => f64::INFINITY,
    }
}
