//! Macro steps: points that are far shorter than the steps of the motion, against a far smaller tolerance, against a mean square, and by the contract of
//! every device.

use bimorph_device::local::LocalDevice;
use bimorph_device::{Device, Mode, OpenRequest, Status, Token, Trial, TrialReply};
use bimorph_model::compile::{CompileOptions, CompiledModel, Formulation, Junctions, draw};
use bimorph_model::options::PortRanges;
use bimorph_netlist::{NetlistSource, read_bundle};
use std::f64::consts::TAU;
use std::path::Path;
use std::sync::Arc;

/// A mechanism: its netlist in the examples, signals of a displacement and its rate, and voltages of its ports in the equilibrium that runs begin from. The
/// first port is driven.
struct MultirateExample {
    file: &'static str,
    signals: [&'static str; 2],
    rest: &'static [f64],
    /// Factor of the lengths of points: the mechanisms differ in speed (1).
    pace: f64,
    /// Ranges of the ports of a reduced model; none: the full one.
    ranges: Option<&'static str>,
    /// Segments of each beam.
    segments: usize,
    /// Largest error of rates over edges, of their range (1).
    rates: f64,
}

impl MultirateExample {
    /// A tolerance that its formulation has.
    fn tol(&self) -> f64 {
        if self.ranges.is_some() { 1e-2 } else { TOL }
    }
}

/// One voltage across all gaps; the switch closes at 17.84 V.
const SWITCH: MultirateExample = MultirateExample {
    file: "switch/switch.net",
    signals: ["a(8).y", "a(8).vy"],
    rest: &[4.0],
    pace: 1.0,
    ranges: None,
    segments: 1,
    rates: 2e-2,
};
/// Every other body of its beams has no rotary inertia, and its gaps turn these bodies, too.
const FINE_SWITCH: MultirateExample = MultirateExample { segments: 2, rates: 8e-2, ..SWITCH };
/// Two voltages; that of the second comb is constant, so that its current is one of the motion.
const COMB: MultirateExample = MultirateExample {
    file: "comb_resonator/comb_resonator.net",
    signals: ["shuttle.x", "shuttle.vx"],
    rest: &[4.0, 20.0],
    pace: 30.0,
    ranges: None,
    segments: 1,
    rates: 2e-2,
};
/// The comb as a reduced model.
const REDUCED_COMB: MultirateExample = MultirateExample { ranges: Some("drive:0:20,sense:0:25"), segments: 2, ..COMB };
const TOL: f64 = 1e-3;

fn compiled(example: &MultirateExample, tol: f64) -> Arc<CompiledModel> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples").join(example.file);
    let bundle = read_bundle(&path, &[]).unwrap();
    let junctions = Junctions::Centreline;
    let formulation = if example.ranges.is_some() { Formulation::Reduced } else { Formulation::default() };
    let segments = Some(example.segments);
    let ranges = example.ranges.map(|text| PortRanges::parse(text).unwrap());
    let options = CompileOptions { junctions, segments, tol, formulation, ranges, ..CompileOptions::default() };
    Arc::new(
        draw(&NetlistSource::new(&bundle), &options)
            .and_then(|drawn| drawn.compile())
            .unwrap_or_else(|e| panic!("{e}")),
    )
}

fn opened(example: &MultirateExample, compiled: &Arc<CompiledModel>) -> LocalDevice {
    let mut device = LocalDevice::new(Arc::clone(compiled));
    let signals = example.signals.map(String::from).to_vec();
    device.open(&OpenRequest { ports: Vec::new(), signals, noise: None }).unwrap();
    device
}

/// A trial with the first port at `volts`, the others as in the equilibrium.
fn ask(
    (example, device): (&MultirateExample, &mut LocalDevice),
    mode: Mode,
    parent: Option<Token>,
    dt: f64,
    volts: f64,
) -> TrialReply {
    let mut reply = TrialReply::default();
    let voltages: Vec<f64> = std::iter::once(volts).chain(example.rest[1..].iter().copied()).collect();
    device.trial(&Trial { mode, parent, t: 0.0, dt, voltages: &voltages }, &mut reply).unwrap();
    assert_eq!(reply.status, Status::Ok);
    reply
}

/// Lengths of points (s) and voltages of the first port (V) that a fixed sequence makes, as of a circuit with edges: bursts of points of some tenths of a
/// nanosecond, then longer ones. An edge comes `every` some points.
fn edges(example: &MultirateExample, points: u32, every: u32) -> impl Iterator<Item = (f64, f64)> {
    let mut seed = 12345u32;
    let mut random = move || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(seed >> 8) / f64::from(1u32 << 24)
    };
    let (mut volts, pace) = (example.rest[0], example.pace);
    (0..points).map(move |k| {
        if k % every == 0 {
            volts = 10.0 * random();
        }
        (pace * 1e-10 * 30f64.powf(random()), volts + 0.2 * random())
    })
}

