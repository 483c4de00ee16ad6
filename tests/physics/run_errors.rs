//! The error that a run reports of its steps, against closed forms and sharper runs.

use crate::model;
use bimorph::analysis::chart::error::{half_range, largest_error};
use bimorph::analysis::integrator::Integrator;
use bimorph::analysis::step_error::with_step_error;
use bimorph::analysis::transient::{TransientOptions, TransientResult, transient};
use bimorph::compile::{CompileOptions, CompiledModel, Formulation, compile};
use bimorph::netlist::{Bundle, NetlistSource, read_bundle};
use std::path::Path;

fn reported(model: &CompiledModel, options: &TransientOptions<'_>) -> TransientResult {
    let mut run =
        |options: &TransientOptions<'_>, sample: &mut dyn FnMut(f64, &[f64]), watch: &mut dyn FnMut(f64) -> bool| {
            transient(model, options, sample, watch).map(|r| (r, ()))
        };
    with_step_error(options, model, &mut run, &mut |_, _| (), &mut |_| true).unwrap().0
}

/// Root mean square error of samples, of their amplitude.
fn off(result: &TransientResult, signal: usize, exact: impl Fn(f64) -> f64) -> f64 {
    let values = &result.signals[signal].2;
    let sum: f64 = result.t.iter().zip(values).map(|(t, x)| (x - exact(*t)).powi(2)).sum();
    (sum / values.len() as f64).sqrt() / half_range(values)
}

/// Two springs of 2 N/m in a row with a node between them that has no mass, and 1e-10 kg: x = cos(1e5 rad/s·t) from 1 µm, the node
/// at half of it.
const WITHOUT_MASS: &str = "
    param F=0
    anchor * [f] [l=1u w=1u h=1u]
    spring2d * [f n] [kx=2 ky=2 kr=1e-12]
    spring2d * [n m] [kx=2 ky=2 kr=1e-12]
    mass2d * [m] [m=1e-10]
    guide2d * [m] []
    f2d * [m] [F=F]";

/// An undamped oscillator over 10 and 200 periods. The reported error is the true one within a factor of 3, and that is
/// within the tolerance. The cases are a mass on a spring, and one behind a node without mass, which follows its
/// springs. Closed form.
#[test]
fn errors_of_an_oscillator() {
    let one = "param F=0\nanchor * [f] [l=1u w=1u h=1u]\nmass2d * [m] [m=1e-10]\nguide2d * [m] []\nspring2d * [f m] [kx=1]\nf2d * [m] [F=F]";
    for (text, signals) in [(one, &["m.x"][..]), (WITHOUT_MASS, &["m.x", "n.x"])] {
        let start = model(&text.replace("F=0", "F=1u"), &CompileOptions::default());
        let compiled = model(text, &CompileOptions::default());
        for (periods, tol) in [(10.0, 1e-2), (10.0, 1e-4), (200.0, 1e-3), (200.0, 1e-4)] {
            let options = TransientOptions {
                stop: periods * std::f64::consts::TAU / 1e5,
                signals: signals.iter().map(|name| (*name).to_owned()).collect(),
                points: 1001,
                release: Some(&start),
                tol,
                ..TransientOptions::default()
            };
            let found = reported(&compiled, &options);
            for signal in 0..signals.len() {
                let amplitude = if signal == 0 { 1e-6 } else { 0.5e-6 };
                let error = off(&found, signal, |t| amplitude * (1e5 * t).cos());
                let reported = found.step_error.unwrap();
                println!(
                    "{signals:?} {periods} {tol:e}: {error:.2e}, reported {reported:.2e}, {} steps",
                    found.counters.steps
                );
                assert!(
                    (1.0 / 3.0..3.0).contains(&(reported / error)),
                    "{periods} {tol:e}: {error:e}, reported {reported:e}"
                );
                assert!(error <= tol && reported <= tol, "{periods} {tol:e}: {error:e}, reported {reported:e}");
            }
        }
    }
}

