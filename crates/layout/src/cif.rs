//! CIF 2.0 (Mead, Conway 1980, appendix; Sproull, Lyon): text of symbols, boxes, polygons, wires and flashes.
//!
//! A distance is a centimicron (10 nm) times the symbol's scale a/b, which is not handed on to the symbols that it calls. Beyond the
//! standard: layer names may be longer than four letters and have digits and `_` (SUGAR writes `POLY1`), `9 NAME;` names a symbol,
//! and `94 TEXT x y LAYER;` and `95 TEXT length width x y LAYER;` are labels, with `"…"` around a text that has blanks. Other user
//! extensions are passed over with a note. Shapes outside symbols make a cell `(top)`.

mod error;
mod shapes;
mod text;

use super::cells::{Cell, CellReference, CellShape, CellText, Library, Transform};
use super::flatten::MAX_POINTS;
use bimorph_base::budget;
use std::collections::HashMap;
use text::CifReader;

pub use error::{CifError, CifFault};

/// Size of the unit (m).
const CENTIMICRON: f64 = 1e-8;
/// Most points of one polygon or wire.
const LONGEST: usize = 1 << 20;
/// Most shapes, labels and calls of a file, before hierarchy is taken out.
const MAX_PARTS: usize = 4_000_000;
/// The cell of what stands outside symbols.
pub(super) const OUTSIDE: &str = "(top)";

/// Reads a CIF file; `file` is its name in messages.
///
/// # Errors
/// See [`CifError`]: the first thing that is wrong, with line and column.
pub(crate) fn read(text: &[u8], file: &str) -> Result<Library, CifError> {
    let mut reading = CifParser {
        reader: CifReader::new(text, file),
        library: Library { source: file.to_owned(), unit_m: CENTIMICRON, ..Library::default() },
        outside: Cell { name: OUTSIDE.to_owned(), ..Cell::default() },
        symbol: None,
        defined: HashMap::new(),
        layer: None,
        parts: 0,
        points: 0,
        skipped: 0,
        first_skipped: String::new(),
    };
    reading.file()?;
    Ok(reading.finish())
}

/// A symbol that is being defined.
struct Symbol {
    number: i64,
    scale: f64,
    cell: Cell,
    outer_layer: Option<u32>,
}

struct CifParser<'a> {
    reader: CifReader<'a>,
    library: Library,
    outside: Cell,
    symbol: Option<Symbol>,
    /// Symbols by number, as indices of cells.
    defined: HashMap<i64, usize>,
    layer: Option<u32>,
    parts: usize,
    points: usize,
    skipped: usize,
    first_skipped: String,
}

type CifResult<T> = Result<T, CifError>;

