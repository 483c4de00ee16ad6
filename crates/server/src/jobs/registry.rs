//! The jobs of a server: running ones, and ended ones that may still be requested.

use super::super::accounts::Accounts;
use super::super::connection::Connections;
use super::super::fair_semaphore::client;
use super::super::limits::Limits;
use super::super::models::check_size;
use super::super::status;
use super::super::store::SessionStore;
use super::super::work::{allowance, of_client};
use super::folder::{self, JobFile, JobOutcome, StoredJob};
use super::job::Job;
use super::job_origin::JobOrigin;
use super::job_state::{JobState, JobStopReason, state_of};
use super::pages::{Page, token};
use super::rows::FinishedRows;
use super::running::JobExecutors;
use bimorph_base::Bundle;
use bimorph_base::budget::{Allowance, Budget};
use bimorph_jobs::sweep::{self, SweepError, SweepSpec};
use bimorph_model::options::CompileOptions;
use bimorph_wire::convert::Violation;
use bimorph_wire::ids::Ids;
use bimorph_wire::{convert, proto};
use prost::Message;
use proto::job_metadata::State;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tonic::{Code, Status};

/// Computation of a job.
pub(super) struct SweepTask {
    pub(super) spec: SweepSpec,
    pub(super) bundle: Bundle,
    pub(super) options: CompileOptions,
}

impl SweepTask {
    /// The request, checked.
    ///
    /// # Errors
    /// The invalid part of the request.
    pub(super) fn of(request: proto::SubmitJobRequest) -> Result<Self, Violation> {
        let proto::SubmitJobRequest { bundle, options, task, .. } = request;
        let spec = task.map(|proto::submit_job_request::Task::Sweep(spec)| spec);
        Ok(Self {
            bundle: convert::model::bundle_from_wire(bundle)?,
            options: convert::options::options_from_wire(options)?,
            spec: convert::sweep::spec_from_wire(spec)?,
        })
    }
}

/// The jobs of a server.
pub(in super::super) struct JobRegistry {
    kept: Mutex<BTreeMap<String, Arc<Job>>>,
    /// Held while a job is accepted, until it is on the disk.
    taking_in: Mutex<()>,
    sequence: AtomicU64,
    ids: Ids,
    crews: Arc<JobExecutors>,
    store: Option<Arc<SessionStore>>,
}

impl JobRegistry {
    /// None yet; with a folder, those that are in it are there after [`Self::wake`]. Within a runtime.
    pub(in super::super) fn new(limits: &Limits, store: Option<Arc<SessionStore>>) -> Self {
        let crews = Arc::new(JobExecutors::new(limits));
        Self {
            kept: Mutex::default(),
            taking_in: Mutex::default(),
            sequence: AtomicU64::new(1),
            ids: Ids::default(),
            crews,
            store,
        }
    }

    fn kept(&self) -> MutexGuard<'_, BTreeMap<String, Arc<Job>>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Jobs kept, running or finished.
    pub(in super::super) fn len(&self) -> usize {
        self.kept().len()
    }

    /// Starts a job, which is on the disk when this returns. A repeated request of the same client under the same name
    /// starts no second job.
    ///
    /// # Errors
    /// INVALID_ARGUMENT, or RESOURCE_EXHAUSTED where there is no room.
    pub(super) fn submit(
        &self,
        asked: JobOrigin,
        task: SweepTask,
        request: &proto::SubmitJobRequest,
        limits: &Limits,
    ) -> Result<Arc<Job>, Status> {
        let SweepTask { spec, bundle, options } = task;
        // before anything is laid out for each value
        let violation = |error: SweepError| status::bad_request(&error.to_string(), [spec_violation(&error)]);
        let points = spec.grid_points().map_err(violation)?;
        if points > limits.sweep_points {
            return Err(status::limit("sweep_points", limits.sweep_points, points));
        }
        let asked = asked.with(&spec, &bundle, &options);
        let again = |job: Arc<Job>| {
            job.touch(client().number);
            Ok(job)
        };
        let before = already(&self.kept(), &asked)?;
        if let Some(before) = before {
            return again(before);
        }
        let points = spec.point_numbers().map_err(violation)?.len() as u64;
        sweep::check_names(&spec, &bundle, &options).map_err(violation)?;
        let budget = Budget::new(of_client(allowance(limits)));
        let id = self.ids.make()?;
        let _taking_in = self.taking_in.lock().unwrap_or_else(PoisonError::into_inner);
        {
            let kept = self.kept();
            if let Some(before) = already(&kept, &asked)? {
                return again(before);
            }
            room(&kept, &asked.owner, limits)?;
        }
        let sequence = self.sequence.fetch_add(1, Ordering::Relaxed);
        let asked = JobOrigin { sequence, points, ..asked };
        let file = self.store.as_ref().map(|store| -> std::io::Result<JobFile> {
            let mut file = folder::begin(store, &id, &asked, &request.encode_to_vec())?;
            file.open().inspect_err(|_| file.remove())?;
            Ok(file)
        });
        let file = file.transpose().map_err(|error| status::not_kept("the job is", &error))?;
        let parts = (asked, spec, request.options.clone());
        let standing = JobState { state: State::Waiting, ..JobState::default() };
        let job = Job::new(id.clone(), parts, budget, file, (Some(FinishedRows::default()), standing));
        job.touch(client().number);
        self.kept().insert(id, Arc::clone(&job));
        self.crews.start(&job, bundle, options);
        Ok(job)
    }

