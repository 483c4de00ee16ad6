//! What a circuit is warned of by the states that it accepts, each kind once, and again when it is ten times more: what no trial refuses, and no
//! waveform shows.

use super::session::Session;
use super::states::Snapshot;
use crate::analysis::mesh::{WARNING, told_moving, told_still};
use crate::analysis::statics::OperatingPoint;
use crate::compile::Compiled;
use crate::netlist::Diagnostic;

impl Session {
    /// What this state warns of and none before it did, or not a tenth as much: fingers of combs that go through their other side, beams hotter than
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
        let found = match state.elapsed == 0.0 {
            true => told_still(compiled, point),
            false => told_moving(compiled, &point).into_iter().map(|warning| (warning, 1.0)).collect(),
        };
        let mut told: Vec<Diagnostic> =
            found.into_iter().filter_map(|(warning, size)| self.grown(warning, size)).collect();
        if let Some(mode) = &compiled.lowest {
            let text = self.ringing.tell(mode, compiled.options.tol, state.elapsed, state.shown.values());
            told.extend(text.map(|text| Diagnostic::warning(WARNING, text, "give the model `segments` or a `band`")));
        }
        told
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
