//! Lines of decks that one analysis alone does not show: several `.dc` lines, orders of integration, operating points that fail, files beside
//! libraries. Each on every ngspice.

use crate::support::{deck, versions};
use bimorph::cosim::{self, CosimError, CosimOptions};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// The `.model` line of a plate of 1 N/m with A = 1e-8 m², g = 2 µm, pull-in at 5.1741 V.
const PLATE: &str = ".model plate bimorph(file=\"damped_plate.net\" ports=[\"drive\"] monitors=[\"m.x:1e6\"])\n";

/// A folder with a deck of this text and the plate's netlist at `at`.
fn folder(text: &str, at: &str) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let netlist = folder.path().join(at);
    std::fs::create_dir_all(netlist.parent().unwrap()).unwrap();
    std::fs::copy(deck("damped_plate.net"), netlist).unwrap();
    let deck = folder.path().join("deck.cir");
    std::fs::write(&deck, text).unwrap();
    (folder, deck)
}

fn output(deck: &Path, ngspice: &Path) -> Result<String, CosimError> {
    let options =
        CosimOptions { deck: deck.to_owned(), ngspice: Some(ngspice.into()), capture: true, ..CosimOptions::default() };
    cosim::run(&options, &|| true).map(|report| report.output)
}

/// Rows of printed tables: index, axis, first column.
fn rows(output: &str) -> Vec<[f64; 3]> {
    let row = |line: &str| {
        let words: Vec<f64> = line.split_whitespace().map_while(|w| w.parse().ok()).collect();
        words.try_into().ok()
    };
    output.lines().filter_map(row).collect()
}

/// Displacement (µm) of the plate at a voltage below pull-in: the fixed-point iteration of k·x = ½εAV²/(g − x)².
fn stands_at(volts: f64) -> f64 {
    (0..4000).fold(0.0f64, |x, _| 0.5 * 8.854e-12 * 1e-8 * volts * volts / (2e-6 - x).powi(2)) * 1e6
}

/// Each `.dc` line begins from rest, also after one that ended pulled in: at 4 V all three stand where one alone does. ngspice runs the lines
/// in an order of its own.
#[test]
fn every_dc_line_begins_from_rest() {
    let text = format!(
        "* lines\nVd a 0 0\nA1 %gd [a 0] %v [x] plate\n{PLATE}.dc vd 4 5 1\n.dc vd 4 6 1\n.dc vd 4 5 1\n.print dc v(x)\n.end\n"
    );
    let (_folder, deck) = folder(&text, "damped_plate.net");
    for (version, ngspice) in versions() {
        let rows = rows(&output(&deck, &ngspice).unwrap_or_else(|e| panic!("ngspice {version}: {e}")));
        let at = |volts: f64| rows.iter().filter(move |row| row[1] == volts).map(|row| row[2]).collect::<Vec<_>>();
        let [low, high] = [at(4.0), at(6.0)];
        assert_eq!((low.len(), high.len()), (3, 1), "ngspice {version}: {rows:?}");
        assert!(low.iter().all(|x| (x / stands_at(4.0) - 1.0).abs() < 1e-4), "ngspice {version}: {low:?}");
        assert!(high[0] > 1.8, "ngspice {version}: at 6 V the plate is pulled in, {high:?}");
    }
}

/// Monitors of a sweep are those of the equilibrium, for any `reltol`. At 1 V after 0.5 V ngspice writes the iterate
/// before the last, whose error was 6e-4. The plate's own equation holds to 3e-5, the difference of the contact law
/// beyond the gap.
#[test]
fn monitors_of_sweeps_are_converged() {
    for reltol in ["1e-3", "1e-2"] {
        let text = format!(
            "* sweep\nVd a 0 0\nRs a b 1k\nA1 %gd [b 0] %v [x] plate\n{PLATE}.options reltol={reltol} convstep=0.25 convabsstep=0.1\n\
             .dc vd 0.5 4.5 0.5\n.print dc v(x)\n.end\n"
        );
        let (_folder, deck) = folder(&text, "damped_plate.net");
        for (version, ngspice) in versions() {
            let rows = rows(&output(&deck, &ngspice).unwrap_or_else(|e| panic!("ngspice {version}: {e}")));
            assert_eq!(rows.len(), 9, "ngspice {version}");
            for [_, volts, x] in rows {
                let off = x / stands_at(volts) - 1.0;
                assert!(off.abs() < 5e-5, "ngspice {version}, reltol {reltol}, {volts} V: off by {off:e}");
            }
        }
    }
}

