//! A mechanism as a layout file: its outlines on the masks of a process, with labels for names and for data that
//! outlines cannot express.
//!
//! docs/reference/layouts.md describes the labels. Nodes are texts on the layer that they belong to. On the layer of notes (`BIMORPH` in CIF,
//! 255/0 in GDSII) stand a text `bimorph layout 1 PROCESS`, one for each process and one for each element, numbered and at its place.

use super::cells::{Cell, CellShape, CellText, Library};
use super::chords::Chords;
use super::crossings::bounded;
use super::draw::{self, Figure, Role, is_beam};
use super::drawing::{FlatLayout, LARGEST_COORDINATE};
use super::lines::{ElementLines, from_structure};
use super::process::{Process, canonical};
use super::read::LayoutFormat;
use super::regions;
use super::write_gds::WriteError;
use super::{write_cif, write_gds};
use bimorph_structure::Structure;
use std::collections::HashMap;
use thiserror::Error;

/// The layer of notes, by its CIF name and its GDSII number.
pub(crate) const NOTES: [&str; 2] = ["BIMORPH", "255/0"];
/// The text that marks a drawing of ours.
pub(crate) const MARK: &str = "bimorph layout 1";
/// Most parts of a drawing.
const MAX_PARTS: usize = 200_000;
/// The finest unit (m).
const FINEST: f64 = 1e-12;
/// Rounding of a grid, in units: of two corners each.
pub(crate) const ROUNDING: f64 = 3.0;

/// A layout file and what it says of the mechanism.
#[derive(Debug, Clone, PartialEq)]
pub struct Mask {
    /// The file.
    pub bytes: Vec<u8>,
    /// Parts that were omitted or drawn differently from the mechanism.
    pub notes: Vec<String>,
    /// Polygons drawn.
    pub polygons: usize,
    /// Labels written.
    pub labels: usize,
    /// Size of the database unit (m).
    pub unit_m: f64,
}

/// Why a mechanism is not drawn.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum MaskError {
    /// Nothing with an outline.
    #[error("nothing of this netlist has an outline: beams, plates, anchors, combs and facing beams have one")]
    Empty,
    /// Too many parts.
    #[error("{count} elements: at most {MAX_PARTS} are drawn")]
    Large {
        /// How many.
        count: usize,
    },
    /// Wider than the grid.
    #[error("the mechanism reaches to {reach:e} m from its first node: a drawing reaches to 0.5 m")]
    Far {
        /// How far (m).
        reach: f64,
    },
    /// A layer of the process has no name of the format.
    #[error(
        "layer `{layer}` of process `{process}` has no name for {format}: expected one of its `{list}` to be {expected}"
    )]
    Unnamed {
        /// The layer.
        layer: String,
        /// Its process.
        process: String,
        /// The format.
        format: &'static str,
        /// Which of its lists.
        list: &'static str,
        /// How such names look.
        expected: &'static str,
    },
    /// It cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// Draws a structure on the masks of a process.
///
/// # Errors
/// See [`MaskError`].
pub fn mask(structure: &Structure, process: &Process, format: LayoutFormat, name: &str) -> Result<Mask, MaskError> {
    let structure = &in_words(structure);
    let (lines, left) = from_structure::lines(structure);
    if lines.elements.len() > MAX_PARTS {
        return Err(MaskError::Large { count: lines.elements.len() });
    }
    let at: HashMap<String, [f64; 2]> =
        structure.nodes.iter().filter(|n| n.mechanical).map(|n| (n.name.clone(), n.position)).collect();
    let figure = draw::draw(&lines, &at, process);
    if figure.shapes.is_empty() {
        return Err(MaskError::Empty);
    }
    let mut notes = figure.notes.clone();
    notes.extend(left.into_iter().map(|what| format!("{what} could not be written down")));
    let mut library = Library { source: name.to_owned(), unit_m: unit(&figure, &at)?, ..Library::default() };
    let mut lines = lines;
    mark_hidden(&mut lines, &figure, &at, library.unit_m);
    let cell = Cell { name: cell_name(name), ..Cell::default() };
    let mut drawn = MaskDrawing { process, format, library: &mut library, cell };
    drawn.shapes(&figure)?;
    drawn.labels(&lines, &figure, structure)?;
    let cell = drawn.cell;
    let (polygons, labels) = (cell.shapes.len(), cell.texts.len());
    library.cells.push(cell);
    let bytes = match format {
        LayoutFormat::Cif => write_cif::write(&library)?.into_bytes(),
        LayoutFormat::Gds => write_gds::write(&library)?,
    };
    Ok(Mask { bytes, notes, polygons, labels, unit_m: library.unit_m })
}

