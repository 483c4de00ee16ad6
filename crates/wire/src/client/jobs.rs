//! Jobs on a server: they run there with and without a connected client, and their rows are fetched from the first
//! missing one.

use super::analyses::{Client, ClientError};
use crate::convert::model::bundle_to_wire;
use crate::convert::options::options_to_wire;
use crate::convert::sweep as wire;
use crate::ids::Ids;
use crate::proto;
use bimorph_base::{Bundle, Setting};
use bimorph_jobs::sweep::journal::JournalRow;
use bimorph_jobs::sweep::{self, SweepProgress, SweepSpec, SweepTable};
use bimorph_model::compile::CompileOptions;
use proto::job_metadata::State;
use std::collections::BTreeSet;
use std::time::Duration;
use tonic::{Code, Status};

/// Jobs of a page.
const PAGE: i32 = 100;

/// How a job is submitted. `Default`: one of its own, which runs on.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Submission {
    /// Identical requests share one job.
    pub share: bool,
    /// It is cancelled when all connections of its client have been closed for so long; none: never.
    pub release_after: Option<Duration>,
}

/// Where a job stands.
#[derive(Debug, Clone, PartialEq)]
pub struct JobStatus {
    /// Its name.
    pub name: String,
    /// "waiting", "running", "done", "cancelled" or "failed".
    pub state: &'static str,
    /// Points that it has to compute.
    pub points: u64,
    /// Rows that it has, failed ones among them.
    pub rows: u64,
    /// Rows with an error.
    pub failed: u64,
    /// When it was submitted, since 1970 (s).
    pub submitted: i64,
    /// Root file of its netlist.
    pub netlist: String,
    /// Of a shard: the content of its table's column `part`.
    pub part: String,
    /// Whether it outlives the server.
    pub kept: bool,
    /// Why it ended without all of its rows: gRPC code and text; none: it did not.
    pub error: Option<(String, String)>,
}

impl JobStatus {
    fn of(job: proto::Job) -> Self {
        let metadata = job.metadata.unwrap_or_default();
        let state = match metadata.state() {
            State::Done => "done",
            State::Cancelled => "cancelled",
            State::Failed => "failed",
            State::Waiting => "waiting",
            State::Running | State::Unspecified => "running",
        };
        let error = match job.result {
            Some(proto::job::Result::Error(error)) => {
                Some((format!("{:?}", Code::from_i32(error.code)), error.message))
            }
            _ => None,
        };
        let provenance = metadata.provenance.unwrap_or_default();
        Self {
            name: job.name,
            state,
            points: metadata.points,
            rows: metadata.rows,
            failed: metadata.failed,
            submitted: metadata.submitted.map_or(0, |time| time.seconds),
            netlist: provenance.netlist,
            part: provenance.part,
            kept: metadata.kept,
            error,
        }
    }
}

/// Rows of a job received so far.
#[derive(Debug, Default)]
struct JobRows {
    parameters: Vec<String>,
    rows: Vec<(Vec<Setting>, JournalRow)>,
    failed: u64,
    points: BTreeSet<usize>,
}

