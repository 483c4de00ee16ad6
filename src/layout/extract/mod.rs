//! Extraction: from the polygons of a drawing to nodes, beams, rigid bodies and anchors.
//!
//! For each layer that moves: the union of what is drawn → holes of the etch filled → for each part that hangs together its medial
//! axis ([`medial`]) → twigs cut off → straight strips, the *limbs* → *joints* between them → nodes where the axes of limbs cross, and
//! rigid bodies where a part is wide → what lies over anchors is held. Every part of the drawn area belongs to a limb or a
//! joint; what could not be understood is told with its place and size, and the sum is checked against the drawing.
//!
//! The method follows Baidya, Gupta and Mukherjee (2002), who take drawings apart into rectangles, with the medial axis in the place
//! of rectangles, so that drawings at any angle are taken apart alike.

mod anchors;
mod arcs;
mod boxes;
mod combs;
mod conductors;
mod gaps;
mod holes;
mod joints;
mod layer;
mod limbs;
mod live;
pub mod medial;
mod model;
pub mod moments;
mod names;
mod netlist;
mod nets;
mod repeats;
mod rows;
mod skeleton;
mod snap;

pub use netlist::{Written, netlist, written};

use super::crossings::{Tangled, bounded};
use super::drawing::{Drawing, Placement, Polygon};
use super::process::{self, Process};
use super::regions;
use thiserror::Error;

/// Most points of one layer after its polygons are merged.
pub const MOST_POINTS: usize = 4_000_000;

/// How a drawing is read.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct ExtractOptions {}

/// Why there is no model.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ExtractError {
    /// No layer of the process is drawn.
    #[error(
        "{source_name}: no layer that moves in process `{process}` is drawn: expected one of {expected}, found {found}; name another \
         process, or write a process file for these layers (docs/layout.md)"
    )]
    NothingMoves {
        /// Name of the drawing.
        source_name: String,
        /// Name of the process.
        process: String,
        /// Layers of the process.
        expected: String,
        /// Layers of the drawing.
        found: String,
    },
    /// Polygons that cut one another too often to be merged.
    #[error("layer {layer}: {tangled}")]
    Tangled {
        /// Name of the layer.
        layer: String,
        /// How often, and where.
        tangled: Tangled,
    },
    /// More points than are worked on.
    #[error("layer {layer}: {points} points after its polygons were merged, at most {MOST_POINTS} are extracted")]
    TooLarge {
        /// Name of the layer.
        layer: String,
        /// Its points.
        points: usize,
    },
}

/// What was found in a drawing, in SI units.
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
    pub nodes: Vec<Node>,
    /// Flexible beams.
    pub beams: Vec<Beam>,
    /// Beams along a circle.
    pub arcs: Vec<Arc>,
    /// Rigid bodies.
    pub bodies: Vec<Body>,
    /// Rigid, massless connections of two nodes.
    pub links: Vec<[usize; 2]>,
    /// Nodes that are held.
    pub anchors: Vec<usize>,
    /// Areas that are held, with the nodes on them.
    pub pads: Vec<Pad>,
    /// Nets that labels name.
    pub nets: Vec<Net>,
    /// Parts between nets, whose beams carry current: [`Node::part`], in order.
    pub live: Vec<usize>,
    /// Where cells stand in the drawing.
    pub cells: Vec<Placement>,
    /// Size of a database unit [m].
    pub unit: f64,
    /// Comb drives.
    pub combs: Vec<Comb>,
    /// Lumped plates that face each other.
    pub plates: Vec<Plates>,
    /// Beams that face another part.
    pub facing: Vec<Facing>,
    /// What is not in the model.
    pub unrecognised: Vec<Unrecognised>,
    /// What a reader should know, in words with places and sizes.
    pub notes: Vec<String>,
}

