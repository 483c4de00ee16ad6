//! The polynomials of a trained space: least squares at the states that it was trained for and about them.
//!
//! 1. Coordinates in which the masses and the tangent at rest are diagonal.
//! 2. Equilibria of the full model at corners and points of the box of inputs (`samples`).
//! 3. Points of the trained box of coordinates, and points about these equilibria. The functions of [`super::shapes`] are evaluated there
//!    with exact kinematics. Every fifth point is kept apart for the error of the fit.
//! 4. The first derivatives at rest, so that the tangent there is exact; least squares by a QR factorization for the rest.
//! 5. Singular vectors: closures in the energy, approaches in the distance. Left out are those that change no equilibrium by more than a
//!    small part of the tolerance.

use super::super::inputs::low_discrepancy;
use super::super::space::{ReducedForces, ReducedSpace};
use super::cubature::thinned;
use super::monomials::{Monomials, Polynomials};
use super::shapes::{CombMotion, Probe, ShapeFunctions, has_combs};
use super::varying_mass::{matrices, slopes};
use super::{Approaches, ClosureStrains, PolynomialModel};
use bimorph_base::ErrorBudget;
use bimorph_domains::System;
use nalgebra::{DMatrix, DMatrixView, DVector, SVD, SymmetricEigen};
use std::sync::Arc;

/// Points of the box of coordinates and points about the equilibria, per monomial.
const WIDE: usize = 1;
const NEAR: usize = 3;
/// How far points about the equilibria lie from them, as a fraction of the trained box (1).
const ABOUT: f64 = 0.2;
/// How far motions go beyond the equilibria, where the training went as far (1).
const BEYOND: f64 = 2.0;
/// Least reach of a coordinate, as a fraction of the amplitude (1): coefficients of what hardly moves are known from there alone.
const LEAST: f64 = 0.1;
/// Step of differences at rest, as a fraction of the amplitude (1): their error is some 1e-8 of a curvature.
const STEP: f64 = 1e-4;
/// Size of a state, over the trained one, that others count at least as (1).
const AT_REST: f64 = 0.1;
/// Every so many points are kept apart.
const APART: usize = 5;

/// Samples and matrices of a space, of which polynomials are made.
pub(super) struct Fit<'a> {
    pub(super) space: &'a ReducedSpace,
    pub(super) system: &'a System,
    pub(super) shapes: ShapeFunctions<'a>,
    /// z of equilibria.
    equilibria: Vec<Vec<f64>>,
    rotation: DMatrix<f64>,
    mass: Vec<f64>,
    damping: DMatrix<f64>,
    /// For each of the equilibria, the relative change of the mass of the slowest coordinate.
    mass_changes: Vec<f64>,
    /// For a motion in the product, whose inertia follows the bodies.
    moves: bool,
    /// Largest |z_k| of the points of the fit.
    reach: Vec<f64>,
    /// Largest |z| of the equilibria.
    amplitude: f64,
}

/// Samples of a space with both laws of its combs, each made on demand.
pub(super) struct CombFits<'a, M> {
    make: M,
    along: Option<Fit<'a>>,
    across: Option<Fit<'a>>,
    /// Whether there are combs, and whether fingers that lie aside were nearer to the full model.
    combs: bool,
    nearer: bool,
}

impl<'a, M: Fn(CombMotion) -> Fit<'a>> CombFits<'a, M> {
    /// Of a system.
    pub(super) fn new(system: &System, make: M) -> Self {
        Self { make, along: None, across: None, combs: has_combs(system), nearer: false }
    }

    /// The result of `of` with its error: of fingers in the middle of their gaps where that is within `enough`, or else of those with the least
    /// error.
    pub(super) fn least<T>(&mut self, enough: f64, of: impl Fn(&Fit<'a>) -> (f64, T)) -> (f64, T) {
        let mut first = None;
        if !self.nearer {
            let along = of(self.along.get_or_insert_with(|| (self.make)(CombMotion::Along)));
            if along.0 <= enough || !self.combs {
                return along;
            }
            first = Some(along);
        }
        let across = of(self.across.get_or_insert_with(|| (self.make)(CombMotion::AlongAndAcross)));
        match first {
            Some(along) if along.0 <= across.0 => along,
            _ => {
                self.nearer = true;
                across
            }
        }
    }
}

