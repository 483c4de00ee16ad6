//! The calls of `service.proto`: check, look up, compute, convert.

use super::analyses::TransientStream;
use super::jobs::{JobStream, RowStream, SweepStream, TableStream};
use super::layouts;
use super::models::check_size;
use super::reply_size::answerable;
use super::runs::RunStream;
use super::shared::{BimorphService, Reply};
use super::status;
use super::stream::TrialStream;
use super::stream_request::StreamRequest;
use bimorph_base::Bundle;
use bimorph_base::budget::Budget;
use bimorph_device::Token;
use bimorph_model::compile::{CompileError, CompileOptions, ParsedStructure, draw};
use bimorph_netlist::NetlistSource;
use bimorph_wire::convert::{self, model as text, options as options_wire};
use bimorph_wire::proto;
use proto::device_reply::Kind as ReplyKind;
use std::sync::Arc;
use std::time::Duration;
use tonic::{Request, Response, Status, Streaming};

impl BimorphService {
    /// Bundle and options of a request, within limits.
    fn netlist(
        &self,
        bundle: Option<proto::Bundle>,
        options: Option<proto::CompileOptions>,
    ) -> Result<(Bundle, CompileOptions), Status> {
        let bundle = text::bundle_from_wire(bundle).map_err(status::violation)?;
        check_size(&bundle, &self.0.limits)?;
        Ok((bundle, options_wire::options_from_wire(options).map_err(status::violation)?))
    }
}

#[tonic::async_trait]
impl proto::bimorph_server::Bimorph for BimorphService {
    async fn info(&self, _: Request<proto::InfoRequest>) -> Reply<proto::InfoResponse> {
        let limits = &self.0.limits;
        Ok(Response::new(proto::InfoResponse {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            protocols: vec!["bimorph.v1".to_owned()],
            limits: Some(limits.to_wire()),
            settings: self.0.reported.clone(),
        }))
    }

    async fn check(&self, request: Request<proto::CheckRequest>) -> Reply<proto::CheckResponse> {
        let request = request.into_inner();
        let (bundle, options) = self.netlist(request.bundle, request.options)?;
        let answer = self.0.desk.run(move || Ok(check(&bundle, &options))).await?;
        Ok(Response::new(answer))
    }

    async fn convert(&self, request: Request<proto::ConvertRequest>) -> Reply<proto::ConvertResponse> {
        let request = request.into_inner();
        let most = self.0.limits.netlist_bytes;
        let bytes = request.layout.len() + request.process.len() + request.name.len();
        if bytes > most {
            return Err(status::limit("netlist_bytes", most, bytes));
        }
        let answer = self.0.desk.run(move || layouts::convert(&request).map_err(status::violation)).await?;
        Ok(Response::new(answer))
    }

    async fn compile(&self, request: Request<proto::CompileRequest>) -> Reply<proto::CompileResponse> {
        let request = request.into_inner();
        let (bundle, options) = self.netlist(request.bundle, request.options)?;
        let shared = Arc::clone(&self.0);
        let job = move || shared.models.compile(bundle.clone(), options.clone(), &shared.limits, shared.make);
        let model = self.0.desk.run(job).await?;
        Ok(Response::new(proto::CompileResponse { model: Some(model.description.clone()) }))
    }

    async fn describe(&self, request: Request<proto::DescribeRequest>) -> Reply<proto::DescribeResponse> {
        let model = self.0.models.get(&request.get_ref().model)?;
        Ok(Response::new(proto::DescribeResponse { model: Some(model.description.clone()) }))
    }

    async fn open(&self, request: Request<proto::OpenRequest>) -> Reply<proto::OpenResponse> {
        let (shared, request) = (Arc::clone(&self.0), request.into_inner());
        let model = shared.models.get(&request.model)?;
        answerable(&request, model.compiled.parts.system.electrics.ports, &shared.limits)?;
        let question = StreamRequest::Open(request);
        let job = move |budget: &Budget| {
            shared.created(&model, |session| match session.answer(&question, budget) {
                Some(ReplyKind::Opened(opened)) => Ok(opened),
                Some(ReplyKind::Fault(fault)) => Err(refusal(fault)),
                _ => Err(status::fault()),
            })
        };
        self.0.desk.run_with(job).await.map(Response::new)
    }

