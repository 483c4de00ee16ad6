//! TLS 1.3 by rustls, with one provider of its cryptography that is always named: two in one process would leave rustls
//! without a choice, and a program that loads this library may have its own.

use super::credentials::read;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use thiserror::Error;
use tokio_rustls::rustls::crypto::{CryptoProvider, ring};
use tokio_rustls::rustls::pki_types::pem::PemObject;
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer};
use tokio_rustls::rustls::{self, RootCertStore};

/// Protocol name of HTTP/2 in the TLS handshake.
pub const ALPN: &[u8] = b"h2";

/// The provider of everything cryptographic.
pub fn provider() -> Arc<CryptoProvider> {
    Arc::new(ring::default_provider())
}

/// A file of certificates or keys that cannot be used.
#[derive(Debug, Error)]
#[error("{what} {path}: {reason}", path = path.display())]
pub struct PemError {
    /// The expected content.
    pub what: &'static str,
    /// The file.
    pub path: PathBuf,
    /// The fault.
    pub reason: String,
}

/// A certificate file and its key.
pub struct CertificateFiles {
    /// The certificate, then those that signed it.
    pub chain: Vec<CertificateDer<'static>>,
    /// Its key.
    pub key: PrivateKeyDer<'static>,
}

impl CertificateFiles {
    /// Reads both; whether they match is checked on use.
    pub fn read(certificate: &Path, key: &Path) -> Result<Self, PemError> {
        let chain = certificates("certificate", certificate)?;
        let wrong = |reason: String| PemError { what: "key", path: key.to_owned(), reason };
        let text = read(key).map_err(|error| wrong(error.to_string()))?;
        let key = PrivateKeyDer::from_pem_slice(text.as_bytes())
            .map_err(|_| wrong("expected a private key (-----BEGIN PRIVATE KEY-----)".to_owned()))?;
        Ok(Self { chain, key })
    }
}

/// The certificates of a PEM file, at least one.
pub fn certificates(what: &'static str, path: &Path) -> Result<Vec<CertificateDer<'static>>, PemError> {
    let wrong = |reason: String| PemError { what, path: path.to_owned(), reason };
    let text = read(path).map_err(|error| wrong(error.to_string()))?;
    let found: Result<Vec<_>, _> = CertificateDer::pem_slice_iter(text.as_bytes()).collect();
    match found {
        Ok(found) if !found.is_empty() => Ok(found),
        _ => Err(wrong("expected certificates (-----BEGIN CERTIFICATE-----)".to_owned())),
    }
}

/// The authorities of a PEM file.
pub fn authorities(path: &Path) -> Result<RootCertStore, PemError> {
    let mut roots = RootCertStore::empty();
    let (added, _) = roots.add_parsable_certificates(certificates("authority", path)?);
    if added == 0 {
        let reason = "expected certificates of version 3, got none".to_owned();
        return Err(PemError { what: "authority", path: path.to_owned(), reason });
    }
    Ok(roots)
}

/// The time within which a certificate holds, from 1970 (s); none where that cannot be read.
///
/// The certificate is a sequence whose first part has, after an optional version, number, algorithm and issuer, a sequence of
/// two times (RFC 5280, 4.1).
pub fn validity(certificate: &[u8]) -> Option<[u64; 2]> {
    const SEQUENCE: u8 = 0x30;
    const VERSION: u8 = 0xa0;
    let (_, certificate, _) = element(certificate)?;
    let (_, mut rest, _) = element(certificate)?;
    if *rest.first()? == VERSION {
        rest = element(rest)?.2;
    }
    for _ in ["number", "algorithm", "issuer"] {
        rest = element(rest)?.2;
    }
    let (SEQUENCE, times, _) = element(rest)? else { return None };
    let (kind, from, rest) = element(times)?;
    let (other, until, _) = element(rest)?;
    Some([seconds(kind, from)?, seconds(other, until)?])
}

/// The first element of DER: its tag, its contents, and what follows it.
fn element(der: &[u8]) -> Option<(u8, &[u8], &[u8])> {
    let (&tag, rest) = der.split_first()?;
    let (&short, rest) = rest.split_first()?;
    let (length, rest) = match short {
        0..=0x7f => (usize::from(short), rest),
        0x81..=0x84 => {
            let (bytes, rest) = rest.split_at_checked(usize::from(short & 0x7f))?;
            (bytes.iter().fold(0, |length, byte| length << 8 | usize::from(*byte)), rest)
        }
        _ => return None,
    };
    let (contents, rest) = rest.split_at_checked(length)?;
    Some((tag, contents, rest))
}

/// A time of a certificate, from 1970 (s): YYMMDDHHMMSSZ (from 1950 on) or, with tag 24, YYYYMMDDHHMMSSZ.
fn seconds(tag: u8, text: &[u8]) -> Option<u64> {
    let text = std::str::from_utf8(text).ok()?.strip_suffix('Z')?;
    let (year, rest) = text.split_at_checked(if tag == 24 { 4 } else { 2 })?;
    let number = |text: &str| text.parse::<u64>().ok();
    let year = match number(year)? {
        year if tag == 24 => year,
        year if year < 50 => 2000 + year,
        year => 1900 + year,
    };
    let part = |k: usize| rest.get(2 * k..2 * k + 2).and_then(number);
    let [month, day, hour, minute, second] = [part(0)?, part(1)?, part(2)?, part(3)?, part(4)?];
    // days by Hinnant's days_from_civil: years begin in March
    let (year, month) = if month > 2 { (year, month - 3) } else { (year.checked_sub(1)?, month + 9) };
    let days = 365 * year + year / 4 - year / 100 + year / 400 + (153 * month + 2) / 5 + day.checked_sub(1)?;
    Some(((days.checked_sub(719_468)? * 24 + hour) * 60 + minute) * 60 + second)
}

/// The error of TLS inside what a socket said.
pub fn inner<'a>(error: &'a (dyn std::error::Error + 'static)) -> Option<&'a rustls::Error> {
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

#[cfg(test)]
mod tests {
    //! The times of a certificate are those that `openssl x509 -dates` prints for tests/tls; a truncated one has none.
    use super::*;

    #[test]
    fn certificates_hold_for_a_time() {
        let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/tls"));
        // `date -d "Jan 1 00:00:00 2020 GMT" +%s`, and so on
        for (name, from, until) in
            [("expired.pem", 1_577_836_800, 1_609_459_200), ("server.pem", 1_735_689_600, 4_891_363_200)]
        {
            let chain = certificates("certificate", &folder.join(name)).expect("certificates");
            assert_eq!(validity(&chain[0]), Some([from, until]), "{name}");
            for cut in 0..100 {
                let _ = validity(&chain[0][..cut]);
            }
        }
        assert_eq!(validity(b""), None);
    }
}
