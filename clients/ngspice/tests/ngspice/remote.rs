//! The same decks with the model on a server, and what happens when the server goes away.

use crate::support::{all_decks, deck, deviation, real, run, skipped};
use bimorph::cosim::{CosimError, CosimOptions};
use bimorph::service::address::Address;
use bimorph::service::authentication::GuardFiles;
use bimorph::service::credentials::Access;
use bimorph::service::server::{self, ServeOptions};
use std::io::{Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, mpsc};
use std::thread;
use std::time::Duration;
use tempfile::TempDir;
use tokio::sync::oneshot;

/// A server on a Unix socket, stopped when dropped.
struct Serving {
    folder: TempDir,
    /// Its port.
    address: String,
    stop: Option<oneshot::Sender<()>>,
    thread: Option<thread::JoinHandle<()>>,
}

impl Serving {
    fn start() -> Self {
        Self::start_with(tempfile::tempdir().unwrap(), GuardFiles::default())
    }

    /// On its socket and at a free port, with the authentication of `guard`.
    fn start_with(folder: TempDir, guard: GuardFiles) -> Self {
        let (stop, stopped) = oneshot::channel::<()>();
        let (ready, is_ready) = mpsc::channel();
        let socket = format!("unix://{}", folder.path().join("server").display());
        let listen = vec![socket.parse().unwrap(), "127.0.0.1:0".parse().unwrap()];
        let ready = Box::new(move |bound: &[Address]| ready.send(bound[1].to_string()).unwrap());
        let options = ServeOptions { listen, guard, ready, ..ServeOptions::default() };
        let thread = thread::spawn(move || {
            let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build().unwrap();
            runtime.block_on(server::run(options, async { drop(stopped.await) })).unwrap();
        });
        let address = is_ready.recv().unwrap();
        Self { folder, address, stop: Some(stop), thread: Some(thread) }
    }

    fn socket(&self) -> PathBuf {
        self.folder.path().join("server")
    }
}

