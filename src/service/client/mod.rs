//! Blocking clients: a [`RemoteDevice`] for circuits and a [`Client`] for analyses.

mod analyses;
mod device;

pub use analyses::{Client, ClientError, RemoteTransient};
pub use device::RemoteDevice;
