//! Linear solvers for the tangent. Integrators are generic over it, so that the block recursion, on which the product
//! is built, can be measured against others of the same matrix (`crate::baseline`); the choice costs no dynamic
//! dispatch.

use bimorph_multibody::factor::ZeroPivot;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyMatrix, Pattern};

/// A direct solver of A·x = b for a symmetric block matrix A.
pub trait LinearSolver {
    /// Prepares for solves with `matrix`. The solver may keep its factors in `matrix` itself or in its own storage.
    ///
    /// # Errors
    /// [`ZeroPivot`] where A is singular.
    fn factor(&mut self, pattern: &Pattern, matrix: &mut BodyMatrix) -> Result<(), ZeroPivot>;

    /// `b` becomes A⁻¹·b, with `matrix` as [`LinearSolver::factor`] left it; one vector for each body, in elimination order.
    fn solve(&self, pattern: &Pattern, matrix: &BodyMatrix, b: &mut [Pose]);
}

/// The block recursion of [`bimorph_multibody::factor`], which keeps its factors in the matrix: the default.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Recursion;

impl LinearSolver for Recursion {
    #[inline]
    fn factor(&mut self, pattern: &Pattern, matrix: &mut BodyMatrix) -> Result<(), ZeroPivot> {
        matrix.factor(pattern).map(|_| ())
    }

    #[inline]
    fn solve(&self, pattern: &Pattern, matrix: &BodyMatrix, b: &mut [Pose]) {
        matrix.solve(pattern, b);
    }
}
