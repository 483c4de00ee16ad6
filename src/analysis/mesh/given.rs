//! An analysis on a mesh that was chosen for another variant of the same drawing: its result, with the estimate of its error,
//! and whether a search of this variant's own would have been content with it.
//!
//! The estimate is that of the search: for statics and pull-in the difference to twice the segments, for modes what the next
//! term of the beams' stiffness says. The result of the coarser mesh is that of the analysis, so that nothing is computed
//! twice.

use super::super::modes::{ModesResult, about_equilibrium, modes};
use super::super::pull_in::{PullInResult, pull_in};
use super::super::statics::{OperatingPoint, StaticResult, operating_point, result_at};
use super::super::{AnalysisError, PortVoltages};
use super::equilibrium::{self, told_of_static};
pub(crate) use super::finer::{Finer, finer};
use super::frequencies::{frequency_outputs, is_carried, is_fine, worst};
use super::meshed::meshed;
use super::pull_in::{pull_in_outputs, told_of_pull_in};
use super::{Request, fitted};
use crate::compile::Compiled;
use crate::netlist::Diagnostic;
use crate::refine::counted;
use crate::refine::doubling::{self, Output};

/// What an analysis found.
#[derive(Debug, Clone)]
pub(crate) enum Answer {
    /// Of [`Request::Static`].
    Static(StaticResult),
    /// Of [`Request::Modes`].
    Modes(ModesResult),
    /// Of [`Request::PullIn`].
    PullIn(PullInResult),
}

/// The result on a given mesh.
#[derive(Debug, Clone)]
pub(crate) struct Judged {
    /// The result.
    pub(crate) answer: Answer,
    /// Largest estimated relative error by the mesh [1]; none without an estimate.
    pub(crate) estimated_error: Option<f64>,
    /// What else is to be warned of, each with its code.
    pub(crate) warnings: Vec<String>,
    /// A search for this variant's own mesh would have stopped here.
    pub(crate) holds: bool,
}

/// The result of a request on the mesh of `compiled`.
///
/// # Errors
/// What the analysis has against the model.
pub(crate) fn judged(compiled: &Compiled, request: &Request<'_>) -> Result<Judged, AnalysisError> {
    match *request {
        Request::Static { voltages } => still(compiled, voltages),
        Request::Modes { count, voltages } => swinging(compiled, count, voltages),
        Request::PullIn { port, max } => closing(compiled, port, max),
    }
}

/// The result of a request on a mesh of its own.
///
/// # Errors
/// What the analysis has against the model.
pub(crate) fn searched(compiled: &Compiled, request: &Request<'_>) -> Result<Judged, AnalysisError> {
    let own = fitted(compiled, request)?;
    let (answer, warnings) = match *request {
        Request::Static { voltages } => {
            let point = operating_point(&own, voltages)?;
            let told = told_of_static(&own, &point);
            let result = result_at(&own, &point);
            let warnings = coded(told).into_iter().chain(result.told()).collect();
            (Answer::Static(result), warnings)
        }
        Request::Modes { count, voltages } => {
            let found = modes(&own, count, voltages)?;
            let warnings = found.warnings.clone();
            (Answer::Modes(found), warnings)
        }
        Request::PullIn { port, max } => {
            let found = pull_in(&own, port, max)?;
            let warnings = coded(told_of_pull_in(&own, &found)).into_iter().chain(found.told()).collect();
            (Answer::PullIn(found), warnings)
        }
    };
    Ok(Judged { answer, estimated_error: own.order.estimated_error, warnings, holds: true })
}

/// Warnings as a table has them.
fn coded(told: impl IntoIterator<Item = Diagnostic>) -> Vec<String> {
    told.into_iter().map(|d| format!("{}: {}", d.code, d.message)).collect()
}

/// Within the share of the tolerance that a comparison with twice the segments may use.
fn within(compiled: &Compiled, error: Option<f64>) -> bool {
    error.is_some_and(|error| error <= doubling::SAFETY * compiled.options.tol)
}