/// The same with pieces of arcs and tapers (`arc.1`) called by a word (`arc.piece1`), as names of netlists are.
fn in_words(structure: &Structure) -> Structure {
    let mut structure = structure.clone();
    let names = structure.nodes.iter_mut().map(|n| &mut n.name).chain(structure.beams.iter_mut().map(|b| &mut b.name));
    for name in names {
        if let Some((whole, piece)) = name.rsplit_once('.').filter(|(_, p)| p.starts_with(|c: char| c.is_ascii_digit()))
        {
            *name = format!("{whole}.piece{piece}");
        }
    }
    structure
}

/// Letters, digits and `_` of a file's name.
fn cell_name(name: &str) -> String {
    let stem = std::path::Path::new(name).file_stem().and_then(|s| s.to_str()).unwrap_or("top");
    let word: String = stem.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).take(32).collect();
    if word.is_empty() { "top".to_owned() } else { word }
}

/// The finest power of ten on which all fits, 1 pm at the finest.
fn unit(figure: &Figure, at: &HashMap<String, [f64; 2]>) -> Result<f64, MaskError> {
    let points = figure.shapes.iter().flat_map(|(_, s)| s).chain(at.values());
    let reach = points.flatten().fold(0.0_f64, |r, x| if x.is_finite() { r.max(x.abs()) } else { f64::INFINITY });
    if reach >= 0.5 {
        return Err(MaskError::Far { reach });
    }
    let units = (0..=9).map(|k| format!("1e-{}", 12 - k).parse().unwrap_or(FINEST));
    let fits = |unit: &f64| reach / unit < f64::from(LARGEST_COORDINATE) - 1.0;
    units.into_iter().find(fits).ok_or(MaskError::Far { reach })
}

/// Marks beams whose width cannot be measured in the drawing, because a wider shape covers them.
fn mark_hidden(lines: &mut ElementLines, figure: &Figure, at: &HashMap<String, [f64; 2]>, unit_m: f64) {
    let widths = Widths::of_figure(figure, unit_m);
    for line in lines.elements.iter_mut().filter(|l| is_beam(&l.model)) {
        let ends = [at.get(&line.nodes[0]), at.get(&line.nodes[1])];
        let (Some(a), Some(b), Some(w)) = (ends[0], ends[1], line.get("w")) else { continue };
        let layer = figure.layer_of.get(&line.nodes[0]).copied().unwrap_or(0);
        let [a, b] = [*a, *b].map(|p| p.map(|x| x / unit_m));
        if widths.measure(layer, a, b, w / unit_m) != Width::AsTold {
            line.set("hidden", 1.0);
        }
    }
}

/// Measured width of a beam in a drawing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Width {
    /// The drawing agrees with the given width.
    AsTold,
    /// Another one, the same all along (units).
    Other(f64),
    /// Nothing clear: other parts cover it.
    Unclear,
}

/// Measures beams across, layer by layer.
pub(crate) struct Widths(HashMap<usize, Chords>);

impl Widths {
    /// Of regions by layer.
    pub(crate) fn new(regions: HashMap<usize, Chords>) -> Self {
        Self(regions)
    }

    fn of_figure(figure: &Figure, unit_m: f64) -> Self {
        let mut by_layer: HashMap<usize, Vec<super::Polygon>> = HashMap::new();
        for (role, shape) in &figure.shapes {
            if let Role::Layer(k) = role {
                let contour = shape.iter().map(|p| p.map(|x| (x / unit_m).round() as i32)).collect();
                by_layer.entry(*k).or_default().push(super::Polygon::from_contour(contour));
            }
        }
        // what cannot be merged measures nothing
        let measurable = by_layer.into_iter().filter(|(_, all)| bounded(all.iter()).is_ok());
        Self(measurable.map(|(k, all)| (k, Chords::new(&regions::union(&all)))).collect())
    }

