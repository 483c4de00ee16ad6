//! The reduced model of a session, or why it has the full one.

use bimorph_analysis::readout::PortKind;
use bimorph_analysis::reduced::circuit::CircuitReduction;
use bimorph_domains::System;
use bimorph_model::compile::{CompiledModel, Formulation};
use bimorph_solve::reduced::check::FullCheck;
use bimorph_solve::reduced::statics::ReducedStatics;
use std::sync::Arc;

/// The reduced model of a session with the storage of its equilibria.
#[derive(Debug)]
pub(crate) struct SessionReduction {
    pub(crate) model: Arc<CircuitReduction>,
    pub(crate) statics: ReducedStatics,
    pub(crate) check: FullCheck,
}

/// Ports of a session: names, sources and kinds.
pub(crate) type Ports<'a> = (&'a [String], &'a [usize], &'a [PortKind]);

impl SessionReduction {
    /// The reduced model that the options request for some ports, `known` if it was trained before; none where they request none. `shortest` is about the
    /// shortest time in which something moves (s).
    ///
    /// # Errors
    /// Why the session has the full model instead.
    pub(crate) fn requested(
        compiled: &CompiledModel,
        system: &System,
        (names, sources, kinds): Ports<'_>,
        (shaken, shortest): (bool, f64),
        known: Option<&Arc<CircuitReduction>>,
    ) -> Result<Option<Self>, String> {
        if compiled.options.formulation != Formulation::Reduced {
            return Ok(None);
        }
        if shaken {
            return Err("thermal agitation acts on every body".to_owned());
        }
        if kinds.contains(&PortKind::Rate) {
            return Err("a port turns the frame, and its Coriolis forces are not in a reduced model".to_owned());
        }
        let model = match known {
            Some(known) => Arc::clone(known),
            None => Arc::new(CircuitReduction::train(compiled, system, (names, sources), shortest)?),
        };
        Ok(Some(Self { statics: ReducedStatics::new(&model.space), check: FullCheck::new(system), model }))
    }
}
