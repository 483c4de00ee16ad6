//! Edges of different parts that face each other across a narrow gap: capacitors.
//!
//! A face is a side of a limb, or what a rigid body has of a side of the outline. Two antiparallel faces at most
//! [`WIDEST`] apart that overlap over at least [`SLENDER`] gaps are plates. Of several faces one behind the other, the
//! nearest counts.

use super::boxes::{self, Boxes, Extent};
use super::combs::FingerArray;
use super::joints::JointRole;
use super::medial::BoundarySite;
use super::part::Part;
use bimorph_base::budget;
use std::collections::BTreeMap;

/// Widest gap (m).
pub(super) const WIDEST: f64 = 10e-6;
/// Least length over gap (1).
const SLENDER: f64 = 3.0;
/// Sine of the angle between faces.
const PARALLEL: f64 = 0.01;
/// Pieces of a gap along a beam that bends.
const PIECES: usize = 8;

/// One side of a part, with the part on its left.
#[derive(Debug, Clone, Copy)]
struct Face {
    part: usize,
    a: [f64; 2],
    b: [f64; 2],
    /// Width of the limb whose side it is; none for a body.
    limb: Option<f64>,
    /// Mean depth of the part behind it.
    depth: f64,
}

/// A place where something pulls at a part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pull {
    pub(super) part: usize,
    pub(super) at: [f64; 2],
    /// On the centreline of a limb, not at the end of an arm.
    pub(super) on_axis: bool,
}

/// A capacitor.
#[derive(Debug, Clone)]
pub(super) enum Gap {
    /// Lumped plates: places on both parts across the gap, length, mean depth of the parts behind it, gap.
    Plates { pulls: [Pull; 2], length: f64, depth: f64, gap: f64 },
    /// Along a beam: places along it, those across the gap, widths, gap.
    Beams { upper: Vec<Pull>, lower: Vec<Pull>, width: [f64; 2], gap: f64 },
}

impl Gap {
    /// The places of its pulls, in the order of their nodes.
    pub(super) fn pulls(&self) -> impl Iterator<Item = &Pull> {
        let (some, more): (&[Pull], &[Pull]) = match self {
            Self::Plates { pulls, .. } => (pulls, &[]),
            Self::Beams { upper, lower, .. } => (upper, lower),
        };
        some.iter().chain(more)
    }
}

/// All capacitors between parts of which at least one moves; `moves` says which do, `widest` is in database units.
pub(super) fn gaps(parts: &[Part], moves: &[bool], combs: &[FingerArray], widest: f64) -> Vec<Gap> {
    let faces: Vec<Face> = parts.iter().enumerate().flat_map(|(k, part)| faces(k, part)).collect();
    let extents: Vec<Extent> = faces
        .iter()
        .map(|f| {
            let [low, high] = boxes::around([f.a, f.b]);
            [low.map(|x| x - widest), high.map(|x| x + widest)]
        })
        .collect();
    let tree = Boxes::of(&extents);
    let fingers: BTreeMap<[usize; 2], f64> = combs.iter().map(|c| (c.parts, c.gap)).collect();
    let mut found = Vec::new();
    for (i, f) in faces.iter().enumerate() {
        budget::check();
        let d = [f.b[0] - f.a[0], f.b[1] - f.a[1]];
        let long = d[0].hypot(d[1]);
        let u = [d[0] / long, d[1] / long];
        // stretch along f, gap, other face
        let mut across: Vec<(f64, [f64; 2], usize)> = Vec::new();
        for j in tree.overlapping(&boxes::around([f.a, f.b])).into_iter().map(|j| j as usize) {
            let g = &faces[j];
            let seen = |p: [f64; 2]| {
                let e = [p[0] - f.a[0], p[1] - f.a[1]];
                [e[0] * u[0] + e[1] * u[1], e[0] * u[1] - e[1] * u[0]]
            };
            let (p, q) = (seen(g.a), seen(g.b));
            let run = p[0] - q[0];
            if i == j || run <= 0.0 || (p[1] - q[1]).abs() > PARALLEL * run {
                continue;
            }
            let stretch = [q[0].max(0.0), p[0].min(long)];
            let gap = 0.5 * (p[1] + q[1]);
            if gap > 0.0 && gap <= widest && stretch[1] - stretch[0] > 0.0 {
                across.push((gap, stretch, j));
            }
        }
        across.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
        let mut covered: Vec<[f64; 2]> = Vec::new();
        for (gap, [mut from, mut to], j) in across {
            for c in &covered {
                // what is left of a stretch in part behind another is its longer end
                if c[0] < to && c[1] > from {
                    if c[0] - from >= to - c[1] { to = c[0] } else { from = c[1] }
                }
            }
            let g = &faces[j];
            covered.push([from, to]);
            let bends = |face: &Face| moves[face.part] && face.limb.is_some();
            // each pair once: from the one that bends, else from the first
            let first = match (bends(f), bends(g)) {
                (true, false) => true,
                (false, true) => false,
                _ => i < j,
            };
            let between = [f.part.min(g.part), f.part.max(g.part)];
            let wanted = f.part != g.part && (moves[f.part] || moves[g.part]) && to - from >= SLENDER * gap;
            if first && wanted && fingers.get(&between).is_none_or(|width| gap < 2.0 * width) {
                found.push(capacitor(f, g, u, [from, to], gap, bends(f), bends(g)));
            }
        }
    }
    found
}

