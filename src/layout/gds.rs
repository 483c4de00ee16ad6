//! GDSII stream format (Calma, release 6): BOUNDARY, BOX, PATH, SREF, AREF and TEXT.
//!
//! A layer is called "layer/datatype", a text's "layer/texttype". Records are read one at a time; what the file holds is kept
//! with its hierarchy. Properties and NODE elements are passed over; the latter with a note, as are absolute magnifications and
//! widths, which are taken as relative ones.

mod error;
pub(crate) mod record;

use super::cells::{Call, Cell, Library, Shape, Text, Transform};
use super::flatten::MOST_POINTS;
use super::outline::{self, Style};
use crate::budget;
use record::{Record, Records, kind};
use std::io::Read;

pub use error::{GdsError, GdsFault};

/// Most points of one polygon or path.
const LONGEST: usize = 1 << 20;
/// Most shapes, labels and calls of a file, before hierarchy is taken out.
const MOST_PARTS: usize = 4_000_000;
/// Most cells of a file.
const MOST_CELLS: usize = 1_000_000;
/// Sizes of a database unit that can be meant [m].
const UNITS: std::ops::RangeInclusive<f64> = 1e-15..=1e-3;
/// Factors of a call that can be meant [1].
const MAGNIFICATIONS: std::ops::RangeInclusive<f64> = 1e-6..=1e6;
/// Records between two reports of progress.
const REPORT: u32 = 1 << 14;

/// Reads a GDSII stream; `file` is its name in messages. `watch` is told how many bytes were read and says whether to go on.
///
/// # Errors
/// See [`GdsError`]: the first thing that is wrong, with its byte and record.
pub(crate) fn read(from: impl Read, file: &str, watch: &mut dyn FnMut(u64) -> bool) -> Result<Library, GdsError> {
    let library = Library { source: file.to_owned(), unit_m: 0.0, ..Library::default() };
    let mut reading = Reading { library, cell: None, element: None, parts: 0, points: 0, noted: Noted::default() };
    let mut records = Records::new(from, file);
    let first = records.next().map(|r| (r.kind, r.data.to_vec()));
    match first {
        Ok((kind::HEADER, _)) => {}
        Ok((0x45, data)) if data.starts_with(b"I-OASIS") => {
            let what = "it is OASIS; KLayout or gdstk convert it";
            return Err(records.error(GdsFault::Foreign { what }));
        }
        Err(e) if matches!(e.fault, GdsFault::Read { .. }) => return Err(e),
        _ => {
            let what =
                "expected a HEADER record (bytes 00 06 00 02) at its beginning; a packed file must be unpacked first";
            return Err(records.error(GdsFault::Foreign { what }));
        }
    }
    let mut until_report = REPORT;
    loop {
        until_report -= 1;
        if until_report == 0 {
            until_report = REPORT;
            if !watch(records.offset()) {
                return Err(records.error(GdsFault::Interrupted));
            }
        }
        budget::check();
        let taken = reading.take(&records.next()?);
        match taken {
            Ok(false) => {}
            Ok(true) => break,
            Err(fault) => return Err(records.error(fault)),
        }
    }
    Ok(reading.finish())
}

/// An element that is being read.
#[derive(Debug, Default)]
struct Element {
    name: &'static str,
    kind: u8,
    layer: Option<u16>,
    datatype: Option<u16>,
    points: Vec<[f64; 2]>,
    width: f64,
    path_type: i16,
    extensions: [f64; 2],
    called: Option<String>,
    text: Option<String>,
    columns_rows: Option<[u32; 2]>,
    mirrored: bool,
    magnification: f64,
    angle: f64,
    offset: u64,
}

/// What was passed over or taken for something else.
#[derive(Debug, Default)]
struct Noted {
    nodes: usize,
    lines: usize,
    absolute: usize,
    unknown: usize,
}

struct Reading {
    library: Library,
    cell: Option<Cell>,
    element: Option<Element>,
    parts: usize,
    points: u64,
    noted: Noted,
}

fn data(record: &Record<'_>, expected: &'static str) -> GdsFault {
    GdsFault::Data { bytes: record.data.len(), expected }
}

