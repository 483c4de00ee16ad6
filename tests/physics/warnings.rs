//! Warnings: errors of steps in time, omissions of a linear model, snaps, and excessive loads.

use super::{close, node};
use bimorph::analysis::mesh::fitted_in_time;
use bimorph::analysis::mesh::modes_fitted;
use bimorph::analysis::mesh::pull_in_fitted;
use bimorph::analysis::mesh::static_fitted;
use bimorph::analysis::modes::modes;
use bimorph::analysis::step_error::with_step_error;
use bimorph::analysis::transient::{TransientOptions, TransientResult, transient};
use bimorph::analysis::{AnalysisError, chart};
use bimorph::compile::{CompileOptions, CompiledModel, Junctions, compile};
use bimorph::netlist::{Bundle, NetlistSource, Setting, read_bundle};
use std::path::Path;

const SILICON: &str = "process p = [Youngsmodulus=165e9 density=2300 h=2u]\nparam F=0\nanchor p [a] []\n";

fn drawn(text: &str, options: &CompileOptions) -> CompiledModel {
    let options = CompileOptions { junctions: Junctions::Centreline, ..options.clone() };
    compile(&Bundle::from_text("told.net", &format!("{SILICON}{text}")), &options).unwrap()
}

fn with(f: f64) -> Vec<(String, Setting)> {
    vec![("F".to_owned(), Setting::Number(f))]
}

fn example(name: &str) -> Bundle {
    let path = format!("{}/examples/{name}/{name}.net", env!("CARGO_MANIFEST_DIR"));
    read_bundle(Path::new(&path), &[]).unwrap()
}

/// A run with its step error and warnings.
fn reported(model: &CompiledModel, start: &CompiledModel, options: &TransientOptions<'_>) -> TransientResult {
    let options = TransientOptions { release: Some(start), ..options.clone() };
    let mut run =
        |options: &TransientOptions<'_>, sample: &mut dyn FnMut(f64, &[f64]), watch: &mut dyn FnMut(f64) -> bool| {
            transient(model, options, sample, watch).map(|r| (r, ()))
        };
    with_step_error(&options, model, &mut run, &mut |_, _| (), &mut |_| true).unwrap().0
}

/// The single bimorph released from 7 µm moves so far that its modes exchange energy, and control of each step does not
/// hold the tolerance over a run of 50 µs. The estimate is the error within a factor of four, and a warning appears
/// where it is beyond the tolerance. Against steps a thousand times more exact.
#[test]
fn steps_in_time_report_their_error() {
    let options = CompileOptions { set: with(20e-6), segments: Some(4), ..CompileOptions::default() };
    let start = compile(&example("single_bimorph"), &options).unwrap();
    let moving = chart::released(&NetlistSource::new(&example("single_bimorph")), &start, "F").unwrap();
    let run = |tol: f64| {
        let signals = vec!["tip.y".to_owned()];
        reported(&moving, &start, &TransientOptions { stop: 50e-6, tol, signals, ..TransientOptions::default() })
    };
    let exact = run(1e-6);
    for tol in [1e-2, 1e-3, 1e-4] {
        let found = run(tol);
        let (error, reported) = (chart::error::relative_error(&exact, &found), found.step_error.unwrap());
        println!("{tol:e}: {error:.1e}, told {reported:.1e}, {} steps", found.counters.steps);
        assert!((0.25..4.0).contains(&(reported / error)), "{tol:e}: {error:e} {reported:e}");
        assert_eq!(found.warnings.iter().any(|w| w.contains("steps in time")), reported > tol, "{:?}", found.warnings);
        assert!(error <= tol || reported > tol, "{tol:e}: {error:e} {reported:e}");
    }
}

