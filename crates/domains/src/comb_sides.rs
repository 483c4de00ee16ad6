//! Capacitance of a comb as a function of its overlap o and of how far its fingers lie aside of the middle of their gaps, y.
//! ```text
//! C = C_p + ½·(C₁(o, g − y) + C₁(o, g + y))
//! C₁ = N·ε·((e(w/g) − S)·o + h·(Λ(o/g) + 2Δ(L − o)))      without fringe field N·ε·h·o/g
//! ```
//! C₁ is the law of [`super::comb_field`] with all gaps alike. Half of the gaps become narrower and half wider. Engaged, that is h/(g − y) + h/(g + y) + e(w/(g − y)) + e(w/(g + y))
//! for two gaps, within 0.7 % of boundary elements in C for |y| up to 0.9·g, and at most 4 % low in the force. The stiffness across, −½V²·∂²C/∂y², is κ_y·N·ε·h·o·V²/g³ at
//! y = 0, with κ_y up to 4 % low. The field at the tips is that of the middle.
//!
//! S is what a conducting substrate takes that has the potential of one side, at the distance d below the fingers. At a large distance the engaged fingers have half of the other side's
//! potential on the mean, which leaves S = ¾·(1 + ρ)·g/d with ρ = w/g. The form
//! ```text
//! S = ¾·(1 + ρ)/(δ + c)      δ = d/g      c = 0.464 + 0.0572ρ + 0.00386ρ² + (0.245 + 0.1407ρ)·exp(−4.087δ/(1 + 2.05ρ))
//! ```
//! is within 1.3 % of finite elements of tall fingers (h = 4g, bilinear, 10⁴ nodes), for ρ of 0.25 to 5 and δ of 0.25 to 8.
//!
//! Below the least distance t that the law of contact knows, gaps are replaced by γ = t²/(2t − g), by which 1/g continues along its tangent.
//!
//! Sides touch at the touching distance of [`super::contact`]. Half of the gaps close, so that the area ½·N·h·o bears, with the overlap as at the field's end. The energy of contact
//! is that area times the law's per area: the contact force acts across, and its small change with the overlap along the fingers.

use super::comb_field::{CombField, above_and_below};
use super::contact::Contact;
use super::jet::Jet;
use std::f64::consts::PI;

/// Share S of a substrate at the distance `delta` below fingers `rho` wide, both in gaps (1).
pub fn substrate_share(rho: f64, delta: f64) -> f64 {
    let near = (0.245 + 0.1407 * rho) * (-4.087 * delta / (1.0 + 2.05 * rho)).exp();
    0.75 * (1.0 + rho) / (delta + 0.464 + 0.0572 * rho + 0.00386 * rho * rho + near)
}

/// A comb whose fingers may lie aside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CombSides {
    /// N·ε (F/m).
    pub strength: f64,
    /// Height of the fingers h (m).
    pub height: f64,
    /// Gap as drawn g (m).
    pub gap: f64,
    /// Width of the fingers w (m), with the field of their tips; none: without fringe field.
    pub fingers: Option<(f64, CombField)>,
    /// S (1).
    pub substrate: f64,
    /// How the sides touch, with the area per overlap ½·N·h (m).
    pub contact: Contact,
    /// Constant part C_p (F).
    pub parasitic: f64,
}

/// The law of a comb over the approach of its sides along the fingers and their displacement across.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CombLaw {
    /// The law over the overlap and the distance aside.
    pub sides: CombSides,
    /// Overlap and distance aside as drawn (m).
    pub drawn: [f64; 2],
}

impl CombLaw {
    /// The overlap at the approach `u` (m).
    pub fn overlap(&self, u: f64) -> f64 {
        self.drawn[0] + u
    }

    /// The distance aside at the displacement `y` across (m).
    pub fn aside(&self, y: f64) -> f64 {
        self.drawn[1] + y
    }

    /// C over both displacements (m).
    pub fn field(&self, [u, y]: [f64; 2]) -> Jet {
        self.sides.at(self.overlap(u), self.aside(y))
    }

