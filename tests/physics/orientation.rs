//! A drawing that is turned gives the same results: 24 angles, the axes among them.

use crate::{close, model};
use bimorph::analysis::continuation::{ContinuationRequest, PathInput, trace};
use bimorph::analysis::harmonic::{HarmonicOptions, harmonic};
use bimorph::analysis::modes::modes;
use bimorph::analysis::pull_in::pull_in;
use bimorph::analysis::statics::static_equilibrium;
use bimorph::analysis::transient::{TransientOptions, transient};
use bimorph::compile::{CompileOptions, CompiledModel};
use bimorph::device::local::LocalDevice;
use bimorph::device::{Device, Mode, OpenRequest, Status, Token, Trial, TrialReply};
use bimorph::solve::continuation::Branch;
use std::sync::Arc;

/// A plate on a guide, a spring and a damper, before an electrode, along a direction (deg).
fn guided(angle: f64) -> CompiledModel {
    let text = format!(
        "anchor * [f] []
        spring2d * [f m] [kx=1 oz=deg({angle})]
        dashpot2d * [m] [bx=2e-7 oz=deg({angle})]
        mass2d * [m] [m=1e-12]
        guide2d * [m] [oz=deg({angle})]
        anchor * [e] []
        gap plategap2d * [m e] [A=1e-8 gap=2u oz=deg({angle})]
        eground * [e] []
        drive port * [m e] []"
    );
    model(&text, &CompileOptions::default())
}

/// A cantilever of 80 µm over an electrode, along a direction (deg).
fn cantilever(angle: f64) -> CompiledModel {
    let text = format!(
        "dl = 20u
        anchor p1 [e(0)] []
        anchor p1 [f(0)] []
        for i=1:4 [
            beam2d p1 [e(i-1) e(i)] [l=dl w=0.5u oz=deg({angle})]
            gap2dforce p1 [e(i-1) e(i) f(i-1) f(i)] [l=dl w1=0.5u w2=0.5u gap=2u touch=0.2u oz=deg({angle})]
            R * [e(i-1) e(i)] [R=1]
            R * [f(i-1) f(i)] [R=1]
            anchor p1 [f(i)] []
        ]
        eground * [e(0)] []
        drive port * [f(0) e(0)] []"
    );
    model(&text, &CompileOptions::default())
}

fn drive(volts: f64) -> Vec<(String, f64)> {
    vec![("drive".to_owned(), volts)]
}

/// Static results of a node at a voltage: its motion along the direction and across it (m), and the charge (C).
fn statics(compiled: &CompiledModel, angle: f64, name: &str, volts: f64) -> [f64; 3] {
    let result = static_equilibrium(compiled, &drive(volts)).unwrap_or_else(|e| panic!("{angle}° {volts} V: {e}"));
    let at = crate::node(&result, name);
    let (sin, cos) = angle.to_radians().sin_cos();
    [at.x * cos + at.y * sin, at.y * cos - at.x * sin, result.charges_c[0].1]
}

/// Limit points of the path up to a voltage (V).
fn limits(compiled: &CompiledModel, to: f64) -> Vec<f64> {
    let request = ContinuationRequest {
        input: PathInput::Port("drive"),
        from: 0.0,
        to,
        voltages: vec![],
        signals: vec![],
        branch: Branch::Plus,
        points: 3000,
    };
    let path = trace(compiled, &request, &mut |_| true).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(path.end, "arrived");
    path.folds.iter().map(|p| p.value).collect()
}

/// Capacitance in sweeps of a device, up through pull-in and down through release, and 5 µs later (F).
fn session(compiled: CompiledModel) -> Vec<f64> {
    let mut device = LocalDevice::new(Arc::new(compiled));
    device.open(&OpenRequest { ports: Vec::new(), signals: vec!["gap.C".to_owned()], noise: None }).unwrap();
    let (mut at, mut seen): (Option<Token>, Vec<f64>) = (None, Vec::new());
    let mut ask = |mode: Mode, dt: f64, volts: f64| {
        let mut reply = TrialReply::default();
        device.trial(&Trial { mode, parent: at, t: 0.0, dt, voltages: &[volts] }, &mut reply).unwrap();
        assert_eq!(reply.status, Status::Ok, "{volts} V");
        at = reply.token;
        seen.push(reply.outputs[0]);
    };
    for volts in [1.0, 4.0, 5.5, 6.0, 3.0, 0.7, 0.6, 2.0] {
        ask(Mode::Static, 0.0, volts);
    }
    ask(Mode::Transient, 5e-6, 3.0);
    seen
}

fn every_angle() -> impl Iterator<Item = f64> {
    (0..24).map(|k| 15.0 * f64::from(k))
}

