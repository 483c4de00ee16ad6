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
use crate::multibody::factor::ZeroPivot;
use crate::multibody::planar::{DOF, Pose};
use crate::multibody::{BlockMatrix, Pattern};
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
    fn factor(&mut self, pattern: &Pattern, matrix: &mut BlockMatrix<f64, 3>) -> Result<(), ZeroPivot> {
        match self {
            Self::Recursion(s) => s.factor(pattern, matrix),
            Self::DenseUnpivoted(s) => s.factor(pattern, matrix),
            Self::Dense(s) => s.factor(pattern, matrix),
            Self::Sparse(s) => s.factor(pattern, matrix),
        }
    }

    fn solve(&self, pattern: &Pattern, matrix: &BlockMatrix<f64, 3>, b: &mut [Pose]) {
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
    use crate::compile::{CompileOptions, compile};
    use crate::multibody::forces;
    use crate::netlist::Bundle;

    /// On the step matrix of the bank, from static (h large) to inertial (h small), every solver finds the solution of
    /// the recursion. The residual of every row is at rounding, 1e-12 of the terms that it sums (1e-10 with exchanges).
    #[test]
    fn all_solvers_agree_on_step_matrices() {
        let bundle = Bundle::read(std::path::Path::new("examples/bank/bank.net"), &[]).unwrap();
        let options = CompileOptions { segments: Some(4), ..CompileOptions::default() };
        let system = compile(&bundle, &options).unwrap().parts.system;
        let pattern = &system.model.pattern;
        let n = system.bodies();
        let zeros = vec![Pose::zeros(); n];
        let mut r = zeros.clone();
        for h in [1e-3, 1e-6, 1e-9] {
            let mut a = BlockMatrix::new(pattern);
            system.tangent(&zeros, &system.electrics.drive(), &mut a, &mut r);
            forces::add_inertia(&system.model, 1.0 / (h * h), 1.0 / h, &mut a);
            system.model.project_matrix(&mut a);
            let mut b: Vec<Pose> = (0..n)
                .map(|k| {
                    let s = ((k * 7919) % 101) as f64 / 101.0 - 0.5;
                    Pose::new(s * 1e-6, (0.3 - s) * 1e-6, s * s * 1e-11)
                })
                .collect();
            system.model.project(&mut b);
            for kind in SolverKind::ALL {
                let mut solver = Solver::new(kind, pattern).unwrap();
                let (mut matrix, mut x) = (a.clone(), b.clone());
                solver.factor(pattern, &mut matrix).unwrap();
                solver.solve(pattern, &matrix, &mut x);
                let mut back = zeros.clone();
                a.multiply_add(pattern, &x, &mut back);
                // what rounding may leave in a row is a fraction of the terms that the row adds up
                let mut sizes = a.clone();
                sizes.diagonal.iter_mut().chain(&mut sizes.below).for_each(|block| *block = block.abs());
                let magnitudes: Vec<Pose> = x.iter().map(|x| x.abs()).collect();
                let mut terms = zeros.clone();
                sizes.multiply_add(pattern, &magnitudes, &mut terms);
                let largest = terms.iter().map(|t| t.amax()).fold(0.0, f64::max);
                for (k, (got, want)) in back.iter().zip(&b).enumerate() {
                    for (i, term) in terms[k].iter().enumerate() {
                        // an exchange of rows compares newtons with newton metres: it is as good as the largest row
                        let room = 1e-12 * if kind == SolverKind::Dense { largest } else { *term };
                        assert!((got - want)[i].abs() <= room, "{} {h} {k} {i}: {got} {want} {room:e}", kind.name());
                    }
                }
            }
        }
    }

    /// The sparse solver's analysis is done on the couplings, without the recursion's fill, and its factor of a tree-like
    /// bank is no larger than the recursion's by a half.
    #[test]
    fn sparse_factor_is_small() {
        let bundle = Bundle::read(std::path::Path::new("examples/bank/bank.net"), &[]).unwrap();
        let options = CompileOptions { band: Some(1.3e6), ..CompileOptions::default() };
        let system = compile(&bundle, &options).unwrap().parts.system;
        let pattern = &system.model.pattern;
        let blocks = 6 * pattern.bodies() + 9 * pattern.off_blocks();
        let entries = Sparse::new(pattern).unwrap().entries();
        assert!(entries < blocks * 3 / 2, "{entries} {blocks}");
    }

    /// A matrix without an inverse is refused by every solver, not divided by.
    #[test]
    fn a_singular_matrix_is_refused() {
        let pattern = Pattern::new(2, &[(0, 1)]);
        for kind in SolverKind::ALL {
            let mut a = BlockMatrix::<f64, 3>::new(&pattern);
            a.diagonal.fill(nalgebra::Matrix3::identity());
            a.below[0] = nalgebra::Matrix3::identity();
            let mut solver = Solver::new(kind, &pattern).unwrap();
            assert!(solver.factor(&pattern, &mut a).is_err(), "{}", kind.name());
        }
    }
}
