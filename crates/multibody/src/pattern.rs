//! The pattern of the factor: where each block lies, and which blocks each elimination updates.
//!
//! Made once per model. Column k holds the rows that are coupled to body k when its turn comes: its neighbours that are
//! eliminated later, and the fill of loops. Eliminating k updates every pair of those rows; the targets are looked up
//! here, once, so that the numeric factorization is a walk over three contiguous arrays.
//!
//! Indices are 32 bits wide: with more than four thousand million blocks the blocks alone would fill 300 GB.

/// Structure of a symmetric block matrix in elimination order, with its fill.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pattern {
    /// Block `k` of column `j` for k in `start[j]..start[j + 1]`; row `row[k]`.
    start: Vec<u32>,
    row: Vec<u32>,
    /// Targets of the updates, column by column: for each pair (i > j) of the column's rows, the block below the diagonal
    /// that it changes.
    target: Vec<u32>,
    target_start: Vec<u32>,
    /// For each block, whether no edge stands for it: it is filled by elimination alone.
    fill: Vec<bool>,
}

const NONE: u32 = u32::MAX;
/// Of a block below the diagonal, in the tangents and factors that an analysis has, about (byte).
const FILL_BYTES: usize = 4 * 72;

impl Pattern {
    /// The pattern of `count` bodies coupled by `edges` (pairs in elimination order; order within a pair and repetitions
    /// do not matter). Cost: O(blocks of the factor).
    #[inline]
    pub fn new(count: usize, edges: &[(usize, usize)]) -> Self {
        let mut pattern = Self::without_targets(count, edges);
        pattern.schedule();
        pattern
    }

    /// The same without the targets of updates, for one elimination that finds them on its way.
    pub(crate) fn without_targets(count: usize, edges: &[(usize, usize)]) -> Self {
        let (edge_start, later) = by_earlier_body(count, edges);
        // bodies whose first later neighbour is k pass their other rows on to k: a linked list for each k
        let (mut first_child, mut sibling) = (vec![NONE; count], vec![NONE; count]);
        let mut seen = vec![NONE; count];
        let mut start = Vec::with_capacity(count + 1);
        let mut row: Vec<u32> = Vec::with_capacity(edges.len());
        for k in 0..count {
            start.push(row.len() as u32);
            seen[k] = k as u32;
            for &r in &later[edge_start[k] as usize..edge_start[k + 1] as usize] {
                add(r, k, &mut seen, &mut row);
            }
            let mut child = first_child[k];
            while child != NONE {
                for at in start[child as usize]..start[child as usize + 1] {
                    add(row[at as usize], k, &mut seen, &mut row);
                }
                child = sibling[child as usize];
            }
            let column = &mut row[start[k] as usize..];
            column.sort_unstable();
            if let Some(&parent) = column.first() {
                sibling[k] = first_child[parent as usize];
                first_child[parent as usize] = k as u32;
            }
        }
        start.push(row.len() as u32);
        row.shrink_to_fit();
        // a factor holds a block for each, and solvers hold some factors
        bimorph_base::budget::lay_out(row.len() * FILL_BYTES);
        let fill = vec![true; row.len()];
        let mut pattern = Self { start, row, target: Vec::new(), target_start: Vec::new(), fill };
        for &(a, b) in edges {
            if let Some(block) = pattern.block(a.max(b), a.min(b)) {
                pattern.fill[block] = false;
            }
        }
        pattern
    }

    /// Looks up the targets of every update.
    fn schedule(&mut self) {
        let count = self.bodies();
        let mut target_start = Vec::with_capacity(count + 1);
        let pairs = (0..count).map(|j| self.column(j).len()).map(|n| n * n.saturating_sub(1) / 2).sum();
        bimorph_base::budget::lay_out(pairs * size_of::<u32>());
        let mut target = Vec::with_capacity(pairs);
        for j in 0..count {
            bimorph_base::budget::check();
            target_start.push(target.len() as u32);
            let column = &self.row[self.column(j)];
            for (i, &below) in column.iter().enumerate() {
                for &right in &column[..i] {
                    // right < below; the fill rule guarantees that this block exists
                    let block = self.block(below as usize, right as usize);
                    target.push(block.map_or(NONE, |block| block as u32));
                }
            }
        }
        target_start.push(target.len() as u32);
        (self.target, self.target_start) = (target, target_start);
    }

