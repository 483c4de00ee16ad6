//! Beams: deflections, large rotations, frequencies.

use crate::{balance, close, linear, model, node};
use bimorph::analysis::AnalysisError;
use bimorph::analysis::modes::modes;
use bimorph::analysis::statics::static_equilibrium;
use bimorph::compile::CompileOptions;

const EI: f64 = 165e9 * 2e-6 * 8e-18 / 12.0;

/// A cantilever of 100 × 2 × 2 µm under an end force bends by FL³/3EI = 3.0303 µm per 2 µN (SUGAR 2.0, cantilever demo),
/// exactly for any number of segments.
#[test]
fn cantilever_is_exact_for_end_loads() {
    for band in [None, Some(1e5), Some(2e7)] {
        let options = CompileOptions { band, ..linear() };
        let compiled =
            model("anchor p1 [a] [l=5u w=5u]\nbeam2d p1 [a b] [l=100u w=2u]\nf2d * [b] [F=2u oz=pi/2]", &options);
        close(node(&balance(&compiled, &[]), "b").y, 3.03030303030303e-6, 1e-12);
    }
}

/// Elastica under a dead end load, α = PL²/EI = 1: tip at (0.056433, 0.301721)·L (independent shooting to 12 digits),
/// within 2e-3 with the few segments that statics takes by itself and within 1e-5 with 20.
#[test]
fn elastica() {
    // 1 mm long, so that the axial compliance, which the elastica leaves out, is 3e-7
    let load = EI / 1e-6;
    let text = format!("anchor p1 [a] [l=5u w=5u]\nbeam2d p1 [a b] [l=1m w=2u]\nf2d * [b] [F={load:e} oz=pi/2]");
    for (band, tolerance) in [(None, 2e-3), (Some(4e5), 1e-5)] {
        let compiled = model(&text, &CompileOptions { band, ..CompileOptions::default() });
        let tip = node(&balance(&compiled, &[]), "b");
        close(-tip.x / 1e-3, 0.05643323628337688, 4.0 * tolerance);
        close(tip.y / 1e-3, 0.3017207737998135, tolerance);
        close(tip.rz, 0.461351949711879, tolerance);
    }
}

/// Eight segments follow the elastica to 1e-3 of the length under dead end loads α = PL²/EI of 1 and 2 (independent shooting
/// to 12 digits), and four segments the roll-up to a half circle.
#[test]
fn few_segments_turn_far() {
    let text = |end: String| format!("anchor p1 [a] [l=5u w=5u]\nbeam2d p1 [a b] [l=1m w=2u]\nf2d * [b] [{end}]");
    let tip = |end: String, segments: usize| {
        let options = CompileOptions { segments: Some(segments), ..CompileOptions::default() };
        node(&balance(&model(&text(end), &options), &[]), "b")
    };
    let exact = [
        (1.0, 0.056_433_236_283_376_88, 0.301_720_773_799_813_5, 0.461_351_949_711_879),
        (2.0, 0.160_641_720_825_167_2, 0.493_457_480_396_711_8, 0.781_749_831_556_543),
    ];
    for (alpha, back, aside, turn) in exact {
        let end = tip(format!("F={:e} oz=pi/2", alpha * EI / 1e-6), 8);
        for (got, want) in [(-end.x / 1e-3, back), (end.y / 1e-3, aside), (end.rz, turn)] {
            assert!((got - want).abs() < 1e-3, "{alpha}: {got} {want}");
        }
    }
    let end = tip(format!("M={:e} F=0", std::f64::consts::PI * EI / 1e-3), 4);
    assert!((end.x / 1e-3 + 1.0).abs() < 1e-3 && (end.y / 1e-3 - 2.0 / std::f64::consts::PI).abs() < 1e-3, "{end:?}");
}

/// An end moment of πEI/L rolls a beam of eight segments up to a half circle: the tip comes to (0, 2L/π).
#[test]
fn roll_up() {
    let moment = std::f64::consts::PI * EI / 100e-6;
    let text = format!("anchor p1 [a] [l=5u w=5u]\nbeam2d p1 [a b] [l=100u w=2u]\nf2d * [b] [M={moment:e} F=0]");
    let compiled = model(&text, &CompileOptions { band: Some(1.5e7), ..CompileOptions::default() });
    let tip = node(&balance(&compiled, &[]), "b");
    assert!((tip.x / 100e-6 + 1.0).abs() < 1e-3, "{tip:?}");
    close(tip.y / 100e-6, 2.0 / std::f64::consts::PI, 1e-3);
    close(tip.rz, std::f64::consts::PI, 1e-9);
}

