//! A frame that turns: centrifugal, Coriolis and Euler forces, and the small signals of a gyroscope.

use crate::{ask, opened};
use bimorph::compile::{CompileOptions, compile};
use bimorph::device::local::LocalDevice;
use bimorph::device::{Device, Mode, SmallSignal};
use bimorph::netlist::Bundle;
use std::sync::Arc;

/// A mass of 1e-9 kg, drawn 30 µm along x, on springs along x and y and about z that act in its centre.
const GYROSCOPE: &str = "
anchor * [o] [l=1u w=1u h=1u]
pos * [o f] [x=30u]
anchor * [f] [l=1u w=1u h=1u]
mass2d * [m] [m=1e-9 J=1e-18]
spring2d * [f m] [kx=4 ky=4.2 krz=1e-8]
damper2d * [f m] [bx=8e-8 by=8e-8 brz=1e-15]
";

const MASS: f64 = 1e-9;

const STIFF: [f64; 2] = [4.0, 4.2];

const DAMPING: f64 = 8e-8;

/// Small displacements only: springs and dampers whose frame does not turn with the mass.
fn gyroscope(ports: &[&str], signals: &[&str]) -> LocalDevice {
    let options = CompileOptions { linear: true, tol: 1e-5, ..CompileOptions::default() };
    let model = compile(&Bundle::from_text("gyro.net", GYROSCOPE), &options).unwrap_or_else(|e| panic!("{e}"));
    opened(&Arc::new(model), ports, signals)
}

/// At a steady rate the mass moves outwards, x = mΩ²·r/(k − mΩ²).
#[test]
fn a_turning_frame_pushes_outwards() {
    let mut device = gyroscope(&["frame.wz"], &["m.x", "m.y"]);
    for rate in [1e3, -1e4] {
        let still = ask(&mut device, Mode::Static, None, 0.0, &[rate]);
        let push = MASS * rate * rate;
        let exact = push * 30e-6 / (STIFF[0] - push);
        assert!((still.outputs[0] / exact - 1.0).abs() < 1e-11, "{:e} {exact:e}", still.outputs[0]);
        let slope = 2.0 * MASS * rate * 30e-6 * STIFF[0] / (STIFF[0] - push).powi(2);
        assert!((still.doutputs_dv[0] / slope - 1.0).abs() < 1e-9, "{:e} {slope:e}", still.doutputs_dv[0]);
        assert!(still.outputs[1].abs() < 1e-12 * exact);
    }
}

/// While the rate of the frame rises and falls and a force pushes, the mass follows m·(q̈ + 2Ω e×q̇ + Ω̇ e×r − Ω²r) +
/// c·q̇ + k·q = F and J·(θ̈ + Ω̇) + … = 0. The error is 1e-5 of its reach against the classical Runge-Kutta method with
/// steps of 20 ns.
#[test]
fn coriolis_and_euler_push_a_mass() {
    let mut device = gyroscope(&["m.x", "frame.wz"], &["m.y", "m.rz", "m.vx"]);
    let rate = |t: f64| if t < 1e-4 { 2e3 * t / 1e-4 } else { 2e3 - 1e3 * (t - 1e-4) / 1e-4 };
    let turning = |t: f64| if t < 1e-4 { 2e7 } else { -1e7 };
    let force = |t: f64| 2e-6 * t / 2e-4;
    // x, y, θ and their rates
    let slope = |t: f64, z: [f64; 6], turning: f64| {
        let [x, y, angle, vx, vy, spin] = z;
        let (w, rx) = (rate(t), 30e-6 + x);
        let ax = (force(t) - STIFF[0] * x - DAMPING * vx) / MASS + 2.0 * w * vy + turning * y + w * w * rx;
        let ay = (-STIFF[1] * y - DAMPING * vy) / MASS - 2.0 * w * vx - turning * rx + w * w * y;
        let spun = (-1e-8 * angle - 1e-15 * spin) / 1e-18 - turning;
        [vx, vy, spin, ax, ay, spun]
    };
    let mut z = [0.0; 6];
    let mut at = ask(&mut device, Mode::Static, None, 0.0, &[0.0, 0.0]);
    let (mut reach, mut worst) = ([0.0f64; 3], [0.0f64; 3]);
    for k in 0..400 {
        let t = f64::from(k) * 5e-7;
        let w = turning(t + 1e-9);
        for n in 0..25 {
            let (t, h) = (t + f64::from(n) * 2e-8, 2e-8);
            let add = |k: [f64; 6], h: f64| std::array::from_fn(|i| z[i] + h * k[i]);
            let k1 = slope(t, z, w);
            let k2 = slope(t + h / 2.0, add(k1, h / 2.0), w);
            let k3 = slope(t + h / 2.0, add(k2, h / 2.0), w);
            let k4 = slope(t + h, add(k3, h), w);
            z = std::array::from_fn(|i| z[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
        }
        let end = t + 5e-7;
        at = ask(&mut device, Mode::Transient, at.token, 5e-7, &[force(end), rate(end)]);
        for (i, (got, want)) in
            [(at.currents[0], z[0]), (at.outputs[0], z[1]), (at.outputs[1], z[2])].into_iter().enumerate()
        {
            reach[i] = reach[i].max(want.abs());
            worst[i] = worst[i].max((got - want).abs());
        }
    }
    for i in 0..3 {
        assert!(worst[i] < 1e-5 * reach[i], "{i}: {:e} of {:e}", worst[i], reach[i]);
    }
}

/// In small signals about a steady rate the two modes are coupled. The result is the exact solution of two degrees of
/// freedom, 1e-9, far from the resonances, between them and on them, at rates at which Coriolis' force is many times
/// that of the dampers.
#[test]
fn small_signals_of_a_gyroscope() {
    let mut device = gyroscope(&["m.x", "m.y", "frame.wz"], &[]);
    for rate in [1.0, 300.0, 2e3] {
        let still = ask(&mut device, Mode::Static, None, 0.0, &[0.0, 0.0, rate]);
        let mut small = SmallSignal::default();
        for omega in [1e3, (STIFF[0] / MASS).sqrt(), 6.4e4, (STIFF[1] / MASS).sqrt(), 3e5] {
            device.linearize(still.token.unwrap(), omega, &mut small).unwrap();
            // [a −b; b d]·q = f with b = iω·2mΩ, as pairs of real and imaginary parts
            let a = STIFF.map(|k| [k - MASS * (rate * rate + omega * omega), omega * DAMPING]);
            let b = 2.0 * MASS * rate * omega;
            let product = |p: [f64; 2], q: [f64; 2]| [p[0] * q[0] - p[1] * q[1], p[0] * q[1] + p[1] * q[0]];
            let over = |p: [f64; 2], q: [f64; 2]| {
                let size = q[0] * q[0] + q[1] * q[1];
                product(p, [q[0] / size, -q[1] / size])
            };
            let both = product(a[0], a[1]);
            let determinant = [both[0] - b * b, both[1]];
            let exact = [
                over(a[1], determinant),
                over([0.0, b], determinant),
                over([0.0, -b], determinant),
                over(a[0], determinant),
            ];
            let size = exact.iter().fold(0.0f64, |m, z| m.max(z[0].hypot(z[1])));
            for (place, want) in [0, 1, 3, 4].into_iter().zip(exact) {
                let got = small.admittance[place];
                let error = (got[0] - want[0]).hypot(got[1] - want[1]);
                assert!(error < 1e-9 * size, "Ω {rate} ω {omega:e} [{place}]: {got:?} {want:?}");
            }
        }
    }
}
