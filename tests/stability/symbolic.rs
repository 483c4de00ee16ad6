//! Method of a symbolic multibody program: constraint equations solved for speeds chosen in advance, by elimination in
//! the order in which they are written, without regard to numbers.
//!
//! In the coordinates q of the description, bodies accelerate with a = B·q̈ + c. The loops' rows J·q̈ = γ are solved for the
//! dependent q̈_d = W·q̈_i + w, and Wᵀ·M·W·q̈_i = Wᵀ·(g − M·w) is what is left (T. R. Kane, D. A. Levinson, "Dynamics:
//! Theory and Applications", 1985, §2.13 and §4.11: dependent generalized speeds).

use super::bank::{Bank, COORDINATES};
use bimorph::multibody::BodyId;
use nalgebra::{DMatrix, DVector};

/// Which speeds of a bimorph's own loop are dependent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Chosen {
    /// Those of the hot arm's first two pins.
    First,
    /// Those of the pins next to the closing one, in the flexure.
    Last,
}

/// Equations of motion of a bank at one configuration.
#[derive(Debug, Clone)]
pub(crate) struct Symbolic {
    mass: DMatrix<f64>,
    loops: DMatrix<f64>,
    force: DVector<f64>,
    gamma: DVector<f64>,
    to_bodies: DMatrix<f64>,
    bias: DVector<f64>,
    dependent: Vec<usize>,
}

impl Symbolic {
    /// Writes the equations down. `pose`, `rate`, `force` are those of a body in the order of description, `masses` its
    /// mass (kg) and moment of inertia (kg·m²).
    pub(crate) fn new(
        bank: &Bank,
        chosen: Chosen,
        masses: &[[f64; 2]],
        pose: &dyn Fn(usize) -> [f64; 3],
        rate: &dyn Fn(usize) -> [f64; 3],
        force: &dyn Fn(usize) -> [f64; 3],
    ) -> Self {
        let n = bank.hangs.len();
        let arm = |k: usize, at: [f64; 2]| {
            let (s, c) = pose(k)[2].sin_cos();
            let [x, y] = [at[0] - bank.centers[k][0], at[1] - bank.centers[k][1]];
            [c * x - s * y, s * x + c * y]
        };
        let (mut to_bodies, mut bias) = (DMatrix::<f64>::zeros(3 * n, n), DVector::<f64>::zeros(3 * n));
        for (k, &(up, at)) in bank.hangs.iter().enumerate() {
            let (r, w) = (arm(k, at), rate(k)[2]);
            if let BodyId::Free(p) = up {
                let (rp, wp) = (arm(p, at), rate(p)[2]);
                for j in 0..n {
                    let turn = to_bodies[(3 * p + 2, j)];
                    to_bodies[(3 * k, j)] = to_bodies[(3 * p, j)] - (rp[1] - r[1]) * turn;
                    to_bodies[(3 * k + 1, j)] = to_bodies[(3 * p + 1, j)] + (rp[0] - r[0]) * turn;
                    to_bodies[(3 * k + 2, j)] = turn;
                }
                for i in 0..2 {
                    bias[3 * k + i] = bias[3 * p + i] - wp * wp * rp[i];
                }
            }
            for i in 0..2 {
                bias[3 * k + i] += w * w * r[i];
            }
            for (i, x) in [r[1], -r[0], 1.0].into_iter().enumerate() {
                to_bodies[(3 * k + i, k)] = x;
            }
        }
        let m = 2 * bank.closes.len();
        let (mut rows, mut gamma) = (DMatrix::<f64>::zeros(m, 3 * n), DVector::<f64>::zeros(m));
        for (l, &(one, other, at)) in bank.closes.iter().enumerate() {
            for (id, sign) in [(one, -1.0), (other, 1.0)] {
                let BodyId::Free(k) = id else { continue };
                let (r, w) = (arm(k, at), rate(k)[2]);
                for (i, lever) in [-r[1], r[0]].into_iter().enumerate() {
                    rows[(2 * l + i, 3 * k + i)] = sign;
                    rows[(2 * l + i, 3 * k + 2)] = sign * lever;
                    gamma[2 * l + i] += sign * w * w * r[i];
                }
            }
        }
        gamma -= &rows * &bias;
        let inertia = DVector::from_fn(3 * n, |i, _| masses[i / 3][usize::from(i % 3 == 2)]);
        let free = DVector::from_fn(3 * n, |i, _| force(i / 3)[i % 3]) - inertia.component_mul(&bias);
        let mut weighted = to_bodies.clone();
        for (mut row, m) in weighted.row_iter_mut().zip(inertia.iter()) {
            row *= *m;
        }
        // of each loop in the order of description: two pins of the arms; the link and the yoke's pin before it
        let mut dependent = Vec::new();
        for k in 0..n / COORDINATES {
            let first = COORDINATES * k + if chosen == Chosen::First { 0 } else { 6 };
            dependent.extend([first, first + 1]);
            if k > 0 {
                dependent.extend([COORDINATES * k + 8, COORDINATES * k - 1]);
            }
        }
        Self {
            mass: to_bodies.transpose() * weighted,
            loops: &rows * &to_bodies,
            force: to_bodies.transpose() * free,
            gamma,
            to_bodies,
            bias,
            dependent,
        }
    }

