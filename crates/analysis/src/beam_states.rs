//! Section forces, stress and strain energy of each beam in an equilibrium.
//!
//! A joint in the middle of a segment bears f = (N, V, M) and stores ½·fᵀ·K⁻¹·f, with K its stiffness. The energy of a beam is the sum over its
//! joints; the forces are those of the joint where the stress on its faces is largest.

use super::statics::OperatingPoint;
use crate::readout::stress;
use bimorph_model::compile::CompiledModel;
use bimorph_multibody::forces;
use serde::Serialize;

/// State of a beam in an equilibrium.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct BeamState {
    /// Normal force where the stress is largest, positive: tension (N).
    pub normal_n: f64,
    /// Shear force there (N).
    pub shear_n: f64,
    /// Bending moment there (N·m).
    pub moment_nm: f64,
    /// Largest stress on its faces (Pa).
    pub stress_pa: f64,
    /// Strain energy (J).
    pub energy_j: f64,
}

/// The state of every beam, in the order of the structure; none of a beam with rigid directions, whose forces do not follow from strains.
pub fn beam_states(compiled: &CompiledModel, point: &OperatingPoint) -> Vec<Option<BeamState>> {
    let model = &compiled.parts.system.model;
    let heating = &compiled.parts.system.electrics.heating;
    let expansion = |k: usize| heating.strain(k, &point.rise);
    let one = |(beam, stressed): (usize, &bimorph_model::discretize::stressed::StressedBeam)| {
        if stressed.rigid {
            return None;
        }
        let worst = stress::largest(compiled, beam, &point.q, &point.rise)?;
        let energy = stressed.joints.iter().map(|&(k, _)| {
            let joint = &model.joints[k as usize];
            let force = forces::resultants(model, joint, &point.q, 1.0, expansion);
            let strain = model.joint(k as usize).stiffness.try_inverse().map(|inverse| inverse * force);
            strain.map_or(0.0, |strain| 0.5 * force.dot(&strain))
        });
        let [normal_n, shear_n, moment_nm] = worst.resultants();
        Some(BeamState { normal_n, shear_n, moment_nm, stress_pa: worst.value(), energy_j: energy.sum() })
    };
    compiled.parts.stressed.iter().enumerate().map(one).collect()
}
