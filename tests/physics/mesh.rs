//! The mesh of a request holds the printed tolerance, and reports its error: contracts of `analysis::mesh`, on default
//! options.

use super::{close, node};
use bimorph::analysis::mesh::{MeshRequest, fitted, fitted_in_time, in_circuit, modes_fitted};
use bimorph::analysis::modes::modes;
use bimorph::analysis::statics::static_equilibrium;
use bimorph::analysis::transient::{TransientOptions, TransientResult, transient};
use bimorph::compile::{CompileOptions, CompiledModel, Formulation, Junctions, compile};
use bimorph::netlist::{Bundle, Setting, read_bundle};
use std::path::Path;

const SILICON: &str = "process p = [Youngsmodulus=165e9 density=2300 h=2u]\nparam F=0\nanchor p [a] []\n";

/// Beams that meet in points and at ideal clamps, as closed forms assume.
fn drawn(text: &str, options: CompileOptions) -> CompiledModel {
    let options = CompileOptions { junctions: Junctions::Centreline, ..options };
    compile(&Bundle::from_text("mesh.net", &format!("{SILICON}{text}")), &options).unwrap()
}

/// Modes of a clamped beam with a slenderness of 10⁸, 4.730041²·√(E/12ρ)·w/(2π·l²) and the second with 7.853205, take as few segments as those of any beam. The axial
/// motions of the first mesh need 10,000 segments, whose stiffness is rounding.
#[test]
fn modes_of_the_thinnest_beam_take_few_segments() {
    for moves in ["", "moves=1"] {
        let text = format!("x beam2d p [a b] [l=200u w=2p]\nanchor p [b] [{moves}]");
        let (fitted, found, _) = modes_fitted(&drawn(&text, CompileOptions::default()), 2, &[]).unwrap();
        assert!(fitted.unknowns() < 200, "{}", fitted.unknowns());
        for (found, root) in found.frequencies_hz.iter().zip([4.730_041f64, 7.853_205]) {
            let exact = root.powi(2) * (165e9f64 / (12.0 * 2300.0)).sqrt() * 2e-12 / (std::f64::consts::TAU * 4e-8);
            close(*found, exact, 1e-3);
        }
    }
}

/// Elastica, a clamped beam under a dead load at its tip, F·l²/EI = 1, 2, 4, 8: deflection and approach of the tip within the tolerance
/// from 1e-2 to 1e-6, and the estimate no smaller than a third of the error. Source: the exact solution (Bisshopp and Drucker,
/// Q. Appl. Math. 3 (1945)), computed to 12 digits.
#[test]
fn elastica_within_the_tolerance() {
    const EXACT: [(f64, f64, f64); 4] = [
        (1.0, 0.301720773800, -0.056433236283),
        (2.0, 0.493457480397, -0.160641720825),
        (4.0, 0.669964181278, -0.328941242247),
        (8.0, 0.784982374953, -0.504827732134),
    ];
    for (load, across, along) in EXACT {
        let force = load * 165e9 * 2e-6 * 0.5e-6_f64.powi(3) / 12.0 / 1e-6;
        let text = "beam2d p [a t] [l=1000u w=0.5u]\nf2d * [t] [F=F oz=pi/2]";
        for tol in [1e-2, 1e-3, 1e-4, 1e-5, 1e-6] {
            let set = vec![("F".to_owned(), Setting::Number(force))];
            let model = drawn(text, CompileOptions { tol, set, ..CompileOptions::default() });
            let model = fitted(&model, &MeshRequest::Static { voltages: &[] }).unwrap();
            let tip = node(&static_equilibrium(&model, &[]).unwrap(), "t");
            let size = across.hypot(along) * 1e-3;
            let error = (tip.y - across * 1e-3).abs().max((tip.x - along * 1e-3).abs()) / size;
            let reported = model.order.estimated_error.unwrap();
            println!("{load} {tol:e}: {error:.1e}, estimated {reported:.1e}, {} unknowns", model.unknowns());
            assert!(error <= tol && reported <= tol, "{load} {tol:e}: {error:e} {reported:e}");
            // below 1e-7 the equilibrium's own tolerance shows
            assert!(error < 3.0 * reported + 1e-7, "{load} {tol:e}: {error:e} {reported:e}");
            assert!(model.warnings.items.is_empty(), "{:?}", model.warnings.items);
        }
    }
}

