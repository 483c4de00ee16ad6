//! A server that lies: whatever it answers, the run ends within the deadline of its device with one error that names instance and server,
//! and no character that controls a terminal passes.

use crate::faulty_server::serve;
use crate::support::{run_text, skipped};
use bimorph::cosim::{self, CosimError};
use std::time::{Duration, Instant};

/// Longest wait of the device for an answer (s).
const DEADLINE: u64 = 2;
/// Further time of a run: its start, its end, and a loaded machine.
const AROUND: Duration = Duration::from_secs(8);

/// Each lie, and what is said of it.
const LIES: [(&str, &str); 27] = [
    ("compile controls", "line"),
    ("compile ports", "port: expected a name"),
    ("compile nothing", "described no model"),
    ("open kind", "another kind"),
    ("open ports", "ports: expected the 2 requested"),
    ("nan", "currents[0]: expected a finite number, got NaN"),
    ("inf", "charges[0]: expected a finite number, got inf"),
    ("sizes", "currents: expected 2 numbers, got 7"),
    ("none", "di_dv: expected 4 numbers, got 0"),
    ("short", "charges: expected 2 numbers, got 0"),
    ("big", ""),
    ("token 0", "token: expected one, got 0"),
    ("need dt", "need_dt"),
    ("need 0", "need_dt: expected less than the step"),
    ("need nan", "need_dt: expected less than the step"),
    ("need more", "need_dt: expected less than the step"),
    ("next 0", "dt_next: expected a time above"),
    ("next below 0", "dt_next: expected a time above"),
    ("next tiny", "dt_next: expected a time above"),
    ("next nan", "dt_next: expected a time above"),
    ("status", "trial status 99 is not known"),
    ("fails", "why"),
    ("kind", "another kind"),
    ("empty", "a kind that is not known, or of none"),
    ("fault huge", ""),
    ("fault controls", "\\u{1b}"),
    ("close", "the server ended the stream"),
];

fn deck(socket: &str) -> String {
    format!(
        "* a comb on a server that lies\nVd d 0 SIN(0 5 1k)\nVs s 0 dc 10\nA1 %gd [d 0 s 0] %v [x] comb\n\
         .model comb bimorph(file=\"comb.net\" ports=[\"drive\" \"sense\"] monitors=[\"m.x:1e6\"] remote=\"{socket}\" \
         deadline={DEADLINE})\n.tran 1u 30u\n.end\n"
    )
}

/// The error of a deck's run, and how long it took.
fn reported(lie: &'static str) -> (String, Duration) {
    let folder = tempfile::tempdir().unwrap();
    let socket = folder.path().join("s");
    serve(lie, &socket);
    let ngspice = cosim::find_ngspice().unwrap();
    let begun = Instant::now();
    let error = match run_text(&deck(&format!("unix:{}", socket.display())), &ngspice) {
        Err(CosimError::Stopped { reason, .. }) => reason,
        Err(other) => other.to_string(),
        Ok(_) => "the run went on".to_owned(),
    };
    (error, begun.elapsed())
}

/// Every lie, one after another.
#[test]
fn lies_end_a_run_and_are_named() {
    if skipped() {
        return;
    }
    let mut wrong = Vec::new();
    for (lie, what) in LIES {
        let (error, took) = reported(lie);
        println!("{lie:16} {:5.1} s  {}", took.as_secs_f64(), error.chars().take(160).collect::<String>());
        // a device without an equilibrium is a valid reply, from any server
        let named = error.contains("instance a1") && (lie == "fails" || error.contains("server unix:"));
        let clean = !error.chars().any(|c| c.is_control() && c != '\n' && c != '\t') && error.len() < 70_000;
        if !named || !clean || !error.contains(what) || took > Duration::from_secs(DEADLINE) + AROUND {
            wrong.push(format!("{lie}, after {took:?}: {}", error.chars().take(400).collect::<String>()));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// One that says nothing to a trial ends it at the deadline.
#[test]
fn a_server_that_never_answers_ends_a_run() {
    if skipped() {
        return;
    }
    let (error, took) = reported("never");
    assert!(error.contains("instance a1") && error.contains("no answer within 2 s"), "{error}");
    assert!(took < Duration::from_secs(DEADLINE) + AROUND, "{took:?}");
}

/// Without a lie the run comes to its end.
#[test]
fn the_truth_is_taken() {
    if skipped() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let socket = folder.path().join("s");
    serve("", &socket);
    run_text(&deck(&format!("unix:{}", socket.display())), &cosim::find_ngspice().unwrap()).unwrap();
}
