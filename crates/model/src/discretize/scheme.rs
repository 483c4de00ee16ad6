//! Schemes: the ways to cut a uniform beam into rigid bodies and flexible joints.
//!
//! A beam of length L is cut into N segments of length h = L/N. Joints have the three directions (u, g, p) of
//! [`planar`](bimorph_multibody::planar). In the paper's terms, p alone is a rotary joint: type 1 inside a beam, type 2
//! between beams of different section, type 3 at a third beam. u alone is a prismatic joint (type 4).
//!
//! | scheme | joints | masses | frequency error |
//! |---|---|---|---|
//! | A0 | type 1 at 0, h, 2h…, K = EI/h: the paper's first rule | natural rods | O(h) |
//! | A2 | type 1 at the middle of the segments | natural rods | O(h²) |
//! | C1 | A2, and the two joints next to each end coupled (the paper's general joint spring) | natural rods | O(h³) |
//! | D1 | type 1 at the two Gauss points of each pair of segments | natural rods | O(h⁴) |
//! | B | types 1 and 4 and shear at the middle: exact for loads at the nodes | natural rods | O(h²) |
//! | E4 | as B | points at the nodes, with end corrections | (kh)⁴/1440 |
//! | Es | as B with a softened shear, and end corrections | points with rotary inertia | O(h⁵) |
//!
//! **Locked directions.** In A0, A2, C1 and D1 joints only turn. [`Joint::locked`](bimorph_multibody::Joint::locked) says so,
//! and joint coordinates leave these directions out. Where every direction needs a spring they get [`PENALTY`]·EA/h.
//!
//! Reference: D. O. Popa et al., "Computationally efficient dynamic modeling of MEMS" (2004), for A0 and the joint types;
//! the end corrections of C1, E4 and Es are those of the Euler–Maclaurin sum for the strain and the kinetic energy.

use super::rigid::Lump;
use crate::options::Scheme;
use nalgebra::{DMatrix, Matrix2, Matrix3, Vector2};

/// Stiffness of a locked direction over EA/h. The beam's own stretch is then wrong by 1e-4 of itself, which a model without
/// stretch leaves out anyway, while bending keeps ten digits of a beam a hundred times as long as wide.
pub const PENALTY: f64 = 1e4;

/// Mass that the end of an E4 beam takes from the node next to it so that it is a point mass, over ρA·h (1).
pub const POINT_EXCESS: f64 = 1.0 / 48.0;

/// Beam data required by a scheme.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bar {
    /// Length L (m).
    pub length: f64,
    /// Axial stiffness EA (N).
    pub ea: f64,
    /// Bending stiffness EI (N·m²).
    pub ei: f64,
    /// Shear flexibility 1/(G·As) (1/N); 0 for an Euler–Bernoulli beam.
    pub shear: f64,
    /// Mass per length ρA (kg/m).
    pub line_mass: f64,
    /// Rotary inertia of the section over its mass I/A (m²); 0 for an Euler–Bernoulli beam.
    pub rotary: f64,
    /// Mass that each end takes from the node next to it, over ρA·h (1): [`super::end_masses`].
    pub end_excess: [f64; 2],
}

/// Excess of the ends of a beam over ρA·h, at its start and its end (1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndExcess {
    /// [`Bar::end_excess`].
    pub mass: [f64; 2],
    /// The same of its drag, which plates may have without mass, and mass without drag.
    pub drag: [f64; 2],
}

/// A body of a cut beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeamSegment {
    /// Its reference point [m from the start]; the first and the last part belong to the end nodes.
    pub at: f64,
    /// Mass (kg).
    pub mass: f64,
    /// First moment about the reference point, towards the far end (kg·m).
    pub first: f64,
    /// Second moment about the reference point (kg·m²).
    pub second: f64,
}

impl BeamSegment {
    /// The same as a lump of a beam along that direction.
    pub(super) fn lump(&self, along: Vector2<f64>) -> Lump {
        Lump { amount: self.mass, first: along * self.first, second: self.second }
    }
}

/// A joint of a cut beam, between parts k and k + 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SegmentJoint {
    /// Place [m from the start].
    pub at: f64,
    /// Length whose free strain it carries (m).
    pub length: f64,
    /// Stress per strain over (u, g, p).
    pub stiffness: Matrix3<f64>,
    /// Second-order axial strain Q over (g, p).
    pub second: Matrix2<f64>,
    /// Directions that are rigid.
    pub locked: [bool; 3],
}

/// A beam cut into parts and joints.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SegmentedBeam {
    /// Bodies from start to end, end nodes included.
    pub parts: Vec<BeamSegment>,
    /// Joints from start to end, one fewer.
    pub pins: Vec<SegmentJoint>,
    /// Pairs of joints whose rotations are coupled, with the stiffness (N·m/rad): energy k·p₁·p₂.
    pub couplings: Vec<(usize, usize, f64)>,
    /// For each of the N + 1 equally spaced nodes, its part.
    pub nodes: Vec<usize>,
}

