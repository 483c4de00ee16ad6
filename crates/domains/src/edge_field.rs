//! The field outside the area that two electrodes face each other with, per length, as a function of the present distance g.
//!
//! A bar of width b and thickness t at the distance g over a plane has the capacitance ε·c(b/g, t/g) per length. Two bars of height h and width w at
//! the distance G are the same problem by mirror symmetry: ½·ε·c(2h/G, 2w/G). The field around rectangles follows from a Schwarz–Christoffel map
//! (H. B. Palmer, Trans. AIEE 46 (1927) 363, with thickness zero), and c is the ratio of two complete elliptic integrals. The closed form here is a fit to it:
//! ```text
//! c(x, τ) = x + (2/π)·ln A      A = Σ aᵢ·x^pᵢ·τ^qᵢ
//! ```
//! For g/b of 0.02 to 5 and t/b of 0.01 to 10 it is within 0.4 % of the map in c and within 0.6 % in dc/dg, as 256 points of the map show. Of bars, the same range is G/h of
//! 0.04 to 10 and w/h of 0.01 to 10. Towards smaller distances it becomes exact. At g/b = 10 the force is 3.9 % high. The powers pᵢ + qᵢ of 1/g are ¼, ½, 1 and 2,
//! so that square roots are all that a distance costs. All aᵢ are positive, which makes c convex with g at every distance.
//!
//! Every law here is one function with its first two derivatives, so that charge, force and stiffness belong to one energy.

use bimorph_multibody::batch::SimdReal;
use bimorph_structure::{BeamGap, ElectrodeShape, Fringe, PlateGap};
use std::f64::consts::PI;

/// Powers of 1/g in A, and for each its terms a·x^p·τ^(power − p): (a, p).
const TERMS: [(f64, &[(f64, f64)]); 4] = [
    (0.25, &[(11.126, 0.2236)]),
    (0.5, &[(5.7161, 0.5)]),
    (1.0, &[(40.17, 0.0697), (8.4381, 0.9625)]),
    (2.0, &[(17.603, 1.0), (20.14, 0.0)]),
];
/// Factor on the force of a bar over a plane, 1 + 0.65·g/h (P. M. Osterberg, S. D. Senturia, J. Microelectromech. Syst. 6 (1997) 107).
const PARALLEL: f64 = 0.65;

/// Field at the edges, as an addition to 1/g: capacitance per length is ε·h·(1/g + e(g)).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum EdgeField {
    /// e = 0.
    None,
    /// e = −(f/h)·ln(g/h).
    Parallel {
        /// f/h (1/m).
        factor: f64,
        /// 1/h (1/m).
        inverse: f64,
    },
    /// e = k·ln A(g/g₀).
    Exact {
        /// k (1/m).
        factor: f64,
        /// Distance that the terms are measured with, g₀ (m).
        unit: f64,
        /// Terms with the powers ¼, ½, 1 and 2 of g₀/g (1).
        terms: [f64; 4],
    },
}

impl EdgeField {
    /// Powers of 1/g in A.
    pub const POWERS: [f64; 4] = [TERMS[0].0, TERMS[1].0, TERMS[2].0, TERMS[3].0];

    /// Of a bar of width `b` and thickness `t` over a plane at about the distance `unit` (m), relative to ε·b.
    pub fn over_plane(b: f64, t: f64, unit: f64) -> Self {
        Self::exact(b / unit, t / unit, unit, 2.0 / (PI * b))
    }

    /// Of two bars of height `h` and width `w` at about the distance `unit` (m), relative to ε·h.
    pub fn between_bars(h: f64, w: f64, unit: f64) -> Self {
        Self::exact(2.0 * h / unit, 2.0 * w / unit, unit, 1.0 / (PI * h))
    }

    fn exact(x: f64, tau: f64, unit: f64, factor: f64) -> Self {
        let terms = TERMS.map(|(power, all)| all.iter().map(|(a, p)| a * x.powf(*p) * tau.powf(power - p)).sum());
        Self::Exact { factor, unit, terms }
    }

    /// The law of a gap between beams, with its factor on ε·h. `fixed`: both lower nodes are anchored; `sugar`: the model is as SUGAR computes.
    pub(super) fn of(gap: &BeamGap, fixed: bool, sugar: bool) -> (f64, Self) {
        let edges = match gap.fringe(sugar) {
            Fringe::Sugar => return (gap.sugar_factor(), Self::None),
            Fringe::None => Self::None,
            Fringe::Parallel => Self::Parallel { factor: PARALLEL / gap.height, inverse: 1.0 / gap.height },
            Fringe::Exact => match gap.shape(fixed) {
                ElectrodeShape::Plane => Self::over_plane(gap.height, gap.widths[0], gap.gap),
                ElectrodeShape::Bar => Self::between_bars(gap.height, gap.mean_width(), gap.gap),
            },
        };
        (1.0, edges)
    }

