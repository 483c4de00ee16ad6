//! Where a server listens: private sockets, no stolen paths, no open networks by accident.

use super::test_server::{Running, start};
use bimorph::device::{Device, OpenRequest};
use bimorph::service::address::Address;
use bimorph::service::limits::Limits;
use bimorph::service::server::{ServeError, ServeOptions, run};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

fn unix(path: &Path) -> Running {
    start(&format!("unix://{}", path.display()), Limits::default())
}

/// Tries to listen and stops at once when it can.
fn attempt(address: &str, insecure: bool) -> Result<(), ServeError> {
    let options = ServeOptions { listen: vec![address.parse().expect("an address")], insecure, ..Default::default() };
    super::test_server::block_on(run(options, std::future::ready(())))
}

/// A Unix socket has mode 0600, serves, and is gone when the server has stopped.
#[test]
fn a_socket_is_private_and_leaves_with_its_server() {
    let dir = tempfile::tempdir().expect("a directory");
    let path = dir.path().join("b.sock");
    let mut server = unix(&path);
    let mode = std::fs::metadata(&path).expect("there").permissions().mode();
    assert_eq!(mode & 0o777, 0o600);
    server.device().open(&OpenRequest::default()).expect("serves");
    server.stop().expect("a clean stop");
    assert_eq!(std::fs::read_dir(dir.path()).expect("a directory").count(), 0);
}

/// A live server's socket is not taken; a dead one's is; a file that is no socket is left alone.
#[test]
fn paths_are_not_stolen() {
    let dir = tempfile::tempdir().expect("a directory");
    let path = dir.path().join("b.sock");
    let uri = format!("unix://{}", path.display());
    let server = unix(&path);
    let taken = attempt(&uri, false).expect_err("is in use");
    assert!(matches!(taken, ServeError::InUse { .. }), "{taken}");
    server.device().open(&OpenRequest::default()).expect("the first still serves");
    drop(server);

    drop(std::os::unix::net::UnixListener::bind(&path).expect("binds"));
    assert!(path.exists(), "a stale socket file");
    unix(&path).device().open(&OpenRequest::default()).expect("serves in its place");

    std::fs::write(&path, "notes").expect("written");
    assert!(matches!(attempt(&uri, false), Err(ServeError::NotASocket { .. })));
    assert_eq!(std::fs::read_to_string(&path).expect("there"), "notes");
}

/// A server that was killed while it bound its socket leaves a folder named after its process: the next of that identifier, which in a
/// container is always 1, starts all the same.
#[test]
fn what_a_killed_server_left_is_no_obstacle() {
    let dir = tempfile::tempdir().expect("a directory");
    std::fs::create_dir(dir.path().join(format!(".{}", std::process::id()))).expect("made");
    unix(&dir.path().join("b.sock")).device().open(&OpenRequest::default()).expect("serves");
}

/// A TCP address beyond this machine needs --insecure, and the message says why.
#[test]
fn open_networks_need_a_word() {
    let refused = attempt("0.0.0.0:0", false).expect_err("is refused");
    assert!(refused.to_string().contains("--insecure"), "{refused}");
    attempt("0.0.0.0:0", true).expect("is allowed");
}

/// Port 0 becomes the port that was given.
#[test]
fn port_zero_is_replaced() {
    let server = start("127.0.0.1:0", Limits::default());
    let Address::Tcp(address) = server.address else { panic!("a TCP address") };
    assert_ne!(address.port(), 0);
}

/// A directory that is not there is an error that names the address.
#[test]
fn impossible_paths_are_named() {
    let error = attempt("unix:///nonexistent/b.sock", false).expect_err("cannot be").to_string();
    assert!(error.contains("unix:///nonexistent/b.sock"), "{error}");
}
