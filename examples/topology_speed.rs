//! Accelerations of pin-jointed chains, banks and ladders by recursive coordinate reduction: nanoseconds per body or loop.
//!
//! Prints `name,topology,count,ns` lines: `serial` for one mechanism with equal subtrees in packs, `single` for the
//! same with every body on its own, `lanes` for a batch of eight variants (per variant). A chain counts bodies, a bank
//! (arms of two rods to ground) and a ladder count loops; `straight` is the bank as it is drawn, by the path for
//! singular configurations. Best of several runs of the whole evaluation: positions, rates, velocity parts, reduction
//! and accelerations.
//!
//! `cargo run --release --no-default-features --example topology_speed [COUNT…]`

#[path = "../tests/topologies/mod.rs"]
mod topologies;

use bimorph::multibody::joint_coordinates::constrained_loops::{Linkage, Reduction, ReductionTask};
use bimorph::multibody::scalar::{Lanes, StoredReal};
use std::hint::black_box;
use std::time::Instant;
use topologies::Topology;

/// Best time of one call (ns).
fn best(mut call: impl FnMut()) -> f64 {
    let started = Instant::now();
    call();
    let repeats = (2e-3 / started.elapsed().as_secs_f64()).ceil().clamp(1.0, 1e5) as usize;
    (0..15)
        .map(|_| {
            let started = Instant::now();
            for _ in 0..repeats {
                call();
            }
            started.elapsed().as_secs_f64() * 1e9 / repeats as f64
        })
        .fold(f64::INFINITY, f64::min)
}

fn measure(name: &str, count: usize, topology: &Topology) {
    let linkage = &Linkage::new(&topology.pinned());
    let n = linkage.coordinates;
    let wave = |k: usize, phase: f64| 0.05 * ((k as f64) * 0.7 + phase).sin();
    let (q, v): (Vec<f64>, Vec<f64>) = ((0..n).map(|k| wave(k, 0.0)).collect(), (0..n).map(|k| wave(k, 1.0)).collect());
    let mut out = vec![0.0; n];
    let mut serial = Reduction::<f64>::new(&[linkage]);
    serial.force.fill([1e-9, -1e-8, 0.0]);
    let t = best(|| {
        serial.accelerate(black_box(&q), black_box(&v), &mut out);
    });
    println!("serial,{name},{count},{:.1}", t / count as f64);
    let mut apart = out.clone();
    let mut single = Reduction::<f64>::without_packs(&[linkage]);
    single.force.fill([1e-9, -1e-8, 0.0]);
    let t = best(|| single.accelerate(black_box(&q), black_box(&v), &mut apart));
    println!("single,{name},{count},{:.1}", t / count as f64);
    let same = out.iter().zip(&apart).all(|(a, b)| a.to_bits() == b.to_bits());
    assert!(same, "equal subtrees side by side change the bits");
    let mut lanes = Reduction::<Lanes<8>>::new(&[linkage]);
    lanes.force.fill([Lanes::splat(1e-9), Lanes::splat(-1e-8), Lanes::ZERO]);
    let (ql, vl): (Vec<Lanes<8>>, Vec<Lanes<8>>) =
        (q.iter().map(|&x| Lanes::splat(x)).collect(), v.iter().map(|&x| Lanes::splat(x)).collect());
    let mut outl = vec![Lanes::ZERO; n];
    let t = best(|| lanes.accelerate(black_box(&ql), black_box(&vl), &mut outl));
    println!("lanes,{name},{count},{:.1}", t / (8 * count) as f64);
    let equal = out.iter().zip(&outl).all(|(a, b)| (0..8).all(|k| b.lane(k).to_bits() == a.to_bits()));
    assert!(equal, "a lane's bits differ from the serial run's");
}

/// One evaluation of a bank as it is drawn: its arms are straight, and with constraints in the place of springs each loop is singular there.
fn drawn(count: usize) {
    let linkage = &Linkage::new(&topologies::straight_arms(count, 2).pinned());
    let n = linkage.coordinates;
    let (q, v, mut out) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let mut serial = Reduction::<f64>::new(&[linkage]);
    serial.force.fill([1e-9, -1e-8, 0.0]);
    serial.place(&q, &v);
    let met = serial.solve(ReductionTask::Accelerations, &mut out);
    let t = best(|| {
        serial.place(black_box(&q), black_box(&v));
        serial.solve(ReductionTask::Accelerations, &mut out);
    });
    println!("{},straight,{count},{:.1}", if met.is_some() { "singular" } else { "serial" }, t / count as f64);
}

fn main() {
    let counts: Vec<usize> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    let counts = if counts.is_empty() { vec![10, 100, 1000] } else { counts };
    println!("name,topology,count,ns");
    for &n in &counts {
        measure("chain", n, &topologies::chain(n));
        measure("bank", n, &topologies::arms(n, 2));
        drawn(n);
        measure("ladder", n, &topologies::ladder(n, 1));
    }
}
