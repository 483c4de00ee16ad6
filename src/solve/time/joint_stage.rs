//! The stages of implicit methods in joint coordinates.
//!
//! Every stage of the methods here asks for accelerations that the motion they lead to has:
//! ```text
//! a = A(t, q + β·a, q̇ + γ·a),      A: accelerations by the recursion, loops reduced on the way
//! ```
//! Newton's method solves it with the recursion itself: each iteration places the bodies, takes the forces and their
//! stiffness there, and reduces with M + γ·C + β·K in the place of M ([`crate::multibody::rcr::AddedInertia`]). No matrix
//! is assembled, and an iteration costs O(n + m). How inertia and reactions change with the configuration is left out of
//! that matrix, not out of the equation: the iteration is linear, accelerated by what the last ones tell
//! (`anderson.rs`). θ is the ratio of the last two corrections, and it ends when what is left, δ·θ/(1 − θ), is below
//! the tolerance.

use super::anderson::Anderson;
use super::joint_motion::NotFinite;
use super::method::Work;
use crate::multibody::rcr::{AddedInertia, Linkage, Reduction, Singularity, Task};
use thiserror::Error;

/// Most iterations of a stage.
const MAX_ITERATIONS: usize = 60;
/// Iterations before a stage is judged.
const PATIENCE: i32 = 6;
/// Mean contraction beyond which a shorter step is better than more iterations.
const SLOW: f64 = 0.7;
/// Corrections below this share of the coordinates that no longer shrink are rounding.
const STALLED: f64 = 1e-10;

/// What acts on a mechanism in joint coordinates.
pub trait Loads {
    /// Sets what time alone prescribes, such as the offsets of heated joints that are locked, at `t` [s]. Before placing.
    fn prescribe(&mut self, t: f64, reduction: &mut Reduction<f64>) {
        let _ = (t, reduction);
    }

    /// Adds what acts at time `t` [s] to the force and torque of `reduction`, whose bodies are placed at `q` and `v`.
    fn add(&mut self, t: f64, q: &[f64], v: &[f64], reduction: &mut Reduction<f64>);

    /// Adds β·K + γ·C of what acts where [`Loads::add`] was last called; `factors` are β [s²] and γ [s]. What is left out
    /// costs iterations, not accuracy.
    fn stiffen(&mut self, reduction: &Reduction<f64>, factors: (f64, f64), added: &mut AddedInertia) {
        let _ = (reduction, factors, added);
    }
}

/// Why a stage has no accelerations; a shorter step may have them.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum StageError {
    /// Not finite.
    #[error(transparent)]
    NotFinite(#[from] NotFinite),
    /// Newton's iteration did not settle.
    #[error("Newton's iteration at {t:.6e} s did not settle in {iterations} iterations; worst body \"{body}\"")]
    Diverged {
        /// Time of the stage [s].
        t: f64,
        /// Iterations made.
        iterations: usize,
        /// Body whose coordinate has the largest correction.
        body: String,
    },
}

/// One stage: a = A(t, q + β·a, v + γ·a).
#[derive(Debug, Clone, Copy)]
pub struct Stage<'a> {
    /// Time [s].
    pub t: f64,
    /// Coordinates without the stage's own acceleration.
    pub q: &'a [f64],
    /// Their rates.
    pub v: &'a [f64],
    /// β [s²].
    pub beta: f64,
    /// γ [s].
    pub gamma: f64,
}

/// A mechanism with its forces, ready for implicit stages. Nothing is allocated after [`ImplicitMotion::new`].
#[derive(Debug, Clone)]
pub struct ImplicitMotion<'a, L> {
    linkage: &'a Linkage,
    /// The recursion with its storage.
    pub reduction: Reduction<f64>,
    loads: L,
    added: AddedInertia,
    anderson: Anderson,
    scale: Vec<f64>,
    bodies: Vec<[f64; 3]>,
    next: Vec<f64>,
    zeros: Vec<f64>,
    /// Coordinates of the last stage.
    pub q: Vec<f64>,
    /// Rates of the last stage.
    pub v: Vec<f64>,
    /// Gives a slow iteration up early, because a shorter step can be had.
    pub hurried: bool,
    /// Work done: a reduction with added inertia counts as a factorization and a solve.
    pub work: Work,
    /// Reductions that took the path for singular configurations.
    pub singular: u64,
    /// Largest gap of a loop after a projection [m].
    pub gap: f64,
}

impl<'a, L: Loads> ImplicitMotion<'a, L> {
    /// Storage for `linkage`; `scale` is the size of each coordinate [m or rad].
    pub fn new(linkage: &'a Linkage, loads: L, scale: &[f64]) -> Self {
        let zeros = vec![0.0; linkage.coordinates];
        Self {
            linkage,
            reduction: Reduction::implicit(linkage),
            loads,
            added: AddedInertia::new(linkage),
            anderson: Anderson::new(linkage.coordinates),
            scale: scale.to_vec(),
            bodies: vec![[0.0; 3]; linkage.links.len()],
            next: zeros.clone(),
            q: zeros.clone(),
            v: zeros.clone(),
            zeros,
            hurried: true,
            work: Work::default(),
            singular: 0,
            gap: 0.0,
        }
    }

    /// Root mean square of the coordinates against their sizes.
    pub fn norm(&self, x: &[f64]) -> f64 {
        let sum: f64 = x.iter().zip(&self.scale).map(|(x, s)| (x / s) * (x / s)).sum();
        (sum / x.len().max(1) as f64).sqrt()
    }

