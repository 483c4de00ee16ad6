//! Steps, work and time of both formulations on the example models as drawn, one line each, in one run:
//! `scene,formulation,tol,bodies,coordinates,loops,steps,rejected,ms,deviation`.
//!
//!     taskset -c 0 cargo run --release --no-default-features --example formulations
//!
//! `deviation` is the largest distance of the bodies from a compliant run at a hundredth of the tolerance, at the end, as a
//! share of the largest displacement. Wall-clock time, the least of nine runs, both formulations in turn; scheme Es in both.
//!
//! `rcr, stiff along for SHARE`: joints that hold no more than that of the strain energy along their axes, all together, are rigid there.
//!
//! Then plates on flexure pivots, joints that only turn (scheme a2): whole runs, explicit in joint coordinates, and the
//! distance of the end of the row from a compliant run at 1e-7 in the same joints. The last lines are compliant with
//! joints elastic in every direction (e4): their difference from joints that only rotate is part of their deviation.

use bimorph::analysis::integrator::Integrator;
use bimorph::analysis::transient::{TransientOptions, transient};
use bimorph::compile::{CompileOptions, Formulation, Scheme, compile};
use bimorph::domains::{Drive, Ramp, System};
use bimorph::equations::{Bodies, Joints};
use bimorph::multibody::joint_coordinates::sprung_loops::Tree;
use bimorph::multibody::planar::Pose;
use bimorph::multibody::{BodyId, BodyMatrix};
use bimorph::netlist::{Setting, read_bundle};
use bimorph::solve::equilibrium::{Equilibrium, EquilibriumOptions};
use bimorph::solve::frequency::eigen::lowest_modes;
use bimorph::solve::path::SourcePath;
use bimorph::solve::time::adaptive::{Adaptive, Control};
use bimorph::solve::time::joint_rodas4::JointRodas4;
use bimorph::solve::time::method::{Method, Motion, SolverCounters};
use bimorph::solve::time::rodas4::Rodas4;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// A model: file, parameters, parameters of the start, port voltages, duration (s).
type Scene<'a> = (&'a str, &'a [(&'a str, f64)], &'a [(&'a str, f64)], &'a [f64], f64);

fn main() {
    let scenes: [Scene<'_>; 4] = [
        ("examples/bank/bank.net", &[], &[], &[1.0, 0.0], 5e-6),
        ("examples/quarter_stage/quarter_stage.net", &[], &[("F", 20e-6)], &[], 10e-6),
        ("examples/rotary_stage/rotary_stage.net", &[], &[], &[1.0], 20e-6),
        ("examples/comb_resonator/comb_resonator.net", &[], &[], &[5.0, 5.0, 0.0, 0.0], 20e-6),
    ];
    println!("scene,formulation,tol,bodies,coordinates,loops,steps,rejected,ms,deviation");
    for scene in &scenes {
        for tol in [1e-2, 1e-3, 1e-4] {
            measure(scene, tol);
        }
    }
    let tight = pivots("", Formulation::Compliant, Scheme::A2, 1e-7, 1, [0.0; 2]);
    for tol in [1e-2, 1e-3, 1e-4] {
        pivots("compliant (a2)", Formulation::Compliant, Scheme::A2, tol, 5, tight);
        pivots("rcr rk45 (a2)", Formulation::Rcr, Scheme::A2, tol, 5, tight);
        pivots("compliant (e4)", Formulation::Compliant, Scheme::E4, tol, 5, tight);
    }
}

