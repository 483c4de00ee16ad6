//! Result of an extraction, in SI units.

use crate::drawing::{Placement, Polygon};

/// Result of an extraction, in SI units.
#[derive(Debug, Clone, Default)]
pub struct Extraction {
    /// Name of the drawing.
    pub source: String,
    /// Its top cell.
    pub top: String,
    /// Name of the process.
    pub process: String,
    /// Layers that move.
    pub layers: Vec<LayerResult>,
    /// Points of the model.
    pub nodes: Vec<ExtractedNode>,
    /// Flexible beams.
    pub beams: Vec<ExtractedBeam>,
    /// Beams along a circle.
    pub arcs: Vec<Arc>,
    /// Rigid bodies.
    pub bodies: Vec<ExtractedBody>,
    /// Rigid, massless connections of two nodes.
    pub links: Vec<[usize; 2]>,
    /// Elastic edges of perforated plates where limbs stand on them.
    pub roots: Vec<ExtractedRoot>,
    /// Nodes that are held.
    pub anchors: Vec<usize>,
    /// Areas that are held, with the nodes on them.
    pub pads: Vec<ExtractedPad>,
    /// Nets that labels name.
    pub nets: Vec<Net>,
    /// Parts between nets, whose beams carry current: [`ExtractedNode::part`], in order.
    pub live: Vec<usize>,
    /// Where cells stand in the drawing.
    pub cells: Vec<Placement>,
    /// Size of a database unit (m).
    pub unit: f64,
    /// Comb drives.
    pub combs: Vec<ExtractedComb>,
    /// Lumped plates that face each other.
    pub plates: Vec<Plates>,
    /// Beams that face another part.
    pub facing: Vec<ExtractedFacing>,
    /// Areas that have no element in the model.
    pub unrecognised: Vec<UnmodelledArea>,
    /// Notes for the reader, with positions and sizes.
    pub notes: Vec<String>,
}

/// One layer that moves.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LayerResult {
    /// Name of the netlist's `process`.
    pub name: String,
    /// Thickness (m).
    pub thickness: f64,
    /// Constants under the names that netlists have, SI.
    pub material: Vec<(String, f64)>,
    /// Area of the union of its polygons (m²).
    pub drawn: f64,
    /// Area of slits between polygons drawn edge to edge, less than two grid units wide, that were closed (m²); it and `drawn`
    /// together are the sum of the three that follow.
    pub closed: f64,
    /// Area of beams and bodies (m²).
    pub extracted: f64,
    /// Area that is held (m²).
    pub anchored: f64,
    /// Area that is in neither (m²).
    pub unrecognised: f64,
    /// Number of etch holes that were filled, and their area (m²); it is no part of `drawn`.
    pub holes: (usize, f64),
    /// Number of connected parts.
    pub parts: usize,
}

/// A point of the model.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtractedNode {
    /// Its name.
    pub name: String,
    /// Its place (m).
    pub at: [f64; 2],
    /// How far from it a label may stand that names it (m).
    pub reach: f64,
    /// A label of the drawing names it.
    pub labelled: bool,
    /// Number of its part; a connected part is one conductor.
    pub part: usize,
}

/// An area that is held.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtractedPad {
    /// Nodes on it; it may have none.
    pub nodes: Vec<usize>,
    /// Index of its layer.
    pub layer: usize,
    /// Number of the part that it belongs to.
    pub part: usize,
    /// Outlines of what it consists of (database units).
    pub outlines: Vec<Vec<[f64; 2]>>,
}

/// Pads that one conductor joins, with the name that a label gives them.
#[derive(Debug, Clone, PartialEq)]
pub struct Net {
    /// Its name.
    pub name: String,
    /// Electrical ground.
    pub ground: bool,
    /// Indices of its pads, in order.
    pub pads: Vec<usize>,
}

/// A straight beam.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtractedBeam {
    /// Index of its layer.
    pub layer: usize,
    /// Nodes at its start and end.
    pub nodes: [usize; 2],
    /// Width at both (m).
    pub width: [f64; 2],
    /// Fraction of its area that etch holes take (1).
    pub porosity: f64,
}

/// A beam along a circle.
#[derive(Debug, Clone, PartialEq)]
pub struct Arc {
    /// Index of its layer.
    pub layer: usize,
    /// Nodes at its start and end.
    pub nodes: [usize; 2],
    /// Its angle from start to end (rad), positive to its left.
    pub angle: f64,
    /// Width (m).
    pub width: f64,
    /// Fraction of its area that etch holes take (1).
    pub porosity: f64,
}

