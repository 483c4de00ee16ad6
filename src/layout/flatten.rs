//! Hierarchy to polygons: everything a cell calls, in its place, on one integer grid.
//!
//! Two passes. The first counts what would come out, cells before those that call them, so that nothing is laid out of a
//! file of a few lines that stands for billions of polygons. The second copies. The grid is the file's own unit where all falls on
//! it; else the finest power of ten of it, down to 1 pm, on which the drawing fits.

use super::cells::{Call, Library, Shape, Transform};
use super::crossings::Tangled;
use super::drawing::{Drawing, LARGEST_COORDINATE, Label, Placement, Point, Polygon};
use super::simple;
use crate::budget;
use std::collections::{BTreeMap, HashMap};
use thiserror::Error;

/// Most polygons of a flat drawing.
pub const MOST_POLYGONS: u64 = 2_000_000;
/// Most points of a flat drawing.
pub const MOST_POINTS: u64 = 20_000_000;
/// Most labels of a flat drawing.
pub const MOST_LABELS: u64 = 500_000;
/// Most placed cells of a drawing whose places are kept; with more, none are.
const MOST_PLACEMENTS: u64 = 200_000;
/// Most placed cells at all: a bound on the work, since empty cells can be called too.
const MOST_CALLS: u64 = 20_000_000;
/// Calls may nest this deep.
pub const DEEPEST: usize = 100;
/// The finest unit [m].
const FINEST: f64 = 1e-12;
/// Decimals of the file's unit that are looked at before a coordinate counts as off the grid.
const DECIMALS: u32 = 4;

/// Why a hierarchy is not flattened.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum FlattenError {
    /// A call of a cell that is not there.
    #[error("{place}: `{cell}` calls `{called}`, which is not in the file")]
    Missing {
        /// Where the call stands.
        place: String,
        /// The calling cell.
        cell: String,
        /// The called one.
        called: String,
    },
    /// A cell that calls itself, through others or not.
    #[error("{place}: `{cell}` calls `{called}`, which calls `{cell}` again")]
    Recursive {
        /// Where the call stands.
        place: String,
        /// The calling cell.
        cell: String,
        /// The called one.
        called: String,
    },
    /// Calls nest too deep.
    #[error("calls nest {depth} deep below `{cell}`: at most {DEEPEST}")]
    Deep {
        /// The outermost cell of the chain.
        cell: String,
        /// How deep.
        depth: usize,
    },
    /// Too much would come out.
    #[error("`{cell}` would be {count} {what} without hierarchy: at most {most}; name a smaller cell with --cell")]
    Large {
        /// The cell.
        cell: String,
        /// Polygons, points, labels or placed cells.
        what: &'static str,
        /// How many.
        count: u64,
        /// The bound.
        most: u64,
    },
    /// A polygon that crosses itself too often.
    #[error("a polygon on layer {layer}: {tangled}")]
    Tangled {
        /// Its layer.
        layer: String,
        /// How often, and where.
        tangled: Tangled,
    },
    /// The chosen cell is not there, or none is chosen and there are several.
    #[error("{message}")]
    Top {
        /// What can be chosen.
        message: String,
    },
    /// A coordinate that is no number or further away than a wafer is wide.
    #[error("`{cell}` reaches to {reach:e} m from its origin: expected less than {FARTHEST} m")]
    Far {
        /// The cell.
        cell: String,
        /// How far [m].
        reach: f64,
    },
}

/// Half of the largest wafer and some [m].
const FARTHEST: f64 = 0.5;

/// What a cell comes to.
#[derive(Debug, Clone, Copy, Default)]
struct Count {
    polygons: u64,
    points: u64,
    labels: u64,
    placements: u64,
    depth: usize,
    /// Box around it [units], and around its polygons alone.
    extent: Option<[[f64; 2]; 2]>,
    drawn: Option<[[f64; 2]; 2]>,
    /// True when something falls off the grid of the file's unit.
    off_grid: bool,
}

