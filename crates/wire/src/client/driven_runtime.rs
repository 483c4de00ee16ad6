//! An event loop driven by the waiting thread: a reply goes from the socket to the thread that sent the request,
//! without another wake-up. Where there is another core for the server, the waiting thread polls for the reply for a
//! while before it sleeps, since a wake-up costs more than the step of a small model. Between requests a thread of its
//! own drives the loop, so that network failures are detected.

use crate::waiting::wanted;
use std::future::Future;
use std::io;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::runtime::{Builder, EnterGuard, Runtime};
use tokio::sync::Notify;
use tonic::Status;

/// Idle time after which the thread takes over.
const LINGER: Duration = Duration::from_millis(5);
/// Turns of the loop in which what was sent reaches the socket: from the queue to the stream, from there to the connection.
const FLUSH: usize = 4;
/// Time of polling for a reply before the waiting thread sleeps.
const LOOK: Duration = Duration::from_micros(200);

/// The loop.
pub(super) struct DrivenRuntime {
    /// There until it is dropped.
    runtime: Option<Runtime>,
    state: Mutex<LoopState>,
    /// Signals the thread, while it does not drive the loop, that the runtime ends. It detects the idle state by
    /// polling.
    over: Condvar,
    /// Signals the thread while it drives the loop.
    asked: Notify,
    /// The last answer was there soon, on a machine with more than one core: the next may be, too.
    soon: AtomicBool,
    cores: usize,
}

#[derive(Default)]
struct LoopState {
    /// Threads that ask, which drive the loop.
    asking: usize,
    /// How often somebody did.
    asks: u64,
    over: bool,
}

/// Somebody asks.
struct ActiveRequest<'a>(&'a DrivenRuntime);

impl Drop for ActiveRequest<'_> {
    fn drop(&mut self) {
        self.0.state().asking -= 1;
    }
}

impl DrivenRuntime {
    /// A loop with its thread, which ends with [`DrivenRuntime::end`].
    pub(super) fn new() -> io::Result<Arc<Self>> {
        let runtime = Builder::new_current_thread().enable_all().build()?;
        fail_writes(&runtime)?;
        let (state, over, asked, soon) = (Mutex::default(), Condvar::new(), Notify::new(), AtomicBool::new(true));
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let new = Arc::new(Self { runtime: Some(runtime), state, over, asked, soon, cores });
        let driven = Arc::clone(&new);
        std::thread::Builder::new().name("bimorph-lines".into()).spawn(move || driven.attend())?;
        Ok(new)
    }

    /// Its thread ends. A waiting request still drives it.
    pub(super) fn end(&self) {
        self.state().over = true;
        self.over.notify_one();
        self.asked.notify_one();
    }

    fn state(&self) -> MutexGuard<'_, LoopState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// For what is to be begun on it.
    pub(super) fn enter(&self) -> Option<EnterGuard<'_>> {
        self.runtime.as_ref().map(Runtime::enter)
    }

    /// Waits for an answer for as long as it is wanted; what is dropped then has stopped.
    pub(super) fn wait<T>(
        &self,
        answer: impl Future<Output = Result<T, Status>>,
        waits: &dyn Fn() -> bool,
    ) -> Result<T, Status> {
        let runtime = self.runtime.as_ref().ok_or_else(|| Status::unavailable("it is over"))?;
        {
            let mut state = self.state();
            state.asking += 1;
            state.asks += 1;
        }
        let _asking = ActiveRequest(self);
        self.asked.notify_one();
        runtime.block_on(wanted(self.looked_for(answer), waits))
    }

    /// An answer that is looked for before it is waited for.
    async fn looked_for<T>(&self, answer: impl Future<Output = T>) -> T {
        let mut answer = std::pin::pin!(answer);
        let asked = Instant::now();
        if self.cores > 1 && self.soon.load(Ordering::Relaxed) {
            while asked.elapsed() < LOOK {
                tokio::select! {
                    biased;
                    answered = &mut answer => return answered,
                    () = tokio::task::yield_now() => {}
                }
            }
        }
        let answered = answer.await;
        self.soon.store(asked.elapsed() < 2 * LOOK, Ordering::Relaxed);
        answered
    }

    /// Sends what is on its way, and waits for nothing.
    pub(super) fn flush(&self) -> Result<(), Status> {
        let turns = async {
            for _ in 0..FLUSH {
                tokio::task::yield_now().await;
            }
            Ok(())
        };
        self.wait(turns, &|| true)
    }

    /// Drives the loop between requests.
    fn attend(&self) {
        let Some(runtime) = &self.runtime else { return };
        while self.rests() {
            runtime.block_on(self.asked.notified());
        }
    }

    /// Waits until the loop has been idle for a while; false where the runtime has ended.
    fn rests(&self) -> bool {
        let mut state = self.state();
        while !state.over {
            let asks = state.asks;
            state = self.over.wait_timeout(state, LINGER).unwrap_or_else(PoisonError::into_inner).0;
            if state.asking == 0 && state.asks == asks && !state.over {
                return true;
            }
        }
        false
    }
}

/// A write to a server that has gone fails. Its signal ends a host that is no Rust program, as ngspice is, unless it is handled.
#[cfg(unix)]
fn fail_writes(runtime: &Runtime) -> io::Result<()> {
    use tokio::signal::unix::{SignalKind, signal};
    let _inside = runtime.enter();
    signal(SignalKind::pipe()).map(drop)
}

/// Such a write has no signal here.
#[cfg(not(unix))]
fn fail_writes(_: &Runtime) -> io::Result<()> {
    Ok(())
}

impl Drop for DrivenRuntime {
    fn drop(&mut self) {
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_background();
        }
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    /// With a loop the signal of a broken pipe (13) is handled, so that it ends no process.
    #[test]
    fn broken_pipes_are_handled() {
        let driven = DrivenRuntime::new().unwrap();
        let status = std::fs::read_to_string("/proc/self/status").unwrap();
        let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:")).unwrap();
        let caught = u64::from_str_radix(caught.trim(), 16).unwrap();
        driven.end();
        assert_eq!(caught >> 12 & 1, 1, "{status}");
    }
}
