//! Resources of one client are bounded, reported with their use, and cost no other client anything.

use super::attached::trial;
use super::jobs::{MANY, request};
use super::session_faults::LOCAL;
use super::test_server::{Running, block_on, start_guarded, wire_bundle};
use bimorph::service::limits::Limits;
use bimorph::service::proto;
use proto::bimorph_client::BimorphClient;
use proto::device_reply::Kind as ReplyKind;
use proto::device_request::Kind as Ask;
use std::time::Duration;
use tonic::service::Interceptor;
use tonic::service::interceptor::InterceptedService;
use tonic::transport::{Channel, Endpoint};
use tonic::{Code, Request, Status};

pub(crate) const TOKENS: &str = "alice alice-0123456789abcdef\nbob bob-0123456789abcdef\n";

/// Shows a token.
#[derive(Clone)]
pub(crate) struct Shows(pub(crate) &'static str);

impl Interceptor for Shows {
    fn call(&mut self, mut request: Request<()>) -> Result<Request<()>, Status> {
        let token = format!("Bearer {}-0123456789abcdef", self.0).parse().expect("a header");
        request.metadata_mut().insert("authorization", token);
        Ok(request)
    }
}

pub(crate) type Known = BimorphClient<InterceptedService<Channel, Shows>>;

/// A server with tokens of alice and bob.
pub(crate) fn server(limits: Limits) -> (tempfile::TempDir, Running) {
    let folder = tempfile::tempdir().expect("a folder");
    let tokens = folder.path().join("tokens");
    std::fs::write(&tokens, TOKENS).expect("written");
    let server = start_guarded(&tokens, Limits { analyses: 4, ..limits }, LOCAL);
    (folder, server)
}

/// A client on a connection of its own.
pub(crate) async fn client(server: &Running, name: &'static str) -> Known {
    let endpoint = Endpoint::from_shared(server.address.uri()).expect("a uri");
    BimorphClient::with_interceptor(endpoint.connect().await.expect("connects"), Shows(name))
}

async fn compile(client: &mut Known) -> Result<proto::ModelDescription, Status> {
    let request = proto::CompileRequest { bundle: wire_bundle(), options: None };
    client.compile(request).await.map(|answer| answer.into_inner().model.expect("a model"))
}

async fn open(client: &mut Known, model: &str) -> Result<String, Status> {
    let request = proto::OpenRequest { model: model.to_owned(), ..Default::default() };
    client.open(request).await.map(|answer| answer.into_inner().session)
}

/// A stream of requests, with the first reply.
async fn stream(
    client: &mut Known,
    first: Ask,
) -> (tokio::sync::mpsc::Sender<proto::DeviceRequest>, tonic::Streaming<proto::DeviceReply>, ReplyKind) {
    let (requests, queue) = tokio::sync::mpsc::channel(4);
    requests.send(proto::DeviceRequest { kind: Some(first) }).await.expect("queued");
    let replies = client.trial(tokio_stream::wrappers::ReceiverStream::new(queue)).await.expect("a stream");
    let mut replies = replies.into_inner();
    let answer = replies.message().await.expect("a reply").expect("a reply").kind.expect("a kind");
    (requests, replies, answer)
}

/// Sessions of one client, by calls, by streams and on any connection, are counted together; what ends makes room.
#[test]
fn sessions_of_one_client() {
    let (_folder, server) = server(Limits { client_sessions: 2, ..Limits::default() });
    block_on(async {
        let (mut alice, mut again) = (client(&server, "alice").await, client(&server, "alice").await);
        let model = compile(&mut alice).await.expect("compiles").id;
        let first = open(&mut alice, &model).await.expect("opens");
        let own = Ask::Open(proto::OpenRequest { model: model.clone(), ..Default::default() });
        let (requests, replies, opened) = stream(&mut again, own.clone()).await;
        assert!(matches!(opened, ReplyKind::Opened(_)), "{opened:?}");
        let refused = open(&mut again, &model).await.expect_err("two are open");
        assert_eq!(refused.code(), Code::ResourceExhausted);
        let text = "client_sessions: at most 2 for client \"alice\", 2 used, 1 more requested";
        assert!(refused.message().starts_with(text), "{refused}");
        let (_, _, refused) = stream(&mut again, own).await;
        assert_eq!(super::attached::refusal(&refused), Code::ResourceExhausted);
        // neither does a fork get around it
        let fork = alice.fork(proto::ForkRequest { session: first.clone() }).await.expect_err("two are open");
        assert_eq!(fork.code(), Code::ResourceExhausted);

        open(&mut client(&server, "bob").await, &model).await.expect("bob has his own");
        alice.close(proto::CloseRequest { session: first }).await.expect("closes");
        open(&mut alice, &model).await.expect("there is room again");
        drop((requests, replies));
        // the end of a stream is seen a moment later
        while open(&mut alice, &model).await.is_err() {
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    });
}

/// Unknowns of all open sessions of one client are counted together.
#[test]
fn unknowns_of_one_client() {
    let (_folder, server) = server(Limits { client_unknowns: 5, ..Limits::default() });
    block_on(async {
        let mut alice = client(&server, "alice").await;
        let model = compile(&mut alice).await.expect("compiles");
        let fit = 5 / usize::try_from(model.unknowns).expect("few");
        assert!((1..=5).contains(&fit), "a plate has {} unknowns", model.unknowns);
        for _ in 0..fit {
            open(&mut alice, &model.id).await.expect("opens");
        }
        let refused = open(&mut alice, &model.id).await.expect_err("no room");
        assert_eq!(refused.code(), Code::ResourceExhausted);
        assert!(refused.message().starts_with("client_unknowns: at most 5 for client \"alice\""), "{refused}");
        open(&mut client(&server, "bob").await, &model.id).await.expect("bob has his own");
    });
}

/// Memory of the computations of one client is bounded; rejected requests hold none.
#[test]
fn bytes_of_one_client() {
    let (_folder, server) = server(Limits { client_bytes: 100, ..Limits::default() });
    block_on(async {
        let mut alice = client(&server, "alice").await;
        for _ in 0..3 {
            let model = compile(&mut alice).await;
            let refused = match model {
                Ok(model) => alice.modes(proto::ModesRequest { model: model.id, ..Default::default() }).await.err(),
                Err(refused) => Some(refused),
            };
            let refused = refused.expect("100 bytes are not enough");
            assert_eq!(refused.code(), Code::ResourceExhausted);
            let text = "client_bytes: at most 100 bytes at once in all computations of one client, ";
            assert!(refused.message().starts_with(text), "{refused}");
        }
    });
}

/// A client whose processor time is used up computes no more, on streams neither; others do.
#[test]
#[cfg(target_os = "linux")]
fn processor_time_of_one_client() {
    let (_folder, server) = server(Limits { client_cpu: Duration::from_millis(300), ..Limits::default() });
    block_on(async {
        let (mut alice, mut bob) = (client(&server, "alice").await, client(&server, "bob").await);
        let model = compile(&mut alice).await.expect("compiles").id;
        let voltages = vec![proto::Named { name: "drive".into(), value: 3.0 }];
        let transient = proto::TransientRequest {
            model: model.clone(),
            stop_s: 1e6,
            tol: 1e-9,
            voltages: voltages.clone(),
            ..Default::default()
        };
        let mut run = alice.transient(transient).await.expect("begins").into_inner();
        let refused = loop {
            match run.message().await {
                Ok(Some(_)) => {}
                Ok(None) => panic!("a run of days is over"),
                Err(refused) => break refused,
            }
        };
        assert_eq!(refused.code(), Code::ResourceExhausted, "{refused}");
        let text = "client_cpu: at most 0.3 s of processor time of one client within an hour, 0.";
        assert!(refused.message().starts_with(text), "{refused}");
        let request = proto::StaticRequest { model: model.clone(), voltages, ..Default::default() };
        let again = alice.r#static(request.clone()).await.expect_err("nothing is left");
        assert_eq!(again.code(), Code::ResourceExhausted);
        bob.r#static(request).await.expect("bob has his own");

        let own = || Ask::Open(proto::OpenRequest { model: model.clone(), ..Default::default() });
        let (requests, mut replies, opened) = stream(&mut bob, own()).await;
        assert!(matches!(opened, ReplyKind::Opened(_)), "{opened:?}");
        requests.send(proto::DeviceRequest { kind: Some(trial(0, 0.0, 1.0)) }).await.expect("sent");
        let reply = replies.message().await.expect("a reply").expect("a reply").kind.expect("a kind");
        assert!(matches!(reply, ReplyKind::Trial(_)), "{reply:?}");
        let (_, _, refused) = stream(&mut alice, own()).await;
        assert_eq!(super::attached::refusal(&refused), Code::ResourceExhausted);
    });
}

/// A job whose client has used up its processor time ends with the rows that it has. Points that it could not compute
/// have no row, and a client without quota can still cancel and delete.
#[test]
#[cfg(target_os = "linux")]
fn a_job_of_a_client_without_processor_time() {
    let (_folder, server) = server(Limits { client_cpu: Duration::from_millis(300), ..Limits::default() });
    block_on(async {
        let mut alice = client(&server, "alice").await;
        let name = alice.submit_job(request(MANY)).await.expect("starts").into_inner().name;
        let watched = proto::WatchJobRequest { name: name.clone() };
        let mut watched = alice.watch_job(watched).await.expect("a stream").into_inner();
        let mut last = None;
        while let Some(job) = watched.message().await.expect("goes on") {
            last = Some(job);
        }
        let last = last.expect("reported");
        let metadata = last.metadata.expect("metadata");
        let Some(proto::job::Result::Error(why)) = last.result else { panic!("it is not done: {metadata:?}") };
        assert!(why.code == Code::ResourceExhausted as i32 && why.message.starts_with("client_cpu: "), "{why:?}");
        assert!(metadata.rows > 0 && metadata.failed == 0, "{metadata:?}");
        alice.cancel_job(proto::CancelJobRequest { name: name.clone() }).await.expect("costs nothing");
        alice.delete_job(proto::DeleteJobRequest { name: name.clone() }).await.expect("costs nothing");
        let gone = alice.get_job(proto::GetJobRequest { name }).await.expect_err("is gone");
        assert_eq!(gone.code(), Code::NotFound);
    });
}
