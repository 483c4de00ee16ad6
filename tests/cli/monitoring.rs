//! Monitoring of a server: metrics, readiness, health, logs with the ids of requests.

use crate::command::{Bench, PLATE};
use crate::serve_process::Server;
use bimorph::netlist::Bundle;
use bimorph::service::convert::model::bundle_to_wire;
use bimorph::service::convert::run::pack;
use bimorph::service::metrics::METRICS;
use bimorph::service::proto;
use proto::bimorph_client::BimorphClient;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;
use tonic::transport::{Channel, Endpoint};
use tonic_health::pb::HealthCheckRequest;
use tonic_health::pb::health_check_response::ServingStatus;
use tonic_health::pb::health_client::HealthClient;

const PATIENCE: Duration = Duration::from_secs(30);

/// A server with metrics at an address of their own.
pub(crate) fn start(bench: &Bench, options: &str) -> (Server, String) {
    let mut server = Server::start(bench, &format!("--listen 127.0.0.1:0 --metrics 127.0.0.1:0 {options}"));
    let metrics = server.line("metrics on http://").trim_end_matches("/metrics").to_owned();
    (server, metrics)
}

/// Status and body of an answer.
pub(crate) fn get(address: &str, what: &str) -> (u16, String) {
    let mut socket = TcpStream::connect(address).expect("connects");
    socket.set_read_timeout(Some(PATIENCE)).expect("set");
    write!(socket, "GET {what} HTTP/1.1\r\nhost: here\r\n\r\n").expect("sent");
    let mut text = String::new();
    socket.read_to_string(&mut text).expect("an answer that ends");
    let (head, body) = text.split_once("\r\n\r\n").expect("a head");
    let status = head.split_whitespace().nth(1).and_then(|word| word.parse().ok());
    (status.expect("a status"), body.to_owned())
}

/// The value of a metric.
pub(crate) fn value(text: &str, metric: &str) -> f64 {
    let line = text.lines().find_map(|line| line.strip_prefix(metric)?.strip_prefix(' '));
    line.unwrap_or_else(|| panic!("no {metric} in {text}")).parse().expect("a number")
}

/// A connection.
pub(crate) async fn channel(address: &str) -> Channel {
    Endpoint::from_shared(format!("http://{address}")).expect("a uri").connect().await.expect("connects")
}

/// Whether the health service says that it is ready.
async fn is_ready(channel: &Channel) -> bool {
    let request = HealthCheckRequest { service: "ready".into() };
    let answer = HealthClient::new(channel.clone()).check(request).await.expect("an answer").into_inner();
    answer.status() == ServingStatus::Serving
}

/// Runs a future to its end.
pub(crate) fn block_on<T>(future: impl Future<Output = T>) -> T {
    tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime").block_on(future)
}

/// Every metric is reported, with its kind, and calls are counted by name and code. Open sessions fill the server,
/// which is then not ready by HTTP and by the health service, and ready again when one is closed.
#[test]
fn metrics_and_readiness() {
    let bench = Bench::new(&[]);
    let (server, metrics) = start(&bench, "--max-sessions 1");
    assert_eq!(get(&metrics, "/ready"), (200, "ready\n".into()));
    assert_eq!(get(&metrics, "/live").0, 200);
    assert_eq!(get(&metrics, "/nosuch").0, 404);
    block_on(async {
        let channel = channel(&server.address).await;
        let mut client = BimorphClient::new(channel.clone());
        let bundle = Some(bundle_to_wire(&Bundle::from_text("plate.net", PLATE)));
        let model = client.compile(proto::CompileRequest { bundle, options: None }).await.expect("compiles");
        let model = model.into_inner().model.expect("a model").id;
        client.describe(proto::DescribeRequest { model: "none".into() }).await.expect_err("not here");
        let open = proto::OpenRequest { model, ..Default::default() };
        let session = client.open(open).await.expect("opens").into_inner().session;

        let (status, text) = get(&metrics, "/metrics");
        assert_eq!(status, 200);
        for metric in METRICS {
            assert!(text.contains(&format!("# TYPE {} {}\n", metric.name, metric.kind)), "{}", metric.name);
        }
        for (metric, expected) in [
            ("bimorph_sessions", 1.0),
            ("bimorph_models", 1.0),
            ("bimorph_ready", 0.0),
            ("bimorph_calls", 0.0),
            ("bimorph_calls_total{call=\"Compile\",code=\"Ok\"}", 1.0),
            ("bimorph_calls_total{call=\"Describe\",code=\"NotFound\"}", 1.0),
            ("bimorph_call_seconds_count{call=\"Open\"}", 1.0),
            ("bimorph_call_seconds_bucket{call=\"Open\",le=\"+Inf\"}", 1.0),
        ] {
            assert_eq!(value(&text, metric), expected, "{metric}");
        }
        assert!(value(&text, "process_resident_memory_bytes") > 1e6);

        assert_eq!(get(&metrics, "/ready"), (503, "not ready: sessions: 1 of 1\n".into()));
        while is_ready(&channel).await {}
        client.close(proto::CloseRequest { session }).await.expect("closes");
        while !is_ready(&channel).await {}
        assert_eq!(get(&metrics, "/ready").0, 200);
    });
}

