//! Mechanisms for the tests: bodies and joints at drawn places.

use bimorph::multibody::planar::JointFrame;
use bimorph::multibody::{Body, BodyId, Joint, Model};
use nalgebra::{Matrix2, Matrix3, Vector2};

/// Locks everything but rotation: a pin.
pub(crate) const PIN: [bool; 3] = [true, true, false];
/// Locks everything: a weld.
pub(crate) const WELD: [bool; 3] = [true; 3];

/// Bodies and joints in the making.
#[derive(Debug, Clone, Default)]
pub(crate) struct Mechanism {
    bodies: Vec<Body>,
    joints: Vec<Joint>,
}

impl Mechanism {
    /// Adds a body at `center`.
    pub(crate) fn body(&mut self, center: [f64; 2], mass: f64, inertia: f64) -> BodyId {
        self.bodies.push(Body {
            name: format!("b{}", self.bodies.len()).into(),
            center: center.into(),
            mass,
            inertia,
            drag: Default::default(),
            free: None,
        });
        BodyId::Free(self.bodies.len() - 1)
    }

    /// Joins two bodies at a drawn point; the directions that `locked` leaves free are elastic with `stiffness`.
    pub(crate) fn join(
        &mut self,
        a: BodyId,
        b: BodyId,
        at: [f64; 2],
        angle: f64,
        locked: [bool; 3],
        stiffness: [f64; 3],
    ) {
        let at = Vector2::from(at);
        let arm = |id: BodyId| match id {
            BodyId::Ground => Vector2::zeros(),
            BodyId::Free(k) => at - self.bodies[k].center,
        };
        let frame = JointFrame { arm_a: arm(a), arm_b: arm(b), axis: Vector2::new(angle.cos(), angle.sin()) };
        self.joints.push(Joint {
            a,
            b,
            frame,
            stiffness: Matrix3::from_diagonal(&stiffness.into()),
            second: Matrix2::zeros(),
            expansion: None,
            rest: 0.0,
            locked,
        });
    }

    /// A pin.
    pub(crate) fn pin(&mut self, a: BodyId, b: BodyId, at: [f64; 2]) {
        self.join(a, b, at, 0.0, PIN, [0.0; 3]);
    }

    /// A uniform rod of unit mass per length between two points.
    pub(crate) fn rod(&mut self, from: [f64; 2], to: [f64; 2]) -> BodyId {
        let length = (to[0] - from[0]).hypot(to[1] - from[1]);
        let center = [0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1])];
        self.body(center, length, length.powi(3) / 12.0)
    }

    /// Bends the joints: second-order axial strain for all.
    pub(crate) fn bend(&mut self, second: Matrix2<f64>) {
        for joint in &mut self.joints {
            joint.second = second;
        }
    }

    /// Lays the model out; also says where each body went.
    pub(crate) fn model(&self) -> (Model, Vec<usize>) {
        Model::new(self.bodies.clone(), self.joints.clone(), Vec::new(), &[], false)
    }
}

/// A reproducible stream of numbers in −½…½ (Knuth's MMIX congruence).
#[derive(Debug)]
pub(crate) struct Stream(pub u64);

impl Stream {
    /// The next number.
    pub(crate) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    }

    /// An index below `n`.
    pub(crate) fn below(&mut self, n: usize) -> usize {
        (((self.next() + 0.5) * n as f64) as usize).min(n - 1)
    }
}
