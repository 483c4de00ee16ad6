//! Authentication of TCP clients: TLS, certificates, tokens.
//!
//! A Unix socket requires nothing: its mode admits its owner alone.

use super::peer::{Peer, PeerIdentity};
use super::tokens::{TokenError, Tokens, is_open, sha256};
use bimorph_wire::tls::{ALPN, CertificateFiles, PemError, authorities, certificates, provider, validity};
use std::io;
use std::path::PathBuf;
use std::sync::{Arc, PoisonError, RwLock};
use std::time::{SystemTime, UNIX_EPOCH};
use thiserror::Error;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio_rustls::TlsAcceptor;
use tokio_rustls::rustls::server::{VerifierBuilderError, WebPkiClientVerifier};
use tokio_rustls::rustls::{self, ServerConfig};
use tokio_rustls::server::TlsStream;
use tonic::Status;
use tonic::codegen::http::HeaderMap;

/// Files by which a server knows itself and its clients; each may be left out.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct GuardFiles {
    /// The server's certificate and those up to its authority (PEM): every TCP address speaks TLS.
    pub certificate: Option<PathBuf>,
    /// The key of that certificate (PEM).
    pub key: Option<PathBuf>,
    /// Certificates (PEM) of the authorities of clients: each must have a certificate of one of them.
    pub client_authority: Option<PathBuf>,
    /// Tokens, a line for each client, `TOKEN` or `NAME TOKEN`: every call over TCP must show one.
    pub token_file: Option<PathBuf>,
}

