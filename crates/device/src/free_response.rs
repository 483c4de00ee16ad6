//! The response of the bodies to a force that acts for a short time: masses accelerate, directions without mass follow their springs at once.
//!
//! With γ far below the shortest time in which something moves,
//! ```text
//! (M/γ² + K)·x = f
//! ```
//! has the accelerations x/γ² of the masses, with what springs bring to them from forces on directions without mass, and the displacements x of the latter.

use bimorph_domains::{Drive, System};
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyMatrix, forces};

/// γ over the shortest time (1).
const SHORT: f64 = 1e-3;

/// Storage.
#[derive(Debug)]
pub(crate) struct FreeResponse {
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
    /// Displacement of directions without mass, each of which counts as the mean of the bodies, rotations at the length scale (√kg·m).
    pub(crate) displacement: f64,
}

impl FreeResponse {
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

    /// Takes the tangent at displacements `q`. False where directions without mass have no springs.
    pub(crate) fn begin(&mut self, system: &System, q: &[Pose], drive: &Drive) -> bool {
        let Self { matrix, residual, gamma, .. } = self;
        system.tangent(q, drive, matrix, residual);
        forces::add_inertia(&system.model, 1.0 / (*gamma * *gamma), 0.0, matrix);
        system.model.project_matrix(matrix);
        matrix.factor(&system.model.pattern).is_ok()
    }

    /// The response to a force on each body (N, N·m), with the tangent taken before.
    pub(crate) fn of(&mut self, system: &System, force: &[Pose]) -> ForceResponse {
        let Self { matrix, x, gamma, .. } = self;
        let model = &system.model;
        x.copy_from_slice(force);
        model.project(x);
        matrix.solve(&model.pattern, x);
        let (mut mass, mut follows) = (0.0, 0.0);
        for (j, x) in x.iter().enumerate() {
            let m = model.mass(j);
            let turned = (x.z * system.length_scale).powi(2);
            match m {
                m if m.x == 0.0 => follows += x.x * x.x + x.y * x.y + turned,
                m if m.z == 0.0 => follows += turned,
                _ => {}
            }
            mass += m.x;
        }
        ForceResponse {
            acceleration: model.mass_product(x, x).sqrt() / (*gamma * *gamma),
            displacement: (follows * mass / x.len() as f64).sqrt(),
        }
    }
}
