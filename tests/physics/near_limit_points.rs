//! Reports next to folds, past them, and without motion.

use super::{close, model, node};
use bimorph::analysis::AnalysisError;
use bimorph::analysis::continuation::{ContinuationRequest, PathInput};
use bimorph::analysis::mesh::{modes_fitted, path_fitted, pull_in_fitted, static_fitted, warnings};
use bimorph::analysis::modes::modes;
use bimorph::compile::{CompileOptions, CompiledModel, compile};
use bimorph::netlist::{Bundle, Setting, read_bundle};
use bimorph::solve::continuation::Branch;
use std::path::Path;

/// A beam of 200 × 2 µm between anchors, under the stress `s`, in two pieces that meet in (m).
const BEAM: &str = "param s = 0\nparam F = 0\nanchor p1 [a] []\nbeam2d p1 [a m] [l=100u w=2u stress=s]\n\
    beam2d p1 [m b] [l=100u w=2u stress=s]\nanchor p1 [b] []\n";

fn stressed(more: &str, s: f64, options: &CompileOptions) -> CompiledModel {
    let options = CompileOptions { set: vec![("s".into(), Setting::Number(s))], ..options.clone() };
    model(&format!("{BEAM}{more}"), &options)
}

/// The frequency goes to zero as the fourth root of the remaining voltage. The estimate beside it, or the tolerance,
/// holds 2e-5 below pull-in too (17.8401 V; reference 48 segments a beam). The deflection alone gave 3.6e-4 for a
/// frequency with an error of 4.6 %.
#[test]
fn modes_next_to_pull_in() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/switch/switch.net");
    let bundle = read_bundle(&path, &[]).unwrap();
    let at = |options: &CompileOptions| {
        let compiled = compile(&bundle, options).unwrap();
        let (fitted, found, _) = modes_fitted(&compiled, 1, &[("drive".into(), 17.8398)]).unwrap();
        (found.frequencies_hz[0], fitted.order.estimated_error)
    };
    let (exact, _) = at(&CompileOptions { segments: Some(48), ..CompileOptions::default() });
    for tol in [1e-2, 1e-3] {
        let (found, reported) = at(&CompileOptions { tol, ..CompileOptions::default() });
        let off = (found / exact - 1.0).abs();
        assert!(off <= reported.unwrap().max(tol), "{tol}: {found} against {exact}, told {reported:?}");
    }
}

/// Next to its pull-in the deflection of a gap drawn in few pieces is within the tolerance, and within its estimate: a
/// cantilever in 4 pieces against one in 24, 1e-4 and 1e-5 below 6.1849 V.
#[test]
fn few_pieces_next_to_pull_in() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/netlists/accuracy/cantilever_gap.net");
    let pieces = |n: f64| read_bundle(&path, &[]).map(|bundle| with_pieces(bundle, n)).unwrap();
    let at = |n: f64, volts: f64| {
        let compiled = compile(&pieces(n), &CompileOptions::default()).unwrap();
        let (fitted, result, _) = static_fitted(&compiled, &[("drive".into(), volts)]).unwrap();
        let most = result.nodes.iter().map(|(_, m)| m.y.abs()).fold(0.0, f64::max);
        (most, fitted.order.estimated_error.unwrap())
    };
    for below in [1e-4, 1e-5] {
        let volts = 6.184_909 * (1.0 - below);
        let ((found, estimate), (exact, _)) = (at(4.0, volts), at(24.0, volts));
        let off = (found / exact - 1.0).abs();
        assert!(off <= 1e-3 && off <= 1.5 * estimate, "{below}: {off:e}, estimate {estimate:e}");
    }
}

/// The same drawing with another number of pieces.
fn with_pieces(mut bundle: Bundle, n: f64) -> Bundle {
    for text in bundle.files.values_mut() {
        let lines = text
            .lines()
            .map(|line| if line.trim_start().starts_with("n =") { format!("n = {n}") } else { line.to_owned() });
        *text = lines.collect::<Vec<_>>().join("\n");
    }
    bundle
}

