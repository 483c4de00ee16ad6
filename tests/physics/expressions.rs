//! Sums of signals have the values of their terms in every analysis that names signals.

use crate::{close, model};
use bimorph::analysis::AnalysisError;
use bimorph::analysis::continuation::{ContinuationRequest, PathInput, trace};
use bimorph::analysis::harmonic::{HarmonicOptions, harmonic};
use bimorph::analysis::transient::{TransientOptions, transient};
use bimorph::compile::{CompileOptions, CompiledModel};
use bimorph::device::local::LocalDevice;
use bimorph::device::{Device, DeviceError, Mode, OpenRequest, Trial, TrialReply};
use bimorph::solve::continuation::Branch;
use std::sync::Arc;

/// A plate of 0.1 ng on a spring of 1 N/m midway between two electrodes.
const DIFFERENTIAL: &str = "
anchor * [f] []
mass2d * [m] [m=1e-10]
guide2d * [m] []
spring2d * [f m] [kx=1]
dashpot2d * [m] [bx=4e-6]
anchor * [e] []
anchor * [g] []
top plategap2d * [m e] [A=1e-8 gap=2u]
bot plategap2d * [m g] [A=1e-8 gap=2u oz=pi]
eground * [m] []
drive port * [e] []
sense port * [g] []
";

const VOLTS: [(&str, f64); 2] = [("drive", 3.0), ("sense", 2.0)];

/// Sums, and the terms of each with their factors. `PORT.i` is no quantity of a state.
const STATE_SUMS: [(&str, [(f64, &str); 2]); 3] = [
    ("top.C-bot.C", [(1.0, "top.C"), (-1.0, "bot.C")]),
    (" 0.5*top.gap + bot.gap/4", [(0.5, "top.gap"), (0.25, "bot.gap")]),
    ("2e-3*m.vx-m.vx", [(2e-3, "m.vx"), (-1.0, "m.vx")]),
];
const CURRENTS: (&str, [(f64, &str); 2]) = ("drive.i-2*sense.i", [(1.0, "drive.i"), (-2.0, "sense.i")]);

fn volts() -> Vec<(String, f64)> {
    VOLTS.iter().map(|(name, volts)| ((*name).to_owned(), *volts)).collect()
}

/// Names of the sums, then of their terms.
fn names(sums: &[(&str, [(f64, &str); 2])]) -> Vec<String> {
    let texts = sums.iter().map(|(text, _)| (*text).to_owned());
    texts.chain(sums.iter().flat_map(|(_, terms)| terms.map(|(_, name)| name.to_owned()))).collect()
}

/// Compares each sum with its terms, in columns as [`names`] has them, within rounding of the largest term.
fn compare(sums: &[(&str, [(f64, &str); 2])], columns: &[Vec<f64>]) {
    let count = sums.len();
    assert_eq!(columns.len(), 3 * count);
    for (k, (text, terms)) in sums.iter().enumerate() {
        let [a, b] = [&columns[count + 2 * k], &columns[count + 2 * k + 1]];
        let largest = a.iter().chain(b).fold(0.0, |most: f64, x| most.max(x.abs()));
        assert!(largest > 0.0, "{text}");
        for ((sum, a), b) in columns[k].iter().zip(a).zip(b) {
            let expected = terms[0].0 * a + terms[1].0 * b;
            assert!((sum - expected).abs() <= 4.0 * f64::EPSILON * largest, "{text}: {sum:e}, {expected:e}");
        }
    }
}

/// In a run, with the crossing of a level by a sum.
#[test]
fn sums_of_a_run() {
    let compiled = model(DIFFERENTIAL, &CompileOptions::default());
    let sums: Vec<_> =
        STATE_SUMS.into_iter().chain([CURRENTS, ("drive.q+sense.q", [(1.0, "drive.q"), (1.0, "sense.q")])]).collect();
    let options = TransientOptions {
        stop: 5e-5,
        points: 101,
        signals: names(&sums),
        voltages: volts(),
        events: vec![("top.C - bot.C".into(), 1e-15), ("m.x".into(), 0.0)],
        ..TransientOptions::default()
    };
    let result =
        transient(&compiled, &options, &mut |_, _| {}, &mut |_| true).unwrap_or_else(|error| panic!("{error}"));
    let columns: Vec<Vec<f64>> = result.signals.iter().map(|(_, _, values)| values.clone()).collect();
    compare(&sums, &columns);
    let units: Vec<&str> = result.signals[..sums.len()].iter().map(|(_, unit, _)| unit.as_str()).collect();
    assert_eq!(units, ["F", "m", "m/s", "A", "C"]);
    // ΔC = 2·ε·A·x/(g² − x²) is 1 fF at x = 22.6 nm
    let crossing = result.events.iter().find(|event| event.signal == "top.C - bot.C").expect("a crossing");
    assert!(crossing.t > 0.0 && crossing.t < 1e-5, "{}", crossing.t);
}

