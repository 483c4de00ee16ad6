//! Stored sessions survive panics, aborted restores, and any event during a restore.

use super::attached::{Attached, refusal, trial};
use super::test_server::{Running, block_on, compiled, start_kept};
use bimorph::budget;
use bimorph::compile::CompiledModel;
use bimorph::device::local::LocalDevice;
use bimorph::device::{Description, Device, DeviceError, OpenRequest, SmallSignal, Token, Trial, TrialReply};
use bimorph::service::limits::Limits;
use bimorph::service::proto;
use bimorph::service::server::MakeDevice;
use proto::bimorph_client::BimorphClient;
use proto::device_reply::Kind as ReplyKind;
use proto::device_request::Kind as Ask;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;
use tempfile::TempDir;
use tonic::Code;
use tonic::transport::Channel;

/// The voltage at which the device panics (V).
const PANIC: f64 = 666.0;
/// Length of a step (s).
const DT: f64 = 1e-7;

/// Blocks loads of states.
#[derive(Default)]
struct Gate {
    shut: AtomicBool,
    /// Number of waiting loads.
    inside: AtomicUsize,
}

impl Gate {
    const fn open() -> Self {
        Self { shut: AtomicBool::new(false), inside: AtomicUsize::new(0) }
    }

    /// Waits until it is open, or the budget is withdrawn.
    fn pass(&self) {
        struct Inside<'a>(&'a AtomicUsize);
        impl Drop for Inside<'_> {
            fn drop(&mut self) {
                self.0.fetch_sub(1, Ordering::SeqCst);
            }
        }
        self.inside.fetch_add(1, Ordering::SeqCst);
        let _inside = Inside(&self.inside);
        while self.shut.load(Ordering::SeqCst) {
            budget::check();
            std::thread::sleep(Duration::from_millis(1));
        }
    }

    /// Waits until so many are at it.
    async fn has(&self, count: usize) {
        while self.inside.load(Ordering::SeqCst) != count {
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
    }
}

