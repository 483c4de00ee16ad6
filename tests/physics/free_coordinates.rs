//! Coordinates that nothing resists: rotations of pins are no unknowns, parts without an anchor stay where they are drawn, and their rigid-body
//! modes are at 0 Hz.

use crate::model;
use bimorph::analysis::AnalysisError;
use bimorph::analysis::formulation::Formulation;
use bimorph::analysis::joint_transient::joint_transient;
use bimorph::analysis::mesh::{modes_fitted, static_fitted};
use bimorph::analysis::modes::modes;
use bimorph::analysis::statics::{StaticResult, static_equilibrium};
use bimorph::analysis::transient::{TransientOptions, TransientResult, transient};
use bimorph::compile::{CompileOptions, CompiledModel};
use std::f64::consts::{PI, TAU};

/// Displacement of a node.
fn moved(result: &StaticResult, node: &str) -> [f64; 3] {
    let (_, m) = result.nodes.iter().find(|(name, _)| name == node).unwrap_or_else(|| panic!("{node}"));
    [m.x, m.y, m.rz]
}

fn close(found: f64, expected: f64, relative: f64) {
    assert!((found - expected).abs() <= relative * expected.abs(), "{found:e}, expected {expected:e}");
}

fn run(compiled: &CompiledModel, formulation: Formulation, options: &TransientOptions<'_>) -> TransientResult {
    let mut sample = |_: f64, _: &[f64]| {};
    let mut watch = |_: f64| true;
    match formulation {
        Formulation::Compliant => transient(compiled, options, &mut sample, &mut watch),
        _ => joint_transient(compiled, formulation, options, &mut sample, &mut watch).map(|(result, _)| result),
    }
    .unwrap_or_else(|e| panic!("{formulation:?}: {e}"))
}

/// A parallelogram of three pinned bars of length L and mass m under a force F on one pin. The cranks turn together by ψ and the coupler only
/// moves, so that the kinetic energy is ½·(5/3)·m·L²·ψ̇² = F·L·sin ψ: the speed of the pin is v² = 6·F·x/(5·m) (energy balance, closed form).
const PARALLELOGRAM: &str = "
    anchor p1 [a] []
    crank freehinge p1 [a b] [l=100u w=4u oz=pi/2]
    coupler freehinge p1 [b c] [l=100u w=4u]
    rocker freehinge p1 [c d] [l=100u w=4u oz=-pi/2]
    anchor p1 [d] []
    f2d * [b] [F=1u]";

/// Bars on common pins run in both formulations, and at any angle of the drawing, with the speed that the energy balance gives.
#[test]
fn bars_on_pins_run() {
    let mass = 2300.0 * 100e-6 * 4e-6 * 2e-6;
    for (formulation, angle) in
        [(Formulation::Compliant, "0"), (Formulation::Compliant, "0.7"), (Formulation::Rcr, "0.7")]
    {
        let text = PARALLELOGRAM
            .replace("oz=pi/2", &format!("oz=pi/2+{angle}"))
            .replace("[b c] [l=100u w=4u]", &format!("[b c] [l=100u w=4u oz={angle}]"))
            .replace("oz=-pi/2", &format!("oz=-pi/2+{angle}"))
            .replace("[F=1u]", &format!("[F=1u oz={angle}]"));
        let compiled = model(&text, &CompileOptions { undamped: true, ..CompileOptions::default() });
        // three bars, four coordinates of two pins
        assert_eq!(compiled.parts.system.model.unknowns(), 3 * 3 + 2 * 2);
        let options = TransientOptions {
            stop: 15e-6,
            signals: ["b.x", "b.y", "b.vx", "b.vy"].map(str::to_owned).to_vec(),
            tol: 1e-5,
            points: 61,
            ..TransientOptions::default()
        };
        let result = run(&compiled, formulation, &options);
        let turn: f64 = angle.parse().unwrap();
        let mut checked = 0;
        for k in 0..result.t.len() {
            let [x, y, vx, vy] = [0, 1, 2, 3].map(|s| result.signals[s].2[k]);
            let along = x * turn.cos() + y * turn.sin();
            if along > 10e-6 && along < 90e-6 {
                close(vx.hypot(vy).powi(2), 1.2 * 1e-6 * along / mass, 2e-3);
                checked += 1;
            }
        }
        assert!(checked > 5, "{formulation:?}: {checked}");
    }
}

