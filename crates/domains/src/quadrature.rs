//! Points and weights of the integrals along a stretch of facing beams, with the cubic (Hermite) shape functions there.

/// One point of a rule on 0…1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Abscissa {
    /// Place along the stretch (1).
    pub at: f64,
    /// Weight; the weights of a rule add up to 1.
    pub weight: f64,
    /// Hermite's cubics there: of the displacement at the start, its slope times the length, and the same at the end.
    pub shape: [f64; 4],
}

/// Hermite's cubics at the fraction `s` of a stretch, for (w₁, ℓ·φ₁, w₂, ℓ·φ₂).
pub const fn hermite(s: f64) -> [f64; 4] {
    [1.0 - 3.0 * s * s + 2.0 * s * s * s, s - 2.0 * s * s + s * s * s, 3.0 * s * s - 2.0 * s * s * s, s * s * s - s * s]
}

/// Derivatives of [`hermite`] with `s`.
pub const fn hermite_slope(s: f64) -> [f64; 4] {
    [6.0 * s * s - 6.0 * s, 1.0 - 4.0 * s + 3.0 * s * s, 6.0 * s - 6.0 * s * s, 3.0 * s * s - 2.0 * s]
}

const fn node(at: f64, weight: f64) -> Abscissa {
    Abscissa { at, weight, shape: hermite(at) }
}

/// Gauss–Legendre with six points: exact to degree 11.
pub const GAUSS_6: [Abscissa; 6] = [
    node(0.033_765_242_898_423_99, 0.085_662_246_189_585_17),
    node(0.169_395_306_766_867_74, 0.180_380_786_524_069_3),
    node(0.380_690_406_958_401_55, 0.233_956_967_286_345_52),
    node(0.619_309_593_041_598_4, 0.233_956_967_286_345_52),
    node(0.830_604_693_233_132_3, 0.180_380_786_524_069_3),
    node(0.966_234_757_101_576, 0.085_662_246_189_585_17),
];

/// Gauss–Legendre with three points: exact to degree 5.
pub const GAUSS_3: [Abscissa; 3] = [
    node(0.112_701_665_379_258_31, 0.277_777_777_777_777_8),
    node(0.5, 0.444_444_444_444_444_4),
    node(0.887_298_334_620_741_7, 0.277_777_777_777_777_8),
];

/// Gauss–Lobatto with nine points: exact to degree 15; the ends and the middle are among them.
pub const LOBATTO_9: [Abscissa; 9] = [
    node(0.0, 0.013_888_888_888_888_89),
    node(0.050_121_002_294_270_02, 0.082_747_680_780_404_59),
    node(0.161_406_860_244_631_2, 0.137_269_356_250_081_2),
    node(0.318_441_268_086_910_9, 0.173_214_255_486_522_97),
    node(0.5, 0.185_759_637_188_208_62),
    node(0.681_558_731_913_089_1, 0.173_214_255_486_522_97),
    node(0.838_593_139_755_368_8, 0.137_269_356_250_081_2),
    node(0.949_878_997_705_73, 0.082_747_680_780_404_59),
    node(1.0, 0.013_888_888_888_888_89),
];

/// Gauss–Lobatto with five points: exact to degree 7; the ends and the middle are among them.
pub const LOBATTO_5: [Abscissa; 5] = [
    node(0.0, 0.05),
    node(0.172_673_164_646_011_43, 0.272_222_222_222_222_2),
    node(0.5, 0.355_555_555_555_555_55),
    node(0.827_326_835_353_988_6, 0.272_222_222_222_222_2),
    node(1.0, 0.05),
];

#[cfg(test)]
mod tests {
    use super::*;

    /// Each rule integrates s^k exactly, ∫ s^k ds = 1/(k + 1), up to its degree, and no further.
    #[test]
    fn rules_are_exact_to_their_degree() {
        let rules: [(&[Abscissa], i32); 4] = [(&GAUSS_6, 11), (&GAUSS_3, 5), (&LOBATTO_9, 15), (&LOBATTO_5, 7)];
        for (rule, degree) in rules {
            let off = |k: i32| {
                let sum: f64 = rule.iter().map(|node| node.weight * node.at.powi(k)).sum();
                (sum * f64::from(k + 1) - 1.0).abs()
            };
            assert!((0..=degree).all(|k| off(k) < 2e-14), "{degree}");
            assert!(off(degree + 1) > 1e-9, "{degree}: {}", off(degree + 1));
        }
    }

    /// The slopes are the derivatives of the cubics: central differences of 1e-6.
    #[test]
    fn slopes_are_derivatives() {
        for s in [0.0, 0.3, 0.9] {
            let (lo, hi, slope) = (hermite(s - 1e-6), hermite(s + 1e-6), hermite_slope(s));
            for ((lo, hi), slope) in lo.iter().zip(hi).zip(slope) {
                assert!(((hi - lo) / 2e-6 - slope).abs() < 1e-9, "{s}: {slope}");
            }
        }
    }
}
