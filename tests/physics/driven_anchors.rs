//! Anchors whose displacement and rotation are inputs, against closed forms of beams and of a base-excited oscillator, an independent solution of the elastica,
//! and the strains of a package.

use crate::{balance, close, node};
use bimorph::analysis::continuation::{ContinuationRequest, PathInput, trace};
use bimorph::analysis::frame::{frame, frame_statics};
use bimorph::analysis::harmonic::grid::Spacing;
use bimorph::analysis::harmonic::{HarmonicOptions, harmonic};
use bimorph::analysis::integrator::Integrator;
use bimorph::analysis::mesh::fitted_in_time;
use bimorph::analysis::statics::{AnchorForce, StaticResult};
use bimorph::analysis::transient::{TransientOptions, TransientResult, transient};
use bimorph::compile::{Anchors, CompileOptions, CompiledModel, Formulation, Junctions, compile};
use bimorph::device::local::LocalDevice;
use bimorph::device::{Device, Mode, OpenRequest, PortKind, Status, Token, Trial, TrialReply};
use bimorph::domains::InputWaveform;
use bimorph::netlist::{Bundle, Setting};
use bimorph::solve::continuation::Branch;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

const L: f64 = 200e-6;
const W: f64 = 2e-6;
const E: f64 = 160e9;
const EA: f64 = E * W * W;
const EI: f64 = E * W * W * W * W / 12.0;

/// A beam between an anchor at its left end and a driven one at its right end.
const BRIDGE: &str = "
param eps=0, turn=0, rz=0
process p = [ Youngsmodulus=160e9 density=2330 h=2u strength=1e12 ]
anchor p [a] [oz=turn]
left beam2d p [a m] [l=100u w=2u oz=turn]
right beam2d p [m b] [l=100u w=2u oz=turn]
anchor p [b] [oz=turn moves=1 anchorrz=rz]
";

/// A mass of 1e-10 kg on a spring of 1 N/m and a damper of 1e-6 N·s/m behind a driven anchor: ω₀ = 1e5 rad/s, ζ = 0.05.
const OSCILLATOR: &str = "
anchor * [b] [l=1u w=1u h=1u moves=1]
spring2d * [b m] [kx=1 l=20u]
damper2d * [b m] [bx=1e-6 l=20u]
mass2d * [m] [m=1e-10]
guide2d * [m] []
";
const MASS: f64 = 1e-10;
const K: f64 = 1.0;
const C: f64 = 1e-6;

fn options(set: &[(&str, f64)]) -> CompileOptions {
    CompileOptions {
        set: set.iter().map(|(name, value)| ((*name).to_owned(), Setting::Number(*value))).collect(),
        junctions: Junctions::Centreline,
        shear: false,
        segments: Some(32),
        ..CompileOptions::default()
    }
}

fn compiled_with(text: &str, options: &CompileOptions) -> CompiledModel {
    compile(&Bundle::from_text("model.net", text), options).unwrap_or_else(|e| panic!("{e}"))
}

fn compiled(text: &str, set: &[(&str, f64)]) -> CompiledModel {
    compiled_with(text, &options(set))
}

fn force(found: &StaticResult, node: &str) -> AnchorForce {
    found.anchor_forces.iter().find(|(name, _)| name == node).unwrap().1
}

