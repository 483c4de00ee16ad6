//! Decks run by ngspice with the plug-in loaded. Skipped aloud where ngspice is missing.

mod analyses;
mod analytic;
mod charge;
mod charge_held;
mod check;
mod currents;
mod deck_lines;
mod export;
#[cfg(feature = "remote")]
mod faulty_replies;
#[cfg(feature = "remote")]
mod faulty_server;
mod generated_deck;
mod harmonic;
mod measure;
mod models;
mod noise;
mod ports;
mod queries;
mod reduced;
#[cfg(feature = "remote")]
mod remote;
mod steps;
mod support;
mod syntax;
mod versions;
mod warnings;
