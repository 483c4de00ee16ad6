//! Credentials of a client, as options.

use bimorph::service::credentials::Access;
use clap::Args;
use clap::builder::{OsStringValueParser, TypedValueParser};
use std::path::PathBuf;

/// For `https://` and servers that require a token.
#[derive(Debug, Args)]
pub(crate) struct AccessArgs {
    /// Authorities to trust at https:// addresses, PEM
    #[arg(long, value_name = "FILE", value_parser = path(), env = "BIMORPH_CA")]
    ca: Option<PathBuf>,

    /// File with the token to show a server
    #[arg(long, value_name = "FILE", value_parser = path(), env = "BIMORPH_TOKEN_FILE")]
    token_file: Option<PathBuf>,

    /// Own certificate, for servers that require one, PEM
    #[arg(long, value_name = "FILE", value_parser = path(), env = "BIMORPH_CLIENT_CERT")]
    client_cert: Option<PathBuf>,

    /// Key of the own certificate, PEM
    #[arg(long, value_name = "FILE", value_parser = path(), env = "BIMORPH_CLIENT_KEY")]
    client_key: Option<PathBuf>,
}

/// A path; an empty one says nothing, as an empty variable does.
fn path() -> impl TypedValueParser<Value = PathBuf> {
    OsStringValueParser::new().map(PathBuf::from)
}

impl AccessArgs {
    pub(crate) fn access(&self) -> Access {
        let said = |path: &Option<PathBuf>| path.clone().filter(|path| !path.as_os_str().is_empty());
        Access {
            authority: said(&self.ca),
            token_file: said(&self.token_file),
            certificate: said(&self.client_cert),
            key: said(&self.client_key),
        }
    }
}
