//! Target of a mesh, and the mesh chosen for it.

use crate::options::CompileOptions;
use serde::Serialize;

/// The chosen order.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Mesh {
    /// Segments of each beam, in the order of the structure; 0: a rigid beam.
    pub segments: Vec<usize>,
    /// Largest estimated relative error of a frequency within the band (1); none where no mode lies in it or no estimate
    /// could be made.
    pub estimated_error: Option<f64>,
    /// Modes within the band that the estimate stands for.
    pub modes_in_band: usize,
    /// Models that were tried.
    pub passes: usize,
}

impl Mesh {
    /// The same mesh with so many times its estimate.
    #[must_use]
    pub fn with_estimate_times(self, factor: f64) -> Self {
        Self { estimated_error: self.estimated_error.map(|error| factor * error), ..self }
    }
}

/// Target of a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshTarget {
    /// Highest frequency whose mode matters (Hz).
    pub band: f64,
    /// Relative error that the frequency of each mode may have (1), from the lowest; beyond the list: the option `tol`.
    pub tolerances: Vec<f64>,
    /// Beams whose strain does not matter become rigid.
    pub rigid: bool,
}

impl MeshTarget {
    pub(super) fn tolerance(&self, options: &CompileOptions, mode: usize) -> f64 {
        self.tolerances.get(mode).copied().unwrap_or(options.errors().requested())
    }

    /// Largest error over what is allowed for it, times the option `tol`.
    pub(super) fn worst(&self, options: &CompileOptions, relative: &[f64]) -> f64 {
        let over = |(m, e): (usize, &f64)| e.abs() / self.tolerance(options, m);
        options.errors().within(relative.iter().enumerate().map(over).fold(0.0, f64::max))
    }
}
