//! Impossible requests are rejected with the right code, and name the field, and the server continues.

use super::echo::PANIC;
use super::test_server::{DEADLINE, block_on, bundle, compiled, start};
use bimorph::compile::CompileOptions;
use bimorph::device::{Device, DeviceError, Mode, OpenRequest, Token, Trial, TrialReply};
use bimorph::netlist::Bundle;
use bimorph::service::client::{Client, RemoteDevice};
use bimorph::service::limits::Limits;
use bimorph::service::proto;
use std::time::Duration;
use tonic::Code;
use tonic_types::StatusExt;

fn netlist(text: &str) -> Option<proto::Bundle> {
    Some(proto::Bundle { root: "a.net".into(), files: [("a.net".to_owned(), text.to_owned())].into() })
}

fn at_rest(voltages: &[f64]) -> Trial<'_> {
    Trial { mode: Mode::Static, parent: None, t: 0.0, dt: 0.0, voltages }
}

/// A netlist with errors: INVALID_ARGUMENT, one violation for each error, its field the place in the text.
#[test]
fn bad_netlists_are_blamed_by_place() {
    let server = start("127.0.0.1:0", Limits::default());
    let request = proto::CompileRequest {
        bundle: netlist("anchor * [f] [l=1u w=1u h=1u]\nnosuch * [f] []\nbeam2d p1 [f b] [l=100u w=oops]\n"),
        options: None,
    };
    let status = block_on(async { server.client().await.compile(request).await }).expect_err("is refused");
    assert_eq!(status.code(), Code::InvalidArgument);
    let details = status.get_error_details();
    let violations = &details.bad_request().expect("a BadRequest").field_violations;
    assert!(violations.iter().any(|v| v.field.starts_with("a.net:2:")), "{violations:?}");
    assert!(status.message().contains("nosuch"), "{}", status.message());
}

/// Fields that mean nothing are named.
#[test]
fn bad_fields_are_named() {
    let server = start("127.0.0.1:0", Limits::default());
    block_on(async {
        let mut client = server.client().await;
        let model = compiled(&mut client).await;
        let field = |status: tonic::Status| {
            assert_eq!(status.code(), Code::InvalidArgument, "{status:?}");
            status.get_error_details().bad_request().expect("a BadRequest").field_violations[0].field.clone()
        };
        let none = client.compile(proto::CompileRequest::default()).await.expect_err("is refused");
        assert_eq!(field(none), "bundle");
        let root = proto::Bundle { root: "b.net".into(), ..Default::default() };
        let root = client.compile(proto::CompileRequest { bundle: Some(root), options: None }).await;
        assert_eq!(field(root.expect_err("is refused")), "bundle.root");
        let nan = vec![proto::Named { name: "drive".into(), value: f64::NAN }];
        let nan =
            client.r#static(proto::StaticRequest { model: model.clone(), voltages: nan, ..Default::default() }).await;
        assert_eq!(field(nan.expect_err("is refused")), "voltages[0]");
        let stop = proto::TransientRequest { model: model.clone(), stop_s: -1.0, ..Default::default() };
        assert_eq!(field(client.transient(stop).await.expect_err("is refused")), "stop_s");
        let port = proto::OpenRequest { model, ports: vec!["nosuch".into()], signals: vec![], noise: None };
        assert_eq!(field(client.open(port).await.expect_err("is refused")), "ports");
        let spec = client.submit_sweep(proto::SubmitSweepRequest {
            bundle: netlist(""),
            options: None,
            spec: None,
            ..Default::default()
        });
        assert_eq!(field(spec.await.expect_err("is refused")), "spec");
    });
}

/// Unknown models, sessions and sweeps: NOT_FOUND with a way out.
#[test]
fn unknown_ids_are_not_found() {
    let server = start("127.0.0.1:0", Limits::default());
    block_on(async {
        let mut client = server.client().await;
        let model = client.describe(proto::DescribeRequest { model: "00".into() }).await.expect_err("unknown");
        assert_eq!(model.code(), Code::NotFound);
        assert!(model.message().contains("compile it again"), "{}", model.message());
        let session = client.close(proto::CloseRequest { session: "x".into() }).await.expect_err("unknown");
        assert_eq!(session.code(), Code::NotFound);
        let sweep = client.watch_sweep(proto::WatchSweepRequest { sweep: "x".into() }).await.expect_err("unknown");
        assert_eq!(sweep.code(), Code::NotFound);
    });
}

