//! Decks run by ngspice with the plug-in loaded. Skipped aloud where ngspice is missing.

mod analyses;
mod analytic;
mod around;
mod charge;
mod check;
mod currents;
mod export;
mod harmonic;
mod held;
#[cfg(feature = "remote")]
mod liar;
mod lines;
mod look;
#[cfg(feature = "remote")]
mod lying;
mod measure;
mod models;
mod noise;
mod ports;
#[cfg(feature = "remote")]
mod remote;
mod steps;
mod support;
mod syntax;
mod versions;
mod warned;
