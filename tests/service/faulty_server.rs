//! A server that lies: whatever it answers to a device in a circuit, the answer is one error that names the server and what is wrong,
//! and the next open begins anew. The lies are those of a device behind a server that passes them on.

use super::test_server::{Running, start_with};
use bimorph::compile::CompiledModel;
use bimorph::device::{
    Description, Device, DeviceError, Mode, OpenRequest, PortInfo, PortKind, SignalInfo, SmallSignal, Status, Token,
    Trial, TrialReply,
};
use bimorph::service::limits::Limits;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Two ports and the requested number of signals; the name of the first signal selects the fault.
struct Liar {
    lie: String,
    ports: usize,
    signals: usize,
}

fn liar(_: Arc<CompiledModel>) -> Box<dyn Device> {
    Box::new(Liar { lie: String::new(), ports: 2, signals: 0 })
}

/// The reply of a truthful server.
fn truth(reply: &mut TrialReply, (p, s): (usize, usize), token: u64) {
    *reply = TrialReply {
        token: Some(Token(token)),
        status: Status::Ok,
        currents: vec![0.0; p],
        charges: vec![0.0; p],
        di_dv: vec![1e-3; p * p],
        dq_dv: vec![0.0; p * p],
        outputs: vec![0.0; s],
        doutputs_dv: vec![0.0; p * s],
        dt_next: f64::INFINITY,
        jumped: false,
    };
}

impl Device for Liar {
    fn open(&mut self, request: &OpenRequest) -> Result<Description, DeviceError> {
        self.lie = request.signals.first().cloned().unwrap_or_default();
        self.signals = request.signals.len();
        let port = |name: &str| PortInfo { name: name.to_owned(), kind: PortKind::Electrical };
        let mut signals: Vec<_> =
            request.signals.iter().map(|name| SignalInfo { name: name.clone(), unit: "m".into() }).collect();
        match self.lie.as_str() {
            "other signals" => signals.clear(),
            "controls" => {
                return Err(DeviceError::UnknownSignal { name: "a".into(), hint: "\u{1b}[2J\u{1b}]0;x\u{7}".into() });
            }
            _ => {}
        }
        let ports = if self.lie == "ports" { vec![port("a\u{1b}[2J"), port("b")] } else { vec![port("p"), port("q")] };
        Ok(Description { ports, signals, unknowns: 3 })
    }

    fn trial(&mut self, request: &Trial<'_>, reply: &mut TrialReply) -> Result<(), DeviceError> {
        truth(reply, (self.ports, self.signals), 1 + request.voltages[0].to_bits() % 1000);
        let need =
            |reply: &mut TrialReply, dt| *reply = TrialReply { status: Status::NeedDt(dt), ..TrialReply::default() };
        match self.lie.as_str() {
            "nan" => reply.currents[1] = f64::NAN,
            "infinite" => reply.charges[0] = f64::INFINITY,
            "many" => reply.currents.extend([0.0; 5]),
            "none" => reply.di_dv.clear(),
            "short" => reply.doutputs_dv.truncate(1),
            "need nan" => need(reply, f64::NAN),
            "need 0" => need(reply, 0.0),
            "need more" => need(reply, 2.0 * request.dt),
            "need on and on" => need(reply, 0.999_999 * request.dt),
            "next 0" => reply.dt_next = 0.0,
            "next below 0" => reply.dt_next = -1.0,
            "next tiny" => reply.dt_next = 1e-300,
            "no token" => reply.token = None,
            "old" => reply.token = Some(Token(7)),
            "fails" => {
                *reply = TrialReply { status: Status::Fail("\u{1b}[2Jwhy\nmore".into()), ..TrialReply::default() };
            }
            "never" => std::thread::sleep(Duration::from_secs(4)),
            _ => {}
        }
        Ok(())
    }

    fn accept(&mut self, _: Token) {}

    fn linearize(&mut self, _: Token, _: f64, reply: &mut SmallSignal) -> Result<(), DeviceError> {
        reply.admittance = vec![[f64::NAN, 0.0]; 4];
        reply.outputs = Vec::new();
        Ok(())
    }
}

