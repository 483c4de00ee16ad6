//! The stiffness that a force brings: second derivatives of a body's place, times the wrench on it.
//!
//! At an equilibrium Π(s) has the second derivative K + Jᵀ·Π_body″·J + Σ_c f_c·∂²x_c/∂(θ_m, s)², with f_c the force on
//! everything that hangs on body c. The last sum has four variables a joint, and its coefficients are those of the bias of
//! [`super::kinematics`], which is the same second derivative.

use super::kinematics::Placed;
use super::tree::{Parent, Tree};
use crate::multibody::planar::Pose;
use nalgebra::{Matrix3, Vector2};

/// Second derivatives of one joint's work over (e_u, g, p) and the rotation of its parent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Geometric {
    /// Over the coordinates.
    pub(super) own: Matrix3<f64>,
    /// Coordinates and the parent's rotation.
    pub(super) cross: [f64; 3],
    /// The parent's rotation twice.
    pub(super) turn: f64,
}

impl Geometric {
    /// Nothing.
    pub const ZERO: Self =
        Self { own: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), cross: [0.0; 3], turn: 0.0 };
}

/// Fills in `out` at coordinates `q`, where the bodies have been placed; `force` holds the wrench on everything that hangs on
/// each body, as [`Placed::gather`] leaves it.
pub fn fill(tree: &Tree, placed: &Placed<f64>, q: &[Pose], force: &[Pose], out: &mut [Geometric]) {
    let pose = |p: Parent| match p {
        Parent::Body(p) => placed.at(p as usize)[2],
        _ => 0.0,
    };
    for (j, link) in tree.links.iter().enumerate() {
        out[j] = Geometric::ZERO;
        if link.parent == Parent::Free {
            continue;
        }
        let (theta_m, theta) = (pose(link.parent), placed.at(j)[2]);
        let rotated = |angle: f64, v: &Vector2<f64>| crate::multibody::planar::rotate(angle, *v);
        let e1 = rotated(0.5 * (theta_m + theta), &link.axis);
        let e2 = Vector2::new(-e1.y, e1.x);
        let (s, q) = (link.sign, &q[j]);
        let [gg, gp, pp] = link.second;
        let (b_g, b_p) = (gg * q.y + gp * q.z, gp * q.y + pp * q.z);
        let d = e1 * (q.x - b_g * q.y - b_p * q.z) + e2 * q.y;
        let f = Vector2::new(force[j].x, force[j].y);
        let (f1, f2) = (e1.dot(&f), e2.dot(&f));
        let along = d.dot(&f);
        let (r_m, r) = (rotated(theta_m, &link.arm_parent).dot(&f), rotated(theta, &link.arm).dot(&f));
        let up = 0.5 * f2;
        let gp_own = 0.5 * (-2.0 * b_g * f2 - f1) - 2.0 * s * gp * f1;
        let pp_own = r - 2.0 * b_p * f2 - 0.25 * s * along - 2.0 * s * pp * f1;
        let mut own = Matrix3::new(0.0, 0.0, up, 0.0, -2.0 * s * gg * f1, gp_own, up, gp_own, pp_own);
        let mut cross = [s * f2, s * (-2.0 * b_g * f2 - f1), s * (r - 2.0 * b_p * f2) - 0.5 * along];
        for (i, cross) in cross.iter_mut().enumerate() {
            if !link.moving[i] {
                own.row_mut(i).fill(0.0);
                own.column_mut(i).fill(0.0);
                *cross = 0.0;
            }
        }
        out[j] = Geometric { own, cross, turn: r - r_m - s * along };
    }
}