    /// Reads the folder, and continues unfinished jobs.
    ///
    /// # Errors
    /// A folder that cannot be read.
    pub(in super::super) fn wake(&self, accounts: &Accounts, limits: &Limits) -> std::io::Result<()> {
        let Some(store) = &self.store else { return Ok(()) };
        // one by one: not the requests of all of them at once
        for id in folder::ids(store)? {
            let Some(found) = folder::find(store, &id) else { continue };
            self.sequence.fetch_max(found.asked.sequence.saturating_add(1), Ordering::Relaxed);
            if let Err(error) = self.wake_one(found, accounts, limits) {
                tracing::warn!(job = id, error, "it cannot be read, and is left alone");
            }
        }
        Ok(())
    }

    fn wake_one(&self, found: StoredJob, accounts: &Accounts, limits: &Limits) -> Result<(), String> {
        let StoredJob { id, asked, request, end, mut file } = found;
        let request = proto::SubmitJobRequest::decode(&*request).map_err(|error| error.to_string())?;
        let wire_options = request.options.clone();
        let SweepTask { spec, bundle, options } = SweepTask::of(request).map_err(|violation| violation.description)?;
        let purse = accounts.of(&asked.owner).purse.clone();
        let budget = Budget::new(Allowance { purse, ..allowance(limits) });
        // reported rows are stored completely and are read again on request
        let whole = |end: &JobOutcome| end.code != Code::Ok as i32 || end.rows == asked.points;
        let are_there = |end: &JobOutcome| {
            let found = file.read_rows().map_or(0, |rows| rows.len() as u64);
            if found < end.rows {
                tracing::warn!(job = id, "{} of its {} rows are damaged", end.rows - found, end.rows);
            }
            found >= end.rows
        };
        if let Some(end) = end.clone().filter(|end| end.bytes == file.row_bytes() && whole(end) && are_there(end)) {
            let (state, rows, failed) = (state_of(end.code), end.rows, end.failed);
            let standing = JobState { state, rows, failed, end: Some(end), ..JobState::default() };
            let job = Job::new(id.clone(), (asked, spec, wire_options), budget, Some(file), (None, standing));
            self.kept().insert(id, job);
            return Ok(());
        }
        let mut rows = FinishedRows::default();
        let lost = match file.open() {
            Ok(found) => {
                found.into_iter().for_each(|kept| rows.push(kept));
                None
            }
            Err(error) => {
                tracing::warn!(job = id, %error, "its journal is damaged");
                Some(status::damaged("job", &id, "submit it again"))
            }
        };
        let standing =
            JobState { state: State::Waiting, rows: rows.len(), failed: rows.failed(), ..JobState::default() };
        let cancelled = end.filter(|end| end.code != Code::Ok as i32);
        let why_not = goes_on(&asked, &bundle, limits).err().filter(|_| standing.rows < asked.points);
        let job = Job::new(id.clone(), (asked, spec, wire_options), budget, Some(file), (Some(rows), standing));
        self.kept().insert(id, Arc::clone(&job));
        match (cancelled, lost.or(why_not)) {
            (None, Some(why)) if why.code() == Code::DataLoss => job.refuse(&why),
            (Some(end), _) => job.finish(Some(Status::new(Code::from_i32(end.code), end.message))),
            (None, Some(why)) => job.refuse(&why),
            (None, None) => self.crews.start(&job, bundle, options),
        }
        Ok(())
    }

    /// The job of that id, requested by the current connection.
    ///
    /// # Errors
    /// NOT_FOUND.
    pub(super) fn get(&self, id: &str, kind: &str) -> Result<Arc<Job>, Status> {
        let job = self.kept().get(id).cloned().ok_or_else(|| status::not_found(kind, id))?;
        job.touch(client().number);
        Ok(job)
    }

    /// A page of the jobs of the client at hand, and the token of the next one.
    pub(super) fn list(&self, page: &Page) -> (Vec<Arc<Job>>, String) {
        let owner = client().name;
        let kept = self.kept();
        let own = kept.values().filter(|job| *job.asked.owner == *owner && job.asked.sequence < page.before);
        let mut jobs: Vec<_> = own.cloned().collect();
        drop(kept);
        jobs.sort_by_key(|job| std::cmp::Reverse(job.asked.sequence));
        let more = jobs.len() > page.size;
        jobs.truncate(page.size);
        let next = jobs.last().filter(|_| more).map(|job| token(job.asked.sequence));
        (jobs, next.unwrap_or_default())
    }

