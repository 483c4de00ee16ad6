//! Signals at equally spaced times, between the steps of a run.

use super::options::TransientOptions;
use crate::readout::expression::Expression;
use crate::readout::run_signal::RunSignal;
use crate::readout::signal::SignalView;
use bimorph_domains::Ramp;
use bimorph_model::compile::CompiledModel;
use bimorph_solve::dense::interpolate;
use bimorph_solve::time::method::Motion;

/// Samples a run, stores the samples if requested, and passes each to the callback.
pub(super) struct SampleRecorder<'a> {
    compiled: &'a CompiledModel,
    options: &'a TransientOptions<'a>,
    ramp: &'a Ramp<'a>,
    volts: &'a [f64],
    signals: &'a [Expression<RunSignal>],
    report: &'a mut dyn FnMut(f64, &[f64]),
    /// Number of the next output time.
    next: usize,
    spacing: f64,
    now: Motion,
    rise: Vec<f64>,
    row: Vec<f64>,
    /// Times that were kept (s).
    pub(super) t: Vec<f64>,
    /// Values that were kept, signal by signal.
    pub(super) columns: Vec<Vec<f64>>,
}

impl<'a> SampleRecorder<'a> {
    /// Takes the first sample, of the motion at the start.
    pub(super) fn start(
        (compiled, options): (&'a CompiledModel, &'a TransientOptions<'a>),
        (ramp, volts): (&'a Ramp<'a>, &'a [f64]),
        signals: &'a [Expression<RunSignal>],
        report: &'a mut dyn FnMut(f64, &[f64]),
        motion: &Motion,
    ) -> Self {
        let system = &compiled.parts.system;
        let kept = if options.keep { options.points } else { 0 };
        let mut samples = Self {
            compiled,
            options,
            ramp,
            volts,
            signals,
            report,
            next: 1,
            spacing: options.stop / (options.points - 1) as f64,
            now: Motion::zeros(system.bodies()),
            rise: vec![0.0; system.electrics.heating.means()],
            row: vec![0.0; signals.len()],
            t: Vec::with_capacity(kept),
            columns: signals.iter().map(|_| Vec::with_capacity(kept)).collect(),
        };
        samples.take(0.0, motion);
        samples
    }

    /// Takes the samples that fall into a step of length `h` from time `s`, those after `end` (s) not.
    pub(super) fn step(&mut self, s: f64, h: f64, before: &Motion, after: &Motion, end: f64) {
        let mut now = std::mem::take(&mut self.now);
        while self.next < self.options.points {
            let last = self.next + 1 == self.options.points;
            let t = if last { self.options.stop } else { self.next as f64 * self.spacing };
            if t > end || t > s + h && !last || t > (s + h) * (1.0 + 1e-12) {
                break;
            }
            bimorph_base::budget::check();
            interpolate(before, after, h, ((t - s) / h).min(1.0), &mut now);
            self.take(t, &now);
            self.next += 1;
        }
        self.now = now;
    }

    fn take(&mut self, t: f64, motion: &Motion) {
        for (k, r) in self.rise.iter_mut().enumerate() {
            *r = self.ramp.rise_at(k, t);
        }
        let view = SignalView { q: &motion.q, v: &motion.v, rise: &self.rise, volts: self.volts };
        for (value, signal) in self.row.iter_mut().zip(self.signals) {
            *value = signal.value(self.compiled, &view);
        }
        if self.options.keep {
            self.t.push(t);
            for (value, column) in self.row.iter().zip(&mut self.columns) {
                column.push(*value);
            }
        }
        (self.report)(t, &self.row);
    }
}