/// A part that is stressed and still by symmetry needs no finer mesh for the rounding of its displacements (1e-27 m),
/// and has no error; its modes hold the tolerance against 48 segments a beam.
#[test]
fn rounding_needs_no_mesh() {
    for s in [50e6, -3e6] {
        let compiled = stressed("", s, &CompileOptions::default());
        let (fitted, result, _) = static_fitted(&compiled, &[]).unwrap();
        assert!(fitted.order.estimated_error.is_some_and(|e| e <= 1e-3), "{:?}", fitted.order.estimated_error);
        assert!(result.unknowns < 60, "{}", result.unknowns);
        assert_eq!(warnings(&fitted).count(), 0);
        let (fitted, found, _) = modes_fitted(&compiled, 2, &[]).unwrap();
        assert!(found.unknowns < 120 && warnings(&fitted).count() == 0, "{} {:?}", found.unknowns, fitted.order);
        let fine = stressed("", s, &CompileOptions { segments: Some(48), ..CompileOptions::default() });
        close(found.frequencies_hz[0], modes(&fine, 1, &[]).unwrap().frequencies_hz[0], 1e-3);
    }
}

/// A path that ends where nothing moves any more is compared by what moves on its way: no mesh is refined for its end.
#[test]
fn a_path_that_ends_at_rest() {
    let loaded = {
        let options = CompileOptions { set: vec![("F".into(), Setting::Number(1e-6))], ..CompileOptions::default() };
        model(&format!("{BEAM}f2d * [m] [F=F oz=pi/2]\n"), &options)
    };
    let request = ContinuationRequest {
        input: PathInput::Loads,
        from: 1.0,
        to: 0.0,
        voltages: Vec::new(),
        signals: vec!["m.y".into()],
        branch: Branch::Plus,
        points: 500,
    };
    let (fitted, found) = path_fitted(&loaded, &request, &mut |_| true).unwrap();
    assert!(fitted.order.estimated_error.is_some_and(|e| e <= 1e-3), "{:?}", fitted.order);
    assert!(found.unknowns < 120, "{}", found.unknowns);
}

/// Events before any voltage are reported with pull-in: compressed by 80 MPa (critical: 54) the part has buckled to one
/// of two sides.
#[test]
fn pull_in_of_a_buckled_part_is_reported() {
    let plate =
        "anchor * [e] []\nplategap2d * [m e] [A=2e-9 gap=3u oz=-pi/2]\neground * [e] []\ndrive port * [m e] []\n";
    let reported = |s: f64| {
        let (_, found) = pull_in_fitted(&stressed(plate, s, &CompileOptions::default()), None, 200.0).unwrap();
        found.notes().join("; ")
    };
    assert!(reported(-80e6).contains("snapped through or buckled"), "{}", reported(-80e6));
    assert!(!reported(0.0).contains("buckled"), "{}", reported(0.0));
}

/// A jump on a finer mesh is reported although the first mesh has none: a column under 1.0012 of Euler's load (217.13
/// µN by π²EI/(4·L²) of its guided end).
#[test]
fn a_jump_on_a_finer_mesh_is_reported() {
    let text = "anchor p1 [a] []\nbeam2d p1 [a m] [l=100u w=2u]\nbeam2d p1 [m b] [l=100u w=2u]\nguide2d * [b] []\n\
        f2d * [b] [F=217.4u oz=pi]\n";
    let (_, result, _) = static_fitted(&model(text, &CompileOptions::default()), &[]).unwrap();
    if node(&result, "m").y.abs() > 0.1e-6 {
        assert!(result.jumped, "{:?}", node(&result, "m"));
    }
}

/// Modes about an unstable equilibrium are those that grow, at 0 Hz, and the others: on any mesh, one or many.
#[test]
fn modes_of_a_buckled_part_as_drawn() {
    for count in [1, 3, 6] {
        let options = CompileOptions { linear: true, ..CompileOptions::default() };
        let found = modes(&stressed("", -60e6, &options), count, &[]).unwrap();
        assert_eq!(found.frequencies_hz[0], 0.0);
        assert!(found.warnings.iter().any(|w| w.contains("unstable")), "{:?}", found.warnings);
    }
}

/// The error of a linear model is relative to the number it prints. A column under 40 µN and a thousandth of it from
/// the side moves by 60.6 nm without the stress and by (S/F)·(tan kL/k − L) = 227.95 nm with it: the difference is 2.76
/// times the printed number.
#[test]
fn a_linear_model_reports_what_it_leaves_out() {
    let text = "anchor p1 [a] []\nbeam2d p1 [a b] [l=100u w=2u]\nf2d * [b] [F=40u oz=pi]\nf2d * [b] [F=40n oz=pi/2]\n";
    let options = CompileOptions { linear: true, ..CompileOptions::default() };
    let (fitted, result, _) = static_fitted(&model(text, &options), &[]).unwrap();
    let (l, f, s): (f64, f64, f64) = (100e-6, 40e-6, 40e-9);
    let k = (f / (165e9 * 2e-6 * 8e-18 / 12.0)).sqrt();
    let exact = s / f * ((k * l).tan() / k - l);
    let share = exact / node(&result, "b").y - 1.0;
    let reported = warnings(&fitted).find(|w| w.contains("stress")).expect("a warning");
    let reported: f64 = reported.rsplit(' ').next().unwrap().parse().unwrap();
    close(reported, share, 0.05);
}

