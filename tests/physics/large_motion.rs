//! A run with changing stiffness holds the tolerance of its mesh, or reports an error beyond it: contracts of
//! `analysis::mesh` for transients.

use bimorph::analysis::chart::error::{largest_error, relative_error};
use bimorph::analysis::mesh::{MeshRequest, fitted, fitted_in_time};
use bimorph::analysis::modes::modes;
use bimorph::analysis::transient::{TransientOptions, TransientResult, transient};
use bimorph::compile::{CompileOptions, compile};
use bimorph::jobs::sweep::{self, Shard, SweepAnalysis, SweepParameter, SweepSpec};
use bimorph::netlist::{Bundle, Setting};

/// A mass between two straight beams, which a step of force throws to where they are far stiffer than where it rests.
const THROWN: &str = "process p = [Youngsmodulus=165e9 density=2300 h=20u]
anchor p [a] []
left beam2d p [a s] [l=250u w=1.6u]
mass2d * [s] [m=4e-10]
right beam2d p [s b] [l=250u w=1.6u]
anchor p [b] []
f2d * [s] [F=18u oz=pi/2]
";

/// A beam between anchors, with an arm at its middle, that a current heats beyond buckling.
const HEATED: &str =
    "process p = [Youngsmodulus=165e9 density=2300 h=2u thermalexpansion=2.6e-6 sheetresistance=20 thermcond=30 \
specificheat=700 ambienttemperature=300]
anchor p [a] []
left beam2det p [a m] [l=180u w=2u]
right beam2det p [m b] [l=180u w=2u]
arm beam2d p [m t] [l=50u w=4u oz=pi/2]
anchor p [b] []
eground * [b] []
heat port * [a] []
";

fn run(text: &str, signal: &str, stop: f64, volts: &[(&str, f64)], options: CompileOptions) -> TransientResult {
    let model = compile(&Bundle::from_text("thrown.net", text), &options).unwrap();
    let options = TransientOptions {
        stop,
        signals: vec![signal.into()],
        tol: options.tol,
        voltages: volts.iter().map(|(name, volts)| ((*name).to_owned(), *volts)).collect(),
        ..TransientOptions::default()
    };
    let (model, _) = fitted_in_time(&model, &options).unwrap();
    transient(&model, &options, &mut |_, _| {}, &mut |_| true).unwrap()
}

