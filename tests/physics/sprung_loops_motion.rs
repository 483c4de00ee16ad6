//! Motion in relative joint coordinates whose loops close by springs, against the bodies' own coordinates and differences.

use crate::model;
use bimorph::analysis::transient::{TransientOptions, TransientResult, transient};
use bimorph::compile::{CompileOptions, CompiledModel, Formulation, Scheme, compile};
use bimorph::domains::Ramp;
use bimorph::equations::{Bodies, Joints};
use bimorph::multibody::joint_coordinates::sprung_loops::{Tree, UnsupportedModel};
use bimorph::netlist::{Setting, read_bundle};
use bimorph::solve::time::joint_rodas4::JointRodas4;

use bimorph::solve::time::method::{Method, Motion};
use std::path::Path;
use std::sync::Arc;

/// Rigid plates on flexure pivots, displaced some 170 µm by a force, with joints that only rotate (scheme a2). `auto`
/// steps explicitly in joint coordinates, and at 1e-2 ends nearer to a compliant run at 1e-6 than a compliant one at
/// 1e-4 does. It takes a seventh of its steps and of its evaluations. Where flexures are elastic in every direction it
/// takes the bodies' own coordinates.
#[test]
fn plates_on_pivots_step_explicitly() {
    let bundle = read_bundle(Path::new("examples/pivots/pivots.net"), &[]).unwrap();
    let swing = |formulation, scheme, tol| {
        let options =
            CompileOptions { formulation, scheme, tol, undamped: true, segments: Some(1), ..CompileOptions::default() };
        let compiled = compile(&bundle, &options).unwrap();
        let options = TransientOptions {
            stop: 300e-6,
            signals: vec!["plate(8).x".into(), "plate(8).y".into()],
            points: 3,
            tol,
            ..TransientOptions::default()
        };
        let result = transient(&compiled, &options, &mut |_, _| (), &mut |_| true).unwrap();
        let end = [0, 1].map(|k: usize| result.signals[k].2[2]);
        (end, result)
    };
    let apart = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    let (truth, _) = swing(Formulation::Compliant, Scheme::A2, 1e-6);
    assert!((1.5e-4..2e-4).contains(&truth[1]), "{truth:?}");
    let (bodies, slow) = swing(Formulation::Compliant, Scheme::A2, 1e-4);
    let (joints, quick) = swing(Formulation::Auto, Scheme::A2, 1e-2);
    assert!(apart(joints, truth) < apart(bodies, truth), "{joints:?} {bodies:?} {truth:?}");
    assert_eq!((quick.counters.factorizations, quick.unknowns, slow.unknowns), (0, 8, 24));
    assert!(7 * quick.counters.steps < slow.counters.steps && 7 * quick.counters.forces < slow.counters.forces);
    // elastic in every direction: the same motion but for what that changes, by factorizations
    let (elastic, counted) = swing(Formulation::Auto, Scheme::Auto, 1e-3);
    assert!(apart(elastic, truth) < 2e-3 * truth[1] && counted.counters.factorizations > 0, "{elastic:?}");
}

fn scene(file: &str, formulation: Formulation, tol: f64, set: &[(&str, f64)]) -> CompiledModel {
    let bundle = read_bundle(Path::new(file), &[]).unwrap();
    let set = set.iter().map(|&(n, v)| (n.to_owned(), Setting::Number(v))).collect();
    let options = CompileOptions { formulation, tol, set, scheme: Scheme::Es, ..CompileOptions::default() };
    compile(&bundle, &options).unwrap_or_else(|e| panic!("{file}: {e}"))
}

fn run(compiled: &CompiledModel, volts: &[(&str, f64)], stop: f64, signal: &str) -> TransientResult {
    let options = TransientOptions {
        stop,
        signals: vec![signal.to_owned()],
        points: 101,
        tol: compiled.options.tol,
        voltages: volts.iter().map(|&(n, v)| (n.to_owned(), v)).collect(),
        ..TransientOptions::default()
    };
    transient(compiled, &options, &mut |_, _| (), &mut |_| true).unwrap_or_else(|e| panic!("{signal}: {e}"))
}

