//! Drives any [`Method`] from one time to another: with error control, in as few steps as the tolerance allows, or in equal
//! steps.
//!
//! The error of a step is measured in the mass norm, ‖e‖² = eᵀMe, which has one unit for translations and rotations:
//! √(‖e_q‖² + h²‖e_v‖²) must stay below tol·(‖q‖ + floor), with ‖q‖ the larger of both ends and a floor of 1e-4 of the
//! model's length scale. Where parts touch, the time of a bounce is nothing beside that of the motion, and a displacement
//! beside its reach: there the error of the energy, |vᵀMe_v| + |work of the contact forces over e_q|, must also stay below
//! tol·(kinetic energy + energy in the contacts). The next step is 0.9·err^(−1/p) times the last, between 0.2 and 5 times, where the estimated
//! error falls with the p-th power of the step (Hairer & Wanner 1996, §IV.8).

use super::method::{Method, Motion, StepFailure, Work};
use super::pace::{self, Pace};
use super::rodas4::Rodas4;
use crate::domains::{Ramp, System};
use crate::multibody::planar::Pose;
use crate::multibody::{BodyId, Model};
use crate::solve::frequency::eigen::mass_product;
use crate::solve::{SolveError, WhyFailed};
use nalgebra::Matrix6;

/// Share of the length scale below which a displacement's relative error does not count.
pub(super) const FLOOR: f64 = 1e-4;

/// What sets the length of steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Control {
    /// Relative error that a step may make [1].
    Tolerance(f64),
    /// Equal steps, as many as are needed for none to be longer than this [s].
    Fixed(f64),
}

/// How an advance ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Advance {
    /// At the end of the interval.
    Done,
    /// The allowed number of steps was used up at this time [s].
    OutOfSteps(f64),
    /// The observer said stop.
    Stopped,
}

/// Sees each accepted step: start time, length, motion before and after; answers whether to go on.
pub type Observer<'a> = &'a mut dyn FnMut(f64, f64, &Motion, &Motion) -> bool;

/// A method with control of its steps, and the storage for it.
#[derive(Debug, Clone)]
pub struct Adaptive<M = Rodas4> {
    /// The method.
    pub method: M,
    steps: u64,
    rejected: u64,
    before: Motion,
    error: Motion,
    carried_before: Vec<Motion>,
    mass: f64,
    /// Directions that have drag and no mass: body, direction and drag [N·s/m, N·m·s].
    dragged: Vec<(usize, usize, f64)>,
}

impl<M: Method> Adaptive<M> {
    /// Storage for a method on a system.
    pub fn new(system: &System, mut method: M) -> Self {
        let n = system.bodies();
        Self {
            carried_before: method.carried().to_vec(),
            method,
            steps: 0,
            rejected: 0,
            before: Motion::zeros(n),
            error: Motion::zeros(n),
            mass: system.model.bodies.iter().map(|b| b.mass).sum(),
            dragged: dragged(&system.model),
        }
    }

    /// Work so far.
    pub fn work(&self) -> Work {
        Work { steps: self.steps, rejected: self.rejected, ..self.method.work() }
    }

    /// Advances `motion` from the start of the ramp to its end, and with it what the method carries. `h` holds the first
    /// step to try [s] and receives the step that would come next.
    ///
    /// # Errors
    /// [`SolveError::StepTooSmall`], [`SolveError::StepFailed`].
    #[allow(clippy::too_many_arguments)]
    pub fn advance(
        &mut self,
        system: &System,
        ramp: &Ramp<'_>,
        motion: &mut Motion,
        h: &mut f64,
        control: Control,
        max_steps: usize,
        observe: Observer<'_>,
    ) -> Result<Advance, SolveError> {
        self.method.start(system, ramp, motion).map_err(|e| failed(system, 0.0, *h, e))?;
        match control {
            Control::Tolerance(tol) => self.controlled(system, ramp, motion, h, tol, max_steps, observe),
            Control::Fixed(step) => self.equal(system, ramp, motion, step, max_steps, observe),
        }
    }

