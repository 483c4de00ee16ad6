//! From one time to another within tolerances: the PI rule for the step, the first step, and what may go wrong.

use super::{DenseOutput, DormandPrince, PhasePoint, SecondOrder, continuous};
use bimorph_base::ErrorBudget;
use thiserror::Error;

/// Bounds of an error: every component may be wrong by atol + rtol·|y| in a step, in the mean square over all.
#[derive(Debug, Clone, PartialEq)]
pub struct Tolerances {
    /// Relative part (1).
    pub rtol: f64,
    /// Absolute part of each coordinate, in its unit.
    pub atol_q: Vec<f64>,
    /// Absolute part of each rate, in its unit.
    pub atol_v: Vec<f64>,
}

impl Tolerances {
    /// The norm of `x` against these bounds, where the state is the larger of `a` and `b`: 1 is just allowed. Also the
    /// component with the largest contribution (rates follow coordinates).
    fn norm(&self, x: &PhasePoint, a: &PhasePoint, b: &PhasePoint) -> (f64, usize) {
        let (mut sum, mut worst, mut component) = (0.0, -1.0, 0);
        let n = x.q.len();
        let halves = [(&x.q, &a.q, &b.q, &self.atol_q), (&x.v, &a.v, &b.v, &self.atol_v)];
        for (half, (x, a, b, atol)) in halves.into_iter().enumerate() {
            for i in 0..n {
                let allowed = atol[i] + ErrorBudget::of(self.rtol).within(a[i].abs().max(b[i].abs()));
                let share = x[i] / allowed;
                let square = share * share;
                sum += square;
                if square > worst || square.is_nan() {
                    (worst, component) = (square, half * n + i);
                }
            }
        }
        ((sum / (2.0 * n as f64)).sqrt(), component)
    }
}

/// Why an integration stopped short. `E` is the formulation's error.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum IntegrationError<E> {
    /// The accelerations could not be had, even for the shortest step; or the projection failed.
    #[error("no accelerations at {t:.6e} s, step {h:.3e} s: {source}")]
    Accelerations {
        /// Start of the step (s).
        t: f64,
        /// Its length (s).
        h: f64,
        /// Error of the formulation.
        source: E,
    },
    /// Steps became too small.
    #[error(
        "step size fell to {h:.3e} s at {t:.6e} s after {rejected} rejections in a row; worst component {component}"
    )]
    StepTooSmall {
        /// Start of the step (s).
        t: f64,
        /// Its length (s).
        h: f64,
        /// Rejections in a row.
        rejected: usize,
        /// Component with the largest error: rates follow coordinates.
        component: usize,
    },
    /// The allowed number of steps was used up.
    #[error("{steps} steps brought the motion to {t:.6e} s only")]
    TooManySteps {
        /// Time reached (s).
        t: f64,
        /// Steps taken, rejected ones included.
        steps: u64,
    },
}

/// Rejections in a row before giving up.
const MAX_REJECTED: usize = 60;
/// Fraction of the last error in the control of the next step.
const BETA: f64 = 0.04;

