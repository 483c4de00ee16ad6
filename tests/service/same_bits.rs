//! A model on a server and the same model in process give the same bits: trials, small signals, analyses and sweeps.

use super::test_server::{DEADLINE, PLATE, Running, bundle, start_with};
use bimorph::analysis::chosen_run::{FittedRun, run_as_chosen};
use bimorph::analysis::harmonic::HarmonicOptions;
use bimorph::analysis::integrator::Integrator;
use bimorph::analysis::mesh::fitted_in_time;
use bimorph::analysis::mesh::harmonic_fitted;
use bimorph::analysis::mesh::in_circuit;
use bimorph::analysis::mesh::{modes_fitted, pull_in_fitted, static_fitted, warnings};
use bimorph::analysis::step_error::with_step_error;
use bimorph::analysis::transient::{TransientOptions, Until, transient};
use bimorph::compile::{CompileOptions, CompiledModel, compile};
use bimorph::device::local::LocalDevice;
use bimorph::device::{Device, Mode, OpenRequest, SmallSignal, Status, Token, Trial, TrialReply};
use bimorph::jobs::sweep::{self, Shard, SweepAnalysis, SweepRow, SweepSpec};
use bimorph::netlist::{Bundle, Setting};
use bimorph::service::client::{Client, RemoteDevice, RemoteTransient};
use bimorph::service::limits::Limits;
use std::sync::Arc;

/// A heated beam between anchors, its middle over an electrode: heat, motion and charge in one small model.
const BANK: &str = "param w=2u
process p1 = [ Youngsmodulus=165e9 density=2300 h=2u thermalexpansion=2.7e-6 thermcond=34 ambienttemperature=300 ]
anchor p1 [a] []
left  beam2det p1 [a m] [l=200u w=w oz=deg(3) R=1k tau=5u]
right beam2det p1 [m b] [l=200u w=w oz=-deg(3) R=1k tau=5u]
anchor p1 [b] []
plategap2d * [m e] [A=1e-8 gap=5u oz=deg(90) permittivity=8.854e-12]
anchor p1 [e] []
eground * [b] []
heat port * [a b] []
sense port * [e b] []
";

fn local_server(limits: Limits) -> Running {
    start_with("127.0.0.1:0", limits, |compiled| Box::new(LocalDevice::new(compiled)))
}

