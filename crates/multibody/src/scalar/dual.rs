//! A value with its derivative: a number that the kinematics run over, for the exact change of everything with one parameter.

use super::Real;
use crate::sine;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

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

impl SubAssign for Dual {
    #[inline(always)]
    fn sub_assign(&mut self, o: Self) {
        *self = *self - o;
    }
}

impl Div for Dual {
    type Output = Self;
    #[inline(always)]
    fn div(self, o: Self) -> Self {
        let value = self.value / o.value;
        Self { value, change: (self.change - value * o.change) / o.value }
    }
}

impl Add<f64> for Dual {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: f64) -> Self {
        Self { value: self.value + o, change: self.change }
    }
}

impl Real for Dual {
    #[inline(always)]
    fn splat_like(self, x: f64) -> Self {
        Self::constant(x)
    }
}

impl Dual {
    /// 0.
    pub const ZERO: Self = Self::constant(0.0);

    /// A constant.
    #[inline(always)]
    pub const fn constant(x: f64) -> Self {
        Self { value: x, change: 0.0 }
    }

    /// Sine and cosine.
    #[inline(always)]
    pub fn sin_cos(self) -> (Self, Self) {
        let (s, c) = sine::sin_cos(self.value);
        (Self { value: s, change: c * self.change }, Self { value: c, change: -s * self.change })
    }
}