/// End force and moment of a clamped elastica with strain, EI·θ' = M and EA·ε = N, whose right end is moved to (L + u, v) and turned by φ. Shooting with the
/// classical Runge-Kutta method in 2000 steps, and Newton's method on force and moment.
fn elastica(u: f64, v: f64, phi: f64) -> [f64; 3] {
    let scale = Vector3::new(EA * 1e-3, 12.0 * EI / (L * L), EI / L);
    // where the left end lies and how it is turned, with a force and a moment on the right end, which has gone a part of its way
    let end = |x: Vector3<f64>, part: f64| {
        let [fx, fy, m] = [x[0] * scale[0], x[1] * scale[1], x[2] * scale[2]];
        let rate = |[_, _, t, m]: [f64; 4]| {
            let (s, c) = t.sin_cos();
            let stretch = 1.0 + (fx * c + fy * s) / EA;
            [stretch * c, stretch * s, m / EI, -(fy * c - fx * s) * stretch]
        };
        let h = -L / 2000.0;
        let mut y = [L + part * u, part * v, part * phi, m];
        for _ in 0..2000 {
            let add = |y: [f64; 4], k: [f64; 4], h: f64| [0, 1, 2, 3].map(|i| y[i] + h * k[i]);
            let k1 = rate(y);
            let k2 = rate(add(y, k1, h / 2.0));
            let k3 = rate(add(y, k2, h / 2.0));
            let k4 = rate(add(y, k3, h));
            y = [0, 1, 2, 3].map(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
        }
        Vector3::new(y[0] / L, y[1] / L, y[2])
    };
    let mut x = Vector3::zeros();
    for part in 1..=20 {
        let part = f64::from(part) / 20.0;
        for _ in 0..40 {
            let r = end(x, part);
            let column = |i: usize| {
                let mut y = x;
                y[i] += 1e-6;
                (end(y, part) - r) / 1e-6
            };
            let jacobian = Matrix3::from_columns(&[column(0), column(1), column(2)]);
            let step = jacobian.try_inverse().unwrap() * r;
            let factor = (0..8).map(|k| 0.5_f64.powi(k)).find(|f| end(x - step * *f, part).norm() < r.norm());
            x -= step * factor.unwrap_or(0.0);
        }
        assert!(end(x, part).norm() < 1e-9, "{part}");
    }
    x.component_mul(&scale).into()
}

/// The stiffness of a clamped beam's end, in two directions of the drawing: forces 12EI·v/L³ and EA·u/L, moments 6EI·v/L² and 4EI·φ/L of small motions, to 1e-5
/// (Gere & Timoshenko, "Mechanics of materials", appendix). A linear model has them at any size, and a drawn rotation is a driven one.
#[test]
fn a_clamped_end_resists_as_its_closed_form() {
    for turn in [0.0, 0.9_f64] {
        let (s, c) = turn.sin_cos();
        let model = compiled(BRIDGE, &[("turn", turn)]);
        let (v, phi) = (1e-10, 1e-7);
        let across = force(&balance(&model, &[("b.ux", -s * v), ("b.uy", c * v)]), "b");
        close(-s * across.fx + c * across.fy, 12.0 * EI * v / L.powi(3), 1e-5);
        close(across.m, -6.0 * EI * v / L.powi(2), 1e-5);
        let along = force(&balance(&model, &[("b.ux", c * v), ("b.uy", s * v)]), "b");
        close(c * along.fx + s * along.fy, EA * v / L, 1e-5);
        let turned = force(&balance(&model, &[("b.urz", phi)]), "b");
        close(turned.m, 4.0 * EI * phi / L, 1e-5);
        close(-s * turned.fx + c * turned.fy, -6.0 * EI * phi / L.powi(2), 1e-5);
        let drawn = force(&balance(&compiled(BRIDGE, &[("turn", turn), ("rz", phi)]), &[]), "b");
        close(drawn.m, turned.m, 1e-9);
    }
    let linear = compiled_with(BRIDGE, &CompileOptions { linear: true, ..options(&[]) });
    let far = force(&balance(&linear, &[("b.uy", 20e-6), ("b.urz", 0.1)]), "b");
    close(far.fy, 12.0 * EI * 20e-6 / L.powi(3) - 6.0 * EI * 0.1 / L.powi(2), 1e-5);
    close(far.m, -6.0 * EI * 20e-6 / L.powi(2) + 4.0 * EI * 0.1 / L, 1e-5);
    assert!(far.fx.abs() < 1e-6 * far.fy);
    // the linear frame moves anchors of the drawing
    let text = BRIDGE.replace("anchorrz=rz", "anchorrz=rz anchory=1n");
    let model = compiled(&text, &[("rz", 1e-4)]);
    let (found, _) = frame_statics(&model, &frame(&model).unwrap(), &[]).unwrap();
    close(node(&found, "m").y, 0.5e-9 - 1e-4 * L / 8.0, 1e-4);
    assert!(frame_statics(&model, &frame(&model).unwrap(), &[("b.uy".into(), 1e-9)]).is_err());
}

/// Moved and turned far, its end has the force and moment of the elastica: to 2e-4 of the largest.
#[test]
fn large_motions_are_those_of_the_elastica() {
    for [u, v, phi] in [[-1.2e-6, 20e-6, 0.0], [-0.34e-6, 10e-6, 0.1], [-0.52e-6, 10e-6, -0.1]] {
        let model = compiled_with(BRIDGE, &CompileOptions { segments: Some(128), ..options(&[]) });
        let found = force(&balance(&model, &[("b.ux", u), ("b.uy", v), ("b.urz", phi)]), "b");
        let [fx, fy, m] = elastica(u, v, phi);
        let most = fx.abs().max(fy.abs());
        assert!((found.fx - fx).abs() < 2e-4 * most, "{u} {v} {phi}: {found:?} {fx:e} {fy:e} {m:e}");
        assert!((found.fy - fy).abs() < 2e-4 * most, "{u} {v} {phi}: {found:?} {fx:e} {fy:e} {m:e}");
        assert!((found.m - m).abs() < 2e-4 * m.abs(), "{u} {v} {phi}: {found:?} {fx:e} {fy:e} {m:e}");
    }
}

/// A cantilever whose only anchor turns by 1.2 rad and moves goes with it as a rigid body: its anchor needs no force, and its end lies at R(φ)·(L, 0).
#[test]
fn a_cantilever_turns_with_its_anchor() {
    let text = "process p = [ Youngsmodulus=160e9 density=2330 h=2u ]
anchor p [a] [moves=1]
beam2d p [a b] [l=200u w=2u]";
    let found = balance(&compiled(text, &[]), &[("a.urz", 1.2), ("a.ux", 3e-6), ("a.uy", -7e-6)]);
    let end = node(&found, "b");
    close(end.x, L * (1.2_f64.cos() - 1.0) + 3e-6, 1e-9);
    close(end.y, L * 1.2_f64.sin() - 7e-6, 1e-9);
    close(end.rz, 1.2, 1e-12);
    let force = force(&found, "a");
    assert!(force.fx.hypot(force.fy) < 1e-9 * EI / (L * L) && force.m.abs() < 1e-9 * EI / L, "{force:?}");
}

/// A strain of the package is a displacement of each anchor by ε·x: stress, places and forces agree to 1e-6, with elastic anchors, too. A strained package has
/// springs at both anchors, each a million times as stiff as half of the beam.
#[test]
fn package_strain_is_the_motion_of_anchors() {
    for anchors in [Anchors::Rigid, Anchors::Elastic] {
        let options = CompileOptions { anchors, ..options(&[("turn", 0.4), ("eps", 3e-4)]) };
        let strained =
            BRIDGE.replace("strength=1e12", "strength=1e12 packagestrain=eps").replace(" moves=1 anchorrz=rz", "");
        let strained = balance(&compiled_with(&strained, &options), &[]);
        let (s, c) = 0.4_f64.sin_cos();
        let model = compiled_with(BRIDGE, &options);
        let driven = balance(&model, &[("b.ux", 3e-4 * L * c), ("b.uy", 3e-4 * L * s)]);
        close(driven.stresses_pa[0].1, strained.stresses_pa[0].1, 1e-6);
        close(node(&driven, "m").x, node(&strained, "m").x, 2e-6);
        let tension = force(&driven, "b");
        close(c * tension.fx + s * tension.fy, driven.stresses_pa[0].1 * W * W, 1e-6);
        let still = force(&balance(&compiled_with(BRIDGE, &CompileOptions { anchors, ..options.clone() }), &[]), "b");
        assert!(still.fx.abs() < 1e-12 * tension.fx);
    }
}

/// A path along the motion of an anchor finds the buckling of a pinned beam: at Euler's π²EI/L² and the shortening of beam and pins under it, to 1e-3. Beyond it
/// the beam bends, and the force of the anchor stays that of buckling.
#[test]
fn end_shortening_buckles_a_pinned_beam() {
    let pins = 1e6;
    let text = format!(
        "process p = [ Youngsmodulus=160e9 density=2330 h=2u ]
hinge p [a] []
left beam2d p [a m] [l=100u w=2u]
right beam2d p [m e] [l=100u w=2u]
spring2d * [e b] [kx={pins} ky={pins}]
anchor p [b] [moves=1]"
    );
    let model = compiled(&text, &[]);
    let critical = PI.powi(2) * EI / L.powi(2);
    let shortening = critical * (L / EA + 1.0 / pins);
    let request = ContinuationRequest {
        input: PathInput::Port("b.ux"),
        from: 0.0,
        to: -3.0 * shortening,
        voltages: vec![],
        signals: ["m.y", "b.fx"].map(str::to_owned).to_vec(),
        branch: Branch::Plus,
        points: 500,
    };
    let found = trace(&model, &request, &mut |_| true).unwrap_or_else(|e| panic!("{e}"));
    close(found.bifurcations[0].value, -shortening, 1e-3);
    let [height, force] = [0, 1].map(|k| *found.signals[k].2.last().unwrap());
    close(force, -critical, 2e-3);
    // half a sine wave of height h is shorter by π²h²/(4L)
    close(height, 2.0 / PI * (2.0 * shortening * L).sqrt(), 5e-3);
}

fn response(drive: &str, signals: &[&str], frequencies: [f64; 2], points: usize) -> Vec<Vec<[f64; 2]>> {
    let asked = HarmonicOptions {
        drive: drive.into(),
        signals: signals.iter().map(|s| (*s).to_owned()).collect(),
        from: frequencies[0],
        to: frequencies[1],
        points,
        spacing: Spacing::Linear,
        even: true,
        ..HarmonicOptions::default()
    };
    let found = harmonic(&compiled(OSCILLATOR, &[]), &asked, &mut |_| true).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(found.drive_unit, "m");
    found.signals.into_iter().map(|signal| signal.values).collect()
}

/// The transmissibility of a base-excited oscillator with a damper, (k + iωc)/(k − mω² + iωc), and the force of its base, −mω² times that (Den Hartog, "Mechanical
/// vibrations", §2.12): to 1e-5 from a tenth of the resonance to ten times it.
#[test]
fn transmissibility_of_an_oscillator() {
    let found = response("b.ux", &["m.x", "b.fx", "b.x"], [1e5 / TAU / 10.0, 1e6 / TAU], 31);
    for k in 0..31 {
        let omega = TAU * (1e5 / TAU / 10.0 + f64::from(k) * (1e6 - 1e4) / TAU / 30.0);
        let path = nalgebra::Complex::new(K, omega * C);
        let gain = path / (path - MASS * omega * omega);
        let push = -gain * MASS * omega * omega;
        for (got, want) in [(found[0][k as usize], gain), (found[1][k as usize], push)] {
            assert!((nalgebra::Complex::new(got[0], got[1]) - want).norm() < 1e-5 * want.norm(), "{got:?} {want}");
        }
        // the springs of the anchor yield by a millionth of what the spring of the mass does
        assert!((found[2][k as usize][0] - 1.0).abs() < 1.1e-6 * push.norm().max(1.0));
    }
    // by itself an anchor answers with its force
    assert_eq!(response("b.ux", &[], [1e3, 2e3], 2).len(), 1);
}

fn run(model: &CompiledModel, wave: InputWaveform, stop: f64, more: &TransientOptions<'_>) -> TransientResult {
    let asked = TransientOptions {
        stop,
        points: 4001,
        signals: ["m.x", "m.vx", "b.x", "b.vx", "b.fx"].map(str::to_owned).to_vec(),
        motions: vec![("b.ux".to_owned(), wave)],
        ..more.clone()
    };
    transient(model, &asked, &mut |_, _| {}, &mut |_| true).unwrap_or_else(|e| panic!("{e}"))
}

/// The motion of the oscillator behind a base with a waveform, by the classical Runge-Kutta method in 40 000 steps.
fn reference(wave: &InputWaveform, c: f64, times: &[f64]) -> Vec<f64> {
    let rate = |t: f64, [x, v]: [f64; 2]| {
        let [u, w] = wave.at(t);
        [v, -(K * (x - u) + c * (v - w)) / MASS]
    };
    let (mut t, mut y) = (0.0, [wave.at(0.0)[0], 0.0]);
    let mut found = vec![y[0]];
    for &end in &times[1..] {
        let h = (end - t) / 10.0;
        for _ in 0..10 {
            // slopes of a waveform jump at its corners: from within the step
            let inside = |s: f64| t + h * s.clamp(1e-9, 1.0 - 1e-9);
            let k1 = rate(inside(0.0), y);
            let k2 = rate(inside(0.5), [y[0] + h / 2.0 * k1[0], y[1] + h / 2.0 * k1[1]]);
            let k3 = rate(inside(0.5), [y[0] + h / 2.0 * k2[0], y[1] + h / 2.0 * k2[1]]);
            let k4 = rate(inside(1.0), [y[0] + h * k3[0], y[1] + h * k3[1]]);
            y = [0, 1].map(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
            t += h;
        }
        t = end;
        found.push(y[0]);
    }
    found
}

fn waves() -> [InputWaveform; 3] {
    [
        InputWaveform::Sine { offset: 0.0, amplitude: 1e-6, frequency: 2e4, delay: 0.0 },
        InputWaveform::Pulse { low: 0.0, high: 1e-6, delay: 2e-5, lengths: [1e-5, 5e-5, 2e-5], period: Some(1.2e-4) },
        InputWaveform::Lines(vec![[0.0, 0.5e-6], [4e-5, 0.5e-6], [1e-4, -1e-6], [1.5e-4, 0.0]]),
    ]
}

/// Behind a base that moves as a sine, as pulses and along lines the mass follows an independent integration within 3e-4 of the amplitude. Every integrator does within
/// 1e-3, at equal steps of a five-hundredth of a period. It does so without the damper, which would feel the jump of the base's rate at the start.
#[test]
fn runs_follow_waveforms() {
    let model = compiled(OSCILLATOR, &[]);
    let free = compiled(&OSCILLATOR.replace("damper2d * [b m] [bx=1e-6 l=20u]\n", ""), &[]);
    let worst = |model: &CompiledModel, c: f64, wave: &InputWaveform, options: &TransientOptions<'_>| {
        let found = run(model, wave.clone(), 4e-4, options);
        let wanted = reference(wave, c, &found.t);
        found.signals[0].2.iter().zip(&wanted).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max) / 1e-6
    };
    for wave in waves() {
        let off = worst(&model, C, &wave, &TransientOptions::default());
        assert!(off < 3e-4, "{wave:?}: {off:e}");
    }
    let methods = [
        Integrator::Rodas4,
        Integrator::Radau5,
        Integrator::AverageField,
        Integrator::Midpoint,
        Integrator::TrBdf2,
        Integrator::GeneralizedAlpha { rho: 0.8 },
        Integrator::Newmark,
        Integrator::Sdirk4,
    ];
    for method in methods {
        let fixed = TransientOptions { method, step: Some(1e-7), ..TransientOptions::default() };
        let off = worst(&free, 0.0, &waves()[0], &fixed);
        assert!(off < 1e-3, "{method:?}: {off:e}");
    }
}

