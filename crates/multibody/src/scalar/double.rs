//! Double-double numbers: an unevaluated sum of two numbers, some 32 digits, where the difference of nearly equal numbers counts.
//!
//! Only what products with a tangent need: sums, and products with a single number. No fused multiplication is used, so that
//! the bits are the same on every processor, and in a lane as alone.
//!
//! Reference: T. J. Dekker, "A floating-point technique for extending the available precision", Numer. Math. 18 (1971);
//! Y. Hida, X. S. Li, D. H. Bailey, "Algorithms for quad-double precision floating point arithmetic", ARITH-15 (2001).

use super::Real;
use std::ops::{Add, AddAssign, Mul, Neg, Sub};

/// `high + low` with |low| at most half a unit in the last place of `high`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Double<T = f64> {
    /// The number rounded to the precision of `T`.
    pub high: T,
    /// The remainder.
    pub low: T,
}

/// Displacement or force of a planar body: x, y, rotation.
pub type DoublePose = [Double; 3];

/// The sum and its rounding error (Knuth).
#[inline(always)]
fn two_sum<T: Real>(a: T, b: T) -> Double<T> {
    let high = a + b;
    let back = high - a;
    Double { high, low: (a - (high - back)) + (b - back) }
}

/// The sum and its rounding error where |a| ≥ |b| (Dekker).
#[inline(always)]
fn quick_two_sum<T: Real>(a: T, b: T) -> Double<T> {
    let high = a + b;
    Double { high, low: b - (high - a) }
}

/// The upper half of the digits of `a` (Veltkamp), and the lower.
#[inline(always)]
fn split<T: Real>(a: T) -> (T, T) {
    let shifted = a * 134_217_729.0;
    let high = shifted - (shifted - a);
    (high, a - high)
}

/// The product and its rounding error (Dekker).
#[inline(always)]
fn two_product<T: Real>(a: T, b: T) -> Double<T> {
    let high = a * b;
    let ((ah, al), (bh, bl)) = (split(a), split(b));
    Double { high, low: ((ah * bh - high) + ah * bl + al * bh) + al * bl }
}

impl<T: Real> From<T> for Double<T> {
    #[inline(always)]
    fn from(high: T) -> Self {
        Self { high, low: high.splat_like(0.0) }
    }
}

impl<T: Real> Add for Double<T> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let (high, low) = (two_sum(self.high, other.high), two_sum(self.low, other.low));
        let first = quick_two_sum(high.high, high.low + low.high);
        quick_two_sum(first.high, first.low + low.low)
    }
}

impl<T: Real> Neg for Double<T> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self { high: -self.high, low: -self.low }
    }
}

impl<T: Real> Sub for Double<T> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl<T: Real> AddAssign for Double<T> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<T: Real> Mul<T> for Double<T> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, factor: T) -> Self {
        let product = two_product(self.high, factor);
        quick_two_sum(product.high, product.low + self.low * factor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scalar::Lanes;

    /// Digits far below the last place of an f64 survive sums and products: (1 + 2⁻⁸⁰)·3 − 3 = 3·2⁻⁸⁰, and the product of
    /// 1 + 2⁻³⁰ with itself keeps its 2⁻⁶⁰.
    #[test]
    fn keeps_what_cancels() {
        let tiny = 0.5f64.powi(80);
        let sum = (Double::from(1.0) + Double::from(tiny)) * 3.0 - Double::from(3.0);
        assert_eq!(sum.high, 3.0 * tiny);
        let x = 1.0 + 0.5f64.powi(30);
        let square = Double::from(x) * x - Double::from(1.0) - Double::from(0.5f64.powi(29));
        assert_eq!(square.high, 0.5f64.powi(60));
    }

    /// A lane has the bits of the number alone, in sums, differences and products.
    #[test]
    fn lanes_are_numbers() {
        let numbers = [1.0, -1.0 / 3.0, 1e-20, 7e11, 0.1];
        for a in numbers {
            for b in numbers {
                let of = |x: f64| Double::from(Lanes([x, 0.3]));
                let alone =
                    [Double::from(a) * b, Double::from(a) + Double::from(b) * a, Double::from(a) - Double::from(b)];
                let lanes = [of(a) * Lanes([b, -2.0]), of(a) + of(b) * Lanes([a, 7.0]), of(a) - of(b)];
                for (alone, lanes) in alone.iter().zip(lanes) {
                    let (high, low) = (lanes.high.0[0], lanes.low.0[0]);
                    assert_eq!((high.to_bits(), low.to_bits()), (alone.high.to_bits(), alone.low.to_bits()));
                }
            }
        }
    }
}
