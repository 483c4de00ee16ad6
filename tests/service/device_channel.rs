//! Requests as bytes, for programs in other languages: the replies of a stream, each to its own request.

use super::attached::trial;
use super::echo::echo;
use super::test_server::{DEADLINE, block_on, compiled, start_with};
use bimorph::compile::CompiledModel;
use bimorph::device::{Description, Device, DeviceError, OpenRequest, SmallSignal, Token, Trial, TrialReply};
use bimorph::service::client::{TrialChannel, TrialConnections};
use bimorph::service::limits::Limits;
use bimorph::service::proto;
use prost::Message;
use proto::device_reply::Kind as ReplyKind;
use proto::device_request::Kind as Ask;
use std::sync::Arc;
use std::time::Duration;
use tonic::{Code, Status};

/// The voltage that is answered late (V).
const SLOW: f64 = 7.0;

/// A device that takes its time over one voltage.
struct Slow(Box<dyn Device>);

impl Device for Slow {
    fn open(&mut self, request: &OpenRequest) -> Result<Description, DeviceError> {
        self.0.open(request)
    }

    fn trial(&mut self, request: &Trial<'_>, reply: &mut TrialReply) -> Result<(), DeviceError> {
        if request.voltages == [SLOW] {
            std::thread::sleep(Duration::from_millis(300));
        }
        self.0.trial(request, reply)
    }

    fn accept(&mut self, token: Token) {
        self.0.accept(token);
    }

    fn linearize(&mut self, token: Token, omega: f64, reply: &mut SmallSignal) -> Result<(), DeviceError> {
        self.0.linearize(token, omega, reply)
    }
}

fn slow(compiled: Arc<CompiledModel>) -> Box<dyn Device> {
    Box::new(Slow(echo(compiled)))
}

fn ask(line: &mut TrialChannel, kind: Ask, patience: Duration) -> Result<Option<ReplyKind>, Status> {
    let request = proto::DeviceRequest { kind: Some(kind) }.encode_to_vec();
    let reply = line.ask(&request, patience, &|| true)?;
    Ok(reply.and_then(|reply| proto::DeviceReply::decode(&*reply).expect("a reply").kind))
}

/// An abandoned request does not leave its reply to the next one; an accept has none.
#[test]
fn each_question_has_its_own_reply() {
    let server = start_with("127.0.0.1:0", Limits::default(), slow);
    let model = block_on(async { compiled(&mut server.client().await).await });
    let lines = TrialConnections::new().expect("a thread");
    let mut line = lines.open((&server.address.to_string(), 0), None, DEADLINE, &|| true).expect("a stream");
    let open = Ask::Open(proto::OpenRequest { model, ports: vec!["p".into()], ..Default::default() });
    let opened = ask(&mut line, open, DEADLINE).expect("a reply");
    assert!(matches!(opened, Some(ReplyKind::Opened(_))), "{opened:?}");
    let late = ask(&mut line, trial(0, 0.0, SLOW), Duration::from_millis(60)).expect_err("too late");
    assert_eq!(late.code(), Code::DeadlineExceeded);
    assert!(late.message().starts_with("no answer within 0.06 s"), "{late}");
    for volts in [1.0, 2.0] {
        let Ok(Some(ReplyKind::Trial(reply))) = ask(&mut line, trial(0, 0.0, volts), DEADLINE) else {
            panic!("a reply")
        };
        // the echo: i = v · 1 mS
        assert_eq!(reply.currents, [volts * 1e-3]);
        let accept = proto::Accept { token: reply.token, answer: false, warn: false };
        assert_eq!(ask(&mut line, Ask::Accept(accept), DEADLINE).expect("is sent"), None);
    }
}

/// Without a server, and after it has gone, a request ends as UNAVAILABLE, and a new server at the address is found.
#[test]
fn a_server_that_goes() {
    let lines = TrialConnections::new().expect("a thread");
    let folder = tempfile::tempdir().expect("a folder");
    let address = format!("unix://{}/s", folder.path().display());
    let open = || lines.open((&address, 0), None, DEADLINE, &|| true);
    assert_eq!(open().err().map(|status| status.code()), Some(Code::Unavailable));
    for _ in 0..2 {
        let mut server = start_with(&address, Limits { drain: Duration::from_millis(10), ..Limits::default() }, slow);
        let mut line = open().expect("a stream");
        let refused = ask(&mut line, trial(0, 0.0, 1.0), DEADLINE).expect("a reply");
        assert!(matches!(refused, Some(ReplyKind::Fault(_))), "{refused:?}");
        server.stop().expect("stops");
        let gone = loop {
            match ask(&mut line, trial(0, 0.0, 1.0), DEADLINE) {
                Ok(_) => {}
                Err(gone) => break gone,
            }
        };
        assert_eq!(gone.code(), Code::Unavailable, "{gone}");
    }
}
