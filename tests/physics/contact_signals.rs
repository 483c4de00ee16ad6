//! Contact forces and the conductance of ohmic contacts as signals.

use crate::{balance, close, model};
use bimorph::analysis::statics::{OperatingPoint, operating_point};
use bimorph::compile::{CompileOptions, CompiledModel};
use bimorph::multibody::planar::Pose;
use bimorph::readout::signal::{Signal, SignalView};

/// A plate on a spring of 50 N/m, an electrode 1 µm away and a gold stop after 0.6 µm.
const RELAY: &str = "
anchor * [f] []
spring2d * [f a] [kx=50]
mass2d * [a] [m=2e-10]
guide2d * [a] []
field plategap2d * [a g] [A=1e-8 gap=1u]
anchor * [g] []
tip stop2d * [a] [gap=0.6u A=1e-12 hardness=2G contactresistivity=22n electronpath=38n]
eground * [a] []
gate port * [g a] []
";

fn value(compiled: &CompiledModel, point: &OperatingPoint, q: &[Pose], name: &str) -> f64 {
    let still = vec![Pose::zeros(); q.len()];
    let signal = Signal::find(compiled, name).unwrap_or_else(|error| panic!("{error}"));
    signal.value(compiled, &SignalView { q, v: &still, rise: &point.rise, volts: &point.volts })
}

/// A closed relay bears with the force of its field less that of its spring, and conducts as Holm and Sharvin say; open it has neither.
#[test]
fn a_closed_relay_conducts() {
    let compiled = model(RELAY, &CompileOptions::default());
    let at = |volts: f64| operating_point(&compiled, &[("gate".to_owned(), volts)]).unwrap();
    let open = at(5.0);
    assert_eq!([value(&compiled, &open, &open.q, "tip.N"), value(&compiled, &open, &open.q, "tip.G")], [0.0; 2]);
    let closed = at(20.0);
    let x = balance(&compiled, &[("gate", 20.0)]).nodes[1].1.x;
    let force = value(&compiled, &closed, &closed.q, "tip.N");
    close(force, 0.5 * 8.854e-12 * 1e-8 * 400.0 / (1e-6 - x).powi(2) - 50.0 * x, 1e-3);
    let a = (force / (std::f64::consts::PI * 2e9)).sqrt();
    let k = 38e-9 / a;
    let resistance = 22e-9 / (2.0 * a) * (1.0 + 0.83 * k) / (1.0 + 1.33 * k)
        + 4.0 * 22e-9 * 38e-9 / (3.0 * std::f64::consts::PI * a * a);
    close(value(&compiled, &closed, &closed.q, "tip.G"), 1.0 / resistance, 1e-9);
}

/// Slopes of contact forces and conductances are those of central differences, for a stop, plates and facing beams that are pressed.
#[test]
fn slopes_are_those_of_differences() {
    let plates = RELAY.replace("tip stop2d * [a] [gap=0.6u", "tip stop2d * [a] [gap=5u");
    let beams = "
anchor p1 [a] []
beam2d p1 [a b] [l=100u w=2u]
field gap2dforce p1 [a b c d] [l=100u w1=2u w2=2u gap=1u touch=0.1u]
anchor p1 [c] []
anchor p1 [d] []
eground * [a] []
w wire * [c d] []
e wire * [a b] []
gate port * [c a] []
";
    for (text, volts, names) in [
        (RELAY, 20.0, ["tip.N", "tip.G"]),
        (plates.as_str(), 20.0, ["field.N", "field.N"]),
        (beams, 60.0, ["field.N", "field.N"]),
    ] {
        let compiled = model(text, &CompileOptions { segments: Some(3), ..CompileOptions::default() });
        let point = operating_point(&compiled, &[("gate".to_owned(), volts)]).unwrap();
        let some = |k: usize| Pose::new((k as f64 + 0.7).sin(), (3.0 * k as f64 + 0.2).cos(), 1e4 * (k as f64).cos());
        let dq: Vec<Pose> = (0..point.q.len()).map(|k| some(k) * 1e-6).collect();
        let still = vec![Pose::zeros(); dq.len()];
        for name in names {
            let at = |s: f64| {
                let q: Vec<Pose> = point.q.iter().zip(&dq).map(|(q, dq)| q + dq * s).collect();
                value(&compiled, &point, &q, name)
            };
            assert!(at(0.0) > 0.0, "{name} {volts}");
            let rise = vec![0.0; point.rise.len()];
            let off = vec![0.0; point.volts.len()];
            let state = SignalView { q: &point.q, v: &still, rise: &point.rise, volts: &point.volts };
            let change = SignalView { q: &dq, v: &still, rise: &rise, volts: &off };
            let slope = Signal::find(&compiled, name).unwrap().slope(&compiled, &state, &change);
            close(slope, (at(1e-7) - at(-1e-7)) / 2e-7, 1e-5);
        }
    }
}
