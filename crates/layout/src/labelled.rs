//! A drawing that carries its mechanism as labels, back to a netlist.
//!
//! Positions of nodes and widths of beams come from the drawing. A number of a label is used where the drawing agrees with it to its grid,
//! since it is more exact. Otherwise the drawn value is used, with a note. Labels provide names and data without an
//! outline: materials, kinds, lumped parts, ports. At the end the mechanism is drawn again. Each area that only one of
//! the two drawings has is reported with its size and position.

use super::chords::Chords;
use super::crossings::{CrossingContours, bounded};
use super::draw::{self, Role, is_beam};
use super::drawing::{FlatLayout, GridPoint, LARGEST_COORDINATE, Polygon};
use super::lines::{ElementLine, ElementLines, LineError, ProcessLine, is_full_name, text};
use super::mask::{ROUNDING, Width, Widths, on_notes};
use super::process::{Process, names};
use super::regions;
use super::report::{ConversionReport, LayerAreas, Unrecognised, region};
use std::collections::{BTreeMap, HashMap};
use thiserror::Error;

/// Differences reported individually.
const MAX_REPORTED: usize = 20;

/// Why the labels of a drawing make no netlist.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum LabelledError {
    /// A label on the layer of notes is no line.
    #[error("{place}: {error}")]
    Line {
        /// Where it stands.
        place: String,
        /// Why not.
        error: LineError,
    },
    /// A line names a node that has no label.
    #[error(
        "{place}: `{line}` is at node `{node}`, which has no label in the drawing: put a text `{node}` where it is"
    )]
    Node {
        /// Where the line stands.
        place: String,
        /// Its name.
        line: String,
        /// The node.
        node: String,
    },
    /// A line of a material that is not there.
    #[error("{place}: `{line}` is of `{process}`, of which there is no label `process {process} = [...]`")]
    Process {
        /// Where the line stands.
        place: String,
        /// Its name.
        line: String,
        /// The process.
        process: String,
    },
    /// Polygons that cut one another too often to be compared.
    #[error("{what}: {tangled}")]
    Tangled {
        /// A layer of the drawing, or of the mechanism in its labels.
        what: String,
        /// How often, and where.
        tangled: CrossingContours,
    },
    /// Two nodes of a beam in one place.
    #[error("{place}: `{line}` has both its nodes in one place")]
    Short {
        /// Where the line stands.
        place: String,
        /// Its name.
        line: String,
    },
}

/// Elements whose nodes must have places.
fn has_places(model: &str) -> bool {
    !matches!(model, "R" | "L" | "C" | "Vsrc" | "Isrc" | "opamp" | "vcvs" | "eground" | "port" | "wire")
}

/// A node and where it lies (m).
type Landmark = Option<(String, [f64; 2])>;

/// Reads the labels of a drawing and checks them against its polygons.
///
/// # Errors
/// See [`LabelledError`].
pub(crate) fn read(
    drawing: &FlatLayout,
    process: &Process,
) -> Result<(String, ConversionReport, Landmark), LabelledError> {
    let mut notes = drawing.notes.clone();
    let (mut lines, places) = lines_of(drawing)?;
    let at = nodes_of(drawing, &lines, &mut notes);
    for (line, place) in lines.elements.iter().zip(&places).filter(|(l, _)| has_places(&l.model)) {
        if let Some(node) = line.nodes.iter().find(|n| !at.contains_key(*n)) {
            let (place, line, node) = (place.clone(), line.name.clone(), node.clone());
            return Err(LabelledError::Node { place, line, node });
        }
    }
    let layers = layers_of(drawing, process)?;
    let measured = measure(&mut lines, &places, &at, drawing, process, &layers)?;
    notes.extend(measured);
    let report = compare(drawing, process, &lines, &at, &layers, notes)?;
    let heading = format!("from {}, cell {}, by its labels", drawing.source, drawing.top);
    // A name without dots is the same in the netlist.
    let landmark = at.iter().filter(|(name, _)| !name.contains('.')).min_by_key(|(name, _)| name.as_str());
    let landmark = landmark.map(|(name, place)| (name.clone(), *place));
    Ok((text::netlist(&lines, &heading), report, landmark))
}

