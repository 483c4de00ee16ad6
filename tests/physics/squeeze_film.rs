//! Gas between facing plates and facing beams.

use crate::contact::Numbers;
use crate::{close, model};
use bimorph::analysis::harmonic::{HarmonicOptions, harmonic};
use bimorph::analysis::integrator::Integrator;
use bimorph::analysis::mode_quality::mode_losses;
use bimorph::analysis::statics::static_equilibrium;
use bimorph::analysis::transient::{TransientOptions, Until, transient};
use bimorph::compile::{CompileOptions, CompiledModel, Formulation};
use bimorph::domains::loss_derivatives::LossDerivatives;
use bimorph::multibody::planar::Pose;
use nalgebra::Vector3;
use std::f64::consts::TAU;

/// A guided plate of 1 mm × 0.5 mm on a spring, 20 µm in front of another one.
fn plate(mass: f64, spring: &str, gas: &str) -> CompiledModel {
    let text = format!(
        "param F=0
        anchor * [f] []
        mass2d * [m] [m={mass:e}]
        guide2d * [m] []
        {spring}
        f2d * [m] [F=F]
        anchor * [e] []
        plategap2d * [m e] [A=5e-7 l=1m w=0.5m gap=20u fringe=none viscosity=1.83e-5 filmstates=0 {gas}]
        eground * [e] []
        drive port * [m e] []"
    );
    model(&text, &CompileOptions::default())
}

/// β(0.5)·μ·L·W³ of that plate, β from an independent summation of the series.
const STRENGTH: f64 = 0.686_045 * 1.83e-5 * 1e-3 * 1.25e-10;

/// Largest response at resonance: F/(c·ω₀) behind a quarter of a period, c = β·μ·L·W³/(Q·g³) with the slip Q = 1 + 9.638·(λ/g)^1.159, λ = 68 nm at one
/// atmosphere and in inverse proportion to the pressure.
#[test]
fn peak_of_the_response() {
    let natural: f64 = (4e3f64 / 1e-8).sqrt();
    for (gas, free_path) in [
        ("pressure=101325", 68e-9),
        ("pressure=1013.25", 68e-7),
        ("pressure=5e4 meanfreepath=0", 0.0),
        ("pressure=5e4 meanfreepath=0.2u", 0.2e-6f64),
    ] {
        let compiled = plate(1e-8, "spring2d * [f m] [kx=4e3]", gas);
        let asked = HarmonicOptions {
            drive: "m.fx".into(),
            signals: vec!["m.x".into()],
            from: natural / TAU,
            to: 2.0 * natural / TAU,
            points: 2,
            ..HarmonicOptions::default()
        };
        let found = harmonic(&compiled, &asked, &mut |_| true).unwrap();
        let slip = 1.0 + 9.638 * (free_path / 20e-6).powf(1.159);
        let c = STRENGTH / (8e-15 * slip);
        let [re, im] = found.signals[0].values[0];
        close(-im, 1.0 / (c * natural), 2e-6);
        assert!(re.abs() < 1e-6 * im.abs(), "{gas}: {re:e}");
        let pole = found.poles.unwrap()[0];
        close(-2.0 * pole.re, c / 1e-8, 2e-6);
    }
}

/// No pressure, no viscosity, an undamped model, or plates without sides: no film. The last is warned of.
#[test]
fn without_a_film() {
    for gas in ["", "pressure=0", "meanfreepath=68n"] {
        assert_eq!(plate(1e-8, "spring2d * [f m] [kx=4e3]", gas).parts.system.members.len(), 1);
    }
    let sides = "anchor * [f] []\nmass2d * [m] [m=1e-8]\nspring2d * [f m] [kx=1]\nanchor * [e] []\n\
                 plategap2d * [m e] [A=1e-8 gap=2u fringe=none viscosity=1.8e-5 pressure=1e5]";
    let compiled = model(sides, &CompileOptions::default());
    assert_eq!(compiled.parts.system.members.len(), 1);
    assert!(compiled.warnings.to_string().contains("W024"), "{}", compiled.warnings);
    let given = sides.replace("A=1e-8", "A=1e-8 w=50u");
    assert_eq!(model(&given, &CompileOptions::default()).parts.system.members.len(), 2);
    let undamped = CompileOptions { undamped: true, ..CompileOptions::default() };
    assert_eq!(model(&given, &undamped).parts.system.members.len(), 1);
}

