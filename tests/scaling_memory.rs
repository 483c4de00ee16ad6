//! Memory of a mechanism of any size, and allocations of its steps.

#[path = "topologies/mod.rs"]
mod topologies;

use bimorph::domains::System;
use bimorph::equations::constrained::Constrained;
use bimorph::equations::{Control, Equations};
use bimorph::multibody::joint_coordinates::constrained_loops::{Linkage, Reduction, ReductionTask};
use bimorph::solve::dirk::Dirk;
use bimorph::solve::method::{Method, Motion};
use bimorph::solve::rodas4::Rodas4;
use bimorph::solve::time::tableau::TR_BDF2;
use std::sync::{Mutex, MutexGuard, PoisonError};

#[global_allocator]
static HEAP: dhat::Alloc = dhat::Alloc;

/// The heap is counted for the whole process: one test at a time.
static COUNTING: Mutex<()> = Mutex::new(());

fn alone() -> MutexGuard<'static, ()> {
    COUNTING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Blocks that `run` allocates on what `ready` has just laid out, at the fewest of five times: the test's runner may
/// allocate beside it, but not every time.
fn blocks<T>(ready: impl Fn() -> T, mut run: impl FnMut(&mut T)) -> u64 {
    let counted = (0..5).map(|_| {
        let mut laid_out = ready();
        let profiler = dhat::Profiler::builder().testing().build();
        run(&mut laid_out);
        let blocks = dhat::HeapStats::get().total_blocks;
        drop(profiler);
        blocks
    });
    counted.fold(u64::MAX, u64::min)
}

/// Bytes per body that a model, its motion, an error estimate and the storage of Rodas4 hold; and at the highest, while
/// they were made.
fn bytes(name: &str, coordinates: usize) -> (usize, usize, usize) {
    let drawing = topologies::sized(name, coordinates);
    let _profiler = dhat::Profiler::builder().testing().build();
    let model = drawing.model();
    let system = System::of_model(model, 2e-6);
    let n = system.bodies();
    let kept: (_, Motion, Motion) = (Rodas4::new(&system, &[]), Motion::zeros(n), Motion::zeros(n));
    let stats = dhat::HeapStats::get();
    drop((kept, system));
    (n, stats.curr_bytes / n, stats.max_bytes / n)
}

/// A million bodies fit into 1 GB (10⁹ bytes): each body, with its joints, its share of the tangent and everything that a
/// Rodas4 step needs, takes no more bytes than stand here; neither does making the model take more. Counted at 10⁵ bodies.
#[test]
fn a_body_takes_less_than_a_kilobyte() {
    let _alone = alone();
    let most = [("chain", 840), ("ladder", 930), ("arms", 860), ("bank", 850), ("quarter", 850), ("rotary", 850)];
    for (name, most) in most {
        let (n, held, peak) = bytes(name, 300_000);
        println!("{name}: {n} bodies, {held} bytes a body, {peak} at the highest");
        assert!(held <= most && peak <= 1000, "{name}: {held} bytes a body, {peak} at the highest");
    }
}

/// The same at a million bodies.
#[test]
#[ignore = "takes 1 GB"]
fn a_million_bodies_take_less_than_a_gigabyte() {
    let _alone = alone();
    for name in topologies::NAMES {
        let (n, held, peak) = bytes(name, 3_000_000);
        println!("{name}: {n} bodies, {held} bytes a body, {peak} at the highest");
        assert!(peak * n <= 1_000_000_000, "{name}");
    }
}

/// An implicit step in joint coordinates, with its projection onto the loops, allocates nothing: stages, factors and the
/// history of the iteration are laid out once. Neither does it where loops are singular, as straight arms are when drawn.
#[test]
fn an_implicit_step_in_joint_coordinates_allocates_nothing() {
    let _alone = alone();
    for (name, bend) in [("chain", 1e-2), ("arms", 1e-2), ("arms", 0.0)] {
        let linkage = Linkage::new(&topologies::sized(name, 300).pinned());
        let n = linkage.coordinates;
        let (springs, mut singular) = (vec![1.0; n], true);
        let ready = || {
            let mut equations = Constrained::new(&linkage, topologies::Springs(&linkage), &springs, 1e-9);
            let mut now = Motion { q: (0..n).map(|k| bend * (k as f64 * 0.7).sin()).collect(), v: vec![0.0; n] };
            if bend > 0.0 {
                equations.project(0.0, &mut now);
            }
            equations.begin(Control::Fixed(1e-9));
            (equations, Dirk::new(n, &TR_BDF2), now.clone(), now, Motion::zeros(n))
        };
        let blocks = blocks(ready, |(equations, method, before, now, error)| {
            method.step(equations, 0.0, 1e-9, now, error).unwrap();
            equations.close(1e-9, &before.q, now, 1.0);
            singular &= equations.singular > 0;
            assert!(equations.work().iterations > 2, "{name}");
        });
        assert_eq!((singular, blocks), (bend == 0.0, 0), "{name}, bent by {bend}");
    }
}

/// The recursion allocates nothing in any configuration and for any task, with packs of equal subtrees or without.
#[test]
fn the_recursion_allocates_nothing() {
    let _alone = alone();
    for (name, bend) in [("ladder", 0.1), ("bank", 0.1), ("bank", 0.0), ("arms", 0.0), ("quarter", 0.0)] {
        for model in [topologies::sized(name, 300).pinned(), topologies::sized(name, 300).model()] {
            let linkage = Linkage::new(&model);
            let n = linkage.coordinates;
            let mut q: Vec<f64> = (0..n).map(|k| bend * (k as f64 * 0.7).sin()).collect();
            let (mut v, mut out) = (vec![0.0; n], vec![0.0; n]);
            let mut singular = 0;
            for way in [Reduction::new, Reduction::plain] {
                let blocks = blocks(
                    || way(&[&linkage]),
                    |r| {
                        for task in [ReductionTask::Accelerations, ReductionTask::Rates, ReductionTask::Positions] {
                            r.place(&q, &v);
                            singular += usize::from(r.solve(task, &mut out).is_some());
                            r.reduce_singular(task, &mut out);
                        }
                        r.project_positions(&mut q, &v, &mut out);
                        r.project_rates(&q, &mut v, &mut out);
                    },
                );
                assert_eq!(blocks, 0, "{name}, bent by {bend}");
            }
            assert!(bend > 0.0 || linkage.constraints == 0 || singular > 0, "{name}");
        }
    }
}
