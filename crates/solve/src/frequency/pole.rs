//! A pole of the small-signal response, s with det(K + sC + s²M) = 0, from a near guess.
//!
//! Rayleigh quotient iteration on the quadratic: with x the motion at the last s, the next s is that root of
//! xᵀKx + s·xᵀCx + s²·xᵀMx = 0 that is nearest, and x becomes Z(s)⁻¹·Z′(s)·x. The matrices are symmetric, so xᵀ is the left vector
//! as well, and convergence is cubic.
//!
//! Reference: P. Lancaster, "Lambda-Matrices and Vibrating Systems" (1966), §10; A. Ruhe, "Algorithms for the nonlinear eigenvalue
//! problem", SIAM J. Numer. Anal. 10 (1973).

use super::harmonic::{ComplexPose, Harmonic};
use bimorph_domains::System;
use bimorph_multibody::BodyMatrix;
use bimorph_multibody::planar::Pose;
use nalgebra::Complex;

/// Iterations at most.
const MAX_ITERATIONS: usize = 20;
/// Change of s that is rounding (1).
const SETTLED: f64 = 1e-14;
/// A change no smaller than that before is rounding too where it is below this (1).
const ROUNDED: f64 = 1e-8;
/// A pole further from its guess than this fraction is another one.
const NEAR: f64 = 0.2;

/// The pole next to `guess` (rad/s) for a tangent `stiffness`, starting from the force `push` on each body; none where the iteration
/// does not settle near it.
pub fn pole(
    harmonic: &mut Harmonic,
    system: &System,
    stiffness: &BodyMatrix,
    guess: Complex<f64>,
    push: &[Pose],
) -> Option<Complex<f64>> {
    let model = &system.model;
    let mut s = guess;
    let mut x: Vec<ComplexPose> = push.iter().map(|f| f.map(Complex::from)).collect();
    let mut last = f64::INFINITY;
    for _ in 0..MAX_ITERATIONS {
        bimorph_base::budget::check();
        if harmonic.factor_at(system, stiffness, s).is_err() {
            return Some(s); // it is one to the last digit
        }
        for (x, body) in x.iter_mut().zip(&model.bodies) {
            if let Some(free) = &body.free {
                *x = free.map(Complex::from) * *x;
            }
        }
        harmonic.solve(system, &mut x);
        let size = x.iter().flat_map(|x| x.iter()).map(|c| c.norm_sqr()).sum::<f64>().sqrt();
        if !(size.is_finite() && size > 0.0) {
            return None;
        }
        x.iter_mut().for_each(|x| *x /= Complex::from(size));
        // xᵀMx, xᵀCx and, from xᵀZx, xᵀKx
        let weighed: Vec<ComplexPose> =
            x.iter().enumerate().map(|(j, x)| x.zip_map(&model.mass(j), |x, m| x * m)).collect();
        let dragged = harmonic.dragged(system, &x);
        let mut forced = vec![ComplexPose::zeros(); x.len()];
        harmonic.matrix.multiply_add(&model.pattern, &x, &mut forced);
        let (a, b) = (dot(&x, &weighed), dot(&x, &dragged));
        let rest = dot(&x, &forced);
        // in the change d of s: a·d² + (2·a·s + b)·d + rest = 0; the root that is nearer to 0
        let slope = a * s * 2.0 + b;
        let root = (slope * slope - a * rest * 4.0).sqrt();
        let sum = if (slope + root).norm() >= (slope - root).norm() { slope + root } else { slope - root };
        if sum.norm() == 0.0 {
            return None;
        }
        let change = -rest * 2.0 / sum;
        for ((x, m), c) in x.iter_mut().zip(&weighed).zip(&dragged) {
            *x = m * (s * 2.0) + c;
        }
        s += change;
        let share = change.norm() / s.norm();
        if share <= SETTLED || (share < ROUNDED && share >= 0.5 * last) {
            return ((s - guess).norm() <= NEAR * guess.norm()).then_some(s);
        }
        if share.is_nan() {
            return None;
        }
        last = share;
    }
    None
}

fn dot(x: &[ComplexPose], y: &[ComplexPose]) -> Complex<f64> {
    x.iter().zip(y).map(|(x, y)| x.x * y.x + x.y * y.y + x.z * y.z).sum()
}
