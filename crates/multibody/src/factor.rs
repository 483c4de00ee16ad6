//! Symmetric block factorization L·D·Lᵀ, leaf to root, and the solves with it.
//!
//! Generic over the scalar (f64; complex for small-signal work) and over the block size (planar bodies 3, spatial 6).
//! The matrix is symmetric, not Hermitian, for complex scalars too. Each body costs one block inverse, one product per
//! row of its column and one per pair of rows: a fixed amount for a tree. Nothing is allocated after [`BlockMatrix::new`].
//!
//! A block is inverted by its own L·D·Lᵀ without exchanges, so the whole is an unpivoted symmetric elimination:
//! backward stable for the definite matrices of implicit steps and stable equilibria, and invariant to the units of
//! each direction. The signs of the scalar pivots give the inertia (Sylvester). It distinguishes stable from unstable
//! equilibria, and counts the modes below a shift.
//!
//! Reference: K. S. Anderson, J. H. Critchley, "Improved 'order-N' performance algorithm for the simulation of constrained
//! multi-rigid-body dynamic systems", Multibody System Dynamics 9 (2003): the recursion that this elimination is, in
//! absolute coordinates.

mod block;

use super::Pattern;
use super::planar::DOF;
use block::BlockFactor;
pub(super) use block::LOST;
pub use block::{PivotSigns, Scalar, ZeroPivot};
use nalgebra::{SMatrix, SVector};

/// A symmetric matrix of N×N blocks on a [`Pattern`]; after [`BlockMatrix::factor`], its factors in the same storage.
#[derive(Debug, Clone, PartialEq)]
pub struct BlockMatrix<T: Scalar, const N: usize> {
    /// Diagonal blocks in elimination order; after factoring, their inverses.
    pub diagonal: Vec<SMatrix<T, N, N>>,
    /// Blocks below the diagonal (row body × column body), in the order of the pattern; after factoring, L.
    pub below: Vec<SMatrix<T, N, N>>,
    /// Diagonal entries before elimination: the scale against which a pivot has vanished.
    scale: Vec<SVector<f64, N>>,
}

/// Such a matrix over the degrees of freedom of bodies in the plane.
pub type BodyMatrix<T = f64> = BlockMatrix<T, DOF>;

/// Stiffness that holds a direction that has none, as a fraction of that of others (1): with a thousandth, a load that excites it moves it a thousand
/// times as far as others in every iteration, and none settles.
pub(crate) const HELD: f64 = 1e-3;

/// Lever at which a stiffness against displacement holds a rotation where nothing resists any (m): a micrometre, the size of parts.
const LEVER: f64 = 1e-6;

/// Bodies eliminated between two checks of the budget, some ten microseconds.
const BODIES_PER_CHECK: usize = 64;

impl<T: Scalar, const N: usize> BlockMatrix<T, N> {
    /// A zero matrix on `pattern`.
    #[inline]
    pub fn new(pattern: &Pattern) -> Self {
        Self {
            diagonal: vec![SMatrix::zeros(); pattern.bodies()],
            below: vec![SMatrix::zeros(); pattern.off_blocks()],
            scale: vec![SVector::zeros(); pattern.bodies()],
        }
    }

    /// Sets every block to zero.
    #[inline]
    pub fn clear(&mut self) {
        self.diagonal.fill(SMatrix::zeros());
        self.below.fill(SMatrix::zeros());
    }

    /// Replaces the matrix by its factors.
    ///
    /// # Errors
    /// [`ZeroPivot`] where a pivot vanishes against the entries it came from, or is not finite.
    #[inline]
    pub fn factor(&mut self, pattern: &Pattern) -> Result<PivotSigns, ZeroPivot> {
        self.eliminate(pattern, Err)
    }

    /// Like [`BlockMatrix::factor`], but a direction whose pivot vanishes is held instead: it gets the pivot it had before
    /// elimination, or `HELD` times the largest diagonal entry of that direction where it had none, and goes to `held`. A solution then
    /// stands for a structure with free motions that no load excites.
    ///
    /// # Errors
    /// [`ZeroPivot`] where there is nothing to hold on to: no body resists that direction, or a pivot is not finite.
    pub fn factor_holding(&mut self, pattern: &Pattern, held: &mut Vec<ZeroPivot>) -> Result<PivotSigns, ZeroPivot> {
        held.clear();
        let empty = self.diagonal.iter().enumerate().flat_map(|(body, block)| {
            let zero = move |direction: &usize| block[(*direction, *direction)] == T::zero();
            (0..N).filter(zero).map(move |direction| ZeroPivot { body, direction })
        });
        held.extend(empty);
        if !held.is_empty() {
            let largest = self.largest();
            for &ZeroPivot { body, direction } in held.iter() {
                let pivot = HELD * largest[direction];
                if pivot == 0.0 {
                    return Err(ZeroPivot { body, direction });
                }
                self.diagonal[body][(direction, direction)] = T::from_real(pivot);
            }
        }
        self.eliminate(pattern, |pivot| {
            held.push(pivot);
            Ok(())
        })
    }

