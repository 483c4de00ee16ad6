//! The service without a network: the same calls on the same models, in the process that asks. Messages are those of
//! the protocol as bytes. A program that uses the protocol on a server uses it here, with bit-identical results and the
//! same errors.

use super::attached_session::{AttachedSession, RequestAction};
use super::connection::Connections;
use super::limits::Limits;
use super::server::share;
use super::shared::{BimorphService, ServerState};
use super::shutdown::Shutdown;
use super::status;
use bimorph_base::budget::{Allowance, Budget};
use bimorph_device::Device;
use bimorph_device::local::LocalDevice;
use bimorph_model::compile::CompiledModel;
use bimorph_wire::proto;
use bimorph_wire::waiting::{decoded, not_asynchronous, wanted};
use prost::Message;
use proto::bimorph_server::Bimorph;
use proto::device_reply::Kind as ReplyKind;
use std::future::Future;
use std::io;
use std::pin::Pin;
use std::sync::Arc;
use std::time::Duration;
use tokio::runtime::{Builder, Handle, Runtime};
use tokio_stream::{Stream, StreamExt};
use tonic::{Response, Status};

/// No bound on what a process asks of itself, but still a number that may be added up.
const NONE: usize = 1_000_000_000_000_000;

/// A service in this process. Its sweeps run and its sessions are there as long as it is.
pub struct InProcessServer {
    /// None once it is over.
    runtime: Option<Runtime>,
    calls: BimorphService,
}

/// Answers of a call that has many.
pub struct ReplyMessages {
    runtime: Handle,
    stream: Pin<Box<dyn Stream<Item = Result<Vec<u8>, Status>> + Send>>,
}

/// Trial channel of one device: the counterpart of the Trial stream of a server.
pub struct DeviceChannel {
    joined: AttachedSession,
    shared: Arc<ServerState>,
}

/// Limits in process: memory and time are those of the process, and programs run in their sandbox.
fn limits() -> Limits {
    let ever = Duration::from_secs(1_000_000_000);
    Limits {
        message_bytes: NONE,
        netlist_bytes: NONE,
        program_bytes: 1 << 20,
        unknowns: NONE,
        models: 64,
        model_memory: NONE,
        sessions: NONE,
        sweep_points: NONE,
        sweeps: NONE,
        transient_values: NONE,
        modes: NONE,
        mode_work: NONE,
        memory: NONE,
        cpu: ever,
        signals: NONE,
        request_timeout: ever,
        idle: ever,
        stream_idle: ever,
        ..Limits::default()
    }
}

/// The call of that name among those with one answer.
macro_rules! one_answer {
    ($calls:expr, $name:expr, $request:expr, $($wire:literal $method:ident),+ $(,)?) => {
        match $name {
            $($wire => $calls.$method(decoded($request)?).await.map(|answer| answer.into_inner().encode_to_vec()),)+
            other => Err(Status::unimplemented(format!("no call \"{other}\" with one answer"))),
        }
    };
}

impl InProcessServer {
    /// A service without models yet.
    ///
    /// # Errors
    /// A system that gives no thread.
    pub fn new() -> io::Result<Self> {
        let runtime = Builder::new_multi_thread().worker_threads(1).thread_name("bimorph").enable_all().build()?;
        let signals = Shutdown::default();
        let make: fn(Arc<CompiledModel>) -> Box<dyn Device> = |compiled| Box::new(LocalDevice::new(compiled));
        let limits = limits();
        let connections = Arc::new(Connections::new(&limits, &signals.cutting));
        let shared = {
            let _within = runtime.enter();
            share(limits, Vec::new(), (make, None, connections), &signals)
        };
        Ok(Self { runtime: Some(runtime), calls: BimorphService(shared) })
    }

    fn runtime(&self) -> Result<&Runtime, Status> {
        not_asynchronous()?;
        self.runtime.as_ref().ok_or_else(status::stopping)
    }

