//! Properties of a heated beam against its temperature, where they are given as curves.

use bimorph_structure::PropertyCurve;

/// A curve that stands for a law in the temperature rise, relative to its value at ambient temperature.
#[derive(Debug, Clone, PartialEq)]
pub struct RelativeCurve {
    curve: PropertyCurve,
    /// Temperature at which its value is 1 (K).
    ambient: f64,
}

impl RelativeCurve {
    /// Of a curve whose value at ambient temperature (K) is positive.
    pub fn new(curve: &PropertyCurve, ambient: f64) -> Self {
        Self { curve: curve.scaled(curve.at(ambient)[0].recip()), ambient }
    }

    /// Value and slope at a rise (1, 1/K).
    fn at(&self, rise: f64) -> [f64; 2] {
        self.curve.at(self.ambient + rise)
    }

    /// Integral of the value between two rises (K), and the value at the second one (1).
    pub(super) fn between(&self, from: f64, to: f64) -> [f64; 2] {
        [self.curve.integral(self.ambient + from, self.ambient + to), self.at(to)[0]]
    }

    /// The largest value of a table; of a polynomial, that at ambient temperature or at a rise (K).
    fn largest(&self, rise: f64) -> f64 {
        let points = self.curve.table.iter().map(|point| point[1]);
        let ends = [0.0, rise].map(|rise| self.at(rise)[0]);
        points.chain(ends).fold(0.0, f64::max)
    }
}

/// Curves of a heated beam.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HeatCurves {
    /// Of its resistivity; none: linear.
    pub resistance: Option<RelativeCurve>,
    /// Of its thermal conductivity; none: 1 over a linear function.
    pub conductance: Option<RelativeCurve>,
    /// Of its heat capacity; none: linear.
    pub capacity: Option<RelativeCurve>,
    /// Of the thermal conductivity of the gas; none: constant.
    pub gas: Option<RelativeCurve>,
    /// Of its thermal expansion, with the ambient temperature (1/K, K); none: constant.
    pub expansion: Option<(PropertyCurve, f64)>,
}

/// A table that ends below or above the temperature of a beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TableEnd {
    /// The property, as netlists call it.
    pub property: &'static str,
    /// Lowest and highest temperature of the table (K).
    pub range: [f64; 2],
    /// The temperature that it does not cover (K).
    pub temperature: f64,
}

impl HeatCurves {
    /// True where no property has a curve.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Largest conductivity of the gas of a table, and of a polynomial up to a rise (K), over that at ambient temperature (1).
    pub(super) fn largest_gas(&self, rise: f64) -> f64 {
        self.gas.as_ref().map_or(1.0, |curve| curve.largest(rise))
    }

    /// The first table that does not cover one of these rises, and otherwise none. `near` widens the test: a fraction of the range (1).
    pub(super) fn end_of_table(&self, rises: [f64; 2], near: f64) -> Option<TableEnd> {
        let relative = |curve: &Option<RelativeCurve>| curve.as_ref().map(|c| (c.curve.range(), c.ambient));
        let expansion = self.expansion.as_ref().map(|(curve, ambient)| (curve.range(), *ambient));
        let all = [
            ("resistivity", relative(&self.resistance)),
            ("thermcond", relative(&self.conductance)),
            ("specificheat", relative(&self.capacity)),
            ("gasconductivity", relative(&self.gas)),
            ("thermalexpansion", expansion),
        ];
        all.into_iter().find_map(|(property, found)| {
            let (range, ambient) = found?;
            let range = range?;
            let margin = near * (range[1] - range[0]);
            let outside = |t: &f64| *t < range[0] + margin || *t > range[1] - margin;
            let temperature = rises.into_iter().map(|rise| ambient + rise).find(outside)?;
            Some(TableEnd { property, range, temperature })
        })
    }
}

/// Resistivity and heat capacity at a rise: 1 + coefficient·t, or by the curve (1, 1/K).
pub(super) fn linear_or(coefficient: f64, curve: Option<&RelativeCurve>, t: f64) -> [f64; 2] {
    curve.map_or([1.0 + coefficient * t, coefficient], |curve| curve.at(t))
}

/// Thermal conductivity at a rise: 1/(1 + coefficient·t), or by the curve (1, 1/K).
pub(super) fn reciprocal_or(coefficient: f64, curve: Option<&RelativeCurve>, t: f64) -> [f64; 2] {
    curve.map_or_else(
        || {
            let kappa = 1.0 / (1.0 + coefficient * t);
            [kappa, -coefficient * kappa * kappa]
        },
        |curve| curve.at(t),
    )
}
