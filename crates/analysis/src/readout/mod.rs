//! Quantities that can be read from a model, and places where it can be driven, by name.
//!
//! | file | contents |
//! |---|---|
//! | [`signal`] | quantities of a state: displacements, rates, temperatures, charges, distances |
//! | [`run_signal`] | quantities of a run: those of its states, charges on ports and currents into them |
//! | [`expression`] | sums of quantities with numeric factors |
//! | [`ports`] | ports of the netlist, and those that any node, heated beam or the frame offers |
//! | `stress` | the largest stress on the faces of a beam |
//! | `small_signal` | the effect of a small change at a port on the forces, and on the quantities read from the motion that follows |
//!
//! Analyses and devices stand on it; it knows neither.

mod error;
pub mod expression;
mod port_kind;
pub mod ports;
pub mod run_signal;
pub mod signal;
pub mod small_signal;
pub(crate) mod stress;

pub use error::ReadoutError;
pub use port_kind::PortKind;
