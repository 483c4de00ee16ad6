//! Inspection by a designer: `show a1` and `@a1[…]`, without monitors, on every ngspice at hand.

use crate::support::{deck, real, run_text, versions};
use bimorph::cosim::{self, CosimOptions};
use std::path::Path;

/// ε·A of the plate (F·m), its gap (m) and stiffness (N/m): tests/decks/damped_plate.net.
const PLATE: (f64, f64, f64) = (8.854e-12 * 1e-8, 2e-6, 1.0);

const HEAD: &str = "* plate and heater\nVd a 0 dc 2 PULSE(2 3 1u 1u)\nVh h 0 1\n\
    A1 %gd [a 0] %v [x] plate\nA2 %gd [h 0] null heater\n\
    .model plate bimorph(file=\"damped_plate.net\" monitors=[\"m.x:1e6\"])\n\
    .model heater bimorph(file=\"heater.net\")\n";

/// Output of ngspice on a deck with these commands in `.control`.
fn said(ngspice: &Path, commands: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    for name in ["damped_plate.net", "heater.net"] {
        std::fs::copy(deck(name), folder.path().join(name)).unwrap();
    }
    let path = folder.path().join("deck.cir");
    std::fs::write(&path, format!("{HEAD}.control\n{commands}\nquit\n.endc\n.end\n")).unwrap();
    let options = CosimOptions { deck: path, ngspice: Some(ngspice.into()), capture: true, ..CosimOptions::default() };
    cosim::run(&options, &|| true).unwrap_or_else(|e| panic!("{e}")).output
}

/// The number printed behind `NAME = `.
fn number(output: &str, name: &str) -> f64 {
    let line = output.lines().find_map(|l| l.trim().strip_prefix(name)?.trim().strip_prefix('='));
    line.and_then(|v| v.trim().parse().ok()).unwrap_or_else(|| panic!("no {name} in\n{output}"))
}

/// At an operating point displacement, gap left, capacitance, force, charge and unknowns are those of the plate's own equations:
/// C = εA/(g − x), F = ½CV²/(g − x) = k·x, q = CV.
#[test]
fn an_operating_point_shows_what_the_plate_is_like() {
    for (version, ngspice) in versions() {
        let names = ["m.x", "gap.gap", "gap.c", "gap.f", "drive.q", "drive.v", "unknowns", "moved", "closest"];
        let asked: Vec<String> = names.iter().map(|name| format!("@a1[{name}]")).collect();
        let output = said(&ngspice, &format!("op\nset numdgt=12\nprint v(x) {}", asked.join(" ")));
        let of = |name: &str| number(&output, &format!("@a1[{name}]"));
        let (strength, gap, stiffness) = PLATE;
        let (x, volts) = (of("m.x"), 2.0);
        let capacitance = strength / (gap - x);
        let expected = [
            ("m.x", number(&output, "v(x)") * 1e-6),
            ("gap.gap", gap - x),
            ("gap.c", capacitance),
            ("gap.f", 0.5 * capacitance * volts * volts / (gap - x)),
            ("drive.q", capacitance * volts),
            ("drive.v", volts),
            ("unknowns", 1.0),
            ("moved", x),
            ("closest", gap - x),
        ];
        for (name, want) in expected {
            assert!((of(name) / want - 1.0).abs() < 1e-9, "ngspice {version}: {name} is {}, expected {want}", of(name));
        }
        assert!((of("gap.f") / (stiffness * x) - 1.0).abs() < 1e-6, "ngspice {version}: {output}");
    }
}

/// `show` lists an instance's numbers, and ends no run; a name that an instance does not have is an error of `print` alone.
#[test]
fn show_lists_numbers_and_unknown_names_are_reported() {
    for (version, ngspice) in versions() {
        let output =
            said(&ngspice, "op\nshow a1\nshow a2 : hottest\nprint @a1[nothing.x]\nprint @a2[gap.gap]\necho on");
        for name in ["unknowns", "closest", "drive.q", "m.x", "hottest"] {
            assert!(output.lines().any(|l| l.trim_start().starts_with(name)), "ngspice {version}: {name}\n{output}");
        }
        let refusals = output.lines().filter(|l| l.contains("no such parameter")).count();
        assert_eq!(refusals, 2, "ngspice {version}: {output}");
        assert!(output.lines().any(|l| l.trim() == "on"), "ngspice {version}: {output}");
    }
}

