//! The same reduction where loops come near singular configurations: hard rows, heavy rows, and a front that stays bounded.
//!
//! A straight arm between two pins closes its loop with a pivot of zero. Near it, the reduction hands the base an inertia
//! that grows with 1/ε², and squares what the other directions know away. Here nothing is squared that has grown:
//!
//! - A closure's row is **hard** until a coordinate has been taken out with it.
//! - Taking x_e out by the hard row ε·x_e + n·a = γ leaves, besides the articulated-body step as if the row were not there,
//!   one more row of weighted least squares on the rest, √D·(c/D − n/ε)·a = …, with D the inertia of the coordinate. It is
//!   kept as a row. While it is light (|n/ε| up to [`LIGHT`]) it is squared into the inertia as usual; a **heavy** one
//!   travels on.
//! - Where heavy rows meet a coordinate, a Householder reflection over them and the coordinate's own row √D takes it out.
//! - Where more rows meet at a body than its front has columns, a QR factorization with the longest rows first brings them
//!   down to that number, so a shuttle with any number of straight arms holds three. A row without length is redundant: it
//!   is counted, with what it contradicts the others by.
//!
//! Rows keep their own scale, which is what makes elimination with rows of very different weight stable (A. J. Cox,
//! N. J. Higham, "Stability of Householder QR factorization for weighted least squares problems", 1998; C. C. Paige,
//! "Computer solution and perturbation analysis of generalized linear least squares problems", Math. Comp. 33, 1979).
//! Compressing rows to the rank of the shuttle is wrong when they are taken as equally hard; weighted by how hard they are
//! it loses nothing.

mod path;

use super::reduction::Task;
use super::schedule::{Schedule, Turn};
use std::ops::Range;

/// Ratio up to which a row is squared into the inertia: its square times the rounding unit is lost.
const LIGHT: f64 = 30.0;
/// A hard row shorter than this share of a closure's own rows is zero: it is lost in rounding.
const ZERO: f64 = 1e-11;
/// The same in a projection. A gap that only a thousandfold motion could close is left until the mechanism has moved on:
/// at the crossing of two branches such a correction would choose one at random.
const IDLE: f64 = 1e-3;

/// What a reduction near a singular configuration met.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Singularity {
    /// Constraint rows that no coordinate could take at their own loop, passed inward.
    pub passed: usize,
    /// Largest number of heavy rows that travelled together.
    pub heavy: usize,
    /// Constraints that others imply.
    pub redundant: usize,
    /// Largest contradiction between a redundant constraint and the others [m/s², or the unit of the task].
    pub contradiction: f64,
}

/// No row.
const NOWHERE: u32 = u32::MAX;

/// Room for rows. A body takes as many out as its coordinates bring in, so there are never more at a time than constraints,
/// and those of one body's coordinates.
#[derive(Debug, Clone)]
pub(super) struct Room {
    /// Entries of every row, `width` apart: the columns of a body's front, a_i first, and the right-hand side.
    entries: Vec<f64>,
    width: usize,
    /// Of each row: the weight that would make it light, √D per length of the coordinate that it came from. Zero: a hard row.
    base: Vec<f64>,
    /// Rows that are not in use.
    free: Vec<u32>,
    /// First and last of the rows that wait at each body.
    waiting: Vec<[u32; 2]>,
    /// The row that waits after each row.
    after: Vec<u32>,
    /// Hard rows of the body at hand.
    hard: Vec<u32>,
    /// The others.
    soft: Vec<u32>,
    /// Coordinates or columns that are left.
    left: Vec<usize>,
    kept: Vec<u32>,
    sizes: Vec<f64>,
    spare: Vec<f64>,
    /// How each coordinate is found on the way out, x = (rhs − row·others)/pivot: rows of all bodies, in the order in which
    /// the coordinates were taken out.
    taken: Vec<f64>,
    /// Where those of each body start.
    taken_start: Vec<usize>,
    /// Which of its body's coordinates each of them is.
    taken_coordinate: Vec<usize>,
}

