//! Relative joint coordinates whose loops close by springs, against the bodies' own coordinates, dense algebra and
//! differences.

use crate::model;
use bimorph::analysis::transient::{TransientOptions, TransientResult, transient};
use bimorph::compile::{CompileError, CompileOptions, Compiled, Formulation, Scheme, compile};
use bimorph::equations::Joints;
use bimorph::gaps::Ramp;
use bimorph::multibody::planar::Pose;
use bimorph::multibody::relative::geometric::{Geometric, fill};
use bimorph::multibody::relative::kinematics::Placed;
use bimorph::multibody::relative::{JointMatrix, Parent, Tree, Unfit};
use bimorph::netlist::{Bundle, Setting};
use bimorph::solve::equilibrium::{Equilibrium, EquilibriumOptions};
use bimorph::solve::path::SourcePath;
use bimorph::solve::time::joint_rodas4::JointRodas4;
use bimorph::solve::time::method::{Method, Motion};
use nalgebra::{DMatrix, DVector, Matrix3};
use std::path::Path;
use std::sync::Arc;

/// Two arms between anchors and a yoke, bent by a beam across: trees, loops, a root of its own.
const FRAME: &str = "
anchor p1 [a] [l=10u w=10u]
anchor p1 [b] [l=10u w=10u]
anchor p1 [c] [l=10u w=10u]
beam2d p1 [a k] [l=90u w=2u oz=0.3]
beam2d p1 [k t] [l=60u w=3u oz=-0.2]
beam2d p1 [b t] [l=110u w=2u oz=2.1]
beam2d p1 [t s] [l=40u w=5u oz=1.2]
beam2d p1 [c s] [l=70u w=2u oz=-1.4]
";

/// Numbers between −0.5 and 0.5, the same in every run.
fn noise(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
}

/// Coordinates of some size: metres for displacements, radians for rotations.
fn coordinates(tree: &Tree, size: f64, seed: &mut u64) -> Vec<Pose> {
    let one = |_: &_| Pose::new(noise(seed) * size * 1e-6, noise(seed) * size * 1e-6, noise(seed) * size * 0.3);
    let mut q: Vec<Pose> = tree.links.iter().map(one).collect();
    tree.project(&mut q);
    q
}

fn framed() -> Compiled {
    model(FRAME, &CompileOptions { scheme: Scheme::Es, segments: Some(3), ..CompileOptions::default() })
}

/// Coordinates of the poses that coordinates lead to are those coordinates, and rates likewise, to rounding at rotations of
/// some tenths of a radian.
#[test]
fn poses_lead_back_to_coordinates() {
    let compiled = framed();
    let tree = Tree::elastic(&compiled.parts.system.model).unwrap();
    assert!(tree.links.iter().any(|l| matches!(l.parent, Parent::Body(_))) && !tree.closures.is_empty());
    let mut seed = 5;
    let (q, v) = (coordinates(&tree, 1.0, &mut seed), coordinates(&tree, 1e6, &mut seed));
    let zeros = vec![Pose::zeros(); q.len()];
    let mut placed = Placed::<f64>::new(&tree);
    placed.move_on(&tree, &q, &v, &zeros);
    let (mut x, mut rate, mut back) = (zeros.clone(), zeros.clone(), zeros.clone());
    placed.poses(&mut x);
    placed.rates(&mut rate);
    tree.coordinates_at(&x, &mut back);
    for (back, q) in back.iter().zip(&q) {
        let apart = back - q;
        assert!(apart.xy().amax() < 1e-18 && apart.z.abs() < 1e-13, "{apart}");
    }
    tree.rates_at(&x, &rate, &mut back);
    for (back, v) in back.iter().zip(&v) {
        let apart = back - v;
        assert!(apart.xy().amax() < 1e-10 && apart.z.abs() < 1e-7, "{apart}");
    }
}

