//! Models for other simulators: a server sends the text of the library, and rejects invalid requests by field.

use super::session_faults::LOCAL;
use super::test_server::{DEADLINE, PLATE, block_on, start_with};
use bimorph::analysis::mesh::in_circuit;
use bimorph::compile::{CompileOptions, compile};
use bimorph::export::ExportRequest;
use bimorph::export::file::{FileContent, FileLanguage, FileRequest};
use bimorph::netlist::Bundle;
use bimorph::service::client::Client;
use bimorph::service::limits::Limits;
use bimorph::service::proto;
use std::sync::Arc;
use tonic::{Code, Status};
use tonic_types::StatusExt;

/// A heated chevron over an electrode: ports of every kind, and a lag of heat.
const CHEVRON: &str =
    "process p1 = [Youngsmodulus=165e9 density=2300 viscosity=1.78e-5 fluid=2u h=2u permittivity=8.854e-12
  sheetresistance=20 thermcond=30 thermalexpansion=2.33e-6 ambienttemperature=293]
anchor p1 [a] [l=10u w=10u oz=pi]
left  beam2det p1 [a c] [l=120u w=2u oz=0.1 tau=20u]
right beam2det p1 [c b] [l=120u w=2u oz=-0.1]
anchor p1 [b] [l=10u w=10u]
plategap2d * [c k] [A=1e-8 gap=3u oz=pi/2]
anchor p1 [k] [l=5u w=5u]
eground * [b] []
heat port * [a] []
sense port * [k] []
";

fn bundle(text: &str) -> Bundle {
    Bundle::from_text("parts/Part one.net", text)
}

/// Both languages, linear about an operating point and nonlinear: the text and its summary.
#[test]
fn exports_have_the_same_bytes() {
    let server = start_with("127.0.0.1:0", Limits::default(), LOCAL);
    let mut client = Client::connect(&server.address.uri(), DEADLINE).expect("connects");
    let model = ExportRequest {
        ports: vec![("heat".into(), None), ("sense".into(), None), ("c.y".into(), Some(2e6))],
        signals: vec![("c.y".into(), 1e6), ("left.T".into(), 1.0)],
        bias: vec![("heat".into(), 1.0), ("sense".into(), 3.0)],
        ..ExportRequest::default()
    };
    let linear = FileRequest { model, ..FileRequest::default() };
    let whole = FileRequest { nonlinear: true, name: Some("plate_cell".into()), ..FileRequest::default() };
    let bias = vec![("drive".into(), 3.0)];
    let biased = FileRequest { model: ExportRequest { bias, ..ExportRequest::default() }, ..FileRequest::default() };
    for (text, request) in [(CHEVRON, linear), (PLATE, whole), (PLATE, biased)] {
        let drawn = compile(&bundle(text), &CompileOptions::default()).unwrap_or_else(|error| panic!("{error}"));
        let compiled = Arc::new(in_circuit(&drawn));
        let id = client.compile(&bundle(text), &CompileOptions::default()).expect("compiles");
        for language in [FileLanguage::Spice, FileLanguage::VerilogA] {
            let request = FileRequest { language, ..request.clone() };
            let here = request.write(&compiled, "Part one.net").expect("a file");
            let there = client.export(&id, &request).expect("a file");
            assert_eq!((&there.file, there.estimated_error), (&here, compiled.order.estimated_error));
            assert_eq!(there.file.name, if request.nonlinear { "plate_cell" } else { "part_one" });
            assert!(there.file.text.contains(&there.file.name) && there.file.text.contains("Part one.net, "));
            match there.file.content {
                FileContent::Linear(linear) => assert!(!linear.frequencies_hz.is_empty() && linear.error <= 1e-4),
                FileContent::Nonlinear { directions, gaps } => assert_eq!((directions, gaps), (1, 1)),
                FileContent::Reduced(_) => panic!("the parts are rigid"),
            }
        }
    }
}

/// Field of a rejected request.
fn field(status: &Status) -> String {
    assert_eq!(status.code(), Code::InvalidArgument, "{status:?}");
    status.get_error_details().bad_request().expect("a BadRequest").field_violations[0].field.clone()
}

