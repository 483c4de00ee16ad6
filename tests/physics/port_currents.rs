//! Currents into ports and charges on them during a run at held voltages.

use crate::{balance, close, model};
use bimorph::analysis::transient::{TransientOptions, TransientResult, transient};
use bimorph::compile::{CompileOptions, CompiledModel};

/// A damped plate of 0.1 ng on a spring of 1 N/m, 2 µm above an electrode of 1e-8 m², behind a divider of 2 kΩ and 1 kΩ.
const PLATE: &str = "
anchor * [f] []
mass2d * [m] [m=1e-10]
guide2d * [m] []
spring2d * [f m] [kx=1]
dashpot2d * [m] [bx=4e-6]
anchor * [e] []
plate plategap2d * [m e] [A=1e-8 gap=2u]
R * [s m] [R=2k]
R * [m e] [R=1k]
eground * [e] []
drive port * [s] []
";

fn run(compiled: &CompiledModel, signals: &[&str], events: &[(&str, f64)]) -> TransientResult {
    let options = TransientOptions {
        stop: 5e-4,
        points: 40_001,
        tol: 1e-7,
        signals: signals.iter().map(|name| (*name).to_owned()).collect(),
        voltages: vec![("drive".to_owned(), 9.0)],
        events: events.iter().map(|(name, level)| ((*name).to_owned(), *level)).collect(),
        ..TransientOptions::default()
    };
    transient(compiled, &options, &mut |_, _| {}, &mut |_| true).unwrap_or_else(|error| panic!("{error}"))
}

fn column<'a>(result: &'a TransientResult, name: &str) -> &'a [f64] {
    &result.signals.iter().find(|(n, _, _)| n == name).unwrap().2
}

/// A third of the 9 V lies across the gap, so a third of its charge counts at the port, by reciprocity. The current is 9 V/3 kΩ and the rate of
/// that charge: its integral is the charge that came. In the end charge and current are those of the equilibrium.
#[test]
fn the_current_is_conduction_and_rate_of_charge() {
    let compiled = model(PLATE, &CompileOptions::default());
    let result = run(&compiled, &["drive.i", "drive.q", "plate.q", "m.x"], &[]);
    let units: Vec<&str> = result.signals.iter().map(|(_, unit, _)| unit.as_str()).collect();
    assert_eq!(units, ["A", "C", "C", "m"]);
    let (i, q, of_gap) = (column(&result, "drive.i"), column(&result, "drive.q"), column(&result, "plate.q"));
    let moved = column(&result, "m.x").iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    assert!(moved > 5e-8, "{moved:e}");
    for (port, gap) in q.iter().zip(of_gap) {
        close(*port, gap / 3.0, 1e-12);
    }
    let conduction = 9.0 / 3e3;
    let mut came = 0.0;
    for k in 1..i.len() {
        came += (0.5 * (i[k] + i[k - 1]) - conduction) * (result.t[k] - result.t[k - 1]);
        // the trapezoidal rule has h²/12 of the change of slope
        assert!((came - (q[k] - q[0])).abs() < 1e-5 * (q[q.len() - 1] - q[0]).abs(), "{}", result.t[k]);
    }
    let displacement = i.iter().fold(0.0, |most: f64, i| most.max((i - conduction).abs()));
    assert!(displacement > 1e-11, "{displacement:e}");
    let rest = balance(&compiled, &[("drive", 9.0)]);
    close(q[q.len() - 1], rest.charges_c[0].1, 1e-5);
    close(i[i.len() - 1], rest.currents_a[0].1, 1e-7);
}

/// The current passes through the conduction where the plate turns back: at the crossings of its velocity through zero.
#[test]
fn crossings_of_a_current_are_found() {
    let text = PLATE.replace("bx=4e-6", "bx=1e-7");
    let compiled = model(&text, &CompileOptions::default());
    let conduction = 9.0 / 3e3;
    let result = run(&compiled, &["m.x"], &[("drive.i", conduction), ("m.vx", 0.0)]);
    let times = |name: &str| -> Vec<f64> {
        result.events.iter().filter(|event| event.signal == name && event.t > 1e-6).map(|event| event.t).collect()
    };
    let (currents, turns) = (times("drive.i"), times("m.vx"));
    assert!(turns.len() >= 2 && currents.len() == turns.len(), "{currents:?} {turns:?}");
    for (current, turn) in currents.iter().zip(&turns) {
        close(*current, *turn, 1e-6);
    }
}

/// A gap named as a port keeps its name: `PORT.q` is the charge on the port only where no gap has that name. Unknown names are rejected with the ports.
#[test]
fn names_of_gaps_come_first() {
    let compiled = model(&PLATE.replace("plate plategap2d", "drive plategap2d"), &CompileOptions::default());
    let result = run(&compiled, &["drive.q", "drive.i"], &[]);
    close(column(&result, "drive.q")[0], 3.0 * 8.854e-12 * 1e-8 / 2e-6, 1e-3);
    let options = TransientOptions { signals: vec!["drove.i".into()], ..TransientOptions::default() };
    let error = transient(&compiled, &options, &mut |_, _| {}, &mut |_| true).unwrap_err().to_string();
    assert!(error.contains("drove.i") && error.contains("PORT.i, PORT.q, with the ports drive"), "{error}");
}
