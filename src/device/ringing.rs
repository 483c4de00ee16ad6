//! How far a motion that rings is off by now, for want of segments.
//!
//! A mesh that is off by e in the lowest frequency brings a free motion out of step by π·e with each half of its cycle, until it has died
//! away: at most 2Q·e, which is also what it makes of a steady swing at resonance. What swings by s of its range r is then off by
//! that phase times s/2r. Halves are told by turning points of what the circuit sees; those that do not last about as long as half a cycle of
//! the mode count nothing, as what a slow drive moves is not out of step.

use crate::compile::LowestMode;
use std::f64::consts::PI;

/// By how much half a swing may be longer or shorter than half a cycle of the mode [1]: voltages move its frequency, and a turning point is
/// known to a step.
const ALIKE: f64 = 0.25;

/// The motion of one transient, as far as its accepted points tell.
#[derive(Debug, Clone, Default)]
pub(super) struct Ringing {
    /// Time of the last point [s].
    at: f64,
    courses: Vec<Course>,
    /// What it was told to be off by, in tolerances: 0, 1, 10, 100, … [1].
    told: f64,
}

/// One quantity that the circuit sees.
#[derive(Debug, Clone, Copy)]
struct Course {
    now: f64,
    low: f64,
    high: f64,
    /// Whether it rises.
    rises: Option<bool>,
    /// The last turning point: time [s], value.
    turned: Option<(f64, f64)>,
    /// Halves of a cycle of the mode so far.
    halves: u32,
}

impl Ringing {
    /// After a point at `t` [s] since the equilibrium with these `values`: how far the worst of them is off by now, as a share of its
    /// range [1], and how many cycles that took.
    pub(super) fn see(&mut self, mode: &LowestMode, t: f64, values: &[f64]) -> (f64, f64) {
        if t <= self.at || self.courses.len() != values.len() {
            let begun = |&y: &f64| Course { now: y, low: y, high: y, rises: None, turned: None, halves: 0 };
            *self = Self { at: t, courses: values.iter().map(begun).collect(), told: self.told };
            return (0.0, 0.0);
        }
        let (before, half) = (self.at, 0.5 / mode.frequency_hz);
        self.at = t;
        let one = |(course, &y): (&mut Course, &f64)| course.see((before, y), half, mode);
        let worst = self.courses.iter_mut().zip(values).map(one).max_by(|a, b| a.0.total_cmp(&b.0));
        worst.unwrap_or((0.0, 0.0))
    }

    /// The same in words, where that is beyond the tolerance for the first time, and ten times more than when it was told last.
    pub(super) fn tell(&mut self, mode: &LowestMode, tol: f64, t: f64, values: &[f64]) -> Option<String> {
        let (error, cycles) = self.see(mode, t, values);
        if error <= tol * self.told.max(1.0) {
            return None;
        }
        self.told = 10.0 * self.told.max(1.0);
        Some(format!(
            "the mesh may be off by {:.1e} in the lowest frequency, {:.4e} Hz, and a motion that rings gets out of step: after {cycles:.1} \
             cycles it may be off by {error:.1e} of its range, more than the tolerance {tol:e}",
            mode.error.abs(),
            mode.frequency_hz
        ))
    }
}

impl Course {
    /// The next value `y`, where the last one was at `before` [s].
    fn see(&mut self, (before, y): (f64, f64), half: f64, mode: &LowestMode) -> (f64, f64) {
        let last = std::mem::replace(&mut self.now, y);
        (self.low, self.high) = (self.low.min(y), self.high.max(y));
        if y == last || self.rises.replace(y > last).is_none_or(|rose| rose == (y > last)) {
            return (0.0, 0.0);
        }
        // it turned at the last point
        let Some((since, from)) = self.turned.replace((before, last)) else { return (0.0, 0.0) };
        if ((before - since) / half - 1.0).abs() > ALIKE {
            return (0.0, 0.0);
        }
        self.halves += 1;
        let phase = mode.error.abs() * (PI * f64::from(self.halves)).min(2.0 * mode.quality);
        let share = (last - from).abs() / (2.0 * (self.high - self.low));
        (phase * share, 0.5 * f64::from(self.halves))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    const MODE: LowestMode = LowestMode { frequency_hz: 1e3, quality: f64::INFINITY, error: 1e-4 };

    /// What [`Ringing`] says of a course up to `end` [s], and how far off a motion with another frequency really is.
    fn worst(mode: &LowestMode, end: f64, course: impl Fn(f64) -> f64) -> f64 {
        let mut ringing = Ringing::default();
        (0..)
            .map(|k| f64::from(k) * 3e-5)
            .take_while(|t| *t < end)
            .map(|t| ringing.see(mode, t, &[course(t)]).0)
            .fold(0.0, f64::max)
    }

    /// A free swing of a hundred cycles: what is told is what a frequency that is off by so much makes of it, ω·t·e of the amplitude.
    #[test]
    fn a_free_swing_is_out_of_step_by_its_phase() {
        let told = worst(&MODE, 0.1, |t| (TAU * 1e3 * t).cos());
        let real = (0..10_000)
            .map(|k| f64::from(k) * 1e-5)
            .map(|t| 0.5 * ((TAU * 1e3 * t).cos() - (TAU * 1e3 * (1.0 + MODE.error) * t).cos()).abs())
            .fold(0.0, f64::max);
        assert!((told / real - 1.0).abs() < 0.05, "{told} against {real}");
    }

    /// What dies away is out of step by what is left of it, and a steady swing at resonance by 2Q·e.
    #[test]
    fn damping_bounds_it() {
        let quality = 20.0;
        let mode = LowestMode { quality, ..MODE };
        let dying = worst(&mode, 0.1, |t| (-TAU * 1e3 * t / (2.0 * quality)).exp() * (TAU * 1e3 * t).cos());
        // the largest of φ·exp(−φ/2Q)/2 over its range, about 1.9
        let most = MODE.error * 2.0 * quality / 1f64.exp() / 1.9;
        assert!((dying / most - 1.0).abs() < 0.1, "{dying} against {most}");
        let steady = worst(&mode, 0.1, |t| (TAU * 1e3 * t).sin());
        assert!((steady / (MODE.error * quality) - 1.0).abs() < 0.05, "{steady}");
    }

    /// A slow drive, a fast one and a ramp are not out of step.
    #[test]
    fn what_is_driven_elsewhere_is_in_step() {
        for frequency in [1.0, 300.0, 2e3, 5e3] {
            assert_eq!(worst(&MODE, 0.1, |t| (TAU * frequency * t).sin()), 0.0, "{frequency} Hz");
        }
        assert_eq!(worst(&MODE, 0.1, |t| t), 0.0);
    }
}
