//! Phase error of a free oscillation from too few segments.
//!
//! A relative error e of the lowest frequency shifts the phase of a free motion by π·e with each half cycle, until it
//! has decayed: at most 2Q·e. This is also the phase error of a steady oscillation at resonance. A component of
//! amplitude s in a signal of range r then has an error of that phase times s/2r. Half cycles are counted by turning
//! points of the circuit's values. Those whose duration differs from about half a cycle of the mode are ignored, since
//! the motion of a slow drive has no phase error.
//!
//! A current is a result as its charge is, over a range of its own: a slow stroke may make nearly all of a charge and nearly nothing of its current.
//! So the rates of charges from point to point are followed, too, and what higher modes bring to them ([`super::higher_modes`]).

use super::half_cycles::{Phase, Waveform};
use super::higher_modes::{HigherModes, OfMode, Split};
use bimorph_base::ErrorBudget;
use bimorph_model::compile::LowestMode;

/// Fraction of half a cycle below which two points give no rate of a charge (1): at corners of a source they are
/// separated by rounding.
const MIN_STEP: f64 = 1e-4;

/// Growth of an error since the last warning that causes another one (1).
const GROWS: f64 = 3.0;

/// An accepted state as the circuit sees it.
#[derive(Debug, Clone, Copy)]
pub(super) struct AcceptedState<'a> {
    /// Time since the equilibrium (s).
    pub(super) t: f64,
    /// Signals, then charges or answers of ports.
    pub(super) values: &'a [f64],
}

/// The motion of one transient, from its accepted points.
#[derive(Debug, Clone, Default)]
pub(super) struct PhaseErrorMonitor {
    /// Time of the last point (s).
    at: f64,
    /// Those of the values, then those of the rates of charges.
    courses: Vec<Waveform>,
    /// Rates of the charges among the values, in their places (1/s); the others stay 0.
    rates: Vec<f64>,
    /// Values and time (s) at the last point with rates.
    rated: (Vec<f64>, f64),
    /// The last errors of rates (1).
    errors: Vec<f64>,
    higher: HigherModes,
    /// Last phase error warned about, in units of `tol`.
    reported: f64,
}

/// The largest phase error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Worst {
    /// Error, of its range (1).
    pub(super) error: f64,
    /// Cycles that it took.
    pub(super) cycles: f64,
    /// Number of the value, currents behind all values.
    pub(super) n: usize,
    /// The higher mode that brings most of it.
    pub(super) higher: Option<OfMode>,
}

impl PhaseErrorMonitor {
    /// Processes a point, with `charges` among its values. Returns the largest error among the values and currents that
    /// turn there.
    pub(super) fn observe(
        &mut self,
        mode: &LowestMode,
        at: AcceptedState<'_>,
        charges: &[bool],
        split: Option<&Split<'_>>,
    ) -> Worst {
        let (AcceptedState { t, values }, count) = (at, at.values.len());
        let mut worst = Worst { error: 0.0, cycles: 0.0, n: 0, higher: None };
        if t <= self.at || self.courses.len() != 2 * count {
            let courses = values.iter().chain(std::iter::repeat_n(&0.0, count)).map(|y| Waveform::at(*y)).collect();
            let none = vec![0.0; count];
            let (rates, rated, reported) = (none.clone(), (values.to_vec(), t), self.reported);
            *self = Self { at: t, courses, rates, rated, errors: none, higher: HigherModes::default(), reported };
            return worst;
        }
        let (before, half) = (self.at, 0.5 / mode.frequency_hz);
        self.at = t;
        let (last, since) = &mut self.rated;
        let rated = t - *since > MIN_STEP * half;
        if rated {
            for (n, rate) in self.rates.iter_mut().enumerate().filter(|(n, _)| charges[*n]) {
                *rate = (values[n] - last[n]) / (t - *since);
            }
            last.copy_from_slice(values);
            *since = t;
        }
        let followed = if rated { 2 * count } else { count };
        let phase = Phase { error: mode.error, quality: mode.quality };
        let seen = values.iter().chain(&self.rates).take(followed);
        for (n, (course, y)) in self.courses.iter_mut().zip(seen).enumerate() {
            let Some((swing, halves)) = course.half([before, t], *y, half) else { continue };
            let error = phase.after(halves) * swing / (2.0 * course.range());
            if n >= count {
                self.errors[n - count] = error;
            }
            if error > worst.error {
                worst = Worst { error, cycles: 0.5 * f64::from(halves), n, higher: None };
            }
        }
        if split.is_some_and(|split| self.higher.observe([before, t], charges, split)) {
            for n in (0..count).filter(|n| charges[*n]) {
                let (sum, largest) = self.higher.of(n);
                let range = self.courses[count + n].range();
                if range == 0.0 {
                    continue; // the charge has not changed
                }
                let error = self.errors[n] + sum / range;
                let most = largest.filter(|of| of.error > self.errors[n] * range);
                if let Some(of) = most.filter(|_| error > worst.error) {
                    worst = Worst { error, cycles: of.cycles, n: count + n, higher: Some(of) };
                }
            }
        }
        worst
    }

