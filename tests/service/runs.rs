//! Many steps in one call: the bits of the same steps one by one, ended by a step without an answer, by a client that leaves, and no longer
//! in the way of others than a burst.

use super::attached::Attached;
use super::session_faults::LOCAL;
use super::test_server::{Running, block_on, bundle, compiled, start_with};
use bimorph::compile::{CompileOptions, CompiledModel, compile};
use bimorph::device::local::LocalDevice;
use bimorph::device::run::{DriveSchedule, Ran, Start, steps};
use bimorph::device::{
    Description, Device, DeviceError, Mode, OpenRequest, PortInfo, PortKind, SignalInfo, SmallSignal, Status, Token,
    Trial, TrialReply,
};
use bimorph::service::convert::run::{pack, unpack};
use bimorph::service::limits::Limits;
use bimorph::service::proto;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};
use tonic::Code;

/// One step as a circuit takes it: whole, then in pieces as short as the device requires; the resulting state, and
/// trials.
fn by_hand(
    device: &mut dyn Device,
    parent: Option<Token>,
    [from, to]: [f64; 2],
    dt: f64,
    reply: &mut TrialReply,
) -> usize {
    let (mut parent, mut done, mut h, mut trials) = (parent, 0.0, 1.0, 0);
    loop {
        let last = done + h >= 1.0;
        h = if last { 1.0 - done } else { h };
        let volts = if last { to } else { from + (to - from) * (done + h) };
        let trial = Trial { mode: Mode::Transient, parent, t: 0.0, dt: h * dt, voltages: &[volts] };
        device.trial(&trial, reply).expect("a reply");
        trials += 1;
        match reply.status {
            Status::Ok if last => return trials,
            Status::Ok => (parent, done) = (reply.token, done + h),
            Status::NeedDt(need) => h = (need / dt).min(h / 2.0),
            Status::Fail(ref why) => panic!("{why}"),
        }
    }
}

fn open(device: &mut dyn Device) -> (Description, Option<Token>) {
    let signals = vec!["m.x".to_owned(), "m.vx".to_owned()];
    let opened = device.open(&OpenRequest { signals, ..OpenRequest::default() }).expect("opens");
    let mut reply = TrialReply::default();
    let rest = Trial { mode: Mode::Static, parent: None, t: 0.0, dt: 0.0, voltages: &[1.0] };
    device.trial(&rest, &mut reply).expect("an equilibrium");
    (opened, reply.token)
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|x| x.to_bits()).collect()
}

/// In process, on a server and step by step, with voltages that jump so that steps are taken in pieces.
#[test]
fn a_run_has_the_bits_of_its_steps() {
    let mut t = 0.0;
    let mut later = |k| {
        t += if k % 50 == 49 { 1e-4 } else { 2e-6 };
        t
    };
    let times: Vec<f64> = (0..300).map(&mut later).collect();
    // beyond the pull-in at 5.17 V, and back
    let volts: Vec<f64> = (0..300).map(|k| [1.0, 5.5, 3.0, 0.0][k / 3 % 4]).collect();
    let model = Arc::new(compile(&bundle(), &CompileOptions::default()).expect("compiles"));
    let mut device = LocalDevice::new(Arc::clone(&model));
    let (opened, state) = open(&mut device);
    let (mut parent, mut before, mut trials) = (state, 0, 0);
    let (mut outputs, mut charges, mut reply) = (Vec::new(), Vec::new(), TrialReply::default());
    for k in 0..times.len() {
        let (t, v) = if k == 0 { (0.0, 1.0) } else { (times[k - 1], volts[k - 1]) };
        trials += by_hand(&mut device, parent, [v, volts[k]], times[k] - t, &mut reply);
        before += usize::from(trials > k + 1);
        parent = reply.token;
        outputs.push(reply.outputs[0]);
        charges.extend(&reply.charges);
    }
    assert!(before > 0, "no step was taken in pieces: the test shows less than it says");
    let signals = ["m.x".to_owned()];
    let course = DriveSchedule { times: &times, values: &volts, signals: &signals, ports: true };
    let said = |ran: &Ran, place: &str| {
        assert_eq!((ran.steps, ran.trials, &ran.error), (times.len(), trials, &None), "{place}");
        assert_eq!(bits(&ran.outputs), bits(&outputs), "{place}");
        assert_eq!(bits(&ran.charges), bits(&charges), "{place}");
        assert_eq!(ran.last.as_ref(), Some(&reply), "{place}");
    };
    let mut device = LocalDevice::new(model);
    open(&mut device);
    said(&steps(&mut device, &opened, &Start { state, t: 0.0, given: &[1.0] }, &course).expect("runs"), "in process");
    let server = start_with("127.0.0.1:0", Limits::default(), LOCAL);
    let mut device = server.device();
    let (_, state) = open(&mut device);
    let start = Start { state, t: 0.0, given: &[1.0] };
    said(&device.run(&start, &course).expect("runs"), "on a server");
    // the state that it began from is still held, and the same run comes to the same
    said(&device.run(&start, &course).expect("runs again"), "again");
}

