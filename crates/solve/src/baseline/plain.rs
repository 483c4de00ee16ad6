//! A matrix of blocks and its vectors as plain numbers, for solvers that know no blocks.

use bimorph_multibody::planar::{DOF, Pose};
use bimorph_multibody::{BodyMatrix, Pattern};
use faer::dyn_stack::MemBuffer;

/// Visits every entry of the lower triangle that a matrix stores: row, column, value.
pub(crate) fn spread(pattern: &Pattern, matrix: &BodyMatrix, mut visit: impl FnMut(usize, usize, f64)) {
    for j in 0..pattern.bodies() {
        for c in 0..DOF {
            for r in c..DOF {
                visit(DOF * j + r, DOF * j + c, matrix.diagonal[j][(r, c)]);
            }
        }
        for k in pattern.column(j) {
            for c in 0..DOF {
                for r in 0..DOF {
                    visit(DOF * pattern.row(k) + r, DOF * j + c, matrix.below[k][(r, c)]);
                }
            }
        }
    }
}

/// A right-hand side and working memory: a solve needs both, and changes nothing that can be seen.
pub(super) struct SolveScratch {
    pub(super) flat: Vec<f64>,
    pub(super) memory: MemBuffer,
}

impl std::fmt::Debug for SolveScratch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Scratch").field("flat", &self.flat).finish_non_exhaustive()
    }
}

pub(super) fn flatten(b: &[Pose], flat: &mut [f64]) {
    for (to, from) in flat.chunks_exact_mut(DOF).zip(b) {
        to.copy_from_slice(from.as_slice());
    }
}

pub(super) fn unflatten(flat: &[f64], b: &mut [Pose]) {
    for (to, from) in b.iter_mut().zip(flat.chunks_exact(DOF)) {
        to.copy_from_slice(from);
    }
}
