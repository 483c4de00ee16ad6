//! Double-double numbers in every lane: [`crate::double`].

use crate::scalar::Real;

/// `high + low` in every lane.
#[derive(Debug, Clone, Copy)]
pub struct LaneDouble<T> {
    /// The number rounded to f64.
    pub high: T,
    /// The remainder.
    pub low: T,
}

/// The sum and its rounding error (Knuth).
#[inline(always)]
fn two_sum<T: Real>(a: T, b: T) -> LaneDouble<T> {
    let high = a + b;
    let back = high - a;
    LaneDouble { high, low: (a - (high - back)) + (b - back) }
}

/// The sum and its rounding error where |a| ≥ |b| (Dekker).
#[inline(always)]
fn quick_two_sum<T: Real>(a: T, b: T) -> LaneDouble<T> {
    let high = a + b;
    LaneDouble { high, low: b - (high - a) }
}

/// The upper half of the digits (Veltkamp), and the lower.
#[inline(always)]
fn split<T: Real>(a: T) -> (T, T) {
    let shifted = a * 134_217_729.0;
    let high = shifted - (shifted - a);
    (high, a - high)
}

/// The product and its rounding error (Dekker).
#[inline(always)]
fn two_product<T: Real>(a: T, b: T) -> LaneDouble<T> {
    let high = a * b;
    let ((ah, al), (bh, bl)) = (split(a), split(b));
    LaneDouble { high, low: ((ah * bh - high) + ah * bl + al * bh) + al * bl }
}

impl<T: Real> LaneDouble<T> {
    /// A number without anything left.
    #[inline(always)]
    pub fn of(high: T) -> Self {
        Self { high, low: high.splat_like(0.0) }
    }

    /// The sum.
    #[inline(always)]
    pub fn plus(self, other: Self) -> Self {
        let (high, low) = (two_sum(self.high, other.high), two_sum(self.low, other.low));
        let first = quick_two_sum(high.high, high.low + low.high);
        quick_two_sum(first.high, first.low + low.low)
    }

    /// The difference.
    #[inline(always)]
    pub fn minus(self, other: Self) -> Self {
        self.plus(Self { high: -other.high, low: -other.low })
    }

    /// The product with a number.
    #[inline(always)]
    pub fn times(self, factor: T) -> Self {
        let product = two_product(self.high, factor);
        quick_two_sum(product.high, product.low + self.low * factor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scalar::Double;

    /// Sums and products have the bits of a double-double number alone.
    #[test]
    fn as_one_number() {
        let numbers = [1.0, -1.0 / 3.0, 1e-20, 7e11, 0.1];
        for a in numbers {
            for b in numbers {
                let (alone, lane) = (Double::from(a) * b + Double::from(b), LaneDouble::of(a).times(b));
                let sum = lane.plus(LaneDouble::of(b));
                assert_eq!((sum.high.to_bits(), sum.low.to_bits()), (alone.high.to_bits(), alone.low.to_bits()));
                let (alone, lane) = (alone - Double::from(a), sum.minus(LaneDouble::of(a)));
                assert_eq!((lane.high.to_bits(), lane.low.to_bits()), (alone.high.to_bits(), alone.low.to_bits()));
            }
        }
    }
}
