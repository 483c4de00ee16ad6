//! One layer: merged, divided into connected parts, and put into the result.

use super::anchors::{self, AnchorRule};
use super::combs::{self, Finger};
use super::error::{ExtractError, MAX_POINTS};
use super::extraction_sink::ExtractionSink;
use super::gaps::{self, Pull};
use super::holes::{self, Hole};
use super::joints;
use super::limbs;
use super::medial::Medial;
use super::model::PartModel;
use super::part::{AxisAnalysis, Part};
use super::perforated::perforated;
use super::skeleton::Skeleton;
use super::snap;
use super::{ExtractedFacing, Extraction, LayerResult, Plates, UnmodelledArea};
use crate::crossings::bounded;
use crate::drawing::{FlatLayout, Polygon};
use crate::process;
use crate::regions;
use bimorph_base::budget;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;

/// Bytes for each point of a layer while its axis is made.
const BYTES_PER_POINT: usize = 1200;

/// Largest depth of plates, in thicknesses of their layer: end of the range of the fringe field's law (1).
const DEEPEST: f64 = 10.0;

/// By what fraction of a part its pieces may miss its area (1).
const BALANCE: f64 = 1e-9;

/// Cached analyses of shapes, since a drawing repeats them.
#[derive(Default)]
struct ShapeCache(HashMap<Polygon, Result<AxisAnalysis, String>>);

impl ShapeCache {
    fn analyse(&mut self, polygon: Polygon, holes: Vec<Hole>, rule: &AnchorRule) -> Result<Part, (Polygon, String)> {
        let found = self.0.entry(at_origin(&polygon)).or_insert_with(|| {
            let axis = Medial::of(&polygon).map_err(|e| e.to_string())?;
            let parts = {
                let skeleton = Skeleton::of(&axis);
                joints::joints(&skeleton, limbs::limbs(&skeleton))
            };
            Ok((Arc::new(axis), Arc::new(parts)))
        });
        match found {
            Ok(found) => {
                let mut part = Part { found: found.clone(), polygon, holes };
                if !part.holes.is_empty() {
                    let (axis, plain) = &part.found;
                    part.found.1 = Arc::new(perforated(axis, plain, &part.holes, part.origin(), rule));
                }
                Ok(part)
            }
            Err(why) => Err((polygon, why.clone())),
        }
    }
}

/// The polygon moved to the origin: its shape.
fn at_origin(polygon: &Polygon) -> Polygon {
    let [[x, y], _] = polygon.extent().unwrap_or_default();
    let moved = |contour: &Vec<[i32; 2]>| contour.iter().map(|p| [p[0] - x, p[1] - y]).collect();
    Polygon { contours: polygon.contours.iter().map(moved).collect() }
}