/// Stefan's equation: a constant force F closes a gap from g₀ to g₁ in c₀·g₀³/(2F)·(1/g₁² − 1/g₀²) where gas without slip holds the plate, and a spring with 5e-6 of the force. Every method and
/// formulation, at 1e-3, which is the tolerance of their steps.
#[test]
fn a_plate_sinks_as_stefan_says() {
    let compiled = model(
        "anchor * [f] []
        mass2d * [m] [m=1e-13]
        guide2d * [m] []
        spring2d * [f m] [kx=1e-6]
        f2d * [m] [F=2u]
        anchor * [e] []
        plategap2d * [m e] [A=5e-7 l=1m w=0.5m gap=20u fringe=none viscosity=1.83e-5 pressure=1e5 meanfreepath=0 filmstates=0]",
        &CompileOptions::default(),
    );
    let time = |from: f64, to: f64| STRENGTH / (2.0 * 2e-6) * (1.0 / (to * to) - 1.0 / (from * from));
    let end = time(20e-6, 10e-6);
    let methods = [
        (Integrator::Rodas4, None),
        (Integrator::Radau5, None),
        (Integrator::Sdirk4, None),
        (Integrator::TrBdf2, None),
        (Integrator::Newmark, Some(end / 20_000.0)),
        (Integrator::GeneralizedAlpha { rho: 0.8 }, Some(end / 20_000.0)),
        (Integrator::AverageField, Some(end / 20_000.0)),
    ];
    for (method, step) in methods {
        let asked = TransientOptions {
            stop: end,
            signals: vec!["m.x".into()],
            points: 11,
            method,
            step,
            tol: 1e-4,
            ..TransientOptions::default()
        };
        let run =
            transient(&compiled, &asked, &mut |_, _| {}, &mut |_| true).unwrap_or_else(|e| panic!("{method:?}: {e}"));
        for (t, x) in run.t.iter().zip(&run.signals[0].2).skip(1) {
            close(time(20e-6, 20e-6 - x), *t, 1e-3);
        }
    }
}

/// The equilibrium under voltage and the pull-in voltage do not depend on gas; the closing takes longer.
#[test]
fn only_motions_feel_it() {
    let [dry, wet] = ["", "pressure=101325"].map(|gas| plate(1e-8, "spring2d * [f m] [kx=4e3]", gas));
    let at = |compiled: &CompiledModel| {
        static_equilibrium(compiled, &[("drive".into(), 500.0)]).unwrap().nodes.iter().find(|n| n.0 == "m").unwrap().1.x
    };
    assert_eq!(at(&dry).to_bits(), at(&wet).to_bits());
    let closes = |compiled: &CompiledModel| {
        let asked = TransientOptions {
            stop: 2e-2,
            signals: vec!["m.x".into()],
            voltages: vec![("drive".into(), 2000.0)],
            until: Some(Until::Contact),
            ..TransientOptions::default()
        };
        transient(compiled, &asked, &mut |_, _| {}, &mut |_| true).unwrap().stopped_at.unwrap()
    };
    let (dry, wet) = (closes(&dry), closes(&wet));
    assert!(wet > 1.05 * dry, "{dry:e} {wet:e}");
    // forty fingers have the film of one, forty times
    let [one, forty] = ["A=5e-9", "A=2e-7"].map(|area| {
        let text = format!(
            "anchor * [f] []\nmass2d * [m] [m=1e-9]\nguide2d * [m] []\nspring2d * [f m] [kx=1]\nanchor * [e] []\n\
             plategap2d * [m e] [{area} l=100u w=50u gap=2u fringe=none viscosity=1.83e-5 pressure=1e5]"
        );
        let compiled = model(&text, &CompileOptions::default());
        let system = &compiled.parts.system;
        let q = vec![Pose::zeros(); system.bodies()];
        let unit: Vec<Pose> =
            system.model.bodies.iter().map(|b| Pose::new(f64::from(u8::from(b.mass > 0.0)), 0.0, 0.0)).collect();
        system.gas_damping(&q, &unit, 1e6)
    });
    close(forty, 40.0 * one, 1e-12);
}

