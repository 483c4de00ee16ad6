//! Jobs of a server that is killed at any moment: no row that was given is lost or changed, none is there twice, and the table is that of the
//! same sweep in process.

use crate::command::{Bench, PLATE};
use crate::serve_process::Server;
use crate::stepping::client;
use crate::stored_sessions::{Numbers, kill_after};
use bimorph::compile::CompileOptions;
use bimorph::jobs::sweep::{self, Shard, SweepAnalysis, SweepSpec};
use bimorph::netlist::Bundle;
use bimorph::service::{convert, proto};
use proto::bimorph_client::BimorphClient;
use proto::job_metadata::State;
use std::time::Duration;
use tonic::transport::Channel;
use tonic::{Code, Status};

/// Longest life of a server that is to be killed, from where its fate is decided (µs).
const LONGEST_LIFE: u64 = 60_000;
/// Points of a job.
const POINTS: usize = 600;

fn spec() -> SweepSpec {
    let parameters = vec![format!("gap=1.5u:2.5u:{POINTS}").parse().expect("an axis")];
    let analysis = SweepAnalysis::PullIn { port: Some("drive".into()), max: 30.0 };
    SweepSpec { parameters, samples: None, analysis, shard: Shard::default(), threads: None }
}

/// Data of a job that a client has received.
#[derive(Default)]
struct Known {
    name: Option<String>,
    rows: Vec<proto::SweepRow>,
    done: bool,
}

impl Known {
    /// Submits the job until it was answered, and reads rows until it has ended.
    async fn go_on(
        &mut self,
        wire: &mut BimorphClient<Channel>,
        request: &proto::SubmitJobRequest,
    ) -> Result<(), Status> {
        let name = wire.submit_job(request.clone()).await?.into_inner().name;
        assert_eq!(*self.name.get_or_insert_with(|| name.clone()), name, "an answered submission is the same job");
        let first_row = self.rows.len() as u64;
        let fetch = proto::FetchJobRequest { name, first_row, only_finished: false };
        let mut stream = wire.fetch_job(fetch).await?.into_inner();
        while let Some(chunk) = stream.message().await? {
            assert_eq!(chunk.first_row, self.rows.len() as u64);
            self.rows.extend(chunk.rows.into_iter().map(|row| row.row.expect("a row")));
            if let Some(job) = chunk.job {
                let metadata = job.metadata.expect("metadata");
                assert_eq!((metadata.state(), metadata.rows), (State::Done, self.rows.len() as u64));
                self.done = true;
                return Ok(());
            }
        }
        Err(Status::unavailable("the stream was cut"))
    }
}

/// Jobs through so many killed servers, one after another until the kills are used up.
async fn killed(kills: usize) {
    let bench = Bench::new(&[]);
    let options = format!("--listen unix://{} --state-dir states", bench.path("s").display());
    let bundle = Bundle::from_text("plate.net", PLATE);
    let expected = sweep::run(&spec(), &bundle, &CompileOptions::default(), &|_| true).expect("runs");
    let request = |number: usize| proto::SubmitJobRequest {
        bundle: Some(convert::model::bundle_to_wire(&bundle)),
        task: Some(proto::submit_job_request::Task::Sweep(convert::sweep::spec_to_wire(&spec()))),
        request_id: format!("job {number}").replace(' ', "-"),
        ..Default::default()
    };
    let (mut numbers, mut left, mut jobs, mut within) = (Numbers(5), kills, 0, 0);
    let mut server = Server::start(&bench, &options);
    let mut wire = client(&server.address).await;
    while left > 0 {
        let (request, mut known) = (request(jobs), Known::default());
        jobs += 1;
        while !known.done {
            if left > 0 {
                kill_after(server.id(), Duration::from_micros(numbers.below(LONGEST_LIFE)));
            }
            match known.go_on(&mut wire, &request).await {
                Ok(()) if left == 0 => break,
                // its fate is decided: it comes
                Ok(()) => {}
                Err(status) if left > 0 => {
                    assert!(
                        [Code::Unavailable, Code::Unknown, Code::Internal, Code::Cancelled].contains(&status.code()),
                        "{status}"
                    );
                    within += usize::from(!known.rows.is_empty() && known.rows.len() < POINTS);
                }
                Err(status) => panic!("{status}"),
            }
            if left > 0 {
                assert_eq!(server.signal("-KILL"), None);
                left -= 1;
                server = Server::start(&bench, &options);
                wire = client(&server.address).await;
            }
        }
        let listed = wire.list_jobs(proto::ListJobsRequest::default()).await.expect("a page").into_inner().jobs;
        assert_eq!(listed.len(), 1, "a submission that was sent again starts one job");
        // a job that was done before the kill has its rows after it as well
        let (rows, name) = (std::mem::take(&mut known.rows), known.name.clone().expect("answered"));
        known.go_on(&mut wire, &request).await.expect("it is there");
        assert_eq!(known.rows, rows, "rows keep their numbers and their bits");
        known.rows.sort_by_key(|row| row.point);
        assert!(known.rows.iter().map(|row| row.point).eq(0..POINTS as u64), "each point once");
        for (row, expected) in known.rows.iter().zip(&expected.rows) {
            let values =
                expected.values.as_ref().expect("each pulls in").iter().map(|x| x.unwrap_or(f64::NAN).to_bits());
            assert!(row.results.iter().map(|x| x.to_bits()).eq(values), "point {}", row.point);
        }
        wire.delete_job(proto::DeleteJobRequest { name }).await.expect("deleted");
    }
    assert_eq!(server.signal("-TERM"), Some(0));
    println!("{kills} kills, {jobs} jobs of {POINTS} points, {within} kills between two rows that were read");
}

fn run(kills: usize) {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
    runtime.block_on(killed(kills));
}

/// Four kills.
#[test]
fn four_kills() {
    run(4);
}

/// A hundred: `make soak`.
#[test]
#[ignore = "a minute; make soak"]
fn soak_kills_of_jobs() {
    run(100);
}
