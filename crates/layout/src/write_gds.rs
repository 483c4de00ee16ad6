//! A library as a GDSII stream. The same cells give the same bytes: dates are those of 1970.

use super::cells::{Cell, Library};
use super::gds::record::{kind, real_to};
use super::process::canonical;
use thiserror::Error;

/// Maximum number of points of a boundary, including the repeated first one: the capacity of one record.
const MAX_POINTS: usize = 8191;
/// Longest text of a record (bytes).
const LONGEST_TEXT: usize = 65_000;

/// Why a drawing cannot be written.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum WriteError {
    /// GDSII layers are numbers.
    #[error("the layer `{layer}` has no number: GDSII has layers \"number/datatype\" up to 65535")]
    Layer {
        /// Its name.
        layer: String,
    },
    /// More points than a record holds.
    #[error("a polygon of `{cell}` on `{layer}` has {points} points: at most {MAX_POINTS}")]
    Points {
        /// Its cell.
        cell: String,
        /// Its layer.
        layer: String,
        /// Its points.
        points: usize,
    },
    /// A coordinate that is no 32-bit number.
    #[error("a coordinate of `{cell}` is {value:e} units: beyond the range of the format")]
    Range {
        /// Its cell.
        cell: String,
        /// The coordinate (units).
        value: f64,
    },
    /// A text that cannot stand in the format.
    #[error("the text `{text}` cannot be written: {why}")]
    Text {
        /// The text, cut.
        text: String,
        /// Why not.
        why: &'static str,
    },
}

/// The bytes of a stream.
///
/// # Errors
/// See [`WriteError`].
pub(crate) fn write(library: &Library) -> Result<Vec<u8>, WriteError> {
    let numbers: Vec<[u16; 2]> = library.layers.iter().map(|name| number(name)).collect::<Result<_, _>>()?;
    let mut out = GdsWriter { bytes: Vec::new() };
    out.shorts(kind::HEADER, &[600]);
    out.shorts(kind::BGNLIB, &[1970, 1, 1, 0, 0, 0, 1970, 1, 1, 0, 0, 0]);
    out.text(kind::LIBNAME, "BIMORPH")?;
    let units: Vec<u8> = [library.unit_m / 1e-6, library.unit_m].into_iter().flat_map(real_to).collect();
    out.record(kind::UNITS, 5, &units);
    for cell in &library.cells {
        out.cell(cell, library, &numbers)?;
    }
    out.record(kind::ENDLIB, 0, &[]);
    Ok(out.bytes)
}

fn number(name: &str) -> Result<[u16; 2], WriteError> {
    let canonical = canonical(name);
    let parsed = canonical.split_once('/').and_then(|(l, d)| Some([l.parse().ok()?, d.parse().ok()?]));
    parsed.ok_or_else(|| WriteError::Layer { layer: name.to_owned() })
}

struct GdsWriter {
    bytes: Vec<u8>,
}

impl GdsWriter {
    fn record(&mut self, kind: u8, data_type: u8, data: &[u8]) {
        // Callers keep data below 64 KiB.
        self.bytes.extend((data.len() as u16 + 4).to_be_bytes());
        self.bytes.extend([kind, data_type]);
        self.bytes.extend(data);
    }

    fn shorts(&mut self, kind: u8, values: &[u16]) {
        let data: Vec<u8> = values.iter().flat_map(|v| v.to_be_bytes()).collect();
        self.record(kind, 2, &data);
    }

    fn text(&mut self, kind: u8, text: &str) -> Result<(), WriteError> {
        let refused = |why| Err(WriteError::Text { text: text.chars().take(40).collect(), why });
        if text.len() > LONGEST_TEXT {
            return refused("it is longer than 65000 bytes");
        }
        if text.is_empty() || text.contains('\0') {
            return refused("it is empty or holds a zero byte");
        }
        let mut data = text.as_bytes().to_vec();
        if data.len() % 2 == 1 {
            data.push(0);
        }
        self.record(kind, 6, &data);
        Ok(())
    }

    fn points(&mut self, cell: &Cell, points: &[[f64; 2]]) -> Result<(), WriteError> {
        let mut data = Vec::with_capacity(8 * points.len());
        for &value in points.iter().flatten() {
            let rounded = value.round();
            if !(f64::from(i32::MIN)..=f64::from(i32::MAX)).contains(&rounded) {
                return Err(WriteError::Range { cell: cell.name.clone(), value });
            }
            data.extend((rounded as i32).to_be_bytes());
        }
        self.record(kind::XY, 3, &data);
        Ok(())
    }

    fn cell(&mut self, cell: &Cell, library: &Library, numbers: &[[u16; 2]]) -> Result<(), WriteError> {
        self.shorts(kind::BGNSTR, &[1970, 1, 1, 0, 0, 0, 1970, 1, 1, 0, 0, 0]);
        self.text(kind::STRNAME, &cell.name)?;
        for shape in &cell.shapes {
            let [layer, datatype] = numbers[shape.layer as usize];
            if shape.points.len() + 1 > MAX_POINTS {
                let layer = library.layers[shape.layer as usize].clone();
                return Err(WriteError::Points { cell: cell.name.clone(), layer, points: shape.points.len() });
            }
            self.record(kind::BOUNDARY, 0, &[]);
            self.shorts(kind::LAYER, &[layer]);
            self.shorts(kind::DATATYPE, &[datatype]);
            let closed: Vec<[f64; 2]> = shape.points.iter().chain(shape.points.first()).copied().collect();
            self.points(cell, &closed)?;
            self.record(kind::ENDEL, 0, &[]);
        }
        for call in &cell.calls {
            let array = call.count != [1, 1];
            self.record(if array { kind::AREF } else { kind::SREF }, 0, &[]);
            self.text(kind::SNAME, &call.cell)?;
            let t = &call.transform;
            let [a, b] = t.columns[0];
            let (angle, size) = (b.atan2(a).to_degrees(), a.hypot(b));
            if t.mirrors() || angle != 0.0 || size != 1.0 {
                self.shorts(kind::STRANS, &[if t.mirrors() { 0x8000 } else { 0 }]);
                self.record(kind::MAG, 5, &real_to(size));
                self.record(kind::ANGLE, 5, &real_to(angle.rem_euclid(360.0)));
            }
            if array {
                let [columns, rows] = call.count;
                self.shorts(kind::COLROW, &[columns as u16, rows as u16]);
                let end = |pitch: [f64; 2], n: u32| {
                    [t.origin[0] + pitch[0] * f64::from(n), t.origin[1] + pitch[1] * f64::from(n)]
                };
                self.points(cell, &[t.origin, end(call.pitch[0], columns), end(call.pitch[1], rows)])?;
            } else {
                self.points(cell, &[t.origin])?;
            }
            self.record(kind::ENDEL, 0, &[]);
        }
        for text in &cell.texts {
            let [layer, texttype] = text.layer.map_or([0, 0], |k| numbers[k as usize]);
            self.record(kind::TEXT, 0, &[]);
            self.shorts(kind::LAYER, &[layer]);
            self.shorts(kind::TEXTTYPE, &[texttype]);
            self.points(cell, &[text.at])?;
            self.text(kind::STRING, &text.text)?;
            self.record(kind::ENDEL, 0, &[]);
        }
        self.record(kind::ENDSTR, 0, &[]);
        Ok(())
    }
}
