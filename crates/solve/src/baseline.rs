//! Baselines that the recursion is measured against: other factorizations of the same matrix, which find the same solution to
//! rounding, and the linear frame with its full mass matrix.
//!
//! | file | what it holds |
//! |---|---|
//! | [`dense_unpivoted`] | dense elimination without exchanges, as a symbolic solution does |
//! | [`dense`] | dense LU with partial pivoting |
//! | [`sparse`] | sparse L·D·Lᵀ with an approximate minimum degree ordering |
//! | [`frame_modes`] | natural frequencies of a linear frame, densely |
//! | [`frame_motion`] | its motion by the trapezoidal rule |

pub mod dense;
pub mod dense_unpivoted;
pub mod frame_modes;
pub mod frame_motion;
mod kind;
mod plain;
pub mod sparse;

use crate::equations::linear::{LinearSolver, Recursion};
use bimorph_multibody::factor::ZeroPivot;
use bimorph_multibody::planar::{DOF, Pose};
use bimorph_multibody::{BodyMatrix, Pattern};
use dense::DensePivoted;
use dense_unpivoted::DenseUnpivoted;
pub use kind::{SolverKind, TooLarge};
use sparse::Sparse;

/// Dense baselines refuse more unknowns than this: their square would be larger than 1.2 GB.
const MAX_DENSE: usize = 12_000;

/// A linear solver chosen at run time: one comparison for each factorization or solve.
#[derive(Debug)]
pub enum Solver {
    /// See [`SolverKind::Recursion`].
    Recursion(Recursion),
    /// See [`SolverKind::DenseUnpivoted`].
    DenseUnpivoted(DenseUnpivoted),
    /// See [`SolverKind::Dense`].
    Dense(DensePivoted),
    /// See [`SolverKind::Sparse`].
    Sparse(Box<Sparse>),
}

impl Solver {
    /// A solver for matrices on `pattern`.
    ///
    /// # Errors
    /// [`TooLarge`].
    pub fn new(kind: SolverKind, pattern: &Pattern) -> Result<Self, TooLarge> {
        let unknowns = DOF * pattern.bodies();
        let dense = matches!(kind, SolverKind::Dense | SolverKind::DenseUnpivoted);
        if dense && unknowns > MAX_DENSE {
            return Err(TooLarge { solver: kind.name(), unknowns });
        }
        Ok(match kind {
            SolverKind::Recursion => Self::Recursion(Recursion),
            SolverKind::DenseUnpivoted => Self::DenseUnpivoted(DenseUnpivoted::new(pattern)),
            SolverKind::Dense => Self::Dense(DensePivoted::new(pattern)),
            SolverKind::Sparse => Self::Sparse(Box::new(Sparse::new(pattern)?)),
        })
    }
}

impl Solver {
    /// Multiplications of one factorization and of one solve: work without a clock.
    pub fn multiplications(&self, pattern: &Pattern) -> (u64, u64) {
        let n = (DOF * pattern.bodies()) as u64;
        match self {
            // blocks of 3×3: 27 for a product of two, 9 for a product with a vector
            Self::Recursion(_) => {
                let products = 27 * pattern.multiplications() as u64 + 27 * pattern.bodies() as u64;
                (products, 18 * pattern.off_blocks() as u64 + 9 * pattern.bodies() as u64)
            }
            Self::DenseUnpivoted(_) | Self::Dense(_) => (n * n * n / 3, n * n),
            Self::Sparse(s) => s.multiplications(),
        }
    }
}

impl LinearSolver for Solver {
    fn factor(&mut self, pattern: &Pattern, matrix: &mut BodyMatrix) -> Result<(), ZeroPivot> {
        match self {
            Self::Recursion(s) => s.factor(pattern, matrix),
            Self::DenseUnpivoted(s) => s.factor(pattern, matrix),
            Self::Dense(s) => s.factor(pattern, matrix),
            Self::Sparse(s) => s.factor(pattern, matrix),
        }
    }

    fn solve(&self, pattern: &Pattern, matrix: &BodyMatrix, b: &mut [Pose]) {
        match self {
            Self::Recursion(s) => s.solve(pattern, matrix, b),
            Self::DenseUnpivoted(s) => s.solve(pattern, matrix, b),
            Self::Dense(s) => s.solve(pattern, matrix, b),
            Self::Sparse(s) => s.solve(pattern, matrix, b),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A matrix without an inverse is refused by every solver, not divided by.
    #[test]
    fn a_singular_matrix_is_refused() {
        let pattern = Pattern::new(2, &[(0, 1)]);
        for kind in SolverKind::ALL {
            let mut a = BodyMatrix::<f64>::new(&pattern);
            a.diagonal.fill(nalgebra::Matrix3::identity());
            a.below[0] = nalgebra::Matrix3::identity();
            let mut solver = Solver::new(kind, &pattern).unwrap();
            assert!(solver.factor(&pattern, &mut a).is_err(), "{}", kind.name());
        }
    }
}
