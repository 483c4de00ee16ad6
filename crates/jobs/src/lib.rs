//! Sweeps: a grid of parameter values over one analysis.
//!
//! **Architecture invariant.** Below are [`bimorph_analysis`] and [`bimorph_netlist`]. Sweeps know no network: the server
//! and the command run them.

pub mod content;
pub mod durable;
pub mod sweep;
