//! Orthogonal elimination of rows in a [`RowPool`]: Householder reflections over a coordinate, and QR with the longest rows first.
//!
//! Reference: A. J. Cox, N. J. Higham, "Stability of Householder QR factorization for weighted least squares problems" (1998).

use super::Singularity;
use super::row_pool::RowPool;
use std::ops::Range;

impl RowPool {
    /// Length of a row over the bodies' columns, which lie at `columns`; rotations count per `length`.
    pub(super) fn norm(&self, row: u32, columns: Range<usize>, length: f64) -> f64 {
        let first = columns.start;
        let entries = &self.row(row)[columns];
        entries.iter().enumerate().map(|(i, x)| (x * column_unit(first, first + i, length)).abs()).fold(0.0, f64::max)
    }

    /// The first of the coordinates that are left which the rows of `list` meet at full size, and that size.
    pub(super) fn biggest(&self, list: &[u32]) -> (usize, f64) {
        let size = |c: usize| list.iter().map(|&r| self.row(r)[c] * self.row(r)[c]).sum::<f64>().sqrt();
        // the first where nothing is larger: numbers that are not finite go through
        self.left.iter().map(|&c| (c, size(c))).fold((self.left[0], 0.0), |best, x| if x.1 > best.1 { x } else { best })
    }

    /// Takes `column` out of the rows of `list` by the row `pivot`.
    pub(super) fn subtract(&mut self, list: &[u32], pivot: u32, column: usize, width: usize) {
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
    pub(super) fn longest_first(&mut self, list: &mut [u32], columns: Range<usize>, length: f64) {
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
    pub(super) fn reflect(&mut self, list: &mut Vec<u32>, column: usize, width: usize) -> u32 {
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
    pub(super) fn shorten(
        &mut self,
        list: &mut Vec<u32>,
        count: usize,
        (length, zero): (f64, f64),
        report: &mut Singularity,
    ) {
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

/// Factor that gives the entry of column `at` the unit 1/length: bodies' columns start at `first`, and each third is a
/// rotation.
fn column_unit(first: usize, at: usize, length: f64) -> f64 {
    if (at - first) % 3 == 2 { 1.0 / length } else { 1.0 }
}