/// The work of the anchor is what spring and mass store and the damper takes: ∫F·u̇ dt by Simpson's rule against ½m·v² + ½k·(x − u)² + ∫c·(v − u̇)² dt, to 1e-4 of
/// the largest energy.
#[test]
fn work_of_an_anchor_is_stored_and_lost() {
    let model = compiled(OSCILLATOR, &[]);
    let wave = waves()[0].clone();
    let sharp = TransientOptions { tol: 1e-6, ..TransientOptions::default() };
    let found = run(&model, wave.clone(), 4e-4, &sharp);
    let column = |k: usize| &found.signals[k].2;
    let rate: Vec<f64> = found.t.iter().map(|t| wave.at(*t)[1]).collect();
    let simpson = |f: &dyn Fn(usize) -> f64| {
        let h = found.t[1] - found.t[0];
        (0..4000).step_by(2).map(|k| h / 3.0 * (f(k) + 4.0 * f(k + 1) + f(k + 2))).sum::<f64>()
    };
    // the damper pushes from the first instant on, when the base already moves
    let push = |k: usize| K * (column(2)[k] - column(0)[k]) + C * (rate[k] - column(1)[k]);
    let most = column(4).iter().fold(0.0, |most: f64, f| most.max(f.abs()));
    for (k, rate) in rate.iter().enumerate().skip(1) {
        assert!((column(4)[k] - push(k)).abs() < 1e-4 * most, "{k}: {:e} {:e}", column(4)[k], push(k));
        assert!((column(3)[k] - rate).abs() < 1e-4 * TAU * 2e4 * 1e-6, "{k}");
    }
    let work = simpson(&|k| if k == 0 { push(0) * rate[0] } else { column(4)[k] * rate[k] });
    let lost = simpson(&|k| C * (column(1)[k] - rate[k]).powi(2));
    let [x, v, u] = [0, 1, 2].map(|k| column(k)[4000]);
    let stored = 0.5 * MASS * v * v + 0.5 * K * (x - u).powi(2);
    assert!((work - stored - lost).abs() < 1e-4 * (stored + lost), "{work:e} {stored:e} {lost:e}");
}

