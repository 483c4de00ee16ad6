//! `formulation=reduced` in statics and in time, against the full model of the same mesh.

use bimorph_analysis::mesh::{modes_fitted, static_fitted};
use bimorph_analysis::statics::{NodeMotion, StaticResult};
use bimorph_analysis::step_error::with_step_error;
use bimorph_analysis::transient::{TransientOptions, TransientResult, transient};
use bimorph_base::Setting;
use bimorph_model::compile::{CompileOptions, CompiledModel, Formulation, Junctions, draw};
use bimorph_netlist::{NetlistSource, read_bundle};
use std::path::Path;

/// A model of the examples on a given mesh, beams that meet in points.
fn example(name: &str, set: &[(&str, f64)], formulation: Formulation, tol: f64) -> CompiledModel {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples").join(name);
    let bundle = read_bundle(&path, &[]).unwrap();
    let options = CompileOptions {
        junctions: Junctions::Centreline,
        segments: Some(2),
        set: set.iter().map(|(name, value)| ((*name).to_owned(), Setting::Number(*value))).collect(),
        formulation,
        tol,
        ..CompileOptions::default()
    };
    draw(&NetlistSource::new(&bundle), &options).and_then(|drawn| drawn.compile()).unwrap_or_else(|e| panic!("{e}"))
}

fn warned(compiled: &CompiledModel) -> bool {
    compiled.warnings.items.iter().any(|warning| warning.code == "W053")
}

/// Largest distance of two results, over the largest displacement.
fn apart(one: &StaticResult, other: &StaticResult) -> f64 {
    let largest = other.nodes.iter().map(|(_, at)| at.x.hypot(at.y)).fold(0.0, f64::max);
    let distance = |(a, b): (&(String, NodeMotion), &(String, NodeMotion))| (a.1.x - b.1.x).hypot(a.1.y - b.1.y);
    one.nodes.iter().zip(&other.nodes).map(distance).fold(0.0, f64::max) / largest
}

/// Equilibria of the quarter stage under 50 µN, of the heated bank, and of the switch below pull-in are those of the full model within
/// the tolerance. Their unknowns are fewer than a fifth of its own. The reported error contains that of the reduction.
#[test]
fn equilibria_are_those_of_the_full_model() {
    type Values = &'static [(&'static str, f64)];
    let cases: [(&str, Values, Values); 3] = [
        ("quarter_stage/quarter_stage.net", &[("F", 50e-6), ("angle", 0.7)], &[]),
        ("bank/bank.net", &[], &[("heat", 2.0), ("sense", 5.0)]),
        ("switch/switch.net", &[], &[("drive", 17.0)]),
    ];
    for (name, set, volts) in cases {
        let volts: Vec<(String, f64)> = volts.iter().map(|(port, v)| ((*port).to_owned(), *v)).collect();
        for tol in [1e-2, 1e-3] {
            let run = |formulation| {
                static_fitted(&example(name, set, formulation, tol), &volts).unwrap_or_else(|e| panic!("{e}"))
            };
            let ((_, full, _), (fitted, reduced, _)) = (run(Formulation::Compliant), run(Formulation::Reduced));
            let error = apart(&reduced, &full);
            println!(
                "{name} tol {tol:e}: {} for {} unknowns, {error:.1e}, {:?}",
                reduced.unknowns, full.unknowns, reduced.estimated_error
            );
            assert!(!warned(&fitted) && error <= tol, "{name}: {error:e}");
            assert!(5 * reduced.unknowns <= full.unknowns);
            let (mesh, both) = (full.estimated_error.unwrap_or(0.0), reduced.estimated_error.unwrap_or(f64::NAN));
            assert!(both - mesh >= 0.3 * error && both - mesh <= 3.0 * error + 1e-6, "{mesh:e} {both:e} {error:e}");
        }
    }
}

/// At a tolerance of 1e-4, after a pull-in, and in time at 1e-3, the full model is taken and a warning says so. Modes refuse a reduced model.
#[test]
fn where_the_full_model_is_taken() {
    let name = "switch/switch.net";
    for (volts, tol) in [(10.0, 1e-4), (19.0, 1e-3)] {
        let volts = [("drive".to_owned(), volts)];
        let run = |formulation| {
            static_fitted(&example(name, &[], formulation, tol), &volts).unwrap_or_else(|e| panic!("{e}"))
        };
        let ((_, full, _), (fitted, reduced, _)) = (run(Formulation::Compliant), run(Formulation::Reduced));
        assert!(warned(&fitted));
        assert_eq!((reduced.nodes, reduced.unknowns), (full.nodes, full.unknowns));
    }
    let moving = example("bank/bank.net", &[], Formulation::Reduced, 1e-3);
    let voltages = vec![("heat".to_owned(), 1.0)];
    let options = TransientOptions { stop: 1e-6, points: 2, tol: 1e-3, voltages, ..TransientOptions::default() };
    let made = transient(&moving, &options, &mut |_, _| (), &mut |_| true).unwrap_or_else(|e| panic!("{e}"));
    assert!(made.warnings.iter().any(|warning| warning.starts_with("W053")), "{:?}", made.warnings);
    let refused = modes_fitted(&example(name, &[], Formulation::Reduced, 1e-3), 2, &[]).unwrap_err();
    assert!(refused.to_string().contains("compliant"), "{refused}");
}