    /// Its memory for a budget (byte): see [`Pattern::new`].
    pub(crate) fn bytes(&self) -> usize {
        self.row.len() * FILL_BYTES + self.target.len() * size_of::<u32>()
    }

    /// Number of bodies.
    #[inline]
    pub fn bodies(&self) -> usize {
        self.start.len() - 1
    }

    /// Number of blocks below the diagonal, fill included.
    #[inline]
    pub fn off_blocks(&self) -> usize {
        self.row.len()
    }

    /// Largest number of rows in a column: the widest front (bodies).
    #[inline]
    pub fn widest_front(&self) -> usize {
        self.start.windows(2).map(|w| (w[1] - w[0]) as usize).max().unwrap_or(0)
    }

    /// True for a block that is zero before elimination.
    #[inline]
    pub fn is_fill(&self, block: usize) -> bool {
        self.fill[block]
    }

    /// Index range of the blocks of column `j`.
    #[inline]
    pub fn column(&self, j: usize) -> std::ops::Range<usize> {
        self.start[j] as usize..self.start[j + 1] as usize
    }

    /// Row of a block below the diagonal.
    #[inline]
    pub fn row(&self, block: usize) -> usize {
        self.row[block] as usize
    }

    /// Rows of column `j`, ascending.
    #[inline]
    pub fn rows(&self, j: usize) -> &[u32] {
        &self.row[self.column(j)]
    }

    /// Off-diagonal update targets of column `j`: for its rows r₀ < r₁ < …, the blocks (r₁,r₀), (r₂,r₀), (r₂,r₁), …
    #[inline]
    pub fn targets(&self, j: usize) -> &[u32] {
        &self.target[self.target_start[j] as usize..self.target_start[j + 1] as usize]
    }

    /// Index of the block in row `row`, column `column` (`row > column`), if the pattern holds it.
    #[inline]
    pub fn block(&self, row: usize, column: usize) -> Option<usize> {
        let range = self.column(column);
        let row = u32::try_from(row).ok()?;
        let rows = &self.row[range.clone()];
        // neighbours along a beam
        if rows.first() == Some(&row) {
            return Some(range.start);
        }
        rows.binary_search(&row).ok().map(|k| range.start + k)
    }

    /// Block multiplications of one factorization: the operation count that must grow linearly with n + m.
    #[inline]
    pub fn multiplications(&self) -> usize {
        (0..self.bodies())
            .map(|j| {
                let rows = self.column(j).len();
                rows + rows * (rows + 1) / 2
            })
            .sum()
    }

    /// Products of a block with a vector in one solve: each block below the diagonal serves both sweeps, each diagonal
    /// block once.
    #[inline]
    pub fn solve_multiplications(&self) -> usize {
        self.bodies() + 2 * self.off_blocks()
    }
}

/// Appends row `r` to the column of body `k` unless it is there.
#[inline]
fn add(r: u32, k: usize, seen: &mut [u32], row: &mut Vec<u32>) {
    if seen[r as usize] != k as u32 {
        seen[r as usize] = k as u32;
        row.push(r);
    }
}

/// The later bodies of the edges, sorted by their earlier body, and where each body's begin.
fn by_earlier_body(count: usize, edges: &[(usize, usize)]) -> (Vec<u32>, Vec<u32>) {
    let mut start = vec![0u32; count + 1];
    for &(a, b) in edges.iter().filter(|(a, b)| a != b) {
        start[a.min(b) + 1] += 1;
    }
    for k in 0..count {
        start[k + 1] += start[k];
    }
    let mut later = vec![0; start[count] as usize];
    let mut at = start.clone();
    for &(a, b) in edges.iter().filter(|(a, b)| a != b) {
        let slot = &mut at[a.min(b)];
        later[*slot as usize] = a.max(b) as u32;
        *slot += 1;
    }
    (start, later)
}
