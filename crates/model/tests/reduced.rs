//! Reduced models in joint coordinates against the full model: statics of a quarter stage, a bank and a switch.

use bimorph_base::ErrorBudget;
use bimorph_base::Setting;
use bimorph_domains::Ramp;
use bimorph_domains::{Drive, Input, System};
use bimorph_model::compile::{CompileOptions, CompiledModel, Junctions, Scheme, draw};
use bimorph_multibody::planar::Pose;
use bimorph_netlist::{NetlistSource, read_bundle};
use bimorph_solve::equations::{Bodies, Motion};
use bimorph_solve::equilibrium::{Equilibrium, EquilibriumOptions};
use bimorph_solve::path::LoadPath;
use bimorph_solve::reduced::check::FullCheck;
use bimorph_solve::reduced::polynomial::statics::fitted;
use bimorph_solve::reduced::space::spanned;
use bimorph_solve::reduced::statics::ReducedStatics;
use bimorph_solve::reduced::taylor::DriveRay;
use bimorph_solve::reduced::{InputBox, ReducedForces, Training, TrainingCase, TrainingInput, TrainingOptions, train};
use bimorph_solve::time::adaptive::{Adaptive, Control};
use bimorph_solve::time::method::Method;
use bimorph_solve::time::reduced_rodas4::ReducedRodas4;
use bimorph_solve::time::rodas4::Rodas4;
use nalgebra::DMatrix;
use std::path::Path;
use std::sync::Arc;

/// A model of the examples, two segments a beam, beams that meet in points.
fn example(name: &str, set: &[(&str, f64)]) -> CompiledModel {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples").join(name);
    let bundle = read_bundle(&path, &[]).unwrap();
    let options = CompileOptions {
        junctions: Junctions::Centreline,
        segments: Some(2),
        scheme: Scheme::E4,
        set: set.iter().map(|(name, value)| ((*name).to_owned(), Setting::Number(*value))).collect(),
        ..CompileOptions::default()
    };
    draw(&NetlistSource::new(&bundle), &options).and_then(|drawn| drawn.compile()).unwrap_or_else(|e| panic!("{e}"))
}

/// The system with inputs for the forces along x and y at node `name`.
fn with_forces(compiled: &CompiledModel, name: &str) -> System {
    let at = compiled.structure.nodes.iter().position(|node| node.name == name).unwrap();
    let point = compiled.parts.nodes[at].unwrap();
    let mut system = compiled.parts.system.clone();
    let forces = [0, 1].map(|direction| Input::Force { point, direction });
    system.electrics = Arc::new(system.electrics.with_inputs(forces.to_vec()));
    system
}

/// The displacement of a node (m).
fn place(compiled: &CompiledModel, name: &str, q: &[Pose]) -> [f64; 2] {
    let at = compiled.structure.nodes.iter().position(|node| node.name == name).unwrap();
    let moved = compiled.parts.nodes[at].unwrap().displacement(q, false);
    [moved.x, moved.y]
}

/// The equilibrium of the full model under a drive.
fn full(system: &System, none: &Drive, drive: &Drive) -> Vec<Pose> {
    let mut q = vec![Pose::zeros(); system.bodies()];
    let mut solver = Equilibrium::new(system, EquilibriumOptions::default());
    solver.follow(system, &DriveRay { none, to: drive }, &mut q).unwrap_or_else(|e| panic!("{e}"));
    q
}

/// Two forces of up to `newtons` at the plate of the quarter stage.
fn stage(newtons: f64) -> (CompiledModel, System, InputBox) {
    let compiled = example("quarter_stage/quarter_stage.net", &[]);
    let system = with_forces(&compiled, "c");
    let none = Drive { load: 0.0, ..system.electrics.drive() };
    let force = |k: usize| {
        let mut unit = none.clone();
        unit.inputs[k] = newtons;
        TrainingInput { unit, range: [-1.0, 1.0] }
    };
    let inputs = InputBox { none: none.clone(), inputs: vec![force(0), force(1)] };
    (compiled, system, inputs)
}