/// A voltage that no circuit has, and one that is given twice, are refused by name; the largest that is taken ends too.
#[test]
fn voltages_are_bounded_and_given_once() {
    let plate = "anchor p1 [e] []\nguide2d * [m] []\nplategap2d * [m e] [A=2e-9 gap=3u oz=-pi/2]\neground * [e] []\ndrive port * [m e] []\n";
    let compiled = stressed(plate, 0.0, &CompileOptions::default());
    let refused = |voltages: &[(&str, f64)]| {
        let voltages: Vec<(String, f64)> = voltages.iter().map(|(n, v)| ((*n).to_owned(), *v)).collect();
        static_fitted(&compiled, &voltages).map(|_| ()).unwrap_err()
    };
    for voltages in [&[("drive", 1e200)][..], &[("drive", 1.0), ("drive", 2.0)][..]] {
        let error = refused(voltages);
        assert!(matches!(&error, AnalysisError::BadRequest { what, .. } if what.contains("drive")), "{error}");
    }
    let _ = static_fitted(&compiled, &[("drive".into(), 1e9)]);
}

/// A port without a gap is rejected, and those with gaps are named. A heater is accepted, since its heat may push a
/// part to where another voltage closes a gap: the search itself then reports that nothing pulls in.
#[test]
fn ports_that_pull_nothing() {
    let parts = "process hot = [Youngsmodulus=165e9 density=2300 h=2u thermalexpansion=2.33e-6 sheetresistance=20 thermcond=41]\n\
        anchor hot [x] []\nh beam2det hot [x y] [l=100u w=4u]\nanchor hot [y] []\neground * [y] []\nheat port * [x y] []\n\
        anchor * [e] []\nplategap2d * [m e] [A=2e-9 gap=3u oz=-pi/2]\neground * [e] []\ndrive port * [m e] []\n\
        R * [u w] [R=1k]\neground * [w] []\nidle port * [u w] []\n";
    let compiled = stressed(parts, 0.0, &CompileOptions::default());
    let said = |port: &str| pull_in_fitted(&compiled, Some(port), 5.0).map(|_| ()).unwrap_err();
    assert!(
        matches!(&said("idle"), AnalysisError::BadRequest { detail, .. } if detail.contains("no gap") && detail.ends_with("drive")),
        "{}",
        said("idle")
    );
    assert!(matches!(said("heat"), AnalysisError::NoEquilibrium { .. }), "{}", said("heat"));
}

/// Just beyond a buckling load no result reports a straight column. A coarse mesh has a higher load than the beam,
/// twice its segments hardly less, and both agreed on no deflection, within 3e-9. At 1 % to 1e-4 beyond it the
/// deflection is that of 64 segments, to the tolerance or to the estimate; nearer, where no mesh decides it, nothing is
/// confirmed. The frequency about it goes with the root of what is beyond.
#[test]
fn beyond_a_buckling_load_nothing_stays_straight() {
    let fine = CompileOptions { segments: Some(64), ..CompileOptions::default() };
    let deflection = |compiled: &CompiledModel| {
        let (fitted, result, _) = static_fitted(compiled, &[]).unwrap();
        (node(&result, "m").y.abs(), fitted.order.estimated_error)
    };
    let (mut straight, mut buckled) = (-20e6, -100e6);
    for _ in 0..32 {
        let between = 0.5 * (straight + buckled);
        let bends = deflection(&stressed("", between, &fine)).0 > 1e-9;
        *if bends { &mut buckled } else { &mut straight } = between;
    }
    println!("buckles at {buckled:.1} Pa");
    for tol in [1e-2, 1e-3] {
        let options = CompileOptions { tol, ..CompileOptions::default() };
        for beyond in [1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 1e-5] {
            let stress = buckled * (1.0 + beyond);
            let (exact, _) = deflection(&stressed("", stress, &fine));
            let (found, reported) = deflection(&stressed("", stress, &options));
            println!("tol {tol}, {beyond} beyond: {found:e} of {exact:e}, told {reported:?}");
            let off = (found / exact - 1.0).abs();
            assert!(
                reported.is_none_or(|reported| off <= tol.max(3.0 * reported)),
                "{tol} {beyond}: {found:e} of {exact:e}, {reported:?}"
            );
            assert!(reported.is_some() || beyond < 1e-4, "{tol} {beyond}: nothing is told");
        }
        let frequency = |options: &CompileOptions, beyond: f64| {
            let (_, found, _) = modes_fitted(&stressed("", buckled * (1.0 + beyond), options), 1, &[]).unwrap();
            (found.frequencies_hz[0], found.estimated_error)
        };
        let ((exact, _), (found, reported)) = (frequency(&fine, 3e-4), frequency(&options, 3e-4));
        let off = (found / exact - 1.0).abs();
        assert!(
            reported.is_none_or(|reported| off <= tol.max(3.0 * reported)),
            "{tol}: {found} Hz of {exact}, told {reported:?}"
        );
    }
}

