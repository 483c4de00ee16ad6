//! Stress stiffening that a linear model omits.
//!
//! Small displacements about the drawing have the stiffness K of unstressed parts. The contribution of stress and heat,
//! K_σ, belongs to a vibration, and modes include it; equilibria and runs in time do not. How much that matters is seen
//! by solving (K + K_σ)·x' = K·x for the deflection x: with K_σ the same forces would bring x' (second-order theory;
//! Timoshenko and Gere 1961, §1.11).

use super::statics::OperatingPoint;
use bimorph_model::compile::CompiledModel;
use bimorph_multibody::BodyMatrix;
use bimorph_multibody::planar::Pose;

/// Error of the deflection `x` of a linear model without the stress stiffening at `point`, as a fraction of the largest
/// reported one; infinite beyond the buckling load. None where the model is not linear.
pub(super) fn left_out(compiled: &CompiledModel, point: &OperatingPoint, x: &[Pose]) -> Option<f64> {
    let system = &compiled.parts.system;
    let model = &system.model;
    if !model.linear {
        return None;
    }
    let mut drive = system.electrics.drive();
    system.electrics.apply(&point.sources, &point.rise, &mut drive);
    let zeros = vec![Pose::zeros(); x.len()];
    let (mut stiffness, mut none, mut force) = (BodyMatrix::new(&model.pattern), zeros.clone(), zeros.clone());
    system.tangent(&zeros, &drive, &mut stiffness, &mut none);
    system.residual(x, &drive, &mut force);
    force.iter_mut().zip(&none).for_each(|(force, none)| *force -= none);
    let mut largest = 0.0;
    let mut apart = 0.0;
    let solved = |matrix: &BodyMatrix| {
        let mut factor = matrix.clone();
        model.project_matrix(&mut factor);
        let inertia = factor.factor(&model.pattern).ok()?;
        let mut x = force.clone();
        model.project(&mut x);
        factor.solve(&model.pattern, &mut x);
        model.project(&mut x);
        (inertia.negative == 0).then_some(x)
    };
    // both from one factorization's rounding, not one from the equilibrium's
    let without = solved(&stiffness)?;
    system.add_stress_stiffness(&point.q, &drive, &mut stiffness);
    let Some(with) = solved(&stiffness) else { return Some(f64::INFINITY) };
    for node in compiled.parts.nodes.iter().flatten() {
        let (a, b) = (node.displacement(&without, true), node.displacement(&with, true));
        largest = a.norm().max(largest);
        apart = (a - b).norm().max(apart);
    }
    (largest > 0.0).then(|| apart / largest)
}