impl Scheme {
    /// Order of the frequency error in h.
    pub fn order(self) -> i32 {
        match self {
            Self::A0 => 1,
            Self::A2 | Self::B => 2,
            Self::C1 => 3,
            Self::D1 | Self::E4 | Self::Auto | Self::Es => 4,
        }
    }

    /// The number of segments that the scheme makes of `n`: D1 cuts pairs.
    pub fn segments(self, n: usize) -> usize {
        if self == Self::D1 { n.max(1).next_multiple_of(2) } else { n.max(1) }
    }

    /// Cuts a beam into `n` segments. `wall`: the far end is clamped to ground, where A0 has one joint more.
    pub fn cut(self, bar: &Bar, n: usize, wall: bool) -> SegmentedBeam {
        let h = bar.length / n as f64;
        match self {
            Self::A0 => {
                let count = n + usize::from(wall);
                let places: Vec<f64> = (0..count).map(|k| k as f64 * h).collect();
                let share = bar.length / count as f64;
                let pins = places.iter().map(|&at| SegmentJoint { length: share, ..turning(bar, at, h) }).collect();
                // node k is the end of rod k; with a wall the last node is a part of its own, next to its rod
                let nodes = (0..=n).map(|k| if wall && k == n { n + 1 } else { k }).collect();
                SegmentedBeam { parts: rods(bar, &places), pins, couplings: Vec::new(), nodes }
            }
            Self::A2 | Self::C1 => {
                let places = middles(n, h);
                let mut pins: Vec<SegmentJoint> = places.iter().map(|&at| turning(bar, at, h)).collect();
                let mut couplings = Vec::new();
                if self == Self::C1 && n > 1 {
                    couplings = couple_ends(&mut pins, bar.ei / h);
                }
                SegmentedBeam { parts: rods(bar, &places), pins, couplings, nodes: (0..=n).collect() }
            }
            Self::D1 => {
                let pair = 2.0 * h;
                let phi = 12.0 * bar.ei * bar.shear / (pair * pair);
                // shear moves the points outwards; further than this they would meet those of the next pair
                let from_middle = 0.5 * ((1.0 + phi.min(1.9)) / 3.0).sqrt();
                let off = |k: usize| if k.is_multiple_of(2) { -from_middle } else { from_middle };
                let places: Vec<f64> = (0..n).map(|k| ((k / 2) as f64 + 0.5 + off(k)) * pair).collect();
                let pins = places.iter().map(|&at| turning(bar, at, h)).collect();
                SegmentedBeam { parts: rods(bar, &places), pins, couplings: Vec::new(), nodes: (0..=n).collect() }
            }
            // where nothing has been decided, what bodies take
            Self::B | Self::E4 | Self::Auto | Self::Es => {
                let pins = (0..n).map(|k| self.elastic(bar, n, k)).collect();
                let mut parts = Vec::new();
                self.parts_into(bar, n, &mut parts);
                SegmentedBeam { parts, pins, couplings: Vec::new(), nodes: (0..=n).collect() }
            }
        }
    }

    /// [`SegmentedBeam::parts`] of B, E4 or Es alone.
    pub fn parts_into(self, bar: &Bar, n: usize, parts: &mut Vec<BeamSegment>) {
        parts.clear();
        match self {
            Self::B => parts.extend(rods(bar, &middles(n, bar.length / n as f64))),
            _ => parts.extend(self.points(bar, n)),
        }
    }