/// Rates and accelerations of the bodies are the first and second derivatives of their poses along q + v·t + z·t²/2 (central
/// differences: 1e-7 of the largest rate, 1e-5 of the largest acceleration).
#[test]
fn motion_is_the_derivative_of_place() {
    let compiled = framed();
    let tree = Tree::elastic(&compiled.parts.system.model).unwrap();
    let mut seed = 11;
    let [q, v, z] = [1.0, 1.0, 1.0].map(|size| coordinates(&tree, size, &mut seed));
    let zeros = vec![Pose::zeros(); q.len()];
    let mut placed = Placed::<f64>::new(&tree);
    let mut at = |t: f64| {
        let q: Vec<Pose> = (0..q.len()).map(|j| q[j] + v[j] * t + z[j] * (0.5 * t * t)).collect();
        placed.put(&tree, &q);
        let mut x = zeros.clone();
        placed.poses(&mut x);
        x
    };
    let step = 1e-4;
    let (before, now, after) = (at(-step), at(0.0), at(step));
    let mut placed = Placed::<f64>::new(&tree);
    placed.move_on(&tree, &q, &v, &z);
    let (mut rate, mut push) = (zeros.clone(), zeros.clone());
    placed.rates(&mut rate);
    placed.accelerations(&mut push);
    let largest = |x: &[Pose]| x.iter().map(|x| x.xy().amax()).fold(0.0, f64::max);
    for j in 0..q.len() {
        let first = (after[j] - before[j]) / (2.0 * step) - rate[j];
        let second = (after[j] - now[j] * 2.0 + before[j]) / (step * step) - push[j];
        assert!(first.xy().amax() < 1e-7 * largest(&rate) && first.z.abs() < 1e-9, "{first}");
        assert!(second.xy().amax() < 1e-5 * largest(&push) && second.z.abs() < 1e-6, "{second}");
    }
}

/// Factor and solve agree with dense elimination of the same form over the coordinates (1e-9), bodies' right sides included;
/// the bodies' motions come with the solution.
#[test]
fn factor_agrees_with_dense_elimination() {
    let compiled = framed();
    let model = &compiled.parts.system.model;
    let tree = Tree::new(model, |k| [k % 3 == 0, false, false]);
    let (count, mut seed) = (tree.links.len(), 3);
    let q = coordinates(&tree, 1.0, &mut seed);
    let mut placed = Placed::<f64>::new(&tree);
    placed.put(&tree, &q);
    let mut form = JointMatrix::<f64>::new(&tree);
    let scale = Matrix3::from_diagonal(&nalgebra::Vector3::new(1.0, 1.0, 1e-6));
    for block in &mut form.bodies.diagonal {
        let raw = Matrix3::from_fn(|_, _| noise(&mut seed));
        *block = scale * (raw + raw.transpose() + Matrix3::identity() * 4.0) * scale;
    }
    for k in 0..form.bodies.below.len() {
        if !tree.pattern.is_fill(k) {
            form.bodies.below[k] = scale * Matrix3::from_fn(|_, _| 0.3 * noise(&mut seed)) * scale;
        }
    }
    // dense: columns of the map from coordinates to motions
    let mut free = Vec::new();
    for (j, link) in tree.links.iter().enumerate() {
        free.extend((0..3).filter(|&i| link.moving[i]).map(|i| (j, i)));
    }
    let zeros = vec![Pose::zeros(); count];
    let column = |&(j, i): &(usize, usize)| {
        let (mut s, mut out) = (zeros.clone(), zeros.clone());
        s[j][i] = 1.0;
        placed.spread(&tree, &s, &mut out);
        out
    };
    let columns: Vec<Vec<Pose>> = free.iter().map(column).collect();
    let product = |a: &[Pose], b: &[Pose]| a.iter().zip(b).map(|(a, b)| a.dot(b)).sum::<f64>();
    let mut dense = DMatrix::<f64>::zeros(free.len(), free.len());
    for c in 0..free.len() {
        let mut force = zeros.clone();
        form.bodies.multiply_add(&tree.pattern, &columns[c], &mut force);
        for r in 0..free.len() {
            dense[(r, c)] = product(&columns[r], &force);
            let ((jr, ir), (jc, ic)) = (free[r], free[c]);
            if jr == jc {
                dense[(r, c)] += 1e-6 * tree.links[jr].stiffness.column(ic)[ir];
            }
        }
    }
    let wrench: Vec<Pose> = (0..count).map(|_| scale * Pose::from_fn(|_, _| noise(&mut seed))).collect();
    let mut right: Vec<Pose> = (0..count).map(|_| scale * Pose::from_fn(|_, _| noise(&mut seed))).collect();
    tree.project(&mut right);
    let flat = DVector::from_iterator(
        free.len(),
        free.iter().zip(&columns).map(|(&(j, i), column)| right[j][i] + product(column, &wrench)),
    );
    // equal units, so that exchanges of rows cost no digits
    let unit = DVector::from_iterator(free.len(), (0..free.len()).map(|i| dense[(i, i)].sqrt().recip()));
    let scaled = DMatrix::from_fn(free.len(), free.len(), |r, c| unit[r] * dense[(r, c)] * unit[c]);
    let expected = scaled.lu().solve(&flat.component_mul(&unit)).unwrap().component_mul(&unit);
    form.factor(&tree, placed.maps(), 1e-6, None, Err).unwrap();
    let (mut motions, mut x) = (wrench, right);
    form.solve(&tree, &mut motions, &mut x);
    let reach = expected.amax();
    let spread = expected.component_div(&unit).amax();
    for (k, &(j, i)) in free.iter().enumerate() {
        assert!((x[j][i] - expected[k]).abs() < 1e-9 * spread * unit[k], "{j} {i}: {} {}", x[j][i], expected[k]);
    }
    let mut again = zeros.clone();
    placed.spread(&tree, &x, &mut again);
    for (a, b) in again.iter().zip(&motions) {
        assert!((a - b).amax() <= 1e-12 * reach, "{a} {b}");
    }
}

