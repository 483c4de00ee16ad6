//! Lanes of numbers: a batch of variants.

// loops over lanes are indexed, which compilers turn into vector instructions
#![allow(clippy::needless_range_loop)]

use super::Real;
use super::stored::{StoredReal, sines_and_cosines};
use pulp::Arch;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A batch of `N` variants.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(64))]
pub struct Lanes<const N: usize>(pub [f64; N]);

/// Whether the processor has vector instructions. Without them eight lanes are eight times the work, and nothing is packed.
#[inline]
pub fn has_lanes() -> bool {
    !matches!(Arch::new(), Arch::Scalar)
}

macro_rules! lanewise {
    ($trait:ident, $method:ident) => {
        impl<const N: usize> $trait for Lanes<N> {
            type Output = Self;
            #[inline(always)]
            fn $method(mut self, other: Self) -> Self {
                for k in 0..N {
                    self.0[k] = $trait::$method(self.0[k], other.0[k]);
                }
                self
            }
        }
    };
}
lanewise!(Add, add);
lanewise!(Sub, sub);
lanewise!(Mul, mul);
lanewise!(Div, div);

macro_rules! with_one_number {
    ($trait:ident, $method:ident) => {
        impl<const N: usize> $trait<f64> for Lanes<N> {
            type Output = Self;
            #[inline(always)]
            fn $method(mut self, other: f64) -> Self {
                for k in 0..N {
                    self.0[k] = $trait::$method(self.0[k], other);
                }
                self
            }
        }
    };
}
with_one_number!(Add, add);
with_one_number!(Mul, mul);

impl<const N: usize> Neg for Lanes<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(mut self) -> Self {
        for x in &mut self.0 {
            *x = -*x;
        }
        self
    }
}

impl<const N: usize> AddAssign for Lanes<N> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        for k in 0..N {
            self.0[k] += other.0[k];
        }
    }
}

impl<const N: usize> SubAssign for Lanes<N> {
    #[inline(always)]
    fn sub_assign(&mut self, other: Self) {
        for k in 0..N {
            self.0[k] -= other.0[k];
        }
    }
}

impl<const N: usize> Real for Lanes<N> {
    #[inline(always)]
    fn splat_like(self, x: f64) -> Self {
        Self([x; N])
    }
}

impl<const N: usize> StoredReal for Lanes<N> {
    const LANES: usize = N;
    const ZERO: Self = Self([0.0; N]);
    const ONE: Self = Self([1.0; N]);
    #[inline(always)]
    fn splat(x: f64) -> Self {
        Self([x; N])
    }
    #[inline(always)]
    fn lane(&self, k: usize) -> f64 {
        self.0[k]
    }
    #[inline(always)]
    fn set_lane(&mut self, k: usize, x: f64) {
        self.0[k] = x;
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = sines_and_cosines(&self.0);
        (Self(sin), Self(cos))
    }
    #[inline(always)]
    fn sqrt(mut self) -> Self {
        for x in &mut self.0 {
            *x = x.sqrt();
        }
        self
    }
    #[inline(always)]
    fn copysign(mut self, sign: Self) -> Self {
        for k in 0..N {
            self.0[k] = self.0[k].copysign(sign.0[k]);
        }
        self
    }
    #[inline(always)]
    fn max(mut self, other: Self) -> Self {
        for k in 0..N {
            self.0[k] = self.0[k].max(other.0[k]);
        }
        self
    }
    #[inline(always)]
    fn abs(mut self) -> Self {
        for x in &mut self.0 {
            *x = x.abs();
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Within 1.2e-16 of the standard library over the whole reduced range, and the same bits in a lane as alone.
    #[test]
    fn sine_and_cosine_are_right_to_rounding() {
        for k in 0..40_000 {
            let small = (k as f64 - 20_000.0) * 1.234_567_89e-3;
            for x in [small, small * 1e-9, small * 3.9e3] {
                let (s, c) = StoredReal::sin_cos(x);
                assert!((s - x.sin()).abs() <= 1.2e-16 && (c - x.cos()).abs() <= 1.2e-16, "{x}: {s} {c}");
                assert!(x.abs() > 1e-3 || (s - x.sin()).abs() <= 2.3e-16 * x.abs());
                let (ls, lc) = Lanes([x, 0.3, -x, 7.0]).sin_cos();
                assert_eq!((ls.0[0].to_bits(), lc.0[0].to_bits()), (s.to_bits(), c.to_bits()));
                assert_eq!(ls.0[2].to_bits(), (-s).to_bits());
            }
        }
    }

    /// Angles taken together give the bits of each alone, whatever their number.
    #[test]
    fn angles_together_are_as_alone() {
        for k in 0..20_000 {
            let angles: Vec<f64> = (0..k % 20).map(|i| (k as f64 - 1e4) * 1.234_5e-4 + 0.1 * i as f64).collect();
            let (mut sin, mut cos) = (angles.clone(), angles.clone());
            f64::sin_cos_each(&mut sin, &mut cos);
            for ((x, s), c) in angles.into_iter().zip(sin).zip(cos) {
                let alone = StoredReal::sin_cos(x);
                assert_eq!((s.to_bits(), c.to_bits()), (alone.0.to_bits(), alone.1.to_bits()), "{x}");
            }
        }
    }

    /// A lane with a far angle takes nothing from its neighbours.
    #[test]
    fn far_angles_go_through_the_standard_library() {
        let (s, c) = Lanes([1e7, 0.5]).sin_cos();
        assert_eq!((s.0[0], c.0[0]), 1e7f64.sin_cos());
        assert_eq!((s.0[1], c.0[1]), StoredReal::sin_cos(0.5));
    }
}
