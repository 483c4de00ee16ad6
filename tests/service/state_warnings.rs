//! Warnings of accepted states over the Trial stream and in runs.

use super::attached::trial;
use super::session_faults::LOCAL;
use super::test_server::{DEADLINE, block_on, bundle, start_with, wire_bundle};
use bimorph::analysis::mesh::in_circuit;
use bimorph::compile::{CompileOptions, Formulation, compile};
use bimorph::device::local::LocalDevice;
use bimorph::device::{Device, DeviceError, Mode, OpenRequest, Status, Token, Trial, TrialReply};
use bimorph::options::PortRanges;
use bimorph::service::client::RemoteDevice;
use bimorph::service::convert::model::diagnostic_to_wire;
use bimorph::service::convert::options::options_to_wire;
use bimorph::service::convert::run::pack;
use bimorph::service::in_process::InProcessServer;
use bimorph::service::limits::Limits;
use bimorph::service::proto;
use prost::Message;
use proto::device_reply::Kind as ReplyKind;
use proto::device_request::Kind as Ask;
use std::sync::Arc;

/// A reduced model without ranges: the full one is taken, and each session warns of it once.
fn options(ranges: Option<&str>) -> CompileOptions {
    let ranges = ranges.map(|text| PortRanges::parse(text).expect("ranges"));
    CompileOptions { formulation: Formulation::Reduced, tol: 1e-2, ranges, ..CompileOptions::default() }
}

fn local(options: &CompileOptions) -> LocalDevice {
    LocalDevice::new(Arc::new(in_circuit(&compile(&bundle(), options).expect("compiles"))))
}

fn next(device: &mut dyn Device, parent: Option<Token>, volts: f64) -> Token {
    let mut reply = TrialReply::default();
    let mode = if parent.is_none() { Mode::Static } else { Mode::Transient };
    device.trial(&Trial { mode, parent, t: 0.0, dt: 1e-7, voltages: &[volts] }, &mut reply).expect("a reply");
    assert_eq!(reply.status, Status::Ok);
    reply.token.expect("a state")
}

/// The warnings of a state that is accepted with a request for them are those in process, and come once, after the next reply. Without a
/// request there are none.
#[test]
fn warnings_come_with_the_next_reply() {
    let server = start_with("127.0.0.1:0", Limits::default(), LOCAL);
    let (mut here, options) = (local(&options(None)), options(None));
    let mut there = RemoteDevice::connect(&server.address.uri(), &bundle(), &options, DEADLINE).expect("compiles");
    here.open(&OpenRequest::default()).expect("opens");
    there.open(&OpenRequest::default()).expect("opens");
    let rest = next(&mut here, None, 1.0);
    let expected = here.warns(rest);
    assert!(expected.iter().any(|warning| warning.code == "W053" && !warning.help.is_empty()), "{expected:?}");

    let first = next(&mut there, None, 1.0);
    assert_eq!(first, rest);
    there.accept(first);
    let second = next(&mut there, Some(first), 1.0);
    assert_eq!(there.warns(second), [], "nothing was requested");
    there.accept(second);
    let third = next(&mut there, Some(second), 1.0);
    assert_eq!(there.warns(third), expected);
    there.accept(third);
    let fourth = next(&mut there, Some(third), 1.0);
    assert_eq!(there.warns(fourth), [], "each kind once");
}

/// A run has the warnings of its states at its end, where they are wanted.
#[test]
fn runs_have_the_warnings_of_their_states() {
    let server = start_with("127.0.0.1:0", Limits::default(), LOCAL);
    let mut here = local(&options(None));
    here.open(&OpenRequest::default()).expect("opens");
    let expected: Vec<_> = {
        let rest = next(&mut here, None, 0.0);
        let state = next(&mut here, Some(rest), 0.0);
        here.warns(state).iter().map(diagnostic_to_wire).collect()
    };
    assert!(expected.iter().any(|warning| warning.code == "W053"), "{expected:?}");
    block_on(async {
        let mut client = server.client().await;
        let compile = proto::CompileRequest { bundle: wire_bundle(), options: Some(options_to_wire(&options(None))) };
        let compiled = client.compile(compile).await.expect("compiles").into_inner();
        let model = compiled.model.expect("a description").id;
        let open = proto::OpenRequest { model, ..Default::default() };
        let session = client.open(open).await.expect("opens").into_inner().session;
        // the last run of the session repeats no warning
        for (warn, expected) in [(false, &[][..]), (true, &expected[..]), (true, &[])] {
            let session = session.clone();
            let request = proto::RunRequest {
                lanes: vec![proto::RunLane { session, start: pack(&[0.0]), ..Default::default() }],
                times: pack(&[1e-7, 2e-7]),
                values: pack(&[0.0]),
                warn,
                ..Default::default()
            };
            let mut stream = client.run(request).await.expect("runs").into_inner();
            let mut ends = Vec::new();
            while let Some(event) = stream.message().await.expect("goes on") {
                ends.extend(event.ends);
            }
            assert_eq!(ends.len(), 1);
            assert_eq!(ends[0].warnings, expected);
        }
    });
}

/// A server does not compile a model with a range of no port, with the error of a session in process.
#[test]
fn a_range_of_no_port_is_refused_as_in_process() {
    let server = start_with("127.0.0.1:0", Limits::default(), LOCAL);
    let options = options(Some("gate:0:1"));
    let there = RemoteDevice::connect(&server.address.uri(), &bundle(), &options, DEADLINE).err();
    let here = local(&options).open(&OpenRequest::default()).expect_err("no port");
    assert!(matches!(&here, DeviceError::BadRequest { what: "ranges", .. }), "{here:?}");
    assert!(matches!(&there, Some(DeviceError::Remote { reason, .. }) if *reason == here.to_string()), "{there:?}");
}

/// The channel of a program that has the service in process has them with its replies, too.
#[test]
fn the_service_in_process_has_warnings() {
    let inside = InProcessServer::new().expect("a thread");
    let compile = proto::CompileRequest { bundle: wire_bundle(), options: Some(options_to_wire(&options(None))) };
    let compiled = inside.call("Compile", &compile.encode_to_vec(), &|| true).expect("compiles");
    let compiled = proto::CompileResponse::decode(&*compiled).expect("a message");
    let mut channel = inside.questions();
    let mut ask = |kind: Ask| {
        let request = proto::DeviceRequest { kind: Some(kind) }.encode_to_vec();
        let reply = channel.ask(&request).expect("a request");
        reply.map(|bytes| proto::DeviceReply::decode(&*bytes).expect("a reply"))
    };
    let model = compiled.model.expect("a description").id;
    ask(Ask::Open(proto::OpenRequest { model, ..Default::default() })).expect("opens");
    let first = ask(trial(0, 0.0, 1.0)).expect("a reply");
    let Some(ReplyKind::Trial(rest)) = first.kind else { panic!("{first:?}") };
    assert_eq!(first.warnings, []);
    let accept = |answer| Ask::Accept(proto::Accept { token: rest.token, answer, warn: true });
    assert_eq!(ask(accept(false)), None);
    let again = ask(trial(rest.token, 1e-7, 1.0)).expect("a reply");
    assert!(again.warnings.iter().any(|warning| warning.code == "W053"), "{again:?}");
    // the state was evaluated
    assert_eq!(ask(accept(true)).expect("a reply").warnings, []);
}
