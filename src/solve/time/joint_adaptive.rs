//! Drives an implicit method in joint coordinates from one time to another: with error control, or in equal steps.
//!
//! The error of a step is √(‖e_q‖² + h²‖e_v‖²), root mean squares over the coordinates against their sizes, and must stay
//! below tol·(‖q‖ + floor); the next step is 0.9·err^(−1/p) times the last, between 0.2 and 5 times (Hairer & Wanner 1996,
//! §IV.8). A method without an estimate takes each step whole and in two halves, keeps the halves, and takes a third of the
//! difference for the error (Hairer et al. 1993, eq. II.4.4). Each step is taken to the loops at its
//! end; where heat moves them, how far that is counts too, since the stages do not see it coming.

use super::adaptive::Control;
use super::dormand_prince::Pair;
use super::joint_dirk::JointMethod;
use super::joint_stage::{ImplicitMotion, Loads, StageError};
use super::pace::{self, Pace};
use thiserror::Error;

/// Share of the size of a coordinate below which its relative error does not count.
const FLOOR: f64 = 1e-4;
/// Error of a stage over that of the step.
const STAGE_SHARE: f64 = 1e-2;
/// Error of a stage against the motion in equal steps.
const EQUAL: f64 = 1e-10;
/// What the loops move an end by delays the motion by a step, over and over but not more and more: it counts by this share.
const MOVED_SHARE: f64 = 1e-2;

/// Why an integration stopped short.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum JointStepError {
    /// A stage had no solution, even in the shortest step, or in an equal one.
    #[error("step of {h:.3e} s at {t:.6e} s failed: {source}")]
    Stage {
        /// Start of the step [s].
        t: f64,
        /// Its length [s].
        h: f64,
        /// Why.
        source: StageError,
    },
    /// Steps became too small.
    #[error("step size fell to {h:.3e} s at {t:.6e} s after {rejected} rejections in a row; worst body \"{body}\"")]
    TooSmall {
        /// Start of the step [s].
        t: f64,
        /// Its length [s].
        h: f64,
        /// Rejections in a row.
        rejected: usize,
        /// Body whose coordinate has the largest error.
        body: String,
    },
}

/// Sees each accepted step: start [s], length [s], coordinates and rates at its end; answers whether to go on.
pub type Observe<'a> = &'a mut dyn FnMut(f64, f64, &Pair) -> bool;

/// A method with control of its steps, and the storage for it.
#[derive(Debug, Clone)]
pub struct JointAdaptive {
    method: JointMethod,
    end: Pair,
    whole: Pair,
    error: Pair,
    carried: Pair,
}

impl JointAdaptive {
    /// Storage for `n` coordinates.
    pub fn new(method: JointMethod, n: usize) -> Self {
        let zeros = Pair::zeros(n);
        Self { carried: method.carried.clone(), method, end: zeros.clone(), whole: zeros.clone(), error: zeros }
    }

    /// Takes `now` from `span.0` to `span.1` [s]. Returns the time where `observe` stopped it, none at the end.
    ///
    /// # Errors
    /// See [`JointStepError`]; `now` is then the end of the last accepted step.
    pub fn advance<L: Loads>(
        &mut self,
        motion: &mut ImplicitMotion<'_, L>,
        span: (f64, f64),
        now: &mut Pair,
        control: Control,
        observe: Observe<'_>,
    ) -> Result<Option<f64>, JointStepError> {
        let stage = |h| move |source| JointStepError::Stage { t: span.0, h, source };
        self.method.start(motion, span.0, &now.q, &now.v).map_err(stage(0.0))?;
        motion.hurried = matches!(control, Control::Tolerance(_));
        match control {
            Control::Tolerance(tol) => self.controlled(motion, span, now, tol, observe),
            Control::Fixed(step) => self.equal(motion, span, now, step, observe),
        }
    }

    fn controlled<L: Loads>(
        &mut self,
        motion: &mut ImplicitMotion<'_, L>,
        span: (f64, f64),
        now: &mut Pair,
        tol: f64,
        observe: Observe<'_>,
    ) -> Result<Option<f64>, JointStepError> {
        let mut pace = Pace::new(span, self.first_step(motion, span, now, tol)?, self.method.order());
        while !pace.is_over() {
            crate::budget::check();
            let (t, step) = (pace.t, pace.step());
            self.carried.copy(&self.method.carried.q, &self.method.carried.v);
            let before = motion.norm(&now.q);
            let stepped = self.attempt(motion, (t, step), STAGE_SHARE * tol * (before + FLOOR), now);
            let mut error =
                if stepped.is_ok() { self.relative_error(motion, before, step, tol) } else { f64::INFINITY };
            if error <= 1.0 {
                error = error.max(MOVED_SHARE * self.project(motion, pace.after(step)) / (tol * (before + FLOOR)));
            }
            if error <= 1.0 {
                pace.accept(step, error);
                self.accept(motion, now);
                if !observe(t, pace.t - t, now) {
                    return Ok(Some(pace.t));
                }
            } else {
                let Pair { q, v } = &self.carried;
                self.method.carried.copy(q, v);
                motion.work.rejected += 1;
                if !pace.reject(step, error, 0.25) {
                    stepped.map_err(|source| JointStepError::Stage { t, h: step, source })?;
                    let (rejected, body) = (pace.rejected, motion.worst(&self.error.q));
                    return Err(JointStepError::TooSmall { t, h: step, rejected, body });
                }
            }
        }
        Ok(None)
    }

