//! Newton's method with the exact tangent, for implicit steps over bodies.
//!
//! With x the displacement from a base q₀, every implicit step comes to
//! ```text
//! R(x) = m·M·x + c·C·x + Σ_k w_k·r(q₀ + ξ_k·x, t_k) + constant = 0,      ∂R/∂x = m·M + c·C + Σ_k w_k·ξ_k·K(q₀ + ξ_k·x, t_k)
//! ```
//! so that convergence is quadratic and one block factorization and one solve make an iteration. A stage a = A(t, q + β·a, v + γ·a)
//! is this with x = β·a, m = 1/β and c = γ/β: bodies without inertia need no inverse. It ends when the next correction would be below
//! 1e-12 of the displacement (largest translation, or rotation times the model's length scale), or when rounding lets corrections shrink
//! no further.

use super::linear::LinearSolver;
use super::{Bodies, DegreeOfFreedom, Equations, Motion, SolverCounters, Stage, Staged, StepFailure, StepResult};
use bimorph_domains::loss_derivatives::LossDerivatives;
use bimorph_domains::{Drive, System};
use bimorph_multibody::planar::{DOF, Pose};
use bimorph_multibody::{BodyMatrix, forces};

/// Next correction allowed, relative to the displacement.
const TOLERANCE: f64 = 1e-12;
/// Corrections below this fraction that no longer shrink are rounding.
const STALLED: f64 = 1e-9;
/// Most iterations.
const MAX_ITERATIONS: usize = 20;
/// Corrections larger than the first by this factor will not come back.
const LOST: f64 = 1e3;

/// One evaluation of the forces in [`Equation`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct ForceEvaluation {
    /// Weight w.
    pub(crate) weight: f64,
    /// Fraction ξ of the displacement.
    pub(crate) share: f64,
    /// Time on the ramp (s).
    pub(crate) time: f64,
}

/// See the module.
#[derive(Debug)]
pub(crate) struct Equation<'a> {
    /// Factor of M (1/s²).
    pub(crate) m: f64,
    /// Factor of C (1/s): the rate is `rates` + c·x.
    pub(crate) c: f64,
    /// Rates without x; their damping is in `constant`, and what contact loses is not.
    pub(crate) rates: &'a [Pose],
    /// q₀.
    pub(crate) base: &'a [Pose],
    /// The part that does not depend on x.
    pub(crate) constant: &'a [Pose],
    /// Where the forces are taken.
    pub(crate) samples: &'a [ForceEvaluation],
    /// Length of a step over which members have their discrete forces instead (s).
    pub(crate) quotient: Option<f64>,
}

/// Bodies with the storage of Newton's method, which is laid out when the first stage asks.
#[derive(Debug, Clone)]
pub struct Newton<'a, S> {
    bodies: Bodies<'a>,
    solver: S,
    matrix: Option<BodyMatrix>,
    part: Option<BodyMatrix>,
    /// 1/M, or 0 without mass.
    inverse: Vec<Pose>,
    /// Derivatives of what contact loses with displacements and rates; none where it loses nothing.
    loss: Option<LossDerivatives>,
    at: Vec<Pose>,
    x: Vec<Pose>,
    constant: Vec<Pose>,
    force: Vec<Pose>,
    residual: Vec<Pose>,
    drive: Drive,
    work: SolverCounters,
}

impl<'a, S: LinearSolver> Newton<'a, S> {
    /// Storage; `solver` solves the linear systems.
    pub fn new(bodies: Bodies<'a>, solver: S) -> Self {
        let model = &bodies.system.model;
        let zeros = vec![Pose::zeros(); model.bodies.len()];
        let inverse = |mass: f64| if mass > 0.0 { 1.0 / mass } else { 0.0 };
        Self {
            inverse: (0..model.bodies.len()).map(|k| model.mass(k).map(inverse)).collect(),
            drive: bodies.system.electrics.drive(),
            loss: LossDerivatives::of(bodies.system),
            bodies,
            solver,
            matrix: None,
            part: None,
            at: zeros.clone(),
            x: zeros.clone(),
            constant: zeros.clone(),
            force: zeros.clone(),
            residual: zeros,
            work: SolverCounters::default(),
        }
    }

