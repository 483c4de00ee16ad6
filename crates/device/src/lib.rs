//! The electrical view of a model, which a circuit simulator drives inside its Newton loop.
//!
//! [`Device`] is the contract. The same trait serves the plug-in in process ([`local`]), the gRPC service, and Python.
//!
//! States are immutable and are named by a [`Token`]. A [`Device::trial`] is a pure function of its request: the same
//! request gives the same token and the same bits, and leaves no trace that another trial could see. Nothing has to be
//! rolled back when the circuit rejects a step: it simply asks again from the same parent.
//!
//! Currents flow into the device at a port's positive node. The circuit current of a port is
//! i = [`TrialReply::currents`] + d/dt [`TrialReply::charges`]; the caller differentiates the charges, because only it
//! knows the steps that were accepted.
//!
//! Not every port is electrical ([`PortKind`]). To a mechanical or thermal one a force or heat is given in the place of
//! a voltage, and it answers with a motion or a temperature in the place of a current; it has no charge. Statements
//! about voltages and currents here apply to inputs and outputs of such ports.
//!
//! **Architecture invariant.** Below is [`bimorph_analysis`]. A trial is pure. The device knows no network and no
//! simulator.

mod accepted_warnings;
pub mod agitation;
mod condensed_response;
mod contact_steps;
mod contract;
mod growth;
mod half_cycles;
mod held_motion;
mod higher_modes;
pub mod local;
pub mod macro_step;
mod multirate;
mod noise;
mod output_gradient;
mod phase_error;
pub mod quantities;
mod reply;
pub mod run;
pub mod scale;
mod session;
pub(crate) mod small_signal;
mod snapshot;
pub mod states;
pub mod step_history;
mod trial;

pub use bimorph_analysis::readout::{PortKind, ports};
pub use contract::{
    Agitation, Description, Device, DeviceError, Mode, OpenRequest, PortInfo, SignalInfo, SmallSignal, Status, Token,
    Trial, TrialReply,
};
pub use output_gradient::surroundings;
