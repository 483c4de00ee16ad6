//! Poses and rates of bodies, and their offsets from their parents, over lanes.

use super::mechanism::MechanismConstants;
use crate::planar::vector::minus;
use crate::planar::{HalfTurn, Vec2};
use crate::scalar::StoredReal;

/// Where a body is and how it moves: what its children and the closures need of it.
#[derive(Debug, Clone, Copy)]
pub struct BodyKinematics<T> {
    /// Displacement and rotation from the drawn place.
    pub pose: [T; 3],
    /// Rate.
    pub rate: [T; 3],
    /// Sine and cosine of half the rotation.
    pub half: Vec2<T>,
}

/// Offset of a placed body from its parent, for the inward and outward passes of the reduction.
#[derive(Debug, Clone, Copy)]
pub struct ParentOffset<T> {
    /// From the parent's centre of mass to the pin, R_p·arm_p; where there is no pin, to this body's centre of mass (m).
    pub lever_parent: Vec2<T>,
    /// From this body's centre of mass to the pin, R·arm; zero without a pin (m).
    pub lever: Vec2<T>,
    /// Velocity part c of the acceleration (m/s²).
    pub bias: Vec2<T>,
}

/// Poses and rates of all bodies, and their offsets.
#[derive(Debug, Clone)]
pub struct MechanismKinematics<T> {
    pub placed: Vec<BodyKinematics<T>>,
    pub hanging: Vec<ParentOffset<T>>,
    /// Axes of the coordinates of joints that are no pins; none where all joints are.
    pub axes: Vec<[T; 3]>,
}

impl<T: StoredReal> BodyKinematics<T> {
    pub const REST: Self = Self { pose: [T::ZERO; 3], rate: [T::ZERO; 3], half: [T::ZERO, T::ONE] };

    /// Takes `from` as one of the lanes.
    #[inline(always)]
    pub fn set_lane(&mut self, lane: usize, from: &BodyKinematics<f64>) {
        let set = |to: &mut [T], from: &[f64]| to.iter_mut().zip(from).for_each(|(t, f)| t.set_lane(lane, *f));
        set(&mut self.pose, &from.pose);
        set(&mut self.rate, &from.rate);
        set(&mut self.half, &from.half);
    }

    /// One of the lanes.
    #[inline]
    pub fn lane(&self, lane: usize) -> BodyKinematics<f64> {
        BodyKinematics {
            pose: self.pose.map(|x| x.lane(lane)),
            rate: self.rate.map(|x| x.lane(lane)),
            half: self.half.map(|x| x.lane(lane)),
        }
    }

    /// (R − 1)·v without cancellation at small angles.
    #[inline(always)]
    pub fn rotation_minus_identity(&self, v: Vec2<T>) -> Vec2<T> {
        HalfTurn::of(self.half).rotation_minus_identity(v)
    }

    /// R((θ + θ_other)/2)·v.
    #[inline(always)]
    pub fn mean(&self, other: &Self, v: Vec2<T>) -> Vec2<T> {
        HalfTurn::of(self.half).mean(&HalfTurn::of(other.half), v)
    }
}

impl<T: StoredReal> ParentOffset<T> {
    /// One of the lanes.
    #[inline]
    pub fn lane(&self, lane: usize) -> ParentOffset<f64> {
        let pair = |x: Vec2<T>| x.map(|x| x.lane(lane));
        ParentOffset { lever_parent: pair(self.lever_parent), lever: pair(self.lever), bias: pair(self.bias) }
    }

    pub const REST: Self = Self { lever_parent: [T::ZERO; 2], lever: [T::ZERO; 2], bias: [T::ZERO; 2] };

    /// From the parent's centre of mass to this one, d (m).
    #[inline(always)]
    pub fn shift(&self) -> Vec2<T> {
        minus(self.lever_parent, self.lever)
    }

    /// Joint axis of a pin, whose one column of S it is.
    #[inline(always)]
    pub fn pin_axis(&self, sign: T) -> [T; 3] {
        [sign * self.lever[1], -(sign * self.lever[0]), sign]
    }
}

impl<T: StoredReal> MechanismKinematics<T> {
    /// Bodies at rest where they are drawn, of a mechanism with `coordinates` coordinates.
    pub(super) fn new(mechanism: &MechanismConstants<T>, coordinates: usize) -> Self {
        Self {
            placed: vec![BodyKinematics::REST; mechanism.bodies()],
            hanging: vec![ParentOffset::REST; mechanism.bodies()],
            axes: vec![[T::ZERO; 3]; if mechanism.joints.is_empty() { 0 } else { coordinates }],
        }
    }

    /// Axis of a coordinate of `body`.
    #[inline(always)]
    pub(super) fn axis(&self, mechanism: &MechanismConstants<T>, body: usize, coordinate: usize) -> [T; 3] {
        if mechanism.schedule.steps[body].pin {
            self.hanging[body].pin_axis(mechanism.signs[body])
        } else {
            self.axes[coordinate]
        }
    }
}
