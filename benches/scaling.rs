//! Time against size, from 10² to 10⁶ coordinates. The kernels and the Rodas4 step run on every topology with flexible
//! joints. Recursive coordinate reduction runs on the same topologies with pins, explicit and as one iteration of an
//! implicit stage. The output is nanoseconds per body at each size. It also has the least-squares exponent of time
//! against size, over all sizes and over those that exceed the caches (from 10⁴ on).
//!
//!     taskset -c 0 cargo bench --no-default-features --bench scaling [-- TOPOLOGY …]
//!
//! Each figure is the median of samples that last a hundred microseconds at least. A model of 10⁶ coordinates takes some
//! 300 MB, so that its figures are those of main memory; small ones stay in the caches.

#[path = "../tests/topologies/mod.rs"]
mod topologies;

use bimorph::domains::{Drive, Ramp, System};
use bimorph::equations::constrained::Constrained;
use bimorph::equations::{Bodies, Control, Equations, Stage, Staged};
use bimorph::multibody::joint_coordinates::constrained_loops::{Linkage, Reduction};
use bimorph::multibody::planar::Pose;
use bimorph::multibody::{BodyId, BodyMatrix, Model, forces};
use bimorph::solve::method::{Method, Motion};
use bimorph::solve::rodas4::Rodas4;
use std::hint::black_box;
use std::time::Instant;

const SIZES: [usize; 9] = [100, 316, 1_000, 3_160, 10_000, 31_600, 100_000, 316_000, 1_000_000];
const WHAT: [&str; 8] = [
    "residual",
    "tangent + residual",
    "tangent + factor",
    "factor",
    "solve",
    "Rodas4 step",
    "reduction on pins",
    "implicit on pins",
];

/// Nanoseconds of each kind of work on a topology of about `coordinates` coordinates, and its number of bodies.
fn measure(name: &str, coordinates: usize) -> (usize, [f64; 8]) {
    let topology = topologies::sized(name, coordinates);
    let reduction = reduction(&topology);
    let implicit = implicit(&topology);
    let model = topology.model();
    let system = System::of_model(model, 2e-6);
    let (n, model) = (system.bodies(), &system.model);
    let pattern = &model.pattern;
    let q = displaced(model);
    let drive = Drive { load: 1.0, ..Drive::default() };
    let (mut a, mut r) = (BodyMatrix::new(pattern), vec![Pose::zeros(); n]);
    let residual = median(1, |_| system.residual(black_box(&q), &drive, &mut r));
    let tangent = median(1, |_| system.tangent(black_box(&q), &drive, &mut a, &mut r));
    // a step of 4e-8 s: inertia and stiffness weigh alike
    let prepare = |a: &mut BodyMatrix, r: &mut [Pose]| {
        system.tangent(black_box(&q), &drive, a, r);
        forces::add_inertia(model, 1e16, 1e8, a);
    };
    let both = median(1, |_| {
        prepare(&mut a, &mut r);
        a.factor(pattern).unwrap_or_else(|e| panic!("{e:?}"))
    });
    // fresh matrices for each sample; at small sizes many, so that reading the clock does not count
    let batch = (20_000 / n).max(1);
    prepare(&mut a, &mut r);
    let mut copies = vec![a.clone(); batch];
    let factor = fresh(&mut copies, &a, |copy| copy.factor(pattern).unwrap_or_else(|e| panic!("{e:?}")));
    drop(copies);
    a.factor(pattern).unwrap_or_else(|e| panic!("{e:?}"));
    let mut copies = vec![r.clone(); batch];
    let solve = fresh(&mut copies, &r, |x| a.solve(pattern, x));
    drop((copies, a));
    let mut rodas = Rodas4::new(&system, &[]);
    let (start, mut motion) = (Motion { q, v: r.clone() }, Motion::zeros(n));
    let mut error = Motion::zeros(n);
    let ramp = Ramp::new(&system.electrics, &[], &[], &[], 1e-6);
    let mut bodies = Bodies::new(&system, &ramp);
    let step = median(1, |_| {
        motion.q.copy_from_slice(&start.q);
        motion.v.fill(Pose::zeros());
        rodas.step(&mut bodies, 0.0, 4e-8, &mut motion, &mut error).unwrap_or_else(|e| panic!("{e:?}"));
    });
    assert!(motion.q.iter().all(|q| q.z.abs() < 0.1), "{name}, {n} bodies: no motion of a mechanism");
    (n, [residual, tangent, both, factor, solve, step, reduction, implicit])
}

