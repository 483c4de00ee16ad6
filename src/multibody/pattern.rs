//! The pattern of the factor: where each block lies, and which blocks each elimination updates.
//!
//! Made once per model. Column k holds the rows that are coupled to body k when its turn comes: its neighbours that are
//! eliminated later, and the fill of loops. Eliminating k updates every pair of those rows; the targets are looked up
//! here, once, so that the numeric factorization is a walk over three contiguous arrays.

/// Structure of a symmetric block matrix in elimination order, with its fill.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pattern {
    /// Block `k` of column `j` for k in `start[j]..start[j + 1]`; row `row[k]`.
    start: Vec<usize>,
    row: Vec<usize>,
    /// Targets of the updates, column by column: for each pair (i ≥ j) of the column's rows, the diagonal block or the
    /// block below the diagonal that it changes.
    target: Vec<usize>,
    target_start: Vec<usize>,
}

impl Pattern {
    /// The pattern of `count` bodies coupled by `edges` (pairs in elimination order; order within a pair and repetitions
    /// do not matter). Cost: O(blocks of the factor).
    pub fn new(count: usize, edges: &[(usize, usize)]) -> Self {
        let mut columns: Vec<Vec<usize>> = vec![Vec::new(); count];
        for &(a, b) in edges {
            if a != b {
                columns[a.min(b)].push(a.max(b));
            }
        }
        let mut children: Vec<Vec<usize>> = vec![Vec::new(); count];
        for k in 0..count {
            for child in std::mem::take(&mut children[k]) {
                let inherited: Vec<usize> = columns[child].iter().copied().filter(|&r| r > k).collect();
                columns[k].extend(inherited);
            }
            columns[k].sort_unstable();
            columns[k].dedup();
            if let Some(&parent) = columns[k].first() {
                children[parent].push(k);
            }
        }
        let mut start = Vec::with_capacity(count + 1);
        let mut row = Vec::new();
        for column in &columns {
            start.push(row.len());
            row.extend_from_slice(column);
        }
        start.push(row.len());
        let mut pattern = Self { start, row, target: Vec::new(), target_start: Vec::with_capacity(count + 1) };
        let mut target = Vec::new();
        for column in &columns {
            pattern.target_start.push(target.len());
            for (i, &below) in column.iter().enumerate() {
                for &right in &column[..i] {
                    // right < below; the fill rule guarantees that this block exists
                    target.push(pattern.block(below, right).unwrap_or(usize::MAX));
                }
            }
        }
        pattern.target_start.push(target.len());
        pattern.target = target;
        pattern
    }

    /// Number of bodies.
    pub fn bodies(&self) -> usize {
        self.start.len() - 1
    }

    /// Number of blocks below the diagonal, fill included.
    pub fn off_blocks(&self) -> usize {
        self.row.len()
    }

    /// Largest number of rows in a column: the widest front [bodies].
    pub fn widest_front(&self) -> usize {
        self.start.windows(2).map(|w| w[1] - w[0]).max().unwrap_or(0)
    }

    /// Index range of the blocks of column `j`.
    pub fn column(&self, j: usize) -> std::ops::Range<usize> {
        self.start[j]..self.start[j + 1]
    }

    /// Row of a block below the diagonal.
    pub fn row(&self, block: usize) -> usize {
        self.row[block]
    }

    /// Off-diagonal update targets of column `j`: for its rows r₀ < r₁ < …, the blocks (r₁,r₀), (r₂,r₀), (r₂,r₁), …
    pub fn targets(&self, j: usize) -> &[usize] {
        &self.target[self.target_start[j]..self.target_start[j + 1]]
    }

    /// Index of the block in row `row`, column `column` (`row > column`), if the pattern holds it.
    pub fn block(&self, row: usize, column: usize) -> Option<usize> {
        let range = self.column(column);
        self.row[range.clone()].binary_search(&row).ok().map(|k| range.start + k)
    }

    /// Block multiplications of one factorization: the operation count that must grow linearly with n + m.
    pub fn multiplications(&self) -> usize {
        (0..self.bodies())
            .map(|j| {
                let rows = self.column(j).len();
                rows + rows * (rows + 1) / 2
            })
            .sum()
    }
}
