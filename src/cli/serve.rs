//! `bimorph serve`: the same models for other programs.

use super::failure::Failure;
use bimorph::service::address::Address;
use bimorph::service::guard::GuardFiles;
use bimorph::service::limits::Limits;
use bimorph::service::log;
use bimorph::service::server::{ServeOptions, run_until_signal};
use clap::Args;
use std::path::PathBuf;

/// Serve models over gRPC (bimorph.v1), until interrupted.
///
/// Prints one line "listening on ADDRESS" for each address on standard error once it accepts connections. Health and
/// reflection services are always on. An address that other machines can reach takes TLS, and tokens or certificates of clients.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  bimorph serve --listen unix:///tmp/bimorph.sock\n  \
                        bimorph serve --listen 127.0.0.1:50051 --listen unix:///run/bimorph.sock\n  \
                        bimorph serve --listen 127.0.0.1:0         any free port; the line says which")]
pub(crate) struct Serve {
    /// Address: unix:///path or host:port. Repeatable
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:50051")]
    listen: Vec<String>,

    /// Certificate of this server and those up to its authority, PEM: every TCP address speaks TLS
    #[arg(long, value_name = "FILE")]
    tls_cert: Option<PathBuf>,

    /// Key of the certificate, PEM
    #[arg(long, value_name = "FILE")]
    tls_key: Option<PathBuf>,

    /// Authorities of clients, PEM: each client must have a certificate of one of them
    #[arg(long, value_name = "FILE")]
    tls_client_ca: Option<PathBuf>,

    /// Tokens, a line for each client, TOKEN or NAME TOKEN: every call over TCP must show one
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,

    /// Allow addresses that other machines can reach, whoever may come and whoever may listen
    #[arg(long)]
    insecure: bool,

    /// Most sessions open at once; as --limit sessions=N
    #[arg(long, value_name = "N")]
    max_sessions: Option<String>,

    /// Most connections at once; as --limit connections=N
    #[arg(long, value_name = "N")]
    max_connections: Option<String>,

    /// Set a limit of docs/service.md: bytes as 64M or 2G, times in seconds. Repeatable
    #[arg(long = "limit", value_name = "NAME=VALUE")]
    limits: Vec<String>,

    /// Stop when standard input ends, as it does when the program that started this server ends
    #[arg(long)]
    while_stdin: bool,
}

impl Serve {
    pub(crate) fn run(&self) -> Result<(), Failure> {
        let listen = self.listen.iter().map(|text| text.parse()).collect::<Result<Vec<Address>, _>>()?;
        let ready = |addresses: &[Address]| {
            for address in addresses {
                log::line(&format!("listening on {address}"));
            }
        };
        let options = ServeOptions {
            listen,
            guard: GuardFiles {
                certificate: self.tls_cert.clone(),
                key: self.tls_key.clone(),
                client_authority: self.tls_client_ca.clone(),
                token_file: self.token_file.clone(),
            },
            insecure: self.insecure,
            limits: self.limits()?,
            while_stdin: self.while_stdin,
            ready: Box::new(ready),
        };
        Ok(run_until_signal(options)?)
    }

    fn limits(&self) -> Result<Limits, Failure> {
        let mut limits = Limits::default();
        for text in &self.limits {
            let (name, value) = text
                .split_once('=')
                .ok_or_else(|| Failure::bad("--limit", "NAME=VALUE, as sessions=1000", text.clone()))?;
            limits.set(name, value).map_err(|error| Failure::bad("--limit", "a limit of docs/service.md", error))?;
        }
        for (flag, name, value) in [
            ("--max-sessions", "sessions", &self.max_sessions),
            ("--max-connections", "connections", &self.max_connections),
        ] {
            if let Some(value) = value {
                limits.set(name, value).map_err(|_| Failure::bad(flag, "a whole number above 0", value.clone()))?;
            }
        }
        Ok(limits)
    }
}
