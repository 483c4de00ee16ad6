//! Macro steps: points that are far shorter than the steps of the motion, against a far smaller tolerance, against a mean square, and by the contract of
//! every device.

use bimorph_device::local::LocalDevice;
use bimorph_device::{Device, Mode, OpenRequest, Status, Token, Trial, TrialReply};
use bimorph_model::compile::{CompileOptions, CompiledModel, Junctions, draw};
use bimorph_netlist::{NetlistSource, read_bundle};
use std::f64::consts::TAU;
use std::path::Path;
use std::sync::Arc;

const SIGNALS: [&str; 2] = ["a(8).y", "a(8).vy"];
/// Voltage of the equilibrium that runs begin from; the switch closes at 17.84 V.
const REST: f64 = 4.0;
const TOL: f64 = 1e-3;

fn compiled(tol: f64) -> Arc<CompiledModel> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/switch/switch.net");
    let bundle = read_bundle(&path, &[]).unwrap();
    let junctions = Junctions::Centreline;
    let options = CompileOptions { junctions, segments: Some(1), tol, ..CompileOptions::default() };
    Arc::new(
        draw(&NetlistSource::new(&bundle), &options)
            .and_then(|drawn| drawn.compile())
            .unwrap_or_else(|e| panic!("{e}")),
    )
}

fn opened(compiled: &Arc<CompiledModel>) -> LocalDevice {
    let mut device = LocalDevice::new(Arc::clone(compiled));
    device.open(&OpenRequest { ports: Vec::new(), signals: SIGNALS.map(String::from).to_vec(), noise: None }).unwrap();
    device
}

fn ask(device: &mut LocalDevice, mode: Mode, parent: Option<Token>, dt: f64, volts: f64) -> TrialReply {
    let mut reply = TrialReply::default();
    device.trial(&Trial { mode, parent, t: 0.0, dt, voltages: &[volts] }, &mut reply).unwrap();
    assert_eq!(reply.status, Status::Ok);
    reply
}

/// Lengths of points (s) and voltages (V) that a fixed sequence makes, as of a circuit with edges: bursts of points of some tenths of a nanosecond, then
/// longer ones.
fn edges(points: u32) -> impl Iterator<Item = (f64, f64)> {
    let mut seed = 12345u32;
    let mut random = move || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(seed >> 8) / f64::from(1u32 << 24)
    };
    let mut volts = REST;
    (0..points).map(move |k| {
        if k % 7 == 0 {
            volts = 10.0 * random();
        }
        (1e-10 * 30f64.powf(random()), volts + 0.2 * random())
    })
}

/// A run over `(length, voltage)` of points from the equilibrium at `rest`: replies, each accepted.
fn run(device: &mut LocalDevice, rest: f64, points: impl Iterator<Item = (f64, f64)>) -> Vec<TrialReply> {
    let mut replies = vec![ask(device, Mode::Static, None, 0.0, rest)];
    for (dt, volts) in points {
        let reply = ask(device, Mode::Transient, replies[replies.len() - 1].token, dt, volts);
        device.accept(reply.token.unwrap());
        replies.push(reply);
    }
    replies
}

/// Edges of a circuit push the part by the same impulses as at a thousandth of the tolerance: displacements within half of the tolerance of their range.
/// Rates are those of higher modes in part, which edges set off and the error of a step weighs little: 1.5e-2 here, 1.2e-2 with steps at every point.
#[test]
fn no_impulse_is_lost() {
    let [run, exact] = [TOL, 1e-3 * TOL].map(|tol| run(&mut opened(&compiled(tol)), REST, edges(3000)));
    for (k, most) in [0.5 * TOL, 2e-2].into_iter().enumerate() {
        let range = exact.iter().fold(0.0f64, |all, reply| all.max((reply.outputs[k] - exact[0].outputs[k]).abs()));
        let ends = run.iter().zip(&exact);
        let worst = ends.map(|(a, b)| (a.outputs[k] - b.outputs[k]).abs()).fold(0.0, f64::max) / range;
        assert!(worst < most, "{}: {worst:e}", SIGNALS[k]);
    }
}