/// A beam clamped at both ends, by its number of modes alone: each within 1e-3 of (βl)² = 22.3733, 61.6728, 120.903
/// (Blevins 1979, table 8-1), in the requested number, each with an estimate within a factor of three.
#[test]
fn modes_by_their_number() {
    let model = drawn("beam2d p [a b] [l=200u w=2u]\nanchor p [b] []", CompileOptions::default());
    let model = fitted(&model, &MeshRequest::Modes { count: 3, voltages: &[] }).unwrap();
    let found = modes(&model, 3, &[]).unwrap();
    // √(EI/ρA)/2πl²
    let unit = (165e9 * 4e-12 / 12.0 / 2300.0_f64).sqrt() / (std::f64::consts::TAU * 4e-8);
    for ((frequency, estimate), exact) in
        found.frequencies_hz.iter().zip(&found.errors).zip([22.3733, 61.6728, 120.9034])
    {
        let error = frequency / (unit * exact) - 1.0;
        println!("{error:.2e}, estimated {:.2e}", estimate.unwrap());
        assert!(error.abs() < 1e-3, "{error:e}");
    }
    assert!(model.order.estimated_error.unwrap() <= 1e-3);
    // a finer tolerance, and what is left is the difference to it
    let fine = drawn(
        "beam2d p [a b] [l=200u w=2u]\nanchor p [b] []",
        CompileOptions { tol: 1e-6, ..CompileOptions::default() },
    );
    let fine = modes(&fitted(&fine, &MeshRequest::Modes { count: 3, voltages: &[] }).unwrap(), 3, &[]).unwrap();
    for k in 0..3 {
        let error = found.frequencies_hz[k] / fine.frequencies_hz[k] - 1.0;
        let reported = found.errors[k].unwrap();
        assert!(error.abs() <= 1e-3 && (1.0 / 3.0..3.0).contains(&(reported / error)), "{k}: {error:e} {reported:e}");
    }
}

/// A given number of segments is kept, its estimate is that of its error within a factor of three, and a warning says
/// that it does not hold the tolerance.
#[test]
fn segments_of_the_user_are_reported() {
    let text = "beam2d p [a t] [l=1000u w=0.5u]\nf2d * [t] [F=1.375e-8 oz=pi/2]";
    let model = drawn(text, CompileOptions { segments: Some(1), ..CompileOptions::default() });
    let model = fitted(&model, &MeshRequest::Static { voltages: &[] }).unwrap();
    assert_eq!(model.order.segments, [1]);
    let tip = node(&static_equilibrium(&model, &[]).unwrap(), "t");
    let error = (tip.y / 0.669964181278e-3 - 1.0).abs().max((tip.x / 0.328941242247e-3 + 1.0).abs());
    let reported = model.order.estimated_error.unwrap();
    assert!((1.0 / 3.0..3.0).contains(&(reported / error)), "{reported:e} {error:e}");
    let warned: Vec<&str> = model.warnings.items.iter().map(|d| d.code.as_str()).collect();
    assert_eq!(warned, ["W040"], "{reported}");
}

/// Modes about a heated and about a stressed state hold the tolerance there: those of 1e-3 within it of those of 1e-5.
#[test]
fn modes_about_a_loaded_state() {
    for text in [
        "beam2d p [a b] [l=200u w=2u]\nanchor p [b] []\nbeam2d p [b c] [l=100u w=2u]\nf2d * [c] [F=20u oz=pi/2]",
        "beam2d p [a b] [l=200u w=2u stress=100e6]\nanchor p [b] []",
    ] {
        let at = |tol: f64| {
            let model = drawn(text, CompileOptions { tol, ..CompileOptions::default() });
            let model = fitted(&model, &MeshRequest::Modes { count: 4, voltages: &[] }).unwrap();
            (modes(&model, 4, &[]).unwrap().frequencies_hz, model.order.estimated_error.unwrap())
        };
        let ((found, reported), (fine, _)) = (at(1e-3), at(1e-5));
        for (found, fine) in found.iter().zip(&fine) {
            close(*found, *fine, 1e-3);
        }
        assert!(reported <= 1.05e-3, "{reported:e}");
    }
}