impl DormandPrince {
    /// Integrates `(q, v)` from `span.0` to `span.1` (s). `h` is the first step to try (0: found from the
    /// accelerations) and receives the one that would come next. `observe` receives each accepted step and returns
    /// whether to continue. `None` is returned when the end was reached, and the time where `observe` stopped
    /// otherwise.
    ///
    /// # Errors
    /// See [`IntegrationError`]; `(q, v)` is then the end of the last accepted step.
    #[allow(clippy::too_many_arguments)]
    pub fn integrate<P: SecondOrder>(
        &mut self,
        problem: &mut P,
        span: (f64, f64),
        q: &mut [f64],
        v: &mut [f64],
        h: &mut f64,
        tolerances: &Tolerances,
        max_steps: u64,
        observe: &mut dyn FnMut(&DenseOutput<'_>) -> bool,
    ) -> Result<Option<f64>, IntegrationError<P::Error>> {
        let (mut t, end) = span;
        if t == end || q.is_empty() {
            return Ok(None);
        }
        let sign = (end - t).signum();
        self.forget();
        let failed = |t, h, source| IntegrationError::Accelerations { t, h, source };
        if self.terms[0].q.len() != q.len() {
            self.terms = std::array::from_fn(|_| PhasePoint::zeros(q.len()));
        }
        self.begin(&mut |t, q: &_, v: &_, a: &mut _| problem.accelerations(t, q, v, a), t, q, v)
            .map_err(|e| failed(t, *h, e))?;
        if *h == 0.0 {
            *h = self.first_step(problem, t, end - t, q, v, tolerances).map_err(|e| failed(t, 0.0, e))?;
        }
        *h = sign * h.abs();
        let (mut last_error, mut rejected, mut steps) = (1e-4, 0, 0);
        let mut now = PhasePoint { q: q.to_vec(), v: v.to_vec() };
        while (end - t) * sign > 0.0 {
            bimorph_base::budget::check();
            if steps == max_steps {
                return Err(IntegrationError::TooManySteps { t, steps });
            }
            steps += 1;
            let last = (t + 1.01 * *h - end) * sign > 0.0;
            let step = if last { end - t } else { *h };
            let attempt =
                self.attempt(&mut |t, q: &_, v: &_, a: &mut _| problem.accelerations(t, q, v, a), (t, step), q, v);
            let (error, component) = match &attempt {
                Ok(()) => tolerances.norm(&self.error, &now, &self.next),
                Err(_) => (f64::INFINITY, 0),
            };
            let raw = error.powf(0.2 - 0.75 * BETA);
            if error <= 1.0 {
                let factor = (raw / f64::powf(last_error, BETA) / 0.9).clamp(0.1, 5.0);
                let next = step / if rejected > 0 { factor.max(1.0) } else { factor };
                // a step cut short by the end says nothing against the longer one
                *h = if last && next.abs() < h.abs() { *h } else { next };
                last_error = error.max(1e-4);
                let to = if last { end } else { t + step };
                self.accept(problem, to, step, q, v, &mut now).map_err(|e| failed(t, step, e))?;
                let dense = DenseOutput { t, h: step, terms: &self.terms };
                rejected = 0;
                self.effort.steps += 1;
                t = to;
                if !observe(&dense) {
                    return Ok(Some(t));
                }
            } else {
                rejected += 1;
                self.effort.rejected += 1;
                *h = if raw.is_finite() { step / (raw / 0.9).clamp(1.0, 5.0) } else { 0.2 * step };
                let least = 4.0 * f64::EPSILON * t.abs().max(end.abs() * 1e-3);
                if rejected > MAX_REJECTED || h.abs() <= least {
                    attempt.map_err(|e| failed(t, step, e))?;
                    return Err(IntegrationError::StepTooSmall { t, h: step, rejected, component });
                }
            }
        }
        Ok(None)
    }

    /// Takes the step just attempted, which ends at `to`: projection, continuous extension, first stage of the next.
    #[allow(clippy::too_many_arguments)]
    fn accept<P: SecondOrder>(
        &mut self,
        problem: &mut P,
        to: f64,
        h: f64,
        q: &mut [f64],
        v: &mut [f64],
        now: &mut PhasePoint,
    ) -> Result<(), P::Error> {
        now.copy(&self.next);
        problem.project(to, &mut now.q, &mut now.v)?;
        let moved = *now != self.next;
        for c in 0..q.len() {
            let terms_q = continuous(q[c], now.q[c], h, |i| self.slopes[i].q[c]);
            let terms_v = continuous(v[c], now.v[c], h, |i| self.slopes[i].v[c]);
            for (term, (x, y)) in self.terms.iter_mut().zip(terms_q.into_iter().zip(terms_v)) {
                (term.q[c], term.v[c]) = (x, y);
            }
        }
        self.advance();
        if moved {
            self.forget();
            self.begin(&mut |t, q: &_, v: &_, a: &mut _| problem.accelerations(t, q, v, a), to, &now.q, &now.v)?;
        }
        q.copy_from_slice(&now.q);
        v.copy_from_slice(&now.v);
        Ok(())
    }

    /// A first step whose Euler step and second difference stay within the tolerances (Hairer et al., §II.4).
    fn first_step<P: SecondOrder>(
        &mut self,
        problem: &mut P,
        t: f64,
        span: f64,
        q: &[f64],
        v: &[f64],
        tolerances: &Tolerances,
    ) -> Result<f64, P::Error> {
        let now = PhasePoint { q: q.to_vec(), v: v.to_vec() };
        let (size, slope) = (tolerances.norm(&now, &now, &now).0, tolerances.norm(&self.slopes[0], &now, &now).0);
        let guess = if size < 1e-5 || slope < 1e-5 { 1e-6 * span.abs() } else { 0.01 * size / slope };
        let h = guess.min(span.abs()) * span.signum();
        for c in 0..q.len() {
            self.at.q[c] = q[c] + h * self.slopes[0].q[c];
            self.at.v[c] = v[c] + h * self.slopes[0].v[c];
        }
        self.slopes[1].q.copy_from_slice(&self.at.v);
        self.effort.accelerations += 1;
        problem.accelerations(t + h, &self.at.q, &self.at.v, &mut self.slopes[1].v)?;
        for c in 0..q.len() {
            self.error.q[c] = self.slopes[1].q[c] - self.slopes[0].q[c];
            self.error.v[c] = self.slopes[1].v[c] - self.slopes[0].v[c];
        }
        let bend = tolerances.norm(&self.error, &now, &now).0 / h.abs();
        let larger = bend.max(slope);
        let fifth = if larger <= 1e-15 { h.abs() * 1e3 } else { (0.01 / larger).powf(0.2) };
        Ok(fifth.min(100.0 * h.abs()).min(span.abs()))
    }
}
