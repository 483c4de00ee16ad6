//! The error of a run with Rodas4, propagated linearly over its accepted steps.
//!
//! A quartic P through displacements and rates at both ends of a step, and accelerations at its start, leaves the residual
//! ρ = M·P̈ + C·Ṗ + r(P, t) in the equations of motion. The error e = (numerical − exact) obeys M·ë + C·ė + K·e = ρ, so a step adds the
//! impulse h∫ρ dx to its momentum and −h²∫x·ρ dx to its displacement (x from 0 to 1, both reduced to the start of the step). Radau's
//! quadrature takes both moments from two nodes, since ρ vanishes at the start. With J the Jacobian of the step and
//! W = (I − γhJ)⁻¹, whose factor the step leaves behind,
//! ```text
//! e ← R(hJ)·e + W⁴·D,          D = (−h²∫x·ρ dx, h∫ρ dx)
//! R(hJ) = Σ a_k·W^k            the method's stability function
//! ```
//! W⁴ is exp(hJ) but for 1 % at hω = 0.3 and 9 % at hω = 1, and at most 1 for motions faster than the step. The displacement in D enters as
//! γhJ·(0, x) = (I − W⁻¹)·(0, x), so that residuals act as forces only: a direction without inertia then follows its springs. Six
//! solves and two evaluations of the forces make a step.
//!
//! P is any function with the right ends: an acceleration that is inexact changes ρ, and not its two moments.
//!
//! The residual takes the energy −h∫Ṗ·ρ dx from the motion. Where motions faster than the step turn with slow ones, a step damps them, and its
//! linear error does not see what that takes from the slow ones. The energy shows it.
//!
//! Reference for estimates by the defect: W. H. Enright, "Continuous numerical methods for ODEs with defect control" (2000).

use super::method::Method;
use super::rodas4::tableau::GAMMA;
use crate::equations::{Bodies, Motion, SolverCounters, StepResult};
use bimorph_multibody::planar::Pose;
use nalgebra::Complex;

/// Nodes of Radau's quadrature of three points without the one at the start, as fractions of the step, and their weights.
pub(super) const NODES: [(f64, f64); 2] =
    [(0.355_051_025_721_682_2, 0.512_485_826_188_421_6), (0.844_948_974_278_317_8, 0.376_403_062_700_467_3)];

/// a₁ to a₆ of R = Σ a_k·W^k.
pub(super) const POWERS: [f64; 6] = [
    2.210_462_521_610_22,
    -9.385_645_941_384_41,
    12.771_291_882_768_83,
    -5.104_625_216_102_17,
    0.385_645_941_384_42,
    0.122_870_811_723_12,
];

/// |R(iz)·exp(−iz) − 1|: relative error of a step that rotates a motion by the angle `z` (rad) (1).
pub fn step_error(z: f64) -> f64 {
    let w = Complex::new(1.0, -GAMMA * z).inv();
    let r = POWERS.iter().rev().fold(Complex::new(0.0, 0.0), |sum, a| (sum + a) * w);
    (r * Complex::new(0.0, -z).exp() - 1.0).norm()
}

/// The number of the solve, from 0, that takes the residual's impulses in; the next takes those of the displacement out.
pub(super) const IMPULSES: usize = 2;

/// Moments of the residual over a step, as impulses at its start.
#[derive(Debug, Clone)]
pub(super) struct Impulses {
    /// M·(0, x) of the displacement, and of it with that of the rate.
    early: Vec<Pose>,
    both: Vec<Pose>,
}

impl Impulses {
    pub(super) fn zeros(count: usize) -> Self {
        Self { early: vec![Pose::zeros(); count], both: vec![Pose::zeros(); count] }
    }

    pub(super) fn clear(&mut self) {
        self.early.fill(Pose::zeros());
        self.both.fill(Pose::zeros());
    }

    /// Adds the residual `rho` of unknown `k` at a node of a step of length `h` (s).
    pub(super) fn add(&mut self, k: usize, (x, weight): (f64, f64), h: f64, rho: Pose) {
        let early = rho * (-weight * x * h / GAMMA);
        self.early[k] += early;
        self.both[k] += early + rho * (weight * h);
    }

    /// Input of solve `number` for unknown `k`.
    pub(super) fn of(&self, number: usize, k: usize) -> Pose {
        match number {
            IMPULSES => self.both[k],
            n if n == IMPULSES + 1 => -self.early[k],
            _ => Pose::zeros(),
        }
    }
}

/// P, Ṗ and P̈ at the fraction `x` of a step of length `h` (s), from displacements and rates at both ends and the acceleration at the start.
#[inline]
pub(super) fn quartic(x: f64, h: f64, [q0, q1]: [&Pose; 2], [v0, v1]: [&Pose; 2], a0: &Pose) -> [Pose; 3] {
    let d = q1 - q0 - v0 * h - a0 * (0.5 * h * h);
    let g = (v1 - v0) * h - a0 * (h * h);
    let (c3, c4) = (d * 4.0 - g, g - d * 3.0);
    let (x2, h2) = (x * x, h * h);
    [
        q0 + v0 * (x * h) + a0 * (0.5 * x2 * h2) + (c3 + c4 * x) * (x2 * x),
        v0 + a0 * (x * h) + (c3 * 3.0 + c4 * (4.0 * x)) * (x2 / h),
        a0 + (c3 * 6.0 + c4 * (12.0 * x)) * (x / h2),
    ]
}

/// The acceleration at the start of the cubic with these ends.
#[inline]
pub(super) fn cubic_start(h: f64, [q0, q1]: [f64; 2], [v0, v1]: [f64; 2]) -> f64 {
    6.0 * (q1 - q0) / (h * h) - (4.0 * v0 + 2.0 * v1) / h
}