/// Difference of two runs of one signal: root mean square over half the range.
fn apart(a: &TransientResult, b: &TransientResult) -> f64 {
    let (x, y) = (&a.signals[0].2, &b.signals[0].2);
    let range = y.iter().copied().fold(f64::MIN, f64::max) - y.iter().copied().fold(f64::MAX, f64::min);
    let sum: f64 = x.iter().zip(y).map(|(x, y)| (x - y).powi(2)).sum();
    (sum / x.len() as f64).sqrt() / (0.5 * range)
}

/// Runs hold the tolerance over their whole length, by default options. The comb resonator of examples/ under a step of
/// 20 V for 300 µs is within 1e-2 and 1e-3 of a run of 1e-5, in both formulations (the version before: 3e-3 at every
/// tolerance).
#[test]
fn transients_hold_over_their_length() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/comb_resonator/comb_resonator.net");
    let run = |tol: f64, formulation: Formulation| {
        let model = compile(
            &read_bundle(&path, &[]).unwrap(),
            &CompileOptions { tol, formulation, ..CompileOptions::default() },
        );
        let options = TransientOptions {
            stop: 300e-6,
            signals: vec!["shuttle.x".into()],
            tol,
            voltages: vec![("drive".into(), 20.0)],
            ..TransientOptions::default()
        };
        let (model, _) = fitted_in_time(&model.unwrap(), &options).unwrap();
        transient(&model, &options, &mut |_, _| {}, &mut |_| true).unwrap()
    };
    let reference = run(1e-5, Formulation::Compliant);
    for formulation in [Formulation::Compliant, Formulation::Rcr] {
        for tol in [1e-2, 1e-3] {
            let found = run(tol, formulation);
            let (error, reported) = (apart(&found, &reference), found.estimated_error.unwrap());
            println!("{formulation:?} {tol:e}: {error:.1e}, estimated {reported:.1e}, {} unknowns", found.unknowns);
            assert!(error <= tol && reported <= 1.05 * tol, "{formulation:?} {tol:e}: {error:e} {reported:e}");
        }
    }
}

/// The estimated error of each mode is its error, to 5 % from 16 segments on: of a beam 25 times as long as wide, flexible in shear, with and without rotary
/// inertia, against Richardson's limit of 256 and 512 segments. A band that holds five modes of bending takes no more segments with rotary inertia than
/// without, within a tenth. Without shear in its mass the reference of the estimate turned sections too far: 1e-3 off with rotary inertia on any mesh.
#[test]
fn errors_of_wide_beams_are_estimated() {
    let text = "beam2d p [a b] [l=100u w=4u]";
    let mut unknowns = Vec::new();
    for rotary_inertia in [false, true] {
        let with = |segments: Option<usize>, band, tol| {
            let base = CompileOptions { rotary_inertia, segments, band, tol, ..CompileOptions::default() };
            compile(&Bundle::from_text("wide.net", &format!("{SILICON}{text}")), &base).unwrap()
        };
        let cut = |n: usize| modes(&with(Some(n), None, 1e-3), 6, &[]).unwrap();
        let limit: Vec<f64> =
            cut(256).frequencies_hz.iter().zip(&cut(512).frequencies_hz).map(|(a, b)| b + (b - a) / 3.0).collect();
        for n in [16, 32, 64] {
            let found = cut(n);
            for ((f, limit), reported) in found.frequencies_hz.iter().zip(&limit).zip(&found.errors) {
                close(reported.unwrap(), f / limit - 1.0, 0.05);
            }
        }
        for tol in [1e-3, 1e-4] {
            let model = with(None, Some(50e6), tol);
            let reported = model.order.estimated_error.unwrap();
            assert!(reported <= tol, "{rotary_inertia} {tol}: {reported:e}");
            unknowns.push(model.unknowns() as f64);
        }
    }
    assert!(unknowns[2] < 1.1 * unknowns[0] && unknowns[3] < 1.1 * unknowns[1], "{unknowns:?}");
}

