//! The tangent shifted by the masses.

use bimorph_multibody::{BlockMatrix, Model};

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
