//! The tangent shifted by the masses.

use bimorph_multibody::planar::DOF;
use bimorph_multibody::{BodyMatrix, Model};

/// K − σM, held directions projected.
pub(super) fn shifted(model: &Model, stiffness: &BodyMatrix, sigma: f64) -> BodyMatrix {
    let mut a = stiffness.clone();
    for (j, block) in a.diagonal.iter_mut().enumerate() {
        let m = model.mass(j);
        for i in 0..DOF {
            block[(i, i)] -= sigma * m[i];
        }
    }
    model.project_matrix(&mut a);
    a
}