/// At junctions the estimated error of a mode is its error, to 5 %, from four to eight segments a beam: the three lowest modes of the bank and of the rotary
/// stage, against 64 segments, all estimates at once. With springs left out of the reference the estimate of the bank was half of its error.
#[test]
fn errors_at_junctions_are_estimated() {
    for path in ["examples/bank/bank.net", "examples/rotary_stage/rotary_stage.net"] {
        let bundle = read_bundle(Path::new(path), &[]).unwrap();
        let cut = |n: usize| {
            let options = CompileOptions { segments: Some(n), ..CompileOptions::default() };
            modes(&compile(&bundle, &options).unwrap(), 3, &[]).unwrap()
        };
        let reference = cut(64).frequencies_hz;
        for n in [4, 6, 8] {
            let found = cut(n);
            let error = |(f, reference): (&f64, &f64)| (f / reference - 1.0).abs();
            let worst = found.frequencies_hz.iter().zip(&reference).map(error).fold(0.0, f64::max);
            let reported = found.errors.iter().map(|error| error.unwrap().abs()).fold(0.0, f64::max);
            close(reported, worst, 0.05);
        }
    }
}

/// The band of the six lowest modes is theirs where a first mesh has fewer modes or higher ones: each holds the tolerance against 64 segments a beam, on fewer
/// than 300 unknowns (before: 490 and 615 at 1e-4).
#[test]
fn meshes_of_the_lowest_modes_are_no_finer_than_needed() {
    for (path, most) in [("examples/column/column.net", 300), ("examples/chevron/chevron.net", 300)] {
        let bundle = read_bundle(Path::new(path), &[]).unwrap();
        let with =
            |segments, tol| compile(&bundle, &CompileOptions { segments, tol, ..CompileOptions::default() }).unwrap();
        let reference = modes(&with(Some(64), 1e-3), 6, &[]).unwrap().frequencies_hz;
        for tol in [1e-2, 1e-3, 1e-4] {
            let (model, found, _) = modes_fitted(&with(None, tol), 6, &[]).unwrap();
            println!("{path} {tol:e}: {} unknowns", model.unknowns());
            assert!(model.unknowns() < most, "{}", model.unknowns());
            for (f, reference) in found.frequencies_hz.iter().zip(&reference) {
                assert!((f / reference - 1.0).abs() < 1.05 * tol, "{path} {tol:e}: {f:e} {reference:e}");
            }
        }
    }
}

/// The three lowest modes of a frame on a mesh of few segments hold 1e-2 against 32 segments a beam, or report more. The estimate of the third was a
/// tenth of its error of 2.5e-2 there: the reference took a higher mode, which the mesh has at twice its frequency, with the mass of that frequency.
#[test]
fn modes_above_the_band_leave_the_estimates_of_those_within() {
    let text = "process s = [Youngsmodulus=160e9 Poisson=0.22 density=2330 h=2u]\nanchor s [o] []\nbeam2d s [o m] [l=97.9u w=3.34u \
                oz=deg(-30)]\nbeam2d s [m t] [l=155.3u w=1.73u oz=deg(-30)]\nplate2d s [t] [l=74.1u w=32.7u]\nanchor s [e] []\n\
                beam2d s [m e] [l=176.6u w=2.87u oz=deg(60)]\n";
    let with = |segments| {
        let options = CompileOptions { segments, tol: 1e-2, ..CompileOptions::default() };
        compile(&Bundle::from_text("frame.net", text), &options).unwrap()
    };
    let reference = modes(&with(Some(32)), 3, &[]).unwrap().frequencies_hz;
    let (_, found, _) = modes_fitted(&with(None), 3, &[]).unwrap();
    for (f, reference) in found.frequencies_hz.iter().zip(&reference) {
        let error = (f / reference - 1.0).abs();
        assert!(error <= found.estimated_error.unwrap().max(1e-2), "{error:e} of {reference:e}");
    }
}

