//! Capacitance of a comb and of two parallel plates as a function of one approach u.

use super::comb_field::CombField;
use super::edge_field::EdgeField;

/// C, C′ = dC/du, C″ at an approach.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Capacitance {
    /// C (F).
    pub value: f64,
    /// dC/du (F/m).
    pub slope: f64,
    /// d²C/du² (F/m²).
    pub curvature: f64,
}

/// A capacitor whose C depends on one approach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Capacitor {
    /// Comb drive, C = C_p + k·o with overlap o = o₀ + u (Tang, Nguyen, Howe 1989: force independent of position).
    ///
    /// Around the end of the overlap, |o| < `blend`, a parabola joins the line to zero with continuous slope: a comb that
    /// has left its stator no longer pulls.
    Comb {
        /// dC/du while engaged, N·ε·h/g (F/m), without that of `fingers`.
        slope: f64,
        /// Overlap as drawn o₀ (m); infinite for a comb whose force does not depend on the position (SUGAR's `comb2d`),
        /// whose capacitance is then counted from the drawn position.
        overlap: f64,
        /// Half width of the blend (m): one finger gap.
        blend: f64,
        /// Constant part C_p (F).
        parasitic: f64,
        /// Field of the fingers in their plane, where the law has it apart: `slope` is then that of the field above and below them.
        fingers: Option<CombField>,
    },
    /// Parallel plates, C = ε·A·(1/d + e(d)) with d = g₀ − u (Nathanson 1967) and the fringe field e at their edges.
    ///
    /// Below `closest` the field is frozen: C continues along its tangent, so that nothing is divided by a vanishing
    /// gap while an iteration oversteps. Contact holds real plates further apart than that.
    Plates {
        /// ε·A (F·m).
        strength: f64,
        /// Fringe fields along both sides.
        edges: [EdgeField; 2],
        /// Gap as drawn g₀ (m).
        gap: f64,
        /// Distance between the plates less that of the field, by an insulating layer (m).
        shortening: f64,
        /// Distance of the field below which it is frozen (m).
        closest: f64,
    },
}

impl Capacitor {
    /// C and its derivatives at approach `u` (m).
    #[inline]
    pub fn at(&self, u: f64) -> Capacitance {
        match *self {
            Self::Comb { fingers: Some(fingers), slope, overlap, blend, parasitic } => {
                let [value, first, second] = fingers.at(overlap + u);
                let other = Self::Comb { fingers: None, slope, overlap, blend, parasitic }.at(u);
                Capacitance {
                    value: other.value + value,
                    slope: other.slope + first,
                    curvature: other.curvature + second,
                }
            }
            Self::Comb { slope, overlap, blend, parasitic, fingers: None } => {
                if overlap.is_infinite() {
                    return Capacitance { value: parasitic + slope * u, slope, curvature: 0.0 };
                }
                let o = overlap + u;
                if o >= blend {
                    Capacitance { value: parasitic + slope * o, slope, curvature: 0.0 }
                } else if o <= -blend {
                    Capacitance { value: parasitic, slope: 0.0, curvature: 0.0 }
                } else {
                    let s = (o + blend) / (2.0 * blend);
                    Capacitance {
                        value: parasitic + slope * blend * s * s,
                        slope: slope * s,
                        curvature: slope / (2.0 * blend),
                    }
                }
            }
            Self::Plates { strength, edges, gap, shortening, closest }
                if !matches!(edges, [EdgeField::None, EdgeField::None]) =>
            {
                let d = gap - shortening - u;
                let at = d.max(closest);
                let sides = edges.map(|edge| edge.at(at));
                let sum = |plain: f64, k: usize| strength * (plain + sides[0][k] + sides[1][k]);
                let slope = -sum(-1.0 / (at * at), 1);
                let curvature = if d > closest { sum(2.0 / (at * at * at), 2) } else { 0.0 };
                Capacitance { value: sum(1.0 / at, 0) + slope * (at - d), slope, curvature }
            }
            Self::Plates { strength, gap, shortening, closest, .. } => {
                let d = gap - shortening - u;
                if d >= closest {
                    let c = strength / d;
                    Capacitance { value: c, slope: c / d, curvature: 2.0 * c / (d * d) }
                } else {
                    let c = strength / closest;
                    let slope = c / closest;
                    Capacitance { value: c + slope * (closest - d), slope, curvature: 0.0 }
                }
            }
        }
    }

    /// Whether it has any capacitance: points where conductors touch stand for none.
    pub fn acts(&self) -> bool {
        !matches!(self, Self::Plates { strength: 0.0, .. })
    }

    /// Sign with which the approach changes the distance, as text, and the distance as drawn (m).
    pub fn way(&self) -> (&'static str, f64) {
        (if matches!(self, Self::Comb { .. }) { "+" } else { "-" }, self.distance(0.0))
    }

    /// Distance left between the conductors (m), where that has a meaning.
    #[inline]
    pub fn distance(&self, u: f64) -> f64 {
        match *self {
            Self::Comb { overlap, .. } => overlap + u,
            Self::Plates { gap, .. } => gap - u,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Slope and curvature are the derivatives of C on every branch, and C and C′ are continuous where branches meet.
    #[test]
    fn derivatives_and_joins() {
        let comb = Capacitor::Comb { slope: 3.0, overlap: 5.0, blend: 2.0, parasitic: 0.1, fingers: None };
        let ideal = [EdgeField::None; 2];
        let plates = Capacitor::Plates { strength: 2.0, edges: ideal, gap: 2.3, shortening: 0.3, closest: 0.1 };
        let edges = [EdgeField::over_plane(3.0, 0.5, 2.0), EdgeField::Parallel { factor: 0.2, inverse: 0.3 }];
        let edged = Capacitor::Plates { strength: 2.0, edges, gap: 2.3, shortening: 0.3, closest: 0.1 };
        let apart = [-1.0, 0.5, 1.8, 1.95];
        for (c, points) in [(comb, [-8.0, -5.5, -3.5, -1.0]), (plates, apart), (edged, apart)] {
            for u in points {
                let e = 1e-5;
                let (lo, at, hi) = (c.at(u - e), c.at(u), c.at(u + e));
                assert!((at.slope - (hi.value - lo.value) / (2.0 * e)).abs() < 1e-5 * (1.0 + at.slope));
                assert!((at.curvature - (hi.slope - lo.slope) / (2.0 * e)).abs() < 1e-4 * (1.0 + at.curvature));
            }
        }
        for (c, join) in [(comb, -3.0), (comb, -7.0), (plates, 1.9), (edged, 1.9)] {
            let (lo, hi) = (c.at(join - 1e-12), c.at(join + 1e-12));
            assert!((lo.value - hi.value).abs() < 1e-8 && (lo.slope - hi.slope).abs() < 1e-6);
        }
    }
}
