//! How far a motion that rings is off by now, for want of segments.
//!
//! A mesh that is off by e in the lowest frequency brings a free motion out of step by π·e with each half of its cycle, until it has died
//! away: at most 2Q·e, which is also what it makes of a steady swing at resonance. What swings by s of its range r is then off by
//! that phase times s/2r. Halves are told by turning points of what the circuit sees; those that do not last about as long as half a cycle of
//! the mode count nothing, as what a slow drive moves is not out of step.
//!
//! A current is a result as its charge is, over a range of its own: a slow stroke may make nearly all of a charge and nearly nothing of its current.
//! So the rates of charges from point to point are followed, too.

use crate::compile::LowestMode;
use std::f64::consts::PI;

/// By how much half a swing may be longer or shorter than half a cycle of the mode [1]: voltages move its frequency, and a turning point is
/// known to a step.
const ALIKE: f64 = 0.25;

/// Part of half a cycle below which two points tell no rate of a charge [1]: at corners of a source they are roundings apart.
const LEAST_STEP: f64 = 1e-4;

/// By how much an error is larger than the last one that was told, to be told again [1].
const GROWS: f64 = 3.0;

/// An accepted state as the circuit sees it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Accepted<'a> {
    /// Time since the equilibrium [s].
    pub(super) t: f64,
    /// Signals, then charges or answers of ports.
    pub(super) values: &'a [f64],
}

/// The motion of one transient, as far as its accepted points tell.
#[derive(Debug, Clone, Default)]
pub(super) struct Ringing {
    /// Time of the last point [s].
    at: f64,
    /// Those of the values, then those of the rates of charges.
    courses: Vec<Course>,
    /// Rates of the charges among the values, in their places [1/s]; the others stay 0.
    rates: Vec<f64>,
    /// Values and time [s] at the last point that told rates.
    rated: (Vec<f64>, f64),
    /// What is told next, in tolerances [1].
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
    /// After a point since the equilibrium, with `charges` among its values: how far the worst of values and currents is off by now, as a share of its
    /// range [1], how many cycles that took, and its number, currents behind all values.
    pub(super) fn see(&mut self, mode: &LowestMode, at: Accepted<'_>, charges: &[bool]) -> (f64, f64, usize) {
        let (Accepted { t, values }, count) = (at, at.values.len());
        if t <= self.at || self.courses.len() != 2 * count {
            let begun = |&y: &f64| Course { now: y, low: y, high: y, rises: None, turned: None, halves: 0 };
            let courses = values.iter().chain(std::iter::repeat_n(&0.0, count)).map(begun).collect();
            *self = Self { at: t, courses, rates: vec![0.0; count], rated: (values.to_vec(), t), told: self.told };
            return (0.0, 0.0, 0);
        }
        let (before, half) = (self.at, 0.5 / mode.frequency_hz);
        self.at = t;
        let (last, since) = &mut self.rated;
        let rated = t - *since > LEAST_STEP * half;
        if rated {
            for (n, rate) in self.rates.iter_mut().enumerate().filter(|(n, _)| charges[*n]) {
                *rate = (values[n] - last[n]) / (t - *since);
            }
            last.copy_from_slice(values);
            *since = t;
        }
        let mut worst = (0.0, 0.0, 0);
        let followed = if rated { 2 * count } else { count };
        for (n, (course, y)) in self.courses.iter_mut().zip(values.iter().chain(&self.rates)).take(followed).enumerate()
        {
            let (error, cycles) = course.see((before, *y), half, mode);
            if error > worst.0 {
                worst = (error, cycles, n);
            }
        }
        worst
    }

    /// The same in words, with the number, where that is beyond the tolerance for the first time, and three times more than when it was told last.
    pub(super) fn tell(
        &mut self,
        mode: &LowestMode,
        tol: f64,
        at: Accepted<'_>,
        charges: &[bool],
    ) -> Option<(String, usize)> {
        let (error, cycles, n) = self.see(mode, at, charges);
        if error <= tol * self.told.max(1.0) {
            return None;
        }
        self.told = GROWS * error / tol;
        let text = format!(
            "the mesh may be off by {:.1e} in the lowest frequency, {:.4e} Hz, and a motion that rings gets out of step: after {cycles:.1} \
             cycles it may be off by {error:.1e} of its range, more than the tolerance {tol:e}",
            mode.error.abs(),
            mode.frequency_hz
        );
        Some((text, n))
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
            .map(|t| ringing.see(mode, Accepted { t, values: &[course(t)] }, &[false]).0)
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

    /// A ringing of a hundredth of a charge's slow stroke is off by its phase in the current, where it is all there is: 100 times as much as in the charge.
    #[test]
    fn currents_have_a_range_of_their_own() {
        let charge = |t: f64| 50.0 * t + 0.01 * (TAU * 1e3 * t).sin();
        let rings = |charges: bool| {
            let mut ringing = Ringing::default();
            let seen = (0..3300).map(|k| f64::from(k) * 3e-5);
            let seen = seen.map(|t| ringing.see(&MODE, Accepted { t, values: &[charge(t)] }, &[charges]));
            seen.fold((0.0, 0), |worst, now| if now.0 > worst.0 { (now.0, now.2) } else { worst })
        };
        let ((error, n), (alone, _)) = (rings(true), rings(false));
        // 98 cycles: ω·t·e, half of it of the range
        assert!((error / (0.5 * TAU * 98.0 * MODE.error) - 1.0).abs() < 0.05 && n == 1, "{error} of {n}");
        assert!(alone < 0.02 * error, "{alone}");
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
