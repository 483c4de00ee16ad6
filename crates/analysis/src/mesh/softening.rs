//! How near an equilibrium is to where it ends: to a bifurcation or a fold, past which the part rests elsewhere.
//!
//! A coarse mesh bears a little more than the structure does. Just beyond a buckling load a straight part is stable on
//! it, and on twice the segments, too, with the same displacements, so that a comparison of displacements shows
//! nothing. The indicator is the remaining stiffness,
//! ```text
//! k = xᵀ·K·x / max |x_j|²,      λ = min over x of xᵀ·K·x / xᵀ·M·x,      K at the equilibrium, M the masses of the bodies,
//! ```
//! in the softest motion x, that of the lowest frequency √λ: it goes to zero there. Let a mesh overestimate the
//! buckling load by ε, and let the part buckle at a fraction δ below the present load. The remaining stiffness is then
//! proportional to ε + δ. On twice the segments ε falls to a sixteenth or, where it is caused by stretching, to a
//! quarter. While the side of the limit is not known, ε > |δ|, the two are further apart than [`KNOWN`] times the
//! smaller.
//!
//! Equilibria with less than half of their stiffness are examined: xᵀ·K·x < ½·xᵀ·K₀·x for some x, with K₀ at rest, by
//! the pivots of K − ½·K₀ (Sylvester). The criterion also requires λ < ½·λ₀, since a rotated beam is soft in a
//! direction that was stiff. Tension may stiffen a part that voltages soften. Therefore the same criterion applies with
//! K₀ at the present state without voltages. A part whose lowest frequency is that of something else, soft or heavy, is
//! not seen.

use super::super::statics::OperatingPoint;
use bimorph_base::ErrorBudget;
use bimorph_domains::Drive;
use bimorph_model::compile::CompiledModel;
use bimorph_multibody::BodyMatrix;
use bimorph_multibody::planar::Pose;

/// Fraction of the stiffness at rest below which it is compared from mesh to mesh (1). The coarsest mesh of a clamped
/// beam bears an eighth too much.
const SOFT: f64 = 0.5;
/// Fraction by which the remaining stiffness may differ between a mesh and twice its segments (1). Slow convergence
/// must not count as converged: a column in one piece has 1.25 times the stiffness on two segments that it has on four,
/// and none on eight.
const KNOWN: f64 = 0.2;
/// Inverse iterations at most, and the change of λ at which they end (1).
const ROUNDS: (usize, f64) = (30, 1e-3);

/// [`left`] of an equilibrium that has less than half of its stiffness left; none of others.
pub(super) fn left_of_soft(compiled: &CompiledModel, point: &OperatingPoint) -> Option<f64> {
    let (system, pattern) = (&compiled.parts.system, &compiled.parts.system.model.pattern);
    if system.model.linear || system.bodies() == 0 || !point.free_motions.is_empty() {
        // displacements are small by decree, or a direction is held that is free
        return None;
    }
    let [here, rest, without] = drives(compiled, point);
    let still = vec![Pose::zeros(); system.bodies()];
    let (mut force, mut tangent) = (still.clone(), BodyMatrix::new(pattern));
    let pulled = here.volts.iter().any(|v| *v != 0.0);
    let references = [(&still, &rest), (&point.q, &without)];
    references.into_iter().take(1 + usize::from(pulled)).find_map(|(q, drive)| {
        system.tangent_less((&point.q, &here), SOFT, (q, drive), &mut tangent, &mut force);
        system.model.project_matrix(&mut tangent);
        if tangent.factor(pattern).is_ok_and(|inertia| inertia.negative == 0) {
            return None;
        }
        let (here, there) = (lowest(compiled, &point.q, &here)?, lowest(compiled, q, drive)?);
        (here.lambda < SOFT * there.lambda).then_some(here.left)
    })
}

/// The remaining stiffness at an equilibrium (N/m); `None` where it is unknown.
pub(super) fn left(compiled: &CompiledModel, point: &OperatingPoint) -> Option<f64> {
    let [here, ..] = drives(compiled, point);
    lowest(compiled, &point.q, &here).map(|lowest| lowest.left)
}

