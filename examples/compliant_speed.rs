//! Time per body or loop of this program on the mechanisms of `benches/peers`, one line each:
//! `name,topology,count,ns_per_body_or_loop`. Thread CPU time, as the peers' scripts take it.
//!
//!     taskset -c 0 cargo run --release --no-default-features --example compliant_speed
//!
//! The compliant formulation: three coordinates a body and flexible joints. The peers' evaluation of accelerations is
//! compared with a solve and its residual. A full Newton iteration is compared with that plus a tangent and its
//! factorization. The same in joint coordinates, loops closed by springs; `straight` is a bank whose arms are straight,
//! as they are drawn.

#[path = "../tests/topologies/mod.rs"]
mod topologies;

use bimorph::domains::{Drive, System};
use bimorph::equations::Joints;
use bimorph::multibody::joint_coordinates::sprung_loops::JointMatrix;
use bimorph::multibody::joint_coordinates::sprung_loops::columns::Four;
use bimorph::multibody::joint_coordinates::sprung_loops::dynamics::Stresses;
use bimorph::multibody::joint_coordinates::sprung_loops::poses::{LaneJointStates, TreeKinematics};
use bimorph::multibody::planar::Pose;
use bimorph::multibody::{BodyMatrix, forces};
use std::hint::black_box;
use std::time::Instant;
use topologies::Topology;

fn main() {
    for count in [10, 100, 1000] {
        report("chain", count, count, &topologies::chain(count));
    }
    for count in [10, 100, 1000] {
        report("bank", count, count, &topologies::arms(count, 2));
    }
    for count in [10, 100, 1000] {
        report("straight", count, count, &topologies::straight_arms(count, 2));
    }
    for count in [10, 100, 1000] {
        report("ladder", count, count, &topologies::ladder(count, 1));
    }
}

/// Measures `topology`; figures are divided by `units`.
fn report(name: &str, count: usize, units: usize, topology: &Topology) {
    let model = topology.model();
    let system = System::of_model(model, 2e-6);
    let (n, pattern) = (system.bodies(), &system.model.pattern);
    let q: Vec<Pose> = (0..n).map(|k| Pose::new(1e-8 * (k % 3) as f64, 1e-8, 1e-3 * (k % 5) as f64)).collect();
    let drive = Drive { load: 1.0, ..Drive::default() };
    let (mut a, mut r) = (BodyMatrix::new(pattern), vec![Pose::zeros(); n]);
    let mut factor = |r: &mut [Pose]| {
        system.tangent(black_box(&q), &drive, &mut a, r);
        forces::add_inertia(&system.model, 1e16, 1e8, &mut a);
        a.factor(pattern).unwrap_or_else(|e| panic!("{e:?}"))
    };
    let per_factor = median(|| {
        black_box(factor(&mut r));
    });
    let mut x = r.clone();
    let per_solve = median(|| {
        system.residual(black_box(&q), &drive, &mut x);
        a.solve(pattern, &mut x);
    });
    let (joint_factor, joint_solve) = by_springs(&system, &q, &drive);
    let bodies = ("compliant", per_factor, per_solve);
    for (formulation, factor, solve) in [bodies, ("rcr by springs", joint_factor, joint_solve)] {
        for (what, time) in [("solve", solve), ("Newton iteration", factor + solve)] {
            println!("bimorph {formulation} {what},{name},{count},{:.1}", time / units as f64);
        }
    }
}

/// The same in joint coordinates, loops closed by springs: nanoseconds of a tangent with its factorization, and of a residual with a solve.
fn by_springs(system: &System, q: &[Pose], drive: &Drive) -> (f64, f64) {
    let joints = Joints::elastic(system).unwrap_or_else(|e| panic!("{e}"));
    let Joints { tree, closures, .. } = &joints;
    let mut s = q.to_vec();
    tree.coordinates_at(q, &mut s);
    let (mut placed, mut stresses, mut w) = (TreeKinematics::new(tree), Stresses::new(tree), JointMatrix::new(tree));
    let given = LaneJointStates::at_rest(&s);
    let (mut r, mut right, mut moved) = (q.to_vec(), vec![Four::ZERO; q.len()], vec![Four::ZERO; q.len() + 1]);
    let factor = median(|| {
        placed.place(tree, black_box(&given));
        closures.tangent(&placed.at, drive, &mut w.bodies, &mut r);
        forces::add_inertia(&system.model, 1e16, 1e8, &mut w.bodies);
        w.factor(tree, &placed, 1.0, None).unwrap_or_else(|e| panic!("{e:?}"));
    });
    let solve = median(|| {
        placed.place(tree, black_box(&given));
        closures.residual(&placed.at, drive, &mut r);
        stresses.fill(tree, &given, &drive.rest());
        placed.resist(tree, &stresses, &mut r, &mut right);
        moved.fill(Four::ZERO);
        w.solve(&mut moved, &mut right);
    });
    (factor, solve)
}

/// Median nanoseconds of thread CPU time of one call, over samples of 40 ms.
fn median(mut call: impl FnMut()) -> f64 {
    let start = Instant::now();
    call();
    let calls = (0.04 / start.elapsed().as_secs_f64().max(1e-8)).ceil() as usize;
    let mut times: Vec<f64> = (0..9)
        .map(|_| {
            let start = Clock::now();
            (0..calls).for_each(|_| call());
            start.elapsed() / calls as f64
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// Processor time of this thread (ns) where the system provides it, else wall time.
struct Clock {
    on_cpu: Option<f64>,
    wall: Instant,
}

impl Clock {
    fn now() -> Self {
        Self { on_cpu: on_cpu(), wall: Instant::now() }
    }

    fn elapsed(&self) -> f64 {
        let wall = self.wall.elapsed().as_secs_f64() * 1e9;
        self.on_cpu.and_then(|before| Some(on_cpu()? - before)).unwrap_or(wall)
    }
}

fn on_cpu() -> Option<f64> {
    std::fs::read_to_string("/proc/thread-self/schedstat").ok()?.split(' ').next()?.parse().ok()
}
