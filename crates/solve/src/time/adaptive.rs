//! Drives any [`Method`] over any equations from their start to their end: with error control, in as few steps as the tolerance
//! allows, or in equal steps.
//!
//! The scale of an error is given by the equations ([`Equations::share`]). The next step is 0.9·err^(−1/p) times the
//! last, between 0.2 and 5 times, where the estimated error falls with the p-th power of the step (Hairer & Wanner
//! 1996, §IV.8).

use super::method::{Method, Motion, SolverCounters, StepFailure};
use super::pace::{self, StepController};
use super::rodas4::Rodas4;
pub use crate::equations::Control;
use crate::equations::{DegreeOfFreedom, Equations, Unknown};
use crate::{SolveError, WhyFailed};
use bimorph_multibody::planar::Pose;

/// Times nearer than this part of themselves are one (1).
const SAME_TIME: f64 = 1e-12;

/// How an advance ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Advance {
    /// At the end of the interval.
    Done,
    /// The allowed number of steps was used up at this time (s).
    OutOfSteps(f64),
    /// The observer stopped it.
    Stopped,
}

/// Receives each accepted step: start time, length, motion before and after; returns whether to continue.
pub type Observer<'a, X = Pose> = &'a mut dyn FnMut(f64, f64, &Motion<X>, &Motion<X>) -> bool;

/// A method with control of its steps, and the storage for it.
#[derive(Debug, Clone)]
pub struct Adaptive<M = Rodas4, X = Pose> {
    /// The method.
    pub method: M,
    /// Times at which steps of a tolerance end, ascending (s): forces have no smooth course through them.
    pub corners: Vec<f64>,
    steps: u64,
    rejected: u64,
    /// Counters of the equations.
    spent: SolverCounters,
    /// Counters of the method.
    done: SolverCounters,
    before: Motion<X>,
    error: Motion<X>,
    carried_before: Vec<Motion<X>>,
}

impl<M, X: Unknown> Adaptive<M, X> {
    /// Storage for a method over some number of unknowns.
    pub fn new(unknowns: usize, method: M) -> Self {
        Self {
            method,
            corners: Vec::new(),
            steps: 0,
            rejected: 0,
            spent: SolverCounters::default(),
            done: SolverCounters::default(),
            before: Motion::zeros(unknowns),
            error: Motion::zeros(unknowns),
            carried_before: Vec::new(),
        }
    }

    /// Work so far.
    pub fn work(&self) -> SolverCounters {
        self.spent.and(self.done).and(SolverCounters {
            steps: self.steps,
            rejected: self.rejected,
            ..SolverCounters::default()
        })
    }

    /// Advances `motion` from the start of the equations to their end, and with it what the method carries. `h` holds the first
    /// step to try (s) and receives the step that would come next.
    ///
    /// # Errors
    /// [`SolveError::StepTooSmall`], [`SolveError::StepFailed`].
    pub fn advance<E: Equations<Unknown = X>>(
        &mut self,
        equations: &mut E,
        motion: &mut Motion<X>,
        h: &mut f64,
        control: Control,
        max_steps: usize,
        observe: Observer<'_, X>,
    ) -> Result<Advance, SolveError>
    where
        M: Method<E>,
    {
        self.prepare::<E>();
        equations.begin(control);
        let begun = self.method.start(equations, motion).map_err(|e| failed(equations, 0.0, *h, e));
        let end = begun.and_then(|()| match control {
            Control::Tolerance(tol) => self.controlled(equations, motion, h, tol, max_steps, observe),
            Control::Fixed(step) => self.equal(equations, motion, step, max_steps, observe),
        });
        self.spent = self.spent.and(equations.work());
        self.done = self.method.work();
        end
    }

    /// Advances `motion` in steps that end at the given times (s), the last of them the end of the equations, with what the method carries.
    /// False: a step made more than `most` times the error that `tol` allows, or failed; then `motion` is where that step began.
    pub fn along<E: Equations<Unknown = X>>(
        &mut self,
        equations: &mut E,
        motion: &mut Motion<X>,
        ends: &[f64],
        (tol, most): (f64, f64),
    ) -> bool
    where
        M: Method<E>,
    {
        self.prepare::<E>();
        equations.begin(Control::Tolerance(tol));
        let mut holds = self.method.start(equations, motion).is_ok();
        let mut t = 0.0;
        for &end in ends {
            if !holds {
                break;
            }
            bimorph_base::budget::check();
            let h = end - t;
            self.keep(motion);
            holds = self.method.step(equations, t, h, motion, &mut self.error).is_ok()
                && equations.share([&self.before, motion], &self.error, h, tol) <= most
                && equations.close(end, &self.before.q, motion, tol) <= most;
            if holds {
                self.steps += 1;
                self.method.accepted(equations, (t, h), [&self.before, &*motion], &self.carried_before);
                t = end;
            } else {
                self.put_back(motion);
                self.rejected += 1;
            }
        }
        self.spent = self.spent.and(equations.work());
        self.done = self.method.work();
        holds
    }