/// One layer that moves.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LayerResult {
    /// Name of the netlist's `process`.
    pub name: String,
    /// Thickness [m].
    pub thickness: f64,
    /// Constants under the names that netlists have, SI.
    pub material: Vec<(String, f64)>,
    /// Area of the union of its polygons [m²].
    pub drawn: f64,
    /// Area of slits between polygons drawn edge to edge, less than two grid units wide, that were closed [m²]; it and `drawn`
    /// together are the sum of the three that follow.
    pub closed: f64,
    /// Area of beams and bodies [m²].
    pub extracted: f64,
    /// Area that is held [m²].
    pub anchored: f64,
    /// Area that is in neither [m²].
    pub unrecognised: f64,
    /// Number of etch holes that were filled, and their area [m²]; it is no part of `drawn`.
    pub holes: (usize, f64),
    /// Number of parts that hang together.
    pub parts: usize,
}

/// A point of the model.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    /// Its name.
    pub name: String,
    /// Its place [m].
    pub at: [f64; 2],
    /// How far from it a label may stand that names it [m].
    pub reach: f64,
    /// A label of the drawing names it.
    pub labelled: bool,
    /// Number of the part that it is on: what hangs together is one conductor.
    pub part: usize,
}

/// An area that is held.
#[derive(Debug, Clone, PartialEq)]
pub struct Pad {
    /// Nodes on it; it may have none.
    pub nodes: Vec<usize>,
    /// Index of its layer.
    pub layer: usize,
    /// Number of the part that it belongs to.
    pub part: usize,
    /// Outlines of what it consists of [database units].
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
pub struct Beam {
    /// Index of its layer.
    pub layer: usize,
    /// Nodes at its start and end.
    pub nodes: [usize; 2],
    /// Width at both [m].
    pub width: [f64; 2],
    /// Share of its area that etch holes take [1].
    pub porosity: f64,
}

/// A beam along a circle.
#[derive(Debug, Clone, PartialEq)]
pub struct Arc {
    /// Index of its layer.
    pub layer: usize,
    /// Nodes at its start and end.
    pub nodes: [usize; 2],
    /// By how much it turns on the way [rad], positive to its left.
    pub angle: f64,
    /// Width [m].
    pub width: f64,
    /// Share of its area that etch holes take [1].
    pub porosity: f64,
}

/// A rigid body.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Index of its layer.
    pub layer: usize,
    /// Node at its centroid.
    pub node: usize,
    /// Area [m²].
    pub area: f64,
    /// Polar second moment of the area about the centroid [m⁴].
    pub polar: f64,
}

/// A comb drive.
#[derive(Debug, Clone, PartialEq)]
pub struct Comb {
    /// Index of its layer.
    pub layer: usize,
    /// Nodes where it pulls: the side that moves, and the other.
    pub nodes: [usize; 2],
    /// Number of gaps.
    pub gaps: usize,
    /// Number of fingers of both sides.
    pub fingers: [usize; 2],
    /// Gap [m].
    pub gap: f64,
    /// Overlap as drawn [m].
    pub overlap: f64,
}

/// Two plates that face each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Plates {
    /// Index of its layer.
    pub layer: usize,
    /// Nodes on both sides, across the gap.
    pub nodes: [usize; 2],
    /// Area [m²].
    pub area: f64,
    /// Gap [m].
    pub gap: f64,
}

/// A piece of a beam that faces another part.
#[derive(Debug, Clone, PartialEq)]
pub struct Facing {
    /// Index of its layer.
    pub layer: usize,
    /// Nodes along the beam, and those across the gap, to the right of the way from the first to the second.
    pub nodes: [usize; 4],
    /// Widths of the two [m].
    pub width: [f64; 2],
    /// Gap [m].
    pub gap: f64,
}

/// Something that is not in the model.
#[derive(Debug, Clone, PartialEq)]
pub struct Unrecognised {
    /// The drawn layer, or the name of one that moves.
    pub layer: String,
    /// Its area [m²].
    pub area: f64,
    /// A point in it or near it [m].
    pub at: [f64; 2],
    /// Its polygons [database units].
    pub polygons: Vec<Polygon>,
    /// Why.
    pub why: String,
}