    /// A call with one answer, by its name in the protocol. `waits` is asked now and then whether the answer is still wanted.
    ///
    /// # Errors
    /// Those of the call; CANCELLED where the answer is not wanted any more.
    pub fn call(&self, name: &str, request: &[u8], waits: &dyn Fn() -> bool) -> Result<Vec<u8>, Status> {
        let answer = async {
            let calls = &self.calls;
            one_answer!(calls, name, request,
                "Info" info, "Check" check, "Convert" convert, "Compile" compile, "Describe" describe,
                "Open" open, "Linearize" linearize, "Snapshot" snapshot, "Restore" restore, "Fork" fork,
                "KeepAlive" keep_alive, "Close" close,
                "Static" r#static, "Modes" modes, "FrequencyResponse" frequency_response, "PullIn" pull_in,
                "Path" path, "Export" export,
                "SubmitJob" submit_job, "GetJob" get_job, "ListJobs" list_jobs, "CancelJob" cancel_job,
                "DeleteJob" delete_job, "SubmitSweep" submit_sweep, "CancelSweep" cancel_sweep,
            )
        };
        wait(self.runtime()?.handle(), answer, waits)
    }

    /// A call with many answers.
    ///
    /// # Errors
    /// Those of the call.
    pub fn stream(&self, name: &str, request: &[u8]) -> Result<ReplyMessages, Status> {
        let runtime = self.runtime()?.handle().clone();
        let calls = &self.calls;
        let stream = runtime.block_on(async {
            match name {
                "Transient" => calls.transient(decoded(request)?).await.map(as_bytes),
                "Run" => calls.run(decoded(request)?).await.map(as_bytes),
                "WatchJob" => calls.watch_job(decoded(request)?).await.map(as_bytes),
                "FetchJob" => calls.fetch_job(decoded(request)?).await.map(as_bytes),
                "WatchSweep" => calls.watch_sweep(decoded(request)?).await.map(as_bytes),
                "FetchSweep" => calls.fetch_sweep(decoded(request)?).await.map(as_bytes),
                other => Err(Status::unimplemented(format!("no call \"{other}\" with many answers"))),
            }
        })?;
        Ok(ReplyMessages { runtime, stream })
    }

    /// The trial channel of one device, whose session ends with it unless it attaches to one.
    pub fn questions(&self) -> DeviceChannel {
        DeviceChannel { joined: AttachedSession::none(&self.calls.0), shared: Arc::clone(&self.calls.0) }
    }
}

impl Drop for InProcessServer {
    fn drop(&mut self) {
        self.calls.0.jobs.suspend();
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_background();
        }
    }
}

fn as_bytes<S, T>(answers: Response<S>) -> Pin<Box<dyn Stream<Item = Result<Vec<u8>, Status>> + Send>>
where
    S: Stream<Item = Result<T, Status>> + Send + 'static,
    T: Message,
{
    Box::pin(answers.into_inner().map(|answer| answer.map(|answer| answer.encode_to_vec())))
}

/// Waits for an answer for as long as it is wanted; what computes it stops when it is not.
fn wait<T>(
    runtime: &Handle,
    answer: impl Future<Output = Result<T, Status>>,
    waits: &dyn Fn() -> bool,
) -> Result<T, Status> {
    runtime.block_on(wanted(answer, waits))
}

impl ReplyMessages {
    /// The next answer; none after the last.
    ///
    /// # Errors
    /// Those of the call; CANCELLED where it is not wanted any more.
    pub fn next(&mut self, waits: &dyn Fn() -> bool) -> Result<Option<Vec<u8>>, Status> {
        not_asynchronous()?;
        let stream = &mut self.stream;
        wait(&self.runtime, async { stream.next().await.transpose() }, waits)
    }
}

impl DeviceChannel {
    /// The reply to one request; `None` for an accept without a reply.
    ///
    /// # Errors
    /// INVALID_ARGUMENT for bytes that are no request. An error of the device is a reply.
    pub fn ask(&mut self, request: &[u8]) -> Result<Option<Vec<u8>>, Status> {
        let request = decoded::<proto::DeviceRequest>(request)?.into_inner();
        let kind = self.reply(request);
        let reply = |kind| proto::DeviceReply { kind: Some(kind), warnings: self.joined.warnings() };
        Ok(kind.map(|kind| reply(kind).encode_to_vec()))
    }

    fn reply(&mut self, request: proto::DeviceRequest) -> Option<ReplyKind> {
        match self.joined.next(request) {
            RequestAction::Ask(session, question) => session.answer(&question, &Budget::new(Allowance::default())),
            RequestAction::Attach(id) => Some(self.joined.join(self.shared.sessions.get(&id))),
            RequestAction::Answered(reply) => reply,
        }
    }
}
