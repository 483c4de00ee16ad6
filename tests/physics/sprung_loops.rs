//! Relative joint coordinates whose loops close by springs, against the bodies' own coordinates, dense algebra and
//! differences.

use crate::model;
use bimorph::analysis::mesh::modes_fitted;
use bimorph::compile::{CompileError, CompileOptions, CompiledModel, Formulation, Scheme, compile};
use bimorph::equations::Joints;
use bimorph::multibody::joint_coordinates::TreeParent;
use bimorph::multibody::joint_coordinates::sprung_loops::columns::Four;
use bimorph::multibody::joint_coordinates::sprung_loops::dynamics::Stresses;
use bimorph::multibody::joint_coordinates::sprung_loops::geometric::{Geometric, fill};
use bimorph::multibody::joint_coordinates::sprung_loops::poses::{LaneJointStates, TreeKinematics};
use bimorph::multibody::joint_coordinates::sprung_loops::{JointMatrix, Tree, UnsupportedModel};
use bimorph::multibody::planar::Pose;
use bimorph::netlist::{Bundle, read_bundle};
use bimorph::solve::equilibrium::{Equilibrium, EquilibriumOptions};
use bimorph::solve::path::SourcePath;
use nalgebra::{DMatrix, DVector, Matrix3};
use std::path::Path;

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

fn framed() -> CompiledModel {
    model(FRAME, &CompileOptions { scheme: Scheme::Es, segments: Some(3), ..CompileOptions::default() })
}

