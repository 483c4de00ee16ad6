//! Scalar trait of the joint kinematics.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// Scalar of the joint kinematics: a number, or one per lane.
pub trait Number:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + Add<f64, Output = Self>
    + Mul<f64, Output = Self>
{
    /// `x`, in as many lanes as this has.
    fn splat_like(self, x: f64) -> Self;
}

impl Number for f64 {
    #[inline(always)]
    fn splat_like(self, x: f64) -> Self {
        x
    }
}
