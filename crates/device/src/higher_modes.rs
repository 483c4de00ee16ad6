//! The phase errors of modes above the lowest in the currents of ports.
//!
//! A current weighs a mode by its frequency: one at ten times the frequency with a hundredth of the charge makes a tenth of the current. The rates v
//! of the bodies are split by the modes about the equilibrium without voltages,
//! ```text
//! η̇ = φᵀ·M·v,   φᵀ·M·φ = 1,   current of a port (∂Q/∂q·φ)·η̇
//! ```
//! Half cycles of η̇ are counted as those of signals are ([`super::half_cycles`]). The frequency of a mode has errors
//! from the mesh and from the steps of the integrator. The phase error accumulates until the mode has decayed, and
//! causes an error of at most twice its amplitude.

use super::half_cycles::{Phase, Waveform};
use bimorph_model::compile::HigherMode;
use bimorph_solve::time::defect::step_error;
use std::f64::consts::TAU;

/// Times half a cycle after which a mode that no longer swings has no error.
const FORGOTTEN: f64 = 6.0;

/// An accepted state, split by modes.
pub(super) struct Split<'a> {
    /// The modes.
    pub(super) modes: &'a [HigherMode],
    /// η̇ of each.
    pub(super) rates: &'a [f64],
    /// Length of a step of the integrator (s).
    pub(super) step: f64,
    /// Charge of a value of the circuit per η of a mode: number of the mode, then of the value.
    pub(super) coupling: &'a dyn Fn(usize, usize) -> f64,
}

/// The worst error of a current by one mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct OfMode {
    /// Number of the mode.
    pub(super) mode: usize,
    /// Error of the current (A).
    pub(super) error: f64,
    /// Cycles that it took.
    pub(super) cycles: f64,
    /// Relative error of the frequency by the steps (1).
    pub(super) steps: f64,
}

/// The modes of one transient.
#[derive(Debug, Clone, Default)]
pub(super) struct HigherModes(Vec<Followed>);

#[derive(Debug, Clone)]
struct Followed {
    course: Waveform,
    /// Sum of the errors of steps (1), and of their angles (rad).
    steps: [f64; 2],
    /// Error of each current (A) at the last half cycle, and when that was (s).
    errors: Vec<f64>,
    at: f64,
    cycles: f64,
}

impl Followed {
    fn by_steps(&self) -> f64 {
        if self.steps[1] > 0.0 { self.steps[0] / self.steps[1] } else { 0.0 }
    }
}

impl HigherModes {
    /// After an accepted point at `times[1]` that follows one at `times[0]` (s); `charges` says which values are charges. True where a mode has turned.
    pub(super) fn observe(&mut self, times: [f64; 2], charges: &[bool], split: &Split<'_>) -> bool {
        let [before, t] = times;
        if self.0.len() != split.modes.len() {
            let begun = |rate: &f64| Followed {
                course: Waveform::at(*rate),
                steps: [0.0; 2],
                errors: vec![0.0; charges.len()],
                at: t,
                cycles: 0.0,
            };
            self.0 = split.rates.iter().map(begun).collect();
            return false;
        }
        let mut turned = false;
        for (k, ((followed, mode), rate)) in self.0.iter_mut().zip(split.modes).zip(split.rates).enumerate() {
            let (half, omega) = (0.5 / mode.frequency_hz, TAU * mode.frequency_hz);
            let angle = omega * split.step;
            followed.steps[0] += step_error(angle) * (t - before) / split.step;
            followed.steps[1] += omega * (t - before);
            if let Some((swing, halves)) = followed.course.half([before, t], *rate, half) {
                let phase = Phase { error: mode.error.abs() + followed.by_steps(), quality: mode.quality };
                (followed.at, followed.cycles) = (t, 0.5 * f64::from(halves));
                for (n, error) in followed.errors.iter_mut().enumerate().filter(|(n, _)| charges[*n]) {
                    *error = 0.5 * swing * (split.coupling)(k, n).abs() * phase.after(halves);
                }
                turned = true;
            } else if t - followed.at > FORGOTTEN * half {
                followed.errors.fill(0.0);
            }
        }
        turned
    }

    /// The sum of the errors of the current of value `n` (A), and the largest of them.
    pub(super) fn of(&self, n: usize) -> (f64, Option<OfMode>) {
        let of = |(mode, followed): (usize, &Followed)| OfMode {
            mode,
            error: followed.errors[n],
            cycles: followed.cycles,
            steps: followed.by_steps(),
        };
        let all = || self.0.iter().enumerate().map(of);
        (all().map(|of| of.error).sum(), all().max_by(|a, b| a.error.total_cmp(&b.error)))
    }
}
