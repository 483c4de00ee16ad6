//! Combs whose fingers lie aside of the middle of their gaps: side force, side pull-in, misalignment, and a substrate.

use crate::{close, model};
use bimorph::analysis::modes::modes;
use bimorph::analysis::pull_in::pull_in;
use bimorph::analysis::statics::{StaticResult, static_equilibrium};
use bimorph::compile::{CompileOptions, CompiledModel};
use std::f64::consts::TAU;

const EPS: f64 = 8.854e-12;
/// Gaps, gap, height and overlap of the combs here (1, m, m, m).
const COMB: [f64; 4] = [40.0, 2e-6, 10e-6, 8e-6];

/// A mass of 1 ng on springs of `kx` and `ky` (N/m) that does not turn, and a comb with `more`.
fn shuttle(kx: f64, ky: f64, more: &str) -> CompiledModel {
    let text = format!(
        "anchor * [f] []
        mass2d * [m] [m=1e-12 J=1e-21]
        spring2d * [f m] [kx={kx} ky={ky} krz=1]
        anchor * [e] []
        drive comb2de * [m e] [N=40 gap=2u h=10u l=8u L=60u permittivity=8.854e-12 {more}]
        eground * [e] []
        in port * [m e] []"
    );
    model(&text, &CompileOptions::default())
}

fn volts(volts: f64) -> Vec<(String, f64)> {
    vec![("in".to_owned(), volts)]
}

fn place(result: &StaticResult) -> [f64; 2] {
    let motion = result.nodes.iter().find(|(name, _)| name == "m").unwrap().1;
    [motion.x, motion.y]
}

/// The fingers snap to the side at V² = g²·k_x/(N·ε·h)·(√(2·k_y/k_x + l²/g²) − l/g), k_x along the fingers, by R. Legtenberg, A. W. Groeneveld and M. Elwenspoek (J. Micromech. Microeng. 6 (1996) 320),
/// for four ratios of the stiffnesses. The result names the comb, and statics beyond that voltage is refused with that reason.
#[test]
fn fingers_snap_to_the_side() {
    let [n, g, h, l] = COMB;
    for (kx, ky) in [(1.0, 30.0), (1.0, 300.0), (0.5, 500.0), (10.0, 20.0)] {
        let compiled = shuttle(kx, ky, "");
        let root = (2.0 * ky / kx + (l / g).powi(2)).sqrt() - l / g;
        let expected = (g * g * kx / (n * EPS * h) * root).sqrt();
        let found = pull_in(&compiled, None, 1e4).unwrap();
        close(found.pull_in_v, expected, 2e-5);
        assert!(!found.held && found.release_v.is_none());
        assert!(found.warnings.iter().any(|w| w.contains("`drive`") && w.contains("side")), "{:?}", found.warnings);
        let beyond = static_equilibrium(&compiled, &volts(1.05 * expected));
        assert!(beyond.as_ref().is_err_and(|e| e.to_string().contains("drawn to the side")), "{beyond:?}");
        assert!(static_equilibrium(&compiled, &volts(0.99 * expected)).is_ok());
    }
}

/// A force that pushes the fingers of 2 µm gaps 3 µm aside is an error under a voltage. Without one the part moves by F/k_y as if it had no comb.
#[test]
fn touching_fingers_are_refused_under_a_voltage() {
    let pushed = shuttle(1.0, 30.0, "]\n        f2d * [m] [F=90u oz=pi/2");
    close(place(&static_equilibrium(&pushed, &volts(0.0)).unwrap())[1], 3e-6, 1e-9);
    let refused = static_equilibrium(&pushed, &volts(1.0));
    assert!(refused.as_ref().is_err_and(|e| e.to_string().contains("under a voltage, and touch at")), "{refused:?}");
}

/// Below that voltage the stiffness across is k_y − N·ε·h·o·V²/g³ (differentiated by hand): the square of the frequency across falls by it, that along does not change.
#[test]
fn voltage_softens_across_the_fingers() {
    let [n, g, h, l] = COMB;
    let (kx, ky, v) = (5.0, 30.0, 40.0);
    let compiled = shuttle(kx, ky, "");
    let u = 0.5 * v * v * n * EPS * h / g / kx;
    let found = modes(&compiled, 2, &volts(v)).unwrap();
    let stiffness: Vec<f64> = found.frequencies_hz.iter().map(|f| (TAU * f).powi(2) * 1e-12).collect();
    close(stiffness[0], kx, 1e-7);
    close(stiffness[1], ky - n * EPS * h * (l + u) * v * v / (g * g * g), 1e-7);
}

/// Misaligned fingers are in equilibrium where k_x·u and k_y·y balance the derivatives of ½V²·N/2·ε·h·o·(1/(g − y) + 1/(g + y)), by fixed-point iteration of these two
/// equations. They snap earlier than aligned ones, at a fold; to the left and to the right at the same voltage.
#[test]
fn misaligned_fingers() {
    let [n, g, h, l] = COMB;
    let (kx, ky, v, aside) = (1.0, 60.0, 60.0, 0.25e-6);
    let compiled = shuttle(kx, ky, "misalign=0.25u");
    let (mut u, mut y) = (0.0, 0.0);
    for _ in 0..500 {
        let (near, far) = (1.0 / (g - aside - y), 1.0 / (g + aside + y));
        let strength = 0.25 * v * v * n * EPS * h;
        (u, y) = (strength * (near + far) / kx, strength * (l + u) * (near * near - far * far) / ky);
    }
    let found = place(&static_equilibrium(&compiled, &volts(v)).unwrap());
    close(found[0], u, 1e-6);
    close(found[1], y, 1e-6);
    let snaps = |more: &str| pull_in(&shuttle(kx, ky, more), None, 1e3).unwrap().pull_in_v;
    let (aligned, left, right) = (snaps(""), snaps("misalign=0.25u"), snaps("misalign=-0.25u"));
    close(left, right, 1e-9);
    assert!(left < 0.95 * aligned && left > 0.5 * aligned, "{left} {aligned}");
}

/// κ of fingers over a substrate that is grounded with the rotor: 1.135 at w = g = h = d and 1.093 at w, g, h = 2, 3, 25 µm and d = h, by boundary elements (1e-4), within 1 %. Without a
/// substrate it is 2.049 and 1.110.
#[test]
fn a_substrate_takes_thrust() {
    for (w, g, h, kappa) in [(2.0, 2.0, 2.0, 1.135), (2.0, 3.0, 25.0, 1.093)] {
        let text = format!(
            "anchor * [f] []
            mass2d * [m] [m=1e-12]
            guide2d * [m] []
            spring2d * [f m] [kx=1]
            anchor * [e] []
            comb2de * [m e] [N=20 gap={g}u h={h}u w={w}u l=40u L=200u substrate={h}u permittivity=8.854e-12]
            eground * [e] []
            in port * [m e] []"
        );
        let found = place(&static_equilibrium(&model(&text, &CompileOptions::default()), &volts(3.0)).unwrap())[0];
        close(found, 0.5 * 9.0 * kappa * 20.0 * EPS * h / g, 1e-2);
    }
}
