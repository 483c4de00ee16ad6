//! Conductors that float keep their charge: plates in series, against one gap of both distances.

use crate::{balance, close, model, node};
use bimorph::analysis::harmonic::{HarmonicOptions, harmonic};
use bimorph::analysis::integrator::Integrator;
use bimorph::analysis::modes::modes;
use bimorph::analysis::pull_in::pull_in;
use bimorph::analysis::transient::{TransientOptions, transient};
use bimorph::compile::{CompileOptions, Formulation};
use bimorph::device::local::LocalDevice;
use bimorph::device::{Device, Mode, OpenRequest, Trial, TrialReply};
use bimorph::multibody::BodyMatrix;
use bimorph::multibody::planar::Pose;
use std::f64::consts::TAU;
use std::sync::Arc;

const EPSILON: f64 = 8.854e-12;
const AREA: f64 = 1e-8;

/// A plate on a spring of 1 N/m at 4 µm from a conductor, which a second gap of 2 µm and twice the area divides from ground.
const SERIES: &str = "
    anchor * [f] []
    spring2d * [f a] [kx=1 l=8u]
    mass2d * [a] [m=1e-10]
    guide2d * [a] []
    g1 plategap2d * [a b] [A=1e-8 gap=4u]
    anchor * [b] []
    g2 plategap2d * [b c] [A=2e-8 gap=2u]
    anchor * [c] []
    eground * [c] []
    drive port * [a c] []";

/// Equal charges of both gaps make them one gap of 4 µm + 2 µm/2.
const BOTH: f64 = 5e-6;

fn undamped() -> CompileOptions {
    CompileOptions { undamped: true, ..CompileOptions::default() }
}

/// Pull-in of plates in series at √(8kg³/27εA), g the gap that stands for both (Nathanson 1967).
#[test]
fn pull_in_of_plates_in_series() {
    let exact = (8.0 * BOTH.powi(3) / (27.0 * EPSILON * AREA)).sqrt();
    let found = pull_in(&model(SERIES, &CompileOptions::default()), None, 60.0).unwrap();
    close(found.pull_in_v, exact, 1e-6);
}

/// The equilibrium solves kx = εAV²/2(g−x)². Each gap has the charge εAV/(g−x), and the port has it, too.
#[test]
fn equilibrium_of_plates_in_series() {
    let compiled = model(SERIES, &CompileOptions::default());
    for volts in [2.0, 12.0, 20.3] {
        let found = balance(&compiled, &[("drive", volts)]);
        let x = node(&found, "a").x;
        close(x, EPSILON * AREA * volts * volts / (2.0 * (BOTH - x).powi(2)), 1e-9);
        close(found.charges_c[0].1, EPSILON * AREA * volts / (BOTH - x), 1e-9);
    }
}

/// Fixed charge is stiffer than fixed voltage: the resonance has ω² = (k − εAV²/(g−x)³)/m. The port has the capacitance
/// εA/(g−x) + (εAV/(g−x)²)²/(k − εAV²/(g−x)³) below it, in `ac` and as a partial of a device.
#[test]
fn resonance_and_capacitance_of_plates_in_series() {
    let compiled = model(SERIES, &CompileOptions::default());
    let volts = 15.0;
    let port = vec![("drive".to_owned(), volts)];
    let x = node(&balance(&compiled, &[("drive", volts)]), "a").x;
    let stiffness = 1.0 - EPSILON * AREA * volts * volts / (BOTH - x).powi(3);
    assert!(stiffness < 0.8, "{stiffness}");
    close(modes(&compiled, 1, &port).unwrap().frequencies_hz[0], (stiffness / 1e-10).sqrt() / TAU, 1e-9);
    let by_volt = EPSILON * AREA * volts / (BOTH - x).powi(2);
    let capacitance = EPSILON * AREA / (BOTH - x) + by_volt * by_volt / stiffness;
    let options = HarmonicOptions {
        drive: "drive".into(),
        signals: vec!["drive.i".into(), "g1.q".into(), "a.x".into()],
        from: 1e-3,
        to: 1e-2,
        points: 2,
        even: true,
        voltages: port,
        ..HarmonicOptions::default()
    };
    let found = harmonic(&compiled, &options, &mut |_| true).unwrap();
    let value = |signal: usize| found.signals[signal].values[0];
    close(value(0)[1], TAU * found.frequencies_hz[0] * capacitance, 1e-8);
    close(value(1)[0], capacitance, 1e-8);
    close(value(2)[0], by_volt / stiffness, 1e-8);
    let mut device = LocalDevice::new(Arc::new(compiled));
    device
        .open(&OpenRequest {
            ports: Vec::new(),
            signals: vec!["g1.q".into(), "g2.q".into(), "g2.F".into()],
            noise: None,
        })
        .unwrap();
    let mut reply = TrialReply::default();
    let trial = Trial { mode: Mode::Static, parent: None, t: 0.0, dt: 0.0, voltages: &[volts] };
    device.trial(&trial, &mut reply).unwrap();
    close(reply.dq_dv[0], capacitance, 1e-8);
    close(reply.doutputs_dv[0], capacitance, 1e-8);
    close(reply.doutputs_dv[1], capacitance, 1e-8);
    let charge = EPSILON * AREA * volts / (BOTH - x);
    close(reply.outputs[2], charge * charge / (2.0 * EPSILON * 2.0 * AREA), 1e-8);
    close(reply.doutputs_dv[2], charge * capacitance / (EPSILON * 2.0 * AREA), 1e-8);
}