    /// The bodies' accelerations, (x, y, θ) of each in turn, by elimination in the written order.
    pub(crate) fn accelerations(&self) -> DVector<f64> {
        let (n, m) = (self.force.len(), self.gamma.len());
        let others: Vec<usize> = (0..n).filter(|i| !self.dependent.contains(i)).collect();
        let s = others.len();
        let square = DMatrix::from_fn(m, m, |i, k| self.loops[(i, self.dependent[k])]);
        let right = DMatrix::from_fn(m, s + 1, |i, k| others.get(k).map_or(self.gamma[i], |&o| -self.loops[(i, o)]));
        let solved = eliminate(square, right);
        let (mut w, mut offset) = (DMatrix::zeros(n, s), DVector::zeros(n));
        for (k, &o) in others.iter().enumerate() {
            w[(o, k)] = 1.0;
        }
        for (i, &d) in self.dependent.iter().enumerate() {
            w.row_mut(d).copy_from(&solved.view((i, 0), (1, s)));
            offset[d] = solved[(i, s)];
        }
        let left = w.transpose() * &self.mass * &w;
        let right = w.transpose() * (&self.force - &self.mass * &offset);
        let x = eliminate(left, DMatrix::from_columns(&[right]));
        &self.to_bodies * (w * x.column(0) + offset) + &self.bias
    }

    /// The same from [M Jᵀ; J 0] with complete pivoting: the judge.
    pub(crate) fn judge(&self) -> DVector<f64> {
        let (n, m) = (self.force.len(), self.gamma.len());
        let mut a = DMatrix::zeros(n + m, n + m);
        a.view_mut((0, 0), (n, n)).copy_from(&self.mass);
        a.view_mut((n, 0), (m, n)).copy_from(&self.loops);
        a.view_mut((0, n), (n, m)).copy_from(&self.loops.transpose());
        let mut r = DVector::zeros(n + m);
        r.rows_mut(0, n).copy_from(&self.force);
        r.rows_mut(n, m).copy_from(&self.gamma);
        let x = a.full_piv_lu().solve(&r).unwrap();
        &self.to_bodies * x.rows(0, n) + &self.bias
    }
}

/// A⁻¹·B by Gaussian elimination, rows and columns as they come.
fn eliminate(mut a: DMatrix<f64>, mut b: DMatrix<f64>) -> DMatrix<f64> {
    let n = a.nrows();
    for k in 0..n {
        for i in k + 1..n {
            let factor = a[(i, k)] / a[(k, k)];
            if factor != 0.0 {
                for c in k..n {
                    a[(i, c)] -= factor * a[(k, c)];
                }
                for c in 0..b.ncols() {
                    b[(i, c)] -= factor * b[(k, c)];
                }
            }
        }
    }
    for k in (0..n).rev() {
        for c in 0..b.ncols() {
            let known: f64 = (k + 1..n).map(|i| a[(k, i)] * b[(i, c)]).sum();
            b[(k, c)] = (b[(k, c)] - known) / a[(k, k)];
        }
    }
    b
}
