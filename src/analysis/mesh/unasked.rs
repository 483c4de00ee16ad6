//! What is known of a mesh of which nobody has asked anything yet: that of a deck, whose voltages come while it runs.

use super::super::modes::modes;
use super::equilibrium;
use super::warnings::{WARNING, beyond};
use crate::compile::Compiled;
use crate::netlist::Diagnostic;

/// Unknowns beyond which nothing is compared: a deck is not to wait for it.
const MOST: usize = 3000;

/// A warning where the equilibrium under the loads of the drawing, without any voltage, or the lowest mode about it may be off by more than
/// the tolerance on this mesh. What voltages do is not known here. None where the mesh holds, is too large to be looked at twice, or where
/// there is no such equilibrium.
pub fn unasked(compiled: &Compiled) -> Option<Diagnostic> {
    if compiled.parts.system.model.unknowns() > MOST {
        return None;
    }
    let still = equilibrium::judged(compiled, &[]).ok().and_then(|(_, error)| error);
    let lowest = modes(compiled, 1, &[]).ok().and_then(|found| found.errors.first().copied().flatten());
    let (what, error) = [("the equilibrium without voltages", still), ("the lowest mode", lowest)]
        .into_iter()
        .filter_map(|(what, error)| Some((what, error?.abs())))
        .max_by(|a, b| a.1.total_cmp(&b.1))?;
    let message = format!("{what}: {}", beyond(compiled.options.tol, Some(error))?);
    Some(Diagnostic::warning(
        WARNING,
        message,
        "give the model `segments` or a `band`; `bimorph cosim --check` compares whole runs",
    ))
}
