//! Many sessions for long: `make soak` runs these; they take minutes and measure.
#![cfg(target_os = "linux")]

use super::serve_process::{Victim, Wire};
use bimorph::netlist::read_bundle;
use bimorph::service::convert::model::bundle_to_wire;
use bimorph::service::proto;
use proto::device_reply::Kind as ReplyKind;
use proto::device_request::Kind as Ask;
use std::path::Path;
use std::time::{Duration, Instant};
use tokio::sync::mpsc;

const SESSIONS: usize = 1000;
const LONG: Duration = Duration::from_secs(60);
const STEP: f64 = 1e-6;

async fn bank(wire: &mut Wire) -> String {
    let bundle = read_bundle(Path::new("examples/bank/bank.net"), &[]).expect("the example is there");
    let request = proto::CompileRequest { bundle: Some(bundle_to_wire(&bundle)), options: None };
    wire.compile(request).await.expect("compiles").into_inner().model.expect("a description").id
}

/// Steps one session of the bank until `end`; how long each step took.
async fn co_simulate(mut wire: Wire, model: String, end: Instant) -> Vec<Duration> {
    let (requests, queue) = mpsc::channel(4);
    let replies = wire.trial(tokio_stream::wrappers::ReceiverStream::new(queue)).await;
    let mut replies = replies.expect("a stream").into_inner();
    let open = Ask::Open(proto::OpenRequest { model, ..Default::default() });
    requests.send(proto::DeviceRequest { kind: Some(open) }).await.expect("sent");
    let opened = replies.message().await.expect("a reply").expect("a reply").kind;
    let Some(ReplyKind::Opened(opened)) = opened else { panic!("{opened:?}") };
    let ports = opened.device.expect("a description").ports.len();
    let (mut parent, mut dt, mut steps) = (0, 0.0, Vec::new());
    while Instant::now() < end {
        let volts = 1.0 + 1e-3 * (steps.len() % 100) as f64;
        let mode = if dt > 0.0 { proto::Mode::Transient } else { proto::Mode::Static };
        let trial = proto::TrialRequest { mode: mode.into(), parent, t: 0.0, dt, voltages: vec![volts; ports] };
        let asked = Instant::now();
        let request = proto::DeviceRequest { kind: Some(Ask::Trial(trial)) };
        requests.send(request).await.expect("sent");
        let reply = replies.message().await.expect("a reply").expect("a reply").kind;
        let Some(ReplyKind::Trial(reply)) = reply else { panic!("{reply:?}") };
        match reply.status() {
            proto::trial_reply::Status::Ok => {
                steps.push(asked.elapsed());
                (parent, dt) = (reply.token, STEP);
                let accept = Ask::Accept(proto::Accept { token: parent, answer: false, warn: false });
                requests.send(proto::DeviceRequest { kind: Some(accept) }).await.expect("sent");
            }
            proto::trial_reply::Status::NeedDt => dt = 0.5 * reply.need_dt,
            other => panic!("{other:?}: {}", reply.reason),
        }
    }
    steps
}

/// Steps `count` sessions; processor time of the server for a step (s), memory above idle (kB), and the steps' times.
fn run(count: usize, long: Duration) -> (f64, u64, Vec<Duration>) {
    let victim = Victim::started(&["--max-sessions", "1100", "--limit", "calls=4096"]);
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
    runtime.block_on(async {
        let mut wires = Vec::new();
        for _ in 0..count.div_ceil(100) {
            wires.push(victim.wire().await);
        }
        let model = bank(&mut wires[0]).await;
        let (idle, before) = (victim.memory_kb(), victim.cpu_s());
        let end = Instant::now() + long;
        let sessions: Vec<_> =
            (0..count).map(|k| tokio::spawn(co_simulate(wires[k / 100].clone(), model.clone(), end))).collect();
        let mut steps = Vec::new();
        for session in sessions {
            steps.extend(session.await.expect("no error"));
        }
        steps.sort();
        (((victim.cpu_s() - before) / steps.len() as f64), victim.memory_kb() - idle, steps)
    })
}

/// A thousand sessions of the bank step for a minute without an error; a step costs little more processor than that of one
/// session alone, compared within this run, and memory stays within 300 MB.
#[test]
#[ignore = "takes minutes: make soak"]
fn a_thousand_sessions() {
    let (alone, _, few) = run(1, Duration::from_secs(10));
    let (among, memory_kb, steps) = run(SESSIONS, LONG);
    let at = |share: f64| steps[((steps.len() - 1) as f64 * share) as usize];
    println!(
        "{SESSIONS} sessions, {} steps, 0 errors; p50 {:.1?}, p99 {:.1?}; {:.1} µs of processor for a step, {:.1} µs alone \
         ({} steps): {:.2} times; {} MB above idle",
        steps.len(),
        at(0.5),
        at(0.99),
        among * 1e6,
        alone * 1e6,
        few.len(),
        among / alone,
        memory_kb / 1024
    );
    assert!(memory_kb < 300 << 10, "{memory_kb} kB");
    assert!(among < 1.3 * alone, "{among} s and {alone} s");
}

/// Ten thousand sessions one after another: memory within a twentieth, descriptors equal.
#[test]
#[ignore = "takes minutes: make soak"]
fn ten_thousand_sessions_in_turn() {
    let victim = Victim::started(&[]);
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
    runtime.block_on(async {
        let mut wire = victim.wire().await;
        let model = bank(&mut wire).await;
        let mut turn = async || {
            let open = proto::OpenRequest { model: model.clone(), ..Default::default() };
            let session = wire.open(open).await.expect("opens").into_inner().session;
            wire.close(proto::CloseRequest { session }).await.expect("closes");
        };
        for _ in 0..500 {
            turn().await;
        }
        let (memory, descriptors) = (victim.memory_kb(), victim.descriptors());
        for _ in 0..10_000 {
            turn().await;
        }
        let (after, still) = (victim.memory_kb(), victim.descriptors());
        println!("10 000 sessions in turn: {memory} kB, then {after} kB; {descriptors} descriptors, then {still}");
        assert!(after as f64 <= 1.05 * memory as f64, "{memory} kB, then {after} kB");
        assert_eq!(still, descriptors);
    });
}