    /// Segment `k` of `n` as a joint with three directions. With S the flexibility over (g, p), K = S⁻¹; the second-order
    /// strain gives the chord of the bent and sheared segment its length:
    /// ```text
    /// e_u = u − h·p²/8 + g²/2h + h·p_t²/24 + 0.6·g_t²/h + (e_a + e_b)·p_t/2 − (g_t + e_b − e_a)²/2h
    /// p_t = M·h/EI,  g_t = V·h³/12EI,  e = (1 − 12σ)·h²/24·κ at inner nodes, 0 at the ends
    /// ```
    fn elastic(self, bar: &Bar, n: usize, k: usize) -> SegmentJoint {
        let h = bar.length / n as f64;
        let at = (k as f64 + 0.5) * h;
        let unit = h * h * h / bar.ei;
        let axial = bar.ea / h;
        let joint = |flexibility: Matrix2<f64>, rest: f64| {
            let bend = flexibility.try_inverse().unwrap_or_else(Matrix2::zeros);
            let mut stiffness = Matrix3::zeros();
            stiffness[(0, 0)] = axial;
            stiffness.fixed_view_mut::<2, 2>(1, 1).copy_from(&bend);
            let turn = Vector2::new(bend[(1, 0)], bend[(1, 1)]) * (h / bar.ei);
            let shear = Vector2::new(bend[(0, 0)], bend[(0, 1)]) * (unit / 12.0);
            let node = |inner: bool, side: f64| {
                if inner { (turn + shear * (side * 6.0 / h)) * (rest * h / 24.0) } else { Vector2::zeros() }
            };
            let (a, b) = (node(k > 0, 1.0), node(k + 1 < n, -1.0));
            let across = shear + b - a;
            let outer = |x: &Vector2<f64>, y: &Vector2<f64>| x * y.transpose();
            let second = Matrix2::from_diagonal(&Vector2::new(0.5 / h, -h / 8.0))
                + outer(&turn, &turn) * (h / 24.0)
                + outer(&shear, &shear) * (0.6 / h)
                + (outer(&(a + b), &turn) + outer(&turn, &(a + b))) * 0.25
                - outer(&across, &across) * (0.5 / h);
            SegmentJoint { at, length: h, stiffness, second, locked: [false; 3] }
        };
        if self == Self::Es {
            let left_out = 1.0 - 12.0 * SIGMA;
            let end = |is: bool| if is { left_out / 24.0 } else { 0.0 };
            let (start, stop) = (end(k == 0), end(k + 1 == n));
            let gg = (SIGMA + start + stop) * unit + h * bar.shear;
            let gp = (start - stop) * h * h / bar.ei;
            return joint(Matrix2::new(gg, gp, gp, h / bar.ei), left_out);
        }
        if bar.shear > 0.0 {
            return joint(Matrix2::new(unit / 12.0 + h * bar.shear, 0.0, 0.0, h / bar.ei), 0.0);
        }
        SegmentJoint {
            at,
            length: h,
            stiffness: Matrix3::from_diagonal(&[axial, 12.0 * bar.ei / (h * h * h), bar.ei / h].into()),
            second: Matrix2::new(0.6 / h, 0.0, 0.0, -h / 12.0),
            locked: [false; 3],
        }
    }

    /// Masses at the nodes: E4 or Es.
    fn points(self, bar: &Bar, n: usize) -> impl Iterator<Item = BeamSegment> {
        (0..=n).map(move |k| self.point(bar, n, k))
    }

    /// Mass at node `k` of `n` segments: E4 or Es.
    pub(super) fn point(self, bar: &Bar, n: usize, k: usize) -> BeamSegment {
        let h = bar.length / n as f64;
        let unit = bar.line_mass * h;
        let (mass, first, second) = if self == Self::Es { tuned(n, k) } else { shares(n, k, bar.end_excess) };
        let mass = mass * unit;
        BeamSegment {
            at: k as f64 * h,
            mass,
            first: first * h * unit,
            second: second * h * h * unit + bar.rotary * mass,
        }
    }
}

/// σ of Es, a shear flexibility σ·h³/EI; with [`ALPHA`] it makes the inner eigenvalue error O((kh)⁶):
/// α + σ = 1/12, α·σ = 1/720.
const SIGMA: f64 = (1.0 - SQRT_FIFTH) / 24.0;
/// α of Es, a rotary inertia α·ρA·h³.
const ALPHA: f64 = (1.0 + SQRT_FIFTH) / 24.0;
const SQRT_FIFTH: f64 = 0.447_213_595_499_957_9;

/// Mass, first and second moment of E4 about node `k` of `n` segments, in units of ρA·h, ρA·h², ρA·h³. `excess`: [`Bar::end_excess`].
fn shares(n: usize, k: usize, excess: [f64; 2]) -> (f64, f64, f64) {
    let gauss = 0.5 - 0.5 / 3f64.sqrt();
    match (n, k) {
        (1, 0) => (0.5, 0.5 * gauss, 0.5 * gauss * gauss),
        (1, _) => (0.5, -0.5 * gauss, 0.5 * gauss * gauss),
        _ => {
            let [start, end] = [end_share(k, excess[0]), end_share(n - k, excess[1])];
            (1.0 + start.0 + end.0, start.1 - end.1, start.2 + end.2)
        }
    }
}

/// Mass, first moment inwards and second moment that an end adds to the mass 1 of the node so many segments away: [`super::end_masses`].
fn end_share(away: usize, excess: f64) -> (f64, f64, f64) {
    match away {
        0 => (excess - 0.5, 1.0 / 12.0 + excess, excess),
        1 => (-excess, 0.0, 0.0),
        _ => (0.0, 0.0, 0.0),
    }
}

