//! What acts on a mechanism beside voltages: forces and moments at points, heat into beams, and the motion of the frame that
//! it is mounted on.
//!
//! Displacements are those within the frame. In a frame with the acceleration a of its origin (that of the drawing) and the
//! rate Ω about z, a body of mass m and inertia J with its centre at r feels
//! ```text
//! f = −m·(a + Ω̇ e×r − Ω²·r + 2Ω e×v),     moment −J·Ω̇,     e×r = (−y, x)
//! ```
//! (Goldstein, "Classical Mechanics" 1980, §4.10): Euler's, the centrifugal and Coriolis' force. All but the last depend on
//! the place alone and belong to the residual here; Coriolis' force is that of [`crate::solve::time::gyration`].

use super::approach::Point;
use super::drive::Drive;
pub use super::input::Input;
use super::system::System;
use crate::multibody::planar::{self, Pose};
use crate::multibody::{BlockMatrix, BodyId};
use nalgebra::Vector2;

/// Motion of the frame, or a change of it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Frame {
    /// Acceleration of the origin [m/s²].
    pub acceleration: Vector2<f64>,
    /// Rate about z [rad/s].
    pub rate: f64,
    /// Rate of change of the rate [rad/s²].
    pub turning: f64,
}

impl System {
    /// Motion of the frame in a drive; none where no input moves it.
    pub fn frame(&self, drive: &Drive) -> Option<Frame> {
        let inputs = &self.electrics.inputs;
        if !inputs.iter().any(Input::moves_frame) {
            return None;
        }
        let mut frame = Frame { turning: drive.turning, ..Frame::default() };
        for (input, value) in inputs.iter().zip(&drive.inputs) {
            match input {
                Input::Acceleration { axis } => frame.acceleration[*axis] += value,
                Input::Rate => frame.rate += value,
                Input::Force { .. } | Input::Heat { .. } => {}
            }
        }
        Some(frame)
    }

    /// Whether an input turns the frame.
    pub fn turns(&self) -> bool {
        self.electrics.inputs.contains(&Input::Rate)
    }

    /// Whether source `source` is the rate of the frame.
    pub fn is_rate(&self, source: usize) -> bool {
        let input = source.checked_sub(self.electrics.voltages()).map(|k| self.electrics.inputs[k]);
        input == Some(Input::Rate)
    }

    /// `r +=` the share of inputs in the residual.
    pub(super) fn add_input_forces(&self, q: &[Pose], drive: &Drive, r: &mut [Pose]) {
        self.add_point_forces(q, &drive.inputs, r);
        r.iter_mut().zip(&drive.push).for_each(|(r, push)| *r -= push);
        if let Some(frame) = self.frame(drive) {
            self.add_inertial(q, &frame, frame.rate * frame.rate, r);
        }
    }

    /// `r +=` the change of that share with a change of the drive.
    pub(super) fn add_input_change(&self, q: &[Pose], drive: &Drive, change: &Drive, r: &mut [Pose]) {
        self.add_point_forces(q, &change.inputs, r);
        if let (Some(frame), Some(change)) = (self.frame(drive), self.frame(change)) {
            self.add_inertial(q, &change, 2.0 * frame.rate * change.rate, r);
        }
    }

    /// `tangent +=` the share of inputs in ∂r/∂q but for the skew one of Euler's force.
    pub(super) fn add_input_tangent(&self, q: &[Pose], drive: &Drive, tangent: &mut BlockMatrix<f64, 3>) {
        for (input, value) in self.electrics.inputs.iter().zip(&drive.inputs) {
            if let Input::Force { point, direction: direction @ 0..2 } = input
                && let BodyId::Free(k) = point.body
            {
                let (_, bend) = planar::point_turn(&q[k], point.arm, self.model.linear);
                tangent.diagonal[k][(2, 2)] -= value * bend[*direction];
            }
        }
        if let Some(frame) = self.frame(drive).filter(|frame| frame.rate != 0.0) {
            for (block, body) in tangent.diagonal.iter_mut().zip(&self.model.bodies) {
                let softer = body.mass * frame.rate * frame.rate;
                block[(0, 0)] -= softer;
                block[(1, 1)] -= softer;
            }
        }
    }

    fn add_point_forces(&self, q: &[Pose], values: &[f64], r: &mut [Pose]) {
        for (input, value) in self.electrics.inputs.iter().zip(values) {
            if let Input::Force { point, direction } = *input
                && let BodyId::Free(k) = point.body
            {
                r[k] -= self.point_wrench(q, point, direction) * *value;
            }
        }
    }

    /// What a unit force or moment on a point of a free body is to its body.
    fn point_wrench(&self, q: &[Pose], point: Point, direction: usize) -> Pose {
        let BodyId::Free(k) = point.body else { return Pose::zeros() };
        match direction {
            0 => planar::wrench(&q[k], point.arm, Vector2::x(), self.model.linear),
            1 => planar::wrench(&q[k], point.arm, Vector2::y(), self.model.linear),
            _ => Pose::z(),
        }
    }

    /// `r += m·(a + Ω̇ e×r − outward·r)` and the moment J·Ω̇.
    fn add_inertial(&self, q: &[Pose], frame: &Frame, outward: f64, r: &mut [Pose]) {
        for ((r, q), body) in r.iter_mut().zip(q).zip(&self.model.bodies) {
            let place = body.center + q.xy();
            let push = frame.acceleration + planar::turn(place) * frame.turning - place * outward;
            r.x += body.mass * push.x;
            r.y += body.mass * push.y;
            r.z += body.inertia * frame.turning;
        }
    }
}
