//! Jobs: rows come as they are finished and from any one on, clients see their own, and what was cancelled stays.

use super::quotas;
use super::session_faults::LOCAL;
use super::test_server::{block_on, bundle, start_with};
use bimorph::compile::CompileOptions;
use bimorph::jobs::sweep::{self, Shard, SweepAnalysis, SweepSpec};
use bimorph::netlist::Bundle;
use bimorph::service::convert;
use bimorph::service::limits::Limits;
use bimorph::service::proto;
use proto::bimorph_client::BimorphClient;
use proto::job_metadata::State;
use proto::submit_job_request::Task;
use std::collections::BTreeSet;
use std::time::Duration;
use tonic::transport::Channel;
use tonic::{Code, Status, Streaming};

pub(crate) type Wire = BimorphClient<Channel>;

/// Pull-in of the plate at so many gaps, and the plate.
pub(crate) fn gaps(count: usize) -> (SweepSpec, Bundle) {
    let parameters = vec![format!("gap=1.5u:2.5u:{count}").parse().expect("an axis")];
    let analysis = SweepAnalysis::PullIn { port: Some("drive".into()), max: 30.0 };
    let spec = SweepSpec { parameters, samples: None, analysis, shard: Shard::default(), threads: None };
    let text = bundle().files["plate.net"].replace("gap=2u", "gap=gap").replace("param V=0", "param gap=2u");
    (spec, Bundle::from_text("plate.net", &text))
}

/// The same as it is submitted.
pub(crate) fn request(count: usize) -> proto::SubmitJobRequest {
    let (spec, bundle) = gaps(count);
    let linear = proto::Linear { low: 1.5e-6, high: 2.5e-6, count: u32::try_from(count).expect("few") };
    let values = Some(proto::sweep_parameter::Values::Linear(linear));
    let axis = proto::SweepParameter { name: "gap".into(), values };
    let spec = proto::SweepSpec {
        parameters: vec![axis],
        ..convert::sweep::spec_to_wire(&SweepSpec { parameters: vec![], ..spec })
    };
    proto::SubmitJobRequest {
        bundle: Some(convert::model::bundle_to_wire(&bundle)),
        task: Some(Task::Sweep(spec)),
        ..Default::default()
    }
}

/// More points than any test waits for.
pub(crate) const MANY: usize = 500_000;

pub(crate) fn meta(job: &proto::Job) -> &proto::JobMetadata {
    job.metadata.as_ref().expect("metadata")
}

/// Everything that a stream still has: its rows in order, and its last message.
pub(crate) async fn rest(
    stream: &mut Streaming<proto::JobRows>,
    next: u64,
) -> Result<(Vec<proto::JobRow>, Option<proto::Job>), Status> {
    let (mut rows, mut next) = (Vec::new(), next);
    while let Some(chunk) = stream.message().await? {
        assert_eq!(chunk.first_row, next, "rows are numbered without a gap");
        next += chunk.rows.len() as u64;
        rows.extend(chunk.rows);
        if chunk.job.is_some() {
            return Ok((rows, chunk.job));
        }
    }
    Ok((rows, None))
}

pub(crate) async fn fetch(wire: &mut Wire, name: &str, first_row: u64) -> Result<Streaming<proto::JobRows>, Status> {
    let request = proto::FetchJobRequest { name: name.to_owned(), first_row, only_finished: false };
    wire.fetch_job(request).await.map(tonic::Response::into_inner)
}

async fn get(wire: &mut Wire, name: &str) -> Result<proto::Job, Status> {
    wire.get_job(proto::GetJobRequest { name: name.to_owned() }).await.map(tonic::Response::into_inner)
}

async fn cancel(wire: &mut Wire, name: &str) {
    wire.cancel_job(proto::CancelJobRequest { name: name.to_owned() }).await.expect("cancelled");
}

async fn delete(wire: &mut Wire, name: &str) -> Result<(), Status> {
    wire.delete_job(proto::DeleteJobRequest { name: name.to_owned() }).await.map(drop)
}

