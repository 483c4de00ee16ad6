//! A model whose frame moves.

use super::options::TransientOptions;
use bimorph_domains::{Input, System};
use bimorph_model::compile::CompiledModel;
use std::sync::Arc;

/// The same model with the acceleration of its frame among its inputs; none without a shock.
pub(super) fn in_frame(compiled: &CompiledModel, options: &TransientOptions<'_>) -> Option<CompiledModel> {
    options.shock?;
    let mut framed = compiled.clone();
    let system = &compiled.parts.system;
    let mut inputs = system.electrics.inputs.clone();
    inputs.extend([0, 1].map(|axis| Input::Acceleration { axis }));
    framed.parts.system = System { electrics: Arc::new(system.electrics.with_inputs(inputs)), ..system.clone() };
    Some(framed)
}