fn capacitor(f: &Face, g: &Face, u: [f64; 2], [from, to]: [f64; 2], gap: f64, bends: bool, other_bends: bool) -> Gap {
    // outwards from f
    let n = [u[1], -u[0]];
    let at = |s: f64, out: f64| [f.a[0] + s * u[0] + out * n[0], f.a[1] + s * u[1] + out * n[1]];
    let pull = |part: usize, at: [f64; 2], on_axis: bool| Pull { part, at, on_axis };
    let Some(w) = f.limb.filter(|_| bends) else {
        let middle = 0.5 * (from + to);
        let pulls = [pull(f.part, at(middle, 0.0), false), pull(g.part, at(middle, gap), false)];
        return Gap::Plates { pulls, length: to - from, depth: (f.depth * g.depth).sqrt(), gap };
    };
    let other = g.limb.filter(|_| other_bends);
    let width = [w, other.unwrap_or(w)];
    let stations = (0..=PIECES).map(|k| from + (to - from) * k as f64 / PIECES as f64);
    let (upper, lower) = stations
        .map(|s| {
            let depth = gap + 0.5 * width[1];
            (pull(f.part, at(s, -0.5 * w), true), pull(g.part, at(s, depth), other.is_some()))
        })
        .unzip();
    Gap::Beams { upper, lower, width, gap }
}

fn faces(k: usize, part: &Part) -> Vec<Face> {
    let (axis, found) = (&part.found.0, &part.found.1);
    let origin = part.origin();
    let place = |p: [f64; 2]| [p[0] + origin[0], p[1] + origin[1]];
    let mut faces = Vec::new();
    for (limb, at) in found.limbs.iter().zip(&found.at) {
        let width = 0.5 * (limb.width[0] + limb.width[1]);
        if (limb.width[0] - limb.width[1]).abs() > PARALLEL * limb.length() {
            continue;
        }
        let [p, q] = [0, 1].map(|end| match (&found.joints[at[end]].kind, found.joints[at[end]].ports.len()) {
            (JointRole::Node(tip), 1) => *tip,
            _ => limb.ends[end],
        });
        let d = limb.direction();
        let r = [0.5 * width * d[1], -0.5 * width * d[0]];
        let shifted = |p: [f64; 2], s: f64| place([p[0] + s * r[0], p[1] + s * r[1]]);
        faces.push(Face { part: k, a: shifted(p, 1.0), b: shifted(q, 1.0), limb: Some(width), depth: width });
        faces.push(Face { part: k, a: shifted(q, -1.0), b: shifted(p, -1.0), limb: Some(width), depth: width });
    }
    for joint in found.joints.iter().filter(|joint| matches!(joint.kind, JointRole::Body(_))) {
        let mut of_side: BTreeMap<u32, [f64; 2]> = BTreeMap::new();
        for edge in joint.edges.iter().map(|e| &axis.edges[*e as usize]) {
            for site in edge.sites {
                let BoundarySite::Side(side) = site else { continue };
                let [a, b] = axis.side(side);
                let (d, l2) = ([b[0] - a[0], b[1] - a[1]], (b[0] - a[0]).powi(2) + (b[1] - a[1]).powi(2));
                for v in edge.ends {
                    let foot = axis.foot(site, axis.vertices[v as usize].at);
                    let t = ((foot[0] - a[0]) * d[0] + (foot[1] - a[1]) * d[1]) / l2;
                    let known = of_side.entry(side).or_insert([t, t]);
                    *known = [known[0].min(t), known[1].max(t)];
                }
            }
        }
        for (side, [from, to]) in of_side.into_iter().filter(|(_, [from, to])| to > from) {
            let [a, b] = axis.side(side);
            let at = |t: f64| place([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]);
            let (a, b) = (at(from), at(to));
            let depth = joint.cell.area / (b[0] - a[0]).hypot(b[1] - a[1]);
            faces.push(Face { part: k, a, b, limb: None, depth });
        }
    }
    faces.retain(|f| f.a != f.b);
    faces
}
