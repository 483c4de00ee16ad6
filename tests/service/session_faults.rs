//! Through a network that fails at any moment no accepted state is lost, none is there twice, and no call exceeds its
//! timeout.

use super::attached::{refusal, trial};
use super::network_faults::Cut;
use super::test_server::{Running, block_on, bundle, compiled, start_kept, start_with};
use bimorph::compile::{CompileOptions, compile};
use bimorph::device::local::LocalDevice;
use bimorph::device::{Device, DeviceError, Mode, OpenRequest, Status, Token, Trial, TrialReply};
use bimorph::service::client::RemoteDevice;
use bimorph::service::limits::Limits;
use bimorph::service::proto;
use bimorph::service::server::MakeDevice;
use proto::bimorph_client::BimorphClient;
use proto::device_reply::Kind as ReplyKind;
use proto::device_request::Kind as Ask;
use std::future::Future;
use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, mpsc};
use std::time::Duration;
use tonic::transport::{Channel, Endpoint};
use tonic::{Code, Streaming};

/// Longest wait for one answer.
pub(crate) const PATIENCE: Duration = Duration::from_millis(400);
/// No call may take longer.
const HANG: Duration = Duration::from_secs(5);
/// Length of a step (s).
const DT: f64 = 1e-7;
/// Steps of a whole run.
const STEPS: usize = 30;
/// Bytes within which a connection fails: some ten steps.
const WITHIN: u64 = 6000;

/// The device in the process of the server.
pub(crate) const LOCAL: MakeDevice = |compiled| Box::new(LocalDevice::new(compiled));

fn volts(step: usize) -> f64 {
    1.0 + (step % 7) as f64
}

/// Where a server listens.
pub(crate) fn socket(server: &Running) -> SocketAddr {
    server.address.uri().trim_start_matches("http://").parse().expect("an address")
}

/// Loss by the network: a missing reply, or an ended stream.
#[derive(Debug)]
struct Lost;

/// Waits for something, not for ever.
async fn within<T, E>(answer: impl Future<Output = Result<T, E>>) -> Result<T, Lost> {
    tokio::time::timeout(PATIENCE, answer).await.map_err(|_| Lost)?.map_err(|_| Lost)
}

/// A stream that may end at any moment.
struct Line {
    requests: tokio::sync::mpsc::Sender<proto::DeviceRequest>,
    replies: Streaming<proto::DeviceReply>,
}

impl Line {
    /// Begins on a connection of its own.
    async fn start(uri: &str, first: Ask) -> Result<(Self, proto::OpenResponse), Lost> {
        let endpoint = Endpoint::from_shared(uri.to_owned()).expect("a uri");
        let mut client: BimorphClient<Channel> = BimorphClient::new(within(endpoint.connect()).await?);
        let (requests, queue) = tokio::sync::mpsc::channel(4);
        let replies = within(client.trial(tokio_stream::wrappers::ReceiverStream::new(queue))).await?.into_inner();
        let mut line = Self { requests, replies };
        match line.ask(first).await? {
            ReplyKind::Opened(opened) => Ok((line, opened)),
            other => panic!("the session is there: {other:?}"),
        }
    }

    async fn ask(&mut self, kind: Ask) -> Result<ReplyKind, Lost> {
        within(self.requests.send(proto::DeviceRequest { kind: Some(kind) })).await?;
        within(self.replies.message()).await?.and_then(|reply| reply.kind).ok_or(Lost)
    }

    /// A step, tried and accepted.
    async fn step(&mut self, step: usize, parent: u64) -> Result<proto::TrialReply, Lost> {
        let reply = match self.ask(trial(parent, DT, volts(step))).await? {
            ReplyKind::Trial(reply) => reply,
            other => panic!("the state is there: {other:?}"),
        };
        match self.ask(Ask::Accept(proto::Accept { token: reply.token, answer: true, warn: false })).await? {
            ReplyKind::Accepted(accepted) => assert_eq!((accepted.token, accepted.kept), (reply.token, true)),
            // a stream that the network held back has joined meanwhile
            other => {
                assert_eq!(refusal(&other), Code::Aborted, "{other:?}");
                return Err(Lost);
            }
        }
        Ok(reply)
    }
}