fn compiled(bundle: &Bundle) -> Arc<CompiledModel> {
    let drawn = compile(bundle, &CompileOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    Arc::new(in_circuit(&drawn))
}

/// Drives a device as a circuit would, each port in proportion to its number, with rejected attempts in between, and writes down
/// all it said.
fn drive(device: &mut dyn Device, ports: &[(&str, f64)], signals: &[&str]) -> Vec<String> {
    let mut said = Vec::new();
    let signals = signals.iter().map(|&signal| signal.to_owned()).collect();
    let names = ports.iter().map(|(name, _)| (*name).to_owned()).collect();
    said.push(format!("{:?}", device.open(&OpenRequest { ports: names, signals, noise: None })));
    let mut ask = |device: &mut dyn Device, mode, parent, dt: f64, v: f64| -> Option<Token> {
        let voltages: Vec<f64> = ports.iter().map(|(_, share)| share * v).collect();
        let mut reply = TrialReply::default();
        let outcome = device.trial(&Trial { mode, parent, t: dt, dt, voltages: &voltages }, &mut reply);
        said.push(format!("{outcome:?} {reply:?}"));
        reply.token.filter(|_| reply.status == Status::Ok)
    };
    let mut state = ask(device, Mode::Static, None, 0.0, 0.5);
    for k in 0..40 {
        let v = 0.5 + 0.05 * f64::from(k);
        // An attempt that the circuit rejects, then a shorter one that it takes.
        ask(device, Mode::Transient, state, 4e-7, v + 0.3);
        let next = ask(device, Mode::Transient, state, 1e-7, v);
        if let Some(token) = next {
            device.accept(token);
            state = next;
        }
    }
    // Longer than any part of this size can follow in one step, and a state that is not held.
    ask(device, Mode::Transient, state, 1.0, 2.0);
    ask(device, Mode::Transient, Some(Token(17)), 1e-7, 1.0);
    let mut small = SmallSignal::default();
    for omega in [0.0, 1e5, 6e6] {
        let outcome = state.map(|token| device.linearize(token, omega, &mut small));
        said.push(format!("{outcome:?} {small:?}"));
        let mut noise = Vec::new();
        let outcome = state.map(|token| device.noise(token, omega, &mut noise));
        assert!(state.is_none() || noise.len() >= ports.len() * ports.len());
        said.push(format!("{outcome:?} {noise:?}"));
    }
    said
}

fn compare(limits: Limits, netlist: &Bundle, ports: &[(&str, f64)], signals: &[&str]) {
    let server = local_server(limits);
    let mut remote = RemoteDevice::connect(&server.address.uri(), netlist, &CompileOptions::default(), DEADLINE)
        .unwrap_or_else(|error| panic!("{error}"));
    let here = drive(&mut LocalDevice::new(compiled(netlist)), ports, signals);
    let there = drive(&mut remote, ports, signals);
    assert!(here.iter().filter(|said| said.contains("token: Some")).count() > 40, "{here:#?}");
    for (here, there) in here.iter().zip(&there) {
        // Debug output of a double is the shortest text that reads back to the same bits.
        assert_eq!(here, there);
    }
}

/// A circuit's run over the wire is the same run, to the bit, rejected steps, faults and small signals included.
#[test]
fn trials_have_the_same_bits() {
    compare(Limits::default(), &bundle(), &[("drive", 1.0)], &["m.x", "m.vx"]);
}

/// The same for a model with heat and a second port.
#[test]
fn trials_of_a_heated_beam_have_the_same_bits() {
    compare(Limits::default(), &Bundle::from_text("bank.net", BANK), &[("heat", 1.0), ("sense", 1.0)], &["m.x", "m.y"]);
}

/// The same with ports of every kind.
#[test]
fn trials_with_ports_of_other_kinds_have_the_same_bits() {
    let ports = [
        ("m.y", 1e-6),
        ("heat", 1.0),
        ("left.T", 1e-4),
        ("m.vx", 1e-6),
        ("m.rz", 1e-11),
        ("sense", 1.0),
        ("m.vrz", -1e-11),
        ("frame.ax", 1e3),
        ("frame.ay", -1e3),
    ];
    compare(Limits::default(), &Bundle::from_text("bank.net", BANK), &ports, &["m.x", "m.y"]);
}

/// The same when the model counts as large and is stepped on threads of its own.
#[test]
fn trials_on_other_threads_have_the_same_bits() {
    compare(Limits { inline_unknowns: 0, ..Limits::default() }, &bundle(), &[("drive", 1.0)], &["m.x"]);
}

/// Every analysis over the wire is the analysis in process.
#[test]
fn analyses_have_the_same_bits() {
    let server = local_server(Limits::default());
    let mut client = Client::connect(&server.address.uri(), DEADLINE).expect("connects");
    let model = client.compile(&bundle(), &CompileOptions::default()).expect("compiles");
    let here = compiled(&bundle());
    let volts = [("drive".to_owned(), 2.0)];
    let (_, still, _) = static_fitted(&here, &volts).expect("one");
    assert_eq!(client.statics(&model, &volts).expect("an answer"), still);
    let (_, ringing, _) = modes_fitted(&here, 1, &volts).expect("one");
    assert_eq!(client.modes(&model, 1, &volts).expect("an answer"), ringing);
    let (_, closed) = pull_in_fitted(&here, None, 10.0).expect("one");
    assert_eq!(client.pull_in(&model, None, 10.0).expect("an answer"), closed);

    let request = HarmonicOptions {
        drive: "m.fx".into(),
        signals: vec!["m.x".into(), "drive.i".into()],
        from: 1e3,
        to: 1e5,
        points: 31,
        voltages: volts.to_vec(),
        ..HarmonicOptions::default()
    };
    for request in [HarmonicOptions { by_modes: true, ..request.clone() }, request] {
        let (_, swung) = harmonic_fitted(&here, &request, &mut |_| true).expect("one");
        assert_eq!(client.frequency_response(&model, &request).expect("an answer"), swung);
    }

    let options = TransientOptions {
        stop: 2e-5,
        signals: vec!["m.x".into(), "m.vx".into(), "drive.i".into(), "drive.q".into()],
        points: 101,
        tol: 1e-4,
        voltages: volts.to_vec(),
        method: Integrator::TrBdf2,
        events: vec![("m.x".into(), 1e-8)],
        ..TransientOptions::default()
    };
    let (moving, _) = fitted_in_time(&here, &options).expect("a mesh");
    let mut run =
        |options: &TransientOptions<'_>, sample: &mut dyn FnMut(f64, &[f64]), watch: &mut dyn FnMut(f64) -> bool| {
            transient(&moving, options, sample, watch).map(|r| (r, ()))
        };
    let (local, ()) = with_step_error(&options, &moving, &mut run, &mut |_, _| {}, &mut |_| true).expect("runs");
    assert!(local.step_error.is_some());
    let remote = RemoteTransient {
        stop: options.stop,
        signals: options.signals.clone(),
        points: options.points,
        tol: options.tol,
        voltages: options.voltages.clone(),
        method: options.method,
        events: options.events.clone(),
        ..RemoteTransient::default()
    };
    // the same until m.x first crosses its level
    let until = Some(Until::Level("m.x".into(), 1e-8));
    let ending = TransientOptions { until: until.clone(), ..options.clone() };
    let ended = with_step_error(&ending, &moving, &mut run, &mut |_, _| {}, &mut |_| true).expect("runs").0;
    assert!(ended.stopped_at.is_some());
    let there = client.transient(&model, &RemoteTransient { until, ..remote.clone() }, &mut |_| true);
    assert_eq!(there.expect("runs"), ended);
    let mut reported = 0.0;
    let there = client.transient(&model, &remote, &mut |fraction| {
        assert!(fraction >= reported);
        reported = fraction;
        true
    });
    assert_eq!(there.expect("runs"), local);
}