/// Two bars of 100 µm that face each other over 2 µm, both ends of one on a rigid body.
const BARS: &str = "
    anchor * [c] []
    link2d * [c d] [l=100u]
    mass2d * [a] [m=1e-10 J=1e-18]
    link2d * [a b] [l=100u]
    spring2d * [s a] [kx=1 ky=1 krz=1e-8 l=5u]
    anchor * [s] []
    gap2dforce * [a b c d] [l=100u w1=2u w2=2u gap=2u h=20u viscosity=1.83e-5 pressure=1e5 meanfreepath=0]
    eground * [c] []";

/// Bars that approach as they are, parallel, have β(h/l)·μ·l·h³/g³ along the gap, half of it at each end: force and moment about node a.
#[test]
fn parallel_bars() {
    let compiled = model(BARS, &CompileOptions::default());
    let system = &compiled.parts.system;
    assert_eq!(system.bodies(), 1);
    let mut force = [Pose::zeros()];
    system.add_loss(&[Pose::zeros()], |_| Vector3::new(0.3, -0.2, 0.0), &mut force);
    // β(0.2) = 1 − 0.630249·0.2 of a short strip, to the terms of the series that differ from it by e^{−5π}
    let c = (1.0 - 0.630_249 * 0.2) * 1.83e-5 * 100e-6 * 8e-15 / 8e-18;
    close(force[0].y, -0.2 * c, 2e-6);
    assert!(force[0].x.abs() < 1e-12 * force[0].y.abs());
    close(force[0].z.abs(), 0.2 * c * 50e-6, 2e-6);
}

/// Derivatives of the forces with displacements and rates, against central differences of fourth order over 200 random states of a linear model, down
/// to contact: 1e-7 of the largest. Plates do not rotate: their moment of tilt enters the matrix at the present gap.
#[test]
fn derivatives() {
    let bars = BARS.to_owned();
    let plates = bars.replace(
        "gap2dforce * [a b c d] [l=100u w1=2u w2=2u gap=2u h=20u",
        "plategap2d * [c a] [A=2e-9 l=100u w=20u gap=2u fringe=none oz=pi/2 filmstates=0",
    );
    let linear = CompileOptions { linear: true, ..CompileOptions::default() };
    for (text, turns) in [(bars, 1e3), (plates, 0.0)] {
        let compiled = model(&text, &linear);
        let system = &compiled.parts.system;
        let mut derivatives = LossDerivatives::of(system).unwrap();
        let mut random = Numbers(7);
        let mut between = |low: f64, high: f64| low + (high - low) * random.between(1.0, std::f64::consts::E).ln();
        for _ in 0..200 {
            let q = Pose::new(between(-1e-6, 1e-6), between(-1.7e-6, 1e-6), between(-2e-3, 2e-3));
            let v = Pose::new(between(-1.0, 1.0), between(-1.0, 1.0), between(-turns, turns));
            let force = |q: &Pose, v: &Pose| {
                let mut force = [Pose::zeros()];
                system.add_loss(&[*q], |_| *v, &mut force);
                force[0]
            };
            derivatives.at(system, &[q], |_| v);
            let model = &system.model;
            for i in 0..3 {
                let scale = if i < 2 { 1.0 } else { 1e4 };
                let unit = Pose::from_fn(|j, _| if i == j { 1.0 } else { 0.0 });
                let differences = |of: &dyn Fn(f64) -> Pose, h: f64| {
                    let one = |h: f64| (of(h) - of(-h)) / (2.0 * h);
                    (one(h) * 4.0 - one(2.0 * h)) / 3.0
                };
                let mut by_rate = [Pose::zeros()];
                derivatives.add_damping(|_| unit, &mut by_rate);
                let numeric = differences(&|h| force(&q, &(v + unit * h)), 1e-3 * scale);
                let largest = derivatives.damping().unwrap().diagonal[0].norm();
                assert!((numeric - by_rate[0]).norm() <= 1e-7 * largest, "{i}: {numeric} {}", by_rate[0]);
                let mut stiffness = bimorph::multibody::BodyMatrix::new(&model.pattern);
                derivatives.add_stiffness(1.0, &mut stiffness);
                let own = stiffness.diagonal[0] * unit;
                let numeric = differences(&|h| force(&(q + unit * h), &v), 4e-11 * scale.min(1e3));
                assert!(
                    (numeric - own).norm() <= 1e-7 * stiffness.diagonal[0].norm() * unit.norm(),
                    "{i}: {numeric} {own}"
                );
            }
        }
    }
}