fn still(compiled: &Compiled, voltages: &PortVoltages) -> Result<Judged, AnalysisError> {
    let (point, estimated_error) = equilibrium::judged(compiled, voltages)?;
    Ok(judged_at(compiled, point, estimated_error))
}

/// The result where the equilibrium on the mesh of `compiled` is known, and that of twice the segments.
///
/// # Errors
/// What the analysis has against the model.
pub(crate) fn judged_static(
    compiled: &Compiled,
    voltages: &PortVoltages,
    point: OperatingPoint,
    finer: (Compiled, OperatingPoint),
) -> Result<Judged, AnalysisError> {
    let (point, estimated_error) = equilibrium::estimated_from(compiled, voltages, point, finer)?;
    Ok(judged_at(compiled, point, estimated_error))
}

fn judged_at(compiled: &Compiled, point: OperatingPoint, estimated_error: Option<f64>) -> Judged {
    let told = told_of_static(compiled, &point);
    let result = result_at(compiled, &point);
    let warnings = coded(told).into_iter().chain(result.told()).collect();
    let answer = Answer::Static(result);
    Judged { answer, estimated_error, warnings, holds: within(compiled, estimated_error) }
}

fn swinging(compiled: &Compiled, count: usize, voltages: &PortVoltages) -> Result<Judged, AnalysisError> {
    judged_modes(compiled, modes(compiled, count, voltages)?, count, voltages)
}

/// The same where the modes on the mesh of `compiled` are known.
///
/// # Errors
/// What the analysis has against the model.
pub(crate) fn judged_modes(
    compiled: &Compiled,
    found: ModesResult,
    count: usize,
    voltages: &PortVoltages,
) -> Result<Judged, AnalysisError> {
    // a mesh without so many modes says nothing about those that it lacks
    let all = found.frequencies_hz.len() == count;
    let own = worst(found.errors.iter().copied());
    let sure = own.is_some_and(|error| error <= counted::SAFETY * compiled.options.tol);
    let loaded = about_equilibrium(compiled, voltages);
    let moved = if loaded { equilibrium::judged(compiled, voltages)?.1 } else { Some(0.0) };
    let (own, sure) = match own {
        Some(_) if !is_fine(compiled) && (!loaded || (sure && is_carried(compiled, &found, moved))) => (own, sure),
        _ => doubled(compiled, &found, count, voltages)?,
    };
    let estimated_error = moved.zip(own).map(|(a, b)| a.max(b));
    let holds = all && sure && within(compiled, moved);
    let warnings = found.warnings.clone();
    Ok(Judged { answer: Answer::Modes(found), estimated_error, warnings, holds })
}

/// Frequencies compared with those of twice the segments.
fn doubled(
    compiled: &Compiled,
    found: &ModesResult,
    count: usize,
    voltages: &PortVoltages,
) -> Result<(Option<f64>, bool), AnalysisError> {
    let mut first = Some(frequency_outputs(found, count));
    let order = doubling::estimate(&compiled.options, compiled.order.segments.clone(), &mut |segments| {
        if let Some(known) = first.take() {
            return Ok(known);
        }
        let model = meshed(compiled, segments)?;
        Ok::<_, AnalysisError>(frequency_outputs(&modes(&model, count, voltages)?, count))
    })?;
    Ok((order.estimated_error, within(compiled, order.estimated_error)))
}

fn closing(compiled: &Compiled, port: Option<&str>, max: f64) -> Result<Judged, AnalysisError> {
    let found = pull_in(compiled, port, max)?;
    let mut first: Option<Vec<Output>> = Some(pull_in_outputs(&found));
    let order = doubling::estimate(&compiled.options, compiled.order.segments.clone(), &mut |segments| {
        if let Some(known) = first.take() {
            return Ok(known);
        }
        Ok::<_, AnalysisError>(pull_in_outputs(&pull_in(&*meshed(compiled, segments)?, port, max)?))
    })?;
    let estimated_error = order.estimated_error;
    let warnings = coded(told_of_pull_in(compiled, &found)).into_iter().chain(found.told()).collect();
    Ok(Judged { answer: Answer::PullIn(found), estimated_error, warnings, holds: within(compiled, estimated_error) })
}
