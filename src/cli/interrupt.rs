//! Ctrl-C, or a request to terminate: long work stops at its next report of progress; anything else stops at once. No half-written file stays.

use bimorph::results::atomic;
use std::process::exit;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

static ASKED: AtomicBool = AtomicBool::new(false);
static POLLED: AtomicBool = AtomicBool::new(false);

/// Exit status of a process that a person interrupted.
const INTERRUPTED: i32 = 130;

/// Starts to listen for Ctrl-C. When that is not possible the system's own way of stopping stays in force.
pub(crate) fn listen() {
    std::thread::spawn(|| {
        let Ok(runtime) = tokio::runtime::Builder::new_current_thread().enable_all().build() else {
            return;
        };
        runtime.block_on(async {
            while signalled().await {
                // A second Ctrl-C, or work that does not ask, ends the process here.
                if ASKED.swap(true, Ordering::SeqCst) || !POLLED.load(Ordering::SeqCst) {
                    atomic::discard_unfinished();
                    exit(INTERRUPTED);
                }
            }
        });
    });
}

/// Waits for Ctrl-C or a request to terminate; false when neither can be heard.
async fn signalled() -> bool {
    #[cfg(unix)]
    if let Ok(mut terminate) = tokio::signal::unix::signal(tokio::signal::unix::SignalKind::terminate()) {
        return tokio::select! {
            heard = tokio::signal::ctrl_c() => heard.is_ok(),
            heard = terminate.recv() => heard.is_some(),
        };
    }
    tokio::signal::ctrl_c().await.is_ok()
}

/// True once a person asked to stop. Work that calls this promises to call it again soon.
pub(crate) fn asked() -> bool {
    POLLED.store(true, Ordering::SeqCst);
    ASKED.load(Ordering::SeqCst)
}

/// [`asked`] once more after a moment: a program that this one runs may hear Ctrl-C and end before it is noticed here.
pub(crate) fn asked_just_now() -> bool {
    asked() || {
        std::thread::sleep(Duration::from_millis(100));
        asked()
    }
}

/// Ends the promise of [`asked`]: from here on Ctrl-C stops the process at once.
pub(crate) fn no_longer_polled() {
    POLLED.store(false, Ordering::SeqCst);
}
