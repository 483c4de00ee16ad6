//! The largest eigenvalues of a symmetric operator that can only be applied.
//!
//! Lanczos with full reorthogonalization, twice, and without restarts: the operator is an inverse, whose large
//! eigenvalues stand far apart, so that a few more vectors than wanted eigenvalues are enough. Where the vectors close
//! a subspace a new direction is begun, which also finds equal eigenvalues in the end. The number of vectors is
//! bounded. The residual of a mode that has not converged by then is reported, and its shape is still a good start for
//! a block iteration.
//!
//! Reference: B. N. Parlett, "The symmetric eigenvalue problem" (1998), chapter 13.

use super::tridiagonal::{eigen, last_entries};
use bimorph_base::ErrorBudget;
use nalgebra::DMatrix;

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

/// A step that leaves less than this fraction of the largest eigenvalue has closed a subspace.
pub(super) const CLOSED: f64 = 1e-14;
/// Vectors beyond the wanted ones before the first convergence check, and between two checks at least.
const FIRST_LOOK: usize = 6;
const NEXT_LOOK: usize = 3;
/// Vectors that memory is taken for at first beyond the wanted ones.
const ROOM: usize = 16;

/// The `wanted` largest eigenvalues in magnitude of `apply`, an operator on vectors of `n` numbers of rank `rank`, each
/// settled when its residual is below `tolerance` of it. At most `most` vectors are built up. `apply` puts the image of its first vector
/// into the second; `direction(k)` is the k-th direction to begin with, in the range of the operator.
pub fn largest(
    (n, rank): (usize, usize),
    apply: &mut dyn FnMut(&[f64], &mut [f64]),
    direction: &dyn Fn(usize) -> Vec<f64>,
    wanted: usize,
    tolerance: f64,
    most: usize,
) -> Pairs {
    let most = most.min(rank).max(1);
    // the basis, then vectors as they are wanted, as shapes of bodies and of nodes
    bimorph_base::budget::lay_out_matrix(n, most + 4 * wanted.min(most));
    // one vector after the other
    let mut basis: Vec<f64> = Vec::with_capacity(n * (wanted + ROOM).min(most));
    let (mut diagonal, mut beside): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    let mut begun = 0;
    let mut next = fresh(&basis, direction, apply, &mut begun);
    let mut w = vec![0.0; n];
    let mut scale: f64 = 0.0;
    let mut check = wanted + FIRST_LOOK;
    for j in 0..most {
        basis.extend_from_slice(&next);
        apply(&next, &mut w);
        diagonal.push(dot(&next, &w));
        orthogonalize(&basis, &mut w);
        scale = scale.max(diagonal[j].abs());
        let length = dot(&w, &w).sqrt();
        let closed = length.is_nan() || length <= CLOSED * scale;
        beside.push(if closed { 0.0 } else { length });
        let last = j + 1 == most;
        if last || j + 1 >= check {
            check = (j + 1) + ((j + 1) / 4).max(NEXT_LOOK);
            let settled = settled(&diagonal, &beside, wanted, tolerance);
            if last || settled >= wanted.min(j + 1) && j + 1 >= wanted {
                let (theta, shapes) = ritz(&diagonal, &beside, wanted);
                return Pairs { theta, vectors: combined(&basis, n, &shapes), settled };
            }
        }
        if closed {
            next = fresh(&basis, direction, apply, &mut begun);
        } else {
            next.iter_mut().zip(&w).for_each(|(next, w)| *next = w / length);
        }
    }
    Pairs { theta: Vec::new(), vectors: DMatrix::zeros(n, 0), settled: 0 }
}

