//! Log lines that never wait: a thread of its own writes them to standard error.
//!
//! Standard error may be a pipe without a reader. Neither may stop the service. Lines go through a queue of bounded
//! length, those beyond it are counted and dropped, and failed writes are ignored.

use std::io::{self, Write};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::Duration;

/// Lines that wait at most.
const QUEUE: usize = 1024;

static LINES: OnceLock<SyncSender<LogItem>> = OnceLock::new();
/// Lines dropped since the last that was written.
static DROPPED: AtomicUsize = AtomicUsize::new(0);
/// Lines dropped in all.
static LOST: AtomicU64 = AtomicU64::new(0);

enum LogItem {
    Text(Vec<u8>),
    /// Everything before this is written.
    Mark(SyncSender<()>),
}

/// Says one line, without waiting.
pub fn line(text: &str) {
    LogLines.put(format!("{text}\n").into_bytes());
}

/// Lines dropped because they were not read in time.
pub(super) fn dropped() -> u64 {
    LOST.load(Ordering::Relaxed)
}

/// Waits until the lines so far are written, but no longer than `most`.
pub(super) fn flush(most: Duration) {
    let (done, written) = sync_channel(1);
    if LINES.get().is_some_and(|lines| lines.try_send(LogItem::Mark(done)).is_ok()) {
        let _ = written.recv_timeout(most);
    }
}

/// A writer for the subscriber: each write is one line.
#[derive(Debug, Clone, Copy)]
pub(super) struct LogLines;

impl LogLines {
    fn put(self, text: Vec<u8>) {
        if queue().try_send(LogItem::Text(text)).is_err() {
            DROPPED.fetch_add(1, Ordering::Relaxed);
            LOST.fetch_add(1, Ordering::Relaxed);
        }
    }
}

impl Write for LogLines {
    fn write(&mut self, text: &[u8]) -> io::Result<usize> {
        self.put(text.to_vec());
        Ok(text.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn queue() -> &'static SyncSender<LogItem> {
    LINES.get_or_init(|| {
        let (sender, lines) = sync_channel(QUEUE);
        // without a thread the queue fills, and lines are dropped
        let _ = std::thread::Builder::new().name("log".into()).spawn(move || write(&lines));
        sender
    })
}

fn write(lines: &Receiver<LogItem>) {
    for item in lines {
        let text = match item {
            LogItem::Text(text) => text,
            LogItem::Mark(done) => {
                let _ = done.send(());
                continue;
            }
        };
        let dropped = DROPPED.swap(0, Ordering::Relaxed);
        let mut out = io::stderr();
        if dropped > 0 {
            let _ = writeln!(out, "… {dropped} lines of this log were dropped: they were not read in time");
        }
        let _ = out.write_all(&text);
    }
}
