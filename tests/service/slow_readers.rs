//! A slow reader of the rows of a sweep gets each of them once, blocks nothing, and receives an error when they are
//! incomplete.

use super::test_server::{Running, block_on, start_with};
use bimorph::device::local::LocalDevice;
use bimorph::service::limits::Limits;
use bimorph::service::proto;
use proto::bimorph_client::BimorphClient;
use proto::sweep_status::State;
use std::time::Duration;
use tonic::Streaming;
use tonic::transport::Channel;

/// Points of the sweep, and nodes with three numbers each: some megabytes, far beyond what a connection holds on its way.
const POINTS: u32 = 3000;
const NODES: usize = 40;

/// A chain of beams under a force at its end.
fn chain() -> proto::Bundle {
    let mut text =
        "process p = [Youngsmodulus=165e9 density=2300 h=2u]\nparam F=0\nanchor p [n0] [l=1u w=1u]\n".to_owned();
    for k in 1..NODES {
        text += &format!("beam2d p [n{} n{k}] [l=10u w=2u]\n", k - 1);
    }
    text += &format!("f2d * [n{}] [F=F oz=pi/2]\n", NODES - 1);
    proto::Bundle { root: "a.net".into(), files: [("a.net".to_owned(), text)].into() }
}

fn server() -> Running {
    let limits = Limits { drain: Duration::from_millis(100), ..Limits::default() };
    start_with("127.0.0.1:0", limits, |compiled| Box::new(LocalDevice::new(compiled)))
}

/// A finished sweep.
async fn swept(client: &mut BimorphClient<Channel>) -> String {
    let linear = proto::Linear { low: 0.0, high: 1e-9, count: POINTS };
    let values = Some(proto::sweep_parameter::Values::Linear(linear));
    let spec = proto::SweepSpec {
        parameters: vec![proto::SweepParameter { name: "F".into(), values }],
        analysis: Some(proto::sweep_spec::Analysis::Static(proto::SweepStatic::default())),
        ..Default::default()
    };
    let options = Some(proto::CompileOptions { segments: Some(1), ..Default::default() });
    let request = proto::SubmitSweepRequest { bundle: Some(chain()), options, spec: Some(spec), ..Default::default() };
    let sweep = client.submit_sweep(request).await.expect("a sweep").into_inner().sweep;
    let request = proto::WatchSweepRequest { sweep: sweep.clone() };
    let mut watched = client.watch_sweep(request).await.expect("a stream").into_inner();
    let mut last = None;
    while let Some(status) = watched.message().await.expect("a status") {
        last = Some(status.state());
    }
    assert_eq!(last, Some(State::Done));
    sweep
}

async fn fetch(client: &mut BimorphClient<Channel>, sweep: &str) -> Streaming<proto::SweepChunk> {
    let request = proto::FetchSweepRequest { sweep: sweep.to_owned() };
    client.fetch_sweep(request).await.expect("a table").into_inner()
}

/// Between any two messages others ask, and are answered; the rows are those that a quick reader gets, each once.
#[test]
fn a_slow_reader_gets_every_row_once() {
    let server = server();
    block_on(async {
        let (mut client, mut other) = (server.client().await, server.client().await);
        let sweep = swept(&mut client).await;
        let mut slow = fetch(&mut client, &sweep).await;
        let (mut rows, mut messages) = (Vec::new(), 0);
        while let Some(chunk) = slow.message().await.expect("a chunk") {
            messages += 1;
            rows.extend(chunk.rows);
            for _ in 0..20 {
                other.info(proto::InfoRequest {}).await.expect("others are served");
            }
        }
        assert!(messages > 2, "{messages}");
        let (mut quick, mut all) = (fetch(&mut other, &sweep).await, Vec::new());
        while let Some(chunk) = quick.message().await.expect("a chunk") {
            all.extend(chunk.rows);
        }
        assert_eq!(rows.len(), POINTS as usize);
        assert!(rows.iter().enumerate().all(|(k, row)| row.point == k as u64));
        assert_eq!(rows, all);
    });
}

/// A reader that stops in the middle does not prevent the server from stopping, and the rest of its stream ends with an
/// error.
#[test]
fn rows_that_are_not_all_do_not_end_well() {
    let mut server = server();
    block_on(async {
        let mut client = server.client().await;
        let sweep = swept(&mut client).await;
        let mut slow = fetch(&mut client, &sweep).await;
        let mut rows = slow.message().await.expect("a chunk").expect("the first").rows.len();
        server.report();
        let end = loop {
            match slow.message().await {
                Ok(Some(chunk)) => rows += chunk.rows.len(),
                Ok(None) => break None,
                Err(status) => break Some(status),
            }
        };
        assert!(end.is_some() || rows == POINTS as usize, "{rows} of {POINTS} rows, and a good end");
    });
    server.stop().expect("a clean stop");
}