fn trained(system: &System, inputs: &InputBox, tol: f64) -> Training {
    trained_with(system, inputs, TrainingOptions { errors: ErrorBudget::of(tol), moments: 0, beyond: false })
}

fn trained_with(system: &System, inputs: &InputBox, options: TrainingOptions) -> Training {
    let case = TrainingCase { system, inputs: inputs.clone(), motions: &[] };
    train(&spanned(system).unwrap(), &[case], options).unwrap_or_else(|e| panic!("{e}"))
}

fn largest(x: &[f64]) -> f64 {
    x.iter().fold(0.0, |a: f64, b| a.max(b.abs()))
}

/// Forces over z are the derivative of their potential's gradient: the tangent against central differences of the forces at a bent and
/// heated state, to 1e-7 of its largest entry; and it is symmetric.
#[test]
fn tangent_is_the_derivative_of_the_forces() {
    let (_, system, mut inputs) = stage(50e-6);
    let mut unit = inputs.none.clone();
    unit.expansion.iter_mut().enumerate().for_each(|(k, x)| *x = 1e-4 * (k as f64 + 1.0));
    inputs.inputs.push(TrainingInput { unit, range: [0.0, 1.0] });
    let space = trained(&system, &inputs, 1e-3).space;
    let m = space.size();
    let drive = inputs.drive(&[0.7, -0.4, 0.8]);
    let mut forces = ReducedForces::new(&space);
    let mut z: Vec<f64> =
        space.reach.iter().enumerate().map(|(k, reach)| 0.3 * reach * (1.3 * k as f64).cos()).collect();
    let (mut r, mut k) = (vec![0.0; m], DMatrix::zeros(m, m));
    forces.tangent(&space, &z, &drive, &mut r, &mut k);
    let scale = k.amax();
    assert!((&k - k.transpose()).amax() <= 1e-12 * scale);
    for j in 0..m {
        let step = 1e-4 * space.reach[j].max(1e-3 * largest(&space.reach));
        let at = z[j];
        let mut side = [vec![0.0; m], vec![0.0; m]];
        for (sign, side) in [-1.0, 1.0].into_iter().zip(&mut side) {
            z[j] = at + sign * step;
            forces.residual(&space, &z, &drive, side);
        }
        z[j] = at;
        for i in 0..m {
            let difference = (side[1][i] - side[0][i]) / (2.0 * step);
            assert!((difference - k[(i, j)]).abs() <= 1e-7 * scale, "{i} {j}: {difference:e} {:e}", k[(i, j)]);
        }
    }
}

/// Statics of the quarter stage under forces of 50 to 95 µN in six directions, trained to 100 µN. A dense study of the same model
/// (independent computation) has errors of 9.7e-4, 1.6e-4 and 2.5e-5 with 6, 8 and 10 directions of this kind; what the tolerance takes
/// is within a third of it. The estimate by one Newton step is the error to 30 % (the study has ratios of 0.9 to 1.06 on this stage, 0.43 to
/// 1.07 on random frames).
#[test]
fn statics_of_a_quarter_stage() {
    let (compiled, system, inputs) = stage(100e-6);
    let mut sizes = Vec::new();
    for tol in [1e-2, 1e-3, 1e-4] {
        let trained = trained(&system, &inputs, tol);
        let space = &trained.space;
        let (mut statics, mut check) = (ReducedStatics::new(space), FullCheck::new(&system));
        let mut worst = 0.0f64;
        for k in 0..6 {
            let (angle, share) = (f64::from(k) * 1.05 + 0.2, 0.5 + 0.09 * f64::from(k));
            let drive = inputs.drive(&[share * angle.cos(), share * angle.sin()]);
            let mut z = vec![0.0; space.size()];
            let path = statics.follow(space, &DriveRay { none: &inputs.none, to: &drive }, &mut z);
            assert_eq!(path.reached, 1.0);
            assert!(space.excess(&z) < 1.1, "{}", space.excess(&z));
            let exact = full(&system, &inputs.none, &drive);
            let [x, y] = place(&compiled, "c", &statics.forces.placed.at);
            let [ex, ey] = place(&compiled, "c", &exact);
            let error = (x - ex).hypot(y - ey) / ex.hypot(ey);
            worst = worst.max(error);
            let found = check.of(&system, &statics.forces.placed.at, &drive, None);
            let at = |q: &[Pose]| place(&compiled, "c", q);
            let moved: Vec<Pose> =
                statics.forces.placed.at.iter().zip(check.step()).map(|(q, step)| q + step).collect();
            let [sx, sy] = at(&moved);
            let estimate = (sx - x).hypot(sy - y) / ex.hypot(ey);
            assert_eq!(found.negative, 0);
            if error > 1e-6 {
                assert!((estimate / error - 1.0).abs() < 0.3, "{estimate:e} {error:e}");
            }
        }
        println!(
            "quarter stage, tol {tol:e}: {} directions ({} added), error {worst:.1e}, estimate in the box {:.1e}",
            space.size(),
            trained.added,
            trained.error
        );
        assert!(worst <= 0.34 * tol, "{worst:e}");
        sizes.push(space.size());
    }
    // a fifth of the strains are 37; corners of the box are at 141 µN
    assert!(sizes[0] <= 12 && sizes[1] <= 18 && sizes[2] <= 20, "{sizes:?}");
}