/// A rigid body.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtractedBody {
    /// Index of its layer.
    pub layer: usize,
    /// Node at its centroid.
    pub node: usize,
    /// Area (m²).
    pub area: f64,
    /// Polar second moment of the area about the centroid (m⁴).
    pub polar: f64,
}

/// Where a limb stands on the elastic edge of a perforated plate: a spring between two nodes in one place.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtractedRoot {
    /// Nodes of the plate and of the limb.
    pub nodes: [usize; 2],
    /// Direction of the limb.
    pub along: [f64; 2],
    /// Stiffness along the limb and across it (N/m).
    pub shift: f64,
    /// Stiffness against turning [N m/rad].
    pub turn: f64,
}

/// A comb drive.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtractedComb {
    /// Index of its layer.
    pub layer: usize,
    /// Nodes where it pulls: the side that moves, and the other.
    pub nodes: [usize; 2],
    /// Number of gaps.
    pub gaps: usize,
    /// Number of fingers of both sides.
    pub fingers: [usize; 2],
    /// Gap (m).
    pub gap: f64,
    /// Overlap as drawn (m).
    pub overlap: f64,
    /// Mean width of a finger (m).
    pub width: f64,
}

/// Two plates that face each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Plates {
    /// Index of its layer.
    pub layer: usize,
    /// Nodes on both sides, across the gap.
    pub nodes: [usize; 2],
    /// Sides of the area that faces: along the gap, and the thickness of the layer (m).
    pub sides: [f64; 2],
    /// Depth of the parts behind it: the geometric mean of both, and at most ten thicknesses, beyond which the field does not depend on it (m).
    pub depth: f64,
    /// Gap (m).
    pub gap: f64,
}

/// A piece of a beam that faces another part.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtractedFacing {
    /// Index of its layer.
    pub layer: usize,
    /// Nodes along the beam, and those across the gap, to the right of the way from the first to the second.
    pub nodes: [usize; 4],
    /// Widths of the two (m).
    pub width: [f64; 2],
    /// Gap (m).
    pub gap: f64,
}

/// Something that is not in the model.
#[derive(Debug, Clone, PartialEq)]
pub struct UnmodelledArea {
    /// The drawn layer, or the name of one that moves.
    pub layer: String,
    /// Its area (m²).
    pub area: f64,
    /// A point in it or near it (m).
    pub at: [f64; 2],
    /// Its polygons (database units).
    pub polygons: Vec<Polygon>,
    /// Why.
    pub why: String,
}
impl Extraction {
    /// All places where elements name nodes.
    pub(super) fn named(&mut self) -> impl Iterator<Item = &mut usize> {
        let beams = self.beams.iter_mut().flat_map(|b| &mut b.nodes);
        let arcs = self.arcs.iter_mut().flat_map(|a| &mut a.nodes);
        let bodies = self.bodies.iter_mut().map(|b| &mut b.node);
        let links = self.links.iter_mut().flatten().chain(self.roots.iter_mut().flat_map(|r| &mut r.nodes));
        let combs = self.combs.iter_mut().flat_map(|c| &mut c.nodes);
        let plates = self.plates.iter_mut().flat_map(|p| &mut p.nodes);
        let facing = self.facing.iter_mut().flat_map(|f| &mut f.nodes);
        let gaps = combs.chain(plates).chain(facing);
        beams.chain(arcs).chain(bodies).chain(links).chain(&mut self.anchors).chain(gaps)
    }

    /// Drops nodes that arcs took the place of.
    pub(super) fn drop_unused_nodes(&mut self) {
        let mut used = vec![false; self.nodes.len()];
        self.named().for_each(|n| used[*n] = true);
        let mut number = vec![0; used.len()];
        let mut count = 0;
        for (number, used) in number.iter_mut().zip(&used) {
            *number = count;
            count += usize::from(*used);
        }
        let mut kept = used.iter().copied();
        self.nodes.retain(|_| kept.next().unwrap_or(false));
        for pad in &mut self.pads {
            pad.nodes.retain(|n| used[*n]);
            pad.nodes.iter_mut().for_each(|n| *n = number[*n]);
        }
        self.named().for_each(|n| *n = number[*n]);
    }
}
