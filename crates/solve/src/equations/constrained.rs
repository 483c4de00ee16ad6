//! Joint coordinates whose loops are constraints, reduced inside the recursion ([`bimorph_multibody::joint_coordinates::constrained_loops`]).
//!
//! Accelerations are one reduction. A stage of an implicit method solves for the accelerations of the motion that they
//! lead to,
//! ```text
//! a = A(t, q + β·a, q̇ + γ·a),      A: accelerations by the recursion, loops reduced on the way
//! ```
//! Newton's method solves it with the recursion itself: each iteration places the bodies, takes the forces and their
//! stiffness there, and reduces with M + γ·C + β·K in the place of M
//! ([`bimorph_multibody::joint_coordinates::constrained_loops::AddedInertia`]). No matrix is assembled, and an iteration
//! costs O(n + m). That matrix, unlike the equation, neglects the dependence of inertia and reactions on the
//! configuration: the iteration is linear, with Anderson acceleration (`anderson.rs`). With θ the ratio of the last two
//! corrections, it ends when the remainder, δ·θ/(1 − θ), is below the tolerance.
//!
//! **How large an error is.** With ‖e‖ the root mean square over the coordinates against their sizes, √(‖e_q‖² + h²‖e_v‖²) must stay below
//! tol·(‖q‖ + 1e-4). Each step is taken to the loops at its end; where heat moves them, how far that is counts too, since the stages do
//! not see them move.

use super::anderson::Anderson;
use super::bodies::{FLOOR, error_scale};
use super::loads::Loads;
use super::{Control, DegreeOfFreedom, Equations, Motion, SolverCounters, Stage, Staged, StepFailure, StepResult};
use bimorph_base::ErrorBudget;
use bimorph_multibody::joint_coordinates::constrained_loops::{
    AddedInertia, Linkage, Reduction, ReductionTask, Singularity,
};

/// Most iterations of a stage.
const MAX_ITERATIONS: usize = 60;
/// Iterations before a stage is judged.
const PATIENCE: i32 = 6;
/// Mean contraction beyond which a shorter step is better than more iterations.
const SLOW: f64 = 0.7;
/// Corrections below this fraction of the coordinates that no longer shrink are rounding.
const STALLED: f64 = 1e-10;
/// Error of a stage against the motion in equal steps.
const EQUAL: f64 = 1e-10;
/// Fraction of the projection of moving loops at the end of a step that counts as error. Each step is late by the
/// projection, but these errors do not accumulate.
const MOVED_SHARE: f64 = 1e-2;

/// A mechanism with its forces. Nothing is allocated after [`Constrained::new`].
#[derive(Debug, Clone)]
pub struct Constrained<'a, L> {
    linkage: &'a Linkage,
    /// The recursion with its storage; after an evaluation it holds poses, rates and accelerations.
    pub reduction: Reduction<f64>,
    loads: L,
    end: f64,
    added: AddedInertia,
    anderson: Anderson,
    scale: Vec<f64>,
    bodies: Vec<[f64; 3]>,
    next: Vec<f64>,
    at: Motion<f64>,
    zeros: Vec<f64>,
    /// Gives a slow iteration up early, because a shorter step can be had.
    hurried: bool,
    /// Relative error that a stage may have (1).
    exact: f64,
    work: SolverCounters,
    /// Reductions that took the path for singular configurations.
    pub singular: u64,
    /// Largest gap of a loop after a projection (m).
    pub gap: f64,
}

impl<'a, L: Loads> Constrained<'a, L> {
    /// Storage for `linkage`, to time `end` (s); `scale` is the size of each coordinate (m or rad).
    pub fn new(linkage: &'a Linkage, loads: L, scale: &[f64], end: f64) -> Self {
        let zeros = vec![0.0; linkage.coordinates];
        Self {
            linkage,
            reduction: Reduction::implicit(linkage),
            loads,
            end,
            added: AddedInertia::new(linkage),
            anderson: Anderson::new(linkage.coordinates),
            scale: scale.to_vec(),
            bodies: vec![[0.0; 3]; linkage.links.len()],
            next: zeros.clone(),
            at: Motion::zeros(linkage.coordinates),
            zeros,
            hurried: true,
            exact: EQUAL,
            work: SolverCounters::default(),
            singular: 0,
            gap: 0.0,
        }
    }

