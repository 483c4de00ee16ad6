//! Numbers as they are stored: one `f64`, or a lane of them for as many variants of one mechanism.
//!
//! Both go through the same additions and multiplications in the same order, so that a lane's bits are those of the serial run,
//! whatever the width of the processor's vectors.

// loops over lanes are indexed, which compilers turn into vector instructions
#![allow(clippy::needless_range_loop)]

use super::Real;
use crate::sine::{REDUCED, reduced};
use std::fmt::Debug;

/// A real number with constants, functions and access to its lanes.
pub trait StoredReal: Real + Debug + Send + Sync + PartialEq + 'static {
    /// How many variants it holds.
    const LANES: usize;
    /// 0 in every lane.
    const ZERO: Self;
    /// 1 in every lane.
    const ONE: Self;
    /// The same value in every lane.
    fn splat(x: f64) -> Self;
    /// Value of one lane.
    fn lane(&self, k: usize) -> f64;
    /// Sets the value of one lane.
    fn set_lane(&mut self, k: usize, x: f64);
    /// Sine and cosine.
    fn sin_cos(self) -> (Self, Self);
    /// Replaces each angle in `sin` by its sine and writes its cosine to `cos`: the bits of [`StoredReal::sin_cos`].
    #[inline(always)]
    fn sin_cos_each(sin: &mut [Self], cos: &mut [Self]) {
        for (s, c) in sin.iter_mut().zip(cos) {
            (*s, *c) = s.sin_cos();
        }
    }
    /// Square root.
    fn sqrt(self) -> Self;
    /// Magnitude of `self` with the sign of `sign`.
    fn copysign(self, sign: Self) -> Self;
    /// The larger one; the other where one is not a number.
    fn max(self, other: Self) -> Self;
    /// Magnitude.
    fn abs(self) -> Self;
}

impl StoredReal for f64 {
    const LANES: usize = 1;
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    #[inline(always)]
    fn splat(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn lane(&self, _: usize) -> f64 {
        *self
    }
    #[inline(always)]
    fn set_lane(&mut self, _: usize, x: f64) {
        *self = x;
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        if self.abs() > REDUCED { f64::sin_cos(self) } else { reduced(self) }
    }
    /// Eight at a time, in vector instructions.
    #[inline(always)]
    fn sin_cos_each(sin: &mut [Self], cos: &mut [Self]) {
        let (eights, ones) = sin.as_chunks_mut::<8>();
        let (cos_eights, cos_ones) = cos.as_chunks_mut::<8>();
        for (s, c) in eights.iter_mut().zip(cos_eights) {
            (*s, *c) = sines_and_cosines(s);
        }
        for (s, c) in ones.iter_mut().zip(cos_ones) {
            // not f64's own method, which is the platform's
            (*s, *c) = StoredReal::sin_cos(*s);
        }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        f64::copysign(self, sign)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        f64::max(self, other)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f64::abs(self)
    }
}

/// Sines and cosines of `N` angles in vector instructions, each with the bits of [`StoredReal::sin_cos`] of that angle alone.
#[inline(always)]
pub(super) fn sines_and_cosines<const N: usize>(angles: &[f64; N]) -> ([f64; N], [f64; N]) {
    let (mut sin, mut cos) = (*angles, *angles);
    let mut far = false;
    for k in 0..N {
        far |= angles[k].abs() > REDUCED;
    }
    for k in 0..N {
        (sin[k], cos[k]) = reduced(angles[k]);
    }
    if far {
        for k in 0..N {
            (sin[k], cos[k]) = StoredReal::sin_cos(angles[k]);
        }
    }
    (sin, cos)
}
