//! Motions over the coordinates of a reduced model, and the few operations of dense matrices of a step.

// triangles are indexed as they are written
#![allow(clippy::needless_range_loop)]

use crate::equations::Motion;
use crate::time::rodas4::tableau::{C, GAMMA, GAMMA_I};
use bimorph_multibody::planar::DOF;
use nalgebra::DMatrix;

/// Evaluates an expression for the number of coordinates: of a small one the compiler knows the number, and unrolls its loops. Operations are the same in
/// the same order.
macro_rules! of_size {
    ($size:expr, $m:ident => $of:expr) => {
        match $size {
            2 => of_size!(@ 2, $m, $of),
            3 => of_size!(@ 3, $m, $of),
            4 => of_size!(@ 4, $m, $of),
            5 => of_size!(@ 5, $m, $of),
            6 => of_size!(@ 6, $m, $of),
            7 => of_size!(@ 7, $m, $of),
            8 => of_size!(@ 8, $m, $of),
            $m => $of,
        }
    };
    (@ $number:literal, $m:ident, $of:expr) => {{
        let $m: usize = $number;
        $of
    }};
}

/// Coordinates, rates and accelerations, one behind the other.
#[derive(Debug, Clone)]
pub(super) struct ReducedMotion {
    all: Vec<f64>,
}

impl ReducedMotion {
    pub(super) fn zeros(m: usize) -> Self {
        Self { all: vec![0.0; 3 * m] }
    }

    /// Number of coordinates.
    #[inline(always)]
    fn size(&self) -> usize {
        self.all.len() / 3
    }

    pub(super) fn copy(&mut self, from: &Self) {
        self.all.copy_from_slice(&from.all);
    }

    pub(super) fn z(&self) -> &[f64] {
        self.parts()[0]
    }

    /// Coordinates, rates and accelerations.
    #[inline(always)]
    pub(super) fn parts(&self) -> [&[f64]; 3] {
        let m = self.size();
        let (z, (v, w)) = (&self.all[..m], self.all[m..].split_at(m));
        [z, v, w]
    }

    /// The same to be changed.
    #[inline(always)]
    pub(super) fn parts_mut(&mut self) -> [&mut [f64]; 3] {
        let m = self.size();
        let (z, rest) = self.all.split_at_mut(m);
        let (v, w) = rest.split_at_mut(m);
        [z, v, w]
    }

    pub(super) fn is_zero(&self) -> bool {
        self.all.iter().all(|x| *x == 0.0)
    }

    pub(super) fn clear(&mut self) {
        self.all.fill(0.0);
    }

    /// `self = of + Σ share·more`.
    #[inline]
    pub(super) fn set_sum(&mut self, of: &Self, shares: &[f64], more: &[Self]) {
        of_size!(of.size(), m => set_sum(3 * m, &mut self.all, of, shares, more));
    }

    /// As two motions of poses: z and v, then w, three numbers to a pose.
    pub(super) fn pack(&self, to: &mut [Motion]) {
        let ([position, push], [z, v, w]) = (to, self.parts()) else { return };
        for (to, from) in [(&mut position.q, z), (&mut position.v, v), (&mut push.q, w)] {
            from.iter().enumerate().for_each(|(k, x)| to[k / DOF][k % DOF] = *x);
        }
    }

    /// Inverse of [`ReducedMotion::pack`].
    pub(super) fn unpack(&mut self, from: &[Motion]) {
        let [position, push] = from else { return };
        for (to, from) in self.parts_mut().into_iter().zip([&position.q, &position.v, &push.q]) {
            to.iter_mut().enumerate().for_each(|(k, x)| *x = from[k / DOF][k % DOF]);
        }
    }
}

/// The same over slices of `n` numbers.
#[inline(always)]
fn set_sum(n: usize, to: &mut [f64], of: &ReducedMotion, shares: &[f64], more: &[ReducedMotion]) {
    let to = &mut to[..n];
    to.copy_from_slice(&of.all[..n]);
    for (share, more) in shares.iter().zip(more) {
        to.iter_mut().zip(&more.all[..n]).for_each(|(to, x)| *to += share * x);
    }
}

/// Matrices of a step, by columns, and the length of the step.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepMatrices<'a> {
    pub(super) mass: &'a DMatrix<f64>,
    pub(super) damping: Option<&'a DMatrix<f64>>,
    /// Cholesky's factor of W; what is above the diagonal is not read.
    pub(super) factor: &'a DMatrix<f64>,
    /// Length of the step (s).
    pub(super) h: f64,
}

