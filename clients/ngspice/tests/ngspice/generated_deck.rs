//! Netlists that draw their own circuit: the deck around the device against closed forms, and against the same deck by hand.

use crate::support::{Run, complex, deviation, real, run, versions};
use bimorph::cosim::CosimOptions;
use bimorph::cosim::deck::{DeckSpec, around};
use bimorph::netlist::{Bundle, load};
use std::path::Path;

/// A plate of 1 N/m, 1e-10 kg, half of critical damping, A = 1e-8 m², g = 2 µm, whose node has capitals and an index.
const PLATE: &str = "anchor * [f] [l=1u w=1u h=1u]\nmass2d * [M(1)] [m=1e-10]\nguide2d * [M(1)] []\n\
    spring2d * [f M(1)] [kx=1]\ndamper2d * [f M(1)] [bx=1e-5]\nanchor * [e] [l=1u w=1u h=1u]\n\
    Gap plategap2d * [M(1) e] [A=1e-8 gap=2u]\neground * [e] []\n";

/// Runs a netlist's own deck, or another text in its place, beside the netlist.
fn run_beside(netlist: &str, text: &str, ngspice: &Path) -> Run {
    let folder = tempfile::tempdir().unwrap();
    let deck = folder.path().join("Part.net");
    std::fs::write(&deck, netlist).unwrap();
    let options =
        CosimOptions { deck, text: Some(text.into()), ngspice: Some(ngspice.into()), ..CosimOptions::default() };
    run(options).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn deck(netlist: &str, analyses: &[&str], drives: &[(&str, &str)]) -> String {
    let loaded = load(&Bundle::from_text("Part.net", netlist), &[]).unwrap_or_else(|d| panic!("{d}"));
    let wanted = DeckSpec {
        file: "Part.net".into(),
        signals: vec!["M(1).x".into()],
        analyses: analyses.iter().map(|line| (*line).to_owned()).collect(),
        drives: drives.iter().map(|(name, wave)| ((*name).to_owned(), (*wave).to_owned())).collect(),
        ..DeckSpec::default()
    };
    around(&loaded.structure, &wanted).unwrap_or_else(|e| panic!("{e}"))
}

/// Displacement (µm) of the plate at a voltage: the fixed-point iteration of k·x = ½εAV²/(g − x)².
fn stands_at(volts: f64) -> f64 {
    (0..200).fold(0.0f64, |x, _| 0.5 * 8.854e-12 * 1e-8 * volts * volts / (2e-6 - x).powi(2)) * 1e6
}

/// A plate behind a divider of two resistors of 1 MΩ with 1 pF. Its voltage is half of the source's, and its
/// displacement that of the plate's own equation. In small signals the divider has its pole at 1/(2π·R/2·(C +
/// C_plate)). The motion adds to the plate's fraction, 4.4 % of C, which shifts it by less than 1 %. A step has the
/// same waveforms, to 1e-9, as a deck written by hand.
#[test]
fn a_divider_and_a_plate() {
    let netlist = format!(
        "{PLATE}Vs Vsrc * [s e] [V=4]\nR1 R * [s M(1)] [R=1M]\nR2 R * [M(1) e] [R=1M]\nC1 C * [M(1) e] [C=1p]\n"
    );
    let analyses = [".op", ".ac dec 20 100 10meg", ".tran 0.05u 20u 0 0.05u"];
    for (version, ngspice) in versions() {
        let text = deck(&netlist, &analyses, &[("Vs", "PULSE(2 4 1u 1u)")]);
        let found = run_beside(&netlist, &text, &ngspice);
        let of = |name: &str| real(found.plot("Operating"), name)[0];
        // ngspice takes the beginning of a pulse for the operating point of a transient, and dc for this one
        assert!((of("v(m_1)") - 2.0).abs() < 1e-9, "ngspice {version}: {} V", of("v(m_1)"));
        let x = stands_at(2.0);
        assert!((of("v(m_1_x)") / x - 1.0).abs() < 1e-6, "ngspice {version}: {} um, expected {x}", of("v(m_1_x)"));

        let plot = found.plot("AC");
        let (frequency, v) = (complex(plot, "frequency"), complex(plot, "v(m_1)"));
        let plate = 8.854e-12 * 1e-8 / (2e-6 - x * 1e-6);
        let pole = 1.0 / (std::f64::consts::TAU * 0.5e6 * (1e-12 + plate));
        for (f, v) in frequency.iter().zip(v) {
            let want = 0.5 / (1.0 + (f[0] / pole).powi(2)).sqrt();
            let got = v[0].hypot(v[1]);
            assert!((got / want - 1.0).abs() < 1e-2, "ngspice {version}: {got} at {} Hz, expected {want}", f[0]);
        }

        let by_hand = "* by hand\nVs s 0 dc 4 PULSE(2 4 1u 1u)\nR1 s p 1meg\nR2 p 0 1meg\nC1 p 0 1p\n\
            A1 %gd [p 0] %v [x] plate\n\
            .model plate bimorph(file=\"alone.net\" ports=[\"drive\"] monitors=[\"m.x:1e6\"])\n\
            .tran 0.05u 20u 0 0.05u\n.end\n";
        let folder = tempfile::tempdir().unwrap();
        let alone = format!("{}drive port * [m e] []\n", PLATE.replace("M(1)", "m"));
        std::fs::write(folder.path().join("alone.net"), alone).unwrap();
        let path = folder.path().join("hand.cir");
        std::fs::write(&path, by_hand).unwrap();
        let hand = run(CosimOptions { deck: path, ngspice: Some(ngspice), ..CosimOptions::default() });
        let hand = hand.unwrap_or_else(|e| panic!("ngspice {version}: {e}"));
        let wave = |run: &Run, name: &str| {
            let plot = run.plot("Transient");
            (real(plot, "time").to_vec(), real(plot, name).to_vec())
        };
        for (own, other) in [("v(m_1)", "v(p)"), ("v(m_1_x)", "v(x)")] {
            let (a, b) = (wave(&found, own), wave(&hand, other));
            let off = deviation((&a.0, &a.1), (&b.0, &b.1), 0.0, 20e-6);
            assert!(off < 1e-9, "ngspice {version}: {own} differs by {off}");
        }
    }
}

/// Sources and amplifiers have SUGAR's signs. A current source takes its current out of the first node. An op-amp with
/// 1 kΩ and 3 kΩ makes −3 V of 1 V (to the 4e-6 that its gain of 1e6 leaves), and a `vcvs` of gain −1.5 makes 4.5 V of
/// that. An inductor carries the current of the plate at no voltage.
#[test]
fn amplifiers_drive_the_plate() {
    let netlist = format!(
        "{PLATE}i1 Isrc * [e in] [I=1m]\nr0 R * [in e] [R=1k]\nb vcvs * [in e a e] [A=1]\nr1 R * [a minus] [R=1k]\n\
         amp opamp * [minus e out e] []\nr2 R * [minus out] [R=3k]\nx vcvs * [out e high e] [A=-1.5]\n\
         l1 L * [high M(1)] [L=1m]\n"
    );
    for (version, ngspice) in versions() {
        let found = run_beside(&netlist, &deck(&netlist, &[".op"], &[]), &ngspice);
        let of = |name: &str| real(found.plot("Operating"), name)[0];
        for (name, want, within) in [
            ("v(in)", 1.0, 1e-9),
            ("v(out)", -3.0, 1e-5),
            ("v(high)", 4.5, 1e-5),
            ("v(m_1)", 4.5, 1e-5),
            ("v(m_1_x)", stands_at(4.5), 1e-4),
        ] {
            assert!(
                (of(name) / want - 1.0).abs() < within,
                "ngspice {version}: {name} is {}, expected {want}",
                of(name)
            );
        }
    }
}