/// Every order of integration runs to the end, the lowest by backward Euler, with several parts and code models of
/// ngspice's own in the circuit. At 0.05 µs steps of a pulse of 20 µs, orders 1 and 2 differ by 1 % of the amplitude.
#[test]
fn every_order_of_integration_runs() {
    for (version, ngspice) in versions() {
        let end = |order: u32| {
            let text = format!(
                "* order\nVd a 0 PULSE(0 3 1u 1u 1u 20u 60u)\nR1 a b 1k\nR2 a c 10k\nA1 %gd [b 0] %v [x] plate\nA2 %gd [c 0] %v [x2] plate\n\
                 A3 x y twice\n.model twice gain(gain=2)\nRy y 0 1k\nCy y 0 1p\n{PLATE}.options maxord={order}\n.tran 0.2u 15u 0 0.05u\n.print tran v(x2)\n.end\n"
            );
            let (_folder, deck) = folder(&text, "damped_plate.net");
            let output = output(&deck, &ngspice).unwrap_or_else(|e| panic!("ngspice {version}, maxord {order}: {e}"));
            *rows(&output).last().unwrap()
        };
        let [one, two, six] = [1, 2, 6].map(end);
        assert_eq!(two, six, "ngspice {version}: the trapezoidal rule has order 2");
        assert!(one[1] >= 15e-6 && (one[2] / two[2] - 1.0).abs() < 1e-2, "ngspice {version}: {one:?}, {two:?}");
    }
}

/// An operating point that does not exist ends with the reason, and at what voltage: a current source has no other path than a plate. Before it
/// gives up ngspice tries every way to the operating point, which took 17 664 evaluations.
#[test]
fn a_failed_operating_point_has_a_reason() {
    let text = format!("* no path\nI1 0 a 1u\nA1 %gd [a 0] %v [x] plate\n{PLATE}.op\n.print op v(x)\n.end\n");
    let (folder, deck) = folder(&text, "damped_plate.net");
    for (version, ngspice) in versions() {
        let trace = folder.path().join("trace");
        let options = CosimOptions {
            deck: deck.clone(),
            ngspice: Some(ngspice),
            capture: true,
            environment: vec![("BIMORPH_LOG", trace.clone())],
            ..CosimOptions::default()
        };
        match cosim::run(&options, &|| true) {
            Err(CosimError::Stopped { reason, .. }) => {
                assert!(reason.starts_with("instance a1: no equilibrium at drive = "), "ngspice {version}: {reason}");
                for words in [" V: gap ", "law of contact", "conduct no direct current"] {
                    assert!(reason.contains(words), "ngspice {version}: {reason}");
                }
            }
            other => panic!("ngspice {version}: {other:?}"),
        }
        let evaluations = std::fs::read_to_string(&trace).unwrap().matches(" Static ").count();
        assert!(evaluations < 2000, "ngspice {version}: {evaluations} evaluations");
    }
}