/// A run over `(length, voltage)` of points from the equilibrium at the voltage `rest`: replies, each accepted.
fn run(
    (example, device): (&MultirateExample, &mut LocalDevice),
    rest: f64,
    points: impl Iterator<Item = (f64, f64)>,
) -> Vec<TrialReply> {
    let mut replies = vec![ask((example, device), Mode::Static, None, 0.0, rest)];
    for (dt, volts) in points {
        let reply = ask((example, device), Mode::Transient, replies[replies.len() - 1].token, dt, volts);
        device.accept(reply.token.unwrap());
        replies.push(reply);
    }
    replies
}

/// Edges of a circuit push the part by the same impulses as at a thousandth of the tolerance: displacements within half of the tolerance of their range.
/// Rates are those of higher modes in part, which edges set off and the error of a step weighs little: 1.5e-2 of the switch, 1.2e-2 with steps at every point.
/// With two segments a beam they are 7.4e-2 and 7.8e-2.
#[test]
fn no_impulse_is_lost() {
    for example in [&SWITCH, &FINE_SWITCH, &COMB, &REDUCED_COMB] {
        let tol = example.tol();
        // at a thousandth of the tolerance a reduced model is the full one
        let [run, exact] = [tol, 1e-3 * TOL].map(|tol| {
            let device = &mut opened(example, &compiled(example, tol));
            run((example, device), example.rest[0], edges(example, 3000, 7))
        });
        for (k, most) in [0.5 * tol, example.rates].into_iter().enumerate() {
            let range = exact.iter().fold(0.0f64, |all, reply| all.max((reply.outputs[k] - exact[0].outputs[k]).abs()));
            let ends = run.iter().zip(&exact);
            let worst = ends.map(|(a, b)| (a.outputs[k] - b.outputs[k]).abs()).fold(0.0, f64::max) / range;
            assert!(worst < most, "{}: {worst:e}", example.signals[k]);
        }
    }
}

/// A voltage that alternates far faster than the part moves acts by its mean square, which for a sine is half the square of its height.
#[test]
fn an_alternating_voltage_acts_by_its_mean_square() {
    let compiled = compiled(&SWITCH, TOL);
    let (height, frequency, points) = (10.0, 2e8, 16);
    let dt = 1.0 / frequency / f64::from(points);
    let cycles = 400;
    let sine = (1..=cycles * points).map(|k| (dt, height * (TAU * f64::from(k) / f64::from(points)).sin()));
    // the square of a line between points, over the cycle
    let chord = (2.0 + (TAU / f64::from(points)).cos()) / 3.0;
    let constant = (1..=cycles).map(|_| (dt * f64::from(points), height * (0.5 * chord).sqrt()));
    let y = |replies: Vec<TrialReply>| replies[replies.len() - 1].outputs[0] - replies[0].outputs[0];
    let alternating = y(run((&SWITCH, &mut opened(&SWITCH, &compiled)), 0.0, sine));
    // from rest at once, as the sine does
    let device = &mut opened(&SWITCH, &compiled);
    let start = ask((&SWITCH, device), Mode::Static, None, 0.0, 0.0);
    let mut state = ask((&SWITCH, device), Mode::Transient, start.token, 1e-15, height * (0.5 * chord).sqrt());
    for (dt, volts) in constant {
        state = ask((&SWITCH, device), Mode::Transient, state.token, dt, volts);
    }
    let steady = state.outputs[0] - start.outputs[0];
    assert!(steady.abs() > 1e-9, "{steady:e}");
    assert!((alternating - steady).abs() < TOL * steady.abs(), "{alternating:e} {steady:e}");
}

/// The displayed motion has no jump where a macro step begins, ends, or is left for ordinary steps, as an edge of the voltage in each hundred points makes
/// it: rates are those of the displacements.
#[test]
fn motion_has_no_jumps() {
    for (example, height) in [(&SWITCH, 8.0), (&SWITCH, 4.0), (&FINE_SWITCH, 4.0), (&COMB, 10.0), (&REDUCED_COMB, 10.0)]
    {
        let dt = example.pace * 5e-10;
        let device = &mut opened(example, &compiled(example, example.tol()));
        let steps = (0..2000).map(|k| (dt, if k % 100 < 50 { 8.0 } else { height }));
        let replies = run((example, device), example.rest[0], steps);
        let largest = replies.iter().fold(0.0f64, |all, reply| all.max(reply.outputs[1].abs()));
        for ends in replies.windows(2) {
            let rate = (ends[1].outputs[0] - ends[0].outputs[0]) / dt;
            let middle = 0.5 * (ends[0].outputs[1] + ends[1].outputs[1]);
            assert!((rate - middle).abs() < 2e-3 * largest, "{}: {rate:e} {middle:e}", example.file);
        }
    }
}

