//! Benchmarks of the multibody field with reference values that were recomputed in high precision.

use crate::mechanism::Mechanism;
use bimorph::multibody::BodyId;
use bimorph::multibody::joint_coordinates::TreeParent;
use bimorph::multibody::joint_coordinates::constrained_loops::{Linkage, Reduction};
use bimorph::solve::dormand_prince::{DormandPrince, Tolerances};
use bimorph::solve::joint_motion::JointMotion;
use std::f64::consts::FRAC_PI_2;

/// Joint rates of a mechanism of pins whose bodies turn at `omega`, in the model's order of bodies.
fn rates(linkage: &Linkage, omega: &[f64]) -> Vec<f64> {
    let mut v = vec![0.0; linkage.coordinates];
    for (body, link) in linkage.links.iter().enumerate() {
        let up = match link.parent {
            TreeParent::Body(p) => omega[p as usize],
            TreeParent::Ground => 0.0,
            TreeParent::Free => panic!("a free root"),
        };
        v[link.first] = link.sign * (omega[body] - up);
    }
    v
}

fn tolerances(n: usize, rtol: f64) -> Tolerances {
    Tolerances { rtol, atol_q: vec![rtol; n], atol_v: vec![rtol; n] }
}

fn gravity(masses: &[f64], r: &mut Reduction<f64>) {
    for (f, m) in r.force.iter_mut().zip(masses) {
        f[1] -= 9.81 * m;
    }
}

/// N-four-bar, N = 2 (IFToMM A02): the chain of two four-bars passes the configuration where all rods lie in a line and
/// its freedom jumps from 1 to 3, some ten times. On the in-phase branch the angle follows
/// θ'' = −(g/L)·((3N+1)/2)/((4N+1)/3)·cos θ, integrated in high precision to the values below.
#[test]
fn n_four_bar() {
    let mut m = Mechanism::default();
    let uprights: Vec<BodyId> = (0..3).map(|k| m.rod([k as f64, 0.0], [k as f64, 1.0])).collect();
    let couplers: Vec<BodyId> = (0..2).map(|k| m.rod([k as f64, 1.0], [k as f64 + 1.0, 1.0])).collect();
    for (k, &upright) in uprights.iter().enumerate() {
        m.pin(BodyId::Ground, upright, [k as f64, 0.0]);
    }
    for (k, &coupler) in couplers.iter().enumerate() {
        m.pin(uprights[k], coupler, [k as f64, 1.0]);
        m.pin(coupler, uprights[k + 1], [k as f64 + 1.0, 1.0]);
    }
    let (model, place) = m.model();
    let linkage = Linkage::new(&model);
    assert_eq!((linkage.coordinates, linkage.constraints), (5, 4));
    let mut omega = vec![0.0; 5];
    for k in 0..3 {
        omega[place[k]] = -1.0;
    }
    let (mut q, mut v) = (vec![0.0; 5], rates(&linkage, &omega));
    let masses: Vec<f64> = model.bodies.iter().map(|b| b.mass).collect();
    let mut motion = JointMotion::new(&linkage, |_, _, _, r: &mut Reduction<f64>| gravity(&masses, r));
    let mut method = DormandPrince::new(5);
    let reference = [
        (4.0, [0.117_616_102_376_808_61, 0.993_059_138_451_325_1]),
        (10.0, [0.328_458_111_540_815_4, 0.944_518_538_178_601]),
    ];
    let (mut t, mut h) = (0.0, 0.0);
    for (end, b0) in reference {
        method
            .integrate(&mut motion, (t, end), &mut q, &mut v, &mut h, &tolerances(5, 1e-12), 1_000_000, &mut |_| true)
            .unwrap();
        t = end;
        motion.reduction.place(&q, &v);
        let [x, y, theta] = motion.reduction.pose(place[0]);
        // the upper end of the first upright: half a metre above its centre as drawn
        let at = [x - 0.5 * theta.sin(), 0.5 + y + 0.5 * theta.cos()];
        let off = (at[0] - b0[0]).hypot(at[1] - b0[1]);
        println!("four-bar, {t} s: {off:.1e} m, {:?}", method.effort);
        assert!((at[0] - b0[0]).abs() < 1e-8 && (at[1] - b0[1]).abs() < 1e-8, "t = {t}: {at:?}");
    }
}

