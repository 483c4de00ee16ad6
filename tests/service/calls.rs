//! Every call answers over a real socket.

use super::test_server::{PLATE, block_on, compiled, start, wire_bundle};
use bimorph::service::limits::Limits;
use bimorph::service::proto;
use proto::device_reply::Kind as Reply;
use proto::device_request::Kind as Ask;
use tokio_stream::StreamExt;
use tonic::Code;

fn ask(kind: Ask) -> proto::DeviceRequest {
    proto::DeviceRequest { kind: Some(kind) }
}

fn trial(parent: u64, t: f64, voltages: &[f64]) -> Ask {
    let mode = if parent == 0 { proto::Mode::Static } else { proto::Mode::Transient };
    Ask::Trial(proto::TrialRequest { mode: mode.into(), parent, t, dt: 1e-6, voltages: voltages.to_vec() })
}

/// Info reports the version and the limits in force.
#[test]
fn info_reports_version_and_limits() {
    let server = start("127.0.0.1:0", Limits { sessions: 7, ..Limits::default() });
    let info = block_on(async { server.client().await.info(proto::InfoRequest {}).await });
    let info = info.expect("an answer").into_inner();
    assert_eq!(info.version, env!("CARGO_PKG_VERSION"));
    assert_eq!(info.protocols, ["bimorph.v1"]);
    assert_eq!(info.limits.expect("limits").sessions, 7);
}

/// Compiling the same text twice gives the same id, other options another, and Describe says what Compile said.
#[test]
fn models_are_named_by_content() {
    let server = start("127.0.0.1:0", Limits::default());
    block_on(async {
        let mut client = server.client().await;
        let first = compiled(&mut client).await;
        assert_eq!(first.len(), 32);
        assert_eq!(compiled(&mut client).await, first);
        let options = Some(proto::CompileOptions { tol: Some(1e-4), ..Default::default() });
        let other = client.compile(proto::CompileRequest { bundle: wire_bundle(), options }).await;
        assert_ne!(other.expect("compiles").into_inner().model.expect("a description").id, first);
        let described = client.describe(proto::DescribeRequest { model: first.clone() }).await;
        let model = described.expect("kept").into_inner().model.expect("a description");
        assert_eq!(model.id, first);
        assert!(model.nodes.contains(&"m".to_owned()), "{:?}", model.nodes);
        assert_eq!(model.parameters[0].name, "V");
    });
}

/// Check gives diagnostics as data, with their place.
#[test]
fn check_gives_diagnostics_as_data() {
    let server = start("127.0.0.1:0", Limits::default());
    block_on(async {
        let mut client = server.client().await;
        let good = client.check(proto::CheckRequest { bundle: wire_bundle(), options: None }).await;
        assert!(good.expect("an answer").into_inner().ok);
        let text = format!("{PLATE}spring2d * [f m] [kx=nosuch]\n");
        let bundle = proto::Bundle { root: "a.net".into(), files: [("a.net".to_owned(), text)].into() };
        let bad = client.check(proto::CheckRequest { bundle: Some(bundle), options: None }).await;
        let bad = bad.expect("an answer").into_inner();
        assert!(!bad.ok);
        assert_eq!((bad.diagnostics[0].file.as_str(), bad.diagnostics[0].line), ("a.net", 10));
        assert!(bad.rendered.contains("nosuch"), "{}", bad.rendered);
    });
}

/// One stream carries open, trials, accepts and small signals; replies come in order, and accepts have none.
#[test]
fn a_stream_answers_in_order() {
    let server = start("127.0.0.1:0", Limits::default());
    block_on(async {
        let mut client = server.client().await;
        let model = compiled(&mut client).await;
        let open = proto::OpenRequest { model, ports: vec![], signals: vec!["t".into()], noise: None };
        let requests = vec![
            ask(Ask::Open(open.clone())),
            ask(trial(0, 0.0, &[1.0, 2.0])),
            ask(trial(0, 0.25, &[3.0, 4.0])),
            ask(Ask::Accept(proto::Accept { token: 12345, answer: false, warn: false })),
            ask(trial(0, 0.5, &[1.0])),
            ask(Ask::Open(open)),
            ask(trial(0, 0.75, &[5.0, 6.0])),
        ];
        let replies = client.trial(tokio_stream::iter(requests)).await.expect("a stream").into_inner();
        let replies: Vec<Reply> = replies.map(|r| r.expect("a reply").kind.expect("a kind")).collect().await;
        assert_eq!(replies.len(), 6);
        assert!(matches!(&replies[0], Reply::Opened(o) if o.device.as_ref().is_some_and(|d| d.ports == ["p", "q"])));
        assert!(matches!(&replies[1], Reply::Trial(t) if t.currents == [1e-3, 2e-3] && t.token != 0));
        assert!(matches!(&replies[2], Reply::Trial(t) if t.outputs == [0.25]));
        let Reply::Fault(fault) = &replies[3] else { panic!("a fault, not {:?}", replies[3]) };
        assert!(matches!(&fault.kind, Some(proto::fault::Kind::BadValue(v)) if v.what == "voltages"), "{fault:?}");
        assert!(matches!(&replies[5], Reply::Trial(t) if t.outputs == [0.75]));
    });
}

