//! The largest stress on the faces of a beam ([`bimorph_model::discretize::stressed`] has the equation), and its change.

use bimorph_model::compile::CompiledModel;
use bimorph_model::discretize::stressed::StressedBeam;
use bimorph_multibody::forces;
use bimorph_multibody::planar::Pose;
use nalgebra::Vector3;

/// Where the stress of a beam is largest.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LargestStress<'a> {
    beam: &'a StressedBeam,
    /// Joint of the model, and half the length of its segment (m).
    joint: (u32, f64),
    /// Normal force, shear force and moment there (N, N, N·m).
    resultants: Vector3<f64>,
}

/// Where the stress of a beam is largest at displacements `q` and temperature rises `rise` (K); none of a beam without segments.
pub(crate) fn largest<'a>(
    compiled: &'a CompiledModel,
    beam: usize,
    q: &[Pose],
    rise: &[f64],
) -> Option<LargestStress<'a>> {
    let system = &compiled.parts.system;
    let beam = &compiled.parts.stressed[beam];
    let at = |&(k, length): &(u32, f64)| {
        let resultants =
            forces::resultants(&system.model, &system.model.joints[k as usize], q, 1.0, expansion(compiled, rise));
        LargestStress { beam, joint: (k, 0.5 * length), resultants }
    };
    beam.joints.iter().map(at).reduce(|most, next| if next.value() > most.value() { next } else { most })
}

/// Free strain of each heater at its rise (1).
fn expansion<'a>(compiled: &'a CompiledModel, rise: &'a [f64]) -> impl Fn(usize) -> f64 + 'a {
    let heating = &compiled.parts.system.electrics.heating;
    move |k| heating.strain(k, rise)
}

impl LargestStress<'_> {
    /// Normal force, shear force and moment there (N, N, N·m).
    pub(crate) fn resultants(&self) -> [f64; 3] {
        [self.resultants.x, self.resultants.y, self.resultants.z]
    }

    /// The stress (Pa).
    pub(crate) fn value(&self) -> f64 {
        self.weighed(&self.resultants.abs())
    }

    fn weighed(&self, sizes: &Vector3<f64>) -> f64 {
        sizes.x / self.beam.area + (sizes.z + sizes.y * self.joint.1) / self.beam.modulus
    }

    /// Its change with a change of displacements and rises.
    pub(crate) fn slope(&self, compiled: &CompiledModel, q: &[Pose], dq: &[Pose], rise: &[f64]) -> f64 {
        let model = &compiled.parts.system.model;
        let joint = &model.joints[self.joint.0 as usize];
        let change = forces::resultants_change(model, joint, q, dq, expansion(compiled, rise));
        self.weighed(&change.component_mul(&self.resultants.map(f64::signum)))
    }
}
