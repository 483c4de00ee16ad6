//! A run repeated with half the steps and a tenth of the tolerances gives its error.

use crate::support::{all_decks, deck, versions};
use bimorph::cosim::check::{CosimCheck, check};
use bimorph::cosim::{CosimError, CosimOptions};
use std::path::Path;

fn checked(folder: &Path, text: &str, ngspice: &Path) -> Result<CosimCheck, CosimError> {
    let deck = folder.join("deck.cir");
    std::fs::write(&deck, text).unwrap();
    check(&CosimOptions { deck, ngspice: Some(ngspice.to_owned()), ..CosimOptions::default() }, &|| true)
}

/// The reported difference of a circuit with coarse steps is its error. A resistor of 1 kΩ and a capacitor of 1 nF
/// oscillate with 1 mH at 159 kHz, v = 1 V·e^(−at)·(cos bt + a/b·sin bt), a = 1/2RC, b² = 1/LC − a². The largest error
/// of the run over 40 µs and the reported difference agree within a factor of two. The part in the circuit, whose
/// motion is solved to its own tolerance, differs by less than 1e-3.
#[test]
fn the_difference_is_the_error() {
    for (version, ngspice) in versions() {
        let folder = all_decks();
        let text = "* ringing\nC1 r 0 1n IC=1\nL1 r 0 1m\nR1 r 0 10k\nVd a 0 SIN(2 1 20k)\n\
            A1 %gd [a 0] %v [x] plate\n.model plate bimorph(file=\"damped_plate.net\" monitors=[\"m.x:1e6\"])\n\
            .tran 0.2u 40u 0 0.2u uic\n.end\n";
        let raw = folder.path().join("out.raw");
        let deck = folder.path().join("deck.cir");
        std::fs::write(&deck, text).unwrap();
        let options = CosimOptions { deck, ngspice: Some(ngspice), raw: Some(raw.clone()), ..CosimOptions::default() };
        let found = check(&options, &|| true).unwrap_or_else(|e| panic!("ngspice {version}: {e}"));
        let plots = bimorph::results::raw::read(&std::fs::read(raw).unwrap()).unwrap();
        let (t, v) = (crate::support::real(&plots[0], "time"), crate::support::real(&plots[0], "v(r)"));
        let (a, c, l) = (0.5 / (10e3 * 1e-9), 1e-9, 1e-3);
        let b = f64::sqrt(1.0 / (l * c) - a * a);
        let exact = |t: f64| (-a * t).exp() * ((b * t).cos() - a / b * (b * t).sin());
        let (low, high) = v.iter().fold((0.0f64, 0.0f64), |r, v| (r.0.min(*v), r.1.max(*v)));
        let error = t.iter().zip(v).map(|(t, v)| (v - exact(*t)).abs()).fold(0.0, f64::max) / (high - low);
        let of = |name: &str| found.plots[0].vectors.iter().find(|v| v.name == name).unwrap();
        let (reported, part) = (of("v(r)").largest, of("v(x)").largest);
        println!(
            "ngspice {version}: {reported:.2e} told, {error:.2e} off; the part {part:.1e}; {:?}",
            found.plots[0].points
        );
        assert!(found.plots[0].points[1] > 2 * found.plots[0].points[0] - 20, "{:?}", found.plots[0].points);
        assert!(reported > 0.5 * error && reported < 2.0 * error, "ngspice {version}: {reported} told, {error} off");
        assert!(part < 1e-3, "ngspice {version}: {part}");
    }
}

/// Results of a `.control` section are compared too: every plot of its loops, and every number it prints or measures. A
/// file that it writes is that of the run as it is, and the deck itself stays as it was.
#[test]
fn control_sections_are_compared() {
    for (version, ngspice) in versions() {
        let folder = all_decks();
        let file = folder.path().join("points.txt");
        let text = format!(
            "* loop\nVd a 0 dc 2 PULSE(2 4 1u 1u)\nR1 a b 10k\nA1 %gd [b 0] %v [x] plate\n\
             .model plate bimorph(file=\"damped_plate.net\" monitors=[\"m.x:1e6\"] tol=1e-2)\n.control\n\
             foreach r 10k 20k\nalter r1 = $r\ntran 0.5u 20u\nmeas tran far max v(x)\nend\n\
             ac dec 2 1k 100k\nprint length(frequency) > {}\nquit\n.endc\n.end\n",
            file.display()
        );
        let found = checked(folder.path(), &text, &ngspice).unwrap_or_else(|e| panic!("ngspice {version}: {e}"));
        let names: Vec<&str> = found.plots.iter().map(|p| p.name.as_str()).collect();
        assert_eq!(names.iter().filter(|n| n.starts_with("Transient")).count(), 2, "ngspice {version}: {names:?}");
        assert_eq!(names.iter().filter(|n| n.starts_with("AC")).count(), 1, "ngspice {version}: {names:?}");
        for plot in found.plots.iter().filter(|p| p.name.starts_with("Transient")) {
            assert!(plot.points[1] > plot.points[0], "ngspice {version}: {:?}", plot.points);
            let x = plot.vectors.iter().find(|v| v.name == "x" || v.name == "v(x)").unwrap();
            assert!(x.largest > 0.0 && x.largest < 2e-2, "ngspice {version}: {x:?}");
        }
        let far: Vec<_> = found.printed.iter().filter(|p| p.name == "far").collect();
        assert_eq!(far.len(), 2, "ngspice {version}: {:?}", found.printed);
        assert!(far.iter().all(|p| p.values[0] > 0.1 && p.difference < 1e-2), "ngspice {version}: {far:?}");
        assert!(file.is_file() && found.notes.is_empty(), "ngspice {version}: {:?}", found.notes);
        assert_eq!(std::fs::read_to_string(folder.path().join("deck.cir")).unwrap(), text);
    }
}

/// A run that is impossible, as it is or refined, is its error, and a cancelled one ends; neither leaves a file.
#[test]
fn a_failed_check_leaves_nothing() {
    for (version, ngspice) in versions() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::copy(deck("plate.net"), folder.path().join("plate.net")).unwrap();
        let raw = folder.path().join("out.raw");
        let path = folder.path().join("deck.cir");
        let deck = |port: &str| {
            format!(
                "* plate\nVd a 0 2\nA1 %gd [a 0] null plate\n\
                 .model plate bimorph(file=\"plate.net\" ports=[\"{port}\"])\n.tran 1n 1\n.end\n"
            )
        };
        let options = || CosimOptions {
            deck: path.clone(),
            ngspice: Some(ngspice.clone()),
            raw: Some(raw.clone()),
            ..CosimOptions::default()
        };
        std::fs::write(&path, deck("nothing")).unwrap();
        let failed = check(&options(), &|| true);
        assert!(matches!(&failed, Err(CosimError::Stopped { reason, .. }) if reason.contains("nothing")), "{failed:?}");
        std::fs::write(&path, deck("drive")).unwrap();
        let asked = std::cell::Cell::new(0);
        let cancelled = check(&options(), &|| asked.replace(asked.get() + 1) < 20);
        assert!(matches!(cancelled, Err(CosimError::Cancelled)), "ngspice {version}: {cancelled:?}");
        let left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
        assert_eq!(left.len(), 2, "ngspice {version}: {left:?}");
    }
}
