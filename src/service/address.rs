//! Where a server listens and a client connects: `unix:///path` or `host:port`.

use std::fmt;
use std::net::{SocketAddr, ToSocketAddrs};
use std::path::PathBuf;
use std::str::FromStr;
use thiserror::Error;

/// A server's address.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Address {
    /// A Unix socket at this path.
    Unix(PathBuf),
    /// A TCP address. Port 0, for a server: any free one.
    Tcp(SocketAddr),
}

/// Text that is no address.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("\"{text}\" is no server address: {detail}; expected unix:///path or host:port (127.0.0.1:50051)")]
pub struct AddressError {
    /// What was given.
    pub text: String,
    /// What is wrong with it.
    pub detail: String,
}

impl FromStr for Address {
    type Err = AddressError;

    /// `unix:///path` (or `unix:path`), `host:port`, `http://host:port`, `grpc://host:port`.
    fn from_str(text: &str) -> Result<Self, AddressError> {
        let error = |detail: &str| AddressError { text: text.to_owned(), detail: detail.to_owned() };
        if let Some(path) = text.strip_prefix("unix:") {
            let path = path.strip_prefix("//").unwrap_or(path);
            return if path.is_empty() { Err(error("no path")) } else { Ok(Self::Unix(path.into())) };
        }
        let host = ["http://", "grpc://"].iter().find_map(|scheme| text.strip_prefix(scheme)).unwrap_or(text);
        let host = host.strip_suffix('/').unwrap_or(host);
        if host.contains("://") || host.starts_with('/') {
            return Err(error("unknown scheme"));
        }
        if let Ok(address) = host.parse() {
            return Ok(Self::Tcp(address));
        }
        let mut found = host.to_socket_addrs().map_err(|reason| error(&reason.to_string()))?;
        found.next().map(Self::Tcp).ok_or_else(|| error("the host has no address"))
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unix(path) => write!(f, "unix://{}", path.display()),
            Self::Tcp(address) => write!(f, "{address}"),
        }
    }
}

impl Address {
    /// The form a gRPC client takes.
    pub fn uri(&self) -> String {
        match self {
            Self::Unix(_) => self.to_string(),
            Self::Tcp(address) => format!("http://{address}"),
        }
    }
}

#[cfg(test)]
mod tests {
    //! Addresses read as documented and print so that they read back.
    use super::*;

    #[test]
    fn every_form_reads_and_prints_back() {
        for (text, shown) in [
            ("unix:///tmp/b.sock", "unix:///tmp/b.sock"),
            ("unix:/tmp/b.sock", "unix:///tmp/b.sock"),
            ("127.0.0.1:0", "127.0.0.1:0"),
            ("http://127.0.0.1:50051/", "127.0.0.1:50051"),
            ("grpc://[::1]:7", "[::1]:7"),
        ] {
            let address: Address = text.parse().expect("an address");
            assert_eq!(address.to_string(), shown);
            assert_eq!(address.uri().parse(), Ok(address));
        }
    }

    #[test]
    fn others_say_what_was_expected() {
        for text in ["", "unix://", "https://127.0.0.1:1", "/tmp/x.sock", "127.0.0.1", "127.0.0.1:99999"] {
            let error = text.parse::<Address>().expect_err(text).to_string();
            assert!(error.contains("unix:///path"), "{error}");
        }
    }
}