    /// Root mean square of the coordinates against their sizes.
    fn norm(&self, x: &[f64]) -> f64 {
        let sum: f64 = x.iter().zip(&self.scale).map(|(x, s)| (x / s) * (x / s)).sum();
        (sum / x.len().max(1) as f64).sqrt()
    }

    /// Takes a motion to the loops as they are at time `t` (s).
    pub fn project(&mut self, t: f64, motion: &mut Motion<f64>) {
        self.loads.prescribe(t, &mut self.reduction);
        let gap = self.reduction.project_positions(&mut motion.q, &motion.v, &mut self.next);
        self.gap = self.gap.max(gap);
        self.reduction.project_rates(&motion.q, &mut motion.v, &mut self.next);
    }

    /// A step in which the first accelerations and rates move the coordinates by no more than an error of `tol` (s).
    ///
    /// # Errors
    /// [`StepFailure::NoInertia`].
    pub fn first_step(&mut self, now: &Motion<f64>, tol: f64) -> Result<f64, StepFailure> {
        let mut a = self.zeros.clone();
        self.accelerations(0.0, &now.q, &now.v, &mut a)?;
        let reach = ErrorBudget::of(tol).within(self.norm(&now.q) + FLOOR);
        let (a, v) = (self.norm(&a), self.norm(&now.v));
        let by_force = (2.0 * reach / a).sqrt();
        // rates are exact to first order: it is their change that counts, within ten times the error
        let by_rate = if v > 0.0 { 10.0 * reach / v } else { f64::INFINITY };
        let h = self.end;
        Ok(h.min(by_force.max(1e-9 * h)).min(by_rate.max(1e-9 * h)))
    }

    fn take(&mut self, stage: &Stage<'_, f64>, a: &[f64]) {
        for (k, a) in a.iter().enumerate() {
            self.at.q[k] = stage.q[k] + stage.beta * a;
            self.at.v[k] = stage.v[k] + stage.gamma * a;
        }
    }

    /// Places the bodies and evaluates their loads.
    fn act(&mut self, t: f64) {
        let Motion { q, v } = &self.at;
        self.loads.prescribe(t, &mut self.reduction);
        self.reduction.place(q, v);
        self.reduction.force.fill([0.0; 3]);
        self.reduction.torque.fill(0.0);
        self.loads.add(t, q, v, &mut self.reduction);
        self.work.forces += 1;
    }

    /// Counts a reduction with added inertia and what it met.
    fn count(&mut self, met: Option<Singularity>) {
        self.singular += u64::from(met.is_some());
        self.work.factorizations += 1;
        self.work.solves += 1;
    }

    fn finite(&self, a: &[f64]) -> StepResult {
        if a.iter().all(|x| x.is_finite()) {
            return Ok(());
        }
        let accelerations = &self.reduction.accelerations;
        let body = accelerations.iter().rposition(|a| !a.iter().all(|x| x.is_finite())).unwrap_or(0);
        Err(StepFailure::NoInertia { body })
    }

    fn diverged(&self, iterations: usize) -> StepFailure {
        let (body, direction) = self.worst(self.anderson.change());
        StepFailure::Diverged { iterations, body, direction }
    }
}

impl<L: Loads> Equations for Constrained<'_, L> {
    type Unknown = f64;

    fn unknowns(&self) -> usize {
        self.linkage.coordinates
    }

    fn end(&self) -> f64 {
        self.end
    }

    fn begin(&mut self, control: Control) {
        (self.hurried, self.exact) = match control {
            Control::Tolerance(tol) => (true, ErrorBudget::of(tol).stage()),
            Control::Fixed(_) => (false, EQUAL),
        };
    }

    fn share(&self, [before, after]: [&Motion<f64>; 2], error: &Motion<f64>, h: f64, tol: f64) -> f64 {
        let (eq, ev) = (self.norm(&error.q), self.norm(&error.v));
        let scale = error_scale([self.norm(&before.q), self.norm(&after.q)], [1.0, 1.0]);
        let share = ErrorBudget::of(tol).used(eq.hypot(h * ev), scale);
        if share.is_nan() { f64::INFINITY } else { share }
    }

    fn close(&mut self, t: f64, before: &[f64], end: &mut Motion<f64>, tol: f64) -> f64 {
        self.at.q.copy_from_slice(&end.q);
        self.project(t, end);
        self.at.q.iter_mut().zip(&end.q).for_each(|(from, to)| *from -= to);
        ErrorBudget::of(tol).used(MOVED_SHARE * self.norm(&self.at.q), self.norm(before) + FLOOR)
    }

    /// The body whose joint has the largest of the coordinates against its size.
    fn worst(&self, error: &[f64]) -> DegreeOfFreedom {
        let size = |k: usize| (error[k] / self.scale[k]).abs();
        let worst = (0..error.len()).fold(0, |best, k| if size(k) > size(best) { k } else { best });
        (if error.is_empty() { 0 } else { self.linkage.body_of(worst) }, 0)
    }

    fn named(&self, (body, _): DegreeOfFreedom) -> (String, &'static str) {
        (self.linkage.names.get(body).cloned().unwrap_or_default(), "in its joint")
    }

    fn work(&mut self) -> SolverCounters {
        std::mem::take(&mut self.work)
    }
}