/// e ← R(hJ)·e + W⁴·D. `solve` takes a vector, in each of its representations, through W; it is called with the number of the solve.
pub(super) fn propagate<const N: usize>(
    e: &mut [Motion; N],
    r: &mut [Motion; N],
    mut solve: impl FnMut(usize, &mut [Motion; N]),
) {
    for (r, e) in r.iter_mut().zip(e.iter()) {
        r.copy(e);
        r.scale(POWERS[5]);
    }
    for k in 0..5 {
        solve(k, r);
        r.iter_mut().zip(e.iter()).for_each(|(r, e)| r.add(POWERS[4 - k], e));
    }
    solve(5, r);
    e.iter_mut().zip(r.iter()).for_each(|(e, r)| e.copy(r));
}

/// A method that carries the error of its motion along.
pub trait Propagates<'s>: Method<Bodies<'s>> {
    /// Starts with no error.
    fn begin_error(&mut self);

    /// After an accepted step of length `h` (s) from time `s` (s): the error of the bodies' motion at its end. `carried` is what the
    /// method carried at its start.
    fn error(
        &mut self,
        bodies: &mut Bodies<'s>,
        step: (f64, f64),
        ends: [&Motion; 2],
        carried: &[Motion],
    ) -> MotionError<'_>;
}

/// The error of a motion at the end of a step.
#[derive(Debug, Clone, Copy)]
pub struct MotionError<'a> {
    /// Error of the bodies' motion.
    pub motion: &'a Motion,
    /// Energy that the residuals have taken from the motion so far (J).
    pub taken: f64,
}

/// Receives each accepted step: its end (s), the motion there and the error of that; returns whether the error is still of use.
pub type SeeError<'a> = &'a mut dyn FnMut(f64, &Motion, MotionError<'_>) -> bool;

/// A method whose error is reported after each accepted step. The motion is bit-identical to that of the method alone.
pub struct Estimated<'a, M> {
    method: M,
    see: SeeError<'a>,
    live: bool,
}

impl<'a, M> Estimated<'a, M> {
    /// `method` with `see` for its errors.
    pub fn new<'s>(mut method: M, see: SeeError<'a>) -> Self
    where
        M: Propagates<'s>,
    {
        method.begin_error();
        Self { method, see, live: true }
    }
}

impl<'s, M: Propagates<'s>> Method<Bodies<'s>> for Estimated<'_, M> {
    fn error_order(&self) -> f64 {
        self.method.error_order()
    }

    fn start(&mut self, bodies: &mut Bodies<'s>, motion: &Motion) -> StepResult {
        self.method.start(bodies, motion)
    }

    fn step(&mut self, bodies: &mut Bodies<'s>, t: f64, h: f64, motion: &mut Motion, error: &mut Motion) -> StepResult {
        self.method.step(bodies, t, h, motion, error)
    }

    fn accepted(&mut self, bodies: &mut Bodies<'s>, (t, h): (f64, f64), ends: [&Motion; 2], carried: &[Motion]) {
        if self.live {
            let error = self.method.error(bodies, (t, h), ends, carried);
            self.live = (self.see)(t + h, ends[1], error);
        }
    }

    fn carried(&mut self) -> &mut [Motion] {
        self.method.carried()
    }

    fn work(&self) -> SolverCounters {
        self.method.work()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The powers of W sum to the exponential of z to the fourth order, with an error of −7.3e-4·z⁵; they are the stability function of
    /// the tableau, computed from it in rational form.
    #[test]
    fn powers_are_the_exponential() {
        let r = |z: f64| {
            let w = 1.0 / (1.0 - GAMMA * z);
            POWERS.iter().rev().fold(0.0, |sum, a| (sum + a) * w)
        };
        for z in [-0.2, -0.1, 0.1, 0.2] {
            let error = (r(z) - f64::exp(z)) / f64::powi(z, 5);
            assert!((-1.1e-3..-4e-4).contains(&error), "{z}: {error:e}");
        }
    }

    /// The error of a step over a small angle is 7.3e-4 of its fifth power; a step over a large angle is wrong
    /// entirely.
    #[test]
    fn steps_are_off_by_the_fifth_power() {
        for z in [0.1, 0.2] {
            assert!((step_error(z) / z.powi(5) / 7.3e-4 - 1.0).abs() < 0.2, "{z}: {:e}", step_error(z) / z.powi(5));
        }
        assert!(step_error(100.0) > 0.8 && step_error(0.0) < 1e-12);
    }

    /// A quartic is itself: t⁴ − 2t³ + t on a step of half a second from t = 0.3 s.
    #[test]
    fn a_quartic_is_itself() {
        let x = |t: f64| Pose::new(t.powi(4) - 2.0 * t.powi(3) + t, t * t, 1.0);
        let v = |t: f64| Pose::new(4.0 * t.powi(3) - 6.0 * t * t + 1.0, 2.0 * t, 0.0);
        let a = |t: f64| Pose::new(12.0 * t * t - 12.0 * t, 2.0, 0.0);
        let (s, h) = (0.3, 0.5);
        for f in [0.0, 0.355, 1.0] {
            let t = s + f * h;
            let found = quartic(f, h, [&x(s), &x(s + h)], [&v(s), &v(s + h)], &a(s));
            for (found, want) in found.iter().zip([x(t), v(t), a(t)]) {
                assert!((found - want).norm() < 1e-12, "{f}: {found} {want}");
            }
        }
    }
}
