//! Rows of polynomials over common monomials, eight of them or eight monomials to a vector instruction.

// sums of a fixed number are indexed as they are written
#![allow(clippy::needless_range_loop)]

use super::chain::{MonomialChain, MonomialValues};
use bimorph_multibody::batch::{LANES, Lane8, SimdReal};
use bimorph_multibody::scalar::Lanes;
use nalgebra::DMatrix;

/// Groups of lanes that are summed at once: their additions do not wait for each other.
const TOGETHER: usize = 4;

/// A matrix by groups of eight rows, the last one filled with zeros, a column after the other.
#[derive(Debug, Clone)]
pub(super) struct LaneColumns {
    columns: usize,
    lanes: Vec<Lane8>,
}

impl LaneColumns {
    /// Of a matrix, with zeros behind it to so many groups of rows.
    pub(super) fn new(matrix: &DMatrix<f64>, groups: usize) -> Self {
        let at = |row: usize, k: usize| if row < matrix.nrows() { matrix[(row, k)] } else { 0.0 };
        let mut lanes = Vec::with_capacity(groups * matrix.ncols());
        for g in 0..groups {
            for k in 0..matrix.ncols() {
                let mut column = Lane8::NONE;
                (0..LANES).for_each(|lane| column.0[lane] = at(g * LANES + lane, k));
                lanes.push(column);
            }
        }
        Self { columns: matrix.ncols(), lanes }
    }

    /// Number of columns.
    pub(super) fn columns(&self) -> usize {
        self.columns
    }

    /// The columns of a group of rows.
    #[inline(always)]
    pub(super) fn group(&self, group: usize) -> &[Lane8] {
        &self.lanes[group * self.columns..(group + 1) * self.columns]
    }

    /// An element.
    #[inline(always)]
    pub(super) fn at(&self, row: usize, column: usize) -> f64 {
        self.group(row / LANES)[column].0[row % LANES]
    }

    /// `to +=` the product with the first numbers of `x`; `to` has all groups.
    #[inline(always)]
    pub(super) fn add_product<W: SimdReal>(&self, simd: W::Simd, x: &[f64], to: &mut [f64]) {
        let weights = &x[..self.columns];
        let (mut lanes, mut to) = (&self.lanes[..], to.as_chunks_mut::<LANES>().0);
        while to.len() >= TOGETHER {
            add_sums::<W, TOGETHER>(simd, &mut lanes, weights, &mut to);
        }
        while !to.is_empty() && !weights.is_empty() {
            add_sums::<W, 1>(simd, &mut lanes, weights, &mut to);
        }
    }
}

/// Coefficients of some rows, twice: by groups of rows, and by groups of monomials. Values of rows have zeros behind them to a multiple of the
/// lanes.
#[derive(Debug, Clone)]
pub(super) struct PolynomialRows {
    /// Number of rows.
    pub(super) count: usize,
    of_rows: LaneColumns,
    of_monomials: LaneColumns,
}

impl PolynomialRows {
    /// Of coefficients, rows × monomials.
    pub(super) fn new(coefficients: &DMatrix<f64>, chain: &MonomialChain) -> Self {
        let count = coefficients.nrows();
        Self {
            count,
            of_rows: LaneColumns::new(coefficients, count.div_ceil(LANES)),
            of_monomials: LaneColumns::new(&coefficients.transpose(), chain.groups()),
        }
    }

    /// Coefficients by groups of rows.
    pub(super) fn of_rows(&self) -> &LaneColumns {
        &self.of_rows
    }

    /// Coefficients by groups of monomials.
    pub(super) fn of_monomials(&self) -> &LaneColumns {
        &self.of_monomials
    }

    /// Groups of lanes that the rows take.
    pub(super) fn groups(&self) -> usize {
        self.count.div_ceil(LANES)
    }

    /// Storage for a value of each row.
    pub(super) fn storage(&self) -> Vec<f64> {
        vec![0.0; self.groups() * LANES]
    }

    /// Storage for derivatives with coordinates.
    pub(super) fn slope_storage(&self, size: usize) -> Vec<Lane8> {
        vec![Lane8::NONE; self.groups() * size]
    }

    /// Values where the monomials have these.
    #[inline(always)]
    pub(super) fn values<W: SimdReal>(&self, simd: W::Simd, monomials: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        self.of_rows.add_product::<W>(simd, monomials, out);
    }

    /// `to +=` the coefficients of each monomial in the sum of the rows with these weights.
    #[inline(always)]
    pub(super) fn add_combined<W: SimdReal>(&self, simd: W::Simd, weights: &[f64], to: &mut [f64]) {
        self.of_monomials.add_product::<W>(simd, weights, to);
    }

    /// Derivatives with `size` coordinates at a state: those of a group of rows together, a coordinate after the other.
    #[inline(always)]
    pub(super) fn slopes<W: SimdReal>(
        &self,
        simd: W::Simd,
        chain: &MonomialChain,
        at: &MonomialValues,
        size: usize,
        out: &mut [Lane8],
    ) {
        out.fill(Lane8::NONE);
        for (columns, out) in self.of_rows.lanes.chunks_exact(self.of_rows.columns).zip(out.chunks_exact_mut(size)) {
            chain.each_slope(at, |k, i, slope| {
                let sum = W::load(simd, &out[i]) + W::load(simd, &columns[k]) * W::splat(simd, slope);
                sum.store(&mut out[i]);
            });
        }
    }
}

/// `to +=` the sums of `K` groups of lanes, which both slices lose.
#[inline(always)]
fn add_sums<W: SimdReal, const K: usize>(
    simd: W::Simd,
    columns: &mut &[Lane8],
    weights: &[f64],
    to: &mut &mut [[f64; LANES]],
) {
    let n = weights.len();
    let (here, further) = columns.split_at(K * n);
    *columns = further;
    let mut sums = [W::splat(simd, 0.0); K];
    for k in 0..n {
        let weight = W::splat(simd, weights[k]);
        for i in 0..K {
            sums[i] += W::load(simd, &here[i * n + k]) * weight;
        }
    }
    let (now, later) = std::mem::take(to).split_at_mut(K);
    *to = later;
    for i in 0..K {
        let sum = W::load(simd, &Lanes(now[i])) + sums[i];
        let mut found = Lane8::NONE;
        sum.store(&mut found);
        now[i] = found.0;
    }
}

/// `to +=` the products Jᵀ·J of derivatives, groups of rows × coordinates.
#[inline(always)]
pub(super) fn add_gram<W: SimdReal>(simd: W::Simd, slopes: &[Lane8], to: &mut DMatrix<f64>) {
    let m = to.nrows();
    for i in 0..m {
        for j in 0..=i {
            let mut sum = W::splat(simd, 0.0);
            for of in slopes.chunks_exact(m) {
                sum += W::load(simd, &of[i]) * W::load(simd, &of[j]);
            }
            let mut lanes = Lane8::NONE;
            sum.store(&mut lanes);
            let [a, b, c, d, e, f, g, h] = lanes.0;
            let sum = ((a + b) + (c + d)) + ((e + f) + (g + h));
            to[(i, j)] += sum;
            if i != j {
                to[(j, i)] += sum;
            }
        }
    }
}
