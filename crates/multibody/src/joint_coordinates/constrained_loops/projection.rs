//! Positions and rates that fulfil the loops, and accelerations in any configuration.
//!
//! Elimination fulfils the accelerations' rows only, so the loops would open quadratically in time. Projection in the mass
//! norm closes them after each step with the reduction itself, at one more right-hand side: min ‖Δ‖_M under J·Δ = −g. It
//! has no gain to choose, unlike Baumgarte's feedback, whose gains would have to know the time scale of the mechanism.
//!
//! Reference: E. Hairer, G. Wanner, "Solving Ordinary Differential Equations II" (1996), §VII.2 (projection methods).

use super::data::ReductionTask;
use super::reduction::{Reduction, Traversal, Traversed};
use super::singular::Singularity;

/// A loop's pivot below 1/100 of its lever loses more than 1e-12: the path for singular configurations is taken instead.
const NEAR: f64 = 1e2;
/// Gauss–Newton steps of a projection.
const MAX_ITERATIONS: usize = 30;

impl Reduction<f64> {
    /// [`Reduction::reduce`], or [`Reduction::reduce_singular`] where that is too near to a singular configuration; then
    /// says what was met.
    #[inline]
    pub fn solve(&mut self, task: ReductionTask, out: &mut [f64]) -> Option<Singularity> {
        if self.mechanism.schedule.redundant == 0 {
            self.reduce(task, out);
            if self.nearness <= NEAR && out.iter().all(|x| x.is_finite()) {
                return None;
            }
        }
        Some(self.reduce_singular(task, out))
    }

    /// Moves `q` onto the loops, by the shortest way in the mass norm; `change` is scratch of the same length. Leaves the
    /// bodies placed there at rates `v`. Returns the largest gap left (m).
    pub fn project_positions(&mut self, q: &mut [f64], v: &[f64], change: &mut [f64]) -> f64 {
        self.place(q, v);
        let mut gap = self.largest(ReductionTask::Positions);
        for _ in 0..MAX_ITERATIONS {
            if gap == 0.0 || self.mechanism.constraints == 0 {
                break;
            }
            self.solve(ReductionTask::Positions, change);
            for (q, d) in q.iter_mut().zip(change.iter()) {
                *q += d;
            }
            self.place(q, v);
            let now = self.largest(ReductionTask::Positions);
            // rounding is reached when a step no longer helps
            if now >= 0.25 * gap {
                if now > gap {
                    for (q, d) in q.iter_mut().zip(change.iter()) {
                        *q -= d;
                    }
                    self.place(q, v);
                    return gap;
                }
                return now;
            }
            gap = now;
        }
        gap
    }

    /// Makes the rates `v` fulfil the loops at the placed configuration.
    #[inline]
    pub fn project_rates(&mut self, q: &[f64], v: &mut [f64], change: &mut [f64]) {
        if self.mechanism.constraints == 0 {
            return;
        }
        for _ in 0..2 {
            self.place(q, v);
            self.solve(ReductionTask::Rates, change);
            for (v, d) in v.iter_mut().zip(change.iter()) {
                *v += d;
            }
        }
        self.place(q, v);
    }

    /// Largest residual of the loops (m, or m/s).
    #[inline]
    pub fn largest(&mut self, task: ReductionTask) -> f64 {
        <f64 as Traversed>::Traversal::rows(self, task)
    }
}
