//! Files that a disk has changed by one bit, and commands that are killed: no number is wrong, and nothing is lost but the record that the bit is
//! in.

use crate::command::{Bench, CANTILEVER, PLATE};
use crate::monitoring::block_on;
use crate::serve_process::Server;
use crate::stepping::{Stream, client, compiled};
use crate::stored_sessions::{Numbers, kill_after};
use bimorph::netlist::Bundle;
use bimorph::service::convert::model::bundle_to_wire;
use bimorph::service::proto;
use proto::bimorph_client::BimorphClient;
use proto::device_request::Kind as Ask;
use proto::job_metadata::State;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;
use tonic::transport::Channel;
use tonic::{Code, Status};

/// Longest life of a command that is to be killed (µs).
const LONGEST_LIFE: u64 = 250_000;
/// Points of a sweep.
const POINTS: usize = 3000;
/// Accepted steps of a session.
const STEPS: usize = 6;
/// Rows of a job.
const ROWS: usize = 40;

/// Flips a bit.
fn flip(bytes: &mut [u8], bit: usize) {
    bytes[bit / 8] ^= 1 << (bit % 8);
}

/// Flips a random bit of a file, if it has any.
fn flip_one(path: &Path, numbers: &mut Numbers) -> bool {
    let Ok(mut bytes) = fs::read(path) else { return false };
    if bytes.is_empty() {
        return false;
    }
    let bit = numbers.below(8 * bytes.len() as u64);
    flip(&mut bytes, usize::try_from(bit).expect("a place"));
    fs::write(path, bytes).is_ok()
}

/// A command is killed repeatedly at any moment, and its journal has one bit changed after every other kill. It
/// continues each time, recomputes at most the damaged points, and its table has the bytes of one run.
fn kills_of_the_command(kills: usize) {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    let words = format!("sweep c.net --segments 40 --param F=1u:2u:{POINTS} --signals b.y --threads 2");
    let whole = bench.run(&words);
    assert_eq!(whole.status, 0, "{}", whole.stderr);
    let journal = bench.path("w.csv.journal");
    let lines = || fs::read(&journal).map_or(0, |bytes| bytes.iter().filter(|byte| **byte == b'\n').count());
    let (mut numbers, mut flips, mut tables, mut killed) = (Numbers(3), 0, 0, 0);
    while killed < kills {
        let before = lines();
        let mut child = bench.command(&format!("{words} --out w.csv --resume")).spawn().expect("the command starts");
        kill_after(child.id(), Duration::from_micros(numbers.below(LONGEST_LIFE)));
        let status = child.wait().expect("an end");
        let table = bench.path("w.csv");
        // it was done before it was killed, or after its table was whole and its journal gone
        if status.success() || (table.exists() && !journal.exists()) {
            assert_eq!(fs::read_to_string(bench.path("w.csv")).expect("the table"), whole.stdout);
            fs::remove_file(bench.path("w.csv")).expect("removed");
            tables += 1;
            continue;
        }
        assert_eq!(status.code(), None, "it was killed, and ended by nothing else");
        killed += 1;
        // a bit that makes a line of one, or one of two, costs these
        assert!(lines() + 2 >= before, "{before} lines, then {}", lines());
        if killed % 2 == 0 && flip_one(&journal, &mut numbers) {
            flips += 1;
        }
    }
    let there = lines();
    let ended = bench.run(&format!("{words} --out w.csv --resume"));
    assert_eq!(ended.status, 0, "{}", ended.stderr);
    assert_eq!(fs::read_to_string(bench.path("w.csv")).expect("the table"), whole.stdout);
    println!(
        "{kills} kills of the command, {flips} bits of its journal changed, {tables} tables meanwhile, {there} lines at the end"
    );
}

/// State of a server before the kill.
struct Before {
    session: String,
    replies: Vec<proto::TrialReply>,
    job: String,
    rows: Vec<proto::SweepRow>,
}

async fn rows(wire: &mut BimorphClient<Channel>, name: &str) -> Result<Vec<proto::SweepRow>, Status> {
    let request = proto::FetchJobRequest { name: name.to_owned(), ..Default::default() };
    let mut stream = wire.fetch_job(request).await?.into_inner();
    let mut rows = Vec::new();
    while let Some(chunk) = stream.message().await? {
        rows.extend(chunk.rows.into_iter().map(|row| row.row.expect("a row")));
    }
    rows.sort_by_key(|row| row.point);
    Ok(rows)
}