/// A cantilever compressed along its axis with half of Euler's load, and pushed aside. With stress stiffening its tip
/// moves 3(tan u − u)/u³ times as far, u = l√(P/EI) (Timoshenko and Gere 1961, §1.11). The linear model omits this and
/// says so. Beyond Euler's load it says so too, and its modes have the stiffness that it leaves out.
#[test]
fn a_linear_model_says_what_stress_would_do() {
    let (l, w, h, e) = (200e-6, 2e-6, 2e-6, 165e9);
    let inertia = h * w * w * w / 12.0;
    let euler = (std::f64::consts::PI / (2.0 * l)).powi(2) * e * inertia;
    let text = "beam2d p [a b] [l=200u w=2u]\nf2d * [b] [F=F oz=pi]\nf2d * [b] [F=1n oz=pi/2]";
    let linear = |share: f64| {
        let options = CompileOptions { linear: true, set: with(share * euler), ..CompileOptions::default() };
        let (model, result, _) = static_fitted(&drawn(text, &options), &[]).unwrap();
        let messages: Vec<String> = model.warnings.items.iter().map(|d| format!("{} {}", d.code, d.message)).collect();
        (node(&result, "b").y, messages)
    };
    let (free, silent) = linear(0.0);
    assert_eq!(silent, [""; 0]);
    close(free, 1e-9 * l.powi(3) / (3.0 * e * inertia), 1e-6);
    let (half, messages) = linear(0.5);
    close(half, free, 1e-9);
    let u = l * (0.5 * euler / (e * inertia)).sqrt();
    let left_out = 3.0 * (u.tan() - u) / u.powi(3) - 1.0;
    let [message] = messages.as_slice() else { panic!("{messages:?}") };
    let number: f64 = message.rsplit(' ').next().unwrap().parse().unwrap();
    assert!(message.starts_with("W041") && (number / left_out - 1.0).abs() < 0.06, "{message}: {left_out}");
    let (_, messages) = linear(1.1);
    assert!(messages.iter().any(|m| m.starts_with("W041") && m.contains("buckle")), "{messages:?}");
    // a run in time says it too
    let options = CompileOptions { linear: true, set: with(0.5 * euler), ..CompileOptions::default() };
    let run = TransientOptions { stop: 10e-6, signals: vec!["b.y".into()], ..TransientOptions::default() };
    let (model, _) = fitted_in_time(&drawn(text, &options), &run).unwrap();
    assert!(model.warnings.items.iter().any(|d| d.code == "W041"), "{:?}", model.warnings.items);
    let (model, found, _) = modes_fitted(&drawn(text, &options), 1, &[]).unwrap();
    assert!(model.warnings.items.iter().all(|d| d.code != "W041"));
    let free = modes(&drawn(text, &CompileOptions { linear: true, ..CompileOptions::default() }), 1, &[]).unwrap();
    let softer = found.frequencies_hz[0] / free.frequencies_hz[0];
    // f² falls about as 1 − P/P_E
    assert!((0.68..0.74).contains(&softer), "{softer}");
}

/// The shallow arch beyond the load at which it snaps through (5.43 µN) rests on the far branch, says that it jumped
/// and not that it pulled in, and every mode there swings; just below it has not jumped. Released from there it does
/// not come back: it snaps back at 0.408 µN only, so that at rest under 1 µN the two branches are 6 µm apart.
#[test]
fn a_snapped_arch_is_on_the_far_branch() {
    let rests = |f: f64| {
        let model = compile(&example("arch"), &CompileOptions { set: with(f), ..CompileOptions::default() }).unwrap();
        let (fitted, result, _) = static_fitted(&model, &[]).unwrap();
        assert!(!result.pulled_in);
        let found = modes(&fitted, 4, &[]).unwrap();
        assert!(found.frequencies_hz.iter().all(|f| *f > 1e3), "{:?}", found.frequencies_hz);
        assert!(found.warnings.iter().all(|w| !w.contains("unstable")), "{:?}", found.warnings);
        (result.jumped, node(&result, "p(20)").y)
    };
    let (jumped, before) = rests(5.4e-6);
    assert!(!jumped && before > -2.5e-6, "{before:e}");
    let (jumped, after) = rests(5.5e-6);
    assert!(jumped && after < -7e-6, "{after:e}");
}

