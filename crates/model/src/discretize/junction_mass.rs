//! Corrects mass and drag that overlapping beams count twice, or miss, at a junction. Computed once per structure;
//! independent of the mesh.
//!
//! It is taken off the body of the junction's node, of which the beams' rigid ends are the part that no mesh changes.
//! Beams may overlap beyond their rigid ends, for example where one folds straight back over the other. Then the
//! correction is limited to half of the rigid ends' mass, and the overlap further out stays, since fine meshes would
//! otherwise have bodies of negative mass.

use super::beam::drag_per_mass;
use super::junction_springs::JunctionEnd;
use super::overlap::{Strip, overlap, turn};
use super::rigid::{Lump, RigidGroups};
use bimorph_structure::{Beam, Structure};
use nalgebra::Vector2;

/// Sharpest turn up to which beams lie above each other within their rigid ends only (rad).
const MAX_OVERLAP_TURN: f64 = 0.75 * std::f64::consts::PI;
/// Fraction of the mass that beams bring to a junction which it may have twice.
const MAX_MASS: f64 = 0.5;

/// Junctions with two beams or more.
#[derive(Debug, Clone, Default)]
pub(super) struct Meetings {
    /// The node, and how many of the strips are its own.
    nodes: Vec<(usize, usize)>,
    /// The strips of one junction after the other, and the beam of each.
    strips: Vec<(Strip, usize)>,
}

impl Meetings {
    /// One more: its strips, and the beam of each.
    pub(super) fn add(&mut self, node: usize, strips: impl Iterator<Item = (Strip, usize)>) {
        let before = self.strips.len();
        self.strips.extend(strips);
        self.nodes.push((node, self.strips.len() - before));
    }

    /// The node of each, its strips, and the beam of each.
    pub(super) fn iter(&self) -> impl Iterator<Item = (usize, &[(Strip, usize)])> {
        let mut left = self.strips.as_slice();
        self.nodes.iter().map(move |&(node, count)| {
            let (own, others) = left.split_at(count);
            left = others;
            (node, own)
        })
    }
}

/// Correction of the body of a junction's node; negative where the drawing exceeds the union.
#[derive(Debug, Clone)]
pub(super) struct Excess {
    node: usize,
    mass: Lump,
    /// Drag of that mass per mass (1/s).
    drag_per_mass: f64,
    /// Drag by itself, where the beams' films differ.
    drag: Option<Lump>,
}

impl Excess {
    /// Adds it to the body of its node.
    pub(super) fn add_to(&self, rigid: &mut RigidGroups) {
        let point = rigid.point(self.node);
        rigid.add_mass(point, &self.mass, self.drag_per_mass);
        if let Some(drag) = &self.drag {
            rigid.add_drag(point, drag, 1.0);
        }
    }
}