/// A toggle of two pinned bars at ±α with a mass at its apex: δ = F·l/(2·E·A·sin² α) under a force, ω² = 2·E·A·sin²
/// α/(l·m) (linear truss theory). This holds where the apex is a bare pin, has a mass without inertia, or two supports
/// hold the feet twice.
#[test]
fn trusses_on_pins() {
    let text = |mass: &str| {
        format!(
            "hinge * [a] []\n hinge * [a] []\n freehinge p1 [a c] [l=100u w=4u oz=pi/3]\n freehinge p1 [c b] [l=100u w=4u oz=-pi/3]\n
             hinge * [b] []\n f2d * [c] [F=1u oz=-pi/2]\n {mass}"
        )
    };
    let stiffness = 165e9 * 4e-6 * 2e-6 / 100e-6;
    let sine = (PI / 3.0).sin();
    for mass in ["", "mass2d * [c] [m=1u]"] {
        let compiled = model(&text(mass), &CompileOptions { linear: true, ..CompileOptions::default() });
        let (_, result, _) = static_fitted(&compiled, &[]).unwrap();
        close(moved(&result, "c")[1], -1e-6 / (2.0 * stiffness * sine * sine), 1e-5);
        assert_eq!(moved(&result, "c")[2], 0.0);
        assert!(result.free_motions.is_empty(), "{:?}", result.free_motions);
        if !mass.is_empty() {
            let (_, found, _) = modes_fitted(&compiled, 2, &[]).unwrap();
            let expected = [(PI / 3.0).cos(), sine].map(|s| (2.0 * stiffness * s * s / 1e-6).sqrt() / TAU);
            found.frequencies_hz.iter().zip(expected).for_each(|(f, expected)| close(*f, expected, 1e-4));
        }
    }
    // a moment on a pin has nothing to act on
    let turned = model(&text("f2d * [c] [F=0 M=1p]"), &CompileOptions::default());
    let error = static_equilibrium(&turned, &[]).unwrap_err().to_string();
    assert!(error.contains("\"c\"") && error.contains("about z") && error.contains("hinge"), "{error}");
}

/// A mass on two springs without rotational stiffness, and one that a spring holds along one axis only: F/k, and a direction that is held with
/// a sentence where no load excites it, or an error where one does.
#[test]
fn masses_on_springs() {
    let text = |more: &str| {
        format!(
            "anchor * [a] []\n spring2d * [a b] [kx=2 ky=0 krz=0]\n mass2d * [b] [m=1n]\n f2d * [b] [F=1u]\n {more}"
        )
    };
    let compiled = model(&text(""), &CompileOptions::default());
    let result = static_equilibrium(&compiled, &[]).unwrap();
    close(moved(&result, "b")[0], 0.5e-6, 1e-9);
    assert!(
        result.free_motions.iter().any(|m| m.contains("\"b\"") && m.contains("along y")),
        "{:?}",
        result.free_motions
    );
    let pushed = model(&text("f2d * [b] [F=1p oz=pi/2]"), &CompileOptions::default());
    assert!(matches!(static_equilibrium(&pushed, &[]), Err(AnalysisError::Singular { .. })));
}

/// A cantilever under a force beside a free beam of the same section.
const BESIDE: &str = "
    anchor p1 [a] []
    beam2d p1 [a b] [l=100u w=2u]
    f2d * [b] [F=1u oz=pi/2]
    pos * [a c] [x=20u y=50u]
    beam2d p1 [c d] [l=120u w=2u oz=0.4]";

