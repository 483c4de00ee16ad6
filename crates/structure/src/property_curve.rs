//! A property of a material against temperature: a polynomial, or a table with a monotone cubic between its points.
//!
//! The slope in an inner point of a table is the weighted harmonic mean of those of the lines on both sides, or 0 where these have different signs
//! (F. N. Fritsch and J. Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300). The curve is continuous with its slope, and has no extremum that the
//! points do not have. Beyond its ends a table keeps its last value, and analyses report a state that leaves it.

use serde::{Deserialize, Serialize};
use std::fmt;

/// A property against temperature. One of the two lists is empty.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct PropertyCurve {
    /// Temperatures, increasing, with the values there (K, the unit of the property).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub table: Vec<[f64; 2]>,
    /// Coefficients of the powers of the temperature, from the constant on (the unit of the property, over K, over K², …).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub polynomial: Vec<f64>,
}

/// A fault of a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CurveFault {
    /// Neither or both lists have entries, or a table has one point alone.
    Form,
    /// A number is not finite.
    NotFinite,
    /// A temperature of a table (K) that is not above the one before it (K).
    NotIncreasing(f64, f64),
}

impl fmt::Display for CurveFault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Form => write!(f, "expected a table of at least two points, or a polynomial"),
            Self::NotFinite => write!(f, "expected finite numbers"),
            Self::NotIncreasing(next, before) => {
                write!(f, "the temperatures of a table must increase, {next} K follows {before} K")
            }
        }
    }
}

impl PropertyCurve {
    /// Its fault, if it has one.
    pub fn fault(&self) -> Option<CurveFault> {
        let numbers = self.table.iter().flatten().chain(&self.polynomial);
        if (self.table.len() < 2) == self.polynomial.is_empty() || (self.table.len() == 1) {
            return Some(CurveFault::Form);
        }
        if !numbers.copied().all(f64::is_finite) {
            return Some(CurveFault::NotFinite);
        }
        let steps = self.table.windows(2).find(|pair| pair[1][0] <= pair[0][0])?;
        Some(CurveFault::NotIncreasing(steps[1][0], steps[0][0]))
    }

    /// Lowest and highest temperature of a table (K); none of a polynomial.
    pub fn range(&self) -> Option<[f64; 2]> {
        Some([self.table.first()?[0], self.table.last()?[0]])
    }

    /// Whether it has a value of its own at a temperature (K).
    pub fn covers(&self, temperature: f64) -> bool {
        self.range().is_none_or(|[low, high]| (low..=high).contains(&temperature))
    }

    /// Value and slope at a temperature (K).
    pub fn at(&self, temperature: f64) -> [f64; 2] {
        let Some([low, high]) = self.range() else {
            let horner = |[value, slope]: [f64; 2], c: &f64| [value * temperature + c, slope * temperature + value];
            return self.polynomial.iter().rev().fold([0.0; 2], horner);
        };
        if !(low..=high).contains(&temperature) {
            return [self.held(temperature, low), 0.0];
        }
        let (k, h, u) = self.place(temperature);
        let ([a, b], [m, n]) = ([self.table[k][1], self.table[k + 1][1]], [h * self.slope(k), h * self.slope(k + 1)]);
        let (p, q) = (3.0 * (b - a) - 2.0 * m - n, m + n - 2.0 * (b - a));
        [a + u * (m + u * (p + u * q)), (m + u * (2.0 * p + 3.0 * u * q)) / h]
    }

    /// ∫ of the value from one temperature to another (K times the unit of the property).
    pub fn integral(&self, from: f64, to: f64) -> f64 {
        self.primitive(to) - self.primitive(from)
    }

    /// The same curve with all values times a factor.
    pub fn scaled(&self, factor: f64) -> Self {
        Self {
            table: self.table.iter().map(|[t, value]| [*t, value * factor]).collect(),
            polynomial: self.polynomial.iter().map(|c| c * factor).collect(),
        }
    }

