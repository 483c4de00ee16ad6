//! The second pass: every shape and label in its place on the grid.

use super::bounds::MAX_PLACEMENTS;
use super::counts::{FlattenedSize, placed, shifted};
use crate::cells::{CellReference, CellShape, Library, Transform};
use crate::crossings::CrossingContours;
use crate::drawing::{FlatLayout, GridPoint, Label, Placement, Polygon};
use crate::simple;
use bimorph_base::budget;
use std::collections::HashMap;

/// The second pass.
pub(super) struct Flat<'a> {
    pub(super) drawing: FlatLayout,
    pub(super) polygons: Vec<Vec<Polygon>>,
    pub(super) library: &'a Library,
    pub(super) by_name: &'a HashMap<String, usize>,
    pub(super) counts: &'a [FlattenedSize],
    pub(super) grid: f64,
    pub(super) places: bool,
    pub(super) crossing: usize,
    /// A layer with a polygon that crosses itself too often.
    pub(super) tangled: Option<(String, CrossingContours)>,
    pub(super) vanished: usize,
}

impl Flat<'_> {
    /// Copies a cell and all it calls. The depth of recursion is bounded by the first pass.
    pub(super) fn copy(&mut self, cell: usize, transform: &Transform, parent: Option<usize>) {
        let library = self.library;
        let Some(cell) = library.cells.get(cell) else { return };
        budget::check();
        for shape in &cell.shapes {
            self.shape(shape, transform);
        }
        for text in &cell.texts {
            let layer = text.layer.map_or(String::new(), |k| library.layers[k as usize].clone());
            let at = self.point(transform.apply(text.at));
            self.drawing.labels.push(Label { layer, text: text.text.clone(), at });
        }
        for call in &cell.calls {
            let called = self.by_name[&call.cell];
            if self.counts[called].polygons == 0 && self.counts[called].labels == 0 {
                continue;
            }
            for row in 0..call.count[1] {
                for column in 0..call.count[0] {
                    let local = Transform {
                        origin: shifted(call.transform.origin, &call.pitch, f64::from(column), f64::from(row)),
                        ..call.transform
                    };
                    let inner = transform.after(&local);
                    let index = self.placement(called, &call.cell, &inner, parent);
                    self.copy(called, &inner, index);
                }
            }
        }
    }

    fn placement(&mut self, called: usize, name: &str, t: &Transform, parent: Option<usize>) -> Option<usize> {
        let extent = self.counts[called].drawn.filter(|_| self.places)?;
        let call = CellReference {
            cell: String::new(),
            place: String::new(),
            transform: *t,
            count: [1, 1],
            pitch: [[0.0; 2]; 2],
        };
        let [low, high] = placed(&call, extent);
        let [a, b] = t.columns[0];
        self.drawing.cells.push(Placement {
            cell: name.to_owned(),
            parent,
            origin: [t.origin[0] * self.grid, t.origin[1] * self.grid],
            angle: b.atan2(a),
            mirrored: t.mirrors(),
            magnification: a.hypot(b),
            extent: [self.point(low), self.point(high)],
        });
        Some(self.drawing.cells.len() - 1)
    }

    fn point(&self, p: [f64; 2]) -> GridPoint {
        // The first pass bounds coordinates; rounding of a rotation may add one unit to its box.
        p.map(|x| (x * self.grid).round() as i32)
    }

    fn shape(&mut self, shape: &CellShape, transform: &Transform) {
        let mut contour: Vec<GridPoint> = Vec::with_capacity(shape.points.len());
        for p in &shape.points {
            let p = self.point(transform.apply(*p));
            if contour.last() != Some(&p) {
                contour.push(p);
            }
        }
        while contour.len() > 1 && contour.first() == contour.last() {
            contour.pop();
        }
        let to = &mut self.polygons[shape.layer as usize];
        match simple::polygons(contour) {
            simple::ContourContent::Simple(polygon) => to.push(polygon),
            simple::ContourContent::Crossing(parts) => {
                self.crossing += 1;
                to.extend(parts);
            }
            simple::ContourContent::Nothing => self.vanished += 1,
            simple::ContourContent::Tangled(tangled) => {
                self.tangled.get_or_insert((self.library.layers[shape.layer as usize].clone(), tangled));
            }
        }
    }

    pub(super) fn finish(mut self, placements: u64) -> (FlatLayout, Vec<Vec<Polygon>>) {
        if self.crossing > 0 {
            let text = format!(
                "{} of a contour that crosses or touches itself: what it encloses was taken",
                count(self.crossing, "polygon")
            );
            self.drawing.notes.push(text);
        }
        if self.vanished > 0 {
            self.drawing.notes.push(format!("{} without area left out", count(self.vanished, "shape")));
        }
        if !self.places {
            self.drawing
                .notes
                .push(format!("{placements} placed cells: their places are not kept (at most {MAX_PLACEMENTS})"));
        }
        (self.drawing, self.polygons)
    }
}

/// "1 shape", "2 shapes".
fn count(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}
