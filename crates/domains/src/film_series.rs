//! Squeeze film of a gas that compresses: the series of a rectangle with open edges as first-order states.
//!
//! Reynolds' equation for a small pressure has the modes sin(mπx/a)·sin(nπy/b), of which a plate that stays parallel excites those of odd m and n.
//! Each stores ½·K·w² and flows out at the rate r(g), with a state ζ that is an approach (m), as the approach u of the plates:
//! ```text
//! w = √g(u) − √g(ζ)          F = K·w·∂w/∂u            K = a·b·p₀·A²,   A = 16/(π²·m·n)
//! K·(∂w/∂ζ)²/r·ζ′ = −K·w·∂w/∂ζ        r = p₀·g(u)²·Q/(12·μ)·π²·(m²/a² + n²/b²)
//! ```
//! A state at rest has ζ = u and no force. About it the force over the rate of u is Z(s) = Σ K/(4g)/(r + s), Blech's series. The work of F is what is stored and
//! what the flow dissipates for every motion, since g enters the stored energy and the flow alone. With χ = w·√(p₀·4/(a·b)·K) this is the form
//! χ′ = −r·χ − p₀·A·g′/√g of each term.
//!
//! **Tail.** All terms that have no state of their own share one, with their Σ K/r and Σ K/r². The damping at low frequency is that of the whole
//! series, and so is the first term of its fall with frequency.
//!
//! Reference: J. J. Blech, "On isothermal squeeze films", J. Lubr. Technol. 105 (1983) 615–620.

use super::squeeze_film::beta;
use bimorph_structure::FacingGas;
use std::f64::consts::PI;

/// Terms along each side among which states are chosen, and that Σ K/r² has.
const TERMS: usize = 60;

/// A term of the series.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FilmTerm {
    /// K (N).
    pub strength: f64,
    /// r over g²·Q (1/(s·m²)).
    pub rate: f64,
}

/// `count` terms of the film of a gas, the last of which is the tail; none for 0.
pub fn series(gas: &FacingGas, count: usize) -> Vec<FilmTerm> {
    if count == 0 {
        return Vec::new();
    }
    let [a, b] = gas.sides;
    let odd = |k: usize| (2 * k + 1) as f64;
    let term = |(m, n): (f64, f64)| {
        let amplitude = 16.0 / (PI * PI * m * n);
        let rate = gas.pressure / (12.0 * gas.viscosity) * PI * PI * ((m / a).powi(2) + (n / b).powi(2));
        FilmTerm { strength: gas.count * a * b * gas.pressure * amplitude * amplitude, rate }
    };
    let mut terms: Vec<FilmTerm> =
        (0..TERMS).flat_map(|i| (0..TERMS).map(move |j| (odd(i), odd(j)))).map(term).collect();
    terms.sort_by(|one, other| (other.strength / other.rate).total_cmp(&(one.strength / one.rate)));
    let (short, long) = (a.min(b), a.max(b));
    // K/(4g)/(g²·Q·rate) of all terms is the damping without compression
    let mut first = 4.0 * gas.count * beta(short / long) * gas.viscosity * long * short.powi(3);
    let mut second: f64 = terms.iter().map(|t| t.strength / (t.rate * t.rate)).sum();
    terms.truncate(count - 1);
    for term in &terms {
        first -= term.strength / term.rate;
        second -= term.strength / (term.rate * term.rate);
    }
    terms.push(FilmTerm { strength: first * first / second, rate: first / second });
    terms
}

/// √g as a function of an approach, with two derivatives, of the thickness g at the distance d with its derivatives (d falls as the approach grows).
#[inline]
pub(super) fn root([g, slope, curvature]: [f64; 3]) -> [f64; 3] {
    let root = g.sqrt();
    [root, -0.5 * slope / root, 0.5 * curvature / root - 0.25 * slope * slope / (g * root)]
}

impl FilmTerm {
    /// Force along u and along ζ, of the roots at both (N).
    #[inline]
    pub(super) fn force(&self, u: &[f64; 3], zeta: &[f64; 3]) -> [f64; 2] {
        let stress = self.strength * (u[0] - zeta[0]);
        [stress * u[1], -stress * zeta[1]]
    }

