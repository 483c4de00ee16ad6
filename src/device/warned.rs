//! What a circuit is warned of by the states that it accepts, each kind once, and a motion out of step again when that is ten times more: what no
//! trial refuses, and no waveform shows.

use super::session::Session;
use super::states::Snapshot;
use crate::analysis::mesh::{WARNING, told_moving, told_still};
use crate::analysis::statics::OperatingPoint;
use crate::compile::Compiled;
use crate::netlist::Diagnostic;

impl Session {
    /// What this state warns of and none before it did: fingers of combs that go through their other side, beams hotter than
    /// any solid bears, a motion that rings out of step and, in equilibria, gaps along beams in too few pieces and what a linear
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
        let mut told = if state.elapsed == 0.0 { told_still(compiled, point) } else { told_moving(compiled, &point) };
        told.retain(|warning| !self.warned.contains(&warning.code));
        self.warned.extend(told.iter().map(|warning| warning.code.clone()));
        if let Some(mode) = &compiled.lowest {
            let text = self.ringing.tell(mode, compiled.options.tol, state.elapsed, state.shown.values());
            told.extend(text.map(|text| Diagnostic::warning(WARNING, text, "give the model `segments` or a `band`")));
        }
        told
    }
}
