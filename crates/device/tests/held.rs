//! Trials about the held motion of a point: short points of a bank, of a switch that is open, and of one that is closed.

use bimorph_device::local::LocalDevice;
use bimorph_device::{Device, Mode, OpenRequest, Status, Token, Trial, TrialReply};
use bimorph_model::compile::{CompileOptions, draw};
use bimorph_netlist::{NetlistSource, read_bundle};
use std::path::Path;
use std::sync::Arc;

/// A model, its signals, port voltages of an equilibrium and of a motion from there, and a short point (s).
struct ShortPoint {
    name: &'static str,
    signals: &'static [&'static str],
    rest: &'static [f64],
    moved: &'static [f64],
    short: f64,
}

const POINTS: [ShortPoint; 3] = [
    ShortPoint {
        name: "bank",
        signals: &["yoke.y", "yoke.vy", "b1.hot.T"],
        rest: &[1.0, 10.0],
        moved: &[1.2, 11.0],
        short: 1e-8,
    },
    ShortPoint { name: "switch", signals: &["a(8).y", "a(8).vy"], rest: &[8.0], moved: &[9.0], short: 1e-9 },
    ShortPoint { name: "switch", signals: &["a(8).y", "a(8).vy"], rest: &[25.0], moved: &[24.0], short: 2e-10 },
];

impl ShortPoint {
    fn open(&self) -> LocalDevice {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../examples/{0}/{0}.net", self.name));
        let bundle = read_bundle(&path, &[]).unwrap();
        let options = CompileOptions { segments: Some(2), ..CompileOptions::default() };
        let compiled = draw(&NetlistSource::new(&bundle), &options).and_then(|drawn| drawn.compile());
        let mut device = LocalDevice::new(Arc::new(compiled.unwrap_or_else(|e| panic!("{e}"))));
        let signals = self.signals.iter().map(|name| (*name).to_owned()).collect();
        device.open(&OpenRequest { ports: Vec::new(), signals, noise: None }).unwrap();
        device
    }

    /// A state in motion.
    fn moving(&self, device: &mut LocalDevice) -> Option<Token> {
        let mut state = ask(device, Mode::Static, None, 0.0, self.rest).token;
        for _ in 0..5 {
            state = ask(device, Mode::Transient, state, 5.0 * self.short, self.moved).token;
        }
        state
    }

    /// The voltages of the motion, of each port `part` of itself more.
    fn near(&self, part: f64) -> Vec<f64> {
        self.moved.iter().map(|v| v * (1.0 + part)).collect()
    }
}

fn ask(device: &mut LocalDevice, mode: Mode, parent: Option<Token>, dt: f64, voltages: &[f64]) -> TrialReply {
    let mut reply = TrialReply::default();
    device.trial(&Trial { mode, parent, t: 0.0, dt, voltages }, &mut reply).unwrap();
    assert_eq!(reply.status, Status::Ok);
    reply
}

/// A trial has the same bits whatever was tried before it: the same voltages, others about the held motion, others that have one of their own, and
/// points of other lengths.
#[test]
fn trials_do_not_depend_on_those_before() {
    for example in &POINTS {
        let parts = [0.0, 1e-6, 1e-3, 0.7, -0.2];
        let mut alone = Vec::new();
        for part in parts {
            let mut device = example.open();
            let parent = example.moving(&mut device);
            alone.push(ask(&mut device, Mode::Transient, parent, example.short, &example.near(part)));
        }
        let mut device = example.open();
        let parent = example.moving(&mut device);
        for k in 0..3 * parts.len() {
            let (part, expected) = (parts[(2 * k) % parts.len()], &alone[(2 * k) % parts.len()]);
            assert_eq!(ask(&mut device, Mode::Transient, parent, example.short, &example.near(part)), *expected);
            if k % 2 == 0 {
                ask(&mut device, Mode::Transient, parent, 0.3 * example.short, &example.near(0.1));
            }
        }
    }
}