    type TrialStream = TrialStream;

    async fn trial(&self, request: Request<Streaming<proto::DeviceRequest>>) -> Reply<TrialStream> {
        Ok(Response::new(TrialStream::new(Arc::clone(&self.0), request.into_inner())))
    }

    type RunStream = RunStream;

    async fn run(&self, request: Request<proto::RunRequest>) -> Reply<RunStream> {
        self.ran(request.into_inner()).await
    }

    async fn linearize(&self, request: Request<proto::LinearizeRequest>) -> Reply<proto::LinearizeResponse> {
        let request = request.into_inner();
        let session = self.0.session(&request.session).await?;
        session.bound_small_signals(request.omega.len(), request.noise, &self.0.limits)?;
        let turn = session.acquire().await?;
        let job = move || {
            let _turn = &turn;
            session.linearize(Token(request.token), &request.omega, request.noise)
        };
        let points = self.0.desk.run(job).await?;
        Ok(Response::new(proto::LinearizeResponse { points }))
    }

    async fn snapshot(&self, request: Request<proto::SnapshotRequest>) -> Reply<proto::SnapshotResponse> {
        let request = request.into_inner();
        let session = self.0.session(&request.session).await?;
        let turn = session.acquire().await?;
        let only = (request.token != 0).then_some(Token(request.token));
        let job = move || {
            let _turn = &turn;
            session.snapshot(only)
        };
        let snapshot = self.0.desk.run(job).await?;
        Ok(Response::new(proto::SnapshotResponse { snapshot }))
    }

    async fn restore(&self, request: Request<proto::RestoreRequest>) -> Reply<proto::OpenResponse> {
        let (shared, request) = (Arc::clone(&self.0), request.into_inner());
        let model = shared.models.get(&request.model)?;
        let job = move || shared.restored(&model, &request.snapshot);
        self.0.desk.run(job).await.map(Response::new)
    }

    async fn fork(&self, request: Request<proto::ForkRequest>) -> Reply<proto::OpenResponse> {
        let shared = Arc::clone(&self.0);
        let session = shared.session(&request.get_ref().session).await?;
        let turn = session.acquire().await?;
        let job = move || {
            let _turn = &turn;
            shared.restored(session.model(), &session.snapshot(None)?)
        };
        self.0.desk.run(job).await.map(Response::new)
    }

    async fn keep_alive(&self, request: Request<proto::KeepAliveRequest>) -> Reply<proto::KeepAliveResponse> {
        let proto::KeepAliveRequest { session, lease_s } = request.into_inner();
        let session = self.0.session(&session).await?;
        let (limits, none) = (&self.0.limits, lease_s == 0.0);
        let longest = limits.stream_idle.as_secs_f64();
        // what is no number is not the longest one
        let lease_s = if lease_s > longest { longest } else { lease_s };
        let lease_s = if none { limits.idle.as_secs_f64() } else { lease_s };
        let lease_s = convert::number("lease_s", lease_s, true).map_err(status::violation)?;
        let millis = || u64::try_from(Duration::from_secs_f64(lease_s).as_millis()).unwrap_or(u64::MAX).max(1);
        let millis = if none { 0 } else { millis() };
        // it may wait for the disk
        self.0.desk.run(move || session.lease(millis)).await?;
        Ok(Response::new(proto::KeepAliveResponse { lease_s }))
    }

    async fn close(&self, request: Request<proto::CloseRequest>) -> Reply<proto::CloseResponse> {
        self.0.close(&request.get_ref().session).await?;
        Ok(Response::new(proto::CloseResponse {}))
    }

