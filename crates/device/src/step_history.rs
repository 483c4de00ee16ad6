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
//!
//! The trapezoidal rule keeps an error of a current with the other sign at each step, and a loop of the circuit may feed
//! it back. Such an alternation has the same height at every step length, so shorter steps do not end it. A quantity
//! that still alternates from point to point after `MIN_ALTERNATIONS` steps that became `MAX_SHORTENING` times
//! shorter follows its mean: d is then that of the mean height of the last two points.

use bimorph_base::ErrorBudget;
use serde::{Deserialize, Serialize};

/// Steps in a row at which d changes its sign before an alternation counts as one of the integration rule.
const MIN_ALTERNATIONS: f64 = 4.0;
/// By how much steps become shorter meanwhile (1). A motion that alternates at first is resolved by 16 points a cycle then.
const MAX_SHORTENING: f64 = 8.0;
/// Value of `alternations` of a quantity whose alternation is one of the integration rule.
const OF_THE_RULE: f64 = -1.0;
/// Smallest height of an alternation, as a fraction of that of the step before (1). That of a motion falls with the square of the step.
const MIN_HEIGHT: f64 = 0.5;

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
    /// Steps in a row at which d changed its sign, or [`OF_THE_RULE`]; empty before the second step.
    alternations: Vec<f64>,
    /// Longest of these steps (s).
    longest: Vec<f64>,
}

impl StepHistory {
    /// At the start of a transient.
    pub fn start(values: Vec<f64>) -> Self {
        let (low, high) = (values.clone(), values.clone());
        Self { now: values, low, high, ..Self::default() }
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
        let mut next = Self { now: values, steps: [dt, self.steps[0]], low, high, ..Self::default() };
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
            let (alternations, longest) = self.alternation(n, dt, bend);
            next.alternations.push(alternations);
            next.longest.push(longest);
            if alternations == OF_THE_RULE {
                bound = bound.min(2.0 * (allowed / self.bend_of_mean(n, dt, bend).abs()).sqrt());
                continue;
            }
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

    /// `alternations` and `longest` of quantity `n` after a step of `dt` (s) that ends with the second difference `bend`.
    fn alternation(&self, n: usize, dt: f64, bend: f64) -> (f64, f64) {
        match (self.bends.get(n), self.alternations.get(n), self.longest.get(n)) {
            (Some(before), Some(&count), Some(&longest))
                if before * bend < 0.0 && (bend * dt).abs() > MIN_HEIGHT * (before * self.steps[1]).abs() =>
            {
                let longest = longest.max(dt);
                let lasting = count == OF_THE_RULE || (count >= MIN_ALTERNATIONS && longest >= MAX_SHORTENING * dt);
                (if lasting { OF_THE_RULE } else { count + 1.0 }, longest)
            }
            _ => (0.0, dt),
        }
    }

    /// Second difference of the mean height of the last two points; `bend` is that of the last.
    fn bend_of_mean(&self, n: usize, dt: f64, bend: f64) -> f64 {
        let before = self.bends.get(n).copied().unwrap_or(bend);
        // values ±δ in turn have d = 2·δ/(h₁·h₂)
        0.5 * (bend + before * self.steps[1] / dt)
    }

    /// Lists of numbers that [`StepHistory::numbers`] gives.
    pub const PARTS: usize = 8;
    /// Of them, those that snapshots of format 2 hold.
    pub const PARTS_OF_FORMAT_2: usize = 6;

    /// Everything it holds, to be put away; [`StepHistory::from_numbers`] takes it back.
    pub fn numbers(&self) -> [&[f64]; Self::PARTS] {
        let Self { now, slopes, bends, steps, low, high, alternations, longest } = self;
        [now, slopes, bends, steps, low, high, alternations, longest]
    }

    /// Inverse of [`StepHistory::numbers`]; `None` for inconsistent lists.
    pub fn from_numbers(parts: [Vec<f64>; Self::PARTS]) -> Option<Self> {
        let [now, slopes, bends, steps, low, high, alternations, longest] = parts;
        let fits = |list: &[f64]| list.is_empty() || list.len() == now.len();
        let fit = [&slopes, &bends, &alternations, &longest].into_iter().all(|list| fits(list));
        if !fit || low.len() != now.len() || high.len() != now.len() {
            return None;
        }
        Some(Self { slopes, bends, steps: steps.try_into().ok()?, low, high, alternations, longest, now })
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
        self.now.len()
            + self.slopes.len()
            + self.bends.len()
            + self.low.len()
            + self.high.len()
            + self.alternations.len()
            + self.longest.len()
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

    /// An alternation of the trapezoidal rule, of the same height at every step length, shortens the steps some
    /// thousand times at most. They grow again to those of the motion under it.
    #[test]
    fn alternations_of_the_rule_do_not_shorten_steps_for_ever() {
        let (mut shown, mut t, mut dt) = (StepHistory::start(vec![0.0]), 0.0, 1e-2);
        let mut shortest = dt;
        for k in 0..300 {
            let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
            let value = f64::sin(t + dt) + 0.1 * sign;
            let (after, bound) = shown.step(dt, vec![value], ErrorBudget::of(1e-3), |_| 0.0, |_| SteppingRule::Line);
            (shown, t) = (after, t + dt);
            dt = bound.min(2.0 * dt).min(1.0);
            shortest = shortest.min(dt);
        }
        assert!(shortest > 1e-6, "{shortest:e}");
        assert!(t > 10.0, "{t}");
    }

    /// A ringing at half the rate of the first points is followed: the steps become short enough for 16 points a cycle.
    #[test]
    fn ringing_faster_than_the_steps_is_resolved() {
        let omega = std::f64::consts::PI / 1e-2;
        let (mut shown, mut t, mut dt) = (StepHistory::start(vec![1.0]), 0.0, 1e-2);
        for _ in 0..100 {
            let value = f64::cos(omega * (t + dt));
            let (after, bound) = shown.step(dt, vec![value], ErrorBudget::of(1e-3), |_| 0.0, |_| SteppingRule::Line);
            (shown, t) = (after, t + dt);
            dt = bound.min(2.0 * dt).min(1e-2);
        }
        assert!(dt < 2.0 * 1e-2 / 16.0, "{dt:e}");
    }
}
