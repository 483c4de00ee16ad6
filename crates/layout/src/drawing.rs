//! A layout without hierarchy: polygons for each layer on an integer grid, and labels.

use std::collections::BTreeMap;

/// Coordinates stay within ±this many database units, so that set operations on them are exact (±1.07 mm at 1 pm).
pub const LARGEST_COORDINATE: i32 = (1 << 30) - 1;

/// A point of the grid: x, y (database units).
pub type GridPoint = [i32; 2];

/// A flat drawing.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FlatLayout {
    /// Size of a database unit (m).
    pub unit_m: f64,
    /// Polygons as drawn (they may overlap), by layer: CIF's name, or GDSII's "layer/datatype".
    pub layers: BTreeMap<String, Vec<Polygon>>,
    /// Texts with a place, in reading order.
    pub labels: Vec<Label>,
    /// Name of the file, as it is shown in messages.
    pub source: String,
    /// Name of the cell that was flattened.
    pub top: String,
    /// Where cells stood before they were flattened, parents before children; the top cell is not among them.
    pub cells: Vec<Placement>,
    /// Features that a reader omitted or approximated: messages with position and size.
    pub notes: Vec<String>,
}

/// A polygon with holes.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Polygon {
    /// Outer contour counter-clockwise, then holes clockwise; closed without repeating the first point.
    pub contours: Vec<Vec<GridPoint>>,
}

/// A text with a place.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Label {
    /// Layer, named as those of polygons ("layer/texttype" in GDSII); empty where the file gives none.
    pub layer: String,
    /// Its text.
    pub text: String,
    /// Its place (database units).
    pub at: GridPoint,
}

/// A cell in its place: p ↦ origin + magnification·R(angle)·(mirrored ? (x, −y) : (x, y)).
#[derive(Debug, Clone, PartialEq)]
pub struct Placement {
    /// Name of the cell.
    pub cell: String,
    /// Index of the placement that holds it in [`FlatLayout::cells`]; none: the top cell.
    pub parent: Option<usize>,
    /// Place of the cell's origin in the drawing (database units).
    pub origin: [f64; 2],
    /// Rotation (rad), after mirroring.
    pub angle: f64,
    /// Mirrored about its own x axis first.
    pub mirrored: bool,
    /// Magnification (1).
    pub magnification: f64,
    /// Lower left and upper right corner of the box around all polygons in it (database units).
    pub extent: [GridPoint; 2],
}

impl Polygon {
    /// A polygon without holes, turned counter-clockwise and beginning with its leftmost, then lowest point.
    pub fn from_contour(mut contour: Vec<GridPoint>) -> Self {
        if twice_area(&contour) < 0 {
            contour.reverse();
        }
        let first = (0..contour.len()).min_by_key(|k| contour[*k]).unwrap_or(0);
        contour.rotate_left(first);
        Self { contours: vec![contour] }
    }

    /// A box between two opposite corners.
    pub fn rectangle([x0, y0]: GridPoint, [x1, y1]: GridPoint) -> Self {
        let ([x0, x1], [y0, y1]) = ([x0.min(x1), x0.max(x1)], [y0.min(y1), y0.max(y1)]);
        Self { contours: vec![vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]]] }
    }

    /// Twice its area, holes taken off (square database units): exact.
    pub fn twice_area(&self) -> i128 {
        self.contours.iter().map(|contour| twice_area(contour)).sum()
    }

    /// Lower left and upper right corner of the box around it; none without points.
    pub fn extent(&self) -> Option<[GridPoint; 2]> {
        let mut points = self.contours.iter().flatten();
        let first = *points.next()?;
        Some(points.fold([first, first], |[low, high], p| {
            [[low[0].min(p[0]), low[1].min(p[1])], [high[0].max(p[0]), high[1].max(p[1])]]
        }))
    }
}

/// Twice the signed area of a closed contour (square database units), positive counter-clockwise: exact.
pub fn twice_area(contour: &[GridPoint]) -> i128 {
    let next = contour.iter().cycle().skip(1);
    let cross = |([x0, y0], [x1, y1]): (&GridPoint, &GridPoint)| {
        i128::from(i64::from(*x0) * i64::from(*y1)) - i128::from(i64::from(*x1) * i64::from(*y0))
    };
    contour.iter().zip(next).map(cross).sum()
}

impl FlatLayout {
    /// Number of polygons on all layers.
    pub fn polygons(&self) -> usize {
        self.layers.values().map(Vec::len).sum()
    }

    /// Lower left and upper right corner of the box around all polygons; none without any.
    pub fn extent(&self) -> Option<[GridPoint; 2]> {
        let boxes = self.layers.values().flatten().filter_map(Polygon::extent);
        boxes.reduce(|[a, b], [c, d]| [[a[0].min(c[0]), a[1].min(c[1])], [b[0].max(d[0]), b[1].max(d[1])]])
    }

    /// A place in micrometres, for messages: "(12.5, -3) µm".
    pub fn place(&self, at: [f64; 2]) -> String {
        let um = |x: f64| {
            let rounded = (x * self.unit_m * 1e6 * 1e4).round() / 1e4;
            if rounded == 0.0 { 0.0 } else { rounded }
        };
        format!("({}, {}) µm", um(at[0]), um(at[1]))
    }
}

#[cfg(test)]
mod tests {
    //! Areas and boxes of polygons are exact. Source: counted by hand.
    use super::*;

    #[test]
    fn areas_take_holes_off_and_do_not_overflow() {
        let mut ring = Polygon::rectangle([0, 0], [10, 10]);
        ring.contours.push(vec![[2, 2], [2, 4], [4, 4], [4, 2]]);
        assert_eq!(ring.twice_area(), 2 * (100 - 4));
        let m = LARGEST_COORDINATE;
        assert_eq!(Polygon::rectangle([-m, -m], [m, m]).twice_area(), 8 * i128::from(m) * i128::from(m));
        assert_eq!(Polygon::from_contour(vec![[1, 0], [0, 0], [0, 1]]).contours[0], [[0, 0], [1, 0], [0, 1]]);
        assert_eq!(ring.extent(), Some([[0, 0], [10, 10]]));
    }
}