/// Trials of all [`Fussy`] devices.
static TRIALS: AtomicUsize = AtomicUsize::new(0);

/// A device whose signal is its voltage, which requires steps of at most 1 s, has no answer above 5 V, and computes 20
/// µs.
struct Fussy;

fn fussy(_: Arc<CompiledModel>) -> Box<dyn Device> {
    Box::new(Fussy)
}

impl Device for Fussy {
    fn open(&mut self, request: &OpenRequest) -> Result<Description, DeviceError> {
        let signal = |name: &String| SignalInfo { name: name.clone(), unit: "V".into() };
        let ports = vec![PortInfo { name: "drive".into(), kind: PortKind::Electrical }];
        Ok(Description { ports, signals: request.signals.iter().map(signal).collect(), unknowns: 1 })
    }

    fn trial(&mut self, request: &Trial<'_>, reply: &mut TrialReply) -> Result<(), DeviceError> {
        TRIALS.fetch_add(1, Ordering::Relaxed);
        let start = Instant::now();
        while start.elapsed() < Duration::from_micros(20) {
            bimorph::budget::check();
        }
        let volts = request.voltages[0];
        *reply = TrialReply {
            token: Some(Token(1 + volts.to_bits() % 1_000_003)),
            status: Status::Ok,
            currents: vec![volts],
            charges: vec![0.0],
            di_dv: vec![1.0],
            dq_dv: vec![0.0],
            outputs: vec![volts],
            doutputs_dv: vec![1.0],
            dt_next: f64::INFINITY,
            jumped: false,
        };
        if request.dt > 1.0 {
            (reply.status, reply.token) = (Status::NeedDt(1.0), None);
        } else if volts > 5.0 {
            (reply.status, reply.token) = (Status::Fail("too much".into()), None);
        }
        Ok(())
    }

    fn accept(&mut self, _: Token) {}

    fn linearize(&mut self, _: Token, _: f64, _: &mut SmallSignal) -> Result<(), DeviceError> {
        Err(DeviceError::NotOpen)
    }
}

fn lane(session: &str, start: f64) -> proto::RunLane {
    proto::RunLane { session: session.to_owned(), start: pack(&[start]), ..Default::default() }
}

/// A session of `server`, with the signal `x`.
async fn session(server: &Running) -> (proto::bimorph_client::BimorphClient<tonic::transport::Channel>, String) {
    let mut client = server.client().await;
    let model = compiled(&mut client).await;
    let open = proto::OpenRequest { model, signals: vec!["x".into()], ..Default::default() };
    let session = client.open(open).await.expect("opens").into_inner().session;
    (client, session)
}