    /// The mechanism.
    pub(crate) fn system(&self) -> &'a System {
        self.bodies.system
    }

    /// Newton from the guess in `x` to the root. The last iteration's factor stays for [`Staged::smooth`].
    pub(crate) fn root(&mut self, equation: &Equation<'_>, x: &mut [Pose]) -> StepResult {
        let system = self.bodies.system;
        let pattern = &system.model.pattern;
        let (mut first, mut last) = (0.0, f64::INFINITY);
        for iteration in 0..MAX_ITERATIONS {
            let mut matrix = self.matrix.take().unwrap_or_else(|| BodyMatrix::new(pattern));
            self.assemble(equation, x, &mut matrix);
            // a matrix that breaks down here means that the iteration has left the neighbourhood of the step
            let factored = self.solver.factor(pattern, &mut matrix).map_err(|p| match iteration {
                0 => StepFailure::Singular(p),
                _ => StepFailure::Diverged { iterations: iteration, body: p.body, direction: p.direction },
            });
            if factored.is_ok() {
                self.solver.solve(pattern, &matrix, &mut self.residual);
            }
            self.matrix = Some(matrix);
            factored?;
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
    fn assemble(&mut self, equation: &Equation<'_>, x: &[Pose], matrix: &mut BodyMatrix) {
        let system = self.bodies.system;
        let model = &system.model;
        for (k, (r, constant)) in self.residual.iter_mut().zip(equation.constant).enumerate() {
            *r = constant + model.mass(k).component_mul(&x[k]) * equation.m;
            self.at[k] = x[k] * equation.c;
        }
        forces::add_damping(model, &self.at, &mut self.residual);
        for (number, sample) in equation.samples.iter().enumerate() {
            self.bodies.ramp.at(sample.time, &mut self.drive);
            for (at, (q, x)) in self.at.iter_mut().zip(equation.base.iter().zip(x)) {
                *at = q + x * sample.share;
            }
            self.work.forces += 1;
            let scale = sample.weight * sample.share;
            let tangent = match equation.quotient {
                Some(_) => System::tangent_without_members,
                None => System::tangent,
            };
            if number == 0 {
                tangent(system, &self.at, &self.drive, matrix, &mut self.force);
                matrix.diagonal.iter_mut().for_each(|b| *b *= scale);
                matrix.below.iter_mut().for_each(|b| *b *= scale);
            } else {
                let part = self.part.get_or_insert_with(|| BodyMatrix::new(&model.pattern));
                tangent(system, &self.at, &self.drive, part, &mut self.force);
                let sum = |a: &mut [_], b: &[_]| {
                    for (a, b) in a.iter_mut().zip(b) {
                        *a += *b * scale;
                    }
                };
                sum(&mut matrix.diagonal, &part.diagonal);
                sum(&mut matrix.below, &part.below);
            }
            for (r, f) in self.residual.iter_mut().zip(&self.force) {
                *r += f * sample.weight;
            }
            if let Some(loss) = self.loss.as_mut().filter(|_| equation.quotient.is_none()) {
                let rate = |k: usize| equation.rates[k] + x[k] * equation.c;
                self.force.fill(Pose::zeros());
                system.add_loss(&self.at, rate, &mut self.force);
                self.residual.iter_mut().zip(&self.force).for_each(|(r, f)| *r += f * sample.weight);
                loss.at(system, &self.at, rate);
                loss.add_to([scale, sample.weight * equation.c], matrix);
            }
        }
        if let Some(h) = equation.quotient {
            let middle: f64 = equation.samples.iter().map(|sample| sample.weight * sample.time).sum();
            self.bodies.ramp.at(middle, &mut self.drive);
            for (k, (middle, q)) in self.at.iter_mut().zip(equation.base).enumerate() {
                *middle = q + x[k] * 0.5;
                self.force[k] = q + x[k];
            }
            system.add_quotients([equation.base, &self.at, &self.force], h, &self.drive, &mut self.residual, matrix);
        }
        forces::add_inertia(model, equation.m, equation.c, matrix);
        model.project_matrix(matrix);
        model.project(&mut self.residual);
    }
}

impl<S: LinearSolver> Equations for Newton<'_, S> {
    type Unknown = Pose;

    fn unknowns(&self) -> usize {
        self.bodies.unknowns()
    }

    fn end(&self) -> f64 {
        self.bodies.end()
    }

    fn share(&self, ends: [&Motion; 2], error: &Motion, h: f64, tol: f64) -> f64 {
        self.bodies.share(ends, error, h, tol)
    }

    fn worst(&self, error: &[Pose]) -> DegreeOfFreedom {
        self.bodies.worst(error)
    }

    fn named(&self, place: DegreeOfFreedom) -> (String, &'static str) {
        self.bodies.named(place)
    }

    fn work(&mut self) -> SolverCounters {
        std::mem::take(&mut self.work)
    }
}

