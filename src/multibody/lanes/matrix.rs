//! Symmetric block factorization and solves over lanes: [`crate::multibody::factor`].
//!
//! A pivot that vanishes in one variant spoils that lane alone: its name is told, and what comes of it is not looked at.

use super::{LaneBlock, LanePose, Lanes, Real, product, times};
use crate::multibody::Pattern;
use crate::multibody::factor::LOST;

/// A symmetric matrix of blocks on a pattern in each variant; after [`LaneMatrix::factor`], its factors.
#[derive(Debug, Clone)]
pub struct LaneMatrix<const N: usize> {
    /// Diagonal blocks; after factoring, their inverses.
    pub diagonal: Vec<LaneBlock<N>>,
    /// Blocks below the diagonal; after factoring, L.
    pub below: Vec<LaneBlock<N>>,
    /// Diagonal entries before elimination.
    scale: Vec<LanePose<N>>,
}

impl<const N: usize> LaneMatrix<N> {
    /// A zero matrix on `pattern`.
    pub fn new(pattern: &Pattern) -> Self {
        let zero = [[Lanes::ZERO; 3]; 3];
        Self {
            diagonal: vec![zero; pattern.bodies()],
            below: vec![zero; pattern.off_blocks()],
            scale: vec![[Lanes::ZERO; 3]; pattern.bodies()],
        }
    }

    /// Sets every block to zero.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.diagonal.fill([[Lanes::ZERO; 3]; 3]);
        self.below.fill([[Lanes::ZERO; 3]; 3]);
    }

    /// Replaces the matrix by its factors. Returns the lanes in which a pivot vanished.
    #[inline(always)]
    pub fn factor(&mut self, pattern: &Pattern) -> [bool; N] {
        let mut vanished = [false; N];
        for (scale, block) in self.scale.iter_mut().zip(&self.diagonal) {
            for i in 0..3 {
                scale[i] = block[i][i].abs();
            }
        }
        for j in 0..pattern.bodies() {
            let own = Decomposed::new(&self.diagonal[j], &self.scale[j], &mut vanished);
            self.diagonal[j] = own.inverse();
            let column = pattern.column(j);
            let mut target = pattern.targets(j).iter();
            for (k, &row) in column.clone().zip(pattern.rows(j)) {
                let coupling = self.below[k];
                for (i, &at) in (column.start..k).zip(target.by_ref()) {
                    let scaled = self.below[i];
                    let block = &mut self.below[at as usize];
                    for c in 0..3 {
                        for s in 0..3 {
                            for r in 0..3 {
                                block[s][r] -= coupling[c][r] * scaled[c][s];
                            }
                        }
                    }
                }
                self.below[k] = own.eliminate(&coupling, &mut self.diagonal[row as usize]);
            }
        }
        vanished
    }

    /// Solves in place with the factors.
    #[inline(always)]
    pub fn solve(&self, pattern: &Pattern, b: &mut [LanePose<N>]) {
        for j in 0..pattern.bodies() {
            let pivot = b[j];
            for (block, &row) in self.below[pattern.column(j)].iter().zip(pattern.rows(j)) {
                let to = &mut b[row as usize];
                for i in 0..3 {
                    let later = Lanes::ZERO + block[1][i] * pivot[1] + block[2][i] * pivot[2];
                    to[i] = (to[i] - block[0][i] * pivot[0]) - later;
                }
            }
            b[j] = times(&self.diagonal[j], &pivot);
        }
        for j in (0..pattern.bodies()).rev() {
            let mut sum = b[j];
            for (block, &row) in self.below[pattern.column(j)].iter().zip(pattern.rows(j)) {
                let x = b[row as usize];
                for i in 0..3 {
                    let later = Lanes::ZERO + block[i][1] * x[1] + block[i][2] * x[2];
                    sum[i] = (sum[i] - block[i][0] * x[0]) - later;
                }
            }
            b[j] = sum;
        }
    }

    /// P·A·P with a pivot of 1 in what the projectors `held` (body, projector, what it leaves out) take away.
    #[inline(always)]
    pub fn project(&mut self, pattern: &Pattern, held: &[Option<(LaneBlock<N>, LaneBlock<N>)>]) {
        for (j, own) in held.iter().enumerate() {
            if let Some((p, rest)) = own {
                let mut block = product(&product(p, &self.diagonal[j]), p);
                for (column, rest) in block.iter_mut().zip(rest) {
                    super::add(column, rest);
                }
                self.diagonal[j] = block;
                for k in pattern.column(j) {
                    self.below[k] = product(&self.below[k], p);
                }
            }
            for k in pattern.column(j) {
                if let Some((p, _)) = &held[pattern.row(k)] {
                    self.below[k] = product(p, &self.below[k]);
                }
            }
        }
    }
}

/// A symmetric block as L·D·Lᵀ.
struct Decomposed<const N: usize> {
    l: LaneBlock<N>,
    reciprocal: [Lanes<N>; 3],
}

impl<const N: usize> Decomposed<N> {
    #[inline(always)]
    fn new(a: &LaneBlock<N>, scale: &LanePose<N>, vanished: &mut [bool; N]) -> Self {
        let mut l = *a;
        let mut reciprocal = [Lanes::ZERO; 3];
        for j in 0..3 {
            let d = l[j][j];
            for k in 0..N {
                vanished[k] |= d.0[k].abs() <= LOST * scale[j].0[k] || !d.0[k].is_finite();
            }
            reciprocal[j] = Lanes::ONE / d;
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
    fn inverse(&self) -> LaneBlock<N> {
        let mut li: LaneBlock<N> = [[Lanes::ZERO; 3]; 3];
        for j in 0..3 {
            li[j][j] = Lanes::ONE;
            for i in j + 1..3 {
                let mut s = -self.l[j][i];
                for k in j + 1..i {
                    s -= self.l[k][i] * li[j][k];
                }
                li[j][i] = s;
            }
        }
        let mut inverse = [[Lanes::ZERO; 3]; 3];
        for i in 0..3 {
            for j in 0..=i {
                let mut s = Lanes::ZERO;
                for k in i..3 {
                    s += li[i][k] * self.reciprocal[k] * li[j][k];
                }
                inverse[j][i] = s;
                inverse[i][j] = s;
            }
        }
        inverse
    }

    /// See [`crate::multibody::factor`].
    #[inline(always)]
    fn eliminate(&self, coupling: &LaneBlock<N>, later: &mut LaneBlock<N>) -> LaneBlock<N> {
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