/// A column in one piece, whose first meshes bear 0.3 % too much one as the other, buckles where it does on 64 segments: pressed together by what those
/// say, from 1e-3 to 5e-3 beyond the load.
#[test]
fn a_column_in_one_piece_buckles() {
    let column =
        "param P = 0\nanchor p1 [a] []\nbeam2d p1 [a b] [l=100u w=2u]\nguide2d p1 [b] []\nf2d * [b] [F=P oz=pi]\n";
    let pressed = |load: f64, options: &CompileOptions| {
        let options = CompileOptions { set: vec![("P".into(), Setting::Number(load))], ..options.clone() };
        let (fitted, result, _) = static_fitted(&model(column, &options), &[]).unwrap();
        (-node(&result, "b").x, fitted.order.estimated_error)
    };
    let fine = CompileOptions { segments: Some(64), ..CompileOptions::default() };
    let compliance = pressed(1e-4, &fine).0 / 1e-4;
    let (mut straight, mut buckled) = (7e-4, 1e-3);
    for _ in 0..32 {
        let between = 0.5 * (straight + buckled);
        let bends = pressed(between, &fine).0 > (1.0 + 1e-4) * compliance * between;
        *if bends { &mut buckled } else { &mut straight } = between;
    }
    println!("buckles at {buckled:e} N");
    for tol in [1e-2, 1e-3] {
        let options = CompileOptions { tol, ..CompileOptions::default() };
        for beyond in [5e-3, 2e-3, 1e-3] {
            let load = buckled * (1.0 + beyond);
            let ((exact, _), (found, reported)) = (pressed(load, &fine), pressed(load, &options));
            println!("tol {tol}, {beyond} beyond: {found:e} of {exact:e}, told {reported:?}");
            let off = (found / exact - 1.0).abs();
            assert!(
                reported.is_none_or(|reported| off <= tol.max(3.0 * reported)),
                "{tol} {beyond}: {found:e} of {exact:e}, {reported:?}"
            );
        }
    }
}

/// A stretched bridge between two electrodes at one voltage pulls in by 0.2 % beyond its bifurcation, though tension
/// has made it far stiffer than at rest. One that is compressed nearly to buckling does not pull in 7e-4 before its
/// fold, though its first meshes would.
#[test]
fn bridges_pull_in_where_they_do() {
    let parts =
        "anchor p1 [e] []\nplategap2d * [m e] [A=4e-9 gap=2u oz=-pi/2]\neground * [e] []\ndrive port * [m e] []\n";
    let second = "anchor p1 [f] []\nplategap2d * [m f] [A=4e-9 gap=2u oz=pi/2]\nwire * [e f] []\n";
    let sharp = CompileOptions { tol: 1e-5, ..CompileOptions::default() };
    let at = |text: &str, stress: f64, share: f64| {
        let closes = pull_in_fitted(&stressed(text, stress, &sharp), Some("drive"), 500.0).unwrap().1.pull_in_v;
        let compiled = stressed(text, stress, &CompileOptions::default());
        let (_, result, _) = static_fitted(&compiled, &[("drive".into(), share * closes)]).unwrap();
        println!("pulls in at {closes} V; at {share} of it: pulled in {}", result.pulled_in);
        result.pulled_in
    };
    assert!(at(&format!("{parts}{second}"), 100e6, 1.002));
    assert!(!at(parts, -50e6, 0.9993));
}