/// The server opens no file that a client names: an include that is not in the bundle is a diagnostic.
#[test]
fn includes_come_from_the_bundle_alone() {
    let dir = tempfile::tempdir().expect("a directory");
    let secret = dir.path().join("secret.net");
    std::fs::write(&secret, "param leaked=1\n").expect("written");
    let server = start("127.0.0.1:0", Limits::default());
    let text = format!("uses {}\nanchor * [f] [l=1u w=1u h=1u]\n", secret.display());
    let request = proto::CheckRequest { bundle: netlist(&text), options: None };
    let answer = block_on(async { server.client().await.check(request).await }).expect("an answer").into_inner();
    assert!(!answer.ok);
    assert!(!answer.rendered.contains("leaked"), "{}", answer.rendered);
}

/// A fault inside one session closes that session and nothing else.
#[test]
fn a_fault_inside_ends_one_session_only() {
    let server = start("127.0.0.1:0", Limits::default());
    let (mut victim, mut other) = (server.device(), server.device());
    victim.open(&OpenRequest::default()).expect("opens");
    other.open(&OpenRequest::default()).expect("opens");
    let mut reply = TrialReply::default();
    let fault = victim.trial(&at_rest(&[PANIC, 0.0]), &mut reply).expect_err("a fault");
    assert!(fault.to_string().contains("internal fault"), "{fault}");
    other.trial(&at_rest(&[1.0, 0.0]), &mut reply).expect("the other session goes on");
    victim.open(&OpenRequest::default()).expect("a new epoch heals");
    victim.trial(&at_rest(&[1.0, 0.0]), &mut reply).expect("and answers");
}

/// Errors of a device come back over the wire as the same values.
#[test]
fn device_errors_come_back_as_themselves() {
    let server = start("127.0.0.1:0", Limits::default());
    let mut device = server.device();
    let mut reply = TrialReply::default();
    assert_eq!(device.trial(&at_rest(&[0.0, 0.0]), &mut reply), Err(DeviceError::NotOpen));
    let ports = OpenRequest { ports: vec!["x".into()], signals: vec![], noise: None };
    assert!(matches!(device.open(&ports), Err(DeviceError::UnknownPort { name, .. }) if name == "x"));
    device.open(&OpenRequest::default()).expect("opens");
    let orphan = Trial { parent: Some(Token(7)), ..at_rest(&[0.0, 0.0]) };
    assert_eq!(device.trial(&orphan, &mut reply), Err(DeviceError::UnknownToken(Token(7))));
    let short = device.trial(&at_rest(&[0.0]), &mut reply);
    assert!(matches!(short, Err(DeviceError::BadRequest { what: "voltages", .. })), "{short:?}");
}

/// No server: an error that names the address, within the deadline.
#[test]
fn a_missing_server_is_named() {
    let uri = "unix:///nonexistent/bimorph.sock";
    let error = RemoteDevice::connect(uri, &bundle(), &CompileOptions::default(), Duration::from_secs(5));
    let text = error.expect_err("nobody is there").to_string();
    assert!(text.contains(uri) && text.contains("No such file"), "{text}");
}

/// A server that accepts and never answers: an error at the deadline, not a hang.
#[test]
fn a_silent_server_is_given_up_on() {
    let silent = std::net::TcpListener::bind("127.0.0.1:0").expect("a port");
    let uri = format!("http://{}", silent.local_addr().expect("an address"));
    let error = RemoteDevice::connect(&uri, &bundle(), &CompileOptions::default(), Duration::from_millis(200));
    let text = error.expect_err("nobody answers").to_string();
    assert!(text.contains(&uri) && text.contains("0.2 s"), "{text}");
}

/// A bad netlist reaches the user of a remote device as rendered diagnostics.
#[test]
fn a_bad_netlist_reaches_the_user_rendered() {
    let server = start("127.0.0.1:0", Limits::default());
    let bad = Bundle::from_text("bank.net", "nosuch * [f] []\n");
    let device = RemoteDevice::connect(&server.address.uri(), &bad, &CompileOptions::default(), DEADLINE);
    let text = device.expect_err("is refused").to_string();
    assert!(text.contains("bank.net") && text.contains("nosuch"), "{text}");
    let mut client = Client::connect(&server.address.uri(), DEADLINE).expect("connects");
    let error = client.compile(&bad, &CompileOptions::default()).expect_err("is refused");
    assert_eq!(error.code, "InvalidArgument");
}
