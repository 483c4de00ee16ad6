//! `bimorph serve` in a process of its own, with another client that calls `Info` while it is attacked.

use super::test_server::DEADLINE;
use bimorph::service::proto;
use proto::bimorph_client::BimorphClient;
use std::io::{BufRead, BufReader, Read};
use std::ops::{Deref, DerefMut};
use std::process::{Child, ChildStderr, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tonic::transport::{Channel, Endpoint};

/// Largest memory under any attack (kB).
const MAX_MEMORY_KB: u64 = 1 << 20;
/// Processor time that it may still use when its callers are gone (s).
const MAX_AFTER_S: f64 = 3.0;
/// The stranger's longest wait. The aim is 250 ms for 99 of 100. Machines that run tests are loaded, so that this is
/// printed, and only the wait of a frozen event loop fails the test.
const LONGEST_WAIT: Duration = Duration::from_secs(5);

/// A client of the attacked server.
#[derive(Clone)]
pub(crate) struct Wire {
    client: BimorphClient<Channel>,
    address: String,
}

impl Deref for Wire {
    type Target = BimorphClient<Channel>;
    fn deref(&self) -> &Self::Target {
        &self.client
    }
}

impl DerefMut for Wire {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.client
    }
}

impl Wire {
    async fn connect(address: &str) -> Self {
        let endpoint = Endpoint::from_shared(format!("http://{address}")).expect("a uri");
        let channel = endpoint.connect().await.expect("the server answers");
        let client = BimorphClient::new(channel).max_encoding_message_size(64 << 20);
        Self { client, address: address.to_owned() }
    }

    /// A connection of its own.
    pub(crate) async fn again(&self) -> Self {
        Self::connect(&self.address).await
    }

    /// A connection that says these bytes and nothing more.
    pub(crate) async fn raw(&self, words: &[u8]) -> TcpStream {
        let mut socket = TcpStream::connect(&self.address).await.expect("connects");
        // the server may have closed it to make room
        let _ = socket.write_all(words).await;
        socket
    }

    /// A `Check` whose message is announced with `announced` bytes and sent up to `sent`, as far as the server lets it.
    pub(crate) async fn half_sent(&self, announced: u32, sent: usize) -> TcpStream {
        let mut socket = self.raw(GREETING).await;
        let _ = socket.write_all(&check_headers(1)).await;
        let mut message = announcement(announced).to_vec();
        message.resize(5 + sent, b' ');
        for chunk in message.chunks(16_000) {
            let framed = frame(0, 0, 1, chunk);
            let written = socket.write_all(&framed);
            if !matches!(tokio::time::timeout(Duration::from_millis(300), written).await, Ok(Ok(()))) {
                break;
            }
            // the server's bytes, windows among them, are ignored
            let mut said = [0; 4096];
            let _ = socket.try_read(&mut said);
        }
        let _ = tokio::time::timeout(Duration::from_millis(1), socket.read(&mut [0; 64])).await;
        socket
    }

    /// A connection with so many calls of `Check`, each of which announces so many bytes and sends none of them.
    pub(crate) async fn announcing(&self, calls: u32, announced: u32) -> TcpStream {
        let mut words = GREETING.to_vec();
        for stream in (0..calls).map(|call| 2 * call + 1) {
            words.extend(check_headers(stream));
            words.extend(frame(0, 0, stream, &announcement(announced)));
        }
        self.raw(&words).await
    }
}

/// The preface of HTTP/2 and settings without any.
const GREETING: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n\0\0\0\x04\0\0\0\0\0";

/// Head of a gRPC message.
fn announcement(bytes: u32) -> [u8; 5] {
    let [a, b, c, d] = bytes.to_be_bytes();
    [0, a, b, c, d]
}

/// A frame of HTTP/2.
fn frame(kind: u8, flags: u8, stream: u32, body: &[u8]) -> Vec<u8> {
    let mut out = (body.len() as u32).to_be_bytes()[1..].to_vec();
    out.extend([kind, flags]);
    out.extend(stream.to_be_bytes());
    out.extend(body);
    out
}