/// Rows are given while the job still computes, a cancelled job keeps those that it has, each once, and they are given again from any row.
#[test]
fn rows_come_as_they_are_finished() {
    let server = start_with("127.0.0.1:0", Limits::default(), LOCAL);
    block_on(async {
        let mut wire = server.client().await;
        let job = wire.submit_job(request(MANY)).await.expect("starts").into_inner();
        assert!(!job.done && job.result.is_none() && meta(&job).points == MANY as u64 && !meta(&job).kept);
        let mut stream = fetch(&mut wire, &job.name, 0).await.expect("a stream");
        let first = loop {
            let chunk = stream.message().await.expect("goes on").expect("goes on");
            if !chunk.rows.is_empty() {
                break chunk;
            }
            assert_eq!(chunk.parameters, ["gap"]);
        };
        assert!(!get(&mut wire, &job.name).await.expect("is here").done, "rows came before the end");
        cancel(&mut wire, &job.name).await;
        let (rest_of, ended) = rest(&mut stream, first.first_row + first.rows.len() as u64).await.expect("ends");
        let ended = ended.expect("its last message");
        let Some(proto::job::Result::Error(error)) = &ended.result else { panic!("{ended:?}") };
        assert_eq!((error.code, meta(&ended).state()), (Code::Cancelled as i32, State::Cancelled));
        let all: Vec<_> = first.rows.into_iter().chain(rest_of).collect();
        assert_eq!(all.len() as u64, meta(&ended).rows);
        assert!(all.len() < MANY);
        let points: BTreeSet<u64> = all.iter().filter_map(|row| Some(row.row.as_ref()?.point)).collect();
        assert_eq!(points.len(), all.len(), "no point has two rows");
        assert!(
            all.iter().all(|row| row.row.as_ref().is_some_and(|row| row.error.is_empty())),
            "a point that was cancelled is no row"
        );
        for from in [0, 1, all.len() / 2, all.len()] {
            let mut stream = fetch(&mut wire, &job.name, from as u64).await.expect("a stream");
            let (rows, last) = rest(&mut stream, from as u64).await.expect("ends");
            assert_eq!((rows.as_slice(), last.as_ref()), (&all[from..], Some(&ended)));
        }
        cancel(&mut wire, &job.name).await;
        assert_eq!(get(&mut wire, &job.name).await.as_ref().ok(), Some(&ended), "it is as it was");
        let beyond = fetch(&mut wire, &job.name, MANY as u64 + 1).await.expect_err("no such row");
        assert_eq!(beyond.code(), Code::InvalidArgument);
        delete(&mut wire, &job.name).await.expect("forgotten");
        assert_eq!(get(&mut wire, &job.name).await.expect_err("is gone").code(), Code::NotFound);
    });
}

/// A job that is done says so and has every point; the rows in the order of their points are those of the same sweep in
/// process, and the older calls have the same table. Their provenance is reported: the hashes are those of a journal
/// and of a model.
#[test]
fn rows_are_those_of_the_sweep_in_process() {
    let server = start_with("127.0.0.1:0", Limits::default(), LOCAL);
    let (spec, bundle) = gaps(40);
    let options = CompileOptions::default();
    let expected = sweep::run(&spec, &bundle, &options, &|_| true).expect("runs");
    block_on(async {
        let mut wire = server.client().await;
        let job = wire.submit_job(request(40)).await.expect("starts").into_inner();
        let mut watched =
            wire.watch_job(proto::WatchJobRequest { name: job.name.clone() }).await.expect("a stream").into_inner();
        let mut last = None;
        while let Some(job) = watched.message().await.expect("goes on") {
            let before = last.as_ref().map_or(0, |last: &proto::Job| meta(last).rows);
            assert!(meta(&job).rows >= before, "counts never go back");
            last = Some(job);
        }
        let last = last.expect("reported");
        assert_eq!(last.result, Some(proto::job::Result::Response(proto::JobResponse { rows: 40, failed: 0 })));
        let mut stream = fetch(&mut wire, &job.name, 0).await.expect("a stream");
        let (mut rows, ended) = rest(&mut stream, 0).await.expect("ends");
        assert_eq!(ended, Some(last.clone()));
        rows.sort_by_key(|row| row.row.as_ref().map(|row| row.point));
        let values: Vec<_> = rows.iter().map(|row| row.row.as_ref().expect("a row").results.clone()).collect();
        let here: Vec<Vec<f64>> = expected
            .rows
            .iter()
            .map(|row| row.values.iter().flatten().map(|x| x.unwrap_or(f64::NAN)).collect())
            .collect();
        assert_eq!(values, here);
        let provenance = meta(&last).provenance.clone().expect("what it comes from");
        assert_eq!(provenance.sweep, sweep::journal::name(&spec, &bundle, &options));
        let compiled = proto::CompileRequest { bundle: Some(convert::model::bundle_to_wire(&bundle)), options: None };
        let model = wire.compile(compiled).await.expect("compiles").into_inner().model.expect("a model");
        assert_eq!((provenance.model, provenance.version), (model.id, env!("CARGO_PKG_VERSION").to_owned()));
        let id = job.name.strip_prefix("jobs/").expect("a name").to_owned();
        let mut chunks = wire.fetch_sweep(proto::FetchSweepRequest { sweep: id }).await.expect("a table").into_inner();
        let mut table = sweep::SweepTable::default();
        while let Some(chunk) = chunks.message().await.expect("goes on") {
            convert::sweep::chunk_from_wire(chunk, &mut table).expect("rows");
        }
        assert_eq!(table.to_csv(), expected.to_csv());
    });
}