/// Bodies displaced by some 10 nm and turned so far that their joints move by 20 nm at most. A yoke on a thousand arms
/// then rotates little. Rotated as far as a rod, it would open its far joints by micrometres, the step would end in
/// rotations of 10⁴⁰ rad, and the time would be that of their sines.
fn displaced(model: &Model) -> Vec<Pose> {
    let mut lever = vec![topologies::ROD / 2.0; model.bodies.len()];
    for joint in &model.joints {
        let (a, b) = joint.bodies();
        for (body, arm) in [(a, joint.arm_a), (b, joint.arm_b)] {
            if let BodyId::Free(k) = body {
                lever[k] = arm.norm().max(lever[k]);
            }
        }
    }
    let pose = |(k, lever): (usize, f64)| Pose::new(1e-8 * (k % 3) as f64, 1e-8, 5e-9 * (k % 5) as f64 / lever);
    lever.into_iter().enumerate().map(pose).collect()
}

/// Nanoseconds of one evaluation of accelerations on pins.
fn reduction(topology: &topologies::Topology) -> f64 {
    let linkage = Linkage::new(&topology.pinned());
    let mut reduction = Reduction::<f64>::new(&[&linkage]);
    reduction.force.fill([1e-9, -1e-8, 0.0]);
    let q: Vec<f64> = (0..linkage.coordinates).map(|k| 1e-2 * (k as f64 * 0.7).sin()).collect();
    let mut out = vec![0.0; q.len()];
    median(1, |_| reduction.accelerate(black_box(&q), &q, &mut out))
}

/// Nanoseconds of one iteration of a stage on pins with springs: placing, forces and stiffness, reduction.
fn implicit(topology: &topologies::Topology) -> f64 {
    let linkage = Linkage::new(&topology.pinned());
    let n = linkage.coordinates;
    let mut equations = Constrained::new(&linkage, topologies::Springs(&linkage), &vec![1.0; n], 1.0);
    // any correction is small enough: one iteration
    equations.begin(Control::Tolerance(f64::INFINITY));
    let q: Vec<f64> = (0..n).map(|k| 1e-2 * (k as f64 * 0.7).sin()).collect();
    let mut a = vec![0.0; n];
    let mut at = Motion::zeros(n);
    let stage = Stage { t: 0.0, q: &q, v: &q, near: &q, beta: 1e-16, gamma: 1e-8 };
    median(1, |_| equations.stage(black_box(&stage), &mut a, &mut at).unwrap_or_else(|e| panic!("{e:?}")))
}

/// Median nanoseconds of `work`, which does `repeat` units of work at a call.
fn median<R>(repeat: usize, mut work: impl FnMut(usize) -> R) -> f64 {
    let start = Instant::now();
    black_box(work(0));
    let once = start.elapsed().as_secs_f64().max(1e-9);
    let (calls, samples) = ((1e-4 / once).ceil() as usize, (0.3 / once).clamp(7.0, 201.0) as usize);
    let mut times: Vec<f64> = (0..samples)
        .map(|_| {
            let start = Instant::now();
            for k in 0..calls {
                black_box(work(k));
            }
            start.elapsed().as_secs_f64() * 1e9 / (calls * repeat) as f64
        })
        .collect();
    middle(&mut times)
}

/// Median nanoseconds of `work` on copies that are made fresh outside of the clock.
fn fresh<T: Clone, R>(copies: &mut [T], original: &T, mut work: impl FnMut(&mut T) -> R) -> f64 {
    let mut times = Vec::new();
    let start = Instant::now();
    while times.len() < 7 || (start.elapsed().as_secs_f64() < 0.3 && times.len() < 201) {
        for copy in copies.iter_mut() {
            copy.clone_from(original);
        }
        let start = Instant::now();
        for copy in copies.iter_mut() {
            black_box(work(copy));
        }
        times.push(start.elapsed().as_secs_f64() * 1e9 / copies.len() as f64);
    }
    middle(&mut times)
}

fn middle(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// Slope of ln t over ln n by least squares.
fn exponent(points: &[(f64, f64)]) -> f64 {
    let count = points.len() as f64;
    let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), (n, t)| (x + n.ln() / count, y + t.ln() / count));
    let along: f64 = points.iter().map(|(n, t)| (n.ln() - x) * (t.ln() - y)).sum();
    along / points.iter().map(|(n, _)| (n.ln() - x).powi(2)).sum::<f64>()
}

fn main() {
    let asked: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    for name in topologies::NAMES.into_iter().filter(|n| asked.is_empty() || asked.iter().any(|a| a == n)) {
        let mut points: Vec<(f64, [f64; 8])> = Vec::new();
        println!("{name}, ns per body\n{:>9}{}", "bodies", WHAT.map(|w| format!("{w:>20}")).concat());
        for size in SIZES {
            let (n, times) = measure(name, size);
            println!("{n:>9}{}", times.map(|t| format!("{:>20.1}", t / n as f64)).concat());
            points.push((n as f64, times));
        }
        for (what, from) in [("exponent", 0), ("from 1e4", SIZES.len() - 5)] {
            let slope = |k: usize| exponent(&points[from..].iter().map(|(n, t)| (*n, t[k])).collect::<Vec<_>>());
            println!("{what:>9}{}", (0..WHAT.len()).map(|k| format!("{:>20.3}", slope(k))).collect::<String>());
        }
        println!();
    }
}
