//! Which beams meet where, what kind of junction that is, and what it does to their ends and to the mass.
//!
//! | beams at a node | rows of the table |
//! |---|---|
//! | one, at an anchor, a plate, a rigid link or a guide that holds the angle | the clamped end; at an elastic anchor [`anchor_root`] |
//! | two | the corner, by turn and ratio of widths; turn 0 is a step of the width, and nothing without one |
//! | three or more, two of them in line within 50° | these are a bar; each other one is a stem, each half of the bar feels every stem |
//! | four, two and two in line | a cross |
//! | otherwise | each branch has a corner with the widest of the others: a makeshift |
//!
//! Where a bar changes its width, the step is added, as far as no stem covers it. Offsets of one beam take at most nine
//! tenths of its length: more is cut down in proportion. A node whose beams all lie on one rigid part has no junction of its
//! own: there each beam ends where it is drawn. Springs of negative compliance are made up for by longer offsets, within the
//! same limit.
//!
//! Not in the table: Poisson's ratios other than 0.3, branches of different stiffness or thickness (each takes its own),
//! ratios of widths beyond 8 and stems that lean by more than 45° (the last row holds).

use super::anchor_root;
use super::bar::bar;
use super::junction_mass::{self, Excess, Meetings};
use super::junction_springs::{JunctionEnd, corner, interpolate};
use super::junction_table as table;
use super::overlap::{IN_LINE, Strip, turn};
use super::rigid::RigidGroups;
use super::scheme::Bar;
use crate::options::{CompileOptions, Junctions};
use bimorph_base::budget;
use bimorph_structure::{Beam, Structure};
use std::f64::consts::PI;

/// Fraction of a beam that its two offsets may take together.
const MAX_OFFSET_FRACTION: f64 = 0.9;
/// Most cached kinds of beams with settled ends.
const MAX_CACHED_ENDS: usize = 16;

/// One beam as its junction sees it.
#[derive(Debug, Clone, Copy)]
struct JunctionBeam {
    beam: usize,
    /// 0 where the beam starts, 1 where it ends.
    end: usize,
    /// Direction from the node outwards (rad).
    angle: f64,
    width: f64,
}

/// Those of each node, one node after the other.
struct JunctionBeams {
    start: Vec<usize>,
    all: Vec<JunctionBeam>,
}

impl JunctionBeams {
    fn new(structure: &Structure) -> Self {
        let ends = |beam: &Beam| [beam.a.0, beam.b.0];
        let mut start = vec![0; structure.nodes.len() + 1];
        for node in structure.beams.iter().flat_map(ends) {
            start[node + 1] += 1;
        }
        for k in 0..structure.nodes.len() {
            start[k + 1] += start[k];
        }
        let mut at = start.clone();
        let mut all = vec![JunctionBeam { beam: 0, end: 0, angle: 0.0, width: 0.0 }; 2 * structure.beams.len()];
        for (k, beam) in structure.beams.iter().enumerate() {
            for (end, node) in ends(beam).into_iter().enumerate() {
                all[at[node]] = JunctionBeam { beam: k, end, angle: beam.angle + PI * end as f64, width: beam.width };
                at[node] += 1;
            }
        }
        Self { start, all }
    }

    fn of(&self, node: usize) -> &[JunctionBeam] {
        &self.all[self.start[node]..self.start[node + 1]]
    }
}

/// Effects of junctions on a structure.
#[derive(Debug, Clone)]
pub struct JunctionEnds {
    /// For each beam, its start and its end.
    pub beams: Vec<[JunctionEnd; 2]>,
    /// Junctions with two beams or more.
    pub(super) meetings: Meetings,
    /// Mass and drag that are drawn twice there.
    pub(super) excess: Vec<Excess>,
    /// Beams whose offsets were cut down.
    pub(super) cut: Vec<usize>,
}