    /// ∫ of the value from the first point of a table, or from 0 K.
    fn primitive(&self, temperature: f64) -> f64 {
        let Some([low, high]) = self.range() else {
            let terms = self.polynomial.iter().enumerate().rev();
            return temperature * terms.fold(0.0, |sum, (k, c)| sum * temperature + c / (k + 1) as f64);
        };
        if temperature <= low {
            return (temperature - low) * self.held(temperature, low);
        }
        let (last, h, u) = self.place(temperature.min(high));
        let part = |k: usize, h: f64, u: f64| {
            let ([a, b], [m, n]) =
                ([self.table[k][1], self.table[k + 1][1]], [h * self.slope(k), h * self.slope(k + 1)]);
            let (p, q) = (3.0 * (b - a) - 2.0 * m - n, m + n - 2.0 * (b - a));
            h * u * (a + u * (m / 2.0 + u * (p / 3.0 + u * q / 4.0)))
        };
        let whole: f64 = (0..last).map(|k| part(k, self.table[k + 1][0] - self.table[k][0], 1.0)).sum();
        whole + part(last, h, u) + (temperature - high).max(0.0) * self.held(temperature, low)
    }

    /// Value that a table keeps beyond the end on the side of a temperature.
    fn held(&self, temperature: f64, low: f64) -> f64 {
        let end = if temperature < low { self.table.first() } else { self.table.last() };
        end.map_or(0.0, |point| point[1])
    }

    /// The interval of a temperature within the table, its length (K) and the fraction of it.
    fn place(&self, temperature: f64) -> (usize, f64, f64) {
        let above = self.table.partition_point(|point| point[0] <= temperature);
        let k = above.clamp(1, self.table.len() - 1) - 1;
        let h = self.table[k + 1][0] - self.table[k][0];
        (k, h, (temperature - self.table[k][0]) / h)
    }

    /// Slope in a point of the table.
    fn slope(&self, k: usize) -> f64 {
        let step = |k: usize| self.table[k + 1][0] - self.table[k][0];
        let secant = |k: usize| (self.table[k + 1][1] - self.table[k][1]) / step(k);
        let last = self.table.len() - 1;
        if last == 1 {
            return secant(0);
        }
        if k == 0 || k == last {
            let [near, far] = if k == 0 { [0, 1] } else { [last - 1, last - 2] };
            return end_slope([step(near), step(far)], [secant(near), secant(far)]);
        }
        let ([before, after], [left, right]) = ([step(k - 1), step(k)], [secant(k - 1), secant(k)]);
        if left * right <= 0.0 {
            return 0.0;
        }
        let [a, b] = [2.0 * after + before, after + 2.0 * before];
        (a + b) / (a / left + b / right)
    }
}

