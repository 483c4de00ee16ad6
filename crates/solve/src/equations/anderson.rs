//! Anderson's acceleration of an iteration x ← g(x) that contracts slowly, or not quite, in a few directions.
//!
//! With f = g(x) − x and the differences ΔF, ΔG of the last iterates, the next one is
//! ```text
//! x = g − ΔG·c,      c: the least squares solution of ΔF·c = f
//! ```
//! which for a linear iteration is GMRES on the directions that are left. A stage in joint coordinates needs it where
//! reactions bend what the iteration's matrix takes for straight: near the load of buckling, and in very long steps.
//!
//! References: D. G. Anderson, J. ACM 12 (1965) 547–560; H. F. Walker, P. Ni, SIAM J. Numer. Anal. 49 (2011) 1715–1735.

use nalgebra::{SMatrix, SVector};

/// Differences kept.
const DEPTH: usize = 4;
/// A difference whose orthogonal remainder is shorter than this fraction of its length is dropped as dependent.
const DEPENDENCE_TOLERANCE: f64 = 1e-10;

/// The last iterates, as differences. Nothing is allocated after [`Anderson::new`].
#[derive(Debug, Clone)]
pub(super) struct Anderson {
    kept: usize,
    begun: bool,
    f: Vec<f64>,
    g: Vec<f64>,
    df: [Vec<f64>; DEPTH],
    dg: [Vec<f64>; DEPTH],
}

impl Anderson {
    /// Storage for `n` unknowns.
    pub(super) fn new(n: usize) -> Self {
        let zeros = || vec![0.0; n];
        Self {
            kept: 0,
            begun: false,
            f: zeros(),
            g: zeros(),
            df: std::array::from_fn(|_| zeros()),
            dg: std::array::from_fn(|_| zeros()),
        }
    }

    /// Drops the history, for another equation.
    pub(super) fn restart(&mut self) {
        (self.kept, self.begun) = (0, false);
    }

    /// g(x) − x of the last iterate.
    pub(super) fn change(&self) -> &[f64] {
        &self.f
    }

    /// Takes `x` and its image `g`, with unknowns measured against `scale`; `x` becomes the next iterate.
    pub(super) fn next(&mut self, x: &mut [f64], g: &[f64], scale: &[f64]) {
        let n = x.len();
        if self.begun {
            self.df.rotate_right(1);
            self.dg.rotate_right(1);
            for k in 0..n {
                self.df[0][k] = (g[k] - x[k]) - self.f[k];
                self.dg[0][k] = g[k] - self.g[k];
            }
            self.kept = (self.kept + 1).min(DEPTH);
        }
        self.begun = true;
        for k in 0..n {
            self.f[k] = g[k] - x[k];
        }
        self.g.copy_from_slice(g);
        x.copy_from_slice(g);
        let c = self.coefficients(scale);
        for (c, dg) in c.iter().zip(&self.dg).take(self.kept) {
            for (x, d) in x.iter_mut().zip(dg) {
                *x -= c * d;
            }
        }
    }

    /// Least squares by the Cholesky factor of the normal equations, newest difference first; one that its elders span
    /// is left out.
    fn coefficients(&self, scale: &[f64]) -> SVector<f64, DEPTH> {
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).zip(scale).map(|((a, b), s)| a * b / (s * s)).sum() };
        let mut l = SMatrix::<f64, DEPTH, DEPTH>::zeros();
        let mut c = SVector::<f64, DEPTH>::zeros();
        let mut used = [false; DEPTH];
        for i in 0..self.kept {
            let own = dot(&self.df[i], &self.df[i]);
            let mut left = own;
            for j in (0..i).filter(|&j| used[j]) {
                let mut sum = dot(&self.df[i], &self.df[j]);
                for k in (0..j).filter(|&k| used[k]) {
                    sum -= l[(i, k)] * l[(j, k)];
                }
                l[(i, j)] = sum / l[(j, j)];
                left -= l[(i, j)] * l[(i, j)];
            }
            used[i] = left > DEPENDENCE_TOLERANCE * own && left.is_finite();
            if used[i] {
                l[(i, i)] = left.sqrt();
                let mut sum = dot(&self.df[i], &self.f);
                for j in (0..i).filter(|&j| used[j]) {
                    sum -= l[(i, j)] * c[j];
                }
                c[i] = sum / l[(i, i)];
            }
        }
        for i in (0..self.kept).rev().filter(|&i| used[i]) {
            let mut sum = c[i];
            for j in (i + 1..self.kept).filter(|&j| used[j]) {
                sum -= l[(j, i)] * c[j];
            }
            c[i] = sum / l[(i, i)];
        }
        c
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A linear iteration that expands in one of its directions (factors 0.5, −0.3, 0.1 and 1.5) comes to its fixed point in
    /// six steps: four differences are enough for four directions.
    #[test]
    fn a_linear_iteration_ends() {
        let (factors, fixed) = ([0.5, -0.3, 0.1, 1.5], [1.0, -2.0, 3.0, 4.0]);
        let mut x = vec![0.0; 4];
        let mut anderson = Anderson::new(4);
        for _ in 0..6 {
            let g: Vec<f64> = (0..4).map(|k| fixed[k] + factors[k] * (x[k] - fixed[k])).collect();
            anderson.next(&mut x, &g, &[1.0; 4]);
        }
        for (x, fixed) in x.iter().zip(fixed) {
            assert!((x - fixed).abs() < 1e-9, "{x} {fixed}");
        }
    }
}