impl Reading {
    /// Takes a record; true after the last one.
    fn take(&mut self, record: &Record<'_>) -> Result<bool, GdsFault> {
        if let Some(element) = &mut self.element {
            if record.kind == kind::ENDEL {
                let element = self.element.take().unwrap_or_default();
                self.close(element)?;
            } else {
                element.take(record, &mut self.noted)?;
            }
            return Ok(false);
        }
        match record.kind {
            kind::ENDLIB if self.cell.is_none() => {
                if self.library.unit_m == 0.0 {
                    return Err(GdsFault::Order { expected: "UNITS before the end of the library" });
                }
                return Ok(true);
            }
            kind::UNITS => {
                let unit = record.real(1).ok_or_else(|| data(record, "two reals"))?;
                if !UNITS.contains(&unit) {
                    let expected = "1e-15 to 1e-3";
                    return Err(GdsFault::OutOfRange { what: "the database unit [m]", value: unit, expected });
                }
                self.library.unit_m = snapped(unit);
            }
            kind::BGNSTR if self.cell.is_none() => {
                if self.library.cells.len() >= MOST_CELLS {
                    return Err(GdsFault::Many { what: "cells", most: MOST_CELLS as u64 });
                }
                self.cell = Some(Cell::default());
            }
            kind::BGNSTR => return Err(GdsFault::Order { expected: "ENDSTR before the next cell" }),
            kind::STRNAME => {
                let Some(cell) = &mut self.cell else { return Err(GdsFault::Order { expected: "BGNSTR before it" }) };
                cell.name = record.text();
                if cell.name.is_empty() {
                    return Err(data(record, "the name of a cell"));
                }
            }
            kind::ENDSTR => match self.cell.take() {
                Some(cell) if cell.name.is_empty() => {
                    return Err(GdsFault::Incomplete { element: "cell", lacks: "STRNAME" });
                }
                // KLayout keeps data of its own in a cell that calls all others.
                Some(cell) if cell.name == "$$$CONTEXT_INFO$$$" => {}
                Some(cell) => self.library.cells.push(cell),
                None => return Err(GdsFault::Order { expected: "BGNSTR before it" }),
            },
            kind::BOUNDARY | kind::PATH | kind::SREF | kind::AREF | kind::TEXT | kind::NODE | kind::BOX => {
                if self.cell.is_none() {
                    return Err(GdsFault::Order { expected: "a cell (BGNSTR) around it" });
                }
                let name = kind::name(record.kind).unwrap_or("element");
                let (kind, offset) = (record.kind, record.offset);
                self.element = Some(Element { name, kind, offset, magnification: 1.0, ..Element::default() });
            }
            kind::ENDLIB => return Err(GdsFault::Order { expected: "ENDSTR before the end of the library" }),
            kind::ENDEL | kind::XY | kind::LAYER => return Err(GdsFault::Order { expected: "an element around it" }),
            other => self.noted.unknown += usize::from(kind::name(other).is_none()),
        }
        Ok(false)
    }

    fn close(&mut self, element: Element) -> Result<(), GdsFault> {
        self.parts += 1;
        if self.parts > MOST_PARTS {
            return Err(GdsFault::Many { what: "elements", most: MOST_PARTS as u64 });
        }
        let name = element.name;
        let lacks = |lacks: &'static str| GdsFault::Incomplete { element: name, lacks };
        let Some(cell) = &mut self.cell else { return Ok(()) };
        if element.kind == kind::NODE {
            self.noted.nodes += 1;
            return Ok(());
        }
        let first = *element.points.first().ok_or_else(|| lacks("XY"))?;
        if element.kind == kind::SREF || element.kind == kind::AREF {
            let (count, pitch) = element.array(first)?;
            let called = element.called.clone().ok_or_else(|| lacks("SNAME"))?;
            let transform = element.transform(first);
            cell.calls.push(Call { cell: called, place: format!("byte {}", element.offset), transform, count, pitch });
            return Ok(());
        }
        let layer = element.layer.ok_or_else(|| lacks("LAYER"))?;
        let layer = self.library.layer(&format!("{layer}/{}", element.datatype.unwrap_or(0)));
        if element.kind == kind::TEXT {
            let text = element.text.ok_or_else(|| lacks("STRING"))?;
            cell.texts.push(Text { layer: Some(layer), text, at: first });
            return Ok(());
        }
        let contours = if element.kind == kind::PATH {
            if element.width == 0.0 {
                self.noted.lines += 1;
            }
            element.outline()
        } else {
            vec![element.points]
        };
        for mut points in contours {
            if points.len() > 1 && points.first() == points.last() {
                points.pop();
            }
            self.points += points.len() as u64;
            if self.points > MOST_POINTS {
                return Err(GdsFault::Many { what: "points", most: MOST_POINTS });
            }
            cell.shapes.push(Shape { layer, points });
        }
        Ok(())
    }

    fn finish(mut self) -> Library {
        let Noted { nodes, lines, absolute, unknown } = self.noted;
        let notes = [
            (nodes, "NODE elements hold no polygon and were passed over"),
            (lines, "paths have no width and were left out"),
            (absolute, "absolute widths, magnifications or angles were taken as relative ones"),
            (unknown, "records of unknown type were passed over"),
        ];
        for (count, text) in notes.into_iter().filter(|(count, _)| *count > 0) {
            self.library.notes.push(format!("{count} {text}"));
        }
        self.library
    }
}

/// The power of ten that is meant where a unit is one up to rounding of the format.
fn snapped(unit: f64) -> f64 {
    let exponent = unit.log10().round() as i32;
    let power: f64 = format!("1e{exponent}").parse().unwrap_or(unit);
    if (unit / power - 1.0).abs() < 1e-14 { power } else { unit }
}