/// A session of the unary Open outlives a stream that attached to it, and ends with Close.
#[test]
fn sessions_outlive_streams() {
    let server = start("127.0.0.1:0", Limits::default());
    block_on(async {
        let mut client = server.client().await;
        let model = compiled(&mut client).await;
        let opened = client.open(proto::OpenRequest { model, ports: vec![], signals: vec![], noise: None }).await;
        let session = opened.expect("opens").into_inner().session;
        let attach = || ask(Ask::Attach(proto::Attach { session: session.clone() }));
        let requests = vec![attach(), ask(trial(0, 0.0, &[1.0, 2.0]))];
        let mut replies = client.trial(tokio_stream::iter(requests)).await.expect("a stream").into_inner();
        assert!(matches!(replies.message().await.expect("a reply").expect("one").kind, Some(Reply::Opened(_))));
        let Some(Reply::Trial(answer)) = replies.message().await.expect("a reply").expect("one").kind else {
            panic!("a trial reply")
        };
        assert!(replies.message().await.expect("a clean end").is_none());

        // The state of the first stream is the parent on the second, and the small signal is about it.
        let requests = vec![attach(), ask(trial(answer.token, 1e-6, &[1.5, 2.0]))];
        let replies = client.trial(tokio_stream::iter(requests)).await.expect("a stream").into_inner();
        let replies: Vec<_> = replies.map(|r| r.expect("a reply").kind.expect("a kind")).collect().await;
        assert!(matches!(&replies[1], Reply::Trial(t) if t.token != answer.token), "{:?}", replies[1]);
        let request = proto::LinearizeRequest {
            session: session.clone(),
            token: answer.token,
            omega: vec![1.0, 2.0],
            ..Default::default()
        };
        let points = client.linearize(request).await.expect("an answer").into_inner().points;
        assert_eq!(points[1].admittance_im, [2e-12, 0.0, 0.0, 2e-12]);

        let close = proto::CloseRequest { session: session.clone() };
        client.close(close.clone()).await.expect("closes");
        assert_eq!(client.close(close).await.expect_err("is gone").code(), Code::NotFound);
    });
}

/// A sweep runs, is watched to its end and fetched; a point without a result is a row with an error and no numbers.
#[test]
fn sweeps_are_submitted_watched_and_fetched() {
    let server = start("127.0.0.1:0", Limits::default());
    block_on(async {
        let mut client = server.client().await;
        let values = proto::sweep_parameter::Values::Linear(proto::Linear { low: 0.0, high: 1.0, count: 5 });
        let spec = proto::SweepSpec {
            parameters: vec![proto::SweepParameter { name: "V".into(), values: Some(values) }],
            analysis: Some(proto::sweep_spec::Analysis::PullIn(proto::SweepPullIn {
                port: "nosuch".into(),
                max_v: 30.0,
            })),
            shard: 0,
            shards: 0,
            samples: None,
        };
        let request =
            proto::SubmitSweepRequest { bundle: wire_bundle(), options: None, spec: Some(spec), ..Default::default() };
        let submitted = client.submit_sweep(request).await.expect("starts").into_inner();
        assert_eq!(submitted.points, 5);
        let sweep = submitted.sweep;
        let watched = client.watch_sweep(proto::WatchSweepRequest { sweep: sweep.clone() }).await;
        let states: Vec<_> = watched.expect("a stream").into_inner().map(|s| s.expect("a status")).collect().await;
        let last = states.last().expect("a last status");
        assert_eq!((last.state(), last.done, last.failed), (proto::sweep_status::State::Done, 5, 5));
        let fetched = client.fetch_sweep(proto::FetchSweepRequest { sweep: sweep.clone() }).await;
        let chunks: Vec<_> = fetched.expect("a stream").into_inner().map(|c| c.expect("a chunk")).collect().await;
        assert_eq!(chunks[0].parameters, ["V"]);
        let rows: Vec<_> = chunks.iter().flat_map(|chunk| &chunk.rows).collect();
        assert_eq!(rows.iter().map(|row| row.point).collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
        assert!(rows.iter().all(|row| !row.error.is_empty() && row.results.is_empty()));
        client.cancel_sweep(proto::CancelSweepRequest { sweep: sweep.clone() }).await.expect("forgotten");
        let gone = client.fetch_sweep(proto::FetchSweepRequest { sweep }).await.expect_err("is gone");
        assert_eq!(gone.code(), Code::NotFound);
    });
}

/// Health and reflection answer, so that generic tools work without the .proto files.
#[test]
fn health_answers() {
    use tonic_health::pb::{HealthCheckRequest, health_check_response::ServingStatus, health_client::HealthClient};
    let server = start("127.0.0.1:0", Limits::default());
    block_on(async {
        let endpoint = tonic::transport::Endpoint::from_shared(server.address.uri()).expect("a uri");
        let mut health = HealthClient::new(endpoint.connect().await.expect("connects"));
        let request = HealthCheckRequest { service: "bimorph.v1.Bimorph".into() };
        let answer = health.check(request).await.expect("an answer").into_inner();
        assert_eq!(answer.status(), ServingStatus::Serving);
    });
}
