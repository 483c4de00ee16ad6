//! The largest eigenvalues of a symmetric operator that can only be applied.
//!
//! Lanczos with full reorthogonalization, twice, and without restarts: the operator is an inverse, whose large eigenvalues
//! stand far apart, so that a few more vectors than wanted eigenvalues are enough. Where the vectors close a subspace a new
//! direction is begun, which also finds equal eigenvalues in the end. The number of vectors is bounded; what has not
//! settled by then is told by its residual, and is still a good start for an iteration of a block.
//!
//! Reference: B. N. Parlett, "The symmetric eigenvalue problem" (1998), chapter 13.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

/// Ritz pairs, |θ| descending.
#[derive(Debug, Clone, PartialEq)]
pub struct Pairs {
    /// Eigenvalues of the operator.
    pub theta: Vec<f64>,
    /// Their vectors as columns, of length 1.
    pub vectors: DMatrix<f64>,
    /// How many of them settled.
    pub settled: usize,
}

/// A step that leaves less than this share of the largest eigenvalue has closed a subspace.
pub(super) const CLOSED: f64 = 1e-14;

/// The `wanted` largest eigenvalues in magnitude of `apply`, an operator on vectors of `n` numbers of rank `rank`, each
/// settled when its residual is below `tolerance` of it. At most `most` vectors are built up. `direction(k)` is the k-th
/// direction to begin with, in the range of the operator.
pub fn largest(
    (n, rank): (usize, usize),
    apply: &mut dyn FnMut(&DVector<f64>) -> DVector<f64>,
    direction: &dyn Fn(usize) -> DVector<f64>,
    wanted: usize,
    tolerance: f64,
    most: usize,
) -> Pairs {
    let most = most.min(rank).max(1);
    // the basis, then vectors as they are wanted, as shapes of bodies and of nodes
    crate::budget::lay_out_matrix(n, most + 4 * wanted.min(most));
    let mut basis = DMatrix::<f64>::zeros(n, most);
    let (mut diagonal, mut beside): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    let mut begun = 0;
    let mut next = fresh(&basis.columns(0, 0), direction, apply, &mut begun);
    let mut scale: f64 = 0.0;
    let mut check = wanted + 8;
    for j in 0..most {
        basis.set_column(j, &next);
        let mut w = apply(&next);
        diagonal.push(next.dot(&w));
        orthogonalize(&basis.columns(0, j + 1), &mut w);
        scale = scale.max(diagonal[j].abs());
        let length = w.norm();
        let closed = length.is_nan() || length <= CLOSED * scale;
        beside.push(if closed { 0.0 } else { length });
        let last = j + 1 == most;
        if last || j + 1 >= check {
            check = (j + 1) + ((j + 1) / 4).max(6);
            let (theta, shapes, settled) = ritz(&diagonal, &beside, wanted, tolerance);
            if last || settled >= wanted.min(j + 1) && j + 1 >= wanted {
                return Pairs { theta, vectors: basis.columns(0, j + 1) * shapes, settled };
            }
        }
        next = if closed { fresh(&basis.columns(0, j + 1), direction, apply, &mut begun) } else { w / length };
    }
    Pairs { theta: Vec::new(), vectors: DMatrix::zeros(n, 0), settled: 0 }
}

type Columns<'a> = nalgebra::DMatrixView<'a, f64>;

/// Removes from `w` what lies in the span of orthonormal columns, twice.
fn orthogonalize(basis: &Columns<'_>, w: &mut DVector<f64>) {
    for _ in 0..2 {
        let h = basis.tr_mul(w);
        w.gemv(-1.0, basis, &h, 1.0);
    }
}

/// A direction of length 1 that the basis does not have yet.
fn fresh(
    basis: &Columns<'_>,
    direction: &dyn Fn(usize) -> DVector<f64>,
    apply: &mut dyn FnMut(&DVector<f64>) -> DVector<f64>,
    begun: &mut usize,
) -> DVector<f64> {
    let mut w = apply(&direction(*begun));
    *begun += 1;
    let length = w.norm();
    w /= length;
    orthogonalize(basis, &mut w);
    let left = w.norm();
    w / left
}

/// Largest eigenvalues of the tridiagonal matrix, its vectors, and how many of them settled, counted from the largest.
fn ritz(diagonal: &[f64], beside: &[f64], wanted: usize, tolerance: f64) -> (Vec<f64>, DMatrix<f64>, usize) {
    let m = diagonal.len();
    let mut t = DMatrix::<f64>::zeros(m, m);
    for j in 0..m {
        t[(j, j)] = diagonal[j];
        if j + 1 < m {
            (t[(j, j + 1)], t[(j + 1, j)]) = (beside[j], beside[j]);
        }
    }
    let eigen = SymmetricEigen::new(t);
    let mut order: Vec<usize> = (0..m).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].abs().total_cmp(&eigen.eigenvalues[a].abs()));
    order.truncate(wanted);
    let theta: Vec<f64> = order.iter().map(|&k| eigen.eigenvalues[k]).collect();
    let rest = |k: usize| (beside[m - 1] * eigen.eigenvectors[(m - 1, k)]).abs();
    let settled = order.iter().zip(&theta).take_while(|(k, theta)| rest(**k) <= tolerance * theta.abs()).count();
    (theta, DMatrix::from_fn(m, order.len(), |r, c| eigen.eigenvectors[(r, order[c])]), settled)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A diagonal operator with threefold eigenvalues and a null space: the largest are found as often as they occur, and
    /// the iteration ends although the vectors close a subspace after three steps.
    #[test]
    fn closed_subspaces_end() {
        let values = |i: usize| [3.0, 2.0, 1.0, 0.0][i % 4];
        let n = 12;
        let mut apply = |x: &DVector<f64>| DVector::from_fn(n, |i, _| values(i) * x[i]);
        let direction = |k: usize| DVector::from_fn(n, |i, _| 1.0 + ((i * 7 + k * 5) % 11) as f64);
        let found = largest((n, 9), &mut apply, &direction, 9, 1e-12, 100);
        let want = [3.0, 3.0, 3.0, 2.0, 2.0, 2.0, 1.0, 1.0, 1.0];
        for (theta, want) in found.theta.iter().zip(want) {
            assert!((theta - want).abs() < 1e-12, "{:?}", found.theta);
        }
        assert_eq!(found.theta.len(), 9);
    }
}
