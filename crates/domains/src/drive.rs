//! From source voltages to what a mechanism feels: the voltage of each gap and the free strain of each heated beam, and with
//! them the inputs that are no voltages.

mod electrics;
mod ramp;
mod shock;
mod waveform;

pub use electrics::{Drive, Electrics};
pub use ramp::Ramp;
pub use shock::Shock;
pub use waveform::InputWaveform;