/// Adds the model of a layer to the result; answers the outlines of its parts in which something moves.
pub(super) fn extract(
    drawing: &FlatLayout,
    layer: &process::StructuralLayer,
    drawn: &[Polygon],
    result: &mut Extraction,
) -> Result<Vec<Polygon>, ExtractError> {
    let unit = drawing.unit_m;
    let holes: Vec<Polygon> = drawing
        .layers
        .iter()
        .filter(|(name, _)| process::names(&layer.holes, name))
        .flat_map(|(_, polygons)| polygons.iter().cloned())
        .collect();
    let held = anchors::marks(drawing, layer);
    bounded(drawn.iter().chain(&holes).chain(&held))
        .map_err(|tangled| ExtractError::Tangled { layer: layer.name.clone(), tangled })?;
    let snapped = snap::snap(drawn);
    let solid = regions::difference(snapped.as_deref().unwrap_or(drawn), &holes);
    let drawn_area = match snapped {
        Some(_) => regions::area(&regions::difference(drawn, &holes)),
        None => regions::area(&solid),
    };
    let points: usize = solid.iter().flat_map(|p| &p.contours).map(Vec::len).sum();
    if points > MAX_POINTS {
        return Err(ExtractError::TooLarge { layer: layer.name.clone(), points });
    }
    budget::lay_out(points.saturating_mul(BYTES_PER_POINT));
    let rule = AnchorRule::of(drawing, layer, &solid);
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
    let mut shapes = ShapeCache::default();
    let mut parts = Vec::new();
    for polygon in solid {
        budget::check();
        let (polygon, holes) = holes::fill(polygon, layer.largest_hole / unit);
        done.holes.0 += holes.len();
        done.holes.1 += holes.iter().map(|h| h.area).sum::<f64>() * unit * unit;
        let missing: f64 = holes.iter().map(|h| h.area).sum();
        match shapes.analyse(polygon, holes, &rule) {
            Ok(part) => parts.push(part),
            Err((polygon, why)) => {
                let area = (regions::area(std::slice::from_ref(&polygon)) - missing) * unit * unit;
                done.unrecognised += area;
                result.unrecognised.push(lost(layer, &polygon, unit, area, &why));
            }
        }
    }
    let (combs, fingers) = combs::combs(&parts);
    let carriers = strip(&mut shapes, &parts, &fingers, &rule);
    let mut taps: Vec<Vec<([f64; 2], bool)>> = vec![Vec::new(); parts.len()];
    for comb in &combs {
        (0..2).for_each(|i| taps[comb.parts[i]].push((comb.roots[i], false)));
    }
    let model = |(carrier, taps): (&Part, &Vec<([f64; 2], bool)>)| {
        budget::check();
        let (axis, found) = &carrier.found;
        PartModel::of(axis, carrier.origin(), found, &rule, taps, &carrier.holes)
    };
    let bare: Vec<Vec<([f64; 2], bool)>> = vec![Vec::new(); parts.len()];
    let models: Vec<PartModel> = carriers.iter().zip(&bare).map(model).collect();
    let moves: Vec<bool> = models.iter().map(|m| !(m.beams.is_empty() && m.bodies.is_empty())).collect();
    let gaps = gaps::gaps(&carriers, &moves, &combs, gaps::WIDEST / unit);
    gaps.iter().flat_map(gaps::Gap::pulls).for_each(|pull| taps[pull.part].push((pull.at, pull.on_axis)));
    let first = result.layers.iter().map(|layer| layer.parts).sum();
    let rigidity = layer.material.get("Youngsmodulus").filter(|e| **e > 0.0).map(|e| e * layer.thickness);
    let mut sink = ExtractionSink { layer: result.layers.len(), result, first, unit, rigidity };
    // for each part, the nodes where combs pull
    let mut pulled: Vec<Option<std::vec::IntoIter<usize>>> = Vec::new();
    // those at which something pulls once more, with nodes there
    let pulled_at = models.into_iter().zip(carriers.iter().zip(&taps));
    let models: Vec<PartModel> = pulled_at.map(|(bare, of)| if of.1.is_empty() { bare } else { model(of) }).collect();
    let mut loose = vec![false; parts.len()];
    combs.iter().flat_map(|comb| &comb.loose).for_each(|k| loose[*k] = true);
    let held = models.iter().filter(|model| model.is_held()).count();
    sink.notes(drawing, layer, &rule, &parts, &models, &loose);
    let mut moving = Vec::new();
    for (k, (part, model)) in parts.iter().zip(&models).enumerate() {
        let whole = regions::area(std::slice::from_ref(&part.polygon));
        let missing: f64 = part.holes.iter().map(|h| h.area).sum();
        let solid = regions::area(std::slice::from_ref(&carriers[k].polygon));
        let why = if (model.area - (solid - missing)).abs() > BALANCE * solid {
            "the parts of its axis do not cover it: it is drawn too finely for its grid"
        } else if loose[k] {
            "it has the shape of a finger of a comb, without support"
        } else if !model.is_held() && held > 0 && taps[k].is_empty() {
            "nothing holds it, and it faces nothing that is held: it would float away"
        } else {
            done.anchored += model.held * unit * unit;
            done.extracted += (model.area - model.held) * unit * unit;
            let fingers = whole - solid;
            let moves = !(model.beams.is_empty() && model.bodies.is_empty());
            *(if moves { &mut done.extracted } else { &mut done.anchored }) += fingers * unit * unit;
            moving.extend(moves.then(|| part.polygon.clone()));
            pulled.push(Some(sink.add(model, k)));
            continue;
        };
        let area = (whole - missing) * unit * unit;
        done.unrecognised += area;
        sink.result.unrecognised.push(lost(layer, &part.polygon, unit, area, why));
        pulled.push(None);
    }
    let anchored: HashSet<usize> = sink.result.anchors.iter().copied().collect();
    for comb in &combs {
        let nodes = comb.parts.map(|k| pulled[k].as_mut().and_then(Iterator::next));
        if let [Some(a), Some(b)] = nodes {
            sink.comb(comb, [a, b], &anchored);
        }
    }
    for gap in &gaps {
        let mut node = |pull: &Pull| pulled[pull.part].as_mut().and_then(Iterator::next);
        match gap {
            gaps::Gap::Plates { pulls, length, depth, gap } => {
                if let [Some(a), Some(b)] = [node(&pulls[0]), node(&pulls[1])] {
                    let sides = [length * unit, layer.thickness];
                    let depth = (depth * unit).min(DEEPEST * layer.thickness);
                    let nodes = [a, b];
                    sink.result.plates.push(Plates { layer: sink.layer, nodes, sides, depth, gap: gap * unit });
                }
            }
            gaps::Gap::Beams { upper, lower, width, gap } => {
                let mut row = |pulls: &Vec<Pull>| pulls.iter().map(&mut node).collect::<Option<Vec<usize>>>();
                if let (Some(upper), Some(lower)) = (row(upper), row(lower)) {
                    let widths = width.map(|w| w * unit);
                    sink.result.facing.extend(upper.windows(2).zip(lower.windows(2)).map(|(u, l)| ExtractedFacing {
                        layer: sink.layer,
                        nodes: [u[0], u[1], l[0], l[1]],
                        width: widths,
                        gap: gap * unit,
                    }));
                }
            }
        }
    }
    result.layers.push(done);
    Ok(moving)
}

/// The parts without the fingers of combs.
fn strip(shapes: &mut ShapeCache, parts: &[Part], fingers: &[Finger], rule: &AnchorRule) -> Vec<Part> {
    let mut of_part: Vec<Vec<&Finger>> = vec![Vec::new(); parts.len()];
    fingers.iter().for_each(|finger| of_part[finger.part].push(finger));
    let stripped = parts.iter().zip(&of_part).map(|(part, fingers)| {
        if fingers.is_empty() {
            return part.clone();
        }
        let mut left = regions::union(&[combs::without(part, fingers)]);
        match (left.pop(), left.is_empty()) {
            (Some(one), true) => shapes.analyse(one, part.holes.clone(), rule).unwrap_or_else(|_| part.clone()),
            _ => part.clone(),
        }
    });
    stripped.collect()
}

fn lost(layer: &process::StructuralLayer, polygon: &Polygon, unit: f64, area: f64, why: &str) -> UnmodelledArea {
    let [low, high] = polygon.extent().unwrap_or_default();
    let at = [0, 1].map(|i| 0.5 * (f64::from(low[i]) + f64::from(high[i])) * unit);
    UnmodelledArea { layer: layer.name.clone(), area, at, polygons: vec![polygon.clone()], why: why.to_owned() }
}
