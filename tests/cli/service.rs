//! `serve`, `sweep --to` and `doctor`.
#![cfg(unix)]

use crate::command::{Bench, CANTILEVER};
use crate::serve_process::Server;

/// A sweep through a server gives the bytes of the same sweep here; the server ends cleanly when it is interrupted.
#[test]
fn a_sweep_on_a_server() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    let address = format!("unix://{}", bench.path("s.sock").display());
    let mut server = Server::start(&bench, &format!("--listen {address}"));
    assert_eq!(server.address, address);
    let words = "sweep c.net --param F=1u:2u:4 --analysis modes --count 2";
    let (here, there) = (bench.run(words), bench.run(&format!("{words} --to {address}")));
    assert_eq!((here.status, there.status), (0, 0), "{}{}", here.stderr, there.stderr);
    assert_eq!(here.stdout, there.stdout);
    assert_eq!(server.signal("-INT"), Some(0));
    assert!(!bench.path("s.sock").exists());
}

/// A server says which port it was given.
#[test]
fn any_free_port() {
    let bench = Bench::new(&[]);
    let listening = &Server::start(&bench, "--listen 127.0.0.1:0").address;
    assert!(listening.starts_with("127.0.0.1:") && !listening.ends_with(":0"), "{listening}");
}

/// The doctor's verdict on the core and on a server of its own is good wherever these tests run.
#[test]
fn doctor() {
    let bench = Bench::new(&[]);
    let ran = bench.run("doctor");
    assert_eq!(ran.status, 0, "{}{}", ran.stdout, ran.stderr);
    for part in ["ok       core", "ok       server"] {
        assert!(ran.stdout.contains(part), "{}", ran.stdout);
    }
}
