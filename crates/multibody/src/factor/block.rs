//! One symmetric block as L·D·Lᵀ without exchanges: its inverse, the signs of its pivots, and what it takes from later blocks.
//!
//! Reference: G. H. Golub, C. F. Van Loan, "Matrix Computations" (2013), §4.1.

use nalgebra::{ComplexField, SMatrix, SVector};

/// Type of a block entry.
pub trait Scalar: ComplexField<RealField = f64> + Copy {}

impl Scalar for f64 {}

impl Scalar for nalgebra::Complex<f64> {}

/// A pivot smaller than this fraction of its diagonal entry is taken for zero. A beam cut into
/// 10,000 segments reaches 2.5e-13.
pub(crate) const LOST: f64 = 1e-13;

/// Where a factorization met a pivot that is zero or not finite.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ZeroPivot {
    /// Body in elimination order.
    pub body: usize,
    /// Direction within its block.
    pub direction: usize,
}

/// Counts of the pivots' signs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct PivotSigns {
    /// Negative pivots: the number of negative eigenvalues.
    pub negative: usize,
}

/// A symmetric block as L·D·Lᵀ.
pub(super) struct BlockFactor<T: Scalar, const N: usize> {
    /// L, unit lower triangle.
    l: SMatrix<T, N, N>,
    /// D⁻¹.
    reciprocal: [T; N],
}

impl<T: Scalar, const N: usize> BlockFactor<T, N> {
    /// Decomposes the lower triangle of `a`; adds the pivots' signs to `inertia`. `vanished` decides about a direction
    /// whose pivot vanished: an error, or to hold it.
    #[inline]
    pub(super) fn new(
        a: &SMatrix<T, N, N>,
        scale: &SVector<f64, N>,
        inertia: &mut PivotSigns,
        vanished: &mut dyn FnMut(usize) -> Result<(), ZeroPivot>,
    ) -> Result<Self, ZeroPivot> {
        let mut l = *a;
        let mut reciprocal = [T::zero(); N];
        for j in 0..N {
            let mut d = l[(j, j)];
            if d.modulus() <= LOST * scale[j] || !d.is_finite() {
                vanished(j)?;
                d = T::from_real(scale[j]);
            }
            if d.real() < 0.0 {
                inertia.negative += 1;
            }
            reciprocal[j] = T::one() / d;
            for i in j + 1..N {
                let below = l[(i, j)];
                l[(i, j)] = below * reciprocal[j];
                // columns j + 1 … i of row i, against rows that hold their share of L already
                for k in j + 1..=i {
                    let other = l[(k, j)];
                    l[(i, k)] -= below * other;
                }
            }
        }
        Ok(Self { l, reciprocal })
    }

    /// L⁻ᵀ·D⁻¹·L⁻¹.
    #[inline]
    pub(super) fn inverse(&self) -> SMatrix<T, N, N> {
        let mut li = SMatrix::<T, N, N>::identity();
        for j in 0..N {
            for i in j + 1..N {
                let mut s = -self.l[(i, j)];
                for k in j + 1..i {
                    s -= self.l[(i, k)] * li[(k, j)];
                }
                li[(i, j)] = s;
            }
        }
        let mut inverse = SMatrix::<T, N, N>::zeros();
        for i in 0..N {
            for j in 0..=i {
                let mut s = T::zero();
                for k in i..N {
                    s += li[(k, i)] * self.reciprocal[k] * li[(k, j)];
                }
                inverse[(i, j)] = s;
                inverse[(j, i)] = s;
            }
        }
        inverse
    }

    /// For the coupling C of a later body's row: takes C·A⁻¹·Cᵀ from the lower triangle of that body's block, and returns
    /// C·A⁻¹. The last pivot, which everything waits for, enters the block through one product and one sum.
    #[inline]
    pub(super) fn eliminate(&self, coupling: SMatrix<T, N, N>, later: &mut SMatrix<T, N, N>) -> SMatrix<T, N, N> {
        let l = &self.l;
        let mut y = coupling;
        for c in 1..N {
            for k in 0..c {
                for r in 0..N {
                    let known = y[(r, k)];
                    y[(r, c)] -= known * l[(c, k)];
                }
            }
        }
        let mut x = y;
        for c in 0..N {
            for r in 0..N {
                x[(r, c)] *= self.reciprocal[c];
            }
            for j in 0..N {
                for i in j..N {
                    later[(i, j)] -= y[(i, c)] * x[(j, c)];
                }
            }
        }
        for c in (0..N).rev() {
            for k in c + 1..N {
                for r in 0..N {
                    let known = x[(r, k)];
                    x[(r, c)] -= known * l[(k, c)];
                }
            }
        }
        x
    }
}
