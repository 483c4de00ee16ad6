//! Amplitudes of a run's signals for small motions about a state.
//!
//! A part that hardly moves beside another is all that a signal on it shows. The scale of each signal is therefore its
//! own amplitude, or [`SMALL`] of the largest of its unit where that is more: smaller motions are a small part of a
//! picture.

use super::super::chart::error::SMALL;
use super::super::statics::OperatingPoint;
use super::super::step_error;
use super::super::transient::TransientOptions;
use crate::readout::expression::Expression;
use crate::readout::run_signal::RunSignal;
use crate::readout::signal::SignalView;
use bimorph_model::compile::CompiledModel;
use bimorph_multibody::planar::Pose;

/// Largest displacement of a node (m), of a small motion `x`.
pub(super) fn reach(model: &CompiledModel, x: &[Pose]) -> f64 {
    model.parts.nodes.iter().flatten().map(|p| p.displacement(x, true).norm()).fold(0.0, f64::max)
}

/// The signals of a run about a state.
pub(super) struct SignalAmplitudes<'a> {
    model: &'a CompiledModel,
    about: &'a OperatingPoint,
    signals: Vec<Expression<RunSignal>>,
    still: Vec<Pose>,
    rise: Vec<f64>,
    volts: Vec<f64>,
}

impl<'a> SignalAmplitudes<'a> {
    /// Of the signals in `options`; a point along a beam that a coarse mesh lacks is omitted.
    pub(super) fn new(model: &'a CompiledModel, options: &TransientOptions<'_>, about: &'a OperatingPoint) -> Self {
        Self {
            model,
            about,
            signals: options
                .signals
                .iter()
                .filter_map(|name| Expression::of_run(model, name, &about.sources).ok())
                .collect(),
            still: vec![Pose::zeros(); about.q.len()],
            rise: vec![0.0; about.rise.len()],
            volts: vec![0.0; about.volts.len()],
        }
    }

    /// How far each signal swings with a motion of this shape at `omega` (rad/s).
    pub(super) fn of(&self, shape: &[Pose], omega: f64) -> Vec<f64> {
        let state = SignalView { q: &self.about.q, v: &self.still, rise: &self.about.rise, volts: &self.about.volts };
        let moved = |q, v| SignalView { q, v, rise: &self.rise, volts: &self.volts };
        let swing = |signal: &Expression<RunSignal>| {
            let place = signal.slope(self.model, &state, &moved(shape, &self.still));
            let rate = signal.slope(self.model, &state, &moved(&self.still, shape));
            place.hypot(omega * rate)
        };
        self.signals.iter().map(swing).collect()
    }

    /// By how much each signal is measured: `swings` has what it swings with each part of a motion.
    pub(super) fn sizes(&self, swings: &[Vec<f64>], options: &TransientOptions<'_>) -> Vec<f64> {
        let most: Vec<f64> =
            (0..self.signals.len()).map(|s| swings.iter().map(|of| of[s]).fold(0.0, f64::max)).collect();
        let size = |(signal, own): (&Expression<RunSignal>, &f64)| {
            let unit = signal.unit();
            let beside = self.signals.iter().zip(&most).filter(|(other, _)| other.unit() == unit);
            let largest = beside.map(|(_, own)| *own).fold(0.0, f64::max);
            own.max(SMALL * largest).max(step_error::least(unit, options, self.model)).max(f64::MIN_POSITIVE)
        };
        self.signals.iter().zip(&most).map(size).collect()
    }
}