/// Lines in the order of their numbers, with where they stand.
fn lines_of(drawing: &FlatLayout) -> Result<(ElementLines, Vec<String>), LabelledError> {
    let mut numbered: Vec<(u64, ElementLine, String)> = Vec::new();
    let mut processes = BTreeMap::new();
    for label in drawing.labels.iter().filter(|l| on_notes(&l.layer)) {
        let place = || format!("{}, label at {}", drawing.source, drawing.place(label.at.map(f64::from)));
        if let Some(process) = ProcessLine::parse(&label.text) {
            processes.insert(process.name.clone(), process);
        } else if let Some((number, text)) = label.text.split_once(": ").and_then(|(n, t)| Some((n.parse().ok()?, t))) {
            let line = ElementLine::parse(text).map_err(|error| LabelledError::Line { place: place(), error })?;
            numbered.push((number, line, place()));
        }
    }
    numbered.sort_by(|a, b| (a.0, &a.1.name).cmp(&(b.0, &b.1.name)));
    for (_, line, place) in &numbered {
        if line.process != "*" && !processes.contains_key(&line.process) {
            let (place, name, process) = (place.clone(), line.name.clone(), line.process.clone());
            return Err(LabelledError::Process { place, line: name, process });
        }
    }
    let (elements, places) = numbered.into_iter().map(|(_, line, place)| (line, place)).unzip();
    Ok((ElementLines { processes: processes.into_values().collect(), elements }, places))
}

/// Where nodes lie (m): labels of their names.
fn nodes_of(drawing: &FlatLayout, lines: &ElementLines, notes: &mut Vec<String>) -> HashMap<String, [f64; 2]> {
    let wanted: std::collections::HashSet<&String> = lines.elements.iter().flat_map(|l| &l.nodes).collect();
    let mut at: HashMap<String, [i32; 2]> = HashMap::new();
    for label in drawing.labels.iter().filter(|l| is_full_name(&l.text) && wanted.contains(&l.text)) {
        let known = *at.entry(label.text.clone()).or_insert(label.at);
        if known != label.at {
            let (first, second) = (drawing.place(known.map(f64::from)), drawing.place(label.at.map(f64::from)));
            notes.push(format!("`{}` is a label at {first} and at {second}: the first one counts", label.text));
        }
    }
    at.into_iter().map(|(name, p)| (name, p.map(|x| f64::from(x) * drawing.unit_m))).collect()
}

/// Polygons of each layer of the process, merged, and of its anchors.
fn layers_of(drawing: &FlatLayout, process: &Process) -> Result<BTreeMap<Role, Vec<Polygon>>, LabelledError> {
    let mut all: BTreeMap<Role, Vec<Polygon>> = BTreeMap::new();
    for (name, polygons) in &drawing.layers {
        for (k, layer) in process.layers.iter().enumerate() {
            for (role, list) in [(Role::Layer(k), &layer.drawn), (Role::Anchor(k), &layer.anchoring.drawn)] {
                if names(list, name) {
                    all.entry(role).or_default().extend(polygons.iter().cloned());
                }
            }
        }
    }
    let merged = |(role, polygons): (Role, Vec<Polygon>)| Ok((role, merge(&name_of(role, process), &polygons, &[])?));
    all.into_iter().map(merged).collect()
}

fn name_of(role: Role, process: &Process) -> String {
    match role {
        Role::Layer(k) => process.layers[k].name.clone(),
        Role::Anchor(k) => format!("anchors of {}", process.layers[k].name),
    }
}

/// The union of polygons that can also be held together with others.
fn merge(what: &str, polygons: &[Polygon], with: &[Polygon]) -> Result<Vec<Polygon>, LabelledError> {
    bounded(polygons.iter().chain(with))
        .map_err(|tangled| LabelledError::Tangled { what: what.to_owned(), tangled })?;
    Ok(regions::union(polygons))
}

/// Lengths, directions and widths: the label's where the drawing agrees, else the drawing's.
fn measure(
    lines: &mut ElementLines,
    places: &[String],
    at: &HashMap<String, [f64; 2]>,
    drawing: &FlatLayout,
    process: &Process,
    layers: &BTreeMap<Role, Vec<Polygon>>,
) -> Result<Vec<String>, LabelledError> {
    let unit = drawing.unit_m;
    let chords = layers.iter().filter_map(|(role, all)| match role {
        Role::Layer(k) => Some((*k, Chords::new(all))),
        Role::Anchor(_) => None,
    });
    let widths = Widths::new(chords.collect());
    let figure = draw::draw(lines, at, process);
    let mut notes = Vec::new();
    let mut changed = 0;
    let mut report = |text: String| {
        changed += 1;
        if changed <= MAX_REPORTED {
            notes.push(text);
        }
    };
    let um = |x: f64| (x * 1e12).round() / 1e6;
    for (line, place) in lines.elements.iter_mut().zip(places) {
        let stretched = is_beam(&line.model) || line.model == "link2d";
        if !stretched || line.nodes.len() != 2 {
            continue;
        }
        let (a, b) = (at[&line.nodes[0]], at[&line.nodes[1]]);
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let (l, oz) = (dx.hypot(dy), dy.atan2(dx));
        if l == 0.0 && is_beam(&line.model) {
            return Err(LabelledError::Short { place: place.clone(), line: line.name.clone() });
        }
        let reported = [line.get("l").unwrap_or(0.0), line.get("oz").unwrap_or(0.0)];
        let miss = (reported[0] * reported[1].cos() - dx).hypot(reported[0] * reported[1].sin() - dy);
        if miss > ROUNDING * unit {
            report(format!("`{}` is drawn {} µm long, its label says {}", line.name, um(l), um(reported[0])));
            line.set("l", l);
            line.set("oz", oz);
        }
        let hidden = line.get("hidden").is_some();
        line.parameters.retain(|(n, _)| n != "hidden");
        let Some(w) = line.get("w").filter(|_| is_beam(&line.model) && !hidden) else { continue };
        let layer = figure.layer_of.get(&line.nodes[0]).copied().unwrap_or(0);
        match widths.measure(layer, a.map(|x| x / unit), b.map(|x| x / unit), w / unit) {
            Width::AsTold => {}
            Width::Other(drawn) => {
                report(format!("`{}` is drawn {} µm wide, its label says {}", line.name, um(drawn * unit), um(w)));
                line.set("w", drawn * unit);
            }
            Width::Unclear => {
                report(format!(
                    "the width of `{}` cannot be measured at {place}: its label's {} µm were taken",
                    line.name,
                    um(w)
                ));
            }
        }
    }
    if changed > MAX_REPORTED {
        notes.push(format!("{} more such differences", changed - MAX_REPORTED));
    }
    Ok(notes)
}

