//! Squeeze film: gas that flows out of a gap between two parallel rectangles as they approach.
//! ```text
//! F = c(g)·g′,     c = β(W/L)·μ_eff·L·W³/g³,     μ_eff = μ/Q,     Q = 1 + 9.638·(λ/g)^1.159
//! β(r) = 1 − (192/π⁵)·r·Σ_{n odd} tanh(nπ/(2r))/n⁵
//! ```
//! L ≥ W are the sides of the rectangle, g the thickness of the film, μ the viscosity and λ the mean free path of the gas. The gas does not
//! compress: the squeeze number σ = 12·μ·ω·W²/(p₀·g²) is small beside 1, and the pressure in the film beside the ambient p₀. Its edges are open.
//!
//! **Thickness at contact.** Parts that touch leave a film of the thickness g_c, between rough surfaces or beside bumps. With d the
//! distance of the parts and t that at which they touch
//! ```text
//! g = g_c + d − t  for d ≥ t,       g = g_c/(1 + s + s²),  s = (t − d)/g_c,  below
//! ```
//! with two continuous derivatives. A film that vanished at contact would never let the parts arrive.
//!
//! **A slit at one edge.** Under beams over a substrate the gas leaves one edge through a slit of the height z and the length b. With H the height of the beams and κ + 1
//! the ratio of the film with that edge closed, half of one of twice the height, to the open one,
//! ```text
//! F·(1 + κ·ρ/(1 + ρ)),     ρ = b/H·(g/z)³
//! ```
//! It is exact for a strip, where κ = 3 (Reynolds' equation with a flow resistance at one edge), and for edges that are open or closed.
//!
//! References: J. J. Blech, "On isothermal squeeze films", J. Lubr. Technol. 105 (1983) 615–620, at low frequency; T. Veijola, H. Kuisma,
//! J. Lahdenperä, T. Ryhänen, "Equivalent-circuit model of the squeezed gas film in a silicon accelerometer", Sens. Actuators A 48 (1995)
//! 239–248, for Q.

use super::contact::touching_distance;
use super::perforation::HolePlate;
use bimorph_structure::FacingGas;
use std::f64::consts::PI;

/// Thickness of the film between surfaces that touch, where the netlist gives a `touch` and no `filmgap` (m).
pub const ROUGHNESS: f64 = 20e-9;
/// ζ(5): the sum of all n⁻⁵ (1).
const ZETA_5: f64 = 1.036_927_755_143_37;

/// Factor of the flow by slip at the walls and its derivative with the thickness (1, 1/m): of a film of the thickness `g` (m) and a mean free path
/// (m).
#[inline]
pub fn slip(free_path: f64, g: f64) -> (f64, f64) {
    let added = 9.638 * (free_path / g).powf(1.159);
    (1.0 + added, -1.159 * added / g)
}

/// β of a rectangle whose short side is this fraction of the long one (1).
pub fn beta(ratio: f64) -> f64 {
    // far terms have a tanh of 1
    let near: f64 = (0..20)
        .map(|k| f64::from(2 * k + 1))
        .map(|n| (f64::tanh(0.5 * n * PI / ratio) - 1.0) / (n * n * n * n * n))
        .sum();
    1.0 - 192.0 / PI.powi(5) * ratio * (near + 31.0 / 32.0 * ZETA_5)
}

/// G of a rectangle that tilts about its middle, a the side across the axis and b along it, with ratio a/b: moment over the rate G·μ_eff·b·a⁵/(60·g³); 1 of a strip
/// along the axis.
pub fn tilt(ratio: f64) -> f64 {
    // Σ 1/(m²n²(m²/a² + n²/b²)) over even m and odd n, summed over n; far terms have a tanh of 1
    let near: f64 =
        (1..400).map(|k| f64::from(2 * k)).map(|m| (f64::tanh(0.5 * PI * m / ratio) - 1.0) / (m * m * m * m * m)).sum();
    60.0 * 192.0 / PI.powi(6) * (PI.powi(6) / 11_520.0 - 0.25 * PI * ratio * (near + ZETA_5 / 32.0))
}

/// The film of a gap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SqueezeFilm {
    /// β·μ·L·W³ (N·s·m²); with holes the viscosity μ (Pa·s).
    pub strength: f64,
    /// Holes through which gas leaves, too.
    pub holes: Option<HolePlate>,
    /// κ and ρ/g³ of a slit at one edge (1, 1/m³).
    pub slit: Option<[f64; 2]>,
    /// Mean free path λ (m).
    pub free_path: f64,
    /// Distance at which the parts touch t (m).
    pub touch: f64,
    /// Thickness there g_c (m).
    pub closed: f64,
}