/// A stored session through so many failures: confirmed accepts are there again, each step is in the run once, and the
/// run has the bits of an undisturbed one.
fn kept(failures: u64, seed: u64) {
    let folder = tempfile::tempdir().expect("a folder");
    let server = start_kept(folder.path(), Limits { analyses: 4, ..Limits::default() }, LOCAL);
    let cut = Cut::to(socket(&server), seed, WITHIN);
    let uri = cut.uri();
    block_on(async {
        let mut direct = server.client().await;
        let model = compiled(&mut direct).await;
        let open = proto::OpenRequest { model, ..Default::default() };
        let session = direct.open(open.clone()).await.expect("opens").into_inner().session;
        let (mut done, mut parent, mut unheard) = (Vec::<proto::TrialReply>::new(), 0, 0);
        while cut.failed() < failures || done.len() < STEPS {
            if cut.failed() >= failures {
                cut.calm();
            }
            let attach = Ask::Attach(proto::Attach { session: session.clone() });
            let Ok((mut line, opened)) = Line::start(&uri, attach).await else { continue };
            let mut accepted = opened.accepted;
            while cut.failed() < failures || done.len() < STEPS {
                let Ok(reply) = line.step(done.len(), parent).await else { break };
                if accepted != parent {
                    // accepted, and cut off before the reply: the same step gives the same state
                    assert_eq!(reply.token, accepted);
                    unheard += 1;
                }
                (parent, accepted) = (reply.token, reply.token);
                done.push(reply);
            }
        }
        let (mut whole, _) = Line::start(&server.address.uri(), Ask::Open(open)).await.expect("a stream");
        let mut parent = 0;
        for (step, reply) in done.iter().enumerate() {
            let Ok(ReplyKind::Trial(expected)) = whole.ask(trial(parent, DT, volts(step))).await else {
                panic!("steps")
            };
            assert_eq!(*reply, expected, "step {step}");
            parent = expected.token;
        }
        println!("kept session: {} steps, {}, {unheard} accepted unheard", done.len(), cut.reported());
    });
}

/// Role of a circuit: steps from the start, again after each failure, until all of them are answered.
fn circuit(uri: &str, expected: &[TrialReply], report: &mpsc::Sender<()>) {
    let request = OpenRequest { ports: vec![], signals: vec!["m.x".into()], noise: None };
    loop {
        let device = RemoteDevice::connect(uri, &bundle(), &CompileOptions::default(), PATIENCE);
        let _ = report.send(());
        let Ok(mut device) = device else { continue };
        // opened again on the same device: it connects anew by itself
        for _ in 0..3 {
            let opened = device.open(&request);
            let _ = report.send(());
            if opened.is_err() {
                continue;
            }
            if run(&mut device, expected, report).is_ok() {
                return;
            }
            let again = device.trial(&question(None, &[1.0]), &mut TrialReply::default());
            assert!(matches!(&again, Err(DeviceError::Remote { .. })), "{again:?}");
        }
    }
}

fn question(parent: Option<Token>, voltages: &[f64]) -> Trial<'_> {
    Trial { mode: Mode::Transient, parent, t: 0.0, dt: DT, voltages }
}

/// A run from the start: each answer is the right one.
fn run(device: &mut dyn Device, expected: &[TrialReply], report: &mpsc::Sender<()>) -> Result<(), DeviceError> {
    let mut parent = None;
    for (step, expected) in expected.iter().enumerate() {
        let mut reply = TrialReply::default();
        let answered = device.trial(&question(parent, &[volts(step)]), &mut reply);
        let _ = report.send(());
        answered?;
        assert_eq!(reply, *expected, "step {step}");
        parent = reply.token;
        parent.into_iter().for_each(|token| device.accept(token));
    }
    Ok(())
}

