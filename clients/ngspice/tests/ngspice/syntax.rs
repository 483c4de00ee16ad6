//! How a `.model` line is read, as ngspice leaves it.

use crate::support::{analytic_deck, analytic_plugin, skipped};
use bimorph::cosim::{self, CosimError, CosimOptions};

/// Writes a deck with this `.model` parameter list and instance, runs it, and returns the error's text, if any.
fn refused(parameters: &str, instance: &str) -> Option<String> {
    let folder = tempfile::tempdir().unwrap();
    let deck = folder.path().join("deck.cir");
    let text = format!(
        "* syntax\nVd d 0 1\nVs s 0 1\n{instance}\nR1 x 0 1k\n.model m bimorph({parameters})\n.op\n.print op v(d)\n.end\n"
    );
    std::fs::write(&deck, text).unwrap();
    let options = CosimOptions { deck, plugin: Some(analytic_plugin()), capture: true, ..CosimOptions::default() };
    match cosim::run(&options, &|| true) {
        Ok(_) => None,
        Err(CosimError::Stopped { reason, .. }) => Some(reason),
        Err(CosimError::Failed { output, .. }) => Some(output),
        Err(other) => Some(other.to_string()),
    }
}

const PLAIN: &str = "A1 %gd [d 0 s 0] %v [x] m";

/// Common forms are accepted: quotes, case, lists, settings, several forms of ports.
#[test]
fn accepted_forms() {
    if skipped() {
        return;
    }
    for (parameters, instance) in [
        (r#"file="plate" ports=["drive" "sense"] monitors=["plate.x:1e6"]"#, PLAIN),
        (
            r#"file="plate" monitors=["plate.x"] set=["w=2.1u" "F=0"] tol=1e-4 band=1e6 linear=true undamped=true junctions="offset""#,
            PLAIN,
        ),
        (r#"file="plate" monitors=["plate.x"] set=["w:2.1u" "mode:fast"] deadline=2"#, PLAIN),
        (r#"file="plate""#, "A1 %gd [d 0 s 0] null m\nR2 x d 1k"),
        (r#"file="plate""#, "A1 %g [d s] null m\nR2 x d 1k"),
        (r#"file="plate" monitors=["plate.x"]"#, "A1 %gd [d 0 s 0] %vd [x d] m"),
    ] {
        assert_eq!(refused(parameters, instance), None, "{parameters}");
    }
}

/// Invalid input is rejected before the analysis starts, with the instance, the model, and the fault.
#[test]
fn refusals() {
    if skipped() {
        return;
    }
    let head = "instance a1 (model m): ";
    for (parameters, instance, want) in [
        (r#"monitors=["plate.x"]"#, PLAIN, "the .model line names no netlist; write file=\"NAME.net\""),
        (r#"file="plate" monitors=["plate.y"]"#, PLAIN, "\"plate\": no signal named \"plate.y\"; there is plate.x"),
        (
            r#"file="plate" ports=["a"] monitors=["plate.x"]"#,
            PLAIN,
            "ports: the .model line names 1, but the instance connects 2",
        ),
        (r#"file="plate""#, PLAIN, "monitors: the .model line names 0, but the instance connects 1"),
        (r#"file="plate" monitors=["plate.x"] tol=-1"#, PLAIN, "tol: expected a number above 0, below 1, got -1"),
        (
            r#"file="plate" monitors=["plate.x"] set=["w"]"#,
            PLAIN,
            "set: \"w\" has no value; write set=[\"NAME=VALUE\" …]",
        ),
    ] {
        assert_eq!(refused(parameters, instance), Some(format!("{head}{want}")), "{parameters}");
    }
}

/// A deck that is not there is an error.
#[test]
fn no_deck() {
    let options = CosimOptions {
        deck: analytic_deck("none.cir"),
        ngspice: Some("ngspice".into()),
        plugin: Some(analytic_plugin()),
        capture: true,
        ..CosimOptions::default()
    };
    assert!(matches!(cosim::run(&options, &|| true), Err(CosimError::Deck { .. })));
}

/// ngspice does not run a deck whose analyses print nothing without a raw file: an error, not silence.
#[test]
fn nothing_to_run() {
    if skipped() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let deck = folder.path().join("deck.cir");
    std::fs::write(&deck, "* silent\nV1 a 0 1\nR1 a 0 1\n.tran 1u 10u\n.end\n").unwrap();
    let options = CosimOptions { deck, plugin: Some(analytic_plugin()), capture: true, ..CosimOptions::default() };
    assert!(matches!(cosim::run(&options, &|| true), Err(CosimError::NothingRun { .. })));
}
