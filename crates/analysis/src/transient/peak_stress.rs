//! The largest stress of a run, at the ends of its steps.

use super::result::StressMaximum;
use crate::readout::signal::{Signal, SignalView};
use bimorph_domains::Ramp;
use bimorph_model::compile::CompiledModel;
use bimorph_solve::time::method::Motion;

/// Code of the warning of a stress above the strength.
const WARNING: &str = "W051";

/// The largest stress so far, in proportion to the strength where layers have one.
pub(super) struct PeakStress<'a> {
    compiled: &'a CompiledModel,
    ramp: &'a Ramp<'a>,
    volts: &'a [f64],
    /// Beams whose stress is followed.
    beams: Vec<usize>,
    rise: Vec<f64>,
    largest: Option<(usize, f64, f64)>,
}

impl<'a> PeakStress<'a> {
    /// Of the beams with a strength; `all`: of every beam that bends.
    pub(super) fn new(compiled: &'a CompiledModel, (ramp, volts): (&'a Ramp<'a>, &'a [f64]), all: bool) -> Self {
        let beams = &compiled.structure.beams;
        let followed = |k: &usize| !compiled.parts.stressed[*k].rigid && (all || beams[*k].material.strength.is_some());
        let rise = vec![0.0; compiled.parts.system.electrics.heating.means()];
        Self { compiled, ramp, volts, beams: (0..beams.len()).filter(followed).collect(), rise, largest: None }
    }

    /// The end of a step at the time `t` (s).
    pub(super) fn step(&mut self, t: f64, motion: &Motion) {
        if self.beams.is_empty() {
            return;
        }
        for (k, rise) in self.rise.iter_mut().enumerate() {
            *rise = self.ramp.rise_at(k, t);
        }
        let view = SignalView { q: &motion.q, v: &motion.v, rise: &self.rise, volts: self.volts };
        let weight = |beam: usize| self.compiled.structure.beams[beam].material.strength.unwrap_or(1e9);
        for &beam in &self.beams {
            let stress = Signal::Stress(beam).value(self.compiled, &view);
            if self.largest.is_none_or(|(of, most, _)| stress / weight(beam) > most / weight(of)) {
                self.largest = Some((beam, stress, t));
            }
        }
    }

    /// The largest of the run.
    pub(super) fn largest(&self) -> Option<StressMaximum> {
        let (beam, stress_pa, t) = self.largest?;
        let beam = &self.compiled.structure.beams[beam];
        Some(StressMaximum { beam: beam.name.clone(), stress_pa, t, strength_pa: beam.material.strength })
    }

    /// The warning where it exceeds the strength.
    pub(super) fn warning(&self) -> Option<String> {
        let StressMaximum { beam, stress_pa, t, strength_pa } = self.largest()?;
        let strength = strength_pa.filter(|strength| stress_pa > *strength)?;
        Some(format!(
            "{WARNING}: the stress in `{beam}` reaches {stress_pa:.3e} Pa at {t:.3e} s, above the strength of its layer, {strength:.3e} Pa; take a wider \
             or longer beam, or a stop before it"
        ))
    }
}
