//! The models in examples/: each netlist as shipped, against the figures that it demonstrates.

use crate::{balance, close, node};
use bimorph::analysis::modes::modes;
use bimorph::analysis::transient::{TransientOptions, transient};
use bimorph::compile::{CompileOptions, CompiledModel, Junctions, compile};
use bimorph::netlist::{Setting, read_bundle};
use std::path::Path;

fn scene(name: &str, set: &[(&str, f64)], options: &CompileOptions) -> CompiledModel {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples").join(name);
    let bundle = read_bundle(&path, &[]).unwrap_or_else(|e| panic!("{name}: {e}"));
    let set = set.iter().map(|(n, v)| ((*n).to_owned(), Setting::Number(*v))).collect();
    let compiled = compile(&bundle, &CompileOptions { set, junctions: Junctions::Centreline, ..options.clone() })
        .unwrap_or_else(|e| panic!("{e}"));
    assert!(compiled.warnings.items.is_empty(), "{}", compiled.warnings);
    compiled
}

fn band(band: f64) -> CompileOptions {
    CompileOptions { band: Some(band), ..CompileOptions::default() }
}

fn frequencies(compiled: &CompiledModel, want: &[f64], relative: f64) {
    let found = modes(compiled, want.len(), &[]).unwrap().frequencies_hz;
    assert_eq!(found.len(), want.len());
    for (found, want) in found.iter().zip(want) {
        close(*found, *want, relative);
    }
}

/// The single bimorph rings at 96.9, 420.1 and 859.5 kHz (converged frame of cubic beams) within 0.3 %, and 10 µN on its
/// link move it by 3.88 µm (corotational frame) within 0.5 %.
#[test]
fn single_bimorph() {
    let file = "single_bimorph/single_bimorph.net";
    frequencies(&scene(file, &[], &band(1e6)), &[96.9e3, 420.1e3, 859.5e3], 3e-3);
    let pushed = scene(file, &[("F", 1e-5)], &band(1e6));
    close(node(&balance(&pushed, &[]), "tip").y, 3.88e-6, 5e-3);
}

/// Without its comb the bank rings at ten frequencies of a converged frame of cubic beams, within 0.15 %.
#[test]
fn bank_of_three() {
    let want = [86.3e3, 407.7e3, 408.1e3, 418.0e3, 627.0e3, 641.6e3, 798.5e3, 1123.4e3, 1123.9e3, 1141.7e3];
    frequencies(&scene("bank/bank.net", &[("comb", 0.0)], &band(1.3e6)), &want, 1.5e-3);
}

/// The quarter stage rings at 72.0, 85.0 and 362 kHz (frame of cubic beams) within 0.2 %; 100 µN along x move it by
/// (8.52, 1.060) µm (corotational frame) within 0.5 %, and by 7.13 µm in small displacements.
#[test]
fn quarter_stage() {
    let file = "quarter_stage/quarter_stage.net";
    frequencies(&scene(file, &[], &band(1e7)), &[72.0e3, 85.0e3, 362e3], 2e-3);
    let pushed = node(&balance(&scene(file, &[("F", 1e-4)], &CompileOptions::default()), &[]), "c");
    close(pushed.x, 8.52e-6, 5e-3);
    close(pushed.y, 1.060e-6, 5e-3);
    let linear = CompileOptions { linear: true, ..CompileOptions::default() };
    close(node(&balance(&scene(file, &[("F", 1e-4)], &linear), &[]), "c").x, 7.13e-6, 5e-4);
}

