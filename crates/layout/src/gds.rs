//! GDSII stream format (Calma, release 6): BOUNDARY, BOX, PATH, SREF, AREF and TEXT.
//!
//! A layer is called "layer/datatype", a text's "layer/texttype". Records are read one at a time; what the file holds is kept
//! with its hierarchy. Properties and NODE elements are passed over; the latter with a note, as are absolute magnifications and
//! widths, which are taken as relative ones.

mod element;
mod error;
pub(crate) mod record;

use super::cells::{Cell, CellReference, CellShape, CellText, Library};
use super::flatten::MAX_POINTS;
use bimorph_base::budget;
use record::{Record, Records, kind};
use std::io::Read;

use element::{GdsElement, IgnoredContent, data};
pub use error::{GdsError, GdsFault};

/// Most shapes, labels and calls of a file, before hierarchy is taken out.
const MAX_PARTS: usize = 4_000_000;
/// Most cells of a file.
const MAX_CELLS: usize = 1_000_000;
/// Sizes of a database unit that can be meant (m).
const UNITS: std::ops::RangeInclusive<f64> = 1e-15..=1e-3;
/// Records between two reports of progress.
const REPORT: u32 = 1 << 14;

/// Reads a GDSII stream; `file` is its name in messages. `watch` receives the number of bytes read and returns whether
/// to continue.
///
/// # Errors
/// See [`GdsError`]: the first thing that is wrong, with its byte and record.
pub(crate) fn read(from: impl Read, file: &str, watch: &mut dyn FnMut(u64) -> bool) -> Result<Library, GdsError> {
    let library = Library { source: file.to_owned(), unit_m: 0.0, ..Library::default() };
    let mut reading =
        GdsParser { library, cell: None, element: None, parts: 0, points: 0, noted: IgnoredContent::default() };
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

struct GdsParser {
    library: Library,
    cell: Option<Cell>,
    element: Option<GdsElement>,
    parts: usize,
    points: u64,
    noted: IgnoredContent,
}

impl GdsParser {
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
                if self.library.cells.len() >= MAX_CELLS {
                    return Err(GdsFault::Many { what: "cells", most: MAX_CELLS as u64 });
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
                self.element = Some(GdsElement { name, kind, offset, magnification: 1.0, ..GdsElement::default() });
            }
            kind::ENDLIB => return Err(GdsFault::Order { expected: "ENDSTR before the end of the library" }),
            kind::ENDEL | kind::XY | kind::LAYER => return Err(GdsFault::Order { expected: "an element around it" }),
            other => self.noted.unknown += usize::from(kind::name(other).is_none()),
        }
        Ok(false)
    }

    fn close(&mut self, element: GdsElement) -> Result<(), GdsFault> {
        self.parts += 1;
        if self.parts > MAX_PARTS {
            return Err(GdsFault::Many { what: "elements", most: MAX_PARTS as u64 });
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
            cell.calls.push(CellReference {
                cell: called,
                place: format!("byte {}", element.offset),
                transform,
                count,
                pitch,
            });
            return Ok(());
        }
        let layer = element.layer.ok_or_else(|| lacks("LAYER"))?;
        let layer = self.library.layer(&format!("{layer}/{}", element.datatype.unwrap_or(0)));
        if element.kind == kind::TEXT {
            let text = element.text.ok_or_else(|| lacks("STRING"))?;
            cell.texts.push(CellText { layer: Some(layer), text, at: first });
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
            if self.points > MAX_POINTS {
                return Err(GdsFault::Many { what: "points", most: MAX_POINTS });
            }
            cell.shapes.push(CellShape { layer, points });
        }
        Ok(())
    }

    fn finish(mut self) -> Library {
        let IgnoredContent { nodes, lines, absolute, unknown } = self.noted;
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

#[cfg(test)]
mod tests;
