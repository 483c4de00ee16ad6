//! Warnings on standard error, each once in a process: warnings of a deck's netlists, and of the states of its parts.

use crate::trace;
use bimorph::netlist::Diagnostic;
use std::io::Write;
use std::sync::{Mutex, PoisonError};

/// Most lines that a process prints.
const MAX_LINES: usize = 200;
/// Most lines about one kind of warning of one instance. Successive analyses repeat much the same warnings, and a
/// growing one is printed again at three times its size.
const MAX_ALIKE: usize = 6;

/// Printed warnings, by instance and code.
static REPORTED: Mutex<Vec<(String, String, String)>> = Mutex::new(Vec::new());

/// Warnings of a netlist. Warnings about an omitted circuit are dropped where the deck includes it.
pub(crate) fn of_netlist(file: &str, has_circuit: bool, warnings: &[Diagnostic]) {
    let of_circuit = |code: &str| has_circuit && ["W013", "W021", "W022"].contains(&code);
    warnings.iter().filter(|w| !of_circuit(&w.code)).for_each(|warning| report(file, warning, MAX_LINES));
}

/// Warnings of what an instance came to.
pub(crate) fn of_instance(name: &str, warnings: &[Diagnostic]) {
    let name = format!("instance {name}");
    warnings.iter().for_each(|warning| report(&name, warning, MAX_ALIKE));
}

fn report(whom: &str, warning: &Diagnostic, most: usize) {
    let mut printed = REPORTED.lock().unwrap_or_else(PoisonError::into_inner);
    let mut alike = printed.iter().filter(|(of, code, _)| of == whom && *code == warning.code);
    if printed.len() == MAX_LINES || alike.clone().count() == most || alike.any(|(.., text)| *text == warning.message) {
        return;
    }
    let line = format!("bimorph: {whom}: warning[{}]: {}", warning.code, warning.message);
    let _ = writeln!(std::io::stderr(), "{line}");
    trace::line(format_args!("{line}"));
    printed.push((whom.to_owned(), warning.code.clone(), warning.message.clone()));
}