/// aᵀb, in eight sums: always the same eight, and as fast as vectors are read.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a, b) = (a.chunks_exact(8), b.chunks_exact(8));
    let rest: f64 = a.remainder().iter().zip(b.remainder()).map(|(a, b)| a * b).sum();
    for (a, b) in a.zip(b) {
        for k in 0..8 {
            sums[k] += a[k] * b[k];
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// `w += factor·v`.
fn add(w: &mut [f64], factor: f64, v: &[f64]) {
    w.iter_mut().zip(v).for_each(|(w, v)| *w += factor * v);
}

/// Removes from `w` what lies in the span of orthonormal vectors, twice.
fn orthogonalize(basis: &[f64], w: &mut [f64]) {
    let mut h = Vec::with_capacity(basis.len() / w.len().max(1));
    for _ in 0..2 {
        h.clear();
        h.extend(basis.chunks_exact(w.len()).map(|v| dot(v, w)));
        for (v, h) in basis.chunks_exact(w.len()).zip(&h) {
            add(w, -h, v);
        }
    }
}

/// A direction of length 1 that the basis does not have yet.
fn fresh(
    basis: &[f64],
    direction: &dyn Fn(usize) -> Vec<f64>,
    apply: &mut dyn FnMut(&[f64], &mut [f64]),
    begun: &mut usize,
) -> Vec<f64> {
    let from = direction(*begun);
    let mut w = vec![0.0; from.len()];
    apply(&from, &mut w);
    *begun += 1;
    let length = dot(&w, &w).sqrt();
    w.iter_mut().for_each(|w| *w /= length);
    orthogonalize(basis, &mut w);
    let left = dot(&w, &w).sqrt();
    w.iter_mut().for_each(|w| *w /= left);
    w
}

/// The combinations of basis vectors given by `shapes`.
fn combined(basis: &[f64], n: usize, shapes: &[Vec<f64>]) -> DMatrix<f64> {
    let mut vectors = DMatrix::zeros(n, shapes.len());
    for (mut column, shape) in vectors.column_iter_mut().zip(shapes) {
        for (v, share) in basis.chunks_exact(n).zip(shape) {
            add(column.as_mut_slice(), *share, v);
        }
    }
    vectors
}

/// Places of the largest numbers in magnitude, the largest first.
fn largest_of(values: &[f64], wanted: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[b].abs().total_cmp(&values[a].abs()));
    order.truncate(wanted);
    order
}

/// How many of the largest eigenvalues of the tridiagonal matrix have settled, counted from the largest.
fn settled(diagonal: &[f64], beside: &[f64], wanted: usize, tolerance: f64) -> usize {
    let m = diagonal.len();
    let (values, last) = last_entries(diagonal, &beside[..m - 1]);
    let rest = |k: usize| (beside[m - 1] * last[k][0]).abs();
    let settled = |k: usize| rest(k) <= ErrorBudget::of(tolerance).within(values[k].abs());
    largest_of(&values, wanted).into_iter().take_while(|&k| settled(k)).count()
}

/// Largest eigenvalues of the tridiagonal matrix, and its vectors.
fn ritz(diagonal: &[f64], beside: &[f64], wanted: usize) -> (Vec<f64>, Vec<Vec<f64>>) {
    let (values, mut vectors) = eigen(diagonal, &beside[..diagonal.len() - 1]);
    let order = largest_of(&values, wanted);
    let theta = order.iter().map(|&k| values[k]).collect();
    (theta, order.into_iter().map(|k| std::mem::take(&mut vectors[k])).collect())
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
        let mut apply = |x: &[f64], y: &mut [f64]| (0..n).for_each(|i| y[i] = values(i) * x[i]);
        let direction = |k: usize| (0..n).map(|i| 1.0 + ((i * 7 + k * 5) % 11) as f64).collect();
        let found = largest((n, 9), &mut apply, &direction, 9, 1e-12, 100);
        let want = [3.0, 3.0, 3.0, 2.0, 2.0, 2.0, 1.0, 1.0, 1.0];
        for (theta, want) in found.theta.iter().zip(want) {
            assert!((theta - want).abs() < 1e-12, "{:?}", found.theta);
        }
        assert_eq!(found.theta.len(), 9);
    }
}
