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
mod boxes;
mod joints;
mod limbs;
pub mod medial;
mod model;
pub mod moments;
mod names;
mod netlist;
mod skeleton;
mod snap;

pub use netlist::netlist;

use super::drawing::{Drawing, Polygon};
use super::process::{self, Process};
use super::regions;
use crate::budget;
use anchors::Rule;
use joints::Parts;
use medial::Medial;
use skeleton::Skeleton;
use std::collections::HashMap;
use std::sync::Arc;
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
    /// Rigid bodies.
    pub bodies: Vec<Body>,
    /// Rigid, massless connections of two nodes.
    pub links: Vec<[usize; 2]>,
    /// Nodes that are held.
    pub anchors: Vec<usize>,
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
        ..Extraction::default()
    };
    unknown_layers(drawing, process, &mut result);
    for layer in &process.layers {
        let drawn: Vec<Polygon> = drawing
            .layers
            .iter()
            .filter(|(name, _)| process::names(&layer.drawn, name))
            .flat_map(|(_, polygons)| polygons.iter().cloned())
            .collect();
        if !drawn.is_empty() {
            one_layer(drawing, layer, &drawn, &mut result)?;
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
    names::name(&mut result, drawing);
    Ok(result)
}

/// Tells of layers that the process does not know.
fn unknown_layers(drawing: &Drawing, process: &Process, result: &mut Extraction) {
    for (name, polygons) in &drawing.layers {
        if process.role_of(name).is_some() {
            continue;
        }
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
}

/// A part's axis and what was found along it, for all parts of its shape.
type Found = Result<Arc<(Medial, Parts)>, String>;

fn one_layer(
    drawing: &Drawing,
    layer: &process::Layer,
    drawn: &[Polygon],
    result: &mut Extraction,
) -> Result<(), ExtractError> {
    let unit = drawing.unit_m;
    let drawn_area = regions::area(&regions::union(drawn));
    let snapped = snap::snap(drawn);
    let solid = regions::union(snapped.as_deref().unwrap_or(drawn));
    let points: usize = solid.iter().flat_map(|p| &p.contours).map(Vec::len).sum();
    if points > MOST_POINTS {
        return Err(ExtractError::TooLarge { layer: layer.name.clone(), points });
    }
    budget::lay_out(points.saturating_mul(1200));
    let rule = Rule::of(drawing, layer, &solid);
    let index = result.layers.len();
    let mut done = LayerResult {
        name: layer.name.clone(),
        thickness: layer.thickness,
        material: layer.material.iter().map(|(name, value)| (name.clone(), *value)).collect(),
        drawn: drawn_area * unit * unit,
        closed: (regions::area(&solid) - drawn_area) * unit * unit,
        parts: solid.len(),
        ..LayerResult::default()
    };
    if let Some(fluid) = layer.fluid {
        done.material.push(("fluid".to_owned(), fluid));
    }
    let mut known: HashMap<Polygon, Found> = HashMap::new();
    for polygon in &solid {
        budget::check();
        let found = known.entry(at_origin(polygon)).or_insert_with(|| {
            let axis = Medial::of(polygon).map_err(|e| e.to_string())?;
            let parts = {
                let skeleton = Skeleton::of(&axis);
                joints::joints(&skeleton, limbs::limbs(&skeleton))
            };
            Ok(Arc::new((axis, parts)))
        });
        let area = regions::area(std::slice::from_ref(polygon));
        match found {
            Ok(found) => {
                let (axis, parts) = &**found;
                let origin = polygon.extent().unwrap_or_default()[0];
                let model = model::Model::of(axis, origin, parts, &rule);
                done.anchored += model.held * unit * unit;
                done.extracted += (model.area - model.held) * unit * unit;
                if (model.area - area).abs() > 1e-9 * area {
                    let missing = (area - model.area) * unit * unit;
                    done.unrecognised += missing;
                    result.unrecognised.push(lost(layer, polygon, unit, missing, "no limb or joint has it"));
                }
                result.add(&model, index, unit);
            }
            Err(why) => {
                let area = area * unit * unit;
                done.unrecognised += area;
                result.unrecognised.push(lost(layer, polygon, unit, area, why));
            }
        }
    }
    result.layers.push(done);
    Ok(())
}

fn lost(layer: &process::Layer, polygon: &Polygon, unit: f64, area: f64, why: &str) -> Unrecognised {
    let [low, high] = polygon.extent().unwrap_or_default();
    let at = [0, 1].map(|i| 0.5 * (f64::from(low[i]) + f64::from(high[i])) * unit);
    Unrecognised { layer: layer.name.clone(), area, at, polygons: vec![polygon.clone()], why: why.to_owned() }
}

/// The polygon moved to the origin: its shape.
fn at_origin(polygon: &Polygon) -> Polygon {
    let [[x, y], _] = polygon.extent().unwrap_or_default();
    let moved = |contour: &Vec<[i32; 2]>| contour.iter().map(|p| [p[0] - x, p[1] - y]).collect();
    Polygon { contours: polygon.contours.iter().map(moved).collect() }
}

impl Extraction {
    /// Takes the model of a part in.
    fn add(&mut self, model: &model::Model, layer: usize, unit: f64) {
        let mut used = vec![false; model.nodes.len()];
        let ends = model.beams.iter().flat_map(|b| [b.a, b.b]).chain(model.links.iter().flatten().copied());
        ends.chain(model.bodies.iter().map(|b| b.node)).for_each(|n| used[n] = true);
        // a part that is nothing but held is an electrode: it keeps one node
        if !used.iter().any(|u| *u) {
            model.anchors.first().iter().for_each(|n| used[**n] = true);
        }
        let mut number = vec![usize::MAX; model.nodes.len()];
        for (n, at) in model.nodes.iter().enumerate().filter(|(n, _)| used[*n]) {
            number[n] = self.nodes.len();
            self.nodes.push(Node { name: String::new(), at: at.map(|x| x * unit), reach: model.reach[n] * unit });
        }
        self.beams.extend(model.beams.iter().map(|b| Beam {
            layer,
            nodes: [number[b.a], number[b.b]],
            width: b.width.map(|w| w * unit),
        }));
        self.bodies.extend(model.bodies.iter().map(|b| Body {
            layer,
            node: number[b.node],
            area: b.moments.area * unit * unit,
            polar: b.moments.polar() * unit.powi(4),
        }));
        self.links.extend(model.links.iter().map(|l| l.map(|n| number[n])));
        self.anchors.extend(model.anchors.iter().filter(|n| used[**n]).map(|n| number[*n]));
    }
}
