//! Mass that is drawn twice, or not at all, where beams meet.
//!
//! Every beam brings its mass up to the node, so that the areas of a T or a cross overlap. At the outer corner of an L, on
//! the other hand, material is missing that is there: the outline fills the corner, each rectangle reaching past the node
//! by (w/2)·tan(turn/2), w the other's width. The difference between the beams' rectangles and their union, with its first
//! and second moment, is integrated over lines across the junction.
//!
//! Where the beams' masses per area differ, the union has the largest of the overlapping ones at each point, and a
//! filled corner has that of the heavier beam. Overlapping shapes are one piece, with the heavier layer continuous.
//! That does not depend on the order in which beams are written.

use super::rigid::Lump;
use nalgebra::Vector2;
use rustc_hash::FxHashMap;
use std::cell::RefCell;
use std::f64::consts::PI;

/// One beam at a junction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strip {
    /// Direction from the node outwards (rad).
    pub angle: f64,
    /// Width (m).
    pub width: f64,
    /// Its mass per area over the largest of the junction's strips (1).
    pub weight: f64,
}

/// Turn below which two branches continue in line and leave no outer corner (rad).
pub const IN_LINE: f64 = 50.0 * PI / 180.0;
/// Sharpest turn whose outer corner is filled (rad).
const MAX_FILLED_TURN: f64 = 2.1;
/// Lines for each band between two corners.
const LINES: usize = 24;

/// By how much a branch of direction `b` departs from going straight on where one of direction `a` ends, 0…π (rad); both
/// seen from the node.
pub fn turn(a: f64, b: f64) -> f64 {
    let between = ((b - a + PI).rem_euclid(2.0 * PI) - PI).abs();
    PI - between
}

/// Most junctions cached by a thread.
const MAX_CACHED_JUNCTIONS: usize = 512;
/// Strips that are looked up without memory of their own.
const FEW: usize = 8;

thread_local! {
    /// Cache of junctions: a structure is discretized on many meshes, and has many equal junctions.
    static KNOWN: RefCell<FxHashMap<Vec<[u64; 3]>, Lump>> = RefCell::default();
}

/// Area, by its weight, that the strips have in excess of their union, with its moments about the node: (m²), (m³), (m⁴).
pub fn overlap(strips: &[Strip]) -> Lump {
    let bits = |s: &Strip| [s.angle.to_bits(), s.width.to_bits(), s.weight.to_bits()];
    let mut few = [[0; 3]; FEW];
    let many: Vec<[u64; 3]>;
    let key: &[[u64; 3]] = if strips.len() <= FEW {
        few.iter_mut().zip(strips).for_each(|(key, strip)| *key = bits(strip));
        &few[..strips.len()]
    } else {
        many = strips.iter().map(bits).collect();
        &many
    };
    if let Some(known) = KNOWN.with_borrow(|known| known.get(key).copied()) {
        return known;
    }
    let found = if strips.iter().all(|s| s.weight == 1.0) {
        integrated(strips)
    } else {
        // lines run across one of the strips: the same one in any order
        let mut sorted = strips.to_vec();
        sorted.sort_by(|a, b| a.angle.total_cmp(&b.angle).then(a.width.total_cmp(&b.width)));
        integrated(&sorted)
    };
    KNOWN.with_borrow_mut(|known| {
        if known.len() >= MAX_CACHED_JUNCTIONS {
            known.clear();
        }
        known.insert(key.to_vec(), found);
    });
    found
}