/// The first error among a thousand steps, of a device with this fault.
fn caught(server: &Running, lie: &str) -> String {
    let mut device = server.device();
    let request = OpenRequest { signals: vec![lie.to_owned()], ..OpenRequest::default() };
    if let Err(error) = device.open(&request) {
        return error.to_string();
    }
    let mut reply = TrialReply::default();
    for k in 0..1000_u32 {
        let volts = [f64::from(k), 0.0];
        let trial = Trial { mode: Mode::Transient, parent: None, t: 1e-6, dt: 1e-6, voltages: &volts };
        if let Err(error) = device.trial(&trial, &mut reply) {
            let again = device.trial(&trial, &mut reply).expect_err("the connection is lost");
            assert!(again.to_string().contains("must be opened again"), "{again}");
            return error.to_string();
        }
        if let Status::Fail(reason) = &reply.status {
            return reason.clone();
        }
    }
    String::new()
}

/// Each lie, and what is said of it.
#[test]
fn lies_are_named() {
    let server = start_with("127.0.0.1:0", Limits::default(), liar);
    for (lie, reported) in [
        ("truth", ""),
        ("nan", "currents[1]: expected a finite number, got NaN"),
        ("infinite", "charges[0]: expected a finite number, got inf"),
        ("many", "currents: expected 2 numbers, got 7"),
        ("none", "di_dv: expected 4 numbers, got 0"),
        ("short", "doutputs_dv: expected 2 numbers, got 1"),
        ("need nan", "need_dt: expected less than the step"),
        ("need 0", "need_dt: expected less than the step"),
        ("need more", "need_dt: expected less than the step"),
        ("need on and on", "need_dt: 500 trials in a row required a shorter step"),
        ("next 0", "dt_next: expected a time above"),
        ("next below 0", "dt_next: expected a time above"),
        ("next tiny", "dt_next: expected a time above"),
        ("no token", "token: expected one, got 0"),
        ("old", "it names the state of an earlier trial"),
        ("fails", "\\u{1b}[2Jwhy\nmore"),
        ("other signals", "signals: expected the 1 requested, got 0 others"),
        ("controls", "no signal named \"a\"; \\u{1b}[2J"),
        ("ports", "port: expected a name, got \"a\\u{1b}[2J\""),
    ] {
        let error = caught(&server, lie);
        assert!(error.contains(reported) && (reported.is_empty() == error.is_empty()), "{lie}: {error}");
        let is_plain = reported.is_empty() || matches!(lie, "fails" | "controls");
        assert!(is_plain || error.contains(&server.address.to_string().replace("http://", "")), "{lie}: {error}");
        assert!(!error.contains('\u{1b}'), "{lie}: {error:?}");
    }
    let mut device = server.device();
    device.open(&OpenRequest::default()).expect("opens");
    let error = device.linearize(Token(1), 1.0, &mut SmallSignal::default()).expect_err("not a number");
    assert!(error.to_string().contains("admittance_re[0]: expected a finite number"), "{error}");
}

/// A call of a device ends within its deadline, whatever has to be done for it.
#[test]
fn no_call_outlives_its_deadline() {
    let server = start_with("127.0.0.1:0", Limits::default(), liar);
    let deadline = Duration::from_millis(500);
    let mut device = bimorph::service::client::RemoteDevice::connect(
        &server.address.uri(),
        &super::test_server::bundle(),
        &bimorph::compile::CompileOptions::default(),
        deadline,
    )
    .expect("connects");
    device.open(&OpenRequest { signals: vec!["never".into()], ..OpenRequest::default() }).expect("opens");
    let start = Instant::now();
    let trial = Trial { mode: Mode::Static, parent: None, t: 0.0, dt: 0.0, voltages: &[0.0, 0.0] };
    let error = device.trial(&trial, &mut TrialReply::default()).expect_err("late");
    assert!(error.to_string().contains("no answer within 0.5 s"), "{error}");
    assert!(start.elapsed() < Duration::from_secs(3), "{:?}", start.elapsed());
}
