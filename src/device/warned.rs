//! What a circuit is warned of by the states that it accepts, each kind once, and again when it is ten times more: what no trial refuses, and no
//! waveform shows.

use super::growth::held_by_charge;
use super::ports::Answer;
use super::ringing::Accepted;
use super::session::Session;
use super::states::Snapshot;
use crate::analysis::mesh::{WARNING, told_moving, told_still};
use crate::analysis::statics::OperatingPoint;
use crate::compile::Compiled;
use crate::netlist::Diagnostic;

/// Code of the warning that a charge alone holds a mechanism.
const HELD: &str = "W048";

impl Session {
    /// What this state warns of and none before it did, or not a tenth as much: fingers of combs that go through their other side, beams hotter than
    /// any solid bears, a motion that rings out of step and, in equilibria, gaps along beams in too few segments and what a linear
    /// model leaves out.
    pub(super) fn warns(&mut self, compiled: &Compiled, state: &Snapshot) -> Vec<Diagnostic> {
        let electrics = &Self::system(&self.ports.system, compiled).electrics;
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
            true => told_still(compiled, &point),
            false => told_moving(compiled, &point).into_iter().map(|warning| (warning, 1.0)).collect(),
        };
        let mut told: Vec<Diagnostic> =
            found.into_iter().filter_map(|(warning, size)| self.grown(warning, size)).collect();
        if let Some(mode) = &compiled.lowest {
            let (charges, seen) = (self.charges(), Accepted { t: state.elapsed, values: state.shown.values() });
            if let Some((text, n)) = self.ringing.tell(mode, compiled.options.tol, seen, &charges) {
                let text = format!("{text} ({})", self.seen_name(n, compiled));
                told.push(Diagnostic::warning(WARNING, text, "give the model `segments` or a `band`"));
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
            told.extend(self.grown(warning, 1.0));
        }
        told
    }

    /// Which of the values that the circuit sees are charges: their change is a current.
    fn charges(&self) -> Vec<bool> {
        let signals = self.signals.iter().map(|_| false);
        signals.chain(self.ports.answers.iter().map(|answer| *answer == Answer::Current)).collect()
    }

    /// What a value, or the current of a charge behind all values, is called.
    fn seen_name(&self, n: usize, compiled: &Compiled) -> String {
        let (signals, ports) = (self.signals.len(), self.ports.len());
        let port = |n: usize| match self.opened.ports.get(n) {
            Some(name) => name.clone(),
            None => compiled.parts.system.electrics.names[self.ports.sources[n]].clone(),
        };
        match n {
            n if n < signals => format!("signal `{}`", self.opened.signals[n]),
            n if n < signals + ports => format!("port `{}`", port(n - signals)),
            n => format!("the current of port `{}`", port(n - 2 * signals - ports)),
        }
    }

    /// A warning, where it was not given before, or where it told of less than a tenth of this.
    fn grown(&mut self, warning: Diagnostic, size: f64) -> Option<Diagnostic> {
        match self.warned.iter_mut().find(|(code, _)| *code == warning.code) {
            Some((_, told)) if size < 10.0 * *told => return None,
            Some((_, told)) => *told = size,
            None => self.warned.push((warning.code.clone(), size)),
        }
        Some(warning)
    }
}