    /// Makes room for what the method carries: it may be another one than before.
    fn prepare<E: Equations<Unknown = X>>(&mut self)
    where
        M: Method<E>,
    {
        let carried = self.method.carried();
        let alike = |(a, b): (&Motion<X>, &Motion<X>)| a.q.len() == b.q.len();
        if self.carried_before.len() != carried.len() || !self.carried_before.iter().zip(&*carried).all(alike) {
            self.carried_before = carried.to_vec();
        }
    }

    fn controlled<E: Equations<Unknown = X>>(
        &mut self,
        equations: &mut E,
        motion: &mut Motion<X>,
        h: &mut f64,
        tol: f64,
        max_steps: usize,
        observe: Observer<'_, X>,
    ) -> Result<Advance, SolveError>
    where
        M: Method<E>,
    {
        let mut pace = StepController::new((0.0, equations.end()), *h, self.method.error_order());
        let (mut steps, mut corner) = (0, 0);
        while !pace.is_over() {
            if steps == max_steps {
                return Ok(Advance::OutOfSteps(pace.t));
            }
            bimorph_base::budget::check();
            let t = pace.t;
            while self.corners.get(corner).is_some_and(|at| *at <= t * (1.0 + SAME_TIME)) {
                corner += 1;
            }
            let step = self.corners.get(corner).map_or(pace.step(), |at| pace.step().min(at - t));
            self.keep(motion);
            let stepped = self.method.step(equations, t, step, motion, &mut self.error);
            let mut error = match &stepped {
                Ok(()) => equations.share([&self.before, motion], &self.error, step, tol),
                Err(_) => f64::INFINITY,
            };
            if error <= 1.0 {
                error = error.max(equations.close(pace.after(step), &self.before.q, motion, tol));
            }
            if error <= 1.0 {
                pace.accept(step, error);
                (steps, *h) = (steps + 1, pace.h);
                self.steps += 1;
                let ends = [&self.before, &*motion];
                self.method.accepted(equations, (pace.t - step, step), ends, &self.carried_before);
                if !observe(pace.t - step, step, &self.before, motion) {
                    return Ok(Advance::Stopped);
                }
            } else {
                self.put_back(motion);
                self.rejected += 1;
                let goes_on = pace.reject(step, error, stepped.map_or_else(StepFailure::shorter, |()| 0.1));
                *h = pace.h;
                if !goes_on {
                    stepped.map_err(|e| failed(equations, t, step, e))?;
                    let (body, direction) = equations.named(equations.worst(&self.error.q));
                    let rejected = pace.rejected;
                    return Err(SolveError::StepTooSmall { t, dt: step, rejected, body, direction });
                }
            }
        }
        Ok(Advance::Done)
    }

    fn equal<E: Equations<Unknown = X>>(
        &mut self,
        equations: &mut E,
        motion: &mut Motion<X>,
        step: f64,
        max_steps: usize,
        observe: Observer<'_, X>,
    ) -> Result<Advance, SolveError>
    where
        M: Method<E>,
    {
        for (k, (t, end)) in pace::equal((0.0, equations.end()), step).enumerate() {
            if k == max_steps {
                return Ok(Advance::OutOfSteps(t));
            }
            bimorph_base::budget::check();
            let h = end - t;
            self.keep(motion);
            self.method.step(equations, t, h, motion, &mut self.error).map_err(|e| failed(equations, t, h, e))?;
            equations.close(end, &self.before.q, motion, 1.0);
            if let Some(place) = motion.not_finite() {
                return Err(solve_error(equations, (t, h), WhyFailed::NotFinite, place));
            }
            self.steps += 1;
            if !observe(t, h, &self.before, motion) {
                return Ok(Advance::Stopped);
            }
        }
        Ok(Advance::Done)
    }

    /// Keeps the start of a step.
    fn keep<E: Equations<Unknown = X>>(&mut self, motion: &Motion<X>)
    where
        M: Method<E>,
    {
        self.before.copy(motion);
        for (keep, now) in self.carried_before.iter_mut().zip(self.method.carried().iter()) {
            keep.copy(now);
        }
    }

    /// Goes back to it.
    fn put_back<E: Equations<Unknown = X>>(&mut self, motion: &mut Motion<X>)
    where
        M: Method<E>,
    {
        motion.copy(&self.before);
        for (keep, now) in self.carried_before.iter().zip(self.method.carried().iter_mut()) {
            now.copy(keep);
        }
    }
}

/// A step that failed, in words.
pub fn failed<E: Equations>(equations: &E, t: f64, dt: f64, failure: StepFailure) -> SolveError {
    let (why, place) = match failure {
        StepFailure::Singular(p) => (WhyFailed::Singular, (p.body, p.direction)),
        StepFailure::Diverged { iterations, body, direction } => {
            (WhyFailed::Diverged { iterations }, (body, direction))
        }
        StepFailure::NoInertia { body } => (WhyFailed::NoInertia, (body, 0)),
    };
    solve_error(equations, (t, dt), why, place)
}

fn solve_error<E: Equations>(equations: &E, (t, dt): (f64, f64), why: WhyFailed, place: DegreeOfFreedom) -> SolveError {
    let (body, direction) = equations.named(place);
    SolveError::StepFailed { t, dt, why, body, direction }
}