/// A run begins in the equilibrium of the anchors as they stand at t = 0 and stays there while they do: no waves. A held anchor is one that does not move.
#[test]
fn runs_begin_where_anchors_are() {
    let model = compiled(BRIDGE, &[]);
    let begun = balance(&model, &[("b.uy", 1e-6), ("b.urz", 1e-3)]);
    let held = vec![("b.uy".to_owned(), 1e-6), ("b.urz".to_owned(), 1e-3)];
    let waves = [1e-6, 1e-3].map(|x| InputWaveform::Lines(vec![[0.0, x]]));
    let motions: Vec<_> = ["b.uy", "b.urz"].map(str::to_owned).into_iter().zip(waves).collect();
    for (voltages, motions) in [(held, Vec::new()), (Vec::new(), motions)] {
        let asked = TransientOptions {
            stop: 1e-5,
            points: 11,
            signals: vec!["m.y".into(), "b.fy".into()],
            voltages,
            motions,
            ..TransientOptions::default()
        };
        let found = transient(&model, &asked, &mut |_, _| {}, &mut |_| true).unwrap();
        for (y, f) in found.signals[0].2.iter().zip(&found.signals[1].2) {
            close(*y, node(&begun, "m").y, 1e-6);
            close(*f, force(&begun, "b").fy, 1e-5);
        }
    }
}

