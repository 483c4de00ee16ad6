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
pub use super::doubled_mesh::{Finer, finer};
use super::equilibrium::{self, static_warnings};
use super::frequencies::{frequency_outputs, is_carried, is_fine, worst};
use super::pull_in::{pull_in_outputs, pull_in_warnings};
use super::remeshed::meshed;
use super::{MeshRequest, fitted};
use bimorph_base::Diagnostic;
use bimorph_model::compile::CompiledModel;
use bimorph_model::refine::doubling::{self, Output};

/// Result of an analysis.
#[derive(Debug, Clone)]
pub enum AnalysisResult {
    /// Of [`MeshRequest::Static`].
    Static(StaticResult),
    /// Of [`MeshRequest::Modes`].
    Modes(ModesResult),
    /// Of [`MeshRequest::PullIn`].
    PullIn(PullInResult),
}

/// The result on a given mesh.
#[derive(Debug, Clone)]
pub struct Assessment {
    /// The result.
    pub answer: AnalysisResult,
    /// Largest estimated relative error by the mesh (1); none without an estimate.
    pub estimated_error: Option<f64>,
    /// Further warnings, each with its code.
    pub warnings: Vec<String>,
    /// A search for this variant's own mesh would have stopped here.
    pub holds: bool,
}

/// The result of a request on the mesh of `compiled`.
///
/// # Errors
/// Errors of the analysis.
pub fn assess(compiled: &CompiledModel, request: &MeshRequest<'_>) -> Result<Assessment, AnalysisError> {
    match *request {
        MeshRequest::Static { voltages } => assess_static(compiled, voltages),
        MeshRequest::Modes { count, voltages } => assess_modes(compiled, count, voltages),
        MeshRequest::PullIn { port, max } => assess_pull_in(compiled, port, max),
    }
}

/// The result of a request on a mesh of its own.
///
/// # Errors
/// Errors of the analysis.
pub fn refine_and_assess(compiled: &CompiledModel, request: &MeshRequest<'_>) -> Result<Assessment, AnalysisError> {
    let own = fitted(compiled, request)?;
    let (answer, warnings) = match *request {
        MeshRequest::Static { voltages } => {
            let point = operating_point(&own, voltages)?;
            let reported = static_warnings(&own, &point);
            let result = result_at(&own, &point);
            let warnings = coded(reported).into_iter().chain(result.notes()).collect();
            (AnalysisResult::Static(result), warnings)
        }
        MeshRequest::Modes { count, voltages } => {
            let found = modes(&own, count, voltages)?;
            let warnings = found.warnings.clone();
            (AnalysisResult::Modes(found), warnings)
        }
        MeshRequest::PullIn { port, max } => {
            let found = pull_in(&own, port, max)?;
            let warnings = coded(pull_in_warnings(&own, &found)).into_iter().chain(found.notes()).collect();
            (AnalysisResult::PullIn(found), warnings)
        }
    };
    Ok(Assessment { answer, estimated_error: own.order.estimated_error, warnings, holds: true })
}

/// Warnings as a table has them.
fn coded(reported: impl IntoIterator<Item = Diagnostic>) -> Vec<String> {
    reported.into_iter().map(|d| format!("{}: {}", d.code, d.message)).collect()
}

/// Within the share of the tolerance that a comparison with twice the segments may use.
fn within(compiled: &CompiledModel, error: Option<f64>) -> bool {
    error.is_some_and(|error| error <= compiled.options.errors().comparison())
}

fn assess_static(compiled: &CompiledModel, voltages: &PortVoltages) -> Result<Assessment, AnalysisError> {
    let (point, estimated_error) = equilibrium::assess(compiled, voltages)?;
    Ok(assess_point(compiled, point, estimated_error))
}

/// The result where the equilibrium on the mesh of `compiled` is known, and that of twice the segments.
///
/// # Errors
/// Errors of the analysis.
pub fn assess_found_static(
    compiled: &CompiledModel,
    voltages: &PortVoltages,
    point: OperatingPoint,
    finer: (CompiledModel, OperatingPoint),
) -> Result<Assessment, AnalysisError> {
    let (point, estimated_error) = equilibrium::estimated_from(compiled, voltages, point, finer)?;
    Ok(assess_point(compiled, point, estimated_error))
}

fn assess_point(compiled: &CompiledModel, point: OperatingPoint, estimated_error: Option<f64>) -> Assessment {
    let reported = static_warnings(compiled, &point);
    let result = result_at(compiled, &point);
    let warnings = coded(reported).into_iter().chain(result.notes()).collect();
    let answer = AnalysisResult::Static(result);
    Assessment { answer, estimated_error, warnings, holds: within(compiled, estimated_error) }
}

fn assess_modes(compiled: &CompiledModel, count: usize, voltages: &PortVoltages) -> Result<Assessment, AnalysisError> {
    assess_found_modes(compiled, modes(compiled, count, voltages)?, count, voltages)
}

/// The same where the modes on the mesh of `compiled` are known.
///
/// # Errors
/// Errors of the analysis.
pub fn assess_found_modes(
    compiled: &CompiledModel,
    found: ModesResult,
    count: usize,
    voltages: &PortVoltages,
) -> Result<Assessment, AnalysisError> {
    // a mesh without so many modes says nothing about those that it lacks
    let all = found.frequencies_hz.len() == count;
    let own = worst(found.errors.iter().copied());
    let sure = own.is_some_and(|error| error <= compiled.options.errors().modes());
    let loaded = about_equilibrium(compiled, voltages);
    let moved = if loaded { equilibrium::assess(compiled, voltages)?.1 } else { Some(0.0) };
    let (own, sure) = match own {
        Some(_) if !is_fine(compiled) && (!loaded || (sure && is_carried(compiled, &found, moved))) => (own, sure),
        _ => doubled(compiled, &found, count, voltages)?,
    };
    let estimated_error = moved.zip(own).map(|(a, b)| a.max(b));
    let holds = all && sure && within(compiled, moved);
    let warnings = found.warnings.clone();
    Ok(Assessment { answer: AnalysisResult::Modes(found), estimated_error, warnings, holds })
}

/// Frequencies compared with those of twice the segments.
fn doubled(
    compiled: &CompiledModel,
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

fn assess_pull_in(compiled: &CompiledModel, port: Option<&str>, max: f64) -> Result<Assessment, AnalysisError> {
    let found = pull_in(compiled, port, max)?;
    let mut first: Option<Vec<Output>> = Some(pull_in_outputs(&found));
    let order = doubling::estimate(&compiled.options, compiled.order.segments.clone(), &mut |segments| {
        if let Some(known) = first.take() {
            return Ok(known);
        }
        Ok::<_, AnalysisError>(pull_in_outputs(&pull_in(&*meshed(compiled, segments)?, port, max)?))
    })?;
    let estimated_error = order.estimated_error;
    let warnings = coded(pull_in_warnings(compiled, &found)).into_iter().chain(found.notes()).collect();
    Ok(Assessment {
        answer: AnalysisResult::PullIn(found),
        estimated_error,
        warnings,
        holds: within(compiled, estimated_error),
    })
}
