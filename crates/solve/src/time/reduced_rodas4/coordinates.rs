//! Motions over the coordinates of a reduced model, and the few operations of dense matrices of a step.

use crate::equations::Motion;
use crate::time::rodas4::tableau::C;
use bimorph_multibody::planar::DOF;
use nalgebra::{DMatrix, DVector};

/// Coordinates, rates and accelerations.
#[derive(Debug, Clone)]
pub(super) struct ReducedMotion {
    pub(super) z: Vec<f64>,
    pub(super) v: Vec<f64>,
    pub(super) w: Vec<f64>,
}

impl ReducedMotion {
    pub(super) fn zeros(m: usize) -> Self {
        Self { z: vec![0.0; m], v: vec![0.0; m], w: vec![0.0; m] }
    }

    pub(super) fn copy(&mut self, from: &Self) {
        for (to, from) in self.all().into_iter().zip(from.parts()) {
            to.copy_from_slice(from);
        }
    }

    pub(super) fn all(&mut self) -> [&mut Vec<f64>; 3] {
        [&mut self.z, &mut self.v, &mut self.w]
    }

    /// All three.
    pub(super) fn parts(&self) -> [&[f64]; 3] {
        [&self.z, &self.v, &self.w]
    }

    pub(super) fn is_zero(&self) -> bool {
        self.parts().iter().all(|x| x.iter().all(|x| *x == 0.0))
    }

    pub(super) fn clear(&mut self) {
        self.all().into_iter().for_each(|x| x.fill(0.0));
    }

    /// `self += share·more`.
    pub(super) fn add(&mut self, share: f64, more: &Self) {
        for (to, x) in self.all().into_iter().zip(more.parts()) {
            to.iter_mut().zip(x).for_each(|(to, x)| *to += share * x);
        }
    }

    /// As two motions of poses: z and v, then w, three numbers to a pose.
    pub(super) fn pack(&self, to: &mut [Motion]) {
        let [position, push] = to else { return };
        for (to, from) in [(&mut position.q, &self.z), (&mut position.v, &self.v), (&mut push.q, &self.w)] {
            from.iter().enumerate().for_each(|(k, x)| to[k / DOF][k % DOF] = *x);
        }
    }

    /// Inverse of [`ReducedMotion::pack`].
    pub(super) fn unpack(&mut self, from: &[Motion]) {
        let [position, push] = from else { return };
        for (to, from) in self.all().into_iter().zip([&position.q, &position.v, &push.q]) {
            to.iter_mut().enumerate().for_each(|(k, x)| *x = from[k / DOF][k % DOF]);
        }
    }

    /// r₁ and r₂ of stage `i` of a step of length `h` (s), from the increments of the stages before it.
    pub(super) fn combined(&self, i: usize, h: f64, before: &[Self], r1: &mut [f64], r2: &mut [f64]) {
        r1.copy_from_slice(&self.v);
        r2.copy_from_slice(&self.w);
        for (c, u) in C[i].iter().zip(before) {
            for (r, u) in [(&mut *r1, &u.z), (&mut *r2, &u.v)] {
                r.iter_mut().zip(u).for_each(|(r, u)| *r += c / h * u);
            }
        }
    }
}

/// The increments of a stage with Uz on the right side; `gh` is γ times the length of the step (s).
pub(super) fn put_increments(
    gh: f64,
    (right, r1, r2): (&DVector<f64>, &DVector<f64>, &DVector<f64>),
    u: &mut ReducedMotion,
) {
    for (k, (z, (r1, r2))) in right.iter().zip(r1.iter().zip(r2.iter())).enumerate() {
        u.z[k] = *z;
        u.v[k] = u.z[k] / gh - r1;
        u.w[k] = u.v[k] / gh - r2;
    }
}

/// Calls a function of a fixed size, which the compiler unrolls, for the sizes that models have. Its operations are those of any size in their order.
macro_rules! of_size {
    ($size:expr, $of:ident($($given:expr),*)) => {
        match $size {
            2 => $of::<2>($($given),*),
            3 => $of::<3>($($given),*),
            4 => $of::<4>($($given),*),
            5 => $of::<5>($($given),*),
            6 => $of::<6>($($given),*),
            7 => $of::<7>($($given),*),
            8 => $of::<8>($($given),*),
            _ => false,
        }
    };
}

