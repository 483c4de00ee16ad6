//! Dense Gaussian elimination without exchanges: a baseline.
//!
//! It does what a solution written out symbolically does (AUTOLEV's constraint solution, which the paper compares
//! with): rows are eliminated in the order in which they stand, whatever their numbers turn out to be. On the definite
//! matrices of implicit steps that is stable, and this baseline differs from the others in cost alone. On indefinite
//! ones, as those of constraints kept as equations, a small pivot invalidates the result without an error. No use is
//! made of zeros or of symmetry.
//!
//! Cost: 2n³/3 for a factorization of n scalar unknowns, 2n² for a solve; n² numbers.
//!
//! Reference: G. H. Golub, C. F. Van Loan, "Matrix Computations" (2013), algorithm 3.2.1 (outer product LU).

use super::plain::spread;
use crate::linear::LinearSolver;
use bimorph_multibody::factor::ZeroPivot;
use bimorph_multibody::planar::{DOF, Pose};
use bimorph_multibody::{BodyMatrix, Pattern};

/// L and U of a dense matrix, row by row in one square.
#[derive(Debug, Clone)]
pub struct DenseUnpivoted {
    n: usize,
    rows: Vec<f64>,
}

impl DenseUnpivoted {
    /// Storage for matrices on `pattern`.
    pub fn new(pattern: &Pattern) -> Self {
        let n = DOF * pattern.bodies();
        Self { n, rows: vec![0.0; n * n] }
    }
}

impl LinearSolver for DenseUnpivoted {
    fn factor(&mut self, pattern: &Pattern, matrix: &mut BodyMatrix) -> Result<(), ZeroPivot> {
        let n = self.n;
        self.rows.fill(0.0);
        spread(pattern, matrix, |i, j, value| {
            self.rows[i * n + j] = value;
            self.rows[j * n + i] = value;
        });
        for k in 0..n {
            let (done, below) = self.rows.split_at_mut((k + 1) * n);
            let pivot_row = &done[k * n + k..];
            let pivot = pivot_row[0];
            if pivot == 0.0 || !pivot.is_finite() {
                return Err(ZeroPivot { body: k / DOF, direction: k % DOF });
            }
            for row in below.chunks_exact_mut(n) {
                let factor = row[k] / pivot;
                row[k] = factor;
                for (a, u) in row[k + 1..].iter_mut().zip(&pivot_row[1..]) {
                    *a -= factor * u;
                }
            }
        }
        Ok(())
    }

    fn solve(&self, _: &Pattern, _: &BodyMatrix, b: &mut [Pose]) {
        let n = self.n;
        for i in 0..n {
            let row = &self.rows[i * n..(i + 1) * n];
            let known: f64 = (0..i).map(|j| row[j] * b[j / DOF][j % DOF]).sum();
            b[i / DOF][i % DOF] -= known;
        }
        for i in (0..n).rev() {
            let row = &self.rows[i * n..(i + 1) * n];
            let known: f64 = (i + 1..n).map(|j| row[j] * b[j / DOF][j % DOF]).sum();
            b[i / DOF][i % DOF] = (b[i / DOF][i % DOF] - known) / row[i];
        }
    }
}