/// [`overlap`], computed.
fn integrated(strips: &[Strip]) -> Lump {
    let widest = strips.iter().map(|s| s.width).fold(0.0, f64::max);
    let far = 4.0 * widest;
    let (s0, c0) = strips.first().map_or((0.0, 1.0), |s| s.angle.sin_cos());
    let drawn: Vec<Quad> = strips.iter().map(|s| Quad::new(s, strips[0].angle, 0.0, far)).collect();
    let filled: Vec<Quad> =
        (0..strips.len()).map(|k| Quad::new(&strips[k], strips[0].angle, past(strips, k), far)).collect();
    let mut levels: Vec<f64> = drawn.iter().chain(&filled).flat_map(|q| q.0.iter().map(|p| p.y)).collect();
    levels.sort_by(f64::total_cmp);
    // with one weight, what is drawn lies within what is filled
    let alike = strips.iter().all(|s| s.weight == 1.0);
    let mut excess = Lump::default();
    let (mut cuts, mut covered) = (Vec::new(), Vec::new());
    let (mut drawn_sides, mut filled_sides) = (Vec::new(), Vec::new());
    for band in levels.windows(2) {
        let step = (band[1] - band[0]) / LINES as f64;
        if step <= 1e-9 * widest {
            continue;
        }
        bimorph_base::budget::check();
        // no corner lies within a band: its lines cross the same sides
        let middle = 0.5 * (band[0] + band[1]);
        for (quads, sides) in [(&drawn, &mut drawn_sides), (&filled, &mut filled_sides)] {
            sides.clear();
            sides.extend(strips.iter().zip(quads).filter_map(|(s, quad)| Some((quad.sides(middle)?, s.weight))));
        }
        for line in 0..LINES {
            let y = band[0] + (line as f64 + 0.5) * step;
            for (sides, weight) in &drawn_sides {
                if let Some((low, high)) = sides.cut(y) {
                    add(&mut excess, y, low, high, step * weight);
                }
            }
            cuts.clear();
            heaviest_first(if alike { &[] } else { &drawn_sides }, y, &mut cuts);
            heaviest_first(&filled_sides, y, &mut cuts);
            unite(&cuts, &mut covered);
            for &(low, high, weight) in &covered {
                add(&mut excess, y, low, high, -step * weight);
            }
        }
    }
    let first = excess.first;
    excess.first = Vector2::new(c0 * first.x - s0 * first.y, s0 * first.x + c0 * first.y);
    excess
}

/// Adds where a line at the height `y` runs between some sides, with their weights, the heaviest first.
fn heaviest_first(sides: &[(Sides, f64)], y: f64, cuts: &mut Vec<(f64, f64, f64)>) {
    let before = cuts.len();
    let cut = |(sides, weight): &(Sides, f64)| sides.cut(y).map(|(low, high)| (low, high, *weight));
    cuts.extend(sides.iter().filter_map(cut));
    cuts[before..].sort_by(|a, b| b.2.total_cmp(&a.2).then(a.0.total_cmp(&b.0)));
}

