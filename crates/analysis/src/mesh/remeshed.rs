//! A model with other numbers of segments.

use super::super::AnalysisError;
use super::warnings::{WARNING, beyond};
use bimorph_base::Diagnostic;
use bimorph_model::compile::CompiledModel;
use bimorph_model::discretize::DiscretizeError;
use bimorph_model::refine::mesh_search::Mesh;
use std::borrow::Cow;

/// True where the number of segments is the user's.
pub(super) fn chosen(compiled: &CompiledModel) -> bool {
    compiled.options.segments.is_some()
}

/// The model on another mesh, with a warning where that does not hold the tolerance.
pub(super) fn on(compiled: &CompiledModel, order: Mesh) -> Result<CompiledModel, AnalysisError> {
    let mut fitted = remeshed(compiled, order)?;
    warn_of_mesh(&mut fitted);
    Ok(fitted)
}

/// The model on another mesh, without warnings.
pub(super) fn remeshed(compiled: &CompiledModel, order: Mesh) -> Result<CompiledModel, AnalysisError> {
    Ok(if order.segments == compiled.order.segments {
        CompiledModel { order, ..compiled.clone() }
    } else {
        let detail = |error: DiscretizeError| AnalysisError::NotConverged { detail: error.to_string() };
        compiled.with_order(order).map_err(detail)?
    })
}

/// Says so where the estimate of a mesh is beyond the tolerance, or missing: once, with the last estimate.
pub(super) fn warn_of_mesh(fitted: &mut CompiledModel) {
    fitted.warnings.items.retain(|d| d.code != WARNING);
    let Some(message) = beyond(fitted.options.errors(), fitted.order.estimated_error) else { return };
    let help =
        if chosen(fitted) { "leave --segments away, or take more" } else { "compare with --segments of your own" };
    fitted.warnings.items.push(Diagnostic::warning(WARNING, message, help));
}

/// The model with so many segments.
pub(in super::super) fn meshed<'a>(
    compiled: &'a CompiledModel,
    segments: &[usize],
) -> Result<Cow<'a, CompiledModel>, AnalysisError> {
    if segments == compiled.order.segments {
        return Ok(Cow::Borrowed(compiled));
    }
    let order = Mesh { segments: segments.to_vec(), ..compiled.order.clone() };
    let refused = |error: DiscretizeError| AnalysisError::NotConverged { detail: error.to_string() };
    compiled.with_order(order).map(Cow::Owned).map_err(refused)
}