/// Slope in an end of a table: that of the parabola through three points, as far as the cubic stays monotone.
fn end_slope([near, far]: [f64; 2], [first, second]: [f64; 2]) -> f64 {
    let slope = ((2.0 * near + far) * first - near * second) / (near + far);
    if slope * first <= 0.0 {
        0.0
    } else if first * second <= 0.0 && slope.abs() > 3.0 * first.abs() {
        3.0 * first
    } else {
        slope
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Thermal expansion of silicon (1/K): Y. Okada and Y. Tokumaru, J. Appl. Phys. 56 (1984) 314, from 120 to 1500 K.
    fn silicon(t: f64) -> f64 {
        1e-6 * (3.725 * (1.0 - (-5.88e-3 * (t - 124.0)).exp()) + 5.548e-4 * t)
    }

    /// Its integral from 300 K, by hand.
    fn silicon_strain(t: f64) -> f64 {
        let part = |t: f64| 3.725 * (t + (-5.88e-3 * (t - 124.0)).exp() / 5.88e-3) + 2.774e-4 * t * t;
        1e-6 * (part(t) - part(300.0))
    }

    fn table(step: f64) -> PropertyCurve {
        let points = (0..).map(|k| 150.0 + step * f64::from(k)).take_while(|t| *t <= 1350.0);
        PropertyCurve { table: points.map(|t| [t, silicon(t)]).collect(), polynomial: Vec::new() }
    }

    /// A table of silicon's expansion each 50 K has the expansion to 3e-4 of itself and the free strain from 300 K to 1e-4, each 25 K four times closer.
    #[test]
    fn a_table_of_silicon() {
        for (step, value, strain) in [(50.0, 3e-4, 1e-4), (25.0, 8e-5, 3e-5)] {
            let curve = table(step);
            for k in 0..200 {
                let t = 200.0 + 5.0 * f64::from(k);
                assert!(
                    (curve.at(t)[0] / silicon(t) - 1.0).abs() < value,
                    "{step} {t}: {}",
                    curve.at(t)[0] / silicon(t)
                );
                let found = curve.integral(300.0, t);
                assert!((found - silicon_strain(t)).abs() <= strain * silicon_strain(t).abs(), "{step} {t}");
            }
        }
    }

    /// Slopes are those of differences, integrals have the value as slope, and both are continuous in the points; also of a polynomial.
    #[test]
    fn slopes_and_integrals() {
        let kinked = PropertyCurve {
            table: vec![[0.0, 1.0], [10.0, 3.0], [15.0, 2.0], [40.0, 2.0], [70.0, 9.0]],
            ..Default::default()
        };
        let cubic = PropertyCurve { polynomial: vec![1.0, 2e-2, -3e-4, 1e-6], ..Default::default() };
        for curve in [&kinked, &cubic, &table(50.0)] {
            let [low, high] = curve.range().unwrap_or([-50.0, 200.0]);
            for k in 1..97 {
                let (t, h) = (low + (high - low) * f64::from(k) / 97.0, 1e-4);
                let [value, slope] = curve.at(t);
                let by = (curve.at(t + h)[0] - curve.at(t - h)[0]) / (2.0 * h);
                let scale = value.abs() / (high - low);
                assert!((by - slope).abs() < 1e-6 * slope.abs() + 1e-5 * scale, "{t}: {by} {slope}");
                let by = curve.integral(t - h, t + h) / (2.0 * h);
                assert!((by - value).abs() < 1e-6 * value.abs(), "{t}: {by} {value}");
            }
        }
        for [t, value] in kinked.table.clone() {
            assert!((kinked.at(t)[0] - value).abs() < 1e-12);
            let [before, after] = [t - 1e-9, t + 1e-9].map(|t| kinked.at(t)[1]);
            assert!(t == 0.0 || t == 70.0 || (before - after).abs() < 1e-6, "{t}: {before} {after}");
        }
    }

    /// A cubic between points has no extremum of its own, and a table that does not increase, has one point or not a number is refused.
    #[test]
    fn monotone_and_checked() {
        let steep =
            PropertyCurve { table: vec![[0.0, 0.0], [1.0, 1.0], [2.0, 100.0], [3.0, 100.0]], ..Default::default() };
        let values: Vec<f64> = (0..=300).map(|k| steep.at(0.01 * f64::from(k))[0]).collect();
        assert!(values.windows(2).all(|pair| pair[1] >= pair[0] - 1e-12) && values[300] <= 100.0);
        assert_eq!((steep.at(-1.0), steep.at(5.0)), ([0.0; 2], [100.0, 0.0]));
        assert!((steep.integral(3.0, 5.0) - 200.0).abs() < 1e-9 && !steep.covers(3.1) && steep.covers(0.0));
        let fault = |table: &[[f64; 2]]| PropertyCurve { table: table.to_vec(), polynomial: Vec::new() }.fault();
        assert_eq!(fault(&[[1.0, 2.0], [1.0, 3.0]]), Some(CurveFault::NotIncreasing(1.0, 1.0)));
        assert_eq!((fault(&[[1.0, 2.0]]), fault(&[])), (Some(CurveFault::Form), Some(CurveFault::Form)));
        assert_eq!(fault(&[[1.0, f64::NAN], [2.0, 3.0]]), Some(CurveFault::NotFinite));
        assert_eq!(steep.fault(), None);
    }
}
