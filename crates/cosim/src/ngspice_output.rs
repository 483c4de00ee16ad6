//! Output and exit of ngspice, and whether the run was good.

use super::error::CosimError;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;
use std::process::Child;
use std::time::Duration;

/// Output and exit status of ngspice.
pub(super) struct RunOutput {
    status: std::process::ExitStatus,
    aborted: Option<String>,
    nothing_run: bool,
    pub(super) cancelled: bool,
    pub(super) output: String,
}

/// Interval at which a run checks for cancellation.
const POLL_INTERVAL: Duration = Duration::from_millis(10);

/// Forwards ngspice's messages or captures them, and detects the ones that report a failure. Ends ngspice on
/// cancellation.
pub(super) fn listen(mut child: Child, capture: bool, keep_going: &dyn Fn() -> bool) -> std::io::Result<RunOutput> {
    let stdout = child.stdout.take().map(|mut out| {
        std::thread::spawn(move || {
            let mut bytes = Vec::new();
            out.read_to_end(&mut bytes).map(|_| bytes)
        })
    });
    let stderr = child.stderr.take().map(|err| std::thread::spawn(move || hear(err, capture)));
    let mut cancelled = false;
    let status = loop {
        if let Some(status) = child.try_wait()? {
            break status;
        }
        if !cancelled && !keep_going() {
            cancelled = true;
            child.kill()?;
        }
        std::thread::sleep(POLL_INTERVAL);
    };
    let mut output = match stdout.map(std::thread::JoinHandle::join) {
        Some(Ok(bytes)) => bytes?,
        _ => Vec::new(),
    };
    let (aborted, nothing_run, mut messages) = match stderr.map(std::thread::JoinHandle::join) {
        Some(Ok(heard)) => heard?,
        _ => (None, false, Vec::new()),
    };
    output.append(&mut messages);
    Ok(RunOutput { status, aborted, nothing_run, cancelled, output: String::from_utf8_lossy(&output).into_owned() })
}

pub(super) fn judge(heard: &RunOutput, failure: &Path, deck: &Path, has_control: bool) -> Result<(), CosimError> {
    let output = || heard.output.clone();
    if let Ok(reason) = std::fs::read_to_string(failure) {
        return Err(CosimError::Stopped { reason, output: output() });
    }
    if let Some(line) = &heard.aborted {
        return Err(CosimError::Failed { status: heard.status.to_string(), line: line.clone(), output: output() });
    }
    // ngspice ends with 1 when a deck's work was all done in .control and there are no other lines to run.
    match (heard.nothing_run, has_control) {
        (true, true) => Ok(()),
        (true, false) => Err(CosimError::NothingRun { deck: deck.to_owned() }),
        (false, _) if heard.status.success() => Ok(()),
        _ => Err(CosimError::Failed { status: heard.status.to_string(), line: String::new(), output: output() }),
    }
}

/// Messages of ngspice where it did not run a deck's request; the first of these lines is the reported reason.
const ABORTS: [&str; 4] =
    ["simulation(s) aborted", "MIF-ERROR", "circuit not parsed", "Simulation interrupted due to error"];

/// Message of ngspice about a query of an unknown quantity, before it saves a column of zeros for it.
fn unseen(text: &str) -> Option<String> {
    let (_, name) = text.split_once("unrecognized variable")?;
    let name = name.trim_start_matches([' ', '-']).trim();
    let of_part = name.get(..2).is_some_and(|start| start.eq_ignore_ascii_case("@a"));
    of_part.then(|| format!("nothing is called {name}: it would be saved as zeros; names are those of the part's signals, and hottest, closest, moved in process"))
}

/// The progress line of ngspice is not a message.
const PROGRESS: &str = "Reference value";

/// A line without what shows progress.
fn without_progress(line: &[u8]) -> Vec<u8> {
    let shows = |part: &&[u8]| !String::from_utf8_lossy(part).trim_start().starts_with(PROGRESS);
    line.split(|byte| *byte == b'\r').filter(shows).flatten().copied().collect()
}

/// Reads ngspice's messages to their end: the line that reports an abort, whether nothing was run, and the captured
/// text.
fn hear(stderr: impl Read, capture: bool) -> std::io::Result<(Option<String>, bool, Vec<u8>)> {
    let (mut aborted, mut nothing_run, mut messages) = (None, false, Vec::new());
    let mut stderr = BufReader::new(stderr);
    let mut line = Vec::new();
    while stderr.read_until(b'\n', &mut line)? > 0 {
        let text = String::from_utf8_lossy(&line);
        if ABORTS.iter().any(|words| text.contains(words)) {
            aborted.get_or_insert_with(|| text.trim().to_owned());
        }
        if let Some(reason) = unseen(&text) {
            aborted.get_or_insert(reason);
        }
        nothing_run |= text.contains("no simulations run");
        if capture {
            let line = without_progress(&line);
            let text = String::from_utf8_lossy(&line);
            let text = text.trim();
            // always printed: a misspelt option, which ngspice ignores, and the estimated error of a model
            let of_model = text.starts_with("bimorph: ") && text.contains(": warning[");
            if of_model || text.contains("unrecognized parameter") {
                let reported = if of_model { format!("{text}\n") } else { format!("warning: {text}\n") };
                let _ = std::io::stderr().write_all(reported.as_bytes());
            }
            messages.extend_from_slice(&line);
        } else {
            let _ = std::io::stderr().write_all(&line);
        }
        line.clear();
    }
    Ok((aborted, nothing_run, messages))
}