/// Invalid numbers, names and counts are rejected by field; a model that cannot be written is no fault of a field.
#[test]
fn bad_exports_are_named() {
    let limits = Limits { signals: 50, modes: 100, mode_work: 200_000, ..Limits::default() };
    let server = start_with("127.0.0.1:0", limits, LOCAL);
    block_on(async {
        let mut client = server.client().await;
        let bundle = Some(bimorph::service::convert::model::bundle_to_wire(&bundle(CHEVRON)));
        let reply = client.compile(proto::CompileRequest { bundle, options: None }).await.expect("compiles");
        let model = reply.into_inner().model.expect("a description").id;
        let named = |name: &str, value| vec![proto::Named { name: name.into(), value }];
        let scaled = |name: &str, scale| vec![proto::Scaled { name: name.into(), scale }];
        let biased = [named("heat", 1.0), named("sense", 3.0)].concat();
        let good = proto::ExportRequest { model, voltages: biased, to_hz: 1e6, ..Default::default() };
        client.export(good.clone()).await.expect("a file");
        for (bad, expected) in [
            (proto::ExportRequest { language: 2, ..good.clone() }, "language"),
            (proto::ExportRequest { to_hz: f64::NAN, ..good.clone() }, "to_hz"),
            (proto::ExportRequest { to_hz: 1e300, ..good.clone() }, "to_hz"),
            (proto::ExportRequest { to_hz: -1.0, ..good.clone() }, "to_hz"),
            (proto::ExportRequest { within: f64::NAN, ..good.clone() }, "within"),
            (proto::ExportRequest { within: 1.0, ..good.clone() }, "within"),
            (proto::ExportRequest { count: 1001, ..good.clone() }, "count"),
            (proto::ExportRequest { name: "2a".into(), ..good.clone() }, "name"),
            (proto::ExportRequest { ports: scaled("heat", Some(f64::NAN)), ..good.clone() }, "ports[0].scale"),
            (proto::ExportRequest { signals: scaled("c.y", Some(0.0)), ..good.clone() }, "signals[0].scale"),
            (proto::ExportRequest { ports: scaled("nosuch", None), ..good.clone() }, "ports"),
            (proto::ExportRequest { ports: scaled("frame.wz", None), ..good.clone() }, "ports"),
            (proto::ExportRequest { signals: scaled("nosuch.x", None), ..good.clone() }, "signal \"nosuch.x\""),
            (proto::ExportRequest { voltages: named("heat", f64::INFINITY), ..good.clone() }, "voltages[0]"),
            (proto::ExportRequest { voltages: named("nosuch", 1.0), ..good.clone() }, "port \"nosuch\""),
            (proto::ExportRequest { nonlinear: true, ..good.clone() }, "voltages"),
            (proto::ExportRequest { nonlinear: true, voltages: vec![], ..good.clone() }, "to_hz"),
        ] {
            let status = client.export(bad).await.expect_err(expected);
            assert_eq!(field(&status), expected, "{status:?}");
        }
        let many: Vec<_> = (0..51).flat_map(|_| scaled("c.y", None)).collect();
        for (large, limit) in [
            (proto::ExportRequest { signals: many.clone(), ..good.clone() }, "signals"),
            (proto::ExportRequest { ports: many, ..good.clone() }, "ports"),
            (proto::ExportRequest { count: 101, ..good.clone() }, "modes"),
            (proto::ExportRequest { count: 100, ..good.clone() }, "mode_work"),
        ] {
            let status = client.export(large).await.expect_err(limit);
            assert!(status.code() == Code::ResourceExhausted && status.message().starts_with(limit), "{status:?}");
        }
        let heats = client.export(proto::ExportRequest { nonlinear: true, voltages: vec![], to_hz: 0.0, ..good }).await;
        let heats = heats.expect_err("heats");
        assert!(heats.code() == Code::FailedPrecondition && heats.message().contains("heats"), "{heats:?}");
    });
}