impl<'a> Fit<'a> {
    /// Of a space of this system with equilibria, and what is read; where it `moves`, with its inertia.
    pub(super) fn new(
        space: &'a ReducedSpace,
        system: &'a System,
        equilibria: Vec<Vec<f64>>,
        probes: &'a [&'a Probe<'a>],
        (moves, combs): (bool, CombMotion),
    ) -> Self {
        let m = space.size();
        let rest = matrices(space, &vec![0.0; m]);
        let SymmetricEigen { eigenvectors, eigenvalues } = SymmetricEigen::new(rest.0.clone());
        let mut order: Vec<usize> = (0..m).collect();
        order.sort_by(|a, b| eigenvalues[*b].total_cmp(&eigenvalues[*a]));
        let signed = |k: usize| {
            let column = eigenvectors.column(k);
            let largest = column.iter().fold(0.0f64, |a, b| if b.abs() > a.abs() { *b } else { a });
            column * largest.signum()
        };
        let rotation = DMatrix::from_columns(&order.iter().map(|k| signed(*k)).collect::<Vec<_>>());
        // that of the slowest coordinate: others are small beside their springs
        let slowest = rotation.column(0).into_owned();
        let mass_of = |mass: &DMatrix<f64>| slowest.dot(&(mass * &slowest));
        let change = |z: &Vec<f64>| mass_of(&matrices(space, z).0) / mass_of(&rest.0) - 1.0;
        let mass_changes = equilibria.iter().map(change).collect();
        let least = eigenvalues.amax() * f64::EPSILON;
        let amplitude = equilibria.iter().map(|z| z.iter().map(|z| z * z).sum::<f64>().sqrt()).fold(0.0, f64::max);
        // samples of the training may lie beyond contact, where the mechanism cannot go
        let reach = |k: usize| {
            let reached = equilibria.iter().map(|z| z[k].abs()).fold(0.0, f64::max);
            space.reach[k].min(BEYOND * reached).max(reached).max(LEAST * amplitude)
        };
        let reach = (0..m).map(reach).collect();
        Self {
            space,
            system,
            shapes: ShapeFunctions::new(&space.joints, system, probes, (moves, combs)),
            equilibria,
            damping: rotation.tr_mul(&(&rest.1 * &rotation)),
            mass: order.iter().map(|k| eigenvalues[*k].max(least)).collect(),
            mass_changes,
            moves,
            reach,
            amplitude,
            rotation,
        }
    }

