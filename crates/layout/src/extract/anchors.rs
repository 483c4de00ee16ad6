//! Anchoring of a layer: positions of its anchors, and the stretches of a line over them.

use super::areas::AreaIndex;
use super::joints::LimbJoint;
use super::limbs::Limb;
use super::medial::Medial;
use crate::drawing::{FlatLayout, Polygon};
use crate::process::{self, StructuralLayer};
use crate::regions;

/// A pad is at least this much wider than its limb (1).
const PAD: f64 = 1.5;

/// Rule that decides which parts are held.
#[derive(Debug)]
pub(super) enum AnchorRule {
    /// Polygons that hold.
    Drawn(AnchorAreas),
    /// Parts wider than twice this many database units are held.
    Wide(f64),
    /// Nothing is drawn: pads at the end of a single limb, and parts without limbs, are held.
    Pads,
}

/// Polygons that hold, found by place.
#[derive(Debug)]
pub(super) struct AnchorAreas(AreaIndex);

fn drawn(drawing: &FlatLayout, names: &[String]) -> Vec<Polygon> {
    let of = drawing.layers.iter().filter(|(name, _)| process::names(names, name));
    of.flat_map(|(_, polygons)| polygons.iter().cloned()).collect()
}

/// Everything that is drawn to say what of a layer is held.
pub(super) fn marks(drawing: &FlatLayout, layer: &StructuralLayer) -> Vec<Polygon> {
    [&layer.anchoring.drawn, &layer.anchoring.released].iter().flat_map(|names| drawn(drawing, names)).collect()
}

impl AnchorRule {
    /// The rule for a layer of a drawing, as [`process::Anchoring`] says.
    pub(super) fn of(drawing: &FlatLayout, layer: &StructuralLayer, solid: &[Polygon]) -> Self {
        let anchors = drawn(drawing, &layer.anchoring.drawn);
        if !anchors.is_empty() {
            return Self::Drawn(AnchorAreas::of(&regions::intersection(solid, &anchors)));
        }
        let released = drawn(drawing, &layer.anchoring.released);
        if !released.is_empty() {
            return Self::Drawn(AnchorAreas::of(&regions::difference(solid, &released)));
        }
        layer.anchoring.undercut.map_or(Self::Pads, |reach| Self::Wide(reach / drawing.unit_m))
    }

    /// Whether a joint is held where it is a body.
    pub(super) fn holds_body(&self, axis: &Medial, origin: [f64; 2], limbs: &[Limb], joint: &LimbJoint) -> bool {
        match self {
            Self::Drawn(held) => held.touches(axis, origin, &joint.edges),
            Self::Wide(reach) => half_width(axis, joint) >= *reach,
            Self::Pads => match joint.ports.as_slice() {
                [] => true,
                [port] => 2.0 * half_width(axis, joint) >= PAD * limbs[port.limb].width[port.end],
                _ => false,
            },
        }
    }

    /// Whether some of a limb is held.
    pub(super) fn holds_limb(&self, limb: &Limb, origin: [f64; 2]) -> bool {
        match self {
            Self::Drawn(held) => {
                let [a, b] = limb.ends.map(|p| [p[0] + origin[0], p[1] + origin[1]]);
                !held.over(a, b).is_empty()
            }
            Self::Wide(reach) => limb.width[0].min(limb.width[1]) >= 2.0 * reach,
            Self::Pads => false,
        }
    }
}

/// Half of the largest width of a joint.
pub(super) fn half_width(axis: &Medial, joint: &LimbJoint) -> f64 {
    let ends = joint.edges.iter().flat_map(|e| axis.edges[*e as usize].ends);
    ends.map(|v| axis.vertices[v as usize].r).fold(0.0, f64::max)
}

impl AnchorAreas {
    fn of(polygons: &[Polygon]) -> Self {
        Self(AreaIndex::of(polygons))
    }

    /// Whether a point lies in one of them.
    pub(super) fn holds(&self, p: [f64; 2]) -> bool {
        !self.0.holding(p).is_empty()
    }

    /// Whether one of them overlaps an area of the axis.
    pub(super) fn touches(&self, axis: &Medial, origin: [f64; 2], edges: &[u32]) -> bool {
        let cells = edges.iter().map(|e| {
            bimorph_base::budget::check();
            let edge = &axis.edges[*e as usize];
            axis.outline(edge.ends, edge.sites).map(|p| [p[0] + origin[0], p[1] + origin[1]])
        });
        let mut cells = cells.filter(|cell| cell.iter().any(|p| *p != cell[0]));
        cells.any(|cell| !self.0.overlapping(&cell).is_empty())
    }

    /// Stretches of the line from `a` to `b` over them, as fractions of its length, in order and disjoint.
    pub(super) fn over(&self, a: [f64; 2], b: [f64; 2]) -> Vec<[f64; 2]> {
        self.0.over(a, b)
    }
}