    /// The width of a beam between two points whose nominal width is `w` (units).
    pub(crate) fn measure(&self, layer: usize, a: [f64; 2], b: [f64; 2], w: f64) -> Width {
        let Some(chords) = self.0.get(&layer) else { return Width::Unclear };
        let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
        let l = dx.hypot(dy);
        let normal = [-dy / l, dx / l];
        let mut widths = [0.0; 3];
        for (width, share) in widths.iter_mut().zip([0.35, 0.5, 0.65]) {
            let p = [a[0] + share * dx, a[1] + share * dy];
            let [Some(left), Some(right)] = chords.across(p, normal, 2.0 * w.max(ROUNDING)) else {
                return Width::Unclear;
            };
            if (left - right).abs() > 2.0 * ROUNDING {
                return Width::Unclear;
            }
            *width = left + right;
        }
        if widths.iter().all(|x| (x - w).abs() <= ROUNDING) {
            return Width::AsTold;
        }
        let same = widths.iter().all(|x| (x - widths[1]).abs() <= ROUNDING);
        if same { Width::Other(widths[1]) } else { Width::Unclear }
    }
}

struct MaskDrawing<'a> {
    process: &'a Process,
    format: LayoutFormat,
    library: &'a mut Library,
    cell: Cell,
}

impl MaskDrawing<'_> {
    /// The name of a mask in this format: the first one that can be one.
    fn mask_name(&self, role: Role) -> Result<String, MaskError> {
        let numbered = |n: &&String| {
            canonical(n).split_once('/').is_some_and(|(a, b)| a.parse::<u16>().is_ok() && b.parse::<u16>().is_ok())
        };
        let (layer, list, names) = match role {
            Role::Layer(k) => (&self.process.layers[k].name, "drawn", &self.process.layers[k].drawn),
            Role::Anchor(k) => (&self.process.layers[k].name, "anchors", &self.process.layers[k].anchoring.drawn),
        };
        let (found, format, expected) = match self.format {
            LayoutFormat::Gds => (names.iter().find(numbered), "GDSII", "a number like \"45/0\""),
            LayoutFormat::Cif => {
                (names.iter().find(|n| !numbered(n)).or(names.first()), "CIF", "a name like \"POLY1\"")
            }
        };
        found.cloned().ok_or_else(|| MaskError::Unnamed {
            layer: layer.clone(),
            process: self.process.name.clone(),
            format,
            list,
            expected,
        })
    }

    fn grid(&self, p: [f64; 2]) -> [f64; 2] {
        p.map(|x| (x / self.library.unit_m).round())
    }

    fn shapes(&mut self, figure: &Figure) -> Result<(), MaskError> {
        for (role, shape) in &figure.shapes {
            let name = self.mask_name(*role)?;
            let layer = self.library.layer(&name);
            let points = shape.iter().map(|p| self.grid(*p)).collect();
            self.cell.shapes.push(CellShape { layer, points });
        }
        Ok(())
    }

    fn text(&mut self, layer: &str, text: String, at: [f64; 2]) {
        let layer = Some(self.library.layer(layer));
        let at = self.grid(at);
        self.cell.texts.push(CellText { layer, text, at });
    }

    fn labels(&mut self, lines: &ElementLines, figure: &Figure, structure: &Structure) -> Result<(), MaskError> {
        let notes = NOTES[usize::from(self.format == LayoutFormat::Gds)];
        for node in structure.nodes.iter().filter(|n| n.mechanical) {
            let layer = match figure.layer_of.get(&node.name) {
                Some(k) => self.mask_name(Role::Layer(*k))?,
                None => notes.to_owned(),
            };
            self.text(&layer, node.name.clone(), node.position);
        }
        let places: HashMap<&str, [f64; 2]> = structure.nodes.iter().map(|n| (n.name.as_str(), n.position)).collect();
        self.text(notes, format!("{MARK} {}", self.process.name), [0.0; 2]);
        for process in &lines.processes {
            self.text(notes, process.to_string(), [0.0; 2]);
        }
        for (k, line) in lines.elements.iter().enumerate() {
            let ends = [&line.nodes[0], &line.nodes[usize::from(is_beam(&line.model))]];
            let [a, b] = ends.map(|n| places.get(n.as_str()).copied().unwrap_or([0.0; 2]));
            self.text(notes, format!("{}: {line}", k + 1), [(a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0]);
        }
        Ok(())
    }
}

/// The process on whose masks a drawing of ours was drawn, by name; none: the drawing does not carry its mechanism as labels.
pub fn drawn_on(drawing: &FlatLayout) -> Option<&str> {
    let marks = drawing.labels.iter().filter(|l| on_notes(&l.layer));
    marks.filter_map(|l| l.text.strip_prefix(MARK)?.strip_prefix(' ')).next()
}

/// True for the layer of notes in any spelling.
pub(crate) fn on_notes(layer: &str) -> bool {
    let canonical = canonical(layer);
    NOTES.contains(&canonical.as_str())
}