/// Clients list their own jobs, by pages, the last one first. An unknown name, or an invalid token, is rejected; the
/// name of a job grants access to it.
#[test]
fn clients_list_their_own_jobs() {
    let (_folder, server) = quotas::server(Limits { client_sweeps: 5, ..Limits::default() });
    block_on(async {
        let (mut alice, mut bob) = (quotas::client(&server, "alice").await, quotas::client(&server, "bob").await);
        let mut names = Vec::new();
        for count in 1..=5 {
            names.push(alice.submit_job(request(count)).await.expect("starts").into_inner().name);
        }
        let full = alice.submit_job(request(6)).await.expect_err("five are there");
        assert_eq!(full.code(), Code::ResourceExhausted);
        assert!(full.message().starts_with("client_sweeps"), "{full}");
        let own = bob.submit_job(request(1)).await.expect("starts").into_inner().name;
        let (mut found, mut token) = (Vec::new(), String::new());
        loop {
            let request = proto::ListJobsRequest { page_size: 2, page_token: token };
            let page = alice.list_jobs(request).await.expect("a page").into_inner();
            assert!(page.jobs.len() <= 2);
            found.extend(page.jobs.into_iter().map(|job| job.name));
            token = page.next_page_token;
            if token.is_empty() {
                break;
            }
        }
        names.reverse();
        assert_eq!(found, names);
        let all = bob.list_jobs(proto::ListJobsRequest::default()).await.expect("a page").into_inner();
        assert!(all.jobs.iter().map(|job| &job.name).eq([&own]));
        for (page_size, page_token) in
            [(-1, String::new()), (0, "x".into()), (0, "f".repeat(1 << 16)), (0, "ffffffffffffffff0".into())]
        {
            let bad = bob.list_jobs(proto::ListJobsRequest { page_size, page_token }).await.expect_err("means nothing");
            assert_eq!(bad.code(), Code::InvalidArgument);
        }
        // any token shows no more than one's own
        let made_up = proto::ListJobsRequest { page_size: 0, page_token: "ffffffffffffffff".into() };
        assert_eq!(bob.list_jobs(made_up).await.expect("a page").into_inner().jobs.len(), 1);
        let id = own.strip_prefix("jobs/").expect("a name");
        for guess in [
            "",
            "jobs/",
            id,
            "jobs/../jobs",
            &format!("jobs/{}", "0".repeat(32)),
            &format!("jobs/{}", id.to_uppercase()),
            &"x".repeat(1 << 16),
        ] {
            let request = proto::GetJobRequest { name: guess.to_owned() };
            let unknown = bob.get_job(request).await;
            let same = guess.strip_prefix("jobs/") == Some(id);
            assert!(same || unknown.is_err_and(|status| status.code() == Code::NotFound), "{guess}");
        }
        assert!(alice.get_job(proto::GetJobRequest { name: own }).await.is_ok());
    });
}