/// Joint coordinates have the same film.
#[test]
fn in_joint_coordinates() {
    let text = "anchor * [f] []
        mass2d * [m] [m=1e-8]
        guide2d * [m] []
        spring2d * [f m] [kx=4e3]
        f2d * [m] [F=1m]
        anchor * [e] []
        plategap2d * [m e] [A=5e-7 l=1m w=0.5m gap=20u fringe=none viscosity=1.83e-5 pressure=1e5 filmstates=0]";
    let run = |formulation: Formulation| {
        let compiled = model(text, &CompileOptions { formulation, ..CompileOptions::default() });
        let asked = TransientOptions {
            stop: 2e-4,
            signals: vec!["m.x".into()],
            points: 41,
            tol: 1e-5,
            ..TransientOptions::default()
        };
        transient(&compiled, &asked, &mut |_, _| {}, &mut |_| true).unwrap().signals[0].2.clone()
    };
    let bodies = run(Formulation::Compliant);
    for (x, y) in bodies.iter().zip(run(Formulation::RcrElastic)) {
        assert!((x - y).abs() < 1e-4 * 0.25e-6, "{x:e} {y:e}");
    }
}

/// ANSYS' verification manual VM245: a plate of 1 mm × 2 mm over 5 µm at 1e5 Pa and 1.83e-5 Pa·s has, at 100 kHz, C = 0.01529838433 N·s/m and K = 28651.30773 N/m (sums
/// of Blech's series, computed independently). From 1/x of a force; by default to 3e-3, with 41 states to 1.2e-6.
#[test]
fn vm245() {
    for (states, within) in [("", 3e-3), ("filmstates=41", 1.2e-6)] {
        let text = format!(
            "anchor * [f] []
            mass2d * [m] [m=1e-9]
            guide2d * [m] []
            spring2d * [f m] [kx=1]
            anchor * [e] []
            plategap2d * [m e] [A=2e-6 l=1m w=2m gap=5u fringe=none viscosity=1.83e-5 pressure=1e5 meanfreepath=0 {states}]"
        );
        let compiled = model(&text, &CompileOptions::default());
        let asked = HarmonicOptions {
            drive: "m.fx".into(),
            signals: vec!["m.x".into()],
            from: 1e5,
            to: 2e5,
            points: 2,
            even: true,
            ..HarmonicOptions::default()
        };
        let [re, im] = harmonic(&compiled, &asked, &mut |_| true).unwrap().signals[0].values[0];
        let omega: f64 = TAU * 1e5;
        let size = re * re + im * im;
        close(-im / size / omega, 0.015_298_384_33, within);
        close(re / size - 1.0 + 1e-9 * omega * omega, 28_651.307_73, within);
    }
}

/// A plate on a spring and its electrode, with two states of gas a body that compresses.
fn compressed(mass: f64) -> CompiledModel {
    let text = format!(
        "anchor * [f] []
        mass2d * [m] [m={mass:e}]
        guide2d * [m] []
        spring2d * [f m] [kx=0.4]
        anchor * [e] []
        plategap2d * [m e] [A=1e-8 l=100u w=100u gap=2u fringe=none viscosity=1.83e-5 pressure=101325 filmstates=4]
        eground * [e] []
        drive port * [m e] []"
    );
    model(&text, &CompileOptions::default())
}

