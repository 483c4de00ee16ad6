//! Where a server listens and a client connects: `unix:///path`, `host:port` or, with TLS, `https://host:port`.

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
    /// A TCP address with TLS.
    Tls {
        /// The host as written: the name that the server's certificate must have.
        host: String,
        /// Where it is.
        socket: SocketAddr,
    },
}

/// Text that is no address.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "\"{text}\" is no server address: {detail}; expected unix:///path, host:port (127.0.0.1:50051) or https://host:port"
)]
pub struct AddressError {
    /// The given text.
    pub text: String,
    /// The fault.
    pub detail: String,
}

impl FromStr for Address {
    type Err = AddressError;

    /// `unix:///path` (or `unix:path`), `host:port`, `http://host:port`, `grpc://host:port`, `https://host:port` (or
    /// `https:host:port`, as decks have it).
    fn from_str(text: &str) -> Result<Self, AddressError> {
        let error = |detail: &str| AddressError { text: text.to_owned(), detail: detail.to_owned() };
        if let Some(path) = text.strip_prefix("unix:") {
            let path = path.strip_prefix("//").unwrap_or(path);
            return if path.is_empty() { Err(error("no path")) } else { Ok(Self::Unix(path.into())) };
        }
        if let Some(place) = text.strip_prefix("https:") {
            let place = place.strip_prefix("//").unwrap_or(place);
            let place = place.strip_suffix('/').unwrap_or(place);
            let socket = find(place).map_err(|detail| error(&detail))?;
            let host = place.rsplit_once(':').map_or(place, |(host, _)| host);
            let host = host.trim_start_matches('[').trim_end_matches(']').to_owned();
            return Ok(Self::Tls { host, socket });
        }
        let host = ["http://", "grpc://"].iter().find_map(|scheme| text.strip_prefix(scheme)).unwrap_or(text);
        let host = host.strip_suffix('/').unwrap_or(host);
        if host.contains("://") || host.starts_with('/') {
            return Err(error("unknown scheme"));
        }
        find(host).map(Self::Tcp).map_err(|detail| error(&detail))
    }
}

/// Where `host:port` is.
fn find(host: &str) -> Result<SocketAddr, String> {
    if let Ok(address) = host.parse() {
        return Ok(address);
    }
    let mut found = host.to_socket_addrs().map_err(|reason| reason.to_string())?;
    found.next().ok_or_else(|| "the host has no address".to_owned())
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unix(path) => write!(f, "unix://{}", path.display()),
            Self::Tcp(address) => write!(f, "{address}"),
            Self::Tls { host, socket } if host.contains(':') => write!(f, "https://[{host}]:{}", socket.port()),
            Self::Tls { host, socket } => write!(f, "https://{host}:{}", socket.port()),
        }
    }
}

impl Address {
    /// The form a gRPC client takes.
    pub fn uri(&self) -> String {
        match self {
            Self::Unix(_) | Self::Tls { .. } => self.to_string(),
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
            ("https://localhost:7/", "https://localhost:7"),
            ("https:127.0.0.1:7", "https://127.0.0.1:7"),
            ("https://[::1]:7", "https://[::1]:7"),
        ] {
            let address: Address = text.parse().expect("an address");
            assert_eq!(address.to_string(), shown);
            assert_eq!(address.uri().parse(), Ok(address));
        }
    }

    #[test]
    fn others_say_what_was_expected() {
        for text in
            ["", "unix://", "https://127.0.0.1", "ftp://127.0.0.1:1", "/tmp/x.sock", "127.0.0.1", "127.0.0.1:99999"]
        {
            let error = text.parse::<Address>().expect_err(text).to_string();
            assert!(error.contains("unix:///path"), "{error}");
        }
    }
}
