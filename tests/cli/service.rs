//! `serve`, `sweep --to` and `doctor`.
#![cfg(unix)]

use crate::bench::{Bench, CANTILEVER};
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

/// A server that is stopped when the test ends.
struct Server(Child);

impl Server {
    /// Starts `bimorph serve` and waits until it says that it listens.
    fn start(bench: &Bench, address: &str) -> (Self, String) {
        let mut command = bench.command("serve --listen");
        let mut child = command.arg(address).stderr(Stdio::piped()).spawn().expect("the server starts");
        let stderr = BufReader::new(child.stderr.take().expect("standard error"));
        let line =
            stderr.lines().map_while(Result::ok).find_map(|l| l.strip_prefix("listening on ").map(str::to_owned));
        (Self(child), line.expect("it listens"))
    }

    fn interrupt(&mut self) -> Option<i32> {
        let id = self.0.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().is_ok_and(|s| s.success()));
        self.0.wait().expect("it ends").code()
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A sweep through a server gives the bytes of the same sweep here; the server ends cleanly when it is interrupted.
#[test]
fn a_sweep_on_a_server() {
    let bench = Bench::new(&[("c.net", CANTILEVER)]);
    let address = format!("unix://{}", bench.path("s.sock").display());
    let (mut server, listening) = Server::start(&bench, &address);
    assert_eq!(listening, address);
    let words = "sweep c.net --param F=1u:2u:4 --analysis modes --count 2";
    let (here, there) = (bench.run(words), bench.run(&format!("{words} --to {address}")));
    assert_eq!((here.status, there.status), (0, 0), "{}{}", here.stderr, there.stderr);
    assert_eq!(here.stdout, there.stdout);
    assert_eq!(server.interrupt(), Some(0));
    assert!(!bench.path("s.sock").exists());
}

/// A server says which port it was given.
#[test]
fn any_free_port() {
    let bench = Bench::new(&[]);
    let (_server, listening) = Server::start(&bench, "127.0.0.1:0");
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
