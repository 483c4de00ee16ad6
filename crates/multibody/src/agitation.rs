//! Thermal agitation: the random forces that come with drag and dampers.
//!
//! Every dissipative element also adds a random force, so that every mode holds k_B·T on average (H. B. Callen, T. A.
//! Welton, "Irreversibility and generalized noise", Phys. Rev. 83, 1951): forces F with the one-sided spectral density
//! ```text
//! S_F = 4·k_B·T·C     [N²/Hz],   C the matrix of drag and dampers
//! ```
//! C is a sum of small positive matrices, one for each body and each damper, so F is a sum of independent forces, each of
//! a factor L of its matrix, L·Lᵀ = C.

use super::body::Drag;
use super::model::Model;
use super::planar::Pose;
use super::{BodyId, forces};
use nalgebra::{Complex, Matrix3, Vector3};

/// Boltzmann's constant, exact since 2019 (J/K).
pub const BOLTZMANN: f64 = 1.380_649e-23;

/// A factor L of the matrix of a drag, L·Lᵀ = C.
fn factor(drag: &Drag) -> Matrix3<f64> {
    if drag.amount <= 0.0 {
        return Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, drag.second.max(0.0).sqrt()));
    }
    let root = drag.amount.sqrt();
    let lever = drag.first / root;
    // the second moment is at least that about the centre of the drag
    let rest = (drag.second - lever.norm_squared()).max(0.0).sqrt();
    Matrix3::new(root, 0.0, 0.0, 0.0, root, 0.0, -lever.y, lever.x, rest)
}

/// `out = Σ L·ξ`, a random force whose covariance is C where `draw` gives independent numbers of variance 1: three for each
/// body, then three for each damper. Held directions are removed.
pub fn force(model: &Model, mut draw: impl FnMut() -> f64, out: &mut [Pose]) {
    let mut three = || Vector3::new(draw(), draw(), draw());
    for (out, body) in out.iter_mut().zip(&model.bodies) {
        *out = factor(&body.drag) * three();
    }
    for damper in &model.dampers {
        let along = damper.coefficients.map(|c| c.max(0.0).sqrt()).component_mul(&three());
        let pair = damper.rows().tr_mul(&along);
        for (id, part) in [(damper.a, pair.fixed_rows::<3>(0)), (damper.b, pair.fixed_rows::<3>(3))] {
            if let BodyId::Free(k) = id {
                out[k] += part;
            }
        }
    }
    model.project(out);
}

/// C·x̄ of a complex motion, x̄ its conjugate; `more` adds the force of other damping at rates to it.
pub fn damped(
    model: &Model,
    x: &[Vector3<Complex<f64>>],
    more: impl Fn(&[Pose], &mut [Pose]),
) -> Vec<Vector3<Complex<f64>>> {
    let part = |of: fn(&Complex<f64>) -> f64| {
        let v: Vec<Pose> = x.iter().map(|x| x.map(|c| of(&c))).collect();
        let mut r = vec![Pose::zeros(); v.len()];
        forces::add_damping(model, &v, &mut r);
        more(&v, &mut r);
        r
    };
    let (re, im) = (part(|c| c.re), part(|c| -c.im));
    re.iter().zip(&im).map(|(re, im)| re.zip_map(im, Complex::new)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector2;

    /// L·Lᵀ is the matrix of the drag, with a lever, without translation, and of nothing.
    #[test]
    fn factors_of_drag() {
        let drag = |amount, first, second| Drag { amount, first, second };
        let drags = [
            drag(2e-7, Vector2::new(3e-13, -1e-13), 9e-18),
            drag(2e-7, Vector2::zeros(), 0.0),
            drag(0.0, Vector2::zeros(), 4e-18),
            drag(0.0, Vector2::zeros(), 0.0),
        ];
        for drag in drags {
            let l = factor(&drag);
            let error = (l * l.transpose() - drag.matrix()).amax();
            assert!(error <= 1e-15 * drag.matrix().amax(), "{drag:?}: {error:e}");
        }
    }
}