/// Finds the junctions of a drawing.
pub fn find(structure: &Structure, rigid: &RigidGroups, options: &CompileOptions) -> JunctionEnds {
    let CompileOptions { junctions: kind, undamped, .. } = *options;
    let beams = vec![[JunctionEnd::default(); 2]; structure.beams.len()];
    let mut ends = JunctionEnds { beams, meetings: Meetings::default(), excess: Vec::new(), cut: Vec::new() };
    let roots = anchor_root::undercuts(structure, options.anchors);
    if kind == Junctions::Centreline && roots.iter().all(Option::is_none) {
        return ends;
    }
    let held = rigid_nodes(structure, rigid);
    let at = JunctionBeams::new(structure);
    let mut guided = vec![false; structure.nodes.len()];
    for support in structure.supports.iter().filter(|s| s.held[2]) {
        guided[support.node.0] = true;
    }
    for node in 0..structure.nodes.len() {
        let branches = at.of(node);
        if let Some(undercut) = roots[node] {
            for b in branches {
                let (beam, end) = (&structure.beams[b.beam], &mut ends.beams[b.beam][b.end]);
                end.add(&anchor_root::row(beam, undercut), beam, b.width, false);
                end.elastic = true;
            }
        } else if kind == Junctions::Centreline {
            // meets in a point
        } else if held[node] || (branches.len() == 1 && guided[node]) {
            for b in branches {
                ends.beams[b.beam][b.end].add(&table::CLAMP, &structure.beams[b.beam], b.width, false);
            }
        } else if branches.len() > 1 {
            meet(branches, &structure.beams, &mut ends.beams);
            let strip = |b: &JunctionBeam| (Strip { angle: b.angle, width: b.width, weight: 1.0 }, b.beam);
            ends.meetings.add(node, branches.iter().map(strip));
        } else if let [b] = branches {
            ends.beams[b.beam][b.end].free = true;
        }
    }
    settle_all(&structure.beams, kind, &mut ends);
    if kind != Junctions::Centreline {
        ends.excess = junction_mass::find(structure, &ends.beams, &ends.meetings, undamped);
    }
    ends
}

/// Cuts offsets down where a beam has no room for them, and settles the springs of its ends.
fn settle_all(beams: &[Beam], kind: Junctions, ends: &mut JunctionEnds) {
    // beams of a drawing are mostly alike
    let mut known: Vec<(Bar, [JunctionEnd; 2], [JunctionEnd; 2])> = Vec::new();
    for (k, (beam, both)) in beams.iter().zip(&mut ends.beams).enumerate() {
        let share = (both[0].offset + both[1].offset) / (MAX_OFFSET_FRACTION * beam.length);
        if share > 1.0 {
            ends.cut.push(k);
        }
        let bar = bar(beam, true, true);
        if let Some((.., settled)) = known.iter().find(|(other, raw, _)| (other, raw) == (&bar, &*both)) {
            *both = *settled;
            continue;
        }
        let raw = *both;
        let taken = (raw[0].offset + raw[1].offset) / share.max(1.0);
        let room = 0.5 * (MAX_OFFSET_FRACTION * beam.length - taken).max(0.0);
        for end in &mut *both {
            if share > 1.0 {
                end.offset /= share;
            }
            match kind {
                Junctions::Calibrated => end.settle(beam, room),
                _ if end.elastic => end.settle(beam, room),
                _ => end.spring.fill(0.0),
            }
        }
        if known.len() < MAX_CACHED_ENDS {
            known.push((bar, raw, *both));
        }
    }
}

/// Nodes on anchors, plates and rigid links: beams end there where they are drawn.
fn rigid_nodes(structure: &Structure, rigid: &RigidGroups) -> Vec<bool> {
    let mut held: Vec<bool> = (0..structure.nodes.len()).map(|n| rigid.grounded(n)).collect();
    for link in &structure.links {
        held[link.a.0] = true;
        held[link.b.0] = true;
    }
    for mass in structure.masses.iter().filter(|m| m.outline[0] > 0.0 && m.outline[1] > 0.0) {
        held[mass.node.0] = true;
    }
    held
}

