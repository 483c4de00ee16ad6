//! Symmetric block factorization and solves over lanes: [`crate::factor`].
//!
//! A vanishing pivot in one variant invalidates that lane alone: the lane is reported, and its results are not used.

use super::{
    BLANK, LANES, Lane8, LaneBlock, LanePose, SimdReal, ZERO_POSE, load, load_block, product, store, store_block, times,
};
use crate::Pattern;
use crate::factor::LOST;
use crate::model::MIN_HELD;

/// A symmetric matrix of blocks on a pattern in each variant; after [`LaneMatrix::factor`], its factors.
#[derive(Debug, Clone)]
pub struct LaneMatrix {
    /// Diagonal blocks; after factoring, their inverses.
    pub diagonal: Vec<LaneBlock>,
    /// Blocks below the diagonal; after factoring, L.
    pub below: Vec<LaneBlock>,
    /// Diagonal entries before elimination.
    scale: Vec<LanePose>,
}

impl LaneMatrix {
    /// A zero matrix on `pattern`.
    #[inline]
    pub fn new(pattern: &Pattern) -> Self {
        Self {
            diagonal: vec![BLANK; pattern.bodies()],
            below: vec![BLANK; pattern.off_blocks()],
            scale: vec![ZERO_POSE; pattern.bodies()],
        }
    }

    /// Sets every block to zero.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.diagonal.fill(BLANK);
        self.below.fill(BLANK);
    }

    /// Replaces the matrix by its factors. Returns the lanes in which a pivot vanished.
    #[inline(always)]
    pub fn factor<W: SimdReal>(&mut self, simd: W::Simd, pattern: &Pattern) -> [bool; LANES] {
        let mut sound = W::splat(simd, 0.0);
        for (scale, block) in self.scale.iter_mut().zip(&self.diagonal) {
            for i in 0..3 {
                W::load(simd, &block[i][i]).abs().store(&mut scale[i]);
            }
        }
        for j in 0..pattern.bodies() {
            let (block, scale) = (load_block::<W>(simd, &self.diagonal[j]), load(simd, &self.scale[j]));
            let own = LaneBlockFactor::new(block, &scale, &mut sound);
            store_block(own.inverse(), &mut self.diagonal[j]);
            let column = pattern.column(j);
            let mut target = pattern.targets(j).iter();
            for (k, &row) in column.clone().zip(pattern.rows(j)) {
                let coupling = load_block::<W>(simd, &self.below[k]);
                for (i, &at) in (column.start..k).zip(target.by_ref()) {
                    let scaled = load_block::<W>(simd, &self.below[i]);
                    let to = &mut self.below[at as usize];
                    for s in 0..3 {
                        for r in 0..3 {
                            let mut entry = W::load(simd, &to[s][r]);
                            for c in 0..3 {
                                entry -= coupling[c][r] * scaled[c][s];
                            }
                            entry.store(&mut to[s][r]);
                        }
                    }
                }
                let mut later = load_block(simd, &self.diagonal[row as usize]);
                store_block(own.eliminate(&coupling, &mut later), &mut self.below[k]);
                store_block(later, &mut self.diagonal[row as usize]);
            }
        }
        let mut spoilt = Lane8::NONE;
        sound.store(&mut spoilt);
        spoilt.0.map(f64::is_nan)
    }

    /// How many pivots are negative in each lane: as many as eigenvalues are (Sylvester). Not a number where a block has none.
    #[inline(always)]
    pub fn negative<W: SimdReal>(&self, simd: W::Simd) -> W {
        let mut signs = W::splat(simd, 0.0);
        for inverse in &self.diagonal {
            // a block and its inverse have as many
            let a = load_block::<W>(simd, inverse);
            let (first, last) = (a[0][1] / a[0][0], a[0][2] / a[0][0]);
            let middle = a[1][1] - first * a[0][1];
            let beside = a[1][2] - last * a[0][1];
            let corner = a[2][2] - last * a[0][2] - beside * beside / middle;
            for pivot in [a[0][0], middle, corner] {
                signs += pivot / pivot.abs();
            }
        }
        (-signs + 3.0 * self.diagonal.len() as f64) * 0.5
    }

    /// Solves in place with the factors.
    #[inline(always)]
    pub fn solve<W: SimdReal>(&self, simd: W::Simd, pattern: &Pattern, b: &mut [LanePose]) {
        let zero = W::splat(simd, 0.0);
        for j in 0..pattern.bodies() {
            let pivot = load::<W, 3>(simd, &b[j]);
            for (block, &row) in self.below[pattern.column(j)].iter().zip(pattern.rows(j)) {
                let to = &mut b[row as usize];
                for i in 0..3 {
                    let entry = |c: usize| W::load(simd, &block[c][i]);
                    let (first, later) = (entry(0) * pivot[0], zero + entry(1) * pivot[1] + entry(2) * pivot[2]);
                    ((W::load(simd, &to[i]) - first) - later).store(&mut to[i]);
                }
            }
            store(times(&load_block(simd, &self.diagonal[j]), &pivot), &mut b[j]);
        }
        for j in (0..pattern.bodies()).rev() {
            let mut sum = load::<W, 3>(simd, &b[j]);
            for (block, &row) in self.below[pattern.column(j)].iter().zip(pattern.rows(j)) {
                let x = load::<W, 3>(simd, &b[row as usize]);
                for i in 0..3 {
                    let entry = load::<W, 3>(simd, &block[i]);
                    let (first, later) = (entry[0] * x[0], zero + entry[1] * x[1] + entry[2] * x[2]);
                    sum[i] = (sum[i] - first) - later;
                }
            }
            store(sum, &mut b[j]);
        }
    }

    /// P·A·P with pivots in what the projectors `held` (body, projector, what it leaves out) take away, as `projected` of one model has them.
    #[inline(always)]
    pub fn project<W: SimdReal>(&mut self, simd: W::Simd, pattern: &Pattern, held: &[Option<(LaneBlock, LaneBlock)>]) {
        let block = |from: &LaneBlock| load_block::<W>(simd, from);
        for (j, own) in held.iter().enumerate() {
            if let Some((p, rest)) = own {
                let (p, own) = (block(p), block(&self.diagonal[j]));
                let size = own[0][0].abs() + own[1][1].abs() + W::splat(simd, MIN_HELD);
                store_block(product(&product(&p, &own), &p), &mut self.diagonal[j]);
                let mut rest = block(rest);
                for column in &mut rest[..2] {
                    column[..2].iter_mut().for_each(|x| *x = *x * size);
                }
                for (column, rest) in self.diagonal[j].iter_mut().zip(&rest) {
                    super::add(simd, column, rest);
                }
                for k in pattern.column(j) {
                    store_block(product(&block(&self.below[k]), &p), &mut self.below[k]);
                }
            }
            for k in pattern.column(j) {
                if let Some((p, _)) = &held[pattern.row(k)] {
                    store_block(product(&block(p), &block(&self.below[k])), &mut self.below[k]);
                }
            }
        }
    }
}

