//! Limbs: stretches of the medial axis along which a part is a strip.
//!
//! An edge of the axis between two sides that face each other is a straight strip with an exact centreline; pieces of
//! one line that only a corner on one side interrupts are one. A piece is a limb when it is long enough for its width,
//! or one of several that follow a curve. The areas between limbs are the joints.

use super::medial::BoundarySite;
use super::moments::Moments;
use super::skeleton::Skeleton;

/// Largest change of half the width along a strip (1).
const TAPER: f64 = 0.15;
/// Length over width from which a strip between two joints is a limb (1).
const CONNECTING: f64 = 0.75;
/// The same for one that ends freely (1).
const ENDING: f64 = 1.0;
/// Pieces of one line may lie off it by this many database units, which rounding to the grid does, and this fraction of the width.
const OFF: [f64; 2] = [2.0, 2e-3];
/// Largest turn between two pieces of a curve (rad).
const BEND: f64 = 0.55;
/// Largest change of the width between two pieces of a curve (1).
const SWELL: f64 = 0.1;

/// A straight strip.
#[derive(Debug, Clone)]
pub(super) struct Limb {
    /// Ends of the centreline as far as both sides face each other.
    pub(super) ends: [[f64; 2]; 2],
    /// Width at both ends.
    pub(super) width: [f64; 2],
    /// Vertices of the axis at both ends.
    pub(super) vertices: [u32; 2],
    /// At each end, the sides to the left and to the right (along `ends`).
    pub(super) sides: [[u32; 2]; 2],
    /// Edges of the axis in it.
    pub(super) edges: Vec<u32>,
    /// The area between its sides.
    pub(super) cell: Moments,
}

impl Limb {
    /// Length of the centreline.
    pub(super) fn length(&self) -> f64 {
        let [a, b] = self.ends;
        (b[0] - a[0]).hypot(b[1] - a[1])
    }

    /// Direction of the centreline.
    pub(super) fn direction(&self) -> [f64; 2] {
        let ([a, b], l) = (self.ends, self.length());
        [(b[0] - a[0]) / l, (b[1] - a[1]) / l]
    }

    fn widest(&self) -> f64 {
        self.width[0].max(self.width[1])
    }

    /// Distance of a point from the line.
    fn off(&self, p: [f64; 2]) -> f64 {
        let ([x, y], a) = (self.direction(), self.ends[0]);
        (x * (p[1] - a[1]) - y * (p[0] - a[0])).abs()
    }

    fn continues(&self, next: &Self) -> bool {
        let (d, e) = (self.direction(), next.direction());
        let allowed = OFF[0] + OFF[1] * self.widest();
        let slope = |l: &Self| (l.width[1] - l.width[0]) / l.length();
        let long = if self.length() > next.length() { (self, next) } else { (next, self) };
        let turned = d[0] * e[1] - d[1] * e[0];
        d[0] * e[0] + d[1] * e[1] > 0.0
            && turned.abs() * long.1.length() <= 2.0 * allowed
            && long.1.ends.iter().all(|p| long.0.off(*p) <= allowed)
            && (self.width[1] - next.width[0]).abs() <= 2.0 * allowed
            && (slope(self) - slope(next)).abs() * long.1.length() <= 2.0 * allowed
    }
}

/// One step along a chain.
#[derive(Debug, Clone, Copy)]
struct ChainStep {
    edge: u32,
    from: u32,
    to: u32,
}

/// All limbs of a skeleton.
pub(super) fn limbs(skeleton: &Skeleton<'_>) -> Vec<Limb> {
    let mut found = Vec::new();
    for chain in chains(skeleton) {
        let ending = [chain[0].from, chain[chain.len() - 1].to].iter().any(|v| skeleton.degree(*v) == 1);
        let least = if ending { ENDING } else { CONNECTING };
        let pieces = pieces(skeleton, &chain);
        let curved = curves(&pieces);
        let chosen = pieces.into_iter().zip(curved).filter(|(p, curved)| *curved || p.length() >= least * p.widest());
        found.extend(chosen.map(|(piece, _)| piece));
    }
    found
}

