//! The largest stress on the faces of beams, against closed forms.

use crate::{balance, close, linear};
use bimorph::analysis::statics::operating_point;
use bimorph::analysis::transient::{TransientOptions, transient};
use bimorph::compile::{CompileOptions, CompiledModel, Junctions, compile};
use bimorph::netlist::{Bundle, Setting};
use bimorph::readout::expression::Expression;
use bimorph::readout::signal::{Signal, SignalView};

const BEAM: &str = "
param fx=0, fy=0, turn=0, s0=0, fixed=0, dt=0
process p = [ Youngsmodulus=160e9 Poisson=0.25 density=2330 h=3u strength=1.2G stress=s0 thermalexpansion=2.6e-6 ]
anchor p [a] []
arm beam2d p [a t] [l=100u w=2u oz=turn T=dt]
if fixed anchor p [t] [oz=turn] else [
  f2d * [t] [F=fx oz=turn]
  f2d * [t] [F=fy oz=pi/2+turn]
]
free beam2d p [t e] [l=10u w=4u oz=turn+pi/2]
";

fn compiled(set: &[(&str, f64)], options: CompileOptions) -> CompiledModel {
    let set = set.iter().map(|(name, value)| ((*name).to_owned(), Setting::Number(*value))).collect();
    compile(&Bundle::from_text("model.net", BEAM), &CompileOptions { set, ..options }).unwrap_or_else(|e| panic!("{e}"))
}

fn stress(set: &[(&str, f64)], options: CompileOptions) -> f64 {
    let result = balance(&compiled(set, options), &[]);
    result.stresses_pa.iter().find(|(name, _)| name == "arm").unwrap().1
}

/// A cantilever has 6·F·l/(t·w²) at its root under a tip force, N/(w·t) under tension, and the sum under both, for any mesh and direction. With
/// calibrated junctions the root lies at the edge of the junction, a sixteenth of a micrometre further out.
#[test]
fn a_cantilever_has_the_stress_of_the_textbook() {
    let (w, t, l) = (2e-6, 3e-6, 100e-6);
    for (junctions, within) in [(Junctions::Centreline, 1e-9), (Junctions::Calibrated, 1e-3)] {
        for segments in [1, 3] {
            let options = || CompileOptions { junctions, segments: Some(segments), ..linear() };
            close(stress(&[("fy", 1e-6), ("turn", 0.7)], options()), 6.0 * 1e-6 * l / (t * w * w), within);
            close(stress(&[("fx", -2e-6)], options()), 2e-6 / (w * t), 1e-9);
            let both = stress(&[("fx", 2e-6), ("fy", 1e-6), ("turn", -2.0)], options());
            close(both, 2e-6 / (w * t) + 6.0 * 1e-6 * l / (t * w * w), within);
        }
    }
}

/// Between anchors residual stress and α·E·ΔT are the stress.
#[test]
fn built_in_and_thermal_stress_count() {
    let points = || CompileOptions { junctions: Junctions::Centreline, ..CompileOptions::default() };
    close(stress(&[("fixed", 1.0), ("s0", 50e6)], points()), 50e6, 1e-9);
    close(stress(&[("fixed", 1.0), ("dt", 100.0)], points()), 2.6e-6 * 160e9 * 100.0, 1e-9);
}