/// A netlist beside a library that holds the `.model` line is found wherever the deck stands and whatever else is called like it, in a subcircuit,
/// too; then along `BIMORPH_PATH`. Two models of one name with a netlist of one name are refused.
#[test]
fn netlists_are_found_beside_their_library() {
    let line = PLATE.replace("damped_plate.net", "part.net");
    let library = format!(".subckt cell p q\nA1 %gd [p 0] %v [q] plate\n{line}.ends\n");
    let text = "* library\n.include lib/mems.lib\nVd a 0 2\nX1 a x cell\n.op\n.print op v(x)\n.end\n";
    let (folder, deck) = folder(text, "lib/part.net");
    std::fs::write(folder.path().join("lib/mems.lib"), &library).unwrap();
    // one beside the deck that is another part
    std::fs::write(folder.path().join("part.net"), "anchor * [a] [l=1u w=1u h=1u]\n").unwrap();
    let elsewhere = tempfile::tempdir().unwrap();
    std::fs::copy(super::support::deck("damped_plate.net"), elsewhere.path().join("part.net")).unwrap();
    let found = |text: &str, ngspice: &Path| {
        std::fs::write(&deck, text).unwrap();
        let options = CosimOptions {
            deck: deck.clone(),
            ngspice: Some(ngspice.into()),
            capture: true,
            environment: vec![("BIMORPH_PATH", elsewhere.path().to_owned())],
            ..CosimOptions::default()
        };
        match cosim::run(&options, &|| true) {
            Ok(report) => {
                let row = |line: &str| line.strip_prefix("0\t")?.trim().parse::<f64>().ok();
                let shown = report.output.lines().find_map(row);
                Ok(shown.unwrap_or_else(|| panic!("{}", report.output)))
            }
            Err(CosimError::Stopped { reason, .. }) => Err(reason),
            Err(other) => Err(format!("{other:?}")),
        }
    };
    for (version, ngspice) in versions() {
        let x = found(text, &ngspice).unwrap_or_else(|e| panic!("ngspice {version}: {e}"));
        assert!((x / stands_at(2.0) - 1.0).abs() < 1e-4, "ngspice {version}: {x}");
        let twice = text.replace(".op", &format!("A2 %gd [a 0] %v [z] plate\n{line}.op"));
        let refused = found(&twice, &ngspice).unwrap_err();
        assert!(refused.contains("two files hold a .model line of this name"), "ngspice {version}: {refused}");
        let listed = format!(
            "* listed\nVd a 0 2\nA1 %gd [a 0] %v [x] plate\n{}.op\n.print op v(x)\n.end\n",
            PLATE.replace("damped_plate", "Part")
        );
        std::fs::rename(folder.path().join("part.net"), folder.path().join("other.net")).unwrap();
        let x = found(&listed, &ngspice);
        std::fs::rename(folder.path().join("other.net"), folder.path().join("part.net")).unwrap();
        assert!((x.unwrap_or_else(|e| panic!("ngspice {version}: {e}")) / stands_at(2.0) - 1.0).abs() < 1e-4);
    }
}

/// `bimorph cosim` lifts ngspice's limit on a code model's inputs unless the deck sets it: an operating point at 5 V under a load takes a third of the
/// evaluations, and the same place.
#[test]
fn inputs_are_limited_where_the_deck_says_so() {
    for (version, ngspice) in versions() {
        let run = |options: &str| {
            let text = format!(
                "* limit\nVd a 0 5\nR1 a b 1k\nA1 %gd [b 0] %v [x] plate\n{PLATE}{options}.control\nop\nprint v(x) @a1[trials]\nquit\n.endc\n.end\n"
            );
            let (_folder, deck) = folder(&text, "damped_plate.net");
            let output = output(&deck, &ngspice).unwrap_or_else(|e| panic!("ngspice {version}: {e}"));
            ["v(x)", "@a1[trials]"].map(|name| {
                let of =
                    |line: &str| line.trim().strip_prefix(name)?.trim().strip_prefix('=')?.trim().parse::<f64>().ok();
                output.lines().find_map(of).unwrap_or_else(|| panic!("{name} in {output}"))
            })
        };
        let [lifted, limited] = [run(""), run(".options convstep=0.25\n")];
        assert!((lifted[0] / limited[0] - 1.0).abs() < 1e-6, "ngspice {version}: {lifted:?}, {limited:?}");
        assert!(3.0 * lifted[1] < limited[1], "ngspice {version}: {} evaluations, limited {}", lifted[1], limited[1]);
    }
}