/// Two plates share a floating conductor: their common motion softens by 2·εAV²/g³, and their difference not at all. At fixed potentials each would
/// soften by itself.
#[test]
fn a_conductor_couples_two_plates() {
    let text = "
        anchor * [f] []
        spring2d * [f a] [kx=1 l=8u]
        mass2d * [a] [m=1e-10]
        guide2d * [a] []
        g1 plategap2d * [a b] [A=1e-8 gap=2u]
        anchor * [b] []
        g2 plategap2d * [b c] [A=1e-8 gap=2u]
        mass2d * [c] [m=1e-10]
        guide2d * [c] []
        spring2d * [c e] [kx=1 l=8u]
        anchor * [e] []
        eground * [c] []
        drive port * [a c] []";
    let compiled = model(text, &CompileOptions::default());
    let volts = 7.0;
    let found = balance(&compiled, &[("drive", volts)]);
    let gap = 4e-6 - node(&found, "a").x + node(&found, "c").x;
    close(node(&found, "a").x, EPSILON * AREA * volts * volts / (2.0 * gap * gap), 1e-9);
    let softening = 2.0 * EPSILON * AREA * volts * volts / gap.powi(3);
    assert!(softening > 0.1, "{softening}");
    let found = modes(&compiled, 2, &[("drive".to_owned(), volts)]).unwrap().frequencies_hz;
    for (found, stiffness) in found.iter().zip([1.0 - softening, 1.0]) {
        close(*found, (stiffness / 1e-10).sqrt() / TAU, 1e-8);
    }
}

/// A step of 10 V without damping goes to x = (g − √(g² − 4εAV²/gk))/2, where the energy is that at rest, with each formulation and with the method that keeps the
/// energy. The charge there is εAV/(g−x).
#[test]
fn a_step_of_plates_in_series() {
    let volts = 10.0f64;
    let largest = 0.5 * (BOTH - (BOTH * BOTH - 4.0 * EPSILON * AREA * volts * volts / BOTH).sqrt());
    for (formulation, method) in [
        (Formulation::Compliant, Integrator::Rodas4),
        (Formulation::Compliant, Integrator::AverageField),
        (Formulation::Rcr, Integrator::Rodas4),
        (Formulation::Reduced, Integrator::Rodas4),
    ] {
        let compiled = model(SERIES, &CompileOptions { formulation, ..undamped() });
        let options = TransientOptions {
            stop: 50e-6,
            points: 2001,
            tol: 1e-7,
            signals: vec!["a.x".into(), "drive.q".into()],
            voltages: vec![("drive".to_owned(), volts)],
            method,
            ..TransientOptions::default()
        };
        let found = transient(&compiled, &options, &mut |_, _| {}, &mut |_| true)
            .unwrap_or_else(|e| panic!("{formulation:?}, {method:?}: {e}"));
        let most = |signal: usize| found.signals[signal].2.iter().copied().fold(0.0, f64::max);
        println!("{formulation:?}, {method:?}: {:e}", most(0) / largest - 1.0);
        close(most(0), largest, 1e-5);
        close(most(1), EPSILON * AREA * volts / (BOTH - largest), 1e-5);
    }
}

