//! Loss of contact: the pressure grows with the closing speed, so that a rebound is slower than the impact.
//! ```text
//! p = p_e·max(0, 1 + χ·s′),     χ = α(e)/v_ref,     α − ln(1 + α) = −α·e − ln(1 − α·e)
//! ```
//! with p_e the pressure of the elastic law, s′ the speed at which the surfaces close and e the restitution of an impact at the reference
//! speed v_ref. The equation of α is exact for every elastic law: over an impact m·v·dv = −p_e·(1 + χ·v)·ds, and what the elastic
//! law stores until rest it has released at the rebound. Restitution rises to 1 at slow impacts and falls at fast ones. A free
//! rebound needs no tension; max(0, ·) acts where a part is torn off.
//!
//! v_ref is a constant of the element, given or found from statics ([`super::contact_speed`]): a law that knew the last impact would
//! hide a state.
//!
//! Reference: K. H. Hunt, F. R. E. Crossley, "Coefficient of restitution interpreted as damping in vibroimpact", J. Appl. Mech. 42
//! (1975) 440–445.

use bimorph_structure::Impact;

/// Restitution unless a netlist gives one (1).
pub const RESTITUTION: f64 = 0.5;

/// Loss of one contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Loss {
    /// Restitution e at the reference speed (1); 1: elastic.
    pub restitution: f64,
    /// Reference speed v_ref (m/s); none: not known yet.
    pub speed: Option<f64>,
    /// χ (s/m).
    chi: f64,
}

impl Loss {
    /// Of an impact, as far as a netlist says it.
    #[inline]
    pub fn new(impact: &Impact) -> Self {
        let loss = Self { restitution: impact.restitution.unwrap_or(RESTITUTION), speed: None, chi: 0.0 };
        impact.speed.map_or(loss, |speed| loss.at(speed))
    }

    /// The same with a reference speed (m/s).
    #[must_use]
    #[inline]
    pub fn at(self, speed: f64) -> Self {
        Self { speed: Some(speed), chi: alpha(self.restitution) / speed, ..self }
    }

    /// True where contact takes energy out of a motion.
    #[inline]
    pub fn is_dissipative(&self) -> bool {
        self.chi > 0.0
    }

    /// χ (s/m); 0: elastic.
    #[inline]
    pub fn coefficient(&self) -> f64 {
        self.chi
    }

    /// Damping force at the closing speed (m/s) as a fraction of the elastic force, and its derivative with the speed
    /// (s/m).
    #[inline]
    pub fn fraction(&self, closing: f64) -> (f64, f64) {
        let added = self.chi * closing;
        if added > -1.0 { (added, self.chi) } else { (-1.0, 0.0) }
    }
}

/// ω₀⁻¹ times the speed with which a plate arrives at its pull-in voltage (m), see [`super::contact_speed`]: from the gap `g` to where it touches, `t` (m).
pub(super) fn fall_at_pull_in(g: f64, t: f64) -> f64 {
    g * (8.0 / 27.0 * (g / t - 1.0) - (1.0 - t / g) * (1.0 - t / g)).max(0.0).sqrt()
}

/// The same of fingers that snap to the side in gaps of the width `g` (m), from their middle over the distance `room` (m).
///
/// At pull-in the stiffness across is that of the field at rest, k = N·ε·h·o·V²/g³. The field gives ½k·y²·g²/(g² − y²), the springs take ½k·y².
pub(super) fn snap_aside(g: f64, room: f64) -> f64 {
    room * room / (g * g - room * room).sqrt()
}

/// α of a restitution above 0 and at most 1.
pub fn alpha(restitution: f64) -> f64 {
    let e = restitution;
    if e >= 1.0 - 1e-6 {
        return 1.5 * (1.0 - e).max(0.0);
    }
    // positive between 0 and the root, negative from there to 1/e
    let rest = |a: f64| a - a.ln_1p() + a * e + (-a * e).ln_1p();
    let (mut low, mut high) = (0.0, 1.0 / e);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if rest(middle) > 0.0 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// α of six restitutions, from an independent computation of the equation in the head of the file (four decimals).
    #[test]
    fn alphas() {
        for (e, expected) in [(0.9, 0.1665), (0.8, 0.3731), (0.7, 0.6348), (0.5, 1.4328), (0.3, 3.0871), (0.2, 4.9192)]
        {
            assert!((alpha(e) - expected).abs() < 6e-5, "{e}: {}", alpha(e));
        }
        assert_eq!(alpha(1.0), 0.0);
        assert!((alpha(1.0 - 1e-6) / 1.5e-6 - 1.0).abs() < 1e-5 && (alpha(1.0 - 1.1e-6) / 1.65e-6 - 1.0).abs() < 1e-4);
    }

    /// A mass that meets a wall at v_ref leaves it at e·v_ref, whatever the elastic law: powers 1.5 and 4, integrated by Runge and Kutta's
    /// rule in 20,000 steps.
    #[test]
    fn restitution_at_the_reference_speed() {
        for (power, e) in [(1.5, 0.9), (1.5, 0.5), (4.0, 0.5), (4.0, 0.2)] {
            let loss = Loss::new(&Impact { restitution: Some(e), speed: Some(2.0) });
            let rate = |(x, v): (f64, f64)| {
                let elastic = if x > 0.0 { 1e3 * x.powf(power) } else { 0.0 };
                (v, -elastic * (1.0 + loss.fraction(v).0))
            };
            let (mut now, h) = ((0.0, 2.0), 1e-4);
            while now.0 > 0.0 || now.1 > 0.0 {
                let add = |a: (f64, f64), b: (f64, f64), f: f64| (a.0 + f * b.0, a.1 + f * b.1);
                let k1 = rate(now);
                let k2 = rate(add(now, k1, 0.5 * h));
                let k3 = rate(add(now, k2, 0.5 * h));
                let k4 = rate(add(now, k3, h));
                now = add(add(add(add(now, k1, h / 6.0), k2, h / 3.0), k3, h / 3.0), k4, h / 6.0);
            }
            assert!((-now.1 / 2.0 - e).abs() < 1e-4, "{power} {e}: {}", now.1);
        }
    }
}