fn signal(result: &TransientResult) -> &[f64] {
    &result.signals[0].2
}

/// Root mean square difference, over the largest value.
fn difference(one: &[f64], other: &[f64]) -> f64 {
    let squares: f64 = one.iter().zip(other).map(|(a, b)| (a - b) * (a - b)).sum();
    (squares / one.len() as f64).sqrt() / other.iter().fold(0.0, |a: f64, b| a.max(b.abs()))
}

/// A release, heating from rest, and a step of voltage in time: signals within the tolerance of the full model, run at a hundredth of the
/// tolerance, with a fifth of the unknowns at most; and the same bits again.
#[test]
fn motion_is_that_of_the_full_model() {
    type Case<'a> = (&'a str, Option<&'a [(&'a str, f64)]>, &'a [(&'a str, f64)], &'a str, f64);
    let force: &[(&str, f64)] = &[("F", 20e-6), ("angle", 0.9)];
    let cases: [Case<'_>; 3] = [
        ("quarter_stage/quarter_stage.net", Some(force), &[], "c.x", 30e-6),
        ("bank/bank.net", None, &[("heat", 1.5)], "yoke.y", 300e-6),
        ("switch/switch.net", None, &[("drive", 12.0)], "a(8).y", 3e-6),
    ];
    for (name, released, volts, signal_name, stop) in cases {
        let tol = 1e-2;
        let run = |formulation, step_tol: f64| {
            let moving = example(name, &[], formulation, tol);
            let start = released.map(|set| example(name, set, Formulation::Compliant, tol));
            let options = TransientOptions {
                stop,
                signals: vec![signal_name.to_owned()],
                points: 301,
                tol: step_tol,
                voltages: volts.iter().map(|(port, v)| ((*port).to_owned(), *v)).collect(),
                release: start.as_ref(),
                ..TransientOptions::default()
            };
            transient(&moving, &options, &mut |_, _| (), &mut |_| true).unwrap_or_else(|e| panic!("{e}"))
        };
        let (full, alike) = (run(Formulation::Compliant, 1e-4), run(Formulation::Compliant, tol));
        let (reduced, again) = (run(Formulation::Reduced, tol), run(Formulation::Reduced, tol));
        let error = difference(signal(&reduced), signal(&full));
        let own = difference(signal(&alike), signal(&full));
        println!(
            "{name}: {} for {} unknowns, error {error:.1e} (full at the same tolerance {own:.1e}), {} steps (full {}), {:?}",
            reduced.unknowns, full.unknowns, reduced.counters.steps, alike.counters.steps, reduced.warnings
        );
        assert_eq!(again, reduced);
        assert_eq!(reduced.warnings, full.warnings, "{name}");
        assert!(error <= tol, "{name}: {error:e}");
        assert!(5 * reduced.unknowns <= full.unknowns);
    }
}

/// A run reports the error of its steps beside that of the reduction.
#[test]
fn a_run_has_an_error_of_its_steps() {
    let moving = example("bank/bank.net", &[], Formulation::Reduced, 1e-2);
    let options = TransientOptions {
        stop: 100e-6,
        signals: vec!["yoke.y".into()],
        points: 201,
        tol: 1e-2,
        voltages: vec![("heat".into(), 1.0)],
        ..TransientOptions::default()
    };
    let mut run = |options: &TransientOptions<'_>,
                   sample: &mut dyn FnMut(f64, &[f64]),
                   watch: bimorph_analysis::ProgressCallback<'_>| {
        Ok((transient(&moving, options, sample, watch)?, ()))
    };
    let (result, ()) =
        with_step_error(&options, &moving, &mut run, &mut |_, _| (), &mut |_| true).unwrap_or_else(|e| panic!("{e}"));
    assert!(result.step_error.is_some_and(|error| error > 0.0 && error <= 1e-2), "{:?}", result.step_error);
}