/// Coordinates of the poses that coordinates lead to are those coordinates, and rates likewise, to rounding at rotations of
/// some tenths of a radian.
#[test]
fn poses_lead_back_to_coordinates() {
    let compiled = framed();
    let tree = Tree::elastic(&compiled.parts.system.model).unwrap();
    assert!(tree.links.iter().any(|l| matches!(l.parent, TreeParent::Body(_))) && !tree.closures.is_empty());
    let mut seed = 5;
    let (q, v) = (coordinates(&tree, 1.0, &mut seed), coordinates(&tree, 1e6, &mut seed));
    let zeros = vec![Pose::zeros(); q.len()];
    let mut placed = TreeKinematics::new(&tree);
    placed.place(&tree, &LaneJointStates::tiles(&q, &v, &zeros));
    let (x, rate, mut back) = (placed.at.clone(), placed.rate.clone(), zeros);
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
    let mut placed = TreeKinematics::new(&tree);
    let mut at = |t: f64| {
        let q: Vec<Pose> = (0..q.len()).map(|j| q[j] + v[j] * t + z[j] * (0.5 * t * t)).collect();
        placed.place(&tree, &LaneJointStates::at_rest(&q));
        placed.at.clone()
    };
    let step = 1e-4;
    let (before, now, after) = (at(-step), at(0.0), at(step));
    let mut placed = TreeKinematics::new(&tree);
    placed.place(&tree, &LaneJointStates::tiles(&q, &v, &z));
    let (rate, push) = (&placed.rate, &placed.acceleration);
    let largest = |x: &[Pose]| x.iter().map(|x| x.xy().amax()).fold(0.0, f64::max);
    for j in 0..q.len() {
        let first = (after[j] - before[j]) / (2.0 * step) - rate[j];
        let second = (after[j] - now[j] * 2.0 + before[j]) / (step * step) - push[j];
        assert!(first.xy().amax() < 1e-7 * largest(rate) && first.z.abs() < 1e-9, "{first}");
        assert!(second.xy().amax() < 1e-5 * largest(push) && second.z.abs() < 1e-6, "{second}");
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
    let mut placed = TreeKinematics::new(&tree);
    placed.place(&tree, &LaneJointStates::at_rest(&q));
    let mut form = JointMatrix::new(&tree);
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
    form.factor(&tree, &placed, 1e-6, None).unwrap();
    let fours = |from: Vec<Pose>| from.into_iter().chain([Pose::zeros()]).map(Four::from).collect::<Vec<_>>();
    let (mut motions, mut x) = (fours(wrench), fours(right));
    form.solve(&mut motions, &mut x);
    let poses = |from: &[Four]| from[..count].iter().map(Four::pose).collect::<Vec<_>>();
    let (motions, x) = (poses(&motions), poses(&x));
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

/// With geometric stiffness the tangent over the coordinates is exact. Newton's method on a frame bent by 20 µN
/// converges quadratically, which it does not without. It ends where the bodies' own coordinates do (1e-9 of the
/// displacement).
#[test]
fn newton_over_coordinates_is_quadratic() {
    let loaded = format!("{FRAME}\nf2d * [s] [F=20u oz=1.1]\n");
    let compiled =
        model(&loaded, &CompileOptions { scheme: Scheme::Es, segments: Some(3), ..CompileOptions::default() });
    let system = &compiled.parts.system;
    let Joints { tree, closures, .. } = &Joints::elastic(system).unwrap();
    let count = system.bodies();
    let (zeros, mut drive) = (vec![Pose::zeros(); count], system.electrics.drive());
    drive.load = 1.0;
    let mut expected = zeros.clone();
    let nothing = vec![0.0; system.electrics.sources()];
    let path = SourcePath::new(&system.electrics, &nothing, &nothing, [0.0, 1.0]);
    Equilibrium::new(system, EquilibriumOptions::default()).follow(system, &path, &mut expected).unwrap();
    let reach = expected.iter().map(|x| x.xy().amax()).fold(0.0, f64::max);
    let run = |exact: bool| {
        let (mut q, mut force, mut change) = (zeros.clone(), zeros.clone(), vec![Four::ZERO; count]);
        let (mut placed, mut stresses, mut form) =
            (TreeKinematics::new(tree), Stresses::new(tree), JointMatrix::new(tree));
        let mut brought = vec![Geometric::ZERO; count];
        let mut errors = Vec::new();
        for _ in 0..9 {
            placed.place(tree, &LaneJointStates::at_rest(&q));
            let apart = placed.at.iter().zip(&expected).map(|(a, b)| (a - b).xy().amax()).fold(0.0, f64::max);
            errors.push(apart / reach);
            closures.tangent(&placed.at, &drive, &mut form.bodies, &mut force);
            stresses.fill(tree, &LaneJointStates::at_rest(&q), &drive.rest());
            placed.resist(tree, &stresses, &mut force, &mut change);
            fill(tree, &placed, |j| q[j], &force, &mut brought);
            form.factor(tree, &placed, 1.0, exact.then_some(&brought)).unwrap();
            form.solve(&mut vec![Four::ZERO; count + 1], &mut change);
            for (q, change) in q.iter_mut().zip(&change) {
                *q += change.pose();
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
fn what_does_not_fit_is_reported() {
    let linear = model(FRAME, &CompileOptions { linear: true, ..CompileOptions::default() });
    assert_eq!(Tree::elastic(&linear.parts.system.model).err(), Some(UnsupportedModel::Linear));
}

/// A scheme without rotary inertia, given by name with joint coordinates, is rejected with a remedy; by default joint
/// coordinates use es and bodies e4.
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

/// At calibrated junctions Es has no estimate of its own, and its mesh follows the tolerance all the same. It has at
/// most 1.4 times the unknowns of E4, and the lowest frequency of the quarter stage (72,404 Hz; `--segments 32`) is
/// within it. (It had eight times as many.)
#[test]
fn es_takes_as_many_segments_as_the_tolerance_wants() {
    let bundle = read_bundle(Path::new("examples/quarter_stage/quarter_stage.net"), &[]).unwrap();
    for tol in [1e-2, 1e-3] {
        let [e4, es] = [Scheme::E4, Scheme::Es].map(|scheme| {
            let compiled = compile(&bundle, &CompileOptions { scheme, tol, ..CompileOptions::default() }).unwrap();
            let (fitted, found, _) = modes_fitted(&compiled, 3, &[]).unwrap();
            assert!((found.frequencies_hz[0] / 72_404.0 - 1.0).abs() <= tol, "{scheme:?} {tol}");
            fitted.parts.system.model.unknowns()
        });
        assert!(10 * es <= 14 * e4, "{tol}: {es} for {e4}");
    }
}