/// In a frequency response, exactly and as a sum over modes, with the same factors of the complex columns.
#[test]
fn sums_of_a_response() {
    let compiled = model(DIFFERENTIAL, &CompileOptions::default());
    let sums: Vec<_> = STATE_SUMS.into_iter().chain([CURRENTS]).collect();
    for by_modes in [false, true] {
        let options = HarmonicOptions {
            drive: "m.fx".into(),
            signals: names(&sums),
            from: 1e3,
            to: 1e5,
            points: 21,
            voltages: volts(),
            by_modes,
            ..HarmonicOptions::default()
        };
        let result = harmonic(&compiled, &options, &mut |_| true).unwrap_or_else(|error| panic!("{error}"));
        for part in [0, 1] {
            let of = |s: &bimorph::analysis::harmonic::SignalResponse| s.values.iter().map(|v| v[part]).collect();
            compare(&sums, &result.signals.iter().map(of).collect::<Vec<Vec<f64>>>());
        }
        let units: Vec<&str> = result.signals[..sums.len()].iter().map(|s| s.unit.as_str()).collect();
        assert_eq!(units, ["F/N", "m/N", "m/s/N", "A/N"]);
    }
}

/// Along a path, whose points are at rest.
#[test]
fn sums_of_a_path() {
    let compiled = model(DIFFERENTIAL, &CompileOptions::default());
    let request = ContinuationRequest {
        input: PathInput::Port("drive"),
        from: 0.0,
        to: 3.0,
        voltages: vec![("sense".into(), 2.0)],
        signals: names(&STATE_SUMS[..2]),
        branch: Branch::Plus,
        points: 200,
    };
    let result = trace(&compiled, &request, &mut |_| true).unwrap_or_else(|error| panic!("{error}"));
    compare(&STATE_SUMS[..2], &result.signals.iter().map(|(_, _, values)| values.clone()).collect::<Vec<_>>());
}

fn opened(compiled: &CompiledModel, signals: Vec<String>) -> Result<LocalDevice, DeviceError> {
    let mut device = LocalDevice::new(Arc::new(compiled.clone()));
    device.open(&OpenRequest { ports: Vec::new(), signals, noise: None })?;
    Ok(device)
}

/// In trials of a session with their derivatives, in small signals, and among the quantities of a state.
#[test]
fn sums_of_a_session() {
    let compiled = model(DIFFERENTIAL, &CompileOptions::default());
    let mut device = opened(&compiled, names(&STATE_SUMS)).unwrap_or_else(|error| panic!("{error}"));
    let mut reply = TrialReply::default();
    let mut trial = |mode, parent, voltages: &[f64]| {
        device
            .trial(&Trial { mode, parent, t: 0.0, dt: 1e-6, voltages }, &mut reply)
            .unwrap_or_else(|error| panic!("{error}"));
        (reply.token, reply.outputs.clone(), reply.doutputs_dv.clone())
    };
    let (rest, _, _) = trial(Mode::Static, None, &[0.0, 0.0]);
    let (moved, outputs, slopes) = trial(Mode::Transient, rest, &[3.0, 2.0]);
    compare(&STATE_SUMS, &outputs.iter().map(|x| vec![*x]).collect::<Vec<_>>());
    compare(&STATE_SUMS, &slopes.chunks(2).map(<[f64]>::to_vec).collect::<Vec<_>>());
    let token = moved.expect("a state");
    for (k, name) in names(&STATE_SUMS).iter().enumerate() {
        close(device.read_quantity(token, name).unwrap_or_else(|error| panic!("{error}")), outputs[k], 1e-12);
    }
}

/// Different units, unknown names and products are rejected with the part that is wrong.
#[test]
fn sums_that_do_not_fit_are_rejected() {
    let compiled = model(DIFFERENTIAL, &CompileOptions::default());
    for (text, part) in [
        ("top.C-m.x", "top.C [F] and m.x [m]"),
        ("top.C-bat.C", "signal \"bat.C\""),
        ("top.C*bot.C", "products of signals"),
        ("top.C+", "after \"+\""),
        ("3*m.x+1", "a signal in each term"),
    ] {
        let options = TransientOptions { signals: vec![text.into()], ..TransientOptions::default() };
        let error = transient(&compiled, &options, &mut |_, _| {}, &mut |_| true).unwrap_err();
        assert!(
            matches!(error, AnalysisError::BadRequest { .. }) && error.to_string().contains(part),
            "{text}: {error}"
        );
        let error = opened(&compiled, vec![text.into()]).unwrap_err().to_string();
        assert!(error.contains(part), "{text}: {error}");
    }
}
