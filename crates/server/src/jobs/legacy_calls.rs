//! The older calls of sweeps, on the same jobs: a sweep is called as its job is, without "jobs/".

use super::super::shared::{BimorphService, Reply};
use super::calls::aside;
use super::job::Job;
use super::streams::{self, SweepStream, TableStream};
use bimorph_wire::proto;
use proto::job_metadata::State;
use proto::sweep_status::State as Older;
use tonic::{Response, Status};

impl BimorphService {
    pub(in super::super) async fn submitted_sweep(
        &self,
        request: proto::SubmitSweepRequest,
    ) -> Reply<proto::SubmitSweepResponse> {
        let proto::SubmitSweepRequest { bundle, options, spec, request_id } = request;
        let task = spec.map(proto::submit_job_request::Task::Sweep);
        let request = proto::SubmitJobRequest { bundle, options, task, request_id, ..Default::default() };
        let job = self.started(request).await?;
        Ok(Response::new(proto::SubmitSweepResponse { sweep: job.id.clone(), points: job.asked.points }))
    }

    pub(in super::super) fn watched_sweep(&self, id: &str) -> Reply<SweepStream> {
        let job = self.0.jobs.get(id, "sweep")?;
        Ok(Response::new(streams::watch(job, &self.0.shutdown, status_of)))
    }

    pub(in super::super) async fn fetched_sweep(&self, id: &str) -> Reply<TableStream> {
        let job = self.0.jobs.get(id, "sweep")?;
        let proto::SweepStatus { done, points, message, .. } = status_of(&job);
        if job.standing().state != State::Done {
            let text = format!("the sweep has no table: {done} of {points} points done {message}");
            return Err(Status::failed_precondition(text.trim_end()));
        }
        let place = self.sending()?;
        let table = aside(move || job.table()).await?;
        Ok(Response::new(TableStream::new(table, place, &self.0.shutdown)))
    }

    pub(in super::super) async fn cancelled_sweep(&self, id: &str) -> Reply<proto::CancelSweepResponse> {
        let job = self.0.jobs.get(id, "sweep")?;
        self.delete(job).await?;
        Ok(Response::new(proto::CancelSweepResponse {}))
    }
}

/// Where a job stands, as older clients know it.
fn status_of(job: &Job) -> proto::SweepStatus {
    let standing = job.standing();
    let state = match standing.state {
        State::Done => Older::Done,
        State::Cancelled => Older::Cancelled,
        State::Failed => Older::Failed,
        State::Waiting | State::Running | State::Unspecified => Older::Running,
    };
    proto::SweepStatus {
        state: state.into(),
        done: standing.rows,
        points: job.asked.points,
        failed: standing.failed,
        message: standing.end.map(|end| end.message).unwrap_or_default(),
    }
}
