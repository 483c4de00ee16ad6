//! The same model on twice the segments, and where its equilibrium is about.

use super::super::statics::OperatingPoint;
use bimorph_model::compile::CompiledModel;
use bimorph_model::refine::doubling;
use bimorph_model::refine::transfer::carried;
use bimorph_multibody::planar::Pose;

/// Segments of all beams together up to which the side of a limit is sought.
pub(super) const MAX_NEAR_LIMIT: usize = 5000;

/// A model of twice the segments, and where its equilibrium is about.
pub struct Finer {
    /// The finer model.
    pub model: CompiledModel,
    /// Displacements near its equilibrium.
    pub start: Vec<Pose>,
}

/// See [`Finer`]; none where it would be too fine.
pub fn finer(compiled: &CompiledModel, point: &OperatingPoint) -> Option<Finer> {
    let model = compiled.with_order(doubling::twice(&compiled.options, &compiled.order)?).ok()?;
    let linear = model.parts.system.model.linear;
    let start = carried(&model.structure, &compiled.parts, &model.parts, &point.q, linear);
    Some(Finer { model, start })
}
