//! Jobs in a folder: reported rows are there after a restart, damage is a job's own error, and a full disk ends a job
//! and not the server.

use super::jobs::{MANY, Wire, fetch, gaps, meta, request, rest};
use super::session_faults::LOCAL;
use super::test_server::{Running, block_on, start_kept};
use bimorph::compile::CompileOptions;
use bimorph::jobs::sweep;
use bimorph::service::limits::Limits;
use bimorph::service::proto;
use proto::job_metadata::State;
use std::path::{Path, PathBuf};
use tonic::Code;

pub(crate) fn server(folder: &Path) -> Running {
    start_kept(folder, Limits { analyses: 2, ..Limits::default() }, LOCAL)
}

pub(crate) async fn job(wire: &mut Wire, name: &str) -> proto::Job {
    wire.get_job(proto::GetJobRequest { name: name.to_owned() }).await.expect("is here").into_inner()
}

pub(crate) async fn ended(wire: &mut Wire, name: &str) -> proto::Job {
    let mut watched =
        wire.watch_job(proto::WatchJobRequest { name: name.to_owned() }).await.expect("a stream").into_inner();
    let mut last = None;
    while let Some(job) = watched.message().await.expect("goes on") {
        last = Some(job);
    }
    last.filter(|job| job.done).expect("it ended")
}

/// The first rows of a job, at least so many.
pub(crate) async fn some_rows(wire: &mut Wire, name: &str, least: usize) -> Vec<proto::JobRow> {
    let mut stream = fetch(wire, name, 0).await.expect("a stream");
    let mut rows = Vec::new();
    while rows.len() < least {
        rows.extend(stream.message().await.expect("goes on").expect("goes on").rows);
    }
    rows
}

pub(crate) fn file(folder: &Path, name: &str, end: &str) -> PathBuf {
    folder.join(format!("{name}.{end}"))
}

/// A job survives its server: sent rows keep their numbers and their bits, none is there twice, and the whole is the
/// sweep in process. A submission whose answer was lost is found again by its name, finished jobs keep their rows, a
/// cancelled one stays so, and a deleted one is gone.
#[test]
fn jobs_outlive_the_server() {
    let folder = tempfile::tempdir().expect("a folder");
    let (spec, bundle) = gaps(400);
    let expected = sweep::run(&spec, &bundle, &CompileOptions::default(), &|_| true).expect("runs");
    let named = proto::SubmitJobRequest { request_id: "mine".into(), ..request(400) };
    let (mut first, mut second) = (Some(server(folder.path())), None);
    let (done, cancelled, running, given) = block_on(async {
        let mut wire = first.as_ref().expect("runs").client().await;
        let mut submit = async |request| wire.submit_job(request).await.expect("starts").into_inner().name;
        let (done, gone) = (submit(request(5)).await, submit(request(4)).await);
        let (cancelled, running) = (submit(request(MANY)).await, submit(named.clone()).await);
        let given = some_rows(&mut wire, &running, 3).await;
        assert_eq!(meta(&ended(&mut wire, &done).await).state(), State::Done);
        some_rows(&mut wire, &cancelled, 1).await;
        wire.cancel_job(proto::CancelJobRequest { name: cancelled.clone() }).await.expect("cancelled");
        wire.delete_job(proto::DeleteJobRequest { name: gone }).await.expect("deleted");
        (done, cancelled, running, given)
    });
    drop(first.take());
    block_on(async {
        let mut wire = second.insert(server(folder.path())).client().await;
        let listed = wire.list_jobs(proto::ListJobsRequest::default()).await.expect("a page").into_inner().jobs;
        let names: Vec<_> = listed.iter().map(|job| job.name.clone()).collect();
        assert_eq!(names, [running.clone(), cancelled.clone(), done.clone()], "the last one first");
        assert!(listed.iter().all(|job| meta(job).kept));
        let again = wire.submit_job(named.clone()).await.expect("is known").into_inner();
        assert_eq!(again.name, running);
        let mut stream = fetch(&mut wire, &running, 0).await.expect("a stream");
        let (rows, last) = rest(&mut stream, 0).await.expect("ends");
        assert_eq!(last.map(|job| meta(&job).state()), Some(State::Done));
        assert_eq!(rows[..given.len()], given, "rows keep their numbers");
        let mut points: Vec<_> = rows.iter().map(|row| row.row.as_ref().expect("a row")).collect();
        points.sort_by_key(|row| row.point);
        assert!(points.iter().map(|row| row.point).eq(0..400), "each point once");
        let values = points.iter().map(|row| row.results.clone());
        assert!(
            values.eq(expected.rows.iter().map(|row| row
                .values
                .iter()
                .flatten()
                .flatten()
                .copied()
                .collect::<Vec<_>>()))
        );
        let was = job(&mut wire, &cancelled).await;
        assert!(was.done && meta(&was).state() == State::Cancelled && meta(&was).rows > 0);
        assert!(some_rows(&mut wire, &cancelled, 1).await.len() as u64 <= meta(&was).rows);
        let (rows, last) = rest(&mut fetch(&mut wire, &done, 0).await.expect("a stream"), 0).await.expect("ends");
        assert_eq!((rows.len(), last.map(|job| meta(&job).state())), (5, Some(State::Done)));
        for name in [running, cancelled, done] {
            wire.delete_job(proto::DeleteJobRequest { name }).await.expect("deleted");
        }
    });
    drop(second.take());
    assert_eq!(std::fs::read_dir(folder.path().join("jobs")).expect("a folder").count(), 0, "nothing is left");
}

