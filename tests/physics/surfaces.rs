//! Adhesion and friction of stops: forces, energy and motion, against closed forms.

use crate::model;
use bimorph::analysis::statics::static_equilibrium;
use bimorph::analysis::transient::{TransientOptions, TransientResult, transient};
use bimorph::compile::{CompileOptions, CompiledModel};
use bimorph::domains::loss_tangent::LossTangent;
use bimorph::domains::{Configuration, Domain};
use bimorph::multibody::BodyMatrix;
use bimorph::multibody::planar::Pose;

fn run(start: &CompiledModel, moving: &CompiledModel, stop: f64, signals: &[&str]) -> TransientResult {
    let options = TransientOptions {
        stop,
        points: 4001,
        tol: 1e-4,
        signals: signals.iter().map(|s| (*s).to_owned()).collect(),
        release: Some(start),
        ..TransientOptions::default()
    };
    transient(moving, &options, &mut |_, _| {}, &mut |_| true).unwrap_or_else(|e| panic!("{e}"))
}

/// A mass of 1e-10 kg on a spring of 1 N/m that slides along a floor, on which 1 µN presses it.
fn slider(force: f64, stop: &str) -> CompiledModel {
    let text = format!(
        "anchor * [f] []
        spring2d * [f m] [kx=1 ky=1e-3 krz=1e-9]
        mass2d * [m] [m=1e-10 J=1e-22]
        f2d * [m] [F=1u oz=-pi/2]
        f2d * [m] [F={force:e}]
        floor stop2d * [m] [gap=1n oz=-pi/2 k=1e4 {stop}]"
    );
    model(&text, &CompileOptions::default())
}

/// Coulomb's oscillator: from x₀ = 5.25 µm with μ·N/k = 0.5 µm it turns at −4.25, 3.25, −2.25, 1.25 µm and sticks at −0.25 µm (closed form: each half
/// period takes 2·μ·N/k). The spring of 1e-3 N/m across and the slip speed of 10 µm/s against 0.5 m/s change that by less than 1e-3 of x₀. Equilibria have no friction.
#[test]
fn a_slider_stops_by_coulombs_law() {
    let stop = "friction=0.5";
    let (start, moving) = (slider(5.25e-6, stop), slider(0.0, stop));
    let rest = static_equilibrium(&start, &Vec::new()).unwrap_or_else(|e| panic!("{e}"));
    let x0 = rest.nodes.iter().find(|(name, _)| name == "m").map_or(0.0, |(_, motion)| motion.x);
    assert!((x0 / 5.25e-6 - 1.0).abs() < 1e-6, "{x0}");
    let result = run(&start, &moving, 400e-6, &["m.x"]);
    let x = &result.signals[0].2;
    let mut turns = Vec::new();
    for w in x.windows(3) {
        if (w[1] - w[0]) * (w[2] - w[1]) < 0.0 && w[1].abs() > 0.5e-6 {
            turns.push(w[1]);
        }
    }
    let wanted = [-4.25e-6, 3.25e-6, -2.25e-6, 1.25e-6];
    assert_eq!(turns.len(), wanted.len(), "{turns:?}");
    for (found, wanted) in turns.iter().zip(wanted) {
        assert!((found - wanted).abs() < 1e-3 * 5.25e-6, "{found} {wanted}");
    }
    assert!((x[x.len() - 1] + 0.25e-6).abs() < 1e-3 * 5.25e-6, "{}", x[x.len() - 1]);
}

/// A contact that holds 2 µN, on a spring that pulls by 1 µN there: without load it stays closed, 0.7 µN do not tear it open and 1.3 µN do. Without adhesion it
/// opens by itself.
#[test]
fn adhesion_holds_up_to_its_force() {
    let part = |force: f64, stop: &str| {
        let text = format!(
            "anchor * [f] []
            spring2d * [f m] [kx=1]
            mass2d * [m] [m=1e-10 b=1e-6]
            guide2d * [m] []
            f2d * [m] [F={force:e}]
            tip stop2d * [m] [gap=1u k=1e4 {stop}]"
        );
        model(&text, &CompileOptions::default())
    };
    let end = |stop: &str, force: f64| {
        let result = run(&part(1.2e-6, stop), &part(force, stop), 3e-3, &["m.x"]);
        result.signals[0].2[4000]
    };
    let sticky = "adhesion=2u";
    for force in [0.0, -0.7e-6] {
        assert!((end(sticky, force) - 1e-6).abs() < 2e-9, "{force}: {}", end(sticky, force));
    }
    assert!((end(sticky, -1.3e-6) + 1.3e-6).abs() < 1e-8, "{}", end(sticky, -1.3e-6));
    assert!(end("", 0.0).abs() < 1e-8);
}

/// A stop between two bodies.
const BETWEEN_TWO: &str = "anchor * [f] []
    spring2d * [f m] [kx=1 ky=1 krz=1e-9]
    mass2d * [m] [m=1e-10 J=1e-21]
    spring2d * [m n] [kx=1 ky=1 krz=1e-9 l=5u]
    mass2d * [n] [m=1e-10 J=1e-21]
    link2d * [n tip] [l=3u oz=1.2]
    both stop2d * [m tip] [gap=0.5u back=0.5u oz=0.4 k=2e3 adhesion=3u adhesionrange=20n friction=0.4 slipspeed=1m restitution=0.5 speed=0.1]";

