//! Macro steps: one step of the motion for many points of the circuit (multirate integration).
//!
//! A circuit with nanosecond edges requests points far shorter than the steps of the motion. A macro step predicts the motion over two of these, from an extrapolation
//! of the square V² of each gap voltage. Its points interpolate that prediction. The state accumulates the integrals of V² over time, and the next macro step
//! begins at the motion corrected with them, so no impulse is lost.
//!
//! The difference between the predicted and the corrected motion decays over the next macro step, or over ordinary steps as a [`DisplayOffset`]: the
//! displayed motion is continuous with its rate.

use crate::Token;
use bimorph_multibody::planar::Pose;
use bimorph_solve::time::method::Motion;
use std::sync::Arc;

/// Largest motion since the equilibrium, in the norm of masses (kg^½·m, kg^½·m/s).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct PeakMotion {
    /// Of the displacements from the equilibrium.
    pub displacement: f64,
    /// Of the rates.
    pub rate: f64,
}

/// The start of a macro step.
#[derive(Debug, Clone, PartialEq)]
pub struct MacroStep {
    /// State at which it begins.
    pub start: Token,
    /// Corrected motion at the start.
    pub motion: Motion,
    /// Displayed motion at the start, from which points interpolate.
    pub displayed: Motion,
    /// Source voltages at the start (V).
    pub sources: Vec<f64>,
    /// Extrapolation of the square of each gap voltage.
    pub extrapolations: Vec<SquareExtrapolation>,
    /// Largest motion up to the start.
    pub peak: PeakMotion,
    /// Consecutive macro steps that the extrapolation is based on, at most two.
    pub history: u32,
    /// First step length that the integrator tries (s).
    pub trial_step: f64,
}

/// Integrals over time of the squared voltage less its value at the start of the macro step: once (V²·s) and twice (V²·s²).
pub type SquareIntegrals = [f64; 2];

/// Extrapolated squared voltage less its value at the start of the macro step: the mean of the macro step before, for an alternating voltage, or the line
/// through it, for a slowly varying one. The candidate with the smaller error over the last macro step is used.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SquareExtrapolation {
    /// Mean (V²).
    pub mean: f64,
    /// Value of the line at the start (V²).
    pub value: f64,
    /// Slope of the line (V²/s).
    pub slope: f64,
    /// Whether the line is used.
    pub is_linear: bool,
}

impl SquareExtrapolation {
    /// Value at the start (V²) and slope (V²/s) of the candidate in use.
    pub(crate) fn line(self) -> [f64; 2] {
        if self.is_linear { [self.value, self.slope] } else { [self.mean, 0.0] }
    }

    /// Integrals at a time (s) after the start, less the extrapolated ones.
    pub(crate) fn residual(self, [once, twice]: SquareIntegrals, time: f64) -> SquareIntegrals {
        let [value, slope] = self.line();
        [once - time * (value + 0.5 * slope * time), twice - double_integral([value, slope], time)]
    }

    /// Extrapolation from the end of a macro step with these integrals over `time` (s); `drop` is V² at its start less that at its end (V²).
    pub(crate) fn next(self, integrals: SquareIntegrals, time: f64, drop: f64) -> Self {
        let [value, slope] = fitted_line(integrals, time);
        let error = |line: [f64; 2]| (integrals[1] - double_integral(line, time)).abs();
        let is_linear = error([self.value, self.slope]) <= error([self.mean, 0.0]);
        Self { mean: integrals[0] / time + drop, value: value + slope * time + drop, slope, is_linear }
    }
}

/// Double integral over `time` (s) of a line.
fn double_integral([value, slope]: [f64; 2], time: f64) -> f64 {
    time * time * (0.5 * value + slope * time / 6.0)
}

/// Position of a state in a macro step.
#[derive(Debug, Clone, PartialEq)]
pub struct MacroStepPosition {
    /// The step.
    pub step: Arc<MacroStep>,
    /// Time since its start (s).
    pub elapsed: f64,
    /// Points since its start.
    pub points: u32,
    /// Integrals of the square of each gap voltage since its start.
    pub integrals: Vec<SquareIntegrals>,
}

impl MacroStepPosition {
    /// Bytes in memory, the step included.
    pub fn bytes(&self) -> usize {
        let motions = [&self.step.motion, &self.step.displayed].into_iter();
        let poses = motions.map(|m| size_of_val(&m.q[..]) + size_of_val(&m.v[..]));
        let voltages = size_of_val(&self.step.extrapolations[..]) + size_of_val(&self.integrals[..]);
        poses.sum::<usize>()
            + size_of_val(&self.step.sources[..])
            + voltages
            + size_of::<MacroStep>()
            + size_of::<Self>()
    }
}

