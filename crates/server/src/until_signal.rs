//! A server on threads of its own, until a signal or the end of its standard input stops it.

use super::log::{self, LogLines};
use super::serve_options::{ServeError, ServeOptions};
use super::server::run;
use std::io::IsTerminal;
use std::sync::Arc;
use std::time::Duration;
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::sync::Notify;
use tracing_subscriber::filter::{LevelFilter, Targets};
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

/// How long the last log lines may take to be written.
const LAST_WORDS: Duration = Duration::from_millis(200);
/// SIGXFSZ, on Linux and on BSDs.
const FILE_TOO_LARGE: i32 = 25;

/// [`run`] on threads of its own, until SIGINT or SIGTERM, or the end of standard input with
/// [`ServeOptions::while_stdin`]: the function behind `bimorph serve`. A second signal stops at once. SIGHUP reads
/// tokens and certificates again. Events are logged on standard error: warnings and faults, or the level of the
/// environment variable `BIMORPH_LOG` (`info`, `debug`, …).
///
/// # Errors
/// [`ServeError`].
pub fn run_until_signal(options: ServeOptions) -> Result<(), ServeError> {
    let wanted = std::env::var("BIMORPH_LOG").ok().and_then(|text| text.parse::<Targets>().ok());
    let filter = wanted.unwrap_or_else(|| Targets::new().with_default(LevelFilter::WARN));
    // A host program that logs already keeps its logger.
    let ansi = std::io::stderr().is_terminal();
    let log = tracing_subscriber::fmt().with_max_level(LevelFilter::TRACE).with_writer(|| LogLines);
    let _ = match options.log_json {
        true => log.json().flatten_event(true).with_span_list(false).finish().with(filter).try_init(),
        false => log.with_ansi(ansi).finish().with(filter).try_init(),
    };
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build().map_err(ServeError::Runtime)?;
    let outcome = runtime.block_on(async {
        let mut interrupt = signal(SignalKind::interrupt()).map_err(ServeError::Runtime)?;
        let mut terminate = signal(SignalKind::terminate()).map_err(ServeError::Runtime)?;
        // a file-size limit is an error of the writer, like a full disk, and does not end the server
        let _too_large = signal(SignalKind::from_raw(FILE_TOO_LARGE));
        let hangup = signal(SignalKind::hangup()).map_err(ServeError::Runtime)?;
        tokio::spawn(reload_on(hangup, Arc::clone(&options.reload)));
        let input = input_ends(options.while_stdin);
        let (first, reported) = tokio::sync::oneshot::channel();
        let mut serving = std::pin::pin!(run(options, async {
            let _ = reported.await;
        }));
        tokio::select! {
            outcome = &mut serving => return outcome,
            _ = interrupt.recv() => {}
            _ = terminate.recv() => {}
            () = input => {}
        }
        let _ = first.send(());
        tokio::select! {
            outcome = &mut serving => outcome,
            _ = interrupt.recv() => Ok(()),
            _ = terminate.recv() => Ok(()),
        }
    });
    // An abandoned computation must not hold the process.
    runtime.shutdown_background();
    log::flush(LAST_WORDS);
    outcome
}

/// Resolves when standard input ends; never without `asked`.
async fn input_ends(asked: bool) {
    let (ended, end) = tokio::sync::oneshot::channel::<()>();
    let reader = move || {
        let _ = std::io::copy(&mut std::io::stdin().lock(), &mut std::io::sink());
        drop(ended);
    };
    if asked && std::thread::Builder::new().name("stdin".into()).spawn(reader).is_ok() {
        let _ = end.await;
    } else {
        std::future::pending::<()>().await;
    }
}

/// SIGHUP, whenever it comes, reads tokens and certificates again.
async fn reload_on(mut hangup: Signal, reload: Arc<Notify>) {
    while hangup.recv().await.is_some() {
        reload.notify_one();
    }
}
