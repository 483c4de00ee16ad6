//! Requests that no client of ours sends: other kinds of content, and states with invalid numbers. The command refuses
//! them with what the protocol says, and answers the next one.

use crate::command::Bench;
use crate::monitoring::block_on;
use crate::serve_process::Server;
use crate::stepping::{Stream, client, compiled};
use bimorph::service::proto;
use proto::device_request::Kind as Ask;
use tonic::Code;
use tonic::body::Body;
use tonic::client::GrpcService;
use tonic::codegen::http::{Request, StatusCode};
use tonic::transport::Endpoint;

fn serving(bench: &Bench) -> Server {
    Server::start(bench, &format!("--listen unix://{}", bench.path("s").display()))
}

/// Status of a request of this content, where it has a kind, and what it says in `accept`.
async fn asked(address: &str, call: &str, kind: Option<&str>) -> (StatusCode, Option<String>) {
    let endpoint = Endpoint::from_shared(address.to_owned()).expect("a uri");
    let mut channel = endpoint.connect().await.expect("the server listens");
    let mut request = Request::post(call).header("te", "trailers");
    if let Some(kind) = kind {
        request = request.header("content-type", kind);
    }
    // an empty message of gRPC
    let body = Body::new("\0".repeat(5));
    std::future::poll_fn(|cx| GrpcService::<Body>::poll_ready(&mut channel, cx)).await.expect("ready");
    let response = GrpcService::call(&mut channel, request.body(body).expect("a request")).await.expect("a response");
    let accept = response.headers().get("accept").and_then(|accept| accept.to_str().ok()).map(str::to_owned);
    (response.status(), accept)
}

/// A request whose content is not that of gRPC gets 415 (Unsupported Media Type), as the gRPC protocol over HTTP/2 says, on every service.
#[test]
fn other_content_is_refused() {
    let bench = Bench::new(&[]);
    let mut server = serving(&bench);
    let info = "/bimorph.v1.Bimorph/Info";
    block_on(async {
        for kind in [
            None,
            Some("application/json"),
            Some("text/plain"),
            Some("application/grpc-web"),
            Some("application/grpc-web+proto"),
            Some("application/grpc+json"),
            Some("application/grpcx"),
            Some("application/x-protobuf"),
            Some(""),
        ] {
            for call in [info, "/grpc.health.v1.Health/Check", "/bimorph.v1.Bimorph/Nothing"] {
                let (status, accept) = asked(&server.address, call, kind).await;
                assert_eq!(status, StatusCode::UNSUPPORTED_MEDIA_TYPE, "{call}, {kind:?}");
                assert_eq!(accept.as_deref(), Some("application/grpc"), "{call}, {kind:?}");
            }
        }
        for kind in ["application/grpc", "application/grpc+proto", "application/grpc;charset=utf-8"] {
            assert_eq!(asked(&server.address, info, Some(kind)).await.0, StatusCode::OK, "{kind}");
        }
        client(&server.address).await.info(proto::InfoRequest {}).await.expect("it goes on");
    });
    assert_eq!(server.signal("-TERM"), Some(0));
}

/// Bytes of the envelope of a snapshot before its body: a name, a version, and the sum of the body.
const HEAD: usize = 16 + 1 + 16;

/// FNV-1a of 128 bits (Fowler, Noll, Vo; draft-eastlake-fnv-17, offset basis and prime of §5).
fn sum(bytes: &[u8]) -> u128 {
    const PRIME: u128 = (1 << 88) + 0x13b;
    bytes
        .iter()
        .fold(0x6c62_272e_07bb_0142_62b8_2175_6295_c58d, |sum, byte| (sum ^ u128::from(*byte)).wrapping_mul(PRIME))
}

/// Where the words of the only state of a snapshot begin, behind its token and its parent.
fn state(snapshot: &[u8]) -> usize {
    let mut at = HEAD;
    // the version of the program and the id of the model
    for _ in 0..2 {
        at += 1 + usize::from(snapshot[at]);
    }
    let count = |at: usize| u64::from_le_bytes(snapshot[at..at + 8].try_into().expect("a word")) as usize;
    // the name of the format; ports and signals by name
    at += 8;
    for _ in 0..2 {
        let names = count(at);
        at += 8;
        for _ in 0..names {
            at += 8 + count(at);
        }
    }
    // no noise, one state, its token and its parent
    assert_eq!((count(at), count(at + 8)), (0, 1));
    at + 32
}

/// The bytes of a state can be given any number, with the matching checksum. Each word of it that is NaN or below all
/// numbers is rejected; the snapshot itself continues, with the bits of its session.
#[test]
fn states_with_numbers_that_are_none_are_refused() {
    let bench = Bench::new(&[]);
    let mut server = serving(&bench);
    block_on(async {
        let mut wire = client(&server.address).await;
        let model = compiled(&mut wire).await;
        let open = proto::OpenRequest { model: model.clone(), signals: vec!["m.x".into()], ..Default::default() };
        let session = wire.open(open).await.expect("opens").into_inner().session;
        let attach = Ask::Attach(proto::Attach { session: session.clone() });
        let (mut stream, _) = Stream::start(&mut wire, attach).await.expect("attaches");
        let mut token = 0;
        for step in 0..5 {
            token = stream.step(step, token).await.expect("steps").0.token;
        }
        let taken = proto::SnapshotRequest { session, token };
        let snapshot = wire.snapshot(taken).await.expect("a snapshot").into_inner().snapshot;
        assert_eq!(snapshot[17..HEAD], sum(&snapshot[HEAD..]).to_le_bytes(), "this is the sum");
        let places: Vec<usize> = (state(&snapshot)..snapshot.len()).step_by(8).collect();
        assert!(places.len() > 20, "{places:?}");
        for at in places {
            for number in [f64::NAN, f64::NEG_INFINITY, -f64::NAN] {
                let mut forged = snapshot.clone();
                forged[at..at + 8].copy_from_slice(&number.to_le_bytes());
                let sum = sum(&forged[HEAD..]).to_le_bytes();
                forged[17..HEAD].copy_from_slice(&sum);
                let restore = proto::RestoreRequest { model: model.clone(), snapshot: forged };
                let refused = wire.restore(restore).await.expect_err("not a state").code();
                assert_eq!(refused, Code::InvalidArgument, "{number} at {at}");
            }
        }
        let whole = proto::RestoreRequest { model, snapshot };
        let restored = wire.restore(whole).await.expect("as it was taken").into_inner().session;
        let attach = Ask::Attach(proto::Attach { session: restored });
        let (mut again, _) = Stream::start(&mut wire, attach).await.expect("attaches");
        let here = again.step(5, token).await.expect("steps").0;
        assert_eq!(here, stream.step(5, token).await.expect("steps").0);
    });
    assert_eq!(server.signal("-TERM"), Some(0));
}
