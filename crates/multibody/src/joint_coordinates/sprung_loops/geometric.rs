//! The stiffness that a force brings: second derivatives of a body's place, times the wrench on it.
//!
//! At an equilibrium Π(s) has the second derivative K + Jᵀ·Π_body″·J + Σ_c f_c·∂²x_c/∂(θ_m, s)², with f_c the force on
//! the subtree of body c. The last sum has four variables a joint, and its coefficients are those of the bias of
//! [`super::kinematics`], which is the same second derivative.

use super::kinematics::MotionMap;
use super::poses::TreeKinematics;
use super::tree::{Tree, TreeJoint};
use crate::joint_coordinates::TreeParent;
use crate::planar::Pose;
use crate::planar::vector::dot;
use nalgebra::Matrix3;

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

/// Fills in `out` at coordinates `q`, where the bodies have been placed; `force` holds the wrench on the subtree of
/// each body, as [`TreeKinematics::resist`] leaves it. Arms and openings are taken from the maps: nothing is turned
/// again.
#[inline]
pub fn fill(tree: &Tree, placed: &TreeKinematics, q: impl Fn(usize) -> Pose, force: &[Pose], out: &mut [Geometric]) {
    for (j, link) in tree.links.iter().enumerate() {
        out[j] =
            if link.parent == TreeParent::Free { Geometric::ZERO } else { of(link, &placed.map(j), &q(j), &force[j]) };
    }
}

#[inline(always)]
fn of(link: &TreeJoint, map: &MotionMap<f64>, q: &Pose, force: &Pose) -> Geometric {
    let s = link.sign;
    let (f, right) = ([force.x, force.y], [-force.y, force.x]);
    let [u, _, p] = &map.columns;
    let e1 = [s * u[0], s * u[1]];
    let (f1, f2) = (dot(e1, f), -dot(e1, right));
    let [gg, gp, pp] = link.second;
    let (b_g, b_p) = (gg * q.y + gp * q.z, gp * q.y + pp * q.z);
    // products of the force with d, with the turned arm, and with what lies between the centres
    let along = (q.x - b_g * q.y - b_p * q.z) * f1 + q.y * f2;
    let r = s * (0.5 * along - dot(*p, right)) + 2.0 * b_p * f2;
    let between = dot(map.lever, right);
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
    Geometric { own, cross, turn: -between }
}
