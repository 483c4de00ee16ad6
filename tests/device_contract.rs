//! The electrical contract of [`bimorph::device::Device`] on a mechanism with heaters, a comb and a plate gap.

use bimorph::compile::{CompileOptions, CompiledModel, Formulation, Junctions, compile};
use bimorph::device::local::LocalDevice;
use bimorph::device::{Device, DeviceError, Mode, OpenRequest, SmallSignal, Status, Token, Trial, TrialReply};
use bimorph::netlist::Bundle;
use std::sync::Arc;

/// A heated chevron that pushes a shuttle with a comb ahead of it and a plate beside it.
const SHUTTLE: &str = include_str!("netlists/shuttle.net");

/// The formulations that a device steps in; the contract is the same in each.
const FORMULATIONS: [Formulation; 2] = [Formulation::Compliant, Formulation::Rcr];

fn compiled(formulation: Formulation) -> Arc<CompiledModel> {
    let options = CompileOptions { formulation, junctions: Junctions::Centreline, ..CompileOptions::default() };
    Arc::new(compile(&Bundle::from_text("shuttle.net", SHUTTLE), &options).unwrap_or_else(|e| panic!("{e}")))
}

fn opened(compiled: &Arc<CompiledModel>) -> LocalDevice {
    let mut device = LocalDevice::new(Arc::clone(compiled));
    let signals =
        ["s.y", "s.x", "s.vy", "left.T", "right.T", "drive.q", "squeeze.gap", "squeeze.C", "squeeze.F", "drive.F"];
    let request = OpenRequest { ports: Vec::new(), signals: signals.map(String::from).to_vec(), noise: None };
    device.open(&request).unwrap();
    device
}

fn ask(device: &mut LocalDevice, mode: Mode, parent: Option<Token>, dt: f64, voltages: &[f64]) -> TrialReply {
    let mut reply = TrialReply::default();
    device.trial(&Trial { mode, parent, t: 0.0, dt, voltages }, &mut reply).unwrap();
    assert_eq!(reply.status, Status::Ok);
    reply
}

/// Asking again gives the same token and the same bits, whatever was asked in between: a rejected trial leaves no trace.
#[test]
fn trials_are_pure() {
    for formulation in FORMULATIONS {
        let compiled = compiled(formulation);
        let mut device = opened(&compiled);
        let rest = ask(&mut device, Mode::Static, None, 0.0, &[1.0, 5.0]);
        let first = ask(&mut device, Mode::Transient, rest.token, 2e-7, &[1.4, 5.5]);
        for dt in [3e-7, 1e-6, 1e-9] {
            ask(&mut device, Mode::Transient, rest.token, dt, &[0.3, 9.0]);
            ask(&mut device, Mode::Static, rest.token, 0.0, &[2.0, 1.0]);
        }
        let again = ask(&mut device, Mode::Transient, rest.token, 2e-7, &[1.4, 5.5]);
        assert_eq!(first, again);
        // a device that was never asked anything else agrees too
        let mut fresh = opened(&compiled);
        let rest = ask(&mut fresh, Mode::Static, None, 0.0, &[1.0, 5.0]);
        assert_eq!(ask(&mut fresh, Mode::Transient, rest.token, 2e-7, &[1.4, 5.5]), first);
    }
}

/// Inspection of a state gives the values of its trial, for opened signals and for all others, and changes nothing; an
/// unknown name is an error.
#[test]
fn a_look_is_what_the_trial_answered() {
    for formulation in FORMULATIONS {
        let compiled = compiled(formulation);
        let mut device = opened(&compiled);
        let rest = ask(&mut device, Mode::Static, None, 0.0, &[1.0, 5.0]);
        let moved = ask(&mut device, Mode::Transient, rest.token, 2e-7, &[1.4, 5.5]);
        let names: Vec<String> = device.names();
        for reply in [&rest, &moved] {
            for (name, value) in ["s.y", "s.x", "s.vy", "left.T", "right.T", "drive.q"].iter().zip(&reply.outputs) {
                assert!(names.iter().any(|n| n == name), "{name}");
                let seen = device.read_quantity(reply.token.unwrap(), name).unwrap();
                assert!((seen - value).abs() <= 1e-14 * value.abs(), "{name}: {seen} for {value}");
            }
            for name in &names {
                assert!(device.read_quantity(reply.token.unwrap(), name).unwrap().is_finite(), "{name}");
            }
        }
        let unknown = device.read_quantity(moved.token.unwrap(), "nothing.x");
        assert!(matches!(unknown, Err(DeviceError::UnknownSignal { .. })), "{unknown:?}");
        assert_eq!(ask(&mut device, Mode::Transient, rest.token, 2e-7, &[1.4, 5.5]), moved);
    }
}