    /// Its derivatives: along u with u, along one with the other, along ζ with ζ (N/m).
    #[inline]
    pub(super) fn stiffness(&self, u: &[f64; 3], zeta: &[f64; 3]) -> [f64; 3] {
        let (k, w) = (self.strength, u[0] - zeta[0]);
        [k * (u[1] * u[1] + w * u[2]), -k * u[1] * zeta[1], k * (zeta[1] * zeta[1] - w * zeta[2])]
    }

    /// Stored energy (J).
    #[inline]
    pub(super) fn energy(&self, u: &[f64; 3], zeta: &[f64; 3]) -> f64 {
        0.5 * self.strength * (u[0] - zeta[0]) * (u[0] - zeta[0])
    }

    /// Damping of ζ with the flow g²·Q at u (N·s/m), and its derivative with ζ.
    #[inline]
    pub(super) fn damping(&self, flow: f64, zeta: &[f64; 3]) -> [f64; 2] {
        let per = self.strength / (self.rate * flow);
        [per * zeta[1] * zeta[1], 2.0 * per * zeta[1] * zeta[2]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Complex;

    /// ANSYS' verification manual VM245: plate 1 mm × 2 mm, gap 5 µm, 100 kHz, 1e5 Pa, 1.83e-5 Pa·s. Damping and stiffness from an independent sum of the
    /// series: four states to 3e-3, 41 to 1.1e-6.
    #[test]
    fn vm245() {
        let gas = FacingGas {
            sides: [1e-3, 2e-3],
            count: 1.0,
            viscosity: 1.83e-5,
            pressure: 1e5,
            free_path: 0.0,
            closed: None,
            states: 0,
            holes: None,
            slit: None,
        };
        let (g, omega) = (5e-6, 2.0 * PI * 1e5);
        for (count, within) in [(4, 3e-3), (41, 1.1e-6)] {
            let z: Complex<f64> =
                series(&gas, count).iter().map(|t| t.strength / (4.0 * g) / Complex::new(t.rate * g * g, omega)).sum();
            assert!((z.re / 0.015_298_384_33 - 1.0).abs() < within, "{count}: {}", z.re);
            assert!((-z.im * omega / 28_651.307_73 - 1.0).abs() < within, "{count}: {}", -z.im * omega);
        }
    }

    /// Force and stiffness are derivatives of the energy: central differences to 1e-7.
    #[test]
    fn derivatives() {
        let term = FilmTerm { strength: 0.3, rate: 1e17 };
        let film = |x: f64| root([3e-6 - x, 1.0, 0.0]);
        let (u, zeta, h) = (0.4e-6, 0.7e-6, 1e-9);
        let difference = |of: &dyn Fn(f64) -> f64| {
            let one = |h: f64| (of(h) - of(-h)) / (2.0 * h);
            (4.0 * one(h) - one(2.0 * h)) / 3.0
        };
        let energy = |du: f64, dz: f64| term.energy(&film(u + du), &film(zeta + dz));
        let force = |du: f64, dz: f64| term.force(&film(u + du), &film(zeta + dz));
        let ([along_u, along_zeta], stiffness) = (force(0.0, 0.0), term.stiffness(&film(u), &film(zeta)));
        let near = |numeric: f64, own: f64| assert!((numeric / own - 1.0).abs() < 1e-7, "{numeric:e} {own:e}");
        near(difference(&|h| energy(h, 0.0)), along_u);
        near(difference(&|h| energy(0.0, h)), along_zeta);
        near(difference(&|h| force(h, 0.0)[0]), stiffness[0]);
        near(difference(&|h| force(0.0, h)[0]), stiffness[1]);
        near(difference(&|h| force(h, 0.0)[1]), stiffness[1]);
        near(difference(&|h| force(0.0, h)[1]), stiffness[2]);
        let damping = |h: f64| term.damping(2e-12, &film(zeta + h));
        near(difference(&|h| damping(h)[0]), damping(0.0)[1]);
    }
}
