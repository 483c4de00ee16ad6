//! Ports that are not electrical: forces, moments, heat and the motion of the frame keep the contract of a device, in both
//! formulations, and mean what they say.

use bimorph::compile::{CompileOptions, Compiled, Formulation, Junctions, compile};
use bimorph::device::local::LocalDevice;
use bimorph::device::{
    Device, DeviceError, Mode, OpenRequest, PortKind, SmallSignal, Status, Token, Trial, TrialReply,
};
use bimorph::netlist::Bundle;
use std::sync::Arc;

/// A heated chevron that pushes a shuttle with a comb ahead of it and a plate beside it.
const SHUTTLE: &str = include_str!("netlists/shuttle.net");

/// Every kind of port, in an order of their own, and a size of each that does something.
const PORTS: [(&str, PortKind, f64); 10] = [
    ("s.y", PortKind::Force, 2e-6),
    ("heat", PortKind::Electrical, 1.5),
    ("left.T", PortKind::Thermal, 1e-3),
    ("c.rz", PortKind::Moment, 1e-9),
    ("frame.ax", PortKind::Acceleration, 2e5),
    ("s.vx", PortKind::ForceRate, 1e-5),
    ("shake", PortKind::Electrical, 8.0),
    ("c.vrz", PortKind::MomentRate, 1e-9),
    ("frame.ay", PortKind::Acceleration, -1e4),
    ("frame.wz", PortKind::Rate, 2e4),
];

/// Those that a formulation takes: the frame's rate is the last.
fn ports(formulation: Formulation) -> &'static [(&'static str, PortKind, f64)] {
    if formulation == Formulation::Rcr { &PORTS[..PORTS.len() - 1] } else { &PORTS }
}

const FORMULATIONS: [Formulation; 2] = [Formulation::Compliant, Formulation::Rcr];

fn compiled(text: &str, formulation: Formulation) -> Arc<Compiled> {
    compiled_to(1e-3, text, formulation)
}

fn compiled_to(tol: f64, text: &str, formulation: Formulation) -> Arc<Compiled> {
    let options = CompileOptions { formulation, tol, junctions: Junctions::Centreline, ..CompileOptions::default() };
    Arc::new(compile(&Bundle::from_text("ports.net", text), &options).unwrap_or_else(|e| panic!("{e}")))
}

fn opened(compiled: &Arc<Compiled>, ports: &[&str], signals: &[&str]) -> LocalDevice {
    let mut device = LocalDevice::new(Arc::clone(compiled));
    let names = |list: &[&str]| list.iter().map(|name| (*name).to_owned()).collect();
    device
        .open(&OpenRequest { ports: names(ports), signals: names(signals), noise: None })
        .unwrap_or_else(|e| panic!("{e}"));
    device
}

fn all(compiled: &Arc<Compiled>) -> LocalDevice {
    let names: Vec<&str> = ports(compiled.options.formulation).iter().map(|(name, ..)| *name).collect();
    opened(compiled, &names, &["s.y", "s.vy", "right.T", "squeeze.gap", "s.vx"])
}

fn ask(device: &mut LocalDevice, mode: Mode, parent: Option<Token>, dt: f64, given: &[f64]) -> TrialReply {
    let mut reply = TrialReply::default();
    device.trial(&Trial { mode, parent, t: 0.0, dt, voltages: given }, &mut reply).unwrap();
    assert_eq!(reply.status, Status::Ok);
    reply
}

fn given(formulation: Formulation, share: f64) -> Vec<f64> {
    ports(formulation).iter().map(|(.., size)| share * size).collect()
}

/// What was opened is described with its kinds.
#[test]
fn kinds_are_told() {
    let mut device = LocalDevice::new(compiled(SHUTTLE, Formulation::Compliant));
    let ports = PORTS.iter().map(|(name, ..)| (*name).to_owned()).collect();
    let told = device.open(&OpenRequest { ports, signals: vec![], noise: None }).unwrap();
    for (port, (name, kind, _)) in told.ports.iter().zip(PORTS) {
        assert_eq!((port.name.as_str(), port.kind), (name, kind));
    }
}