/// Accepting a state frees its rivals and changes no answer.
#[test]
fn accept_is_advisory() {
    for formulation in FORMULATIONS {
        let compiled = compiled(formulation);
        let (mut silent, mut reported) = (opened(&compiled), opened(&compiled));
        let mut parents = [None, None];
        for step in 0..20 {
            let v = [1.0 + 0.05 * f64::from(step), 4.0];
            let mut replies = Vec::new();
            for (device, parent) in [&mut silent, &mut reported].into_iter().zip(parents) {
                let mode = if step == 0 { Mode::Static } else { Mode::Transient };
                ask(device, mode, parent, 1.3e-7, &[v[0], 7.0]);
                replies.push(ask(device, mode, parent, 1e-7, &v));
            }
            assert_eq!(replies[0], replies[1]);
            parents = [replies[0].token, replies[1].token];
            reported.accept(replies[1].token.unwrap());
        }
        assert!(reported.state_bytes() < silent.state_bytes());
    }
}

/// Central differences of charges, currents and outputs agree with the partials: to 1e-6 of the largest entry of each row
/// for a single internal step, where the partials are exact, and to 1e-3 when a trial takes several.
#[test]
fn partials_match_finite_differences() {
    for formulation in FORMULATIONS {
        let compiled = compiled(formulation);
        let mut device = opened(&compiled);
        let base = [1.5, 8.0];
        let rest = ask(&mut device, Mode::Static, None, 0.0, &[1.2, 6.0]);
        let moving = ask(&mut device, Mode::Transient, rest.token, 3e-7, &[1.3, 7.0]);
        let cases = [
            (Mode::Static, rest.token, 0.0, 1e-3, 1e-6),
            (Mode::Transient, moving.token, 5e-9, 1e-2, 1e-6),
            (Mode::Transient, moving.token, 1e-7, 1e-2, 1e-3),
        ];
        for (mode, parent, dt, step, tolerance) in cases {
            let at = ask(&mut device, mode, parent, dt, &base);
            for port in 0..2 {
                // fourth-order differences: a step's result curves with the voltage
                let [far_hi, hi, lo, far_lo] = [2.0, 1.0, -1.0, -2.0].map(|k| {
                    let mut v = base;
                    v[port] += k * step;
                    ask(&mut device, mode, parent, dt, &v)
                });
                let check = |what: &str, of: &dyn Fn(&TrialReply) -> Vec<f64>, partial: &[f64]| {
                    let [far_hi, hi, lo, far_lo] = [&far_hi, &hi, &lo, &far_lo].map(of);
                    for row in 0..hi.len() {
                        let (near, far) = (hi[row] - lo[row], far_hi[row] - far_lo[row]);
                        let difference = (8.0 * near - far) / (12.0 * step);
                        let exact = partial[2 * row + port];
                        let scale = partial[2 * row].abs().max(partial[2 * row + 1].abs());
                        let error = (difference - exact).abs();
                        // a gap of a micrometre has its own last place
                        let rounding = 4.0 * f64::EPSILON * hi[row].abs() / step;
                        assert!(
                            error <= tolerance * scale + rounding,
                            "{formulation:?} {mode:?} dt={dt:e} {what}[{row}]/V{port}: {difference:e} {exact:e}"
                        );
                    }
                };
                check("charge", &|r| r.charges.clone(), &at.dq_dv);
                check("current", &|r| r.currents.clone(), &at.di_dv);
                check("output", &|r| r.outputs.clone(), &at.doutputs_dv);
            }
        }
    }
}

