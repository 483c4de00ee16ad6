//! A layout with its hierarchy, as a file holds it: cells with outlines, labels and calls of other cells.
//!
//! Both readers make one of these; [`flatten`](super::flatten) makes a [`FlatLayout`](super::FlatLayout) of it.

use std::collections::BTreeMap;

/// A file's cells.
#[derive(Debug, Clone, Default)]
pub(crate) struct Library {
    /// Name of the file.
    pub(crate) source: String,
    /// Size of the unit in which all coordinates are given (m).
    pub(crate) unit_m: f64,
    /// Names of layers; shapes and labels name them by index.
    pub(crate) layers: Vec<String>,
    /// Cells in file order.
    pub(crate) cells: Vec<Cell>,
    /// Features that the reader omitted or approximated, as messages.
    pub(crate) notes: Vec<String>,
    /// The cell that the file is about, where it says so.
    pub(crate) top: Option<String>,
    pub(super) index: BTreeMap<String, usize>,
}

/// One cell.
#[derive(Debug, Clone, Default)]
pub(crate) struct Cell {
    /// Its name.
    pub(crate) name: String,
    /// Contours, any direction, closed without repeating the first point (units).
    pub(crate) shapes: Vec<CellShape>,
    /// Texts.
    pub(crate) texts: Vec<CellText>,
    /// Calls of other cells.
    pub(crate) calls: Vec<CellReference>,
}

/// A contour on a layer.
#[derive(Debug, Clone)]
pub(crate) struct CellShape {
    /// Index into [`Library::layers`].
    pub(crate) layer: u32,
    /// Its points (units).
    pub(crate) points: Vec<[f64; 2]>,
}

/// A text on a layer.
#[derive(Debug, Clone)]
pub(crate) struct CellText {
    /// Index into [`Library::layers`]; none where the file gives none.
    pub(crate) layer: Option<u32>,
    /// The text.
    pub(crate) text: String,
    /// Its place (units).
    pub(crate) at: [f64; 2],
}

/// A cell called in a place, or in a grid of them.
#[derive(Debug, Clone)]
pub(crate) struct CellReference {
    /// Name of the cell.
    pub(crate) cell: String,
    /// Where in the file, for messages ("line 7", "byte 1204").
    pub(crate) place: String,
    /// How it is placed.
    pub(crate) transform: Transform,
    /// Columns and rows.
    pub(crate) count: [u32; 2],
    /// From one column, and one row, to the next (units).
    pub(crate) pitch: [[f64; 2]; 2],
}

/// p ↦ origin + columns·p, with columns magnification·R(angle), the second one negated where mirrored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Transform {
    /// Where the origin goes (units).
    pub(crate) origin: [f64; 2],
    /// Where the unit vectors of x and y go.
    pub(crate) columns: [[f64; 2]; 2],
}

impl Transform {
    /// Nothing moves.
    pub(crate) const IDENTITY: Self = Self { origin: [0.0; 2], columns: [[1.0, 0.0], [0.0, 1.0]] };

    /// A shift.
    pub(crate) fn shift(origin: [f64; 2]) -> Self {
        Self { origin, ..Self::IDENTITY }
    }

    /// A rotation that takes the x axis to this direction (of any length above 0), exact along the axes.
    pub(crate) fn turn([a, b]: [f64; 2]) -> Self {
        let length = a.hypot(b);
        let (c, s) = if b == 0.0 {
            (a.signum(), 0.0)
        } else if a == 0.0 {
            (0.0, b.signum())
        } else {
            (a / length, b / length)
        };
        Self { origin: [0.0; 2], columns: [[c, s], [-s, c]] }
    }

    /// A rotation by an angle (degrees), exact at multiples of 90°.
    pub(crate) fn turn_degrees(angle: f64) -> Self {
        let turned = angle.rem_euclid(360.0);
        let quarters = [(0.0, [1.0, 0.0]), (90.0, [0.0, 1.0]), (180.0, [-1.0, 0.0]), (270.0, [0.0, -1.0])];
        let exact = quarters.iter().find(|(at, _)| *at == turned).map(|(_, direction)| *direction);
        let radians = turned.to_radians();
        Self::turn(exact.unwrap_or([radians.cos(), radians.sin()]))
    }

    /// Mirrored: x ↦ −x with `[true, false]`, y ↦ −y with `[false, true]`.
    pub(crate) fn mirror([x, y]: [bool; 2]) -> Self {
        let sign = |mirrored: bool| if mirrored { -1.0 } else { 1.0 };
        Self { origin: [0.0; 2], columns: [[sign(x), 0.0], [0.0, sign(y)]] }
    }

    /// Larger by a factor.
    pub(crate) fn scale(factor: f64) -> Self {
        Self { origin: [0.0; 2], columns: [[factor, 0.0], [0.0, factor]] }
    }

    /// Where a point goes.
    pub(crate) fn apply(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [[a, b], [c, d]] = self.columns;
        [self.origin[0] + a * x + c * y, self.origin[1] + b * x + d * y]
    }

    /// Where a direction goes.
    pub(crate) fn direct(&self, direction: [f64; 2]) -> [f64; 2] {
        Self { origin: [0.0; 2], ..*self }.apply(direction)
    }

    /// `first`, then this.
    pub(crate) fn after(&self, first: &Self) -> Self {
        Self {
            origin: self.apply(first.origin),
            columns: [self.direct(first.columns[0]), self.direct(first.columns[1])],
        }
    }

    /// True for rotations by multiples of 90° without scaling: grid points stay on the grid.
    pub(crate) fn keeps_grid(&self) -> bool {
        let whole = |x: &f64| x.fract() == 0.0;
        self.columns.iter().flatten().all(whole) && self.origin.iter().all(whole)
    }

    /// True when it turns counter-clockwise contours clockwise.
    pub(crate) fn mirrors(&self) -> bool {
        let [[a, b], [c, d]] = self.columns;
        a * d - b * c < 0.0
    }
}

impl Library {
    /// The index of a layer name; new ones are added.
    pub(crate) fn layer(&mut self, name: &str) -> u32 {
        let next = self.layers.len();
        let index = *self.index.entry(name.to_owned()).or_insert(next);
        if index == next {
            self.layers.push(name.to_owned());
        }
        index as u32
    }
}

#[cfg(test)]
mod tests {
    //! Transforms act in the order in which they are composed, exactly along the axes. Source: by hand.
    use super::*;

    #[test]
    fn quarter_turns_and_mirrors_are_exact() {
        let t = Transform::shift([10.0, 0.0]).after(&Transform::turn_degrees(90.0));
        assert_eq!(t.apply([3.0, 1.0]), [9.0, 3.0]);
        assert!(t.keeps_grid() && !t.mirrors());
        let m = Transform::turn_degrees(-90.0).after(&Transform::mirror([false, true]));
        assert_eq!(m.apply([3.0, 1.0]), [-1.0, -3.0]);
        assert!(m.mirrors());
        assert!(!Transform::turn_degrees(30.0).keeps_grid());
        assert_eq!(Transform::turn([0.0, -7.0]).apply([1.0, 0.0]), [0.0, -1.0]);
    }
}