/// Residual, tangent, charge and their changes with voltages are derivatives of one potential where a comb, two plates and a gap along beams share two
/// floating conductors: to 1e-6 of differences of fourth order at random states.
#[test]
fn one_potential_with_floating_conductors() {
    let text = "
        process p = [ Youngsmodulus=165e9 Poisson=0.3 density=2300 h=20u ]
        anchor p [f] [l=1u w=1u]
        beam2d p [f m] [l=60u w=2u]
        mass2d * [m] [m=1e-10 J=1e-20]
        c comb2de p [m e] [N=40 gap=2u l=10u L=30u w=2u]
        mass2d * [e] [m=1e-10 J=1e-20]
        spring2d * [e h] [kx=1 ky=1 krz=1e-9]
        anchor p [h] [l=1u w=1u]
        g plategap2d p [e n] [l=100u w=100u gap=2u h=2u oz=0.3]
        mass2d * [n] [m=1e-10 J=1e-20]
        spring2d * [n o] [kx=1 ky=1 krz=1e-9]
        anchor p [o] [l=1u w=1u]
        k plategap2d p [n s] [l=50u w=100u gap=3u h=2u]
        anchor p [s] []
        link2d * [n r] [l=5u]
        R * [n r] [R=1k]
        v plategap2d p [r o] [l=50u w=50u gap=4u h=2u voffset=3]
        eground * [o] []
        one port * [m o] []
        two port * [s o] []";
    let compiled = model(text, &CompileOptions { segments: Some(3), ..CompileOptions::default() });
    let system = &compiled.parts.system;
    let (n, pattern) = (system.bodies(), &system.model.pattern);
    assert_eq!(system.electrics.floating.groups().len(), 1);
    assert_eq!(system.electrics.floating.groups()[0].conductors, 2);
    let mut seed = 7u64;
    let mut random = |[size, turn]: [f64; 2]| -> Vec<Pose> {
        let mut next = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 40) as f64 / f64::from(1 << 23) - 1.0
        };
        (0..n).map(|_| Pose::new(size * next(), size * next(), turn * next())).collect()
    };
    let dot = |a: &[Pose], b: &[Pose]| a.iter().zip(b).map(|(a, b)| a.dot(b)).sum::<f64>();
    let (mut drive, mut change) = (system.electrics.drive(), system.electrics.drive());
    let mut u = vec![0.0; system.electrics.sources()];
    system.electrics.fill_sources(&[9.0, -4.0], &mut u);
    let rise = system.electrics.heating.rest();
    system.electrics.apply(&u, &rise, &mut drive);
    u.fill(0.0);
    u[0] = 1.0;
    system.electrics.apply(&u, &rise, &mut change);
    change.load = 0.0;
    for k in 0..20 {
        let size = [0.3e-6, 3e-3];
        let (q, way, other) = (random(size), random(size.map(|x| 1e-3 * x)), random(size));
        let moved = |h: f64| -> Vec<Pose> { q.iter().zip(&way).map(|(q, w)| q + w * h).collect() };
        let four = |of: &dyn Fn(f64) -> f64| (8.0 * (of(1.0) - of(-1.0)) - of(2.0) + of(-2.0)) / 12.0;
        let body_force = |q: &[Pose], drive: &bimorph::domains::Drive| {
            let mut r = vec![Pose::zeros(); n];
            system.add_body_forces(q, drive, &mut r);
            r
        };
        let field = |q: &[Pose]| -> f64 {
            let volts = system.gap_voltages(q, &drive.volts);
            (0..volts.len()).map(|g| -0.5 * system.capacitance(g, q) * volts[g] * volts[g]).sum()
        };
        let force = body_force(&q, &drive);
        let near = |what: &str, found: f64, wanted: f64, scale: f64| {
            assert!((found - wanted).abs() <= 1e-6 * scale, "{k}, {what}: {found:e} {wanted:e}");
        };
        near(
            "energy",
            four(&|h| field(&moved(h))),
            dot(&force, &way),
            dot(&force, &way).abs() + 1e-9 * field(&q).abs(),
        );
        let mut tangent = BodyMatrix::new(pattern);
        system.add_body_tangent(&q, &drive, &mut tangent);
        let mut by_way = vec![Pose::zeros(); n];
        tangent.multiply_add(pattern, &way, &mut by_way);
        let found = four(&|h| dot(&body_force(&moved(h), &drive), &other));
        near("tangent", found, dot(&by_way, &other), found.abs() + 1e-3 * dot(&force, &other).abs());
        let mut by_volt = vec![Pose::zeros(); n];
        system.add_body_drive_force(&q, &drive, &change, &mut by_volt);
        let at = |h: f64| {
            let mut drive = drive.clone();
            drive.volts.iter_mut().zip(&change.volts).for_each(|(v, by)| *v += h * by);
            dot(&body_force(&q, &drive), &other)
        };
        near("voltage", four(&at), dot(&by_volt, &other), dot(&by_volt, &other).abs());
        let charges = |q: &[Pose]| -> f64 {
            (0..drive.volts.len()).map(|g| change.volts[g] * system.charge(g, q, &drive.volts)).sum()
        };
        let found = four(&|h| charges(&moved(h)));
        let wanted: f64 = (0..drive.volts.len())
            .map(|g| change.volts[g] * system.charge_slope(g, (&q, &drive.volts), (&way, None)))
            .sum();
        near("charge", found, wanted, wanted.abs() + 1e-6 * charges(&q).abs());
        near("reciprocity", wanted, -dot(&by_volt, &way), wanted.abs());
    }
}

/// A node of a capacitor stays at 0 V, since the model leaves the capacitor out.
#[test]
fn a_node_of_the_circuit_stays_at_ground() {
    let text = SERIES.replace("eground", "sense C * [b c] [C=1p]\neground");
    let found = pull_in(&model(&text, &CompileOptions::default()), None, 60.0).unwrap();
    close(found.pull_in_v, (8.0 * 64e-18 / (27.0 * EPSILON * AREA)).sqrt(), 1e-6);
}

/// A conductor whose gaps both lead to the plate has no field of its own, and is at ground as one that is grounded: the same voltages of gaps.
#[test]
fn a_forgotten_ground_is_ground() {
    let text = SERIES.replace("g2 plategap2d * [b c]", "g2 plategap2d * [a b]").replace("anchor * [c] []", "");
    let [open, grounded] = [text.clone(), format!("{text}\neground * [b] []")].map(|text| {
        let compiled = model(&text, &CompileOptions::default());
        let electrics = &compiled.parts.system.electrics;
        assert!(electrics.floating.is_empty());
        electrics.gap_rows.clone()
    });
    assert_eq!(open, grounded);
}