/// A run of the row of plates; returns where its end is, and prints a line unless `label` is empty.
fn pivots(label: &str, formulation: Formulation, scheme: Scheme, tol: f64, times: usize, end: [f64; 2]) -> [f64; 2] {
    let bundle = read_bundle(Path::new("examples/pivots/pivots.net"), &[]).unwrap();
    let options =
        CompileOptions { tol, formulation, scheme, undamped: true, segments: Some(1), ..CompileOptions::default() };
    let compiled = compile(&bundle, &options).unwrap();
    let method = if formulation == Formulation::Rcr { Integrator::Rk45 } else { Integrator::Rodas4 };
    let options = TransientOptions {
        stop: 300e-6,
        signals: vec!["plate(8).x".into(), "plate(8).y".into()],
        points: 2,
        tol,
        method,
        ..TransientOptions::default()
    };
    let (mut best, mut last) = (f64::INFINITY, None);
    for _ in 0..times {
        let begin = Instant::now();
        let result = transient(&compiled, &options, &mut |_, _| (), &mut |_| true).unwrap();
        best = best.min(begin.elapsed().as_secs_f64() * 1e3);
        last = Some(result);
    }
    let result = last.unwrap();
    let at = [0, 1].map(|k| *result.signals[k].2.last().unwrap());
    if !label.is_empty() {
        let deviation = (at[0] - end[0]).hypot(at[1] - end[1]) / end[0].hypot(end[1]);
        let c = result.counters;
        println!(
            "pivots,{label},{tol:e},{},{},0,{},{},{best:.3},{deviation:.2e}",
            compiled.parts.system.bodies(),
            result.unknowns,
            c.steps,
            c.rejected
        );
    }
    at
}

fn measure((file, set, start, volts, stop): &Scene<'_>, tol: f64) {
    let build = |extra: &[(&str, f64)]| {
        let bundle = read_bundle(Path::new(file), &[]).unwrap();
        let named = |&(n, v): &(&str, f64)| (n.to_owned(), Setting::Number(v));
        let set = set.iter().chain(extra).map(named).collect();
        compile(&bundle, &CompileOptions { tol, set, scheme: Scheme::Es, ..CompileOptions::default() }).unwrap()
    };
    let compiled = build(&[]);
    let system = &compiled.parts.system;
    let electrics = &system.electrics;
    let mut sources = vec![0.0; electrics.sources()];
    for (to, from) in sources.iter_mut().zip(*volts) {
        *to = *from;
    }
    let mut at = Motion::zeros(system.bodies());
    if !start.is_empty() {
        let start = build(start);
        let zeros = vec![0.0; sources.len()];
        let path = SourcePath::new(&start.parts.system.electrics, &zeros, &zeros, [0.0, 1.0]);
        Equilibrium::new(&start.parts.system, EquilibriumOptions::default())
            .follow(&start.parts.system, &path, &mut at.q)
            .unwrap();
    }
    let rise = vec![0.0; electrics.heating.heaters.len()];
    let ramp = Ramp::new(electrics, &sources, &sources, &rise, *stop);
    let first = bimorph::analysis::transient::first_step(system, *stop);
    let equations = Arc::new(Joints::elastic(system).unwrap());
    let tree = &equations.tree;
    let (bodies, loops, n) = (system.bodies(), tree.closures.len(), tree.coordinates);
    let name = file.split('/').nth(1).unwrap_or(file);
    let fine = run(system, &ramp, &at, first, tol * 1e-2, || Rodas4::new(system, &[])).0;
    let print = |formulation: &str, coordinates: usize, (end, work, ms): (Motion, SolverCounters, f64)| {
        let reach = largest(&fine.q, &vec![Pose::zeros(); bodies]);
        let deviation = largest(&end.q, &fine.q) / reach;
        println!(
            "{name},{formulation},{tol:e},{bodies},{coordinates},{loops},{},{},{ms:.3},{deviation:.2e}",
            work.steps, work.rejected
        );
    };
    let joints = || JointRodas4::new(Arc::clone(&equations), first, &[]);
    let mut best = [None, None];
    for _ in 0..9 {
        // in turn, so that what else the machine does comes to both
        let now = [
            run(system, &ramp, &at, first, tol, || Rodas4::new(system, &[])),
            run(system, &ramp, &at, first, tol, joints),
        ];
        for (best, now) in best.iter_mut().zip(now) {
            if best.as_ref().is_none_or(|(_, _, ms)| now.2 < *ms) {
                *best = Some(now);
            }
        }
    }
    let [bodies_run, joints_run] = best.map(Option::unwrap);
    print("compliant", system.model.unknowns(), bodies_run);
    print("rcr", n, joints_run);
    let cases = energies(system, &[&at.q, &fine.q], &ramp, *stop);
    for share in [1e-2, 1e-3] {
        let locked = stiff_along(&cases, share);
        let tree = Tree::new(&system.model, |k| [locked[k], false, false]);
        let coordinates = tree.coordinates;
        let locked = Arc::new(Joints::new(system, tree));
        let run = || run(system, &ramp, &at, first, tol, || JointRodas4::new(Arc::clone(&locked), first, &[]));
        let best = (0..9).map(|_| run()).min_by(|a, b| a.2.total_cmp(&b.2)).unwrap();
        print(&format!("rcr, stiff along for {share:e}"), coordinates, best);
    }
}

