//! Full disks: accepted states stay, a state that cannot be stored is reported, and bytes are counted as in the files.

use crate::command::{Bench, CANTILEVER, PLATE};
use crate::monitoring::{block_on, get, value};
use crate::stepping::Killed;
use bimorph::service::proto;
use std::path::Path;
use std::process::Command;

/// Bytes of all files under a folder.
fn bytes(folder: &Path) -> u64 {
    let entries = std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry"));
    let size = |entry: std::fs::DirEntry| entry.metadata().expect("there").len();
    entries.map(|entry| if entry.path().is_dir() { bytes(&entry.path()) } else { size(entry) }).sum()
}

/// From a given moment files may not grow beyond some bytes, as on a full disk. An accept is then rejected, and the
/// state before is there, also after a kill. With free space again the same step is taken once. The remains of a failed
/// write are counted, and removed with the session.
#[test]
fn a_disk_that_is_full() {
    block_on(async {
        let mut server = Killed::start("--metrics 127.0.0.1:0").await;
        let metrics = server.line("metrics on http://").trim_end_matches("/metrics").to_owned();
        let session = server.open().await;
        let known = server.attach(&session).await.step(0, 0).await.expect("steps").0.token;
        let next = server.attach(&session).await.step(1, known).await.expect("steps").0;
        let largest = std::fs::read_dir(server.bench.path("states/sessions")).expect("a folder");
        let largest = largest.map(|entry| entry.expect("an entry").metadata().expect("there").len()).max();
        limit_files(server.id(), &(largest.expect("files") - 1).to_string());
        let mut stream = server.attach(&session).await;
        for _ in 0..3 {
            let refused = stream.try_step(2, next.token).await.expect_err("no room");
            assert!(refused.contains("the state is not kept"), "{refused}");
        }
        let used = || value(&get(&metrics, "/metrics").1, "bimorph_kept_bytes");
        assert_eq!(used(), bytes(&server.bench.path("states")) as f64);
        limit_files(server.id(), "unlimited");
        let third = stream.step(2, next.token).await.expect("there is room again").0;
        assert_eq!(used(), bytes(&server.bench.path("states")) as f64);
        server.wire.close(proto::CloseRequest { session: session.clone() }).await.expect("closes");
        assert_eq!(used(), 0.0);

        // the same with a kill while the disk is full
        let other = server.open().await;
        let mut stream = server.attach(&other).await;
        assert_eq!(stream.step(0, 0).await.expect("steps").0.token, known);
        assert_eq!(stream.step(1, known).await.expect("steps").0, next);
        limit_files(server.id(), "100");
        stream.try_step(2, next.token).await.expect_err("no room");
        server.again().await;
        assert_eq!(server.attach(&other).await.step(2, next.token).await.expect("goes on").0, third);
    });
}

/// A job whose rows find the disk full ends with that for its error and the rows that have a place, which are there after a kill; the
/// server computes others, and counts bytes as files have them.
#[test]
fn a_job_on_a_disk_that_is_full() {
    block_on(async {
        let mut server = Killed::start("--metrics 127.0.0.1:0").await;
        let metrics = server.line("metrics on http://").trim_end_matches("/metrics").to_owned();
        let name = server.wire.submit_job(gaps(500_000)).await.expect("starts").into_inner().name;
        let fetch = proto::FetchJobRequest { name: name.clone(), first_row: 0, only_finished: false };
        let mut stream = server.wire.fetch_job(fetch).await.expect("a stream").into_inner();
        let mut rows = 0;
        let full = loop {
            let chunk = stream.message().await.expect("goes on").expect("goes on");
            if rows == 0 && !chunk.rows.is_empty() {
                limit_files(server.id(), "60000");
            }
            rows += chunk.rows.len() as u64;
            if let Some(job) = chunk.job {
                break job;
            }
        };
        let Some(proto::job::Result::Error(error)) = &full.result else { panic!("{full:?}") };
        assert_eq!(error.code, tonic::Code::ResourceExhausted as i32);
        assert!(error.message.contains("its rows are not kept: File too large"), "{}", error.message);
        assert!(rows > 0 && full.metadata.as_ref().is_some_and(|about| about.rows == rows));
        let small = server.wire.submit_job(gaps(5)).await.expect("the server goes on").into_inner().name;
        let watch = proto::WatchJobRequest { name: small.clone() };
        let mut watched = server.wire.watch_job(watch).await.expect("a stream").into_inner();
        while watched.message().await.expect("goes on").is_some_and(|job| !job.done) {}
        let used = value(&get(&metrics, "/metrics").1, "bimorph_kept_bytes");
        assert_eq!(used, bytes(&server.bench.path("states")) as f64);
        server.again().await;
        let kept =
            server.wire.get_job(proto::GetJobRequest { name: name.clone() }).await.expect("is kept").into_inner();
        assert_eq!((kept.result, kept.metadata.map(|about| about.rows)), (full.result, Some(rows)));
        for name in [name, small] {
            server.wire.delete_job(proto::DeleteJobRequest { name }).await.expect("deleted");
        }
        assert_eq!(bytes(&server.bench.path("states")), 0);
    });
}