impl Room {
    /// Room for a mechanism with this schedule.
    pub(super) fn new(schedule: &Schedule) -> Self {
        let (mut start, mut coordinates) = (0, 0);
        let starts = schedule.turns().map(|turn| {
            let here = start;
            start += turn.freedom * (turn.freedom + 3 * turn.front + 1);
            coordinates += turn.freedom;
            here
        });
        let taken_start: Vec<usize> = starts.collect();
        let width = schedule.turns().map(|turn| 3 + 3 * turn.front + 1).max().unwrap_or(0);
        let rows = schedule.entries.iter().map(|e| e.count).sum::<usize>() + 3;
        Self {
            entries: vec![0.0; rows * width],
            width,
            base: vec![0.0; rows],
            free: (0..rows as u32).rev().collect(),
            waiting: vec![[NOWHERE; 2]; taken_start.len()],
            after: vec![NOWHERE; rows],
            hard: Vec::with_capacity(rows),
            soft: Vec::with_capacity(rows),
            left: Vec::with_capacity(width),
            kept: Vec::with_capacity(rows),
            sizes: Vec::with_capacity(rows),
            spare: vec![0.0; width],
            taken: vec![0.0; start],
            taken_start,
            taken_coordinate: vec![0; coordinates],
        }
    }

    /// The entries of a row.
    fn row(&self, row: u32) -> &[f64] {
        &self.entries[row as usize * self.width..(row as usize + 1) * self.width]
    }

    /// The entries of a row, to change.
    fn row_mut(&mut self, row: u32) -> &mut [f64] {
        &mut self.entries[row as usize * self.width..(row as usize + 1) * self.width]
    }

    /// The weight of a row, see [`Room`].
    fn base(&self, row: u32) -> f64 {
        self.base[row as usize]
    }

    /// A row with `base`; its entries are what the last user has left.
    fn take(&mut self, base: f64) -> u32 {
        let row = self.free.pop().unwrap_or_else(|| {
            // not reached by the count above; a longer list is better than none
            self.entries.resize(self.entries.len() + self.width, 0.0);
            self.base.push(0.0);
            self.after.push(NOWHERE);
            self.base.len() as u32 - 1
        });
        self.base[row as usize] = base;
        row
    }

    /// Gives a row back.
    fn give_back(&mut self, row: u32) {
        self.free.push(row);
    }

    /// Lets a row wait at `body`, behind those that are there.
    fn wait(&mut self, row: u32, body: usize) {
        self.after[row as usize] = NOWHERE;
        let [first, last] = &mut self.waiting[body];
        if *first == NOWHERE {
            *first = row;
        } else {
            self.after[*last as usize] = row;
        }
        *last = row;
    }

    /// Calls the rows that wait at `body`, the hard and the others apart.
    fn call(&mut self, body: usize) {
        self.hard.clear();
        self.soft.clear();
        let mut row = self.waiting[body][0];
        while row != NOWHERE {
            let list = if self.base[row as usize] == 0.0 { &mut self.hard } else { &mut self.soft };
            list.push(row);
            row = self.after[row as usize];
        }
        self.waiting[body] = [NOWHERE; 2];
    }

