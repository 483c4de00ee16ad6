//! The calls of jobs.proto.

use super::super::analyses::count;
use super::super::models::check_size;
use super::super::shared::{BimorphService, Reply};
use super::super::status;
use super::job::Job;
use super::job_origin::JobOrigin;
use super::job_state::JobStopReason;
use super::pages::Page;
use super::registry::{JobRegistry, SweepTask};
use super::streams::{self, JobStream, RowStream};
use bimorph_wire::convert::{Violation, sweep as sweeps_wire};
use bimorph_wire::proto;
use proto::submit_job_request::Task as Wire;
use std::sync::Arc;
use tonic::{Response, Status};

/// The id in the name of a job.
fn id(name: &str) -> Result<&str, Status> {
    name.strip_prefix("jobs/").ok_or_else(|| status::not_found("job", name))
}

impl BimorphService {
    /// Starts a job, or finds the one that was started under the same name.
    pub(super) async fn started(&self, request: proto::SubmitJobRequest) -> Result<Arc<Job>, Status> {
        if self.0.shutdown.draining.is_cancelled() {
            return Err(status::stopping());
        }
        let limits = &self.0.limits;
        let asked = JobOrigin::by(&request).map_err(status::violation)?;
        let sizes = request.task.as_ref().map(|Wire::Sweep(spec)| {
            (sweeps_wire::grid_points(spec), sweeps_wire::outputs(spec), sweeps_wire::modes(spec))
        });
        let (points, outputs, modes) = sizes.unwrap_or_default();
        if points > limits.sweep_points {
            return Err(status::limit("sweep_points", limits.sweep_points, points));
        }
        count("outputs", outputs, limits)?;
        if modes > limits.modes {
            return Err(status::limit("modes", limits.modes, modes));
        }
        let shared = Arc::clone(&self.0);
        let job = move || {
            let task = SweepTask::of(request.clone()).map_err(status::violation)?;
            check_size(&task.bundle, &shared.limits)?;
            let job = shared.jobs.submit(asked.clone(), task, &request, &shared.limits)?;
            if shared.shutdown.draining.is_cancelled() {
                // it was accepted after the running jobs were suspended
                job.stop(JobStopReason::Suspended);
            }
            Ok(job)
        };
        self.0.desk.run(job).await
    }

    pub(in super::super) async fn submitted_job(&self, request: proto::SubmitJobRequest) -> Reply<proto::Job> {
        let job = self.started(request).await?;
        Ok(Response::new(job.to_wire_whole()))
    }

    pub(in super::super) fn job_of(&self, name: &str) -> Reply<proto::Job> {
        Ok(Response::new(self.0.jobs.get(id(name)?, "job")?.to_wire_whole()))
    }

    pub(in super::super) fn listed_jobs(&self, request: &proto::ListJobsRequest) -> Reply<proto::ListJobsResponse> {
        let page = Page::of(request.page_size, &request.page_token).map_err(status::violation)?;
        let (jobs, next_page_token) = self.0.jobs.list(&page);
        let jobs = jobs.iter().map(|job| job.to_wire()).collect();
        Ok(Response::new(proto::ListJobsResponse { jobs, next_page_token }))
    }

    pub(in super::super) fn watched_job(&self, name: &str) -> Reply<JobStream> {
        let job = self.0.jobs.get(id(name)?, "job")?;
        Ok(Response::new(streams::watch(job, &self.0.shutdown, |job| job.to_wire())))
    }

    pub(in super::super) fn fetched_job(&self, request: &proto::FetchJobRequest) -> Reply<RowStream> {
        let job = self.0.jobs.get(id(&request.name)?, "job")?;
        let points = job.asked.points;
        if request.first_row > points {
            let text = format!("expected at most {points}, the rows that there will be, got {}", request.first_row);
            return Err(status::violation(Violation::new("first_row", text)));
        }
        let place = self.sending()?;
        Ok(Response::new(streams::rows(job, (request.first_row, request.only_finished), place, &self.0.shutdown)))
    }

    pub(in super::super) async fn cancelled_job(&self, name: &str) -> Reply<proto::CancelJobResponse> {
        let job = self.0.jobs.get(id(name)?, "job")?;
        aside(move || JobRegistry::cancel(&job)).await?;
        Ok(Response::new(proto::CancelJobResponse {}))
    }

    pub(in super::super) async fn deleted_job(&self, name: &str) -> Reply<proto::DeleteJobResponse> {
        let job = self.0.jobs.get(id(name)?, "job")?;
        self.delete(job).await?;
        Ok(Response::new(proto::DeleteJobResponse {}))
    }

    /// Stops and removes a job.
    pub(super) async fn delete(&self, job: Arc<Job>) -> Result<(), Status> {
        let shared = Arc::clone(&self.0);
        let delete = move || {
            shared.jobs.delete(&job);
            Ok(())
        };
        aside(delete).await
    }
}

/// Runs disk operations without computation. They take no permit and are charged to no account, so that a client with
/// an exhausted quota can still stop its jobs.
pub(super) async fn aside<T: Send + 'static>(
    job: impl FnOnce() -> Result<T, Status> + Send + 'static,
) -> Result<T, Status> {
    tokio::task::spawn_blocking(job).await.unwrap_or_else(|_| Err(status::fault()))
}