impl CifParser<'_> {
    fn file(&mut self) -> CifResult<()> {
        loop {
            budget::check();
            self.reader.blanks()?;
            let Some(byte) = self.reader.peek() else {
                return Err(self.reader.error(CifFault::End("without `E`: is it whole?")));
            };
            if self.parts > MAX_PARTS {
                return Err(self.reader.error(CifFault::Many { what: "shapes, labels and calls", most: MAX_PARTS }));
            }
            if self.points as u64 > MAX_POINTS {
                return Err(self.reader.error(CifFault::Many { what: "points", most: MAX_POINTS as usize }));
            }
            match byte {
                b';' => self.reader.advance(),
                b'P' => self.polygon()?,
                b'B' => self.block()?,
                b'W' => self.wire()?,
                b'R' => self.flash()?,
                b'L' => self.layer()?,
                b'D' => self.definition()?,
                b'C' => self.call()?,
                b'0'..=b'9' => self.extension()?,
                b'E' => {
                    if self.symbol.is_some() {
                        return Err(self.reader.error(CifFault::Order("`E` inside a symbol: `DF;` is missing")));
                    }
                    return Ok(());
                }
                _ => {
                    let found = self.reader.found();
                    return Err(self.reader.error(CifFault::Command { found }));
                }
            }
        }
    }

    fn scale(&self) -> f64 {
        self.symbol.as_ref().map_or(1.0, |s| s.scale)
    }

    fn cell(&mut self) -> &mut Cell {
        self.symbol.as_mut().map_or(&mut self.outside, |s| &mut s.cell)
    }

    fn add(&mut self, points: Vec<[f64; 2]>) -> CifResult<()> {
        let Some(layer) = self.layer else { return Err(self.reader.error(CifFault::NoLayer)) };
        self.parts += 1;
        self.points += points.len();
        self.cell().shapes.push(CellShape { layer, points });
        Ok(())
    }

    /// A point, in the unit of the file.
    fn point(&mut self) -> CifResult<[f64; 2]> {
        let (x, y) = (self.reader.integer()?, self.reader.integer()?);
        Ok([x as f64, y as f64].map(|v| v * self.scale()))
    }

    fn size(&mut self, what: &'static str) -> CifResult<f64> {
        let value = self.reader.integer()?;
        if value > 0 { Ok(value as f64 * self.scale()) } else { Err(self.reader.error(CifFault::Size { what, value })) }
    }

    fn layer(&mut self) -> CifResult<()> {
        self.reader.advance();
        let name = self.reader.name("the name of a layer")?;
        self.reader.end()?;
        self.layer = Some(self.library.layer(&name));
        Ok(())
    }

    fn definition(&mut self) -> CifResult<()> {
        self.reader.advance();
        self.reader.blanks()?;
        match self.reader.peek() {
            Some(b'S') => {
                self.reader.advance();
                if self.symbol.is_some() {
                    return Err(self.reader.error(CifFault::Order("`DS` inside a symbol: `DF;` is missing")));
                }
                let number = self.number("the number of a symbol")?;
                if self.defined.contains_key(&number) {
                    return Err(self.reader.error(CifFault::Twice { number }));
                }
                let mut scale = 1.0;
                if self.reader.number_follows()? {
                    let (a, b) = (self.reader.integer()?, self.reader.integer()?);
                    for (what, value) in [("a of the scale a/b", a), ("b of the scale a/b", b)] {
                        if value <= 0 {
                            return Err(self.reader.error(CifFault::Size { what, value }));
                        }
                    }
                    scale = a as f64 / b as f64;
                }
                self.reader.end()?;
                let cell = Cell { name: number.to_string(), ..Cell::default() };
                self.symbol = Some(Symbol { number, scale, cell, outer_layer: self.layer.take() });
            }
            Some(b'F') => {
                self.reader.advance();
                self.reader.end()?;
                let Some(symbol) = self.symbol.take() else {
                    return Err(self.reader.error(CifFault::Order("`DF` outside a symbol")));
                };
                self.layer = symbol.outer_layer;
                self.defined.insert(symbol.number, self.library.cells.len());
                self.library.cells.push(symbol.cell);
            }
            Some(b'D') => {
                self.reader.advance();
                if self.symbol.is_some() {
                    return Err(self.reader.error(CifFault::Order("`DD` inside a symbol")));
                }
                let from = self.number("the number of a symbol")?;
                self.reader.end()?;
                self.defined.retain(|number, _| *number < from);
            }
            _ => {
                let found = self.reader.found();
                return Err(self.reader.error(CifFault::Expected { expected: "`DS`, `DF` or `DD`", found }));
            }
        }
        Ok(())
    }

    fn number(&mut self, what: &'static str) -> CifResult<i64> {
        let value = self.reader.integer()?;
        if value >= 0 { Ok(value) } else { Err(self.reader.error(CifFault::Size { what, value })) }
    }

    /// C number, then T x y, MX, MY and R a b in the order in which they act.
    fn call(&mut self) -> CifResult<()> {
        let place = self.reader.place();
        self.reader.advance();
        let number = self.number("the number of a symbol")?;
        let mut transform = Transform::IDENTITY;
        loop {
            self.reader.blanks()?;
            let next = match self.reader.peek() {
                Some(b'T') => {
                    self.reader.advance();
                    Transform::shift(self.point()?)
                }
                Some(b'M') => {
                    self.reader.advance();
                    self.reader.blanks()?;
                    let axis = self.reader.peek();
                    let found = self.reader.found();
                    self.reader.advance();
                    match axis {
                        Some(b'X') => Transform::mirror([true, false]),
                        Some(b'Y') => Transform::mirror([false, true]),
                        _ => return Err(self.reader.error(CifFault::Expected { expected: "`MX` or `MY`", found })),
                    }
                }
                Some(b'R') => {
                    self.reader.advance();
                    self.direction()?
                }
                _ => break,
            };
            transform = next.after(&transform);
        }
        self.reader.end()?;
        self.parts += 1;
        // A symbol that comes later is found at the end.
        let cell = self.defined.get(&number).map_or_else(|| format!("#{number}"), |k| format!("@{k}"));
        let call = CellReference { cell, place, transform, count: [1, 1], pitch: [[0.0; 2]; 2] };
        self.cell().calls.push(call);
        Ok(())
    }

    /// 9 names a symbol, 94 and 95 are labels.
    fn extension(&mut self) -> CifResult<()> {
        let place = self.reader.place();
        let statement = self.reader.statement()?;
        let words = text::words(&statement);
        let number = |word: &String| word.parse::<f64>().ok().filter(|x| x.is_finite() && x.abs() < 1e15);
        let label = |skip: usize| {
            // TEXT [sizes] x y [LAYER]
            let at = words.get(2 + skip..4 + skip)?;
            Some((words.get(1)?.clone(), [number(&at[0])?, number(&at[1])?], words.get(4 + skip).cloned()))
        };
        let found = match (words.first().map(String::as_str), words.len()) {
            (Some("9"), 2) if self.symbol.is_some() => {
                let name = words[1].clone();
                self.cell().name = name;
                return Ok(());
            }
            (Some("94"), 4..=5) => label(0),
            (Some("95"), 6..=7) => label(2),
            _ => None,
        };
        if let Some((text, at, layer)) = found {
            let layer = layer.map(|name| self.library.layer(&name)).or(self.layer);
            let at = at.map(|v| v * self.scale());
            self.parts += 1;
            self.cell().texts.push(CellText { layer, text, at });
        } else {
            self.skipped += 1;
            if self.skipped == 1 {
                let shown: String = statement.chars().take(40).collect();
                self.first_skipped = format!("{place}: `{shown}`");
            }
        }
        Ok(())
    }

    /// Names instead of numbers: cells get unique names, calls name them.
    fn finish(mut self) -> Library {
        let mut uses: HashMap<String, usize> = HashMap::new();
        let mut names = Vec::with_capacity(self.library.cells.len());
        for cell in &mut self.library.cells {
            let used = uses.entry(cell.name.clone()).or_insert(0);
            *used += 1;
            if *used > 1 {
                cell.name = format!("{}~{used}", cell.name);
            }
            names.push(cell.name.clone());
        }
        for call in self.library.cells.iter_mut().chain([&mut self.outside]).flat_map(|c| &mut c.calls) {
            let bound = call.cell.strip_prefix('@').and_then(|k| k.parse().ok());
            let later = || self.defined.get(&call.cell.strip_prefix('#')?.parse().ok()?).copied();
            if let Some(k) = bound.or_else(later) {
                call.cell.clone_from(&names[k]);
            } else {
                call.cell = format!("symbol {}", &call.cell[1..]);
            }
        }
        let outside = &self.outside;
        // A file whose top level is one call as it stands means that symbol.
        let plain = |call: &CellReference| call.transform == Transform::IDENTITY && names.contains(&call.cell);
        let alone = outside.shapes.is_empty() && outside.texts.is_empty();
        if alone && outside.calls.len() == 1 && plain(&outside.calls[0]) {
            let called = outside.calls[0].cell.clone();
            self.library.top = Some(called);
        } else if !alone || !outside.calls.is_empty() {
            self.library.top = Some(OUTSIDE.to_owned());
            self.library.cells.push(self.outside);
        }
        if self.skipped > 0 {
            let note = format!("{} user extensions passed over, the first at {}", self.skipped, self.first_skipped);
            self.library.notes.push(note);
        }
        self.library
    }
}

#[cfg(test)]
mod tests;
