//! Inertia forces on the bodies of a mechanism in a moving frame.
//!
//! Displacements are those within the frame. In a frame with the acceleration a of its origin (that of the drawing) and the
//! rate Ω about z, a body of mass m and inertia J with its centre at r feels
//! ```text
//! f = −m·(a + Ω̇ e×r − Ω²·r + 2Ω e×v),     moment −J·Ω̇,     e×r = (−y, x)
//! ```
//! (Goldstein, "Classical Mechanics" 1980, §4.10): Euler's, the centrifugal and Coriolis' force. All but the last depend on
//! the place alone and belong to the residual here; Coriolis' force is that of `gyration` in the integrators.

use super::domain::{Configuration, Domain};
use bimorph_multibody::planar::{self, Pose};
use bimorph_multibody::{Body, BodyId, BodyMatrix, Pattern};
use nalgebra::Vector2;

/// Motion of the frame, or a change of it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FrameMotion {
    /// Acceleration of the origin (m/s²).
    pub acceleration: Vector2<f64>,
    /// Rate about z (rad/s).
    pub rate: f64,
    /// Rate of change of the rate (rad/s²).
    pub turning: f64,
}

/// All bodies in a frame. Its input is the frame motion.
#[derive(Debug, Clone, Copy)]
pub struct FrameInertiaForces<'a>(pub &'a [Body]);

impl FrameInertiaForces<'_> {
    /// `r += m·(a + Ω̇ e×r − outward·r)` and the moment J·Ω̇.
    fn add(&self, q: &[Pose], frame: &FrameMotion, outward: f64, r: &mut [Pose]) {
        for ((r, q), body) in r.iter_mut().zip(q).zip(self.0) {
            let place = body.center + q.xy();
            let push = frame.acceleration + planar::perpendicular(place) * frame.turning - place * outward;
            r.x += body.mass * push.x;
            r.y += body.mass * push.y;
            r.z += body.inertia * frame.turning;
        }
    }
}

impl Domain for FrameInertiaForces<'_> {
    type Given = FrameMotion;

    fn bodies(&self, see: impl FnMut(BodyId)) {
        (0..self.0.len()).map(BodyId::Free).for_each(see);
    }

    fn add_force(&self, at: Configuration<'_>, frame: FrameMotion, r: &mut [Pose]) {
        self.add(at.q, &frame, frame.rate * frame.rate, r);
    }

    fn add_force_change(&self, at: Configuration<'_>, frame: FrameMotion, change: FrameMotion, r: &mut [Pose]) {
        self.add(at.q, &change, 2.0 * frame.rate * change.rate, r);
    }

    fn energy(&self, at: Configuration<'_>, frame: FrameMotion) -> f64 {
        let of = |(q, body): (&Pose, &Body)| {
            let outward = 0.5 * (q.xy().norm_squared() + 2.0 * body.center.dot(&q.xy()));
            body.mass * (frame.acceleration.dot(&q.xy()) - frame.rate * frame.rate * outward)
        };
        at.q.iter().zip(self.0).map(of).sum()
    }

    /// But for the skew share of Euler's force.
    fn add_tangent(&self, _: Configuration<'_>, frame: FrameMotion, _: &Pattern, tangent: &mut BodyMatrix) {
        if frame.rate == 0.0 {
            return;
        }
        for (block, body) in tangent.diagonal.iter_mut().zip(self.0) {
            let softer = body.mass * frame.rate * frame.rate;
            block[(0, 0)] -= softer;
            block[(1, 1)] -= softer;
        }
    }
}
