//! A session continues elsewhere with the same bits: from a snapshot at any step, on another server, or as a fork; and
//! not from one of another model.

use super::attached::Attached;
use super::test_server::{Running, block_on, compiled, start_with, wire_bundle};
use bimorph::device::local::LocalDevice;
use bimorph::service::limits::Limits;
use bimorph::service::proto;
use prost::Message;
use proto::bimorph_client::BimorphClient;
use std::time::Duration;
use tonic::Code;
use tonic::transport::Channel;

fn server(limits: Limits) -> Running {
    start_with("127.0.0.1:0", limits, |compiled| Box::new(LocalDevice::new(compiled)))
}

async fn open(client: &mut BimorphClient<Channel>, model: &str) -> String {
    let signals = ["m.x", "m.vx"].map(str::to_owned).to_vec();
    let request = proto::OpenRequest { model: model.to_owned(), ports: vec![], signals, noise: None };
    client.open(request).await.expect("opens").into_inner().session
}

/// The plate is driven through its pull-in; at every step the state goes to another server, which takes the next step with
/// the same bits, as does a fork on the first one.
#[test]
fn snapshots_continue_with_the_same_bits() {
    let (here, there) = (server(Limits::default()), server(Limits::default()));
    block_on(async {
        let (mut a, mut b) = (here.client().await, there.client().await);
        let model = compiled(&mut a).await;
        assert_eq!(compiled(&mut b).await, model);
        let session = open(&mut a, &model).await;
        let mut stream = Attached::to(&mut a, &session).await;
        let mut now = stream.trial(0, 0.0, 1.0).await;
        let mut reach: f64 = 0.0;
        for step in 0..30 {
            let volts = 1.0 + 0.5 * f64::from(step);
            let request = proto::SnapshotRequest { session: session.clone(), token: now.token };
            let alone = a.snapshot(request).await.expect("a snapshot").into_inner().snapshot;
            let request = proto::SnapshotRequest { session: session.clone(), token: 0 };
            let all = a.snapshot(request).await.expect("a snapshot").into_inner().snapshot;
            assert!(alone.len() <= all.len());
            let mut dt = 1e-6;
            let next = loop {
                let next = stream.trial(now.token, dt, volts).await;
                if next.status() == proto::trial_reply::Status::Ok {
                    break next;
                }
                dt = 0.5 * next.need_dt;
            };
            for snapshot in [alone, all] {
                let request = proto::RestoreRequest { model: model.clone(), snapshot };
                let moved = b.restore(request).await.expect("restores").into_inner();
                assert_eq!(moved.device.expect("described").signals.len(), 2);
                let mut other = Attached::to(&mut b, &moved.session).await;
                let reply = other.trial(now.token, dt, volts).await;
                assert_eq!(reply.encode_to_vec(), next.encode_to_vec(), "step {step}");
                b.close(proto::CloseRequest { session: moved.session }).await.expect("closes");
            }
            let fork = a.fork(proto::ForkRequest { session: session.clone() }).await.expect("forks").into_inner();
            assert_ne!(fork.session, session);
            let mut other = Attached::to(&mut a, &fork.session).await;
            assert_eq!(other.trial(now.token, dt, volts).await.encode_to_vec(), next.encode_to_vec(), "step {step}");
            a.close(proto::CloseRequest { session: fork.session }).await.expect("closes");
            reach = reach.max(next.outputs[0]);
            now = next;
        }
        assert!(reach > 1.5e-6, "the plate (gap 2 µm) has pulled in: {reach}");
    });
}

