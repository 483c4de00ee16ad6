//! `bimorph serve`: the same models for other programs.

use super::failure::Failure;
use bimorph::service::address::Address;
use bimorph::service::limits::Limits;
use bimorph::service::log;
use bimorph::service::server::{ServeOptions, run_until_signal};
use clap::Args;

/// Serve models over gRPC (bimorph.v1), until interrupted.
///
/// Prints one line "listening on ADDRESS" for each address on standard error once it accepts connections. Health and
/// reflection services are always on. There are no passwords: keep to a Unix socket or to this machine.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  bimorph serve --listen unix:///tmp/bimorph.sock\n  \
                        bimorph serve --listen 127.0.0.1:50051 --listen unix:///run/bimorph.sock\n  \
                        bimorph serve --listen 127.0.0.1:0         any free port; the line says which")]
pub(crate) struct Serve {
    /// Address: unix:///path or host:port. Repeatable
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:50051")]
    listen: Vec<String>,

    /// Allow addresses that other machines can reach
    #[arg(long)]
    insecure: bool,

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
            insecure: self.insecure,
            limits: Limits::default(),
            while_stdin: self.while_stdin,
            ready: Box::new(ready),
        };
        Ok(run_until_signal(options)?)
    }
}
