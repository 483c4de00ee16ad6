//! Accelerations of pin-jointed chains, banks and ladders by recursive coordinate reduction: nanoseconds per body or loop.
//!
//! Prints `name,topology,count,ns` lines: `serial` for one mechanism, `lanes` for eight variants side by side (per variant).
//! A chain counts bodies, a bank and a ladder count loops. Best of several runs of the whole evaluation: positions, rates,
//! velocity parts, reduction and accelerations.
//!
//! `cargo run --release --no-default-features --example topology_speed [COUNT…]`

use bimorph::multibody::planar::JointFrame;
use bimorph::multibody::rcr::{Lanes, Linkage, Real, Reduction};
use bimorph::multibody::{Body, BodyId, Joint, Model};
use nalgebra::{Matrix2, Matrix3, Vector2};
use std::hint::black_box;
use std::time::Instant;

#[derive(Default)]
struct Mechanism {
    bodies: Vec<Body>,
    joints: Vec<Joint>,
}

impl Mechanism {
    fn rod(&mut self, from: [f64; 2], to: [f64; 2]) -> BodyId {
        let length = (to[0] - from[0]).hypot(to[1] - from[1]);
        self.bodies.push(Body {
            name: "rod".into(),
            center: Vector2::new(0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1])),
            mass: length,
            inertia: length.powi(3) / 12.0,
            drag: Default::default(),
            free: None,
        });
        BodyId::Free(self.bodies.len() - 1)
    }

    fn pin(&mut self, a: BodyId, b: BodyId, at: [f64; 2]) {
        let arm = |id: BodyId| match id {
            BodyId::Ground => Vector2::zeros(),
            BodyId::Free(k) => Vector2::from(at) - self.bodies[k].center,
        };
        self.joints.push(Joint {
            a,
            b,
            frame: JointFrame { arm_a: arm(a), arm_b: arm(b), axis: Vector2::x() },
            stiffness: Matrix3::zeros(),
            second: Matrix2::zeros(),
            expansion: None,
            rest: 0.0,
            locked: [true, true, false],
        });
    }

    fn linkage(self) -> Linkage {
        Linkage::new(&Model::new(self.bodies, self.joints, Vec::new(), &[], false).0)
    }
}

/// `n` rods one after the other, hanging from ground.
fn chain(n: usize) -> Linkage {
    let mut m = Mechanism::default();
    let mut up = BodyId::Ground;
    for k in 0..n {
        let (from, to) = ([k as f64, 0.1 * (k % 2) as f64], [(k + 1) as f64, 0.1 * ((k + 1) % 2) as f64]);
        let rod = m.rod(from, to);
        m.pin(up, rod, from);
        up = rod;
    }
    m.linkage()
}

/// `n` arms of two links between ground and a shuttle: `n` loops (the first arm is the tree's).
fn bank(n: usize) -> Linkage {
    let mut m = Mechanism::default();
    let shuttle = m.rod([0.0, 0.0], [0.0, n as f64]);
    for k in 0..n {
        let y = k as f64 + 0.5;
        let (at, knee, foot) = ([0.0, y], [-1.0, y + 0.3], [-2.0, y]);
        let (upper, lower) = (m.rod(at, knee), m.rod(knee, foot));
        m.pin(shuttle, upper, at);
        m.pin(upper, lower, knee);
        m.pin(lower, BodyId::Ground, foot);
    }
    m.linkage()
}

/// Two rails of `n` links with rungs between them.
fn ladder(n: usize) -> Linkage {
    let mut m = Mechanism::default();
    let mut below = BodyId::Ground;
    for k in 0..n {
        let y = k as f64;
        let ends = |k: usize, y: f64| ([0.1 * (k % 2) as f64, y], [1.0 + 0.08 * (k % 3) as f64, y]);
        let ((l0, r0), (l1, r1)) = (ends(k, y), ends(k + 1, y + 1.0));
        let (left, right, rung) = (m.rod(l0, l1), m.rod(r0, r1), m.rod(l1, r1));
        m.pin(below, left, l0);
        m.pin(below, right, r0);
        m.pin(left, rung, l1);
        m.pin(right, rung, r1);
        below = rung;
    }
    m.linkage()
}

/// Best time of one call [ns].
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

fn measure(topology: &str, count: usize, linkage: &Linkage) {
    let n = linkage.coordinates;
    let wave = |k: usize, phase: f64| 0.05 * ((k as f64) * 0.7 + phase).sin();
    let (q, v): (Vec<f64>, Vec<f64>) = ((0..n).map(|k| wave(k, 0.0)).collect(), (0..n).map(|k| wave(k, 1.0)).collect());
    let mut out = vec![0.0; n];
    let mut serial = Reduction::<f64>::new(&[linkage]);
    serial.force.fill([0.1, -1.0, 0.0]);
    let t = best(|| {
        serial.accelerate(linkage, black_box(&q), black_box(&v), &mut out);
    });
    println!("serial,{topology},{count},{:.1}", t / count as f64);
    let mut lanes = Reduction::<Lanes<8>>::new(&[linkage]);
    lanes.force.fill([Lanes::splat(0.1), Lanes::splat(-1.0), Lanes::ZERO]);
    let (ql, vl): (Vec<Lanes<8>>, Vec<Lanes<8>>) =
        (q.iter().map(|&x| Lanes::splat(x)).collect(), v.iter().map(|&x| Lanes::splat(x)).collect());
    let mut outl = vec![Lanes::ZERO; n];
    let t = best(|| lanes.accelerate(linkage, black_box(&ql), black_box(&vl), &mut outl));
    println!("lanes,{topology},{count},{:.1}", t / (8 * count) as f64);
    let equal = out.iter().zip(&outl).all(|(a, b)| (0..8).all(|k| b.lane(k).to_bits() == a.to_bits()));
    assert!(equal, "a lane's bits differ from the serial run's");
}

fn main() {
    let counts: Vec<usize> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    let counts = if counts.is_empty() { vec![10, 100, 1000] } else { counts };
    println!("name,topology,count,ns");
    for &n in &counts {
        measure("chain", n, &chain(n));
        measure("bank", n, &bank(n));
        measure("ladder", n, &ladder(n));
    }
}
