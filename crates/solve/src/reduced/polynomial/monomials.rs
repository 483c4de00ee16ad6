//! Monomials of some coordinates, and polynomials as sums of them.

use nalgebra::{DMatrix, DVector};
use std::sync::Arc;

/// Monomials of degree 1 to a degree: each the ascending list of its factors. Lower degrees come first.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Monomials {
    /// Number of coordinates m.
    pub size: usize,
    /// Factors of each.
    pub factors: Vec<Vec<usize>>,
}

impl Monomials {
    /// All in `size` coordinates up to a degree.
    pub fn new(size: usize, degree: usize) -> Self {
        let mut factors: Vec<Vec<usize>> = Vec::new();
        let mut last: Vec<Vec<usize>> = vec![Vec::new()];
        for _ in 0..degree {
            let further = |of: &Vec<usize>| {
                let of = of.clone();
                (of.last().copied().unwrap_or(0)..size).map(move |k| [of.as_slice(), &[k]].concat())
            };
            last = last.iter().flat_map(further).collect();
            factors.extend(last.iter().cloned());
        }
        Self { size, factors }
    }

    /// Their number.
    pub fn count(&self) -> usize {
        self.factors.len()
    }

    /// The highest degree.
    pub fn degree(&self) -> usize {
        self.factors.last().map_or(0, Vec::len)
    }

    /// Values at `x`.
    pub fn values(&self, x: &[f64]) -> DVector<f64> {
        DVector::from_iterator(self.count(), self.factors.iter().map(|of| of.iter().map(|k| x[*k]).product()))
    }

    /// Derivatives at `x`, monomials × coordinates.
    pub fn derivatives(&self, x: &[f64]) -> DMatrix<f64> {
        let mut slopes = DMatrix::zeros(self.count(), self.size);
        for (row, of) in self.factors.iter().enumerate() {
            for (i, k) in of.iter().enumerate() {
                slopes[(row, *k)] += others(of, &[i], x);
            }
        }
        slopes
    }

    /// `to +=` the second derivatives at `x` of the sum with these coefficients.
    pub fn add_curvature(&self, coefficients: &DVector<f64>, x: &[f64], to: &mut DMatrix<f64>) {
        for (of, c) in self.factors.iter().zip(coefficients.iter()).filter(|(of, c)| of.len() > 1 && **c != 0.0) {
            for i in 0..of.len() {
                for j in 0..i {
                    let value = c * others(of, &[i, j], x);
                    to[(of[i], of[j])] += value;
                    to[(of[j], of[i])] += value;
                }
            }
        }
    }
}

/// Product of the factors but for those in some places.
fn others(of: &[usize], without: &[usize], x: &[f64]) -> f64 {
    of.iter().enumerate().filter(|(i, _)| !without.contains(i)).map(|(_, k)| x[*k]).product()
}

/// Polynomials without constant terms.
#[derive(Debug, Clone, PartialEq)]
pub struct Polynomials {
    /// Their monomials.
    pub monomials: Arc<Monomials>,
    /// Coefficients, polynomials × monomials.
    pub coefficients: DMatrix<f64>,
}

impl Polynomials {
    /// Values where the monomials have these.
    pub fn values(&self, monomials: &DVector<f64>) -> DVector<f64> {
        &self.coefficients * monomials
    }

    /// Derivatives where the monomials have these, polynomials × coordinates.
    pub fn derivatives(&self, slopes: &DMatrix<f64>) -> DMatrix<f64> {
        &self.coefficients * slopes
    }

    /// The polynomials of some rows.
    pub fn rows(&self, first: usize, count: usize) -> Self {
        let coefficients = self.coefficients.rows(first, count).into_owned();
        Self { monomials: Arc::clone(&self.monomials), coefficients }
    }

    /// Those whose values are `matrix` times the values of these.
    pub fn mixed(&self, matrix: &DMatrix<f64>) -> Self {
        Self { monomials: Arc::clone(&self.monomials), coefficients: matrix * &self.coefficients }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two coordinates to the third degree have nine monomials; first and second derivatives of a sum of them are those of central differences
    /// to 1e-6, whose own error it is.
    #[test]
    fn derivatives_of_monomials() {
        let monomials = Monomials::new(2, 3);
        assert_eq!((monomials.count(), monomials.degree()), (9, 3));
        assert_eq!(monomials.factors[4], [1, 1]);
        let c = DVector::from_iterator(9, (1..=9).map(f64::from));
        let x = [0.7, -0.4];
        let at = |i: usize, h: f64| {
            let mut x = x;
            x[i] += h;
            x
        };
        let slopes = monomials.derivatives(&x).tr_mul(&c);
        let mut curvature = DMatrix::zeros(2, 2);
        monomials.add_curvature(&c, &x, &mut curvature);
        let h = 1e-5;
        for i in 0..2 {
            let difference = (monomials.values(&at(i, h)) - monomials.values(&at(i, -h))).dot(&c) / (2.0 * h);
            assert!((difference - slopes[i]).abs() < 1e-6 * slopes.amax(), "{i}: {difference} {}", slopes[i]);
            let change = monomials.derivatives(&at(i, h)) - monomials.derivatives(&at(i, -h));
            let column = change.tr_mul(&c) / (2.0 * h);
            assert!((column - curvature.column(i)).amax() < 1e-6 * curvature.amax(), "{i}");
        }
    }
}