/// A symmetric block as L·D·Lᵀ.
struct LaneBlockFactor<W> {
    l: LaneBlock<W>,
    reciprocal: [W; 3],
}

impl<W: SimdReal> LaneBlockFactor<W> {
    /// `sound` becomes NaN in lanes with a vanishing or invalid pivot.
    #[inline(always)]
    fn new(mut l: LaneBlock<W>, scale: &LanePose<W>, sound: &mut W) -> Self {
        let mut reciprocal = *scale;
        for j in 0..3 {
            let d = l[j][j];
            *sound = d.abs().mark_nan(scale[j] * LOST, *sound) + d * 0.0;
            reciprocal[j] = d.splat_like(1.0) / d;
            for i in j + 1..3 {
                let below = l[j][i];
                l[j][i] = below * reciprocal[j];
                for k in j + 1..=i {
                    let other = l[j][k];
                    l[k][i] -= below * other;
                }
            }
        }
        Self { l, reciprocal }
    }

    /// L⁻ᵀ·D⁻¹·L⁻¹.
    #[inline(always)]
    fn inverse(&self) -> LaneBlock<W> {
        let (zero, one) = (self.reciprocal[0].splat_like(0.0), self.reciprocal[0].splat_like(1.0));
        let mut li = [[zero; 3]; 3];
        for j in 0..3 {
            li[j][j] = one;
            for i in j + 1..3 {
                let mut s = -self.l[j][i];
                for k in j + 1..i {
                    s -= self.l[k][i] * li[j][k];
                }
                li[j][i] = s;
            }
        }
        let mut inverse = [[zero; 3]; 3];
        for i in 0..3 {
            for j in 0..=i {
                let mut s = zero;
                for k in i..3 {
                    s += li[i][k] * self.reciprocal[k] * li[j][k];
                }
                inverse[j][i] = s;
                inverse[i][j] = s;
            }
        }
        inverse
    }

    /// See [`crate::factor`].
    #[inline(always)]
    fn eliminate(&self, coupling: &LaneBlock<W>, later: &mut LaneBlock<W>) -> LaneBlock<W> {
        let l = &self.l;
        let mut y = *coupling;
        for c in 1..3 {
            for k in 0..c {
                for r in 0..3 {
                    let known = y[k][r];
                    y[c][r] -= known * l[k][c];
                }
            }
        }
        let mut x = y;
        for c in 0..3 {
            for r in 0..3 {
                x[c][r] = x[c][r] * self.reciprocal[c];
            }
            for j in 0..3 {
                for i in j..3 {
                    later[j][i] -= y[c][i] * x[c][j];
                }
            }
        }
        for c in (0..3).rev() {
            for k in c + 1..3 {
                for r in 0..3 {
                    let known = x[k][r];
                    x[c][r] -= known * l[c][k];
                }
            }
        }
        x
    }
}