/// Begins a call of `Check`.
fn check_headers(stream: u32) -> Vec<u8> {
    let mut headers = Vec::new();
    for (name, value) in [
        (":method", "POST"),
        (":scheme", "http"),
        (":authority", "localhost"),
        (":path", "/bimorph.v1.Bimorph/Check"),
        ("content-type", "application/grpc"),
        ("te", "trailers"),
    ] {
        // a literal header without indexing (RFC 7541, §6.2.2)
        headers.push(0);
        for text in [name, value] {
            headers.push(text.len() as u8);
            headers.extend(text.bytes());
        }
    }
    frame(1, 4, stream, &headers)
}

/// A netlist as it travels.
pub(crate) fn netlist(text: &str) -> Option<proto::Bundle> {
    Some(proto::Bundle { root: "a.net".into(), files: [("a.net".to_owned(), text.to_owned())].into() })
}

/// Reader of the server's log.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Reader {
    Reads,
    /// Keeps the pipe, and reads nothing.
    Stalls,
    /// Closes it.
    Leaves,
}

/// The attacked server.
pub(crate) struct Victim {
    process: Child,
    address: String,
    _log: Option<BufReader<ChildStderr>>,
}

impl Victim {
    /// Runs an attack and judges what it did.
    pub(crate) fn attacked(name: &str, attack: impl AsyncFnOnce(&mut Wire)) {
        Self::attacked_before(Reader::Reads, name, attack);
    }

    /// As above with a given reader of the log, which receives everything unless it is inactive.
    pub(crate) fn attacked_before(reader: Reader, name: &str, attack: impl AsyncFnOnce(&mut Wire)) {
        let mut victim = Self::start(reader);
        let stop = Arc::new(AtomicBool::new(false));
        let stranger = std::thread::spawn({
            let (address, stop) = (victim.address.clone(), Arc::clone(&stop));
            move || stranger(&address, &stop)
        });
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
        runtime.block_on(async {
            let mut wire = Wire::connect(&victim.address).await;
            tokio::time::timeout(6 * DEADLINE, attack(&mut wire)).await.expect("the attack ends");
        });
        drop(runtime);
        let before = victim.cpu_s();
        victim.rests();
        let after = victim.cpu_s() - before;
        stop.store(true, Ordering::Relaxed);
        let mut waits = stranger.join().expect("the stranger is served");
        waits.sort();
        let at = |share: f64| waits[((waits.len() - 1) as f64 * share) as usize];
        let (p99, worst) = (at(0.99), at(1.0));
        let memory = victim.status_kb("VmHWM:");
        let stopped = victim.stop();
        println!(
            "{name}: {} Infos, p50 {:.1?}, p99 {p99:.1?}, worst {worst:.1?}; {} MB at most; {after:.2} s of processor \
             afterwards; stopped in {stopped:.1?}",
            waits.len(),
            at(0.5),
            memory / 1024
        );
        assert!(memory < MAX_MEMORY_KB, "{name}: {memory} kB");
        assert!(after < MAX_AFTER_S, "{name}: {after} s");
        assert!(worst < LONGEST_WAIT, "{name}: {worst:?}");
    }

    /// A server with these further options, without an attack.
    pub(crate) fn started(options: &[&str]) -> Self {
        Self::start_with(Reader::Reads, options)
    }

    /// A client of it.
    pub(crate) async fn wire(&self) -> Wire {
        Wire::connect(&self.address).await
    }

    fn start(reader: Reader) -> Self {
        Self::start_with(reader, &[])
    }

    fn start_with(reader: Reader, options: &[&str]) -> Self {
        Self::spawn(reader, Command::new(env!("CARGO_BIN_EXE_bimorph")), options)
    }