    /// The largest diagonal entry that stands for each direction.
    fn largest(&self) -> [f64; N] {
        let of = |i: usize| self.diagonal.iter().map(|block| block[(i, i)].modulus()).fold(0.0, f64::max);
        let translation = of(0).max(of(1));
        // both translations of the plane have one unit; of bodies on springs alone none resists rotation
        std::array::from_fn(|i| match of(i) {
            _ if i < 2 => translation,
            own if own > 0.0 => own,
            _ => translation * LEVER * LEVER,
        })
    }

    fn eliminate(
        &mut self,
        pattern: &Pattern,
        mut vanished: impl FnMut(ZeroPivot) -> Result<(), ZeroPivot>,
    ) -> Result<PivotSigns, ZeroPivot> {
        let mut inertia = PivotSigns::default();
        for (scale, block) in self.scale.iter_mut().zip(&self.diagonal) {
            *scale = SVector::from_fn(|i, _| block[(i, i)].modulus());
        }
        for j in 0..pattern.bodies() {
            if j.is_multiple_of(BODIES_PER_CHECK) {
                bimorph_base::budget::check();
            }
            let own = BlockFactor::new(&self.diagonal[j], &self.scale[j], &mut inertia, &mut |direction| {
                vanished(ZeroPivot { body: j, direction })
            })?;
            self.diagonal[j] = own.inverse();
            let column = pattern.column(j);
            let mut target = pattern.targets(j).iter();
            for (k, &row) in column.clone().zip(pattern.rows(j)) {
                let coupling = self.below[k];
                // rows before k already hold L; their couplings are L·D, so update with L·(A)ᵀ from this side
                for (i, &at) in (column.start..k).zip(target.by_ref()) {
                    let scaled = self.below[i];
                    let block = &mut self.below[at as usize];
                    for c in 0..N {
                        for s in 0..N {
                            for r in 0..N {
                                block[(r, s)] -= coupling[(r, c)] * scaled[(s, c)];
                            }
                        }
                    }
                }
                self.below[k] = own.eliminate(coupling, &mut self.diagonal[row as usize]);
            }
        }
        Ok(inertia)
    }

    /// `to += factor·A`.
    #[inline]
    pub fn add_to(&self, factor: T, to: &mut Self) {
        to.diagonal.iter_mut().zip(&self.diagonal).for_each(|(to, from)| *to += from * factor);
        to.below.iter_mut().zip(&self.below).for_each(|(to, from)| *to += from * factor);
    }

    /// Solves in place with the factors: `b` becomes A⁻¹·b. Body vectors in elimination order.
    pub fn solve(&self, pattern: &Pattern, b: &mut [SVector<T, N>]) {
        // along a beam the row is the next body: its value is passed in registers
        let count = pattern.bodies();
        let mut next = b.first().copied().unwrap_or_else(SVector::zeros);
        for j in 0..count {
            let pivot = next;
            next = b.get(j + 1).copied().unwrap_or_else(SVector::zeros);
            for (block, &row) in self.below[pattern.column(j)].iter().zip(pattern.rows(j)) {
                let row = row as usize;
                if row == j + 1 {
                    subtract(block, &pivot, &mut next);
                } else {
                    subtract(block, &pivot, &mut b[row]);
                }
            }
            b[j] = self.diagonal[j] * pivot;
        }
        let mut last = next;
        for j in (0..count).rev() {
            let mut sum = b[j];
            for (block, &row) in self.below[pattern.column(j)].iter().zip(pattern.rows(j)) {
                let row = row as usize;
                let x = if row == j + 1 { last } else { b[row] };
                subtract(&block.transpose(), &x, &mut sum);
            }
            b[j] = sum;
            last = sum;
        }
    }

    /// `y += A·x` with the unfactored matrix.
    #[inline]
    pub fn multiply_add(&self, pattern: &Pattern, x: &[SVector<T, N>], y: &mut [SVector<T, N>]) {
        self.multiply_add_of(pattern, |j| x[j], y);
    }

    /// The same with the part of each body of x as a function.
    #[inline]
    pub fn multiply_add_of(&self, pattern: &Pattern, x: impl Fn(usize) -> SVector<T, N>, y: &mut [SVector<T, N>]) {
        for j in 0..pattern.bodies() {
            let own = x(j);
            let mut sum = self.diagonal[j] * own;
            for k in pattern.column(j) {
                let row = pattern.row(k);
                sum += self.below[k].tr_mul(&x(row));
                y[row] += self.below[k] * own;
            }
            y[j] += sum;
        }
    }
}

