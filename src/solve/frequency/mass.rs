//! The masses of a model: products with them, and the tangent shifted by them.

use crate::multibody::planar::Pose;
use crate::multibody::{BlockMatrix, Model};

/// K − σM, held directions projected.
pub(super) fn shifted(model: &Model, stiffness: &BlockMatrix<f64, 3>, sigma: f64) -> BlockMatrix<f64, 3> {
    let mut a = stiffness.clone();
    for (j, block) in a.diagonal.iter_mut().enumerate() {
        let m = model.mass(j);
        for i in 0..3 {
            block[(i, i)] -= sigma * m[i];
        }
    }
    model.project_matrix(&mut a);
    a
}

/// xᵀMy.
pub fn mass_product(model: &Model, x: &[Pose], y: &[Pose]) -> f64 {
    x.iter().zip(y).enumerate().map(|(j, (x, y))| x.dot(&model.mass(j).component_mul(y))).sum()
}
