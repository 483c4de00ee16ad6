//! The equation that every implicit step with one unknown displacement comes to, and Newton's method for it.
//!
//! With x the displacement from the start of the step,
//! ```text
//! R(x) = m·M·x + c·C·x + Σ_k w_k·r(q₀ + ξ_k·x, t_k) + constant = 0,      ∂R/∂x = m·M + c·C + Σ_k w_k·ξ_k·K(q₀ + ξ_k·x, t_k)
//! ```
//! with the exact tangent in every iteration, so that convergence is quadratic and one block factorization and one solve
//! make an iteration. It ends when the next correction would be below 1e-12 of the displacement (largest translation, or
//! rotation times the model's length scale), or when rounding lets corrections shrink no further.

use super::method::{Motion, StepFailure, Work};
use crate::domains::{Drive, Ramp, System};
use crate::multibody::planar::Pose;
use crate::multibody::{BlockMatrix, forces};
use crate::solve::linear::LinearSolver;

/// Next correction allowed, relative to the displacement.
const TOLERANCE: f64 = 1e-12;
/// Corrections below this share that no longer shrink are rounding.
const STALLED: f64 = 1e-9;
/// Most iterations.
const MAX_ITERATIONS: usize = 20;
/// Corrections larger than the first by this factor will not come back.
const LOST: f64 = 1e3;

/// One evaluation of the forces in [`Equation`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    /// Weight w.
    pub(super) weight: f64,
    /// Share ξ of the displacement.
    pub(super) share: f64,
    /// Time on the ramp [s].
    pub(super) time: f64,
}

/// See the module.
#[derive(Debug)]
pub(super) struct Equation<'a> {
    /// Factor of M [1/s²].
    pub(super) m: f64,
    /// Factor of C [1/s].
    pub(super) c: f64,
    /// q₀.
    pub(super) base: &'a [Pose],
    /// The part that does not depend on x.
    pub(super) constant: &'a [Pose],
    /// Where the forces are taken.
    pub(super) samples: &'a [Sample],
}

/// Newton's method with its storage.
#[derive(Debug, Clone)]
pub(super) struct Implicit<S> {
    solver: S,
    matrix: BlockMatrix<f64, 3>,
    part: BlockMatrix<f64, 3>,
    at: Vec<Pose>,
    force: Vec<Pose>,
    residual: Vec<Pose>,
    drive: Drive,
    pub(super) work: Work,
}

impl<S: LinearSolver> Implicit<S> {
    pub(super) fn new(solver: S, system: &System) -> Self {
        let zeros = vec![Pose::zeros(); system.bodies()];
        Self {
            solver,
            matrix: BlockMatrix::new(&system.model.pattern),
            part: BlockMatrix::new(&system.model.pattern),
            at: zeros.clone(),
            force: zeros.clone(),
            residual: zeros,
            drive: system.electrics.drive(),
            work: Work::default(),
        }
    }

    /// Newton from the guess in `x` to the root. The last iteration's factor stays for [`Implicit::solve`].
    pub(super) fn newton(
        &mut self,
        system: &System,
        ramp: &Ramp<'_>,
        equation: &Equation<'_>,
        x: &mut [Pose],
    ) -> Result<(), StepFailure> {
        let (mut first, mut last) = (0.0, f64::INFINITY);
        for iteration in 0..MAX_ITERATIONS {
            self.assemble(system, ramp, equation, x);
            // a matrix that breaks down on the way means that the iteration has left the neighbourhood of the step
            self.solver.factor(&system.model.pattern, &mut self.matrix).map_err(|p| match iteration {
                0 => StepFailure::Singular(p),
                _ => StepFailure::Diverged { iterations: iteration, body: p.body, direction: p.direction },
            })?;
            self.solver.solve(&system.model.pattern, &self.matrix, &mut self.residual);
            self.work.factorizations += 1;
            self.work.solves += 1;
            self.work.iterations += 1;
            for (x, d) in x.iter_mut().zip(&self.residual) {
                *x -= d;
            }
            let correction = largest(system, &self.residual);
            let reach = largest(system, equation.base).0.max(largest(system, x).0).max(1e-6 * system.length_scale);
            // quadratic convergence: the next correction shrinks at least as much more as this one did
            let next = if iteration == 0 { correction.0 } else { correction.0 * (correction.0 / last).min(1.0) };
            let stalled = iteration > 0 && correction.0 <= STALLED * reach && correction.0 > 0.1 * last;
            if next <= TOLERANCE * reach || stalled {
                return Ok(());
            }
            first = if iteration == 0 { correction.0 } else { first };
            if !correction.0.is_finite() || correction.0 > LOST * first || iteration + 1 == MAX_ITERATIONS {
                let (body, direction) = correction.1;
                return Err(StepFailure::Diverged { iterations: iteration + 1, body, direction });
            }
            last = correction.0;
        }
        Ok(())
    }