/// Integrals extended by a time `dt` (s) over which the voltage goes linearly `from` one value `to` another (V); `start` is V² at the start of the step (V²).
pub(crate) fn extended([once, twice]: SquareIntegrals, dt: f64, [from, to]: [f64; 2], start: f64) -> SquareIntegrals {
    let change = to - from;
    let first = from * from + from * change + change * change / 3.0 - start;
    let second = 0.5 * from * from + from * change / 3.0 + change * change / 12.0 - 0.5 * start;
    [once + dt * first, twice + dt * (once + dt * second)]
}

/// Line with these integrals over `time` (s): value at the start (V²) and slope (V²/s).
pub(crate) fn fitted_line([once, twice]: SquareIntegrals, time: f64) -> [f64; 2] {
    let slope = (6.0 * once * time - 12.0 * twice) / time.powi(3);
    [once / time - 0.5 * slope * time, slope]
}

/// Hermite polynomial of fifth degree through three motions with their rates: shares of each displacement and of each rate in the displacement and in the
/// rate at time `t` (s). The `times` of the second and the third follow that of the first, 0.
pub(crate) fn hermite_shares(times: [f64; 2], t: f64) -> [[[f64; 2]; 2]; 3] {
    let nodes = [0.0, times[0], times[1]];
    std::array::from_fn(|i| {
        let [j, k] = [(i + 1) % 3, (i + 2) % 3].map(|other| nodes[other]);
        let x = t - nodes[i];
        let [a, b] = [nodes[i] - j, nodes[i] - k].map(f64::recip);
        // Lagrange's polynomial of the node, its slope, and its slope at the node
        let [at_j, at_k] = [(t - j) * a, (t - k) * b];
        let (value, slope, steep) = (at_j * at_k, a * at_k + b * at_j, a + b);
        let square = [value * value, 2.0 * value * slope];
        let level = 1.0 - 2.0 * steep * x;
        [[level * square[0], level * square[1] - 2.0 * steep * square[0]], [x * square[0], x * square[1] + square[0]]]
    })
}

/// Shares of a displacement and of its rate in the displacement and in the rate a time `t` later (s), as both decay to zero over a `length` by a cubic
/// polynomial.
pub(crate) fn decay_shares(t: f64, length: f64) -> [[f64; 2]; 2] {
    let x = t / length;
    let rest = 1.0 - x;
    [[rest * rest * (1.0 + 2.0 * x), -6.0 * x * rest / length], [t * rest * rest, rest * (1.0 - 3.0 * x)]]
}

/// Difference of the displayed motion from the integrated one where a macro step was left. It decays over `length`, so that the displayed motion stays
/// continuous with its rate.
#[derive(Debug, Clone, PartialEq)]
pub struct DisplayOffset {
    /// The difference where it began.
    pub start: Arc<Motion>,
    /// Time until it is zero (s).
    pub length: f64,
    /// Time since it began (s).
    pub elapsed: f64,
}

impl DisplayOffset {
    /// Of a displayed motion from an integrated one.
    pub(crate) fn between(displayed: [&[Pose]; 2], motion: &Motion, length: f64) -> Self {
        let less = |a: &[Pose], b: &[Pose]| a.iter().zip(b).map(|(a, b)| a - b).collect();
        let start = Motion { q: less(displayed[0], &motion.q), v: less(displayed[1], &motion.v) };
        Self { start: Arc::new(start), length, elapsed: 0.0 }
    }

    /// The same a time `dt` later (s); none where it is zero.
    pub(crate) fn after(&self, dt: f64) -> Option<Self> {
        let elapsed = self.elapsed + dt;
        (elapsed < self.length).then(|| Self { start: Arc::clone(&self.start), length: self.length, elapsed })
    }

    /// `to += factor` times the difference now.
    pub(crate) fn add(&self, factor: f64, to: &mut Motion) {
        let [of_q, of_v] = decay_shares(self.elapsed, self.length).map(|shares| shares.map(|share| factor * share));
        let Motion { q, v } = &*self.start;
        for (j, (q, v)) in q.iter().zip(v).enumerate() {
            to.q[j] += q * of_q[0] + v * of_v[0];
            to.v[j] += q * of_q[1] + v * of_v[1];
        }
    }