/// Jacobi's function cn(u | m), by the arithmetic-geometric mean (Abramowitz and Stegun, 16.4).
fn cn(u: f64, m: f64) -> f64 {
    let (mut a, mut b, mut means) = (1.0_f64, (1.0 - m).sqrt(), Vec::new());
    while (a - b).abs() > 1e-15 {
        let c = 0.5 * (a - b);
        (a, b) = (0.5 * (a + b), (a * b).sqrt());
        means.push((a, c));
    }
    let whole = a * u * f64::from(1 << means.len());
    means.iter().rev().fold(whole, |phi, (a, c)| 0.5 * (phi + (c / a * phi.sin()).asin())).cos()
}

/// An undamped mass on a spring with k₃·a² = k₁ over 200 periods is predictable. The reported error is at least the true one and at most five times as large,
/// although the propagated one grows without bound. Closed form: x = a·cn(√(2k₁/m)·t | ¼).
#[test]
fn a_hardening_oscillator_is_predictable() {
    let text = "param F=0\nanchor * [f] []\nspring2d * [f m] [kx=1 kx3=1e12]\nmass2d * [m] [m=1e-10]\nguide2d * [m] []\nf2d * [m] [F=F]";
    let start = model(&text.replace("F=0", "F=2u"), &CompileOptions::default());
    let compiled = model(text, &CompileOptions::default());
    let options = TransientOptions {
        stop: 10e-3,
        signals: vec!["m.x".into()],
        points: 1001,
        release: Some(&start),
        ..TransientOptions::default()
    };
    let found = reported(&compiled, &options);
    let error = off(&found, 0, |t| 1e-6 * cn(2e10_f64.sqrt() * t, 0.25));
    let reported = found.step_error.unwrap();
    println!("{error:.2e}, reported {reported:.2e}");
    assert!((1.0..5.0).contains(&(reported / error)) && reported < 1e-3, "{error:e}, reported {reported:e}");
    assert!(found.warnings.is_empty(), "{:?}", found.warnings);
}

/// A plate of 0.2 mm on a short flexure, which swings by a radian after a release.
const SWING: &str = "
    process p1 = [Youngsmodulus=165e9 density=2300 h=9.3u]
    param F=0
    anchor p1 [a] []
    beam2d p1 [a j] [l=9.9u w=1.24u oz=deg(-17)]
    link2d * [j m] [l=103u oz=deg(-17)]
    plate2d p1 [m] [l=206u w=127u oz=deg(-17)]
    f2d * [m] [F=F oz=deg(136)]";

/// The error of a body that swings far is reported, over bodies and in joint coordinates: at least half of the true one, which is within the tolerance. Steps
/// damp the fast motions of the flexure, which turn with the plate, and the linear estimate alone says 3.1e-3 where bodies have an error of 2.4e-2. In joint
/// coordinates the plate takes its 169 steps only where inertia that turns is part of the equations of a step (705 steps and an error of 1.0e-2 without).
/// Against Radau IIA at a tolerance of 1e-6.
#[test]
fn errors_of_a_body_that_swings_far() {
    let loaded = |text: &str, formulation| {
        let options = CompileOptions { formulation, segments: Some(4), ..CompileOptions::default() };
        model(text, &options)
    };
    let options = TransientOptions {
        stop: 0.9e-3,
        signals: vec!["m.x".into(), "m.y".into()],
        points: 101,
        ..TransientOptions::default()
    };
    let exact = {
        let start = loaded(&SWING.replace("F=0", "F=200u"), Formulation::Compliant);
        let options =
            TransientOptions { release: Some(&start), tol: 1e-6, method: Integrator::Radau5, ..options.clone() };
        transient(&loaded(SWING, Formulation::Compliant), &options, &mut |_, _| (), &mut |_| true).unwrap()
    };
    for (formulation, most) in [(Formulation::Compliant, 20_000), (Formulation::RcrElastic, 250)] {
        let start = loaded(&SWING.replace("F=0", "F=200u"), formulation);
        let options = TransientOptions { release: Some(&start), tol: 1e-2, ..options.clone() };
        let found = reported(&loaded(SWING, formulation), &options);
        let error = largest_error(&found, &exact, &|_| 0.0);
        let (reported, steps) = (found.step_error.unwrap(), found.counters.steps);
        println!("{formulation:?}: {error:.2e}, reported {reported:.2e}, {steps} steps");
        assert!(error <= 1e-2 && reported <= 1e-2 && error <= 2.0 * reported, "{error:e}, reported {reported:e}");
        assert!(steps < most, "{steps} steps");
    }
}