/// Released from 100 µN, the quarter stage crosses x = 0 at 3.42, 9.46, 16.28 and 22.43 µs (corotational frame, HHT),
/// within 0.5 %.
#[test]
fn quarter_stage_release() {
    let file = "quarter_stage/quarter_stage.net";
    let options = CompileOptions { undamped: true, ..CompileOptions::default() };
    let held = scene(file, &[("F", 1e-4)], &options);
    let asked = TransientOptions {
        stop: 24e-6,
        signals: vec!["c.x".into()],
        points: 961,
        tol: 1e-3,
        voltages: vec![],
        release: Some(&held),
        ..TransientOptions::default()
    };
    let found = transient(&scene(file, &[], &options), &asked, &mut |_, _| {}, &mut |_| true).unwrap();
    let x = &found.signals[0].2;
    let crossings = (1..x.len())
        .filter(|&k| x[k - 1] * x[k] < 0.0)
        .map(|k| found.t[k - 1] + (found.t[k] - found.t[k - 1]) * x[k - 1] / (x[k - 1] - x[k]));
    let crossings: Vec<f64> = crossings.collect();
    assert_eq!(crossings.len(), 4);
    for (found, want) in crossings.iter().zip([3.42e-6, 9.46e-6, 16.28e-6, 22.43e-6]) {
        close(*found, want, 5e-3);
    }
}

/// The rotary stage turns about its centre alone: banks A and B turn it by opposite angles and shift it by less than a
/// femtometre, and a tenfold finer model agrees within 0.1 %.
#[test]
fn rotary_stage() {
    let file = "rotary_stage/rotary_stage.net";
    let turned =
        |port: &str, options: &CompileOptions| node(&balance(&scene(file, &[], options), &[(port, 2.5)]), "rotor");
    let (one, other) = (turned("clockwise", &CompileOptions::default()), turned("counter", &CompileOptions::default()));
    for moved in [one, other] {
        assert!(moved.x.hypot(moved.y) < 1e-15, "{moved:?}");
    }
    assert!(one.rz < 0.0);
    close(one.rz, -other.rz, 1e-9);
    close(other.rz, turned("counter", &band(4e7)).rz, 1e-3);
}

/// The comb resonator oscillates as W. C. Tang, T.-C. H. Nguyen, R. T. Howe (1989) give it, 2π·f = √(k/(M_p + M_t/4 +
/// 12·M_b/35)) with k = 2·E·h·w³/l³, within 0.5 %. The trusses count as half as fast as the shuttle. Its comb displaces
/// it by N·ε·h·V²/(2·g·k) within 0.2 %.
#[test]
fn comb_resonator() {
    let file = "comb_resonator/comb_resonator.net";
    let (l, w, h, rho): (f64, f64, f64, f64) = (200e-6, 2e-6, 2e-6, 2300.0);
    let stiffness = 2.0 * 165e9 * h * (w / l).powi(3);
    let (plates, trusses, beams) = (80e-6 * 80e-6 + 2.0 * 16e-6 * 160e-6, 2.0 * 120e-6 * 10e-6, 8.0 * l * w);
    let mass = rho * h * (plates + trusses / 4.0 + 12.0 / 35.0 * beams);
    let resonator = scene(file, &[], &band(1e5));
    frequencies(&resonator, &[(stiffness / mass).sqrt() / std::f64::consts::TAU], 5e-3);
    let pull = 40.0 * 8.854e-12 * h * 60.0 * 60.0 / (2.0 * 2e-6);
    close(node(&balance(&resonator, &[("drive", 60.0)]), "shuttle").x, pull / stiffness, 2e-3);
}

/// The chevron, warmed by 600 K on average at V² = 600·12·ρ·k, rises by 2.711 µm (corotational frame) within 0.1 %, and
/// in small displacements by α·ΔT·l·sin/(sin² + w²/l²·cos²) within 1e-6.
#[test]
fn chevron() {
    let file = "chevron/chevron.net";
    let volts = (600.0 * 12.0 * 20.0 * 3.5e-6 * 30.0f64).sqrt();
    let apex = |options| node(&balance(&scene(file, &[], &options), &[("heat", volts)]), "apex").y;
    close(apex(CompileOptions::default()), 2.711e-6, 1e-3);
    let (sin, cos) = 0.1f64.sin_cos();
    let l = 200e-6 / cos;
    let small = 2.5e-6 * 600.0 * l * sin / (sin * sin + (4e-6 / l).powi(2) * cos * cos);
    close(apex(CompileOptions { linear: true, ..CompileOptions::default() }), small, 1e-6);
}