/// Paths between vertices where the skeleton ends or branches, and closed rings.
fn chains(skeleton: &Skeleton<'_>) -> Vec<Vec<ChainStep>> {
    let mut done: Vec<bool> = skeleton.alive.iter().map(|alive| !alive).collect();
    let mut found = Vec::new();
    let count = skeleton.axis.vertices.len() as u32;
    for rings in [false, true] {
        for v in 0..count {
            if !rings && matches!(skeleton.degree(v), 0 | 2) {
                continue;
            }
            let around: Vec<u32> = skeleton.around(v).collect();
            for first in around {
                let (mut chain, mut from, mut edge) = (Vec::new(), v, first);
                while !done[edge as usize] {
                    done[edge as usize] = true;
                    let to = skeleton.across(edge, from);
                    chain.push(ChainStep { edge, from, to });
                    if skeleton.degree(to) != 2 {
                        break;
                    }
                    let Some(next) = skeleton.around(to).find(|e| *e != edge) else { break };
                    (from, edge) = (to, next);
                }
                if !chain.is_empty() {
                    found.push(chain);
                }
            }
        }
    }
    found
}

/// The straight strips of a chain, those of one line joined.
fn pieces(skeleton: &Skeleton<'_>, chain: &[ChainStep]) -> Vec<Limb> {
    let mut pieces: Vec<Limb> = Vec::new();
    // edges since the last piece, with their length
    let (mut between, mut gap) = (Vec::new(), 0.0);
    for step in chain {
        let length = skeleton.length(step.edge);
        if let Some(piece) = straight(skeleton, step, length) {
            match pieces.last_mut() {
                Some(last) if gap <= last.widest() && last.continues(&piece) => {
                    between.push(step.edge);
                    for e in &between {
                        last.cell += skeleton.axis.edges[*e as usize].cell;
                    }
                    last.edges.append(&mut between);
                    last.ends[1] = piece.ends[1];
                    last.width[1] = piece.width[1];
                    last.vertices[1] = piece.vertices[1];
                    last.sides[1] = piece.sides[1];
                }
                _ => pieces.push(piece),
            }
            between.clear();
            gap = 0.0;
        } else {
            between.push(step.edge);
            gap += length;
        }
    }
    pieces
}

/// The strip of one edge, if it is one.
fn straight(skeleton: &Skeleton<'_>, step: &ChainStep, length: f64) -> Option<Limb> {
    let axis = skeleton.axis;
    let edge = &axis.edges[step.edge as usize];
    let [BoundarySite::Side(first), BoundarySite::Side(second)] = edge.sites else { return None };
    let [u, v] = [step.from, step.to].map(|v| skeleton.vertex(v));
    if length <= 0.0 || (u.r - v.r).abs() > TAPER * length || u.r.min(v.r) <= 0.0 {
        return None;
    }
    let d = [(v.at[0] - u.at[0]) / length, (v.at[1] - u.at[1]) / length];
    let [a, b] = axis.side(first);
    let along = d[0] * (b[0] - a[0]) + d[1] * (b[1] - a[1]);
    // the inside lies to the left of a side: one that runs along the axis is on its right
    let sides = if along > 0.0 { [second, first] } else { [first, second] };
    Some(Limb {
        ends: [u.at, v.at],
        width: [2.0 * u.r, 2.0 * v.r],
        vertices: [step.from, step.to],
        sides: [sides; 2],
        edges: vec![step.edge],
        cell: edge.cell,
    })
}

/// Which pieces are part of a curve: at least three that follow each other closely with small turns and little change of width, as
/// long together as the strip is wide.
fn curves(pieces: &[Limb]) -> Vec<bool> {
    let follows = |p: &Limb, q: &Limb| {
        let (d, e) = (p.direction(), q.direction());
        let gap = (p.ends[1][0] - q.ends[0][0]).hypot(p.ends[1][1] - q.ends[0][1]);
        d[0] * e[0] + d[1] * e[1] > BEND.cos()
            && gap <= 0.5 * p.widest().min(q.widest())
            && (p.width[1] - q.width[0]).abs() <= SWELL * p.widest()
    };
    let mut curved = vec![false; pieces.len()];
    let mut first = 0;
    while first < pieces.len() {
        let mut last = first;
        while last + 1 < pieces.len() && follows(&pieces[last], &pieces[last + 1]) {
            last += 1;
        }
        let run = &pieces[first..=last];
        let length: f64 = run.iter().map(Limb::length).sum();
        if run.len() >= 3 && length >= run[0].widest() {
            curved[first..=last].fill(true);
        }
        first = last + 1;
    }
    curved
}
