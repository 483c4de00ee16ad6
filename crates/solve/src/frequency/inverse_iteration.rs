//! The last digits of modes: inverse iteration of a block of near modes, with solves that are right to rounding.
//!
//! Each round solves once for every vector, takes the best modes in their span (Rayleigh–Ritz) and measures each by
//! ```text
//! ‖(K + |λ|·M)⁻¹·(K·x − λ·M·x)‖ in the mass norm, λ = xᵀKx, xᵀMx = 1
//! ```
//! A fraction e of mode j in x adds e·|λ_j − λ|/(λ_j + |λ|): the residual is about the relative error of the shape, with
//! modes far below and far above counted alike. K·x is summed in extended precision; the error of the frequency is the
//! square.
//!
//! Reference: K.-J. Bathe, "Finite Element Procedures" (2014), §11.6.

use super::mass::shifted;
use super::refined::Refined;
use super::subspace::{columns, ritz};
use bimorph_multibody::planar::{DOF, Pose};
use bimorph_multibody::{BodyMatrix, Model};

/// Rounds at most.
const MAX_ROUNDS: usize = 30;
/// Error of a solve that is used only to measure a residual (1).
const MEASURED: f64 = 1e-3;

/// Modes with their residuals.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeBlock {
    /// λ of the wanted modes, ascending (rad²/s²).
    pub lambda: Vec<f64>,
    /// All shapes of the block, xᵀMx = 1, the wanted ones first.
    pub shapes: Vec<Vec<Pose>>,
    /// Residual of each wanted mode (1).
    pub residuals: Vec<f64>,
}

/// Iterates on the block `x` until the `wanted` lowest modes have residuals below `goal`, or get no better. `factor` is that
/// of K − σM, `stiffness` K itself, held directions not projected. None where the vectors are dependent.
pub fn settle(
    model: &Model,
    refined: &mut Refined<'_>,
    (factor, shift): (&BodyMatrix, f64),
    stiffness: &BodyMatrix,
    mut x: Vec<Vec<Pose>>,
    wanted: usize,
    goal: f64,
) -> Option<ModeBlock> {
    let mut best: Option<(f64, ModeBlock)> = None;
    let mut stalls = 0;
    for _ in 0..MAX_ROUNDS {
        let (next, loose) = improve(model, refined, (factor, shift), &x, goal)?;
        x = next;
        let (lambda, mut residuals) = measure(model, refined, stiffness, shift.abs(), &x[..wanted]);
        residuals.iter_mut().for_each(|r| *r = r.max(loose));
        let worst = residuals.iter().fold(0.0, |w: f64, r| if r.is_nan() { f64::INFINITY } else { w.max(*r) });
        stalls = if best.as_ref().is_some_and(|(w, _)| worst > 0.9 * w) { stalls + 1 } else { 0 };
        if best.as_ref().is_none_or(|(w, _)| worst < *w) {
            best = Some((worst, ModeBlock { lambda, shapes: x.clone(), residuals }));
        }
        if worst <= goal || stalls > 1 {
            break;
        }
    }
    let (_, mut block) = best?;
    sort(&mut block);
    Some(block)
}

/// One solve for each vector, and the best modes in their span; and by what fraction the worst of the solves is still off.
fn improve(
    model: &Model,
    refined: &mut Refined<'_>,
    (factor, shift): (&BodyMatrix, f64),
    x: &[Vec<Pose>],
    goal: f64,
) -> Option<(Vec<Vec<Pose>>, f64)> {
    let weigh =
        |x: &Vec<Pose>| -> Vec<Pose> { x.iter().enumerate().map(|(j, x)| model.mass(j).component_mul(x)).collect() };
    let forces: Vec<Vec<Pose>> = x.iter().map(weigh).collect();
    let mut y = forces.clone();
    let loose = y.iter_mut().map(|y| refined.solve(factor, shift, y, goal).left).fold(0.0, f64::max);
    let (flat, weighed) = (columns(&y), columns(&y.iter().map(weigh).collect::<Vec<_>>()));
    let (_, v) = ritz(&(flat.transpose() * columns(&forces)), &(flat.transpose() * weighed))?;
    let flat = flat * v;
    let pose = |c: nalgebra::DVectorView<'_, f64>, k: usize| Pose::new(c[DOF * k], c[DOF * k + 1], c[DOF * k + 2]);
    let normal = |c: nalgebra::DVectorView<'_, f64>| {
        let x: Vec<Pose> = (0..model.bodies.len()).map(|k| pose(c, k)).collect();
        let length = model.mass_product(&x, &x).sqrt();
        x.iter().map(|x| x / length).collect()
    };
    Some((flat.column_iter().map(normal).collect(), loose))
}

/// Rayleigh quotients and residuals. One factor of K + sM serves all |λ| between s/2 and 2s.
fn measure(
    model: &Model,
    refined: &mut Refined<'_>,
    stiffness: &BodyMatrix,
    least: f64,
    x: &[Vec<Pose>],
) -> (Vec<f64>, Vec<f64>) {
    let mut rest = vec![Pose::zeros(); model.bodies.len()];
    let mut known: Option<(f64, BodyMatrix)> = None;
    // K + sM is positive for s beyond the most negative of them
    let lowest = x.iter().map(|x| refined.quotient(x, &mut rest)).fold(0.0, f64::min);
    let least = least.max(-2.0 * lowest);
    let one = |x: &Vec<Pose>| {
        let lambda = refined.quotient(x, &mut rest);
        let size = lambda.abs().max(least);
        if known.as_ref().is_none_or(|(s, _)| !(0.5 * s..=2.0 * s).contains(&size)) {
            let mut factor = shifted(model, stiffness, -size);
            // near an unstable configuration it may be singular; then the residual is unknown
            known = factor.factor(&model.pattern).is_ok().then_some((size, factor));
        }
        let Some((_, factor)) = &known else { return (lambda, f64::NAN) };
        // what is solved for here may be rounding alone, which no correction makes smaller
        let solved = refined.solve(factor, -size, &mut rest, MEASURED);
        (lambda, model.mass_product(&rest, &rest).sqrt() * (1.0 + solved.left))
    };
    x.iter().map(one).unzip()
}

/// Ascending λ.
fn sort(block: &mut ModeBlock) {
    let mut order: Vec<usize> = (0..block.lambda.len()).collect();
    order.sort_by(|&a, &b| block.lambda[a].total_cmp(&block.lambda[b]));
    block.lambda = order.iter().map(|&i| block.lambda[i]).collect();
    block.residuals = order.iter().map(|&i| block.residuals[i]).collect();
    let rest = block.shapes.split_off(order.len());
    let mut shapes: Vec<Vec<Pose>> = order.iter().map(|&i| std::mem::take(&mut block.shapes[i])).collect();
    shapes.extend(rest);
    block.shapes = shapes;
}
