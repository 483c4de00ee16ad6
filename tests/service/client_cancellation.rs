//! A client that leaves takes its computation with it: every call, with an input near the limits, stops computing at once when its
//! connection is gone. Against the command itself.
#![cfg(target_os = "linux")]

use super::serve_process::{Victim, Wire, netlist};
use super::test_server::block_on;
use bimorph::service::proto;
use std::fmt::Write;
use std::pin::Pin;
use std::time::Duration;

/// How long a client stays.
const STAY: Duration = Duration::from_millis(400);
/// Processor time of the server after that, with two cores: a fraction of what it would compute (s).
const MAX_AFTER_S: f64 = 0.5;

/// A grid of beams with `side` by `side` meshes.
fn grid(side: usize) -> String {
    let mut text =
        "process p = [Youngsmodulus=165e9 density=2300 h=2u]\nparam F=0\nanchor p [n0_0] [l=10u w=10u oz=pi]\n"
            .to_owned();
    for (i, j) in (0..side).flat_map(|i| (0..side).map(move |j| (i, j))) {
        let _ = writeln!(text, "beam2d p [n{i}_{j} n{}_{j}] [l=20u w=2u]", i + 1);
        let _ = writeln!(text, "beam2d p [n{i}_{j} n{i}_{}] [l=20u w=2u oz=pi/2]", j + 1);
    }
    text + &format!("f2d * [n{side}_0] [F=F oz=pi/2]\neground * [n0_0] []\ndrive port * [n{side}_0 n0_0] []\n")
}

/// A GDSII file with one polygon of so many corners on a circle, each joined with the one across: a star that cuts itself everywhere.
fn star(corners: usize) -> Vec<u8> {
    let record = |kind: u8, data: u8, bytes: &[u8]| {
        let mut out = u16::try_from(4 + bytes.len()).expect("short").to_be_bytes().to_vec();
        out.extend([kind, data]);
        out.extend(bytes);
        out
    };
    // numbers of base 16 with an exponent of excess 64: 1e-3 and 1e-9
    let units = [0x3e, 0x41, 0x89, 0x37, 0x4b, 0xc6, 0xa7, 0xf0, 0x39, 0x44, 0xb8, 0x2f, 0xa0, 0x9b, 0x5a, 0x54];
    let mut out = record(0, 2, &600_u16.to_be_bytes());
    out.extend(record(1, 2, &[0; 24]));
    out.extend(record(2, 6, b"library\0"));
    out.extend(record(3, 5, &units));
    out.extend(record(5, 2, &[0; 24]));
    out.extend(record(6, 6, b"part"));
    out.extend(record(8, 0, &[]));
    out.extend(record(13, 2, &45_u16.to_be_bytes()));
    out.extend(record(14, 2, &[0; 2]));
    let corner = |k: usize| {
        let angle = std::f64::consts::TAU * (k * (corners / 2) % corners) as f64 / corners as f64;
        [angle.cos(), angle.sin()].map(|x| (1e6 * x) as i32)
    };
    let points: Vec<u8> = (0..=corners).flat_map(|k| corner(k % corners)).flat_map(i32::to_be_bytes).collect();
    out.extend(record(16, 3, &points));
    for kind in [17, 7, 4] {
        out.extend(record(kind, 0, &[]));
    }
    out
}

async fn compiled(wire: &mut Wire, text: &str) -> String {
    let options = Some(proto::CompileOptions { segments: Some(1), ..Default::default() });
    let answer = wire.compile(proto::CompileRequest { bundle: netlist(text), options }).await.expect("compiles");
    answer.into_inner().model.expect("a model").id
}

type Asking = Pin<Box<dyn Future<Output = ()>>>;

/// Calls with heavy inputs, each by a client of its own.
fn calls(wire: &Wire, [large, many]: &[String; 2]) -> Vec<(&'static str, Asking)> {
    macro_rules! call {
        ($name:literal, $call:ident, $request:expr) => {{
            let (mut wire, request) = (wire.clone(), $request);
            let asking: Asking = Box::pin(async move { drop(wire.$call(request).await) });
            ($name, asking)
        }};
    }
    let model = || large.clone();
    let fine = Some(proto::CompileOptions { band_hz: Some(1e7), tol: Some(1e-6), ..Default::default() });
    let signals = vec!["n3_3.y".to_owned()];
    let transient = proto::TransientRequest {
        model: many.clone(),
        stop_s: 1.0,
        points: 3_000_000,
        signals: signals.clone(),
        tol: 1e-12,
        ..Default::default()
    };
    let mut other = wire.clone();
    let motion: Asking = Box::pin(async move {
        if let Ok(stream) = other.transient(transient).await {
            let mut stream = stream.into_inner();
            while let Ok(Some(_)) = stream.message().await {}
        }
    });
    let response = proto::FrequencyResponseRequest {
        model: model(),
        drive: "n9_9.fy".into(),
        from_hz: 1.0,
        to_hz: 1e7,
        points: 200_000,
        even: true,
        signals,
        ..Default::default()
    };
    let layout = proto::ConvertRequest {
        name: "a.gds".into(),
        layout: star(4001),
        process: "polymumps".into(),
        ..Default::default()
    };
    vec![
        call!("Convert", convert, layout),
        call!("Check", check, proto::CheckRequest { bundle: netlist(&grid(250)), options: fine.clone() }),
        call!("Compile", compile, proto::CompileRequest { bundle: netlist(&grid(200)), options: fine }),
        call!(
            "Open",
            open,
            proto::OpenRequest { model: model(), signals: vec!["n3_3.y".into(); 9000], ..Default::default() }
        ),
        call!("Static", r#static, proto::StaticRequest { model: model(), ..Default::default() }),
        call!(
            "Path",
            path,
            proto::PathRequest { model: model(), along: "F".into(), to: 1e-3, points: 100_000, ..Default::default() }
        ),
        call!(
            "Export",
            export,
            proto::ExportRequest {
                model: model(),
                ports: (0..40).map(|k| proto::Scaled { name: format!("n{k}_9.y"), scale: None }).collect(),
                count: 300,
                ..Default::default()
            }
        ),
        call!("Modes", modes, proto::ModesRequest { model: model(), count: 300, voltages: vec![], quality: false }),
        call!("FrequencyResponse", frequency_response, response),
        ("Transient", motion),
    ]
}

/// Two of each call at once, whose clients leave after a moment.
#[test]
fn computations_end_with_their_clients() {
    let victim = Victim::started(&[]);
    block_on(async {
        let mut wire = victim.wire().await;
        let models = [compiled(&mut wire, &grid(60)).await, compiled(&mut wire, &grid(18)).await];
        let count = calls(&wire, &models).len();
        for k in 0..count {
            let (first, second) = (wire.again().await, wire.again().await);
            let (name, one) = calls(&first, &models).swap_remove(k);
            let (_, other) = calls(&second, &models).swap_remove(k);
            let _ = tokio::time::timeout(STAY, async { tokio::join!(one, other) }).await;
            drop((first, second));
            let before = victim.cpu_s();
            tokio::time::sleep(Duration::from_millis(700)).await;
            let after = victim.cpu_s() - before;
            println!("{name}: {after:.2} s of processor after the clients have left");
            assert!(after < MAX_AFTER_S, "{name}: {after} s");
        }
    });
}
