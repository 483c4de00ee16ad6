//! One request, or one careless client, neither ends nor freezes the server: each attack runs against `bimorph serve`
//! in a process of its own while another client calls `Info` all the time. After it the server is alive, has never held
//! a gigabyte, answers the attack with the right code, is idle, and stops on request.
#![cfg(target_os = "linux")]

use super::serve_process::{Reader, Victim, Wire, netlist};
use bimorph::service::proto;
use proto::device_request::Kind as Ask;
use std::fmt::Write as _;
use std::time::Duration;
use tokio_stream::StreamExt;
use tonic::Code;

/// A chain of 40 beams with so many segments in all; 20 000 of them are 60 000 unknowns, and minutes of modes.
fn chain(segments: usize) -> (String, proto::CompileOptions) {
    let mut text =
        "process p = [Youngsmodulus=165e9 density=2300 h=2u]\nparam F=0\nanchor p [n0] [l=1u w=1u]\n".to_owned();
    for k in 0..40 {
        let _ = writeln!(text, "beam2d p [n{k} n{}] [l=100u w=2u oz={}]", k + 1, f64::from(k % 2) * 0.3);
    }
    text += "f2d * [n40] [F=F oz=pi/2]\neground * [n0] []\ndrive port * [n40 n0] []\n";
    (text, proto::CompileOptions { segments: Some(segments as u32 / 40), ..Default::default() })
}

async fn check(wire: &mut Wire, text: &str) -> Code {
    let answer = wire.check(proto::CheckRequest { bundle: netlist(text), options: None }).await;
    answer.map_or_else(|status| status.code(), |_| Code::Ok)
}

async fn compiled(wire: &mut Wire, (text, options): (String, proto::CompileOptions)) -> String {
    let request = proto::CompileRequest { bundle: netlist(&text), options: Some(options) };
    wire.compile(request).await.expect("compiles").into_inner().model.expect("a description").id
}

fn named(count: usize) -> Vec<proto::Named> {
    (0..count).map(|k| proto::Named { name: format!("p{k}"), value: 1.0 }).collect()
}

/// 600 axes of four thousand million values each: refused before one of them is laid out.
#[test]
fn axes() {
    Victim::attacked("600 axes of 4e9 values", async |wire| {
        let linear = proto::Linear { low: 0.0, high: 1.0, count: 4_000_000_000 };
        let axis = |k| proto::SweepParameter {
            name: format!("V{k}"),
            values: Some(proto::sweep_parameter::Values::Linear(linear)),
        };
        let spec = proto::SweepSpec { parameters: (0..600).map(axis).collect(), ..Default::default() };
        let request =
            proto::SubmitSweepRequest { bundle: netlist("x"), options: None, spec: Some(spec), ..Default::default() };
        let status = wire.submit_sweep(request).await.expect_err("too many");
        assert!(status.message().starts_with("sweep_points"), "{}", status.message());
        assert_eq!(status.code(), Code::ResourceExhausted);
    });
}

/// An instance name of 100 000 characters, once in each of 200 000 nodes.
#[test]
fn long_names() {
    Victim::attacked("a name of 100 000 characters in 200 000 nodes", async |wire| {
        let name = "n".repeat(100_000);
        let text =
            format!("subnet s [a] [] [\nfor k=1:200000 [ anchor * [b(k)] [l=1u w=1u h=1u] ]\n]\n{name} s * [f] []\n");
        assert_eq!(check(wire, &text).await, Code::ResourceExhausted);
    });
}

