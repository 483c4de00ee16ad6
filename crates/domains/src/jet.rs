//! A value with its first two derivatives over two variables: laws of two displacements are written once, and their derivatives are exact.
//!
//! Reference: A. Griewank, A. Walther, "Evaluating Derivatives" (2008), §13.

use std::ops::{Add, Mul, Sub};

/// Value f, (f_x, f_y) and (f_xx, f_xy, f_yy).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Jet {
    /// The value.
    pub value: f64,
    /// First derivatives.
    pub first: [f64; 2],
    /// Second derivatives.
    pub second: [f64; 3],
}

impl Jet {
    /// Variable number `k`.
    #[inline]
    pub fn variable(value: f64, k: usize) -> Self {
        let mut first = [0.0; 2];
        first[k] = 1.0;
        Self { value, first, second: [0.0; 3] }
    }

    /// A function of it, by the function's value and first two derivatives there.
    #[inline]
    #[must_use]
    pub fn map(self, [value, slope, curvature]: [f64; 3]) -> Self {
        let [x, y] = self.first;
        let [xx, xy, yy] = self.second;
        Self {
            value,
            first: [slope * x, slope * y],
            second: [curvature * x * x + slope * xx, curvature * x * y + slope * xy, curvature * y * y + slope * yy],
        }
    }

    /// 1/f.
    #[inline]
    #[must_use]
    pub fn inverse(self) -> Self {
        let inverse = 1.0 / self.value;
        let square = inverse * inverse;
        self.map([inverse, -square, 2.0 * square * inverse])
    }
}

impl Add for Jet {
    type Output = Self;
    #[inline]
    fn add(self, o: Self) -> Self {
        Self {
            value: self.value + o.value,
            first: std::array::from_fn(|k| self.first[k] + o.first[k]),
            second: std::array::from_fn(|k| self.second[k] + o.second[k]),
        }
    }
}

impl Sub for Jet {
    type Output = Self;
    #[inline]
    fn sub(self, o: Self) -> Self {
        self + o * -1.0
    }
}

impl Mul<f64> for Jet {
    type Output = Self;
    #[inline]
    fn mul(self, s: f64) -> Self {
        Self { value: self.value * s, first: self.first.map(|x| x * s), second: self.second.map(|x| x * s) }
    }
}

impl Mul for Jet {
    type Output = Self;
    #[inline]
    fn mul(self, o: Self) -> Self {
        let ([x, y], [ox, oy]) = (self.first, o.first);
        let ([xx, xy, yy], [oxx, oxy, oyy]) = (self.second, o.second);
        Self {
            value: self.value * o.value,
            first: [x * o.value + self.value * ox, y * o.value + self.value * oy],
            second: [
                xx * o.value + 2.0 * x * ox + self.value * oxx,
                xy * o.value + x * oy + y * ox + self.value * oxy,
                yy * o.value + 2.0 * y * oy + self.value * oyy,
            ],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (x·y + x − y²)/(x + 3y) and its logarithm at (2, 0.7): derivatives by hand of the quotient's parts, checked with differences of fourth order to 1e-8.
    #[test]
    fn derivatives_of_an_expression() {
        let at = |x: f64, y: f64| {
            let (x, y) = (Jet::variable(x, 0), Jet::variable(y, 1));
            let quotient = (x * y + x - y * y) * (x + y * 3.0).inverse();
            let v = quotient.value;
            quotient.map([v.ln(), 1.0 / v, -1.0 / (v * v)])
        };
        let (x, y, e) = (2.0, 0.7, 1e-3);
        let found = at(x, y);
        assert!((found.value - ((1.4 + 2.0 - 0.49) / 4.1f64).ln()).abs() < 1e-15);
        let difference = |of: &dyn Fn(f64) -> f64| {
            let [a, b, c, d] = [-2.0, -1.0, 1.0, 2.0].map(|n| of(n * e));
            (a - d + 8.0 * (c - b)) / (12.0 * e)
        };
        let expected = [
            (found.first[0], difference(&|d| at(x + d, y).value)),
            (found.first[1], difference(&|d| at(x, y + d).value)),
            (found.second[0], difference(&|d| at(x + d, y).first[0])),
            (found.second[1], difference(&|d| at(x, y + d).first[0])),
            (found.second[2], difference(&|d| at(x, y + d).first[1])),
        ];
        for (k, (found, expected)) in expected.into_iter().enumerate() {
            assert!((found - expected).abs() < 1e-8, "{k}: {found} {expected}");
        }
    }
}
