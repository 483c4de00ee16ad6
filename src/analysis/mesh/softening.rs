//! How near an equilibrium is to where it ends: to a bifurcation or a fold, past which the part rests elsewhere.
//!
//! A coarse mesh bears a little more than the structure does. Just beyond a buckling load a straight part is stable on it, and on twice the
//! segments, too, with the same displacements: nothing that is compared tells. What tells is the stiffness that is left,
//! ```text
//! s = min over x of xᵀ·K·x / xᵀ·K₀·x,      K at the equilibrium, K₀ at rest, without loads and voltages,
//! ```
//! which goes to zero there and needs no mass, no units and no scale. Where s changes from one mesh to the next by more than half of itself, the
//! side of the limit is not known.
//!
//! Whether s is below a share c is the sign of the pivots of K − c·K₀ (Sylvester); s itself is found by inverse iteration.

use super::super::statics::OperatingPoint;
use crate::compile::Compiled;
use crate::domains::Drive;
use crate::multibody::BlockMatrix;
use crate::multibody::planar::Pose;

/// Share of the stiffness at rest below which it is looked at from mesh to mesh [1]. The coarsest mesh of a clamped beam bears an eighth too much.
const SOFT: f64 = 0.5;
/// Share of what is left that may differ between a mesh and twice its segments [1].
const KNOWN: f64 = 0.5;
/// Inverse iterations at most, and the change of s at which they end [1].
const ROUNDS: (usize, f64) = (30, 1e-3);

/// True where less than half of the stiffness at rest is left in some direction.
pub(super) fn is_soft(compiled: &Compiled, point: &OperatingPoint) -> bool {
    let Some((mut left, rest)) = stiffnesses(compiled, point) else { return false };
    for (left, rest) in left.diagonal.iter_mut().zip(&rest.diagonal).chain(left.below.iter_mut().zip(&rest.below)) {
        *left -= rest * SOFT;
    }
    let pattern = &compiled.parts.system.model.pattern;
    left.factor(pattern).is_ok_and(|inertia| inertia.negative > 0)
}

/// s of an equilibrium [1]; none where it cannot be told.
pub(super) fn left(compiled: &Compiled, point: &OperatingPoint) -> Option<f64> {
    let model = &compiled.parts.system.model;
    let (mut tangent, rest) = stiffnesses(compiled, point)?;
    tangent.factor(&model.pattern).ok().filter(|inertia| inertia.negative == 0)?;
    // no symmetry of a part may hide its softest direction
    let scale = compiled.parts.system.length_scale;
    let one = |j: usize| Pose::new(1.0, 1.0 + 0.37 * ((j * 7) % 5) as f64, 0.61 * ((j * 3) % 4) as f64 / scale);
    let mut x: Vec<Pose> = (0..model.bodies.len()).map(one).collect();
    model.project(&mut x);
    let (mut pushed, mut s) = (vec![Pose::zeros(); x.len()], f64::INFINITY);
    for _ in 0..ROUNDS.0 {
        let product = |pushed: &mut [Pose], x: &[Pose]| -> f64 {
            pushed.fill(Pose::zeros());
            rest.multiply_add(&model.pattern, x, pushed);
            x.iter().zip(&*pushed).map(|(x, f)| x.dot(f)).sum()
        };
        let length = product(&mut pushed, &x).sqrt();
        if !(length.is_finite() && length > 0.0) {
            return None;
        }
        // with x₁ = K⁻¹·K₀·x/|x|: s = xᵀ·K₀·x₁/x₁ᵀ·K₀·x₁ to the second order
        pushed.iter_mut().for_each(|f| *f /= length);
        let force = pushed.clone();
        tangent.solve(&model.pattern, &mut pushed);
        std::mem::swap(&mut x, &mut pushed);
        let work: f64 = x.iter().zip(&force).map(|(x, f)| x.dot(f)).sum();
        let next = work / product(&mut pushed, &x);
        let settled = (next - s).abs() <= ROUNDS.1 * next.abs();
        s = next;
        if settled {
            break;
        }
    }
    s.is_finite().then_some(s)
}

/// Whether two meshes, the second twice as fine, agree on which side of the limit they are.
pub(super) fn agree(coarse: Option<f64>, fine: Option<f64>) -> bool {
    coarse.zip(fine).is_none_or(|(coarse, fine)| (coarse - fine).abs() <= KNOWN * fine)
}

/// What of s is compared, at a tolerance: beyond it where two meshes do not agree.
pub(super) fn scale(left: f64, tol: f64) -> f64 {
    // a comparison divides by ¾ of the scale and allows ¾ of the tolerance
    KNOWN * left.abs() / (0.75 * 0.75 * tol)
}

/// The tangent at the equilibrium and at rest; none where some direction is free, or displacements are small by decree.
fn stiffnesses(compiled: &Compiled, point: &OperatingPoint) -> Option<(BlockMatrix<f64, 3>, BlockMatrix<f64, 3>)> {
    let system = &compiled.parts.system;
    if system.model.linear || system.bodies() == 0 || !point.free_motions.is_empty() {
        return None;
    }
    let electrics = &system.electrics;
    let (mut rise, mut drive) = (point.rise.clone(), electrics.drive());
    electrics.steady(&point.sources, &mut rise, &mut drive);
    let mut force = vec![Pose::zeros(); system.bodies()];
    let mut at = |q: &[Pose], drive: &Drive| {
        let mut tangent = BlockMatrix::new(&system.model.pattern);
        system.tangent(q, drive, &mut tangent, &mut force);
        system.model.project_matrix(&mut tangent);
        tangent
    };
    let still = vec![Pose::zeros(); system.bodies()];
    let rest = at(&still, &Drive { load: 0.0, ..electrics.drive() });
    Some((at(&point.q, &drive), rest))
}
