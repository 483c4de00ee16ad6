//! Dense LU with partial pivoting, by faer: a baseline.
//!
//! The method of a general-purpose program for a small system: blocked, vectorized, backward stable for any regular
//! matrix, without use of sparsity. Its exchanges compare newtons with newton metres. Rows of moments, which are small
//! in SI, therefore have a few digits less than from a symmetric elimination, which does not depend on units.
//!
//! Cost: 2n³/3 for a factorization of n scalar unknowns, 2n² for a solve; n² numbers.
//!
//! Reference: G. H. Golub, C. F. Van Loan, "Matrix Computations" (2013), §3.4.

use super::plain::{SolveScratch, flatten, spread, unflatten};
use crate::linear::LinearSolver;
use bimorph_multibody::factor::ZeroPivot;
use bimorph_multibody::planar::{DOF, Pose};
use bimorph_multibody::{BodyMatrix, Pattern};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::lu::partial_pivoting::{factor, solve};
use faer::perm::PermRef;
use faer::{Mat, MatMut, Par};
use std::cell::RefCell;

/// A dense pivoted factorization with its storage.
#[derive(Debug)]
pub struct DensePivoted {
    lu: Mat<f64>,
    forward: Vec<usize>,
    backward: Vec<usize>,
    scratch: RefCell<SolveScratch>,
}

impl DensePivoted {
    /// Storage for matrices on `pattern`.
    pub fn new(pattern: &Pattern) -> Self {
        let n = DOF * pattern.bodies();
        let memory = factor::lu_in_place_scratch::<usize, f64>(n, n, Par::Seq, Default::default())
            .or(solve::solve_in_place_scratch::<usize, f64>(n, 1, Par::Seq));
        Self {
            lu: Mat::zeros(n, n),
            forward: vec![0; n],
            backward: vec![0; n],
            scratch: RefCell::new(SolveScratch { flat: vec![0.0; n], memory: MemBuffer::new(memory) }),
        }
    }
}

impl LinearSolver for DensePivoted {
    fn factor(&mut self, pattern: &Pattern, matrix: &mut BodyMatrix) -> Result<(), ZeroPivot> {
        self.lu.fill(0.0);
        spread(pattern, matrix, |i, j, value| {
            self.lu[(i, j)] = value;
            self.lu[(j, i)] = value;
        });
        let SolveScratch { memory, .. } = self.scratch.get_mut();
        let stack = MemStack::new(memory);
        let (lu, params) = (self.lu.as_mut(), Default::default());
        factor::lu_in_place(lu, &mut self.forward, &mut self.backward, Par::Seq, stack, params);
        let vanished = |&k: &usize| self.lu[(k, k)] == 0.0 || !self.lu[(k, k)].is_finite();
        match (0..self.forward.len()).find(vanished) {
            Some(k) => Err(ZeroPivot { body: k / DOF, direction: k % DOF }),
            None => Ok(()),
        }
    }

    fn solve(&self, _: &Pattern, _: &BodyMatrix, b: &mut [Pose]) {
        let SolveScratch { flat, memory } = &mut *self.scratch.borrow_mut();
        flatten(b, flat);
        let n = flat.len();
        let permutation = PermRef::new_checked(&self.forward, &self.backward, n);
        let right = MatMut::from_column_major_slice_mut(flat, n, 1);
        let (l, u) = (self.lu.as_ref(), self.lu.as_ref());
        solve::solve_in_place(l, u, permutation, right, Par::Seq, MemStack::new(memory));
        unflatten(flat, b);
    }
}
