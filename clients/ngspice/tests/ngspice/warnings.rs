//! Warnings of decks about accepted states.

use crate::support::{all_decks, run, versions};
use bimorph::cosim::{self, CosimOptions};
use std::path::Path;

/// The bank's heaters at a voltage that melts them and drives the comb through its other side; returns the warnings in
/// order.
fn reported(ngspice: &Path, source: &str, analysis: &str) -> Vec<String> {
    let folder = all_decks();
    let (deck, log) = (folder.path().join("hot.cir"), folder.path().join("log"));
    let text = format!(
        "* hot\nV1 h 0 {source}\nV2 s 0 0\nA1 %gd [h 0 s 0] %v [y] bank\n\
         .model bank bimorph(file=\"bank.net\" ports=[\"heat\" \"sense\"] monitors=[\"yoke.y:1e6\"])\n{analysis}\n.end\n"
    );
    std::fs::write(&deck, text).unwrap();
    let environment = vec![("BIMORPH_LOG", log.clone())];
    run(CosimOptions { deck, ngspice: Some(ngspice.to_owned()), environment, ..CosimOptions::default() }).unwrap();
    let trace = std::fs::read_to_string(log).unwrap();
    let warning = |line: &str| Some(line.split_once("warning[")?.1.split_once(']')?.0.to_owned());
    trace.lines().filter_map(warning).collect()
}

/// Heat beyond the strength of any solid (W037) and fingers beyond the other side of their comb (W024) are reported by
/// an operating point, a sweep and a transient, each once. A deck within its range has no warnings.
#[test]
fn states_beyond_their_range_are_reported_once() {
    for (version, ngspice) in versions() {
        let both = ["W024", "W037"].map(String::from);
        for (source, analysis) in [("30", ".op"), ("0", ".dc V1 0 30 1"), ("PWL(0 0 10u 30)", ".tran 1u 400u")] {
            let mut codes = reported(&ngspice, source, analysis);
            codes.sort();
            assert_eq!(codes, both, "ngspice {version}: {analysis}");
        }
        assert_eq!(reported(&ngspice, "PWL(0 0 10u 1)", ".tran 1u 20u"), [""; 0], "ngspice {version}");
    }
}

/// A cantilever that a force pulse leaves oscillating without loss, for 137 cycles. A warning appears when the phase
/// error of its mesh reaches the tolerance, and again whenever it is three times larger, up to six times. On the mesh
/// for the tolerance there is none.
#[test]
fn phase_errors_are_reported() {
    let net = "process p = [Youngsmodulus=165e9 density=2300 h=2u]\nanchor p [a] []\nbeam2d p [a b] [l=200u w=2u]\n";
    for (version, ngspice) in versions() {
        for (more, reported) in [("segments=3", 4..=6), ("", 0..=0)] {
            let folder = all_decks();
            let deck = folder.path().join("ring.cir");
            std::fs::write(folder.path().join("ring.net"), net).unwrap();
            let text = format!(
                "* rings\nI1 0 f PULSE(0 1u 1u 10n 10n 2u 1)\nA1 %hd [f 0] %v [y] r\n\
                 .model r bimorph(file=\"ring.net\" ports=[\"b.y\"] monitors=[\"b.y:1e6\"] {more})\n.tran 1u 2m\n.end\n"
            );
            std::fs::write(&deck, text).unwrap();
            let options = CosimOptions {
                raw: Some(folder.path().join("ring.raw")),
                deck,
                ngspice: Some(ngspice.clone()),
                capture: true,
                ..CosimOptions::default()
            };
            let report = cosim::run(&options, &|| true).unwrap();
            let lines: Vec<&str> = report.warnings().filter(|line| line.contains("warning[W040]")).collect();
            assert!(reported.contains(&lines.len()), "ngspice {version}, {more}: {lines:#?}");
        }
    }
}

/// A current above that of a thermal runaway ends an operating point, a sweep of the current and a transient with one message: the beam, and the largest current with a steady temperature. That of a
/// bar of 200 × 2 × 2 µm with ρ 2e-5 Ω·m, k 32 W/(m·K) and a TCR of 1.25e-3/K is 2.247941 mA: A·π/L·√(k/(ρ·TCR)). 2 mA has a steady temperature.
#[test]
fn runaway_currents_are_reported() {
    let net = "process si = [ Youngsmodulus=160e9 density=2330 h=2u resistivity=2e-5 thermcond=32 thermalexpansion=2.7e-6 TCR=1.25e-3 specificheat=700 ]
anchor si [cold] []
arm beam2det si [cold far] [l=200u w=2u]
anchor si [far] []
eground * [cold] []
feed port * [far cold] []
";
    for (version, ngspice) in versions() {
        let folder = all_decks();
        std::fs::write(folder.path().join("arm.net"), net).unwrap();
        let deck = folder.path().join("arm.cir");
        let ended = |source: &str, analysis: &str| {
            let text = format!(
                "* a current into a bar\nI1 0 p {source}\nA1 %gd [p 0] %v [t] bar\n\
                 .model bar bimorph(file=\"arm.net\" ports=[\"feed\"] monitors=[\"arm.T\"])\n{analysis}\n.end\n"
            );
            std::fs::write(&deck, text).unwrap();
            let options = CosimOptions {
                deck: deck.clone(),
                ngspice: Some(ngspice.clone()),
                raw: Some(folder.path().join("arm.raw")),
                capture: true,
                ..CosimOptions::default()
            };
            cosim::run(&options, &|| true).err().map(|error| error.to_string())
        };
        for (source, analysis) in [("3m", ".op"), ("0", ".dc I1 0 3m 0.05m"), ("PWL(0 0 1u 3m)", ".tran 0.5u 500u")] {
            let error = ended(source, analysis).unwrap_or_else(|| panic!("ngspice {version}: {analysis} has a result"));
            let current = error.split_once("no current above ").and_then(|(_, rest)| rest.split_once(" A into `feed`"));
            let current: f64 =
                current.and_then(|(x, _)| x.parse().ok()).unwrap_or_else(|| panic!("{analysis}: {error}"));
            assert!(error.contains("thermal runaway of `arm`") && error.matches("runaway").count() == 1, "{error}");
            assert!((current / 2.247941e-3 - 1.0).abs() < 1e-4, "ngspice {version}: {analysis}: {current}");
        }
        assert_eq!(ended("2m", ".op"), None, "ngspice {version}");
    }
}
