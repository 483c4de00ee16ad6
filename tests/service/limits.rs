//! Each limit is answered with RESOURCE_EXHAUSTED and its name; sessions idle for too long are removed.

use super::test_server::{DEADLINE, block_on, bundle, compiled, start, start_with, wire_bundle};
use bimorph::compile::CompileOptions;
use bimorph::device::local::LocalDevice;
use bimorph::device::{Device, Mode, OpenRequest, Trial, TrialReply};
use bimorph::jobs::sweep::{Shard, SweepAnalysis, SweepSpec};
use bimorph::service::client::Client;
use bimorph::service::limits::Limits;
use bimorph::service::proto;
use std::time::Duration;
use tonic::{Code, Status};

const AT_REST: Trial<'_> = Trial { mode: Mode::Static, parent: None, t: 0.0, dt: 0.0, voltages: &[1.0, 0.0] };

fn exhausted(status: &Status, name: &str) {
    assert_eq!(status.code(), Code::ResourceExhausted, "{status:?}");
    assert!(status.message().starts_with(name), "{}", status.message());
}

/// Netlist size, unknowns, sessions, modes, samples, sweep points and sweeps are limited.
#[test]
fn limits_are_named() {
    let small = Limits {
        netlist_bytes: 400,
        sessions: 1,
        modes: 3,
        transient_values: 100,
        sweep_points: 10,
        sweeps: 0,
        signals: 5,
        ..Limits::default()
    };
    let server = start("127.0.0.1:0", small);
    block_on(async {
        let mut client = server.client().await;
        let model = compiled(&mut client).await;
        let large = proto::Bundle { root: "a".into(), files: [("a".to_owned(), "% ".repeat(400))].into() };
        let request = proto::CompileRequest { bundle: Some(large), options: None };
        exhausted(&client.compile(request).await.expect_err("too large"), "netlist_bytes");
        let open = proto::OpenRequest { model: model.clone(), ..Default::default() };
        client.open(open.clone()).await.expect("the first");
        exhausted(&client.open(open).await.expect_err("the second"), "sessions");
        let modes = proto::ModesRequest { model: model.clone(), count: 4, voltages: vec![], quality: false };
        exhausted(&client.modes(modes).await.expect_err("too many"), "modes");
        let transient = proto::TransientRequest { model, stop_s: 1.0, points: 101, ..Default::default() };
        exhausted(&client.transient(transient).await.expect_err("too many"), "transient_values");
        let sweep = |count| {
            let values = proto::sweep_parameter::Values::Linear(proto::Linear { low: 0.0, high: 1.0, count });
            let spec = proto::SweepSpec {
                parameters: vec![proto::SweepParameter { name: "V".into(), values: Some(values) }],
                analysis: Some(proto::sweep_spec::Analysis::Static(proto::SweepStatic::default())),
                ..Default::default()
            };
            proto::SubmitSweepRequest { bundle: wire_bundle(), options: None, spec: Some(spec), ..Default::default() }
        };
        exhausted(&client.submit_sweep(sweep(u32::MAX)).await.expect_err("too many"), "sweep_points");
        let mut wide = sweep(2);
        let asked = proto::SweepTransient { outputs: vec!["m.x".into(); 6], stop_s: 1e-6, ..Default::default() };
        let spec = wide.spec.as_mut().expect("a sweep");
        spec.analysis = Some(proto::sweep_spec::Analysis::Transient(asked));
        exhausted(&client.submit_sweep(wide).await.expect_err("too many"), "outputs");
        let mut many = sweep(2);
        let asked = proto::SweepModes { count: 4, ..Default::default() };
        many.spec.as_mut().expect("a sweep").analysis = Some(proto::sweep_spec::Analysis::Modes(asked));
        exhausted(&client.submit_sweep(many).await.expect_err("too many"), "modes");
        exhausted(&client.submit_sweep(sweep(2)).await.expect_err("too many"), "sweeps");
    });
}

