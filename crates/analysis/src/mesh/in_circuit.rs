//! The mesh of a model in a circuit, whose voltages come while it runs: that for what is known before, the equilibrium under the loads of the
//! drawing and the lowest modes about it, which steps and pulses excite most.

use super::super::AnalysisError;
use super::super::modes::{higher, lowest};
use super::equilibrium;
use super::frequencies::for_modes;
use super::remeshed::{chosen, remeshed};
use super::section_inertia::with_section_inertia;
use super::warnings::{WARNING, beyond};
use bimorph_base::budget::bounded;
use bimorph_base::{Diagnostic, ErrorBudget};
use bimorph_model::compile::CompiledModel;
use bimorph_model::refine::mesh_search::Mesh;

/// Unknowns of the finest mesh that is taken, and of the largest drawing for which one is sought: a circuit is not to wait for it. Meshes
/// that it is compared with may have twice as many.
const MAX_UNKNOWNS: usize = 3000;

/// Modes whose errors are followed over a run.
const FOLLOWED: usize = 12;

/// Modes that the mesh holds.
const HELD: usize = 3;

/// The model for a circuit, on a mesh that holds the tolerance for the equilibrium under the loads of the drawing,
/// without any voltage, and for the three lowest modes about it; no coarser anywhere than it was. Where segments or a
/// band are given the mesh stays; where that mesh would be too fine it is one that holds ten, a hundred or a thousand
/// times the tolerance. A warning reports an error of one of the two beyond the tolerance. Effects of voltages are
/// unknown here.
pub fn in_circuit(compiled: &CompiledModel) -> CompiledModel {
    let turning = with_section_inertia(compiled, false);
    let compiled = turning.as_deref().unwrap_or(compiled);
    let given = chosen(compiled) || compiled.options.band.is_some();
    let drawn = compiled.parts.system.model.unknowns();
    if compiled.order.segments.is_empty() {
        return compiled.clone();
    }
    if drawn > MAX_UNKNOWNS {
        return warned(compiled.clone(), "a drawing of so many unknowns", None);
    }
    let finer =
        if given { None } else { compiled.options.errors().relaxed().find_map(|errors| within_most(compiled, errors)) };
    let sought = finer.as_ref().and_then(|finer| finer.order.estimated_error);
    let mut fitted = finer.unwrap_or_else(|| compiled.clone());
    fitted.lowest =
        bounded(2 * MAX_UNKNOWNS, || lowest(&fitted, || twice(&fitted, fitted.options.errors().requested()).ok()))
            .flatten();
    fitted.higher = bounded(2 * MAX_UNKNOWNS, || higher(&fitted, FOLLOWED)).unwrap_or_default().into();
    let compared = if sought.is_some() { None } else { bounded(2 * MAX_UNKNOWNS, || worse(&fitted)) };
    match (sought, compared) {
        (Some(error), _) => warned(fitted, "the equilibrium without voltages or one of the lowest modes", Some(error)),
        (None, Some(Some((what, error)))) => warned(fitted, what, Some(error)),
        // neither exists: the analysis itself will report the error
        (None, Some(None)) => fitted,
        // nothing that is fine enough to be compared with may be laid out
        (None, None) => warned(fitted, "the equilibrium and the lowest modes", None),
    }
}

/// Adds a warning if the estimated error exceeds `tol` or is unknown.
fn warned(mut fitted: CompiledModel, what: &str, error: Option<f64>) -> CompiledModel {
    let help = "give the model `segments` or a `band`; `bimorph cosim --check` compares whole runs";
    let reported = beyond(fitted.options.errors(), error);
    fitted
        .warnings
        .items
        .extend(reported.map(|reported| Diagnostic::warning(WARNING, format!("{what}: {reported}"), help)));
    fitted
}

/// The model on twice the segments of every beam, for steps with another tolerance: the reference of a run.
///
/// # Errors
/// [`AnalysisError::NotConverged`] where there is no such mesh.
pub fn twice(compiled: &CompiledModel, tol: f64) -> Result<CompiledModel, AnalysisError> {
    let scheme = compiled.options.scheme;
    let twice = |&n: &usize| if n == 0 { 0 } else { scheme.segments(2 * n) };
    let segments = compiled.order.segments.iter().map(twice).collect();
    let finer = remeshed(compiled, Mesh { segments, estimated_error: None, ..compiled.order.clone() })?;
    Ok(finer.with_tolerance(tol))
}

/// The model on the mesh that holds another tolerance, where that is not too fine.
fn within_most(compiled: &CompiledModel, errors: ErrorBudget) -> Option<CompiledModel> {
    let asked = compiled.with_tolerance(errors.requested());
    let found =
        bounded(2 * MAX_UNKNOWNS, || sought(&asked)).flatten().filter(|finer| finer.unknowns() <= MAX_UNKNOWNS)?;
    Some(found.with_tolerance(compiled.options.errors().requested()))
}

/// The model on the mesh for both; none where there is no such equilibrium or mode.
fn sought(compiled: &CompiledModel) -> Option<CompiledModel> {
    let (moving, _) = for_modes(compiled, HELD, &[]).ok()?;
    let drawn = &compiled.order.segments;
    let least = moving.segments.iter().zip(drawn).map(|(moving, drawn)| *moving.max(drawn)).collect();
    let (still, _) = equilibrium::order(compiled, &[], least).ok()?;
    let worst = |a: Option<f64>, b: Option<f64>| Some(a?.abs().max(b?.abs()));
    let estimated_error = worst(moving.estimated_error, still.estimated_error);
    remeshed(compiled, Mesh { estimated_error, ..still }).ok()
}

/// Which of the two is further off on this mesh, and by how much; none where neither is known.
fn worse(compiled: &CompiledModel) -> Option<(&'static str, f64)> {
    // an equilibrium without an estimate has an unknown error
    let still = equilibrium::assess(compiled, &[]).ok().map(|(_, error)| error.unwrap_or(f64::INFINITY));
    [("the equilibrium without voltages", still), ("the lowest mode", compiled.lowest.map(|lowest| lowest.error))]
        .into_iter()
        .filter_map(|(what, error)| Some((what, error?.abs())))
        .max_by(|a, b| a.1.total_cmp(&b.1))
}