impl SqueezeFilm {
    /// Of gas between parts drawn `gap` (m) apart that touch at the distance `touch` (m), where the netlist gives one.
    pub fn new(gas: &FacingGas, gap: f64, touch: Option<f64>) -> Self {
        let [short, long] = if gas.sides[0] < gas.sides[1] { gas.sides } else { [gas.sides[1], gas.sides[0]] };
        let contact = touch.unwrap_or(touching_distance(gap));
        let closed = gas.closed.unwrap_or(if touch.is_some() { ROUGHNESS } else { contact });
        let holes = gas.holes.as_ref().map(|holes| HolePlate::new(gas.sides, holes));
        let strength =
            if holes.is_some() { 1.0 } else { beta(short / long) * long * short.powi(3) } * gas.count * gas.viscosity;
        let slit = gas.slit.as_ref().map(|slit| {
            let open = |[a, b]: [f64; 2]| {
                let (short, long) = if a < b { (a, b) } else { (b, a) };
                beta(short / long) * long * short.powi(3)
            };
            let [length, height] = gas.sides;
            let excess = 0.5 * open([length, 2.0 * height]) / open([length, height]) - 1.0;
            [excess, slit.length / height / slit.height.powi(3)]
        });
        Self { strength, holes, slit, free_path: gas.free_path, touch: contact, closed }
    }

    /// The same of a fraction of the rectangle.
    #[must_use]
    #[inline]
    pub fn part(self, fraction: f64) -> Self {
        Self { strength: self.strength * fraction, ..self }
    }

    /// Thickness of the film at the distance `d` (m), and its first two derivatives (1, 1/m).
    #[inline]
    pub fn thickness(&self, d: f64) -> [f64; 3] {
        let x = d - self.touch;
        if x >= 0.0 {
            return [self.closed + x, 1.0, 0.0];
        }
        let s = -x / self.closed;
        let f = 1.0 / (1.0 + s + s * s);
        let rise = 1.0 + 2.0 * s;
        [self.closed * f, f * f * rise, (2.0 * f * rise * rise - 2.0) * f * f / self.closed]
    }

