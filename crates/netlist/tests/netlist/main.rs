//! Contracts of the netlist languages: rules, elements, messages, includes, and the page that describes them.

mod diagnostics;
mod document;
mod elements;
mod examples;
mod include;
mod language;
mod process;
mod properties;
#[cfg(feature = "lua")]
mod sugar3;

/// Root of the repository.
const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