/// A band of 1e12 Hz and a tolerance of 1e-300 would be two million segments; segments of 100 000 for each of 19 beams too.
#[test]
fn fine_models() {
    Victim::attacked("bands and segments", async |wire| {
        let (text, _) = chain(40);
        let asked = [
            proto::CompileOptions { band_hz: Some(1e12), tol: Some(1e-12), ..Default::default() },
            proto::CompileOptions { band_hz: Some(1e12), ..Default::default() },
            proto::CompileOptions { segments: Some(40_000), ..Default::default() },
            proto::CompileOptions { segments: Some(2_000), ..Default::default() },
        ];
        for options in asked {
            let request = proto::CompileRequest { bundle: netlist(&text), options: Some(options.clone()) };
            let status = wire.compile(request).await.expect_err("too fine");
            assert!(
                matches!(status.code(), Code::ResourceExhausted | Code::InvalidArgument),
                "{options:?}: {status:?}"
            );
        }
        let many = proto::CompileOptions { segments: Some(u32::MAX), ..Default::default() };
        let request = proto::CheckRequest { bundle: netlist(&text), options: Some(many) };
        assert_eq!(wire.check(request).await.expect_err("refused").code(), Code::InvalidArgument);
    });
}

/// Dense matrices of the electrical side: gaps with a voltage of their own, and a long chain of resistors.
#[test]
fn dense_matrices() {
    Victim::attacked("100 000 gaps with sources, 50 000 resistors", async |wire| {
        let plates = "anchor * [f] [l=1u w=1u h=1u]\nmass2d * [m] [m=1e-10]\nspring2d * [f m] [kx=1 ky=1 ko=1]\n";
        let gaps = format!("{plates}for k=1:100000 [ plategap2d * [m f] [A=1e-8 gap=2u V=1] ]\n");
        let resistors = format!("{plates}eground * [r(0)] []\nfor k=1:50000 [ R * [r(k-1) r(k)] [R=1] ]\n");
        for text in [gaps, resistors] {
            let code = check(wire, &text).await;
            assert!(matches!(code, Code::ResourceExhausted | Code::Ok), "{code:?}");
        }
    });
}

/// Numbers beyond any sense end in a status, whatever takes them.
#[test]
fn huge_numbers() {
    Victim::attacked("1e300 everywhere", async |wire| {
        for (a, b) in [("1e300", "1e300"), ("1e-300", "1e300"), ("1e300", "1e-300"), ("1e-300", "1e-300")] {
            let text = format!(
                "process p = [Youngsmodulus={a} density={b} h={a}]\nanchor p [n0] [l=1u w=1u]\n\
                 beam2d p [n0 n1] [l={b} w={a}]\nbeam2d p [n1 n2] [l={a} w={b}]\nmass2d * [n2] [m={a} I={b}]\n"
            );
            for band_hz in [None, Some(1e6)] {
                let options = Some(proto::CompileOptions { band_hz, ..Default::default() });
                let request = proto::CompileRequest { bundle: netlist(&text), options };
                match wire.compile(request).await {
                    Ok(model) => {
                        let model = model.into_inner().model.expect("a description").id;
                        let request = proto::StaticRequest { model: model.clone(), ..Default::default() };
                        let ended = wire.r#static(request).await.map_or_else(|s| s.code(), |_| Code::Ok);
                        assert!(!matches!(ended, Code::Internal | Code::Unknown), "{text} {ended:?}");
                        let request = proto::ModesRequest { model, count: 2, voltages: vec![], quality: false };
                        let ended = wire.modes(request).await.map_or_else(|s| s.code(), |_| Code::Ok);
                        assert!(!matches!(ended, Code::Internal | Code::Unknown), "{text} {ended:?}");
                    }
                    Err(status) => {
                        assert!(!matches!(status.code(), Code::Internal | Code::Unknown), "{text} {status:?}");
                    }
                }
            }
        }
    });
}