/// One client's small job is done while another's large one has begun and is far from its end.
#[test]
fn a_large_job_does_not_hold_up_a_small_one() {
    let (_folder, server) = quotas::server(Limits::default());
    block_on(async {
        let (mut alice, mut bob) = (quotas::client(&server, "alice").await, quotas::client(&server, "bob").await);
        let large = alice.submit_job(request(MANY)).await.expect("starts").into_inner().name;
        let large = proto::GetJobRequest { name: large };
        while meta(alice.get_job(large.clone()).await.expect("is here").get_ref()).rows == 0 {}
        let small = bob.submit_job(request(7)).await.expect("starts").into_inner().name;
        let mut watched = bob.watch_job(proto::WatchJobRequest { name: small }).await.expect("a stream").into_inner();
        let mut last = None;
        while let Some(job) = watched.message().await.expect("goes on") {
            last = Some(job);
        }
        assert_eq!(meta(&last.expect("reported")).state(), State::Done);
        assert_eq!(meta(alice.get_job(large).await.expect("is here").get_ref()).state(), State::Running);
    });
}

/// The same request again is the same job, another one under its name is refused, and names are those of one client.
/// With `share` an identical request gets the same job, unless it was cancelled.
#[test]
fn requests_have_names() {
    let (_folder, server) = quotas::server(Limits::default());
    block_on(async {
        let (mut alice, mut bob) = (quotas::client(&server, "alice").await, quotas::client(&server, "bob").await);
        let named = |count| proto::SubmitJobRequest { request_id: "a".into(), ..request(count) };
        let shared = |count| proto::SubmitJobRequest { share: true, ..request(count) };
        let first = alice.submit_job(named(3)).await.expect("starts").into_inner().name;
        assert_eq!(alice.submit_job(named(3)).await.expect("is known").into_inner().name, first);
        assert_eq!(alice.submit_job(named(4)).await.expect_err("another").code(), Code::InvalidArgument);
        assert_ne!(bob.submit_job(named(3)).await.expect("starts").into_inner().name, first);
        let one = alice.submit_job(shared(MANY)).await.expect("starts").into_inner();
        assert_eq!(meta(&one).request_id.len(), 32);
        assert_eq!(alice.submit_job(shared(MANY)).await.expect("is known").into_inner().name, one.name);
        assert_ne!(alice.submit_job(shared(3)).await.expect("starts").into_inner().name, one.name);
        assert_ne!(bob.submit_job(shared(MANY)).await.expect("starts").into_inner().name, one.name);
        alice.cancel_job(proto::CancelJobRequest { name: one.name.clone() }).await.expect("cancelled");
        let mut watched =
            alice.watch_job(proto::WatchJobRequest { name: one.name.clone() }).await.expect("a stream").into_inner();
        while watched.message().await.expect("goes on").is_some() {}
        assert_ne!(alice.submit_job(shared(MANY)).await.expect("starts").into_inner().name, one.name);
        let both = proto::SubmitJobRequest { request_id: "b".into(), ..shared(3) };
        assert_eq!(alice.submit_job(both).await.expect_err("one or the other").code(), Code::InvalidArgument);
        for release_after_s in [-1.0, f64::NAN, f64::INFINITY, 1e300] {
            let bad = proto::SubmitJobRequest { release_after_s, ..request(3) };
            assert_eq!(alice.submit_job(bad).await.expect_err("no time").code(), Code::InvalidArgument);
        }
    });
}

/// A job with that option is cancelled when its client is gone; one without it continues; and a request by another
/// connection keeps it.
#[test]
fn a_job_is_released_when_its_client_is_lost() {
    let server = start_with("127.0.0.1:0", Limits::default(), LOCAL);
    block_on(async {
        let mut wire = server.client().await;
        let mut names = Vec::new();
        let mut other = server.client().await;
        for release_after_s in [0.3, 0.0, 0.3] {
            let request = proto::SubmitJobRequest { release_after_s, ..request(MANY) };
            names.push(other.submit_job(request).await.expect("starts").into_inner().name);
        }
        get(&mut wire, &names[2]).await.expect("is here");
        drop(other);
        // listing is not asking for a job
        let released = loop {
            let jobs = wire.list_jobs(proto::ListJobsRequest::default()).await.expect("a page").into_inner().jobs;
            let of = |name: &str| jobs.iter().find(|job| job.name == name).cloned().expect("is listed");
            if of(&names[0]).done {
                assert!(!of(&names[1]).done && !of(&names[2]).done);
                break of(&names[0]);
            }
            tokio::time::sleep(Duration::from_millis(10)).await;
        };
        let Some(proto::job::Result::Error(error)) = released.result else { panic!("{released:?}") };
        assert_eq!(error.code, Code::Cancelled as i32);
        assert!(error.message.contains("client was gone for 0.3 s"), "{}", error.message);
    });
}