/// The root of a cantilever with fillets of a tenth of the width has 1.918 times the nominal stress in bending and 2.772 times that in tension, by Roark's formula at h/r = 10, x = 2/3 (by
/// hand). A root at the side of another beam has the same. A beam of twice the width on the same axis has the factor of h/r = 5, x = 1/2: 1.917 in bending. The free end, and a
/// continuation of the same width, have none. `nominal` stays as it is without a fillet.
#[test]
fn fillets_concentrate_stress() {
    let text = |layer: &str, more: &str| {
        format!(
            "process p = [ Youngsmodulus=160e9 Poisson=0.25 density=2330 h=3u strength=20G {layer} ]
            anchor p [a] []
            {more}
            arm beam2d p [r t] [l=100u w=2u]
            f2d * [t] [F=fx]
            f2d * [t] [F=fy oz=pi/2]"
        )
    };
    let of = |layer: &str, more: &str, [fx, fy]: [f64; 2], name: &str| -> f64 {
        let text = format!("param fx={fx}, fy={fy}\n{}", text(layer, more));
        let options = CompileOptions { junctions: Junctions::Centreline, segments: Some(3), ..linear() };
        let compiled = compile(&Bundle::from_text("model.net", &text), &options).unwrap_or_else(|e| panic!("{e}"));
        let point = operating_point(&compiled, &[]).unwrap();
        let still = vec![bimorph::multibody::planar::Pose::zeros(); point.q.len()];
        let view = SignalView { q: &point.q, v: &still, rise: &point.rise, volts: &point.volts };
        Expression::of_run(&compiled, name, &[]).unwrap().value(&compiled, &view)
    };
    let [bent, pulled] = [[0.0, 1e-6], [1e-6, 0.0]];
    let rooted = |layer: &str, load: [f64; 2], name: &str| of(layer, "link2d * [a r] [l=1n]", load, name);
    let (nominal, pull) = (6.0 * 1e-6 * 100e-6 / (3e-6 * 4e-12), 1e-6 / 6e-12);
    close(rooted("", bent, "arm.stress"), nominal, 1e-9);
    for (load, stress, factor) in [(bent, nominal, 1.918), (pulled, pull, 2.772)] {
        close(rooted("fillet=0.2u", load, "arm.stress") / stress, factor, 1e-3);
        close(rooted("fillet=0.2u", load, "arm.nominal"), stress, 1e-9);
    }
    let along = |width: &str| format!("base beam2d p [a r] [l=10u w={width}]");
    close(of("fillet=0.2u", &along("4u"), bent, "arm.stress") / nominal, 1.917, 1e-3);
    close(of("fillet=0.2u", &along("2u"), bent, "arm.stress") / nominal, 1.0, 1e-9);
    let side = "side beam2d p [a r] [l=10u w=2u oz=pi/2]";
    close(of("fillet=0.2u", side, bent, "arm.stress") / nominal, 1.918, 1e-3);
}

/// The slope of the signal is its change with the state: central differences.
#[test]
fn slopes_are_those_of_differences() {
    let compiled =
        compiled(&[("fx", 3e-5), ("fy", 2e-5)], CompileOptions { segments: Some(3), ..CompileOptions::default() });
    let signal = Signal::find(&compiled, "arm.stress").unwrap();
    let bodies = compiled.parts.system.bodies();
    let some = |k: usize, seed: f64| {
        let x = |d: f64| (12.9898 * (k as f64 + seed) + 78.233 * d).sin();
        bimorph::multibody::planar::Pose::new(1e-6 * x(1.0), 1e-6 * x(2.0), 0.02 * x(3.0))
    };
    let q: Vec<_> = (0..bodies).map(|k| some(k, 0.3)).collect();
    let dq: Vec<_> = (0..bodies).map(|k| some(k, 5.7)).collect();
    let still = vec![bimorph::multibody::planar::Pose::zeros(); bodies];
    let at = |s: f64| -> f64 {
        let moved: Vec<_> = q.iter().zip(&dq).map(|(q, dq)| q + dq * s).collect();
        signal.value(&compiled, &SignalView { q: &moved, v: &still, rise: &[], volts: &[] })
    };
    let state = SignalView { q: &q, v: &still, rise: &[], volts: &[] };
    let slope = signal.slope(&compiled, &state, &SignalView { q: &dq, v: &still, rise: &[], volts: &[] });
    close(slope, (at(1e-4) - at(-1e-4)) / 2e-4, 1e-6);
}

/// A run reports the stress as a signal, a sum of stresses has its unit, and a stress beyond the strength is a warning of `static`.
#[test]
fn runs_and_warnings_know_it() {
    let compiled = compiled(&[("fy", 30e-6)], CompileOptions::default());
    assert!(Expression::of_state(&compiled, "arm.stress-free.stress").is_ok());
    let options = TransientOptions {
        stop: 1e-5,
        points: 11,
        signals: vec!["arm.stress".to_owned()],
        ..TransientOptions::default()
    };
    let run = transient(&compiled, &options, &mut |_, _| {}, &mut |_| true).unwrap_or_else(|error| panic!("{error}"));
    let (name, unit, values) = &run.signals[0];
    assert_eq!((name.as_str(), unit.as_str(), values[0]), ("arm.stress", "Pa", 0.0));
    assert!(values.iter().any(|stress| *stress > 1e8), "{values:?}");
    let (_, result, _) =
        bimorph::analysis::mesh::static_fitted(&compiled, &[]).unwrap_or_else(|error| panic!("{error}"));
    let stress = result.stresses_pa[0].1;
    assert!(stress > 1.2e9, "{stress:e}");
    let (fitted, ..) = bimorph::analysis::mesh::static_fitted(&compiled, &[]).unwrap();
    assert!(fitted.warnings.items.iter().any(|warning| warning.code == "W051" && warning.message.contains("`arm`")));
}
