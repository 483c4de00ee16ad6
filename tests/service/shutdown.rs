//! A server stops on request, for any state of its clients.

use super::test_server::{Running, block_on, compiled, start};
use bimorph::device::{Device, Mode, OpenRequest, Trial, TrialReply};
use bimorph::service::limits::Limits;
use bimorph::service::proto;
use proto::device_request::Kind as Ask;
use std::io::{Read, Write};
use std::time::Duration;
use tonic::Code;

fn hasty() -> Running {
    start("127.0.0.1:0", Limits { drain: Duration::from_millis(100), ..Limits::default() })
}

const AT_REST: Trial<'_> = Trial { mode: Mode::Static, parent: None, t: 0.0, dt: 0.0, voltages: &[1.0, 0.0] };

/// Without a connection, at once.
#[test]
fn an_idle_server_stops() {
    hasty().stop().expect("a clean stop");
}

/// A silent open stream receives UNAVAILABLE when the drain time is over.
#[test]
fn open_streams_are_reported() {
    let mut server = hasty();
    block_on(async {
        let mut client = server.client().await;
        let model = compiled(&mut client).await;
        let (requests, queue) = tokio::sync::mpsc::channel(4);
        let open = Ask::Open(proto::OpenRequest { model, ..Default::default() });
        requests.send(proto::DeviceRequest { kind: Some(open) }).await.expect("queued");
        let queue = tokio_stream::wrappers::ReceiverStream::new(queue);
        let mut replies = client.trial(queue).await.expect("a stream").into_inner();
        replies.message().await.expect("opened").expect("a reply");
        server.report();
        let status = replies.message().await.expect_err("the end");
        assert_eq!(status.code(), Code::Unavailable);
        assert!(status.message().contains("shutting down"), "{}", status.message());
        drop(requests);
    });
    server.stop().expect("a clean stop");
}

/// A client that speaks no HTTP, and one that connects and says nothing, do not hold the server.
#[test]
fn mute_clients_are_cut() {
    let mut server = hasty();
    let address = server.address.to_string();
    let mut silent = std::net::TcpStream::connect(&address).expect("connects");
    let mut half = std::net::TcpStream::connect(&address).expect("connects");
    // The HTTP/2 preface and an empty SETTINGS frame, then nothing: no reply to the server's pings.
    half.write_all(b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\x04\0\0\0\0\0").expect("written");
    let mut settings = [0; 9];
    half.read_exact(&mut settings).expect("the server's SETTINGS");
    server.stop().expect("a clean stop");
    for socket in [&mut silent, &mut half] {
        let mut rest = Vec::new();
        // An end or a reset: either way the server has closed.
        let _ = socket.read_to_end(&mut rest);
    }
}

/// A blocking device whose host computes elsewhere, and so answers nothing, does not hold the server either; its next
/// call says what happened, and when a server is back, open starts over.
#[test]
fn a_remote_device_outlives_its_server() {
    let dir = tempfile::tempdir().expect("a directory");
    let uri = format!("unix://{}", dir.path().join("b.sock").display());
    let limits = || Limits { drain: Duration::from_millis(100), ..Limits::default() };
    let mut server = start(&uri, limits());
    let mut device = server.device();
    let mut reply = TrialReply::default();
    device.open(&OpenRequest::default()).expect("opens");
    device.trial(&AT_REST, &mut reply).expect("answers");
    let before = reply.clone();
    server.stop().expect("a clean stop, with the device connected");

    let lost = device.trial(&AT_REST, &mut reply).expect_err("the server is gone").to_string();
    assert!(lost.contains(&uri), "{lost}");
    let still = device.trial(&AT_REST, &mut reply).expect_err("and stays so").to_string();
    assert!(still.contains("opened again"), "{still}");
    device.open(&OpenRequest::default()).expect_err("nobody to open");

    let _server = start(&uri, limits());
    device.open(&OpenRequest::default()).expect("a server is back");
    device.trial(&AT_REST, &mut reply).expect("answers");
    assert_eq!(reply, before);
}

/// A stream whose client is gone frees its session.
#[test]
fn streams_take_their_sessions_along() {
    let server = start("127.0.0.1:0", Limits { sessions: 1, ..Limits::default() });
    for _ in 0..3 {
        let mut device = server.device();
        // The server may see the end of the last connection a moment later.
        let opened = (0..200).any(|_| {
            std::thread::sleep(Duration::from_millis(5));
            device.open(&OpenRequest::default()).is_ok()
        });
        assert!(opened, "the session of the last device is still there");
    }
}
