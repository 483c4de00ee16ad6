//! Sessions with `formulation=reduced`: against those of the full model of the same mesh, and by the contract of every device.

use bimorph_device::local::LocalDevice;
use bimorph_device::{Device, Mode, OpenRequest, Status, Token, Trial, TrialReply};
use bimorph_model::compile::{CompileOptions, CompiledModel, Formulation, Junctions, draw};
use bimorph_model::options::PortRanges;
use bimorph_netlist::{NetlistSource, read_bundle};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// A model, ranges of its ports, signals, and voltages of the ports in their order: at the start, later, and then within the ranges.
struct Example {
    name: &'static str,
    ranges: &'static str,
    signals: &'static [&'static str],
    rest: &'static [f64],
    moved: &'static [f64],
    /// A step that is one internal step, and one of several (s).
    steps: [f64; 2],
}

const EXAMPLES: [Example; 3] = [
    Example {
        name: "bank",
        ranges: "heat:0:2,sense:0:20",
        signals: &["yoke.y", "yoke.vy", "b1.hot.T"],
        rest: &[1.0, 10.0],
        moved: &[1.4, 12.0],
        steps: [1e-8, 3e-6],
    },
    Example {
        name: "comb_resonator",
        ranges: "drive:0:40,sense:0:20",
        signals: &["shuttle.x", "shuttle.vx"],
        rest: &[20.0, 10.0],
        moved: &[25.0, 12.0],
        steps: [5e-8, 5e-6],
    },
    Example {
        name: "switch",
        ranges: "drive:0:15",
        signals: &["a(8).y", "a(8).vy"],
        rest: &[8.0],
        moved: &[11.0],
        steps: [1e-9, 3e-8],
    },
];

fn compiled(name: &str, ranges: Option<&str>, formulation: Formulation) -> Arc<CompiledModel> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../examples/{name}/{name}.net"));
    let bundle = read_bundle(&path, &[]).unwrap();
    let options = CompileOptions {
        junctions: Junctions::Centreline,
        segments: Some(2),
        formulation,
        tol: 1e-2,
        ranges: ranges.map(|text| PortRanges::parse(text).unwrap()),
        ..CompileOptions::default()
    };
    Arc::new(
        draw(&NetlistSource::new(&bundle), &options)
            .and_then(|drawn| drawn.compile())
            .unwrap_or_else(|e| panic!("{e}")),
    )
}

impl Example {
    fn open(&self, formulation: Formulation) -> LocalDevice {
        let mut device = LocalDevice::new(compiled(self.name, Some(self.ranges), formulation));
        let signals = self.signals.iter().map(|name| (*name).to_owned()).collect();
        device.open(&OpenRequest { ports: Vec::new(), signals, noise: None }).unwrap();
        device
    }
}

fn ask(device: &mut LocalDevice, mode: Mode, parent: Option<Token>, dt: f64, voltages: &[f64]) -> TrialReply {
    let mut reply = TrialReply::default();
    device.trial(&Trial { mode, parent, t: 0.0, dt, voltages }, &mut reply).unwrap();
    assert_eq!(reply.status, Status::Ok);
    reply
}

/// Codes of the warnings of a state.
fn codes(device: &mut LocalDevice, reply: &TrialReply) -> Vec<String> {
    device.warns(reply.token.unwrap()).into_iter().map(|warning| warning.code).collect()
}

/// No state of a ramp within the ranges warns of the reduced model: its unknowns are less than a fifth of the full model's.
#[test]
fn trials_are_reduced() {
    for example in &EXAMPLES {
        let mut device = LocalDevice::new(compiled(example.name, Some(example.ranges), Formulation::Reduced));
        let opened = device.open(&OpenRequest::default()).unwrap();
        let full = example.open(Formulation::Compliant).compiled().unknowns();
        assert!(5 * opened.unknowns < full, "{}: {} of {full}", example.name, opened.unknowns);
        let (dt, volts) = (example.steps[1], ramp(example, example.steps[1]));
        let mut reply = ask(&mut device, Mode::Static, None, 0.0, example.rest);
        for k in 1..=80 {
            let warnings = device.warns(reply.token.unwrap());
            assert!(warnings.iter().all(|warning| warning.code != "W053"), "{}: {warnings:?}", example.name);
            device.accept(reply.token.unwrap());
            reply = ask(&mut device, Mode::Transient, reply.token, dt, &volts(f64::from(k) * dt));
        }
    }
}