impl<S: LinearSolver> Staged for Newton<'_, S> {
    fn accelerations(&mut self, t: f64, q: &[Pose], v: &[Pose], a: &mut [Pose]) -> StepResult {
        let system = self.bodies.system;
        let model = &system.model;
        self.bodies.ramp.at(t, &mut self.drive);
        system.residual(q, &self.drive, a);
        forces::add_damping(model, v, a);
        if self.loss.is_some() {
            system.add_loss(q, |k| v[k], a);
        }
        self.work.forces += 1;
        for (a, inverse) in a.iter_mut().zip(&self.inverse) {
            *a = -a.component_mul(inverse);
        }
        model.project(a);
        Ok(())
    }

    fn stage(&mut self, stage: &Stage<'_, Pose>, a: &mut [Pose], at: &mut Motion) -> StepResult {
        let model = &self.bodies.system.model;
        let (mut x, mut constant) = (std::mem::take(&mut self.x), std::mem::take(&mut self.constant));
        constant.fill(Pose::zeros());
        forces::add_damping(model, stage.v, &mut constant);
        for (x, (near, q)) in x.iter_mut().zip(stage.near.iter().zip(stage.q)) {
            *x = near - q;
        }
        let samples = [ForceEvaluation { weight: 1.0, share: 1.0, time: stage.t }];
        let (m, c) = (1.0 / stage.beta, stage.gamma / stage.beta);
        let (rates, base) = (stage.v, stage.q);
        let equation = Equation { m, c, rates, base, constant: &constant, samples: &samples, quotient: None };
        let found = self.root(&equation, &mut x);
        for (k, x) in x.iter().enumerate() {
            a[k] = x * m;
            (at.q[k], at.v[k]) = (stage.q[k] + x, stage.v[k] + x * c);
        }
        model.project(&mut at.v);
        (self.x, self.constant) = (x, constant);
        found
    }

    fn smooth(&mut self, (_, gamma): (f64, f64), _: &[Pose], error: &mut Motion) -> StepResult {
        // (M/γ² + C/γ + K)·e_q' = M·(e_q + γ·e_v)/γ² + C·e_q/γ
        let model = &self.bodies.system.model;
        let c = 1.0 / gamma;
        for (k, (q, v)) in error.q.iter().zip(&error.v).enumerate() {
            self.force[k] = model.mass(k).component_mul(&(v + q * c)) * c;
            self.at[k] = q * c;
        }
        forces::add_damping(model, &self.at, &mut self.force);
        if let Some(loss) = &self.loss {
            loss.add_damping(|k| self.at[k], &mut self.force);
        }
        model.project(&mut self.force);
        if let Some(matrix) = &self.matrix {
            self.solver.solve(&model.pattern, matrix, &mut self.force);
            self.work.solves += 1;
        }
        for ((q, v), smoothed) in error.q.iter_mut().zip(&mut error.v).zip(&self.force) {
            *v = (smoothed - *q) * c;
            *q = *smoothed;
        }
        Ok(())
    }

    fn follow(&self, h: f64, before: &[Pose], end: &mut Motion, accelerations: &mut [Motion]) {
        let model = &self.bodies.system.model;
        for (k, body) in model.bodies.iter().enumerate() {
            if body.mass > 0.0 && body.inertia > 0.0 {
                continue;
            }
            let mass = model.mass(k);
            for i in (0..DOF).filter(|&i| mass[i] == 0.0) {
                end.v[k][i] = (end.q[k][i] - before[k][i]) / h;
                for a in accelerations.iter_mut() {
                    (a.q[k][i], a.v[k][i]) = (0.0, 0.0);
                }
            }
        }
    }
}

/// Largest translation, or rotation times the length scale (m), with its body and direction; a NaN counts as infinite.
pub(crate) fn largest(system: &System, x: &[Pose]) -> (f64, DegreeOfFreedom) {
    let mut found = (0.0, (0, 0));
    for (j, p) in x.iter().enumerate() {
        for i in 0..DOF {
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
