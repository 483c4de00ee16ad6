//! Macro steps: one step of the motion for many points of the circuit (multirate integration).
//!
//! Points of a circuit with edges of nanoseconds are far shorter than the steps of the motion. Those within a macro step take the motion from a polynomial
//! through the ends of that step, which is made with the forces that its start expects. Moments of V² over time keep the voltages meanwhile. The next macro
//! step begins where the motion has come under the forces of these moments, so no impulse is lost.
//!
//! The displayed motion has no jump there: the difference to the expected one fades away over the next macro step.

use crate::Token;
use bimorph_multibody::planar::Pose;
use bimorph_solve::time::method::Motion;
use std::sync::Arc;

/// The start of a macro step.
#[derive(Debug, Clone, PartialEq)]
pub struct MacroStep {
    /// The state at which it begins.
    pub start: Token,
    /// The motion there.
    pub motion: Motion,
    /// The displayed motion there, less that.
    pub offset: Motion,
    /// Source voltages there (V).
    pub sources: Vec<f64>,
    /// Expected voltage of each electrode pair.
    pub expected: Vec<Expected>,
    /// Largest rates up to there, in the norm of masses.
    pub fastest: f64,
    /// The same of displacements since the equilibrium.
    pub reach: f64,
    /// Macro steps before it that suggest it, two at most.
    pub informed: u32,
    /// Length of the step to try (s).
    pub first: f64,
}

/// The square of a voltage in a macro step less that at its start, as the macro step before suggests it: its mean for a voltage that alternates, or the
/// line through it for one that continues. The one is taken that would have been right before.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Expected {
    /// The mean (V²).
    pub mean: f64,
    /// The line at the start (V²).
    pub value: f64,
    /// Its slope (V²/s).
    pub slope: f64,
    /// The line is taken.
    pub goes_on: bool,
}

impl Expected {
    /// Value at the start and slope of what is taken.
    pub(crate) fn line(self) -> [f64; 2] {
        if self.goes_on { [self.value, self.slope] } else { [self.mean, 0.0] }
    }

    /// The moments after some time (s) less the expected ones.
    pub(crate) fn missed(self, [once, twice]: [f64; 2], time: f64) -> [f64; 2] {
        let [value, slope] = self.line();
        [once - time * (value + 0.5 * slope * time), twice - twice_of([value, slope], time)]
    }

    /// The expectation after this one, given the moments over a time (s); `less` is the square at the start less that at the end (V²).
    pub(crate) fn after(self, moments: [f64; 2], time: f64, less: f64) -> Self {
        let [value, slope] = line(moments, time);
        let missed = |line: [f64; 2]| (moments[1] - twice_of(line, time)).abs();
        let goes_on = missed([self.value, self.slope]) <= missed([self.mean, 0.0]);
        Self { mean: moments[0] / time + less, value: value + slope * time + less, slope, goes_on }
    }
}

/// Second moment of a line.
fn twice_of([value, slope]: [f64; 2], time: f64) -> f64 {
    time * time * (0.5 * value + slope * time / 6.0)
}

/// Where a state lies in a macro step.
#[derive(Debug, Clone, PartialEq)]
pub struct InMacroStep {
    /// The step.
    pub step: Arc<MacroStep>,
    /// Time since its start (s).
    pub since: f64,
    /// Points since its start.
    pub points: u32,
    /// Of each electrode pair the square of the voltage less that at the start, integrated over time once (V²·s) and twice (V²·s²).
    pub moments: Vec<[f64; 2]>,
}

impl InMacroStep {
    /// Doubles held, the step included.
    pub fn doubles(&self) -> usize {
        let step = &self.step;
        let poses = [&step.motion, &step.offset].iter().map(|m| m.q.len() + m.v.len()).sum::<usize>();
        3 * poses + step.sources.len() + 4 * step.expected.len() + 2 * self.moments.len()
    }
}

/// The moments after a time `dt` (s) over which a voltage goes from `from` to `to` (V), the square of that at the start of the step being `start` (V²).
pub(crate) fn moments([once, twice]: [f64; 2], dt: f64, [from, to]: [f64; 2], start: f64) -> [f64; 2] {
    let change = to - from;
    let first = from * from + from * change + change * change / 3.0 - start;
    let second = 0.5 * from * from + from * change / 3.0 + change * change / 12.0 - 0.5 * start;
    [once + dt * first, twice + dt * (once + dt * second)]
}

/// The line in time that has the same moments over `time` (s): its value at the start (V²) and its slope (V²/s).
pub(crate) fn line([once, twice]: [f64; 2], time: f64) -> [f64; 2] {
    let slope = (6.0 * once * time - 12.0 * twice) / time.powi(3);
    [once / time - 0.5 * slope * time, slope]
}

