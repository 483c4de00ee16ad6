//! A force or a moment on a point that a source gives.

use super::approach::Point;
use super::domain::{At, Domain};
use crate::multibody::planar::{self, Pose};
use crate::multibody::{BlockMatrix, BodyId, Pattern};
use nalgebra::Vector2;

/// A force of fixed direction, or a moment. What drives it is its size [N, N·m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointForce {
    /// Where it acts.
    pub point: Point,
    /// Along global x (0) or y (1), or a moment about z (2).
    pub direction: usize,
}

impl Domain for PointForce {
    type Given = f64;

    fn bodies(&self, mut see: impl FnMut(BodyId)) {
        see(self.point.body);
    }

    fn add_force(&self, at: At<'_>, size: f64, r: &mut [Pose]) {
        if let BodyId::Free(k) = self.point.body {
            let unit = match self.direction {
                0 => planar::wrench(&at.q[k], self.point.arm, Vector2::x(), at.linear),
                1 => planar::wrench(&at.q[k], self.point.arm, Vector2::y(), at.linear),
                _ => Pose::z(),
            };
            r[k] -= unit * size;
        }
    }

    fn add_force_change(&self, at: At<'_>, _: f64, change: f64, r: &mut [Pose]) {
        self.add_force(at, change, r);
    }

    fn add_tangent(&self, at: At<'_>, size: f64, _: &Pattern, tangent: &mut BlockMatrix<f64, 3>) {
        if let (BodyId::Free(k), 0..2) = (self.point.body, self.direction) {
            let (_, bend) = planar::point_turn(&at.q[k], self.point.arm, at.linear);
            tangent.diagonal[k][(2, 2)] -= size * bend[self.direction];
        }
    }
}
