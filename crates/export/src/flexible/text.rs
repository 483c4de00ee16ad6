//! Polynomials as expressions that Verilog-A reads.

use bimorph_solve::reduced::polynomial::monomials::Polynomials;

/// Part of the largest term of a polynomial below which a term is left out (1).
const NEGLIGIBLE: f64 = 1e-9;

/// A term: its factors in ascending order, and its coefficient.
type Term = (Vec<usize>, f64);

/// A polynomial over the variables `q1`, `q2` and so on.
#[derive(Debug, Clone, PartialEq)]
pub struct PolynomialText(Vec<Term>);

impl PolynomialText {
    /// Polynomial `row`, times `scale`, without terms that are negligible where the coordinates have this reach.
    pub fn new(polynomials: &Polynomials, row: usize, scale: f64, reach: &[f64]) -> Self {
        let coefficients = polynomials.coefficients.row(row);
        let factors = polynomials.monomials.factors.iter().cloned();
        let mut terms: Vec<Term> = factors.zip(coefficients.iter().map(|c| scale * c)).collect();
        let size = |(factors, c): &Term| c.abs() * factors.iter().map(|k| reach[*k]).product::<f64>();
        let largest = terms.iter().map(size).fold(0.0, f64::max);
        terms.retain(|term| size(term) > NEGLIGIBLE * largest);
        Self(terms)
    }

    /// Its derivative with coordinate `k`.
    #[must_use]
    pub fn derivative(&self, k: usize) -> Self {
        let one = |(factors, c): &Term| {
            let place = factors.iter().position(|of| *of == k)?;
            let times = factors.iter().filter(|of| **of == k).count() as f64;
            let mut rest = factors.clone();
            rest.remove(place);
            Some((rest, times * c))
        };
        Self(self.0.iter().filter_map(one).collect())
    }

    /// Whether it is 0.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The expression, by Horner's rule in one coordinate after the other.
    pub fn text(&self) -> String {
        let terms: Vec<(&[usize], f64)> = self.0.iter().map(|(factors, c)| (factors.as_slice(), *c)).collect();
        nested(&terms)
    }
}

fn nested(terms: &[(&[usize], f64)]) -> String {
    let mut parts: Vec<String> = Vec::new();
    let constant: f64 = terms.iter().filter(|(factors, _)| factors.is_empty()).map(|(_, c)| c).sum();
    if constant != 0.0 {
        parts.push(format!("{constant:e}"));
    }
    let mut firsts: Vec<usize> = terms.iter().filter_map(|(factors, _)| factors.first().copied()).collect();
    firsts.sort_unstable();
    firsts.dedup();
    for first in firsts {
        let inner: Vec<(&[usize], f64)> =
            terms.iter().filter(|(factors, _)| factors.first() == Some(&first)).map(|(f, c)| (&f[1..], *c)).collect();
        let text = nested(&inner);
        parts.push(match inner.iter().all(|(factors, _)| factors.is_empty()) {
            true => format!("{text} * q{}", first + 1),
            false => format!("q{} * ({text})", first + 1),
        });
    }
    if parts.is_empty() { "0".to_owned() } else { parts.join(" + ").replace("+ -", "- ") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bimorph_solve::reduced::polynomial::monomials::Monomials;
    use nalgebra::DMatrix;
    use std::sync::Arc;

    /// 2·x + 3·x² − x·y + 5·x²·y as text, and its derivative with x, whose values at (0.5, 2) are 3.25 and 13 by hand.
    #[test]
    fn terms_and_derivatives() {
        let monomials = Arc::new(Monomials::new(2, 3));
        let mut coefficients = DMatrix::zeros(1, monomials.count());
        for (factors, c) in [(vec![0], 2.0), (vec![0, 0], 3.0), (vec![0, 1], -1.0), (vec![0, 0, 1], 5.0)] {
            let place = monomials.factors.iter().position(|of| *of == factors).unwrap();
            coefficients[(0, place)] = c;
        }
        let text = PolynomialText::new(&Polynomials { monomials, coefficients }, 0, 1.0, &[1.0, 1.0]);
        assert_eq!(text.text(), "q1 * (2e0 + q1 * (3e0 + 5e0 * q2) - 1e0 * q2)");
        assert_eq!(text.derivative(0).text(), "2e0 + q1 * (6e0 + 1e1 * q2) - 1e0 * q2");
        assert_eq!(text.derivative(1).text(), "q1 * (-1e0 + 5e0 * q1)");
        let value = |x: f64, y: f64| x * (2.0 + x * (3.0 + 5.0 * y) - y);
        assert_eq!((value(0.5, 2.0), 2.0 + 0.5 * (6.0 + 10.0 * 2.0) - 2.0), (3.25, 13.0));
        assert!(text.derivative(1).derivative(1).is_empty());
    }
}