/// A contour on the grid of a unit (m); none where it reaches beyond.
fn on_grid(shape: &[[f64; 2]], unit: f64) -> Option<Vec<GridPoint>> {
    let largest = f64::from(LARGEST_COORDINATE);
    let on = |p: &[f64; 2]| {
        let p = p.map(|x| (x / unit).round());
        p.iter().all(|x| x.abs() <= largest).then(|| p.map(|x| x as i32))
    };
    shape.iter().map(on).collect()
}

/// Draws the mechanism again and reports areas that only one of the two drawings has.
fn compare(
    drawing: &FlatLayout,
    process: &Process,
    lines: &ElementLines,
    at: &HashMap<String, [f64; 2]>,
    layers: &BTreeMap<Role, Vec<Polygon>>,
    mut notes: Vec<String>,
) -> Result<ConversionReport, LabelledError> {
    let figure = draw::draw(lines, at, process);
    let unit = drawing.unit_m;
    let mut again: BTreeMap<Role, Vec<Polygon>> = BTreeMap::new();
    let mut beyond = 0;
    for (role, shape) in &figure.shapes {
        match on_grid(shape, unit) {
            Some(contour) => again.entry(*role).or_default().push(Polygon::from_contour(contour)),
            None => beyond += 1,
        }
    }
    if beyond > 0 {
        notes.push(format!(
            "{beyond} outlines of parts reach beyond what a drawing can hold: their labels' sizes are too large"
        ));
    }
    let square = unit * unit;
    let mut areas = LayerAreas::default();
    let mut unrecognised = Vec::new();
    let none = Vec::new();
    let roles: std::collections::BTreeSet<Role> = layers.keys().chain(again.keys()).copied().collect();
    for role in roles {
        let drawn = layers.get(&role).unwrap_or(&none);
        let name = name_of(role, process);
        let ours = merge(&format!("{name}, as given by its labels"), again.get(&role).unwrap_or(&none), drawn)?;
        let (more, less) = (regions::difference(drawn, &ours), regions::difference(&ours, drawn));
        let more = Unrecognised::of(&name, &more, unit, "drawn, but in no part of the mechanism");
        let less = Unrecognised::of(&name, &less, unit, "in the mechanism, but not drawn");
        if let Role::Layer(_) = role {
            areas.drawn_m2 += regions::area(drawn) * square;
            areas.unrecognised_m2 += more.iter().map(|u| u.area_m2).sum::<f64>();
        } else {
            areas.anchored_m2 += regions::area(drawn) * square;
        }
        unrecognised.extend(more);
        for u in less {
            notes.push(format!("{} µm² on {} at {}: {}", u.area_um2(), u.layer, region(&u), u.why));
        }
    }
    areas.extracted_m2 = areas.drawn_m2 - areas.unrecognised_m2;
    for (name, polygons) in drawing.layers.iter().filter(|(name, _)| process.role_of(name).is_none()) {
        let merged = merge(&format!("layer {name}"), polygons, &[])?;
        let foreign = Unrecognised::of(name, &merged, unit, "the process has no such layer");
        let area: f64 = foreign.iter().map(|u| u.area_m2).sum();
        areas.drawn_m2 += area;
        areas.unrecognised_m2 += area;
        unrecognised.extend(foreign);
    }
    let mut counts = BTreeMap::new();
    for line in &lines.elements {
        *counts.entry(line.model.clone()).or_insert(0) += 1;
    }
    Ok(ConversionReport { by: "labels".to_owned(), counts, areas, unrecognised, notes })
}