    /// Laws of the edges along both sides of a plate, relative to ε·A. Each edge has half the field that a long bar as wide as the plate across it has at both edges; corners are
    /// left out. `sugar`: the model is as SUGAR computes, which has no such plates.
    pub(super) fn of_plates(plate: &PlateGap, sugar: bool) -> [Self; 2] {
        let [l, w] = plate.sides;
        let law = plate.law.unwrap_or(if sugar { Fringe::None } else { Fringe::Exact });
        if l == 0.0 || w == 0.0 {
            return [Self::None; 2];
        }
        [w, l].map(|across| {
            let edges = match (law, plate.electrode) {
                (Fringe::None | Fringe::Sugar, _) => Self::None,
                (Fringe::Exact, _) if plate.thickness == 0.0 => Self::None,
                (Fringe::Parallel, _) => Self::Parallel { factor: PARALLEL / across, inverse: 1.0 / across },
                (Fringe::Exact, Some(ElectrodeShape::Bar)) => Self::between_bars(across, plate.thickness, plate.gap),
                (Fringe::Exact, _) => Self::over_plane(across, plate.thickness, plate.gap),
            };
            edges.times(l * w / plate.area)
        })
    }

    /// The same field, `k` times as strong.
    fn times(self, k: f64) -> Self {
        match self {
            Self::None => Self::None,
            Self::Parallel { factor, inverse } => Self::Parallel { factor: k * factor, inverse },
            Self::Exact { factor, unit, terms } => Self::Exact { factor: k * factor, unit, terms },
        }
    }

    /// e (1/m), e′ (1/m²) and e″ (1/m³) at the distance `g` (m).
    #[inline]
    pub fn at(&self, g: f64) -> [f64; 3] {
        match *self {
            Self::None => [0.0; 3],
            Self::Parallel { factor, inverse } => {
                let slope = -factor / g;
                [-factor * (g * inverse).ln(), slope, -slope / g]
            }
            Self::Exact { factor, unit, terms } => {
                let y = unit / g;
                let root = y.sqrt();
                let [quarter, half, one, two] =
                    [terms[0] * root.sqrt(), terms[1] * root, terms[2] * y, terms[3] * y * y];
                let sum = quarter + half + one + two;
                // −g·dA/dg and (g·d/dg)²A over A
                let first = (0.25 * quarter + 0.5 * half + one + 2.0 * two) / sum;
                let second = (0.0625 * quarter + 0.25 * half + one + 4.0 * two) / sum;
                let slope = -factor * first / g;
                [factor * sum.ln(), slope, factor * (second - first * first + first) / (g * g)]
            }
        }
    }
}

impl EdgeField {
    /// The first derivative of [`EdgeField::derivatives`] alone.
    #[inline(always)]
    pub(super) fn slope<W: SimdReal>(&self, inverse: W) -> W {
        let square = inverse * inverse;
        match *self {
            Self::None => -square,
            Self::Parallel { factor, .. } => -square + inverse * -factor,
            Self::Exact { factor, unit, terms } => {
                let y = inverse * unit;
                let root = y.sqrt();
                let [quarter, half, one, two] =
                    [root.sqrt() * terms[0], root * terms[1], y * terms[2], y * y * terms[3]];
                let over = y.splat_like(1.0) / (quarter + half + one + two);
                let first = (quarter * 0.25 + half * 0.5 + one + two * 2.0) * over;
                -square + first * inverse * -factor
            }
        }
    }