/// Displacements and rates at a part `x` (1) of a step of length `h` (s) on the cubic polynomial through the motion at its ends.
pub(crate) fn on_cubic([from, to]: [&Motion; 2], h: f64, x: f64, put: &mut Motion) {
    let (rest, square) = (1.0 - x, x * x);
    let [a, b] = [rest * rest * (1.0 + 2.0 * x), square * (3.0 - 2.0 * x)];
    let [c, d] = [h * x * rest * rest, -h * square * rest];
    let bend = 6.0 * x * rest / h;
    let [e, f] = [rest * (1.0 - 3.0 * x), x * (3.0 * x - 2.0)];
    for j in 0..put.q.len() {
        let ([p, q], [v, w]) = ([from.q[j], to.q[j]], [from.v[j], to.v[j]]);
        put.q[j] = p * a + q * b + v * c + w * d;
        put.v[j] = (q - p) * bend + v * e + w * f;
    }
}

/// `put +=` an offset at the start of a step of length `h` (s) that fades to nothing at its end, at a part `x` (1) of it.
pub(crate) fn add_fading(offset: &Motion, h: f64, x: f64, put: &mut Motion) {
    let rest = 1.0 - x;
    let [a, c] = [rest * rest * (1.0 + 2.0 * x), h * x * rest * rest];
    let [b, d] = [-6.0 * x * rest / h, rest * (1.0 - 3.0 * x)];
    for (j, (q, v)) in offset.q.iter().zip(&offset.v).enumerate() {
        put.q[j] += q * a + v * c;
        put.v[j] += q * b + v * d;
    }
}

/// Poses of nothing.
pub(crate) fn zeros(bodies: usize) -> Vec<Pose> {
    vec![Pose::zeros(); bodies]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Moments of a voltage that goes along two lines are those of its square, by Simpson's rule (exact for their third powers), and the line has them.
    #[test]
    fn moments_are_those_of_the_square() {
        let volts = |t: f64| if t < 1.0 { 2.0 + 3.0 * t } else { 5.0 - 4.0 * (t - 1.0) };
        let mut found = moments([0.0; 2], 1.0, [2.0, 5.0], 4.0);
        found = moments(found, 0.5, [5.0, 3.0], 4.0);
        let simpson = |f: &dyn Fn(f64) -> f64, a: f64, b: f64| (b - a) / 6.0 * (f(a) + 4.0 * f(0.5 * (a + b)) + f(b));
        let over = |f: &dyn Fn(f64) -> f64| simpson(f, 0.0, 1.0) + simpson(f, 1.0, 1.5);
        let square = |t: f64| volts(t).powi(2) - 4.0;
        assert!((found[0] - over(&square)).abs() < 1e-12, "{found:?}");
        assert!((found[1] - over(&|t| (1.5 - t) * square(t))).abs() < 1e-12, "{found:?}");
        let [value, slope] = line(found, 1.5);
        let of_line = |t: f64| value + slope * t;
        assert!((simpson(&of_line, 0.0, 1.5) - found[0]).abs() < 1e-12);
        assert!((simpson(&|t| (1.5 - t) * of_line(t), 0.0, 1.5) - found[1]).abs() < 1e-12);
    }

    /// The polynomial has both ends and their rates, and its rate is the change of its displacement; so has what fades.
    #[test]
    fn rates_are_those_of_displacements() {
        let pose = |x: f64| vec![Pose::new(x, -x, 3.0 * x)];
        let (from, to) = (Motion { q: pose(1.0), v: pose(2.0) }, Motion { q: pose(-0.5), v: pose(0.7) });
        let h = 0.5;
        let at = |x: f64| {
            let (mut cubic, mut fading) = (Motion::zeros(1), Motion::zeros(1));
            on_cubic([&from, &to], h, x, &mut cubic);
            add_fading(&from, h, x, &mut fading);
            (cubic, fading)
        };
        let near = |a: &[Pose], b: &[Pose]| assert!((a[0] - b[0]).norm() < 1e-7, "{a:?} {b:?}");
        let ((start, begins), (end, ends)) = (at(0.0), at(1.0));
        for (found, expected) in [(start, &from), (begins, &from), (end, &to), (ends, &Motion::zeros(1))] {
            near(&found.q, &expected.q);
            near(&found.v, &expected.v);
        }
        let e = 1e-5;
        let ((less, fades_less), (more, fades_more), (mid, fades)) = (at(0.3 - e), at(0.3 + e), at(0.3));
        let rate = |a: &Motion, b: &Motion| vec![(b.q[0] - a.q[0]) / (2.0 * e * h)];
        near(&rate(&less, &more), &mid.v);
        near(&rate(&fades_less, &fades_more), &fades.v);
    }
}
