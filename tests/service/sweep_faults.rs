//! Sweeps through a network that fails at any moment: no finished point is lost, none is there twice, and nothing counts as complete that
//! is not.

use super::network_faults::Cut;
use super::session_faults::{LOCAL, PATIENCE, socket};
use super::test_server::{block_on, bundle, start_with, wire_bundle};
use bimorph::compile::CompileOptions;
use bimorph::jobs::sweep::{self, Shard, SweepAnalysis, SweepSpec};
use bimorph::service::client::Client;
use bimorph::service::limits::Limits;
use bimorph::service::proto;
use std::sync::mpsc;
use std::time::Duration;
use tonic::Code;

/// Bytes within which a connection fails: often before a submission is answered.
const WITHIN: u64 = 1000;

/// Sweeps through so many failures each. A table is complete with each point once, or there is no table. A submission
/// whose reply was lost starts no second sweep, for which there is no space.
fn sweeps(rounds: u64, failures: u64) {
    let parameters = vec!["gap=1.5u:2.5u:60".parse().expect("an axis")];
    let analysis = SweepAnalysis::PullIn { port: Some("drive".into()), max: 30.0 };
    let spec = SweepSpec { parameters, samples: None, analysis, shard: Shard::default(), threads: None };
    let options = CompileOptions::default();
    let text = bundle().files["plate.net"].replace("gap=2u", "gap=gap").replace("param V=0", "param gap=2u");
    let bundle = bimorph::netlist::Bundle::from_text("plate.net", &text);
    let expected = sweep::run(&spec, &bundle, &options, &|_| true).expect("runs");
    assert!(expected.rows.iter().all(|row| row.values.is_ok()));
    let (mut tables, mut given_up, mut failed) = (0, 0, 0);
    for round in 0..rounds {
        let server = start_with("127.0.0.1:0", Limits { sweeps: 1, ..Limits::default() }, LOCAL);
        let cut = Cut::to(socket(&server), round, WITHIN);
        let (send, ended) = mpsc::channel();
        let (uri, spec, bundle, options) = (cut.uri(), spec.clone(), bundle.clone(), options.clone());
        std::thread::spawn(move || {
            let swept =
                Client::connect(&uri, PATIENCE).and_then(|mut c| c.sweep(&spec, &bundle, &options, &mut |_| true));
            send.send(swept)
        });
        let swept = loop {
            match ended.recv_timeout(Duration::from_millis(10)) {
                Ok(swept) => break swept,
                Err(mpsc::RecvTimeoutError::Timeout) if cut.failed() >= failures => cut.calm(),
                Err(mpsc::RecvTimeoutError::Timeout) => {}
                Err(gone) => panic!("{gone}"),
            }
        };
        match swept {
            Ok(table) => {
                assert_eq!(table, expected);
                tables += 1;
            }
            Err(error) => {
                assert!(["Unavailable", "DeadlineExceeded"].contains(&&*error.code), "{error:?}");
                given_up += 1;
            }
        }
        failed += cut.failed();
        println!("sweep {round}: {}", cut.reported());
    }
    assert!(tables > given_up && failed >= rounds, "{tables} tables, {given_up} given up, {failed} failures");
    println!("{tables} tables, {given_up} given up");
}

#[test]
fn sweeps_through_a_network_that_fails() {
    sweeps(2, 2);
}

/// Forty sweeps: `make soak`.
#[test]
#[ignore = "minutes; make soak"]
fn soak_sweeps_through_a_network_that_fails() {
    sweeps(40, 5);
}

/// A request that is sent again under its name is the same sweep; the name with another content is refused.
#[test]
fn a_submission_that_is_sent_again() {
    let server = start_with("127.0.0.1:0", Limits { sweeps: 1, ..Limits::default() }, LOCAL);
    block_on(async {
        let mut client = server.client().await;
        let pull_in = proto::SweepPullIn { port: "drive".into(), max_v: 30.0 };
        let spec = |max_v| proto::SweepSpec {
            analysis: Some(proto::sweep_spec::Analysis::PullIn(proto::SweepPullIn { max_v, ..pull_in.clone() })),
            ..Default::default()
        };
        let request = |max_v, request_id: &str| proto::SubmitSweepRequest {
            bundle: wire_bundle(),
            options: None,
            spec: Some(spec(max_v)),
            request_id: request_id.into(),
        };
        let first = client.submit_sweep(request(30.0, "a")).await.expect("starts").into_inner();
        let again = client.submit_sweep(request(30.0, "a")).await.expect("is known").into_inner();
        assert_eq!(first, again);
        let other = client.submit_sweep(request(31.0, "a")).await.expect_err("another content");
        assert_eq!(other.code(), Code::InvalidArgument);
        assert!(other.message().starts_with("request_id"), "{other}");
        let full = client.submit_sweep(request(30.0, "b")).await.expect_err("there is room for one");
        assert_eq!(full.code(), Code::ResourceExhausted);
        let long = client.submit_sweep(request(30.0, &"x".repeat(65))).await.expect_err("too long");
        assert_eq!(long.code(), Code::InvalidArgument);
    });
}