    /// The potential of field and contact over both at a voltage.
    pub fn potential(&self, at: [f64; 2], volts: f64) -> Jet {
        let field = self.field(at) * (-0.5 * volts * volts);
        self.pressed(at).map_or(field, |pressed| field + pressed)
    }

    /// Energy of the contact at the sides over both (J); none where they do not touch.
    pub fn pressed(&self, [u, y]: [f64; 2]) -> Option<Jet> {
        self.sides.pressed(self.overlap(u), self.aside(y))
    }
}

impl CombSides {
    /// C over the overlap and the distance aside (m).
    pub fn at(&self, overlap: f64, aside: f64) -> Jet {
        let o = Jet::variable(overlap, 0);
        let facing = o.map(self.facing(overlap));
        let near = self.side(o, facing, aside, 1.0);
        let both = if aside == 0.0 {
            // what is odd in y cancels
            let [slope, _] = near.first;
            let [curvature, _, across] = near.second;
            Jet { value: near.value, first: [slope, 0.0], second: [curvature, 0.0, across] } * 2.0
        } else {
            near + self.side(o, facing, aside, -1.0)
        };
        let tips = match &self.fingers {
            Some((_, field)) => o.map(field.at_tips(overlap)) * (2.0 * self.height),
            None => Jet::default(),
        };
        let mut sum = (both * 0.5 + tips) * self.strength;
        sum.value += self.parasitic;
        sum
    }

    /// Energy of the contact at the sides (J) over the overlap and the distance aside (m); none where they do not touch.
    pub fn pressed(&self, overlap: f64, aside: f64) -> Option<Jet> {
        let left = self.gap - aside.abs();
        if left >= self.contact.touch || !self.faces(overlap) {
            return None;
        }
        let (force, slope) = self.contact.force(left);
        let value = self.contact.energy(left);
        let per_overlap = Jet { value, first: [0.0, aside.signum() * force], second: [0.0, 0.0, -slope] };
        Some(Jet::variable(overlap, 0).map(self.facing(overlap)) * per_overlap)
    }

    /// True where fingers face each other with their sides.
    pub fn faces(&self, overlap: f64) -> bool {
        overlap > -self.gap
    }

    /// Overlap, which ends over a gap on both sides of 0, and its derivatives.
    fn facing(&self, o: f64) -> [f64; 3] {
        let blend = self.gap;
        if o >= blend {
            [o, 1.0, 0.0]
        } else if o <= -blend {
            [0.0; 3]
        } else {
            let s = (o + blend) / (2.0 * blend);
            [blend * s * s, s, 0.5 / blend]
        }
    }

    /// C/(N·ε) of gaps that are narrower by `sign`·y, without tips.
    fn side(&self, o: Jet, facing: Jet, aside: f64, sign: f64) -> Jet {
        let (g, t) = (self.gap - sign * aside, self.contact.least());
        // 1/γ over y
        let inverse = if g >= t { 1.0 / g } else { (2.0 * t - g) / (t * t) };
        let slope = sign * if g >= t { inverse * inverse } else { 1.0 / (t * t) };
        let bend = if g >= t { 2.0 * inverse * inverse * inverse } else { 0.0 };
        let inverse = Jet { value: inverse, first: [0.0, slope], second: [0.0, 0.0, bend] };
        let Some((width, _)) = &self.fingers else { return facing * inverse * self.height };
        let rho = inverse * *width;
        let mut above = rho.map(charge(rho.value));
        above.value -= self.substrate;
        above * facing + engaged(o * inverse, rho) * self.height
    }
}

/// e(ρ) and its derivatives.
fn charge(rho: f64) -> [f64; 3] {
    [above_and_below(rho), ((rho + 2.0).ln() - rho.ln()) / PI, (1.0 / (rho + 2.0) - 1.0 / rho) / PI]
}