/// Why a server cannot guard itself.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum GuardError {
    /// A file of certificates or keys.
    #[error(transparent)]
    Pem(#[from] PemError),
    /// The token file.
    #[error(transparent)]
    Tokens(#[from] TokenError),
    /// A certificate without its key, or a key without its certificate.
    #[error("a certificate and its key go together: --tls-cert and --tls-key")]
    Unpaired,
    /// Clients are to show certificates, and the server has none.
    #[error("--tls-client-ca requires certificates of clients, which needs TLS: --tls-cert and --tls-key")]
    NoCertificate,
    /// The certificate and the key, or the authority, are refused.
    #[error("certificate {path}: {reason}", path = path.display())]
    Refused {
        /// The certificate.
        path: PathBuf,
        /// The fault.
        reason: String,
    },
}

/// Summary of a server's files: a line for each.
///
/// # Errors
/// [`GuardError`].
pub fn inspect(files: &GuardFiles) -> Result<Vec<String>, GuardError> {
    let guard = LoadedFiles::of(files)?;
    let mut found = Vec::new();
    if let Some(path) = &files.certificate {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs();
        let times = certificates("certificate", path)?.first().and_then(|certificate| validity(certificate));
        let days = |seconds: u64| seconds / 86_400;
        found.push(match times {
            Some([_, until]) if until <= now => {
                let reason = format!("it has expired {} days ago; get a new one", days(now - until));
                return Err(GuardError::Refused { path: path.clone(), reason });
            }
            Some([from, _]) if from > now => {
                let reason = format!("it holds in {} days only; is the clock right?", days(from - now) + 1);
                return Err(GuardError::Refused { path: path.clone(), reason });
            }
            Some([_, until]) => format!("certificate for {} more days", days(until - now)),
            None => "a certificate".to_owned(),
        });
    }
    if guard.certified {
        found.push("clients show certificates".to_owned());
    }
    if let Some(tokens) = &guard.tokens {
        found.push(format!("{} tokens", tokens.len()));
    }
    let open = [&files.key, &files.token_file].into_iter().flatten().filter(|file| is_open(file));
    found.extend(open.map(|file| format!("others can read {}: chmod 600", file.display())));
    Ok(found)
}

/// Authentication that clients need.
#[derive(Default)]
pub(super) struct Guard {
    files: GuardFiles,
    read: RwLock<Arc<LoadedFiles>>,
}

/// Content of the files at their last read.
#[derive(Default)]
struct LoadedFiles {
    tls: Option<Arc<ServerConfig>>,
    certified: bool,
    tokens: Option<Tokens>,
}

impl LoadedFiles {
    fn of(files: &GuardFiles) -> Result<Self, GuardError> {
        let tls = match (&files.certificate, &files.key) {
            (Some(certificate), Some(key)) => {
                let pair = CertificateFiles::read(certificate, key)?;
                let refused = |reason: String| GuardError::Refused { path: certificate.clone(), reason };
                Some(Arc::new(config(pair, files, refused)?))
            }
            (None, None) if files.client_authority.is_some() => return Err(GuardError::NoCertificate),
            (None, None) => None,
            _ => return Err(GuardError::Unpaired),
        };
        let tokens = files.token_file.as_deref().map(Tokens::read).transpose()?;
        for file in [&files.key, &files.token_file].into_iter().flatten() {
            if is_open(file) {
                tracing::warn!(file = %file.display(), "others can read this file: chmod 600");
            }
        }
        if let Some(tokens) = &tokens {
            tracing::info!(tokens = tokens.len(), "calls over TCP must show a token");
        }
        Ok(Self { tls, certified: files.client_authority.is_some(), tokens })
    }
}

impl Guard {
    /// Reads the files.
    ///
    /// # Errors
    /// [`GuardError`].
    pub(super) fn read(files: &GuardFiles) -> Result<Self, GuardError> {
        Ok(Self { files: files.clone(), read: RwLock::new(Arc::new(LoadedFiles::of(files)?)) })
    }

    /// Reads the files again: calls show the new tokens from here on, and new connections have the new certificates. Where a file is wrong,
    /// all stays as it is.
    ///
    /// # Errors
    /// [`GuardError`].
    pub(super) fn reload(&self) -> Result<(), GuardError> {
        let read = Arc::new(LoadedFiles::of(&self.files)?);
        *self.read.write().unwrap_or_else(PoisonError::into_inner) = read;
        Ok(())
    }

    fn now(&self) -> Arc<LoadedFiles> {
        Arc::clone(&self.read.read().unwrap_or_else(PoisonError::into_inner))
    }

    /// Whether TCP addresses speak TLS.
    pub(super) fn speaks_tls(&self) -> bool {
        self.now().tls.is_some()
    }

    /// Whether other machines may be let in: nothing travels in the clear, and not everybody may ask.
    pub(super) fn is_enough(&self) -> bool {
        let now = self.now();
        now.tls.is_some() && (now.certified || now.tokens.is_some())
    }

    /// The peer, if it uses the protocol of this address.
    pub(super) fn hear(&self, presence: &Peer) -> Result<PeerIdentity, Status> {
        match presence.who() {
            PeerIdentity::Plain => Err(Status::unauthenticated("this address speaks TLS: connect with https://")),
            known => Ok(known),
        }
    }

    /// The client of a call, if the server knows it.
    pub(super) fn admit(&self, presence: &Peer, headers: &HeaderMap) -> Result<PeerIdentity, Status> {
        match self.hear(presence)? {
            PeerIdentity::Local => Ok(PeerIdentity::Local),
            known => match &self.now().tokens {
                Some(tokens) => tokens.who(headers).map(PeerIdentity::Named),
                None => Ok(known),
            },
        }
    }

    /// Finds out how a client speaks. Without TLS here, as it likes.
    ///
    /// A client that uses plain HTTP/2 on a TLS address is accepted, so that every call can return an error that says
    /// so.
    pub(super) async fn greet(&self, socket: TcpStream) -> io::Result<(NegotiatedSocket, PeerIdentity)> {
        let Some(tls) = self.now().tls.clone() else {
            return Ok((NegotiatedSocket::Plain(socket), PeerIdentity::Unknown));
        };
        let mut first = [0];
        if socket.peek(&mut first).await? == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        if first == *b"P" {
            return Ok((NegotiatedSocket::Plain(socket), PeerIdentity::Plain));
        }
        match TlsAcceptor::from(tls).accept(socket).into_fallible().await {
            Ok(stream) => {
                let shown = stream.get_ref().1.peer_certificates().and_then(<[_]>::first);
                let who =
                    shown.map_or(PeerIdentity::Unknown, |certificate| PeerIdentity::Certified(sha256(certificate)));
                Ok((NegotiatedSocket::Secure(Box::new(stream)), who))
            }
            Err((error, socket)) => {
                say_goodbye(socket).await;
                Err(error)
            }
        }
    }
}

/// A socket whose client has been understood.
pub(super) enum NegotiatedSocket {
    Plain(TcpStream),
    Secure(Box<TlsStream<TcpStream>>),
}

/// Lets the client read why it was refused: closing with unread bytes would take the alert back.
async fn say_goodbye(mut socket: TcpStream) {
    let mut rest = [0; 1024];
    let _ = socket.shutdown().await;
    for _ in 0..64 {
        match socket.read(&mut rest).await {
            Ok(1..) => {}
            _ => return,
        }
    }
}

fn config(
    pair: CertificateFiles,
    files: &GuardFiles,
    refused: impl Fn(String) -> GuardError,
) -> Result<ServerConfig, GuardError> {
    let error = |error: rustls::Error| refused(error.to_string());
    let builder = ServerConfig::builder_with_provider(provider())
        .with_protocol_versions(&[&rustls::version::TLS13])
        .map_err(error)?;
    let builder = match &files.client_authority {
        None => builder.with_no_client_auth(),
        Some(path) => {
            let roots = Arc::new(authorities(path)?);
            let built = WebPkiClientVerifier::builder_with_provider(roots, provider()).build();
            builder.with_client_cert_verifier(built.map_err(|error: VerifierBuilderError| refused(error.to_string()))?)
        }
    };
    let mut config = builder.with_single_cert(pair.chain, pair.key).map_err(error)?;
    config.alpn_protocols.push(ALPN.to_vec());
    Ok(config)
}
