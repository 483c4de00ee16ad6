//! Numbers that the kinematics run over: `f64`, or a value with its derivative, for the exact change of everything with one
//! parameter.

use crate::multibody::sine::sin_cos;
use std::ops::{Add, AddAssign, Mul, Neg, Sub};

/// What the kinematics need of a number.
pub trait Number:
    Copy
    + std::fmt::Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Mul<f64, Output = Self>
    + Neg<Output = Self>
    + AddAssign
{
    /// 0.
    const ZERO: Self;
    /// A constant.
    fn constant(x: f64) -> Self;
    /// Sine and cosine.
    fn sin_cos(self) -> (Self, Self);
}

impl Number for f64 {
    const ZERO: Self = 0.0;
    #[inline(always)]
    fn constant(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        sin_cos(self)
    }
}

/// A value and its derivative with respect to one parameter.
///
/// Reference: W. K. Clifford, "Preliminary sketch of biquaternions" (1873); A. Griewank, A. Walther, "Evaluating
/// Derivatives" (2008), §3.1.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Dual {
    /// The value.
    pub value: f64,
    /// Its derivative.
    pub change: f64,
}

impl Add for Dual {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self { value: self.value + o.value, change: self.change + o.change }
    }
}

impl Sub for Dual {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self { value: self.value - o.value, change: self.change - o.change }
    }
}

impl Mul for Dual {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        Self { value: self.value * o.value, change: self.change * o.value + self.value * o.change }
    }
}

impl Mul<f64> for Dual {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: f64) -> Self {
        Self { value: self.value * o, change: self.change * o }
    }
}

impl Neg for Dual {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { value: -self.value, change: -self.change }
    }
}

impl AddAssign for Dual {
    #[inline(always)]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

impl Number for Dual {
    const ZERO: Self = Self { value: 0.0, change: 0.0 };
    #[inline(always)]
    fn constant(x: f64) -> Self {
        Self { value: x, change: 0.0 }
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = sin_cos(self.value);
        (Self { value: s, change: c * self.change }, Self { value: c, change: -s * self.change })
    }
}
