//! The client's end of TLS.

use crate::credentials::{Access, AccessError};
use crate::tls::{ALPN, CertificateFiles, PemError, authorities, inner, provider};
use hyper_util::rt::TokioIo;
use std::future::Future;
use std::io;
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;
use tokio::io::AsyncBufReadExt;
use tokio::net::TcpStream;
use tokio_rustls::TlsConnector;
use tokio_rustls::client::TlsStream;
use tokio_rustls::rustls::pki_types::ServerName;
use tokio_rustls::rustls::{self, AlertDescription, CertificateError, ClientConfig};
use tonic::codegen::Service;
use tonic::codegen::http::Uri;

impl From<PemError> for AccessError {
    fn from(error: PemError) -> Self {
        Self::File { what: error.what, path: error.path, reason: error.reason }
    }
}

/// How long the settings of a server, which it sends without being asked, are waited for.
const FIRST_WORDS: Duration = Duration::from_secs(2);

/// Opens connections to one address.
#[derive(Clone)]
pub(super) struct Connect {
    config: Arc<ClientConfig>,
    name: ServerName<'static>,
    socket: SocketAddr,
}

impl Connect {
    /// To a server that has a certificate for `host`.
    pub(super) fn new(host: &str, socket: SocketAddr, access: &Access) -> Result<Self, AccessError> {
        let roots = authorities(access.authority.as_deref().ok_or(AccessError::NoAuthority)?)?;
        let builder = ClientConfig::builder_with_provider(provider())
            .with_protocol_versions(&[&rustls::version::TLS13])
            .map_err(|error| AccessError::NoTls(error.to_string()))?
            .with_root_certificates(roots);
        let mut config = match (&access.certificate, &access.key) {
            (Some(certificate), Some(key)) => {
                let CertificateFiles { chain, key } = CertificateFiles::read(certificate, key)?;
                builder.with_client_auth_cert(chain, key).map_err(|error| AccessError::File {
                    what: "certificate",
                    path: certificate.clone(),
                    reason: error.to_string(),
                })?
            }
            (None, None) => builder.with_no_client_auth(),
            _ => return Err(AccessError::Unpaired),
        };
        config.alpn_protocols.push(ALPN.to_vec());
        let name = ServerName::try_from(host.to_owned()).map_err(|error| AccessError::NoTls(error.to_string()))?;
        Ok(Self { config: Arc::new(config), name, socket })
    }
}

impl Service<Uri> for Connect {
    type Response = TokioIo<TlsStream<TcpStream>>;
    type Error = io::Error;
    type Future = Pin<Box<dyn Future<Output = io::Result<Self::Response>> + Send>>;

    fn poll_ready(&mut self, _: &mut Context<'_>) -> Poll<io::Result<()>> {
        Poll::Ready(Ok(()))
    }

    fn call(&mut self, _: Uri) -> Self::Future {
        let Self { config, name, socket } = self.clone();
        Box::pin(async move {
            let tcp = TcpStream::connect(socket).await?;
            tcp.set_nodelay(true)?;
            let secured = async {
                let mut secured = TlsConnector::from(config).connect(name, tcp).await?;
                // with TLS 1.3 the client is done before the server has checked its certificate
                let _ = tokio::time::timeout(FIRST_WORDS, secured.fill_buf()).await.unwrap_or(Ok(&[]))?;
                Ok(secured)
            };
            let secured = secured.await.map_err(|error: io::Error| refused(&error).map_or(error, io::Error::other))?;
            Ok(TokioIo::new(secured))
        })
    }
}

/// Fault reported by TLS, with a remedy; `None` for another error.
pub(super) fn refused(error: &(dyn std::error::Error + 'static)) -> Option<String> {
    let error = inner(error)?;
    Some(match error {
        rustls::Error::InvalidCertificate(CertificateError::Expired | CertificateError::ExpiredContext { .. }) => {
            format!("the server's certificate has expired ({error}); it needs a new one")
        }
        rustls::Error::InvalidCertificate(CertificateError::UnknownIssuer) => {
            "the server's certificate is not of the authority that is trusted here (--ca, BIMORPH_CA)".to_owned()
        }
        rustls::Error::InvalidCertificate(
            CertificateError::NotValidForName | CertificateError::NotValidForNameContext { .. },
        ) => format!("the server's certificate is for another name ({error})"),
        rustls::Error::InvalidMessage(_) => {
            "the server speaks no TLS at this address; leave https:// away if that is meant".to_owned()
        }
        rustls::Error::AlertReceived(AlertDescription::CertificateRequired) => {
            "the server requires a client certificate: --client-cert and --client-key, or BIMORPH_CLIENT_CERT and \
             BIMORPH_CLIENT_KEY"
                .to_owned()
        }
        rustls::Error::AlertReceived(AlertDescription::CertificateExpired) => {
            "the server refuses this client's certificate: it has expired".to_owned()
        }
        rustls::Error::AlertReceived(AlertDescription::UnknownCA) => {
            "the server refuses this client's certificate: it is not of an authority that the server trusts".to_owned()
        }
        rustls::Error::AlertReceived(alert) => format!("the server refuses TLS with this client: {alert:?}"),
        other => format!("TLS: {other}"),
    })
}