    /// Bytes in memory.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.start.q[..]) + size_of_val(&self.start.v[..]) + size_of::<Self>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Integrals of a piecewise linear voltage are those of its square, by Simpson's rule (exact for cubics), and the fitted line has them.
    #[test]
    fn integrals_are_those_of_the_square() {
        let volts = |t: f64| if t < 1.0 { 2.0 + 3.0 * t } else { 5.0 - 4.0 * (t - 1.0) };
        let mut found = extended([0.0; 2], 1.0, [2.0, 5.0], 4.0);
        found = extended(found, 0.5, [5.0, 3.0], 4.0);
        let simpson = |f: &dyn Fn(f64) -> f64, a: f64, b: f64| (b - a) / 6.0 * (f(a) + 4.0 * f(0.5 * (a + b)) + f(b));
        let over = |f: &dyn Fn(f64) -> f64| simpson(f, 0.0, 1.0) + simpson(f, 1.0, 1.5);
        let square = |t: f64| volts(t).powi(2) - 4.0;
        assert!((found[0] - over(&square)).abs() < 1e-12, "{found:?}");
        assert!((found[1] - over(&|t| (1.5 - t) * square(t))).abs() < 1e-12, "{found:?}");
        let [value, slope] = fitted_line(found, 1.5);
        let of_line = |t: f64| value + slope * t;
        assert!((simpson(&of_line, 0.0, 1.5) - found[0]).abs() < 1e-12);
        assert!((simpson(&|t| (1.5 - t) * of_line(t), 0.0, 1.5) - found[1]).abs() < 1e-12);
    }

    /// The polynomial has the motion at its nodes, its rates are the derivatives of its displacements, and it is exact for the fifth degree.
    #[test]
    fn interpolation_is_exact_for_the_fifth_degree() {
        let q = |t: f64| 1.0 - 2.0 * t + 3.0 * t.powi(2) - t.powi(3) + 0.5 * t.powi(4) + 2.0 * t.powi(5);
        let v = |t: f64| -2.0 + 6.0 * t - 3.0 * t * t + 2.0 * t.powi(3) + 10.0 * t.powi(4);
        let times = [0.4, 1.1];
        for t in [0.0, 0.1, 0.4, 0.75, 1.1] {
            let mut found = [0.0; 2];
            for (node, shares) in [0.0, 0.4, 1.1].into_iter().zip(hermite_shares(times, t)) {
                (0..2).for_each(|k| found[k] += shares[0][k] * q(node) + shares[1][k] * v(node));
            }
            assert!((found[0] - q(t)).abs() < 1e-12 && (found[1] - v(t)).abs() < 1e-12, "{t}: {found:?}");
        }
    }

    /// An offset is that of its start at first, ends at zero with its rate, and its rate is the derivative of its displacement.
    #[test]
    fn an_offset_decays_with_its_rate() {
        let pose = |x: f64| vec![Pose::new(x, -x, 3.0 * x)];
        let zero = Motion::zeros(1);
        let offset = DisplayOffset::between([&pose(1.0), &pose(2.0)], &zero, 0.5);
        let at = |t: f64| {
            let mut motion = Motion::zeros(1);
            if let Some(offset) = offset.after(t) {
                offset.add(1.0, &mut motion);
            }
            motion
        };
        let near = |a: Pose, b: Pose| assert!((a - b).norm() < 1e-6, "{a:?} {b:?}");
        near(at(0.0).q[0], pose(1.0)[0]);
        near(at(0.0).v[0], pose(2.0)[0]);
        let e = 1e-6;
        near((at(0.2 + e).q[0] - at(0.2 - e).q[0]) / (2.0 * e), at(0.2).v[0]);
        assert!(at(0.5 - e).q[0].norm() < 1e-9 && at(0.5 - e).v[0].norm() < 1e-3);
        assert_eq!(at(0.5), zero);
    }

    /// The candidate that fits the last macro step is used for the next one, from the value at its end.
    #[test]
    fn the_better_extrapolation_is_used() {
        let last = SquareExtrapolation { mean: 1.0, value: -2.0, slope: 3.0, is_linear: false };
        for (line, is_linear) in [([1.0, 0.0], false), ([-2.0, 3.0], true)] {
            let time = 2.0;
            let integrals = [time * (line[0] + 0.5 * line[1] * time), double_integral(line, time)];
            let next = last.next(integrals, time, 0.5);
            assert_eq!(next.is_linear, is_linear, "{next:?}");
            let end = line[0] + line[1] * time + 0.5;
            let mean = line[0] + 0.5 * line[1] * time + 0.5;
            assert!(
                [next.value - end, next.slope - line[1], next.mean - mean].iter().all(|x| x.abs() < 1e-12),
                "{next:?}"
            );
            let used = SquareExtrapolation { is_linear, ..last };
            assert!(used.residual(integrals, time).iter().all(|x| x.abs() < 1e-12));
        }
    }
}
