//! A drawing to a netlist: by its labels where it carries its mechanism, else by its geometry.

use super::drawing::FlatLayout;
use super::extract::{self, ExtractError, ExtractOptions, Extraction};
use super::labelled::{self, LabelledError};
use super::lines::ElementLine;
use super::mask;
use super::process::{Process, ProcessError};
use super::read::LayoutError;
use super::report::{ConversionReport, LayerAreas, Unrecognised};
use std::collections::BTreeMap;
use std::fmt::Write;
use thiserror::Error;

/// The process of drawings that say none.
pub const DEFAULT_PROCESS: &str = "polymumps";

/// Why a layout makes no netlist.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ConvertError {
    /// It cannot be read.
    #[error(transparent)]
    Layout(#[from] LayoutError),
    /// Its process.
    #[error(transparent)]
    Process(#[from] ProcessError),
    /// Its labels.
    #[error(transparent)]
    Labels(#[from] LabelledError),
    /// Its geometry.
    #[error(transparent)]
    Extract(#[from] ExtractError),
}

/// The converted netlist and its report.
#[derive(Debug, Clone, PartialEq)]
pub struct Converted {
    /// The netlist.
    pub netlist: String,
    /// Report of the conversion.
    pub report: ConversionReport,
    /// Name of the process.
    pub process: String,
    /// For lines of the netlist, from 1, the layer and place in the drawing that they stand for.
    pub places: BTreeMap<usize, String>,
    /// A node of the netlist and where it lies in the drawing (m): netlists have an origin of their own.
    pub landmark: Option<(String, [f64; 2])>,
}

/// Makes a netlist of a drawing. Without a process it is the one that the drawing names, or [`DEFAULT_PROCESS`].
///
/// # Errors
/// See [`ConvertError`].
pub fn convert(drawing: &FlatLayout, process: Option<&Process>) -> Result<Converted, ConvertError> {
    let named = mask::drawn_on(drawing);
    let builtin;
    let process = match process {
        Some(process) => process,
        None => {
            builtin = Process::builtin(named.unwrap_or(DEFAULT_PROCESS))?;
            &builtin
        }
    };
    if named.is_none() {
        return by_geometry(drawing, process);
    }
    let (netlist, report, landmark) = labelled::read(drawing, process)?;
    Ok(Converted { netlist, report, process: process.name.clone(), places: BTreeMap::new(), landmark })
}

/// Limbs, bodies and anchors as they are drawn, with what labels on the layer of notes add.
fn by_geometry(drawing: &FlatLayout, process: &Process) -> Result<Converted, ConvertError> {
    let extraction = extract::extract(drawing, process, &ExtractOptions::default())?;
    let extract::WrittenNetlist { text: mut netlist, names, places } = extract::written(&extraction);
    let in_words = |(line, (layer, at)): (usize, (String, [f64; 2]))| {
        let at = drawing.place(at.map(|x| x / drawing.unit_m));
        (line, if layer == "*" { format!("at {at}") } else { format!("layer {layer} at {at}") })
    };
    let mut places: BTreeMap<usize, String> = places.into_iter().map(in_words).collect();
    let mut report = report(&extraction, drawing.unit_m);
    let mut lines = netlist.lines().count();
    for label in drawing.labels.iter().filter(|l| mask::on_notes(&l.layer)) {
        match ElementLine::parse(&label.text) {
            Ok(line) => {
                let _ = writeln!(netlist, "{line}");
                let at = drawing.place(label.at.map(f64::from));
                lines += 1;
                places.insert(lines, format!("label `{}` at {at}", label.text));
                *report.counts.entry(line.model).or_insert(0) += 1;
            }
            Err(error) => {
                report.notes.push(format!("{} was passed over: {error}", drawing.place(label.at.map(f64::from))));
            }
        }
    }
    let landmark = names.into_iter().zip(&extraction.nodes).map(|(name, n)| (name, n.at)).next();
    Ok(Converted { netlist, report, process: process.name.clone(), places, landmark })
}

fn report(extraction: &Extraction, unit_m: f64) -> ConversionReport {
    let mut areas = LayerAreas::default();
    for layer in &extraction.layers {
        areas.drawn_m2 += layer.drawn;
        areas.extracted_m2 += layer.extracted;
        areas.anchored_m2 += layer.anchored;
        areas.unrecognised_m2 += layer.unrecognised;
    }
    let counts = [
        ("beams", extraction.beams.len()),
        ("bodies", extraction.bodies.len()),
        ("links", extraction.links.len()),
        ("anchors", extraction.anchors.len()),
    ];
    let more = [
        ("elastic edges", extraction.roots.len()),
        ("arcs", extraction.arcs.len()),
        ("combs", extraction.combs.len()),
        ("facing plates", extraction.plates.len()),
        ("pieces of facing beams", extraction.facing.len()),
        ("nets", extraction.nets.len()),
    ];
    let counts = counts.into_iter().chain(more.into_iter().filter(|(_, n)| *n > 0));
    let pieces = extraction.unrecognised.iter().map(|lost| {
        let metres = |p: &[i32; 2]| p.map(|x| f64::from(x) * unit_m);
        let boxes = lost.polygons.iter().filter_map(super::Polygon::extent);
        let [low, high] = boxes
            .map(|[low, high]| [metres(&low), metres(&high)])
            .reduce(|[a, b], [c, d]| [[a[0].min(c[0]), a[1].min(c[1])], [b[0].max(d[0]), b[1].max(d[1])]])
            .unwrap_or([lost.at; 2]);
        let contours = lost.polygons.iter().flat_map(|p| &p.contours).map(|c| c.iter().map(metres).collect());
        Unrecognised {
            layer: lost.layer.clone(),
            area_m2: lost.area,
            box_m: [low, high],
            why: lost.why.clone(),
            contours: contours.collect(),
        }
    });
    ConversionReport {
        by: "geometry".to_owned(),
        counts: counts.map(|(what, n)| (what.to_owned(), n)).collect(),
        areas,
        unrecognised: pieces.collect(),
        notes: extraction.notes.clone(),
    }
}
