//! Small signals in a frame that turns: (A + G)·x = f, where A is symmetric and factored and G is what the frame's rate adds,
//! iω·2mΩ e×, skew.
//!
//! Next to a resonance G is not small beside A: there a gyroscope's two modes are coupled. But it couples few directions, so
//! the Krylov space of A⁻¹G is small, and GMRES on (1 + A⁻¹G)·x = A⁻¹f needs about two vectors for each mode that takes part.
//!
//! Reference: Y. Saad, M. Schultz, "GMRES: a generalized minimal residual algorithm for solving nonsymmetric linear systems",
//! SIAM J. Sci. Stat. Comput. 7 (1986).

use super::harmonic::{ComplexPose, Harmonic};
use bimorph_domains::System;
use nalgebra::Complex;

/// Vectors at most: more modes than take part in any band.
const MAX_VECTORS: usize = 60;
/// Fraction of the right-hand side at which the residual is rounding (1).
const ENOUGH: f64 = 1e-14;

type ComplexVector = Vec<ComplexPose>;

/// Solves for one force with the matrix that `harmonic` has factored and a frame at `rate` (rad/s); `x` holds the force and
/// becomes the response. `omega` in rad/s.
pub fn solve(harmonic: &mut Harmonic, system: &System, (omega, rate): (f64, f64), x: &mut [ComplexPose]) {
    harmonic.solve(system, x);
    if rate == 0.0 || omega == 0.0 {
        return;
    }
    let factor = Complex::new(0.0, 2.0 * omega * rate);
    let apply = |harmonic: &mut Harmonic, v: &ComplexVector| -> ComplexVector {
        let mut w: ComplexVector = v
            .iter()
            .zip(&system.model.bodies)
            .map(|(v, body)| {
                let amount = factor * body.mass;
                let force = ComplexPose::new(-amount * v.y, amount * v.x, Complex::from(0.0));
                match &body.free {
                    Some(free) => free.map(Complex::from) * force,
                    None => force,
                }
            })
            .collect();
        harmonic.solve(system, &mut w);
        w.iter_mut().zip(v).for_each(|(w, v)| *w += v);
        w
    };
    let size = norm(x);
    if size == 0.0 {
        return;
    }
    // Arnoldi with Givens rotations; x₀ = 0
    let mut basis: Vec<ComplexVector> = vec![x.iter().map(|p| p / Complex::from(size)).collect()];
    let mut columns: Vec<Vec<Complex<f64>>> = Vec::new();
    let mut turns: Vec<(f64, Complex<f64>)> = Vec::new();
    let mut rest = vec![Complex::from(size)];
    while columns.len() < MAX_VECTORS && rest.last().is_some_and(|r| r.norm() > ENOUGH * size) {
        bimorph_base::budget::check();
        let k = columns.len();
        let mut w = apply(harmonic, &basis[k]);
        let mut column = Vec::with_capacity(k + 2);
        for v in &basis {
            let h = dot(v, &w);
            w.iter_mut().zip(v).for_each(|(w, v)| *w -= v * h);
            column.push(h);
        }
        let left = norm(&w);
        column.push(Complex::from(left));
        for (j, (c, s)) in turns.iter().enumerate() {
            let (a, b) = (column[j], column[j + 1]);
            (column[j], column[j + 1]) = (a * *c + s * b, b * *c - s.conj() * a);
        }
        let (a, b) = (column[k], column[k + 1]);
        let long = a.norm().hypot(b.norm());
        let (c, s) =
            if a.norm() == 0.0 { (0.0, Complex::from(1.0)) } else { (a.norm() / long, a / a.norm() * b.conj() / long) };
        column[k] = a * c + s * b;
        column.truncate(k + 1);
        let last = rest[k];
        rest[k] = last * c;
        rest.push(-s.conj() * last);
        turns.push((c, s));
        columns.push(column);
        if left <= f64::EPSILON * long {
            break;
        }
        basis.push(w.iter().map(|p| p / Complex::from(left)).collect());
    }
    // back-substitution
    let n = columns.len();
    let mut y = rest[..n].to_vec();
    for k in (0..n).rev() {
        for j in k + 1..n {
            let known = columns[j][k] * y[j];
            y[k] -= known;
        }
        y[k] /= columns[k][k];
    }
    x.fill(ComplexPose::zeros());
    for (v, y) in basis.iter().zip(&y) {
        x.iter_mut().zip(v).for_each(|(x, v)| *x += v * *y);
    }
}

/// xᴴ·y.
fn dot(x: &[ComplexPose], y: &[ComplexPose]) -> Complex<f64> {
    x.iter().zip(y).map(|(x, y)| x.dotc(y)).sum()
}

fn norm(x: &[ComplexPose]) -> f64 {
    dot(x, x).re.sqrt()
}