/// Asking again gives the same token and the same bits, whatever was asked in between, and so does another device.
#[test]
fn trials_are_pure() {
    for formulation in FORMULATIONS {
        let compiled = compiled(SHUTTLE, formulation);
        let mut device = all(&compiled);
        let rest = ask(&mut device, Mode::Static, None, 0.0, &given(formulation, 0.5));
        let first = ask(&mut device, Mode::Transient, rest.token, 2e-7, &given(formulation, 0.7));
        for dt in [3e-7, 1e-6, 1e-9] {
            ask(&mut device, Mode::Transient, rest.token, dt, &given(formulation, 0.1));
        }
        assert_eq!(ask(&mut device, Mode::Transient, rest.token, 2e-7, &given(formulation, 0.7)), first);
        let mut fresh = all(&compiled);
        let rest = ask(&mut fresh, Mode::Static, None, 0.0, &given(formulation, 0.5));
        assert_eq!(ask(&mut fresh, Mode::Transient, rest.token, 2e-7, &given(formulation, 0.7)), first);
        // a snapshot goes on with the same bits
        let bytes = device.save(rest.token).unwrap();
        let mut other = LocalDevice::new(Arc::clone(&compiled));
        other.load(&bytes).unwrap();
        assert_eq!(ask(&mut other, Mode::Transient, rest.token, 2e-7, &given(formulation, 0.7)), first);
    }
}

/// Units of what the ports answer, and of the outputs of [`all`].
const UNITS: [&str; PORTS.len()] = ["m", "A", "K", "rad", "", "m/s", "A", "rad/s", "", ""];
const OUTPUT_UNITS: [&str; 5] = ["m", "m/s", "K", "m", "m/s"];

/// Largest share that the whole size of any port has in any of these rows.
fn largest(ports: &[(&str, PortKind, f64)], partial: &[f64], rows: impl Iterator<Item = usize>) -> f64 {
    let of_row = |row: usize| {
        let partials = &partial[ports.len() * row..ports.len() * (row + 1)];
        partials.iter().zip(ports).map(|(p, (.., size))| (p * size).abs()).fold(0.0, f64::max)
    };
    rows.map(of_row).fold(0.0, f64::max)
}

/// Central differences of what is answered, of charges and of outputs agree with the partials over every port: to 1e-6 of the
/// row's largest share for a single internal step, where they are exact. When a trial takes several, at a tolerance of 1e-5 for
/// their own error, to 1e-3 of the largest share in all motions of the same unit: how long steps are changes with what is
/// given, within a tolerance that is one of the motion as a whole.
#[test]
fn partials_match_finite_differences() {
    for formulation in FORMULATIONS {
        let cases = [
            (1e-3, Mode::Static, 0.0, 1e-3, 1e-6),
            (1e-3, Mode::Transient, 5e-9, 1e-2, 1e-6),
            (1e-5, Mode::Transient, 1e-7, 1e-2, 1e-3),
        ];
        for (tol, mode, dt, share, tolerance) in cases {
            let mut device = all(&compiled_to(tol, SHUTTLE, formulation));
            let rest = ask(&mut device, Mode::Static, None, 0.0, &given(formulation, 0.8));
            let moving = ask(&mut device, Mode::Transient, rest.token, 3e-7, &given(formulation, 0.9));
            let parent = if mode == Mode::Static { rest.token } else { moving.token };
            let base = given(formulation, 1.0);
            let ports = ports(formulation);
            let count = ports.len();
            let at = ask(&mut device, mode, parent, dt, &base);
            for port in 0..count {
                let step = share * ports[port].2.abs();
                let replies = [2.0, 1.0, -1.0, -2.0].map(|k| {
                    let mut given = base.clone();
                    given[port] += k * step;
                    ask(&mut device, mode, parent, dt, &given)
                });
                let alike = |unit: &str| {
                    let same = |units: &'static [&str], rows: usize| {
                        let unit = unit.to_owned();
                        (0..rows).filter(move |&row| units[row] == unit)
                    };
                    largest(ports, &at.di_dv, same(&UNITS, count)).max(largest(
                        ports,
                        &at.doutputs_dv,
                        same(&OUTPUT_UNITS, OUTPUT_UNITS.len()),
                    ))
                };
                let check = |what: &str, of: &dyn Fn(&TrialReply) -> Vec<f64>, partial: &[f64], units: &[&str]| {
                    let [far_hi, hi, lo, far_lo] = replies.each_ref().map(of);
                    for row in 0..hi.len() {
                        let (near, far) = (hi[row] - lo[row], far_hi[row] - far_lo[row]);
                        let difference = (8.0 * near - far) / (12.0 * step);
                        let partials = &partial[count * row..count * (row + 1)];
                        let several = tolerance > 1e-6 && units[row].starts_with(['m', 'r']);
                        let scale =
                            if several { alike(units[row]) } else { largest(ports, partial, std::iter::once(row)) };
                        let scale = scale / ports[port].2.abs();
                        let rounding = 4.0 * f64::EPSILON * hi[row].abs() / step;
                        let error = (difference - partials[port]).abs();
                        assert!(
                            error <= tolerance * scale + rounding,
                            "{formulation:?} {mode:?} dt={dt:e} {what}[{row}]/{}: {difference:e} {:e} of {scale:e}",
                            ports[port].0,
                            partials[port],
                        );
                    }
                };
                check("charge", &|r| r.charges.clone(), &at.dq_dv, &["C"; PORTS.len()]);
                check("answer", &|r| r.currents.clone(), &at.di_dv, &UNITS);
                check("output", &|r| r.outputs.clone(), &at.doutputs_dv, &OUTPUT_UNITS);
            }
        }
    }
}