/// Partials are those of fourth-order differences, to 1e-6 of the largest entry of each row: the held motion is linear in the voltages.
#[test]
fn partials_match_finite_differences() {
    for example in &POINTS {
        let mut device = example.open();
        let parent = example.moving(&mut device);
        let about = ask(&mut device, Mode::Transient, parent, example.short, example.moved);
        let ports = example.moved.len();
        let rows = |reply: &TrialReply| [&reply.charges[..], &reply.outputs[..]].concat();
        let partials = [&about.dq_dv[..], &about.doutputs_dv[..]].concat();
        let mut found = vec![0.0; partials.len()];
        for port in 0..ports {
            let step = 1e-5 * example.moved[port];
            for (weight, n) in [(1.0, -2.0), (-8.0, -1.0), (8.0, 1.0), (-1.0, 2.0)] {
                let mut volts = example.moved.to_vec();
                volts[port] += n * step;
                let reply = ask(&mut device, Mode::Transient, parent, example.short, &volts);
                for (row, (value, middle)) in rows(&reply).iter().zip(rows(&about)).enumerate() {
                    found[row * ports + port] += weight * (value - middle) / (12.0 * step);
                }
            }
        }
        for (row, (found, partials)) in found.chunks(ports).zip(partials.chunks(ports)).enumerate() {
            // rates and displacements of a step of nanoseconds hardly depend on voltages: rounding of their values over the step of the difference
            let rounding = 3e-16 * rows(&about)[row].abs() / (1e-5 * example.moved[0]);
            let largest = partials.iter().fold(0.0f64, |a, b| a.max(b.abs()));
            for (found, partial) in found.iter().zip(partials) {
                let off = (found - partial).abs();
                assert!(off <= 1e-6 * largest + 20.0 * rounding, "{} {row}: {found:e} {partial:e}", example.name);
            }
        }
    }
}

/// A ramp in 400 short points comes to where it comes in 10 long ones, within the tolerance of 1e-3.
#[test]
fn short_points_come_to_where_long_ones_do() {
    for example in &POINTS {
        let ends = [(400, 1.0), (10, 40.0)].map(|(count, times)| {
            let mut device = example.open();
            let mut state = ask(&mut device, Mode::Static, None, 0.0, example.rest);
            for k in 1..=count {
                let part = f64::from(k) / f64::from(count);
                let ways = example.rest.iter().zip(example.moved);
                let volts: Vec<f64> = ways.map(|(a, b)| a + part * (b - a)).collect();
                state = ask(&mut device, Mode::Transient, state.token, times * example.short, &volts);
                device.accept(state.token.unwrap());
            }
            let rest = ask(&mut device, Mode::Static, None, 0.0, example.rest);
            (state.outputs[0] - rest.outputs[0], state.charges)
        });
        let [(short, charges), (long, others)] = ends;
        assert!((short - long).abs() < 2e-3 * long.abs(), "{}: {short:e} {long:e}", example.name);
        for (a, b) in charges.iter().zip(others) {
            assert!((a - b).abs() <= 1e-4 * b.abs(), "{}: {a:e} {b:e}", example.name);
        }
    }
}

/// A point in which nothing touches does not take the internal steps of a point before in which parts touch. Its trials have the bits of a device that
/// never touched, with and without a held motion that covers the change of voltage.
#[test]
fn a_point_is_free_of_the_contact_before() {
    let [_, open, closed] = &POINTS;
    for part in [1.5, 0.5, 1e-3, 0.0] {
        let mut fresh = open.open();
        let parent = open.moving(&mut fresh);
        let expected = ask(&mut fresh, Mode::Transient, parent, open.short, &open.near(part));
        let mut device = open.open();
        let [touching, parent] = [closed, open].map(|point| point.moving(&mut device));
        ask(&mut device, Mode::Transient, touching, 40.0 * closed.short, &closed.near(0.01));
        assert_eq!(ask(&mut device, Mode::Transient, parent, open.short, &open.near(part)), expected, "{part}");
    }
}
