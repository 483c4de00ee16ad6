//! A machine may lose its power at any moment of a job. A confirmed job is still there with every row that was sent,
//! and a job reported as ended has ended.

use super::super::power_cuts::{Machine, UnsyncedBytes};
use super::super::store::SessionStore;
use super::folder::{self, JobOutcome, StoredJob};
use super::job_origin::JobOrigin;
use bimorph_jobs::durable::disk::Disk;
use bimorph_jobs::sweep::journal::JournalRow;
use std::sync::Arc;

const ID: &str = "0123456789abcdef0123456789abcdef";
const REQUEST: &[u8] = b"what was asked";

fn asked() -> JobOrigin {
    JobOrigin {
        owner: String::new(),
        request: "by name".into(),
        content: String::new(),
        share: false,
        release_after_s: 0.0,
        sequence: 1,
        submitted_ms: 0,
        version: "0".into(),
        sweep: "00000000000000000000000000000002".into(),
        part: String::new(),
        model: String::new(),
        netlist: "a.net".into(),
        points: 12,
    }
}

fn row(point: usize) -> JournalRow {
    let values = vec![("yoke.y".into(), "m".into(), Some(1e-9 / (1 + point) as f64))];
    JournalRow { point, values, estimated_error: Some(1e-4), warning: "w".repeat(30 * point), error: None }
}

/// Confirmed operations.
#[derive(Debug, Clone, Copy)]
enum Answered {
    Job,
    Rows(usize),
    End,
}

/// Whenever the power goes, and whatever becomes of what was not waited for.
#[test]
fn nothing_that_a_job_gave_out_is_lost_with_the_power() {
    let folder = tempfile::tempdir().expect("a folder");
    let store = Arc::new(SessionStore::open_on(Disk::recording(), folder.path(), 1 << 20).expect("opens"));
    let done = || store.disk().operations();
    let mut answered = Vec::new();
    let mut file = folder::begin(&store, ID, &asked(), REQUEST).expect("there is room");
    assert!(file.open().expect("opens").is_empty());
    answered.push((Answered::Job, done().len()));
    for (first, last) in [(0, 1), (1, 5), (5, 6), (6, 12)] {
        file.append(&(first..last).map(row).collect::<Vec<_>>()).expect("kept");
        answered.push((Answered::Rows(last), done().len()));
    }
    let end = JobOutcome { code: 0, message: String::new(), rows: 12, failed: 0, ended_ms: 7, bytes: 0 };
    file.end(&end).expect("kept");
    answered.push((Answered::End, done().len()));
    drop(file);
    let done = done();
    for power in 0..=done.len() {
        let machine = Machine::after(&done[..power]);
        let before = || answered.iter().filter(|(_, when)| *when <= power).map(|(what, _)| *what);
        let rows = before().filter_map(|what| if let Answered::Rows(n) = what { Some(n) } else { None }).max();
        for bytes in UnsyncedBytes::ALL {
            for new_names in [false, true] {
                let case = format!("{bytes:?}, {new_names}, after {power} of {}", done.len());
                let found = machine.found(folder.path(), bytes, new_names);
                let store = Arc::new(SessionStore::open(found.path(), true, 1 << 20).expect("opens"));
                let Some(StoredJob { asked: known, request, end, mut file, .. }) = folder::find(&store, ID) else {
                    assert_eq!(before().count(), 0, "lost: {case}");
                    continue;
                };
                assert_eq!((&known, &*request), (&asked(), REQUEST), "{case}");
                let ended = before().any(|what| matches!(what, Answered::End));
                assert!(!ended || end.as_ref().is_some_and(|end| end.bytes == file.row_bytes()), "continues: {case}");
                // an end that is there says how many rows there are, and so they are
                let all = end.filter(|end| end.bytes == file.row_bytes()).map(|_| file.read_rows().expect(&case));
                let there = file.open().unwrap_or_else(|error| panic!("{error}: {case}"));
                // the sent rows in their order, then unsent ones; each once, and unchanged
                let points: Vec<usize> = there.iter().map(|kept| kept.point).collect();
                let reported = rows.unwrap_or(0);
                assert!(points.iter().take(reported).copied().eq(0..reported), "{points:?} of {reported} rows: {case}");
                assert!(
                    points.is_sorted_by(|a, b| a < b) && there.iter().all(|kept| *kept == row(kept.point)),
                    "{case}"
                );
                assert!(all.is_none_or(|all| all.len() == 12), "{case}");
            }
        }
    }
}
