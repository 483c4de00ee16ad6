//! Runs the service: listen, serve, drain, stop.

use super::address::Address;
use super::limits::Limits;
use std::future::Future;
use thiserror::Error;

/// What a server may be told.
pub struct ServeOptions {
    /// Addresses to listen on; at least one. See [`Address`].
    pub listen: Vec<Address>,
    /// Allow TCP addresses that other machines can reach. The service has no passwords and no encryption.
    pub insecure: bool,
    /// What clients may ask for.
    pub limits: Limits,
    /// Called once, when every address accepts connections, with the addresses as bound (port 0 replaced).
    pub ready: Box<dyn FnOnce(&[Address]) + Send>,
}

/// Why a server does not run.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ServeError {
    /// Nothing to listen on.
    #[error("no address to listen on; expected unix:///path or 127.0.0.1:50051")]
    NoAddress,
    /// A TCP address beyond this machine, without [`ServeOptions::insecure`].
    #[error("{address} can be reached from other machines, and the service has no passwords and no encryption; listen \
             on 127.0.0.1 or a Unix socket, or pass --insecure if the network is trusted")]
    NotLoopback {
        /// The address.
        address: Address,
    },
    /// A live server already has this Unix socket.
    #[error("{address} is in use by a running server; stop it or choose another path")]
    InUse {
        /// The address.
        address: Address,
    },
    /// The path of a Unix socket is something else.
    #[error("{address} exists and is not a socket; choose another path")]
    NotASocket {
        /// The address.
        address: Address,
    },
    /// The system refused.
    #[error("cannot listen on {address}: {reason}")]
    Bind {
        /// The address.
        address: Address,
        /// What it said.
        reason: std::io::Error,
    },
    /// No asynchronous runtime.
    #[error("cannot start the server's threads: {0}")]
    Runtime(std::io::Error),
    /// The transport failed while serving.
    #[error("the server stopped: {0}")]
    Transport(String),
}

/// Serves until `shutdown` resolves, then drains for [`Limits::drain`] and cuts what is left.
///
/// # Errors
/// [`ServeError`]; a clean stop is `Ok`.
pub async fn run(options: ServeOptions, shutdown: impl Future<Output = ()> + Send) -> Result<(), ServeError> {
    let _ = (options, shutdown);
    Err(ServeError::NoAddress)
}

/// [`run`] on threads of its own, until SIGINT or SIGTERM: what `bimorph serve` calls.
///
/// # Errors
/// [`ServeError`].
pub fn run_until_signal(options: ServeOptions) -> Result<(), ServeError> {
    let _ = options;
    Err(ServeError::NoAddress)
}