/// A stage: its number, where it evaluates, force and ∂R/∂t there.
#[derive(Debug, Clone, Copy)]
pub(super) struct StageForces<'a> {
    pub(super) i: usize,
    pub(super) at: &'a ReducedMotion,
    pub(super) force: &'a [f64],
    pub(super) forcing: &'a [f64],
}

/// Room for the solve of a stage: r₁, r₂ and their sum r₁/(γh) + r₂.
#[derive(Debug, Clone)]
pub(super) struct StageRoom([Vec<f64>; 3]);

impl StageRoom {
    pub(super) fn new(m: usize) -> Self {
        Self([(); 3].map(|()| vec![0.0; m]))
    }

    /// The increments of a stage behind those of the stages before it.
    #[inline]
    pub(super) fn solve(&mut self, step: StepMatrices<'_>, stage: StageForces<'_>, increments: &mut [ReducedMotion]) {
        let (before, rest) = increments.split_at_mut(stage.i);
        if let Some(to) = rest.first_mut() {
            of_size!(stage.force.len(), m => solve_stage(m, (step, stage), before, &mut self.0, &mut to.all));
        }
    }
}

/// Uz = W⁻¹·(M·(r₁/(γh) + r₂) + C·r₁ − force − γ_i·h·forcing), Uv = Uz/(γh) − r₁ and Uw = Uv/(γh) − r₂.
#[inline(always)]
fn solve_stage(
    m: usize,
    (step, stage): (StepMatrices<'_>, StageForces<'_>),
    before: &[ReducedMotion],
    [r1, r2, product]: &mut [Vec<f64>; 3],
    to: &mut [f64],
) {
    let (h, gh, shift) = (step.h, GAMMA * step.h, GAMMA_I[stage.i] * step.h);
    let (r1, r2, product) = (&mut r1[..m], &mut r2[..m], &mut product[..m]);
    let [_, v, w] = stage.at.parts();
    r1.copy_from_slice(&v[..m]);
    r2.copy_from_slice(&w[..m]);
    for (c, u) in C[stage.i].iter().zip(before) {
        let (share, [z, v, _]) = (c / h, u.parts());
        r1.iter_mut().zip(&z[..m]).for_each(|(r, u)| *r += share * u);
        r2.iter_mut().zip(&v[..m]).for_each(|(r, u)| *r += share * u);
    }
    product.iter_mut().zip(&*r1).zip(&*r2).for_each(|((x, r1), r2)| *x = r1 / gh + r2);
    let (z, rest) = to.split_at_mut(m);
    z.fill(0.0);
    add_columns(m, step.mass.as_slice(), product, z);
    if let Some(damping) = step.damping {
        add_columns(m, damping.as_slice(), r1, z);
    }
    for (right, (force, forcing)) in z.iter_mut().zip(stage.force[..m].iter().zip(&stage.forcing[..m])) {
        *right -= force + shift * forcing;
    }
    solve_factored(m, step.factor.as_slice(), z);
    let (of_rates, of_pushes) = rest.split_at_mut(m);
    let of_stage = z.iter().zip(&mut *of_rates).zip(&mut of_pushes[..m]);
    for (((z, v), w), (r1, r2)) in of_stage.zip(r1.iter().zip(&*r2)) {
        *v = z / gh - r1;
        *w = *v / gh - r2;
    }
}

/// `to += a·x`.
#[inline]
pub(super) fn add_product(a: &DMatrix<f64>, x: &[f64], to: &mut [f64]) {
    of_size!(to.len(), m => add_columns(m, a.as_slice(), x, to));
}

/// The same of an order.
#[inline(always)]
fn add_columns(m: usize, a: &[f64], x: &[f64], to: &mut [f64]) {
    let to = &mut to[..m];
    for (column, x) in a.chunks_exact(m).zip(&x[..m]) {
        to.iter_mut().zip(column).for_each(|(to, a)| *to += a * x);
    }
}

/// `x` becomes (L·Lᵀ)⁻¹·x, with what is above the diagonal not read.
#[inline(always)]
fn solve_factored(m: usize, l: &[f64], x: &mut [f64]) {
    let (l, x) = (&l[..m * m], &mut x[..m]);
    for j in 0..m {
        x[j] /= l[j * m + j];
        for i in j + 1..m {
            x[i] -= l[j * m + i] * x[j];
        }
    }
    for j in (0..m).rev() {
        let mut known = -0.0;
        for i in j + 1..m {
            known += l[j * m + i] * x[i];
        }
        x[j] = (x[j] - known) / l[j * m + j];
    }
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
            of_size!(m, m => solve_factored(m, l.as_slice(), &mut solved));
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