/// A voltage that alternates far faster than the part moves acts by its mean square, which for a sine is half the square of its height.
#[test]
fn an_alternating_voltage_acts_by_its_mean_square() {
    let compiled = compiled(TOL);
    let (height, frequency, points) = (10.0, 2e8, 16);
    let dt = 1.0 / frequency / f64::from(points);
    let cycles = 400;
    let sine = (1..=cycles * points).map(|k| (dt, height * (TAU * f64::from(k) / f64::from(points)).sin()));
    // the square of a line between points, over the cycle
    let chord = (2.0 + (TAU / f64::from(points)).cos()) / 3.0;
    let constant = (1..=cycles).map(|_| (dt * f64::from(points), height * (0.5 * chord).sqrt()));
    let y = |replies: Vec<TrialReply>| replies[replies.len() - 1].outputs[0] - replies[0].outputs[0];
    let alternating = y(run(&mut opened(&compiled), 0.0, sine));
    // from rest at once, as the sine does
    let mut device = opened(&compiled);
    let start = ask(&mut device, Mode::Static, None, 0.0, 0.0);
    let mut state = ask(&mut device, Mode::Transient, start.token, 1e-15, height * (0.5 * chord).sqrt());
    for (dt, volts) in constant {
        state = ask(&mut device, Mode::Transient, state.token, dt, volts);
    }
    let steady = state.outputs[0] - start.outputs[0];
    assert!(steady.abs() > 1e-9, "{steady:e}");
    assert!((alternating - steady).abs() < TOL * steady.abs(), "{alternating:e} {steady:e}");
}

/// The displayed motion has no jump where a macro step ends: rates are those of the displacements.
#[test]
fn motion_has_no_jumps() {
    let dt = 5e-10;
    let mut device = opened(&compiled(TOL));
    let replies = run(&mut device, REST, (0..2000).map(|_| (dt, 8.0)));
    let largest = replies.iter().fold(0.0f64, |all, reply| all.max(reply.outputs[1].abs()));
    for ends in replies.windows(2) {
        let rate = (ends[1].outputs[0] - ends[0].outputs[0]) / dt;
        let middle = 0.5 * (ends[0].outputs[1] + ends[1].outputs[1]);
        assert!((rate - middle).abs() < 2e-3 * largest, "{rate:e} {middle:e}");
    }
}

/// The trials of a run have the same bits alone and among others of other lengths and voltages, from the same states and from earlier ones, and in
/// devices that continue from a snapshot.
#[test]
fn trials_are_pure() {
    let compiled = compiled(TOL);
    let points: Vec<(f64, f64)> = edges(300).collect();
    let alone = run(&mut opened(&compiled), REST, points.iter().copied());
    let mut device = opened(&compiled);
    let mut last = ask(&mut device, Mode::Static, None, 0.0, REST);
    let mut before = last.token;
    let mut in_macro_steps = 0;
    for (k, (&(dt, volts), expected)) in points.iter().zip(&alone[1..]).enumerate() {
        match k % 5 {
            0 => drop(ask(&mut device, Mode::Transient, last.token, 1e-7, volts)),
            1 => drop(ask(&mut device, Mode::Transient, before, 0.4 * dt, 0.5 * volts)),
            2 => drop(ask(&mut device, Mode::Transient, last.token, 3.0 * dt, volts + 5.0)),
            3 => {
                let saved = device.save(last.token.as_ref().map(std::slice::from_ref)).unwrap();
                in_macro_steps += u32::from(saved.starts_with(b"bimorph\x05"));
                device = opened(&compiled);
                device.load(&saved).unwrap();
            }
            _ => {}
        }
        let reply = ask(&mut device, Mode::Transient, last.token, dt, volts);
        assert_eq!(reply, *expected, "{k}");
        (before, last) = (last.token, reply);
        device.accept(last.token.unwrap());
    }
    // else nothing was tried
    assert!(in_macro_steps > 30, "{in_macro_steps} of 60");
}

/// Points of any length within a macro step have finite outputs and a positive bound of the next one, or fail.
#[test]
fn points_of_any_length_are_answered() {
    let mut device = opened(&compiled(TOL));
    let replies = run(&mut device, REST, edges(60));
    let parent = replies[replies.len() - 1].token;
    for dt in [f64::from_bits(1), f64::MIN_POSITIVE, 1e-300, 1e-25, 1e-15, 1e-9, 1.0] {
        for volts in [REST, 0.0, -REST, 1e6, -1e30, f64::MAX] {
            let mut reply = TrialReply::default();
            device.trial(&Trial { mode: Mode::Transient, parent, t: 0.0, dt, voltages: &[volts] }, &mut reply).unwrap();
            let finite = || reply.outputs.iter().chain(&reply.charges).chain(&reply.dq_dv).all(|x| x.is_finite());
            assert!(reply.status != Status::Ok || finite() && reply.dt_next > 0.0, "{dt:e} s, {volts:e} V: {reply:?}");
        }
    }
}
