//! The first pass: the flattened size of every cell with all its calls, checked before any allocation.

use super::bounds::{DEEPEST, FARTHEST, MAX_CALLS, MAX_LABELS, MAX_POINTS, MAX_POLYGONS};
use super::error::FlattenError;
use crate::cells::{CellReference, Library};
use std::collections::HashMap;

/// Flattened size of a cell.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct FlattenedSize {
    pub(super) polygons: u64,
    pub(super) points: u64,
    pub(super) labels: u64,
    pub(super) placements: u64,
    pub(super) depth: usize,
    /// Box around it (units), and around its polygons alone.
    pub(super) extent: Option<[[f64; 2]; 2]>,
    pub(super) drawn: Option<[[f64; 2]; 2]>,
    /// True when something falls off the grid of the file's unit.
    pub(super) off_grid: bool,
}

impl Library {
    /// Counts what every cell below `top` comes to, called cells first; also gives that order. Without recursion, whatever the depth.
    pub(super) fn count(
        &self,
        top: usize,
        by_name: &HashMap<String, usize>,
    ) -> Result<(Vec<FlattenedSize>, Vec<usize>), FlattenError> {
        const NEW: u8 = 0;
        const OPEN: u8 = 1;
        const DONE: u8 = 2;
        let mut state = vec![NEW; self.cells.len()];
        let mut counts = vec![FlattenedSize::default(); self.cells.len()];
        let mut order = Vec::new();
        let mut stack = vec![(top, 0)];
        state[top] = OPEN;
        while let Some((cell, next)) = stack.pop() {
            let Some(call) = self.cells[cell].calls.get(next) else {
                counts[cell] = self.count_one(cell, by_name, &counts)?;
                state[cell] = DONE;
                order.push(cell);
                continue;
            };
            stack.push((cell, next + 1));
            let name = |k: usize| self.cells[k].name.clone();
            let Some(called) = by_name.get(&call.cell).copied() else {
                let (place, called) = (call.place.clone(), call.cell.clone());
                return Err(FlattenError::Missing { place, cell: name(cell), called });
            };
            match state[called] {
                NEW => {
                    state[called] = OPEN;
                    stack.push((called, 0));
                }
                OPEN => {
                    let (place, called) = (call.place.clone(), name(called));
                    return Err(FlattenError::Recursive { place, cell: name(cell), called });
                }
                _ => {}
            }
        }
        Ok((counts, order))
    }

    fn count_one(
        &self,
        index: usize,
        by_name: &HashMap<String, usize>,
        counts: &[FlattenedSize],
    ) -> Result<FlattenedSize, FlattenError> {
        let cell = &self.cells[index];
        let mut sum = FlattenedSize {
            polygons: cell.shapes.len() as u64,
            labels: cell.texts.len() as u64,
            ..FlattenedSize::default()
        };
        for p in cell.shapes.iter().flat_map(|s| &s.points) {
            sum.points += 1;
            sum.extent = Some(enclose(sum.extent, [*p, *p]));
            sum.off_grid |= p[0].fract() != 0.0 || p[1].fract() != 0.0;
        }
        sum.drawn = sum.extent;
        for text in &cell.texts {
            sum.extent = Some(enclose(sum.extent, [text.at, text.at]));
            sum.off_grid |= text.at.iter().any(|x| x.fract() != 0.0);
        }
        for call in &cell.calls {
            let below = &counts[by_name[&call.cell]];
            let times = u64::from(call.count[0]) * u64::from(call.count[1]);
            if times == 0 {
                continue;
            }
            let add = |sum: u64, n: u64| sum.saturating_add(times.saturating_mul(n));
            sum.polygons = add(sum.polygons, below.polygons);
            sum.points = add(sum.points, below.points);
            sum.labels = add(sum.labels, below.labels);
            sum.placements = add(sum.placements, below.placements + 1);
            sum.depth = sum.depth.max(below.depth + 1);
            let arrays = call.pitch.iter().flatten().all(|x| x.fract() == 0.0);
            sum.off_grid |= below.off_grid || !call.transform.keeps_grid() || !arrays;
            if let Some(extent) = below.extent {
                sum.extent = Some(enclose(sum.extent, placed(call, extent)));
            }
            if let Some(drawn) = below.drawn {
                sum.drawn = Some(enclose(sum.drawn, placed(call, drawn)));
            }
        }
        let cell = || cell.name.clone();
        if sum.depth > DEEPEST {
            return Err(FlattenError::Deep { cell: cell(), depth: sum.depth });
        }
        let bounds = [
            ("polygons", sum.polygons, MAX_POLYGONS),
            ("points", sum.points, MAX_POINTS),
            ("labels", sum.labels, MAX_LABELS),
            ("placed cells", sum.placements, MAX_CALLS),
        ];
        if let Some((what, count, most)) = bounds.into_iter().find(|(_, count, most)| count > most) {
            return Err(FlattenError::Large { cell: cell(), what, count, most });
        }
        let reach = reach(&sum) * self.unit_m;
        if reach.is_finite() && reach < FARTHEST { Ok(sum) } else { Err(FlattenError::Far { cell: cell(), reach }) }
    }
}

fn enclose(a: Option<[[f64; 2]; 2]>, b: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    let Some(a) = a else { return b };
    [[a[0][0].min(b[0][0]), a[0][1].min(b[0][1])], [a[1][0].max(b[1][0]), a[1][1].max(b[1][1])]]
}

/// The box around all that a call places, given the box of the cell.
pub(super) fn placed(call: &CellReference, [low, high]: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    let corners = [low, [low[0], high[1]], high, [high[0], low[1]]];
    let last = [f64::from(call.count[0] - 1), f64::from(call.count[1] - 1)];
    let mut all = None;
    for corner in corners {
        let p = call.transform.apply(corner);
        for [i, j] in [[0.0, 0.0], [last[0], 0.0], [0.0, last[1]], last] {
            let q = shifted(p, &call.pitch, i, j);
            all = Some(enclose(all, [q, q]));
        }
    }
    all.unwrap_or([low, high])
}

/// A place in the column and row of an array.
pub(super) fn shifted(p: [f64; 2], pitch: &[[f64; 2]; 2], column: f64, row: f64) -> [f64; 2] {
    [p[0] + column * pitch[0][0] + row * pitch[1][0], p[1] + column * pitch[0][1] + row * pitch[1][1]]
}

/// The largest coordinate, or what is no number (units).
pub(super) fn reach(count: &FlattenedSize) -> f64 {
    let extent = count.extent.unwrap_or_default();
    let largest = |r: f64, x: &f64| if x.is_finite() { r.max(x.abs()) } else { f64::INFINITY };
    extent.iter().flatten().fold(0.0, largest)
}