/// A part without an anchor changes nothing of the others, and is reported; pulled at both ends by F it is longer by
/// F·l/(E·A) (Hooke).
#[test]
fn loose_parts_stay_where_they_are_drawn() {
    let alone = BESIDE.split("pos").next().unwrap();
    let options = CompileOptions::default();
    let tip = |text: &str| static_fitted(&model(text, &options), &[]).unwrap().1;
    let (one, both) = (tip(alone), tip(BESIDE));
    close(moved(&both, "b")[1], moved(&one, "b")[1], 1e-9);
    assert!(both.free_motions.len() == 1 && both.free_motions[0].contains("no anchor"), "{:?}", both.free_motions);
    assert_eq!(moved(&both, "d"), [0.0; 3]);
    let pulled = format!("{BESIDE}\n f2d * [d] [F=5u oz=0.4]\n f2d * [c] [F=5u oz=0.4+pi]");
    let result = tip(&pulled);
    let [c, d] = ["c", "d"].map(|node| moved(&result, node));
    close((d[0] - c[0]).hypot(d[1] - c[1]), 5e-6 * 120e-6 / (165e9 * 2e-6 * 2e-6), 1e-6);
    // not balanced: nothing holds it
    for load in ["f2d * [d] [F=1n]", "f2d * [d] [F=0 M=1f]"] {
        let error = static_equilibrium(&model(&format!("{BESIDE}\n{load}"), &options), &[]).unwrap_err();
        assert!(matches!(error, AnalysisError::Singular { .. }), "{load}: {error}");
    }
}

/// Modes of both: three at exactly 0 Hz with a warning, then those of the cantilever (β·l = 1.875104) and the free beam (β·l = 4.730041; closed
/// forms of the Euler–Bernoulli beam), about the drawing and about the state under a force.
#[test]
fn rigid_modes_of_loose_parts_are_at_zero() {
    let frequency = |beta: f64, length: f64| {
        let (ei, line) = (165e9 * 2e-6 * 8e-18 / 12.0, 2300.0 * 4e-12);
        (beta / length).powi(2) * f64::sqrt(ei / line) / TAU
    };
    for load in ["F=1u", "F=0"] {
        let compiled = model(&BESIDE.replace("F=1u", load), &CompileOptions { tol: 1e-3, ..CompileOptions::default() });
        let (_, found, _) = modes_fitted(&compiled, 5, &[]).unwrap();
        assert_eq!(&found.frequencies_hz[..3], [0.0; 3], "{load}");
        let expected = [frequency(1.875_104, 100e-6), frequency(4.730_041, 120e-6)];
        found.frequencies_hz[3..].iter().zip(expected).for_each(|(f, expected)| close(*f, expected, 2e-3));
        assert!(found.warnings.iter().any(|w| w.contains("3 of the modes are rigid-body")), "{:?}", found.warnings);
        assert!(found.errors.iter().all(|error| error.is_some_and(|error| error.abs() <= 1e-3)), "{:?}", found.errors);
        let few = modes(&compiled, 1, &[]).unwrap();
        assert_eq!(few.frequencies_hz, [0.0], "{load}");
    }
}

/// A force on a free beam of mass m moves its centre by ½·F·t²/m (Newton).
#[test]
fn loose_parts_run_in_time() {
    let text = format!("{BESIDE}\n f2d * [c] [F=1u oz=0.4]");
    let compiled = model(&text, &CompileOptions { undamped: true, segments: Some(2), ..CompileOptions::default() });
    let options = TransientOptions {
        stop: 4e-6,
        signals: vec!["d.x".into(), "c.x".into()],
        tol: 1e-5,
        points: 21,
        ..TransientOptions::default()
    };
    let result = run(&compiled, Formulation::Compliant, &options);
    let last = result.t.len() - 1;
    let (mass, time) = (2300.0 * 4e-12 * 120e-6, result.t[last]);
    // along its own axis it is a stiff rod: both ends move alike but for waves along it
    close(result.signals[0].2[last], 0.5 * 1e-6 * time * time / mass * f64::cos(0.4), 1e-3);
}