/// Derivatives of the forces of gas that compresses with displacements, the symmetric part and the skew one together, and with rates, against central differences of
/// fourth order over 200 random states: 1e-7 of the largest.
#[test]
fn derivatives_of_states() {
    let compiled = compressed(1e-11);
    let system = &compiled.parts.system;
    let count = system.bodies();
    let mut derivatives = LossDerivatives::of(system).unwrap();
    let mut random = Numbers(11);
    let mut between = |low: f64, high: f64| low + (high - low) * random.between(1.0, std::f64::consts::E).ln();
    for _ in 0..200 {
        let mut poses = |low: f64, high: f64| -> Vec<Pose> {
            (0..count).map(|_| Pose::new(between(low, high), between(low, high), 0.0)).collect()
        };
        let (q, v) = (poses(-1e-6, 1.7e-6), poses(-1.0, 1.0));
        let unit = poses(-1.0, 1.0);
        let force = |dq: f64, dv: f64| {
            let at: Vec<Pose> = q.iter().zip(&unit).map(|(q, x)| q + x * dq).collect();
            let mut force = vec![Pose::zeros(); count];
            system.add_loss(&at, |k| v[k] + unit[k] * dv, &mut force);
            force
        };
        derivatives.at(system, &q, |k| v[k]);
        let pattern = &system.model.pattern;
        let mut stiffness = bimorph::multibody::BodyMatrix::new(pattern);
        derivatives.add_stiffness(1.0, &mut stiffness);
        let mut by_place = vec![Pose::zeros(); count];
        stiffness.multiply_add_of(pattern, |k| unit[k], &mut by_place);
        derivatives.add_skew(&unit, &mut by_place);
        let mut by_rate = vec![Pose::zeros(); count];
        derivatives.add_damping(|k| unit[k], &mut by_rate);
        let differences = |of: &dyn Fn(f64) -> Vec<Pose>, h: f64, k: usize| {
            let one = |h: f64| (of(h)[k] - of(-h)[k]) / (2.0 * h);
            (one(h) * 4.0 - one(2.0 * h)) / 3.0
        };
        for (own, of, h) in [
            (&by_place, &(|h| force(h, 0.0)) as &dyn Fn(f64) -> Vec<Pose>, 4e-11),
            (&by_rate, &(|h| force(0.0, h)) as &dyn Fn(f64) -> Vec<Pose>, 1e-3),
        ] {
            let largest = own.iter().map(|x| x.norm()).fold(0.0, f64::max);
            for (k, derivative) in own.iter().enumerate().take(count) {
                let numeric = differences(of, h, k);
                assert!((numeric - derivative).norm() <= 1e-7 * largest, "{k}: {numeric} {derivative}");
            }
        }
    }
}

/// Where gas holds a light plate, steps that follow the tolerance have nearly the order 4 of their method. A thousandth of the tolerance takes less than
/// ten times the steps. At 1e-3 they are at most three times the 29 of the same plate in gas that does not compress.
#[test]
fn steps_keep_their_order_in_gas_that_compresses() {
    let steps = |compiled: &CompiledModel, tol: f64| {
        let asked = TransientOptions {
            stop: 2e-4,
            signals: vec!["m.x".into()],
            voltages: vec![("drive".into(), 3.0)],
            points: 5,
            tol,
            ..TransientOptions::default()
        };
        transient(compiled, &asked, &mut |_, _| {}, &mut |_| true).unwrap().counters.steps
    };
    let compiled = compressed(1e-11);
    let [coarse, fine] = [1e-3, 1e-6].map(|tol| steps(&compiled, tol));
    println!("{coarse} steps at 1e-3, {fine} at 1e-6");
    assert!(fine < 10 * coarse && coarse < 90, "{coarse} {fine}");
}