/// Puts the union of weighted intervals into `covered` as intervals that do not overlap, in order, each with the weight of the first
/// that covers it.
fn unite(cuts: &[(f64, f64, f64)], covered: &mut Vec<(f64, f64, f64)>) {
    covered.clear();
    for &(mut low, high, weight) in cuts {
        let heavier = covered.len();
        for k in 0..heavier {
            let (from, to, _) = covered[k];
            if from >= high {
                break;
            }
            if from > low {
                covered.push((low, from, weight));
            }
            low = low.max(to);
        }
        if high > low {
            covered.push((low, high, weight));
        }
        covered.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
}

/// How far a strip reaches past the node.
fn past(strips: &[Strip], k: usize) -> f64 {
    let others =
        || strips.iter().enumerate().filter(|&(i, _)| i != k).map(|(_, s)| (turn(strips[k].angle, s.angle), s));
    if strips.len() > 2 && others().any(|(turn, _)| turn < IN_LINE) {
        return 0.0;
    }
    others().map(|(turn, s)| 0.5 * s.width * (0.5 * turn.min(MAX_FILLED_TURN)).tan()).fold(0.0, f64::max)
}

fn add(lump: &mut Lump, y: f64, low: f64, high: f64, height: f64) {
    let length = high - low;
    lump.amount += height * length;
    lump.first += Vector2::new(0.5 * (high * high - low * low), y * length) * height;
    lump.second += height * ((high.powi(3) - low.powi(3)) / 3.0 + y * y * length);
}

/// Four corners in order.
struct Quad([Vector2<f64>; 4]);

impl Quad {
    /// A strip from `past` behind the node to `far`, turned back by `zero`.
    fn new(strip: &Strip, zero: f64, past: f64, far: f64) -> Self {
        let (s, c) = (strip.angle - zero).sin_cos();
        let at = |x: f64, y: f64| Vector2::new(c * x - s * y, s * x + c * y);
        let half = 0.5 * strip.width;
        Self([at(-past, -half), at(far, -half), at(far, half), at(-past, half)])
    }

    /// The two sides that the line at height `y` crosses.
    fn sides(&self, y: f64) -> Option<Sides> {
        let mut crossed = (0..4).map(|k| (self.0[k], self.0[(k + 1) % 4])).filter(|(a, b)| (a.y - y) * (b.y - y) < 0.0);
        let side = |(a, b): (Vector2<f64>, Vector2<f64>)| QuadSide { from: a, along: b - a };
        Some(Sides(side(crossed.next()?), side(crossed.next()?)))
    }
}

/// A side of a quadrilateral: its start and its direction.
struct QuadSide {
    from: Vector2<f64>,
    along: Vector2<f64>,
}

impl QuadSide {
    /// Where it is at height `y`.
    fn at(&self, y: f64) -> f64 {
        self.from.x + self.along.x * (y - self.from.y) / self.along.y
    }
}

/// Two sides of one quadrilateral.
struct Sides(QuadSide, QuadSide);

impl Sides {
    /// Where the line at height `y` runs between them.
    fn cut(&self, y: f64) -> Option<(f64, f64)> {
        let (a, b) = (self.0.at(y), self.1.at(y));
        let (low, high) = (a.min(b), a.max(b));
        (low < high).then_some((low, high))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn excess(strips: &[(f64, f64)]) -> Lump {
        let strips: Vec<Strip> =
            strips.iter().map(|&(degrees, width)| Strip { angle: degrees.to_radians(), width, weight: 1.0 }).collect();
        overlap(&strips)
    }

    /// A T counts half of its square twice, a cross all of it, an L none of it; beams in line nothing at all.
    #[test]
    fn squares() {
        let near = |lump: Lump, area: f64| assert!((lump.amount - area).abs() < 1e-9, "{lump:?} against {area}");
        near(excess(&[(0.0, 2.0), (180.0, 2.0), (90.0, 2.0)]), 2.0);
        near(excess(&[(0.0, 2.0), (180.0, 2.0), (90.0, 3.0)]), 3.0);
        near(excess(&[(0.0, 2.0), (180.0, 2.0), (90.0, 2.0), (270.0, 2.0)]), 4.0);
        near(excess(&[(0.0, 2.0), (180.0, 3.0)]), 0.0);
        let corner = excess(&[(0.0, 2.0), (90.0, 2.0)]);
        near(corner, 0.0);
        // the square at (½, ½) is there twice, that at (−½, −½) not at all: the first moment shows it
        assert!((corner.first - Vector2::new(1.0, 1.0)).norm() < 1e-9, "{corner:?}");
        // with a stem of ten times the mass per area, the bar's half loses its own mass there and the stem nothing
        let tee = |order: [usize; 3]| {
            let of = |k: usize| [(0.0, 0.1), (PI, 0.1), (0.5 * PI, 1.0)][k];
            overlap(&order.map(|k| Strip { angle: of(k).0, width: 2.0, weight: of(k).1 }))
        };
        near(tee([0, 1, 2]), 0.2);
        assert_eq!(tee([2, 0, 1]), tee([0, 1, 2]));
        // turned as a whole, the moments turn with it
        let turned = excess(&[(30.0, 2.0), (120.0, 2.0)]);
        assert!((turned.first.norm() - corner.first.norm()).abs() < 1e-9, "{turned:?}");
    }
}