/// Andrews' squeezing mechanism (E. Hairer, G. Wanner, "Solving Ordinary Differential Equations II", 1996, §VII.7): seven
/// bodies, four loops, driven by a constant torque; the crank turns twice in 30 ms. Reference: two independent integrators,
/// projected DOP853 and 30-digit extrapolation, which agree to 2e-14 in the angles and 4e-12 in their rates. (The values of
/// the IVP test set itself are good to 2.7e-10 only.)
#[test]
fn andrews_squeezer() {
    let (beta, theta, gamma) = (-0.061_713_890_014_276_45, 0.0, 0.455_279_819_163_070_4);
    let (phi, delta, omega) = (0.222_668_390_165_885_88, 0.487_364_979_543_842_55, -0.222_668_390_165_885_88);
    let epsilon = 1.230_547_444_549_821_2f64;
    let (a, b, c) = ([-0.06934, -0.00227], [-0.03635, 0.03273], [0.014, 0.072]);
    let along = |from: [f64; 2], length: f64, angle: f64| {
        [from[0] + length * f64::cos(angle), from[1] + length * f64::sin(angle)]
    };
    let below = |from: [f64; 2], length: f64, angle: f64| along(from, length, angle - FRAC_PI_2);
    let crank = along([0.0, 0.0], 7e-3, beta);
    let end = along(crank, -28e-3, beta + theta);
    let (end5, end7) = (along(a, 4e-2, delta), below(a, 4e-2, epsilon));
    let mut m = Mechanism::default();
    let k1 = m.body(along([0.0, 0.0], 92e-5, beta), 0.04325, 2.194e-6);
    let k2 = m.body(along(crank, -115e-4, beta + theta), 0.00365, 4.410e-7);
    let k3 = m.body(along(along(b, 1874e-5, gamma), 1043e-5, gamma + FRAC_PI_2), 0.02373, 5.255e-6);
    let k4 = m.body(below(end5, 2e-2 - 1421e-5, phi + delta), 0.00706, 5.667e-7);
    let k5 = m.body(along(along(a, 2308e-5, delta), 916e-5, delta + FRAC_PI_2), 0.07050, 1.169e-5);
    let k6 = m.body(along(end7, 2e-2 - 1421e-5, omega + epsilon), 0.00706, 5.667e-7);
    let k7 = m.body(along(along(a, 1228e-5, epsilon), 449e-5, epsilon + FRAC_PI_2), 0.05498, 1.912e-5);
    for (body, at) in [(k1, [0.0, 0.0]), (k3, b), (k5, a), (k7, a)] {
        m.pin(BodyId::Ground, body, at);
    }
    for (one, other, at) in
        [(k1, k2, crank), (k5, k4, end5), (k7, k6, end7), (k2, k3, end), (k2, k4, end), (k2, k6, end)]
    {
        m.pin(one, other, at);
    }
    let (model, place) = m.model();
    let linkage = Linkage::new(&model);
    assert_eq!((linkage.coordinates, linkage.constraints), (7, 6));
    let hook = along(along(b, 2e-2, gamma), -18e-3, gamma + FRAC_PI_2);
    let center = model.bodies[place[2]].center;
    let arm = [hook[0] - center.x, hook[1] - center.y];
    let (motor, rocker) = (place[0], place[2]);
    let loads = |_: f64, _: &[f64], _: &[f64], r: &mut Reduction<f64>| {
        r.force[motor][2] += 33e-3;
        let [x, y, turn] = r.pose(rocker);
        let (s, co) = turn.sin_cos();
        let lever = [co * arm[0] - s * arm[1], s * arm[0] + co * arm[1]];
        let from = [center.x + x + lever[0] - c[0], center.y + y + lever[1] - c[1]];
        let length = from[0].hypot(from[1]);
        let pull = -4530.0 * (length - 7785e-5) / length;
        let f = [pull * from[0], pull * from[1]];
        let force = &mut r.force[rocker];
        *force = [force[0] + f[0], force[1] + f[1], force[2] + lever[0] * f[1] - lever[1] * f[0]];
    };
    let n = linkage.coordinates;
    let (mut q, mut v) = (vec![0.0; n], vec![0.0; n]);
    let mut motion = JointMotion::new(&linkage, loads);
    let mut method = DormandPrince::new(n);
    let mut h = 0.0;
    let mut bounds = tolerances(n, 1e-13);
    bounds.atol_v = vec![1e-10; n];
    method.integrate(&mut motion, (0.0, 0.03), &mut q, &mut v, &mut h, &bounds, 1_000_000, &mut |_| true).unwrap();
    motion.reduction.place(&q, &v);
    let angle = |k: usize| motion.reduction.pose(place[k])[2];
    let rate = |k: usize| motion.reduction.rate(place[k])[2];
    let relative = |f: &dyn Fn(usize) -> f64| [f(0), f(1) - f(0), f(2), f(3) - f(4), f(4), f(5) - f(6), f(6)];
    let start = [beta, theta, gamma, phi, delta, omega, epsilon];
    let expected_q = [
        15.81077119515371,
        -15.75637105841184,
        0.0408222401196458,
        -0.53473011634208,
        0.524409965879954,
        0.53473011634208,
        1.04808074104194,
    ];
    let expected_v = [
        1139.92030225911,
        -1424.37929517754,
        11.0329119106186,
        19.2933741050320,
        0.573569914830,
        -19.2933741050320,
        0.323179149249,
    ];
    let mut off = [0.0f64; 2];
    for i in 0..7 {
        let (q, v) = (start[i] + relative(&angle)[i], relative(&rate)[i]);
        assert!((q - expected_q[i]).abs() < 1e-9, "angle {i}: {q}");
        assert!((v - expected_v[i]).abs() < 1e-7, "rate {i}: {v}");
        off = [off[0].max((q - expected_q[i]).abs()), off[1].max((v - expected_v[i]).abs())];
    }
    println!("squeezer: {:.1e} rad, {:.1e} rad/s, {:?}", off[0], off[1], method.effort);
}