    /// The same in an address space of so many gigabytes.
    pub(crate) fn within(gigabytes: u32, options: &[&str]) -> Self {
        let mut shell = Command::new("sh");
        let script = format!("ulimit -v {} && exec \"$0\" \"$@\"", gigabytes << 20);
        shell.args(["-c", &script, env!("CARGO_BIN_EXE_bimorph")]);
        Self::spawn(Reader::Reads, shell, options)
    }

    fn spawn(reader: Reader, mut command: Command, options: &[&str]) -> Self {
        let mut process = command
            .args(["serve", "--listen", "127.0.0.1:0"])
            .args(options)
            .env("BIMORPH_LOG", if reader == Reader::Reads { "warn" } else { "trace" })
            .stderr(Stdio::piped())
            .spawn()
            .expect("the server starts");
        let mut log = BufReader::new(process.stderr.take().expect("standard error"));
        let address = log.by_ref().lines().map_while(Result::ok).find_map(|line| {
            let address = line.strip_prefix("listening on ")?;
            Some(address.to_owned())
        });
        let address = address.expect("it listens");
        let _log = match reader {
            Reader::Reads => {
                std::thread::spawn(move || log.lines().map_while(Result::ok).for_each(drop));
                None
            }
            Reader::Stalls => Some(log),
            Reader::Leaves => None,
        };
        Self { process, address, _log }
    }

    /// Waits until it has used less than 20 ms of processor in half a second, at most for a minute.
    fn rests(&self) {
        for _ in 0..120 {
            let before = self.cpu_s();
            std::thread::sleep(Duration::from_millis(500));
            if self.cpu_s() - before < 0.02 {
                return;
            }
        }
    }

    /// The most that it has held (kB).
    pub(crate) fn peak_kb(&self) -> u64 {
        self.status_kb("VmHWM:")
    }

    /// Where it listens.
    pub(crate) fn address(&self) -> &str {
        &self.address
    }

    /// Its present memory (kB).
    pub(crate) fn memory_kb(&self) -> u64 {
        self.status_kb("VmRSS:")
    }

    /// Open file descriptors.
    pub(crate) fn descriptors(&self) -> usize {
        std::fs::read_dir(format!("/proc/{}/fd", self.process.id())).expect("it is alive").count()
    }

    /// Processor time so far (s).
    pub(crate) fn cpu_s(&self) -> f64 {
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", self.process.id())).expect("it is alive");
        let fields: Vec<&str> = stat.rsplit(')').next().expect("fields").split_whitespace().collect();
        // user and system time in hundredths of a second, fields 14 and 15 of proc(5)
        fields[11..13].iter().map(|ticks| ticks.parse::<f64>().expect("a number") / 100.0).sum()
    }

    fn status_kb(&self, field: &str) -> u64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.process.id())).expect("it is alive");
        let line = status.lines().find_map(|line| line.strip_prefix(field)).expect("the field");
        line.split_whitespace().next().and_then(|kb| kb.parse().ok()).expect("a number")
    }

    /// One signal stops it; returns the time that it takes.
    fn stop(&mut self) -> Duration {
        let start = Instant::now();
        let id = self.process.id().to_string();
        assert!(Command::new("kill").args(["-TERM", &id]).status().is_ok_and(|status| status.success()));
        while start.elapsed() < DEADLINE {
            if let Some(status) = self.process.try_wait().expect("a child") {
                assert!(status.success(), "{status}");
                return start.elapsed();
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        panic!("it does not stop");
    }
}

impl Drop for Victim {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Calls `Info` until it is stopped; returns the time of each call.
fn stranger(address: &str, stop: &AtomicBool) -> Vec<Duration> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
    runtime.block_on(async {
        let mut wire = Wire::connect(address).await;
        let mut waits = Vec::new();
        while !stop.load(Ordering::Relaxed) {
            let start = Instant::now();
            wire.info(proto::InfoRequest {}).await.expect("an answer");
            waits.push(start.elapsed());
            // often idle for a moment, as strangers are
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
        waits
    })
}
