//! Losses of modes through resistances and anchors.

use crate::{close, model};
use bimorph::analysis::mode_quality::{ModeLoss, mode_losses};
use bimorph::compile::CompileOptions;
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