/// The mesh of a run resolves every mode that it excites where a voltage softens them: an elbow with a plate at half of its pull-in has its second mode 1.3 % lower than as
/// drawn. Each coordinate of the tip holds the tolerance against 32 segments a beam. With the second mode left out the error was twice the tolerance.
#[test]
fn meshes_of_runs_resolve_softened_modes() {
    let text = "process p = [Youngsmodulus=160e9 Poisson=0.22 density=2330 h=20u]
        anchor p [f] []
        beam2d p [f a] [l=91.5u w=2.08u oz=deg(20)]
        beam2d p [a b] [l=169.8u w=2.08u oz=pi/2]
        mass2d * [b] [m=4.49e-11 J=1e-20]
        g plategap2d p [b c] [l=81u w=39u gap=2.66u oz=-pi/2]
        anchor p [c] []
        eground * [c] []
        drive port * [b c] []";
    let run = |tol: f64, segments: Option<usize>| {
        let given = CompileOptions { tol, segments, ..CompileOptions::default() };
        let options = TransientOptions {
            stop: 132e-6,
            points: 201,
            signals: vec!["b.x".into(), "b.y".into()],
            tol,
            voltages: vec![("drive".into(), 21.32)],
            ..TransientOptions::default()
        };
        let model = compile(&Bundle::from_text("elbow.net", text), &given).unwrap();
        let (model, _) = fitted_in_time(&model, &options).unwrap();
        transient(&model, &options, &mut |_, _| {}, &mut |_| true).unwrap()
    };
    let (found, reference) = (run(1e-2, None), run(1e-4, Some(32)));
    let reported = found.estimated_error.unwrap();
    for signal in 0..2 {
        let [found, reference] = [&found, &reference].map(|run| &run.signals[signal].2);
        let range = reference.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(*x), b.max(*x)]);
        let squares: f64 = found.iter().zip(reference).map(|(a, b)| (a - b) * (a - b)).sum();
        let error = (squares / found.len() as f64).sqrt() / (0.5 * (range[1] - range[0]));
        assert!(error < 1e-2 && reported < 1e-2, "{signal}: {error:e}, estimated {reported:e}");
    }
}

/// Modes of a corner under its residual stress, whose junction stands at the end of ever shorter segments. A tight
/// tolerance is held, and each frequency converges. The estimated error of the mesh is the change on a mesh eight times
/// as fine, within a factor of two.
#[test]
fn modes_about_stress_converge_at_junctions() {
    let text = "process p = [Youngsmodulus=165e9 density=2300 h=2u stress=100M]\nanchor p [a] []\nbeam2d p [a b] [l=20u w=5u]\n\
                beam2d p [b c] [l=50u w=5u oz=pi/2]\nanchor p [c] []\n";
    let with = |options| compile(&Bundle::from_text("corner.net", text), &options).unwrap();
    let cut = |n: usize| {
        let found = modes(&with(CompileOptions { segments: Some(n), ..CompileOptions::default() }), 3, &[]).unwrap();
        found.frequencies_hz
    };
    let (fine, finest) = (cut(500), cut(4000));
    for (a, b) in fine.iter().zip(&finest) {
        close(*a, *b, 3e-5);
    }
    close(fine[0], finest[0], 3e-6);
    let model = fitted(
        &with(CompileOptions { tol: 1e-6, ..CompileOptions::default() }),
        &MeshRequest::Modes { count: 3, voltages: &[] },
    );
    let model = model.unwrap();
    let reported = model.order.estimated_error.unwrap();
    assert!(reported <= 1e-6 && model.unknowns() < 100_000, "{reported:e}, {} unknowns", model.unknowns());
    assert!(model.warnings.items.is_empty(), "{:?}", model.warnings.items);
    let found = modes(&model, 3, &[]).unwrap().frequencies_hz;
    let finer: Vec<usize> = model.order.segments.iter().map(|n| 8 * n).collect();
    let finer = model.with_order(bimorph::refine::mesh_search::Mesh { segments: finer, ..model.order.clone() });
    let finer = modes(&finer.unwrap(), 3, &[]).unwrap().frequencies_hz;
    let error = found.iter().zip(&finer).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
    assert!(error <= 1e-6 && error < 2.0 * reported, "{error:e}, told {reported:e}");
}