/// With the stiffness that forces bring the tangent over the coordinates is exact: Newton's method on a frame bent by 20 µN
/// doubles its digits, which it does not without, and ends where the bodies' own coordinates do (1e-9 of the displacement).
#[test]
fn newton_over_coordinates_is_quadratic() {
    let loaded = format!("{FRAME}\nf2d * [s] [F=20u oz=1.1]\n");
    let compiled =
        model(&loaded, &CompileOptions { scheme: Scheme::Es, segments: Some(3), ..CompileOptions::default() });
    let system = &compiled.parts.system;
    let Joints { tree, closures } = &Joints::elastic(system).unwrap();
    let count = system.bodies();
    let (zeros, mut drive) = (vec![Pose::zeros(); count], system.electrics.drive());
    drive.load = 1.0;
    let mut expected = zeros.clone();
    let nothing = vec![0.0; system.electrics.sources()];
    let path = SourcePath::new(&system.electrics, &nothing, &nothing, [0.0, 1.0]);
    Equilibrium::new(system, EquilibriumOptions::default()).follow(system, &path, &mut expected).unwrap();
    let reach = expected.iter().map(|x| x.xy().amax()).fold(0.0, f64::max);
    let run = |exact: bool| {
        let (mut q, mut poses, mut force, mut share) = (zeros.clone(), zeros.clone(), zeros.clone(), zeros.clone());
        let (mut placed, mut form) = (Placed::<f64>::new(tree), JointMatrix::<f64>::new(tree));
        let mut brought = vec![Geometric::ZERO; count];
        let mut errors = Vec::new();
        for _ in 0..9 {
            placed.put(tree, &q);
            placed.poses(&mut poses);
            let apart = poses.iter().zip(&expected).map(|(a, b)| (a - b).xy().amax()).fold(0.0, f64::max);
            errors.push(apart / reach);
            closures.tangent(&poses, &drive, &mut form.bodies, &mut force);
            placed.gather(tree, &mut force, &mut share);
            for ((share, link), q) in share.iter_mut().zip(&tree.links).zip(&q) {
                *share += link.stress(q, &drive.rest());
            }
            fill(tree, &placed, &q, &force, &mut brought);
            form.factor(tree, placed.maps(), 1.0, exact.then_some(&brought), Err).unwrap();
            form.solve(tree, &mut zeros.clone(), &mut share);
            for (q, share) in q.iter_mut().zip(&share) {
                *q -= share;
            }
        }
        errors
    };
    let (exact, without) = (run(true), run(false));
    assert!(exact[8] < 1e-9, "{exact:?}");
    let near = exact.iter().position(|e| *e < 1e-2).unwrap();
    assert!(exact[near + 1] < 3.0 * exact[near].powf(1.7), "{exact:?}");
    assert!(without[near + 2] > 10.0 * exact[near + 2], "{without:?} {exact:?}");
}