/// Adds what a junction does to the ends of its branches.
fn meet(branches: &[JunctionBeam], beams: &[Beam], ends: &mut [[JunctionEnd; 2]]) {
    let mut add = |b: &JunctionBeam, row: &table::ComplianceRow, other: f64, mirrored: bool| {
        ends[b.beam][b.end].add(row, &beams[b.beam], other, mirrored);
    };
    let pairs = if branches.len() > 2 { in_line(branches) } else { Vec::new() };
    match (branches, pairs.as_slice()) {
        ([a, b], _) => {
            let between = turn(a.angle, b.angle).to_degrees();
            for (one, other) in [(a, b), (b, a)] {
                let row = corner(other.width / one.width, between);
                add(one, &row, other.width, left_of(one, other) < 0.0);
            }
        }
        ([_, _, _, _], &[(a, b), (c, d)]) => {
            for ((a, b), (c, d)) in [((a, b), (c, d)), ((c, d), (a, b))] {
                let wide = branches[c].width.max(branches[d].width);
                for k in [a, b] {
                    let own = &branches[k];
                    let tilt = -0.5 * (angle_to(own, &branches[c]) + angle_to(own, &branches[d])).to_degrees();
                    let row = interpolate(&table::CROSS, wide / own.width, &table::TILTS, tilt.abs());
                    add(own, &row, wide, tilt < 0.0);
                }
                step(&branches[a], &branches[b], wide, &mut add);
            }
        }
        (_, &[(a, b), ..]) => {
            let (i, j) = (&branches[a], &branches[b]);
            let wide = i.width.max(j.width);
            let mut covered: f64 = 0.0;
            for (k, stem) in branches.iter().enumerate() {
                if k == a || k == b {
                    continue;
                }
                covered = covered.max(stem.width);
                // half the difference of the angles to both halves: positive when it leans towards i
                let lean = 0.5 * (angle_to(stem, j).abs() - angle_to(stem, i).abs()).to_degrees();
                let near = if lean > 0.0 { i } else { j };
                let row = interpolate(&table::STEM, wide / stem.width, &table::TILTS, lean.abs());
                add(stem, &row, wide, left_of(stem, near) > 0.0);
                for (half, lean) in [(i, lean), (j, -lean)] {
                    let row = interpolate(&table::BAR, stem.width / half.width, &table::LEANS, lean);
                    add(half, &row, stem.width, left_of(half, stem) < 0.0);
                }
            }
            step(i, j, covered, &mut add);
        }
        _ => {
            for (k, own) in branches.iter().enumerate() {
                let others = branches.iter().enumerate().filter(|&(i, _)| i != k).map(|(_, b)| b);
                if let Some(other) = others.max_by(|a, b| a.width.total_cmp(&b.width)) {
                    let between = turn(own.angle, other.angle).to_degrees();
                    let row = corner(other.width / own.width, between);
                    add(own, &row, other.width, left_of(own, other) < 0.0);
                }
            }
        }
    }
}

/// The step in the width of a bar, as far as what crosses it does not cover it.
fn step(
    a: &JunctionBeam,
    b: &JunctionBeam,
    covered: f64,
    add: &mut impl FnMut(&JunctionBeam, &table::ComplianceRow, f64, bool),
) {
    let open = 1.0 - covered / a.width.max(b.width);
    if open <= 0.0 || a.width == b.width {
        return;
    }
    for (one, other) in [(a, b), (b, a)] {
        let mut row = corner(other.width / one.width, 0.0);
        row.iter_mut().for_each(|x| *x *= open);
        add(one, &row, other.width, false);
    }
}

/// Pairs of branches that continue in line, the straightest first; a branch is in one pair at most.
fn in_line(branches: &[JunctionBeam]) -> Vec<(usize, usize)> {
    let mut found: Vec<(f64, usize, usize)> = Vec::new();
    for i in 0..branches.len() {
        budget::check();
        budget::lay_out((branches.len() - i - 1) * size_of::<(f64, usize, usize)>());
        for j in i + 1..branches.len() {
            let turn = turn(branches[i].angle, branches[j].angle);
            if turn < IN_LINE {
                found.push((turn, i, j));
            }
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut taken = vec![false; branches.len()];
    let mut pairs = Vec::new();
    for (_, i, j) in found {
        if !taken[i] && !taken[j] {
            (taken[i], taken[j]) = (true, true);
            pairs.push((i, j));
        }
    }
    pairs
}

/// Angle from one branch to another, counterclockwise, −π…π (rad).
fn angle_to(from: &JunctionBeam, to: &JunctionBeam) -> f64 {
    (to.angle - from.angle + PI).rem_euclid(2.0 * PI) - PI
}

/// Positive where the other branch lies on the left of the first.
fn left_of(from: &JunctionBeam, to: &JunctionBeam) -> f64 {
    (to.angle - from.angle).sin()
}
