//! A session that is stepped: each step is tried and accepted.

use crate::command::{Bench, PLATE};
use crate::serve_process::Server;
use bimorph::netlist::Bundle;
use bimorph::service::convert::model::bundle_to_wire;
use bimorph::service::proto;
use proto::bimorph_client::BimorphClient;
use proto::device_reply::Kind as Reply;
use proto::device_request::Kind as Ask;
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tonic::transport::{Channel, Endpoint};
use tonic::{Code, Status, Streaming};

/// Length of a step (s).
const DT: f64 = 1e-7;

/// Voltages of the circuit in a step (V).
fn voltages(step: usize) -> Vec<f64> {
    vec![1.0 + (step % 7) as f64]
}

/// One stream of a session.
pub(crate) struct Stream {
    requests: mpsc::Sender<proto::DeviceRequest>,
    replies: Streaming<proto::DeviceReply>,
}

impl Stream {
    /// Begins with what the first message says.
    pub(crate) async fn start(
        client: &mut BimorphClient<Channel>,
        first: Ask,
    ) -> Result<(Self, proto::OpenResponse), Status> {
        let (requests, queue) = mpsc::channel(4);
        let replies = client.trial(ReceiverStream::new(queue)).await?.into_inner();
        let mut stream = Self { requests, replies };
        match stream.ask(first).await? {
            Reply::Opened(opened) => Ok((stream, opened)),
            Reply::Fault(proto::Fault { kind: Some(proto::fault::Kind::Refused(refused)), message }) => {
                Err(Status::new(refused.code.into(), message))
            }
            other => panic!("{other:?}"),
        }
    }

    /// One request.
    pub(crate) async fn ask(&mut self, kind: Ask) -> Result<Reply, Status> {
        let gone = || Status::unavailable("the stream has ended");
        self.requests.send(proto::DeviceRequest { kind: Some(kind) }).await.map_err(|_| gone())?;
        self.replies.message().await?.and_then(|reply| reply.kind).ok_or_else(gone)
    }

    /// One step from a state: tried and accepted. The reply, and whether the state is kept.
    pub(crate) async fn step(&mut self, step: usize, parent: u64) -> Result<(proto::TrialReply, bool), Status> {
        let mode = proto::Mode::Transient.into();
        let trial = proto::TrialRequest { mode, parent, t: 0.0, dt: DT, voltages: voltages(step) };
        let Reply::Trial(reply) = self.ask(Ask::Trial(trial)).await? else { panic!("a trial has a reply") };
        assert_eq!(reply.status(), proto::trial_reply::Status::Ok, "the plate takes such steps");
        let accept = proto::Accept { token: reply.token, answer: true, warn: false };
        match self.ask(Ask::Accept(accept)).await? {
            Reply::Accepted(accepted) => Ok((reply, accepted.kept)),
            Reply::Fault(fault) => Err(Status::data_loss(fault.message)),
            other => panic!("{other:?}"),
        }
    }

    /// The same, which may be refused: the words.
    pub(crate) async fn try_step(&mut self, step: usize, parent: u64) -> Result<proto::TrialReply, String> {
        self.step(step, parent).await.map(|(reply, _)| reply).map_err(|status| status.message().to_owned())
    }
}

/// A client of a server.
pub(crate) async fn client(address: &str) -> BimorphClient<Channel> {
    let endpoint = Endpoint::from_shared(address.to_owned()).expect("a uri");
    BimorphClient::new(endpoint.connect().await.expect("the server listens"))
}

/// The id of the plate.
pub(crate) async fn compiled(client: &mut BimorphClient<Channel>) -> String {
    let bundle = Some(bundle_to_wire(&Bundle::from_text("plate.net", PLATE)));
    let answer = client.compile(proto::CompileRequest { bundle, options: None }).await.expect("compiles");
    answer.into_inner().model.expect("a model").id
}

/// A server that keeps states, and is killed and started anew.
pub(crate) struct Killed {
    pub(crate) bench: Bench,
    options: String,
    server: Server,
    pub(crate) wire: BimorphClient<Channel>,
}

impl Killed {
    /// Starts one with these options more.
    pub(crate) async fn start(more: &str) -> Self {
        let bench = Bench::new(&[]);
        let options = format!("--listen unix://{} --state-dir states", bench.path("s").display());
        let server = Server::start(&bench, &format!("{options} {more}"));
        let wire = client(&server.address).await;
        Self { bench, options, server, wire }
    }

    /// The rest of the next output line that contains `head`.
    pub(crate) fn line(&mut self, head: &str) -> String {
        self.server.line(head)
    }

    /// Its process.
    pub(crate) fn id(&self) -> u32 {
        self.server.id()
    }

    /// Kills it.
    pub(crate) fn kill(&mut self) {
        assert_eq!(self.server.signal("-KILL"), None);
    }

    /// Starts it anew, with these options more.
    pub(crate) async fn revive(&mut self, more: &str) {
        self.server = Server::start(&self.bench, &format!("{} {more}", self.options));
        self.wire = client(&self.server.address).await;
    }

    /// Both.
    pub(crate) async fn again(&mut self) {
        self.kill();
        self.revive("").await;
    }

    /// A kept session of the plate.
    pub(crate) async fn open(&mut self) -> String {
        let request = proto::OpenRequest { model: compiled(&mut self.wire).await, ..Default::default() };
        let opened = self.wire.open(request).await.expect("opens").into_inner();
        assert!(opened.kept);
        opened.session
    }

    /// A stream of a session, which is kept.
    pub(crate) async fn attach(&mut self, session: &str) -> Stream {
        self.try_attach(session).await.expect("it is kept")
    }

    /// A stream of a session; the code and the words of the refusal.
    pub(crate) async fn try_attach(&mut self, session: &str) -> Result<Stream, (Code, String)> {
        let attach = Ask::Attach(proto::Attach { session: session.to_owned() });
        let refused = |status: Status| (status.code(), status.message().to_owned());
        Stream::start(&mut self.wire, attach).await.map(|(stream, _)| stream).map_err(refused)
    }
}
