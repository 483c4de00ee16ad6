//! Ports that are not electrical: forces, moments, heat and the motion of the frame keep the contract of a device, in both
//! formulations, and mean what they say.

mod frame;
mod meaning;
mod sliding;

use bimorph::compile::{CompileOptions, CompiledModel, Formulation, Junctions, compile};
use bimorph::device::local::LocalDevice;
use bimorph::device::{
    Device, DeviceError, Mode, OpenRequest, PortKind, SmallSignal, Status, Token, Trial, TrialReply,
};
use bimorph::netlist::Bundle;
use std::sync::Arc;

/// A heated chevron that pushes a shuttle with a comb ahead of it and a plate beside it.
const SHUTTLE: &str = include_str!("../netlists/shuttle.net");

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

fn compiled(text: &str, formulation: Formulation) -> Arc<CompiledModel> {
    compiled_to(1e-3, text, formulation)
}

fn compiled_to(tol: f64, text: &str, formulation: Formulation) -> Arc<CompiledModel> {
    let options = CompileOptions { formulation, tol, junctions: Junctions::Centreline, ..CompileOptions::default() };
    // fingers that have room to their sides for what the ports do
    let text = text.replace("N=40 gap=2u", "N=40 gap=20u");
    Arc::new(compile(&Bundle::from_text("ports.net", &text), &options).unwrap_or_else(|e| panic!("{e}")))
}

fn opened(compiled: &Arc<CompiledModel>, ports: &[&str], signals: &[&str]) -> LocalDevice {
    let mut device = LocalDevice::new(Arc::clone(compiled));
    let names = |list: &[&str]| list.iter().map(|name| (*name).to_owned()).collect();
    device
        .open(&OpenRequest { ports: names(ports), signals: names(signals), noise: None })
        .unwrap_or_else(|e| panic!("{e}"));
    device
}

fn all(compiled: &Arc<CompiledModel>) -> LocalDevice {
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

/// The description of opened ports includes their kinds.
#[test]
fn kinds_are_reported() {
    let mut device = LocalDevice::new(compiled(SHUTTLE, Formulation::Compliant));
    let ports = PORTS.iter().map(|(name, ..)| (*name).to_owned()).collect();
    let reported = device.open(&OpenRequest { ports, signals: vec![], noise: None }).unwrap();
    for (port, (name, kind, _)) in reported.ports.iter().zip(PORTS) {
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
        // a snapshot continues with the same bits
        let bytes = device.save(rest.token.as_ref().map(std::slice::from_ref)).unwrap();
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

/// Central differences of what is answered, of charges and of outputs agree with the partials over every port: to 1e-6
/// of the row's largest share for a single internal step, where they are exact. When a trial takes several steps, at a
/// tolerance of 1e-7 for their own error, the agreement is 1e-4 of the largest contribution in all motions of the same
/// unit. The step lengths change with the input, within a tolerance of the motion as a whole.
#[test]
fn partials_match_finite_differences() {
    for formulation in FORMULATIONS {
        let cases = [
            (1e-3, Mode::Static, 0.0, 1e-3, 1e-6),
            (1e-3, Mode::Transient, 5e-9, 1e-2, 1e-6),
            (1e-7, Mode::Transient, 1e-7, 1e-2, 1e-4),
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

/// Reciprocity: the motion at one place under a force at another equals the motion at the other under the force at the
/// first. It holds to 1e-9, at rest under load, at DC and at frequencies on both sides of the first mode (Maxwell 1864,
/// Betti 1872). Charge and force at an electrical port likewise: ∂q/∂F = −∂x/∂V with the sign of a port that is given a
/// force, ∂q/∂F = ∂x/∂V.
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

/// Impossible ports are rejected with the reason.
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