impl Element {
    fn take(&mut self, record: &Record<'_>, noted: &mut Noted) -> Result<(), GdsFault> {
        let short = || record.short(0).ok_or_else(|| data(record, "a two-byte number"));
        let long = || record.long(0).ok_or_else(|| data(record, "a four-byte number"));
        let real = || record.real(0).ok_or_else(|| data(record, "a real"));
        match record.kind {
            kind::LAYER => self.layer = Some(short()? as u16),
            kind::DATATYPE | kind::BOXTYPE | kind::TEXTTYPE | kind::NODETYPE => self.datatype = Some(short()? as u16),
            kind::XY => {
                if record.data.is_empty() || !record.data.len().is_multiple_of(8) {
                    return Err(data(record, "pairs of four-byte numbers"));
                }
                let count = record.data.len() / 8;
                if self.points.len() + count > LONGEST {
                    return Err(GdsFault::Many { what: "points in one element", most: LONGEST as u64 });
                }
                let coordinate = |k: usize| f64::from(record.long(k).unwrap_or(0));
                self.points.extend((0..count).map(|k| [coordinate(2 * k), coordinate(2 * k + 1)]));
            }
            kind::WIDTH => {
                let width = long()?;
                noted.absolute += usize::from(width < 0);
                self.width = f64::from(width).abs();
            }
            kind::PATHTYPE => {
                self.path_type = short()?;
                if ![0, 1, 2, 4].contains(&self.path_type) {
                    let (what, value) = ("the type of a path", f64::from(self.path_type));
                    return Err(GdsFault::OutOfRange { what, value, expected: "0, 1, 2 or 4" });
                }
            }
            kind::BGNEXTN => self.extensions[0] = f64::from(long()?),
            kind::ENDEXTN => self.extensions[1] = f64::from(long()?),
            kind::SNAME => self.called = Some(record.text()),
            kind::STRING => self.text = Some(record.text()),
            kind::COLROW => {
                let (columns, rows) = (short()?, record.short(1).ok_or_else(|| data(record, "two two-byte numbers"))?);
                for (what, value) in [("the number of columns", columns), ("the number of rows", rows)] {
                    if value < 1 {
                        return Err(GdsFault::OutOfRange { what, value: f64::from(value), expected: "1 to 32767" });
                    }
                }
                self.columns_rows = Some([columns.unsigned_abs().into(), rows.unsigned_abs().into()]);
            }
            kind::STRANS => {
                let bits = short()? as u16;
                self.mirrored = bits & 0x8000 != 0;
                noted.absolute += usize::from(bits & 0x0006 != 0);
            }
            kind::MAG => {
                self.magnification = real()?;
                if !MAGNIFICATIONS.contains(&self.magnification) {
                    let (what, value) = ("a magnification", self.magnification);
                    return Err(GdsFault::OutOfRange { what, value, expected: "1e-6 to 1e6" });
                }
            }
            kind::ANGLE => {
                self.angle = real()?;
                if self.angle.abs() > 1e6 {
                    let (what, value) = ("an angle [degrees]", self.angle);
                    return Err(GdsFault::OutOfRange { what, value, expected: "up to 1e6" });
                }
            }
            kind::PROPATTR | kind::PROPVALUE | kind::ELFLAGS | kind::PLEX | kind::PRESENTATION | kind::ELKEY => {}
            other if kind::name(other).is_none() => noted.unknown += 1,
            _ => return Err(GdsFault::Order { expected: "ENDEL before it" }),
        }
        Ok(())
    }

    fn transform(&self, origin: [f64; 2]) -> Transform {
        let turn = Transform::turn_degrees(self.angle);
        let mirror = Transform::mirror([false, self.mirrored]);
        let scale = Transform::scale(self.magnification);
        Transform::shift(origin).after(&scale).after(&turn).after(&mirror)
    }

    /// Columns and rows of an array, and the steps between them.
    fn array(&self, first: [f64; 2]) -> Result<([u32; 2], [[f64; 2]; 2]), GdsFault> {
        if self.kind == kind::SREF {
            return Ok(([1, 1], [[0.0; 2]; 2]));
        }
        let lacks = |lacks: &'static str| GdsFault::Incomplete { element: "AREF", lacks };
        let count = self.columns_rows.ok_or_else(|| lacks("COLROW"))?;
        let [_, across, up] = self.points.as_slice() else { return Err(lacks("XY of three points")) };
        let step = |p: &[f64; 2], n: u32| [(p[0] - first[0]) / f64::from(n), (p[1] - first[1]) / f64::from(n)];
        Ok((count, [step(across, count[0]), step(up, count[1])]))
    }

    fn outline(&self) -> Vec<Vec<[f64; 2]>> {
        if self.width == 0.0 {
            return Vec::new();
        }
        let half = self.width / 2.0;
        let style = match self.path_type {
            1 => Style::RoundEnds,
            2 => Style::Square([half; 2]),
            4 => Style::Square(self.extensions),
            _ => Style::Square([0.0; 2]),
        };
        outline::wire(&self.points, self.width, style)
    }
}

#[cfg(test)]
mod tests;
