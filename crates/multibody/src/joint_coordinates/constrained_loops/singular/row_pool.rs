//! Room for the rows of loops near singular configurations: which are in use, which wait at a body, and which are kept for the
//! way out.

use super::super::schedule::{BodyElimination, Schedule};

/// No row.
const NOWHERE: u32 = u32::MAX;

/// Room for rows. A body takes as many out as its coordinates bring in, so there are never more at a time than constraints,
/// and those of one body's coordinates.
#[derive(Debug, Clone)]
pub(in crate::joint_coordinates::constrained_loops) struct RowPool {
    /// Entries of every row, `width` apart: the columns of a body's front, a_i first, and the right-hand side.
    entries: Vec<f64>,
    width: usize,
    /// Of each row: the weight that would make it light, √D per length of the coordinate that it came from. Zero: a hard row.
    pub(super) base: Vec<f64>,
    /// Rows that are not in use.
    free: Vec<u32>,
    /// First and last of the rows that wait at each body.
    waiting: Vec<[u32; 2]>,
    /// The row that waits after each row.
    after: Vec<u32>,
    /// Hard rows of the body at hand.
    pub(super) hard: Vec<u32>,
    /// The others.
    pub(super) soft: Vec<u32>,
    /// Coordinates or columns that are left.
    pub(super) left: Vec<usize>,
    pub(super) kept: Vec<u32>,
    pub(super) sizes: Vec<f64>,
    pub(super) spare: Vec<f64>,
    /// Back-substitution of each coordinate, x = (rhs − row·others)/pivot: rows of all bodies, in the order of
    /// elimination.
    taken: Vec<f64>,
    /// Where those of each body start.
    taken_start: Vec<usize>,
    /// Which of its body's coordinates each of them is.
    taken_coordinate: Vec<usize>,
}

impl RowPool {
    /// Room for a mechanism with this schedule.
    pub(in crate::joint_coordinates::constrained_loops) fn new(schedule: &Schedule) -> Self {
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
    pub(super) fn row(&self, row: u32) -> &[f64] {
        &self.entries[row as usize * self.width..(row as usize + 1) * self.width]
    }

    /// The entries of a row, to change.
    pub(super) fn row_mut(&mut self, row: u32) -> &mut [f64] {
        &mut self.entries[row as usize * self.width..(row as usize + 1) * self.width]
    }

    /// The weight of a row, see [`RowPool`].
    pub(super) fn base(&self, row: u32) -> f64 {
        self.base[row as usize]
    }

    /// A row with `base`; its entries are what the last user has left.
    pub(super) fn take(&mut self, base: f64) -> u32 {
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
    pub(super) fn give_back(&mut self, row: u32) {
        self.free.push(row);
    }

    /// Lets a row wait at `body`, behind those that are there.
    pub(super) fn wait(&mut self, row: u32, body: usize) {
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
    pub(super) fn call(&mut self, body: usize) {
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
    pub(super) fn pass(&mut self, schedule: &Schedule, turn: BodyElimination, row: u32) {
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
    pub(super) fn keep(&mut self, (body, turn): (usize, BodyElimination), at: usize, coordinate: usize, row: u32) {
        let width = turn.freedom + 3 * turn.front + 1;
        let start = self.taken_start[body] + at * width;
        let from = row as usize * self.width;
        self.taken[start..start + width].copy_from_slice(&self.entries[from..from + width]);
        self.taken_coordinate[turn.first + at] = coordinate;
        self.give_back(row);
    }

    /// The coordinate that was the `at`-th to be taken out of a body, and its row.
    pub(super) fn kept(&self, (body, turn): (usize, BodyElimination), at: usize) -> (usize, &[f64]) {
        let width = turn.freedom + 3 * turn.front + 1;
        let start = self.taken_start[body] + at * width;
        (self.taken_coordinate[turn.first + at], &self.taken[start..start + width])
    }
}