    fn equal<L: Loads>(
        &mut self,
        motion: &mut ImplicitMotion<'_, L>,
        span: (f64, f64),
        now: &mut Pair,
        step: f64,
        observe: Observe<'_>,
    ) -> Result<Option<f64>, JointStepError> {
        for (t, end) in pace::equal(span, step) {
            crate::budget::check();
            let h = end - t;
            let tolerance = EQUAL * (motion.norm(&now.q) + FLOOR);
            self.method
                .step(motion, (t, h), tolerance, now, &mut self.end, &mut self.error)
                .map_err(|source| JointStepError::Stage { t, h, source })?;
            self.project(motion, end);
            self.accept(motion, now);
            if !observe(t, h, now) {
                return Ok(Some(end));
            }
        }
        Ok(None)
    }

    /// One step with its error, by the method's estimate or by doubling.
    fn attempt<L: Loads>(
        &mut self,
        motion: &mut ImplicitMotion<'_, L>,
        (t, h): (f64, f64),
        tolerance: f64,
        now: &Pair,
    ) -> Result<(), StageError> {
        let Self { method, end, whole, error, carried } = self;
        if method.estimates() {
            return method.step(motion, (t, h), tolerance, now, end, error);
        }
        method.step(motion, (t, h), tolerance, now, whole, error)?;
        method.carried.copy(&carried.q, &carried.v);
        let half = 0.5 * h;
        method.step(motion, (t, half), tolerance, now, error, end)?;
        // the middle lies in `error` until the second half is done
        std::mem::swap(whole, error);
        method.step(motion, (t + half, h - half), tolerance, whole, end, &mut Pair::default())?;
        for k in 0..end.q.len() {
            error.q[k] = (end.q[k] - error.q[k]) / 3.0;
            error.v[k] = (end.v[k] - error.v[k]) / 3.0;
        }
        Ok(())
    }

    /// Takes the end of the step to the loops as they are at time `to` [s]. Returns how far that moves it.
    fn project<L: Loads>(&mut self, motion: &mut ImplicitMotion<'_, L>, to: f64) -> f64 {
        let Self { end, whole, .. } = self;
        whole.q.copy_from_slice(&end.q);
        motion.project(to, &mut end.q, &mut end.v);
        whole.q.iter_mut().zip(&end.q).for_each(|(from, to)| *from -= to);
        motion.norm(&self.whole.q)
    }

    fn accept<L: Loads>(&mut self, motion: &mut ImplicitMotion<'_, L>, now: &mut Pair) {
        now.copy(&self.end.q, &self.end.v);
        motion.work.steps += 1;
    }

    fn relative_error<L: Loads>(&self, motion: &ImplicitMotion<'_, L>, before: f64, h: f64, tol: f64) -> f64 {
        let (eq, ev) = (motion.norm(&self.error.q), motion.norm(&self.error.v));
        let reach = before.max(motion.norm(&self.end.q)) + FLOOR;
        let error = eq.hypot(h * ev) / (tol * reach);
        if error.is_nan() { f64::INFINITY } else { error }
    }

    /// A step in which the first accelerations and rates move the coordinates by no more than a step's error.
    fn first_step<L: Loads>(
        &mut self,
        motion: &mut ImplicitMotion<'_, L>,
        (start, end): (f64, f64),
        now: &Pair,
        tol: f64,
    ) -> Result<f64, JointStepError> {
        let h = end - start;
        motion.accelerations(start, &now.q, &now.v, &mut self.error.v).map_err(|source| JointStepError::Stage {
            t: start,
            h,
            source,
        })?;
        let reach = tol * (motion.norm(&now.q) + FLOOR);
        let (a, v) = (motion.norm(&self.error.v), motion.norm(&now.v));
        let by_force = (2.0 * reach / a).sqrt();
        // rates are exact to first order: it is their change that counts, within ten times the error
        let by_rate = if v > 0.0 { 10.0 * reach / v } else { f64::INFINITY };
        Ok(h.min(by_force.max(1e-9 * h)).min(by_rate.max(1e-9 * h)))
    }
}
