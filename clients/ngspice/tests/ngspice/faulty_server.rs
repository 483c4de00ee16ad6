//! A server that lies: it speaks the protocol, and what it answers to a device in a circuit is wrong in one way, which its name says.

use bimorph::service::proto::{
    self,
    bimorph_server::{Bimorph, BimorphServer},
};
use proto::device_reply::Kind as Said;
use proto::device_request::Kind as Asked;
use std::path::Path;
use std::pin::Pin;
use std::time::Duration;
use tokio::net::UnixListener;
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tokio_stream::{Stream, StreamExt};
use tonic::{Request, Response, Status, Streaming};

/// Control characters of a terminal: a title, and a cleared screen.
const CONTROLS: &str = "\u{1b}]0;x\u{7}\u{1b}[2J";
const UNBOUNDED: usize = 200 << 20;

#[derive(Clone, Copy)]
struct Liar(&'static str);

type Reply<T> = Result<Response<T>, Status>;
type Many<T> = Pin<Box<dyn Stream<Item = Result<T, Status>> + Send>>;

/// The service, of which all but a few calls are not there.
macro_rules! liar {
    (one { $($one:ident($ask:ident) -> $answer:ident;)* } many { $($many:ident($ask_many:ident) -> $stream:ident<$item:ident>;)* }) => {
        #[tonic::async_trait]
        impl Bimorph for Liar {
            $(type $stream = Many<proto::$item>;)*
            $(async fn $many(&self, _: Request<proto::$ask_many>) -> Reply<Self::$stream> {
                Err(Status::unimplemented(""))
            })*
            $(async fn $one(&self, _: Request<proto::$ask>) -> Reply<proto::$answer> {
                Err(Status::unimplemented(""))
            })*

            async fn check(&self, _: Request<proto::CheckRequest>) -> Reply<proto::CheckResponse> {
                Ok(Response::new(proto::CheckResponse { ok: true, ..Default::default() }))
            }

            async fn compile(&self, _: Request<proto::CompileRequest>) -> Reply<proto::CompileResponse> {
                self.compiled()
            }

            type TrialStream = Many<proto::DeviceReply>;

            async fn trial(&self, requests: Request<Streaming<proto::DeviceRequest>>) -> Reply<Self::TrialStream> {
                Ok(Response::new(self.answers(requests.into_inner())))
            }
        }
    };
}

liar! {
    one {
        info(InfoRequest) -> InfoResponse;
        convert(ConvertRequest) -> ConvertResponse;
        describe(DescribeRequest) -> DescribeResponse;
        open(OpenRequest) -> OpenResponse;
        linearize(LinearizeRequest) -> LinearizeResponse;
        snapshot(SnapshotRequest) -> SnapshotResponse;
        restore(RestoreRequest) -> OpenResponse;
        fork(ForkRequest) -> OpenResponse;
        keep_alive(KeepAliveRequest) -> KeepAliveResponse;
        close(CloseRequest) -> CloseResponse;
        r#static(StaticRequest) -> StaticResponse;
        modes(ModesRequest) -> ModesResponse;
        frequency_response(FrequencyResponseRequest) -> FrequencyResponseReply;
        pull_in(PullInRequest) -> PullInResponse;
        path(PathRequest) -> PathResponse;
        export(ExportRequest) -> ExportResponse;
        submit_job(SubmitJobRequest) -> Job;
        get_job(GetJobRequest) -> Job;
        list_jobs(ListJobsRequest) -> ListJobsResponse;
        cancel_job(CancelJobRequest) -> CancelJobResponse;
        delete_job(DeleteJobRequest) -> DeleteJobResponse;
        submit_sweep(SubmitSweepRequest) -> SubmitSweepResponse;
        cancel_sweep(CancelSweepRequest) -> CancelSweepResponse;
    }
    many {
        run(RunRequest) -> RunStream<RunEvent>;
        transient(TransientRequest) -> TransientStream<TransientEvent>;
        watch_job(WatchJobRequest) -> WatchJobStream<Job>;
        fetch_job(FetchJobRequest) -> FetchJobStream<JobRows>;
        watch_sweep(WatchSweepRequest) -> WatchSweepStream<SweepStatus>;
        fetch_sweep(FetchSweepRequest) -> FetchSweepStream<SweepChunk>;
    }
}

impl Liar {
    fn compiled(self) -> Reply<proto::CompileResponse> {
        let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
        let mut model = proto::ModelDescription {
            id: "0".repeat(32),
            ports: names(&["drive", "sense"]),
            nodes: names(&["m"]),
            unknowns: u64::MAX,
            ..Default::default()
        };
        match self.0 {
            "compile controls" => return Err(Status::invalid_argument(format!("{CONTROLS}line\nother"))),
            "compile ports" => model.ports = vec![CONTROLS.to_owned(); 3],
            "compile nothing" => return Ok(Response::new(proto::CompileResponse::default())),
            _ => {}
        }
        Ok(Response::new(proto::CompileResponse { model: Some(model) }))
    }

    /// Answers each request until it has had enough.
    fn answers(self, mut requests: Streaming<proto::DeviceRequest>) -> Many<proto::DeviceReply> {
        let (sender, replies) = mpsc::channel(4);
        tokio::spawn(async move {
            let (mut shape, mut trials) = ((2, 0), 0);
            while let Some(Ok(request)) = requests.next().await {
                let said = match request.kind {
                    Some(Asked::Open(open)) => {
                        shape = (2, open.signals.len());
                        vec![Some(self.opened(&open))]
                    }
                    Some(Asked::Trial(_)) if self.0 == "close" => return,
                    Some(Asked::Trial(_)) if self.0 == "never" => {
                        tokio::time::sleep(Duration::from_secs(60)).await;
                        return;
                    }
                    Some(Asked::Trial(trial)) => {
                        trials += 1;
                        self.tried(&trial, shape, trials)
                    }
                    Some(Asked::Linearize(_)) => vec![Some(Said::Linearized(proto::SmallSignal {
                        admittance_re: vec![f64::NAN],
                        ..Default::default()
                    }))],
                    _ => continue,
                };
                for kind in said {
                    if sender.send(Ok(proto::DeviceReply { kind, ..Default::default() })).await.is_err() {
                        return;
                    }
                }
            }
        });
        Box::pin(ReceiverStream::new(replies))
    }

    fn opened(self, open: &proto::OpenRequest) -> Said {
        if self.0 == "open kind" {
            return Said::Trial(proto::TrialReply { status: 1, token: 1, ..Default::default() });
        }
        let signal = |name: &String| proto::Signal { name: name.clone(), unit: "m".to_owned() };
        let times = if self.0 == "open ports" { 1000 } else { 1 };
        let ports: Vec<String> = std::iter::repeat_n(open.ports.clone(), times).flatten().collect();
        let device = proto::DeviceDescription {
            port_kinds: vec![0; ports.len()],
            ports,
            signals: open.signals.iter().map(signal).collect(),
            unknowns: 1,
        };
        Said::Opened(proto::OpenResponse { session: "1".into(), device: Some(device), ..Default::default() })
    }

    fn tried(self, trial: &proto::TrialRequest, (p, s): (usize, usize), token: u64) -> Vec<Option<Said>> {
        let mut reply = proto::TrialReply {
            status: 1,
            token,
            currents: vec![0.0; p],
            charges: vec![0.0; p],
            di_dv: (0..p * p).map(|k| if k % (p + 1) == 0 { 1e-3 } else { 0.0 }).collect(),
            dq_dv: vec![0.0; p * p],
            outputs: vec![0.0; s],
            doutputs_dv: vec![0.0; p * s],
            dt_next: f64::INFINITY,
            ..Default::default()
        };
        let need = |need_dt| proto::TrialReply { status: 2, need_dt, ..Default::default() };
        match self.0 {
            "nan" => (reply.currents, reply.di_dv) = (vec![f64::NAN; p], vec![f64::NAN; p * p]),
            "inf" => reply.charges = vec![f64::INFINITY; p],
            "sizes" => reply.currents = vec![0.0; p + 5],
            "none" => reply.di_dv.clear(),
            "short" => reply.charges.clear(),
            "big" => reply.currents = vec![0.0; 8_000_000],
            "token 0" => reply.token = 0,
            "need dt" => reply = need(0.999_999 * trial.dt),
            "need 0" => reply = need(0.0),
            "need nan" => reply = need(f64::NAN),
            "need more" => reply = need(if trial.dt > 0.0 { 2.0 * trial.dt } else { 1.0 }),
            "next 0" => reply.dt_next = 0.0,
            "next below 0" => reply.dt_next = -1.0,
            "next tiny" => reply.dt_next = 1e-300,
            "next nan" => reply.dt_next = f64::NAN,
            "status" => reply.status = 99,
            "fails" => {
                reply = proto::TrialReply { status: 3, reason: format!("{CONTROLS} why\nother"), ..Default::default() };
            }
            "kind" => return vec![Some(Said::Linearized(proto::SmallSignal::default()))],
            "empty" => return vec![None],
            "extra" => return vec![Some(Said::Trial(reply.clone())), Some(Said::Trial(reply))],
            "fault huge" => {
                let refused = proto::fault::Kind::Refused(proto::Refused { code: 13 });
                let message = "x".repeat(UNBOUNDED - 1000);
                return vec![Some(Said::Fault(proto::Fault { kind: Some(refused), message }))];
            }
            "fault controls" => {
                let refused = proto::fault::Kind::Refused(proto::Refused { code: 13 });
                return vec![Some(Said::Fault(proto::Fault { kind: Some(refused), message: CONTROLS.into() }))];
            }
            _ => {}
        }
        vec![Some(Said::Trial(reply))]
    }
}

/// Serves a lie on a socket until the process ends.
pub(crate) fn serve(lie: &'static str, socket: &Path) {
    let (ready, is_ready) = std::sync::mpsc::channel();
    let socket = socket.to_owned();
    std::thread::spawn(move || {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            let listener = UnixListener::bind(socket).unwrap();
            ready.send(()).unwrap();
            let service = BimorphServer::new(Liar(lie)).max_encoding_message_size(2 * UNBOUNDED);
            let (sender, incoming) = mpsc::channel(4);
            tokio::spawn(async move {
                while sender.send(listener.accept().await.map(|(socket, _)| socket)).await.is_ok() {}
            });
            let incoming = ReceiverStream::new(incoming);
            tonic::transport::Server::builder().add_service(service).serve_with_incoming(incoming).await.unwrap();
        });
    });
    is_ready.recv().unwrap();
}