impl Client {
    /// Starts a job; its name. An answer that is lost starts no second one.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn submit(
        &mut self,
        spec: &SweepSpec,
        bundle: &Bundle,
        options: &CompileOptions,
        how: Submission,
    ) -> Result<String, ClientError> {
        if how.release_after.is_some_and(|time| time.is_zero()) {
            let text = "release_after: expected a time above 0 s, or none, got 0";
            return Err(self.error(&Status::invalid_argument(text)));
        }
        let unique = || Ids::default().make().map_err(|status| self.error(&status));
        let request = proto::SubmitJobRequest {
            bundle: Some(bundle_to_wire(bundle)),
            options: Some(options_to_wire(options)),
            task: Some(proto::submit_job_request::Task::Sweep(wire::spec_to_wire(spec))),
            request_id: if how.share { String::new() } else { unique()? },
            share: how.share,
            release_after_s: how.release_after.map_or(0.0, |time| time.as_secs_f64()),
        };
        let job = self.persist(|client, _| client.call(client.link.rpc.clone().submit_job(request.clone())));
        job.map(|job| job.name).map_err(|error| match &*error.code {
            "Unimplemented" => {
                ClientError { message: "it is of an earlier version, which has no jobs".to_owned(), ..error }
            }
            _ => error,
        })
    }

    /// Where a job stands.
    ///
    /// # Errors
    /// [`ClientError`]; code "NotFound" for one that the server does not have (any more).
    pub fn job(&mut self, name: &str) -> Result<JobStatus, ClientError> {
        let request = proto::GetJobRequest { name: name.to_owned() };
        self.call(self.link.rpc.clone().get_job(request)).map(JobStatus::of)
    }

    /// The jobs of this client, the last one first.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn jobs(&mut self) -> Result<Vec<JobStatus>, ClientError> {
        let (mut jobs, mut page_token) = (Vec::new(), String::new());
        loop {
            let request = proto::ListJobsRequest { page_size: PAGE, page_token };
            let page = self.call(self.link.rpc.clone().list_jobs(request))?;
            jobs.extend(page.jobs.into_iter().map(JobStatus::of));
            page_token = page.next_page_token;
            if page_token.is_empty() {
                return Ok(jobs);
            }
        }
    }

    /// Stops a job; its rows stay. Where the connection fails, it is made anew and the job asked to stop once more.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn cancel_job(&mut self, name: &str) -> Result<(), ClientError> {
        let request = proto::CancelJobRequest { name: name.to_owned() };
        self.persist(|client, _| client.call(client.link.rpc.clone().cancel_job(request.clone()))).map(drop)
    }

    /// Stops a job, if it is running, and removes it from the server. If the connection fails, the request is repeated
    /// on a new one. A job that is unknown then counts as removed, since only the reply may have been lost.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn delete_job(&mut self, name: &str) -> Result<(), ClientError> {
        let request = proto::DeleteJobRequest { name: name.to_owned() };
        let mut tries = 0;
        self.persist(|client, _| {
            tries += 1;
            match client.call(client.link.rpc.clone().delete_job(request.clone())) {
                Err(error) if error.code == "NotFound" && tries > 1 => Ok(()),
                answer => answer.map(drop),
            }
        })
    }

    /// Waits for the rows of a job; its table, in grid order, and how it ended: where it ended early, the table has the
    /// rows that there are. `progress` is called for rows as they arrive and may detach, which does not affect the job.
    /// A connection that fails meanwhile is replaced, and the rows continue.
    ///
    /// # Errors
    /// [`ClientError`]; code "Cancelled" when `progress` stopped it, "Unavailable" or "DeadlineExceeded" when the
    /// server was not reached again.
    pub fn follow(
        &mut self,
        name: &str,
        progress: &mut dyn FnMut(SweepProgress) -> bool,
    ) -> Result<(SweepTable, JobStatus), ClientError> {
        let points = self.persist(|client, _| {
            let request = proto::GetJobRequest { name: name.to_owned() };
            client.call(client.link.rpc.clone().get_job(request)).map(|job| job.metadata.unwrap_or_default().points)
        })?;
        let mut all = JobRows::default();
        let job = self.persist(|client, heard| client.hear(name, points, &mut all, heard, progress))?;
        if all.rows.len() as u64 != job.rows {
            let text = format!("the rows of {name} ended after {} of {}", all.rows.len(), job.rows);
            return Err(self.error(&Status::internal(text)));
        }
        Ok((sweep::table_of(all.parameters, all.rows), job))
    }

    fn hear(
        &self,
        name: &str,
        points: u64,
        all: &mut JobRows,
        heard: &mut bool,
        progress: &mut dyn FnMut(SweepProgress) -> bool,
    ) -> Result<JobStatus, ClientError> {
        let first_row = all.rows.len() as u64;
        let request = proto::FetchJobRequest { name: name.to_owned(), first_row, only_finished: false };
        let mut stream = self.call(self.link.rpc.clone().fetch_job(request))?;
        // those announced on this stream
        let mut columns: Vec<proto::JobColumns> = Vec::new();
        while let Some(chunk) = self.next(&mut stream)? {
            *heard = true;
            if !chunk.parameters.is_empty() {
                all.parameters = chunk.parameters;
            }
            columns.extend(chunk.columns);
            if chunk.first_row != all.rows.len() as u64 {
                let text = format!("expected row {}, got {}", all.rows.len(), chunk.first_row);
                return Err(self.error(&Status::internal(text)));
            }
            for row in chunk.rows {
                let found = row.row.unwrap_or_default();
                let read = wire::job_row_from_wire(found, columns.get(row.columns as usize));
                let read =
                    read.map_err(|v| self.error(&Status::internal(format!("{}: {}", v.field, v.description))))?;
                if !all.points.insert(read.1.point) {
                    let text = format!(
                        "point {} came twice: the server has lost rows and computed them again; fetch all of them anew",
                        read.1.point
                    );
                    return Err(self.error(&Status::data_loss(text)));
                }
                all.failed += u64::from(read.1.error.is_some());
                all.rows.push(read);
            }
            let wanted = progress(SweepProgress { done: all.rows.len() as u64, points, failed: all.failed });
            if let Some(job) = chunk.job {
                return Ok(JobStatus::of(job));
            }
            if !wanted {
                return Err(self.error(&Status::cancelled(format!("after {} of {points} points", all.rows.len()))));
            }
        }
        Err(self.error(&Status::unavailable("the stream ended before the job did")))
    }
}