    /// The model of a degree, for a tolerance, with groups of members that have one voltage. A fine one leaves out fewer strains
    /// of closures.
    pub(super) fn model(&self, (degree, fine): (usize, bool), tol: f64, groups: &[Vec<usize>]) -> PolynomialModel {
        let monomials = Arc::new(Monomials::new(self.space.size(), degree));
        let scale = self.amplitude.max(f64::MIN_POSITIVE);
        let mut states = self.states(monomials.count());
        states.iter_mut().for_each(|z| *z = (self.rotation.tr_mul(&*z)) / scale);
        let reach: Vec<f64> = (0..self.space.size())
            .map(|k| states.iter().map(|x| x[k].abs()).fold(f64::MIN_POSITIVE, f64::max))
            .collect();
        let counts = self.shapes.counts();
        let rows: usize = counts.iter().sum();
        bimorph_base::budget::lay_out_matrix(states.len(), rows + 2 * monomials.count());
        let mut forces = ReducedForces::new(self.space);
        let mut values = DMatrix::zeros(states.len(), rows);
        for (k, x) in states.iter().enumerate() {
            bimorph_base::budget::check();
            let z = &self.rotation * x * scale;
            forces.place_at_rest(self.space, z.as_slice());
            values.row_mut(k).copy_from_slice(&self.shapes.values(&forces.placed.at));
        }
        // closures and inertia in units of the energy
        for (first, count) in in_energy(counts) {
            values.columns_mut(first, count).scale_mut(1.0 / scale);
        }
        let of_monomials = |apart: bool| {
            let chosen: Vec<usize> = (0..states.len()).filter(|k| (k % APART == APART - 1) == apart).collect();
            let table = DMatrix::from_fn(chosen.len(), monomials.count(), |k, c| {
                monomials.factors[c].iter().map(|i| states[chosen[k]][*i] / reach[*i]).product::<f64>()
            });
            (table, DMatrix::from_fn(chosen.len(), rows, |k, c| values[(chosen[k], c)]))
        };
        let (table, given) = of_monomials(false);
        let m = self.space.size();
        let mut coefficients = DMatrix::zeros(monomials.count(), rows);
        let mut linear = self.slopes(scale, counts);
        reach.iter().zip(linear.row_iter_mut()).for_each(|(reach, mut row)| row *= *reach);
        let curved = given - table.columns(0, m) * &linear;
        let of_higher = table.columns(m, table.ncols() - m).into_owned();
        let size: Vec<f64> = (0..table.nrows()).map(|k| table.view((k, 0), (1, m)).amax()).collect();
        coefficients.rows_mut(0, m).copy_from(&linear);
        coefficients.rows_mut(m, table.ncols() - m).copy_from(&weighted_least_squares(of_higher, curved, &size));
        let (kept, wanted) = of_monomials(true);
        let fit_error = largest_error(&(&kept * &coefficients), &wanted);
        let root = (table.nrows() as f64).sqrt();
        let typical = table * &coefficients / root;
        let errors = ErrorBudget::of(tol);
        let apart = errors.reduced_statics(); // of displacements, whose squares have masses
        let inertia = independent(coefficients.columns(in_energy(counts)[1].0, counts[4]), apart * apart, (m, apart));
        let mut inertia = Polynomials { monomials: Arc::clone(&monomials), coefficients: inertia };
        for (c, factors) in monomials.factors.iter().enumerate() {
            let size: f64 = factors.iter().map(|i| reach[*i]).product();
            coefficients.row_mut(c).scale_mut(1.0 / size);
            inertia.coefficients.column_mut(c).scale_mut(1.0 / size);
        }
        let all = Polynomials { monomials: Arc::clone(&monomials), coefficients: coefficients.transpose() };
        let [c, a, w, p, _] = counts;
        let least = if fine { errors.fine_closures() } else { errors.closures() };
        let closed = principal(&typical.columns(0, c).into_owned(), |_| least);
        let near = principal(&typical.columns(c, a).into_owned(), |largest| errors.approaches(largest));
        let (thermal, built_in) = self.shapes.rests();
        let closures = ClosureStrains {
            strains: all.rows(0, c).mixed(&closed.transpose()),
            thermal: closed.tr_mul(&thermal) / scale,
            built_in: closed.tr_mul(&DVector::from_vec(built_in)) / scale,
        };
        let approaches = Approaches {
            members: self.shapes.members.clone(),
            shapes: all.rows(c, a).mixed(&near.transpose()),
            mix: near,
        };
        let of_gaps: Vec<Vec<f64>> = (self.equilibria.iter())
            .flat_map(|z| [0.6, 0.9, 1.0].map(|share| DVector::from_column_slice(z) * share))
            .map(|z| (self.rotation.tr_mul(&z) / scale).as_slice().to_vec())
            .collect();
        let approaches = thinned(&approaches, groups, &of_gaps, &monomials, errors);
        let (stiffness, thermal, built_in) = self.tree_forces(scale);
        let [mass_slopes, damping_slopes] = match self.moves {
            true => [DMatrix::zeros(m, m), DMatrix::zeros(m, m)],
            false => slopes(self.space, (&self.rotation, scale), (&self.mass, &reach), errors.constant_mass()),
        };
        PolynomialModel {
            scale,
            rotation: self.rotation.clone(),
            reach,
            stiffness,
            thermal,
            built_in,
            closures,
            approaches,
            work: all.rows(c + a, w),
            probes: all.rows(c + a + w, p),
            inertia,
            mass: self.mass.clone(),
            damping: self.damping.clone(),
            mass_change: self.mass_change(&mass_slopes, scale),
            mass_slopes,
            damping_slopes,
            fit_error,
            monomials,
        }
    }