    /// R(x) into `residual` and its tangent into `matrix`.
    fn assemble(&mut self, system: &System, ramp: &Ramp<'_>, equation: &Equation<'_>, x: &[Pose]) {
        let model = &system.model;
        for (k, (r, constant)) in self.residual.iter_mut().zip(equation.constant).enumerate() {
            *r = constant + model.mass(k).component_mul(&x[k]) * equation.m;
            self.at[k] = x[k] * equation.c;
        }
        forces::add_damping(model, &self.at, &mut self.residual);
        for (number, sample) in equation.samples.iter().enumerate() {
            ramp.at(sample.time, &mut self.drive);
            for (at, (q, x)) in self.at.iter_mut().zip(equation.base.iter().zip(x)) {
                *at = q + x * sample.share;
            }
            let matrix = if number == 0 { &mut self.matrix } else { &mut self.part };
            system.tangent(&self.at, &self.drive, matrix, &mut self.force);
            self.work.forces += 1;
            let scale = sample.weight * sample.share;
            if number == 0 {
                self.matrix.diagonal.iter_mut().for_each(|b| *b *= scale);
                self.matrix.below.iter_mut().for_each(|b| *b *= scale);
            } else {
                let sum = |a: &mut [_], b: &[_]| {
                    for (a, b) in a.iter_mut().zip(b) {
                        *a += *b * scale;
                    }
                };
                sum(&mut self.matrix.diagonal, &self.part.diagonal);
                sum(&mut self.matrix.below, &self.part.below);
            }
            for (r, f) in self.residual.iter_mut().zip(&self.force) {
                *r += f * sample.weight;
            }
        }
        forces::add_inertia(model, equation.m, equation.c, &mut self.matrix);
        model.project_matrix(&mut self.matrix);
        model.project(&mut self.residual);
    }

    /// Takes an estimated error through (1 − J/c)⁻¹ with the factor that the last iteration left, which has `c` [1/s] for the
    /// factor of C and c² for that of M: motions much faster than the step then count for little. In: the errors of the
    /// displacements' rates in `error.v` times the step, and of M times the accelerations in `error.q`.
    pub(super) fn smooth(&mut self, system: &System, c: f64, error: &mut Motion) {
        for (k, (q, v)) in error.q.iter_mut().zip(&error.v).enumerate() {
            *q = (*q + system.model.mass(k).component_mul(v) * c) * c;
            self.at[k] = v * c;
        }
        forces::add_damping(&system.model, &self.at, &mut error.q);
        self.solve(system, &mut error.q);
        for (q, v) in error.q.iter().zip(&mut error.v) {
            *v = (q - *v) * c;
        }
    }

    /// Solves with the factor that the last iteration left.
    pub(super) fn solve(&mut self, system: &System, b: &mut [Pose]) {
        system.model.project(b);
        self.solver.solve(&system.model.pattern, &self.matrix, b);
        self.work.solves += 1;
    }

    /// `out = r(q, t)`.
    pub(super) fn force(&mut self, system: &System, ramp: &Ramp<'_>, time: f64, q: &[Pose], out: &mut [Pose]) {
        ramp.at(time, &mut self.drive);
        system.residual(q, &self.drive, out);
        self.work.forces += 1;
    }
}

/// Largest translation, or rotation times the length scale [m], with its body and direction; a NaN counts as infinite.
pub(super) fn largest(system: &System, x: &[Pose]) -> (f64, (usize, usize)) {
    let mut found = (0.0, (0, 0));
    for (j, p) in x.iter().enumerate() {
        for i in 0..3 {
            let size = if i == 2 { p[i].abs() * system.length_scale } else { p[i].abs() };
            if size.is_nan() {
                return (f64::INFINITY, (j, i));
            }
            if size > found.0 {
                found = (size, (j, i));
            }
        }
    }
    found
}
