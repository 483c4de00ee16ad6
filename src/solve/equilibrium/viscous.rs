//! A fall in viscous steps, for where the trust region of [`super::fall`] spends its budget.
//!
//! Each step is one of backward Euler for motion against viscous drag W,
//! ```text
//! min over q of E(q) + ½·μ·(q − q₀)ᵀ·W·(q − q₀),
//! ```
//! solved by Newton's method with tangents of its own, so that it follows a curved valley of the energy. The straight steps of a trust region have to
//! stay within the valley. Where parts are 10⁶ times as stiff along as across, and segments are short, they take thousands where these take
//! hundreds. μ shrinks after steps that are solved quickly, grows after the others, and is zero at the end: the last steps are Newton's.
//!
//! Reference: E. Hairer, G. Wanner, "Solving Ordinary Differential Equations II" (1996), on stiff gradient systems.

use super::fall::{MOST_SHIFT, ROUNDING, SETTLED, UNTESTED, Units, Unsettled};
use super::path::LoadPath;
use super::{Equilibrium, Path};
use crate::domains::System;
use crate::multibody::planar::Pose;

/// Newton iterations of a step at most, and the number up to which it counts as solved quickly.
const ROUNDS: [usize; 2] = [6, 3];
/// Last correction of a step, as a fraction of the step. The path of the fall need not be exact, only its end.
const ROUGH: f64 = 0.05;
/// Largest rotation of a correction [rad].
const FARTHEST: f64 = 1.0;
/// First μ, and the μ that counts as none, as fractions of the median stiffness.
const SHIFT: [f64; 2] = [1e-8, 1e-15];
/// Change of μ after a step that is solved quickly or not at all, and after one that is nearly not solved.
const CHANGE: [f64; 2] = [4.0, 1.5];
/// Factorizations, in budgets of a fall by the trust region.
const BUDGETS: usize = 5;
/// Steps that overturn a segment, at most: beyond them the mesh is too coarse for this fall.
const MAX_OVERTURNED: usize = 30;

/// The outcome of a viscous step.
enum Solved {
    /// It is in `trial`, after so many iterations.
    In(usize),
    /// The first Newton step without μ is no longer than this, in the units of W.
    Settled(f64),
    No,
}

impl Equilibrium {
    /// Lets the system fall at the loads of `s` from `q` to a stable equilibrium, in viscous steps.
    pub(super) fn creep(
        &mut self,
        system: &System,
        path: &dyn LoadPath,
        s: f64,
        q: &mut [Pose],
        done: &mut Path,
    ) -> Result<(), Unsettled> {
        path.at(s, &mut self.drive);
        let units = Units::of(system);
        let mut energy = system.potential(q, &self.drive);
        system.tangent(q, &self.drive, &mut self.tangent, &mut self.residual);
        let median = units.median_stiffness(&self.tangent);
        let (mut shift, mut last, mut overturned) = (SHIFT[0] * median, f64::INFINITY, 0);
        let end = done.iterations + BUDGETS * self.options.fall_steps;
        while done.iterations < end {
            let rounds = match self.viscous_step(system, q, units, shift, done) {
                Solved::Settled(length) => {
                    // converged, or as close as rounding lets it come
                    if length < SETTLED || length > 0.5 * last {
                        q.copy_from_slice(&self.trial);
                        return Ok(());
                    }
                    last = length;
                    ROUNDS[1]
                }
                Solved::In(rounds) => {
                    last = f64::INFINITY;
                    rounds
                }
                Solved::No => ROUNDS[0] + 1,
            };
            let there = system.potential(&self.trial, &self.drive);
            for ((step, x), q) in self.step.iter_mut().zip(&self.trial).zip(&*q) {
                *step = x - q;
            }
            let dissipated = 0.25 * shift * units.weigh(&self.step);
            // steps below this are not tested for energy: rounding
            let tiny = units.size(&self.step) < UNTESTED;
            let falls = tiny || there + dissipated <= energy + ROUNDING * (energy.abs() + there.abs());
            let solved = rounds <= ROUNDS[0] && falls;
            let over = solved && self.overturns(system, q);
            overturned += usize::from(over);
            if overturned > MAX_OVERTURNED {
                return Err(Unsettled::Budget);
            }
            if !solved || over || self.closes_too_far(system, q) {
                shift = (CHANGE[0] * shift).max(SHIFT[1] * median);
                if shift.is_nan() || shift > MOST_SHIFT * median {
                    return Err(Unsettled::Stuck);
                }
                continue;
            }
            q.copy_from_slice(&self.trial);
            energy = there;
            if rounds <= ROUNDS[1] {
                shift = if shift < CHANGE[0] * SHIFT[1] * median { 0.0 } else { shift / CHANGE[0] };
            } else if rounds == ROUNDS[0] || rounds + 1 == ROUNDS[0] {
                shift *= CHANGE[1];
            }
        }
        Err(Unsettled::Budget)
    }

    /// One step from `q` with the drag `shift`·W; its end is `trial`.
    fn viscous_step(&mut self, system: &System, q: &[Pose], units: Units, shift: f64, done: &mut Path) -> Solved {
        self.trial.copy_from_slice(q);
        let mut last = f64::INFINITY;
        for round in 1..=ROUNDS[0] {
            crate::budget::check();
            done.iterations += 1;
            system.tangent(&self.trial, &self.drive, &mut self.tangent, &mut self.residual);
            for (((step, r), x), q) in self.step.iter_mut().zip(&self.residual).zip(&self.trial).zip(q) {
                *step = -(r + units.weighted(&(x - q)) * shift);
            }
            units.add_shift(shift, &mut self.tangent);
            system.model.project_matrix(&mut self.tangent);
            if !self.is_definite(system) {
                return Solved::No;
            }
            system.model.project(&mut self.step);
            self.tangent.solve(&system.model.pattern, &mut self.step);
            let length = units.size(&self.step);
            let turned = self.step.iter().map(|x| x.z.abs()).fold(0.0, f64::max);
            if !length.is_finite() || length > last || turned > FARTHEST {
                return Solved::No;
            }
            last = length;
            for (x, step) in self.trial.iter_mut().zip(&self.step) {
                *x += step;
            }
            if round == 1 && shift == 0.0 && length < UNTESTED {
                return Solved::Settled(length);
            }
            for ((step, x), q) in self.step.iter_mut().zip(&self.trial).zip(q) {
                *step = x - q;
            }
            if length < ROUGH * units.size(&self.step) {
                return Solved::In(round);
            }
        }
        Solved::No
    }
}