    /// The largest relative change of the mass of the slowest coordinate over the equilibria, beyond that of its slopes.
    fn mass_change(&self, slopes: &DMatrix<f64>, scale: f64) -> f64 {
        let beyond = |(z, change): (&Vec<f64>, &f64)| {
            let x = self.rotation.tr_mul(&DVector::from_column_slice(z)) / scale;
            (change - slopes.row(0).transpose().dot(&x) / self.mass[0]).abs()
        };
        self.equilibria.iter().zip(&self.mass_changes).map(beyond).fold(0.0, f64::max)
    }

    /// Derivatives of all functions with x at rest, coordinates × functions: central differences of exact kinematics.
    fn slopes(&self, scale: f64, counts: [usize; 5]) -> DMatrix<f64> {
        let mut forces = ReducedForces::new(self.space);
        let mut at = |k: usize, step: f64| {
            let z = self.rotation.column(k) * (scale * step);
            forces.place_at_rest(self.space, z.as_slice());
            DVector::from_vec(self.shapes.values(&forces.placed.at))
        };
        let m = self.space.size();
        let mut slopes = DMatrix::zeros(m, counts.iter().sum());
        for k in 0..m {
            let change = (at(k, STEP) - at(k, -STEP)) / (2.0 * STEP);
            slopes.row_mut(k).copy_from(&change.transpose());
        }
        for (first, count) in in_energy(counts) {
            slopes.columns_mut(first, count).scale_mut(1.0 / scale);
        }
        slopes
    }

    /// z of the points of the fit for so many monomials: those about equilibria, and those of the trained box.
    fn states(&self, monomials: usize) -> Vec<DVector<f64>> {
        let m = self.space.size();
        let within = |x: &[f64], share: f64| {
            DVector::from_iterator(m, x.iter().zip(&self.reach).map(move |(x, reach)| share * (2.0 * x - 1.0) * reach))
        };
        let count = (monomials * (WIDE + NEAR)).max(4 * APART);
        let points = low_discrepancy(m, count);
        let mut states: Vec<DVector<f64>> = self.equilibria.iter().map(|z| DVector::from_column_slice(z)).collect();
        for (k, x) in points.iter().enumerate() {
            let near = (k % (WIDE + NEAR) != 0).then(|| k / (WIDE + NEAR) % self.equilibria.len().max(1));
            states.push(match near.and_then(|k| self.equilibria.get(k)) {
                Some(z) => DVector::from_column_slice(z) + within(x, ABOUT),
                None => within(x, 1.0),
            });
        }
        states
    }

    /// K_T, t and t₀ over x.
    fn tree_forces(&self, scale: f64) -> (DMatrix<f64>, DMatrix<f64>, DVector<f64>) {
        let (m, links) = (self.space.size(), &self.space.joints.tree.links);
        let heaters = self.system.electrics.heating.heaters.len();
        let (mut thermal, mut built_in) = (DMatrix::zeros(m, heaters), DVector::zeros(m));
        for (k, direction) in self.space.directions.iter().enumerate() {
            for (link, x) in links.iter().zip(direction) {
                let along = (link.stiffness * *x).x;
                if let Some((heater, length)) = link.expansion {
                    thermal[(k, heater)] += along * length;
                }
                built_in[k] += along * link.rest;
            }
        }
        let turn = |x: &DMatrix<f64>| self.rotation.tr_mul(x);
        let stiffness = turn(&(self.space.tree_energy() * &self.rotation));
        (stiffness, turn(&thermal) / scale, self.rotation.tr_mul(&built_in) / scale)
    }
}

/// First row and number of the rows of closures and of inertia.
fn in_energy(counts: [usize; 5]) -> [(usize, usize); 2] {
    [(0, counts[0]), (counts[..4].iter().sum(), counts[4])]
}