/// Where `auto` takes joint coordinates, and where a run there fails, a transient over the wire, one in process and a sweep of one point are one run,
/// which reports the formulation. Under 500 µN the flexures fold, and joint coordinates have no step from there on. Under 140 µN two segments of a
/// frame fold, and the bodies have none. So does a point of a grid.
#[test]
fn choices_of_auto_have_the_same_bits() {
    let chain = "process p1 = [ Youngsmodulus=165e9 density=2300 h=2u ]\nparam F=0.1u\nanchor p1 [q(0)] []\nfor i=1:3 [\n beam2d p1 [q(i-1) r(i)] \
                 [l=10u w=1u]\n link2d * [r(i) c(i)] [l=20u]\n plate2d p1 [c(i)] [l=40u w=30u]\n link2d * [c(i) q(i)] [l=20u]\n]\n\
                 f2d * [c(3)] [F=F oz=pi/2]\n";
    let frame = "process p1 = [Youngsmodulus=165e9 density=2300 h=5u]\nparam F=140u\nanchor p1 [a] []\nbeam2d p1 [a c(3)] [l=80u w=0.45u]\nbeam2d p1 [a c] \
                 [l=80u w=1.5u oz=1]\nbeam2d p1 [c c(3)] [l=76.7u w=1.5u oz=-1.0708]\nplate2d p1 [c(3)] [l=18u w=18u]\nf2d * [c(3)] [F=F oz=2.7]\n";
    let server = local_server(Limits::default());
    let mut client = Client::connect(&server.address.uri(), DEADLINE).expect("connects");
    for (text, force, segments, (stop, tol), taken) in [
        (chain, 1e-7, None, (2e-5, 1e-3), "rcr: rigid parts of"),
        (chain, 5e-4, Some(2), (2e-5, 1e-3), "compliant: a run in joint coordinates was given up ("),
        (frame, 1.4e-4, Some(2), (4e-7, 1e-2), "rcr: a run of the bodies was given up (transient stopped at t = 4.7"),
    ] {
        let netlist = Bundle::from_text("chain.net", text);
        let set = vec![("F".to_owned(), Setting::Number(force))];
        let options = CompileOptions { segments, set, tol, undamped: segments.is_some(), ..CompileOptions::default() };
        let drawn = compile(&netlist, &options).unwrap_or_else(|error| panic!("{error}"));
        let asked = TransientOptions {
            stop,
            signals: vec!["c(3).y".into()],
            points: 201,
            tol: options.tol,
            ..TransientOptions::default()
        };
        let mut attempt = |on: FittedRun, sample: &mut dyn FnMut(f64, &[f64]), watch: &mut dyn FnMut(f64) -> bool| {
            let mut run = |options: &TransientOptions<'_>,
                           sample: &mut dyn FnMut(f64, &[f64]),
                           watch: &mut dyn FnMut(f64) -> bool| {
                transient(&on.moving, options, sample, watch).map(|r| (r, ()))
            };
            let (mut found, ()) = with_step_error(&asked, &on.moving, &mut run, sample, watch)?;
            found.warnings.extend(warnings(&on.moving));
            Ok((found, ()))
        };
        let (local, ()) = run_as_chosen(&drawn, &asked, &mut attempt, &mut |_, _| {}, &mut |_| true).expect("runs");
        let told = local.formulation_taken.clone().unwrap_or_default();
        assert!(told.starts_with(taken), "{told}");

        let model = client.compile(&netlist, &options).expect("compiles");
        let remote = RemoteTransient {
            stop: asked.stop,
            signals: asked.signals.clone(),
            points: asked.points,
            tol: asked.tol,
            ..RemoteTransient::default()
        };
        assert_eq!(client.transient(&model, &remote, &mut |_| true).expect("runs"), local);

        let sweep_of = |axis: String| {
            let outputs = asked.signals.clone();
            let analysis = SweepAnalysis::Transient { stop: asked.stop, outputs, voltages: Vec::new() };
            let parameters = vec![axis.parse().expect("an axis")];
            let spec = SweepSpec { samples: None, parameters, analysis, shard: Shard::default(), threads: Some(1) };
            sweep::run(&spec, &netlist, &options, &|_| true).expect("a table")
        };
        let end = local.signals[0].2.last().copied();
        let values = |row: &SweepRow| row.values.as_ref().map(|values| values[0]).ok();
        assert_eq!(values(&sweep_of(format!("F={force}")).rows[0]), Some(end));
        let grid = sweep_of(format!("F=1e-7:{force}:3"));
        assert!(grid.rows.iter().all(|row| values(row).is_some()), "{:?}", grid.rows);
    }
}