/// An excessive load is reported as that, and not as an unsupported part: the cantilever has a firm support.
#[test]
fn too_large_a_load_is_no_loose_part() {
    let text = "beam2d p [a b] [l=100u w=2u]\nf2d * [b] [F=F oz=pi/2]";
    let model = drawn(text, &CompileOptions { set: with(1.0), ..CompileOptions::default() });
    let error = static_fitted(&model, &[]).unwrap_err();
    assert!(matches!(error, AnalysisError::NoEquilibrium { .. }), "{error}");
    assert!(error.to_string().contains("the load is"), "{error}");
}

/// A moment that winds a cantilever to a radius M/EI below half its width is refused on the first meshes: the curvature there is that of the moment on any
/// mesh. The search went on to 1,024 segments, for minutes.
#[test]
fn a_moment_beyond_beams_ends_the_search() {
    for moment in [1e-5, 1e-3] {
        let text = format!("x beam2d p [a b] [l=100u w=2u]\nf2d * [b] [M={moment}]");
        let error = static_fitted(&drawn(&text, &CompileOptions::default()), &[]).unwrap_err();
        assert!(matches!(error, AnalysisError::NoEquilibrium { overbent: true, .. }), "{error}");
        let text = error.to_string();
        assert!(text.contains("beam x is bent to a radius") && text.contains("beyond beams"), "{text}");
        let segment = text.split("segment ").nth(1).and_then(|rest| rest.split(' ').next()).unwrap();
        assert!(segment.parse::<usize>().unwrap() <= 32, "{text}");
    }
}

/// One segment has two modes; a request for three gets two, with an estimate and a warning.
#[test]
fn fewer_modes_than_asked_for_are_reported() {
    let text = "beam2d p [a b] [l=100u w=2u]";
    let model = drawn(text, &CompileOptions { segments: Some(1), ..CompileOptions::default() });
    let found = modes(&model, 3, &[]).unwrap();
    assert_eq!(found.frequencies_hz.len(), 2);
    assert!(found.warnings.iter().any(|w| w.starts_with("only 2 of 3 modes")), "{:?}", found.warnings);
}

/// Equal steps far longer than the initial motion damp it away, in a companion of twice the step as well. An oscillator
/// of 15.9 kHz is released from 1 µm, in steps of 100 µs (ω·h = 10) and of 1 µs, over 2 ms.
#[test]
fn steps_that_outrun_the_motion_are_reported() {
    let text = "param F=1u\nanchor * [f] []\nspring2d * [f m] [kx=1]\nmass2d * [m] [m=1e-10]\nguide2d * [m] []\nf2d * [m] [F=F]";
    let drawn = |f: f64| {
        let options = CompileOptions { set: with(f), ..CompileOptions::default() };
        compile(&Bundle::from_text("told.net", text), &options).unwrap()
    };
    let (start, moving) = (drawn(1e-6), drawn(0.0));
    let reported = |step: f64| {
        let run = TransientOptions {
            stop: 2e-3,
            step: Some(step),
            release: Some(&start),
            signals: vec!["m.x".into()],
            ..TransientOptions::default()
        };
        let (model, _) = fitted_in_time(&moving, &run).unwrap();
        model.warnings.items.iter().any(|d| d.code == "W044")
    };
    assert!(reported(100e-6));
    assert!(!reported(1e-6));
}

/// A part that is unstable where it is drawn, and rests on its gap without any voltage, is said to be so: nothing pulls it in.
#[test]
fn what_no_voltage_holds_open_is_reported() {
    let plate = "anchor * [f] []\nspring2d * [f m] [kx=-1]\nmass2d * [m] [m=1e-10]\nguide2d * [m] []\n\
                 gp plategap2d * [m e] [A=1e-8 gap=2u]\nanchor * [e] []\neground * [e] []\ndrive port * [m e] []\n";
    let error = pull_in_fitted(&drawn(plate, &CompileOptions::default()), None, 200.0).unwrap_err().to_string();
    assert!(error.contains("unstable where it is drawn") && error.contains("`gp`"), "{error}");
}
