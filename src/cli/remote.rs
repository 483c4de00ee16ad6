//! A server that computes sweeps as jobs.

use super::credentials::AccessArgs;
use super::failure::Failure;
use super::{interrupt, value};
use bimorph::compile::CompileOptions;
use bimorph::jobs::sweep::{SweepProgress, SweepSpec, SweepTable};
use bimorph::netlist::Bundle;
use bimorph::service::client::{Client, ClientError, JobStatus, Submission};
use clap::Args;
use std::time::Duration;

/// How a server is reached.
#[derive(Debug, Args)]
pub(crate) struct ConnectionArgs {
    #[command(flatten)]
    access: AccessArgs,

    /// Longest wait for an answer of the server [s]
    #[arg(long, default_value = "30", value_parser = value::number, allow_negative_numbers = true)]
    deadline: f64,
}

/// How a sweep is computed on a server.
#[derive(Debug, Args)]
pub(crate) struct RemoteSweepArgs {
    /// Run on a server: unix:///path, host:port or https://host:port. Ctrl-C disconnects; the run continues there
    /// (`bimorph jobs`)
    #[arg(long, value_name = "URI")]
    pub(super) to: Option<String>,

    /// Print the name of the job and do not wait for it: `bimorph jobs attach NAME` has its table
    #[arg(long, requires = "to", conflicts_with = "out")]
    pub(super) detach: bool,

    /// Have the job that computes the same, if you have one there
    #[arg(long, requires = "to")]
    share: bool,

    /// Let the server cancel the job when it has had no connection of yours for so long [s] [default: it runs on]
    #[arg(long, requires = "to", value_name = "SECONDS", value_parser = value::number)]
    release_after: Option<f64>,

    #[command(flatten)]
    pub(super) reach: ConnectionArgs,
}

impl ConnectionArgs {
    /// A connection.
    pub(super) fn client(&self, uri: &str) -> Result<Client, Failure> {
        if !(self.deadline > 0.0 && self.deadline < 1e6) {
            return Err(Failure::bad("--deadline", "a time above 0 s", self.deadline.to_string()));
        }
        Ok(Client::connect_with(uri, &self.access.access(), Duration::from_secs_f64(self.deadline))?)
    }
}

impl RemoteSweepArgs {
    /// Starts a job; the connection and its name.
    pub(super) fn submit(
        &self,
        uri: &str,
        spec: &SweepSpec,
        bundle: &Bundle,
        options: &CompileOptions,
    ) -> Result<(Client, String), Failure> {
        let release_after = match self.release_after {
            Some(seconds) if !(1e-3..=1e9).contains(&seconds) => {
                return Err(Failure::bad("--release-after", "a time from 1 ms to 1e9 s", seconds.to_string()));
            }
            seconds => seconds.map(Duration::from_secs_f64),
        };
        let mut client = self.reach.client(uri)?;
        // from here on an interruption prints the name of the job
        interrupt::asked();
        let how = Submission { share: self.share, release_after };
        let name = client.submit(spec, bundle, options, how)?;
        Ok((client, name))
    }

    /// The table of a job. The server removes it afterwards, unless others may have it.
    pub(super) fn forget(&self, client: &mut Client, name: &str) {
        if !self.share {
            // that it is gone already is no error
            let _ = client.delete_job(name);
        }
    }
}

/// Waits for the rows of a job; an interruption or a lost connection prints how to continue.
pub(super) fn follow(
    client: &mut Client,
    uri: &str,
    name: &str,
    bar: &indicatif::ProgressBar,
) -> Result<(SweepTable, JobStatus), Failure> {
    let mut report = |progress: SweepProgress| {
        bar.set_length(progress.points);
        bar.set_position(progress.done);
        !interrupt::asked()
    };
    client.follow(name, &mut report).map_err(|error| {
        let lost = ["Unavailable", "DeadlineExceeded"].contains(&&*error.code);
        if lost || interrupt::asked() {
            let after = "has its table, `cancel` in its place ends it";
            bar.suspend(|| stderr_line!("the sweep continues there: `bimorph jobs attach {name} --to {uri}` {after}"));
        }
        if interrupt::asked() { Failure::Interrupted } else { error.into() }
    })
}

/// Why a job ended without all of its rows; none: it has them.
pub(super) fn failure(uri: &str, job: &JobStatus) -> Option<Failure> {
    let (code, message) = job.error.clone()?;
    let message = format!("{} ended after {} of {} points: {message}", job.name, job.rows, job.points);
    Some(ClientError { address: uri.to_owned(), code, message }.into())
}
