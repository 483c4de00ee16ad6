//! What holds a layer: where its anchors lie, and which stretches of a line run over them.

use super::areas::Areas;
use super::medial::Medial;
use crate::layout::drawing::{Drawing, Polygon};
use crate::layout::process::{self, Layer};
use crate::layout::regions;

/// What tells which parts are held.
#[derive(Debug)]
pub(super) enum Rule {
    /// Polygons that hold.
    Drawn(Held),
    /// Parts wider than twice this many database units are held.
    Wide(f64),
    /// Nothing is drawn: pads at the end of a single limb, and parts without limbs, are held.
    Pads,
}

/// Polygons that hold, found by place.
#[derive(Debug)]
pub(super) struct Held(Areas);

fn drawn(drawing: &Drawing, names: &[String]) -> Vec<Polygon> {
    let of = drawing.layers.iter().filter(|(name, _)| process::names(names, name));
    of.flat_map(|(_, polygons)| polygons.iter().cloned()).collect()
}

/// Everything that is drawn to say what of a layer is held.
pub(super) fn marks(drawing: &Drawing, layer: &Layer) -> Vec<Polygon> {
    [&layer.anchoring.drawn, &layer.anchoring.released].iter().flat_map(|names| drawn(drawing, names)).collect()
}

impl Rule {
    /// The rule for a layer of a drawing, as [`process::Anchoring`] says.
    pub(super) fn of(drawing: &Drawing, layer: &Layer, solid: &[Polygon]) -> Self {
        let anchors = drawn(drawing, &layer.anchoring.drawn);
        if !anchors.is_empty() {
            return Self::Drawn(Held::of(&regions::intersection(solid, &anchors)));
        }
        let released = drawn(drawing, &layer.anchoring.released);
        if !released.is_empty() {
            return Self::Drawn(Held::of(&regions::difference(solid, &released)));
        }
        layer.anchoring.undercut.map_or(Self::Pads, |reach| Self::Wide(reach / drawing.unit_m))
    }
}

impl Held {
    fn of(polygons: &[Polygon]) -> Self {
        Self(Areas::of(polygons))
    }

    /// Whether a point lies in one of them.
    pub(super) fn holds(&self, p: [f64; 2]) -> bool {
        !self.0.holding(p).is_empty()
    }

    /// Whether one of them overlaps an area of the axis.
    pub(super) fn touches(&self, axis: &Medial, origin: [f64; 2], edges: &[u32]) -> bool {
        let cells = edges.iter().map(|e| {
            crate::budget::check();
            let edge = &axis.edges[*e as usize];
            axis.outline(edge.ends, edge.sites).map(|p| [p[0] + origin[0], p[1] + origin[1]])
        });
        let mut cells = cells.filter(|cell| cell.iter().any(|p| *p != cell[0]));
        cells.any(|cell| !self.0.overlapping(&cell).is_empty())
    }

    /// Stretches of the line from `a` to `b` over them, as shares of its length, in order and disjoint.
    pub(super) fn over(&self, a: [f64; 2], b: [f64; 2]) -> Vec<[f64; 2]> {
        self.0.over(a, b)
    }
}