impl<L: Loads> Staged for Constrained<'_, L> {
    fn accelerations(&mut self, t: f64, q: &[f64], v: &[f64], a: &mut [f64]) -> StepResult {
        self.at.q.copy_from_slice(q);
        self.at.v.copy_from_slice(v);
        self.act(t);
        let met = self.reduction.solve(ReductionTask::Accelerations, a);
        self.singular += u64::from(met.is_some());
        self.finite(a)
    }

    /// Until its coordinates are right to a fraction of what the step may be wrong.
    fn stage(&mut self, stage: &Stage<'_, f64>, a: &mut [f64], at: &mut Motion<f64>) -> StepResult {
        let tolerance = ErrorBudget::of(self.exact).within(self.norm(stage.near) + FLOOR);
        let (mut first, mut last) = (0.0, f64::INFINITY);
        self.anderson.restart();
        for iteration in 1..=MAX_ITERATIONS as i32 {
            self.take(stage, a);
            self.act(stage.t);
            self.added.clear();
            self.loads.stiffen(&self.reduction, (stage.beta, stage.gamma), &mut self.added);
            let Self { linkage, reduction, added, bodies, next, .. } = self;
            let met = reduction.solve_implicit(linkage, added, a, bodies, next);
            self.count(met);
            self.work.iterations += 1;
            match self.finite(&self.next) {
                // it was finite where it began: the iteration has left the neighbourhood of the step
                Err(_) if iteration > 1 => return Err(self.diverged(iteration as usize)),
                found => found?,
            }
            self.anderson.next(a, &self.next, &self.scale);
            let correction = stage.beta * self.norm(self.anderson.change());
            let shrink = correction / last;
            // the first correction does not predict the second
            let left = if iteration > 1 { correction * shrink / (1.0 - shrink).max(1e-3) } else { correction };
            let stalled = iteration > 1 && correction <= STALLED * self.norm(&self.at.q).max(tolerance) && shrink > 0.1;
            if left <= tolerance || stalled {
                self.take(stage, a);
                at.copy(&self.at);
                return Ok(());
            }
            first = if iteration == 1 { correction } else { first };
            let slow = self.hurried && iteration > PATIENCE && correction > first * SLOW.powi(iteration);
            if !correction.is_finite() || slow || iteration as usize == MAX_ITERATIONS {
                return Err(self.diverged(iteration as usize));
            }
            last = correction;
        }
        Ok(())
    }

    fn smooth(&mut self, (_, gamma): (f64, f64), q: &[f64], error: &mut Motion<f64>) -> StepResult {
        // M + γC + β·K on the smoothed coordinates is M on γ·e_v + e_q; at rest nothing else acts
        let Motion { q: error_q, v: error_v } = error;
        for ((v, e), w) in self.at.v.iter_mut().zip(error_q.iter()).zip(error_v.iter()) {
            *v = e + gamma * w;
        }
        self.reduction.place(q, &self.zeros);
        self.reduction.accelerations_of(self.linkage, &self.at.v, &mut self.bodies);
        for ((force, body), link) in self.reduction.force.iter_mut().zip(&self.bodies).zip(&self.linkage.links) {
            *force = [link.mass * body[0], link.mass * body[1], link.inertia * body[2]];
        }
        self.reduction.torque.fill(0.0);
        let Self { linkage, reduction, added, bodies, next, zeros, .. } = self;
        let met = reduction.solve_implicit(linkage, added, zeros, bodies, next);
        self.count(met);
        self.finite(&self.next)?;
        for ((e, w), x) in error_q.iter_mut().zip(error_v).zip(&self.next) {
            *w = (x - *e) / gamma;
            *e = *x;
        }
        Ok(())
    }
}
