//! Paths, permanent strains and further snaps: a server has the numbers of the library, and rejects invalid requests by field.

use super::session_faults::LOCAL;
use super::test_server::{DEADLINE, PLATE, block_on, start_with};
use bimorph::analysis::continuation::ContinuationResult;
use bimorph::analysis::largest_motion::path_with_signals;
use bimorph::analysis::mesh::{self, pull_in_fitted, static_backbent};
use bimorph::analysis::path_parameter::{PathModels, PathOptions, PathParameter};
use bimorph::compile::{CompileError, CompileOptions, compile};
use bimorph::netlist::Bundle;
use bimorph::service::client::Client;
use bimorph::service::convert::path::PathReply;
use bimorph::service::limits::Limits;
use bimorph::service::proto;
use bimorph::solve::continuation::Branch;
use tonic::{Code, Status};
use tonic_types::StatusExt;

/// A clamped beam guided at its right end and pressed by a load, with a port at its middle: it buckles.
const COLUMN: &str = "param F=0
param side=1n
process p1 = [ Youngsmodulus=165e9 density=2300 h=2u ]
anchor p1 [a] [l=10u w=10u oz=pi]
beam2d p1 [a m] [l=100u w=2u]
beam2d p1 [m b] [l=100u w=2u]
guide2d * [b] []
f2d * [b] [F=F oz=pi]
f2d * [m] [F=side oz=pi/2]
";

/// A hot bar between two pads, whose left half has a strength of 100 MPa at 293 K and none at 1293 K.
const BAR: &str = "process p1 = [ Youngsmodulus=165e9 density=2300 h=2u thermalexpansion=2.33e-6 thermcond=41 sheetresistance=20 ambienttemperature=293 ]
anchor p1 [a] []
left beam2det p1 [a m] [l=25u w=4u yieldstress=100e6 softening=1293]
right beam2det p1 [m b] [l=25u w=4u]
anchor p1 [b] [oz=pi]
eground * [b] []
heat port * [a] []
";

/// Two plates in a row, of which the second closes after the first.
const ROW: &str = "anchor * [f] []
spring2d * [f q] [kx=1]
mass2d * [q] [m=1e-12]
guide2d * [q] []
spring2d * [q r] [kx=0.5]
mass2d * [r] [m=1e-12]
guide2d * [r] []
anchor * [d] []
anchor * [e] []
first plategap2d * [q d] [A=1e-8 gap=2u]
second plategap2d * [r e] [A=1.5e-8 gap=5u]
R * [q r] [R=1]
R * [d e] [R=1]
eground * [e] []
drive port * [q e] []
";

fn bundle(text: &str) -> Bundle {
    Bundle::from_text("part.net", text)
}