/// The same of Es.
fn tuned(n: usize, k: usize) -> (f64, f64, f64) {
    match k {
        0 => (0.5, 0.5 * (ALPHA + 1.0 / 6.0), 0.5 * ALPHA),
        k if k == n => (0.5, -0.5 * (ALPHA + 1.0 / 6.0), 0.5 * ALPHA),
        _ => (1.0, 0.0, ALPHA),
    }
}

fn middles(n: usize, h: f64) -> Vec<f64> {
    (0..n).map(|k| (k as f64 + 0.5) * h).collect()
}

/// Rods between the joints; the outer ones belong to the end nodes.
pub(super) fn rods(bar: &Bar, places: &[f64]) -> Vec<BeamSegment> {
    let count = places.len();
    (0..=count)
        .map(|k| {
            let from = if k == 0 { 0.0 } else { places[k - 1] };
            let to = if k == count { bar.length } else { places[k] };
            let (length, middle) = (to - from, 0.5 * (from + to));
            // the outer ones are attached to the ends
            let at = if k == count { bar.length } else { middle * f64::from(u8::from(k > 0)) };
            let (mass, off) = (length * bar.line_mass, middle - at);
            let second = mass * (length * length / 12.0 + off * off + bar.rotary);
            BeamSegment { at, mass, first: mass * off, second }
        })
        .collect()
}

/// A joint that only turns.
fn turning(bar: &Bar, at: f64, h: f64) -> SegmentJoint {
    let stiff = PENALTY * bar.ea / h;
    SegmentJoint {
        at,
        length: h,
        stiffness: Matrix3::from_diagonal(&[stiff, stiff, bar.ei / h].into()),
        second: Matrix2::zeros(),
        locked: [true, true, false],
    }
}

/// The end correction of C1: the flexibilities of the two joints next to each end grow by h/24EI·[[3, −2], [−2, 1]].
fn couple_ends(pins: &mut [SegmentJoint], unit: f64) -> Vec<(usize, usize, f64)> {
    let n = pins.len();
    // ends that share a joint are one block
    let ends = if n < 4 { vec![(0, n)] } else { vec![(0, 2), (n - 2, n)] };
    let mut couplings = Vec::new();
    for (start, stop) in ends {
        let size = stop - start;
        let mut flexibility = DMatrix::<f64>::identity(size, size);
        for (outer, inner, here) in [(0, 1, start == 0), (size - 1, size - 2, stop == n)] {
            if here {
                flexibility[(outer, outer)] += 3.0 / 24.0;
                flexibility[(inner, inner)] += 1.0 / 24.0;
                flexibility[(outer, inner)] -= 2.0 / 24.0;
                flexibility[(inner, outer)] -= 2.0 / 24.0;
            }
        }
        let Some(stiffness) = flexibility.try_inverse() else { continue };
        for i in 0..size {
            pins[start + i].stiffness[(2, 2)] = stiffness[(i, i)] * unit;
            for j in i + 1..size {
                couplings.push((start + i, start + j, stiffness[(i, j)] * unit));
            }
        }
    }
    couplings
}

#[cfg(test)]
mod tests {
    use super::*;

    const BAR: Bar =
        Bar { length: 3.0, ea: 7.0, ei: 2.0, shear: 0.0, line_mass: 1.5, rotary: 0.0, end_excess: [POINT_EXCESS; 2] };

    /// Mass and first moment of the whole beam are exact for every scheme and number of segments, the second moment too but
    /// for Es, whose rotary inertia is tuned.
    #[test]
    fn moments_are_exact() {
        for scheme in Scheme::ALL {
            for n in (1..12).map(|n| scheme.segments(n)) {
                for wall in [false, true] {
                    let (mut mass, mut first, mut second) = (0.0, 0.0, 0.0);
                    let cut = scheme.cut(&BAR, n, wall);
                    for p in &cut.parts {
                        mass += p.mass;
                        first += p.mass * p.at + p.first;
                        second += p.mass * p.at * p.at + 2.0 * p.first * p.at + p.second;
                    }
                    assert!((mass - 4.5).abs() < 1e-12, "{scheme:?} {n}");
                    assert!((first - 6.75).abs() < 1e-12, "{scheme:?} {n}: {first}");
                    let tolerance = if scheme == Scheme::Es { 2.0 / (n * n) as f64 } else { 1e-12 };
                    assert!((second - 13.5).abs() < tolerance * 13.5, "{scheme:?} {n}: {second}");
                }
            }
        }
    }

    /// The general formula of the second-order strain gives E4 its 0.6·g²/h − h·p²/12.
    #[test]
    fn second_order_strain_of_a_slender_segment() {
        let plain = Scheme::E4.elastic(&BAR, 4, 1);
        let general = Scheme::E4.elastic(&Bar { shear: 1e-14, ..BAR }, 4, 1);
        assert!((plain.second - general.second).norm() < 1e-12);
        assert!((plain.stiffness - general.stiffness).norm() < 1e-10);
    }
}
