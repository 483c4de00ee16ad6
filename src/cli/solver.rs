//! `--solver`: the solver of the equations.

use bimorph::solve::baseline::SolverKind;
use clap::ValueEnum;
use serde::Serialize;

/// The recursion of the product, or a baseline to compare it with.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum SolverChoice {
    /// The O(n+m) block recursion
    #[default]
    Recursion,
    /// Dense elimination without exchanges, as a symbolic solution does
    DenseUnpivoted,
    /// Dense LU with partial pivoting
    Dense,
    /// Sparse L·D·Lᵀ with an approximate minimum degree ordering
    Sparse,
    /// A linear frame of cubic beams, as SUGAR: one element for each beam, or by --band
    Frame,
}

impl SolverChoice {
    /// The linear solver; the frame has its own.
    pub(crate) fn linear(self) -> SolverKind {
        match self {
            Self::Recursion | Self::Frame => SolverKind::Recursion,
            Self::DenseUnpivoted => SolverKind::DenseUnpivoted,
            Self::Dense => SolverKind::Dense,
            Self::Sparse => SolverKind::Sparse,
        }
    }
}

/// The model of commands whose equations are solved in one way only.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum ModelChoice {
    /// Rigid segments and flexible joints, solved by the O(n+m) block recursion
    #[default]
    Recursion,
    /// A linear frame of cubic beams, as SUGAR: one element for each beam, or by --band; a baseline
    Frame,
}