    /// Accelerations `a` at time `t` [s] and the motion (`q`, `v`).
    ///
    /// # Errors
    /// [`StageError::NotFinite`].
    pub fn accelerations(&mut self, t: f64, q: &[f64], v: &[f64], a: &mut [f64]) -> Result<(), StageError> {
        self.q.copy_from_slice(q);
        self.v.copy_from_slice(v);
        self.act(t);
        let met = self.reduction.solve(Task::Accelerations, a);
        self.count(met);
        self.finite(a, t)
    }

    /// Solves a stage, from the guess in `a`, until its coordinates are right to `tolerance` in the norm of
    /// [`ImplicitMotion::norm`]. They and their rates stay in `q` and `v`.
    ///
    /// # Errors
    /// See [`StageError`].
    pub fn stage(&mut self, stage: &Stage<'_>, tolerance: f64, a: &mut [f64]) -> Result<(), StageError> {
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
            match self.finite(&self.next, stage.t) {
                // it was finite where it began: the iteration has left the neighbourhood of the step
                Err(_) if iteration > 1 => return Err(self.diverged(stage.t, iteration as usize)),
                found => found?,
            }
            self.anderson.next(a, &self.next, &self.scale);
            let correction = stage.beta * self.norm(self.anderson.change());
            let shrink = correction / last;
            // the first correction tells nothing about the second
            let left = if iteration > 1 { correction * shrink / (1.0 - shrink).max(1e-3) } else { correction };
            let stalled = iteration > 1 && correction <= STALLED * self.norm(&self.q).max(tolerance) && shrink > 0.1;
            if left <= tolerance || stalled {
                self.take(stage, a);
                return Ok(());
            }
            first = if iteration == 1 { correction } else { first };
            let slow = self.hurried && iteration > PATIENCE && correction > first * SLOW.powi(iteration);
            if !correction.is_finite() || slow || iteration as usize == MAX_ITERATIONS {
                return Err(self.diverged(stage.t, iteration as usize));
            }
            last = correction;
        }
        Ok(())
    }

    /// Takes an estimated error of the end of a step through (1 − γ·J)⁻¹, J the Jacobian of the first-order equations with
    /// γ and stiffness of the last stage, at the coordinates `q`: motions much faster than the step then count for little.
    ///
    /// # Errors
    /// [`StageError::NotFinite`].
    pub fn smooth(
        &mut self,
        (t, gamma): (f64, f64),
        q: &[f64],
        error_q: &mut [f64],
        error_v: &mut [f64],
    ) -> Result<(), StageError> {
        // M + γC + β·K on the smoothed coordinates is M on γ·e_v + e_q; at rest nothing else acts
        for ((v, e), w) in self.v.iter_mut().zip(error_q.iter()).zip(error_v.iter()) {
            *v = e + gamma * w;
        }
        self.reduction.place(q, &self.zeros);
        self.reduction.accelerations_of(self.linkage, &self.v, &mut self.bodies);
        for ((force, body), link) in self.reduction.force.iter_mut().zip(&self.bodies).zip(&self.linkage.links) {
            *force = [link.mass * body[0], link.mass * body[1], link.inertia * body[2]];
        }
        self.reduction.torque.fill(0.0);
        let Self { linkage, reduction, added, bodies, next, zeros, .. } = self;
        let met = reduction.solve_implicit(linkage, added, zeros, bodies, next);
        self.count(met);
        self.finite(&self.next, t)?;
        for ((e, w), x) in error_q.iter_mut().zip(error_v).zip(&self.next) {
            *w = (x - *e) / gamma;
            *e = *x;
        }
        Ok(())
    }

    /// Takes a motion back to the loops as they are at time `t` [s].
    pub fn project(&mut self, t: f64, q: &mut [f64], v: &mut [f64]) {
        self.loads.prescribe(t, &mut self.reduction);
        let gap = self.reduction.project_positions(q, v, &mut self.next);
        self.gap = self.gap.max(gap);
        self.reduction.project_rates(q, v, &mut self.next);
    }

    fn take(&mut self, stage: &Stage<'_>, a: &[f64]) {
        for (k, a) in a.iter().enumerate() {
            self.q[k] = stage.q[k] + stage.beta * a;
            self.v[k] = stage.v[k] + stage.gamma * a;
        }
    }

    /// Places the bodies and lays what acts on them.
    fn act(&mut self, t: f64) {
        self.loads.prescribe(t, &mut self.reduction);
        self.reduction.place(&self.q, &self.v);
        self.reduction.force.fill([0.0; 3]);
        self.reduction.torque.fill(0.0);
        self.loads.add(t, &self.q, &self.v, &mut self.reduction);
        self.work.forces += 1;
    }

    /// Counts one reduction and what it met.
    fn count(&mut self, met: Option<Singularity>) {
        self.singular += u64::from(met.is_some());
        self.work.factorizations += 1;
        self.work.solves += 1;
    }

    fn finite(&self, a: &[f64], t: f64) -> Result<(), StageError> {
        if a.iter().all(|x| x.is_finite()) {
            return Ok(());
        }
        let accelerations = &self.reduction.accelerations;
        let body = accelerations.iter().rposition(|a| !a.iter().all(|x| x.is_finite())).unwrap_or(0);
        Err(NotFinite { body: self.linkage.names[body].clone(), t }.into())
    }

    fn diverged(&self, t: f64, iterations: usize) -> StageError {
        StageError::Diverged { t, iterations, body: self.worst(self.anderson.change()) }
    }

    /// Name of the body whose joint has the largest of the coordinates `x` against its size.
    pub fn worst(&self, x: &[f64]) -> String {
        let size = |k: usize| (x[k] / self.scale[k]).abs();
        let worst = (0..x.len()).fold(0, |best, k| if size(k) > size(best) { k } else { best });
        self.linkage.names.get(self.linkage.body_of(worst)).cloned().unwrap_or_default()
    }
}
