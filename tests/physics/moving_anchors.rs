//! Anchors that move with a strained substrate, or by a given displacement, against the closed forms of a beam clamped at both ends.

use crate::{balance, close, node};
use bimorph::analysis::frame::{frame, frame_statics};
use bimorph::analysis::modes::modes;
use bimorph::analysis::transient::{TransientOptions, transient};
use bimorph::compile::{CompileOptions, CompiledModel, Junctions, compile};
use bimorph::netlist::{Bundle, Setting};

const L: f64 = 200e-6;
const W: f64 = 2e-6;
const E: f64 = 160e9;
const RHO: f64 = 2330.0;

const BRIDGE: &str = "
param eps=0, turn=0
process p = [ Youngsmodulus=160e9 density=2330 h=2u strength=1e12 packagestrain=eps ]
anchor p [a] [oz=turn]
left beam2d p [a m] [l=100u w=2u oz=turn]
right beam2d p [m b] [l=100u w=2u oz=turn]
anchor p [b] [oz=turn]
";

fn compiled(text: &str, set: &[(&str, f64)]) -> CompiledModel {
    let set = set.iter().map(|(name, value)| ((*name).to_owned(), Setting::Number(*value))).collect();
    let options = CompileOptions {
        set,
        junctions: Junctions::Centreline,
        shear: false,
        segments: Some(16),
        ..CompileOptions::default()
    };
    compile(&Bundle::from_text("model.net", text), &options).unwrap_or_else(|e| panic!("{e}"))
}

/// First frequency of a clamped-clamped beam that is strained by ε (Hz): the lowest root of 2·a·b·(1 − cosh aL·cos bL) + (a² − b²)·sinh aL·sin bL = 0 with
/// a², b² = √(t² + ρAω²/EI) ± t, t = N/2EI (Bokaian, J. Sound Vib. 126 (1988)). In drawn coordinates slopes are smaller by λ = 1 + ε, so that EI stands for EI/λ² and N for EAε/λ.
fn clamped(eps: f64) -> f64 {
    let (area, bending) = (W * W, E * W.powi(4) / 12.0 / (1.0 + eps).powi(2));
    let t = E * area * eps / (1.0 + eps) / (2.0 * bending);
    let equation = |f: f64| {
        let root = (t * t + RHO * area * (std::f64::consts::TAU * f).powi(2) / bending).sqrt();
        let (a, b) = ((root + t).sqrt(), (root - t).sqrt());
        2.0 * a * b * (1.0 / (a * L).cosh() - (b * L).cos()) + (a * a - b * b) * (a * L).tanh() * (b * L).sin()
    };
    let step = 200.0;
    let first = (1..).find(|k| equation(step * f64::from(*k)) * equation(step * f64::from(k + 1)) <= 0.0).unwrap();
    let (mut low, mut high) = (step * f64::from(first), step * f64::from(first + 1));
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if equation(low) * equation(middle) <= 0.0 { high = middle } else { low = middle }
    }
    low
}

/// A substrate strain ε presses or pulls the beam by E·ε, moves its anchors by ε·x, and shifts its frequency as the axial force EAε does: to 1e-4, in two directions of the drawing. A
/// strain of 0 changes nothing: 1e-5 of the frequency.
#[test]
fn substrate_strain_is_axial_force() {
    for turn in [0.0, 1.1] {
        for eps in [-2e-4, 1e-4, 5e-4] {
            let model = compiled(BRIDGE, &[("eps", eps), ("turn", turn)]);
            let found = balance(&model, &[]);
            close(found.stresses_pa[0].1, E * eps.abs(), 1e-5);
            let end = node(&found, "b");
            close(end.x, eps * L * turn.cos(), 1e-5);
            assert!((end.y - eps * L * turn.sin()).abs() < 1e-5 * eps.abs() * L && end.rz.abs() < 1e-12);
            close(modes(&model, 1, &[]).unwrap().frequencies_hz[0], clamped(eps), 1e-4);
        }
    }
    let [fixed, still] = [BRIDGE.replace(" packagestrain=eps", ""), BRIDGE.to_owned()]
        .map(|text| modes(&compiled(&text, &[]), 1, &[]).unwrap().frequencies_hz[0]);
    close(still, fixed, 1e-5);
}

