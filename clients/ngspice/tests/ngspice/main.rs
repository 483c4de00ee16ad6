//! Decks run by ngspice with the plug-in loaded. Skipped aloud where ngspice is missing.

mod analytic;
mod models;
#[cfg(feature = "remote")]
mod remote;
mod support;
mod syntax;
