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
mod areas;
mod boxes;
mod combs;
mod conductors;
mod found;
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
mod pads;
mod repeats;
mod rows;
mod sink;
mod skeleton;
mod snap;
mod strips;
mod taps;

pub use found::{Arc, Beam, Body, Comb, Extraction, Facing, LayerResult, Net, Node, Pad, Plates, Unrecognised};
pub use netlist::{Written, netlist, written};

use super::crossings::{Tangled, bounded};
use super::drawing::{Drawing, Polygon};
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
    let mut moving = Vec::new();
    for layer in &process.layers {
        let drawn: Vec<Polygon> = drawing
            .layers
            .iter()
            .filter(|(name, _)| process::names(&layer.drawn, name))
            .flat_map(|(_, polygons)| polygons.iter().cloned())
            .collect();
        if !drawn.is_empty() {
            moving.push(Moving { layer, parts: layer::extract(drawing, layer, &drawn, &mut result)? });
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
    let labels = nets::find(&mut result, drawing, process, &moving)?;
    live::divide_tapers(&mut result);
    arcs::arcs(&mut result, drawing.unit_m);
    result.drop_unused_nodes();
    names::name(&mut result, drawing, &labels);
    names::told(&mut result);
    Ok(result)
}

/// What moves of a layer.
struct Moving<'a> {
    layer: &'a process::Layer,
    /// Outlines of the parts in which something moves, etch holes filled.
    parts: Vec<Polygon>,
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