/// The mesh of a run follows what a moving anchor excites, and meets the tolerance: the middle of a beam whose anchors shake it, against a mesh and steps that
/// are far finer.
#[test]
fn meshes_of_shaken_beams() {
    let text = BRIDGE.replace("density=2330", "density=2330 viscosity=1.78e-5 fluid=2u");
    let asked = TransientOptions {
        stop: 3e-5,
        points: 301,
        signals: vec!["m.y".into()],
        motions: vec![(
            "b.uy".to_owned(),
            InputWaveform::Sine { offset: 0.0, amplitude: 1e-7, frequency: 2e5, delay: 0.0 },
        )],
        ..TransientOptions::default()
    };
    let drawn = compiled_with(&text, &CompileOptions { segments: None, ..options(&[]) });
    let (fitted, _) = fitted_in_time(&drawn, &asked).unwrap_or_else(|e| panic!("{e}"));
    let found = transient(&fitted, &asked.with_tolerance(1e-3), &mut |_, _| {}, &mut |_| true).unwrap();
    let fine = compiled_with(&text, &CompileOptions { segments: Some(96), ..options(&[]) });
    let wanted = transient(&fine, &asked.with_tolerance(1e-5), &mut |_, _| {}, &mut |_| true).unwrap();
    let (got, want) = (&found.signals[0].2, &wanted.signals[0].2);
    let size = want.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    let off = got.iter().zip(want).map(|(x, y)| (x - y).powi(2)).sum::<f64>().sqrt() / 301f64.sqrt() / size;
    assert!(off < 1e-3, "{off:e}");
    assert!(fitted.unknowns() < fine.unknowns(), "{} {}", fitted.unknowns(), fine.unknowns());
}