/// The path of the library.
fn path_here(text: &str, options: &PathOptions) -> PathReply {
    let netlist = bundle(text);
    let drawn = compile(&netlist, &CompileOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    let parameter = PathParameter::find(&drawn, &options.along).expect("a parameter");
    let models = PathModels::new(parameter, &drawn, options, || Ok::<_, CompileError>(netlist)).expect("compiles");
    let (first, input) = models.input(&drawn, &options.along);
    let (fitted, mut result) = path_with_signals(first, &options.request(input), &mut |_| true).expect("a path");
    result.warnings.extend(mesh::warnings(&fitted));
    let result = ContinuationResult { last_curves: Vec::new(), ..result };
    PathReply { result, unit: models.unit().to_owned(), estimated_error: fitted.order.estimated_error }
}

/// Paths along a port, a parameter of the netlist and the loads, on every branch, with given and with default signals.
#[test]
fn paths_have_the_same_bits() {
    let server = start_with("127.0.0.1:0", Limits::default(), LOCAL);
    let mut client = Client::connect(&server.address.uri(), DEADLINE).expect("connects");
    let along = |along: &str, to, points| PathOptions { along: along.into(), to, points, ..PathOptions::default() };
    let minus = PathOptions { branch: Branch::Minus, signals: vec!["m.y".into()], ..along("F", 2.6e-4, 2000) };
    for (text, options, unit) in [
        (PLATE, along("drive", 8.0, 2000), "V"),
        (COLUMN, along("F", 2.6e-4, 2000), "N"),
        (COLUMN, minus, "N"),
        (COLUMN, PathOptions { branch: Branch::Stay, ..along("F", 2.6e-4, 40) }, "N"),
        (COLUMN, along("loads", 2.0, 2000), ""),
    ] {
        let model = client.compile(&bundle(text), &CompileOptions::default()).expect("compiles");
        let (here, there) = (path_here(text, &options), client.path(&model, &options).expect("a path"));
        assert_eq!(there, here);
        assert_eq!(there.unit, unit);
        assert!(there.result.values.len() > 10, "{there:?}");
        assert_eq!(there.result.signals.len(), if options.signals.is_empty() { 2 } else { 1 });
    }
}

/// A plate pulls in at √(8kg³/27εA), where its path has a limit point and becomes unstable.
#[test]
fn a_limit_point_is_pull_in() {
    let server = start_with("127.0.0.1:0", Limits::default(), LOCAL);
    let mut client = Client::connect(&server.address.uri(), DEADLINE).expect("connects");
    let model = client.compile(&bundle(PLATE), &CompileOptions::default()).expect("compiles");
    let options = PathOptions { along: "drive".into(), to: 8.0, ..PathOptions::default() };
    let path = client.path(&model, &options).expect("a path").result;
    let pull_in = (8.0 * 2e-6f64.powi(3) / (27.0 * 8.854e-12 * 1e-8)).sqrt();
    let fold = path.folds[0];
    assert!((fold.value / pull_in - 1.0).abs() < 1e-3, "{} {pull_in}", fold.value);
    assert!(path.negative[..fold.point].iter().all(|n| *n == 0) && path.negative[fold.point + 1] == 1);
}

/// Permanent strains of hot arms, and the equilibria without and with a voltage after that.
#[test]
fn permanent_strains_have_the_same_bits() {
    let server = start_with("127.0.0.1:0", Limits::default(), LOCAL);
    let mut client = Client::connect(&server.address.uri(), DEADLINE).expect("connects");
    let model = client.compile(&bundle(BAR), &CompileOptions::default()).expect("compiles");
    let drawn = compile(&bundle(BAR), &CompileOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    let volts = |v: f64| vec![("heat".to_owned(), v)];
    for voltages in [vec![], volts(1.0)] {
        let (fitted, mut result, _, strains) = static_backbent(&drawn, &volts(2.8), &voltages).expect("an equilibrium");
        result.warnings.extend(mesh::warnings(&fitted));
        let there = client.statics_backbent(&model, &volts(2.8), &voltages).expect("an equilibrium");
        assert_eq!(there, (result, strains));
        assert!(there.1.len() == 1 && there.1[0].1 < -1e-3, "{there:?}");
        assert_eq!(client.statics_backbent(&model, &[], &voltages).expect("an equilibrium").1, []);
    }
}

/// A second snap and both releases.
#[test]
fn further_snaps_have_the_same_bits() {
    let server = start_with("127.0.0.1:0", Limits::default(), LOCAL);
    let mut client = Client::connect(&server.address.uri(), DEADLINE).expect("connects");
    let model = client.compile(&bundle(ROW), &CompileOptions::default()).expect("compiles");
    let drawn = compile(&bundle(ROW), &CompileOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    let (fitted, mut here) = pull_in_fitted(&drawn, None, 20.0).expect("pulls in");
    here.warnings.extend(mesh::warnings(&fitted));
    assert!(here.snaps_v.len() == 1 && here.release_before_snaps_v.is_some(), "{here:?}");
    assert_eq!(client.pull_in(&model, None, 20.0).expect("pulls in"), here);
}

/// Field of a rejected request.
fn field(status: &Status) -> String {
    assert_eq!(status.code(), Code::InvalidArgument, "{status:?}");
    status.get_error_details().bad_request().expect("a BadRequest").field_violations[0].field.clone()
}

/// Invalid numbers, names and counts are rejected by field, before anything is computed.
#[test]
fn bad_paths_and_voltages_are_named() {
    let server = start_with("127.0.0.1:0", Limits { signals: 5, message_bytes: 1 << 20, ..Limits::default() }, LOCAL);
    block_on(async {
        let mut client = server.client().await;
        let bundle = |text| Some(bimorph::service::convert::model::bundle_to_wire(&bundle(text)));
        let mut ids = Vec::new();
        for text in [COLUMN, BAR] {
            let request = proto::CompileRequest { bundle: bundle(text), options: None };
            let reply = client.compile(request).await.expect("compiles").into_inner();
            ids.push(reply.model.expect("a description").id);
        }
        let named = |name: &str, value| vec![proto::Named { name: name.into(), value }];
        let good = proto::PathRequest { model: ids[0].clone(), along: "F".into(), to: 1e-4, ..Default::default() };
        client.path(good.clone()).await.expect("a path");
        let signals = vec!["nosuch.x".to_owned()];
        for (bad, expected) in [
            (proto::PathRequest { along: "nosuch".into(), ..good.clone() }, "along"),
            (proto::PathRequest { along: String::new(), ..good.clone() }, "along"),
            (proto::PathRequest { from: f64::NAN, ..good.clone() }, "from"),
            (proto::PathRequest { to: f64::INFINITY, ..good.clone() }, "to"),
            (proto::PathRequest { to: 0.0, ..good.clone() }, "to"),
            (proto::PathRequest { model: ids[1].clone(), along: "heat".into(), to: 1e300, ..good.clone() }, "to"),
            (proto::PathRequest { model: ids[1].clone(), along: "heat".into(), from: -1e300, ..good.clone() }, "from"),
            (proto::PathRequest { branch: 7, ..good.clone() }, "branch"),
            (proto::PathRequest { points: 1, ..good.clone() }, "points"),
            (proto::PathRequest { points: u32::MAX, ..good.clone() }, "points"),
            (proto::PathRequest { voltages: named("nosuch", f64::NAN), ..good.clone() }, "voltages[0]"),
            (proto::PathRequest { voltages: named("nosuch", 1.0), ..good.clone() }, "port \"nosuch\""),
            (proto::PathRequest { signals, ..good.clone() }, "signal \"nosuch.x\""),
        ] {
            let status = client.path(bad).await.expect_err(expected);
            assert_eq!(field(&status), expected, "{status:?}");
        }
        for (large, limit) in [
            (proto::PathRequest { points: 1_000_000, ..good.clone() }, "message_bytes"),
            (proto::PathRequest { signals: vec!["m.x".into(); 6], ..good.clone() }, "signals"),
        ] {
            let status = client.path(large).await.expect_err(limit);
            assert!(status.code() == Code::ResourceExhausted && status.message().starts_with(limit), "{status:?}");
        }
        let gone = client.path(proto::PathRequest { model: "00".into(), ..good }).await.expect_err("unknown");
        assert_eq!(gone.code(), Code::NotFound);
        for (model, backbend, expected) in [
            (&ids[1], named("heat", f64::NAN), "backbend[0]"),
            (&ids[1], [named("heat", 1.0), named("heat", 1.0)].concat(), "backbend[1]"),
            (&ids[1], named("nosuch", 1.0), "backbend"),
            (&ids[1], named("heat", 1e300), "backbend"),
            (&ids[0], named("heat", 1.0), "backbend"),
        ] {
            let request = proto::StaticRequest { model: model.clone(), backbend, ..Default::default() };
            let status = client.r#static(request).await.expect_err(expected);
            assert_eq!(field(&status), expected, "{status:?}");
        }
        let voltages = named("nosuch", 1.0);
        let request = proto::StaticRequest { model: ids[1].clone(), voltages, backbend: named("heat", 1.0) };
        assert_eq!(field(&client.r#static(request).await.expect_err("unknown")), "port \"nosuch\"");
    });
}