/// A sweep over the wire, on one thread and on several, whole and in shards, is one table.
#[test]
fn sweeps_have_the_same_bits() {
    let server = local_server(Limits::default());
    let mut client = Client::connect(&server.address.uri(), DEADLINE).expect("connects");
    let netlist =
        Bundle::from_text("plate.net", &PLATE.replace("kx=1", "kx=k").replace("param V=0", "param V=0\nparam k=1"));
    let spec = |threads, shard| SweepSpec {
        samples: None,
        parameters: vec!["k=0.5:4:3".parse().expect("an axis"), "V=0,1".parse().expect("an axis")],
        analysis: SweepAnalysis::PullIn { port: None, max: 9.0 },
        shard,
        threads,
    };
    let options = CompileOptions::default();
    let run = |threads, shard| {
        let spec = spec(Some(threads), shard);
        sweep::run(&spec, &netlist, &options, &|_| true).expect("a table")
    };
    let whole = run(1, Shard::default());
    assert_eq!(whole.rows.len(), 6);
    assert!(whole.failed() < 6 && whole.failed() > 0, "stiff springs do not pull in below 9 V: {}", whole.to_csv());
    assert_eq!(run(5, Shard::default()), whole);
    let parts: Vec<_> = (0..3).flat_map(|index| run(2, Shard { index, count: 3 }).rows).collect();
    let mut parts: Vec<_> = parts.into_iter().collect();
    parts.sort_by_key(|row| row.point);
    assert_eq!(parts, whole.rows);
    let mut reported = 0;
    let remote = client.sweep(&spec(None, Shard::default()), &netlist, &options, &mut |progress| {
        reported = progress.done;
        true
    });
    assert_eq!(remote.expect("a table"), whole);
    assert_eq!(reported, 6);
    // so many points that none is the last when the first message comes
    let long =
        SweepSpec { parameters: vec!["k=0.5:4:200000".parse().expect("an axis")], ..spec(None, Shard::default()) };
    let stopped = client.sweep(&long, &netlist, &options, &mut |_| false);
    assert_eq!(stopped.map(|_| ()).map_err(|e| e.code), Err("Cancelled".to_owned()));
}