/// The mesh of circuits becomes finer with the tolerance up to 3,000 unknowns. Where more would be needed it is no
/// coarser, and W040 reports its error. (Beyond that it had been the one as drawn: 219 unknowns at 3e-6 where there
/// were 2,151 at 1e-5.)
#[test]
fn meshes_of_circuits_have_no_cliff() {
    let bundle =
        read_bundle(&Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/quarter_stage/quarter_stage.net"), &[])
            .unwrap();
    let mut before = 0;
    for (tol, holds) in [(1e-3, true), (1e-5, true), (1e-6, false)] {
        let found = in_circuit(&compile(&bundle, &CompileOptions { tol, ..CompileOptions::default() }).unwrap());
        let reported = found.warnings.items.iter().find(|warning| warning.code == "W040");
        println!("{tol}: {} unknowns, {reported:?}", found.unknowns());
        assert!((before..=3000).contains(&found.unknowns()), "{tol}: {} after {before}", found.unknowns());
        assert_eq!(reported.is_none(), holds, "{tol}: {reported:?}");
        before = found.unknowns();
    }
}

/// A circuit has an error estimate of the lowest frequency of its mesh, in both formulations: the base of phase errors.
/// Within a factor of three of the error against 32 segments a beam. (With `rcr`, whose scheme has no estimate of its
/// own, there was none.)
#[test]
fn circuits_know_the_error_of_their_lowest_mode() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/bank/bank.net");
    let bundle = read_bundle(&path, &[]).unwrap();
    for formulation in [Formulation::Compliant, Formulation::Rcr] {
        let at = |segments| {
            let options = CompileOptions { formulation, segments, ..CompileOptions::default() };
            in_circuit(&compile(&bundle, &options).unwrap()).lowest.unwrap()
        };
        let (found, exact) = (at(None), at(Some(32)));
        let (reported, off) = (found.error.abs(), (found.frequency_hz / exact.frequency_hz - 1.0).abs());
        assert!(
            off < 3.0 * reported + 1e-5 && reported < 3.0 * off + 1e-5,
            "{formulation:?}: {off:e}, told {reported:e}"
        );
    }
}

/// Beams five times as long as wide between two anchors move, by every request. The first frequency is (βl)² = 22.3733 (Blevins 1979, table 8-1)
/// within the tolerance. The mean rise at 1 V, of 12.5 mW in 80 Ω, is P·l/(12·k·w·h).
#[test]
fn stubby_beams_between_anchors_move() {
    let text = "x beam2d p [a b] [l=50u w=10u]\nanchor p [b] []";
    let model =
        fitted(&drawn(text, CompileOptions::default()), &MeshRequest::Modes { count: 1, voltages: &[] }).unwrap();
    let exact = 22.3733 * (165e9 * 100e-12 / 12.0 / 2300.0_f64).sqrt() / (std::f64::consts::TAU * 2.5e-9);
    let error = modes(&model, 1, &[]).unwrap().frequencies_hz[0] / exact - 1.0;
    assert!(error.abs() < 1e-3, "{error:e}");

    let heated = text
        .replace("beam2d", "beam2det")
        .replace("w=10u", "w=12.5u sheetresistance=20 thermcond=32 thermalexpansion=0 ambienttemperature=300");
    let heated = drawn(&format!("{heated}\neground * [a] []\nfeed port * [b] []"), CompileOptions::default());
    let volts = [("feed".to_owned(), 1.0)];
    let model = fitted(&heated, &MeshRequest::Static { voltages: &volts }).unwrap();
    let found = static_equilibrium(&model, &volts).unwrap();
    let rise = 12.5e-3 * 50e-6 / (12.0 * 32.0 * 12.5e-6 * 2e-6);
    assert!(((found.temperatures_k[0].1 - 300.0) / rise - 1.0).abs() < 1e-9, "{:?}", found.temperatures_k);
}