    async fn r#static(&self, request: Request<proto::StaticRequest>) -> Reply<proto::StaticResponse> {
        self.statics(request.into_inner()).await
    }

    async fn modes(&self, request: Request<proto::ModesRequest>) -> Reply<proto::ModesResponse> {
        self.frequencies(request.into_inner()).await
    }

    async fn frequency_response(
        &self,
        request: Request<proto::FrequencyResponseRequest>,
    ) -> Reply<proto::FrequencyResponseReply> {
        self.response(request.into_inner()).await
    }

    async fn pull_in(&self, request: Request<proto::PullInRequest>) -> Reply<proto::PullInResponse> {
        self.pulled_in(request.into_inner()).await
    }

    async fn path(&self, request: Request<proto::PathRequest>) -> Reply<proto::PathResponse> {
        self.traced(request.into_inner()).await
    }

    async fn export(&self, request: Request<proto::ExportRequest>) -> Reply<proto::ExportResponse> {
        self.exported(request.into_inner()).await
    }

    type TransientStream = TransientStream;

    async fn transient(&self, request: Request<proto::TransientRequest>) -> Reply<Self::TransientStream> {
        self.motion(request.into_inner()).await
    }

    async fn submit_job(&self, request: Request<proto::SubmitJobRequest>) -> Reply<proto::Job> {
        self.submitted_job(request.into_inner()).await
    }

    async fn get_job(&self, request: Request<proto::GetJobRequest>) -> Reply<proto::Job> {
        self.job_of(&request.get_ref().name)
    }

    async fn list_jobs(&self, request: Request<proto::ListJobsRequest>) -> Reply<proto::ListJobsResponse> {
        self.listed_jobs(request.get_ref())
    }

    type WatchJobStream = JobStream;

    async fn watch_job(&self, request: Request<proto::WatchJobRequest>) -> Reply<JobStream> {
        self.watched_job(&request.get_ref().name)
    }

    type FetchJobStream = RowStream;

    async fn fetch_job(&self, request: Request<proto::FetchJobRequest>) -> Reply<RowStream> {
        self.fetched_job(request.get_ref())
    }

    async fn cancel_job(&self, request: Request<proto::CancelJobRequest>) -> Reply<proto::CancelJobResponse> {
        self.cancelled_job(&request.get_ref().name).await
    }

    async fn delete_job(&self, request: Request<proto::DeleteJobRequest>) -> Reply<proto::DeleteJobResponse> {
        self.deleted_job(&request.get_ref().name).await
    }

    async fn submit_sweep(&self, request: Request<proto::SubmitSweepRequest>) -> Reply<proto::SubmitSweepResponse> {
        self.submitted_sweep(request.into_inner()).await
    }

    type WatchSweepStream = SweepStream;

    async fn watch_sweep(&self, request: Request<proto::WatchSweepRequest>) -> Reply<SweepStream> {
        self.watched_sweep(&request.get_ref().sweep)
    }

    type FetchSweepStream = TableStream;

    async fn fetch_sweep(&self, request: Request<proto::FetchSweepRequest>) -> Reply<TableStream> {
        self.fetched_sweep(&request.get_ref().sweep).await
    }

    async fn cancel_sweep(&self, request: Request<proto::CancelSweepRequest>) -> Reply<proto::CancelSweepResponse> {
        self.cancelled_sweep(&request.get_ref().sweep).await
    }
}

/// A fault of a session as the status of a unary call.
fn refusal(fault: proto::Fault) -> Status {
    match fault.kind {
        Some(proto::fault::Kind::Refused(proto::Refused { code })) => Status::new(code.into(), fault.message),
        _ => status::device(&convert::device::fault_from_wire(fault, "here")),
    }
}

fn check(bundle: &Bundle, options: &CompileOptions) -> proto::CheckResponse {
    match draw(&NetlistSource::new(bundle), options).and_then(ParsedStructure::compile) {
        Ok(compiled) => proto::CheckResponse {
            ok: true,
            diagnostics: text::diagnostics_to_wire(&compiled.warnings),
            rendered: compiled.warnings.render(false),
        },
        Err(CompileError::Netlist(diagnostics)) => proto::CheckResponse {
            ok: false,
            diagnostics: text::diagnostics_to_wire(&diagnostics),
            rendered: diagnostics.render(false),
        },
        Err(other) => {
            let message = other.to_string();
            let severity = proto::diagnostic::Severity::Error.into();
            let diagnostic = proto::Diagnostic { severity, message: message.clone(), ..Default::default() };
            proto::CheckResponse { ok: false, diagnostics: vec![diagnostic], rendered: message }
        }
    }
}
