//! ngspice code model for Bimorph: an electro-mechanical netlist as one more `A` device.
//!
//! ngspice loads this library as an XSPICE code model, without its headers and whatever its version (39 to 47) and
//! build flags. A deck then reads
//!
//! ```text
//! .model bank bimorph(file="bank.net" ports=["heat" "sense"] monitors=["yoke.y:1e6" "b1.hot.T"])
//! A1 %gd [hot 0 sense 0] %v [y t] bank
//! ```
//!
//! # Layout
//! Modules that know ngspice's memory: `abi` has the structures, [`layout`] detects the host, `table` has the
//! declarations of the plug-in, and `exports` the symbols. `host` has the host's functions, `call` the data of one
//! call, `circuit` its circuit, and `query_table` the quantities that can be queried by name. Between the two sides
//! stand `callbacks`, `instance_setup` and `respond`, with the `registry` of instances. Modules independent of ngspice:
//! [`model_card`], [`settings`], [`deck_options`] and `names` read the `.model` line, and [`opener`] opens the device.
//! [`instance`] has requests and outcomes, [`companion`] converts charges to currents, [`bimorph::device::scale`] volts
//! to micrometres, and [`history`] stores accepted points.
//!
//! This crate and `clients/c` are the only ones of the project with `unsafe` code; each block says why it holds.

#![deny(unsafe_op_in_unsafe_fn)]
#![warn(clippy::undocumented_unsafe_blocks)]

mod abi;
mod alternation;
mod call;
mod callbacks;
mod circuit;
pub mod companion;
pub mod deck_options;
pub mod evaluation;
mod exports;
mod failed_evaluations;
pub mod history;
mod host;
pub mod instance;
mod instance_setup;
pub mod layout;
pub mod model_card;
mod names;
mod noise;
pub mod opener;
mod panics;
mod parameters;
mod queries;
mod query_table;
mod registry;
mod reported;
mod respond;
pub mod settings;
mod table;
mod trace;

pub use opener::{Opener, set_opener};