/// Of each junction of a drawing whose beams end so.
pub(super) fn find(
    structure: &Structure,
    ends: &[[JunctionEnd; 2]],
    meetings: &Meetings,
    undamped: bool,
) -> Vec<Excess> {
    let mut shortest = vec![f64::INFINITY; structure.nodes.len()];
    let mut brought = vec![0.0; structure.nodes.len()];
    for beam in &structure.beams {
        for node in [beam.a, beam.b] {
            shortest[node.0] = shortest[node.0].min(beam.length);
            brought[node.0] += 0.5 * beam.material.density * beam.width * beam.thickness * beam.length;
        }
    }
    let mut all = Vec::with_capacity(structure.nodes.len());
    let mut strips: Vec<Strip> = Vec::new();
    for (node, meeting) in meetings.iter() {
        let beams = || meeting.iter().map(|(_, beam)| &structure.beams[*beam]);
        strips.clear();
        strips.extend(meeting.iter().map(|(strip, _)| *strip));
        let mass = weigh(&mut strips, beams().map(|b| b.material.density * b.thickness));
        if mass <= 0.0 {
            continue;
        }
        let excess = overlap(&strips);
        // beams shorter than the junction have no such overlap
        let widest = strips.iter().map(|s| s.width).fold(0.0, f64::max);
        let room = (shortest[node] / widest).min(1.0);
        let whole = mass * room;
        // where junctions of stout beams overlap in turn, no more goes than leaves half of what the beams bring
        let left = MAX_MASS * brought[node] / (whole * excess.amount).max(f64::MIN_POSITIVE);
        let mut left = left.min(1.0);
        if folded(&strips) {
            let end = |beam: usize| &ends[beam][usize::from(structure.beams[beam].a.0 != node)];
            let rods = meeting.iter().map(|(strip, beam)| rod(strip, &structure.beams[*beam], end(*beam).offset));
            let rods = rods.fold(Lump::default(), |sum, rod| plus(sum, rod, 1.0));
            left = left.min(spared(&rods, &scaled(excess, whole)));
        }
        let mass = scaled(excess, -whole * left);
        let drag = |beam: &Beam| drag_per_mass(beam, undamped);
        let first = beams().next().map_or(0.0, drag);
        if beams().all(|beam| drag(beam) == first) {
            all.push(Excess { node, mass, drag_per_mass: first, drag: None });
            continue;
        }
        let film = |b: &Beam| if b.material.density > 0.0 { drag(b) * b.material.density * b.thickness } else { 0.0 };
        let most = weigh(&mut strips, beams().map(film));
        let twice = scaled(overlap(&strips), -most * room * left);
        all.push(Excess { node, mass, drag_per_mass: 0.0, drag: Some(twice) });
    }
    all
}

/// True where two beams lie along each other, one turning back sharply.
fn folded(strips: &[Strip]) -> bool {
    let others = |k: usize| strips.iter().skip(k + 1);
    strips.iter().enumerate().any(|(k, strip)| others(k).any(|other| turn(strip.angle, other.angle) > MAX_OVERLAP_TURN))
}

/// The rigid end of a beam, of a length, about its node.
fn rod(strip: &Strip, beam: &Beam, length: f64) -> Lump {
    let amount = beam.material.density * beam.width * beam.thickness * length;
    let along = Vector2::new(strip.angle.cos(), strip.angle.sin());
    let second = amount * (length * length / 3.0 + beam.width * beam.width / 12.0);
    Lump { amount, first: along * (0.5 * length * amount), second }
}

/// The largest fraction of what is there twice that leaves half of the mass of rigid ends, and half of its inertia about its centre.
fn spared(rods: &Lump, twice: &Lump) -> f64 {
    let inertia = |lump: &Lump| lump.second - lump.first.norm_squared() / lump.amount.max(f64::MIN_POSITIVE);
    let enough = |share: f64| {
        let rest = plus(*rods, *twice, -share);
        rest.amount >= 0.5 * rods.amount && inertia(&rest) >= 0.5 * inertia(rods)
    };
    let (mut low, mut high) = (0.0, 1.0);
    if enough(high) {
        return high;
    }
    for _ in 0..f64::MANTISSA_DIGITS {
        let middle = 0.5 * (low + high);
        (low, high) = if enough(middle) { (middle, high) } else { (low, middle) };
    }
    low
}

fn plus(sum: Lump, lump: Lump, share: f64) -> Lump {
    let mut sum = sum;
    sum.add(&lump, Vector2::zeros(), share);
    sum
}

/// Gives strips their shares in the largest of some amounts per area, which it returns.
fn weigh(strips: &mut [Strip], amounts: impl Iterator<Item = f64> + Clone) -> f64 {
    let most = amounts.clone().fold(0.0, f64::max);
    for (strip, amount) in strips.iter_mut().zip(amounts) {
        strip.weight = if most > 0.0 { amount / most } else { 1.0 };
    }
    most
}

fn scaled(lump: Lump, scale: f64) -> Lump {
    Lump { amount: lump.amount * scale, first: lump.first * scale, second: lump.second * scale }
}