/// Reciprocity: what a force at one place moves at another, the other moves here, to 1e-9, at rest under load, at DC and at
/// frequencies on both sides of the first mode (Maxwell 1864, Betti 1872). Charge and force at an electrical port likewise:
/// ∂q/∂F = −∂x/∂V with the sign of a port that is given a force, ∂q/∂F = ∂x/∂V.
#[test]
fn ports_are_reciprocal() {
    let ports = ["s.x", "c.y", "c.rz", "shake", "s.y"];
    let mut device = opened(&compiled(SHUTTLE, Formulation::Compliant), &ports, &[]);
    let rest = ask(&mut device, Mode::Static, None, 0.0, &[1e-6, 2e-6, 1e-10, 8.0, -1e-6]);
    let n = ports.len();
    let electrical = 3;
    let flow = |row: usize, column: usize| {
        if row == electrical { rest.dq_dv[row * n + column] } else { rest.di_dv[row * n + column] }
    };
    let scale = |row: usize, column: usize| (flow(row, row) * flow(column, column)).abs().sqrt();
    for row in 0..n {
        for column in 0..row {
            let (a, b) = (flow(row, column), flow(column, row));
            assert!((a - b).abs() <= 1e-9 * scale(row, column), "{row} {column}: {a:e} {b:e}");
        }
    }
    let mut small = SmallSignal::default();
    for omega in [1.0, 1e5, 3e6, 2e7] {
        device.linearize(rest.token.unwrap(), omega, &mut small).unwrap();
        // i = iω·q
        let flow = |row: usize, column: usize| {
            let [re, im] = small.admittance[row * n + column];
            if row == electrical { [im / omega, -re / omega] } else { [re, im] }
        };
        let size = |z: [f64; 2]| z[0].hypot(z[1]);
        for row in 0..n {
            for column in 0..row {
                let (a, b) = (flow(row, column), flow(column, row));
                let scale = (size(flow(row, row)) * size(flow(column, column))).sqrt();
                let error = size([a[0] - b[0], a[1] - b[1]]);
                assert!(error <= 1e-9 * scale, "{omega:e}: {row} {column}: {a:?} {b:?}");
            }
        }
    }
}

/// A lumped mass m on a spring k with a damper c.
const OSCILLATOR: &str = "
anchor * [f] [l=1u w=1u h=1u]
mass2d * [m] [m=1e-10]
guide2d * [m] []
spring2d * [f m] [kx=2]
damper2d * [f m] [bx=1e-7]
";

/// Static: x = F/k and x = −m·a/k to rounding. In time: after a step of the acceleration the closed form of the damped
/// oscillator to the tolerance of 1e-3 and better, with internal steps of its own.
#[test]
fn forces_and_accelerations_move_a_mass() {
    let (m, k, c): (f64, f64, f64) = (1e-10, 2.0, 1e-7);
    for formulation in [Formulation::Compliant] {
        let mut device = opened(&compiled(OSCILLATOR, formulation), &["m.x", "frame.ax"], &["m.vx"]);
        let still = ask(&mut device, Mode::Static, None, 0.0, &[3e-6, 500.0]);
        let exact = (3e-6 - m * 500.0) / k;
        assert!((still.currents[0] / exact - 1.0).abs() < 1e-12, "{:e}", still.currents[0]);
        assert!((still.di_dv[0] * k - 1.0).abs() < 1e-12 && (still.di_dv[1] / (-m / k) - 1.0).abs() < 1e-12);
        assert_eq!(still.currents[1], 0.0, "a frame's port draws nothing");
        // from rest at a = 1e4 m/s², held
        let (omega, zeta) = ((k / m).sqrt(), c / (2.0 * (k * m).sqrt()));
        let mut at = ask(&mut device, Mode::Static, None, 0.0, &[0.0, 0.0]);
        let (a, sag) = (1e4, -m * 1e4 / k);
        at = ask(&mut device, Mode::Transient, at.token, 1e-12, &[0.0, a]);
        let mut t: f64 = 0.0;
        for _ in 0..200 {
            at = ask(&mut device, Mode::Transient, at.token, 2e-7, &[0.0, a]);
            t += 2e-7;
            let turn = omega * (1.0 - zeta * zeta).sqrt();
            let swing = (turn * t).cos() + zeta / (1.0 - zeta * zeta).sqrt() * (turn * t).sin();
            let exact = sag * (1.0 - (-zeta * omega * t).exp() * swing);
            assert!((at.currents[0] - exact).abs() < 1e-4 * sag.abs(), "{t:e}: {:e} {exact:e}", at.currents[0]);
        }
    }
}