    /// Passes a row over a body's own columns to the first body of its front that it touches.
    fn pass(&mut self, schedule: &Schedule, turn: Turn, row: u32) {
        let nd = turn.freedom;
        let k = nd + 3 * turn.front;
        let front = &schedule.fronts[turn.column..turn.column + turn.front];
        let entries = &self.entries[row as usize * self.width..(row as usize + 1) * self.width];
        let size = entries[nd..k].iter().fold(0.0f64, |a, x| a.max(x.abs()));
        let touches = |slot: usize| (0..3).any(|i| entries[nd + 3 * slot + i].abs() > 1e-14 * size);
        let Some(first) = (0..turn.front).find(|&slot| touches(slot)) else {
            self.give_back(row);
            return;
        };
        let next = front[first];
        let there = schedule.turn(next as usize);
        let places = &schedule.fronts[there.column..there.column + there.front];
        let last = 3 + 3 * there.front;
        self.spare[..last].fill(0.0);
        for (slot, &body) in front.iter().enumerate().skip(first) {
            let place = if body == next { Some(0) } else { places.iter().position(|&b| b == body).map(|p| p + 1) };
            if let Some(place) = place {
                self.spare[3 * place..3 * place + 3].copy_from_slice(&entries[nd + 3 * slot..nd + 3 * slot + 3]);
            }
        }
        self.spare[last] = entries[k];
        let start = row as usize * self.width;
        self.entries[start..=start + last].copy_from_slice(&self.spare[..=last]);
        self.wait(row, next as usize);
    }

    /// Keeps `row` as the way to find the `at`-th coordinate that was taken out of a body, which is its `coordinate`.
    fn keep(&mut self, (body, turn): (usize, Turn), at: usize, coordinate: usize, row: u32) {
        let width = turn.freedom + 3 * turn.front + 1;
        let start = self.taken_start[body] + at * width;
        let from = row as usize * self.width;
        self.taken[start..start + width].copy_from_slice(&self.entries[from..from + width]);
        self.taken_coordinate[turn.first + at] = coordinate;
        self.give_back(row);
    }

    /// The coordinate that was the `at`-th to be taken out of a body, and its row.
    fn kept(&self, (body, turn): (usize, Turn), at: usize) -> (usize, &[f64]) {
        let width = turn.freedom + 3 * turn.front + 1;
        let start = self.taken_start[body] + at * width;
        (self.taken_coordinate[turn.first + at], &self.taken[start..start + width])
    }

    /// Length of a row over the bodies' columns, which lie at `columns`; rotations count per `length`.
    fn norm(&self, row: u32, columns: Range<usize>, length: f64) -> f64 {
        let first = columns.start;
        let entries = &self.row(row)[columns];
        entries.iter().enumerate().map(|(i, x)| (x * column_unit(first, first + i, length)).abs()).fold(0.0, f64::max)
    }

    /// The first of the coordinates that are left which the rows of `list` meet at full size, and that size.
    fn biggest(&self, list: &[u32]) -> (usize, f64) {
        let size = |c: usize| list.iter().map(|&r| self.row(r)[c] * self.row(r)[c]).sum::<f64>().sqrt();
        // the first where nothing is larger: numbers that are not finite go through
        self.left.iter().map(|&c| (c, size(c))).fold((self.left[0], 0.0), |best, x| if x.1 > best.1 { x } else { best })
    }

    /// Takes `column` out of the rows of `list` by the row `pivot`.
    fn subtract(&mut self, list: &[u32], pivot: u32, column: usize, width: usize) {
        let mut spare = std::mem::take(&mut self.spare);
        spare[..width].copy_from_slice(&self.row(pivot)[..width]);
        for &row in list {
            let entries = self.row_mut(row);
            let factor = entries[column] / spare[column];
            for (x, p) in entries.iter_mut().zip(&spare[..width]) {
                *x -= factor * p;
            }
            entries[column] = 0.0;
        }
        self.spare = spare;
    }

    /// Sorts the rows of `list`, longest over the bodies' columns first, equal ones as they came.
    fn longest_first(&mut self, list: &mut [u32], columns: Range<usize>, length: f64) {
        let mut sizes = std::mem::take(&mut self.sizes);
        sizes.clear();
        sizes.extend(list.iter().map(|&r| self.norm(r, columns.clone(), length)));
        for k in 1..list.len() {
            let mut at = k;
            while at > 0 && sizes[at].total_cmp(&sizes[at - 1]).is_gt() {
                sizes.swap(at, at - 1);
                list.swap(at, at - 1);
                at -= 1;
            }
        }
        self.sizes = sizes;
    }

