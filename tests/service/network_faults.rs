//! A network that fails: a way between clients and a server that goes silent, is reset, ends within a message, or holds back what
//! it was given until others have gone on.

use super::test_server::DEADLINE;
use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::watch;

/// Numbers without chance: SplitMix64 (Steele, Lea, Flood 2014).
pub(crate) struct Numbers(pub u64);

impl Numbers {
    pub(crate) fn below(&mut self, most: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) % most
    }
}

/// Fault of a connection.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Fate {
    /// No data pass any more, and neither end is notified.
    Silent,
    /// Both ends receive a reset.
    Reset,
    /// It ends, politely, within what was being sent.
    Half,
    /// Nothing passes any more, but what the client said last arrives when other connections have gone on for a while.
    Late,
}

const FATES: [Fate; 4] = [Fate::Silent, Fate::Reset, Fate::Half, Fate::Late];
/// Bytes that others exchange before what was held back arrives.
const HELD_BACK: u64 = 1500;

/// Fault of one connection, and after how many bytes of which end: of the client (0) or the server (1).
#[derive(Debug, Clone, Copy)]
struct Plan {
    fate: Fate,
    end: usize,
    after: u64,
}

/// Such a network to one server.
pub(crate) struct Cut {
    /// Where clients go.
    pub address: SocketAddr,
    shared: Arc<Shared>,
    over: watch::Sender<bool>,
    thread: Option<JoinHandle<()>>,
}

struct Shared {
    chance: Mutex<Numbers>,
    /// Most bytes before it fails.
    most: u64,
    calm: AtomicBool,
    /// Connections that failed, by fate.
    failed: [AtomicU64; 4],
    carried: watch::Sender<u64>,
}

impl Cut {
    /// A proxy to `server` whose connections fail after at most so many bytes, at random by the seed.
    pub(crate) fn to(server: SocketAddr, seed: u64, most: u64) -> Self {
        let shared = Arc::new(Shared {
            chance: Mutex::new(Numbers(seed)),
            most,
            calm: AtomicBool::new(false),
            failed: Default::default(),
            carried: watch::Sender::new(0),
        });
        let (over, end) = watch::channel(false);
        let (ready, bound) = std::sync::mpsc::channel();
        let theirs = Arc::clone(&shared);
        let thread = std::thread::spawn(move || {
            let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().expect("a runtime");
            runtime.block_on(async {
                let listener = TcpListener::bind("127.0.0.1:0").await.expect("a port");
                ready.send(listener.local_addr().expect("an address")).expect("the test waits");
                let mut ended = end.clone();
                loop {
                    let client = tokio::select! {
                        accepted = listener.accept() => accepted.expect("a connection").0,
                        _ = ended.wait_for(|over| *over) => return,
                    };
                    tokio::spawn(carry(client, server, Arc::clone(&theirs), end.clone()));
                }
            });
        });
        let address = bound.recv_timeout(DEADLINE).expect("it listens");
        Self { address, shared, over, thread: Some(thread) }
    }

    /// Address for clients.
    pub(crate) fn uri(&self) -> String {
        format!("http://{}", self.address)
    }

    /// From now on nothing fails that has not failed yet.
    pub(crate) fn calm(&self) {
        self.shared.calm.store(true, Ordering::SeqCst);
    }

    /// Connections that failed.
    pub(crate) fn failed(&self) -> u64 {
        self.shared.failed.iter().map(|count| count.load(Ordering::SeqCst)).sum()
    }

    /// How they failed, in words.
    pub(crate) fn reported(&self) -> String {
        let reported =
            FATES.iter().zip(&self.shared.failed).map(|(fate, n)| format!("{fate:?} {}", n.load(Ordering::SeqCst)));
        reported.collect::<Vec<_>>().join(", ").to_lowercase()
    }
}

impl Drop for Cut {
    fn drop(&mut self) {
        let _ = self.over.send(true);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn plan(&self) -> Plan {
        let mut chance = self.chance.lock().expect("nobody panicked");
        let fate = FATES[chance.below(4) as usize];
        let end = if fate == Fate::Late { 0 } else { chance.below(2) as usize };
        Plan { fate, end, after: chance.below(self.most) }
    }
}

/// Carries what both ends say, until the plan is due.
async fn carry(mut client: TcpStream, server: SocketAddr, shared: Arc<Shared>, mut over: watch::Receiver<bool>) {
    let Ok(mut server) = TcpStream::connect(server).await else { return };
    let plan = shared.plan();
    let mut passed = [0; 2];
    let mut said = [vec![0; 4096], vec![0; 4096]];
    let [from_client, from_server] = &mut said;
    loop {
        let (end, read) = tokio::select! {
            read = client.read(from_client) => (0, read),
            read = server.read(from_server) => (1, read),
            _ = over.wait_for(|over| *over) => return,
        };
        // the other end detects a closed connection
        let Ok(bytes @ 1..) = read else { return };
        let words = if end == 0 { &from_client[..bytes] } else { &from_server[..bytes] };
        passed[end] += bytes as u64;
        let other = if end == 0 { &mut server } else { &mut client };
        if end != plan.end || passed[end] <= plan.after || shared.calm.load(Ordering::SeqCst) {
            if other.write_all(words).await.is_err() {
                return;
            }
            shared.carried.send_modify(|carried| *carried += bytes as u64);
            continue;
        }
        shared.failed[plan.fate as usize].fetch_add(1, Ordering::SeqCst);
        let half = bytes - (passed[end] - plan.after) as usize;
        match plan.fate {
            Fate::Silent => {}
            Fate::Reset => {
                let _ = (client.set_zero_linger(), server.set_zero_linger());
                return;
            }
            Fate::Half => {
                let _ = other.write_all(&words[..half]).await;
                return;
            }
            Fate::Late => {
                let due = *shared.carried.borrow() + HELD_BACK;
                let mut carried = shared.carried.subscribe();
                tokio::select! {
                    _ = carried.wait_for(|carried| *carried >= due) => {}
                    _ = over.wait_for(|over| *over) => return,
                }
                let _ = server.write_all(words).await;
            }
        }
        let _ = over.wait_for(|over| *over).await;
        return;
    }
}