/// Under a growing compression of the substrate the beam buckles at ε = −π²·w²/(3·L²) (Euler), here the fraction 0.8225 of −4e-4, to 1e-3.
#[test]
fn substrate_strain_buckles() {
    let critical = std::f64::consts::PI.powi(2) * W * W / (3.0 * L * L);
    let found = balance(&compiled(BRIDGE, &[("eps", -4e-4)]), &[]);
    assert_eq!(found.passed.len(), 1, "{:?}", found.passed);
    close(found.passed[0].share, critical / 4e-4, 1e-3);
    // the half wave of a clamped strut: its height is 2·√(ε − ε_cr)·L/π for small ones
    let middle = node(&found, "m");
    close(middle.x.hypot(middle.y), 2.0 * (4e-4 - critical).sqrt() * L / std::f64::consts::PI, 2e-2);
}

/// A strain along y alone does nothing to a beam along x. A given displacement of one anchor by u along x presses the beam by E·u/L, and one by v across gives both ends the moment 6EI·v/L² (Euler-Bernoulli).
#[test]
fn displacements_of_anchors() {
    let across = BRIDGE.replace("packagestrain=eps", "packagestrainy=eps");
    assert!(balance(&compiled(&across, &[("eps", 1e-3)]), &[]).stresses_pa[0].1.abs() < 1.0);
    let moved =
        |motion: &str| BRIDGE.replace(" packagestrain=eps", "").replace("[b] [oz=turn]", &format!("[b] [{motion}]"));
    close(balance(&compiled(&moved("anchorx=10n"), &[]), &[]).stresses_pa[0].1, E * 10e-9 / L, 1e-5);
    // σ = M·w/(2I) with M = 6EI·v/L², and the tension of the longer curve, E·3/5·(v/L)²
    let wanted = 3.0 * E * W * 10e-9 / (L * L) + 0.6 * E * (10e-9 / L).powi(2);
    close(balance(&compiled(&moved("anchory=10n"), &[]), &[]).stresses_pa[0].1, wanted, 1e-4);
    let found = balance(&compiled(&moved("anchory=10n"), &[]), &[]);
    close(node(&found, "m").y, 5e-9, 1e-6);
}

/// An electrode on an anchor moves with it: the capacitance of a plate over it is ε₀·A/(gap − displacement), to 1e-5.
#[test]
fn electrodes_move_with_their_anchors() {
    let text = "process p = [ Youngsmodulus=160e9 density=2330 h=2u permittivity=8.854e-12 ]
anchor p [a] []
beam2d p [a m] [l=20u w=20u]
anchor p [e] [anchory=100n]
plate plategap2d p [m e] [A=1e-10 gap=2u oz=-pi/2]
eground * [e] []
feed port * [m] []";
    let charge = balance(&compiled(text, &[]), &[("feed", 1e-3)]).charges_c[0].1;
    close(charge, 8.854e-12 * 1e-10 / 1.9e-6 * 1e-3, 1e-5);
}

/// A linear frame has the same strains, and a run settles where the statics are: a cantilever on an anchor that moves by 10 nm.
#[test]
fn runs_and_frames_move() {
    let text = BRIDGE.replace(" packagestrain=eps", "").replace("[b] [oz=turn]", "[b] [anchory=10n]");
    let model = compiled(&text, &[]);
    let (found, _) = frame_statics(&model, &frame(&model).unwrap(), &[]).unwrap();
    close(node(&found, "m").y, 5e-9, 1e-5);
    let options = TransientOptions {
        stop: 200e-6,
        signals: vec!["b.y".into(), "m.y".into()],
        points: 2001,
        ..TransientOptions::default()
    };
    let run = transient(&model, &options, &mut |_, _| {}, &mut |_| true).unwrap_or_else(|e| panic!("{e}"));
    let [end, middle] = [0, 1].map(|k| &run.signals[k].2);
    close(end[2000], 10e-9, 1e-5);
    let mean = middle.iter().sum::<f64>() / 2001.0;
    close(mean, 5e-9, 5e-2);
}
