//! Circuit points in which parts touch: charges are smooth functions of voltages, and trials stay pure.

use crate::model;
use bimorph::compile::CompileOptions;
use bimorph::device::local::LocalDevice;
use bimorph::device::{Device, Mode, OpenRequest, Status, Token, Trial, TrialReply};
use std::sync::Arc;

/// A plate that 8 V pull in: k = 1 N/m, 1e-10 kg, 2 µm from an electrode that it touches at 0.1 µm.
fn plate() -> LocalDevice {
    let text = "
        anchor * [f] []
        mass2d * [m] [m=1e-10]
        guide2d * [m] []
        spring2d * [f m] [kx=1]
        anchor * [e] []
        squeeze plategap2d * [m e] [A=1e-8 gap=2u]
        eground * [e] []
        drive port * [m e] []";
    let mut device = LocalDevice::new(Arc::new(model(text, &CompileOptions::default())));
    let request = OpenRequest { ports: Vec::new(), signals: vec!["squeeze.gap".into()], noise: None };
    device.open(&request).unwrap();
    device
}

fn ask(device: &mut LocalDevice, parent: Option<Token>, dt: f64, volts: f64) -> TrialReply {
    let mode = if parent.is_some() { Mode::Transient } else { Mode::Static };
    let mut reply = TrialReply::default();
    device.trial(&Trial { mode, parent, t: 0.0, dt, voltages: &[volts] }, &mut reply).unwrap();
    assert_eq!(reply.status, Status::Ok);
    reply
}

/// The last accepted state at 8 V before the plate touches, in steps of 0.2 µs, and the time from there to the touch (s).
fn before_contact(device: &mut LocalDevice) -> (Token, f64) {
    let mut now = ask(device, None, 0.0, 0.0).token;
    let mut volts = 0.0;
    loop {
        volts = f64::min(volts + 1.0, 8.0);
        let next = ask(device, now, 2e-7, volts);
        if next.outputs[0] < 1e-7 {
            break;
        }
        device.accept(next.token.unwrap());
        now = next.token;
    }
    let (mut open, mut closed) = (0.0, 2e-7);
    for _ in 0..40 {
        let middle = 0.5 * (open + closed);
        if ask(device, now, middle, 8.0).outputs[0] < 1e-7 { closed = middle } else { open = middle }
    }
    (now.unwrap(), closed)
}

/// From a point before an impact to 5, 50 and 500 ns after it, 21 voltages within 1e-5 of 8 V give charges on a smooth
/// curve. A parabola through them leaves less than 1e-3 of their range, and its slope at 8 V is the partial that the
/// trial reports within 1 %. With steps of its own in each trial the rest was 0.2 of the range 50 ns after the impact,
/// and more than the range 500 ns after it.
#[test]
fn charge_is_smooth_across_an_impact() {
    let mut device = plate();
    let (state, touch) = before_contact(&mut device);
    for after in [5e-9, 50e-9, 500e-9] {
        let at = |u: f64| 8.0 * (1.0 + 1e-5 * u);
        let points: Vec<f64> = (-10..=10).map(|k| f64::from(k) / 10.0).collect();
        let replies: Vec<TrialReply> =
            points.iter().map(|u| ask(&mut device, Some(state), touch + after, at(*u))).collect();
        assert!(replies[10].outputs[0] < 2e-6);
        let charges: Vec<f64> = replies.iter().map(|reply| reply.charges[0]).collect();
        // least squares of a parabola over points that lie evenly about 0
        let sums = |power: i32| points.iter().zip(&charges).map(|(u, q)| u.powi(power) * q).sum::<f64>();
        let moment = |power: i32| points.iter().map(|u| u.powi(power)).sum::<f64>();
        let slope = sums(1) / moment(2);
        let (n, s2, s4) = (points.len() as f64, moment(2), moment(4));
        let bend = (n * sums(2) - s2 * sums(0)) / (n * s4 - s2 * s2);
        let mean = (sums(0) - bend * s2) / n;
        let rest =
            (points.iter().zip(&charges)).map(|(u, q)| (q - mean - slope * u - bend * u * u).abs()).fold(0.0, f64::max);
        let range = 2.0 * slope.abs();
        assert!(rest < 1e-3 * range, "{after:e}: {rest:e} of {range:e}");
        let reported = replies[10].dq_dv[0] * 8e-5;
        assert!((reported / slope - 1.0).abs() < 1e-2, "{after:e}: {reported:e} for {slope:e}");
    }
}

/// A trial across an impact gives the same bits whatever was asked before it: by this device, or by one that is asked nothing else.
#[test]
fn trials_across_impacts_are_pure() {
    let mut device = plate();
    let (state, touch) = before_contact(&mut device);
    let dt = touch + 50e-9;
    let first = ask(&mut device, Some(state), dt, 8.0);
    for (other, volts) in [(dt, 8.5), (0.5 * dt, 8.0), (dt, 7.0)] {
        ask(&mut device, Some(state), other, volts);
    }
    assert_eq!(ask(&mut device, Some(state), dt, 8.0), first);
    let mut fresh = plate();
    let (state, _) = before_contact(&mut fresh);
    assert_eq!(ask(&mut fresh, Some(state), dt, 8.0), first);
}
