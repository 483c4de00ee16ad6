//! Squeeze film under a plate with holes: the gas also flows out through them.
//! ```text
//! ∇²p − p/l² = 12·μ_eff·g′/g³,     l² = 2·g³·H_eff·η/(3·β²·r₀²),     η = 1 + 3·r₀⁴·K/(16·H·g³)
//! β = r₀/r_c,   r_c = pitch/√π,   K = 4β² − β⁴ − 4·ln β − 3,   H_eff = H + 3π·r₀/8
//! ```
//! r₀ is the radius of a hole, H the depth of the plate along them, and r_c that of a round cell of the area of a square one. With open edges the damping of a rectangle a ≤ b is
//! that of a strip less the part of its ends, whose series converges as n⁻⁵:
//! ```text
//! c = 12·μ_eff/g³·a·b·[l²·(1 − tanh(y)/y) − Σ_{n odd} 8/(π²n²)·tanh(x)/(x·κ²)],     y = a/(2l),   κ² = (nπ/a)² + 1/l²,   x = κ·b/2
//! ```
//! Reference: M. Bao, H. Yang, "Squeeze film air damping in MEMS", Sens. Actuators A 136 (2007) 3–27, section 4.

use bimorph_structure::Perforation;
use std::f64::consts::PI;

/// Terms of the series: the rest is below 1e-8 of the damping.
const TERMS: usize = 40;
/// y² below which the strip is summed as a series (1).
const THIN: f64 = 1e-3;

/// Constants of a plate with holes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HolePlate {
    /// Sides of the rectangle, the shorter one first (m).
    sides: [f64; 2],
    /// 1/l² times g³ + `bore` (m).
    leak: f64,
    /// g³ at which holes and their cells resist alike, 3·r₀⁴·K/(16·H) (m³).
    bore: f64,
}

impl HolePlate {
    /// Of a rectangle (m) with holes.
    pub fn new([a, b]: [f64; 2], holes: &Perforation) -> Self {
        let (r0, depth) = (holes.radius, holes.depth);
        let beta = r0 * PI.sqrt() / holes.pitch;
        let square = beta * beta;
        let k = 4.0 * square - square * square - 4.0 * beta.ln() - 3.0;
        let leak = 1.5 * square * r0 * r0 / (depth + 0.375 * PI * r0);
        Self { sides: [a.min(b), a.max(b)], leak, bore: 3.0 * r0.powi(4) * k / (16.0 * depth) }
    }

    /// 1/l² in a film of the thickness `g` (m) (1/m²), and its derivative.
    fn leak(&self, g: f64) -> [f64; 2] {
        let square = self.leak / (g * g * g + self.bore);
        [square, -3.0 * g * g * square / (g * g * g + self.bore)]
    }

    /// Damping times g³/μ_eff (m⁴), and its derivative with the thickness `g` (m).
    pub fn strength(&self, g: f64) -> [f64; 2] {
        let [a, b] = self.sides;
        let [leak, leak_slope] = self.leak(g);
        let [strip, strip_slope] = strip(0.25 * a * a * leak).map(|x| 0.25 * a * a * x);
        let (mut sum, mut slope) = (strip, 0.25 * a * a * strip_slope);
        for n in (0..TERMS).map(|k| (2 * k + 1) as f64) {
            let square = (n * PI / a).powi(2) + leak;
            let x = 0.5 * b * square.sqrt();
            let (tanh, weight) = (x.tanh(), 8.0 / (PI * PI * n * n));
            sum -= weight * tanh / (x * square);
            slope += weight * (1.5 * tanh / x - 0.5 * (1.0 - tanh * tanh)) / (square * square);
        }
        let scale = 12.0 * a * b;
        [scale * sum, scale * slope * leak_slope]
    }
}

/// F(z) = (1 − tanh(y)/y)/z with z = y², and its derivative.
fn strip(z: f64) -> [f64; 2] {
    if z < THIN {
        let value = 1.0 / 3.0 + z * (-2.0 / 15.0 + z * (17.0 / 315.0 - z * 62.0 / 2835.0));
        return [value, -2.0 / 15.0 + z * (34.0 / 315.0 - z * 62.0 / 945.0)];
    }
    let y = z.sqrt();
    let tanh = y.tanh();
    let share = tanh / y;
    [(1.0 - share) / z, (0.5 * (share - 1.0 + tanh * tanh) - (1.0 - share)) / (z * z)]
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOLES: Perforation = Perforation { radius: 2e-6, pitch: 10e-6, depth: 2e-6 };

    /// Length l and damping per area of a strip of 100 µm at 1.83e-5 Pa·s, from an independent computation of the formulas in the head of the file: 7.7711985 µm and
    /// 1400.095 Pa·s/m. Without holes it has 22875 Pa·s/m.
    #[test]
    fn strip() {
        let strip = HolePlate::new([100e-6, 100.0], &HOLES);
        let g: f64 = 2e-6;
        assert!((strip.leak(g)[0].powf(-0.5) / 7.771_198_5e-6 - 1.0).abs() < 1e-8);
        let per_area = |plate: &HolePlate| plate.strength(g)[0] * 1.83e-5 / (g * g * g) / (100e-6 * 100.0);
        assert!((per_area(&strip) / 1400.095 - 1.0).abs() < 2e-6, "{}", per_area(&strip));
        let closed = HolePlate { leak: 0.0, ..strip };
        assert!((per_area(&closed) / 22_875.0 - 1.0).abs() < 2e-6, "{}", per_area(&closed));
    }

    /// Without holes it is the film of a rectangle, β(0.5) = 0.686045; the derivative is that of central differences (1e-7).
    #[test]
    fn limits_and_derivatives() {
        let plate = HolePlate::new([200e-6, 100e-6], &HOLES);
        let closed = HolePlate { leak: 0.0, ..plate };
        assert!((closed.strength(2e-6)[0] / (0.686_045 * 200e-6 * 1e-12) - 1.0).abs() < 2e-6);
        for g in [0.3e-6, 1e-6, 4e-6] {
            let one = |h: f64| (plate.strength(g + h)[0] - plate.strength(g - h)[0]) / (2.0 * h);
            let numeric = (4.0 * one(1e-4 * g) - one(2e-4 * g)) / 3.0;
            assert!((numeric / plate.strength(g)[1] - 1.0).abs() < 1e-7, "{g:e}");
        }
    }

    /// The series of a thin film joins its closed form (1e-8), and its derivative is that of central differences, which are right to 3e-6.
    #[test]
    fn the_series_joins_the_closed_form() {
        let [below, above] = [THIN * (1.0 - 1e-12), THIN].map(super::strip);
        assert!(
            (below[0] / above[0] - 1.0).abs() < 1e-8 && (below[1] / above[1] - 1.0).abs() < 1e-8,
            "{below:?} {above:?}"
        );
        for z in [0.2 * THIN, 0.9 * THIN, 5.0 * THIN, 30.0] {
            let e = 1e-3 * z;
            let numeric = (super::strip(z + e)[0] - super::strip(z - e)[0]) / (2.0 * e);
            assert!((numeric / super::strip(z)[1] - 1.0).abs() < 3e-6, "{z}");
        }
    }
}
