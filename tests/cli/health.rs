//! Health checks need no token and cannot exhaust other calls: `grpc.health.v1`.

use crate::command::Bench;
use crate::monitoring::{block_on, channel, get, start, value};
use crate::serve_process::Server;
use crate::tls_and_tokens::{self, access, asked, certified};
use bimorph::service::proto;
use proto::bimorph_client::BimorphClient;
use proto::device_request::Kind as Ask;
use std::time::Duration;
use tonic::transport::Channel;
use tonic::{Code, Streaming};
use tonic_health::pb::health_check_response::ServingStatus;
use tonic_health::pb::health_client::HealthClient;
use tonic_health::pb::{HealthCheckRequest, HealthCheckResponse};

/// Watches and checks at once, as docs/reference/server.md says.
const PLACES: usize = 64;

async fn check(channel: &Channel, service: &str) -> Result<ServingStatus, Code> {
    let request = HealthCheckRequest { service: service.into() };
    let answer = HealthClient::new(channel.clone()).check(request).await;
    answer.map(|answer| answer.into_inner().status()).map_err(|status| status.code())
}

/// A stream of health, after its first message.
async fn watch(channel: &Channel) -> Result<Streaming<HealthCheckResponse>, Code> {
    let request = HealthCheckRequest { service: String::new() };
    let mut stream = HealthClient::new(channel.clone()).watch(request).await.map_err(|s| s.code())?.into_inner();
    let first = stream.message().await.map_err(|status| status.code())?.expect("a word");
    assert_eq!(first.status(), ServingStatus::Serving);
    Ok(stream)
}

/// With the maximum number of connections, each with a watch and no token, a client with a token gets a permit.
#[test]
fn watches_block_no_client() {
    let bench = tls_and_tokens::bench();
    let server = Server::start(&bench, "--listen 127.0.0.1:0 --token-file tokens --max-connections 4");
    block_on(async {
        let mut watches = Vec::new();
        for _ in 0..4 {
            let channel = channel(&server.address).await;
            watches.push((watch(&channel).await.expect("a stream"), channel));
        }
        let (address, access) = (server.address.clone(), access(&bench, Some("alice")));
        let asked = std::thread::spawn(move || asked(&address, &access)).join().expect("no panic");
        assert_eq!(asked.as_deref(), Ok(env!("CARGO_PKG_VERSION")));
    });
}

/// Watches are few at once, checks have places of their own, and a request has a kilobyte; other calls are not counted among them.
#[test]
fn health_has_small_places_of_its_own() {
    let bench = Bench::new(&[]);
    let (server, metrics) = start(&bench, "--limit calls=1");
    block_on(async {
        let channel = channel(&server.address).await;
        let mut watches = Vec::new();
        for _ in 0..PLACES {
            watches.push(watch(&channel).await.expect("a place"));
        }
        assert_eq!(watch(&channel).await.err(), Some(Code::ResourceExhausted));
        assert_eq!(check(&channel, "").await, Ok(ServingStatus::Serving));
        assert_eq!(check(&channel, &"x".repeat(2000)).await, Err(Code::ResourceExhausted));
        BimorphClient::new(channel.clone()).info(proto::InfoRequest {}).await.expect("the one call that may be");
    });
    // health calls appear in the metrics by that name
    let (_, text) = get(&metrics, "/metrics");
    assert_eq!(value(&text, "bimorph_calls_total{call=\"Health/Check\",code=\"Ok\"}"), 1.0);
    assert!(!text.contains("call=\"Check\""), "{text}");
}

/// A plain client on a TLS address receives an error that says so, for any call.
#[test]
fn health_requires_tls_on_tls_addresses() {
    let bench = tls_and_tokens::bench();
    let authority = tls_and_tokens::tls("authority.pem");
    let server = Server::start(&bench, &format!("{} --tls-client-ca {}", certified("server"), authority.display()));
    block_on(async {
        let channel = channel(server.address.trim_start_matches("https://")).await;
        assert_eq!(check(&channel, "").await, Err(Code::Unauthenticated));
    });
}

/// A server that stops is not well under any name, from the first moment.
#[test]
fn a_server_that_stops_says_so() {
    let bench = Bench::new(&[]);
    let mut server = Server::start(&bench, "--listen 127.0.0.1:0 --limit drain=30");
    block_on(async {
        let channel = channel(&server.address).await;
        let mut well = watch(&channel).await.expect("a stream");
        let mut client = BimorphClient::new(channel.clone());
        // a stream that is open lets it drain for long
        let (requests, queue) = tokio::sync::mpsc::channel(1);
        let attach = Ask::Attach(proto::Attach { session: "none".into() });
        requests.send(proto::DeviceRequest { kind: Some(attach) }).await.expect("queued");
        let queue = tokio_stream::wrappers::ReceiverStream::new(queue);
        let mut replies = client.trial(queue).await.expect("a stream").into_inner();
        replies.message().await.expect("a reply");
        server.report("-TERM");
        let next = well.message().await.expect("a stream that goes on").expect("a word");
        assert_eq!(next.status(), ServingStatus::NotServing);
    });
}

/// Connections whose other end is gone are noticed by the system: the socket's timer runs, and is the one that the limit says.
/// (proc(5): `tr` 02 is a timer that is no retransmission; `tm->when` counts hundredths of a second.)
#[cfg(target_os = "linux")]
#[test]
fn a_silent_connection_is_asked_whether_it_is_there() {
    let bench = Bench::new(&[]);
    let server = Server::start(&bench, "--listen 127.0.0.1:0 --limit keepalive=1000");
    let client = std::net::TcpStream::connect(&server.address).expect("connects");
    let port = |address: std::net::SocketAddr| format!(":{:04X}", address.port());
    let (ours, theirs) = (client.local_addr().expect("bound"), client.peer_addr().expect("connected"));
    let timer = || {
        let table = std::fs::read_to_string("/proc/net/tcp").expect("a table");
        let mut lines = table.lines().map(|line| line.split_whitespace().collect::<Vec<_>>());
        let line = lines.find(|words| words[1].ends_with(&port(theirs)) && words[2].ends_with(&port(ours)));
        line.expect("the other end of it")[5].to_owned()
    };
    // it is not set until it is accepted
    let looks = (0..5000).map(|_| {
        std::thread::sleep(Duration::from_millis(1));
        timer()
    });
    let timer = looks.into_iter().find(|timer| timer.starts_with("02:")).expect("a timer that runs");
    let when = u64::from_str_radix(&timer[3..], 16).expect("a number");
    assert!((90_000..=100_000).contains(&when), "{when}");
}
