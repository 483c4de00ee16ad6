//! The polynomials of a trained space for a motion, with their error against exact kinematics.
//!
//! At equilibria of the training the difference of the forces, over the exact tangent, is the error of the coordinates to first order. It is taken in
//! the mass norm, relative to the largest displacement, as the error of the reduction is.

use super::super::space::{ReducedForces, ReducedSpace};
use super::super::statics::solve;
use super::super::training::Training;
use super::fit::{CombFits, Fit};
use super::motion::{PolynomialForces, PolynomialMotion, has_polynomials};
use super::statics::groups;
use bimorph_base::ErrorBudget;
use bimorph_domains::{Drive, System};
use nalgebra::{DMatrix, DVector};

/// Degrees of the polynomials, most coordinates of each, and whether few strains are left out.
const ATTEMPTS: [(usize, usize, bool); 4] = [(2, 40, false), (2, 40, true), (3, 12, false), (3, 12, true)];

/// Polynomials for a motion.
#[derive(Debug, Clone)]
pub struct FittedMotion {
    /// The space with directions turned as theirs are.
    pub space: ReducedSpace,
    /// The polynomials.
    pub polynomials: PolynomialMotion,
    /// Largest coordinates of equilibria in the box, in the norm of masses (√(N·m)·s).
    pub largest: f64,
}

/// The turned space of a training and its polynomials for the motion of a system under a drive: of the lowest degree and the fewest strains whose error at the equilibria
/// is within its part of the tolerance. Fingers of combs stay in the middle of their gaps where that is within it, too. None where there are no such
/// polynomials, or a law of a member is none of single points.
pub fn of_motion(training: &Training, system: &System, drive: &Drive, errors: ErrorBudget) -> Option<FittedMotion> {
    if training.equilibria.is_empty() || !has_polynomials(system) {
        return None;
    }
    let space = training.space.of_system(system);
    let mut fits =
        CombFits::new(system, |combs| Fit::new(&space, system, training.equilibria.clone(), &[], (true, combs)));
    let groups = groups(system, &[]);
    let share = errors.reduced_statics();
    for (degree, most, fine) in ATTEMPTS {
        if space.size() > most {
            break;
        }
        let made = fits.least(share, |fit| {
            let model = fit.model((degree, fine), share, &groups);
            let turned = space.turned(&model.rotation);
            let motion = PolynomialMotion::new(&model);
            let states: Vec<Vec<f64>> = (training.equilibria.iter())
                .map(|z| model.rotation.tr_mul(&DVector::from_column_slice(z)).as_slice().to_vec())
                .collect();
            let error = error(&motion, &turned, &states, drive, &model.mass);
            let largest = states.iter().map(|z| mass_norm(z, &model.mass)).fold(0.0, f64::max);
            (error, FittedMotion { space: turned, polynomials: motion, largest })
        });
        if made.0 <= share {
            return Some(made.1);
        }
    }
    None
}

fn mass_norm(z: &[f64], mass: &[f64]) -> f64 {
    z.iter().zip(mass).map(|(z, mass)| mass * z * z).sum::<f64>().sqrt()
}

/// Largest error of the coordinates at some states, over the largest of these, in the norm of masses (1).
fn error(of: &PolynomialMotion, space: &ReducedSpace, states: &[Vec<f64>], drive: &Drive, mass: &[f64]) -> f64 {
    let m = space.size();
    let (mut exact, mut forces) = (ReducedForces::new(space), PolynomialForces::new(of));
    let (mut known, mut found, mut tangent) = (vec![0.0; m], vec![0.0; m], DMatrix::zeros(m, m));
    let none = vec![0.0; m];
    let norm = |z: &[f64]| mass_norm(z, mass);
    let largest = states.iter().map(|z| norm(z)).fold(f64::MIN_POSITIVE, f64::max);
    let mut worst = 0.0f64;
    for z in states {
        bimorph_base::budget::check();
        exact.tangent(space, z, drive, &mut known, &mut tangent);
        forces.residual(of, [z, &none, &none], drive, &mut found);
        known.iter_mut().zip(&found).for_each(|(known, found)| *known -= found);
        let Some((off, _)) = solve(&tangent, &DVector::from_column_slice(&known)) else { return f64::INFINITY };
        let error = norm(off.as_slice()) / largest;
        worst = if error.is_nan() { f64::INFINITY } else { worst.max(error) };
    }
    worst
}
