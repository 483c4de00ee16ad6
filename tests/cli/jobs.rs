//! `bimorph sweep --to` and `bimorph jobs`: the bytes of the same sweep in this process, with any client waiting or
//! disconnecting.

use crate::command::{Bench, PLATE};
use crate::serve_process::Server;
use std::process::{Command, Stdio};

const SWEEP: &str = "sweep plate.net --analysis pullin --max 30 --param gap=1.5u:2.5u";

/// A table from a server is that of this process: waited for, attached to, a shard with its part, and shared.
#[test]
fn tables_are_those_of_this_process() {
    let bench = Bench::new(&[("plate.net", PLATE)]);
    let server = Server::start(&bench, "--listen unix://s");
    let to = format!("--to {}", server.address);
    let here = bench.run(&format!("{SWEEP}:30"));
    let there = bench.run(&format!("{SWEEP}:30 {to}"));
    assert_eq!((there.status, &there.stdout, &there.stderr), (0, &here.stdout, &here.stderr), "{}", there.stderr);
    let list = |count: usize| {
        let listed = bench.run(&format!("jobs list {to}"));
        assert_eq!(
            (listed.status, listed.stdout.lines().count()),
            (0, count + 1),
            "{}{}",
            listed.stdout,
            listed.stderr
        );
        listed.stdout
    };
    list(0);
    for shard in ["", "--shard 1/3"] {
        let here = bench.run(&format!("{SWEEP}:30 {shard}")).stdout;
        let detached = bench.run(&format!("{SWEEP}:30 {shard} {to} --detach"));
        let name = detached.stdout.trim_end();
        assert!(detached.status == 0 && name.len() == 37 && name.starts_with("jobs/"), "{}", detached.stderr);
        let attached = bench.run(&format!("jobs attach {name} {to}"));
        assert_eq!((attached.status, &attached.stdout), (0, &here), "{}", attached.stderr);
        assert!(list(1).contains("plate.net"));
        assert_eq!(bench.run(&format!("jobs delete {name} {to}")).status, 0);
        list(0);
        let gone = bench.run(&format!("jobs attach {name} {to}"));
        assert!(gone.status == 1 && gone.stderr.contains("no job"), "{}", gone.stderr);
    }
    let shared = |_| bench.run(&format!("{SWEEP}:5 {to} --share --detach")).stdout;
    assert_eq!(shared(0), shared(1));
    list(1);
    for wrong in ["--detach", "--share", "--release-after 5"] {
        assert_eq!(bench.run(&format!("{SWEEP}:5 {wrong}")).status, 2, "{wrong} is nothing without --to");
    }
    assert!(bench.run(&format!("{SWEEP}:5 {to} --release-after 0")).stderr.contains("from 1 ms"));
}

/// Ctrl-C detaches from a sweep and prints how to continue. The sweep runs until it is cancelled, and its finished
/// points form a table all the same.
#[test]
fn ctrl_c_detaches_from_a_sweep() {
    let bench = Bench::new(&[("plate.net", PLATE)]);
    let server = Server::start(&bench, "--listen unix://s");
    let to = format!("--to {}", server.address);
    let mut command = bench.command(&format!("{SWEEP}:500000 {to} --out w.csv"));
    let child = command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("starts");
    let rows = |listed: &str| -> Option<u64> {
        let line = listed.lines().nth(1)?;
        line.split_whitespace().find(|word| word.ends_with("/500000"))?.split('/').next()?.parse().ok()
    };
    let listed = loop {
        let listed = bench.run(&format!("jobs list {to}")).stdout;
        if rows(&listed).is_some_and(|rows| rows > 0) {
            break listed;
        }
    };
    assert!(listed.contains("running"), "{listed}");
    let name = listed.lines().nth(1).and_then(|line| line.split_whitespace().next()).expect("a name").to_owned();
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().is_ok_and(|status| status.success()));
    let ended = child.wait_with_output().expect("it ends");
    let said = String::from_utf8_lossy(&ended.stderr).into_owned();
    assert_eq!(ended.status.code(), Some(130), "{said}");
    assert!(said.contains(&format!("bimorph jobs attach {name} --to {}", server.address)), "{said}");
    assert!(bench.run(&format!("jobs list {to}")).stdout.contains("running"));
    assert_eq!(bench.run(&format!("jobs cancel {name} {to}")).status, 0);
    let attached = bench.run(&format!("jobs attach {name} {to} --out w.csv"));
    assert_eq!(attached.status, 1);
    assert!(attached.stderr.contains("cancelled"), "{}", attached.stderr);
    let table = std::fs::read_to_string(bench.path("w.csv")).expect("the rows that there are");
    assert!(table.starts_with("point,gap,") && table.lines().count() > 1);
}
