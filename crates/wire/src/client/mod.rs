//! Blocking clients: a [`RemoteDevice`] for circuits and a [`Client`] for analyses.
//!
//! Both drive a single-threaded runtime of their own, only while a call runs: no thread is started in the host, and a
//! round trip never waits for another thread to be woken. [`TrialConnections`] are for programs in other languages.

mod analyses;
mod device;
#[cfg(feature = "server")]
mod driven_runtime;
mod jobs;
#[cfg(feature = "server")]
mod line;
mod link;
mod replay;
mod reply_checks;
mod reply_order;
mod retry;
mod runs;
#[cfg(feature = "tls")]
mod secure;
mod sweeps;
mod trial_stream;

pub use analyses::{Client, ClientError, RemoteTransient};
pub use device::RemoteDevice;
pub use jobs::{JobStatus, Submission};
#[cfg(feature = "server")]
pub use line::{TrialChannel, TrialConnections};
