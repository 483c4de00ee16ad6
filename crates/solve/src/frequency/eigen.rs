//! Lowest natural frequencies of K·x = λ·M·x.
//!
//! Shift-invert Lanczos: the operator A = M^½·(K − σM)⁻¹·M^½ is symmetric, its largest eigenvalues 1/(λ − σ) belong to the
//! lowest modes, and one application is one solve with the block factor, O(n+m). Coordinates weighted by M^½ have one unit,
//! so no scaling is needed. Small models go through a dense symmetric eigensolver. Where rounding has spoiled the factor
//! (parts a million times stiffer than others) the operator applies solves that correct themselves (`refined`).
//!
//! The last digits come from inverse iteration of the block ([`inverse_iteration`]), which also measures each mode. The
//! number of modes below the highest found is checked against the inertia of K − λM (Sylvester), which no lost mode
//! survives; where one is lost, or did not settle, a wider block with further directions takes over. All iterations are
//! bounded.
//!
//! Reference: T. Ericsson, A. Ruhe, "The spectral transformation Lanczos method", Math. Comp. 35 (1980).

use super::inverse_iteration::{self, ModeBlock};
use super::lanczos::{self, CLOSED, Pairs};
use super::mass::shifted;
use super::refined::{ROUNDING, Refined};
use super::subspace;
use crate::SolveError;
use bimorph_domains::{Drive, System};
use bimorph_multibody::planar::{DOF, Pose};
use bimorph_multibody::{BodyMatrix, Model};
use nalgebra::{DMatrix, SymmetricEigen};

/// Models of at most this many coordinates are solved densely.
const DENSE: usize = 60;
/// Additional settled modes, which separate the last requested one from the next.
const GUARD_MODES: usize = 2;
/// A factor whose solves have a larger relative error is corrected in every solve.
const ROUGH: f64 = 1e-9;
/// Residual at which an iteration stops (1).
const GOAL: f64 = 1e-11;
/// Residual of a reliable mode: the error of its frequency is the square (1).
pub const RELIABLE: f64 = 1e-8;

/// Modes with their residuals.
#[derive(Debug, Clone, PartialEq)]
pub struct Modes {
    /// λ = ω² of each mode, ascending (rad²/s²).
    pub lambda: Vec<f64>,
    /// Shapes with xᵀMx = 1.
    pub shapes: Vec<Vec<Pose>>,
    /// ‖(K + |λ|M)⁻¹(Kx − λMx)‖ in the mass norm: about the relative error of the shape.
    pub residuals: Vec<f64>,
    /// The inertia below the highest mode counts more modes than were found.
    pub missed: bool,
    /// About the relative error of K by rounding, as the factor has it (1).
    pub rounding: f64,
}

/// M^½·(K − σM)⁻¹·M^½ over flat vectors.
struct Operator<'a, 'b> {
    refined: &'a mut Refined<'b>,
    factor: &'a BodyMatrix,
    shift: f64,
    model: &'a Model,
    root: &'a [Pose],
    /// Solves correct themselves.
    corrected: bool,
    /// The last right side.
    x: Vec<Pose>,
}

impl Operator<'_, '_> {
    /// (K − σM)⁻¹·M^½·y.
    fn displacement(&mut self, y: &[f64]) -> &[Pose] {
        bimorph_base::budget::check();
        for ((x, r), y) in self.x.iter_mut().zip(self.root).zip(y.chunks_exact(DOF)) {
            *x = Pose::new(r.x * y[0], r.y * y[1], r.z * y[2]);
        }
        if self.corrected {
            self.refined.solve(self.factor, self.shift, &mut self.x, ROUNDING);
        } else {
            self.model.project(&mut self.x);
            self.factor.solve(&self.model.pattern, &mut self.x);
            self.model.project(&mut self.x);
        }
        &self.x
    }

    /// Puts the image of `y` into `to`.
    fn apply(&mut self, y: &[f64], to: &mut [f64]) {
        let root = self.root;
        for ((to, x), r) in to.chunks_exact_mut(DOF).zip(self.displacement(y)).zip(root) {
            to.copy_from_slice(&[x.x * r.x, x.y * r.y, x.z * r.z]);
        }
    }
}

