//! Credentials of a client, and the servers that it trusts.

use super::address::Address;
use std::fmt;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Files of a client; each may be left out.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Access {
    /// Certificates (PEM) of the authorities that servers are trusted by; needed for `https://`.
    pub authority: Option<PathBuf>,
    /// A file with the token to show: the last word of its first line that is no comment.
    pub token_file: Option<PathBuf>,
    /// The client's own certificate and those up to its authority (PEM), for servers that require one.
    pub certificate: Option<PathBuf>,
    /// The key of that certificate (PEM).
    pub key: Option<PathBuf>,
}

/// Environment variables of a client: authority, token file, certificate, key.
pub const VARIABLES: [&str; 4] = ["BIMORPH_CA", "BIMORPH_TOKEN_FILE", "BIMORPH_CLIENT_CERT", "BIMORPH_CLIENT_KEY"];

/// Errors of a client's credentials.
#[derive(Debug, Error)]
pub enum AccessError {
    /// A file cannot be read, or holds something else.
    #[error("{what} {path}: {reason}", path = path.display())]
    File {
        /// The expected content.
        what: &'static str,
        /// The file.
        path: PathBuf,
        /// The fault.
        reason: String,
    },
    /// `https://` without anyone to trust.
    #[error(
        "https:// needs the certificates of an authority to trust: --ca FILE or BIMORPH_CA (the authorities of this \
         system are often in /etc/ssl/certs/ca-certificates.crt)"
    )]
    NoAuthority,
    /// A certificate without its key, or a key without its certificate.
    #[error("a client certificate and its key go together: --client-cert and --client-key, or {} and {}", VARIABLES[2], VARIABLES[3])]
    Unpaired,
    /// A token would travel where others can read it.
    #[error("a token is not sent unencrypted to another machine: write https:// before {0}")]
    Unencrypted(String),
    /// Built without TLS.
    #[error("{0} requires TLS, and this build has none (it was built without \"tls\")")]
    NoTls(String),
}

impl Access {
    /// Credentials from the environment: `BIMORPH_CA`, `BIMORPH_TOKEN_FILE`, `BIMORPH_CLIENT_CERT`,
    /// `BIMORPH_CLIENT_KEY`.
    pub fn from_environment() -> Self {
        let [authority, token_file, certificate, key] =
            VARIABLES.map(|name| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from));
        Self { authority, token_file, certificate, key }
    }

    /// The variables that pass them to another process.
    pub fn to_environment(&self) -> Vec<(&'static str, PathBuf)> {
        let files = [&self.authority, &self.token_file, &self.certificate, &self.key];
        VARIABLES.into_iter().zip(files).filter_map(|(name, file)| Some((name, file.clone()?))).collect()
    }

    /// The token to show at `address`. None is shown at a Unix socket, which requires none.
    ///
    /// # Errors
    /// [`AccessError::File`]; [`AccessError::Unencrypted`] where others could read it on its way.
    pub fn token(&self, address: &Address) -> Result<Option<Secret>, AccessError> {
        let Some(path) = &self.token_file else { return Ok(None) };
        match address {
            Address::Unix(_) => return Ok(None),
            Address::Tcp(socket) if !socket.ip().is_loopback() => {
                return Err(AccessError::Unencrypted(address.to_string()));
            }
            _ => {}
        }
        let wrong = |reason: String| AccessError::File { what: "token file", path: path.clone(), reason };
        let text = read(path).map_err(|error| wrong(error.to_string()))?;
        let line = text.lines().map(str::trim).find(|line| !line.is_empty() && !line.starts_with('#'));
        let token = line.and_then(|line| line.split_whitespace().last());
        token.map(|token| Some(Secret(token.to_owned()))).ok_or_else(|| wrong("expected a token, got none".to_owned()))
    }
}

/// Longest file of tokens or certificates (byte).
pub const FILE_BYTES: u64 = 1 << 20;

/// A small text file.
pub fn read(path: &Path) -> std::io::Result<String> {
    use std::io::Read;
    let mut text = String::new();
    let read = std::fs::File::open(path)?.take(FILE_BYTES + 1).read_to_string(&mut text)?;
    if read as u64 > FILE_BYTES {
        return Err(std::io::Error::other(format!("expected at most {FILE_BYTES} bytes")));
    }
    Ok(text)
}

/// A token; it does not show itself.
#[derive(Clone)]
pub struct Secret(pub String);

impl fmt::Debug for Secret {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("…")
    }
}

#[cfg(test)]
mod tests {
    //! A token is the last word of the first line that says something, and goes nowhere unencrypted.
    use super::*;

    #[test]
    fn a_token_is_read_and_kept_private() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("tokens");
        std::fs::write(&file, "# ours\n\n  alice 0123456789abcdef \nbob x\n").expect("written");
        let access = Access { token_file: Some(file.clone()), ..Access::default() };
        let token = |address: &str| access.token(&address.parse().expect("an address"));
        for address in ["127.0.0.1:1", "https://192.0.2.1:1"] {
            let token = token(address).expect("readable").expect("a token");
            assert_eq!((token.0.as_str(), format!("{token:?}").as_str()), ("0123456789abcdef", "…"));
        }
        assert!(token("unix:///x").expect("none is needed").is_none());
        assert!(matches!(token("192.0.2.1:1"), Err(AccessError::Unencrypted(_))));
        std::fs::write(&file, "# nothing\n").expect("written");
        assert!(token("127.0.0.1:1").expect_err("nothing").to_string().contains("tokens: expected a token"));
    }
}