/// Steps of a run count as trials, and its call and those of a path by their names.
#[test]
fn runs_count_their_trials() {
    let bench = Bench::new(&[]);
    let (server, metrics) = start(&bench, "");
    block_on(async {
        let mut client = BimorphClient::new(channel(&server.address).await);
        let bundle = Some(bundle_to_wire(&Bundle::from_text("plate.net", PLATE)));
        let model = client.compile(proto::CompileRequest { bundle, options: None }).await.expect("compiles");
        let model = model.into_inner().model.expect("a model").id;
        client.path(proto::PathRequest { model: model.clone(), ..Default::default() }).await.expect_err("no values");
        let open = proto::OpenRequest { model, ..Default::default() };
        let session = client.open(open).await.expect("opens").into_inner().session;
        let times: Vec<f64> = (1..=50).map(|k| 1e-7 * f64::from(k)).collect();
        let lane = proto::RunLane { session, start: pack(&[0.0]), ..Default::default() };
        let request =
            proto::RunRequest { times: pack(&times), values: pack(&[2.0]), lanes: vec![lane], ..Default::default() };
        let mut events = client.run(request).await.expect("runs").into_inner();
        let mut trials = 0;
        while let Some(event) = events.message().await.expect("an event") {
            trials += event.ends.iter().map(|end| end.trials).sum::<u64>();
        }
        assert!(trials >= 50, "{trials}");
        let text = get(&metrics, "/metrics").1;
        assert_eq!(value(&text, "bimorph_trials_total"), trials as f64);
        assert_eq!(value(&text, "bimorph_calls_total{call=\"Run\",code=\"Ok\"}"), 1.0);
        assert_eq!(value(&text, "bimorph_calls_total{call=\"Path\",code=\"InvalidArgument\"}"), 1.0);
    });
}

/// Lines of a log in JSON are objects with the id, the name and the client of their request; the id is the client's where it has
/// one, and comes back with the answer.
#[test]
fn logs_name_their_requests() {
    let bench = Bench::new(&[("tokens", "alice 0123456789abcdef\n")]);
    let mut command = bench.command("serve --listen 127.0.0.1:0 --log-json --token-file tokens");
    command.env("BIMORPH_LOG", "bimorph=info");
    let mut server = Server::spawn(command);
    let (own, made) = block_on(async {
        let mut client = BimorphClient::new(channel(&server.address).await);
        let mut ask = async |id: Option<&'static str>| {
            let mut request = tonic::Request::new(proto::InfoRequest {});
            let metadata = request.metadata_mut();
            metadata.insert("authorization", "Bearer 0123456789abcdef".parse().expect("a value"));
            id.map(|id| metadata.insert("x-request-id", id.parse().expect("a value")));
            let answer = client.info(request).await.expect("an answer");
            answer.metadata().get("x-request-id").expect("an id").to_str().expect("text").to_owned()
        };
        (ask(Some("job-17")).await, ask(None).await)
    });
    assert_eq!(own, "job-17");
    for id in [own, made] {
        let line = server.line_with(&[&format!("\"id\":\"{id}\""), "answered"]);
        let line: serde_json::Value = serde_json::from_str(&line).expect("an object");
        assert_eq!(line["span"]["call"], "Info", "{line}");
        assert_eq!(line["span"]["client"], "alice", "{line}");
        assert_eq!((&line["level"], &line["code"]), (&"INFO".into(), &"Ok".into()), "{line}");
    }
}

/// An address without host and port is rejected.
#[test]
fn metrics_need_a_port() {
    let bench = Bench::new(&[]);
    let ran = bench.run("serve --listen 127.0.0.1:0 --metrics unix:///tmp/nosuch");
    assert_eq!(ran.status, 1);
    assert!(ran.stderr.contains("expected host:port"), "{}", ran.stderr);
}

/// docs/reference/server.md has every metric.
#[test]
fn documented_metrics() {
    let docs =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/reference/server.md")).expect("the page");
    for metric in METRICS {
        let row = format!("| `{}` | {} | {} |", metric.name, metric.kind, metric.help);
        assert!(docs.contains(&row), "no row {row}");
    }
}