/// A loop of rigid joints and small displacements are refused with the reason.
#[test]
fn what_does_not_fit_is_told() {
    let linear = model(FRAME, &CompileOptions { linear: true, ..CompileOptions::default() });
    assert_eq!(Tree::elastic(&linear.parts.system.model).err(), Some(Unfit::Linear));
}

/// A scheme without rotary inertia that is asked for by name beside joint coordinates is refused with the way out; where none is
/// named, joint coordinates take es and bodies e4.
#[test]
fn a_scheme_without_rotary_inertia_is_refused() {
    let bundle = Bundle::from_text(
        "beam",
        "process p = [Youngsmodulus=165e9 density=2300 h=2u]\nanchor p [a] [l=5u w=5u]\nbeam2d p [a b] [l=100u w=2u]",
    );
    let compiled =
        |formulation, scheme| compile(&bundle, &CompileOptions { formulation, scheme, ..CompileOptions::default() });
    let Err(CompileError::Option(refused)) = compiled(Formulation::Rcr, Scheme::E4) else { panic!("not refused") };
    assert!(refused.option == "scheme" && refused.to_string().contains("es, which is taken"), "{refused}");
    for (formulation, scheme) in [(Formulation::Compliant, Scheme::E4), (Formulation::Rcr, Scheme::Es)] {
        assert_eq!(compiled(formulation, Scheme::Auto).map(|c| c.options.scheme), Ok(scheme));
    }
}

/// Rigid plates on flexure pivots, swung some 170 µm by a force: with joints that only turn (scheme a2), `auto` steps explicitly in
/// joint coordinates, and at 1e-2 ends nearer to a compliant run at 1e-6 than a compliant one at 1e-4 does, with a seventh of its
/// steps and of its evaluations. Where flexures are elastic in every direction it takes the bodies' own coordinates.
#[test]
fn plates_on_pivots_step_explicitly() {
    let bundle = Bundle::read(Path::new("examples/pivots/pivots.net"), &[]).unwrap();
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

fn scene(file: &str, formulation: Formulation, tol: f64, set: &[(&str, f64)]) -> Compiled {
    let bundle = Bundle::read(Path::new(file), &[]).unwrap();
    let set = set.iter().map(|&(n, v)| (n.to_owned(), Setting::Number(v))).collect();
    let options = CompileOptions { formulation, tol, set, scheme: Scheme::Es, ..CompileOptions::default() };
    compile(&bundle, &options).unwrap_or_else(|e| panic!("{file}: {e}"))
}

fn run(compiled: &Compiled, volts: &[(&str, f64)], stop: f64, signal: &str) -> TransientResult {
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

/// A cantilever let go from a micrometre, undamped, with 1, 4 and 12 segments and at three tolerances: the end is where the
/// bodies' own coordinates have it, within the tolerance, in as many steps within a fifth. Without rotary inertia (scheme E4)
/// the formulation is refused.
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
    assert!(matches!(Tree::elastic(&bare.parts.system.model), Err(Unfit::NoInertia { .. })));
}

/// On scenes as they are drawn, heated or loaded at once, both formulations move alike: within the tolerance of the larger
/// excursion, in as many steps within a tenth, with as many unknowns, no constraint and no singular evaluation.
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
    let rise = vec![0.0; electrics.heating.heaters.len()];
    let from = [1.0, 9.0];
    let shortest = 1e-10;
    let after = |to: [f64; 2]| {
        let before = Ramp::new(electrics, &[0.5, 3.0], &from, &rise, 3e-7);
        let mut method = JointRodas4::new(Arc::clone(&joints), shortest, &[0, 1]);
        let (mut motion, mut error) = (Motion::zeros(count), Motion::zeros(count));
        method.start(system, &before, &motion).unwrap();
        for k in 0..15 {
            method.step(system, &before, f64::from(k) * 2e-8, 2e-8, &mut motion, &mut error).unwrap();
        }
        // a moving start, from which the step that is differentiated goes on
        let rise: Vec<f64> = (0..rise.len()).map(|k| before.rise_at(k, 3e-7)).collect();
        let ramp = Ramp::new(electrics, &from, &to, &rise, 2e-8);
        method.forget_sensitivities();
        method.step(system, &ramp, 0.0, 2e-8, &mut motion, &mut error).unwrap();
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