/// Plates of 100 µm × 50 µm, 2 µm apart, that tilt about the normal of the drawing: c_θ = G·μ·b·a⁵/(60·g³) with G(2) = 0.43888143 and, turned round, G(0.5) =
/// 0.84752145 (independent Fourier series); the power of a mode that tilts is c_θ·ω².
#[test]
fn tilting_plates() {
    for (sides, factor, a, b) in
        [("l=100u w=50u", 0.438_881_43, 100e-6f64, 50e-6), ("l=50u w=100u", 0.847_521_45, 50e-6f64, 100e-6)]
    {
        for states in [0, 4] {
            let text = format!(
                "anchor * [f] []
                mass2d * [m] [m=1e-10 J=1e-19]
                spring2d * [f m] [kx=1 ky=1 krz=1e-9]
                anchor * [e] []
                plategap2d * [m e] [A=5e-9 {sides} gap=2u fringe=none viscosity=1.83e-5 pressure=1e5 meanfreepath=0 filmstates={states}]"
            );
            let compiled = model(&text, &CompileOptions::default());
            let system = &compiled.parts.system;
            let n = system.bodies();
            let plate = system.model.bodies.iter().position(|body| body.mass > 0.0).unwrap();
            let mut rate = vec![Pose::zeros(); n];
            rate[plate].z = 3.0;
            let mut force = vec![Pose::zeros(); n];
            system.add_loss(&vec![Pose::zeros(); n], |k| rate[k], &mut force);
            let c = factor * 1.83e-5 * b * a.powi(5) / (60.0 * 8e-18);
            close(force[plate].z, 3.0 * c, 1e-6);
            close(system.gas_damping(&vec![Pose::zeros(); n], &rate, 1e3), 9.0 * c, 1e-6);
        }
    }
}

/// Gas slides between the fingers of a comb as long as they overlap: N·μ/(1 + 2Kn + 0.2·Kn^0.788·e^{−Kn/10})·h/gap·(l + u), Kn = λ/gap; and under a plate on μ/fluid
/// with the same slip. Without a `pressure` the comb has none and the plate no slip.
#[test]
fn sliding_gas() {
    let text = "
        process p = [ density=2300 h=20u viscosity=1.83e-5 fluid=2u PRESSURE ]
        anchor p [f] [l=1u w=1u]
        plate2d p [m] [l=100u w=100u]
        guide2d p [m] []
        spring2d * [f m] [kx=1]
        comb2de p [m e] [N=40 gap=2u l=10u L=30u]
        anchor p [e] [l=1u w=1u]";
    let drag = |pressure: &str, x: f64| {
        let compiled = model(&text.replace("PRESSURE", pressure), &CompileOptions::default());
        let system = &compiled.parts.system;
        let (q, unit) = (vec![Pose::new(x, 0.0, 0.0)], vec![Pose::new(1.0, 0.0, 0.0)]);
        let mut under = vec![Pose::zeros()];
        bimorph::multibody::forces::add_damping(&system.model, &unit, &mut under);
        [under[0].x, system.gas_damping(&q, &unit, 0.0)]
    };
    let (kn, continuum) = (0.34f64 / 2.0, 1.83e-5 * 1e-8 / 2e-6);
    let slip = 1.0 + 2.0 * kn + 0.2 * kn.powf(0.788) * (-0.1 * kn).exp();
    let [under, between] = drag("", 0.0);
    close(under, continuum, 1e-12);
    assert_eq!(between, 0.0);
    assert_eq!(drag("pressure=0", 0.0), [0.0, 0.0]);
    let [under, between] = drag("pressure=20265", 4e-6);
    close(under, continuum / slip, 1e-12);
    close(between, 40.0 * 1.83e-5 / slip * 20e-6 / 2e-6 * 14e-6, 1e-12);
}

/// A perforated plate of 100 µm × 1 mm, nearly Bao's strip: 1400.095 Pa·s/m per area (independent computation) but for the flow at its short ends, over a length of l = 7.77 µm each.
#[test]
fn perforated_plate() {
    let text = "
        anchor * [f] []
        mass2d * [m] [m=1e-10]
        guide2d * [m] []
        spring2d * [f m] [kx=1]
        anchor * [e] []
        plategap2d * [m e] [A=1e-7 l=100u w=1m gap=2u fringe=none viscosity=1.83e-5 pressure=1e5 meanfreepath=0 hole=2u pitch=10u h=2u]";
    let compiled = model(text, &CompileOptions::default());
    let c = compiled.parts.system.gas_damping(&[Pose::zeros()], &[Pose::new(1.0, 0.0, 0.0)], 0.0) / 1e-7;
    assert!(c < 1400.095 && c > 1400.095 * (1.0 - 2.0 * 7.78e-6 / 1e-3), "{c}");
}