/// Plates on flexures in a chain that is held at its end.
const HELD_CHAIN: &str = "
    process p1 = [Youngsmodulus=165e9 density=2300 h=1.63u]
    anchor p1 [a] []
    beam2d p1 [a r] [l=8.98u w=0.967u oz=0.042]
    link2d * [r c] [l=65.75u oz=0.042]
    plate2d p1 [c] [l=131.5u w=81.6u oz=0.042]
    link2d * [c q] [l=65.75u oz=0.042]
    beam2d p1 [q s] [l=21.2u w=1u oz=-0.182]
    link2d * [s d] [l=65.2u oz=-0.182]
    plate2d p1 [d] [l=130.4u w=138u oz=-0.182]
    link2d * [d t] [l=65.2u oz=-0.182]
    beam2d p1 [t u] [l=83.7u w=1.42u oz=-0.03]
    link2d * [u e] [l=50.33u oz=-0.03]
    plate2d p1 [e] [l=100.7u w=126u oz=-0.03]
    link2d * [e v] [l=50.33u oz=-0.03]
    beam2d p1 [v w] [l=14.3u w=1.33u oz=-0.072]
    link2d * [w m] [l=75.5u oz=-0.072]
    plate2d p1 [m] [l=151u w=71u oz=-0.072]
    link2d * [m x] [l=75.5u oz=-0.072]
    beam2d p1 [x y] [l=48.1u w=1.06u oz=-1.378]
    anchor p1 [y] []
    f2d * [m] [F=2.889u oz=5.345]";

/// A tree of beams with plates at its ends, the slender ones of which swing fast.
const SLENDER_BRANCHES: &str = "
    process p1 = [Youngsmodulus=165e9 density=2300 h=4.15u]
    anchor p1 [a] []
    beam2d p1 [a n] [l=52.78u w=1.93u oz=-0.7758]
    beam2d p1 [n b] [l=75.24u w=0.504u oz=-2.6033]
    beam2d p1 [n c] [l=95.87u w=0.572u oz=1.4826]
    beam2d p1 [n m] [l=62.85u w=3.84u oz=1.1410]
    plate2d p1 [b] [l=16u w=16u]
    plate2d p1 [c] [l=28.8u w=28.8u]
    plate2d p1 [m] [l=22u w=22u]
    f2d * [m] [F=3.763u oz=0.361]";

/// No more runs are made than the error requires, and it is within the tolerance. Steps of the chain at 1e-2 do not resolve it, and the next ones have a tenth of the
/// tolerance, where a hundredth takes 1,634 steps. The energy that those of the branches take is 4e-3 of that of the motion, and most of it does not matter: a run
/// of ten times the tolerance is compared, none is made at a tenth (10,867 steps). Against Radau IIA at a hundredth of the tolerance.
#[test]
fn no_more_runs_than_the_error_requires() {
    for (text, segments, (tol, stop), want) in
        [(HELD_CHAIN, 2, (1e-2, 186.5e-6), [1e-2, 1e-3]), (SLENDER_BRANCHES, 8, (1e-3, 305e-6), [1e-3, 1e-2])]
    {
        let undamped = CompileOptions { segments: Some(segments), undamped: true, ..CompileOptions::default() };
        let compiled = model(text, &CompileOptions { formulation: Formulation::Compliant, ..undamped });
        let options = TransientOptions {
            stop,
            signals: vec!["m.x".into(), "m.y".into()],
            points: 101,
            tol,
            ..TransientOptions::default()
        };
        let exact = TransientOptions { tol: 1e-2 * tol, method: Integrator::Radau5, ..options.clone() };
        let exact = transient(&compiled, &exact, &mut |_, _| (), &mut |_| true).unwrap();
        let mut tolerances = Vec::new();
        let mut run = |options: &TransientOptions<'_>,
                       sample: &mut dyn FnMut(f64, &[f64]),
                       watch: &mut dyn FnMut(f64) -> bool| {
            tolerances.push(options.tol);
            transient(&compiled, options, sample, watch).map(|r| (r, ()))
        };
        let found = with_step_error(&options, &compiled, &mut run, &mut |_, _| (), &mut |_| true).unwrap().0;
        let error = largest_error(&found, &exact, &|_| 0.0);
        println!("{error:.2e}, reported {:.2e}, {} steps", found.step_error.unwrap(), found.counters.steps);
        let same = tolerances.iter().zip(want).all(|(tol, want)| (tol / want - 1.0_f64).abs() < 1e-9);
        assert!(same && tolerances.len() == want.len(), "{tolerances:?}");
        assert!(error <= tol && found.step_error.unwrap() <= tol, "{error:e}");
    }
}