/// No mesh resolves the waves that an anchor sends out when it moves within 1 ns. The mesh is that of a slow motion, and the estimate says what they add: half
/// of the motion or so, no less than the difference to 24 segments a beam.
#[test]
fn a_step_of_an_anchor_asks_for_no_useless_mesh() {
    let drawn = compiled_with(BRIDGE, &CompileOptions { segments: None, ..options(&[]) });
    let asked = TransientOptions {
        stop: 3e-6,
        points: 301,
        signals: vec!["m.y".into()],
        motions: vec![(
            "b.uy".to_owned(),
            InputWaveform::Pulse { low: 0.0, high: 1e-7, delay: 0.0, lengths: [1e-9, 1e-5, 1e-9], period: None },
        )],
        ..TransientOptions::default()
    };
    let (fitted, _) = fitted_in_time(&drawn, &asked).unwrap_or_else(|e| panic!("{e}"));
    let reported = fitted.order.estimated_error.unwrap();
    assert!(fitted.unknowns() < 200 && reported > 0.1, "{} {reported:e}", fitted.unknowns());
    let run = |model: &CompiledModel| {
        transient(model, &asked.with_tolerance(1e-4), &mut |_, _| {}, &mut |_| true).unwrap().signals[0].2.clone()
    };
    let fine = compiled_with(BRIDGE, &CompileOptions { segments: Some(24), ..options(&[]) });
    let (got, want) = (run(&fitted), run(&fine));
    let (low, high) = want.iter().fold((0.0f64, 0.0f64), |(low, high), x| (low.min(*x), high.max(*x)));
    let off = got.iter().zip(&want).map(|(x, y)| (x - y).powi(2)).sum::<f64>().sqrt() / 301f64.sqrt();
    assert!(off <= reported * 0.5 * (high - low), "{off:e} of {:e}, {reported:e}", 0.5 * (high - low));
}

