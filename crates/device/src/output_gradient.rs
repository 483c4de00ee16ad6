//! Gradients of outputs over displacements, and the environment of a mechanism.

use bimorph_model::compile::CompiledModel;
use bimorph_multibody::planar::Pose;
use bimorph_solve::harmonic::ComplexPose;
use nalgebra::Complex;

/// Temperature of a mechanism whose netlist names none: 27 °C, as circuits have it (K).
const ROOM: f64 = 300.15;

/// Temperature of what surrounds the mechanism (K): the ambient temperature of its first beam that has one, else of the layer of a lumped part.
pub fn surroundings(compiled: &CompiledModel) -> f64 {
    let ambient = compiled.structure.beams.iter().map(|beam| beam.material.ambient_temperature);
    ambient.into_iter().find(|t| *t > 0.0).or(compiled.structure.ambient_temperature).unwrap_or(ROOM)
}

/// Gradient of an output over the displacement of each body, and over its rate: the same at every frequency.
#[derive(Debug, Clone)]
pub(super) struct OutputGradient {
    pub(super) place: Vec<Pose>,
    pub(super) change: Vec<Pose>,
}

impl OutputGradient {
    pub(super) fn nothing(bodies: usize) -> Self {
        Self { place: vec![Pose::zeros(); bodies], change: vec![Pose::zeros(); bodies] }
    }

    /// Of a displacement that swings at `omega` (rad/s).
    pub(super) fn at(&self, omega: f64) -> Vec<ComplexPose> {
        let one = |(place, change): (&Pose, &Pose)| place.zip_map(change, |p, c| Complex::new(p, omega * c));
        self.place.iter().zip(&self.change).map(one).collect()
    }
}
