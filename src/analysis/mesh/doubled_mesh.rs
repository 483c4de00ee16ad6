//! The same model on twice the segments, and where its equilibrium is about.

use super::super::statics::OperatingPoint;
use crate::compile::CompiledModel;
use crate::multibody::planar::Pose;
use crate::refine::doubling;
use crate::refine::transfer::carried;

/// Segments of all beams together up to which the side of a limit is sought.
pub(super) const MAX_NEAR_LIMIT: usize = 5000;

/// A model of twice the segments, and where its equilibrium is about.
pub(crate) struct Finer {
    pub(crate) model: CompiledModel,
    pub(crate) start: Vec<Pose>,
}

/// See [`Finer`]; none where it would be too fine.
pub(crate) fn finer(compiled: &CompiledModel, point: &OperatingPoint) -> Option<Finer> {
    let model = compiled.with_order(doubling::twice(&compiled.options, &compiled.order)?).ok()?;
    let linear = model.parts.system.model.linear;
    let start = carried(&model.structure, &compiled.parts, &model.parts, &point.q, linear);
    Some(Finer { model, start })
}
