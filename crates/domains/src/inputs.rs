//! Non-electrical inputs of a mechanism: forces and moments at points, heat into beams, and the motion of the frame
//! that it is mounted on ([`super::moving_frame`]).

use super::approach::MaterialPoint;
use super::domain::{Configuration, Domain};
use super::drive::Drive;
pub use super::input::Input;
use super::load::DeadLoad;
use super::moving_frame::FrameInertiaForces;
pub use super::moving_frame::FrameMotion;
use super::system::System;
use bimorph_multibody::BodyMatrix;
use bimorph_multibody::planar::{DOF, Pose};
use nalgebra::Vector2;

/// A force along x or y, or a moment, of one unit.
fn unit(point: MaterialPoint, direction: usize) -> DeadLoad {
    match direction {
        0 => DeadLoad { point, force: Vector2::x(), moment: 0.0 },
        1 => DeadLoad { point, force: Vector2::y(), moment: 0.0 },
        _ => DeadLoad { point, force: Vector2::zeros(), moment: 1.0 },
    }
}

impl System {
    /// Motion of the frame in a drive; none where no input moves it.
    pub fn frame(&self, drive: &Drive) -> Option<FrameMotion> {
        let inputs = &self.electrics.inputs;
        if !inputs.iter().any(Input::moves_frame) {
            return None;
        }
        let mut frame = FrameMotion { turning: drive.turning, ..FrameMotion::default() };
        for (input, value) in inputs.iter().zip(&drive.inputs) {
            match input {
                Input::Acceleration { axis } => frame.acceleration[*axis] += value,
                Input::Rate => frame.rate += value,
                Input::Force { .. } | Input::Motion { .. } | Input::Heat { .. } => {}
            }
        }
        Some(frame)
    }

    /// Whether an input turns the frame.
    #[inline]
    pub fn turns(&self) -> bool {
        self.electrics.inputs.contains(&Input::Rate)
    }

    /// Whether source `source` is the rate of the frame.
    #[inline]
    pub fn is_rate(&self, source: usize) -> bool {
        let input = source.checked_sub(self.electrics.voltages()).map(|k| self.electrics.inputs[k]);
        input == Some(Input::Rate)
    }

    /// `r +=` the share of inputs in the residual.
    pub(super) fn add_input_forces(&self, at: Configuration<'_>, drive: &Drive, r: &mut [Pose]) {
        for (load, size) in self.given_loads(drive) {
            load.add_force(at, size, r);
        }
        r.iter_mut().zip(&drive.push).for_each(|(r, push)| *r -= push);
        if let Some(frame) = self.frame(drive) {
            self.in_frame().add_force(at, frame, r);
        }
    }

    /// `r +=` the change of that share with a change of the drive.
    pub(super) fn add_input_change(&self, at: Configuration<'_>, drive: &Drive, change: &Drive, r: &mut [Pose]) {
        for ((load, change), (_, size)) in self.given_loads(change).zip(self.given_loads(drive)) {
            load.add_force_change(at, size, change, r);
        }
        r.iter_mut().zip(&change.push).for_each(|(r, push)| *r -= push);
        if let (Some(frame), Some(change)) = (self.frame(drive), self.frame(change)) {
            self.in_frame().add_force_change(at, frame, change, r);
        }
    }

    /// `tangent +=` the share of inputs in ∂r/∂q but for the skew one of Euler's force.
    pub(super) fn add_input_tangent(&self, at: Configuration<'_>, drive: &Drive, tangent: &mut BodyMatrix) {
        for (load, size) in self.given_loads(drive) {
            load.add_tangent(at, size, &self.model.pattern, tangent);
        }
        if let Some(frame) = self.frame(drive) {
            self.in_frame().add_tangent(at, frame, &self.model.pattern, tangent);
        }
    }

    /// Their share in the potential (J) but for Euler's force, which has none.
    pub(super) fn input_energy(&self, at: Configuration<'_>, drive: &Drive) -> f64 {
        let given: f64 = self.given_loads(drive).map(|(load, size)| load.energy(at, size)).sum();
        let moved: f64 = self.anchor_loads(drive).map(|(_, stiffness, value)| 0.5 * stiffness * value * value).sum();
        let given = given + moved;
        let pushed: f64 = at.q.iter().zip(&drive.push).map(|(q, push)| q.dot(push)).sum();
        given - pushed + self.frame(drive).map_or(0.0, |frame| self.in_frame().energy(at, frame))
    }

    /// The forces and moments among the inputs, those that hold anchors at their places included: loads of one unit, with their sizes (N, N·m).
    pub(super) fn given_loads<'a>(&'a self, drive: &'a Drive) -> impl Iterator<Item = (DeadLoad, f64)> + 'a {
        let forces = self.electrics.inputs.iter().zip(&drive.inputs).filter_map(|(input, value)| match *input {
            Input::Force { point, direction } => Some((unit(point, direction), *value)),
            _ => None,
        });
        forces.chain(self.anchor_loads(drive).map(|(load, stiffness, value)| (load, stiffness * value)))
    }

    /// Loads of one unit at driven anchors, with the stiffness of the springs there (N/m, N·m/rad) and their displacement or rotation (m, rad).
    fn anchor_loads<'a>(&'a self, drive: &'a Drive) -> impl Iterator<Item = (DeadLoad, f64, f64)> + 'a {
        let given = move |anchor: usize, direction: usize| -> f64 {
            let is_it = |input: &Input| *input == Input::Motion { anchor, direction };
            let values = self.electrics.inputs.iter().zip(&drive.inputs);
            values.filter(|(input, _)| is_it(input)).map(|(_, value)| *value).sum()
        };
        self.anchors.iter().enumerate().flat_map(move |(anchor, of)| {
            (0..DOF).map(move |direction| {
                let value = given(anchor, direction) + drive.load * of.drawn[direction];
                (unit(of.point, direction), of.stiffness[direction], value)
            })
        })
    }

    fn in_frame(&self) -> FrameInertiaForces<'_> {
        FrameInertiaForces(&self.model.bodies)
    }
}
