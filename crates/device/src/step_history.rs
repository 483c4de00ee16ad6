//! Values of a device as a circuit sees them: the charges of its ports and its signals, at the circuit's own points and
//! on straight lines between them. The next step is bounded by how far these bend, not by what moves unseen: the device
//! takes internal steps of its own for that.
//!
//! Over three points with steps h₁ and h₂ the second divided difference is
//! ```text
//! d = ((y₂ − y₁)/h₂ − (y₁ − y₀)/h₁)/(h₁ + h₂),
//! ```
//! and a parabola with that d leaves the line over the next step H by |d|·H²/4 in the middle. At an inflection d
//! vanishes, and its change d′ counts instead: |d′|·H³/4. Its weight is larger where the circuit gives a force for a
//! displacement or differentiates a charge. Steps whose length varies twice a cycle would pump energy into a spring of
//! the circuit (a parametric resonance), and a current with an error of the square of its step would vary with them. A
//! ringing that is faster than the steps shows in d by its height: where that may be seen, the steps become short
//! enough to follow it.

use bimorph_base::ErrorBudget;
use serde::{Deserialize, Serialize};

/// How the circuit's steps follow a quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SteppingRule {
    /// On straight lines between its points.
    Line,
    /// The same, with steps that are even over a swing.
    Even,
    /// As what is differentiated, with even steps.
    Differentiated,
}

/// History up to a state, part of that state.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct StepHistory {
    /// Values at this state.
    now: Vec<f64>,
    /// Slopes over the step that led here, per second; empty at the start.
    slopes: Vec<f64>,
    /// Second divided differences over the last two steps, per second squared; empty before the second.
    bends: Vec<f64>,
    /// Lengths of the last step and of the one before it (s).
    steps: [f64; 2],
    /// Smallest values so far.
    low: Vec<f64>,
    /// Largest values so far.
    high: Vec<f64>,
}

impl StepHistory {
    /// At the start of a transient.
    pub fn start(values: Vec<f64>) -> Self {
        let (low, high) = (values.clone(), values.clone());
        Self { now: values, slopes: Vec::new(), bends: Vec::new(), steps: [0.0; 2], low, high }
    }

    /// After a step of `dt` (s), and the longest next step (s) at which each quantity keeps to the line within its share
    /// of the tolerance or within `floor`, in its own unit.
    pub fn step(
        &self,
        dt: f64,
        values: Vec<f64>,
        errors: ErrorBudget,
        floor: impl Fn(usize) -> f64,
        follow: impl Fn(usize) -> SteppingRule,
    ) -> (Self, f64) {
        if self.now.len() != values.len() {
            return (Self::start(values), f64::INFINITY);
        }
        let mut bound = f64::INFINITY;
        let (low, high) = (self.low.clone(), self.high.clone());
        let mut next =
            Self { now: values, slopes: Vec::new(), bends: Vec::new(), steps: [dt, self.steps[0]], low, high };
        for (n, &y) in next.now.iter().enumerate() {
            next.low[n] = next.low[n].min(y);
            next.high[n] = next.high[n].max(y);
            let slope = (y - self.now[n]) / dt;
            next.slopes.push(slope);
            let Some(slope_before) = self.slopes.get(n) else { continue };
            let follow = follow(n);
            let share = if follow == SteppingRule::Differentiated { errors.bend_of_charges() } else { errors.bend() };
            let allowed = share * (next.high[n] - next.low[n]) + floor(n);
            let bend = (slope - slope_before) / (self.steps[0] + dt);
            next.bends.push(bend);
            bound = bound.min(2.0 * (allowed / bend.abs()).sqrt());
            if let Some(bend_before) = self.bends.get(n) {
                // A divided difference stands for the middle of its three points.
                let change = 3.0 * (bend - bend_before) / (self.steps[1] + self.steps[0] + dt);
                // of a sine even steps are as long where it turns as where it bends most
                let turns = if follow == SteppingRule::Line { 1.0 } else { (16.0 * share).sqrt().min(1.0) };
                bound = bound.min((turns * 4.0 * allowed / change.abs()).cbrt());
            }
        }
        (next, bound)
    }

    /// Lists of numbers that [`StepHistory::numbers`] gives.
    pub const PARTS: usize = 6;

    /// Everything it holds, to be put away; [`StepHistory::from_numbers`] takes it back.
    pub fn numbers(&self) -> [&[f64]; Self::PARTS] {
        [&self.now, &self.slopes, &self.bends, &self.steps, &self.low, &self.high]
    }

    /// Inverse of [`StepHistory::numbers`]; `None` for inconsistent lists.
    pub fn from_numbers(parts: [Vec<f64>; Self::PARTS]) -> Option<Self> {
        let [now, slopes, bends, steps, low, high] = parts;
        let fits = |list: &[f64]| list.is_empty() || list.len() == now.len();
        if !fits(&slopes) || !fits(&bends) || low.len() != now.len() || high.len() != now.len() {
            return None;
        }
        Some(Self { slopes, bends, steps: steps.try_into().ok()?, low, high, now })
    }

    /// Values at this state.
    pub(super) fn values(&self) -> &[f64] {
        &self.now
    }

    /// Length of the step that led here (s); 0 at the start.
    pub(super) fn last_step(&self) -> f64 {
        self.steps[0]
    }

    /// Values that it follows.
    pub fn followed(&self) -> usize {
        self.now.len()
    }

    /// Doubles held.
    pub fn doubles(&self) -> usize {
        self.now.len() + self.slopes.len() + self.bends.len() + self.low.len() + self.high.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Followed at its own bound, a sine stays within 5·tol of its range of straight lines, also at inflections,
    /// without excess points: at most 30 points a cycle at a tolerance of 1e-3.
    #[test]
    fn a_sine_is_followed_within_its_share() {
        let tol = 1e-3;
        let (mut shown, mut t, mut dt) = (StepHistory::start(vec![1.0]), 0.0, 1e-3);
        let (mut worst, mut points) = (0.0f64, 0);
        while t < 40.0 {
            let (after, bound) =
                shown.step(dt, vec![f64::cos(t + dt)], ErrorBudget::of(tol), |_| 0.0, |_| SteppingRule::Line);
            if t > 20.0 {
                let line = 0.5 * (f64::cos(t) + f64::cos(t + dt));
                worst = worst.max((f64::cos(t + 0.5 * dt) - line).abs() / 2.0);
                points += 1;
            }
            (shown, t) = (after, t + dt);
            dt = bound.min(2.0 * dt).min(1.0);
        }
        let cycles = 20.0 / std::f64::consts::TAU;
        assert!(worst < 5.0 * tol, "{worst}");
        assert!((20.0..30.0).contains(&(f64::from(points) / cycles)), "{}", f64::from(points) / cycles);
    }

    /// A constant quantity, and one that bends by less than its floor, gives no relevant bound.
    #[test]
    fn noise_below_the_floor_does_not_hold_the_circuit() {
        let mut shown = StepHistory::start(vec![293.0, 0.0]);
        for k in 1..100 {
            let noise = if k % 2 == 0 { 1e-9 } else { -1e-9 };
            let (after, bound) =
                shown.step(1e-6, vec![293.0, noise], ErrorBudget::of(1e-3), |_| 1e-6, |_| SteppingRule::Line);
            assert!(bound > 1e-5, "{bound:e}");
            shown = after;
        }
    }
}