impl Drop for Serving {
    fn drop(&mut self) {
        drop(self.stop.take());
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Fault of a connection between client and server after so many bytes of replies.
#[derive(Clone, Copy, PartialEq)]
enum Fate {
    /// The connection breaks and nothing listens any more, as when the server is killed.
    Cut,
    /// Replies no longer arrive, as when the server hangs.
    Mute,
}

/// Forwards `at` to `server` until `after` bytes of replies.
fn line(at: &Path, server: PathBuf, fate: Fate, after: usize) {
    let listener = UnixListener::bind(at).unwrap();
    let (at, count) = (at.to_owned(), Arc::new(AtomicUsize::new(0)));
    let over = Arc::new(AtomicBool::new(false));
    thread::spawn(move || {
        for client in listener.incoming() {
            let (Ok(client), Ok(to_server)) = (client, UnixStream::connect(&server)) else { return };
            if fate == Fate::Cut && over.load(Ordering::SeqCst) {
                return;
            }
            let (mut up, mut up_to) = (client.try_clone().unwrap(), to_server.try_clone().unwrap());
            thread::spawn(move || {
                let _ = std::io::copy(&mut up, &mut up_to);
            });
            let (mut down, mut down_to) = (to_server, client);
            let (count, over, at) = (Arc::clone(&count), Arc::clone(&over), at.clone());
            thread::spawn(move || {
                let mut bytes = [0; 4096];
                while let Ok(n @ 1..) = down.read(&mut bytes) {
                    if count.fetch_add(n, Ordering::SeqCst) + n < after {
                        let _ = down_to.write_all(&bytes[..n]);
                    } else if fate == Fate::Cut {
                        over.store(true, Ordering::SeqCst);
                        let _ = std::fs::remove_file(&at);
                        let _ = down_to.shutdown(std::net::Shutdown::Both);
                        let _ = down.shutdown(std::net::Shutdown::Both);
                    }
                }
            });
        }
    });
}

fn on(socket: &Path, name: &str) -> CosimOptions {
    CosimOptions { deck: deck(name), remote: Some(format!("unix://{}", socket.display())), ..CosimOptions::default() }
}

/// In process and on a server the waveforms are the same to the last bit.
#[test]
fn a_server_gives_the_same_bits() {
    if skipped() {
        return;
    }
    let server = Serving::start();
    for name in ["comb_edges.cir", "noise.cir", "brownian.cir"] {
        let here = run(CosimOptions { deck: deck(name), ..CosimOptions::default() }).unwrap();
        let there = run(on(&server.socket(), name)).unwrap();
        assert_eq!(here.plots, there.plots, "{name}");
    }
}

/// A server with TLS and tokens (certificates of tests/tls): with credentials from the environment the bytes are those
/// of the process, and without a token the run ends with the server's message.
#[test]
fn a_deck_over_tls() {
    if skipped() {
        return;
    }
    let keys = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/tls");
    let folder = tempfile::tempdir().unwrap();
    let token_file = Some(folder.path().join("token"));
    std::fs::write(folder.path().join("token"), "ngspice 0123456789abcdef0123456789abcdef\n").unwrap();
    let (certificate, key) = (Some(keys.join("server.pem")), Some(keys.join("server.key")));
    let guard = GuardFiles { certificate, key, token_file: token_file.clone(), ..GuardFiles::default() };
    let server = Serving::start_with(folder, guard);
    let shown = Access { authority: Some(keys.join("authority.pem")), token_file, ..Access::default() };
    let with = |access: Access| CosimOptions {
        deck: deck("comb_edges.cir"),
        remote: Some(server.address.replace("https://", "https:")),
        environment: access.to_environment(),
        ..CosimOptions::default()
    };
    let here = run(CosimOptions { deck: deck("comb_edges.cir"), ..CosimOptions::default() }).unwrap();
    assert_eq!(here.plots, run(with(shown.clone())).unwrap().plots);
    let Err(CosimError::Stopped { reason, .. }) = run(with(Access { token_file: None, ..shown })) else {
        panic!("served without a token")
    };
    assert!(reason.contains("requires a token"), "{reason}");
}

/// The bank's deck in each formulation. On a server the waveforms are those of the process to the last bit. Two
/// formulations agree within 1e-3 of the range of each waveform: 7e-4 of the current, which has 150 times as much fast
/// motion as `v(y)`, on 705 unknowns. On a mesh of 132, which has less of it, they agree to 1.7e-5.
#[test]
fn formulations_agree_on_the_bank() {
    if skipped() {
        return;
    }
    let (server, folder) = (Serving::start(), all_decks());
    let text = std::fs::read_to_string(folder.path().join("bank.cir")).unwrap();
    assert!(text.contains("tol=1e-4") && text.contains(".tran 1u 1.2m 0 0.2u"));
    let [bodies, joints] = ["compliant", "rcr"].map(|formulation| {
        let deck = folder.path().join(format!("{formulation}.cir"));
        let text = text.replace("tol=1e-4", &format!("tol=1e-4 scheme=\"es\" formulation=\"{formulation}\""));
        std::fs::write(&deck, text.replace(".tran 1u 1.2m 0 0.2u", ".tran 1u 100u 0 0.2u")).unwrap();
        let remote = Some(format!("unix://{}", server.socket().display()));
        let here = run(CosimOptions { deck: deck.clone(), ..CosimOptions::default() }).unwrap();
        let there = run(CosimOptions { deck, remote, ..CosimOptions::default() }).unwrap();
        assert_eq!(here.plots, there.plots, "{formulation}");
        here
    });
    let (a, b) = (bodies.plot("Transient"), joints.plot("Transient"));
    for name in ["v(y)", "v(t)", "v(out)", "i(vsense)"] {
        let wave = |plot| (real(plot, "time"), real(plot, name));
        let apart = deviation(wave(a), wave(b), 0.0, 100e-6);
        assert!(apart < 1e-3, "{name}: {apart:e}");
        println!("{name}: {apart:.1e} of its range");
    }
}

/// The run stops with an error that names the instance and the address; `deadline` is 2 s in this deck.
fn stops(fate: Fate) {
    let server = Serving::start();
    let folder = tempfile::tempdir().unwrap();
    let socket = folder.path().join("line");
    line(&socket, server.socket(), fate, 20_000);
    match run(on(&socket, "comb_remote.cir")) {
        Err(CosimError::Stopped { reason, .. }) => {
            let head = format!("instance a1: server unix://{}: ", socket.display());
            assert!(reason.starts_with(&head), "{reason}");
            let what = match fate {
                Fate::Cut => "the connection broke: the server was stopped or killed, or crashed",
                Fate::Mute => "no answer within 2 s",
            };
            assert!(reason[head.len()..].starts_with(what), "{reason}");
        }
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("the run went on without its server"),
    }
}

/// A server killed in the middle of a transient ends it.
#[test]
fn a_killed_server_ends_the_run() {
    if !skipped() {
        stops(Fate::Cut);
    }
}

/// A server that is killed in the middle of a transient and comes back within the deadline, without any of its states,
/// continues where it was: the waveforms are those of the process to the last bit.
#[test]
fn a_server_that_comes_back_goes_on() {
    if skipped() {
        return;
    }
    let (first, second) = (Serving::start(), Serving::start());
    let folder = tempfile::tempdir().unwrap();
    let socket = folder.path().join("line");
    line(&socket, first.socket(), Fate::Cut, 20_000);
    let (at, server) = (socket.clone(), second.socket());
    let comes_back = thread::spawn(move || {
        while at.exists() {
            thread::sleep(Duration::from_millis(5));
        }
        thread::sleep(Duration::from_millis(200));
        line(&at, server, Fate::Mute, usize::MAX);
    });
    let there = run(on(&socket, "comb_remote.cir")).unwrap();
    comes_back.join().unwrap();
    let here = run(on(&first.socket(), "comb_remote.cir")).unwrap();
    assert_eq!(here.plots, there.plots);
}

/// A server that no longer answers ends it at the deadline.
#[test]
fn a_mute_server_ends_the_run() {
    if !skipped() {
        stops(Fate::Mute);
    }
}

/// Without a server the run does not start, and the message names the instance and the address.
#[test]
fn no_server() {
    if skipped() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let socket = folder.path().join("nobody");
    match run(on(&socket, "comb_edges.cir")) {
        Err(CosimError::Stopped { reason, .. }) => {
            let head = format!("instance a1 (model comb): server unix://{}: ", socket.display());
            assert!(reason.starts_with(&head), "{reason}");
        }
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("the run went on without a server"),
    }
}
