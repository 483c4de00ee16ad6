//! Rayleigh–Ritz over lanes: A·v = λ·B·v for small matrices with B definite, by Cholesky and Jacobi.
//!
//! Shapes are near modes already, so that the matrices are near diagonal, and sweeps of rotations settle quadratically.
//! Their number is fixed: a lane neither waits for another nor continues for one.
//!
//! Reference: G. H. Golub, C. F. Van Loan, "Matrix Computations" (2013), §8.5.

// small matrices are indexed as the formulas are written
#![allow(clippy::needless_range_loop)]

use super::vectors::{mass_product, scale};
use bimorph_multibody::batch::{LANES, Lane8, LaneModel, LanePose, SimdReal, load, store};
use bimorph_multibody::planar::DOF;

/// Rows at most.
pub(super) const MAX_ROWS: usize = 10;
/// Sweeps over all pairs.
const SWEEPS: usize = 6;

type RitzMatrix<T = Lane8> = [[T; MAX_ROWS]; MAX_ROWS];

/// The matrices.
#[derive(Debug, Clone)]
pub struct RitzMatrices {
    count: usize,
    /// Lower triangles.
    a: RitzMatrix,
    b: RitzMatrix,
    /// Vectors, v[row][column].
    v: RitzMatrix,
}

impl Default for RitzMatrices {
    fn default() -> Self {
        let none = [[Lane8::NONE; MAX_ROWS]; MAX_ROWS];
        Self { count: 0, a: none, b: none, v: none }
    }
}

impl RitzMatrices {
    /// Takes so many rows.
    pub fn resize(&mut self, count: usize) {
        self.count = count.min(MAX_ROWS);
    }

    /// A, its lower triangle.
    pub fn a(&mut self, row: usize, column: usize) -> &mut Lane8 {
        &mut self.a[row][column]
    }

    /// B, its lower triangle.
    pub fn b(&mut self, row: usize, column: usize) -> &mut Lane8 {
        &mut self.b[row][column]
    }

    /// Finds all λ and v, vᵀBv = 1, in no order.
    #[inline(always)]
    pub fn solve<W: SimdReal>(&mut self, simd: W::Simd, lambda: &mut [Lane8]) {
        let n = self.count;
        let zero = W::splat(simd, 0.0);
        let one = W::splat(simd, 1.0);
        let (mut a, mut l, mut v) =
            ([[zero; MAX_ROWS]; MAX_ROWS], [[zero; MAX_ROWS]; MAX_ROWS], [[zero; MAX_ROWS]; MAX_ROWS]);
        for i in 0..n {
            for j in 0..=i {
                a[i][j] = W::load(simd, &self.a[i][j]);
                a[j][i] = a[i][j];
                l[i][j] = W::load(simd, &self.b[i][j]);
            }
        }
        // B = L·Lᵀ
        for j in 0..n {
            for k in 0..j {
                for i in j..n {
                    let product = l[i][k] * l[j][k];
                    l[i][j] -= product;
                }
            }
            let root = one / l[j][j].sqrt();
            for i in j..n {
                l[i][j] = l[i][j] * root;
            }
        }
        // L⁻¹·A·L⁻ᵀ, rows first
        for _ in 0..2 {
            for j in 0..n {
                for i in 0..n {
                    let mut sum = a[i][j];
                    for k in 0..i {
                        sum -= l[i][k] * a[k][j];
                    }
                    a[i][j] = sum / l[i][i];
                }
            }
            for i in 0..n {
                for j in 0..i {
                    (a[i][j], a[j][i]) = (a[j][i], a[i][j]);
                }
            }
        }
        for i in 0..n {
            v[i][i] = one;
        }
        for _ in 0..SWEEPS {
            for p in 0..n {
                for q in p + 1..n {
                    rotate(&mut a, &mut v, n, (p, q), one);
                }
            }
        }
        // back to the span: L⁻ᵀ·v
        for j in 0..n {
            for i in (0..n).rev() {
                let mut sum = v[i][j];
                for k in i + 1..n {
                    sum -= l[k][i] * v[k][j];
                }
                v[i][j] = sum / l[i][i];
            }
            a[j][j].store(&mut lambda[j]);
            for i in 0..n {
                v[i][j].store(&mut self.v[i][j]);
            }
        }
    }

    /// An entry of a vector.
    pub fn vector(&self, row: usize, vector: usize) -> &Lane8 {
        &self.v[row][vector]
    }

    /// Sorts λ and its vectors in each lane.
    pub fn sort(&mut self, lambda: &mut [Lane8]) {
        let n = self.count;
        for lane in 0..LANES {
            for end in (1..n).rev() {
                for j in 0..end {
                    if lambda[j].0[lane] > lambda[j + 1].0[lane] {
                        let (x, y) = (lambda[j].0[lane], lambda[j + 1].0[lane]);
                        (lambda[j].0[lane], lambda[j + 1].0[lane]) = (y, x);
                        for row in &mut self.v[..n] {
                            let (x, y) = (row[j].0[lane], row[j + 1].0[lane]);
                            (row[j].0[lane], row[j + 1].0[lane]) = (y, x);
                        }
                    }
                }
            }
        }
    }

    /// Replaces the shapes by the combinations that the vectors say, of length 1 in the mass. The content of `room` is
    /// overwritten.
    #[inline(always)]
    pub(super) fn combine<W: SimdReal>(
        &self,
        simd: W::Simd,
        model: &LaneModel,
        x: &mut Vec<Vec<LanePose>>,
        room: &mut Vec<Vec<LanePose>>,
    ) {
        let one = W::splat(simd, 1.0);
        for j in 0..self.count {
            for body in 0..model.bodies.len() {
                let mut sum = [W::splat(simd, 0.0); DOF];
                for i in 0..self.count {
                    let (share, x) = (W::load(simd, &self.v[i][j]), load::<W, DOF>(simd, &x[i][body]));
                    for d in 0..DOF {
                        sum[d] += x[d] * share;
                    }
                }
                store(sum, &mut room[j][body]);
            }
            let size = mass_product::<W>(simd, model, &room[j], &room[j]);
            scale(simd, &mut room[j], one / size.sqrt());
        }
        std::mem::swap(x, room);
    }
}

/// Turns rows and columns p and q of `a` so that what couples them is gone, and the columns of `v` with them.
#[inline(always)]
fn rotate<W: SimdReal>(a: &mut RitzMatrix<W>, v: &mut RitzMatrix<W>, n: usize, (p, q): (usize, usize), one: W) {
    let coupling = a[p][q];
    let apart = a[q][q] - a[p][p];
    let root = (apart * apart + coupling * coupling * 4.0).sqrt();
    let sign = apart.if_zero(one, apart / apart.abs());
    let tangent = coupling.if_zero(coupling, sign * coupling * 2.0 / (apart.abs() + root));
    let c = one / (tangent * tangent + one).sqrt();
    let s = tangent * c;
    for k in 0..n {
        let (x, y) = (a[k][p], a[k][q]);
        (a[k][p], a[k][q]) = (c * x - s * y, s * x + c * y);
    }
    for k in 0..n {
        let (x, y) = (a[p][k], a[q][k]);
        (a[p][k], a[q][k]) = (c * x - s * y, s * x + c * y);
    }
    for k in 0..n {
        let (x, y) = (v[k][p], v[k][q]);
        (v[k][p], v[k][q]) = (c * x - s * y, s * x + c * y);
    }
}