struct Session(LocalDevice);

impl Session {
    fn trial(&mut self, mode: Mode, parent: Option<Token>, times: [f64; 2], given: &[f64]) -> TrialReply {
        let mut reply = TrialReply::default();
        let trial = Trial { mode, parent, t: times[1], dt: times[1] - times[0], voltages: given };
        self.0.trial(&trial, &mut reply).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(reply.status, Status::Ok);
        reply
    }
}

/// Opens ports of a model with signals.
fn session(text: &str, ports: &[&str], signals: &[&str]) -> (Session, Vec<PortKind>) {
    let mut device = LocalDevice::new(Arc::new(compiled(text, &[])));
    let [ports, signals] = [ports, signals].map(|names| names.iter().map(|name| (*name).to_owned()).collect());
    let opened = device.open(&OpenRequest { ports, signals, noise: None }).unwrap();
    (Session(device), opened.ports.iter().map(|port| port.kind).collect())
}

/// Partials of a trial against central differences, relative to the geometric mean of the two driving-point partials or to the partial itself.
fn check_partials(
    session: &mut Session,
    (mode, parent, times): (Mode, Option<Token>, [f64; 2]),
    at: &[f64],
    steps: &[f64],
) -> TrialReply {
    let (found, n) = (session.trial(mode, parent, times, at), at.len());
    for column in 0..n {
        let [below, above] = [-1.0, 1.0].map(|sign: f64| {
            let mut given = at.to_vec();
            given[column] += sign * steps[column];
            session.trial(mode, parent, times, &given)
        });
        for row in 0..n {
            let slope = (above.currents[row] - below.currents[row]) / (2.0 * steps[column]);
            let size = (found.di_dv[(n + 1) * row] * found.di_dv[(n + 1) * column]).abs().sqrt();
            let got = found.di_dv[n * row + column];
            assert!((got - slope).abs() < 1e-5 * size.max(slope.abs()), "{mode:?} {row} {column}: {got:e} {slope:e}");
        }
        for (signal, (a, b)) in below.outputs.iter().zip(&above.outputs).enumerate() {
            let (slope, got) = ((b - a) / (2.0 * steps[column]), found.doutputs_dv[n * signal + column]);
            assert!(
                (got - slope).abs() < 1e-5 * slope.abs().max(got.abs()) + 1e-9,
                "{signal} {column}: {got:e} {slope:e}"
            );
        }
    }
    assert_eq!(session.trial(mode, parent, times, at).currents, found.currents);
    found
}