/// A voltage that jumps within 1 ns leaves no error by the reduction, though the accelerations that the step carries have one.
#[test]
fn jumps_warn_of_no_reduction() {
    let example = &EXAMPLES[1];
    let mut device = example.open(Formulation::Reduced);
    let mut reply = ask(&mut device, Mode::Static, None, 0.0, &[2.0, 20.0]);
    let mut drive = 2.0;
    for k in 0..400 {
        // residuals are taken every twenty accepted states
        let jumps = k % 20 == 0;
        drive = if jumps { 16.0 - drive } else { drive };
        let dt = if jumps { 1e-9 } else { 2e-8 };
        reply = ask(&mut device, Mode::Transient, reply.token, dt, &[drive, 20.0]);
        let warnings = device.warns(reply.token.unwrap());
        assert!(warnings.iter().all(|warning| warning.code != "W053"), "point {k}: {warnings:?}");
        device.accept(reply.token.unwrap());
    }
}

/// `auto` has the reduced model where ranges are given and it is cheaper, and otherwise the full one without a warning: without ranges, below a tolerance of
/// 5e-3, and for a model of so few unknowns as the chevron.
#[test]
fn auto_is_reduced_within_ranges() {
    let opened = |compiled: CompiledModel| {
        let mut device = LocalDevice::new(Arc::new(compiled));
        let opened = device.open(&OpenRequest::default()).unwrap();
        let rest = ask(&mut device, Mode::Static, None, 0.0, &vec![1.0; opened.ports.len()]);
        (opened.unknowns, codes(&mut device, &rest))
    };
    let chosen = |name: &str, ranges: Option<&str>| Arc::unwrap_or_clone(compiled(name, ranges, Formulation::Auto));
    for example in &EXAMPLES {
        let reduced =
            opened(Arc::unwrap_or_clone(compiled(example.name, Some(example.ranges), Formulation::Reduced))).0;
        let given = chosen(example.name, Some(example.ranges));
        let full = (given.unknowns(), Vec::new());
        assert_eq!(opened(given.clone()), (reduced, Vec::new()), "{}", example.name);
        assert_eq!(opened(given.clone().for_given_steps()), (reduced, Vec::new()), "{}", example.name);
        assert_eq!(opened(given.with_tolerance(1e-3)), full, "{}", example.name);
        assert_eq!(opened(chosen(example.name, None)), full, "{}", example.name);
    }
    let few = chosen("chevron", Some("heat:0:3"));
    let unknowns = few.unknowns();
    assert_eq!(opened(few), (unknowns, Vec::new()));
}

/// Fourth-order differences of charges, currents and outputs agree with the partials: to 1e-6 of the largest entry of each row for a
/// single internal step, where the partials are exact, and to 1e-3 when a trial takes several.
#[test]
fn partials_match_finite_differences() {
    for example in &EXAMPLES {
        let mut device = example.open(Formulation::Reduced);
        let rest = ask(&mut device, Mode::Static, None, 0.0, example.rest);
        let moving = ask(&mut device, Mode::Transient, rest.token, example.steps[1], example.moved);
        let cases = [
            (Mode::Static, rest.token, 0.0, 1e-3, 1e-6),
            (Mode::Transient, moving.token, example.steps[0], 1e-3, 1e-6),
            (Mode::Transient, moving.token, example.steps[1], 1e-2, 1e-3),
        ];
        for (mode, parent, dt, step, tolerance) in cases {
            let at = ask(&mut device, mode, parent, dt, example.moved);
            let ports = example.moved.len();
            for port in 0..ports {
                let differing = [2.0, 1.0, -1.0, -2.0].map(|k| {
                    let mut volts = example.moved.to_vec();
                    volts[port] += k * step;
                    ask(&mut device, mode, parent, dt, &volts)
                });
                let check = |what: &str, of: &dyn Fn(&TrialReply) -> &[f64], partial: &[f64]| {
                    let [far_hi, hi, lo, far_lo] = differing.each_ref().map(of);
                    for row in 0..hi.len() {
                        let (near, far) = (hi[row] - lo[row], far_hi[row] - far_lo[row]);
                        let difference = (8.0 * near - far) / (12.0 * step);
                        let exact = partial[ports * row + port];
                        let scale = partial[ports * row..][..ports].iter().fold(0.0f64, |a, x| a.max(x.abs()));
                        let rounding = 4.0 * f64::EPSILON * hi[row].abs() / step;
                        assert!(
                            (difference - exact).abs() <= tolerance * scale + rounding,
                            "{} {mode:?} dt={dt:e} {what}[{row}]/V{port}: {difference:e} {exact:e}",
                            example.name
                        );
                    }
                };
                check("charge", &|r| &r.charges, &at.dq_dv);
                check("current", &|r| &r.currents, &at.di_dv);
                check("output", &|r| &r.outputs, &at.doutputs_dv);
            }
        }
    }
}