/// A point of a sweep whose modes are more work than a single call may be has that for its error; one that is not has its frequencies.
#[test]
fn modes_of_sweeps_are_bounded_work() {
    let spec = SweepSpec {
        parameters: vec!["V=0,1".parse().expect("an axis")],
        samples: None,
        analysis: SweepAnalysis::Modes { count: 1, voltages: vec![] },
        shard: Shard::default(),
        threads: None,
    };
    let errors = |count, mode_work| {
        let server = start("127.0.0.1:0", Limits { mode_work, ..Limits::default() });
        let spec = SweepSpec { analysis: SweepAnalysis::Modes { count, voltages: vec![] }, ..spec.clone() };
        let mut client = Client::connect(&server.address.uri(), DEADLINE).expect("connects");
        let table = client.sweep(&spec, &bundle(), &CompileOptions::default(), &mut |_| true).expect("a table");
        table.rows.iter().map(|row| row.values.as_ref().err().cloned().unwrap_or_default()).collect::<Vec<_>>()
    };
    assert_eq!(errors(1, 1), ["", ""], "the plate has one unknown");
    assert_eq!(errors(2, 3), ["mode_work: at most 3 unknowns times modes squared, got 4"; 2]);
}

/// A SUGAR 3 netlist is a program: it is run only where the server was started with room for such.
#[test]
fn programs_are_refused_unless_allowed() {
    let text = "-- a cantilever\np1 = material {Youngsmodulus=160e9, density=2300, h=2u}\nanchor {node 'a'; material=p1}\n\
                beam2d {node 'a', node 'b'; material=p1, l=100u, w=2u}\n";
    let bundle = proto::Bundle { root: "a".into(), files: [("a".to_owned(), text.to_owned())].into() };
    let request = proto::CompileRequest { bundle: Some(bundle), options: None };
    let server = start("127.0.0.1:0", Limits::default());
    let status = block_on(async { server.client().await.compile(request.clone()).await }).expect_err("a program");
    exhausted(&status, "program_bytes");
    let server = start("127.0.0.1:0", Limits { program_bytes: 1000, ..Limits::default() });
    block_on(async { server.client().await.compile(request).await }).expect("room for it");
}

/// A model with too many unknowns is refused after compiling (the echo device has three).
#[test]
fn large_models_are_refused() {
    let server = start("127.0.0.1:0", Limits { unknowns: 2, ..Limits::default() });
    let request = proto::CompileRequest { bundle: wire_bundle(), options: None };
    let status = block_on(async { server.client().await.compile(request).await }).expect_err("too many");
    exhausted(&status, "unknowns");
}

/// A drawing that the server has room for is never refused for the mesh that it would have in a circuit: that stays within the limit, and is
/// warned of. (Compile answered "at most 300, got at least 342".)
#[test]
fn meshes_of_circuits_fit_the_limit() {
    let server =
        start_with("127.0.0.1:0", Limits { unknowns: 300, ..Limits::default() }, |m| Box::new(LocalDevice::new(m)));
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/quarter_stage/quarter_stage.net");
    let bundle = bimorph::netlist::read_bundle(std::path::Path::new(path), &[]).expect("an example");
    let bundle = Some(bimorph::service::convert::model::bundle_to_wire(&bundle));
    let options = Some(proto::CompileOptions { tol: Some(1e-4), ..Default::default() });
    let request = proto::CompileRequest { bundle, options };
    let answer = block_on(async { server.client().await.compile(request).await }).expect("219 unknowns as drawn");
    let model = answer.into_inner().model.expect("a model");
    assert!((219..=300).contains(&model.unknowns), "{} unknowns", model.unknowns);
    assert!(model.warnings.iter().any(|warning| warning.code == "W040"), "{:?}", model.warnings);
}

/// The model unused for longest goes first.
#[test]
fn the_oldest_model_goes_first() {
    let server = start("127.0.0.1:0", Limits { models: 2, ..Limits::default() });
    block_on(async {
        let mut client = server.client().await;
        let mut ids: Vec<String> = Vec::new();
        for tol in [1e-3, 1e-4, 1e-5] {
            if ids.len() == 2 {
                client.describe(proto::DescribeRequest { model: ids[0].clone() }).await.expect("kept");
            }
            let options = Some(proto::CompileOptions { tol: Some(tol), ..Default::default() });
            let response = client.compile(proto::CompileRequest { bundle: wire_bundle(), options }).await;
            let id = response.expect("compiles").into_inner().model.expect("a description").id;
            ids.push(id);
        }
        client.describe(proto::DescribeRequest { model: ids[0].clone() }).await.expect("was used");
        let gone = client.describe(proto::DescribeRequest { model: ids[1].clone() }).await;
        assert_eq!(gone.expect_err("was unused").code(), Code::NotFound);
    });
}