/// A session's ports of an anchor are given displacements and a rotation and answer with forces and a moment. Partials of statics, symmetric, and of steps with
/// a damper agree with differences to 1e-5, and the same trial has the same bits.
#[test]
fn sessions_drive_anchors() {
    let (mut bridge, kinds) = session(BRIDGE, &["b.ux", "b.uy", "b.urz", "m.y"], &["m.x", "b.fy"]);
    assert_eq!(kinds, [PortKind::Displacement, PortKind::Displacement, PortKind::Rotation, PortKind::Force]);
    let still = (Mode::Static, None, [0.0; 2]);
    let found = check_partials(&mut bridge, still, &[1e-8, 3e-6, 0.02, 1e-6], &[1e-11, 1e-9, 1e-5, 1e-9]);
    assert_eq!(found.outputs[1], found.currents[1]);
    for (row, column) in [(0, 1), (0, 2), (1, 2)] {
        let [one, other] = [found.di_dv[4 * row + column], found.di_dv[4 * column + row]];
        let size = (found.di_dv[5 * row] * found.di_dv[5 * column]).abs().sqrt();
        assert!((one - other).abs() < 1e-6 * size, "{row} {column}: {one:e} {other:e}");
    }
    let (mut oscillator, _) = session(OSCILLATOR, &["b.ux", "m.x"], &["b.fx", "m.vx"]);
    let start = oscillator.trial(Mode::Static, None, [0.0; 2], &[1e-7, 0.0]);
    let step = (Mode::Transient, start.token, [0.0, 1e-6]);
    check_partials(&mut oscillator, step, &[1.2e-7, 1e-8], &[1e-9, 1e-9]);
}

/// Formulations in joint coordinates, anchors without `moves`, unknown motions, invalid waveforms and values beyond any structure are refused with what was expected.
#[test]
fn what_cannot_move_is_refused() {
    let joints = compiled_with(BRIDGE, &CompileOptions { formulation: Formulation::Rcr, ..options(&[]) });
    assert!(matches!(&joints.joints, Some(Err(why)) if why.to_string().contains("moves")), "{:?}", joints.joints);
    let fixed = compiled(&BRIDGE.replace(" moves=1", ""), &[]);
    let refused = |model: &CompiledModel, name: &str, value: f64| {
        let given = [(name.to_owned(), value)];
        bimorph::analysis::statics::static_equilibrium(model, &given).unwrap_err().to_string()
    };
    assert!(refused(&fixed, "b.uy", 1e-9).contains("moves=1"), "{}", refused(&fixed, "b.uy", 1e-9));
    let model = compiled(BRIDGE, &[]);
    assert!(refused(&model, "a.uy", 1e-9).contains("b.ux, b.uy, b.urz"));
    assert!(refused(&model, "b.uy", 2.0).contains("at most 1e0 m"), "{}", refused(&model, "b.uy", 2.0));
    assert!(refused(&model, "b.uy", f64::NAN).contains("at most"));
    for motions in [
        vec![("a.uy".to_owned(), InputWaveform::Lines(vec![[0.0, 0.0]]))],
        vec![("b.uy".to_owned(), InputWaveform::Lines(vec![]))],
        vec![("b.uy".to_owned(), InputWaveform::Lines(vec![[0.0, 3.0]]))],
    ] {
        let asked = TransientOptions { stop: 1e-6, motions, ..TransientOptions::default() };
        assert!(transient(&model, &asked, &mut |_, _| {}, &mut |_| true).is_err());
    }
}