/// A session that is kept and a job that is done.
async fn made(wire: &mut BimorphClient<Channel>) -> Before {
    let model = compiled(wire).await;
    let open = proto::OpenRequest { model, signals: vec!["m.x".into()], ..Default::default() };
    let session = wire.open(open).await.expect("opens").into_inner().session;
    let attach = Ask::Attach(proto::Attach { session: session.clone() });
    let (mut stream, _) = Stream::start(wire, attach).await.expect("attaches");
    let (mut replies, mut parent) = (Vec::new(), 0);
    for step in 0..STEPS {
        let (reply, kept) = stream.step(step, parent).await.expect("steps");
        assert!(kept);
        parent = reply.token;
        replies.push(reply);
    }
    let linear = proto::Linear { low: 1.5e-6, high: 2.5e-6, count: u32::try_from(ROWS).expect("few") };
    let spec = proto::SweepSpec {
        parameters: vec![proto::SweepParameter {
            name: "gap".into(),
            values: Some(proto::sweep_parameter::Values::Linear(linear)),
        }],
        analysis: Some(proto::sweep_spec::Analysis::Static(proto::SweepStatic::default())),
        ..Default::default()
    };
    let submit = proto::SubmitJobRequest {
        bundle: Some(bundle_to_wire(&Bundle::from_text("plate.net", PLATE))),
        task: Some(proto::submit_job_request::Task::Sweep(spec)),
        request_id: "one".into(),
        ..Default::default()
    };
    let job = wire.submit_job(submit).await.expect("submitted").into_inner().name;
    let rows = rows(wire, &job).await.expect("all rows");
    assert_eq!(rows.len(), ROWS);
    Before { session, replies, job, rows }
}

/// State of a session and a job after a bit was changed; each has its numbers, or is rejected as damaged.
#[derive(Debug, Default, PartialEq)]
struct Left {
    /// Steps after which the session continues; `None`: it is rejected.
    steps: Option<usize>,
    job: bool,
}

async fn left(wire: &mut BimorphClient<Channel>, before: &Before) -> Left {
    let mut found = Left::default();
    let attach = Ask::Attach(proto::Attach { session: before.session.clone() });
    match Stream::start(wire, attach).await {
        Ok((mut stream, opened)) => {
            let at = before
                .replies
                .iter()
                .position(|reply| reply.token == opened.accepted)
                .expect("a state that was accepted");
            // and the next step has the bits that it had, or, of the last one, those of a session without a flip
            if let Some(next) = before.replies.get(at + 1) {
                let (reply, _) = stream.step(at + 1, opened.accepted).await.expect("it goes on");
                assert_eq!(&reply, next, "the state after step {at} is another one");
            }
            found.steps = Some(at + 1);
        }
        Err(status) => assert_eq!(status.code(), Code::DataLoss, "{status}"),
    }
    match rows(wire, &before.job).await {
        Ok(rows) => {
            assert_eq!(rows, before.rows, "its rows are those from before, or computed again to the same bits");
            let job =
                wire.get_job(proto::GetJobRequest { name: before.job.clone() }).await.expect("there").into_inner();
            assert_eq!(job.metadata.expect("metadata").state(), State::Done);
            found.job = true;
        }
        Err(status) => assert!([Code::DataLoss, Code::NotFound].contains(&status.code()), "{status}"),
    }
    found
}

/// Every file below a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() { found.extend(files(&path)) } else { found.push(path) }
    }
    found.sort();
    found
}

