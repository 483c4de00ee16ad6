//! Equilibria of the polynomials, and their error against the full model.
//!
//! The full model is followed to points of the box of inputs, through pull-in where that comes. From its state Newton's method goes to the
//! equilibrium of the polynomials next to it. The error is the largest of displacements by exact kinematics there, of what is read, and
//! of capacitances.

use super::super::inputs::InputBox;
use super::super::space::{ReducedForces, ReducedSpace};
use super::super::statics::solve;
use super::PolynomialModel;
use super::fast_coordinates::following;
use super::fit::{CombFits, Fit};
use super::samples::{FullEquilibrium, equilibria};
use super::shapes::Probe;
use bimorph_domains::{Drive, System};
use bimorph_multibody::planar::Pose;
use nalgebra::{DMatrix, DVector};

/// Newton iterations, and the correction at which they end (1).
const ITERATIONS: usize = 60;
const CONVERGED: f64 = 1e-11;
/// MotionCorrections below this fraction that no longer shrink are rounding (1).
const STALLED: f64 = 1e-8;
/// Part of the largest displacement or reading that others count at least as (1): an error where one passes through 0 is one of that.
const SMALL: f64 = 0.1;
/// Difference of the shares of two voltages that counts as none (1).
const SAME: f64 = 1e-9;
/// Degrees of the polynomials, and the most coordinates of the higher one.
const DEGREES: [usize; 2] = [2, 3];
const CUBIC: usize = 12;
/// Part of the errors of degree 2 that those of degree 3 have at most where they exceed the tolerance, too (1): simulators step cubic forces worse.
const WORTH: f64 = 0.7;

/// A polynomial model with its error.
#[derive(Debug, Clone, PartialEq)]
pub struct FittedPolynomials {
    /// The model.
    pub model: PolynomialModel,
    /// Largest relative error of equilibria in the box of inputs (1).
    pub error: f64,
    /// The same of displacements and readings alone, and of capacitances alone.
    pub errors: [f64; 2],
    /// Equilibria of the full model that were compared.
    pub compared: usize,
    /// Those beyond a pull-in next to which the polynomials have none.
    pub missed: usize,
    /// Whether each coordinate has no inertia in a file: it is fast, and follows its forces at once.
    pub follows: Vec<bool>,
}

/// A tested equilibrium with its readings.
struct Reference<'a> {
    at: &'a FullEquilibrium,
    read: Vec<f64>,
    capacitances: Vec<f64>,
}

/// Largest errors of displacements and readings, and of capacitances; and the states beyond a pull-in next to which there is no equilibrium.
#[derive(Debug, Clone, Copy, PartialEq)]
struct FittedErrors {
    of: [f64; 2],
    missed: usize,
}

impl FittedErrors {
    /// Without an equilibrium next to one of the full model.
    const NONE: Self = Self { of: [f64::INFINITY; 2], missed: 0 };

    /// The larger error; each missed state counts as one of 1.
    fn rank(&self) -> f64 {
        self.of[0].max(self.of[1]) + self.missed as f64
    }
}