/// `.save @a1[…]` follows any signal through a transient and a sweep: the displacement that a monitor shows, within Newton's
/// tolerance; a velocity that adds up to it; and the current that the source delivers.
#[test]
fn saved_quantities_follow_the_run() {
    for (version, ngspice) in versions() {
        let text = |analysis: &str| {
            let more = ".save all @a1[m.x] @a1[m.vx] @a1[drive.i] @a1[gap.f] @a2[hot.t] @a1[points]";
            format!("{HEAD}{more}\n{analysis}\n.end\n")
        };
        let run = run_text(&text(".tran 0.1u 20u"), &ngspice).unwrap_or_else(|e| panic!("ngspice {version}: {e}"));
        let plot = run.plot("Transient");
        let column = |name: &str| real(plot, name).to_vec();
        let (t, shown, x) = (column("time"), column("v(x)"), column("v(@a1[m.x])"));
        for (i, (x, shown)) in x.iter().zip(&shown).enumerate() {
            assert!((x * 1e6 - shown).abs() < 1e-6, "ngspice {version}: point {i}: {x} m, {shown} um");
        }
        let (range, velocity) = (x[x.len() - 1] - x[0], column("v(@a1[m.vx])"));
        let area: f64 = (1..t.len()).map(|i| 0.5 * (velocity[i] + velocity[i - 1]) * (t[i] - t[i - 1])).sum();
        assert!((area / range - 1.0).abs() < 1e-3, "ngspice {version}: velocity adds up to {area} m of {range}");
        let (own, source) = (column("v(@a1[drive.i])"), column("i(vd)"));
        let most = source.iter().fold(0.0f64, |m, i| m.max(i.abs()));
        // after the operating point, where ngspice keeps no current of a charge
        for i in 1..t.len() {
            assert!((own[i] + source[i]).abs() < 1e-3 * most, "ngspice {version}: {} A of {}", own[i], source[i]);
        }
        let (points, temperature) = (column("v(@a1[points])"), column("v(@a2[hot.t])"));
        assert!(points.windows(2).all(|p| p[1] >= p[0]) && points[points.len() - 1] > 20.0, "{points:?}");
        assert!(temperature.iter().all(|t| (*t > 300.0) && (t / temperature[0] - 1.0).abs() < 1e-9));

        let run = run_text(&text(".dc Vd 0 4 1"), &ngspice).unwrap_or_else(|e| panic!("ngspice {version}: {e}"));
        let plot = run.plot("DC");
        let (shown, x) = (real(plot, "v(x)"), real(plot, "v(@a1[m.x])"));
        for (shown, x) in shown.iter().zip(x) {
            // the monitor is the solution that Newton's iteration ended at: reltol 1e-3 and vntol 1 uV
            assert!((x * 1e6 - shown).abs() < 1e-3 * shown + 1e-6, "ngspice {version}: {x} m, {shown} um");
        }
    }
}

/// Names with an index are written with underscores, and instances in subcircuits by their full name.
#[test]
fn names_of_indices_and_subcircuits() {
    let netlist = "anchor * [f] [l=1u w=1u h=1u]\nmass2d * [m(2)] [m=1e-10]\nguide2d * [m(2)] []\n\
        spring2d * [f m(2)] [kx=1]\nf2d * [m(2)] [F=1u]\nanchor * [e] [l=1u w=1u h=1u]\n\
        gap plategap2d * [m(2) e] [A=1e-8 gap=4u]\neground * [e] []\ndrive port * [m(2) e] []\n";
    for (version, ngspice) in versions() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("part.net"), netlist).unwrap();
        let path = folder.path().join("deck.cir");
        let text = "* index\n.subckt cell a\nA1 %gd [a 0] null inner\n\
            .model inner bimorph(file=\"part.net\")\n.ends\nX1 a cell\nVd a 0 0\n\
            .control\nop\nprint @a.x1.a1[m_2.x]\nquit\n.endc\n.end\n";
        std::fs::write(&path, text).unwrap();
        let options = CosimOptions { deck: path, ngspice: Some(ngspice), capture: true, ..CosimOptions::default() };
        let output = cosim::run(&options, &|| true).unwrap_or_else(|e| panic!("ngspice {version}: {e}")).output;
        // 1 µN on 1 N/m
        let x = number(&output, "@a.x1.a1[m_2.x]");
        assert!((x / 1e-6 - 1.0).abs() < 1e-5, "ngspice {version}: {x}");
    }
}
