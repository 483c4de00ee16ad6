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

/// `to += a·x`.
#[inline]
pub(super) fn add_product(a: &DMatrix<f64>, x: &[f64], to: &mut [f64]) {
    for (column, x) in a.as_slice().chunks_exact(to.len()).zip(x) {
        to.iter_mut().zip(column).for_each(|(to, a)| *to += a * x);
    }
}

/// `x` becomes (L·Lᵀ)⁻¹·x, with what is above the diagonal not read.
#[inline]
pub(super) fn solve_factored(l: &DMatrix<f64>, x: &mut [f64]) {
    let m = x.len();
    let columns = || l.as_slice().chunks_exact(m).enumerate();
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