/// The steps before it are there, with the reason why it has none; other sessions of the call continue. Pieces count: 4
/// s from 0 to 4 V are four trials of 1 s after one that requires them.
#[test]
fn a_step_without_an_answer_ends_a_run() {
    let server = start_with("127.0.0.1:0", Limits::default(), fussy);
    block_on(async {
        let (mut client, one) = session(&server).await;
        let (_, other) = session(&server).await;
        let request = proto::RunRequest {
            lanes: vec![lane(&one, 0.0), proto::RunLane { values: pack(&[2.0]), ..lane(&other, 0.0) }],
            times: pack(&[1.0, 5.0, 6.0, 7.0]),
            values: pack(&[0.0, 4.0, 6.0, 1.0]),
            signals: vec!["x".into()],
            ports: false,
            warn: false,
        };
        let mut stream = client.run(request).await.expect("runs").into_inner();
        let (mut rows, mut ends) = (vec![Vec::new(); 2], Vec::new());
        while let Some(event) = stream.message().await.expect("goes on") {
            for part in event.rows {
                assert_eq!((part.first as usize, part.currents.len()), (rows[part.lane as usize].len(), 0));
                rows[part.lane as usize].extend(unpack(&part.outputs));
            }
            ends.extend(event.ends);
        }
        assert_eq!(rows, [vec![0.0, 4.0], vec![2.0; 4]]);
        assert_eq!(
            ends.iter().map(|end| (end.lane, end.steps, end.trials)).collect::<Vec<_>>(),
            [(0, 2, 7), (1, 4, 8)]
        );
        assert_eq!([&*ends[0].error, &*ends[1].error], ["too much", ""]);
        assert_eq!(ends[0].last.as_ref().map(|last| last.outputs.clone()), Some(vec![4.0]));
    });
}

/// The end of a run is its last message, also where it is due by time (0.3 s for the 15,000 trials of a step): no message is empty.
#[test]
fn no_message_follows_the_end_of_a_run() {
    let server = start_with("127.0.0.1:0", Limits::default(), fussy);
    block_on(async {
        let (mut client, id) = session(&server).await;
        let request = proto::RunRequest {
            lanes: vec![lane(&id, 0.0)],
            times: pack(&[15_000.0]),
            values: pack(&[1.0]),
            signals: vec!["x".into()],
            ports: false,
            warn: false,
        };
        let mut stream = client.run(request).await.expect("runs").into_inner();
        let mut ends = 0;
        while let Some(event) = stream.message().await.expect("goes on") {
            assert_eq!(ends, 0, "a message after the end: {event:?}");
            assert!(!event.rows.is_empty() || !event.ends.is_empty());
            ends += event.ends.len();
        }
        assert_eq!(ends, 1);
    });
}