/// Another model, damaged bytes and unknown names are refused, and leave no session behind.
#[test]
fn other_snapshots_are_refused() {
    let server = server(Limits { sessions: 2, ..Limits::default() });
    block_on(async {
        let mut client = server.client().await;
        let model = compiled(&mut client).await;
        let session = open(&mut client, &model).await;
        let token = Attached::to(&mut client, &session).await.trial(0, 0.0, 1.0).await.token;
        let request = proto::SnapshotRequest { session: session.clone(), token };
        let snapshot = client.snapshot(request).await.expect("a snapshot").into_inner().snapshot;
        let options = Some(proto::CompileOptions { tol: Some(1e-4), ..Default::default() });
        let request = proto::CompileRequest { bundle: wire_bundle(), options };
        let other = client.compile(request).await.expect("compiles").into_inner().model.expect("a description").id;
        let mut restore = async |model: &str, snapshot: &[u8]| {
            let request = proto::RestoreRequest { model: model.to_owned(), snapshot: snapshot.to_vec() };
            client.restore(request).await.map(|opened| opened.into_inner().session)
        };
        for _ in 0..10 {
            let refused = restore(&other, &snapshot).await.expect_err("of another model");
            assert_eq!(refused.code(), Code::FailedPrecondition, "{refused:?}");
            let mut damaged = snapshot.clone();
            damaged[snapshot.len() / 2] ^= 4;
            for bytes in [&damaged, &snapshot[..snapshot.len() - 1], b""] {
                let refused = restore(&model, bytes).await.expect_err("damaged");
                assert_eq!(refused.code(), Code::InvalidArgument, "{refused:?}");
            }
        }
        restore(&model, &snapshot).await.expect("there is room for one more");
        let request = proto::SnapshotRequest { session, token: 12345 };
        assert_eq!(client.snapshot(request).await.expect_err("no such state").code(), Code::NotFound);
        let request = proto::SnapshotRequest { session: "0".repeat(32), token: 0 };
        assert_eq!(client.snapshot(request).await.expect_err("no such session").code(), Code::NotFound);
    });
}

/// Requests to a session of another server have the same limits here as those to a session opened here.
#[test]
fn a_restored_session_is_within_limits() {
    let (here, there) = (server(Limits::default()), server(Limits { signals: 1, ..Limits::default() }));
    block_on(async {
        let (mut a, mut b) = (here.client().await, there.client().await);
        let model = compiled(&mut a).await;
        assert_eq!(compiled(&mut b).await, model);
        let session = open(&mut a, &model).await;
        let request = proto::SnapshotRequest { session, token: 0 };
        let snapshot = a.snapshot(request).await.expect("a snapshot").into_inner().snapshot;
        let refused = b.restore(proto::RestoreRequest { model, snapshot }).await.expect_err("two signals");
        assert_eq!(refused.code(), Code::ResourceExhausted);
        assert!(refused.message().starts_with("signals"), "{}", refused.message());
    });
}

/// A lease keeps a session for longer than the server does, and for less, as it says; a stranger without the id cannot.
#[test]
fn leases_keep_sessions() {
    let (idle, stream_idle) = (Duration::from_millis(400), Duration::from_secs(3600));
    let server = server(Limits { idle, stream_idle, ..Limits::default() });
    block_on(async {
        let mut client = server.client().await;
        let model = compiled(&mut client).await;
        let (plain, leased, short) =
            (open(&mut client, &model).await, open(&mut client, &model).await, open(&mut client, &model).await);
        let mut keep = async |session: &str, lease_s| {
            let request = proto::KeepAliveRequest { session: session.to_owned(), lease_s };
            client.keep_alive(request).await.map(|kept| kept.into_inner().lease_s)
        };
        assert_eq!(keep(&leased, 600.0).await.expect("is kept"), 600.0);
        assert_eq!(keep(&leased, 1e9).await.expect("is kept"), 3600.0, "at most the limit");
        assert_eq!(keep(&plain, 0.0).await.expect("is kept"), 0.4);
        assert_eq!(keep(&short, 0.001).await.expect("is kept"), 0.001);
        assert_eq!(keep("guess", 1.0).await.expect_err("no such session").code(), Code::NotFound);
        for none in [-1.0, f64::NAN] {
            assert_eq!(keep(&plain, none).await.expect_err("no time").code(), Code::InvalidArgument);
        }
        tokio::time::sleep(Duration::from_millis(1500)).await;
        assert_eq!(keep(&plain, 0.0).await.expect_err("is forgotten").code(), Code::NotFound);
        assert_eq!(keep(&short, 0.0).await.expect_err("is forgotten").code(), Code::NotFound);
        keep(&leased, 600.0).await.expect("is there");
    });
}