/// A watt given to a beam acts as a watt of its own current: V²/R through the port's heat and V at its ends leave the same
/// rise, that of V²/(12ρk) (Carslaw & Jaeger §4.9), steady and with its lag.
#[test]
fn heat_given_is_heat_of_a_current() {
    const HEATER: &str = "
    process p = [ Youngsmodulus=165e9 density=2300 h=2u thermalexpansion=2.7e-6 thermcond=34 ambienttemperature=300 ]
    anchor p [a] []
    hot beam2det p [a b] [l=200u w=2u R=1k tau=30u]
    anchor p [b] []
    mass2d * [m] [m=1e-12]
    spring2d * [a m] [kx=1 ky=1 krz=1e-12]
    eground * [b] []
    heat port * [a] []
    ";
    for formulation in FORMULATIONS {
        if formulation == Formulation::Rcr {
            continue;
        }
        let model = compiled(HEATER, formulation);
        let mut device = opened(&model, &["heat", "hot.T"], &["hot.T"]);
        let watts = 1.5f64 * 1.5 / 1e3;
        let by_current = ask(&mut device, Mode::Static, None, 0.0, &[1.5, 0.0]);
        let by_heat = ask(&mut device, Mode::Static, None, 0.0, &[0.0, watts]);
        let exact = watts * 200e-6 / (12.0 * 34.0 * 4e-12);
        for reply in [&by_current, &by_heat] {
            assert!((reply.currents[1] / exact - 1.0).abs() < 1e-12, "{}", reply.currents[1]);
            assert!((reply.outputs[0] - 300.0 - exact).abs() < 1e-9);
        }
        let cold = ask(&mut device, Mode::Static, None, 0.0, &[0.0, 0.0]);
        let on = ask(&mut device, Mode::Transient, cold.token, 1e-15, &[0.0, watts]);
        let later = ask(&mut device, Mode::Transient, on.token, 30e-6, &[0.0, watts]);
        let lag = exact * (1.0 - (-1.0f64).exp());
        assert!((later.currents[1] / lag - 1.0).abs() < 1e-9, "{}", later.currents[1]);
    }
}

/// What cannot be a port is refused with the reason.
#[test]
fn impossible_ports_are_refused() {
    let mut device = LocalDevice::new(compiled(SHUTTLE, Formulation::Compliant));
    let mut open = |port: &str| device.open(&OpenRequest { ports: vec![port.into()], signals: vec![], noise: None });
    assert!(matches!(open("s.z"), Err(DeviceError::UnknownPort { .. })));
    for (port, why) in [("a.x", "held"), ("rod.T", "beam2det"), ("drive.q", "monitored")] {
        match open(port) {
            Err(DeviceError::BadRequest { what: "ports", got, .. }) => assert!(got.contains(why), "{got}"),
            other => panic!("{port}: {other:?}"),
        }
    }
    let mut device = LocalDevice::new(compiled(SHUTTLE, Formulation::Rcr));
    match device.open(&OpenRequest { ports: vec!["frame.wz".into()], signals: vec![], noise: None }) {
        Err(DeviceError::BadRequest { expected, .. }) => assert!(expected.contains("compliant"), "{expected}"),
        other => panic!("{other:?}"),
    }
}

/// A mass of 1e-9 kg, drawn 30 µm along x, on springs along x and y and about z.
const GYROSCOPE: &str = "
anchor * [f] [l=1u w=1u h=1u]
mass2d * [m] [m=1e-9 J=1e-18]
spring2d * [f m] [kx=4 ky=4.2 krz=1e-8 l=30u]
damper2d * [f m] [bx=8e-8 by=8e-8 brz=1e-15 l=30u]
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

/// While the rate of the frame goes up and down again and a force pushes, the mass follows
/// m·(q̈ + 2Ω e×q̇ + Ω̇ e×r − Ω²r) + c·q̇ + k·q = F and J·(θ̈ + Ω̇) + … = 0: to 1e-5 of its reach against the classical Runge-Kutta
/// method with steps of 20 ns.
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

/// In small signals about a steady rate the two modes are coupled: the exact answer of two degrees of freedom, 1e-9, far from
/// the resonances, between them and on them, at rates at which Coriolis' force is many times that of the dampers.
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