/// A stop of two bodies with loss, adhesion and friction at 200 random states. The force is the slope of the energy, the tangent that of the force, and friction
/// has its derivatives with rates, each within 1e-7 (differences of fourth order). The part that depends on rates takes power. The discrete force of a step does the work
/// of the stored energy and takes more, within 1e-10 of their size.
#[test]
fn energy_and_derivatives() {
    let compiled = model(BETWEEN_TWO, &CompileOptions::default());
    let system = &compiled.parts.system;
    let stop = &system.members[0];
    let pattern = &system.model.pattern;
    let mut seed = 11_u64;
    let mut random = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 40) as f64 / f64::from(1 << 23) - 1.0
    };
    let zeros = vec![Pose::zeros(); system.bodies()];
    let norm = |r: &[Pose]| r.iter().map(|r| r.norm_squared()).sum::<f64>().sqrt();
    let (mut pressed, mut drawn) = (0, 0);
    for k in 0..200 {
        // approaches about the two sides
        let side = if k % 2 == 0 { 0.5e-6 } else { -0.5e-6 };
        let (sin, cos) = 0.4_f64.sin_cos();
        let mut q = vec![Pose::new(side * cos, side * sin, 0.0), Pose::zeros()];
        for q in &mut q {
            *q += Pose::new(8e-9 * random(), 8e-9 * random(), 2e-3 * random());
        }
        let way: Vec<Pose> = (0..2).map(|_| Pose::new(1e-9 * random(), 1e-9 * random(), 1e-3 * random())).collect();
        let speed: Vec<Pose> = (0..2).map(|_| Pose::new(0.02 * random(), 0.02 * random(), 4e3 * random())).collect();
        let moved =
            |from: &[Pose], by: &[Pose], h: f64| from.iter().zip(by).map(|(q, w)| q + w * h).collect::<Vec<Pose>>();
        let energy = |q: &[Pose]| {
            let at = Configuration { q, linear: false };
            stop.energy(at, 0.0) + stop.contact_energy(at)
        };
        let force = |q: &[Pose]| {
            let mut r = zeros.clone();
            stop.add_force(Configuration { q, linear: false }, 0.0, &mut r);
            r
        };
        let lost = |q: &[Pose], v: &[Pose]| {
            let mut r = zeros.clone();
            stop.add_loss(Configuration { q, linear: false }, &|k| v[k], &mut r);
            r
        };
        let h = 1e-3;
        let four = |of: &dyn Fn(f64) -> f64| (8.0 * (of(h) - of(-h)) - of(2.0 * h) + of(-2.0 * h)) / (12.0 * h);
        let dot = |a: &[Pose], b: &[Pose]| a.iter().zip(b).map(|(a, b)| a.dot(b)).sum::<f64>();
        let (f, work) = (force(&q), dot(&force(&q), &way));
        let slope = four(&|h| energy(&moved(&q, &way, h)));
        let scale = 1e-6 * 1e-9;
        assert!((slope - work).abs() < 1e-7 * work.abs().max(scale), "{k}: {slope:e} {work:e}");
        pressed += usize::from(stop.bearing(Configuration { q: &q, linear: false }) > 0.0);
        drawn += usize::from(norm(&f) > 0.0);
        let mut tangent = BodyMatrix::new(pattern);
        stop.add_tangent(Configuration { q: &q, linear: false }, 0.0, pattern, &mut tangent);
        let mut change = zeros.clone();
        tangent.multiply_add(pattern, &way, &mut change);
        for other in [&speed, &way] {
            let found = four(&|h| dot(&force(&moved(&q, &way, h)), other));
            let wanted = dot(&change, other);
            assert!(
                (found - wanted).abs() <= 1e-7 * (found.abs() + norm(&change) * norm(other)),
                "{k}: {found:e} {wanted:e}"
            );
        }
        // friction and loss resist, and their derivatives with rates are exact along the speed itself
        let power = dot(&lost(&q, &speed), &speed);
        assert!(power >= -1e-30, "{k}: {power}");
        let (mut stiffness, mut damping) = (BodyMatrix::new(pattern), BodyMatrix::new(pattern));
        let mut to = LossTangent { pattern, stiffness: &mut stiffness, damping: &mut damping };
        if stop.add_loss_tangent(Configuration { q: &q, linear: false }, &|k| speed[k], &mut to) {
            // friction at a fixed contact force: motions along the stop alone, without rotation
            let along: Vec<Pose> = vec![Pose::new(-sin, cos, 0.0), Pose::zeros()];
            let mut rated = zeros.clone();
            damping.multiply_add(pattern, &along, &mut rated);
            let step = 1e-6;
            let of = |h: f64| lost(&q, &moved(&speed, &along, h * step));
            let [far, near, back, behind] = [2.0, 1.0, -1.0, -2.0].map(of);
            for b in 0..2 {
                let found = ((near[b] - back[b]) * 8.0 - far[b] + behind[b]) / (12.0 * step);
                assert!((found - rated[b]).norm() < 1e-7 * (found.norm() + 1e-9), "{k}: {found} {}", rated[b]);
            }
        }
        let end = moved(&q, &way, 1.0);
        let middle: Vec<Pose> = q.iter().zip(&end).map(|(a, b)| (a + b) * 0.5).collect();
        let chord = bimorph::domains::domain::Chord {
            at: [&q, &middle, &end].map(|q| Configuration { q, linear: false }),
            h: 1e-9,
        };
        let (mut r, mut unused) = (zeros.clone(), BodyMatrix::new(pattern));
        stop.add_quotient(&chord, 0.0, pattern, &mut r, &mut unused);
        let dissipated = dot(&r, &way) - (energy(&end) - energy(&q));
        assert!(dissipated >= -1e-10 * (energy(&q).abs() + energy(&end).abs()), "{k}: {dissipated:e}");
    }
    assert!(pressed > 40 && drawn > 120, "{pressed} {drawn}");
}
