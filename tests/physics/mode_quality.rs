//! Losses of modes through resistances and anchors.

use crate::{close, model};
use bimorph::analysis::mode_quality::{ModeLoss, mode_losses};
use bimorph::compile::{CompileOptions, Junctions, compile};
use bimorph::netlist::Bundle;
use std::f64::consts::TAU;

const EPS: f64 = 8.854e-12;

fn loss(text: &str, voltages: &[(String, f64)]) -> ModeLoss {
    mode_losses(&model(text, &CompileOptions::default()), 1, voltages).unwrap()[0]
}

fn volts(volts: f64) -> Vec<(String, f64)> {
    vec![("drive".to_owned(), volts)]
}

/// A guided mass of 0.1 µg on 1 N/m with an anchored electrode, these parts, and a source `drive` at the node s.
fn resonator(parts: &str) -> String {
    format!(
        "anchor * [f] []
        mass2d * [m] [m=1e-10]
        guide2d * [m] []
        spring2d * [f m] [kx=1]
        anchor * [e] []
        {parts}
        drive port * [s] []"
    )
}

/// A guided mass of 0.1 µg on 1 N/m, a plate of 1000 µm² at 2 µm biased through a resistance: Q = ω·m/(η²·R)·(1 + (ωRC)²) with η = V·∂C/∂x at the equilibrium (H. A. C. Tilmans 1996,
/// J. Micromech. Microeng. 6, 157, with a resistance as the electrical load), for ωRC of 0.004 to 4. Without a voltage or a resistance there is no loss.
#[test]
fn current_through_a_resistance() {
    let plate = "plategap2d * [m e] [A=1e-9 gap=2u fringe=none permittivity=8.854e-12]";
    let text = |resistor: &str| resonator(&format!("{plate}\n{resistor}\neground * [m] []"));
    let v = 10.0;
    let mut u = 0.0;
    for _ in 0..200 {
        u = 0.5 * v * v * EPS * 1e-9 / (2e-6 - u) / (2e-6 - u);
    }
    let c = EPS * 1e-9 / (2e-6 - u);
    for r in [1e7, 1e9, 1e10] {
        let found = loss(&text(&format!("R * [s e] [R={r:e}]")), &volts(v));
        let omega = TAU * found.frequency_hz;
        let (eta, lag) = (v * c / (2e-6 - u), omega * r * c);
        close(1.0 / found.electrical, omega * 1e-10 / (eta * eta * r) * (1.0 + lag * lag), 1e-6);
        close(found.quality(), 1.0 / found.electrical, 1e-12);
    }
    assert_eq!(loss(&text("R * [s e] [R=1e9]"), &volts(0.0)).electrical, 0.0);
    assert_eq!(loss(&text("wire * [s e] []"), &volts(v)).electrical, 0.0);
}

/// A mass between two electrodes at one voltage: the motional currents cancel in a resistance that both share, and add up to twice the loss of one gap where each has
/// its own. Both follow from the equivalent circuit of two ports (Tilmans 1996).
#[test]
fn currents_that_cancel() {
    let text = |wiring: &str| {
        resonator(&format!(
            "anchor * [g] []
            plategap2d * [m e] [A=1e-9 gap=2u fringe=none]
            plategap2d * [m g] [A=1e-9 gap=2u fringe=none oz=pi]
            {wiring}"
        ))
    };
    let shared = loss(&text("wire * [e s] []\nwire * [g s] []\nR * [m z] [R=1e7]\neground * [z] []"), &volts(5.0));
    let own = loss(&text("R * [e s] [R=1e7]\nR * [g s] [R=1e7]\neground * [m] []"), &volts(5.0));
    let one = loss(&text("R * [e s] [R=1e7]\nwire * [g s] []\neground * [m] []"), &volts(5.0));
    assert!(shared.electrical.abs() < 1e-9 * own.electrical, "{} {}", shared.electrical, own.electrical);
    close(own.electrical, 2.0 * one.electrical, 1e-5);
}

/// Thermoelastic loss of a clamped beam whose heat flows across its width: exactly Δ·f(ξ) of Lifshitz and Roukes (2000) with beams that meet in points. Calibrated
/// junctions hold part of the bending energy, and the rest does not depend on the mesh.
#[test]
fn thermoelastic_loss_has_no_mesh() {
    let text = "process s = [ Youngsmodulus=165e9 density=2330 h=20u thermalexpansion=2.6e-6 thermcond=90 specificheat=700 ambienttemperature=300 ]
        anchor s [a] [oz=pi]
        beam2d s [a b] [l=200u w=8u]";
    let capacity = 2330.0 * 700.0;
    let exact = |found: &ModeLoss| {
        let xi = 8e-6 * (TAU * found.frequency_hz * capacity / 180.0f64).sqrt();
        let law = 6.0 / xi.powi(2) - 6.0 / xi.powi(3) * (xi.sinh() + xi.sin()) / (xi.cosh() + xi.cos());
        165e9 * 2.6e-6f64.powi(2) * 300.0 / capacity * law
    };
    let of = |segments: usize, junctions: Junctions| {
        let options = CompileOptions { segments: Some(segments), junctions, ..CompileOptions::default() };
        mode_losses(&compile(&Bundle::from_text("ted.net", text), &options).unwrap(), 3, &[]).unwrap()
    };
    for found in of(16, Junctions::Centreline) {
        close(found.thermoelastic, exact(&found), 1e-9);
    }
    let (coarse, fine) = (of(16, Junctions::Calibrated), of(64, Junctions::Calibrated));
    for (mode, (coarse, fine)) in coarse.iter().zip(&fine).enumerate() {
        let fraction = [coarse, fine].map(|found| found.thermoelastic / exact(found));
        println!("mode {mode}: {fraction:?}");
        assert!((0.9..1.0).contains(&fraction[1]), "{fraction:?}");
        close(fraction[0], fraction[1], 1e-3);
    }
}

/// A layer with `anchorquality` gives its modes that Q where beams hold all energy, within the error of the mesh. The loss is half where two equal springs, a beam of that
/// layer and one of another layer, share the energy.
#[test]
fn anchors_as_given() {
    let layer = "Youngsmodulus=160e9 Poisson=0.2 density=2330 h=10u";
    let beam = format!(
        "process s = [ {layer} anchorquality=5000 ]
        anchor s [a] [l=5u w=20u oz=pi]
        beam2d s [a b] [l=400u w=4u]
        anchor s [b] [l=5u w=20u]"
    );
    let found = loss(&beam, &[]);
    close(found.anchors, 1.0 / 5000.0, 2e-3);
    close(found.quality(), 5000.0, 2e-3);
    let shared = format!(
        "process s = [ {layer} anchorquality=5000 ]
        process r = [ {layer} ]
        anchor s [a] [l=5u w=20u oz=pi]
        beam2d s [a m] [l=200u w=2u]
        mass2d * [m] [m=1e-8]
        beam2d r [m b] [l=200u w=2u]
        anchor r [b] [l=5u w=20u]"
    );
    close(loss(&shared, &[]).anchors, 0.5 / 5000.0, 2e-3);
}
