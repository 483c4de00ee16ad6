//! `bimorph jobs`: sweeps on a server, while clients come and go.

use super::failure::Failure;
use super::output::print;
use super::remote::{ConnectionArgs, failure, follow};
use super::{progress, sweep_output};
use bimorph::service::client::JobStatus;
use clap::{Args, Subcommand};
use std::path::PathBuf;
use std::time::{SystemTime, UNIX_EPOCH};

/// See and steer the sweeps that run on a server.
///
/// `bimorph sweep --to` starts them; they run there whether or not anybody waits.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    bimorph serve --listen unix:///tmp/bimorph.sock\n  \
    bimorph sweep examples/bank/bank.net --param wh=1.8u:2.2u:2001 --signals yoke.y --to unix:///tmp/bimorph.sock --detach\n  \
    bimorph jobs list --to unix:///tmp/bimorph.sock\n  \
    bimorph jobs attach JOB --to unix:///tmp/bimorph.sock --out w.csv     # JOB as `sweep --detach` or `list` print it")]
pub(crate) struct JobsCommand {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Your jobs, the last one first
    List(ServerArgs),
    /// Wait for the rows of a job and write its table; of one that ended early, the rows that it has
    Attach(Attach),
    /// Stop a job; its rows stay
    Cancel(JobArgs),
    /// Stop a job, if it is running, and remove it from the server
    Delete(JobArgs),
}

#[derive(Debug, Args)]
struct ServerArgs {
    /// The server: unix:///path, host:port or https://host:port
    #[arg(long, value_name = "URI")]
    to: String,

    #[command(flatten)]
    reach: ConnectionArgs,
}

#[derive(Debug, Args)]
struct JobArgs {
    /// The job: jobs/ and 32 digits
    name: String,

    #[command(flatten)]
    at: ServerArgs,
}

#[derive(Debug, Args)]
struct Attach {
    #[command(flatten)]
    job: JobArgs,

    /// Write the table to a .csv file [default: standard output]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

impl JobsCommand {
    pub(crate) fn run(&self) -> Result<(), Failure> {
        match &self.action {
            Action::List(at) => list(at),
            Action::Attach(attach) => attach.run(),
            Action::Cancel(JobArgs { name, at }) => Ok(at.reach.client(&at.to)?.cancel_job(name)?),
            Action::Delete(JobArgs { name, at }) => Ok(at.reach.client(&at.to)?.delete_job(name)?),
        }
    }
}

impl Attach {
    fn run(&self) -> Result<(), Failure> {
        sweep_output::check(self.out.as_ref())?;
        let JobArgs { name, at } = &self.job;
        let bar = progress::bar("sweep");
        let followed = follow(&mut at.reach.client(&at.to)?, &at.to, name, &bar);
        bar.finish_and_clear();
        let (table, job) = followed?;
        let part = (!job.part.is_empty()).then_some(job.part.as_str());
        sweep_output::deliver(self.out.as_deref(), &table, part)?;
        stderr_line!("{}", sweep_output::summary(&table, ""));
        match failure(&at.to, &job) {
            Some(failure) => Err(failure),
            None => sweep_output::nothing(&table),
        }
    }
}

fn list(at: &ServerArgs) -> Result<(), Failure> {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs();
    let now = i64::try_from(now).unwrap_or(i64::MAX);
    let mut text = format!("{:37}  {:9}  {:>17}  {:>9}  netlist\n", "job", "state", "rows", "age");
    for job in at.reach.client(&at.to)?.jobs()? {
        let JobStatus { name, state, points, rows, submitted, netlist, .. } = job;
        let (rows, age) = (format!("{rows}/{points}"), age(now.saturating_sub(submitted)));
        text += &format!("{name:37}  {state:9}  {rows:>17}  {age:>9}  {netlist}\n");
        if let Some((_, message)) = job.error {
            text += &format!("    {message}\n");
        }
    }
    print(&text)
}

/// A time in words [s].
fn age(seconds: i64) -> String {
    match seconds {
        ..120 => format!("{} s", seconds.max(0)),
        120..7200 => format!("{} min", seconds / 60),
        7200..172_800 => format!("{} h", seconds / 3600),
        _ => format!("{} d", seconds / 86_400),
    }
}