    /// Stops a job; its rows stay. It is on the disk that it is to stop when this returns.
    ///
    /// # Errors
    /// It is stopped, but not on the disk.
    pub(super) fn cancel(job: &Job) -> Result<(), Status> {
        let kept = job.keep_cancelled();
        job.stop(JobStopReason::Cancelled);
        kept.map_err(|error| status::not_kept("the job is stopped; that it is cancelled is", &error))
    }

    /// Stops and removes a job.
    pub(super) fn delete(&self, job: &Job) {
        self.kept().remove(&job.id);
        job.delete();
    }

    /// Stops all running jobs: those in a folder continue with the next server.
    pub(in super::super) fn suspend(&self) {
        let jobs: Vec<_> = self.kept().values().cloned().collect();
        jobs.iter().filter(|job| !job.has_ended()).for_each(|job| job.stop(JobStopReason::Suspended));
    }

    /// Returns when all suspended jobs have stopped, and releases the folder.
    pub(in super::super) async fn release(&self, patience: Duration) {
        let jobs: Vec<_> = self.kept().values().cloned().collect();
        let quiet = async {
            for job in &jobs {
                job.quiet().await;
            }
        };
        if tokio::time::timeout(patience, quiet).await.is_err() {
            tracing::warn!("some points of jobs did not stop in time");
        }
        jobs.iter().for_each(|job| job.release());
    }

    /// Cancels jobs whose clients are gone for longer than their limit.
    pub(in super::super) fn check_clients(&self, connections: &Connections) {
        let jobs: Vec<_> = self.kept().values().filter(|job| job.asked.release().is_some()).cloned().collect();
        if !jobs.is_empty() {
            let open = connections.numbers();
            jobs.iter().for_each(|job| job.check_client(&open));
        }
    }

    /// Drops finished jobs without a request during the time limit; returns their number. Waits for the disk.
    pub(in super::super) fn expire(&self, limits: &Limits) -> usize {
        let time = if self.store.is_some() { limits.sweeps_idle } else { limits.idle };
        let is_old = |job: &&Arc<Job>| job.is_over() && job.idle() >= time && !job.is_watched();
        let old: Vec<_> = self.kept().values().filter(is_old).cloned().collect();
        old.iter().for_each(|job| self.delete(job));
        old.len()
    }
}

/// Whether this server may continue a job that another one began.
fn goes_on(asked: &JobOrigin, bundle: &Bundle, limits: &Limits) -> Result<(), Status> {
    let own = env!("CARGO_PKG_VERSION");
    if asked.version != own {
        let text =
            format!("version {} began it and this is {own}, whose numbers may differ; submit it again", asked.version);
        return Err(Status::failed_precondition(text));
    }
    // programs are not run where they are disabled, even if the job was accepted before
    check_size(bundle, limits)
}

/// So many times as many jobs are kept as may run and wait, where a folder has those that have ended.
const ENDED: usize = 64;

/// Room for one more job of a client.
fn room(kept: &BTreeMap<String, Arc<Job>>, owner: &str, limits: &Limits) -> Result<(), Status> {
    let way_out = "one more; delete one that is no longer needed";
    // in a folder ended ones take its bytes, and hardly anything else
    let counts = |job: &&Arc<Job>| !(job.is_kept() && job.has_ended());
    if kept.values().filter(counts).count() >= limits.sweeps || kept.len() >= limits.sweeps.saturating_mul(ENDED) {
        return Err(status::limit("sweeps", limits.sweeps, way_out));
    }
    let own = || kept.values().filter(|job| job.asked.owner == owner);
    match limits.client_sweeps {
        0 => Ok(()),
        most if own().filter(counts).count() >= most || own().count() >= most.saturating_mul(ENDED) => {
            Err(status::limit("client_sweeps", most, way_out))
        }
        _ => Ok(()),
    }
}

/// The stored job that its client requested by the same name.
fn already(kept: &BTreeMap<String, Arc<Job>>, asked: &JobOrigin) -> Result<Option<Arc<Job>>, Status> {
    let mut same = kept.values().filter_map(|job| job.asked.is(asked).map(|same| (job, same)));
    if asked.share {
        return Ok(same.filter(|(_, same)| *same).map(|(job, _)| job).find(|job| job.lives()).cloned());
    }
    match same.next() {
        Some((_, false)) => {
            let text = "expected a name of its own, got that of another sweep; choose them at random";
            Err(status::violation(Violation::new("request_id", text)))
        }
        found => Ok(found.map(|(job, _)| Arc::clone(job))),
    }
}

fn spec_violation(error: &SweepError) -> Violation {
    let field = match error {
        SweepError::BadSpec { what, .. } => format!("spec.{what}"),
        _ => "spec".to_owned(),
    };
    Violation::new(field, error.to_string())
}