/// Λ over z = o/g and ρ = w/g.
fn engaged(z: Jet, rho: Jet) -> Jet {
    let half = rho * 0.5;
    let ends = half.map(charge(half.value)) * 2.0;
    let fade = ends.map(CombField::fading(ends.value));
    let n = z.map(CombField::apart(z.value));
    let y = n * fade.inverse();
    n + z + ends * y.map(CombField::fringe(y.value))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn comb(rho: f64, h: f64, delta: f64) -> CombSides {
        let (g, strength) = (2e-6, 20.0 * 8.854e-12);
        CombSides {
            strength,
            height: h * g,
            gap: g,
            fingers: Some((rho * g, CombField::new(strength * h * g, [g, rho * g, 40e-6]))),
            substrate: if delta > 0.0 { substrate_share(rho, delta) } else { 0.0 },
            contact: Contact { touch: 0.1e-6, area: 10.0 * h * g },
            parasitic: 1e-15,
        }
    }

    /// Derivatives are those of C: differences of fourth order agree to 2e-7 of the largest, from far apart to the base, in the middle, aside and beyond contact, with and
    /// without fringe field.
    #[test]
    fn derivatives_are_exact() {
        let plain = CombSides { fingers: None, ..comb(1.0, 1.0, 0.0) };
        for comb in [comb(0.5, 2.0, 0.0), comb(2.0, 1.0, 1.5), plain] {
            for o in [-15e-6, -3e-6, -0.4e-6, 1e-6, 12e-6, 38.5e-6] {
                for y in [0.0, 0.3e-6, -1.2e-6, 1.86e-6, -1.95e-6] {
                    let (at, e) = (comb.at(o, y), 5e-10);
                    let along = [-2.0, -1.0, 1.0, 2.0].map(|n| comb.at(o + n * e, y));
                    let across = [-2.0, -1.0, 1.0, 2.0].map(|n| comb.at(o, y + n * e));
                    let slope = |of: &[Jet; 4], get: &dyn Fn(&Jet) -> f64| {
                        let [a, b, c, d] = [0, 1, 2, 3].map(|k| get(&of[k]));
                        (a - d + 8.0 * (c - b)) / (12.0 * e)
                    };
                    let [f, s] = [comb.strength * comb.height / 2e-6, comb.strength * comb.height / 4e-12];
                    let (left, right) = (2e-6 - y.abs(), 1e-7 * (s + at.second[2].abs()));
                    let off = [slope(&along, &|j| j.value) - at.first[0], slope(&across, &|j| j.value) - at.first[1]];
                    assert!(off.iter().all(|x| x.abs() < 1e-7 * (f + at.first[1].abs())), "{o} {y}: {off:?} {at:?}");
                    let off = [
                        slope(&along, &|j| j.first[0]) - at.second[0],
                        slope(&along, &|j| j.first[1]) - at.second[1],
                        slope(&across, &|j| j.first[0]) - at.second[1],
                        slope(&across, &|j| j.first[1]) - at.second[2],
                    ];
                    assert!(left < 0.2e-6 || off.iter().all(|x| x.abs() < 2.0 * right), "{o} {y}: {off:?} {at:?}");
                }
            }
        }
    }

    /// Contact begins at the touching distance on either side. At 5 nm of penetration it bears with 100 MPa on half of the gaps, and derivatives are those of its energy by central
    /// differences to 1e-6, engaged and at the end of the overlap. Fingers that have left each other do not touch.
    #[test]
    fn sides_bear() {
        let comb = comb(1.0, 2.0, 0.0);
        assert_eq!((comb.pressed(12e-6, 1.899e-6), comb.pressed(12e-6, -1.899e-6)), (None, None));
        assert_eq!(comb.pressed(-2e-6, 1.95e-6), None);
        let force = comb.pressed(12e-6, 1.905e-6).unwrap().first[1];
        assert!(
            (force / (10.0 * 4e-6 * 12e-6 * comb.contact.force(0.095e-6).0 / comb.contact.area) - 1.0).abs() < 1e-12
        );
        for o in [12e-6, 0.7e-6] {
            for y in [1.91e-6, -1.93e-6] {
                let (at, e) = (comb.pressed(o, y).unwrap(), 1e-12);
                let slope = |of: &dyn Fn(f64) -> f64| (of(e) - of(-e)) / (2.0 * e);
                let along = |k: usize| slope(&|d| comb.pressed(o + d, y).unwrap().first[k]);
                let across = |k: usize| slope(&|d| comb.pressed(o, y + d).unwrap().first[k]);
                for (found, wanted) in [
                    (slope(&|d| comb.pressed(o + d, y).unwrap().value), at.first[0]),
                    (slope(&|d| comb.pressed(o, y + d).unwrap().value), at.first[1]),
                    (along(1), at.second[1]),
                    (across(0), at.second[1]),
                    (across(1), at.second[2]),
                ] {
                    assert!((found / wanted - 1.0).abs() < 1e-6, "{o} {y}: {found} {wanted}");
                }
                assert!(at.first[1] * y > 0.0 && at.second[2] > 0.0);
            }
        }
    }

    /// In the middle C and its derivatives along the fingers are those of the law of one displacement.
    #[test]
    fn the_middle_is_the_law_of_one_displacement() {
        let comb = comb(1.5, 1.2, 0.0);
        let (_, field) = comb.fingers.unwrap();
        for o in [-9e-6, -2.5e-6, 3e-6, 17e-6, 39e-6] {
            let (found, [value, slope, curvature]) = (comb.at(o, 0.0), field.at(o));
            let above = comb.strength * above_and_below(1.5);
            let [own, rate, bend] = comb.facing(o);
            assert!((found.value / (1e-15 + value + above * own) - 1.0).abs() < 1e-13, "{o}");
            assert!((found.first[0] / (slope + above * rate) - 1.0).abs() < 1e-12, "{o}");
            let expected = curvature + above * bend;
            assert!((found.second[0] - expected).abs() < 1e-11 * expected.abs().max(slope / 2e-6), "{o}");
        }
    }

    /// Curvature across at y = 0 of engaged fingers, over 2·h/g³ for each gap: 1 + (0.31 ± 0.02)·g/h from boundary elements, for w/g of 1 to 4 and h/g of 1 to 10. The law is
    /// at most 4 % lower.
    #[test]
    fn fingers_aside() {
        for rho in [1.0, 2.0, 4.0] {
            for h in [1.0, 3.0, 10.0] {
                let comb = comb(rho, h, 0.0);
                let per_overlap = |y: f64| {
                    let [a, b] = [20e-6, 15e-6].map(|o| comb.at(o, y));
                    ((a.value - b.value) / 5e-6, (a.second[2] - b.second[2]) / 5e-6)
                };
                let kappa = per_overlap(0.0).1 / (comb.strength * 2.0 * comb.height / 8e-18);
                let [low, high] = [0.29, 0.33].map(|part| 1.0 + part / h);
                assert!(kappa > 0.96 * low && kappa < high, "{rho} {h}: {kappa}");
            }
        }
    }

    /// κ of a comb whose rotor and substrate are grounded, by boundary elements (1e-4), for d/h of 0.25 to 20. It is within 0.5 % for fingers with w = g and h of 2 and 5 gaps, and
    /// w, g, h = 2, 3, 25. At w = g = h it is within 1 % from d = h on, and 7 % low at d = h/4, where the fingers are not tall.
    #[test]
    fn a_substrate_takes_thrust() {
        let distances = [0.25, 0.5, 1.0, 2.0, 5.0, 20.0];
        for (w, g, h, kappas, bound) in [
            (1.0, 1.0, 1.0, [0.669, 0.850, 1.135, 1.464, 1.778, 1.976], [0.08, 0.04, 0.01, 3e-3, 1e-3, 1e-3]),
            (1.0, 1.0, 2.0, [0.910, 1.060, 1.230, 1.359, 1.453, 1.506], [5e-3; 6]),
            (1.0, 1.0, 5.0, [1.046, 1.111, 1.155, 1.181, 1.198, 1.207], [2e-3; 6]),
            (2.0, 3.0, 25.0, [1.052, 1.078, 1.093, 1.101, 1.107, 1.109], [1e-3; 6]),
        ] {
            for ((d, kappa), bound) in distances.into_iter().zip(kappas).zip(bound) {
                let found = 1.0 + (above_and_below(w / g) - substrate_share(w / g, d * h / g)) * g / h;
                assert!((found / kappa - 1.0).abs() < bound, "{w} {g} {h} {d}: {found} {kappa}");
            }
        }
    }
}