/// Drives of an equilibrium: the actual one, the one at rest without loads and voltages, and the first without
/// voltages.
fn drives(compiled: &CompiledModel, point: &OperatingPoint) -> [Drive; 3] {
    let electrics = &compiled.parts.system.electrics;
    let here = point.drive(compiled);
    let without = Drive { volts: vec![0.0; here.volts.len()], ..here.clone() };
    [here, Drive { load: 0.0, ..electrics.drive() }, without]
}

/// Whether two meshes, the second twice as fine, agree on which side of the limit they are.
pub(super) fn agree(coarse: Option<f64>, fine: Option<f64>) -> bool {
    coarse.zip(fine).is_none_or(|(coarse, fine)| (coarse - fine).abs() <= KNOWN * fine)
}

/// Scale for comparing the remaining stiffness, or the distance beyond a fold, at a tolerance: a larger difference
/// means that two meshes disagree.
pub(super) fn scale(left: f64, errors: ErrorBudget) -> f64 {
    errors.scale_of_comparison(KNOWN * left.abs())
}

/// The softest motion, for its masses.
struct SoftestMotion {
    /// xᵀ·K·x / xᵀ·M·x (rad²/s²), or (N/m) over bodies that are alike where nothing has mass.
    lambda: f64,
    /// xᵀ·K·x / max |x_j|² (N/m).
    left: f64,
}

/// The softest motion at a configuration, by inverse iteration; none where the stiffness is not positive.
fn lowest(compiled: &CompiledModel, q: &[Pose], drive: &Drive) -> Option<SoftestMotion> {
    let (system, model) = (&compiled.parts.system, &compiled.parts.system.model);
    let mut x = vec![Pose::zeros(); q.len()];
    let mut stiffness = BodyMatrix::new(&model.pattern);
    system.tangent(q, drive, &mut stiffness, &mut x);
    model.project_matrix(&mut stiffness);
    stiffness.factor(&model.pattern).ok().filter(|inertia| inertia.negative == 0)?;
    let count = model.bodies.len();
    let massless = (0..count).all(|j| model.mass(j).x == 0.0);
    let weight = |j: usize| if massless { Pose::new(1.0, 1.0, 0.0) } else { model.mass(j) };
    let product =
        |x: &[Pose], y: &[Pose]| -> f64 { (0..count).map(|j| weight(j).component_mul(&x[j]).dot(&y[j])).sum() };
    // no symmetry of a part may hide its softest direction
    let one =
        |j: usize| Pose::new(1.0, 1.0 + 0.37 * ((j * 7) % 5) as f64, 0.61 * ((j * 3) % 4) as f64 / system.length_scale);
    x.iter_mut().enumerate().for_each(|(j, x)| *x = one(j));
    model.project(&mut x);
    let (mut before, mut lambda) = (x.clone(), f64::INFINITY);
    for _ in 0..ROUNDS.0 {
        let length = product(&x, &x).sqrt();
        if !(length.is_finite() && length > 0.0) {
            return None;
        }
        for (j, (x, before)) in x.iter_mut().zip(&mut before).enumerate() {
            *before = *x / length;
            *x = weight(j).component_mul(before);
        }
        model.project(&mut x);
        stiffness.solve(&model.pattern, &mut x);
        model.project(&mut x);
        // with x₁ = K⁻¹·M·x of xᵀ·M·x = 1: λ = x₁ᵀ·M·x/x₁ᵀ·M·x₁
        let next = product(&x, &before) / product(&x, &x);
        let settled = (next - lambda).abs() <= ROUNDS.1 * next.abs();
        lambda = next;
        if settled {
            break;
        }
    }
    let most = x.iter().map(|x| x.x * x.x + x.y * x.y).fold(0.0, f64::max);
    let left = lambda * product(&x, &x) / most;
    left.is_finite().then_some(SoftestMotion { lambda, left })
}