/// Bits of every file that a killed server leaves are changed, one at a time: the server starts, and of the session and the job is lost only
/// what the file held.
fn flips_in_what_a_server_keeps(flips: usize) {
    let bench = Bench::new(&[]);
    let options = format!("--listen unix://{} --state-dir states", bench.path("s").display());
    let mut server = Server::start(&bench, &options);
    let before = block_on(async { made(&mut client(&server.address).await).await });
    server.signal("-KILL");
    let folder = bench.path("states");
    let whole: BTreeMap<PathBuf, Vec<u8>> =
        files(&folder).into_iter().map(|path| (path.clone(), fs::read(path).expect("readable"))).collect();
    let put_back = || {
        for path in files(&folder).into_iter().filter(|path| !whole.contains_key(path)) {
            fs::remove_file(path).expect("removed");
        }
        whole.iter().for_each(|(path, bytes)| fs::write(path, bytes).expect("written"));
    };
    let tried = || {
        let mut server = Server::start(&bench, &options);
        let left = block_on(async { left(&mut client(&server.address).await, &before).await });
        server.signal("-KILL");
        left
    };
    assert_eq!(tried(), Left { steps: Some(STEPS), job: true }, "without a change nothing is lost");
    let (mut numbers, mut table) = (Numbers(8), BTreeMap::<String, [usize; 3]>::new());
    let paths: Vec<_> = whole.iter().filter(|(_, bytes)| !bytes.is_empty()).collect();
    assert!(paths.len() >= 6, "two of the session, its model, three of the job: {paths:?}");
    for k in 0..flips {
        let (path, bytes) = paths[k % paths.len()];
        put_back();
        let mut changed = bytes.clone();
        let bit = numbers.below(8 * bytes.len() as u64);
        flip(&mut changed, usize::try_from(bit).expect("a place"));
        fs::write(path, changed).expect("written");
        let left = tried();
        let folder = path.parent().and_then(Path::file_name).expect("a folder").to_string_lossy().into_owned();
        let kind =
            path.extension().map_or_else(|| folder.clone(), |end| format!("{folder} .{}", end.to_string_lossy()));
        let what = format!("bit {bit} of {}: {left:?}", path.display());
        match kind.as_str() {
            // the file before has the state before
            kind if kind.starts_with("sessions") => {
                assert!(left.job && left.steps.is_some_and(|steps| steps + 1 >= STEPS), "{what}");
            }
            // without its netlist a session cannot be woken, and says so
            "models" => assert!(left.job && left.steps.is_none(), "{what}"),
            "jobs .job" => assert_eq!(left.steps, Some(STEPS), "{what}"),
            // rows that are damaged, and the word of its end, are computed again
            _ => assert_eq!(left, Left { steps: Some(STEPS), job: true }, "{what}"),
        }
        let counts = table.entry(kind).or_default();
        counts[0] += 1;
        counts[1] += usize::from(left.steps != Some(STEPS));
        counts[2] += usize::from(!left.job);
    }
    for (kind, [changed, sessions, jobs]) in table {
        println!(
            "{kind}: {changed} bits changed; {sessions} times the session was at the state before or refused, {jobs} times the job refused"
        );
    }
}

/// Each bit of a snapshot that is changed is refused.
fn flips_in_snapshots(flips: usize) {
    let bench = Bench::new(&[]);
    let server = Server::start(&bench, &format!("--listen unix://{}", bench.path("s").display()));
    block_on(async {
        let mut wire = client(&server.address).await;
        let model = compiled(&mut wire).await;
        let open = proto::OpenRequest { model: model.clone(), ..Default::default() };
        let session = wire.open(open).await.expect("opens").into_inner().session;
        let attach = Ask::Attach(proto::Attach { session: session.clone() });
        let (mut stream, _) = Stream::start(&mut wire, attach).await.expect("attaches");
        stream.step(0, 0).await.expect("steps");
        let taken = proto::SnapshotRequest { session, token: 0 };
        let snapshot = wire.snapshot(taken).await.expect("a snapshot").into_inner().snapshot;
        let mut numbers = Numbers(21);
        for _ in 0..flips {
            let mut changed = snapshot.clone();
            let bit = numbers.below(8 * snapshot.len() as u64);
            flip(&mut changed, usize::try_from(bit).expect("a place"));
            let restore = proto::RestoreRequest { model: model.clone(), snapshot: changed };
            let refused = wire.restore(restore).await.expect_err("it is not that of a session");
            assert!(
                [Code::InvalidArgument, Code::FailedPrecondition].contains(&refused.code()),
                "bit {bit}: {refused}"
            );
        }
        println!("{flips} bits of a snapshot changed, each refused");
    });
}

/// Four kills of the command, a bit of every kind of file.
#[test]
fn a_few() {
    kills_of_the_command(4);
    flips_in_what_a_server_keeps(6);
    flips_in_snapshots(50);
}

/// Fifty kills and hundreds of bits: `make soak`.
#[test]
#[ignore = "a minute; make soak"]
fn soak_damage() {
    kills_of_the_command(50);
    flips_in_what_a_server_keeps(300);
    flips_in_snapshots(2000);
}