fn bimorph() -> (Bundle, CompileOptions) {
    let path = format!("{}/examples/single_bimorph/single_bimorph.net", env!("CARGO_MANIFEST_DIR"));
    let set = vec![("F".to_owned(), bimorph::netlist::Setting::Number(20e-6))];
    let options = CompileOptions { set, segments: Some(4), ..CompileOptions::default() };
    (read_bundle(Path::new(&path), &[]).unwrap(), options)
}

/// A large motion on bodies and in joint coordinates: with the estimate the samples are bit-identical to those without, and it is the
/// distance to a run at a thousandth of the tolerance within a factor of 3.
#[test]
fn estimates_leave_the_motion_alone() {
    for formulation in [Formulation::Compliant, Formulation::RcrElastic] {
        let (bundle, options) = bimorph();
        let options = CompileOptions { formulation, ..options };
        let start = compile(&bundle, &options).unwrap();
        let moving = bimorph::analysis::chart::released(&NetlistSource::new(&bundle), &start, "F").unwrap();
        let run = |tol: f64, estimate: bool| {
            let options = TransientOptions {
                stop: 50e-6,
                signals: vec!["tip.x".into(), "tip.y".into()],
                release: Some(&start),
                tol,
                estimate,
                ..TransientOptions::default()
            };
            transient(&moving, &options, &mut |_, _| {}, &mut |_| true).unwrap()
        };
        let exact = run(1e-6, false);
        for tol in [1e-2, 1e-3, 1e-4] {
            let (alone, found) = (run(tol, false), run(tol, true));
            assert_eq!(alone.signals, found.signals);
            assert_eq!((alone.counters, alone.step_error), (found.counters, None));
            let (error, reported) = (largest_error(&exact, &found, &|_| 0.0), found.step_error.unwrap());
            println!("{formulation:?} {tol:e}: {error:.2e}, reported {reported:.2e}");
            assert!(
                (1.0 / 3.0..3.0).contains(&(reported / error)),
                "{formulation:?} {tol:e}: {error:e}, reported {reported:e}"
            );
        }
    }
}

/// Loose steps over 3000 periods lose the phase of an oscillator: the run says from when on, and reports an error of the order of the
/// amplitude, at most twice it.
#[test]
fn a_lost_phase_is_reported() {
    let text = WITHOUT_MASS;
    let start = model(&text.replace("F=0", "F=1u"), &CompileOptions::default());
    let compiled = model(text, &CompileOptions::default());
    let options = TransientOptions {
        stop: 3000.0 * std::f64::consts::TAU / 1e5,
        signals: vec!["m.x".into()],
        release: Some(&start),
        tol: 0.2,
        estimate: true,
        ..TransientOptions::default()
    };
    let found = transient(&compiled, &options, &mut |_, _| {}, &mut |_| true).unwrap();
    let reported = found.step_error.unwrap();
    assert!((0.5..=2.0).contains(&reported), "{reported}");
    assert!(found.warnings.iter().any(|w| w.starts_with("the phase of m.x is lost after")), "{:?}", found.warnings);
}