/// The `count` lowest modes of a system whose tangent is `stiffness` (held directions not yet projected) at `q` under
/// `drive`; fewer where fewer directions have mass.
///
/// A structure that floats freely is solved with a small negative shift and shows its rigid motions as λ ≈ 0.
///
/// # Errors
/// [`SolveError::Singular`] when even the shifted matrix cannot be factored.
pub fn lowest_modes(
    system: &System,
    (q, drive): (&[Pose], &Drive),
    stiffness: &BodyMatrix,
    count: usize,
) -> Result<Modes, SolveError> {
    let model = &system.model;
    let (factor, shift) = factored(system, stiffness)?;
    let massive = massive_directions(model);
    let count = count.min(massive);
    if count == 0 {
        return Ok(Modes {
            lambda: Vec::new(),
            shapes: Vec::new(),
            residuals: Vec::new(),
            missed: false,
            rounding: 0.0,
        });
    }
    let mut refined = Refined::new(system, q, drive);
    let mut force: Vec<Pose> = (0..system.bodies()).map(|j| model.mass(j).map(f64::sqrt)).collect();
    let root = force.clone();
    let first = refined.solve(&factor, shift, &mut force, ROUNDING);
    let rounding = first.first.max(first.left);
    let x = root.clone();
    let mut operator =
        Operator { refined: &mut refined, factor: &factor, shift, model, root: &root, corrected: rounding > ROUGH, x };
    let wide = (count + GUARD_MODES).min(massive);
    let pairs =
        if DOF * root.len() <= DENSE { dense(&mut operator, wide) } else { sparse(&mut operator, wide, massive) };
    let few = if pairs.settled >= wide && rounding <= ROUGH { count } else { wide };
    let start: Vec<Vec<Pose>> = (0..few.min(pairs.theta.len()))
        .map(|i| operator.displacement(pairs.vectors.column(i).as_slice()).iter().map(|x| x / pairs.theta[i]).collect())
        .collect();
    let wanted = count.min(start.len());
    let settle = |refined: &mut Refined<'_>, start, wanted| {
        inverse_iteration::settle(model, refined, (&factor, shift), stiffness, start, wanted, GOAL)
    };
    let found = settle(&mut refined, start.clone(), wanted);
    // only where nothing is known of it yet
    let lost = |found: &ModeBlock| missed(model, stiffness, &found.lambda, rounding);
    let sound = |found: &ModeBlock| found.lambda.len() == count && found.residuals.iter().all(|&r| r <= RELIABLE);
    let complete = |found: &ModeBlock| sound(found) && !lost(found);
    let mut known = None;
    let found = match found {
        Some(found) if complete(&found) => {
            known = Some(false);
            Some(found)
        }
        found => {
            let block = (count + (8 + count / 2).min(24)).min(massive);
            let mut start = found.as_ref().map_or(start, |f| f.shapes.clone());
            start.truncate(block);
            let extra = subspace::start(system.bodies(), block - start.len(), system.length_scale);
            start.extend(extra);
            let wider = settle(&mut refined, start, count);
            if wider.as_ref().is_some_and(complete) || found.is_none() { wider } else { wider.or(found) }
        }
    };
    let Some(mut found) = found else {
        return Ok(Modes { lambda: Vec::new(), shapes: Vec::new(), residuals: Vec::new(), missed: true, rounding });
    };
    found.shapes.truncate(found.lambda.len());
    let missed = known.unwrap_or_else(|| lost(&found));
    Ok(Modes { lambda: found.lambda, shapes: found.shapes, residuals: found.residuals, missed, rounding })
}