impl Library {
    /// Makes a drawing of one cell: the named one, or the only one that no other calls.
    ///
    /// # Errors
    /// See [`FlattenError`].
    pub(crate) fn flatten(mut self, cell: Option<&str>) -> Result<Drawing, FlattenError> {
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
            drawing: Drawing {
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
            places: total.placements <= MOST_PLACEMENTS,
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
        const MOST_LISTED: usize = 20;
        let list = |names: &[&str]| {
            let more = names.len().saturating_sub(MOST_LISTED);
            let listed = names[..names.len().min(MOST_LISTED)].join(", ");
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

    /// Counts what every cell below `top` comes to, called cells first; also gives that order. Without recursion, whatever the depth.
    fn count(&self, top: usize, by_name: &HashMap<String, usize>) -> Result<(Vec<Count>, Vec<usize>), FlattenError> {
        const NEW: u8 = 0;
        const OPEN: u8 = 1;
        const DONE: u8 = 2;
        let mut state = vec![NEW; self.cells.len()];
        let mut counts = vec![Count::default(); self.cells.len()];
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
        counts: &[Count],
    ) -> Result<Count, FlattenError> {
        let cell = &self.cells[index];
        let mut sum = Count { polygons: cell.shapes.len() as u64, labels: cell.texts.len() as u64, ..Count::default() };
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
            ("polygons", sum.polygons, MOST_POLYGONS),
            ("points", sum.points, MOST_POINTS),
            ("labels", sum.labels, MOST_LABELS),
            ("placed cells", sum.placements, MOST_CALLS),
        ];
        if let Some((what, count, most)) = bounds.into_iter().find(|(_, count, most)| count > most) {
            return Err(FlattenError::Large { cell: cell(), what, count, most });
        }
        let reach = reach(&sum) * self.unit_m;
        if reach.is_finite() && reach < FARTHEST { Ok(sum) } else { Err(FlattenError::Far { cell: cell(), reach }) }
    }

    /// Grid points in one of the file's units: a power of ten, below 1 only where the drawing would not fit.
    fn grid(&mut self, total: &Count, order: &[usize], counts: &[Count]) -> f64 {
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

fn enclose(a: Option<[[f64; 2]; 2]>, b: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    let Some(a) = a else { return b };
    [[a[0][0].min(b[0][0]), a[0][1].min(b[0][1])], [a[1][0].max(b[1][0]), a[1][1].max(b[1][1])]]
}

/// The box around all that a call places, given the box of the cell.
fn placed(call: &Call, [low, high]: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
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

fn shifted(p: [f64; 2], pitch: &[[f64; 2]; 2], column: f64, row: f64) -> [f64; 2] {
    [p[0] + column * pitch[0][0] + row * pitch[1][0], p[1] + column * pitch[0][1] + row * pitch[1][1]]
}

/// "1 shape", "2 shapes".
fn count(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

/// The largest coordinate, or what is no number [units].
fn reach(count: &Count) -> f64 {
    let extent = count.extent.unwrap_or_default();
    let largest = |r: f64, x: &f64| if x.is_finite() { r.max(x.abs()) } else { f64::INFINITY };
    extent.iter().flatten().fold(0.0, largest)
}

/// The second pass.
struct Flat<'a> {
    drawing: Drawing,
    polygons: Vec<Vec<Polygon>>,
    library: &'a Library,
    by_name: &'a HashMap<String, usize>,
    counts: &'a [Count],
    grid: f64,
    places: bool,
    crossing: usize,
    /// A layer with a polygon that crosses itself too often.
    tangled: Option<(String, Tangled)>,
    vanished: usize,
}

impl Flat<'_> {
    /// Copies a cell and all it calls. The depth of recursion is bounded by the first pass.
    fn copy(&mut self, cell: usize, transform: &Transform, parent: Option<usize>) {
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
        let call =
            Call { cell: String::new(), place: String::new(), transform: *t, count: [1, 1], pitch: [[0.0; 2]; 2] };
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

    fn point(&self, p: [f64; 2]) -> Point {
        // The first pass bounds coordinates; rounding of a rotation may add one unit to its box.
        p.map(|x| (x * self.grid).round() as i32)
    }

    fn shape(&mut self, shape: &Shape, transform: &Transform) {
        let mut contour: Vec<Point> = Vec::with_capacity(shape.points.len());
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
            simple::Outcome::Simple(polygon) => to.push(polygon),
            simple::Outcome::Crossing(parts) => {
                self.crossing += 1;
                to.extend(parts);
            }
            simple::Outcome::Nothing => self.vanished += 1,
            simple::Outcome::Tangled(tangled) => {
                self.tangled.get_or_insert((self.library.layers[shape.layer as usize].clone(), tangled));
            }
        }
    }

    fn finish(mut self, placements: u64) -> (Drawing, Vec<Vec<Polygon>>) {
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
                .push(format!("{placements} placed cells: their places are not kept (at most {MOST_PLACEMENTS})"));
        }
        (self.drawing, self.polygons)
    }
}
