//! Names of the linear solvers, and which matrices are too large for one.

use thiserror::Error;

/// Names of the linear solvers.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum SolverKind {
    /// The block recursion.
    #[default]
    Recursion,
    /// Dense elimination without exchanges.
    DenseUnpivoted,
    /// Dense LU with partial pivoting.
    Dense,
    /// Sparse L·D·Lᵀ.
    Sparse,
}

impl SolverKind {
    /// All of them, the recursion first.
    pub const ALL: [Self; 4] = [Self::Recursion, Self::DenseUnpivoted, Self::Dense, Self::Sparse];

    /// Its name on the command line and in results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Recursion => "recursion",
            Self::DenseUnpivoted => "dense-unpivoted",
            Self::Dense => "dense",
            Self::Sparse => "sparse",
        }
    }
}

/// A factor that is too large to hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error("the {solver} factor of {unknowns} unknowns is too large to hold")]
pub struct TooLarge {
    /// Name of the solver.
    pub solver: &'static str,
    /// Scalar unknowns, held directions included.
    pub unknowns: usize,
}
