//! Jobs that another server left, and files that were damaged meanwhile: nothing sound is lost, and nothing is taken for what it is not.

use super::jobs::{MANY, Wire, fetch, meta, request, rest};
use super::session_faults::LOCAL;
use super::stored_jobs::{ended, file, job, server, some_rows};
use super::test_server::{block_on, start_kept};
use bimorph::content::Fnv;
use bimorph::service::limits::Limits;
use bimorph::service::proto;
use proto::job_metadata::State;
use std::path::Path;
use std::time::Duration;
use tonic::{Code, Status};

/// Length of what stands before the sum, with the sum.
const HEAD: usize = 32;

/// Every row of a job, and how it ended.
async fn rows(wire: &mut Wire, name: &str) -> Result<(Vec<proto::JobRow>, Option<proto::Job>), Status> {
    rest(&mut fetch(wire, name, 0).await?, 0).await
}

/// A job of a server that then stops: its name, and the rows that it has.
fn left(folder: &Path, points: usize) -> (String, Vec<proto::JobRow>) {
    let mut running = server(folder);
    let left = block_on(async {
        let mut wire = running.client().await;
        let name = wire.submit_job(request(points)).await.expect("starts").into_inner().name;
        if points == MANY {
            some_rows(&mut wire, &name, 5).await;
            return (name, Vec::new());
        }
        ended(&mut wire, &name).await;
        let (rows, _) = rows(&mut wire, &name).await.expect("ends");
        (name, rows)
    });
    running.stop().expect("stops");
    left
}

fn id(name: &str) -> &str {
    name.strip_prefix("jobs/").expect("a name")
}

/// A job that another version began has its rows, for any number of requests, and reports why there are not more; it
/// stays for a server of that version, unless it is cancelled.
#[test]
fn a_job_of_another_version_is_left_to_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let (name, _) = left(folder.path(), MANY);
    let path = file(&folder.path().join("jobs"), id(&name), "job");
    let mut bytes = std::fs::read(&path).expect("what was asked");
    let own = format!("\"version\":\"{}\"", env!("CARGO_PKG_VERSION"));
    let at = bytes.windows(own.len()).position(|part| part == own.as_bytes()).expect("the version");
    bytes[at + own.len() - 2] = b'z';
    let mut sum = Fnv::default();
    sum.bytes(&bytes[HEAD..]);
    bytes[16..HEAD].copy_from_slice(&sum.value().to_le_bytes());
    std::fs::write(&path, &bytes).expect("written");
    let limits = Limits { sweeps_idle: Duration::from_millis(1), analyses: 2, ..Limits::default() };
    for cancelled in [false, false, true] {
        let mut running = start_kept(folder.path(), limits.clone(), LOCAL);
        block_on(async {
            let mut wire = running.client().await;
            let (first, last) = rows(&mut wire, &name).await.expect("its rows");
            assert!(first.len() >= 5);
            let Some(proto::job::Result::Error(why)) = last.expect("reported").result else { panic!("it is not done") };
            assert_eq!(why.code, Code::FailedPrecondition as i32, "{why:?}");
            for _ in 0..2 {
                assert_eq!(rows(&mut wire, &name).await.expect("its rows").0, first);
            }
            if cancelled {
                wire.cancel_job(proto::CancelJobRequest { name: name.clone() }).await.expect("kept");
                assert_eq!(meta(&job(&mut wire, &name).await).state(), State::Cancelled);
            }
        });
        running.stop().expect("stops");
    }
    let running = server(folder.path());
    block_on(async {
        let job = job(&mut running.client().await, &name).await;
        assert_eq!(meta(&job).state(), State::Cancelled, "a cancelled one stays so");
    });
}

/// A journal of a finished job that is damaged in the middle has all rows again: that of the damage is computed anew, and nothing that stands
/// behind the damage is taken away.
#[test]
fn a_damaged_journal_keeps_what_it_has() {
    let folder = tempfile::tempdir().expect("a folder");
    let (name, whole) = left(folder.path(), 40);
    let path = file(&folder.path().join("jobs"), id(&name), "rows");
    let sound = std::fs::read(&path).expect("a journal");
    let mut damaged = sound.clone();
    damaged[sound.len() / 2] = 0;
    std::fs::write(&path, &damaged).expect("written");
    let running = server(folder.path());
    block_on(async {
        let mut wire = running.client().await;
        let sorted = |rows: &[proto::JobRow]| {
            let mut rows: Vec<_> = rows.iter().map(|row| row.row.clone().expect("a row")).collect();
            rows.sort_by_key(|row| row.point);
            rows
        };
        for _ in 0..2 {
            assert_eq!(sorted(&rows(&mut wire, &name).await.expect("its rows").0), sorted(&whole));
        }
        assert!(std::fs::read(&path).expect("a journal").starts_with(&damaged));
    });
}

/// An unreadable outcome hides no job: it continues, and has nothing left to do.
#[test]
fn a_damaged_end_hides_no_job() {
    let folder = tempfile::tempdir().expect("a folder");
    let (name, whole) = left(folder.path(), 6);
    for damage in [&b""[..], b"{\"code\":"] {
        std::fs::write(file(&folder.path().join("jobs"), id(&name), "end"), damage).expect("written");
        let mut running = server(folder.path());
        block_on(async {
            let mut wire = running.client().await;
            assert_eq!(meta(&ended(&mut wire, &name).await).state(), State::Done);
            assert_eq!(rows(&mut wire, &name).await.expect("its rows").0, whole);
        });
        running.stop().expect("stops");
    }
}

/// The time without a request of a job begins with the server: a stop for a month, or a wrong clock, removes nothing.
#[test]
fn a_server_that_was_stopped_for_long_forgets_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let (name, whole) = left(folder.path(), 6);
    let path = file(&folder.path().join("jobs"), id(&name), "end");
    let text = std::fs::read_to_string(&path).expect("an end");
    let (before, after) = text.split_once("\"ended_ms\":").expect("when");
    let after = after.trim_start_matches(|c: char| c.is_ascii_digit());
    std::fs::write(&path, format!("{before}\"ended_ms\":1{after}")).expect("written");
    let limits = Limits { sweeps_idle: Duration::from_secs(3600), ..Limits::default() };
    let running = start_kept(folder.path(), limits, LOCAL);
    block_on(async {
        let mut wire = running.client().await;
        // the task for old jobs runs at once, and then periodically
        tokio::time::sleep(Duration::from_millis(200)).await;
        assert_eq!(rows(&mut wire, &name).await.expect("its rows").0, whole);
    });
}