/// Thermoelastic quality of a clamped beam of 400 µm × 12 µm (E = 157 GPa, ρ = 2330 kg/m³, α = 2.6e-6/K, c_p = 700 J/(kg·K), k = 90 W/(m·K), 293.15 K) by Lifshitz and Roukes'
/// law: 10619.79 at 632838 Hz (independent computation). The shares of drag and thermoelasticity add up.
#[test]
fn thermoelastic_quality() {
    let text = |gas: &str| {
        format!(
            "process s = [ Youngsmodulus=157e9 Poisson=0.06 density=2330 h=10u thermalexpansion=2.6e-6 specificheat=700 thermcond=90 ambienttemperature=293.15 {gas} ]
            anchor s [a] [l=5u w=20u oz=pi]
            beam2d s [a b] [l=400u w=12u]
            anchor s [b] [l=5u w=20u]"
        )
    };
    let options = CompileOptions { segments: Some(32), ..CompileOptions::default() };
    let of = |gas: &str| mode_losses(&model(&text(gas), &options), 1, &[]).unwrap()[0];
    let dry = of("");
    close(dry.frequency_hz, 632_838.0, 2e-3);
    close(dry.quality(), 10_619.79, 5e-3);
    assert_eq!((dry.drag, dry.gas), (0.0, 0.0));
    let wet = of("viscosity=1.8e-5 fluid=2u");
    close(wet.thermoelastic, dry.thermoelastic, 1e-9);
    // μ/(fluid·ρ·h)/ω
    close(wet.drag, 1.8e-5 / (2e-6 * 2330.0 * 10e-6) / (TAU * wet.frequency_hz), 1e-6);
    close(1.0 / wet.quality(), wet.drag + wet.thermoelastic, 1e-12);
}

/// A clamped beam of 610 µm × 2.2 µm, 40 µm deep, over an electrode 2.3 µm away in air (1.82e-5 Pa·s, λ = 0.064 µm). A pressure of 3.7 MPa acts along it, and it may move
/// along itself. Pull-in is at 8.863 V to 5e-3. The times to 0.9 of the gap are 259, 137.4 and 112.5 µs at 9.5, 10.5 and 11 V, to 3e-2. The source of all is an
/// independent solution of the beam's and Reynolds' equations.
#[test]
fn a_beam_over_an_electrode_in_air() {
    let text = "
        process s = [ Youngsmodulus=149e9 Poisson=0 density=2330 h=40u viscosity=1.82e-5 pressure=101.3k meanfreepath=64n ]
        anchor s [a] []
        beam2d s [a m] [l=305u w=2.2u]
        beam2d s [m b] [l=305u w=2.2u]
        gap2dforce s [a b c d] [l=610u w1=2.2u w2=2.2u gap=2.3u h=40u fringe=none]
        anchor s [c] []
        anchor s [d] []
        guide2d * [b] []
        dashpot2d * [b] [bx=1.6m]
        f2d * [b] [F=-3.7e6*40u*2.2u]
        eground * [a] []
        drive port * [c a] []";
    let compiled = model(text, &CompileOptions::default());
    close(bimorph::analysis::pull_in::pull_in(&compiled, None, 50.0).unwrap().pull_in_v, 8.863, 5e-3);
    for (volts, time) in [(9.5, 259e-6), (10.5, 137.4e-6), (11.0, 112.5e-6)] {
        let asked = TransientOptions {
            stop: 6e-4,
            signals: vec!["m.y".into()],
            voltages: vec![("drive".into(), volts)],
            until: Some(Until::Level("m.y".into(), -0.9 * 2.3e-6)),
            ..TransientOptions::default()
        };
        let found = transient(&compiled, &asked, &mut |_, _| {}, &mut |_| true).unwrap();
        println!("{volts} V: {:?} {:?}", found.stopped_at, found.counters);
        close(found.stopped_at.unwrap(), time, 3e-2);
    }
}
