//! The response of the bodies to a force that acts for a short time, by static condensation: masses accelerate, directions without mass follow their springs at
//! once.
//!
//! With γ far below the shortest time in which something moves,
//! ```text
//! (M/γ² + K)·x = f
//! ```
//! has the accelerations x/γ² of the masses, with what springs bring to them from forces on directions without mass, and the displacements x of the latter.

use bimorph_domains::{Drive, System};
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyMatrix, forces};
use bimorph_solve::equations::bodies::NormWeights;

/// γ over the shortest time (1).
const SHORT: f64 = 1e-3;

/// Storage.
#[derive(Debug)]
pub(crate) struct CondensedResponse {
    matrix: BodyMatrix,
    residual: Vec<Pose>,
    x: Vec<Pose>,
    /// γ (s).
    gamma: f64,
}

/// The effect of a force, in the norm of masses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ForceResponse {
    /// Acceleration (√kg·m/s²).
    pub(crate) acceleration: f64,
    /// Displacement of directions without mass, see [`NormWeights::norm_without_mass`] (√kg·m).
    pub(crate) displacement: f64,
}

impl CondensedResponse {
    /// Storage for a system in which nothing moves in less than about `shortest` (s).
    pub(crate) fn new(system: &System, shortest: f64) -> Self {
        let zeros = vec![Pose::zeros(); system.bodies()];
        Self {
            matrix: BodyMatrix::new(&system.model.pattern),
            residual: zeros.clone(),
            x: zeros,
            gamma: SHORT * shortest,
        }
    }

    /// Takes the tangent at displacements `q`. False where directions without mass have no springs, or unstable ones.
    pub(crate) fn begin(&mut self, system: &System, q: &[Pose], drive: &Drive) -> bool {
        let Self { matrix, residual, gamma, .. } = self;
        system.tangent(q, drive, matrix, residual);
        forces::add_inertia(&system.model, 1.0 / (*gamma * *gamma), 0.0, matrix);
        system.model.project_matrix(matrix);
        matrix.factor(&system.model.pattern).is_ok_and(|signs| signs.negative == 0)
    }

    /// The response to a force on each body (N, N·m), with the tangent taken before.
    pub(crate) fn of(&mut self, (system, weights): (&System, &NormWeights), force: &[Pose]) -> ForceResponse {
        let Self { matrix, x, gamma, .. } = self;
        let model = &system.model;
        x.copy_from_slice(force);
        model.project(x);
        matrix.solve(&model.pattern, x);
        ForceResponse {
            acceleration: model.mass_product(x, x).sqrt() / (*gamma * *gamma),
            displacement: weights.norm_without_mass(system, x),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bimorph_base::Bundle;
    use bimorph_model::compile::{CompileOptions, CompiledModel, Junctions, draw};
    use bimorph_netlist::NetlistSource;

    /// A beam of 100 × 2 × 2 µm in two segments, whose inner body has no rotary inertia.
    fn beam(end: &str) -> CompiledModel {
        let text = format!(
            "process p = [Youngsmodulus=165e9 density=2300 h=2u]\nanchor p [a] []\nbeam2d p [a b] [l=100u w=2u]\n{end}"
        );
        let options =
            CompileOptions { segments: Some(2), junctions: Junctions::Centreline, ..CompileOptions::default() };
        let bundle = Bundle::from_text("beam.net", &text);
        draw(&NetlistSource::new(&bundle), &options).and_then(|drawn| drawn.compile()).unwrap_or_else(|e| panic!("{e}"))
    }

    /// The response to a force on the heaviest body, which is the inner one.
    fn of_inner(system: &System, shortest: f64, force: Pose) -> ForceResponse {
        let n = system.bodies();
        let mut response = CondensedResponse::new(system, shortest);
        assert!(response.begin(system, &vec![Pose::zeros(); n], &system.electrics.drive()));
        let mut forces = vec![Pose::zeros(); n];
        let inner = (0..n).max_by(|a, b| system.model.mass(*a).x.total_cmp(&system.model.mass(*b).x)).unwrap();
        assert_eq!(system.model.mass(inner).z, 0.0);
        forces[inner] = force;
        response.of((system, &NormWeights::new(&system.model)), &forces)
    }

    fn same(found: f64, expected: f64) {
        assert!((found / expected - 1.0).abs() < 1e-5, "{found:e} {expected:e}");
    }

    /// Between two anchors a force F on the inner body of mass m accelerates it by F/m. A moment τ turns it by τ·l/(8EI) against segments of length l, and
    /// accelerates nothing.
    #[test]
    fn moments_turn_directions_without_mass() {
        let compiled = beam("anchor p [b] []");
        let system = &compiled.parts.system;
        let mass = system.model.mass(0).y;
        same(of_inner(system, 1e-9, Pose::new(0.0, 1e-6, 0.0)).acceleration, 1e-6 / mass.sqrt());
        let turned = of_inner(system, 1e-9, Pose::new(0.0, 0.0, 1e-12));
        let angle = 1e-12 * 50e-6 / (8.0 * 165e9 * 2e-6 * 2e-6f64.powi(3) / 12.0);
        same(turned.displacement, angle * system.length_scale * mass.sqrt());
        assert!(turned.acceleration < 1e-9 * 1e-12 / 50e-6 / mass.sqrt(), "{turned:?}");
    }

    /// At a free end springs pass a moment on to masses. Their acceleration does not depend on γ.
    #[test]
    fn springs_pass_moments_on_to_masses() {
        let compiled = beam("");
        let [one, other] = [1e-9, 1e-10]
            .map(|shortest| of_inner(&compiled.parts.system, shortest, Pose::new(0.0, 0.0, 1e-12)).acceleration);
        assert!(one > 0.1 * 1e-12 / 50e-6 / compiled.parts.system.model.mass(0).y.sqrt(), "{one:e}");
        same(one, other);
    }
}