/// The error of such a run is within the tolerance, and its estimate no smaller than a third of it. Before, the meshes of these runs were those of
/// their ends and modes, and two to five times the tolerance off. The reference has 40 segments a beam and the steps of 1e-6; for the
/// heated one it is itself 2e-4 off (by 80 segments), no reference for 1e-4.
#[test]
fn runs_far_from_their_ends_hold_the_tolerance() {
    type Case<'a> = (&'a str, &'a str, f64, &'a [(&'a str, f64)], &'a [f64]);
    let cases: [Case<'_>; 2] = [
        (THROWN, "s.y", 100e-6, &[], &[1e-2, 3e-3, 1e-3, 1e-4]),
        (HEATED, "t.y", 400e-6, &[("heat", 1.9)], &[1e-2, 8e-3, 5e-3, 2e-3, 1e-3]),
    ];
    for (text, signal, stop, volts, tolerances) in cases {
        let fine = CompileOptions { tol: 1e-6, segments: Some(40), ..CompileOptions::default() };
        let reference = run(text, signal, stop, volts, fine);
        for &tol in tolerances {
            let found = run(text, signal, stop, volts, CompileOptions { tol, ..CompileOptions::default() });
            let (error, reported) = (relative_error(&reference, &found), found.estimated_error.unwrap());
            println!("{signal} {tol:e}: {error:.1e}, told {reported:.1e}, {} unknowns", found.unknowns);
            assert!(error <= tol && reported <= 1.05 * tol, "{signal} {tol:e}: {error:e} {reported:e}");
            assert!(error <= 3.0 * reported, "{signal} {tol:e}: {error:e} {reported:e}");
        }
    }
}

/// A sweep over such a run judges its mesh by the run as well: one of few output times is a run like any other. Before, such rows were 5.7 % off at
/// 1e-2 without a word.
#[test]
fn sweeps_of_such_runs_hold_it_too() {
    let text = format!("param F=18u\n{}", THROWN.replace("F=18u", "F=F"));
    let bundle = Bundle::from_text("thrown.net", &text);
    let fine = CompileOptions { tol: 1e-6, segments: Some(40), ..CompileOptions::default() };
    let reference = run(THROWN, "s.y", 100e-6, &[], fine);
    let (end, most) =
        (reference.signals[0].2.last().unwrap(), reference.signals[0].2.iter().copied().fold(0.0, f64::max));
    let values = [17e-6, 18e-6, 19e-6].map(Setting::Number).to_vec().into();
    let spec = SweepSpec {
        parameters: vec![SweepParameter { name: "F".into(), values, in_step: false }],
        samples: None,
        analysis: SweepAnalysis::Transient { stop: 100e-6, outputs: vec!["s.y".into()], voltages: Vec::new() },
        shard: Shard::default(),
        threads: None,
    };
    let table =
        sweep::run(&spec, &bundle, &CompileOptions { tol: 1e-2, ..CompileOptions::default() }, &|_| true).unwrap();
    let found = table.rows[1].values.as_ref().unwrap()[0].unwrap();
    println!("{found:e} of {end:e}: {:.1e}", (found - end).abs() / most);
    assert!((found - end).abs() <= 1e-2 * most, "{found:e} {end:e}");
}

/// Given segments have an error estimate in such a run.
#[test]
fn given_segments_are_reported() {
    let with =
        |segments: usize, tol: f64| CompileOptions { tol, segments: Some(segments), ..CompileOptions::default() };
    let reference = run(THROWN, "s.y", 100e-6, &[], with(40, 1e-6));
    for segments in [1, 2, 3, 4, 5, 8] {
        let found = run(THROWN, "s.y", 100e-6, &[], with(segments, 1e-3));
        let (error, reported) = (relative_error(&reference, &found), found.estimated_error.unwrap());
        println!("{segments}: {error:.1e}, told {reported:.1e}");
        assert!(error <= 3.0 * reported && reported <= 10.0 * error, "{segments}: {error:e} {reported:e}");
    }
}

/// The estimated error of a mode about a loaded state is no less than the effect of that state's error: a clamped beam
/// under a force that bends it far. The reference has 64 segments.
#[test]
fn modes_about_a_load_are_reported() {
    let text = "process p = [Youngsmodulus=165e9 density=2300 h=20u]
anchor p [a] []
left beam2d p [a s] [l=250u w=1.6u]
right beam2d p [s b] [l=250u w=1.6u]
anchor p [b] []
f2d * [s] [F=60u oz=pi/2]
";
    let bundle = Bundle::from_text("loaded.net", text);
    let with = |options: CompileOptions| {
        let model = compile(&bundle, &options).unwrap();
        bimorph::analysis::mesh::modes_fitted(&model, 3, &Vec::new()).unwrap().1
    };
    let fine = CompileOptions { tol: 1e-6, segments: Some(64), ..CompileOptions::default() };
    let model = compile(&bundle, &fine).unwrap();
    let model = fitted(&model, &MeshRequest::Modes { count: 3, voltages: &Vec::new() }).unwrap();
    let reference = modes(&model, 3, &Vec::new()).unwrap();
    for tol in [1e-2, 1e-3, 1e-4] {
        let found = with(CompileOptions { tol, ..CompileOptions::default() });
        for (k, reported) in found.errors.iter().enumerate() {
            let error = (found.frequencies_hz[k] / reference.frequencies_hz[k] - 1.0).abs();
            let reported = reported.expect("reported").abs();
            assert!(
                error <= 3.0 * reported && reported <= 1.05 * tol,
                "{tol:e}, mode {}: {error:e} {reported:e}",
                k + 1
            );
        }
    }
}

/// Seven plates on flexures between anchors, which a force turns by a third of a radian.
fn stretched_chain() -> String {
    // length and width of a flexure, and of its plate (µm), and their direction (rad)
    let parts = [
        [21.4, 0.7874, 28.74, 11.33, -0.401],
        [18.12, 0.5843, 36.56, 28.25, 0.3],
        [7.612, 0.6648, 27.64, 22.48, -0.312],
        [17.28, 0.6599, 46.76, 26.16, 0.01],
        [13.36, 0.5576, 30.39, 23.9, 0.332],
        [5.321, 0.6777, 20.01, 21.02, -0.085],
        [10.82, 0.9329, 42.09, 24.86, -0.385],
    ];
    let mut text = "process p = [Youngsmodulus=165e9 density=2300 h=3.04u]\nanchor p [q(0)] []\n".to_owned();
    for (k, [l, w, length, width, oz]) in (1..).zip(parts) {
        let half = length / 2.0;
        text += &format!(
            "beam2d p [q({}) r({k})] [l={l}u w={w}u oz={oz}]\nlink2d * [r({k}) c({k})] [l={half}u oz={oz}]\n\
             plate2d p [c({k})] [l={length}u w={width}u oz={oz}]\nlink2d * [c({k}) q({k})] [l={half}u oz={oz}]\n",
            k - 1
        );
    }
    text + "beam2d p [q(7) b] [l=21.36u w=0.7117u oz=-0.15]\nanchor p [b] []\nf2d * [c(7)] [F=44.56u oz=3.604]\n"
}

/// Meshes that differ by their steps alone are compared with sharper steps. The steps of this chain at the tolerance differ by as much on 16 segments as on 256. It has
/// at most 16, and the error of this mesh is within its estimate: against four times the segments, both with steps at a hundredth of the tolerance.
#[test]
fn steps_are_no_error_of_a_mesh() {
    let text = stretched_chain();
    let model = |segments| {
        let given = CompileOptions { tol: 1e-2, segments, undamped: true, ..CompileOptions::default() };
        compile(&Bundle::from_text("chain.net", &text), &given).unwrap()
    };
    let options = TransientOptions {
        stop: 156.6e-6,
        points: 101,
        signals: vec!["c(7).x".into(), "c(7).y".into()],
        tol: 1e-2,
        ..TransientOptions::default()
    };
    let (fitted, _) = fitted_in_time(&model(None), &options).unwrap();
    let most = *fitted.order.segments.iter().max().unwrap();
    let sharp = TransientOptions { tol: 1e-4, ..options.clone() };
    let run = |model| transient(model, &sharp, &mut |_, _| {}, &mut |_| true).unwrap();
    let error = largest_error(&run(&fitted), &run(&model(Some(4 * most))), &|_| 0.0);
    let stated = fitted.order.estimated_error.unwrap();
    println!("{most} segments, error {error:.1e}, stated {stated:.1e}");
    assert!(most <= 16 && error <= stated && stated <= 1e-2, "{most} segments, error {error:e}, stated {stated:e}");
}
