//! The field of comb fingers in their plane: engagement, finger ends and the gaps between, beside the field above and below the section.
//!
//! With finger width w, gap g, height h, overlap o and finger length L, one gap between two fingers has
//! ```text
//! C/ε = e(w/g)·o + h·(Λ(o/g) + 2Δ(L − o))      e(ρ) = ((ρ + 2)·ln(ρ + 2) − ρ·ln ρ)/π
//! ```
//! e is the field above and below tall fingers (exact by conformal mapping; within 1e-3 down to h = g/2), so that the thrust of an engaged comb is N·ε·h/g times
//! κ = 1 + e·g/h. Λ is the field in the plane without tips: Λ → o/g + 2e(w/2g) while engaged, where 2e(w/2g) is the exact charge of both ends. Its slope, the
//! thrust while fingers meet, is within 2.5 % of boundary elements for o/g above −4 and w/g of 1 to 4, and within 6 % at −6:
//! ```text
//! Λ(z) = p + c·G(n/b)      p = ln(1 + exp(λz))/λ      n = p − z      G(y) = 1/(1 + y) + k·y/(1 + y)²      c = 2e(w/2g)      b = b₁·c^b₂
//! ```
//! Δ is the field between finger tips and the base of the other side, at the distance d = L − o: with H = w/2 + g, s = w/2H and q = exp(−πd/H)
//! ```text
//! Δ = π·s·q/(1 − q) − β·ln(1 − q)      β = (2/π)·(1 − 1.307·s^2.385)
//! ```
//! For w/g of 0.25 to 5 and d/g of 0.15 to 6 the thrust is within 2.2 %. Below d = g/10 the field continues along its tangent.

use std::f64::consts::PI;

/// λ, b₁, b₂ and k of the engagement.
const ENGAGEMENT: [f64; 4] = [1.781_628, 1.457_107, 1.137_372, -0.662_631];
/// Distance from a finger tip to the base below which the field continues along its tangent, over the gap (1).
const CLOSEST: f64 = 0.1;

/// e(ρ): the field above and below a gap between tall fingers of width ρ·g, both sides (1).
pub fn above_and_below(rho: f64) -> f64 {
    ((rho + 2.0) * (rho + 2.0).ln() - rho * rho.ln()) / PI
}

/// The field of all gaps of a comb in its plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CombField {
    /// N·ε·h (F).
    pub strength: f64,
    /// Gap g (m).
    pub gap: f64,
    /// Length of the fingers L (m).
    pub length: f64,
    /// Charge of both ends c (1).
    pub ends: f64,
    /// Length over which it fades, b (1).
    pub fade: f64,
    /// π/H of the tips (1/m).
    pub decay: f64,
    /// π·s and β (1).
    pub tips: [f64; 2],
}

impl CombField {
    /// λ of the engagement (1).
    pub const STEEPNESS: f64 = ENGAGEMENT[0];
    /// k of the engagement (1).
    pub const SHAPE: f64 = ENGAGEMENT[3];
    /// b₁ and b₂ of the engagement, with b = b₁·c^b₂ (1).
    pub const FADING: [f64; 2] = [ENGAGEMENT[1], ENGAGEMENT[2]];

    /// Of fingers `width` wide and `length` long with gaps `gap` between them (m); `strength` is N·ε·h (F).
    pub fn new(strength: f64, [gap, width, length]: [f64; 3]) -> Self {
        let ends = 2.0 * above_and_below(0.5 * width / gap);
        let half_pitch = 0.5 * width + gap;
        let s = 0.5 * width / half_pitch;
        let tips = [PI * s, 2.0 / PI * (1.0 - 1.307 * s.powf(2.385))];
        let [fade, ..] = Self::fading(ends);
        Self { strength, gap, length, ends, fade, decay: PI / half_pitch, tips }
    }

    /// Least distance from the tips to the base for which the law holds (m).
    pub fn closest(&self) -> f64 {
        CLOSEST * self.gap
    }

    /// Capacitance (F) and its first two derivatives with the overlap `o` (m).
    pub fn at(&self, o: f64) -> [f64; 3] {
        let (engaged, tips) = (self.engaged(o / self.gap), self.tips(self.length - o));
        let scales = [1.0, 1.0 / self.gap, 1.0 / (self.gap * self.gap)];
        std::array::from_fn(|k| self.strength * (scales[k] * engaged[k] + 2.0 * tips[k]))
    }

    /// Λ, Λ′ and Λ″ at z.
    fn engaged(&self, z: f64) -> [f64; 3] {
        let (b, c) = (self.fade, self.ends);
        let [n, opening, bend] = Self::apart(z);
        let (open, g) = (-opening, Self::fringe(n / b));
        let first = 1.0 - open - c * g[1] * open / b;
        let second = bend * (1.0 + c * g[1] / b) + c * g[2] * open * open / (b * b);
        [n + z + c * g[0], first, second]
    }

    /// n and its derivatives with z.
    pub(super) fn apart(z: f64) -> [f64; 3] {
        let [lambda, ..] = ENGAGEMENT;
        let small = (-lambda * z.abs()).exp();
        let n = small.ln_1p() / lambda + (-z).max(0.0);
        // 1 − dp/dz, and dp/dz times that
        let open = if z > 0.0 { small } else { 1.0 } / (1.0 + small);
        let both = small / ((1.0 + small) * (1.0 + small));
        [n, -open, lambda * both]
    }

    /// G and its derivatives.
    pub(super) fn fringe(y: f64) -> [f64; 3] {
        let [.., k] = ENGAGEMENT;
        let r = 1.0 / (1.0 + y);
        [r + k * y * r * r, r * r * (k * (1.0 - y) * r - 1.0), r * r * r * (2.0 + k * (2.0 * y - 4.0) * r)]
    }

