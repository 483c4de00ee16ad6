//! Extraction: from the polygons of a drawing to nodes, beams, rigid bodies and anchors.
//!
//! For each moving layer: 1. the union of the outlines; 2. etch holes are filled; 3. the medial axis of each connected
//! part ([`medial`]); 4. twigs are cut off; 5. straight strips, the *limbs*; 6. *joints* between them; 7. nodes at the
//! intersections of axes, and rigid bodies where a part is wide; 8. areas over anchors are held. Every part of the
//! drawn area belongs to a limb or a joint. Areas without a model are reported with position and size, and the sum is
//! checked against the drawing.
//!
//! The method follows that of Baidya, Gupta and Mukherjee (2002), which decomposes drawings into rectangles. The medial
//! axis replaces the rectangles here, so that the result does not depend on orientation.

mod anchors;
mod arcs;
mod areas;
mod boxes;
mod cells;
mod combs;
mod conductors;
mod cut;
mod error;
mod extraction;
mod extraction_sink;
mod gaps;
mod holes;
mod identifier;
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
mod part;
mod perforated;
mod repeats;
mod rows;
mod skeleton;
mod snap;
mod strips;
mod taps;

pub use error::{ExtractError, MAX_POINTS};
pub use extraction::{
    Arc, ExtractedBeam, ExtractedBody, ExtractedComb, ExtractedFacing, ExtractedNode, ExtractedPad, ExtractedRoot,
    Extraction, LayerResult, Net, Plates, UnmodelledArea,
};
pub use netlist::{WrittenNetlist, netlist, written};

use super::crossings::bounded;
use super::drawing::{FlatLayout, Polygon};
use super::process::{self, Process};
use super::regions;
use nets::MovingLayer;

/// How a drawing is read.
#[derive(Debug, Clone, Default, PartialEq)]
#[non_exhaustive]
pub struct ExtractOptions {}

/// The model of a drawing made in a process.
///
/// # Errors
/// Nothing that moves is drawn, or there is too much of it.
pub fn extract(drawing: &FlatLayout, process: &Process, options: &ExtractOptions) -> Result<Extraction, ExtractError> {
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
            moving.push(MovingLayer { layer, parts: layer::extract(drawing, layer, &drawn, &mut result)? });
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
    names::reported(&mut result);
    Ok(result)
}

/// Notes layers that the process does not define.
fn unknown_layers(drawing: &FlatLayout, process: &Process, result: &mut Extraction) -> Result<(), ExtractError> {
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
            result.unrecognised.push(UnmodelledArea { layer: name.clone(), area, at, polygons: merged, why });
        }
    }
    Ok(())
}
