//! The imperfection that every real part has: a small fraction of the shape of its lowest mode.
//!
//! A structure that was made a little in the shape x₀ rests there without stress. To first order that is the ideal one under
//! the constant forces K·x₀, which here are a·λ·M·x of the lowest mode: loads then bring out what an ideal part hides, such
//! as the side to which a column buckles. A compressed column with it is bent by a/(1 − N/N_cr).
//!
//! Reference: W. T. Koiter, "On the stability of elastic equilibrium" (1945), for imperfections; S. P. Timoshenko, J. M. Gere,
//! "Theory of Elastic Stability" (1961), §1.12.

use crate::discretize::Assembly;
use bimorph_domains::{DeadLoad, MaterialPoint};
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyId, BodyMatrix};
use bimorph_solve::frequency::eigen::lowest_modes;
use nalgebra::Vector2;

/// Adds the forces of an imperfection whose largest displacement is `size` (m), of either sign. Adds nothing where no
/// mode is found or the lowest one is a rigid motion.
pub fn apply(parts: &mut Assembly, size: f64) {
    let system = &parts.system;
    let zeros = vec![Pose::zeros(); system.bodies()];
    let mut drive = system.electrics.drive();
    drive.load = 0.0;
    let mut tangent = BodyMatrix::new(&system.model.pattern);
    let mut residual = zeros.clone();
    system.tangent(&zeros, &drive, &mut tangent, &mut residual);
    system.add_stress_stiffness(&zeros, &drive, &mut tangent);
    let Ok(found) = lowest_modes(system, (&zeros, &drive), &tangent, 1) else { return };
    let (Some(&lambda), Some(shape)) = (found.lambda.first(), found.shapes.first()) else { return };
    let moved = |p: &Pose| p.x.hypot(p.y);
    let Some(most) = shape.iter().max_by(|a, b| moved(a).total_cmp(&moved(b))) else { return };
    let largest = moved(most);
    if largest == 0.0 || lambda <= 0.0 {
        return;
    }
    // the body that moves most goes up, or to the right
    let up = if most.y.abs() > 1e-6 * most.x.abs() { most.y } else { most.x };
    let scale = lambda * size.copysign(size * up) / largest;
    let loads: Vec<DeadLoad> = (shape.iter().enumerate())
        .map(|(k, x)| {
            let force = system.model.mass(k).component_mul(x) * scale;
            let point = MaterialPoint { body: BodyId::Free(k), arm: Vector2::zeros() };
            DeadLoad { point, force: Vector2::new(force.x, force.y), moment: force.z }
        })
        .collect();
    parts.system.loads.extend(loads);
}
