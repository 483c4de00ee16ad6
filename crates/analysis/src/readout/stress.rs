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
    /// Factors on the stress of tension and of bending there (1).
    factors: [f64; 2],
    /// Normal force, shear force and moment there (N, N, N·m).
    resultants: Vector3<f64>,
}

/// Where the nominal stress of a beam is largest, without the concentration at fillets; see [`largest`].
pub(crate) fn nominal<'a>(
    compiled: &'a CompiledModel,
    beam: usize,
    q: &[Pose],
    rise: &[f64],
) -> Option<LargestStress<'a>> {
    largest_with(compiled, beam, q, rise, false)
}

/// Where the stress of a beam is largest at displacements `q` and temperature rises `rise` (K); none of a beam without segments.
pub(crate) fn largest<'a>(
    compiled: &'a CompiledModel,
    beam: usize,
    q: &[Pose],
    rise: &[f64],
) -> Option<LargestStress<'a>> {
    largest_with(compiled, beam, q, rise, true)
}

fn largest_with<'a>(
    compiled: &'a CompiledModel,
    beam: usize,
    q: &[Pose],
    rise: &[f64],
    concentrated: bool,
) -> Option<LargestStress<'a>> {
    let system = &compiled.parts.system;
    let beam = &compiled.parts.stressed[beam];
    let last = beam.joints.len().saturating_sub(1);
    let factors = |k: usize| {
        let ends =
            [(0, beam.fillets[0]), (last, beam.fillets[1])].into_iter().filter(|(at, _)| concentrated && *at == k);
        ends.filter_map(|(_, factors)| factors).fold([1.0; 2], |[a, b], [c, d]| [f64::max(a, c), f64::max(b, d)])
    };
    let at = |(place, &(k, length)): (usize, &(u32, f64))| {
        let resultants =
            forces::resultants(&system.model, &system.model.joints[k as usize], q, 1.0, expansion(compiled, rise));
        LargestStress { beam, joint: (k, 0.5 * length), factors: factors(place), resultants }
    };
    let all = beam.joints.iter().enumerate().map(at);
    all.reduce(|most, next| if next.value() > most.value() { next } else { most })
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
        let [tension, bending] = self.factors;
        tension * (sizes.x / self.beam.area) + bending * ((sizes.z + sizes.y * self.joint.1) / self.beam.modulus)
    }

    /// Its change with a change of displacements and rises.
    pub(crate) fn slope(&self, compiled: &CompiledModel, q: &[Pose], dq: &[Pose], rise: &[f64]) -> f64 {
        let model = &compiled.parts.system.model;
        let joint = &model.joints[self.joint.0 as usize];
        let change = forces::resultants_change(model, joint, q, dq, expansion(compiled, rise));
        self.weighed(&change.component_mul(&self.resultants.map(f64::signum)))
    }
}