/// The model of a drawing made in a process.
///
/// # Errors
/// Nothing that moves is drawn, or there is too much of it.
pub fn extract(drawing: &Drawing, process: &Process, options: &ExtractOptions) -> Result<Extraction, ExtractError> {
    let ExtractOptions {} = options;
    let mut result = Extraction {
        source: drawing.source.clone(),
        top: drawing.top.clone(),
        process: process.name.clone(),
        notes: drawing.notes.clone(),
        cells: drawing.cells.clone(),
        unit: drawing.unit_m,
        ..Extraction::default()
    };
    unknown_layers(drawing, process, &mut result)?;
    for layer in &process.layers {
        let drawn: Vec<Polygon> = drawing
            .layers
            .iter()
            .filter(|(name, _)| process::names(&layer.drawn, name))
            .flat_map(|(_, polygons)| polygons.iter().cloned())
            .collect();
        if !drawn.is_empty() {
            layer::extract(drawing, layer, &drawn, &mut result)?;
        }
    }
    if result.layers.is_empty() {
        let expected = process.layers.iter().flat_map(|l| l.drawn.iter().cloned()).collect::<Vec<_>>().join(", ");
        let found: Vec<&str> = drawing.layers.keys().map(String::as_str).take(40).collect();
        return Err(ExtractError::NothingMoves {
            source_name: drawing.source.clone(),
            process: process.name.clone(),
            expected,
            found: if found.is_empty() { "none".to_owned() } else { found.join(", ") },
        });
    }
    arcs::same_widths(&mut result, drawing.unit_m);
    let labels = nets::find(&mut result, drawing, process)?;
    live::divide_tapers(&mut result);
    arcs::arcs(&mut result, drawing.unit_m);
    result.drop_unused_nodes();
    names::name(&mut result, drawing, &labels);
    Ok(result)
}

/// Tells of layers that the process does not know.
fn unknown_layers(drawing: &Drawing, process: &Process, result: &mut Extraction) -> Result<(), ExtractError> {
    for (name, polygons) in &drawing.layers {
        if process.role_of(name).is_some() {
            continue;
        }
        bounded(polygons.iter()).map_err(|tangled| ExtractError::Tangled { layer: name.clone(), tangled })?;
        let merged = regions::union(polygons);
        let area = regions::area(&merged) * drawing.unit_m * drawing.unit_m;
        if area > 0.0 {
            let at = merged.first().and_then(Polygon::extent).map_or([0.0; 2], |[low, high]| {
                [0, 1].map(|i| 0.5 * (f64::from(low[i]) + f64::from(high[i])) * drawing.unit_m)
            });
            let why = format!("process `{}` does not know layer {name}", process.name);
            result.unrecognised.push(Unrecognised { layer: name.clone(), area, at, polygons: merged, why });
        }
    }
    Ok(())
}

impl Extraction {
    /// All places where elements name nodes.
    fn named(&mut self) -> impl Iterator<Item = &mut usize> {
        let beams = self.beams.iter_mut().flat_map(|b| &mut b.nodes);
        let arcs = self.arcs.iter_mut().flat_map(|a| &mut a.nodes);
        let bodies = self.bodies.iter_mut().map(|b| &mut b.node);
        let links = self.links.iter_mut().flatten();
        let combs = self.combs.iter_mut().flat_map(|c| &mut c.nodes);
        let plates = self.plates.iter_mut().flat_map(|p| &mut p.nodes);
        let facing = self.facing.iter_mut().flat_map(|f| &mut f.nodes);
        let gaps = combs.chain(plates).chain(facing);
        beams.chain(arcs).chain(bodies).chain(links).chain(&mut self.anchors).chain(gaps)
    }

    /// Drops nodes that arcs took the place of.
    fn drop_unused_nodes(&mut self) {
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