/// A guided plate: statics before and beyond pull-in, modes, pull-in and release, the path, a run, a response and the sweeps of a deck,
/// each as along x. A circuit's voltage and contact do not know the axes.
#[test]
fn a_guided_plate_along_any_direction() {
    let along_x = guided(0.0);
    let options = TransientOptions {
        stop: 4e-5,
        points: 101,
        voltages: drive(4.0),
        signals: vec!["gap.gap".to_owned()],
        ..TransientOptions::default()
    };
    let response = |compiled: &CompiledModel| {
        let options = HarmonicOptions {
            drive: "drive".to_owned(),
            signals: vec!["gap.gap".to_owned()],
            from: 1e4,
            to: 1e6,
            points: 10,
            voltages: drive(3.0),
            ..HarmonicOptions::default()
        };
        harmonic(compiled, &options, &mut |_| true).unwrap_or_else(|e| panic!("{e}"))
    };
    let run = |compiled: &CompiledModel, angle: f64| {
        transient(compiled, &options, &mut |_, _| {}, &mut |_| true).unwrap_or_else(|e| panic!("{angle}°: {e}"))
    };
    let wanted = (
        [2.0, 5.0, 6.0].map(|volts| statics(&along_x, 0.0, "m", volts)),
        modes(&along_x, 1, &drive(4.0)).unwrap().frequencies_hz[0],
        pull_in(&along_x, None, 20.0).unwrap(),
        limits(&along_x, 8.0),
        run(&along_x, 0.0),
        response(&along_x),
        session(guided(0.0)),
    );
    for angle in every_angle() {
        let compiled = guided(angle);
        for (volts, wanted) in [2.0, 5.0, 6.0].into_iter().zip(wanted.0) {
            let found = statics(&compiled, angle, "m", volts);
            close(found[0], wanted[0], 1e-8);
            assert!(found[1].abs() < 1e-9 * wanted[0].abs(), "{angle}°: {found:?}");
            close(found[2], wanted[2], 1e-6);
        }
        close(modes(&compiled, 1, &drive(4.0)).unwrap().frequencies_hz[0], wanted.1, 1e-9);
        let found = pull_in(&compiled, None, 20.0).unwrap_or_else(|e| panic!("{angle}°: {e}"));
        close(found.pull_in_v, wanted.2.pull_in_v, 1e-8);
        close(found.release_v.unwrap(), wanted.2.release_v.unwrap(), 1e-6);
        let found = limits(&compiled, 8.0);
        assert_eq!(found.len(), wanted.3.len(), "{angle}°");
        found.iter().zip(&wanted.3).for_each(|(found, wanted)| close(*found, *wanted, 1e-6));
        let found = run(&compiled, angle);
        assert_eq!(found.counters.steps, wanted.4.counters.steps, "{angle}°");
        found.signals[0].2.iter().zip(&wanted.4.signals[0].2).for_each(|(found, wanted)| close(*found, *wanted, 1e-8));
        let found = response(&compiled);
        close(found.poles.unwrap()[0].frequency_hz(), wanted.5.poles.as_ref().unwrap()[0].frequency_hz(), 1e-8);
        let found = session(guided(angle));
        found.iter().zip(&wanted.6).for_each(|(found, wanted)| close(*found, *wanted, 1e-6));
    }
}

/// A cantilever over an electrode: statics, modes, pull-in with its further snaps, and release.
#[test]
fn a_cantilever_along_any_direction() {
    let along_x = cantilever(0.0);
    let wanted = (
        [5.0, 15.0].map(|volts| statics(&along_x, 0.0, "e(4)", volts)),
        modes(&along_x, 2, &drive(5.0)).unwrap().frequencies_hz,
        pull_in(&along_x, None, 15.0).unwrap(),
    );
    for angle in every_angle() {
        let compiled = cantilever(angle);
        for (volts, wanted) in [5.0, 15.0].into_iter().zip(wanted.0) {
            let found = statics(&compiled, angle, "e(4)", volts);
            close(found[1], wanted[1], 1e-7);
            close(found[2], wanted[2], 1e-6);
        }
        let found = modes(&compiled, 2, &drive(5.0)).unwrap().frequencies_hz;
        found.iter().zip(&wanted.1).for_each(|(found, wanted)| close(*found, *wanted, 1e-8));
        let found = pull_in(&compiled, None, 15.0).unwrap_or_else(|e| panic!("{angle}°: {e}"));
        close(found.pull_in_v, wanted.2.pull_in_v, 1e-7);
        close(found.release_v.unwrap(), wanted.2.release_v.unwrap(), 1e-5);
    }
}
