//! Options of a server, and reasons why it does not start.

use super::authentication::{GuardError, GuardFiles};
use super::limits::Limits;
use super::settings::Settings;
use super::store::scan::StoreError;
use bimorph_device::Device;
use bimorph_model::compile::CompiledModel;
use bimorph_wire::address::Address;
use std::path::PathBuf;
use std::sync::Arc;
use thiserror::Error;
use tokio::sync::Notify;

/// Options of a server.
pub struct ServeOptions {
    /// Addresses to listen on; at least one. See [`Address`].
    pub listen: Vec<Address>,
    /// Authentication of TCP clients.
    pub guard: GuardFiles,
    /// Allow TCP addresses that other machines can reach without TLS, or without tokens and certificates of clients.
    pub insecure: bool,
    /// Limits of clients.
    pub limits: Limits,
    /// Address of metrics and readiness (HTTP/1.1, TCP): `/metrics`, `/ready`, `/live`; none: nowhere.
    pub metrics: Option<Address>,
    /// Log as JSON, an object a line.
    pub log_json: bool,
    /// Where accepted states are kept, to outlive the server; none: nowhere.
    pub state_dir: Option<PathBuf>,
    /// Do not wait for the disk: states outlive the server, not the machine.
    pub state_unsynced: bool,
    /// Sources of the options, for `Info`; `None`: only the limits are reported.
    pub settings: Option<Settings>,
    /// Whether [`super::until_signal::run_until_signal`] also ends when standard input does: a program that starts a server for itself holds the
    /// other end of a pipe, which the system closes however that program ends.
    pub while_stdin: bool,
    /// Notified, the server reads tokens and certificates again; where a file is wrong, those before stay.
    pub reload: Arc<Notify>,
    /// Called once, when every address accepts connections, with the addresses as bound (port 0 replaced), that of metrics last.
    pub ready: Ready,
}

impl ServeOptions {
    /// For a process that may end with its standard input (`while_stdin`) and reports its addresses.
    #[must_use]
    pub fn with_process(self, while_stdin: bool, ready: Ready) -> Self {
        Self { while_stdin, ready, ..self }
    }
}

/// Receives the bound addresses of a server.
pub type Ready = Box<dyn FnOnce(&[Address]) + Send>;

/// Makes the device of a session.
pub type MakeDevice = fn(Arc<CompiledModel>) -> Box<dyn Device>;

impl Default for ServeOptions {
    fn default() -> Self {
        Self {
            listen: Vec::new(),
            guard: GuardFiles::default(),
            insecure: false,
            limits: Limits::default(),
            metrics: None,
            log_json: false,
            state_dir: None,
            state_unsynced: false,
            settings: None,
            while_stdin: false,
            reload: Arc::default(),
            ready: Box::new(|_| {}),
        }
    }
}

/// Why a server does not run.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ServeError {
    /// Nothing to listen on.
    #[error("no address to listen on; expected unix:///path or 127.0.0.1:50051")]
    NoAddress,
    /// A TCP address beyond this machine, without [`ServeOptions::insecure`].
    #[error(
        "{address} can be reached from other machines: that takes TLS (--tls-cert, --tls-key) and a token for each client \
         (--token-file) or an authority of their certificates (--tls-client-ca); or listen on 127.0.0.1 or a Unix socket, \
         or pass --insecure if the network is trusted"
    )]
    NotLoopback {
        /// The address.
        address: Address,
    },
    /// An `https://` address without a certificate.
    #[error("{address} requires TLS, which takes a certificate and its key: --tls-cert and --tls-key")]
    NoTls {
        /// The address.
        address: Address,
    },
    /// Metrics over something else than TCP.
    #[error("--metrics {address}: expected host:port, which is plain HTTP")]
    Metrics {
        /// The address.
        address: Address,
    },
    /// States cannot be kept.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// Certificates, keys or tokens cannot be used.
    #[error(transparent)]
    Guard(#[from] GuardError),
    /// A running server already has this Unix socket.
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
        /// The system's error.
        reason: std::io::Error,
    },
    /// No asynchronous runtime.
    #[error("cannot start the server's threads: {0}")]
    Runtime(std::io::Error),
    /// The transport failed while serving.
    #[error("the server stopped: {0}")]
    Transport(String),
}

impl Settings {
    /// The options to run a server with these settings.
    pub fn options(self) -> ServeOptions {
        ServeOptions {
            listen: self.listen.clone(),
            guard: GuardFiles {
                certificate: self.tls_cert.clone(),
                key: self.tls_key.clone(),
                client_authority: self.tls_client_ca.clone(),
                token_file: self.token_file.clone(),
            },
            insecure: self.insecure,
            limits: self.limits_of_clients(),
            metrics: self.metrics.clone(),
            log_json: self.log_json,
            state_dir: self.state_dir.clone(),
            state_unsynced: self.state_unsynced,
            settings: Some(self),
            ..ServeOptions::default()
        }
    }
}