    /// Damping c at the distance `d` (m) (N·s/m), and its derivative (N·s/m²).
    #[inline]
    pub fn damping(&self, d: f64) -> (f64, f64) {
        let [g, slope, _] = self.thickness(d);
        let (q, q_slope) = slip(self.free_path, g);
        let c = self.strength / (q * g * g * g);
        let falls = 3.0 / g + q_slope / q;
        if let Some([excess, rise]) = self.slit {
            let rho = rise * g * g * g;
            let through = 1.0 + excess * rho / (1.0 + rho);
            let by_g = 3.0 * excess * rho / (g * (1.0 + rho) * (1.0 + rho));
            return (c * through, c * slope * (by_g - through * falls));
        }
        let Some(holes) = &self.holes else { return (c, -c * slope * falls) };
        let [through, by_g] = holes.strength(g);
        (c * through, c * slope * (by_g - through * falls))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn film(touch: Option<f64>, free_path: f64) -> SqueezeFilm {
        let gas = FacingGas {
            sides: [1e-3, 2e-3],
            count: 1.0,
            viscosity: 1.83e-5,
            pressure: 1e5,
            free_path,
            closed: None,
            states: 0,
            holes: None,
            slit: None,
        };
        SqueezeFilm::new(&gas, 5e-6, touch)
    }

    /// β(1), β(0.5), β(0.1) from an independent summation of the series (six digits), and 1 of a strip.
    #[test]
    fn shape_factors() {
        for (ratio, expected) in [(1.0, 0.421_731), (0.5, 0.686_045), (0.1, 0.936_975), (1e-9, 1.0)] {
            assert!((beta(ratio) - expected).abs() < 6e-7, "{ratio}: {}", beta(ratio));
        }
    }

    /// G(0.5) and G(2) of tilting rectangles from an independent Fourier series (eight decimals), and 1 of a strip.
    #[test]
    fn tilting() {
        for (ratio, expected) in [(0.5, 0.847_521_45), (2.0, 0.438_881_43), (1e-9, 1.0)] {
            assert!((tilt(ratio) - expected).abs() < 2e-8, "{ratio}: {}", tilt(ratio));
        }
    }

    /// μ_eff/μ at Kn = 0.1 and 10 from the formula in the head of the file, computed independently (eight decimals).
    #[test]
    fn rarefied_gas() {
        for (kn, expected) in [(0.1, 0.599_404_03), (10.0, 0.007_143_31)] {
            assert!((1.0 / slip(kn, 1.0).0 - expected).abs() < 6e-9);
        }
    }

    /// Far from contact the film is as thick as the gap, where the netlist gives no `touch`; with one it is the distance beyond it and the roughness.
    /// Pressed parts keep most of the thickness at contact. Without slip c is β·μ·L·W³/g³.
    #[test]
    fn thickness() {
        let free = film(None, 0.0);
        assert!((free.thickness(5e-6)[0] / 5e-6 - 1.0).abs() < 1e-14);
        let c = 0.686_045 * 1.83e-5 * 2e-3 * 1e-9 / 125e-18;
        assert!((free.damping(5e-6).0 / c - 1.0).abs() < 1e-6);
        let insulated = film(Some(0.3e-6), 0.0);
        assert!((insulated.thickness(1.3e-6)[0] - 1.02e-6).abs() < 1e-18);
        assert!((insulated.thickness(0.3e-6)[0] / 20e-9 - 1.0).abs() < 1e-9);
        assert!(insulated.thickness(0.295e-6)[0] > 15e-9 && insulated.thickness(0.0)[0] > 0.0);
    }

    /// Derivatives of thickness and damping against central differences, over distances from beyond contact to the gap as drawn, with slip: 1e-7.
    #[test]
    fn derivatives() {
        for touch in [None, Some(0.3e-6)] {
            let film = film(touch, 68e-9);
            for k in 1..400 {
                let d = 0.25e-6 + 1e-9 * f64::from(k) * (1.0 + 0.02 * f64::from(k));
                let step = 2e-12;
                let differences = |of: &dyn Fn(f64) -> f64| {
                    let one = |h: f64| (of(d + h) - of(d - h)) / (2.0 * h);
                    (4.0 * one(step) - one(2.0 * step)) / 3.0
                };
                let (c, slope) = film.damping(d);
                let numeric = differences(&|d| film.damping(d).0);
                assert!(
                    (numeric - slope).abs() <= 1e-7 * (slope.abs() + c / film.closed),
                    "{d:e}: {numeric:e} {slope:e}"
                );
                let [_, first, second] = film.thickness(d);
                assert!((differences(&|d| film.thickness(d)[0]) - first).abs() < 1e-7, "{d:e}");
                let numeric = differences(&|d| film.thickness(d)[1]);
                assert!(
                    (numeric - second).abs() <= 1e-7 * (second.abs() + 1.0 / film.closed),
                    "{d:e}: {numeric:e} {second:e}"
                );
            }
        }
    }

    /// A slit at one edge of a strip: Reynolds' equation with a flow resistance there, whose mean pressure is that of the closed form; no slit far above the film's own
    /// resistance, and four times the film far below. Of a square the closed edge makes
    /// β(0.5)/β(1) = 1.627 times the film. Derivatives are those of differences.
    #[test]
    fn a_slit() {
        let with = |sides: [f64; 2], height: f64| {
            let slit = Some(bimorph_structure::FilmSlit { height, length: 4e-6 });
            let gas = FacingGas {
                sides,
                count: 1.0,
                viscosity: 1.83e-5,
                pressure: 1e5,
                free_path: 0.0,
                closed: None,
                states: 0,
                holes: None,
                slit,
            };
            SqueezeFilm::new(&gas, 5e-6, Some(0.1e-6))
        };
        let strip = [1.0, 40e-6];
        let open = with(strip, 1.0).damping(5e-6).0;
        assert!((with(strip, 1e-9).damping(5e-6).0 / open / 4.0 - 1.0).abs() < 1e-4);
        let [g, _, _] = with(strip, 2e-6).thickness(5e-6);
        let rho = 4.0 / 40.0 * (g / 2e-6).powi(3);
        // p = S·(−z²/2 + A·z + ρ·H·A) with A = H/(2·(1 + ρ)): the mean over the height against H²/12
        let a = 0.5 / (1.0 + rho);
        let mean = -1.0 / 6.0 + 0.5 * a + rho * a;
        assert!((with(strip, 2e-6).damping(5e-6).0 / open / (12.0 * mean) - 1.0).abs() < 1e-4);
        let square = [40e-6, 40e-6];
        let closed = with(square, 1e-9).damping(5e-6).0 / with(square, 1.0).damping(5e-6).0;
        assert!((closed / (0.686_045 / 0.421_731) - 1.0).abs() < 2e-6, "{closed}");
        for d in [0.05e-6, 0.5e-6, 3e-6] {
            let h = 1e-5 * d;
            let film = with(square, 2e-6);
            let slope = (film.damping(d + h).0 - film.damping(d - h).0) / (2.0 * h);
            assert!((film.damping(d).1 / slope - 1.0).abs() < 1e-7, "{d}");
        }
    }
}
