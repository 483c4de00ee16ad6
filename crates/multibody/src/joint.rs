//! Elements between two bodies: joints, dampers, couplings of joints.

use super::planar::{JointFrame, Pose};
use nalgebra::{Matrix2, Matrix3, Matrix3x6, Matrix6, Vector3};

/// A body of the model, or ground.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum BodyId {
    /// Immovable.
    Ground,
    /// The body eliminated as the k-th.
    Free(usize),
}

/// A flexible joint between two bodies, with three directions: axial, shear, rotation.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// First body.
    pub a: BodyId,
    /// Second body.
    pub b: BodyId,
    /// Where it sits.
    pub frame: JointFrame,
    /// Stress (N, V, M) per strain (u, g, p) (N/m, N/rad, N·m/rad); symmetric.
    pub stiffness: Matrix3<f64>,
    /// Second-order axial strain Q on (g, p); see [`super::planar`].
    pub second: Matrix2<f64>,
    /// Which entry of the strain vector sets its axial rest offset, and the length it acts on (m).
    pub expansion: Option<(usize, f64)>,
    /// Axial rest offset that does not change (m) (residual stress, prescribed temperature).
    pub rest: f64,
    /// Directions (u, g, p) that are meant to be rigid. `stiffness` is then only high enough for a formulation that needs
    /// one; a formulation in joint coordinates leaves the direction out.
    pub locked: [bool; 3],
}

/// A linear damper between two bodies.
#[derive(Debug, Clone, PartialEq)]
pub struct Damper {
    /// First body.
    pub a: BodyId,
    /// Second body.
    pub b: BodyId,
    /// Where it sits.
    pub frame: JointFrame,
    /// Force per rate of the strains (u, g, p), about the drawn place (N·s/m, N·s/m, N·m·s/rad).
    pub coefficients: Vector3<f64>,
}

impl Damper {
    /// Force on the pair's six coordinates per rate: symmetric and constant.
    pub(super) fn matrix(&self) -> Matrix6<f64> {
        let rows = self.rows();
        rows.transpose() * Matrix3::from_diagonal(&self.coefficients) * rows
    }

    /// Strains (u, g, p) per displacement of the pair, about the drawn place.
    pub(crate) fn rows(&self) -> Matrix3x6<f64> {
        let rest = Pose::zeros();
        self.frame.kinematics(&rest, &rest, &[0.0; 3]).rows()
    }
}

/// Two joints whose moments depend on both rotations: the paper's general joint spring. Its energy is `stiffness`·p₁·p₂,
/// with p = θ_b − θ_a of each joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coupling {
    /// Bodies a and b of the first joint.
    pub first: (BodyId, BodyId),
    /// Bodies a and b of the second joint.
    pub second: (BodyId, BodyId),
    /// Moment of one joint per rotation of the other (N·m/rad).
    pub stiffness: f64,
}

impl Coupling {
    /// The pairs of bodies that it couples.
    #[inline]
    pub fn pairs(&self) -> [(BodyId, BodyId); 4] {
        let ((a, b), (c, d)) = (self.first, self.second);
        [(a, c), (a, d), (b, c), (b, d)]
    }
}