    /// The warning with the number of the value, where the error exceeds the tolerance for the first time, or three
    /// times the last warning.
    pub(super) fn report(
        &mut self,
        mode: &LowestMode,
        errors: ErrorBudget,
        at: AcceptedState<'_>,
        charges: &[bool],
        split: &Split<'_>,
    ) -> Option<(String, usize)> {
        let Worst { error, cycles, n, higher } = self.observe(mode, at, charges, Some(split));
        if error <= errors.within(self.reported.max(1.0)) {
            return None;
        }
        self.reported = errors.used(GROWS * error, 1.0);
        let frequency = match higher {
            None => format!(
                "the mesh has an estimated error of {:.1e} in the lowest frequency, {:.4e} Hz,",
                mode.error.abs(),
                mode.frequency_hz
            ),
            Some(of) => format!(
                "the mesh and the steps have estimated errors of {:.1e} and {:.1e} in the frequency of a higher mode, {:.4e} Hz,",
                split.modes[of.mode].error.abs(),
                of.steps,
                split.modes[of.mode].frequency_hz
            ),
        };
        let text = format!(
            "{frequency} which shifts the phase of a free oscillation: after {cycles:.1} \
             cycles its estimated error is {error:.1e} of its range, more than the tolerance {:e}",
            errors.requested()
        );
        Some((text, n))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bimorph_model::compile::HigherMode;
    use bimorph_solve::time::defect::step_error;
    use std::f64::consts::{PI, TAU};

    const MODE: LowestMode = LowestMode { frequency_hz: 1e3, quality: f64::INFINITY, error: 1e-4 };

    /// Largest error of [`PhaseErrorMonitor`] for a waveform up to `end` (s), and the true error of a motion with
    /// another frequency.
    fn worst(mode: &LowestMode, end: f64, course: impl Fn(f64) -> f64) -> f64 {
        let mut ringing = PhaseErrorMonitor::default();
        (0..)
            .map(|k| f64::from(k) * 3e-5)
            .take_while(|t| *t < end)
            .map(|t| ringing.observe(mode, AcceptedState { t, values: &[course(t)] }, &[false], None).error)
            .fold(0.0, f64::max)
    }

    /// A free oscillation of a hundred cycles: the reported error is that of the frequency error, ω·t·e of the
    /// amplitude.
    #[test]
    fn a_free_swing_is_out_of_step_by_its_phase() {
        let reported = worst(&MODE, 0.1, |t| (TAU * 1e3 * t).cos());
        let real = (0..10_000)
            .map(|k| f64::from(k) * 1e-5)
            .map(|t| 0.5 * ((TAU * 1e3 * t).cos() - (TAU * 1e3 * (1.0 + MODE.error) * t).cos()).abs())
            .fold(0.0, f64::max);
        assert!((reported / real - 1.0).abs() < 0.05, "{reported} against {real}");
    }

    /// A decaying oscillation has the phase error of its remaining amplitude, and a steady one at resonance 2Q·e.
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

    /// An oscillation of a hundredth of a charge's slow stroke has an error of its phase in the current, which it
    /// dominates: 100 times as much as in the charge.
    #[test]
    fn currents_have_a_range_of_their_own() {
        let charge = |t: f64| 50.0 * t + 0.01 * (TAU * 1e3 * t).sin();
        let rings = |charges: bool| {
            let mut ringing = PhaseErrorMonitor::default();
            let seen = (0..3300).map(|k| f64::from(k) * 3e-5);
            let seen =
                seen.map(|t| ringing.observe(&MODE, AcceptedState { t, values: &[charge(t)] }, &[charges], None));
            seen.fold((0.0, 0), |worst, now| if now.error > worst.0 { (now.error, now.n) } else { worst })
        };
        let ((error, n), (alone, _)) = (rings(true), rings(false));
        // 98 cycles: ω·t·e, half of it of the range
        assert!((error / (0.5 * TAU * 98.0 * MODE.error) - 1.0).abs() < 0.05 && n == 1, "{error} of {n}");
        assert!(alone < 0.02 * error, "{alone}");
    }

    /// A slow drive, a fast one and a ramp have no phase error.
    #[test]
    fn what_is_driven_elsewhere_is_in_step() {
        for frequency in [1.0, 300.0, 2e3, 5e3] {
            assert_eq!(worst(&MODE, 0.1, |t| (TAU * frequency * t).sin()), 0.0, "{frequency} Hz");
        }
        assert_eq!(worst(&MODE, 0.1, |t| t), 0.0);
    }

    /// A charge that does not change has no error of its current, whatever rounding makes of the higher modes at rest.
    #[test]
    fn a_current_of_zero_has_no_error() {
        let modes = [HigherMode { frequency_hz: 1e4, quality: f64::INFINITY, error: 1e-2, shape: Vec::new() }];
        let mut ringing = PhaseErrorMonitor::default();
        for k in 1..4000 {
            let t = f64::from(k) * 5e-6;
            let rate = 1e-20 * (TAU * 1e4 * t).cos();
            let split = Split { modes: &modes, rates: &[rate], step: 1e-7, coupling: &|_, _| 1.0 };
            let worst = ringing.observe(&MODE, AcceptedState { t, values: &[1.0] }, &[true], Some(&split));
            assert_eq!(worst.error, 0.0, "at {t:e} s");
        }
    }

    /// In this current a mode of ten times the lowest frequency makes a quarter of the range, with a frequency error
    /// that leads to half a radian at the end. The error is that of the two sines, and the current is identified.
    /// Integrator steps that are long for that mode increase it.
    #[test]
    fn a_higher_mode_brings_its_phase() {
        let lowest = LowestMode { frequency_hz: 1e3, quality: f64::INFINITY, error: 0.0 };
        let (end, error) = (0.02, 0.5 / (TAU * 1e4 * 0.02));
        let modes = [HigherMode { frequency_hz: 1e4, quality: f64::INFINITY, error, shape: Vec::new() }];
        let (slow, fast) = (|t: f64| 3.0 * (TAU * 1e3 * t).cos(), |t: f64| (TAU * 1e4 * t).cos());
        let charge = |t: f64| 3.0 * (TAU * 1e3 * t).sin() / (TAU * 1e3) + (TAU * 1e4 * t).sin() / (TAU * 1e4);
        let reported = |step: f64| {
            let (mut ringing, dt) = (PhaseErrorMonitor::default(), 5e-6);
            let points = (1..).map(|k| f64::from(k) * dt).take_while(|t| *t < end);
            let seen = points.map(|t| {
                let split = Split { modes: &modes, rates: &[fast(t)], step, coupling: &|_, _| 1.0 };
                let worst = ringing.observe(&lowest, AcceptedState { t, values: &[charge(t)] }, &[true], Some(&split));
                assert!(worst.error == 0.0 || worst.n == 1 && worst.higher.is_some());
                worst.error
            });
            seen.fold(0.0, f64::max)
        };
        let range = (0..20_000).map(|k| slow(f64::from(k) * 1e-7) + fast(f64::from(k) * 1e-7));
        let (low, high) = range.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
        let expected = 2.0 * (0.25f64).sin() / (high - low);
        let found = reported(1e-7);
        assert!((found / expected - 1.0).abs() < 0.1, "{found} {expected}");
        // a step over a radian has the error step_error(1)
        let steps = TAU * 1e4 * end * step_error(1.0);
        let more = reported(1.0 / (TAU * 1e4)) / found;
        assert!((more / (1.0 + steps / 0.5) - 1.0).abs() < 0.2, "{more} {steps}");
        assert!(steps < PI);
    }
}