    /// Reflects the rows of `list`, of which the first `width` entries count, so that one of them alone meets `column`; that
    /// one is taken out of the list and returned.
    fn reflect(&mut self, list: &mut Vec<u32>, column: usize, width: usize) -> u32 {
        // the longest entry becomes the pivot's row: rows of very different weight keep their digits
        let size = |k: &usize| self.row(list[*k])[column].abs();
        let at = (0..list.len()).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(0);
        let pivot = list.remove(at);
        let first = self.row(pivot)[column];
        let scale = first.abs();
        let sum: f64 = list.iter().map(|&r| (self.row(r)[column] / scale).powi(2)).sum();
        if sum == 0.0 {
            return pivot;
        }
        let alpha = -(first.signum() * scale * (1.0 + sum).sqrt());
        let v0 = first - alpha;
        // the reflection 1 − v·vᵀ/(v₀·(v₀ − …)), written with ratios so that nothing overflows
        let mut ratio = std::mem::take(&mut self.sizes);
        ratio.clear();
        ratio.extend(list.iter().map(|&r| self.row(r)[column] / v0));
        let beta = 2.0 / (1.0 + ratio.iter().map(|r| r * r).sum::<f64>());
        for j in (0..width).filter(|&j| j != column) {
            let sum = self.row(pivot)[j] + list.iter().zip(&ratio).map(|(&r, x)| x * self.row(r)[j]).sum::<f64>();
            let sum = beta * sum;
            self.row_mut(pivot)[j] -= sum;
            for (&row, x) in list.iter().zip(&ratio) {
                self.row_mut(row)[j] -= x * sum;
            }
        }
        self.row_mut(pivot)[column] = alpha;
        for &row in list.iter() {
            self.row_mut(row)[column] = 0.0;
        }
        self.sizes = ratio;
        pivot
    }

    /// Brings the rows of `list` down to at most one for each of `count` columns by QR, longest rows and columns first. Hard
    /// rows without length are redundant.
    fn shorten(&mut self, list: &mut Vec<u32>, count: usize, (length, zero): (f64, f64), report: &mut Singularity) {
        if list.len() <= count {
            return;
        }
        let mut kept = std::mem::take(&mut self.kept);
        kept.clear();
        self.left.clear();
        self.left.extend(0..count);
        while !self.left.is_empty() && !list.is_empty() {
            let (mut column, mut size) = (self.left[0], 0.0);
            for &c in &self.left {
                let unit = column_unit(0, c, length);
                let n = list.iter().map(|&r| (self.row(r)[c] * unit).powi(2)).sum::<f64>().sqrt();
                if n > size {
                    (column, size) = (c, n);
                }
            }
            if size <= zero {
                break;
            }
            let base = list.iter().map(|&r| self.base[r as usize]).fold(f64::INFINITY, f64::min);
            let pivot = self.reflect(list, column, count + 1);
            self.base[pivot as usize] = base;
            kept.push(pivot);
            self.left.retain(|&c| c != column);
        }
        for &row in list.iter() {
            if self.base[row as usize] == 0.0 {
                report.redundant += 1;
                report.contradiction = report.contradiction.max(self.row(row)[count].abs());
            }
            self.give_back(row);
        }
        list.clear();
        list.extend_from_slice(&kept);
        self.kept = kept;
    }
}

/// What makes the entry of column `at` one per length: bodies' columns start at `first`, and each third is a rotation.
fn column_unit(first: usize, at: usize, length: f64) -> f64 {
    if (at - first) % 3 == 2 { 1.0 / length } else { 1.0 }
}

impl Task {
    /// Length below which a hard row is zero, see [`ZERO`] and [`IDLE`].
    fn zero(self) -> f64 {
        if self == Self::Accelerations { ZERO } else { IDLE }
    }
}