/// A request has the same token and the same bits, whatever was asked in between, also in a fresh device.
#[test]
fn trials_are_pure() {
    for example in &EXAMPLES {
        let dt = example.steps[1];
        let mut device = example.open(Formulation::Reduced);
        let rest = ask(&mut device, Mode::Static, None, 0.0, example.rest);
        let first = ask(&mut device, Mode::Transient, rest.token, dt, example.moved);
        let beyond: Vec<f64> = example.moved.iter().map(|v| 1.9 * v).collect();
        for volts in [&beyond[..], &vec![0.0; beyond.len()]] {
            let mut reply = TrialReply::default();
            for mode in [Mode::Static, Mode::Transient] {
                device
                    .trial(&Trial { mode, parent: rest.token, t: 0.0, dt: 0.3 * dt, voltages: volts }, &mut reply)
                    .unwrap();
            }
        }
        assert_eq!(ask(&mut device, Mode::Transient, rest.token, dt, example.moved), first);
        let mut fresh = example.open(Formulation::Reduced);
        let rest = ask(&mut fresh, Mode::Static, None, 0.0, example.rest);
        assert_eq!(ask(&mut fresh, Mode::Transient, rest.token, dt, example.moved), first);
    }
}

/// Root mean square difference of each output and charge of two runs over equal points, of its range; and the time of each a point (µs).
fn compared(example: &Example, points: usize, volts: impl Fn(f64) -> Vec<f64>, dt: f64) -> (Vec<f64>, [f64; 2]) {
    let runs = [Formulation::Reduced, Formulation::Compliant].map(|formulation| {
        let mut device = example.open(formulation);
        let mut reply = ask(&mut device, Mode::Static, None, 0.0, &volts(0.0));
        let mut values = Vec::new();
        let begun = Instant::now();
        for k in 1..=points {
            let parent = reply.token;
            device.accept(parent.unwrap());
            reply = ask(&mut device, Mode::Transient, parent, dt, &volts(k as f64 * dt));
            values.push([reply.outputs.clone(), reply.charges.clone()].concat());
        }
        (values, 1e6 * begun.elapsed().as_secs_f64() / points as f64)
    });
    let [(reduced, fast), (full, slow)] = &runs;
    let errors = (0..full[0].len()).map(|n| {
        let (low, high) = full.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x[n]), b.max(x[n])));
        let squares: f64 = reduced.iter().zip(full).map(|(a, b)| (a[n] - b[n]).powi(2)).sum();
        if high > low { (squares / full.len() as f64).sqrt() / (high - low) } else { 0.0 }
    });
    (errors.collect(), [*fast, *slow])
}

/// A ramp from the start to the later voltages of an example over 40 points, and as long a time there.
fn ramp(example: &Example, dt: f64) -> impl Fn(f64) -> Vec<f64> {
    let (from, to) = (example.rest, example.moved);
    move |t| {
        let x = (t / (40.0 * dt)).min(1.0);
        from.iter().zip(to).map(|(a, b)| a + x * (b - a)).collect()
    }
}

