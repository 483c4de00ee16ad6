//! ngspice on a deck with the plug-in loaded.
//!
//! | file | what it holds |
//! |---|---|
//! | `run` | one run, from its files to its raw file |
//! | `find` | where ngspice and the plug-in are |
//! | `scratch` | the folder of a run, and what ngspice reads at its start |
//! | `includes` | the files that a deck includes: where `.model` lines stand |
//! | `ngspice_output` | output of ngspice, and whether the run was good |
//! | `error` | why it was not |
//! | [`deck`] | a deck around the circuit of a netlist |
//! | `printed` | the `.print` lines of such a deck |
//! | [`check`] | a run compared with a finer one |
//! | [`refined_deck`] | the finer deck |
//! | `oscillation` | frequency and amplitude of what oscillates in both |
//! | [`compare`] | how far two results are apart |
//! | [`osdi`] | the compiler of exported Verilog-A modules |
//!
//! **Architecture invariant.** Below are [`bimorph_results`] and [`bimorph_structure`]. Nothing here solves: ngspice does,
//! through the plug-in.

pub mod check;
pub mod compare;
pub mod deck;
mod error;
mod find;
mod includes;
mod ngspice_output;
mod oscillation;
pub mod osdi;
mod printed;
pub mod refined_deck;
mod run;
mod scratch;
mod spice_names;

pub use error::CosimError;
pub use find::{find_ngspice, find_plugin};
pub use run::{CosimOptions, CosimReport, run};
