//! One Trial over the stream: the cost of the protocol alone (the device echoes), and a transient Trial of a lumped
//! plate in process and over the stream. It also has steps of the plate as Python takes them ([`TrialConnections`]): a
//! trial and its accept, whose reply is not awaited.
//!
//! Client and server each run on one thread, as a plug-in and `bimorph serve` do. For figures that can be compared, keep
//! both on one core, where no thread waits for another core to wake: `taskset -c 0 cargo bench --bench stream`.
//! Besides criterion's mean it prints the median and the 99th percentile of single calls.

use bimorph::compile::{CompileOptions, compile};
use bimorph::device::local::LocalDevice;
use bimorph::device::{Device, Mode, OpenRequest, Trial, TrialReply};
use bimorph::netlist::Bundle;
use bimorph::service::address::Address;
use bimorph::service::client::{Client, RemoteDevice, TrialConnections};
use bimorph::service::proto::{self, device_reply, device_request};
use bimorph::service::server::{MakeDevice, ServeOptions, run_with};
use criterion::{Criterion, criterion_group, criterion_main};
use prost::Message;
use std::hint::black_box;
use std::sync::Arc;
use std::time::{Duration, Instant};

#[path = "../tests/service/echo.rs"]
mod echo;

/// How long an answer may take.
const PATIENCE: Duration = Duration::from_secs(10);
const CALLS: usize = 20_000;
/// A plate on a spring over an electrode. The echo device does not read it.
const NETLIST: &str = "anchor * [f] [l=1u w=1u h=1u]
spring2d * [f m] [kx=1]
mass2d * [m] [m=1e-10]
guide2d * [m] []
plategap2d * [m e] [A=1e-8 gap=2u]
anchor * [e] [l=1u w=1u h=1u]
eground * [e] []
drive port * [m e] []
";

/// Serves until the process ends.
fn serve(listen: &str, make: MakeDevice) -> Address {
    let (ready, bound) = std::sync::mpsc::channel();
    let options = ServeOptions {
        listen: vec![listen.parse().expect("an address")],
        ready: Box::new(move |addresses| ready.send(addresses[0].clone()).expect("somebody waits")),
        ..ServeOptions::default()
    };
    std::thread::spawn(move || {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
        runtime.block_on(run_with(options, make, std::future::pending())).expect("serves");
    });
    bound.recv().expect("the server starts")
}

fn connect(address: &Address) -> RemoteDevice {
    let bundle = Bundle::from_text("plate.net", NETLIST);
    RemoteDevice::connect(&address.uri(), &bundle, &CompileOptions::default(), PATIENCE).expect("the server compiles")
}

fn ask(device: &mut dyn Device, request: &Trial<'_>, reply: &mut TrialReply) {
    device.trial(black_box(request), reply).expect("an answer");
}

fn percentiles(name: &str, mut call: impl FnMut(usize)) {
    let mut times: Vec<Duration> = (0..CALLS)
        .map(|k| {
            let start = Instant::now();
            call(k);
            start.elapsed()
        })
        .collect();
    times.sort_unstable();
    let at = |fraction: f64| times[(fraction * CALLS as f64) as usize].as_secs_f64() * 1e6;
    println!("{name}: p50 {:.1} µs, p99 {:.1} µs over {CALLS} trials", at(0.5), at(0.99));
}

/// Newton's trials of one step: the same parent, voltages that differ.
fn steps(criterion: &mut Criterion, name: &str, device: &mut dyn Device) {
    device.open(&OpenRequest { ports: vec![], signals: vec!["m.x".into()], noise: None }).expect("opens");
    let mut reply = TrialReply::default();
    let rest = Trial { mode: Mode::Static, parent: None, t: 0.0, dt: 0.0, voltages: &[1.0] };
    ask(device, &rest, &mut reply);
    let parent = reply.token;
    let mut step = |k: usize| {
        let voltages = [1.0 + 1e-3 * (k % 7) as f64];
        let request = Trial { mode: Mode::Transient, parent, t: 1e-7, dt: 1e-7, voltages: &voltages };
        ask(device, &request, &mut reply);
    };
    let mut k = 0;
    criterion.bench_function(name, |b| {
        b.iter(|| {
            k += 1;
            step(k);
        });
    });
    percentiles(name, step);
}

/// Steps by a line, each from the state of the one before.
fn lines(criterion: &mut Criterion, name: &str, address: &Address) {
    let mut client = Client::connect(&address.uri(), PATIENCE).expect("connects");
    let model = client.compile(&Bundle::from_text("plate.net", NETLIST), &CompileOptions::default()).expect("compiles");
    let lines = TrialConnections::new().expect("a thread");
    let mut line = lines.open((&address.uri(), 0), None, PATIENCE, &|| true).expect("a stream");
    let mut ask = |kind| {
        let request = proto::DeviceRequest { kind: Some(kind) }.encode_to_vec();
        let reply = line.ask(&request, PATIENCE, &|| true).expect("an answer")?;
        proto::DeviceReply::decode(&*reply).expect("a reply").kind
    };
    let open = proto::OpenRequest { model, signals: vec!["m.x".into()], ..Default::default() };
    ask(device_request::Kind::Open(open));
    let (mut parent, mut t) = (0, 0.0);
    let mut step = |k: usize| {
        let mode = if parent == 0 { proto::Mode::Static } else { proto::Mode::Transient };
        let dt = if parent == 0 { 0.0 } else { 1e-7 };
        t += dt;
        let voltages = vec![1.0 + 1e-3 * (k % 7) as f64];
        let trial = proto::TrialRequest { mode: mode.into(), parent, t, dt, voltages };
        let Some(device_reply::Kind::Trial(reply)) = ask(device_request::Kind::Trial(trial)) else { panic!("a trial") };
        parent = reply.token;
        ask(device_request::Kind::Accept(proto::Accept { token: reply.token, answer: false, warn: false }));
    };
    let mut k = 0;
    criterion.bench_function(name, |b| {
        b.iter(|| {
            k += 1;
            step(k);
        });
    });
    percentiles(name, step);
}

fn stream(criterion: &mut Criterion) {
    let dir = tempfile::tempdir().expect("a directory");
    let unix = |name: &str| format!("unix://{}", dir.path().join(name).display());
    for (name, listen) in [("echo over unix socket", unix("echo")), ("echo over tcp loopback", "127.0.0.1:0".into())] {
        let mut device = connect(&serve(&listen, echo::echo));
        device.open(&OpenRequest::default()).expect("opens");
        let mut reply = TrialReply::default();
        let mut echo = |k: usize| {
            let voltages = [(k % 7) as f64, 1.0];
            let request = Trial { mode: Mode::Static, parent: None, t: 0.0, dt: 0.0, voltages: &voltages };
            ask(&mut device, &request, &mut reply);
        };
        criterion.bench_function(name, |b| b.iter(|| echo(1)));
        percentiles(name, echo);
    }
    let compiled = compile(&Bundle::from_text("plate.net", NETLIST), &CompileOptions::default()).expect("compiles");
    steps(criterion, "plate in process", &mut LocalDevice::new(Arc::new(compiled)));
    let address = serve(&unix("plate"), |compiled| Box::new(LocalDevice::new(compiled)));
    steps(criterion, "plate over unix socket", &mut connect(&address));
    lines(criterion, "steps of the plate over unix socket", &address);
}

criterion_group!(benches, stream);
criterion_main!(benches);