/// Few rows with the products RᵀR of all rows, given as columns, but for `least` of their trace and for a fraction `own` of the product of each
/// of the first `m` with itself: a Cholesky factorization with diagonal pivots. These are coordinates, which must not lose their masses.
fn independent(columns: DMatrixView<'_, f64>, least: f64, (m, own): (usize, f64)) -> DMatrix<f64> {
    let n = columns.nrows();
    let mut left = columns * columns.transpose();
    let bound = least * left.trace();
    let bounds: Vec<f64> = (0..m).map(|k| own * left[(k, k)]).collect();
    let mut rows: Vec<DVector<f64>> = Vec::new();
    while rows.len() < n {
        let pivot = if left.diagonal().sum() > bound {
            left.diagonal().imax()
        } else if let Some(light) = (0..m).find(|&k| left[(k, k)] > bounds[k]) {
            light
        } else {
            break;
        };
        if left[(pivot, pivot)] <= 0.0 {
            break;
        }
        let row = left.column(pivot) / left[(pivot, pivot)].sqrt();
        left -= &row * row.transpose();
        rows.push(row);
    }
    let rows: Vec<_> = rows.iter().map(DVector::transpose).collect();
    if rows.is_empty() { DMatrix::zeros(0, n) } else { DMatrix::from_rows(&rows) }
}

/// The coefficients with which `table` comes closest to `given`, one column each. Rows count as their states are near rest, by their sizes, so that
/// small motions are as right in proportion as large ones.
fn weighted_least_squares(mut table: DMatrix<f64>, mut given: DMatrix<f64>, sizes: &[f64]) -> DMatrix<f64> {
    for (k, size) in sizes.iter().enumerate() {
        let weight = 1.0 / (AT_REST + size);
        table.row_mut(k).scale_mut(weight);
        given.row_mut(k).scale_mut(weight);
    }
    let columns = table.ncols();
    let factored = table.qr();
    let mut right = given;
    factored.q_tr_mul(&mut right);
    let mut found = right.rows(0, columns).into_owned();
    let r = factored.r();
    // a coordinate that no state moves has a column of zeros: it keeps coefficients of 0
    let least = r.diagonal().amax() * 1e-13;
    for k in (0..columns).rev() {
        for c in 0..found.ncols() {
            let known: f64 = (k + 1..columns).map(|i| r[(k, i)] * found[(i, c)]).sum();
            found[(k, c)] = if r[(k, k)].abs() > least { (found[(k, c)] - known) / r[(k, k)] } else { 0.0 };
        }
    }
    found
}

/// Largest error of a column, relative to the largest value in it.
fn largest_error(found: &DMatrix<f64>, wanted: &DMatrix<f64>) -> f64 {
    let of = |c: usize| {
        let most = wanted.column(c).amax();
        if most > 0.0 { (found.column(c) - wanted.column(c)).amax() / most } else { 0.0 }
    };
    (0..wanted.ncols()).map(of).fold(0.0, f64::max)
}

/// Orthonormal directions over the columns of a table in which its rows lie but for parts of a root mean square below `least` of the largest.
fn principal(typical: &DMatrix<f64>, least: impl Fn(f64) -> f64) -> DMatrix<f64> {
    let n = typical.ncols();
    if n == 0 || typical.nrows() == 0 {
        return DMatrix::zeros(n, 0);
    }
    let decomposed = SVD::new(typical.transpose(), true, false);
    let (Some(u), sigma) = (decomposed.u, decomposed.singular_values) else { return DMatrix::identity(n, n) };
    let mut order: Vec<usize> = (0..sigma.len()).collect();
    order.sort_by(|a, b| sigma[*b].total_cmp(&sigma[*a]));
    let least = least(order.first().map_or(0.0, |k| sigma[*k]));
    let signed = |k: usize| {
        let column = u.column(k);
        let largest = column.iter().fold(0.0f64, |a, b| if b.abs() > a.abs() { *b } else { a });
        column * largest.signum()
    };
    let columns: Vec<DVector<f64>> = order.into_iter().filter(|k| sigma[*k] > least).map(signed).collect();
    if columns.is_empty() { DMatrix::zeros(n, 0) } else { DMatrix::from_columns(&columns) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of inertia have the mass of each coordinate within the given fraction, also where it has 1e-10 of all, and leave out light products
    /// of others.
    #[test]
    fn coordinates_keep_their_masses() {
        let columns = DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, 1e-5, 1e-4]));
        let rows = independent(columns.as_view(), 1e-5, (2, 1e-3));
        assert_eq!(rows.nrows(), 2);
        let mass = |k: usize| rows.column(k).norm_squared();
        assert!((mass(0) - 1.0).abs() <= 1e-3 && (mass(1) / 1e-10 - 1.0).abs() <= 1e-3, "{rows}");
        assert!(mass(2) == 0.0, "{rows}");
    }
}