/// The plate of the quarter stage under 100 µN along x moves by 8.495 and 1.056 µm, as `bimorph static -s F=100u --junctions centreline
/// --segments 2 --scheme e4` prints, and as a dense study found.
#[test]
fn the_quarter_stage_is_that_of_the_study() {
    let (compiled, system, inputs) = stage(100e-6);
    let [x, y] = place(&compiled, "c", &full(&system, &inputs.none, &inputs.drive(&[1.0, 0.0])));
    assert!((x * 1e6 - 8.495).abs() < 1e-3 && (y.abs() * 1e6 - 1.056).abs() < 1e-3, "{x:e} {y:e}");
}

/// The bank under heat of up to 400 K on its hot arms: the study has 2.3e-5 with two directions of the Taylor expansion's span.
#[test]
fn statics_of_a_bank() {
    let compiled = example("bank/bank.net", &[]);
    let system = &compiled.parts.system;
    let none = Drive { load: 0.0, ..system.electrics.drive() };
    let mut unit = none.clone();
    let hot = system.electrics.heating.heaters.iter().zip(&mut unit.expansion);
    hot.for_each(|(heater, x)| *x = 400.0 * heater.expansion);
    let inputs = InputBox { none: none.clone(), inputs: vec![TrainingInput { unit, range: [0.0, 1.0] }] };
    for (tol, most) in [(1e-2, 2), (1e-3, 3), (1e-4, 4)] {
        let trained = trained(system, &inputs, tol);
        let mut statics = ReducedStatics::new(&trained.space);
        let mut worst = 0.0f64;
        for share in [0.3, 0.6, 1.0] {
            let drive = inputs.drive(&[share]);
            let mut z = vec![0.0; trained.space.size()];
            let path = statics.follow(&trained.space, &DriveRay { none: &none, to: &drive }, &mut z);
            assert_eq!(path.reached, 1.0);
            let exact = place(&compiled, "yoke", &full(system, &none, &drive));
            let [x, y] = place(&compiled, "yoke", &statics.forces.placed.at);
            worst = worst.max((x - exact[0]).hypot(y - exact[1]) / exact[0].hypot(exact[1]));
        }
        println!("bank, tol {tol:e}: {} directions, error {worst:.1e}", trained.space.size());
        assert!(worst <= 0.34 * tol && trained.space.size() <= most);
    }
}

/// The switch with its voltage from 0 to so many volts.
fn switch(most: f64) -> (CompiledModel, InputBox) {
    let compiled = example("switch/switch.net", &[]);
    let electrics = &compiled.parts.system.electrics;
    let none = Drive { load: 0.0, ..electrics.drive() };
    let mut unit = none.clone();
    electrics.apply(&[most], &[], &mut unit);
    let inputs = InputBox { none, inputs: vec![TrainingInput { unit, range: [0.0, 1.0] }] };
    (compiled, inputs)
}

