//! The service without a network gives what a server gives: the same bytes, the same refusals.

use super::attached::{Attached, trial};
use super::session_faults::LOCAL;
use super::test_server::{block_on, start_with, wire_bundle};
use bimorph::service::in_process::{DeviceChannel, InProcessServer};
use bimorph::service::limits::Limits;
use bimorph::service::proto;
use prost::Message;
use proto::device_reply::Kind as ReplyKind;
use proto::device_request::Kind as Ask;
use std::cell::Cell;
use tonic::Code;

fn call<T: Message + Default>(
    inside: &InProcessServer,
    name: &str,
    request: &impl Message,
) -> Result<T, tonic::Status> {
    inside.call(name, &request.encode_to_vec(), &|| true).map(|bytes| T::decode(&*bytes).expect("a message"))
}

fn ask(questions: &mut DeviceChannel, kind: Ask) -> Option<ReplyKind> {
    let request = proto::DeviceRequest { kind: Some(kind) }.encode_to_vec();
    let reply = questions.ask(&request).expect("a question")?;
    proto::DeviceReply::decode(&*reply).expect("a reply").kind
}

fn compiled(inside: &InProcessServer) -> String {
    let request = proto::CompileRequest { bundle: wire_bundle(), options: None };
    call::<proto::CompileResponse>(inside, "Compile", &request).expect("compiles").model.expect("a model").id
}

/// Models have the same ids, analyses the same numbers, sessions the same replies, and what is refused the same words.
#[test]
fn it_says_what_a_server_says() {
    let inside = InProcessServer::new().expect("a thread");
    let server = start_with("127.0.0.1:0", Limits::default(), LOCAL);
    let model = compiled(&inside);
    let voltages = vec![proto::Named { name: "drive".into(), value: 3.0 }];
    let statics = proto::StaticRequest { model: model.clone(), voltages, ..Default::default() };
    let pull_in = proto::PullInRequest { model: model.clone(), port: "drive".into(), max_v: 1.0 };
    let open = proto::OpenRequest { model: model.clone(), ..Default::default() };
    let (there, refused, device, replies) = block_on(async {
        let mut client = server.client().await;
        assert_eq!(super::test_server::compiled(&mut client).await, model);
        let there = client.r#static(statics.clone()).await.expect("an equilibrium").into_inner();
        let refused = client.pull_in(pull_in.clone()).await.expect_err("nothing pulls in");
        let session = client.open(open.clone()).await.expect("opens").into_inner().session;
        let (mut stream, opened) = Attached::join(&mut client, &session).await.expect("attaches");
        let (mut replies, mut parent) = (Vec::new(), 0);
        for step in 0..20 {
            let reply = stream.trial(parent, dt(step), f64::from(step)).await;
            parent = reply.token;
            replies.push(reply);
            stream.say(Ask::Accept(proto::Accept { token: parent, answer: false, warn: false })).await;
        }
        // a thread that may not block receives an error
        let waits = inside.call("Static", &statics.encode_to_vec(), &|| true).expect_err("asynchronous code");
        assert_eq!(waits.code(), Code::FailedPrecondition);
        (there, refused, opened.device, replies)
    });
    assert_eq!(call::<proto::StaticResponse>(&inside, "Static", &statics).expect("an equilibrium"), there);
    let here = call::<proto::PullInResponse>(&inside, "PullIn", &pull_in).expect_err("nothing pulls in");
    assert_eq!((here.code(), here.message(), here.details()), (refused.code(), refused.message(), refused.details()));

    let mut questions = inside.questions();
    let Some(ReplyKind::Opened(opened)) = ask(&mut questions, Ask::Open(open)) else { panic!("opens") };
    assert_eq!(opened.device, device);
    let mut parent = 0;
    for (step, expected) in (0..).zip(replies) {
        let token = expected.token;
        let reply = ask(&mut questions, trial(parent, dt(step), f64::from(step)));
        assert_eq!(reply, Some(ReplyKind::Trial(expected)));
        assert_eq!(ask(&mut questions, Ask::Accept(proto::Accept { token, answer: false, warn: false })), None);
        parent = token;
    }
}

/// Length of a step (s); the first is static.
fn dt(step: u32) -> f64 {
    if step == 0 { 0.0 } else { 1e-6 }
}

/// Cancelled calls stop; invalid names and bytes are rejected; a session ends with its channel.
#[test]
fn it_stops_and_refuses() {
    let inside = InProcessServer::new().expect("a thread");
    let model = compiled(&inside);
    let voltages = vec![proto::Named { name: "drive".into(), value: 3.0 }];
    let transient =
        proto::TransientRequest { model: model.clone(), stop_s: 1000.0, tol: 1e-9, voltages, ..Default::default() };
    let mut answers = inside.stream("Transient", &transient.encode_to_vec()).expect("begins");
    let asked = Cell::new(0);
    let stopped = loop {
        let wanted = || {
            asked.set(asked.get() + 1);
            asked.get() < 3
        };
        match answers.next(&wanted) {
            Ok(Some(_)) => {}
            other => break other,
        }
    };
    assert_eq!(stopped.expect_err("is stopped").code(), Code::Cancelled);
    drop(answers);
    assert_eq!(call::<proto::InfoResponse>(&inside, "NoSuch", &()).expect_err("no call").code(), Code::Unimplemented);
    assert_eq!(inside.stream("Info", &[]).err().expect("one answer").code(), Code::Unimplemented);
    let bytes = inside.call("Static", b"\xff", &|| true).expect_err("no message");
    assert_eq!(bytes.code(), Code::InvalidArgument);

    let mut questions = inside.questions();
    let Some(ReplyKind::Opened(opened)) =
        ask(&mut questions, Ask::Open(proto::OpenRequest { model, ..Default::default() }))
    else {
        panic!("opens")
    };
    let alive = |inside: &InProcessServer| {
        let request = proto::KeepAliveRequest { session: opened.session.clone(), lease_s: 0.0 };
        call::<proto::KeepAliveResponse>(inside, "KeepAlive", &request).map_err(|status| status.code())
    };
    assert!(alive(&inside).is_ok());
    drop(questions);
    assert_eq!(alive(&inside).expect_err("is over"), Code::NotFound);
}
