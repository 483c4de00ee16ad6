//! Where a body is, how it moves, and how it hangs on its parent, over lanes.

use super::pair::{Pair, minus, turned};
use super::scalar::Real;

/// Where a body is and how it moves: what its children and the closures need of it.
#[derive(Debug, Clone, Copy)]
pub struct Placed<T> {
    /// Displacement and rotation from the drawn place.
    pub(super) pose: [T; 3],
    /// Rate.
    pub(super) rate: [T; 3],
    /// Sine and cosine of half the rotation.
    pub(super) half: Pair<T>,
}

/// How a placed body hangs on its parent: what the reduction needs of it, inward and outward.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hanging<T> {
    /// From the parent's centre of mass to the pin, R_p·arm_p; where there is no pin, to this body's centre of mass [m].
    pub lever_parent: Pair<T>,
    /// From this body's centre of mass to the pin, R·arm; zero where there is none [m].
    pub(super) lever: Pair<T>,
    /// Velocity part c of the acceleration [m/s²].
    pub bias: Pair<T>,
}

impl<T: Real> Placed<T> {
    pub(super) const REST: Self = Self { pose: [T::ZERO; 3], rate: [T::ZERO; 3], half: [T::ZERO, T::ONE] };

    /// Takes `from` as one of the lanes.
    #[inline(always)]
    pub(super) fn set_lane(&mut self, lane: usize, from: &Placed<f64>) {
        let set = |to: &mut [T], from: &[f64]| to.iter_mut().zip(from).for_each(|(t, f)| t.set_lane(lane, *f));
        set(&mut self.pose, &from.pose);
        set(&mut self.rate, &from.rate);
        set(&mut self.half, &from.half);
    }

    /// One of the lanes.
    pub(super) fn lane(&self, lane: usize) -> Placed<f64> {
        Placed {
            pose: self.pose.map(|x| x.lane(lane)),
            rate: self.rate.map(|x| x.lane(lane)),
            half: self.half.map(|x| x.lane(lane)),
        }
    }

    /// (R − 1)·v without cancellation at small angles.
    #[inline(always)]
    pub(super) fn swing(&self, v: Pair<T>) -> Pair<T> {
        let [less, s] = turned(self.half);
        [less * v[0] - s * v[1], s * v[0] + less * v[1]]
    }

    /// R((θ + θ_other)/2)·v.
    #[inline(always)]
    pub(super) fn mean(&self, other: &Self, v: Pair<T>) -> Pair<T> {
        let c = self.half[1] * other.half[1] - self.half[0] * other.half[0];
        let s = self.half[0] * other.half[1] + self.half[1] * other.half[0];
        [c * v[0] - s * v[1], s * v[0] + c * v[1]]
    }
}

impl<T: Real> Hanging<T> {
    /// One of the lanes.
    pub(super) fn lane(&self, lane: usize) -> Hanging<f64> {
        let pair = |x: Pair<T>| x.map(|x| x.lane(lane));
        Hanging { lever_parent: pair(self.lever_parent), lever: pair(self.lever), bias: pair(self.bias) }
    }

    pub(super) const REST: Self = Self { lever_parent: [T::ZERO; 2], lever: [T::ZERO; 2], bias: [T::ZERO; 2] };

    /// From the parent's centre of mass to this one, d [m].
    #[inline(always)]
    pub(super) fn shift(&self) -> Pair<T> {
        minus(self.lever_parent, self.lever)
    }

    /// Joint axis of a pin, whose one column of S it is.
    #[inline(always)]
    pub(super) fn pin_axis(&self, sign: T) -> [T; 3] {
        [sign * self.lever[1], -(sign * self.lever[0]), sign]
    }
}
