//! Netlists behind the plug-in, against closed forms and against the same part written with ngspice's B-sources.

use crate::support::{complex, complex_deviation, deck, deviation, real, run, skipped};
use bimorph::cosim::CosimOptions;

const PERMITTIVITY: f64 = 8.854e-12;
const STIFFNESS: f64 = 1.0;
const MASS: f64 = 1e-10;
const AREA: f64 = 1e-8;
const GAP: f64 = 2e-6;

fn options(name: &str) -> CosimOptions {
    CosimOptions { deck: deck(name), ..CosimOptions::default() }
}

/// A sweep jumps at the static pull-in voltage √(8kg³/27εA) = 5.1741 V, to 0.1 %, from a third of the gap.
#[test]
fn static_pull_in() {
    if skipped() {
        return;
    }
    let want = (8.0 * STIFFNESS * GAP.powi(3) / (27.0 * PERMITTIVITY * AREA)).sqrt();
    assert!((want - 5.1741).abs() < 1e-4);
    let sweep = run(options("plate_static_pull_in.cir")).unwrap();
    let plot = sweep.plot("DC");
    let (v, x) = (real(plot, "v(v-sweep)"), real(plot, "v(x)"));
    let jump = (1..x.len()).find(|&i| x[i] - x[i - 1] > 0.5).expect("the plate never pulled in");
    assert!((v[jump] / want - 1.0).abs() < 1e-3, "pulled in at {} V, expected {want} V", v[jump]);
    assert!(x[jump - 1] < 0.6667 && x[jump - 1] > 0.6, "{} um before the jump", x[jump - 1]);
}

/// Stepped to 0.5 % below the dynamic pull-in voltage √(kg³/4εA) = 4.7527 V the undamped plate turns back within half
/// the gap; 0.5 % above it pulls in.
#[test]
fn dynamic_pull_in() {
    if skipped() {
        return;
    }
    let step = run(options("plate_dynamic_pull_in.cir")).unwrap();
    let plot = step.plot("Transient");
    let farthest = |name| real(plot, name).iter().copied().fold(0.0, f64::max);
    let (below, above) = (farthest("v(x)"), farthest("v(x2)"));
    assert!(below > 0.8 && below < 1.0, "0.5 % below, the plate reaches {below} um");
    assert!(above > 1.5, "0.5 % above, the plate reaches {above} um");
}

/// Under 4 V the small-signal resonance is that of the softened spring k − εAV²/(g − x)³; it lies where the response
/// changes its sign, to the 5 Hz between two frequencies.
#[test]
fn softened_resonance() {
    if skipped() {
        return;
    }
    let run = run(options("plate_softening.cir")).unwrap();
    let v = 4.0f64;
    let mut x = 0.0f64;
    for _ in 0..400 {
        x = 0.5 * PERMITTIVITY * AREA * v * v / (GAP - x).powi(2) / STIFFNESS;
    }
    let op = real(run.plot("Operating"), "v(x)")[0];
    assert!((op / (x * 1e6) - 1.0).abs() < 1e-6, "{op} um against {} um", x * 1e6);
    let soft = STIFFNESS - PERMITTIVITY * AREA * v * v / (GAP - x).powi(3);
    let want = (soft / MASS).sqrt() / std::f64::consts::TAU;
    let plot = run.plot("AC");
    let (f, y) = (complex(plot, "frequency"), complex(plot, "v(x)"));
    let at = (1..y.len()).find(|&i| y[i - 1][0] * y[i][0] < 0.0).expect("no resonance between 12 and 15 kHz");
    assert!(f[at - 1][0] <= want && want <= f[at][0], "between {} and {} Hz, expected {want}", f[at - 1][0], f[at][0]);
}

/// A comb resonator as a netlist and as B-sources: small signal to 1e-6 of the largest value, displacement and sense
/// current in time to 1e-4 of their range.
#[test]
fn comb_agrees_with_b_sources() {
    if skipped() {
        return;
    }
    let (ours, theirs) = (run(options("comb.cir")).unwrap(), run(options("comb_b_sources.cir")).unwrap());
    let (a, b) = (ours.plot("AC"), theirs.plot("AC"));
    for column in ["v(x)", "i(vd)", "i(vs)"] {
        let off = complex_deviation(complex(a, column), complex(b, column));
        assert!(off < 1e-6, "ac {column}: {off:e}");
    }
    let (a, b) = (ours.plot("Transient"), theirs.plot("Transient"));
    for column in ["v(x)", "i(vs)"] {
        let wave = |p| (real(p, "time"), real(p, column));
        let off = deviation(wave(a), wave(b), 1e-6, 90e-6);
        assert!(off < 1e-4, "tran {column}: {off:e}");
    }
}

/// Hard edges, rejected steps and steps of ngspice's own choice give the motion of a small fixed step. Tolerance:
/// ngspice's limit was 1e-4 per step.
#[test]
fn rejected_steps_leave_no_trace() {
    if skipped() {
        return;
    }
    let (free, fine) = (run(options("comb_edges.cir")).unwrap(), run(options("comb_edges_fine.cir")).unwrap());
    let (a, b) = (free.plot("Transient"), fine.plot("Transient"));
    let wave = |p| (real(p, "time"), real(p, "v(x)"));
    let off = deviation(wave(a), wave(b), 1e-6, 30e-6);
    assert!(off < 1e-4, "{off:e}");
}

/// The same deck gives the same bytes twice.
#[test]
fn runs_are_repeatable() {
    if skipped() {
        return;
    }
    let (a, b) = (run(options("comb_edges.cir")).unwrap(), run(options("comb_edges.cir")).unwrap());
    assert_eq!(a.plots, b.plots);
}

/// A sweep follows its branch: downwards the plate stays pulled in where upwards it is not, and finally opens. An
/// operating point in the same run starts from rest whatever the sweep left behind.
#[test]
fn sweeps_follow_their_branch() {
    if skipped() {
        return;
    }
    let run = run(options("plate_hysteresis.cir")).unwrap();
    let plot = run.plot("DC");
    let (v, x) = (real(plot, "v(v-sweep)"), real(plot, "v(x)"));
    let at = |volts: f64| x[v.iter().position(|v| (v - volts).abs() < 1e-6).unwrap()];
    assert!(at(6.0) > 1.5 && at(5.0) > 1.5, "{} um at 6 V, {} um at 5 V", at(6.0), at(5.0));
    assert!(at(0.0).abs() < 1e-6, "{} um at 0 V", at(0.0));
    let op = real(run.plot("Operating"), "v(x)")[0];
    assert!(op < 0.6667, "{op} um at the operating point");
}