/// The factor of K − σM and σ: 0, or a little below where K itself is singular.
fn factored(system: &System, stiffness: &BodyMatrix) -> Result<(BodyMatrix, f64), SolveError> {
    let model = &system.model;
    let mut k = stiffness.clone();
    model.project_matrix(&mut k);
    let mut factor = k.clone();
    // a remainder of rounding in the stiffness of a loose part is not a stiffness
    if model.loose().next().is_none() && factor.factor(&model.pattern).is_ok() {
        return Ok((factor, 0.0));
    }
    let shift = -1e-6 * typical(model, &k);
    factor = shifted(model, stiffness, shift);
    factor.factor(&model.pattern).map_err(|p| SolveError::singular(system, p))?;
    Ok((factor, shift))
}

/// True when more modes lie below the highest one than were found there: of several with the highest frequency, some may be found while
/// one below is not. The factor that counts has rounding errors itself.
fn missed(model: &Model, stiffness: &BodyMatrix, lambda: &[f64], rounding: f64) -> bool {
    let margin = 0.01 + 20.0 * rounding;
    let Some(&highest) = lambda.last() else { return true };
    if margin.is_nan() || margin > 0.5 || highest <= 0.0 {
        return false;
    }
    let cut = highest * (1.0 - margin);
    // what lies that near may be counted or not
    let near = cut * (1.001 + 20.0 * rounding);
    let found = lambda.iter().filter(|lambda| **lambda <= near).count();
    let mut counted = shifted(model, stiffness, cut);
    counted.factor(&model.pattern).is_ok_and(|inertia| inertia.negative > found)
}

/// Free directions that carry mass: a model has as many modes. Inner bodies of a beam have no rotary inertia of their own.
fn massive_directions(model: &Model) -> usize {
    (model.bodies.iter())
        .map(|b| {
            let free = |i: usize| b.free.as_ref().map_or(1.0, |p| p[(i, i)]);
            let translations = if b.mass > 0.0 { (free(0) + free(1)).round() as usize } else { 0 };
            translations + usize::from(b.inertia > 0.0 && free(2) > 0.5)
        })
        .sum()
}

/// Smallest ratio of a body's stiffness to its mass (rad²/s²).
fn typical(model: &Model, k: &BodyMatrix) -> f64 {
    (0..k.diagonal.len())
        .filter(|&j| model.mass(j).x > 0.0)
        .map(|j| k.diagonal[j][(0, 0)] / model.mass(j).x)
        .filter(|&r| r > 0.0)
        .fold(f64::INFINITY, f64::min)
        .min(1e18)
}

/// The largest eigenvalues of an operator from all of its columns.
fn dense(operator: &mut Operator<'_, '_>, wanted: usize) -> Pairs {
    let n = DOF * operator.root.len();
    let mut a = DMatrix::<f64>::zeros(n, n);
    let mut unit = vec![0.0; n];
    for c in 0..n {
        unit[c] = 1.0;
        operator.apply(&unit, a.column_mut(c).as_mut_slice());
        unit[c] = 0.0;
    }
    let eigen = SymmetricEigen::new((&a + a.transpose()) * 0.5);
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&i, &j| eigen.eigenvalues[j].abs().total_cmp(&eigen.eigenvalues[i].abs()));
    let largest = order.first().map_or(0.0, |&i| eigen.eigenvalues[i].abs());
    order.retain(|&i| eigen.eigenvalues[i].abs() > CLOSED * largest);
    order.truncate(wanted);
    let theta: Vec<f64> = order.iter().map(|&i| eigen.eigenvalues[i]).collect();
    let settled = theta.len();
    Pairs { theta, vectors: DMatrix::from_fn(n, settled, |r, c| eigen.eigenvectors[(r, order[c])]), settled }
}

/// The same by Lanczos, from fixed directions with components everywhere: the same bits on every run.
fn sparse(operator: &mut Operator<'_, '_>, wanted: usize, rank: usize) -> Pairs {
    let n = DOF * operator.root.len();
    let direction = |k: usize| (0..n).map(|i| 1.0 + ((i * (7919 + 104 * k)) % 101) as f64 / 101.0).collect();
    let mut apply = |y: &[f64], to: &mut [f64]| operator.apply(y, to);
    lanczos::largest((n, rank), &mut apply, &direction, wanted, 1e-10, 3 * wanted + 100)
}