/// A session without a stream is removed when it was idle for long, one on a stream is not.
#[test]
fn idle_sessions_are_forgotten() {
    let server = start("127.0.0.1:0", Limits { idle: Duration::from_millis(40), ..Limits::default() });
    let mut device = server.device();
    device.open(&OpenRequest::default()).expect("opens");
    block_on(async {
        let mut client = server.client().await;
        let model = compiled(&mut client).await;
        let opened = client.open(proto::OpenRequest { model, ..Default::default() }).await.expect("opens");
        tokio::time::sleep(Duration::from_millis(300)).await;
        let close = proto::CloseRequest { session: opened.into_inner().session };
        assert_eq!(client.close(close).await.expect_err("is forgotten").code(), Code::NotFound);
    });
    device.trial(&AT_REST, &mut TrialReply::default()).expect("the stream has kept its session");
}

/// Even on a stream a session does not stay for ever; a remote device notices, and opens anew.
#[test]
fn sessions_of_vanished_clients_are_forgotten() {
    let server = start("127.0.0.1:0", Limits { stream_idle: Duration::from_millis(500), ..Limits::default() });
    let mut device = server.device();
    device.open(&OpenRequest::default()).expect("opens");
    std::thread::sleep(Duration::from_millis(1500));
    let gone = device.trial(&AT_REST, &mut TrialReply::default()).expect_err("is forgotten");
    assert!(gone.to_string().contains("no session"), "{gone}");
    device.open(&OpenRequest::default()).expect("opens anew");
    device.trial(&AT_REST, &mut TrialReply::default()).expect("answers");
}

/// Analyses that take every place do not keep a circuit from compiling and opening, nor short analyses; only long ones wait.
#[test]
fn analyses_do_not_block_circuits() {
    let limits = Limits { analyses: 1, request_timeout: Duration::from_secs(2), ..Limits::default() };
    let server = start_with("127.0.0.1:0", limits, |compiled| Box::new(LocalDevice::new(compiled)));
    block_on(async {
        let mut client = server.client().await;
        let model = compiled(&mut client).await;
        // Some 500 million steps and two samples: it keeps its place.
        let (stop_s, step_s) = (0.5, 1e-9);
        let request = proto::TransientRequest { model: model.clone(), stop_s, step_s, points: 2, ..Default::default() };
        let _running = client.transient(request.clone()).await.expect("starts");
        let late = client.transient(request).await;
        assert_eq!(late.expect_err("waits in vain").code(), Code::DeadlineExceeded);
        client.r#static(proto::StaticRequest { model: model.clone(), ..Default::default() }).await.expect("is short");
        let options = Some(proto::CompileOptions { tol: Some(1e-4), ..Default::default() });
        client.compile(proto::CompileRequest { bundle: wire_bundle(), options }).await.expect("compiles");
        client.open(proto::OpenRequest { model, ..Default::default() }).await.expect("opens");
    });
}

/// A transient whose reader is slow gives its place to others.
#[test]
fn slow_readers_keep_no_place() {
    let limits = Limits { analyses: 1, ..Limits::default() };
    let server = start_with("127.0.0.1:0", limits, |compiled| Box::new(LocalDevice::new(compiled)));
    block_on(async {
        let mut client = server.client().await;
        let model = compiled(&mut client).await;
        let request = proto::TransientRequest {
            model: model.clone(),
            stop_s: 1e-3,
            signals: vec!["m.x".into(); 300],
            points: 300_000,
            ..Default::default()
        };
        let _unread = client.transient(request).await.expect("starts");
        client.r#static(proto::StaticRequest { model, ..Default::default() }).await.expect("has a place");
    });
}

/// A thousand sessions one after another leave nothing behind: the limit of four is never reached.
#[test]
fn closed_sessions_leave_no_trace() {
    let server = start("127.0.0.1:0", Limits { sessions: 4, ..Limits::default() });
    block_on(async {
        let mut client = server.client().await;
        let model = compiled(&mut client).await;
        for _ in 0..1000 {
            let open = proto::OpenRequest { model: model.clone(), ..Default::default() };
            let session = client.open(open).await.expect("has room").into_inner().session;
            client.close(proto::CloseRequest { session }).await.expect("closes");
        }
    });
}