/// A circuit with a device on a server through so many failures: every reply is the right one, a device that was cut
/// off reports it until it is opened again, and no call blocks.
fn co_simulation(failures: u64, seed: u64) {
    let server = start_with("127.0.0.1:0", Limits::default(), LOCAL);
    let cut = Cut::to(socket(&server), seed, WITHIN);
    let compiled = Arc::new(compile(&bundle(), &CompileOptions::default()).expect("compiles"));
    let mut here = LocalDevice::new(compiled);
    here.open(&OpenRequest { ports: vec![], signals: vec!["m.x".into()], noise: None }).expect("opens");
    let (mut expected, mut parent) = (Vec::new(), None);
    for step in 0..STEPS {
        let mut reply = TrialReply::default();
        here.trial(&question(parent, &[volts(step)]), &mut reply).expect("steps");
        assert_eq!(reply.status, Status::Ok);
        parent = reply.token;
        expected.push(reply);
    }
    let (report, reported) = mpsc::channel();
    let (uri, calm) = (cut.uri(), Arc::new(AtomicBool::new(false)));
    let theirs = Arc::clone(&calm);
    let running = std::thread::spawn(move || {
        while !theirs.load(Ordering::SeqCst) {
            circuit(&uri, &expected, &report);
        }
        // nothing disturbs this one
        circuit(&uri, &expected, &report);
    });
    let mut calls = 0_u64;
    loop {
        match reported.recv_timeout(HANG) {
            Ok(()) => calls += 1,
            Err(mpsc::RecvTimeoutError::Timeout) => panic!("a call hangs"),
            Err(mpsc::RecvTimeoutError::Disconnected) => break,
        }
        if cut.failed() >= failures {
            cut.calm();
            calm.store(true, Ordering::SeqCst);
        }
    }
    running.join().expect("every answer is right");
    println!("co-simulation: {calls} calls, {}", cut.reported());
}

#[test]
fn a_kept_session_through_a_network_that_fails() {
    kept(8, 1);
}

#[test]
fn a_circuit_through_a_network_that_fails() {
    co_simulation(8, 2);
}

/// Two hundred failures of each: `make soak`.
#[test]
#[ignore = "minutes; make soak"]
fn soak_a_network_that_fails() {
    for seed in 0..20 {
        kept(10, 100 + seed);
        co_simulation(10, 200 + seed);
    }
}

/// A stream that the network delayed accepts nothing after another one has attached: later accepts stay, here and on
/// the disk.
#[test]
fn what_was_held_back_undoes_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let limits = || Limits { analyses: 4, ..Limits::default() };
    let server = start_kept(folder.path(), limits(), LOCAL);
    let (session, last) = block_on(async {
        let mut direct = server.client().await;
        let open = proto::OpenRequest { model: compiled(&mut direct).await, ..Default::default() };
        let session = direct.open(open).await.expect("opens").into_inner().session;
        let attach = || Ask::Attach(proto::Attach { session: session.clone() });
        let uri = server.address.uri();
        let (mut old, _) = Line::start(&uri, attach()).await.expect("attaches");
        let first = old.step(0, 0).await.expect("steps").token;
        let Ok(ReplyKind::Trial(held_back)) = old.ask(trial(first, DT, 5.0)).await else { panic!("steps") };
        // another connection, another step from the same state, and one after it
        let (mut new, opened) = Line::start(&uri, attach()).await.expect("attaches");
        assert_eq!(opened.accepted, first);
        let second = new.step(1, first).await.expect("steps").token;
        let last = new.step(2, second).await.expect("steps").token;
        for (token, answer) in [(held_back.token, false), (held_back.token, true), (first, true)] {
            let accept = Ask::Accept(proto::Accept { token, answer, warn: false });
            if answer {
                assert_eq!(refusal(&old.ask(accept).await.expect("an answer")), Code::Aborted);
            } else {
                old.requests.send(proto::DeviceRequest { kind: Some(accept) }).await.expect("sent");
            }
        }
        // neither is the newer stream held up by what the other could not
        assert!(matches!(new.ask(trial(last, DT, 1.0)).await, Ok(ReplyKind::Trial(_))));
        (session, last)
    });
    drop(server);
    let server = start_kept(folder.path(), limits(), LOCAL);
    block_on(async {
        let attach = Ask::Attach(proto::Attach { session });
        let (mut line, opened) = Line::start(&server.address.uri(), attach).await.expect("it is kept");
        assert_eq!(opened.accepted, last);
        line.step(3, last).await.expect("goes on");
    });
}
