//! Everything that knows a plane from space: poses and points on bodies here, vectors over any scalar in `vector`, joint strains
//! and their derivatives in `joint`.
//!
//! A body's pose is its displacement from the drawn place, q = (x, y, θ) of its centre of mass, so that rest is q = 0 and
//! a displacement of 1e-15 m is not lost against a coordinate of 1e-4 m. `arm` is a vector fixed to a body, from its
//! centre of mass to a point, in the global axes as drawn.

pub(crate) mod factored;
mod joint;
pub(crate) mod vector;

pub use joint::{JointFrame, JointKinematics, PairTangent, Symmetric};
pub use vector::{HalfTurn, Vec2, Vec3};

use super::sine::sin_cos;
use nalgebra::{Matrix3, SMatrix, Vector2, Vector3};

/// Degrees of freedom of a planar body: x (m), y (m), θ (rad).
pub const DOF: usize = 3;
/// A body's displacement or rate.
pub type Pose = Vector3<f64>;
/// A 3×3 block of the tangent between two bodies.
pub type Block = Matrix3<f64>;
/// Rows over the six coordinates of a pair of bodies, a then b.
pub type PairRow = SMatrix<f64, 3, 6>;

/// Rotation of `v` by a right angle: the derivative of a rotating vector with respect to its angle.
#[inline]
pub fn perpendicular(v: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-v.y, v.x)
}

/// R(θ)·v.
#[inline]
pub fn rotate(theta: f64, v: Vector2<f64>) -> Vector2<f64> {
    let (s, c) = theta.sin_cos();
    Vector2::new(c * v.x - s * v.y, s * v.x + c * v.y)
}

/// (R(θ) − 1)·v without cancellation at small angles.
#[inline]
pub fn rotation_minus_identity(theta: f64, v: Vector2<f64>) -> Vector2<f64> {
    HalfTurn::new(theta).rotation_minus_identity(v.into()).into()
}

impl HalfTurn {
    /// Of a body with this rotation (rad).
    #[inline]
    pub(crate) fn new(theta: f64) -> Self {
        let (sin, cos) = sin_cos(0.5 * theta);
        Self::of([sin, cos])
    }
}

/// Displacement of the point at `arm` on a body at pose `q` (m).
#[inline]
pub fn point(q: &Pose, arm: Vector2<f64>, linear: bool) -> Vector2<f64> {
    let moved = if linear { perpendicular(arm) * q.z } else { rotation_minus_identity(q.z, arm) };
    Vector2::new(q.x, q.y) + moved
}

/// ∂(point)/∂θ and ∂²(point)/∂θ² at that pose (m/rad).
#[inline]
pub fn point_turn(q: &Pose, arm: Vector2<f64>, linear: bool) -> (Vector2<f64>, Vector2<f64>) {
    if linear {
        (perpendicular(arm), Vector2::zeros())
    } else {
        let r = rotate(q.z, arm);
        (perpendicular(r), -r)
    }
}

/// The generalized force of a force on the point at `arm`: force and its moment about the centre of mass.
#[inline]
pub fn wrench(q: &Pose, arm: Vector2<f64>, force: Vector2<f64>, linear: bool) -> Pose {
    let (lever, _) = point_turn(q, arm, linear);
    Vector3::new(force.x, force.y, lever.dot(&force))
}