/// After any truncation of its journal, a job has the complete rows, computes the others, and ends with all of them,
/// each once. A job whose outcome has more rows than exist does not count as complete.
#[test]
fn a_journal_that_was_cut_goes_on() {
    let folder = tempfile::tempdir().expect("a folder");
    let jobs = folder.path().join("jobs");
    let mut running = server(folder.path());
    let (name, whole) = block_on(async {
        let mut wire = running.client().await;
        let name = wire.submit_job(request(6)).await.expect("starts").into_inner().name;
        ended(&mut wire, &name).await;
        let (rows, _) = rest(&mut fetch(&mut wire, &name, 0).await.expect("a stream"), 0).await.expect("ends");
        (name, rows)
    });
    running.stop().expect("stops");
    let id = name.strip_prefix("jobs/").expect("a name");
    let bytes = std::fs::read(file(&jobs, id, "rows")).expect("a journal");
    let (least, most) = (bytes.iter().position(|byte| *byte == b'\n').expect("a head"), bytes.len());
    for cut in (0..most).step_by((most - least) / 20).chain([least, least + 1, most - 1]) {
        std::fs::write(file(&jobs, id, "rows"), &bytes[..cut]).expect("written");
        let mut running = server(folder.path());
        block_on(async {
            let mut wire = running.client().await;
            assert_eq!(meta(&ended(&mut wire, &name).await).state(), State::Done, "{cut}");
            let (mut rows, _) = rest(&mut fetch(&mut wire, &name, 0).await.expect("a stream"), 0).await.expect("ends");
            let there = bytes[..cut].iter().filter(|byte| **byte == b'\n').count().saturating_sub(1);
            assert_eq!(rows[..there], whole[..there], "{cut}: rows that were whole keep their numbers");
            let sort = |rows: &mut Vec<proto::JobRow>| rows.sort_by_key(|row| row.row.as_ref().map(|row| row.point));
            let mut expected = whole.clone();
            sort(&mut rows);
            sort(&mut expected);
            assert_eq!(rows, expected, "{cut}");
        });
        running.stop().expect("stops");
    }
    // a file that cannot be understood is its job's own trouble: the others are served, and nothing of it is taken away
    let sound = std::fs::read(file(&jobs, id, "job")).expect("what was asked");
    std::fs::write(file(&jobs, id, "job"), b"damaged").expect("written");
    let mut running = server(folder.path());
    block_on(async {
        let mut wire = running.client().await;
        let gone = wire.get_job(proto::GetJobRequest { name: name.clone() }).await.expect_err("is no job");
        assert_eq!(gone.code(), Code::NotFound);
        assert!(wire.submit_job(request(2)).await.is_ok());
    });
    running.stop().expect("stops");
    std::fs::write(file(&jobs, id, "job"), sound).expect("written");
    let running = server(folder.path());
    block_on(async {
        let mut wire = running.client().await;
        let (rows, _) = rest(&mut fetch(&mut wire, &name, 0).await.expect("a stream"), 0).await.expect("ends");
        assert_eq!(rows.len(), whole.len(), "its rows are there again");
    });
}

/// Ended jobs in a folder block nothing, and their rows are available on request, though not in memory.
#[test]
fn ended_jobs_make_room() {
    let folder = tempfile::tempdir().expect("a folder");
    let running = start_kept(folder.path(), Limits { sweeps: 1, ..Limits::default() }, LOCAL);
    block_on(async {
        let mut wire = running.client().await;
        let mut names = Vec::new();
        for points in 2..6 {
            let name = wire.submit_job(request(points)).await.expect("there is room").into_inner().name;
            ended(&mut wire, &name).await;
            names.push(name);
        }
        for _ in 0..2 {
            for (name, points) in names.iter().zip(2..6) {
                let (rows, last) =
                    rest(&mut fetch(&mut wire, name, 0).await.expect("a stream"), 0).await.expect("ends");
                assert_eq!((rows.len(), meta(&last.expect("reported")).state()), (points, State::Done));
            }
        }
    });
}

/// Rows without disk space end their job, with the reason and the stored rows; the server continues, and without space
/// for the request itself there is no job.
#[test]
fn a_full_folder_ends_a_job_and_not_the_server() {
    let folder = tempfile::tempdir().expect("a folder");
    let limits = Limits { state_bytes: 20_000, ..Limits::default() };
    let running = start_kept(folder.path(), limits, LOCAL);
    block_on(async {
        let mut wire = running.client().await;
        let name = wire.submit_job(request(MANY)).await.expect("starts").into_inner().name;
        let full = ended(&mut wire, &name).await;
        let Some(proto::job::Result::Error(error)) = &full.result else { panic!("{full:?}") };
        assert_eq!((error.code, meta(&full).state()), (Code::ResourceExhausted as i32, State::Failed));
        assert!(error.message.contains("rows are not kept: state_bytes: at most 20000"), "{}", error.message);
        let (rows, last) = rest(&mut fetch(&mut wire, &name, 0).await.expect("a stream"), 0).await.expect("ends");
        assert_eq!((rows.len() as u64, last.as_ref()), (meta(&full).rows, Some(&full)));
        let mut large = request(3);
        let text = format!("{}* {}\n", super::test_server::PLATE, "x".repeat(20_000));
        large
            .bundle
            .as_mut()
            .expect("a netlist")
            .files
            .insert("plate.net".into(), text.replace("gap=2u", "gap=gap").replace("param V=0", "param gap=2u"));
        let refused = wire.submit_job(large).await.expect_err("no room");
        assert_eq!(refused.code(), Code::ResourceExhausted, "{refused}");
        wire.delete_job(proto::DeleteJobRequest { name }).await.expect("deleted");
        let name = wire.submit_job(request(3)).await.expect("there is room again").into_inner().name;
        assert_eq!(meta(&ended(&mut wire, &name).await).state(), State::Done);
    });
}