    /// b and its derivatives with c.
    pub(super) fn fading(c: f64) -> [f64; 3] {
        let [_, scale, power, _] = ENGAGEMENT;
        let b = scale * c.powf(power);
        [b, power * b / c, power * (power - 1.0) * b / (c * c)]
    }

    /// Δ at the overlap `o` (m), and its derivatives with that.
    pub(super) fn at_tips(&self, o: f64) -> [f64; 3] {
        self.tips(self.length - o)
    }

    /// Δ and its derivatives with the overlap at the distance `d` (m) of the tips.
    fn tips(&self, d: f64) -> [f64; 3] {
        let (at, a, [facing, beside]) = (d.max(self.closest()), self.decay, self.tips);
        let q = (-a * at).exp();
        let rest = -(-a * at).exp_m1();
        let slope = a * q * (facing / (rest * rest) + beside / rest);
        let curvature = a * a * q * (facing * (1.0 + q) / (rest * rest * rest) + beside / (rest * rest));
        let value = facing * q / rest - beside * rest.ln() + slope * (at - d);
        [value, slope, if d > at - f64::EPSILON * at { curvature } else { 0.0 }]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// e at w/g = 0.25, 0.5, 1, 2, 3 and 5 (closed form of the map, computed independently). κ is 2.049 for w = g = h and 1.110 for w, g, h = 2, 3, 25, with which
    /// boundary elements agree to 1e-5.
    #[test]
    fn field_above_and_below() {
        for (rho, e) in [(0.25, 0.691), (0.5, 0.839), (1.0, 1.049), (2.0, 1.324), (3.0, 1.512), (5.0, 1.774)] {
            assert!((above_and_below(rho) - e).abs() < 6e-4, "{rho}");
        }
        assert!((1.0 + above_and_below(1.0) - 2.049).abs() < 6e-4);
        assert!((1.0 + above_and_below(2.0 / 3.0) * 3.0 / 25.0 - 1.110).abs() < 6e-4);
    }

    /// Thrust of long fingers over N·ε·h/g while they engage, against biquadratic elements at w/g = 1, 2 and 4: within 2.5 % for overlaps from −4 to 2 gaps, and within
    /// 6.5 % at −6.
    #[test]
    fn fingers_engage() {
        let overlaps = [-6.0, -4.0, -3.0, -2.0, -1.5, -1.0, -0.5, 0.0, 0.25, 0.5, 1.0, 1.5, 2.0];
        for (rho, thrusts) in [
            (1.0, [0.043, 0.086, 0.137, 0.243, 0.340, 0.484, 0.677, 0.862, 0.924, 0.961, 0.991, 0.998, 1.0]),
            (2.0, [0.062, 0.122, 0.187, 0.311, 0.413, 0.552, 0.724, 0.883, 0.935, 0.967, 0.993, 0.998, 1.0]),
            (4.0, [0.094, 0.172, 0.248, 0.376, 0.473, 0.599, 0.753, 0.895, 0.942, 0.971, 0.994, 0.999, 1.0]),
        ] {
            let field = CombField::new(1.0, [1e-6, rho * 1e-6, 100e-6]);
            for (z, thrust) in overlaps.into_iter().zip(thrusts) {
                let found = field.at(z * 1e-6)[1] * 1e-6;
                let bound = if z < -4.0 { 6.5e-2 } else { 2.5e-2 };
                assert!((found / thrust - 1.0).abs() < bound, "{rho} {z}: {found} {thrust}");
            }
            // engaged, both ends have the charge 2e(w/2g)
            let charge = field.at(20e-6)[0] - 20.0;
            assert!((charge / (2.0 * above_and_below(0.5 * rho)) - 1.0).abs() < 1e-9);
        }
    }

    /// The tips add more than 20, 5 and 1 % to the thrust of tall fingers below d/g = 1.71, 2.35 and 3.12 at w = g, and below 2.24, 3.10 and 4.12 at w = 2g (biquadratic
    /// elements). This law has these additions within a tenth.
    #[test]
    fn tips_add_thrust() {
        for (rho, distances) in [(1.0, [1.71, 2.35, 3.12]), (2.0, [2.24, 3.10, 4.12])] {
            let field = CombField::new(1.0, [1e-6, rho * 1e-6, 40e-6]);
            for (d, added) in distances.into_iter().zip([0.2, 0.05, 0.01]) {
                let found = field.at(40e-6 - d * 1e-6)[1] * 1e-6 - 1.0;
                assert!((found / added - 1.0).abs() < 0.1, "{rho} {d}: {found} {added}");
            }
        }
    }

    /// Slope and curvature are the derivatives of C: differences of fourth order agree to 1e-7 from far apart to the tangent at the base.
    #[test]
    fn derivatives_are_exact() {
        for rho in [0.3, 1.0, 4.0] {
            let field = CombField::new(1.0, [2e-6, rho * 2e-6, 30e-6]);
            for o in [-25e-6, -6e-6, -1e-6, -0.1e-6, 0.3e-6, 2e-6, 12e-6, 26e-6, 29e-6, 29.6e-6, 29.95e-6] {
                let at = field.at(o);
                for k in 0..2 {
                    let e = 2e-9;
                    let [a, b, c, d] = [-2.0, -1.0, 1.0, 2.0].map(|n| field.at(o + n * e)[k]);
                    let slope = (a - d + 8.0 * (c - b)) / (12.0 * e);
                    let scale = [1.0 / 2e-6, 0.01 / 4e-12][k];
                    assert!((slope - at[k + 1]).abs() < 1e-7 * at[k + 1].abs().max(scale), "{rho} {o}: {slope} {at:?}");
                }
                assert!(at[0] > 0.0 && at[1] > 0.0, "{rho} {o}: {at:?}");
            }
        }
    }
}
