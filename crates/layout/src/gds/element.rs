//! One element of a structure while its records come in.

use super::error::GdsFault;
use super::record::{Record, kind};
use crate::cells::Transform;
use crate::outline::{self, Style};

/// Most points of one polygon or path.
pub(super) const LONGEST: usize = 1 << 20;
/// Factors of a call that can be meant (1).
pub(super) const MAGNIFICATIONS: std::ops::RangeInclusive<f64> = 1e-6..=1e6;

/// An element that is being read.
#[derive(Debug, Default)]
pub(super) struct GdsElement {
    pub(super) name: &'static str,
    pub(super) kind: u8,
    pub(super) layer: Option<u16>,
    pub(super) datatype: Option<u16>,
    pub(super) points: Vec<[f64; 2]>,
    pub(super) width: f64,
    pub(super) path_type: i16,
    pub(super) extensions: [f64; 2],
    pub(super) called: Option<String>,
    pub(super) text: Option<String>,
    pub(super) columns_rows: Option<[u32; 2]>,
    pub(super) mirrored: bool,
    pub(super) magnification: f64,
    pub(super) angle: f64,
    pub(super) offset: u64,
}

/// Content that was skipped or approximated.
#[derive(Debug, Default)]
pub(super) struct IgnoredContent {
    pub(super) nodes: usize,
    pub(super) lines: usize,
    pub(super) absolute: usize,
    pub(super) unknown: usize,
}

impl GdsElement {
    pub(super) fn take(&mut self, record: &Record<'_>, noted: &mut IgnoredContent) -> Result<(), GdsFault> {
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

    pub(super) fn transform(&self, origin: [f64; 2]) -> Transform {
        let turn = Transform::turn_degrees(self.angle);
        let mirror = Transform::mirror([false, self.mirrored]);
        let scale = Transform::scale(self.magnification);
        Transform::shift(origin).after(&scale).after(&turn).after(&mirror)
    }

    /// Columns and rows of an array, and the steps between them.
    pub(super) fn array(&self, first: [f64; 2]) -> Result<([u32; 2], [[f64; 2]; 2]), GdsFault> {
        if self.kind == kind::SREF {
            return Ok(([1, 1], [[0.0; 2]; 2]));
        }
        let lacks = |lacks: &'static str| GdsFault::Incomplete { element: "AREF", lacks };
        let count = self.columns_rows.ok_or_else(|| lacks("COLROW"))?;
        let [_, across, up] = self.points.as_slice() else { return Err(lacks("XY of three points")) };
        let step = |p: &[f64; 2], n: u32| [(p[0] - first[0]) / f64::from(n), (p[1] - first[1]) / f64::from(n)];
        Ok((count, [step(across, count[0]), step(up, count[1])]))
    }

    pub(super) fn outline(&self) -> Vec<Vec<[f64; 2]>> {
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

/// Fault of a record whose data does not have the expected kind.
pub(super) fn data(record: &Record<'_>, expected: &'static str) -> GdsFault {
    GdsFault::Data { bytes: record.data.len(), expected }
}