/// A cantilever released from a micrometre, undamped, with 1, 4 and 12 segments and at three tolerances. The final
/// state is that of the bodies' own coordinates, within the tolerance, and the steps agree within a fifth. Without
/// rotary inertia (scheme E4) the formulation is refused.
#[test]
fn a_cantilever_swings_alike() {
    let beam = |force: f64, formulation, scheme, segments, tol| {
        let text = format!("anchor p1 [a] [l=5u w=5u]\nbeam2d p1 [a b] [l=100u w=2u]\nf2d * [b] [F={force} oz=pi/2]");
        let options = CompileOptions {
            formulation,
            scheme,
            segments: Some(segments),
            tol,
            undamped: true,
            ..CompileOptions::default()
        };
        model(&text, &options)
    };
    for segments in [1, 4, 12] {
        for tol in [1e-2, 1e-3, 1e-4] {
            let [bodies, joints] = [Formulation::Compliant, Formulation::Rcr].map(|formulation| {
                let held = beam(1e-6, formulation, Scheme::Es, segments, tol);
                let options = TransientOptions {
                    stop: 4e-6,
                    signals: vec!["b.y".to_owned()],
                    points: 41,
                    tol,
                    release: Some(&held),
                    ..TransientOptions::default()
                };
                let free = beam(0.0, formulation, Scheme::Es, segments, tol);
                transient(&free, &options, &mut |_, _| (), &mut |_| true).unwrap_or_else(|e| panic!("{segments}: {e}"))
            });
            let (a, b) = (&bodies.signals[0].2, &joints.signals[0].2);
            let apart = a.iter().zip(b).fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
            assert!(apart <= tol * a[0].abs(), "{segments} at {tol:e}: {apart:e} of {:e}", a[0]);
            let steps = joints.counters.steps as f64 / bodies.counters.steps as f64;
            assert!((0.8..1.2).contains(&steps), "{segments} at {tol:e}: {steps} times the steps");
        }
    }
    let bare = beam(0.0, Formulation::Compliant, Scheme::E4, 4, 1e-3);
    assert!(matches!(Tree::elastic(&bare.parts.system.model), Err(UnsupportedModel::NoInertia { .. })));
}

/// On example models as drawn, heated or loaded at once, both formulations move alike: within the tolerance of the
/// larger excursion, in as many steps within a tenth, with as many unknowns, no constraint and no singular evaluation.
#[test]
fn formulations_move_alike() {
    type Case<'a> = (&'a str, &'a [(&'a str, f64)], &'a [(&'a str, f64)], f64, &'a str);
    let cases: [Case<'_>; 5] = [
        ("examples/bank/bank.net", &[], &[("heat", 1.0)], 5e-6, "yoke.y"),
        ("examples/quarter_stage/quarter_stage.net", &[("F", 20e-6)], &[], 10e-6, "c.x"),
        ("examples/rotary_stage/rotary_stage.net", &[], &[("clockwise", 1.0)], 3e-6, "rotor.rz"),
        ("examples/chevron/chevron.net", &[], &[("heat", 1.0)], 5e-6, "apex.y"),
        ("examples/comb_resonator/comb_resonator.net", &[], &[("drive", 20.0)], 20e-6, "shuttle.x"),
    ];
    for (file, set, volts, stop, signal) in cases {
        for tol in [1e-2, 1e-3, 1e-4] {
            let [bodies, joints] = [Formulation::Compliant, Formulation::Rcr]
                .map(|formulation| run(&scene(file, formulation, tol, set), volts, stop, signal));
            let (a, b) = (&bodies.signals[0].2, &joints.signals[0].2);
            let reach = a.iter().fold(0.0f64, |m, x| m.max(x.abs()));
            let apart = a.iter().zip(b).fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
            assert!(reach > 0.0 && apart <= tol * reach, "{file} at {tol:e}: {apart:e} of {reach:e}");
            assert_eq!(bodies.unknowns, joints.unknowns, "{file}");
            let steps = joints.counters.steps as f64 / bodies.counters.steps as f64;
            assert!((0.9..1.1).contains(&steps), "{file} at {tol:e}: {steps} times the steps");
        }
    }
}

/// A heated arm pushes a plate that a voltage pulls at.
const HEATED: &str = "
anchor p1 [a] [l=10u w=10u oz=pi]
anchor p1 [b] [l=10u w=10u]
anchor p1 [e] [l=10u w=10u]
left  beam2det p1 [a c] [l=120u w=2u oz=0.1 tau=20u]
right beam2det p1 [c b] [l=120u w=2u oz=-0.1]
rod beam2d p1 [c s] [l=40u w=4u oz=pi/2]
mass2d * [s] [m=2e-11 J=1e-20]
plategap2d p1 [s e] [A=4e-10 gap=1.5u oz=0]
eground * [b] []
eground * [e] []
heat port * [a] []
pull port * [s] []
";

