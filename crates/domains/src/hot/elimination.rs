//! Elimination of nodes whose couplings are not symmetric, on a symmetric pattern and without exchanges of rows.

use bimorph_multibody::layout::EliminationLayout;
use nalgebra::ComplexField;

/// A matrix on the pattern of a layout, then its factors.
#[derive(Debug, Clone, Default)]
pub(super) struct NodeMatrix<T> {
    diagonal: Vec<T>,
    /// Entries below the diagonal, column by column of the pattern.
    lower: Vec<T>,
    /// Entries above it, row by row in the same order.
    upper: Vec<T>,
    /// Scratch: a vector in the order of elimination.
    now: Vec<T>,
}

impl<T: ComplexField<RealField = f64> + Copy> NodeMatrix<T> {
    /// Of no size.
    pub(super) fn empty() -> Self {
        Self { diagonal: Vec::new(), lower: Vec::new(), upper: Vec::new(), now: Vec::new() }
    }

    /// Sets all entries to zero.
    pub(super) fn clear(&mut self, layout: &EliminationLayout) {
        let (count, blocks) = (layout.order.len(), layout.pattern.off_blocks());
        for (entries, length) in
            [(&mut self.diagonal, count), (&mut self.lower, blocks), (&mut self.upper, blocks), (&mut self.now, count)]
        {
            entries.clear();
            entries.resize(length, T::from_real(0.0));
        }
    }

    /// Adds to the entry of a row and a column.
    pub(super) fn add(&mut self, layout: &EliminationLayout, (row, column): (usize, usize), value: T) {
        let (i, j) = (layout.place[row], layout.place[column]);
        if i == j {
            self.diagonal[i] += value;
        } else if let Some(block) = layout.pattern.block(i.max(j), i.min(j)) {
            let entries = if i > j { &mut self.lower } else { &mut self.upper };
            entries[block] += value;
        }
    }

    /// Factors in place. Returns the number of pivots with a negative real part.
    pub(super) fn factor(&mut self, layout: &EliminationLayout) -> usize {
        let pattern = &layout.pattern;
        let mut negative = 0;
        for j in 0..self.diagonal.len() {
            let pivot = self.diagonal[j];
            negative += usize::from(pivot.real() < 0.0);
            for below in pattern.column(j) {
                let l = self.lower[below] / pivot;
                self.lower[below] = l;
                let row = pattern.row(below);
                for right in pattern.column(j) {
                    let column = pattern.row(right);
                    let update = l * self.upper[right];
                    if row == column {
                        self.diagonal[row] -= update;
                    } else if let Some(block) = pattern.block(row.max(column), row.min(column)) {
                        let entries = if row > column { &mut self.lower } else { &mut self.upper };
                        entries[block] -= update;
                    }
                }
            }
        }
        negative
    }

    /// The inverse times a vector, in place.
    pub(super) fn solve(&mut self, layout: &EliminationLayout, x: &mut [T]) {
        let Self { diagonal, lower, upper, now } = self;
        let pattern = &layout.pattern;
        x.iter().zip(&layout.place).for_each(|(x, k)| now[*k] = *x);
        for j in 0..diagonal.len() {
            let value = now[j];
            for below in pattern.column(j) {
                now[pattern.row(below)] -= lower[below] * value;
            }
        }
        for j in (0..diagonal.len()).rev() {
            let mut value = now[j];
            for right in pattern.column(j) {
                value -= upper[right] * now[pattern.row(right)];
            }
            now[j] = value / diagonal[j];
        }
        x.iter_mut().zip(&layout.place).for_each(|(x, k)| *x = now[*k]);
    }
}
