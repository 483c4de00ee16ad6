//! Hierarchy to polygons: everything a cell calls, in its place, on one integer grid.
//!
//! Two passes. The first counts the result, called cells before their callers. A file of a few lines that stands for
//! billions of polygons is therefore rejected before any allocation. The second copies. The grid is the file's own unit
//! where all falls on it; else the finest power of ten of it, down to 1 pm, on which the drawing fits.

mod bounds;
mod copy;
mod counts;
mod error;
mod grid;

use super::cells::{Library, Transform};
use super::drawing::FlatLayout;
use bimorph_base::budget;
use bounds::MAX_PLACEMENTS;
pub use bounds::{DEEPEST, MAX_LABELS, MAX_POINTS, MAX_POLYGONS};
use copy::Flat;
pub use error::FlattenError;
use std::collections::{BTreeMap, HashMap};

impl Library {
    /// Makes a drawing of one cell: the named one, or the only one that no other calls.
    ///
    /// # Errors
    /// See [`FlattenError`].
    pub(crate) fn flatten(mut self, cell: Option<&str>) -> Result<FlatLayout, FlattenError> {
        let mut by_name = HashMap::with_capacity(self.cells.len());
        for (k, cell) in self.cells.iter().enumerate() {
            if by_name.insert(cell.name.clone(), k).is_some() {
                self.notes.push(format!("`{}` is there twice: the later one counts", cell.name));
            }
        }
        let top = self.top(cell, &by_name)?;
        let (counts, order) = self.count(top, &by_name)?;
        let total = counts[top];
        // A point, and what holds a polygon and a label.
        let bytes = total.points * 8 + total.polygons * 80 + total.labels * 80;
        budget::lay_out(usize::try_from(bytes).unwrap_or(usize::MAX));
        let grid = self.grid(&total, &order, &counts);
        let mut flat = Flat {
            drawing: FlatLayout {
                unit_m: self.unit_m / grid,
                layers: BTreeMap::new(),
                labels: Vec::with_capacity(total.labels as usize),
                source: self.source.clone(),
                top: self.cells[top].name.clone(),
                cells: Vec::new(),
                notes: self.notes.clone(),
            },
            polygons: vec![Vec::new(); self.layers.len()],
            library: &self,
            by_name: &by_name,
            counts: &counts,
            grid,
            places: total.placements <= MAX_PLACEMENTS,
            crossing: 0,
            tangled: None,
            vanished: 0,
        };
        flat.copy(top, &Transform::IDENTITY, None);
        if let Some((layer, tangled)) = flat.tangled.take() {
            return Err(FlattenError::Tangled { layer, tangled });
        }
        let (drawing, polygons) = flat.finish(total.placements);
        let mut drawing = drawing;
        drawing.layers = self.layers.iter().cloned().zip(polygons).filter(|(_, all)| !all.is_empty()).collect();
        Ok(drawing)
    }

    /// The cell to draw.
    fn top(&self, cell: Option<&str>, by_name: &HashMap<String, usize>) -> Result<usize, FlattenError> {
        const MAX_LISTED: usize = 20;
        let list = |names: &[&str]| {
            let more = names.len().saturating_sub(MAX_LISTED);
            let listed = names[..names.len().min(MAX_LISTED)].join(", ");
            if more > 0 { format!("{listed} and {more} more") } else { listed }
        };
        if let Some(name) = cell.or(self.top.as_deref()) {
            return by_name.get(name).copied().ok_or_else(|| {
                let names: Vec<&str> = self.cells.iter().map(|c| c.name.as_str()).collect();
                FlattenError::Top { message: format!("{}: no cell `{name}`; there are: {}", self.source, list(&names)) }
            });
        }
        let mut called = vec![false; self.cells.len()];
        for call in self.cells.iter().flat_map(|c| &c.calls) {
            if let Some(k) = by_name.get(&call.cell) {
                called[*k] = true;
            }
        }
        let tops: Vec<usize> = by_name.values().copied().filter(|k| !called[*k]).collect();
        let mut tops: Vec<usize> = if tops.is_empty() { by_name.values().copied().collect() } else { tops };
        tops.sort_unstable();
        // Cells of metadata, as some programs write them, hold nothing and are no choice.
        let filled = |k: &usize| !self.cells[*k].shapes.is_empty() || !self.cells[*k].calls.is_empty();
        if tops.iter().filter(|k| filled(k)).count() == 1 {
            tops.retain(filled);
        }
        match tops.as_slice() {
            [only] => Ok(*only),
            [] => Err(FlattenError::Top { message: format!("{}: there is no cell in it", self.source) }),
            several => {
                let names: Vec<&str> = several.iter().map(|k| self.cells[*k].name.as_str()).collect();
                let message = format!(
                    "{}: {} cells are called by no other, {}: choose one with --cell",
                    self.source,
                    names.len(),
                    list(&names)
                );
                Err(FlattenError::Top { message })
            }
        }
    }
}
