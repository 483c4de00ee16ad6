//! The lowest modes of K·x = λ·M·x by inverse iteration of a block of vectors, for models whose modes are near known.
//!
//! Each iteration is one solve with the block factor for every vector and a small dense eigenproblem in their span
//! (Rayleigh–Ritz). A mode gains the factor (λ/λ_p₊₁)² in its frequency with every iteration, p the number of vectors.
//! Repeated frequencies are returned with their multiplicity. Cost: O(p·n + p²·n) an iteration.
//!
//! Reference: K.-J. Bathe, "Finite Element Procedures" (2014), §11.6.

use bimorph_base::ErrorBudget;
use bimorph_multibody::planar::{DOF, Pose};
use bimorph_multibody::{BodyMatrix, Model};
use nalgebra::{Cholesky, DMatrix, SymmetricEigen};

/// Iterations at most.
const MAX_ITERATIONS: usize = 60;

/// Modes as columns.
#[derive(Debug, Clone, PartialEq)]
pub struct SubspaceModes {
    /// λ = ω² of each vector of the block, ascending (rad²/s²).
    pub lambda: Vec<f64>,
    /// Shapes with xᵀMx = 1.
    pub shapes: Vec<Vec<Pose>>,
    /// Iterations used.
    pub iterations: usize,
}

/// A fixed block of vectors with components everywhere.
pub fn start(bodies: usize, count: usize, length: f64) -> Vec<Vec<Pose>> {
    let mut seed = 0x9e37_79b9_7f4a_7c15u64;
    let mut next = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    (0..count).map(|_| (0..bodies).map(|_| Pose::new(next(), next(), next() / length)).collect()).collect()
}

/// Iterates until the `wanted` lowest λ change by less than `tolerance`, relatively. `factor` is that of K − σM. None where
/// the vectors have become dependent, as they must when there are fewer modes, or do not settle.
pub fn iterate(
    model: &Model,
    (factor, shift): (&BodyMatrix, f64),
    start: Vec<Vec<Pose>>,
    wanted: usize,
    tolerance: f64,
) -> Option<SubspaceModes> {
    let (n, count) = (model.bodies.len(), start.len());
    let mass: Vec<Pose> = (0..n).map(|k| model.mass(k)).collect();
    let mut x = columns(&start);
    let mut lambda = vec![f64::INFINITY; count];
    let mut scratch = vec![Pose::zeros(); n];
    let weigh = |x: &DMatrix<f64>| {
        let mut z = x.clone();
        for mut column in z.column_iter_mut() {
            for (k, m) in mass.iter().enumerate() {
                for i in 0..DOF {
                    column[DOF * k + i] *= m[i];
                }
            }
        }
        z
    };
    for iterations in 1..=MAX_ITERATIONS {
        let z = weigh(&x);
        let mut y = z.clone();
        for mut column in y.column_iter_mut() {
            bimorph_base::budget::check();
            for (k, pose) in scratch.iter_mut().enumerate() {
                *pose = Pose::new(column[DOF * k], column[DOF * k + 1], column[DOF * k + 2]);
            }
            model.project(&mut scratch);
            factor.solve(&model.pattern, &mut scratch);
            model.project(&mut scratch);
            for (k, pose) in scratch.iter().enumerate() {
                for i in 0..DOF {
                    column[DOF * k + i] = pose[i];
                }
            }
        }
        let (mu, v) = ritz(&(y.transpose() * z), &(y.transpose() * weigh(&y)))?;
        x = y * v;
        let settled = (mu.iter().zip(&lambda).take(wanted))
            .all(|(mu, old)| (mu + shift - old).abs() <= ErrorBudget::of(tolerance).within(mu.abs() + shift.abs()));
        lambda = mu.iter().map(|mu| mu + shift).collect();
        if settled {
            let shapes = (x.column_iter())
                .map(|c| (0..n).map(|k| Pose::new(c[DOF * k], c[DOF * k + 1], c[DOF * k + 2])).collect())
                .collect();
            return Some(SubspaceModes { lambda, shapes, iterations });
        }
    }
    None
}

/// Body vectors as the columns of a matrix.
pub fn columns(vectors: &[Vec<Pose>]) -> DMatrix<f64> {
    let rows = vectors.first().map_or(0, |v| DOF * v.len());
    let mut matrix = DMatrix::zeros(rows, vectors.len());
    for (mut column, vector) in matrix.column_iter_mut().zip(vectors) {
        for (to, p) in column.as_mut_slice().chunks_exact_mut(DOF).zip(vector) {
            to.copy_from_slice(p.as_slice());
        }
    }
    matrix
}

/// Eigenvalues, ascending, and vectors of A·v = μ·B·v with B definite, vᵀBv = 1. None where B is not, and without any vector.
pub fn ritz(a: &DMatrix<f64>, b: &DMatrix<f64>) -> Option<(Vec<f64>, DMatrix<f64>)> {
    let n = a.nrows();
    if n == 0 {
        return None;
    }
    // vectors of unit length: the remainder of B shows how dependent they are
    let scale: Vec<f64> = (0..n).map(|i| 1.0 / b[(i, i)].sqrt()).collect();
    if scale.iter().any(|s| !s.is_finite()) {
        return None;
    }
    let b = DMatrix::from_fn(n, n, |i, j| 0.5 * (b[(i, j)] + b[(j, i)]) * scale[i] * scale[j]);
    let a = DMatrix::from_fn(n, n, |i, j| 0.5 * (a[(i, j)] + a[(j, i)]) * scale[i] * scale[j]);
    let l = Cholesky::new(b)?.unpack();
    let half = l.solve_lower_triangular(&a)?;
    let c = l.solve_lower_triangular(&half.transpose())?;
    let eigen = SymmetricEigen::new((&c + c.transpose()) * 0.5);
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&i, &j| eigen.eigenvalues[i].total_cmp(&eigen.eigenvalues[j]));
    let u = DMatrix::from_fn(n, n, |r, c| eigen.eigenvectors[(r, order[c])]);
    let mut v = l.tr_solve_lower_triangular(&u)?;
    for (mut row, s) in v.row_iter_mut().zip(&scale) {
        row *= *s;
    }
    Some((order.iter().map(|&i| eigen.eigenvalues[i]).collect(), v))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A space without vectors has no modes, instead of a panic of the decomposition: a body of 1e300 kg·m² leaves none.
    #[test]
    fn a_space_without_vectors_has_no_modes() {
        assert!(ritz(&DMatrix::zeros(0, 0), &DMatrix::zeros(0, 0)).is_none());
    }
}