/// `to += a·x`.
#[inline]
pub(super) fn add_product(a: &DMatrix<f64>, x: &[f64], to: &mut [f64]) {
    let a = a.as_slice();
    if !of_size!(to.len(), add_fixed_product(a, x, to)) {
        for (column, x) in a.chunks_exact(to.len()).zip(x) {
            to.iter_mut().zip(column).for_each(|(to, a)| *to += a * x);
        }
    }
}

/// The product of a size; false where the lengths are not those of it.
#[inline]
fn add_fixed_product<const M: usize>(a: &[f64], x: &[f64], to: &mut [f64]) -> bool {
    let (columns, Ok(x), Ok(to)) = (a.as_chunks::<M>().0, <&[f64; M]>::try_from(x), <&mut [f64; M]>::try_from(to))
    else {
        return false;
    };
    let Ok(columns) = <&[[f64; M]; M]>::try_from(columns) else { return false };
    let mut sum = *to;
    for (column, x) in columns.iter().zip(x) {
        sum.iter_mut().zip(column).for_each(|(to, a)| *to += a * x);
    }
    *to = sum;
    true
}

/// `x` becomes (L·Lᵀ)⁻¹·x, with what is above the diagonal not read.
#[inline]
pub(super) fn solve_factored(l: &DMatrix<f64>, x: &mut [f64]) {
    let (l, m) = (l.as_slice(), x.len());
    if !of_size!(m, solve_fixed(l, x)) {
        let columns = || l.chunks_exact(m).enumerate();
        for (j, column) in columns() {
            x[j] /= column[j];
            let (done, rest) = x.split_at_mut(j + 1);
            rest.iter_mut().zip(&column[j + 1..]).for_each(|(x, l)| *x -= l * done[j]);
        }
        for (j, column) in columns().rev() {
            let known: f64 = x[j + 1..].iter().zip(&column[j + 1..]).map(|(x, l)| l * x).sum();
            x[j] = (x[j] - known) / column[j];
        }
    }
}

/// The solution of a size; false where the lengths are not those of it.
#[inline]
fn solve_fixed<const M: usize>(l: &[f64], x: &mut [f64]) -> bool {
    let (columns, Ok(x)) = (l.as_chunks::<M>().0, <&mut [f64; M]>::try_from(x)) else { return false };
    let Ok(columns) = <&[[f64; M]; M]>::try_from(columns) else { return false };
    let mut y = *x;
    for j in 0..M {
        y[j] /= columns[j][j];
        for i in j + 1..M {
            y[i] -= columns[j][i] * y[j];
        }
    }
    for j in (0..M).rev() {
        let mut known = -0.0;
        for i in j + 1..M {
            known += columns[j][i] * y[i];
        }
        y[j] = (y[j] - known) / columns[j][j];
    }
    *x = y;
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Products and solutions of fixed sizes have the bits of those of any size.
    #[test]
    fn fixed_sizes_have_the_bits_of_any() {
        for m in 1..12 {
            let l = DMatrix::from_fn(m, m, |i, j| ((3 * i + 7 * j + m) as f64).sin() + if i == j { 3.0 } else { 0.0 });
            let x: Vec<f64> = (0..m).map(|i| (i as f64 + 0.3).cos()).collect();
            let mut product = x.clone();
            add_product(&l, &x, &mut product);
            let mut expected = x.clone();
            (0..m).for_each(|j| (0..m).for_each(|i| expected[i] += l[(i, j)] * x[j]));
            assert_eq!(product, expected);
            let mut solved = x.clone();
            solve_factored(&l, &mut solved);
            let mut expected = x;
            for j in 0..m {
                expected[j] /= l[(j, j)];
                (j + 1..m).for_each(|i| expected[i] -= l[(i, j)] * expected[j]);
            }
            for j in (0..m).rev() {
                let known: f64 = (j + 1..m).map(|i| l[(i, j)] * expected[i]).sum();
                expected[j] = (expected[j] - known) / l[(j, j)];
            }
            assert_eq!(solved, expected);
        }
    }
}
