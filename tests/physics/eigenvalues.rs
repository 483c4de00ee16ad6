//! Natural frequencies where eigenvalues are hard to have: very stiff beside very soft, many alike, short stout pieces.

use crate::{close, model};
use bimorph::analysis::AnalysisError;
use bimorph::analysis::modes::{ModesResult, modes};
use bimorph::analysis::statics::static_equilibrium;
use bimorph::analysis::transient::{TransientOptions, transient};
use bimorph::compile::{CompileOptions, Junctions};

fn found(text: &str, segments: usize, count: usize) -> Result<ModesResult, AnalysisError> {
    let options =
        CompileOptions { segments: Some(segments), junctions: Junctions::Centreline, ..CompileOptions::default() };
    modes(&model(text, &options), count, &[])
}

fn settled(result: &ModesResult) {
    assert!(result.residuals.iter().all(|&r| r <= 1e-8), "{:?}", result.residuals);
}

/// Two thin beams with one two hundred times as wide between them: 998.378613683932 Hz (dynamic stiffness of the three
/// beams to 40 digits). Two hundred segments, whose assembled stiffness has lost it, come as near as the mesh allows.
#[test]
fn widths_apart_keep_their_digits() {
    let text = "anchor p1 [a] []\nbeam2d p1 [a b] [l=80u w=0.5u]\nbeam2d p1 [b c] [l=150u w=100u]\n\
                beam2d p1 [c d] [l=120u w=0.5u]";
    for (segments, tolerance) in [(2, 1e-6), (40, 1e-10), (200, 1e-11)] {
        let result = found(text, segments, 3).unwrap();
        close(result.frequencies_hz[0], 998.378613683932, tolerance);
        settled(&result);
    }
}

/// Beams whose widths differ by a factor of a thousand, on a fine mesh: rounding exceeds the soft stiffness, and no
/// frequency is reported.
#[test]
fn what_rounding_hides_is_refused() {
    let text = "anchor p1 [a] []\nbeam2d p1 [a b] [l=80u w=0.02u h=0.02u]\nbeam2d p1 [b c] [l=150u w=100u]\n\
                beam2d p1 [c d] [l=120u w=0.02u h=0.02u]";
    let refused = found(text, 400, 2);
    assert!(matches!(&refused, Err(AnalysisError::NotConverged { .. })), "{refused:?}");
}

/// Forty equal cantilevers have every frequency forty times; all of them are found, by the dense way and by Lanczos.
#[test]
fn equal_frequencies_are_counted() {
    let alone = "anchor p1 [a] []\nbeam2d p1 [a b] [l=100u w=2u]";
    let mut many = String::new();
    for k in 0..40 {
        many += &format!("anchor p1 [a{k}] []\nbeam2d p1 [a{k} b{k}] [l=100u w=2u]\n");
    }
    for segments in [1, 8] {
        let one = found(alone, segments, 2).unwrap();
        let all = found(&many, segments, 41).unwrap();
        settled(&all);
        for (k, f) in all.frequencies_hz.iter().enumerate() {
            close(*f, one.frequencies_hz[k / 40], 1e-9);
        }
    }
}

/// A chain of pieces as long as they are wide, each turned against the last by up to 140°: junctions may not take more
/// mass than the pieces bring, and the modes come.
#[test]
fn stout_pieces_have_modes() {
    let mut text = "anchor p1 [q0] [l=10u w=10u oz=-pi/2]\n".to_owned();
    for k in 0..40 {
        text += &format!("beam2d p1 [q{k} q{}] [l=5u w=5u oz=deg({})]\n", k + 1, (k * k * 20) % 141);
    }
    let compiled = model(&text, &CompileOptions::default());
    assert!(compiled.parts.system.model.bodies.iter().all(|b| b.mass > 0.0));
    let result = modes(&compiled, 3, &[]).unwrap();
    settled(&result);
    assert_eq!(result.frequencies_hz.len(), 3);
}

/// A clamped beam under residual stress, so that N·L²/EI is −20 (half of the buckling load) and +200. The estimate has
/// the sign and the size of the difference between six segments and sixty, within a factor of 2 where its terms nearly
/// cancel.
#[test]
fn estimates_hold_under_stress() {
    let text =
        |stress: f64| format!("anchor p1 [a] []\nbeam2d p1 [a b] [l=300u w=2u stress={stress:e}]\nanchor p1 [b] []");
    // σ = k·E·w²/(12·L²)
    for k in [-20.0, 200.0] {
        let stress = k * 165e9 * 4e-12 / (12.0 * 9e-8);
        let (few, many) = (found(&text(stress), 6, 3).unwrap(), found(&text(stress), 60, 3).unwrap());
        for mode in 0..3 {
            let off = few.frequencies_hz[mode] / many.frequencies_hz[mode] - 1.0;
            let reported = few.errors[mode].unwrap();
            assert!((0.5..2.0).contains(&(reported / off)), "{k} mode {mode}: told {reported:e}, off {off:e}");
        }
    }
}

