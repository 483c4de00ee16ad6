//! TLS 1.3 by rustls, with one provider of its cryptography that is always named: two in one process would leave rustls
//! without a choice, and a program that loads this library may have its own.

use super::access::read;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use thiserror::Error;
use tokio_rustls::rustls::crypto::{CryptoProvider, ring};
use tokio_rustls::rustls::pki_types::pem::PemObject;
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer};
use tokio_rustls::rustls::{self, RootCertStore};

/// What both ends call HTTP/2 in their greeting.
pub(super) const ALPN: &[u8] = b"h2";

/// The provider of everything cryptographic.
pub(super) fn provider() -> Arc<CryptoProvider> {
    Arc::new(ring::default_provider())
}

/// A file of certificates or keys that cannot be used.
#[derive(Debug, Error)]
#[error("{what} {path}: {reason}", path = path.display())]
pub struct PemError {
    /// What it should hold.
    pub what: &'static str,
    /// The file.
    pub path: PathBuf,
    /// What is wrong.
    pub reason: String,
}

/// A certificate file and its key.
pub(super) struct Pair {
    pub(super) chain: Vec<CertificateDer<'static>>,
    pub(super) key: PrivateKeyDer<'static>,
}

impl Pair {
    /// Reads both; whether they belong together is found out by who uses them.
    pub(super) fn read(certificate: &Path, key: &Path) -> Result<Self, PemError> {
        let chain = certificates("certificate", certificate)?;
        let wrong = |reason: String| PemError { what: "key", path: key.to_owned(), reason };
        let text = read(key).map_err(|error| wrong(error.to_string()))?;
        let key = PrivateKeyDer::from_pem_slice(text.as_bytes())
            .map_err(|_| wrong("expected a private key (-----BEGIN PRIVATE KEY-----)".to_owned()))?;
        Ok(Self { chain, key })
    }
}

/// The certificates of a PEM file, at least one.
pub(super) fn certificates(what: &'static str, path: &Path) -> Result<Vec<CertificateDer<'static>>, PemError> {
    let wrong = |reason: String| PemError { what, path: path.to_owned(), reason };
    let text = read(path).map_err(|error| wrong(error.to_string()))?;
    let found: Result<Vec<_>, _> = CertificateDer::pem_slice_iter(text.as_bytes()).collect();
    match found {
        Ok(found) if !found.is_empty() => Ok(found),
        _ => Err(wrong("expected certificates (-----BEGIN CERTIFICATE-----)".to_owned())),
    }
}

/// The authorities of a PEM file.
pub(super) fn authorities(path: &Path) -> Result<RootCertStore, PemError> {
    let mut roots = RootCertStore::empty();
    let (added, _) = roots.add_parsable_certificates(certificates("authority", path)?);
    if added == 0 {
        let reason = "expected certificates of version 3, got none".to_owned();
        return Err(PemError { what: "authority", path: path.to_owned(), reason });
    }
    Ok(roots)
}

/// The error of TLS inside what a socket said.
pub(super) fn inner<'a>(error: &'a (dyn std::error::Error + 'static)) -> Option<&'a rustls::Error> {
    let mut next = Some(error);
    while let Some(error) = next {
        if let Some(found) = error.downcast_ref::<rustls::Error>() {
            return Some(found);
        }
        // an error inside a socket's error is not among its sources
        let inside = error.downcast_ref::<std::io::Error>().and_then(std::io::Error::get_ref);
        next = match inside {
            Some(inside) => Some(inside),
            None => error.source(),
        };
    }
    None
}