/// Pull-in of the plate at so many gaps.
fn gaps(count: u32) -> proto::SubmitJobRequest {
    let linear = proto::Linear { low: 1.5e-6, high: 2.5e-6, count };
    let values = Some(proto::sweep_parameter::Values::Linear(linear));
    let pull_in = proto::SweepPullIn { port: "drive".into(), max_v: 30.0 };
    let spec = proto::SweepSpec {
        parameters: vec![proto::SweepParameter { name: "gap".into(), values }],
        analysis: Some(proto::sweep_spec::Analysis::PullIn(pull_in)),
        ..Default::default()
    };
    let bundle = bimorph::netlist::Bundle::from_text("plate.net", PLATE);
    proto::SubmitJobRequest {
        bundle: Some(bimorph::service::convert::model::bundle_to_wire(&bundle)),
        task: Some(proto::submit_job_request::Task::Sweep(spec)),
        ..Default::default()
    }
}

/// Files of a process may not grow beyond so many bytes from now on: prlimit(1).
fn limit_files(id: u32, most: &str) {
    let set = Command::new("prlimit").args(["--pid", &id.to_string(), &format!("--fsize={most}:")]).status();
    assert!(set.expect("prlimit is there").success());
}

/// A sweep whose disk is full ends with an error and no table; what was done is in its journal, and with --resume, when there is room,
/// the table has the bytes of one run.
#[test]
fn a_sweep_on_a_disk_that_is_full() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    let words = "sweep c.net --segments 1 --param F=1u:2u:400 --signals b.y --threads 2";
    let whole = bench.run(words);
    assert_eq!(whole.status, 0, "{}", whole.stderr);
    let limited = |most: usize| {
        let inner = bench.command(&format!("{words} --out w.csv --resume"));
        let mut outer = Command::new("prlimit");
        // as on a full disk, a write is refused; without the trap the system would end the program
        outer.arg(format!("--fsize={most}")).args(["sh", "-c", "trap '' XFSZ; exec \"$0\" \"$@\""]);
        outer.arg(inner.get_program()).args(inner.get_args()).current_dir(bench.path(""));
        let ran = outer.output().expect("it runs");
        (ran.status.code(), String::from_utf8_lossy(&ran.stderr).into_owned())
    };
    let mut before = 0;
    for most in [4000, 8000] {
        let (status, stderr) = limited(most);
        assert_eq!(status, Some(1), "{stderr}");
        assert!(stderr.contains("w.csv.journal"), "{stderr}");
        assert!(!bench.path("w.csv").exists());
        let kept = std::fs::metadata(bench.path("w.csv.journal")).expect("a journal").len();
        assert!(kept > before, "{kept} bytes, {before} before");
        before = kept;
    }
    let ended = bench.run(&format!("{words} --out w.csv --resume"));
    assert_eq!(ended.status, 0, "{}", ended.stderr);
    assert_eq!(std::fs::read_to_string(bench.path("w.csv")).expect("the table"), whole.stdout);
    assert_eq!(bench.files(), ["c.net", "w.csv"]);
}