/// Small displacements keep the effect of stress on vibrations. With and without `linear` a clamped beam at half of its
/// buckling load has the same first frequency, far below that without stress. Beyond the load the linear model reports
/// that it is unstable.
#[test]
fn linear_models_keep_the_stiffness_of_stress() {
    let first = |stress: f64, linear: bool| {
        let text = format!("anchor p1 [a] []\nbeam2d p1 [a b] [l=300u w=2u stress={stress:e}]\nanchor p1 [b] []");
        modes(&model(&text, &CompileOptions { linear, segments: Some(10), ..CompileOptions::default() }), 1, &[])
            .unwrap()
    };
    let buckles = -4.0 * std::f64::consts::PI.powi(2) * 165e9 * 4e-12 / (12.0 * 9e-8);
    let (free, half) = (first(0.0, true), first(0.5 * buckles, true));
    close(half.frequencies_hz[0], first(0.5 * buckles, false).frequencies_hz[0], 1e-6);
    assert!(half.frequencies_hz[0] < 0.8 * free.frequencies_hz[0] && half.warnings.is_empty());
    let beyond = first(1.5 * buckles, true);
    assert!(beyond.frequencies_hz[0] == 0.0 && beyond.warnings[0].contains("unstable"), "{:?}", beyond.warnings);
}

/// Modes about a state that is bent far from the drawing say so, and fewer modes than requested cause a warning too.
#[test]
fn modes_say_what_they_are_about() {
    let text = "anchor p1 [a] []\nbeam2d p1 [a b] [l=200u w=2u]\nf2d * [b] [F=20u oz=pi/2]";
    let result = found(text, 8, 2).unwrap();
    assert!(result.deflection_m > 4e-6 && result.warnings[0].contains("largely deflected"), "{:?}", result.warnings);
    let few = found("anchor p1 [a] []\nbeam2d p1 [a b] [l=200u w=2u]", 1, 20).unwrap();
    assert!(few.frequencies_hz.len() < 20 && few.warnings[0].contains("of 20 modes"), "{:?}", few.warnings);
}

/// A clamped beam heated at once to six times its buckling load stays straight in an ideal computation, and the run
/// says so. With an imperfection of a ten-thousandth it reaches the branch of the static equilibrium, without a
/// message.
#[test]
fn a_balanced_motion_is_reported_and_an_imperfection_takes_the_branch() {
    let text = "h1 beam2det p1 [a m] [l=150u w=2u R=1000 tau=5u]\nh2 beam2det p1 [m b] [l=150u w=2u R=1000 tau=5u]\n\
                anchor p1 [a] []\nanchor p1 [b] []\neground * [b] []\nv port * [a b] []";
    let volts = vec![("v".to_owned(), 1.2)];
    let run = |imperfection: Option<f64>| {
        let options = CompileOptions { imperfection, segments: Some(4), ..CompileOptions::default() };
        let compiled = model(text, &options);
        let asked = TransientOptions {
            stop: 2e-3,
            signals: vec!["m.y".into()],
            voltages: volts.clone(),
            ..TransientOptions::default()
        };
        let result = transient(&compiled, &asked, &mut |_, _| (), &mut |_| true).unwrap();
        (result.signals[0].2.last().copied().unwrap(), result.warnings, compiled)
    };
    let (straight, reported, ideal) = run(None);
    assert!(
        straight.abs() < 1e-9 && reported.len() == 1 && reported[0].contains("unstable"),
        "{straight:e} {reported:?}"
    );
    let rests = static_equilibrium(&ideal, &volts).unwrap().nodes;
    let branch = rests.iter().find(|(name, _)| name == "m").unwrap().1.y.abs();
    for side in [1.0, -1.0] {
        let (bent, reported, _) = run(Some(side * 1e-4));
        assert!(reported.is_empty(), "{reported:?}");
        close(bent, side * branch, 0.05);
    }
}

/// As SUGAR: frequencies about the drawing, whatever the residual stress, and beams that meet in points.
#[test]
fn as_sugar_is_about_the_drawing() {
    let first = |stress: f64, options: CompileOptions| {
        let text = format!("anchor p1 [a] []\nbeam2d p1 [a b] [l=300u w=2u stress={stress:e}]\nanchor p1 [b] []");
        modes(&model(&text, &CompileOptions { segments: Some(8), ..options }), 1, &[]).unwrap().frequencies_hz[0]
    };
    let sugar = CompileOptions { as_sugar: true, ..CompileOptions::default() };
    let plain = CompileOptions { linear: true, junctions: Junctions::Centreline, ..CompileOptions::default() };
    assert_eq!(first(20e6, sugar.clone()), first(0.0, plain.clone()));
    assert!(first(20e6, plain.clone()) > 1.05 * first(0.0, plain));
}

/// A model without mass has no modes, and says so; it has an equilibrium and a motion all the same.
#[test]
fn nothing_with_mass() {
    let text = "process p = [Youngsmodulus=165e9 h=2u]\nanchor p [a] []\nbeam2d p [a b] [l=100u w=2u]\nf2d * [b] [F=1u oz=pi/2]";
    let compiled = model(text, &CompileOptions { segments: Some(2), ..CompileOptions::default() });
    let error = modes(&compiled, 3, &[]).unwrap_err().to_string();
    assert!(error.contains("mass") && error.contains("density"), "{error}");
    assert!(static_equilibrium(&compiled, &[]).is_ok());
}
