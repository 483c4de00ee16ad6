//! Sparse L·D·Lᵀ by faer, with its own ordering: a baseline.
//!
//! The method of a general sparse package: the approximate minimum degree ordering of the scalar graph and the symbolic
//! factorization once for a model, the numeric factorization for each matrix. It knows nothing of bodies, and starts
//! from the couplings alone, without the fill that the recursion's order brings. There is no pivoting, as in the
//! recursion.
//!
//! Cost: that of the factor's fill, O(n + m) on the graphs where the recursion is.
//!
//! Reference: P. R. Amestoy, T. A. Davis, I. S. Duff, "An approximate minimum degree ordering algorithm", SIAM J. Matrix
//! Anal. Appl. 17 (1996).

use super::kind::{SolverKind, TooLarge};
use super::plain::{SolveScratch, flatten, unflatten};
use crate::linear::LinearSolver;
use bimorph_multibody::factor::ZeroPivot;
use bimorph_multibody::planar::{DOF, Pose};
use bimorph_multibody::{BodyMatrix, Pattern};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::cholesky::{
    LdltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat};
use faer::{Conj, MatMut, Par, Side};
use std::cell::RefCell;

/// A sparse factorization with its analysis and storage.
#[derive(Debug)]
pub struct Sparse {
    lower: SymbolicSparseColMat<usize>,
    values: Vec<f64>,
    symbolic: SymbolicCholesky<usize>,
    factor: Vec<f64>,
    scratch: RefCell<SolveScratch>,
}

impl Sparse {
    /// Analyses matrices on `pattern`.
    ///
    /// # Errors
    /// [`TooLarge`].
    pub fn new(pattern: &Pattern) -> Result<Self, TooLarge> {
        let n = DOF * pattern.bodies();
        let (mut start, mut row) = (vec![0], Vec::new());
        entries(pattern, |i, column, _| {
            start.resize(column + 1, row.len());
            row.push(i);
        });
        start.resize(n + 1, row.len());
        let lower = SymbolicSparseColMat::new_checked(n, n, start, None, row);
        let symbolic =
            factorize_symbolic_cholesky(lower.as_ref(), Side::Lower, SymmetricOrdering::Amd, Default::default())
                .map_err(|_| TooLarge { solver: SolverKind::Sparse.name(), unknowns: n })?;
        let memory = (symbolic.factorize_numeric_ldlt_scratch::<f64>(Par::Seq, Default::default()))
            .or(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
        Ok(Self {
            values: vec![0.0; lower.row_idx().len()],
            factor: vec![0.0; symbolic.len_val()],
            scratch: RefCell::new(SolveScratch { flat: vec![0.0; n], memory: MemBuffer::new(memory) }),
            lower,
            symbolic,
        })
    }

    /// Entries of the factor.
    pub fn entries(&self) -> usize {
        self.factor.len()
    }

    /// Multiplications of one factorization and of one solve: c·(c + 3)/2 and 2c + 1 for a column with c entries below the
    /// diagonal.
    pub fn multiplications(&self) -> (u64, u64) {
        let (mut factor, mut solve) = (0, 0);
        let mut column = |below: usize| {
            let c = below as u64;
            factor += c * (c + 3) / 2;
            solve += 2 * c + 1;
        };
        match self.symbolic.raw() {
            SymbolicCholeskyRaw::Simplicial(s) => {
                s.col_ptr().windows(2).for_each(|w| column((w[1] - w[0]).saturating_sub(1)));
            }
            SymbolicCholeskyRaw::Supernodal(s) => {
                for k in 0..s.n_supernodes() {
                    let width = s.supernode_end()[k] - s.supernode_begin()[k];
                    let rows = s.col_ptr_for_row_idx()[k + 1] - s.col_ptr_for_row_idx()[k];
                    (0..width).for_each(|j| column(width - 1 - j + rows));
                }
            }
        }
        (factor, solve)
    }
}

impl LinearSolver for Sparse {
    fn factor(&mut self, pattern: &Pattern, matrix: &mut BodyMatrix) -> Result<(), ZeroPivot> {
        let mut next = self.values.iter_mut();
        entries(pattern, |i, j, block| {
            if let Some(value) = next.next() {
                let source = block.map_or(&matrix.diagonal[j / DOF], |k| &matrix.below[k]);
                *value = source[(i % DOF, j % DOF)];
            }
        });
        let SolveScratch { memory, .. } = self.scratch.get_mut();
        let a = SparseColMatRef::new(self.lower.as_ref(), &self.values[..]);
        let factored = self.symbolic.factorize_numeric_ldlt(
            &mut self.factor,
            a,
            Side::Lower,
            Default::default(),
            Par::Seq,
            MemStack::new(memory),
            Default::default(),
        );
        factored.map(|_| ()).map_err(|faer::linalg::cholesky::ldlt::factor::LdltError::ZeroPivot { index }| {
            let place = self.symbolic.perm().map_or(index, |p| p.arrays().0[index]);
            ZeroPivot { body: place / DOF, direction: place % DOF }
        })
    }

    fn solve(&self, _: &Pattern, _: &BodyMatrix, b: &mut [Pose]) {
        let SolveScratch { flat, memory } = &mut *self.scratch.borrow_mut();
        flatten(b, flat);
        let n = flat.len();
        let right = MatMut::from_column_major_slice_mut(flat, n, 1);
        LdltRef::new(&self.symbolic, &self.factor).solve_in_place_with_conj(
            Conj::No,
            right,
            Par::Seq,
            MemStack::new(memory),
        );
        unflatten(flat, b);
    }
}

/// Walks the lower triangle column by column: row, column, and the block below the diagonal that holds the entry (none: the
/// diagonal block). Fill of the recursion is left out: it is zero before elimination.
fn entries(pattern: &Pattern, mut visit: impl FnMut(usize, usize, Option<usize>)) {
    for body in 0..pattern.bodies() {
        for column in DOF * body..DOF * (body + 1) {
            for row in column..DOF * (body + 1) {
                visit(row, column, None);
            }
            for block in pattern.column(body).filter(|&k| !pattern.is_fill(k)) {
                for i in 0..DOF {
                    visit(DOF * pattern.row(block) + i, column, Some(block));
                }
            }
        }
    }
}