/// The current into a comb at a constant voltage is that voltage times the slope of the capacitance and the speed. That holds in points of a tenth of a
/// nanosecond, too, in which an edge of the other voltage ends a macro step. A jump of the displayed motion there makes 5e-4 of the largest speed.
#[test]
fn currents_of_the_motion_have_no_spikes() {
    for example in [&COMB, &REDUCED_COMB] {
        let device = &mut opened(example, &compiled(example, example.tol()));
        let points: Vec<(f64, f64)> =
            (0..2000).map(|k| (if k % 50 == 0 { 1e-10 } else { 1e-8 }, if k % 100 < 50 { 9.0 } else { 2.0 })).collect();
        let replies = run((example, device), example.rest[0], points.iter().copied());
        let largest = replies.iter().fold(0.0f64, |all, reply| all.max(reply.outputs[1].abs()));
        let way = |ends: &[TrialReply]| ends[1].outputs[0] - ends[0].outputs[0];
        let charge = |ends: &[TrialReply]| ends[1].charges[1] - ends[0].charges[1];
        // of the longest way in a point, where differences have the most digits
        let longest = replies.windows(2).max_by(|a, b| way(a).abs().total_cmp(&way(b).abs())).unwrap();
        let per_way = charge(longest) / way(longest);
        for (ends, (dt, _)) in replies.windows(2).zip(&points) {
            let speed = 0.5 * (ends[0].outputs[1] + ends[1].outputs[1]);
            let spike = (charge(ends) / (per_way * dt) - speed).abs();
            assert!(spike < 5e-5 * largest, "{spike:e} of {largest:e} m/s in {dt:e} s");
        }
    }
}

/// The trials of a run have the same bits alone and among others of other lengths and voltages, from the same states and from earlier ones, and in
/// devices that continue from a snapshot.
#[test]
fn trials_are_pure() {
    for example in [&SWITCH, &FINE_SWITCH, &COMB, &REDUCED_COMB] {
        let compiled = compiled(example, example.tol());
        // macro steps have tolerances relative to the motion so far
        let steps = (0..30).map(|_| (example.pace * 2e-8, 8.0));
        let points: Vec<(f64, f64)> = steps.chain(edges(example, 400, 100)).collect();
        let rest = example.rest[0];
        let alone = run((example, &mut opened(example, &compiled)), rest, points.iter().copied());
        let device = &mut opened(example, &compiled);
        let mut last = ask((example, device), Mode::Static, None, 0.0, rest);
        let at_rest = device.save(last.token.as_ref().map(std::slice::from_ref)).unwrap().len();
        let mut before = last.token;
        let mut in_macro_steps = 0;
        for (k, (&(dt, volts), expected)) in points.iter().zip(&alone[1..]).enumerate() {
            match k % 5 {
                0 => drop(ask((example, device), Mode::Transient, last.token, 1e-7, volts)),
                1 => drop(ask((example, device), Mode::Transient, before, 0.4 * dt, 0.5 * volts)),
                2 => drop(ask((example, device), Mode::Transient, last.token, 3.0 * dt, volts + 5.0)),
                3 => {
                    let saved = device.save(last.token.as_ref().map(std::slice::from_ref)).unwrap();
                    // a macro step has the motion at its start twice, and an offset is one
                    in_macro_steps += u32::from(2 * saved.len() > 3 * at_rest);
                    *device = opened(example, &compiled);
                    device.load(&saved).unwrap();
                }
                _ => {}
            }
            let reply = ask((example, device), Mode::Transient, last.token, dt, volts);
            assert_eq!(reply, *expected, "{k}");
            (before, last) = (last.token, reply);
            device.accept(last.token.unwrap());
        }
        // else nothing was tried
        assert!(in_macro_steps > 20, "{}: {in_macro_steps} of 86", example.file);
    }
}

/// Points of any length within a macro step have finite outputs and a positive bound of the next one, or fail.
#[test]
fn points_of_any_length_are_answered() {
    for example in [&SWITCH, &FINE_SWITCH, &COMB, &REDUCED_COMB] {
        let device = &mut opened(example, &compiled(example, example.tol()));
        let rest = example.rest[0];
        let replies = run((example, device), rest, edges(example, 60, 7));
        let parent = replies[replies.len() - 1].token;
        for dt in [f64::from_bits(1), f64::MIN_POSITIVE, 1e-300, 1e-25, 1e-15, 1e-9, 1.0] {
            for volts in [rest, 0.0, -rest, 1e6, -1e30, f64::MAX] {
                let mut reply = TrialReply::default();
                let voltages: Vec<f64> = example.rest.iter().map(|_| volts).collect();
                let trial = Trial { mode: Mode::Transient, parent, t: 0.0, dt, voltages: &voltages };
                device.trial(&trial, &mut reply).unwrap();
                let finite = || reply.outputs.iter().chain(&reply.charges).chain(&reply.dq_dv).all(|x| x.is_finite());
                let answered = reply.status != Status::Ok || finite() && reply.dt_next > 0.0;
                assert!(answered, "{dt:e} s, {volts:e} V: {reply:?}");
            }
        }
    }
}
