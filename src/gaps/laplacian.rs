//! Potentials of nodes that conductors join, for given flows into them: G·v = i, G the weighted Laplacian of what conducts.
//!
//! Every part of the network hangs on a node whose potential is known, so that G is positive definite, and a sparse L·D·Lᵀ in an
//! approximate minimum degree ordering needs no pivoting: O(n) for chains and trees, O(n^1.5) for grids.
//!
//! Reference: P. R. Amestoy, T. A. Davis, I. S. Duff, "An approximate minimum degree ordering algorithm", SIAM J. Matrix Anal. Appl. 17
//! (1996); faer's factorization.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::cholesky::{LdltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky};
use faer::sparse::{SparseColMat, Triplet};
use faer::{Conj, MatMut, Par, Side};

/// G, factored.
pub(super) struct Laplacian {
    size: usize,
    symbolic: Option<SymbolicCholesky<usize>>,
    factor: Vec<f64>,
}

impl Laplacian {
    /// Of `size` nodes whose potentials are not known, joined by conductors (a, b, conductance); none: a node whose potential is 0. None
    /// where rounding leaves a pivot of zero, or numbers beyond what doubles hold.
    pub(super) fn new(
        size: usize,
        conductors: impl Iterator<Item = (Option<usize>, Option<usize>, f64)>,
    ) -> Option<Self> {
        if size == 0 {
            return Some(Self { size, symbolic: None, factor: Vec::new() });
        }
        let mut entries = Vec::new();
        let mut diagonal = vec![0.0; size];
        for (a, b, g) in conductors {
            if a == b {
                continue;
            }
            for node in [a, b].into_iter().flatten() {
                diagonal[node] += g;
            }
            if let (Some(a), Some(b)) = (a, b) {
                entries.push(Triplet::new(a.max(b), a.min(b), -g));
            }
        }
        entries.extend(diagonal.iter().enumerate().map(|(k, g)| Triplet::new(k, k, *g)));
        crate::budget::lay_out(entries.len().saturating_mul(5 * 24));
        crate::budget::check();
        let lower = SparseColMat::try_new_from_triplets(size, size, &entries).ok()?;
        let symbolic =
            factorize_symbolic_cholesky(lower.symbolic(), Side::Lower, SymmetricOrdering::Amd, Default::default())
                .ok()?;
        crate::budget::lay_out_matrix(symbolic.len_val(), 3);
        crate::budget::check();
        let mut factor = vec![0.0; symbolic.len_val()];
        let mut memory = MemBuffer::new(symbolic.factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Default::default()));
        symbolic
            .factorize_numeric_ldlt(
                &mut factor,
                lower.as_ref(),
                Side::Lower,
                Default::default(),
                Par::Seq,
                MemStack::new(&mut memory),
                Default::default(),
            )
            .ok()?;
        Some(Self { size, symbolic: Some(symbolic), factor })
    }

    /// Potentials for the flows into the nodes, in place, column after column.
    pub(super) fn solve(&self, flows: &mut [f64]) {
        let Some(symbolic) = &self.symbolic else { return };
        let mut memory = MemBuffer::new(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
        for column in flows.chunks_exact_mut(self.size) {
            crate::budget::check();
            LdltRef::new(symbolic, &self.factor).solve_in_place_with_conj(
                Conj::No,
                MatMut::from_column_major_slice_mut(column, self.size, 1),
                Par::Seq,
                MemStack::new(&mut memory),
            );
        }
    }
}

#[cfg(test)]
mod tests {
    //! A ladder and a grid against what series and parallel say; sizes that a dense matrix could not have.
    use super::*;

    /// A chain of 100 000 conductors of 1 S from ground to the last node: a flow of 1 there makes the potentials 1, 2, 3 ….
    #[test]
    fn chain() {
        let n: usize = 100_000;
        let conductors = (0..n).map(|k| (k.checked_sub(1), Some(k), 1.0));
        let laplacian = Laplacian::new(n, conductors).unwrap();
        let mut flow = vec![0.0; n];
        flow[n - 1] = 1.0;
        laplacian.solve(&mut flow);
        assert!(flow.iter().enumerate().all(|(k, v)| (v / (k + 1) as f64 - 1.0).abs() < 1e-9));
        // by its fill: two entries a node
        assert!(laplacian.factor.len() < 4 * n, "{}", laplacian.factor.len());
    }

    /// A flow into nothing but known potentials changes nothing.
    #[test]
    fn empty() {
        Laplacian::new(0, std::iter::empty()).unwrap().solve(&mut []);
    }
}