/// Polynomials of a switch up to 20 V have the closed states of the full model down to its release at 11.2 V (ANSYS VM236: 11.21 V), to the
/// tolerance of 1e-3, where the space is trained for them. They miss them by 1e-2 where it has the states of a rising voltage alone.
#[test]
fn closed_states_of_a_switch() {
    let (compiled, inputs) = switch(20.0);
    let system = &compiled.parts.system;
    let [with, without] = [true, false].map(|beyond| {
        let options = TrainingOptions { errors: ErrorBudget::of(1e-3), moments: 0, beyond };
        let space = trained_with(system, &inputs, options).space;
        let found = fitted(&space, system, &inputs, &[], (1e-3, &[]));
        println!("beyond pull-in {beyond}: {} directions, {} states, {:?}", space.size(), found.compared, found.errors);
        (found.error, found.compared)
    });
    assert!(with.0 <= 1e-3 && without.0 > 2e-3, "{with:?} {without:?}");
    // 17 states of a rising voltage, and the closed ones above release
    assert!(with.1 >= 24 && with.1 == without.1, "{with:?} {without:?}");
}

/// The switch under voltage, with the exact law of its gaps on every body: four Taylor directions in V² have pull-in within 5e-4 of the
/// full model's, and the displacement below pull-in within a third of the tolerance. The study finds 17.84 V with three or four.
#[test]
fn pull_in_of_a_switch() {
    let compiled = example("switch/switch.net", &[]);
    let system = &compiled.parts.system;
    let none = Drive { load: 0.0, ..system.electrics.drive() };
    let volts = |v: f64| {
        let mut drive = none.clone();
        let sources: Vec<f64> = (0..system.electrics.sources()).map(|s| if s == 0 { v } else { 0.0 }).collect();
        system.electrics.apply(&sources, &[], &mut drive);
        drive
    };
    let mut inputs =
        InputBox { none: none.clone(), inputs: vec![TrainingInput { unit: volts(17.0), range: [0.0, 1.0] }] };
    let trained = trained(system, &inputs, 1e-3);
    let mut statics = ReducedStatics::new(&trained.space);
    println!("switch: {} directions, estimate {:.1e}", trained.space.size(), trained.error);
    assert!(trained.space.size() <= 5);
    for v in [8.0, 14.0, 17.0] {
        let drive = volts(v);
        let mut z = vec![0.0; trained.space.size()];
        assert_eq!(statics.follow(&trained.space, &DriveRay { none: &none, to: &drive }, &mut z).reached, 1.0);
        let (exact, found) = (full(system, &none, &drive), &statics.forces.placed.at);
        let [y, ey] = [found, &exact].map(|q| place(&compiled, "a(8)", q)[1]);
        println!("  {v} V: {y:e} {ey:e} {:.1e}", y / ey - 1.0);
        assert!((y / ey - 1.0).abs() < 1e-3);
    }
    inputs.inputs[0].unit = volts(25.0);
    let path = DriveRay { none: &none, to: &inputs.inputs[0].unit };
    let mut z = vec![0.0; trained.space.size()];
    let reduced = 25.0 * statics.follow(&trained.space, &path, &mut z).reached.sqrt();
    let mut q = vec![Pose::zeros(); system.bodies()];
    let mut solver = Equilibrium::new(system, EquilibriumOptions { stop_at_fold: true, ..Default::default() });
    let exact = 25.0 * solver.follow(system, &path, &mut q).unwrap().reached.sqrt();
    println!("  pull-in {reduced} {exact}");
    assert!((reduced / exact - 1.0).abs() < 1e-3, "{reduced} {exact}");
}

/// The path of an equilibrium is the ray of the drive.
#[test]
fn a_ray_has_the_slope_of_its_drive() {
    let (_, system, inputs) = stage(1e-6);
    let to = inputs.drive(&[0.3, 0.4]);
    let ray = DriveRay { none: &inputs.none, to: &to };
    let (mut at, mut slope) = (system.electrics.drive(), system.electrics.drive());
    ray.at(0.5, &mut at);
    ray.slope(0.5, &mut slope);
    for ((at, slope), to) in at.inputs.iter().zip(&slope.inputs).zip(&to.inputs) {
        assert!((at - 0.5 * to).abs() <= 1e-15 * to.abs() && slope == to);
    }
}

