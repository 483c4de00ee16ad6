//! Warnings to a circuit about accepted states, each kind once, and again when it is ten times larger. They concern
//! effects that no trial rejects and no waveform shows.

use super::growth::held_by_charge;
use super::higher_modes::Split;
use super::phase_error::AcceptedState;
use super::session::DeviceSession;
use super::states::Snapshot;
use bimorph_analysis::mesh::{WARNING, operating_point_warnings, transient_warnings};
use bimorph_analysis::readout::ports::PortResponse;
use bimorph_analysis::statics::OperatingPoint;
use bimorph_base::Diagnostic;
use bimorph_model::compile::CompiledModel;

/// Code of the warning that a charge alone holds a mechanism.
const HELD: &str = "W048";

impl DeviceSession {
    /// New warnings of this state, or warnings ten times larger than before. They concern combs whose fingers pass
    /// their other side, beams hotter than any solid bears, and phase errors of a free oscillation. In equilibria they
    /// also concern gaps along beams with too few segments, and omissions of a linear model.
    pub(super) fn warns(&mut self, compiled: &CompiledModel, state: &Snapshot) -> Vec<Diagnostic> {
        let own = self.ports.system.clone();
        let system = Self::system(&own, compiled);
        let electrics = &system.electrics;
        let mut drive = electrics.drive();
        electrics.apply(&state.sources, &state.rise, &mut drive);
        // what is given to other ports than electrical ones stands behind the sources of the drawing
        let drawn = compiled.parts.system.electrics.sources().min(state.sources.len());
        let point = OperatingPoint {
            q: state.q.clone(),
            sources: state.sources[..drawn].to_vec(),
            rise: state.rise.clone(),
            volts: drive.volts,
            ..OperatingPoint::default()
        };
        let found = match state.elapsed == 0.0 {
            true => operating_point_warnings(compiled, &point),
            false => transient_warnings(compiled, &point).into_iter().map(|warning| (warning, 1.0)).collect(),
        };
        let mut reported: Vec<Diagnostic> =
            found.into_iter().filter_map(|(warning, size)| self.grown(warning, size)).collect();
        for (warning, size) in self.reduction_warnings(compiled, system, state) {
            reported.extend(self.grown(warning, size));
        }
        if let Some(mode) = &compiled.lowest {
            let (charges, seen) = (self.charges(), AcceptedState { t: state.elapsed, values: state.shown.values() });
            let model = &compiled.parts.system.model;
            let rates: Vec<f64> =
                compiled.higher.iter().map(|mode| model.mass_product(&mode.shape, &state.v)).collect();
            let (sources, signals) = (&self.ports.sources, self.signals.len());
            let volts = system.gap_voltages(&state.q, &point.volts);
            let coupling = |mode: usize, n: usize| -> f64 {
                let port = sources[n - signals];
                let of = |(g, volts): (usize, &f64)| match electrics.gap_rows[(g, port)] * volts {
                    0.0 => 0.0,
                    volts => volts * system.capacitance_slope(g, &state.q, &compiled.higher[mode].shape),
                };
                volts.iter().enumerate().map(of).sum()
            };
            let step = state.next_step.min(state.shown.last_step());
            let split = Split { modes: &compiled.higher, rates: &rates, step, coupling: &coupling };
            if let Some((text, n)) = self.ringing.report(mode, compiled.options.errors(), seen, &charges, &split) {
                let text = format!("{text} ({})", self.seen_name(n, compiled));
                reported.push(Diagnostic::warning(WARNING, text, "give the model `segments` or a `band`"));
            }
        }
        if state.elapsed > 0.0
            && let Some(seconds) = self.growth.held()
        {
            let warning = Diagnostic::warning(
                HELD,
                held_by_charge(seconds),
                "a voltage source in place of the charge would close or open the gap",
            );
            reported.extend(self.grown(warning, 1.0));
        }
        reported
    }

    /// Takes the monitors of accepted states and the codes of warnings of an earlier session of the same states.
    pub(super) fn continues(&mut self, earlier: &mut Self) {
        self.warned = std::mem::take(&mut earlier.warned);
        self.ringing = std::mem::take(&mut earlier.ringing);
        if let (Some(own), Some(earlier)) = (&mut self.reduction, &mut earlier.reduction) {
            own.error = std::mem::take(&mut earlier.error);
        }
    }

    /// Which of the values that the circuit sees are charges: their change is a current.
    fn charges(&self) -> Vec<bool> {
        let signals = self.signals.iter().map(|_| false);
        signals.chain(self.ports.answers.iter().map(|answer| *answer == PortResponse::Current)).collect()
    }

    /// Name of a value, or of the current of a charge after all values.
    fn seen_name(&self, n: usize, compiled: &CompiledModel) -> String {
        let (signals, ports) = (self.signals.len(), self.ports.len());
        match n {
            n if n < signals => format!("signal `{}`", self.opened.signals[n]),
            n if n < signals + ports => format!("port `{}`", self.port_name(n - signals, compiled)),
            n => format!("the current of port `{}`", self.port_name(n - 2 * signals - ports, compiled)),
        }
    }

    /// The warning, if it is new or ten times larger than before.
    fn grown(&mut self, warning: Diagnostic, size: f64) -> Option<Diagnostic> {
        match self.warned.iter_mut().find(|(code, _)| *code == warning.code) {
            Some((_, reported)) if size < 10.0 * *reported => return None,
            Some((_, reported)) => *reported = size,
            None => self.warned.push((warning.code.clone(), size)),
        }
        Some(warning)
    }
}
