//! Rotary inertia of sections in runs whose parts may touch.
//!
//! Sections of beams have no rotary inertia by default (docs/explanation/junctions.md): next to the lowest frequencies theirs is
//! negligible. An impact is no such motion. A section without inertia that a contact pushes follows the force at once,
//! so that no step is short enough where the force depends on its rate: steps fell to 1e-21 s. In time, models whose
//! parts may touch, or do in the state to which the run goes, therefore have it, and points without mass that contacts act on have some
//! (`bimorph_model::discretize`).

use super::super::AnalysisError;
use bimorph_model::compile::CompiledModel;
use bimorph_model::discretize::DiscretizeError;
use std::borrow::Cow;

/// The model, with the inertia of its sections where parts may touch, or a run comes to rest in contact.
pub(super) fn with_section_inertia(
    compiled: &CompiledModel,
    rests_in_contact: bool,
) -> Result<Cow<'_, CompiledModel>, AnalysisError> {
    let options = &compiled.options;
    let system = &compiled.parts.system;
    let bends = compiled.order.segments.iter().any(|n| *n > 0);
    let lacks = bends || system.model.bodies.iter().any(|body| body.mass == 0.0);
    if options.rotary_inertia || options.as_sugar || !lacks || !(rests_in_contact || system.may_touch()) {
        return Ok(Cow::Borrowed(compiled));
    }
    let model = CompiledModel { options: options.with_rotary_inertia(), ..compiled.clone() };
    let refused = |error: DiscretizeError| AnalysisError::NotConverged { detail: error.to_string() };
    let model = model.with_order(compiled.order.clone()).map_err(refused)?;
    Ok(Cow::Owned(CompiledModel { lowest: compiled.lowest, ..model }))
}