/// Displacements, velocities, temperatures and charges over a ramp and the time behind it are those of the full model within the
/// tolerance of 1e-2 of each range.
#[test]
fn waveforms_are_those_of_the_full_model() {
    for example in &EXAMPLES {
        let dt = example.steps[1];
        let (errors, _) = compared(example, 80, ramp(example, dt), dt);
        assert!(errors.iter().all(|error| *error < 1e-2), "{}: {errors:?}", example.name);
    }
}

/// The time of a trial with partials, in the reduced and the full model, in one run.
#[test]
#[ignore = "a measurement"]
fn time_of_trials() {
    for example in &EXAMPLES {
        for dt in [example.steps[0], 0.1 * example.steps[1], example.steps[1]] {
            let (errors, [fast, slow]) = compared(example, 2000, ramp(example, dt), dt);
            let worst = errors.iter().fold(0.0f64, |a, b| a.max(*b));
            println!(
                "{} dt={dt:e} reduced {fast:.2} µs, full {slow:.2} µs, ratio {:.2}, error {worst:.1e}",
                example.name,
                slow / fast
            );
        }
    }
}

/// Beyond its range a port has the full model: the switch pulls in at 20 V as that does, within the tolerance, and W053 names the port. It stays
/// closed within the ranges as that does.
#[test]
fn the_full_model_takes_over() {
    let switch = &EXAMPLES[2];
    let (mut reduced, mut full) = (switch.open(Formulation::Reduced), switch.open(Formulation::Compliant));
    let closed = [&mut reduced, &mut full].map(|device| ask(device, Mode::Static, None, 0.0, &[20.0]));
    assert_eq!((&closed[0].outputs, &closed[0].charges), (&closed[1].outputs, &closed[1].charges));
    let warnings = reduced.warns(closed[0].token.unwrap());
    assert!(warnings.iter().any(|w| w.code == "W053" && w.message.contains("`drive`")), "{warnings:?}");
    // back within the range, and still closed
    let held = [(&mut reduced, &closed[0]), (&mut full, &closed[1])];
    let held = held.map(|(device, closed)| ask(device, Mode::Static, closed.token, 0.0, &[14.0]));
    assert_eq!((&held[0].outputs, &held[0].charges), (&held[1].outputs, &held[1].charges));
    assert!(held[0].outputs[0] < -0.55e-6, "{:?}", held[0].outputs);
    // a step over the range: every trial of it and of the points behind it is that of the full model
    let mut parents = [&mut reduced, &mut full].map(|device| ask(device, Mode::Static, None, 0.0, &[10.0]).token);
    let mut last = [0.0; 2];
    for k in 1..=100 {
        let volts = [10.0 + 0.1 * f64::from(k)];
        for (n, device) in [&mut reduced, &mut full].into_iter().enumerate() {
            let reply = ask(device, Mode::Transient, parents[n], 5e-8, &volts);
            device.accept(reply.token.unwrap());
            (parents[n], last[n]) = (reply.token, reply.outputs[0]);
        }
    }
    assert!((last[0] - last[1]).abs() < 1e-2 * last[1].abs(), "{last:?}");
}

/// Without ranges, or at a sharper tolerance a session is that of the full model bit by bit, and says why (W053).
#[test]
fn the_full_model_is_taken_with_a_reason() {
    let switch = &EXAMPLES[2];
    for (ranges, tol) in [(None, 1e-2), (Some(switch.ranges), 1e-3)] {
        let opened = |formulation| {
            let model = CompiledModel::clone(&compiled("switch", ranges, formulation)).with_tolerance(tol);
            let mut device = LocalDevice::new(Arc::new(model));
            device.open(&OpenRequest::default()).unwrap();
            device
        };
        let (mut reduced, mut full) = (opened(Formulation::Reduced), opened(Formulation::Compliant));
        let replies = [&mut reduced, &mut full].map(|device| {
            let rest = ask(device, Mode::Static, None, 0.0, &[8.0]);
            (ask(device, Mode::Transient, rest.token, 1e-7, &[9.0]), rest)
        });
        assert_eq!(replies[0], replies[1]);
        assert!(codes(&mut reduced, &replies[0].1).contains(&"W053".to_owned()), "{ranges:?} {tol:e}");
        assert!(!codes(&mut full, &replies[1].1).contains(&"W053".to_owned()));
    }
}