    #[allow(clippy::too_many_arguments)]
    fn controlled(
        &mut self,
        system: &System,
        ramp: &Ramp<'_>,
        motion: &mut Motion,
        h: &mut f64,
        tol: f64,
        max_steps: usize,
        observe: Observer<'_>,
    ) -> Result<Advance, SolveError> {
        let mut pace = Pace::new((0.0, ramp.dt), *h, self.method.error_order());
        let mut steps = 0;
        while !pace.is_over() {
            if steps == max_steps {
                return Ok(Advance::OutOfSteps(pace.t));
            }
            crate::budget::check();
            let (s, step) = (pace.t, pace.step());
            self.keep(motion);
            let stepped = self.method.step(system, ramp, s, step, motion, &mut self.error);
            let error = if stepped.is_ok() { self.relative_error(system, motion, step, tol) } else { f64::INFINITY };
            if error <= 1.0 {
                pace.accept(step, error);
                (steps, *h) = (steps + 1, pace.h);
                self.steps += 1;
                if !observe(pace.t - step, step, &self.before, motion) {
                    return Ok(Advance::Stopped);
                }
            } else {
                self.put_back(motion);
                self.rejected += 1;
                let goes_on = pace.reject(step, error, 0.1);
                *h = pace.h;
                if !goes_on {
                    stepped.map_err(|e| failed(system, s, step, e))?;
                    return Err(self.too_small(system, s, step, pace.rejected));
                }
            }
        }
        Ok(Advance::Done)
    }

    fn equal(
        &mut self,
        system: &System,
        ramp: &Ramp<'_>,
        motion: &mut Motion,
        step: f64,
        max_steps: usize,
        observe: Observer<'_>,
    ) -> Result<Advance, SolveError> {
        for (k, (s, end)) in pace::equal((0.0, ramp.dt), step).enumerate() {
            if k == max_steps {
                return Ok(Advance::OutOfSteps(s));
            }
            crate::budget::check();
            let h = end - s;
            self.keep(motion);
            self.method.step(system, ramp, s, h, motion, &mut self.error).map_err(|e| failed(system, s, h, e))?;
            if let Some((body, direction)) = not_finite(motion) {
                return Err(SolveError::step_failed(system, s, h, WhyFailed::NotFinite, body, direction));
            }
            self.steps += 1;
            if !observe(s, h, &self.before, motion) {
                return Ok(Advance::Stopped);
            }
        }
        Ok(Advance::Done)
    }

    /// Keeps the start of a step.
    fn keep(&mut self, motion: &Motion) {
        self.before.copy(motion);
        for (keep, now) in self.carried_before.iter_mut().zip(self.method.carried().iter()) {
            keep.copy(now);
        }
    }

    /// Goes back to it.
    fn put_back(&mut self, motion: &mut Motion) {
        motion.copy(&self.before);
        for (keep, now) in self.carried_before.iter().zip(self.method.carried().iter_mut()) {
            now.copy(keep);
        }
    }

    fn relative_error(&self, system: &System, after: &Motion, h: f64, tol: f64) -> f64 {
        if self.mass == 0.0 && self.dragged.is_empty() {
            return 0.0; // nothing moves in time with neither mass nor drag
        }
        // what drag holds back and no mass weighs as much as a mass that it would stop in this step
        let drag = |x: &[Pose]| h * self.dragged.iter().map(|(j, i, c)| c * x[*j][*i] * x[*j][*i]).sum::<f64>();
        let norm = |x: &[Pose]| match self.dragged.is_empty() {
            true => mass_norm(system, x),
            false => mass_norm(system, x).hypot(drag(x).sqrt()),
        };
        let mass = self.mass + h * self.dragged.iter().map(|(_, _, c)| c).sum::<f64>();
        let (eq, ev) = (norm(&self.error.q), norm(&self.error.v));
        let reach = norm(&self.before.q).max(norm(&after.q)) + FLOOR * system.length_scale * mass.sqrt();
        let error = (eq * eq + h * h * ev * ev).sqrt() / (tol * reach);
        // a sum: the larger of the two would hide what is not a number
        let error = error.hypot(contact_error(system, (&self.before, after), &self.error, tol));
        if error.is_nan() { f64::INFINITY } else { error }
    }

