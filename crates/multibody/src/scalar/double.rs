//! Double-double numbers: an unevaluated sum of two f64, some 32 digits, where the difference of nearly equal numbers counts.
//!
//! Only what products with a tangent need: sums, and products with an f64. No fused multiplication is used, so that the bits
//! are the same on every processor.
//!
//! Reference: T. J. Dekker, "A floating-point technique for extending the available precision", Numer. Math. 18 (1971);
//! Y. Hida, X. S. Li, D. H. Bailey, "Algorithms for quad-double precision floating point arithmetic", ARITH-15 (2001).

use std::ops::{Add, AddAssign, Mul, Neg, Sub};

/// `high + low` with |low| at most half a unit in the last place of `high`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Double {
    /// The number rounded to f64.
    pub high: f64,
    /// The remainder.
    pub low: f64,
}

/// Displacement or force of a planar body: x, y, rotation.
pub type DoublePose = [Double; 3];

/// The sum and its rounding error (Knuth).
#[inline(always)]
fn two_sum(a: f64, b: f64) -> Double {
    let high = a + b;
    let back = high - a;
    Double { high, low: (a - (high - back)) + (b - back) }
}

/// The sum and its rounding error where |a| ≥ |b| (Dekker).
#[inline(always)]
fn quick_two_sum(a: f64, b: f64) -> Double {
    let high = a + b;
    Double { high, low: b - (high - a) }
}

/// The upper half of the digits of `a` (Veltkamp), and the lower.
#[inline(always)]
fn split(a: f64) -> (f64, f64) {
    let shifted = 134_217_729.0 * a;
    let high = shifted - (shifted - a);
    (high, a - high)
}

/// The product and its rounding error (Dekker).
#[inline(always)]
fn two_product(a: f64, b: f64) -> Double {
    let high = a * b;
    let ((ah, al), (bh, bl)) = (split(a), split(b));
    Double { high, low: ((ah * bh - high) + ah * bl + al * bh) + al * bl }
}

impl From<f64> for Double {
    fn from(high: f64) -> Self {
        Self { high, low: 0.0 }
    }
}

impl Add for Double {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let (high, low) = (two_sum(self.high, other.high), two_sum(self.low, other.low));
        let first = quick_two_sum(high.high, high.low + low.high);
        quick_two_sum(first.high, first.low + low.low)
    }
}

impl Neg for Double {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self { high: -self.high, low: -self.low }
    }
}

impl Sub for Double {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl AddAssign for Double {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Mul<f64> for Double {
    type Output = Self;

    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        let product = two_product(self.high, factor);
        quick_two_sum(product.high, product.low + self.low * factor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