/// At a very low frequency the small-signal answer is the static one: capacitances and outputs per volt.
#[test]
fn low_frequency_is_static() {
    for formulation in FORMULATIONS {
        let compiled = compiled(formulation);
        let mut device = opened(&compiled);
        let rest = ask(&mut device, Mode::Static, None, 0.0, &[1.2, 6.0]);
        let mut small = SmallSignal::default();
        let omega = 1.0;
        device.linearize(rest.token.unwrap(), omega, &mut small).unwrap();
        for k in 0..4 {
            let (y, g, c) = (small.admittance[k], rest.di_dv[k], rest.dq_dv[k]);
            assert!((y[0] - g).abs() <= 1e-6 * g.abs() + 1e-4 * omega * c.abs());
            assert!((y[1] - omega * c).abs() <= 1e-4 * c.abs(), "{k}: {} {}", y[1], c);
        }
        // displacements share the scale of the larger one: x is what an unsymmetric heating leaves of y
        for (rows, tolerance) in [(&[0, 1, 6][..], 1e-7), (&[3, 4], 1e-9), (&[5], 1e-7)] {
            let scale =
                rows.iter().flat_map(|&r| &rest.doutputs_dv[2 * r..2 * r + 2]).fold(0.0f64, |m, s| m.max(s.abs()));
            for &row in rows {
                for p in 0..2 {
                    let (x, s) = (small.outputs[2 * row + p][0], rest.doutputs_dv[2 * row + p]);
                    assert!((x - s).abs() <= tolerance * scale, "{row} {p}: {x:e} {s:e}");
                }
            }
        }
    }
}

/// Bad requests are refused with the field and the reason, and change nothing.
#[test]
fn bad_requests_are_refused() {
    let compiled = compiled(Formulation::Compliant);
    let mut device = LocalDevice::new(Arc::clone(&compiled));
    let mut reply = TrialReply::default();
    fn trial(voltages: &[f64]) -> Trial<'_> {
        Trial { mode: Mode::Static, parent: None, t: 0.0, dt: 0.0, voltages }
    }
    assert_eq!(device.trial(&trial(&[0.0, 0.0]), &mut reply), Err(DeviceError::NotOpen));
    let unknown = OpenRequest { ports: vec!["heet".into()], signals: vec![], noise: None };
    assert!(matches!(device.open(&unknown), Err(DeviceError::UnknownPort { .. })));
    let unknown = OpenRequest { ports: vec![], signals: vec!["s.z".into()], noise: None };
    assert!(matches!(device.open(&unknown), Err(DeviceError::UnknownSignal { .. })));
    let mut device = opened(&compiled);
    assert!(matches!(device.trial(&trial(&[0.0]), &mut reply), Err(DeviceError::BadRequest { .. })));
    assert!(matches!(device.trial(&trial(&[0.0, f64::NAN]), &mut reply), Err(DeviceError::BadRequest { .. })));
    let lost = Trial { parent: Some(Token(12345)), ..trial(&[0.0, 0.0]) };
    assert_eq!(device.trial(&lost, &mut reply), Err(DeviceError::UnknownToken(Token(12345))));
    let backwards = Trial { mode: Mode::Transient, dt: -1e-9, ..trial(&[0.0, 0.0]) };
    assert!(matches!(device.trial(&backwards, &mut reply), Err(DeviceError::BadRequest { .. })));
}

/// A state warns of what no trial refuses, each kind once in an epoch: heat that nothing bears (W037).
#[test]
fn states_warn_once() {
    let compiled = compiled(Formulation::Compliant);
    let mut device = opened(&compiled);
    let codes = |device: &mut LocalDevice, token: Option<Token>| -> Vec<String> {
        device.warns(token.unwrap()).into_iter().map(|warning| warning.code).collect()
    };
    let ports = device.open(&OpenRequest::default()).unwrap().ports;
    let at = |volts: f64| ports.iter().map(|p| if p.name == "heat" { volts } else { 0.0 }).collect::<Vec<_>>();
    let cool = ask(&mut device, Mode::Static, None, 0.0, &at(0.1)).token;
    assert_eq!(codes(&mut device, cool), [""; 0]);
    let hot = ask(&mut device, Mode::Static, None, 0.0, &at(100.0)).token;
    assert!(codes(&mut device, hot).contains(&"W037".to_owned()));
    assert_eq!(codes(&mut device, hot), [""; 0]);
    device.open(&OpenRequest::default()).unwrap();
    let again = ask(&mut device, Mode::Static, None, 0.0, &at(100.0)).token;
    assert!(codes(&mut device, again).contains(&"W037".to_owned()));
}
