//! The integer grid of a flat drawing: the file's own unit where all falls on it, else a power of ten of it.

use super::bounds::DEEPEST;
use super::counts::{FlattenedSize, reach};
use crate::cells::Library;
use crate::drawing::LARGEST_COORDINATE;

/// The finest unit (m).
const FINEST: f64 = 1e-12;
/// Decimals of the file's unit that are read before a coordinate counts as off the grid.
const DECIMALS: u32 = 4;

impl Library {
    /// Grid points in one of the file's units: a power of ten, below 1 only where the drawing would not fit.
    pub(super) fn grid(&mut self, total: &FlattenedSize, order: &[usize], counts: &[FlattenedSize]) -> f64 {
        let largest = f64::from(LARGEST_COORDINATE) - 1.0;
        let reach = reach(total).max(1.0);
        let fits = |grid: f64| reach * grid <= largest;
        if !fits(1.0) {
            let mut grid = 0.1;
            while !fits(grid) {
                grid /= 10.0;
            }
            let unit = self.unit_m / grid;
            self.notes.push(format!(
                "the drawing is {:.3e} m wide: its coordinates were rounded to {unit:.0e} m",
                reach * self.unit_m
            ));
            return grid;
        }
        if !total.off_grid {
            return 1.0;
        }
        // Whatever is turned by no multiple of 90° has no grid; decimals have one.
        let turned = order.iter().flat_map(|k| &self.cells[*k].calls).any(|c| {
            let columns = c.transform.columns.iter().flatten();
            columns.clone().any(|x| x.fract() != 0.0)
        });
        let decimal = |grid: f64| {
            let on = |x: f64| ((x * grid).round() - x * grid).abs() <= 1e-6 * grid;
            order.iter().all(|k| {
                let cell = &self.cells[*k];
                let calls = cell.calls.iter().flat_map(|c| c.pitch.iter().flatten().chain(&c.transform.origin));
                let shapes = cell.shapes.iter().flat_map(|s| s.points.iter().flatten());
                let texts = cell.texts.iter().flat_map(|t| &t.at);
                shapes.chain(calls).chain(texts).all(|x| on(*x))
            })
        };
        debug_assert!(order.iter().all(|k| counts[*k].depth <= DEEPEST));
        if !turned {
            let grids = (1..=DECIMALS).map(|d| 10f64.powi(d as i32));
            if let Some(grid) = grids.take_while(|g| fits(*g)).find(|g| decimal(*g)) {
                return grid;
            }
        }
        let mut grid = 1.0;
        while fits(grid * 10.0) && self.unit_m / (grid * 10.0) > FINEST * 0.999 {
            grid *= 10.0;
        }
        grid
    }
}