/// Clamped-free and clamped-clamped frequencies of the Euler–Bernoulli beam (βL = 1.8751, 4.6941, 7.8548; 4.7300, 7.8532,
/// 10.9956) within the tolerance that the number of segments was chosen for.
#[test]
fn frequencies_hold_their_tolerance() {
    let unit = (165e9f64 * 4e-12 / 12.0 / 2300.0).sqrt() / (100e-6f64 * 100e-6) / std::f64::consts::TAU;
    let free = [1.875104068711961, 4.694091132974174, 7.854757438237612];
    let clamped = [4.730040744862704, 7.853204624095838, 10.99560783800167];
    for (end, roots) in [("", free), ("anchor p1 [b] [l=5u w=5u]", clamped)] {
        let text = format!("anchor p1 [a] [l=5u w=5u]\nbeam2d p1 [a b] [l=100u w=2u]\n{end}");
        let band = roots[2] * roots[2] * unit;
        let compiled = model(&text, &CompileOptions { band: Some(band), tol: 1e-3, ..CompileOptions::default() });
        let found = modes(&compiled, 3, &[]).unwrap();
        assert_eq!(found.frequencies_hz.len(), roots.len());
        for (f, root) in found.frequencies_hz.iter().zip(roots) {
            close(*f, root * root * unit, 1.1e-3);
        }
        assert!(found.residuals.iter().all(|&r| r < 1e-8), "{:?}", found.residuals);
    }
}

/// The reconstructed three-bimorph bank: ten modes within 0.2 % of the converged Euler–Bernoulli frame (86.3, 407.7, 408.1,
/// 418.0, 627.0, 641.6, 798.5, 1123.4, 1123.9, 1141.7 kHz, independent cubic-beam frame).
#[test]
fn bank_modes() {
    let bimorph = |k: usize| {
        format!(
            "anchor p1 [a{k}] [l=10u w=10u oz=pi]\nbeam2d p1 [a{k} t{k}] [l=206u w=2u]\n\
             beam2d p1 [t{k} c{k}] [l=23u w=13u oz=-pi/2]\nbeam2d p1 [c{k} f{k}] [l=112u w=8u oz=pi]\n\
             beam2d p1 [f{k} g{k}] [l=94u w=1.9u oz=pi]\nanchor p1 [g{k}] [l=10u w=10u oz=pi]\n\
             beam2d p1 [c{k} y{k}] [l=24u w=3u]\n"
        )
    };
    let yoke = "beam2d p1 [y1 y2] [l=49.5u w=11u oz=pi/2]\nbeam2d p1 [y2 y3] [l=49.5u w=11u oz=pi/2]\n";
    let text = format!("{}{}{yoke}{}", bimorph(1), bimorph(2), bimorph(3));
    let compiled = model(&text, &CompileOptions { band: Some(1.3e6), ..CompileOptions::default() });
    let found = modes(&compiled, 10, &[]).unwrap();
    let want = [86.3, 407.7, 408.1, 418.0, 627.0, 641.6, 798.5, 1123.4, 1123.9, 1141.7];
    assert_eq!(found.frequencies_hz.len(), want.len());
    for (f, want) in found.frequencies_hz.iter().zip(want) {
        close(*f, 1e3 * want, 2e-3);
    }
}

/// A structure without support is rejected, and the message names a body.
#[test]
fn a_mechanism_without_support_is_singular() {
    let compiled = model("beam2d p1 [a b] [l=100u w=2u]\nf2d * [b] [F=1u oz=pi/2]", &CompileOptions::default());
    let refused = static_equilibrium(&compiled, &[]);
    assert!(matches!(refused, Err(AnalysisError::Singular { .. })), "{refused:?}");
}

/// The same free beam has three rigid motions at zero frequency and then βL = 4.7300, 7.8532.
#[test]
fn a_free_beam_has_three_rigid_modes() {
    let compiled =
        model("beam2d p1 [a b] [l=100u w=2u]", &CompileOptions { band: Some(8e6), ..CompileOptions::default() });
    let found = modes(&compiled, 5, &[]).unwrap().frequencies_hz;
    let unit = (165e9f64 * 4e-12 / 12.0 / 2300.0).sqrt() / (100e-6f64 * 100e-6) / std::f64::consts::TAU;
    assert!(found[2] < 1e-3 * found[3], "{found:?}");
    close(found[3], 4.730040744862704f64.powi(2) * unit, 1e-3);
    close(found[4], 7.853204624095838f64.powi(2) * unit, 1e-3);
}

/// A part on beams that are too soft to resolve (2 nm × 2 nm, like drawing aids in old decks) stays in place, and the
/// result says so, with the net load on it, if any. The rest has its displacement, F·l³/(3·E·I).
#[test]
fn a_part_on_slender_beams_is_held_and_reported() {
    let text = |force: &str| {
        format!(
            "anchor p1 [a] [l=5u w=5u]\nbeam2d p1 [a b] [l=100u w=2u]\nf2d * [b] [F=2u oz=pi/2]\n\
             beam2d p1 [b c] [l=200u w=2n h=2n]\nbeam2d p1 [c d] [l=50u w=20u]\n{force}"
        )
    };
    let result = balance(&model(&text(""), &linear()), &[]);
    close(node(&result, "b").y, 3.03030303030303e-6, 1e-9);
    assert!(!result.free_motions.is_empty());
    let loaded = balance(&model(&text("f2d * [d] [F=1u oz=pi/2]"), &linear()), &[]);
    close(node(&loaded, "b").y, 3.03030303030303e-6, 1e-6);
    assert!(loaded.free_motions.iter().any(|m| m.contains("1.0e-6 N")), "{:?}", loaded.free_motions);
}
