//! Frequency responses without a circuit are those that ngspice computes of one: `.ac` of a netlist behind the plug-in, on the same mesh.

use crate::support::{Run, complex, run, skipped, versions};
use bimorph::analysis::harmonic::grid::Spacing;
use bimorph::analysis::harmonic::{HarmonicOptions, HarmonicResult, harmonic};
use bimorph::compile::{CompileOptions, compile};
use bimorph::cosim::CosimOptions;
use bimorph::netlist::Bundle;
use std::path::Path;

/// The comb resonator of examples/, a shuttle on a folded flexure between two combs.
fn netlist() -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples");
    let text = std::fs::read_to_string(root.join("comb_resonator/comb_resonator.net")).unwrap();
    let process = std::fs::read_to_string(root.join("poly.net")).unwrap();
    text.replace("uses ../poly.net", &process)
}

/// `.ac` of the resonator with these sources, about twenty frequencies in a decade from 1 kHz to 200 kHz, both on the grid.
fn circuit(sources: &str, line: &str, ngspice: &Path) -> Run {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("resonator.net"), netlist()).unwrap();
    let deck = folder.path().join("deck.cir");
    std::fs::write(&deck, format!("* small signals\n{sources}\n{line}\n.ac dec 20 1k 200k\n.end\n")).unwrap();
    run(CosimOptions { deck, ngspice: Some(ngspice.to_owned()), ..CosimOptions::default() }).unwrap()
}

/// The same without it, at the frequencies of a run.
fn direct(run: &Run, drive: &str, signals: &[&str], bias: &[(&str, f64)]) -> HarmonicResult {
    let named = |list: &[&str]| list.iter().map(|s| (*s).to_owned()).collect();
    let compiled = compile(
        &Bundle::from_text("resonator.net", &netlist()),
        &CompileOptions { segments: Some(2), ..CompileOptions::default() },
    );
    let grid = frequencies(run);
    let options = HarmonicOptions {
        drive: drive.into(),
        signals: named(signals),
        from: grid[0],
        to: grid[grid.len() - 1],
        points: grid.len(),
        spacing: Spacing::Logarithmic,
        even: true,
        voltages: bias.iter().map(|(name, volts)| ((*name).to_owned(), *volts)).collect(),
        ..HarmonicOptions::default()
    };
    harmonic(&compiled.unwrap(), &options, &mut |_| true).unwrap()
}

fn frequencies(run: &Run) -> Vec<f64> {
    complex(run.plot("AC"), "frequency").iter().map(|f| f[0]).collect()
}

/// Largest deviation of a signal from what the circuit has, times `scale`, over each value.
fn off(run: &Run, name: &str, scale: f64, result: &HarmonicResult, signal: usize) -> f64 {
    let values = &result.signals[signal].values;
    let grid = frequencies(run);
    assert_eq!(grid.len(), result.frequencies_hz.len());
    assert!(grid.iter().zip(&result.frequencies_hz).all(|(a, b)| (a / b - 1.0).abs() < 1e-9));
    let one = |([re, im], there): (&[f64; 2], &[f64; 2])| {
        (there[0] - scale * re).hypot(there[1] - scale * im) / there[0].hypot(there[1])
    };
    values.iter().zip(complex(run.plot("AC"), name)).map(one).fold(0.0, f64::max)
}

/// At the port of the driving comb under a bias of 30 V, the current and the motion of a volt; and under a force on the shuttle.
#[test]
fn ac_of_a_circuit_and_without_one() {
    if skipped() {
        return;
    }
    for (version, ngspice) in versions() {
        let driven = circuit(
            "Vd d 0 dc 30 ac 1",
            "A1 %gd [d 0] %v [x] part\n.model part bimorph(file=\"resonator.net\" segments=2 ports=[\"drive\"] monitors=[\"shuttle.x:1e6\"])",
            &ngspice,
        );
        let result = direct(&driven, "drive", &["drive.i", "shuttle.x"], &[("drive", 30.0)]);
        // current into the port is minus that through the source; a micrometre is a volt
        let (current, motion) = (off(&driven, "i(vd)", -1.0, &result, 0), off(&driven, "v(x)", 1e6, &result, 1));
        // a force of 1 A at a port that shows micrometres
        let pushed = circuit(
            "If 0 f dc 0 ac 1",
            "A1 [%hd f 0] null part\n.model part bimorph(file=\"resonator.net\" segments=2 ports=[\"shuttle.x\"])",
            &ngspice,
        );
        let result = direct(&pushed, "shuttle.fx", &["shuttle.x"], &[]);
        let force = off(&pushed, "v(f)", 1e6, &result, 0);
        println!("ngspice {version}: current {current:.1e}, motion {motion:.1e}, under a force {force:.1e}");
        // the stiffness that the device sums up is rounded, which moves resonances by some 1e-11: 2Q times that. Beside a port under a force
        // ngspice puts its smallest conductance, 1e-12 S, which is 1e-12 N for a micrometre
        assert!(current < 1e-8 && motion < 1e-8 && force < 1e-6, "{version}: {current:e} {motion:e} {force:e}");
    }
}