/// Inconsistent requests are rejected by field before anything is computed.
#[test]
fn what_does_not_fit_is_refused() {
    let server = start_with("127.0.0.1:0", Limits { transient_values: 9, ..Limits::default() }, fussy);
    block_on(async {
        let (mut client, id) = session(&server).await;
        let good = || proto::RunRequest {
            lanes: vec![lane(&id, 0.0)],
            times: pack(&[1.0, 2.0]),
            values: pack(&[0.0]),
            signals: vec!["x".into()],
            ports: true,
            warn: false,
        };
        type Change<'a> = &'a dyn Fn(&mut proto::RunRequest);
        let refused: [(Code, &str, Change<'_>); 11] = [
            (Code::InvalidArgument, "times[1]", &|r| r.times = pack(&[1.0, 1.0])),
            (Code::InvalidArgument, "times[0]", &|r| r.lanes[0].t = 1.0),
            (Code::InvalidArgument, "times", &|r| r.times.clear()),
            (Code::InvalidArgument, "times", &|r| r.times = vec![0; 7]),
            (Code::InvalidArgument, "values", &|r| r.values = pack(&[0.0; 3])),
            (Code::InvalidArgument, "values[0]", &|r| r.values = pack(&[f64::NAN])),
            (Code::InvalidArgument, "lanes[0].start", &|r| r.lanes[0].start.clear()),
            (Code::InvalidArgument, "signals", &|r| r.signals = vec!["y".into()]),
            (Code::NotFound, "no session", &|r| r.lanes[0].session = "none".into()),
            (Code::InvalidArgument, "lanes[1].session", &|r| r.lanes.push(lane(&id, 0.0))),
            (Code::ResourceExhausted, "transient_values", &|r| r.times = pack(&[1.0, 2.0, 3.0, 4.0])),
        ];
        for (code, begins, change) in refused {
            let mut request = good();
            change(&mut request);
            let status = client.run(request).await.expect_err(begins);
            assert_eq!(status.code(), code, "{begins}: {status}");
            assert!(status.message().starts_with(begins), "{begins}: {}", status.message());
        }
        assert!(client.run(good()).await.is_ok());
    });
}

/// A run of ten minutes (30,000,000 trials of 20 µs) stops when its client leaves, and lets an analysis of the same client through that has
/// the only place.
#[test]
fn a_run_is_in_no_way_and_ends_with_its_client() {
    let server = start_with("127.0.0.1:0", Limits { analyses: 1, ..Limits::default() }, fussy);
    block_on(async {
        let (mut client, id) = session(&server).await;
        let times: Vec<f64> = (1..=3_000_000).map(f64::from).collect();
        let request = proto::RunRequest {
            lanes: vec![lane(&id, 0.0)],
            times: pack(&times),
            values: pack(&[1.0]),
            signals: vec!["x".into()],
            ports: false,
            warn: false,
        };
        let mut run = client.run(request).await.expect("runs").into_inner();
        run.message().await.expect("goes on").expect("rows");
        let model = compiled(&mut client).await;
        for _ in 0..3 {
            let asked = Instant::now();
            let statics = proto::StaticRequest { model: model.clone(), ..Default::default() };
            client.r#static(statics).await.expect("an equilibrium");
            assert!(asked.elapsed() < Duration::from_secs(5), "{:?}", asked.elapsed());
        }
        let before = TRIALS.load(Ordering::Relaxed);
        run.message().await.expect("goes on").expect("rows");
        assert!(TRIALS.load(Ordering::Relaxed) > before, "it has ended before its client left");
        drop(run);
        let mut last = TRIALS.load(Ordering::Relaxed);
        for _ in 0..200 {
            tokio::time::sleep(Duration::from_millis(50)).await;
            let now = TRIALS.load(Ordering::Relaxed);
            if now == last {
                return;
            }
            last = now;
        }
        panic!("it goes on without a client");
    });
}

/// Another run of a session, and a trial, end the run that is under way: its next steps would push out their states.
#[test]
fn the_next_question_to_a_session_ends_its_run() {
    let server = start_with("127.0.0.1:0", Limits::default(), fussy);
    block_on(async {
        let (mut client, id) = session(&server).await;
        let request = |steps: u32| proto::RunRequest {
            lanes: vec![lane(&id, 0.0)],
            times: pack(&(1..=steps).map(f64::from).collect::<Vec<_>>()),
            values: pack(&[1.0]),
            signals: vec!["x".into()],
            ports: false,
            warn: false,
        };
        let ended = async |mut stream: tonic::Streaming<proto::RunEvent>| loop {
            match stream.message().await {
                Ok(Some(_)) => {}
                Ok(None) => return None,
                Err(status) => return Some(status.code()),
            }
        };
        let mut long = client.run(request(1_000_000)).await.expect("runs").into_inner();
        long.message().await.expect("goes on").expect("rows");
        let short = client.run(request(3)).await.expect("runs").into_inner();
        assert_eq!(ended(short).await, None);
        assert_eq!(ended(long).await, Some(Code::Cancelled));
        // one that has ended blocks nothing
        let mut long = client.run(request(1_000_000)).await.expect("runs").into_inner();
        long.message().await.expect("goes on").expect("rows");
        Attached::to(&mut client, &id).await.trial(0, 1.0, 1.0).await;
        assert_eq!(ended(long).await, Some(Code::Cancelled));
    });
}