/// A range of no port, and two of one port, are refused with the ports that exist, in every formulation; one of a port that is not opened is not.
#[test]
fn ranges_of_no_port_are_refused() {
    let opened = |name: &str, ranges: &str, formulation, ports: &[&str]| {
        let mut device = LocalDevice::new(compiled(name, Some(ranges), formulation));
        let ports = ports.iter().map(|port| (*port).to_owned()).collect();
        device.open(&OpenRequest { ports, ..OpenRequest::default() }).map_err(|error| error.to_string())
    };
    for formulation in [Formulation::Reduced, Formulation::Compliant] {
        assert_eq!(
            opened("switch", "gate:0:1", formulation, &[]).unwrap_err(),
            "ranges: expected the name of a port of this model (drive; NODE.x|y|rz, NODE.vx|vy|vrz, BEAM.T, frame.ax|ay), got \"gate:0e0:1e0\""
        );
        assert_eq!(
            opened("switch", "drive:0:12|Drive:0:11", formulation, &[]).unwrap_err(),
            "ranges: expected one range for each port, got two of \"drive\""
        );
    }
    assert!(opened("switch", "DRIVE:0:12|a(8).y:0:1e-6", Formulation::Reduced, &["drive"]).is_ok());
    assert!(opened("bank", "heat:0:2|sense:0:20", Formulation::Compliant, &["heat"]).is_ok());
}

/// A restored session continues bit by bit and saves equal bytes; its states are refused by the full model and by another training, and it
/// refuses those of the full model.
#[test]
fn states_are_restored_by_their_own_model() {
    let switch = &EXAMPLES[2];
    let mut device = switch.open(Formulation::Reduced);
    let rest = ask(&mut device, Mode::Static, None, 0.0, switch.rest);
    let moving = ask(&mut device, Mode::Transient, rest.token, 3e-8, switch.moved);
    let saved = device.save(None).unwrap();
    let next = ask(&mut device, Mode::Transient, moving.token, 3e-8, switch.moved);
    let mut restored = LocalDevice::new(Arc::clone(device.compiled()));
    restored.load(&saved).unwrap();
    assert_eq!(restored.save(None).unwrap(), saved);
    assert_eq!(ask(&mut restored, Mode::Transient, moving.token, 3e-8, switch.moved), next);
    device.recover();
    assert_eq!(ask(&mut device, Mode::Transient, moving.token, 3e-8, switch.moved), next);
    let mut full = switch.open(Formulation::Compliant);
    assert!(full.load(&saved).is_err());
    assert!(device.load(&full.save(None).unwrap()).is_err());
    let mut other = LocalDevice::new(compiled("switch", Some("drive:0:12"), Formulation::Reduced));
    assert!(other.load(&saved).is_err());
}

/// The small signal about a reduced state is that of the full model about its own within the tolerance.
#[test]
fn small_signals_are_those_of_the_full_model() {
    for example in &EXAMPLES {
        let found = [Formulation::Reduced, Formulation::Compliant].map(|formulation| {
            let mut device = example.open(formulation);
            let rest = ask(&mut device, Mode::Static, None, 0.0, example.rest);
            let mut reply = bimorph_device::SmallSignal::default();
            device.linearize(rest.token.unwrap(), 1e4, &mut reply).unwrap();
            [reply.admittance, reply.outputs].concat()
        });
        let [reduced, full] = found;
        let ports = example.rest.len();
        for (row, (a, b)) in reduced.chunks(ports).zip(full.chunks(ports)).enumerate() {
            let size = |x: &[f64; 2]| x[0].hypot(x[1]);
            let largest = b.iter().map(size).fold(0.0, f64::max);
            for (a, b) in a.iter().zip(b) {
                assert!((a[0] - b[0]).hypot(a[1] - b[1]) <= 1e-2 * largest, "{} row {row}: {a:?} {b:?}", example.name);
            }
        }
    }
}