/// `b −= block·x`. The products of the later columns are summed aside: along a beam each body waits for the one before
/// it, and the path from x to b is what a solve takes.
#[inline]
fn subtract<T: Scalar, const N: usize>(block: &SMatrix<T, N, N>, x: &SVector<T, N>, b: &mut SVector<T, N>) {
    for i in 0..N {
        let mut later = T::zero();
        for c in 1..N {
            later += block[(i, c)] * x[c];
        }
        b[i] = (b[i] - block[(i, 0)] * x[0]) - later;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Complex, DMatrix, DVector};

    const EDGES: [(usize, usize); 9] = [(0, 1), (1, 2), (2, 5), (3, 4), (4, 5), (5, 6), (0, 6), (1, 4), (6, 7)];

    fn entry(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    }

    fn check<T: Scalar, const N: usize>(make: impl Fn(&mut u64) -> T, tolerance: f64) {
        let pattern = Pattern::new(8, &EDGES);
        let mut a = BlockMatrix::<T, N>::new(&pattern);
        let mut seed = 7;
        for block in &mut a.diagonal {
            let raw = SMatrix::<T, N, N>::from_fn(|_, _| make(&mut seed));
            *block = raw + raw.transpose() + SMatrix::identity() * T::from_real(6.0 * N as f64);
        }
        for &(p, q) in &EDGES {
            let k = pattern.block(p.max(q), p.min(q)).unwrap();
            a.below[k] = SMatrix::from_fn(|_, _| make(&mut seed));
        }
        let n = 8 * N;
        let mut dense = DMatrix::<T>::zeros(n, n);
        for j in 0..8 {
            dense.view_mut((j * N, j * N), (N, N)).copy_from(&a.diagonal[j]);
            for k in pattern.column(j) {
                let r = pattern.row(k);
                dense.view_mut((r * N, j * N), (N, N)).copy_from(&a.below[k]);
                dense.view_mut((j * N, r * N), (N, N)).copy_from(&a.below[k].transpose());
            }
        }
        let b: Vec<SVector<T, N>> = (0..8).map(|_| SVector::from_fn(|_, _| make(&mut seed))).collect();
        let mut product = vec![SVector::<T, N>::zeros(); 8];
        a.multiply_add(&pattern, &b, &mut product);
        let mut x = b.clone();
        a.factor(&pattern).unwrap();
        a.solve(&pattern, &mut x);
        let flat = DVector::from_iterator(n, b.iter().flat_map(|v| v.iter().copied()));
        let expected = dense.clone().lu().solve(&flat).unwrap();
        let times = &dense * &flat;
        for (j, v) in x.iter().enumerate() {
            for i in 0..N {
                assert!((v[i] - expected[j * N + i]).modulus() < tolerance * expected.norm());
                assert!((product[j][i] - times[j * N + i]).modulus() < tolerance * times.norm());
            }
        }
    }

    /// On a graph with coupled loops the factor solves as dense pivoted LU does, for planar and spatial blocks, real and
    /// complex scalars, to rounding.
    #[test]
    fn agrees_with_dense_lu() {
        check::<f64, 3>(entry, 1e-14);
        check::<f64, 6>(entry, 1e-14);
        check::<Complex<f64>, 3>(|s| Complex::new(entry(s), entry(s)), 1e-14);
    }

    /// The number of negative pivots is the number of negative eigenvalues (Sylvester's law of inertia).
    #[test]
    fn inertia_counts_negative_eigenvalues() {
        let pattern = Pattern::new(8, &EDGES);
        let mut seed = 3;
        for shift in [-2.0, -0.5, 0.0, 0.7, 2.5] {
            let mut a = BlockMatrix::<f64, 3>::new(&pattern);
            let mut dense = DMatrix::<f64>::zeros(24, 24);
            for j in 0..8 {
                let raw = SMatrix::<f64, 3, 3>::from_fn(|_, _| entry(&mut seed));
                a.diagonal[j] = raw + raw.transpose() - SMatrix::identity() * shift;
                dense.view_mut((j * 3, j * 3), (3, 3)).copy_from(&a.diagonal[j]);
            }
            for &(p, q) in &EDGES {
                let k = pattern.block(p.max(q), p.min(q)).unwrap();
                a.below[k] = SMatrix::from_fn(|_, _| entry(&mut seed));
                let (r, c) = (p.max(q) * 3, p.min(q) * 3);
                dense.view_mut((r, c), (3, 3)).copy_from(&a.below[k]);
                dense.view_mut((c, r), (3, 3)).copy_from(&a.below[k].transpose());
            }
            let negative = dense.symmetric_eigenvalues().iter().filter(|&&v| v < 0.0).count();
            assert_eq!(a.factor(&pattern).unwrap().negative, negative);
        }
    }

    /// A body without stiffness is found and named, not divided by.
    #[test]
    fn a_zero_pivot_names_its_body() {
        let pattern = Pattern::new(2, &[(0, 1)]);
        let mut a = BlockMatrix::<f64, 3>::new(&pattern);
        a.diagonal[0] = SMatrix::identity();
        a.diagonal[1] = SMatrix::identity();
        a.below[0] = SMatrix::identity();
        assert_eq!(a.factor(&pattern), Err(ZeroPivot { body: 1, direction: 0 }));
    }
}