    fn too_small(&self, system: &System, t: f64, dt: f64, rejected: usize) -> SolveError {
        let (mut body, mut direction, mut worst) = (0, 0, -1.0);
        for (j, e) in self.error.q.iter().enumerate() {
            let m = system.model.mass(j);
            for i in 0..3 {
                let share = m[i] * e[i] * e[i];
                if share > worst || share.is_nan() {
                    (body, direction, worst) = (j, i, share);
                }
            }
        }
        let body = system.model.bodies[body].name.to_string();
        SolveError::StepTooSmall { t, dt, rejected, body, direction: crate::solve::DIRECTIONS[direction] }
    }
}

/// Error of the energy over a step that begins or ends in contact; 0 elsewhere.
pub(super) fn contact_error(system: &System, (before, after): (&Motion, &Motion), error: &Motion, tol: f64) -> f64 {
    let stored = system.contact_energy(&before.q).max(system.contact_energy(&after.q));
    if stored == 0.0 {
        return 0.0;
    }
    let model = &system.model;
    let kinetic = 0.5 * mass_product(model, &after.v, &after.v).max(mass_product(model, &before.v, &before.v));
    let work = system.contact_work(&after.q, &error.q);
    (mass_product(model, &after.v, &error.v).abs() + work) / (tol * (kinetic + stored))
}

fn failed(system: &System, t: f64, dt: f64, failure: StepFailure) -> SolveError {
    match failure {
        StepFailure::Singular(p) => SolveError::step_failed(system, t, dt, WhyFailed::Singular, p.body, p.direction),
        StepFailure::Diverged { iterations, body, direction } => {
            SolveError::step_failed(system, t, dt, WhyFailed::Diverged { iterations }, body, direction)
        }
    }
}

/// The first body and direction whose motion is not finite.
fn not_finite(motion: &Motion) -> Option<(usize, usize)> {
    let wrong = |p: &Pose| p.iter().position(|x| !x.is_finite());
    let mut pairs = motion.q.iter().zip(&motion.v).enumerate();
    pairs.find_map(|(j, (q, v))| wrong(q).or_else(|| wrong(v)).map(|i| (j, i)))
}

/// Directions of bodies without mass that drag holds back, with the drag [N·s/m, N·m·s].
pub(super) fn dragged(model: &Model) -> Vec<(usize, usize, f64)> {
    if model.bodies.iter().all(|body| body.mass > 0.0) {
        return Vec::new();
    }
    let mut found = Vec::new();
    for (j, body) in model.bodies.iter().enumerate().filter(|(_, body)| body.mass == 0.0) {
        crate::budget::check();
        let own = body.drag.matrix();
        for i in (0..3).filter(|i| *i < 2 || body.inertia == 0.0) {
            let at =
                |id: BodyId, i: usize, matrix: &Matrix6<f64>| if id == BodyId::Free(j) { matrix[(i, i)] } else { 0.0 };
            let dampers = model.dampers.iter().zip(&model.damper_matrix);
            let drag = own[(i, i)] + dampers.map(|(d, m)| at(d.a, i, m) + at(d.b, i + 3, m)).sum::<f64>();
            if drag > 0.0 {
                found.push((j, i, drag));
            }
        }
    }
    found
}

/// √(xᵀMx).
fn mass_norm(system: &System, x: &[Pose]) -> f64 {
    mass_product(&system.model, x, x).sqrt()
}
