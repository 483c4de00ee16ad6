//! The work and the memory of a model grow with its size and no faster.

#[path = "topologies/mod.rs"]
mod topologies;

use bimorph::domains::{Drive, Ramp, System};
use bimorph::equations::Bodies;
use bimorph::multibody::planar::Pose;
use bimorph::multibody::{BodyMatrix, Model, forces};
use bimorph::solve::method::{Method, Motion};
use bimorph::solve::rodas4::Rodas4;
use topologies::{NAMES, bodies_per_unit, named};

/// A mechanism with nothing but joints: no gaps, no loads, no sources.
fn system(model: Model) -> System {
    System::of_model(model, 2e-6)
}

/// Size of a model: bodies, joints, blocks below the diagonal, block products of a factorization and of a solve.
fn counters(model: &Model) -> [usize; 5] {
    let p = &model.pattern;
    [model.bodies.len(), model.joints.len(), p.off_blocks(), p.multiplications(), p.solve_multiplications()]
}

/// Increment per unit of each topology: bodies, joints, blocks, products of a factorization and of a solve; and the
/// widest front. Exact: every unit costs the same, whether it is the third or the hundred thousandth.
#[rustfmt::skip]
const PER_UNIT: [([usize; 5], usize); 6] = [
    ([1, 1, 1, 2, 3], 1),
    ([12, 13, 24, 60, 60], 2),
    ([4, 5, 4, 8, 12], 1),
    ([11, 13, 11, 22, 33], 1),
    ([22, 26, 22, 44, 66], 1),
    ([88, 104, 88, 176, 264], 1),
];

/// From 10² to 10⁶ coordinates the counters of every topology are straight lines. Each further unit adds the same
/// number of blocks and of block products, exactly, and the widest front does not grow.
#[test]
fn the_work_is_linear_from_a_hundred_to_a_million_coordinates() {
    for (name, (per_unit, front)) in NAMES.into_iter().zip(PER_UNIT) {
        let at = |units: usize| {
            let model = named(name, units).model();
            assert!(model.pattern.widest_front() <= front, "{name}: front {}", model.pattern.widest_front());
            counters(&model)
        };
        let small = 34_usize.div_ceil(bodies_per_unit(name)).max(2);
        let base = at(small);
        for coordinates in [3_000, 30_000, 1_000_000] {
            let units = coordinates / (3 * bodies_per_unit(name));
            let line: Vec<usize> = (0..5).map(|k| base[k] + per_unit[k] * (units - small)).collect();
            assert_eq!(at(units).to_vec(), line, "{name}, {units} units");
        }
    }
}

/// A Rodas4 step costs one factorization, six solves and six passes over the joints at any size: with the counters of the
/// pattern, which are linear, a step is. The step is taken, on models of 10² and of 10⁵ coordinates.
#[test]
fn a_step_is_one_factorization_and_six_solves_at_any_size() {
    for name in NAMES {
        for coordinates in [100, 100_000] {
            let system = system(topologies::sized(name, coordinates).model());
            let mut rodas = Rodas4::new(&system, &[]);
            let (mut motion, mut error): (Motion, Motion) =
                (Motion::zeros(system.bodies()), Motion::zeros(system.bodies()));
            motion.v[0].y = 1e-3;
            let ramp = Ramp::new(&system.electrics, &[], &[], &[], 1e-6);
            let mut bodies = Bodies::new(&system, &ramp);
            for _ in 0..3 {
                rodas.step(&mut bodies, 0.0, 1e-8, &mut motion, &mut error).unwrap();
            }
            let work = rodas.work();
            assert_eq!((work.factorizations, work.solves, work.forces), (3, 18, 18), "{name}");
            assert!(motion.q.iter().all(|q| q.iter().all(|x| x.is_finite())));
        }
    }
}

/// The recursion solves what it was given: on every topology, the residual of a solve with the matrix of an implicit step
/// is rounding, whatever the number of arms on a hub.
#[test]
fn the_factor_solves_every_topology() {
    for name in NAMES {
        let system = system(topologies::sized(name, 10_000).model());
        let (n, pattern) = (system.bodies(), &system.model.pattern);
        let q: Vec<Pose> = (0..n).map(|k| Pose::new(1e-8 * (k % 3) as f64, 1e-8, 1e-3 * (k % 5) as f64)).collect();
        let (mut a, mut r) = (BodyMatrix::new(pattern), vec![Pose::zeros(); n]);
        system.tangent(&q, &Drive { load: 1.0, ..Drive::default() }, &mut a, &mut r);
        forces::add_inertia(&system.model, 1e16, 1e8, &mut a);
        let mut factored = a.clone();
        factored.factor(pattern).unwrap();
        let mut x = r.clone();
        factored.solve(pattern, &mut x);
        let mut back = vec![Pose::zeros(); n];
        a.multiply_add(pattern, &x, &mut back);
        // translations and rotations differ in unit: compare each kind with its own largest
        for i in [0, 2] {
            let largest = r.iter().map(|r| r[i].abs()).fold(0.0, f64::max);
            let worst = back.iter().zip(&r).map(|(b, r)| (b[i] - r[i]).abs()).fold(0.0, f64::max);
            assert!(worst <= 1e-11 * largest, "{name}: {worst:e} of {largest:e}");
        }
    }
}
