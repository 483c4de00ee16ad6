//! Modes about the drawn geometry of many variants of one mechanism: in lanes where that is possible.
//!
//! All variants begin with the modes of one of them. A variant that differs from it in more than numbers, has any load,
//! or whose lane does not converge, gets `None`. [`super::modes`] then finds its modes or reports the error.

use super::PortVoltages;
use super::modes::{GUARDS, ModesResult, about_equilibrium, unloaded};
use bimorph_model::compile::CompiledModel;
use bimorph_model::refine::batch_mode_errors::{BatchVariant, LaneReference};
use bimorph_multibody::BodyMatrix;
use bimorph_multibody::batch::LANES;
use bimorph_multibody::planar::Pose;
use bimorph_solve::eigen::{Modes, RELIABLE, lowest_modes};
use bimorph_solve::frequency::batch::LaneModes;

/// Lanes for variants like one of them.
#[derive(Debug, Clone)]
pub struct BatchModes {
    lanes: LaneModes,
    reference: LaneReference,
    count: usize,
}

impl BatchModes {
    /// For the `count` lowest modes of variants like `first`; none where it has no lanes.
    pub fn new(first: &CompiledModel, count: usize, voltages: &PortVoltages) -> Option<Self> {
        if !at_rest(first, voltages) {
            return None;
        }
        let system = &first.parts.system;
        let (q, drive) = (vec![Pose::zeros(); system.bodies()], system.electrics.drive());
        let mut tangent = BodyMatrix::new(&system.model.pattern);
        system.tangent(&q, &drive, &mut tangent, &mut q.clone());
        let mut found: Modes = lowest_modes(system, (&q, &drive), &tangent, count + GUARDS).ok()?;
        let sound = found.lambda.len() == count + GUARDS && found.residuals.iter().all(|r| *r <= RELIABLE);
        found.shapes.truncate(count + GUARDS);
        let reference = LaneReference::new(drawn(first), found.shapes.len())?;
        let lanes = LaneModes::new(system, found.shapes).filter(|_| sound && !found.missed)?;
        Some(Self { lanes, reference, count })
    }

    /// The modes of each variant; none for one whose modes have to be found alone. Shapes of nodes are left out.
    pub fn results(&self, variants: &[&CompiledModel], voltages: &PortVoltages) -> Vec<Option<ModesResult>> {
        let mut results: Vec<Option<ModesResult>> = vec![None; variants.len()];
        let fits = |&k: &usize| at_rest(variants[k], voltages) && self.lanes.fits(&variants[k].parts.system);
        let able: Vec<usize> = (0..variants.len()).filter(fits).collect();
        if able.is_empty() {
            return results;
        }
        let (mut lanes, mut reference) = (self.lanes.clone(), self.reference.clone());
        for some in able.chunks(LANES) {
            let systems: Vec<_> = some.iter().map(|&k| &variants[k].parts.system).collect();
            let found = lanes.find(&systems, self.count);
            let some_drawn: Vec<_> = some.iter().map(|&k| drawn(variants[k])).collect();
            let errors = reference.compare(&lanes, &some_drawn);
            for ((&k, found), errors) in some.iter().zip(found).zip(errors) {
                results[k] = found.zip(errors).map(|(found, errors)| unloaded(variants[k], self.count, found, errors));
            }
        }
        results
    }
}

fn drawn(compiled: &CompiledModel) -> BatchVariant<'_> {
    (&compiled.structure, &compiled.options, &compiled.parts)
}

/// True where nothing acts on the drawn geometry.
fn at_rest(compiled: &CompiledModel, voltages: &PortVoltages) -> bool {
    let system = &compiled.parts.system;
    !about_equilibrium(compiled, voltages)
        && system.model.loose().next().is_none()
        && !system.is_acted_on_as_drawn(&system.electrics.drive())
        && system.electrics.inputs.is_empty()
}