/// 400 000 voltages, axes, parameters and settings, all of different names: looked up, not compared pair by pair.
#[test]
fn many_names() {
    Victim::attacked("400 000 names", async |wire| {
        let model = compiled(wire, (chain(40).0, proto::CompileOptions::default())).await;
        let request = proto::StaticRequest { model, voltages: named(400_000), ..Default::default() };
        assert_eq!(wire.r#static(request).await.expect_err("no such port").code(), Code::InvalidArgument);
        let one = proto::SettingList { values: vec![proto::Setting { name: String::new(), value: number(1.0) }] };
        let axis = |k| proto::SweepParameter {
            name: format!("V{k}"),
            values: Some(proto::sweep_parameter::Values::List(one.clone())),
        };
        let mut parameters: Vec<_> = (0..400_000).map(axis).collect();
        parameters[399_999].name = "V7".into();
        let analysis = Some(proto::sweep_spec::Analysis::Modes(proto::SweepModes::default()));
        let spec = Some(proto::SweepSpec { parameters, samples: None, analysis, ..Default::default() });
        let request = proto::SubmitSweepRequest { bundle: netlist("x"), options: None, spec, ..Default::default() };
        assert_eq!(wire.submit_sweep(request).await.expect_err("V7 twice").code(), Code::InvalidArgument);
        let mut text = String::new();
        for k in 0..400_000 {
            let _ = writeln!(text, "param q{k}=1");
        }
        let set = (0..400_000).map(|k| proto::Setting { name: format!("z{k}"), value: number(1.0) }).collect();
        let options = Some(proto::CompileOptions { set, ..Default::default() });
        let answer = wire.check(proto::CheckRequest { bundle: netlist(&text), options }).await.expect("diagnostics");
        assert!(!answer.into_inner().ok);
    });
}

fn number(x: f64) -> Option<proto::setting::Value> {
    Some(proto::setting::Value::Number(x))
}

/// Abandoned static, mode, pull-in and transient analyses release their permits and their processor.
#[test]
fn abandoned_analyses() {
    Victim::attacked("abandoned analyses", async |wire| {
        let (text, options) = chain(20_000);
        // released from a load: a run at rest would end in a few steps
        let held = compiled(wire, (text.replace("param F=0", "param F=1n"), options.clone())).await;
        let model = compiled(wire, (text, options)).await;
        let large = proto::ModesRequest { model: model.clone(), count: 1000, voltages: vec![], quality: false };
        assert_eq!(wire.modes(large).await.expect_err("hours of memory").code(), Code::ResourceExhausted);
        let patience = Duration::from_millis(1500);
        for _ in 0..3 {
            let modes = proto::ModesRequest { model: model.clone(), count: 100, voltages: vec![], quality: false };
            let (mut a, mut b) = (wire.clone(), wire.clone());
            let (model, release_model) = (model.clone(), held.clone());
            let signals = vec!["n40.y".to_owned()];
            let transient =
                proto::TransientRequest { model, release_model, signals, stop_s: 1e3, ..Default::default() };
            let watched = async {
                let mut stream = a.transient(transient).await?.into_inner();
                while stream.message().await?.is_some() {}
                Ok::<_, tonic::Status>(())
            };
            let (modes, watched) =
                tokio::join!(tokio::time::timeout(patience, b.modes(modes)), tokio::time::timeout(patience, watched));
            assert!(modes.is_err() && watched.is_err(), "both take longer: {modes:?} {watched:?}");
        }
    });
}

/// A hundred frequencies of a large model by the unary call, while a stream of the same session waits: no other client
/// does.
#[test]
fn long_linearize() {
    Victim::attacked("a long Linearize", async |wire| {
        let model = compiled(wire, chain(20_000)).await;
        let opened = wire.open(proto::OpenRequest { model, ..Default::default() }).await.expect("opens").into_inner();
        let trial = proto::TrialRequest { mode: 1, voltages: vec![0.0], ..Default::default() };
        let attach = Ask::Attach(proto::Attach { session: opened.session.clone() });
        let (sender, requests) = tokio::sync::mpsc::channel(8);
        let ask = async |kind| sender.send(proto::DeviceRequest { kind: Some(kind) }).await.expect("queued");
        ask(attach).await;
        ask(Ask::Trial(trial.clone())).await;
        let requests = tokio_stream::wrappers::ReceiverStream::new(requests);
        let mut replies = wire.trial(requests).await.expect("a stream").into_inner();
        replies.message().await.expect("attached");
        let reply = replies.message().await.expect("a trial").expect("a reply");
        let Some(proto::device_reply::Kind::Trial(reply)) = reply.kind else { panic!("{reply:?}") };
        let omega = (0..5000).map(|k| 1e3 + f64::from(k)).collect();
        let request = proto::LinearizeRequest { session: opened.session, token: reply.token, omega, noise: false };
        let mut other = wire.clone();
        let long = tokio::time::timeout(Duration::from_secs(3), other.linearize(request));
        let waits = async {
            tokio::time::sleep(Duration::from_millis(200)).await;
            ask(Ask::Trial(trial)).await;
            replies.next().await
        };
        let (long, waited) = tokio::join!(long, waits);
        assert!(long.is_err(), "it takes longer");
        let waited = waited.expect("goes on").expect("after the one before is gone").kind;
        assert!(matches!(waited, Some(proto::device_reply::Kind::Trial(_))), "{waited:?}");
    });
}

/// A thousand result streams without a reader.
#[test]
fn unread_results() {
    Victim::attacked("1 000 unread result streams", async |wire| {
        let model = compiled(wire, (chain(40).0, proto::CompileOptions::default())).await;
        let request = proto::TransientRequest {
            model,
            stop_s: 1e-6,
            points: 100_000,
            signals: (0..40).map(|k| format!("n{k}.y")).collect(),
            ..Default::default()
        };
        let mut open = Vec::new();
        let mut refused = 0;
        for k in 0..1000 {
            // a connection has 128 streams, and each request waits for its own first window
            let mut own = if k % 100 == 0 { wire.again().await } else { wire.clone() };
            match tokio::time::timeout(Duration::from_secs(10), own.transient(request.clone())).await {
                Ok(Ok(stream)) => open.push((own, stream)),
                Ok(Err(status)) => {
                    assert_eq!(status.code(), Code::ResourceExhausted, "{status:?}");
                    refused += 1;
                }
                Err(_) => panic!("the {k}th hangs"),
            }
        }
        assert_eq!((open.len(), refused), (64, 936));
    });
}

/// 700 connections that say nothing, and as many that only greet, do not lock anyone out.
#[test]
fn silent_connections() {
    Victim::attacked("1 400 silent connections", async |wire| {
        let greeting: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\x04\0\0\0\0\0";
        let mut held = Vec::new();
        for words in [b"".as_slice(), greeting] {
            for _ in 0..700 {
                held.push(wire.raw(words).await);
            }
            let mut fresh = wire.again().await;
            fresh.info(proto::InfoRequest {}).await.expect("there is room");
        }
        drop(held);
    });
}

/// Messages that are announced and never sent, begun and never ended, and more of them than the server may hold.
#[test]
fn half_messages() {
    Victim::attacked("half-sent messages", async |wire| {
        let mut held = Vec::new();
        for _ in 0..40 {
            held.push(wire.half_sent(16 << 20, 15 << 20).await);
        }
        for _ in 0..100 {
            held.push(wire.half_sent(60 << 20, 100).await);
        }
        let mut fresh = wire.again().await;
        fresh.info(proto::InfoRequest {}).await.expect("there is room");
    });
}

/// A trial over an enormous step and thousands of trials at once on one connection: the event loop stays free.
#[test]
fn long_trials() {
    Victim::attacked("64 streams of long trials", async |wire| {
        let (text, _) = chain(40);
        let options = proto::CompileOptions { segments: Some(16), ..Default::default() };
        let model = compiled(wire, (text, options)).await;
        let mut streams = Vec::new();
        for _ in 0..64 {
            let open = Ask::Open(proto::OpenRequest { model: model.clone(), ..Default::default() });
            let trial = |k: i32| {
                Ask::Trial(proto::TrialRequest {
                    mode: 2,
                    dt: 1e-3 * f64::from(k),
                    voltages: vec![0.0],
                    ..Default::default()
                })
            };
            let asked = std::iter::once(open).chain((1..200).map(trial));
            let requests = asked.map(|kind| proto::DeviceRequest { kind: Some(kind) });
            streams.push(wire.clone().trial(tokio_stream::iter(requests)).await.expect("a stream"));
        }
        tokio::time::sleep(Duration::from_secs(2)).await;
    });
}

/// Ten thousand ports are a hundred million derivatives in each answer: refused as a session opens, alone and on a stream
/// that has one already.
#[test]
fn many_ports() {
    Victim::attacked("10 000 ports", async |wire| {
        let model = compiled(wire, chain(40)).await;
        let many =
            proto::OpenRequest { model: model.clone(), ports: vec!["n9.y".into(); 10_000], ..Default::default() };
        let status = wire.open(many.clone()).await.expect_err("too many");
        assert_eq!(status.code(), Code::ResourceExhausted);
        assert!(status.message().starts_with("message_bytes"), "{}", status.message());

        let few = proto::OpenRequest { model, ..Default::default() };
        let asked = [few, many].map(|open| proto::DeviceRequest { kind: Some(Ask::Open(open)) });
        let mut replies = wire.trial(tokio_stream::iter(asked)).await.expect("a stream").into_inner();
        let mut kinds = Vec::new();
        while let Some(reply) = replies.next().await {
            kinds.push(reply.expect("a reply").kind.expect("a kind"));
        }
        let [proto::device_reply::Kind::Opened(_), proto::device_reply::Kind::Fault(fault)] = &kinds[..] else {
            panic!("{kinds:?}")
        };
        assert!(fault.message.starts_with("message_bytes"), "{}", fault.message);
    });
}

/// Cross-spectra of thousands of signals, and millions of frequencies in one request: refused before any of it is computed.
#[test]
fn many_spectra() {
    Victim::attacked("noise of 5 000 signals, 4 000 000 frequencies", async |wire| {
        let model = compiled(wire, chain(40)).await;
        let open = proto::OpenRequest { model, signals: vec!["n9.y".into(); 5_000], ..Default::default() };
        let session = wire.open(open).await.expect("opens").into_inner().session;
        let still = Ask::Trial(proto::TrialRequest { mode: 1, voltages: vec![0.0], ..Default::default() });
        let attach = Ask::Attach(proto::Attach { session: session.clone() });
        let noise = |token: u64| Ask::Linearize(proto::SmallSignalRequest { token, omega: 1e5, noise: true });
        let asked = [attach, still, noise(1)].map(|kind| proto::DeviceRequest { kind: Some(kind) });
        let mut replies = wire.trial(tokio_stream::iter(asked)).await.expect("a stream").into_inner();
        let mut last = None;
        while let Some(reply) = replies.next().await {
            last = reply.expect("a reply").kind;
        }
        let Some(proto::device_reply::Kind::Fault(fault)) = last else { panic!("{last:?}") };
        assert!(fault.message.starts_with("message_bytes"), "{}", fault.message);

        let request = proto::LinearizeRequest { session, token: 1, omega: vec![1e5; 4_000_000], noise: false };
        let status = wire.linearize(request).await.expect_err("too many");
        assert_eq!(status.code(), Code::ResourceExhausted);
        assert!(status.message().starts_with("message_bytes"), "{}", status.message());
    });
}

/// A log without a reader, or whose reader is gone, stops nothing.
#[test]
fn unread_logs() {
    for (reader, name) in [(Reader::Stalls, "a log that nobody reads"), (Reader::Leaves, "a log whose reader is gone")]
    {
        Victim::attacked_before(reader, name, async |wire| {
            // some lines of tens of bytes for each: far beyond the 64 KiB of a pipe
            for _ in 0..3000 {
                wire.info(proto::InfoRequest {}).await.expect("an answer");
            }
        });
    }
}
