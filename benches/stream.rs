//! One Trial over the stream: the cost of the wire alone (the device echoes), per address and with the client of circuits.
//!
//! Client and server each run on one thread, as a plug-in and `bimorph serve` do. For figures that can be compared, keep
//! both on one core, where no thread waits for another core to wake: `taskset -c 0 cargo bench --bench stream`.
//! Besides criterion's mean it prints the median and the 99th percentile of single calls.

use bimorph::compile::CompileOptions;
use bimorph::device::{Device, Mode, OpenRequest, Trial, TrialReply};
use bimorph::netlist::Bundle;
use bimorph::service::address::Address;
use bimorph::service::client::RemoteDevice;
use bimorph::service::server::{ServeOptions, run_with};
use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;
use std::time::{Duration, Instant};

#[path = "../tests/service/echo.rs"]
mod echo;

const CALLS: usize = 20_000;
/// Something that compiles; the echo device does not look at it.
const NETLIST: &str =
    "anchor * [f] [l=1u w=1u h=1u]\nspring2d * [f m] [kx=1]\nmass2d * [m] [m=1e-10]\nguide2d * [m] []\n";

/// Serves until the process ends.
fn serve(listen: &str) -> Address {
    let (ready, bound) = std::sync::mpsc::channel();
    let options = ServeOptions {
        listen: vec![listen.parse().expect("an address")],
        ready: Box::new(move |addresses| ready.send(addresses[0].clone()).expect("somebody waits")),
        ..ServeOptions::default()
    };
    std::thread::spawn(move || {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
        runtime.block_on(run_with(options, echo::echo, std::future::pending())).expect("serves");
    });
    bound.recv().expect("the server starts")
}

fn trial(device: &mut RemoteDevice, reply: &mut TrialReply, v: f64) {
    let request = Trial { mode: Mode::Static, parent: None, t: 0.0, dt: 0.0, voltages: &[v, 1.0] };
    device.trial(black_box(&request), reply).expect("an answer");
}

fn percentiles(name: &str, device: &mut RemoteDevice) {
    let mut reply = TrialReply::default();
    let mut times: Vec<Duration> = (0..CALLS)
        .map(|k| {
            let start = Instant::now();
            trial(device, &mut reply, (k % 7) as f64);
            start.elapsed()
        })
        .collect();
    times.sort_unstable();
    let at = |fraction: f64| times[(fraction * CALLS as f64) as usize].as_secs_f64() * 1e6;
    println!("{name}: p50 {:.1} µs, p99 {:.1} µs over {CALLS} trials", at(0.5), at(0.99));
}

fn stream(criterion: &mut Criterion) {
    let dir = tempfile::tempdir().expect("a directory");
    let unix = format!("unix://{}", dir.path().join("b.sock").display());
    for (name, listen) in [("unix socket", unix.as_str()), ("tcp loopback", "127.0.0.1:0")] {
        let bundle = Bundle::from_text("plate.net", NETLIST);
        let uri = serve(listen).uri();
        let mut device = RemoteDevice::connect(&uri, &bundle, &CompileOptions::default(), Duration::from_secs(10))
            .expect("the server compiles");
        device.open(&OpenRequest::default()).expect("opens");
        let mut reply = TrialReply::default();
        criterion.bench_function(&format!("trial over {name}"), |b| b.iter(|| trial(&mut device, &mut reply, 1.0)));
        percentiles(name, &mut device);
    }
}

criterion_group!(benches, stream);
criterion_main!(benches);
