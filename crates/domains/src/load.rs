//! Dead loads: forces that keep their direction, and moments; those of a netlist, and those that a source gives.

use super::approach::MaterialPoint;
use super::domain::{Configuration, Domain};
use bimorph_multibody::planar::{self, Pose};
use bimorph_multibody::{BodyId, BodyMatrix, Pattern};
use nalgebra::Vector2;

/// A dead load on a point. Its input is the fraction of it that acts (1); for a unit load, its size (N, N·m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeadLoad {
    /// Where it acts.
    pub point: MaterialPoint,
    /// Force (N).
    pub force: Vector2<f64>,
    /// Moment (N·m).
    pub moment: f64,
}

impl Domain for DeadLoad {
    type Given = f64;

    fn bodies(&self, mut see: impl FnMut(BodyId)) {
        see(self.point.body);
    }

    fn add_force(&self, at: Configuration<'_>, share: f64, r: &mut [Pose]) {
        if let BodyId::Free(k) = self.point.body {
            let mut w = planar::wrench(&at.q[k], self.point.arm, self.force, at.linear);
            w.z += self.moment;
            r[k] += w * -share;
        }
    }

    fn add_force_change(&self, at: Configuration<'_>, _: f64, change: f64, r: &mut [Pose]) {
        self.add_force(at, change, r);
    }

    fn add_tangent(&self, at: Configuration<'_>, share: f64, _: &Pattern, tangent: &mut BodyMatrix) {
        if let BodyId::Free(k) = self.point.body {
            let (_, bend) = planar::point_turn(&at.q[k], self.point.arm, at.linear);
            tangent.diagonal[k][(2, 2)] += -share * bend.dot(&self.force);
        }
    }

    fn load_points(&self, _: Configuration<'_>, share: f64, mut lever: impl FnMut(MaterialPoint, Vector2<f64>)) {
        lever(self.point, self.force * share);
    }

    fn energy(&self, at: Configuration<'_>, share: f64) -> f64 {
        let BodyId::Free(k) = self.point.body else { return 0.0 };
        let moved = planar::point(&at.q[k], self.point.arm, at.linear);
        -share * (moved.dot(&self.force) + at.q[k].z * self.moment)
    }
}