/// Places of node `name` after each step of a run from `q` to `stop` (s), and the steps taken.
fn run<'a, M: Method<Bodies<'a>>>(
    (compiled, system, name): (&CompiledModel, &'a System, &str),
    ramp: &'a Ramp<'a>,
    method: M,
    q: &[Pose],
    control: Control,
) -> (Vec<[f64; 2]>, u64) {
    let mut motion = Motion::zeros(q.len());
    motion.q.copy_from_slice(q);
    let mut places = Vec::new();
    let mut stepper = Adaptive::new(q.len(), method);
    let mut h = 1e-9;
    let mut see = |_: f64, _: f64, _: &Motion, after: &Motion| {
        places.push(place(compiled, name, &after.q));
        true
    };
    let mut bodies = Bodies::new(system, ramp);
    stepper.advance(&mut bodies, &mut motion, &mut h, control, usize::MAX, &mut see).unwrap_or_else(|e| panic!("{e}"));
    let steps = stepper.work().steps;
    (places, steps)
}

/// Root mean square distance of two courses, over the largest distance from rest.
fn apart(one: &[[f64; 2]], other: &[[f64; 2]]) -> f64 {
    let squares: f64 = one.iter().zip(other).map(|(a, b)| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)).sum();
    (squares / one.len() as f64).sqrt() / other.iter().map(|b| b[0].hypot(b[1])).fold(0.0, f64::max)
}

/// The quarter stage released from 20 µN, 30 µs in equal steps of 10 ns, in which reduction alone makes a difference. The study has 3.2e-3
/// and 4.1e-3 with directions of the statics and the first moments of each input (undamped).
#[test]
fn the_quarter_stage_in_time() {
    let (compiled, system, inputs) = stage(20e-6);
    let sources = vec![0.0; system.electrics.sources()];
    let rise = vec![0.0; system.electrics.heating.states()];
    let ramp = Ramp::new(&system.electrics, &sources, &sources, &rise, 30e-6);
    let begun = full(&system, &inputs.none, &inputs.drive(&[0.6, 0.8]));
    let about = (&compiled, &system, "c");
    let equal = Control::Fixed(10e-9);
    let (exact, _) = run(about, &ramp, Rodas4::new(&system, &[]), &begun, equal);
    let (_, adaptive) = run(about, &ramp, Rodas4::new(&system, &[]), &begun, Control::Tolerance(1e-3));
    println!("quarter stage in time: bodies {adaptive} adaptive steps");
    let (tol, moments, most) = (1e-2, 2, 6e-3);
    let trained =
        trained_with(&system, &inputs, TrainingOptions { errors: ErrorBudget::of(tol), moments, beyond: false });
    let space = Arc::new(trained.space);
    let method = || ReducedRodas4::new(Arc::clone(&space), 1e-9);
    // each model is released from its own equilibrium
    let (mut statics, mut z) = (ReducedStatics::new(&space), vec![0.0; space.size()]);
    let to = inputs.drive(&[0.6, 0.8]);
    assert_eq!(statics.follow(&space, &DriveRay { none: &inputs.none, to: &to }, &mut z).reached, 1.0);
    let q = &statics.forces.placed.at;
    let (reduced, _) = run(about, &ramp, method(), q, equal);
    let (_, adaptive) = run(about, &ramp, method(), q, Control::Tolerance(1e-3));
    let error = apart(&reduced, &exact);
    println!("  {} directions: error {error:.1e}; {adaptive} adaptive steps", space.size());
    let coarse = Control::Fixed(50e-9);
    let (one, _) = run(about, &ramp, Rodas4::new(&system, &[]), &begun, coarse);
    let (two, _) = run(about, &ramp, method(), q, coarse);
    let every = |x: &[[f64; 2]]| x.iter().skip(4).step_by(5).copied().collect::<Vec<_>>();
    println!("    50 ns: bodies {:.1e}, reduced {:.1e}", apart(&one, &every(&exact)), apart(&two, &every(&reduced)));
    assert!(error < most, "{error:e}");
}