    /// First and second derivative of 1/g + e(g) in lanes, at the inverse of the distance g (1/m).
    #[inline(always)]
    pub(super) fn derivatives<W: SimdReal>(&self, inverse: W) -> [W; 2] {
        let square = inverse * inverse;
        let (slope, curvature) = (-square, square * inverse * 2.0);
        match *self {
            Self::None => [slope, curvature],
            Self::Parallel { factor, .. } => [slope + inverse * -factor, curvature + square * factor],
            Self::Exact { factor, unit, terms } => {
                let y = inverse * unit;
                let root = y.sqrt();
                let [quarter, half, one, two] =
                    [root.sqrt() * terms[0], root * terms[1], y * terms[2], y * y * terms[3]];
                let over = y.splat_like(1.0) / (quarter + half + one + two);
                let first = (quarter * 0.25 + half * 0.5 + one + two * 2.0) * over;
                let second = (quarter * 0.0625 + half * 0.25 + one + two * 4.0) * over;
                let bent = second - first * first + first;
                [slope + first * inverse * -factor, curvature + bent * square * factor]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    //! Sources: "exact" are values of the conformal map of a rectangular bar over a plane (independent computation, residual 1e-14; the boundary
    //! element method agrees to 1e-5). C factors are relative to ε·h/G, F factors to ε·h·V²/(2G²).
    use super::*;

    /// C and F factors of a law relative to ε·h over 1/g and 1/g².
    fn factors(edges: &EdgeField, g: f64) -> [f64; 2] {
        let [value, slope, _] = edges.at(g);
        [1.0 + value * g, 1.0 - slope * g * g]
    }

    /// Two facing bars: the fit agrees with exact C and F factors at 14 pairs of G/h and w/h within 0.4 % and 0.7 %.
    #[test]
    fn bars_follow_the_map() {
        for (gap, width, c, f) in [
            (0.05, 0.2, 1.140, 1.030),
            (0.05, 10.0, 1.239, 1.032),
            (0.2, 0.2, 1.408, 1.101),
            (0.2, 1.0, 1.532, 1.118),
            (0.2, 5.0, 1.700, 1.125),
            (0.5, 0.5, 1.937, 1.244),
            (1.0, 0.2, 2.360, 1.332),
            (1.0, 1.0, 2.784_66, 1.476_42),
            (1.0, 5.0, 3.520, 1.585),
            (2.0, 2.0, 4.438, 1.940),
            (2.0, 10.0, 5.981, 2.173),
            (5.0, 0.2, 5.726, 1.993),
            (5.0, 1.0, 6.802, 2.503),
            (5.0, 10.0, 10.87, 3.669),
        ] {
            let h = 2e-6;
            let [found_c, found_f] = factors(&EdgeField::between_bars(h, width * h, 1.3e-6), gap * h);
            assert!((found_c / c - 1.0).abs() < 4.3e-3, "{gap} {width}: C {found_c} {c}");
            assert!((found_f / f - 1.0).abs() < 7e-3, "{gap} {width}: F {found_f} {f}");
        }
    }

    /// A bar over a plane: exact factors at g/b and t/b within 0.4 % and 0.7 %; the mirror image is two bars of twice the size.
    #[test]
    fn bars_over_planes_follow_the_map() {
        for (gap, t, c, f) in [
            (0.05, 0.01, 1.180, 1.036),
            (0.05, 1.0, 1.308, 1.061),
            (0.1, 0.05, 1.345, 1.080),
            (0.2, 0.2, 1.685, 1.174),
            (0.5, 0.01, 2.139, 1.213),
            (0.5, 1.0, 2.785, 1.476),
            (1.0, 0.05, 3.092, 1.407),
            (1.0, 1.0, 3.961, 1.800),
        ] {
            let b = 20e-6;
            let [found_c, found_f] = factors(&EdgeField::over_plane(b, t * b, 4e-6), gap * b);
            assert!((found_c / c - 1.0).abs() < 4.3e-3, "{gap} {t}: C {found_c} {c}");
            assert!((found_f / f - 1.0).abs() < 7e-3, "{gap} {t}: F {found_f} {f}");
            let bars = factors(&EdgeField::between_bars(b, t * b, 4e-6), 2.0 * gap * b);
            assert!((bars[0] / found_c - 1.0).abs() < 1e-12 && (bars[1] / found_f - 1.0).abs() < 1e-12);
        }
    }

    /// e′ and e″ are the derivatives of e and e′: differences of fourth order over 200 random states of every law agree to 1e-7 of 1/g² and 1/g³. C is convex
    /// and falls with the distance.
    #[test]
    fn derivatives_are_exact() {
        let mut seed = 1_u64;
        let mut random = |low: f64, high: f64| {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            low * (high / low).powf((seed >> 11) as f64 / (1_u64 << 53) as f64)
        };
        for _ in 0..200 {
            let (h, g) = (random(1e-6, 50e-6), random(0.1e-6, 20e-6));
            let w = h * random(0.01, 10.0);
            for edges in [
                EdgeField::None,
                EdgeField::Parallel { factor: PARALLEL / h, inverse: 1.0 / h },
                EdgeField::between_bars(h, w, 2e-6),
                EdgeField::over_plane(h, w, 2e-6),
            ] {
                let at = edges.at(g);
                for k in 0..2 {
                    let e = 1e-3 * g;
                    let [a, b, c, d] = [-2.0, -1.0, 1.0, 2.0].map(|n| edges.at(g + n * e)[k]);
                    let slope = (a - d + 8.0 * (c - b)) / (12.0 * e);
                    let scale = g.powi(-2 - k as i32);
                    assert!(
                        (slope - at[k + 1]).abs() < 1e-7 * scale.max(at[k + 1].abs()),
                        "{edges:?} {g}: {slope} {at:?}"
                    );
                }
                assert!(at[1] <= 0.0 && 2.0 / g.powi(3) + at[2] > 0.0, "{edges:?} {g}: {at:?}");
            }
        }
    }
}