/// Share of the joints' strain energy that each one has along its axis, at some states of a run and in its six lowest modes.
fn energies(system: &System, states: &[&Vec<Pose>], ramp: &Ramp<'_>, stop: f64) -> Vec<Vec<f64>> {
    let model = &system.model;
    let (rest, mut hot) = (system.electrics.drive(), system.electrics.drive());
    ramp.at(stop, &mut hot);
    let mut stiffness = BodyMatrix::new(&model.pattern);
    let still = vec![Pose::zeros(); system.bodies()];
    system.tangent(&still, &rest, &mut stiffness, &mut still.clone());
    let modes = lowest_modes(system, (&still, &rest), &stiffness, 6).unwrap().shapes;
    // small enough to be linear
    let small = |shape: &Vec<Pose>| {
        let size = 1e-9 / shape.iter().map(|x| x.xy().amax()).fold(0.0, f64::max);
        shape.iter().map(|x| x * size).collect::<Vec<_>>()
    };
    let modes = modes.iter().map(|shape| (small(shape), &rest));
    let cases = states.iter().map(|q| ((*q).clone(), &hot)).chain(modes);
    let shares = |(q, drive): (Vec<Pose>, &Drive)| {
        let pose = |id| match id {
            BodyId::Free(k) => q[k],
            BodyId::Ground => Pose::zeros(),
        };
        let energy = |k: usize| {
            let joint = model.joint(k);
            let second = [joint.second[(0, 0)], joint.second[(0, 1)], joint.second[(1, 1)]];
            let mut e = nalgebra::Vector3::from(joint.frame.kinematics(&pose(joint.a), &pose(joint.b), &second).strain);
            e.x -= joint.expansion.map_or(0.0, |(group, length)| length * drive.expansion[group]);
            let stress = joint.stiffness * e;
            [stress.x * e.x, stress.dot(&e)]
        };
        let each: Vec<_> = (0..model.joints.len()).map(energy).collect();
        let whole: f64 = each.iter().map(|e| e[1]).sum();
        each.iter().map(|e| if whole > 0.0 { e[0].abs() / whole } else { 0.0 }).collect()
    };
    cases.map(shares).collect()
}

/// Joints that may be rigid along their axes: in ascending order of their largest share, while those of no case sum to more than `most`.
fn stiff_along(cases: &[Vec<f64>], most: f64) -> Vec<bool> {
    let largest = |k: usize| cases.iter().map(|case| case[k]).fold(0.0, f64::max);
    let mut order: Vec<usize> = (0..cases[0].len()).collect();
    order.sort_by(|a, b| largest(*a).total_cmp(&largest(*b)));
    let (mut locked, mut sums) = (vec![false; order.len()], vec![0.0; cases.len()]);
    for k in order {
        sums.iter_mut().zip(cases).for_each(|(sum, case)| *sum += case[k]);
        if sums.iter().any(|sum| *sum > most) {
            break;
        }
        locked[k] = true;
    }
    locked
}

fn run<M: for<'a> Method<Bodies<'a>>>(
    system: &System,
    ramp: &Ramp<'_>,
    at: &Motion,
    first: f64,
    tol: f64,
    method: impl Fn() -> M,
) -> (Motion, SolverCounters, f64) {
    let mut motion = at.clone();
    let mut stepper = Adaptive::new(system.bodies(), method());
    let begin = Instant::now();
    let mut h = first;
    let control = Control::Tolerance(1e-2 * tol);
    let end =
        stepper
            .advance(&mut Bodies::new(system, ramp), &mut motion, &mut h, control, usize::MAX, &mut |_, _, _, _| true);
    let ms = begin.elapsed().as_secs_f64() * 1e3;
    if let Err(e) = end {
        println!("{e}");
    }
    (motion, stepper.work(), ms)
}

fn largest(a: &[Pose], b: &[Pose]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).xy().amax()).fold(0.0, f64::max)
}
