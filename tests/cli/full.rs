//! Disks that are full: what was accepted stays, what cannot be kept is told, and bytes are counted as files have them.

use crate::overseen::{block_on, get, value};
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

/// From a moment on files may not grow beyond some bytes, as on a full disk: an accept is refused, the state before is there, also
/// after a kill, and when there is room again the same step is taken once. What a failed write left is counted, and goes with the session.
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

/// Files of a process may not grow beyond so many bytes from now on: prlimit(1).
fn limit_files(id: u32, most: &str) {
    let set = Command::new("prlimit").args(["--pid", &id.to_string(), &format!("--fsize={most}:")]).status();
    assert!(set.expect("prlimit is there").success());
}