/// Sensitivities of a single step are the derivatives of its result, for both ports: 1e-6 of the largest change of a body
/// (central differences of a thousandth).
#[test]
fn sensitivities_of_a_step_are_exact() {
    let compiled =
        model(HEATED, &CompileOptions { scheme: Scheme::Es, segments: Some(2), ..CompileOptions::default() });
    let system = &compiled.parts.system;
    let joints = Arc::new(Joints::elastic(system).unwrap());
    let electrics = &system.electrics;
    let count = system.bodies();
    let rise = vec![0.0; electrics.heating.states()];
    let from = [1.0, 9.0];
    let shortest = 1e-10;
    let after = |to: [f64; 2]| {
        let before = Ramp::new(electrics, &[0.5, 3.0], &from, &rise, 3e-7);
        let mut method = JointRodas4::new(Arc::clone(&joints), shortest, &[0, 1]);
        let (mut motion, mut error) = (Motion::zeros(count), Motion::zeros(count));
        let mut bodies = Bodies::new(system, &before);
        method.start(&mut bodies, &motion).unwrap();
        for k in 0..15 {
            method.step(&mut bodies, f64::from(k) * 2e-8, 2e-8, &mut motion, &mut error).unwrap();
        }
        // a moving start, from which the differentiated step continues
        let rise: Vec<f64> = (0..rise.len()).map(|k| before.rise_at(k, 3e-7)).collect();
        let ramp = Ramp::new(electrics, &from, &to, &rise, 2e-8);
        method.forget_sensitivities();
        method.step(&mut Bodies::new(system, &ramp), 0.0, 2e-8, &mut motion, &mut error).unwrap();
        (motion, method.sensitivity.clone())
    };
    let at = [3.0, 12.0];
    let (_, sensitivity) = after(at);
    for port in 0..2 {
        let step = 1e-3 * at[port];
        let (mut hi, mut lo) = (at, at);
        hi[port] += step;
        lo[port] -= step;
        let (hi, lo) = (after(hi).0, after(lo).0);
        for (hi, lo, exact) in [(&hi.q, &lo.q, &sensitivity[port].q), (&hi.v, &lo.v, &sensitivity[port].v)] {
            let reach = exact.iter().map(|x| x.xy().amax()).fold(0.0, f64::max);
            for j in 0..count {
                let apart = (hi[j] - lo[j]) / (2.0 * step) - exact[j];
                assert!(apart.xy().amax() < 1e-6 * reach, "port {port} body {j}: {apart} of {reach:e}");
            }
        }
    }
}

/// A body on a guide, straight or at an angle, which its arm pushes across, or on two that hold it wholly, moves alike in both formulations:
/// within the tolerance of the larger excursion. (Joint coordinates let the held direction move, or called the matrix singular.)
#[test]
fn a_guided_body_moves_alike() {
    let arms = "anchor p1 [a] [l=10u w=10u]\nbeam2d p1 [a m] [l=100u w=2u oz=0.4]\nbeam2d p1 [m b] [l=60u w=2u oz=-0.3]\n\
        mass2d p1 [b] [m=1e-12 J=1e-24]\nf2d * [b] [F=5u oz=1.2]\n";
    let guided = [
        ("guide2d p1 [m] [oz=0]", ["m.y", "b.y"]),
        ("guide2d p1 [m] [oz=0.1]", ["m.x", "m.y"]),
        ("guide2d p1 [m] [oz=0.1]", ["b.x", "b.y"]),
        ("guide2d p1 [m] [oz=1]\nguide2d p1 [m] [oz=2]", ["b.x", "b.y"]),
    ];
    for (guides, signals) in guided {
        for signal in signals {
            let end = |formulation| {
                let options =
                    CompileOptions { formulation, scheme: Scheme::Es, tol: 1e-3, ..CompileOptions::default() };
                let compiled = model(&format!("{arms}{guides}\n"), &options);
                *run(&compiled, &[], 3e-6, signal).signals[0].2.last().unwrap()
            };
            let (bodies, joints) = (end(Formulation::Compliant), end(Formulation::Rcr));
            assert!(
                (bodies - joints).abs() <= 1e-3 * bodies.abs().max(1e-8),
                "{guides} {signal}: {bodies:e} {joints:e}"
            );
        }
    }
}
