//! What a client shows a server, as options.

use bimorph::service::access::Access;
use clap::Args;
use std::path::PathBuf;

/// For `https://` and servers that ask for a token.
#[derive(Debug, Args)]
pub(crate) struct AccessArgs {
    /// Authorities to trust at https:// addresses, PEM
    #[arg(long, value_name = "FILE", env = "BIMORPH_CA")]
    ca: Option<PathBuf>,

    /// File with the token to show a server
    #[arg(long, value_name = "FILE", env = "BIMORPH_TOKEN_FILE")]
    token_file: Option<PathBuf>,

    /// Own certificate, for servers that ask for one, PEM
    #[arg(long, value_name = "FILE", env = "BIMORPH_CLIENT_CERT")]
    client_cert: Option<PathBuf>,

    /// Key of the own certificate, PEM
    #[arg(long, value_name = "FILE", env = "BIMORPH_CLIENT_KEY")]
    client_key: Option<PathBuf>,
}

impl AccessArgs {
    pub(crate) fn access(&self) -> Access {
        Access {
            authority: self.ca.clone(),
            token_file: self.token_file.clone(),
            certificate: self.client_cert.clone(),
            key: self.client_key.clone(),
        }
    }
}