/// The polynomials of a trained space: of degree 3 where those of degree 2 do not come within `tol`. Members in `apart` stay as they are; others
/// that have one voltage become one.
pub fn fitted(
    space: &ReducedSpace,
    system: &System,
    inputs: &InputBox,
    probes: &[&Probe<'_>],
    (tol, apart): (f64, &[usize]),
) -> FittedPolynomials {
    let groups = groups(system, apart);
    let space = space.of_system(system);
    let sampled = equilibria(&space, system, inputs);
    let made: Vec<Vec<f64>> =
        sampled.iter().filter(|equilibrium| equilibrium.makes).map(|equilibrium| equilibrium.z.clone()).collect();
    let mut fits = CombFits::new(system, |combs| Fit::new(&space, system, made.clone(), probes, (false, combs)));
    let references: Vec<Reference<'_>> = (sampled.iter().filter(|equilibrium| equilibrium.tests))
        .map(|at| Reference {
            at,
            read: probes.iter().map(|probe| probe(&at.q)).collect(),
            capacitances: (0..system.members.len()).map(|g| system.capacitance(g, &at.q)).collect(),
        })
        .collect();
    let mut best: Option<(PolynomialModel, FittedErrors)> = None;
    for degree in DEGREES {
        if degree > DEGREES[0] && space.size() > CUBIC {
            break;
        }
        let (_, (model, found)) = fits.least(tol, |fit| {
            let model = fit.model((degree, false), tol, &groups);
            let found = errors(&model, &space, &references);
            (found.rank(), (model, found))
        });
        // where both exceed the tolerance by errors that no degree changes, these do not decide by their last digits
        let sum = |errors: &FittedErrors| errors.of.iter().sum::<f64>() + errors.missed as f64;
        if best.as_ref().is_none_or(|(_, least)| found.rank() <= tol || sum(&found) < WORTH * sum(least)) {
            best = Some((model, found));
        }
        if best.as_ref().is_some_and(|(_, found)| found.rank() <= tol) {
            break;
        }
    }
    let (model, errors) = best.unwrap_or_else(|| {
        let (_, model) = fits.least(f64::INFINITY, |fit| (0.0, fit.model((DEGREES[0], false), tol, &groups)));
        (model, FittedErrors::NONE)
    });
    let states: Vec<Vec<f64>> = sampled.iter().map(|at| coordinates(&model, &at.z)).collect();
    let follows = following(&model, &states);
    let FittedErrors { of: errors, missed } = errors;
    let error = errors[0].max(errors[1]);
    FittedPolynomials { model, error, errors, compared: references.len() - missed, missed, follows }
}

/// Members by their voltage, but for those that stay apart.
pub(super) fn groups(system: &System, apart: &[usize]) -> Vec<Vec<usize>> {
    let rows = &system.electrics.gap_rows;
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for g in 0..system.members.len() {
        let like = |of: usize| (rows.row(of) - rows.row(g)).amax() <= SAME * rows.row(g).amax();
        match groups.iter_mut().find(|group| !apart.contains(&g) && !apart.contains(&group[0]) && like(group[0])) {
            Some(group) => group.push(g),
            None => groups.push(vec![g]),
        }
    }
    groups
}

/// The largest errors of a model's equilibria; infinite where it has none next to one of the full model on the branch from rest.
fn errors(model: &PolynomialModel, space: &ReducedSpace, references: &[Reference<'_>]) -> FittedErrors {
    let mut forces = ReducedForces::new(space);
    let scale = space.joints.closures.length_scale;
    let extent = |x: &[Pose]| x.iter().map(|x| x.xy().norm().max(x.z.abs() * scale)).fold(0.0, f64::max);
    let most = |p: usize| references.iter().map(|reference| reference.read[p].abs()).fold(0.0, f64::max);
    let farthest = references.iter().map(|reference| extent(&reference.at.q)).fold(1e-6 * scale, f64::max);
    let (mut worst, mut charged, mut missed) = (0.0f64, 0.0f64, 0);
    for reference in references {
        bimorph_base::budget::check();
        let mut x = coordinates(model, &reference.at.z);
        if !equilibrium(model, &reference.at.drive, &mut x) {
            if reference.at.beyond {
                missed += 1;
                continue;
            }
            return FittedErrors::NONE;
        }
        let z = &model.rotation * DVector::from_column_slice(&x) * model.scale;
        forces.place_at_rest(space, z.as_slice());
        let off: Vec<Pose> = forces.placed.at.iter().zip(&reference.at.q).map(|(a, b)| a - b).collect();
        worst = worst.max(extent(&off) / extent(&reference.at.q).max(SMALL * farthest));
        let values = model.monomials.values(&x);
        for (p, read) in model.probes.values(&values).iter().enumerate() {
            let size = reference.read[p].abs().max(SMALL * most(p));
            if size > 0.0 {
                worst = worst.max((read - reference.read[p]).abs() / size);
            }
        }
        let approach = model.approaches(&values);
        for points in &model.approaches.members {
            let whole: f64 = points.merged.iter().map(|g| reference.capacitances[*g]).sum();
            if whole > 0.0 {
                charged = charged.max((points.capacitance(approach.as_slice()) / whole - 1.0).abs());
            }
        }
    }
    FittedErrors { of: [worst, charged], missed }
}

/// The coordinates of a state of the space.
fn coordinates(model: &PolynomialModel, z: &[f64]) -> Vec<f64> {
    (model.rotation.tr_mul(&DVector::from_column_slice(z)) / model.scale).as_slice().to_vec()
}

/// Newton's method from `x`; true where it ends at a stable equilibrium.
pub fn equilibrium(model: &PolynomialModel, drive: &Drive, x: &mut [f64]) -> bool {
    let m = x.len();
    let mut tangent = DMatrix::zeros(m, m);
    let mut last = f64::INFINITY;
    for _ in 0..ITERATIONS {
        let force = model.force(x, drive, Some(&mut tangent));
        let Some((change, negative)) = solve(&tangent, &force) else { return false };
        let size = change.norm();
        if !size.is_finite() {
            return false;
        }
        x.iter_mut().zip(change.iter()).for_each(|(x, dx)| *x -= dx);
        let stalled = size <= STALLED && size > 0.1 * last;
        last = size;
        if size <= CONVERGED || stalled {
            return negative == 0;
        }
    }
    false
}