/// A device in process that panics at [`PANIC`], and loads states when its gate is open.
struct Faulty(LocalDevice, &'static Gate);

impl Device for Faulty {
    fn open(&mut self, request: &OpenRequest) -> Result<Description, DeviceError> {
        self.0.open(request)
    }

    fn trial(&mut self, request: &Trial<'_>, reply: &mut TrialReply) -> Result<(), DeviceError> {
        assert!(request.voltages != [PANIC], "asked to panic");
        self.0.trial(request, reply)
    }

    fn accept(&mut self, token: Token) {
        self.0.accept(token);
    }

    fn linearize(&mut self, token: Token, omega: f64, reply: &mut SmallSignal) -> Result<(), DeviceError> {
        self.0.linearize(token, omega, reply)
    }

    fn save(&self, only: Option<&[Token]>) -> Result<Vec<u8>, DeviceError> {
        self.0.save(only)
    }

    fn parent(&self, token: Token) -> Option<Token> {
        self.0.parent(token)
    }

    fn load(&mut self, saved: &[u8]) -> Result<Description, DeviceError> {
        self.1.pass();
        self.0.load(saved)
    }
}

/// A maker of devices with a gate of their own.
macro_rules! gated {
    ($gate:ident) => {{
        fn make(compiled: Arc<CompiledModel>) -> Box<dyn Device> {
            Box::new(Faulty(LocalDevice::new(compiled), &$gate))
        }
        make as MakeDevice
    }};
}

fn limits() -> Limits {
    Limits { analyses: 4, ..Limits::default() }
}

async fn open(client: &mut BimorphClient<Channel>) -> proto::OpenResponse {
    let model = compiled(client).await;
    client.open(proto::OpenRequest { model, ..Default::default() }).await.expect("opens").into_inner()
}

/// A kept session with one accepted state, whose server has stopped; its id and the state.
fn asleep(folder: &Path, make: MakeDevice) -> (String, u64) {
    let server = start_kept(folder, limits(), make);
    block_on(async {
        let mut client = server.client().await;
        let session = open(&mut client).await.session;
        let mut stream = Attached::to(&mut client, &session).await;
        let token = stream.trial(0, 0.0, 1.0).await.token;
        stream.accept(token).await;
        (session, token)
    })
}

/// A server with a stored session, and a gate that blocks its restore.
struct Asleep {
    server: Running,
    folder: TempDir,
    gate: &'static Gate,
    session: String,
    /// Its accepted state.
    token: u64,
}

impl Asleep {
    fn new(gate: &'static Gate, make: MakeDevice, limits: Limits) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let (session, token) = asleep(folder.path(), make);
        let server = start_kept(folder.path(), limits, make);
        Self { server, folder, gate, session, token }
    }

    /// A client that restores it, and waits at the gate.
    async fn waking(&self, client: &mut BimorphClient<Channel>) -> Attached {
        self.gate.shut.store(true, Ordering::SeqCst);
        let waking = Attached::ask_to_join(client, &self.session).await;
        self.gate.has(1).await;
        waking
    }

    fn open_the_gate(&self) {
        self.gate.shut.store(false, Ordering::SeqCst);
    }

    /// Numbers of remaining sessions and models.
    fn left(&self) -> [usize; 2] {
        ["sessions", "models"].map(|name| std::fs::read_dir(self.folder.path().join(name)).expect("a folder").count())
    }
}

/// A trial that panics closes its session; the states are there as they were accepted, and a new stream continues with
/// them.
#[test]
fn a_panic_takes_no_state_along() {
    static GATE: Gate = Gate::open();
    let folder = tempfile::tempdir().expect("a folder");
    let server = start_kept(folder.path(), limits(), gated!(GATE));
    block_on(async {
        let mut client = server.client().await;
        let session = open(&mut client).await.session;
        let mut stream = Attached::to(&mut client, &session).await;
        let token = stream.trial(0, 0.0, 1.0).await.token;
        stream.accept(token).await;
        let next = stream.trial(token, DT, 2.0).await;
        assert_eq!(refusal(&stream.ask(trial(token, DT, PANIC)).await), Code::Internal);
        assert_eq!(refusal(&stream.ask(trial(token, DT, 2.0)).await), Code::NotFound);
        let (mut again, opened) = Attached::join(&mut client, &session).await.expect("it is kept");
        assert_eq!(opened.accepted, token);
        assert_eq!(again.trial(token, DT, 2.0).await, next);
    });
}

/// A wake whose client goes away in the middle leaves the session asleep: the next one finds it whole.
#[test]
fn a_wake_that_is_stopped_leaves_it_asleep() {
    static GATE: Gate = Gate::open();
    let asleep = Asleep::new(&GATE, gated!(GATE), limits());
    block_on(async {
        let mut client = asleep.server.client().await;
        let waking = asleep.waking(&mut client).await;
        drop(waking);
        GATE.has(0).await;
        asleep.open_the_gate();
        let (mut stream, opened) = Attached::join(&mut client, &asleep.session).await.expect("it is kept");
        assert_eq!(opened.device.expect("a description").ports, ["drive"]);
        assert_eq!(opened.accepted, asleep.token);
        stream.trial(asleep.token, DT, 2.0).await;
    });
}

/// A Restore whose client goes away in the middle leaves no session, and nothing in the folder.
#[test]
fn a_restore_that_is_stopped_leaves_nothing() {
    static GATE: Gate = Gate::open();
    let folder = tempfile::tempdir().expect("a folder");
    let server = start_kept(folder.path(), Limits { sessions: 1, ..limits() }, gated!(GATE));
    block_on(async {
        let mut client = server.client().await;
        let session = open(&mut client).await.session;
        let request = proto::SnapshotRequest { session: session.clone(), token: 0 };
        let snapshot = client.snapshot(request).await.expect("a snapshot").into_inner().snapshot;
        client.close(proto::CloseRequest { session }).await.expect("closes");
        GATE.shut.store(true, Ordering::SeqCst);
        let model = compiled(&mut client).await;
        let mut other = client.clone();
        let restoring = tokio::spawn(async move { other.restore(proto::RestoreRequest { model, snapshot }).await });
        GATE.has(1).await;
        restoring.abort();
        GATE.has(0).await;
        GATE.shut.store(false, Ordering::SeqCst);
        let session = open(&mut client).await.session;
        client.close(proto::CloseRequest { session }).await.expect("closes");
        assert_eq!(std::fs::read_dir(folder.path().join("models")).expect("a folder").count(), 0);
    });
}

/// While one session wakes slowly, others open, and their states are kept.
#[test]
fn a_slow_restore_blocks_no_client() {
    static GATE: Gate = Gate::open();
    let asleep = Asleep::new(&GATE, gated!(GATE), limits());
    block_on(async {
        let mut client = asleep.server.client().await;
        let mut slow = asleep.waking(&mut client).await;
        let other = open(&mut client).await;
        assert!(other.kept);
        client.close(proto::CloseRequest { session: other.session }).await.expect("closes");
        asleep.open_the_gate();
        let opened = slow.answer().await;
        assert!(matches!(&opened, proto::device_reply::Kind::Opened(o) if o.accepted == asleep.token), "{opened:?}");
    });
}

/// Two streams that request one stored session get the same one, and one of them accepts.
#[test]
fn two_who_wake_one_session() {
    static GATE: Gate = Gate::open();
    let asleep = Asleep::new(&GATE, gated!(GATE), Limits { sessions: 1, ..limits() });
    block_on(async {
        let mut client = asleep.server.client().await;
        GATE.shut.store(true, Ordering::SeqCst);
        let mut both = [
            Attached::ask_to_join(&mut client, &asleep.session).await,
            Attached::ask_to_join(&mut client, &asleep.session).await,
        ];
        GATE.has(2).await;
        asleep.open_the_gate();
        for stream in &mut both {
            let opened = stream.answer().await;
            assert!(matches!(opened, proto::device_reply::Kind::Opened(_)), "{opened:?}");
        }
        let [first, second] = &mut both;
        let next = first.trial(asleep.token, DT, 2.0).await;
        assert_eq!(second.trial(asleep.token, DT, 2.0).await, next);
        let accept = || Ask::Accept(proto::Accept { token: next.token, answer: true, warn: false });
        let answers = [first.ask(accept()).await, second.ask(accept()).await];
        let accepted = answers.iter().filter(|answer| matches!(answer, ReplyKind::Accepted(_))).count();
        let refused = answers.iter().filter(|answer| matches!(answer, ReplyKind::Fault(_))).map(refusal);
        assert_eq!((accepted, refused.collect::<Vec<_>>()), (1, vec![Code::Aborted]));
    });
}

/// A session whose lifetime ends during its restore is gone: the restoring client receives an error, and nothing of the
/// session is left.
#[test]
fn what_wakes_too_late() {
    static GATE: Gate = Gate::open();
    let asleep = Asleep::new(&GATE, gated!(GATE), Limits { stream_idle: Duration::from_secs(2), ..limits() });
    block_on(async {
        let mut client = asleep.server.client().await;
        let mut waking = asleep.waking(&mut client).await;
        while asleep.left() != [0, 0] {
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
        asleep.open_the_gate();
        assert_eq!(refusal(&waking.answer().await), Code::NotFound);
        assert_eq!(Attached::join(&mut client, &asleep.session).await.err(), Some(Code::NotFound));
        assert_eq!(asleep.left(), [0, 0]);
    });
}

/// Close while a session wakes ends it: it does not come back, and nothing is left of it.
#[test]
fn closing_what_wakes() {
    static GATE: Gate = Gate::open();
    let asleep = Asleep::new(&GATE, gated!(GATE), limits());
    block_on(async {
        let mut client = asleep.server.client().await;
        let mut waking = asleep.waking(&mut client).await;
        client.close(proto::CloseRequest { session: asleep.session.clone() }).await.expect("closes");
        asleep.open_the_gate();
        assert_eq!(refusal(&waking.answer().await), Code::NotFound);
        assert_eq!(Attached::join(&mut client, &asleep.session).await.err(), Some(Code::NotFound));
        assert_eq!(asleep.left(), [0, 0]);
    });
}

/// A failure to store an accept without a reply is reported by the next reply of its stream, to any request.
#[test]
fn an_accept_that_is_not_kept_is_reported() {
    static GATE: Gate = Gate::open();
    let folder = tempfile::tempdir().expect("a folder");
    // room for the netlist and no state
    let server = start_kept(folder.path(), Limits { state_bytes: 530, ..limits() }, gated!(GATE));
    block_on(async {
        let mut client = server.client().await;
        let session = open(&mut client).await.session;
        let mut stream = Attached::to(&mut client, &session).await;
        let token = stream.trial(0, 0.0, 1.0).await.token;
        stream.say(Ask::Accept(proto::Accept { token, answer: false, warn: false })).await;
        assert_eq!(refusal(&stream.ask(trial(token, DT, 2.0)).await), Code::ResourceExhausted);
    });
}
