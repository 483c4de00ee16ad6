//! Combs, plates and facing beams.

use crate::{balance, close, model, node};
use bimorph::analysis::frame::{frame, frame_modes, frame_statics};
use bimorph::analysis::modes::modes;
use bimorph::analysis::pull_in::pull_in;
use bimorph::analysis::statics::static_equilibrium;
use bimorph::compile::CompileOptions;
use bimorph::domains::{Configuration, Domain, MaterialPoint};
use bimorph::multibody::planar::Pose;
use bimorph::multibody::{BodyId, BodyMatrix};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

/// k = 1 N/m, m = 1e-10 kg, A = 1e-8 m², g = 2 µm.
pub(crate) const PLATE: &str = "
    anchor * [f] [l=1u w=1u h=1u]
    mass2d * [m] [m=1e-10]
    guide2d * [m] []
    spring2d * [f m] [kx=1]
    anchor * [e] [l=1u w=1u h=1u]
    gap plategap2d * [m e] [A=1e-8 gap=2u]
    eground * [e] []
    drive port * [m e] []";

/// A relay of nanometres: k = 14.1295236 N/m, an effective gap of 60 nm and 30 nm of insulation over 5.7, contact 25 nm from the electrode. Pull-in is at √(8kg³/27εA) =
/// 4.387278 V to 1e-4. A rigid contact opens at t·√(2k(g − t)/εA) = 3.429563 V, to 1e-4.
#[test]
fn a_relay_of_nanometres() {
    let (k, gap, touch, pull_in_v) = (14.129_523_6f64, (60.0 + 30.0 / 5.7) * 1e-9f64, 25e-9f64, 4.387_278f64);
    let strength = 8.0 * k * gap.powi(3) / (27.0 * pull_in_v.powi(2));
    let text = format!(
        "anchor * [f] [l=1u w=1u h=1u]
         mass2d * [m] [m=1e-15]
         guide2d * [m] []
         spring2d * [f m] [kx={k}]
         anchor * [e] [l=1u w=1u h=1u]
         plategap2d * [m e] [A={} gap={gap} touch={touch}]
         eground * [e] []
         drive port * [m e] []",
        strength / 8.854e-12
    );
    let found = pull_in(&model(&text, &CompileOptions::default()), None, 20.0).unwrap();
    close(found.pull_in_v, pull_in_v, 1e-4);
    let rigid = touch * (2.0 * k * (gap - touch) / strength).sqrt();
    close(rigid, 3.429_563, 1e-6);
    close(found.release_v.unwrap(), rigid, 1e-4);
}

/// Static pull-in of a lumped plate at √(8kg³/27εA) (Nathanson 1967), located to 1e-6; before it, the equilibrium solves
/// kx = εAV²/2(g−x)².
#[test]
fn plate_pull_in() {
    let compiled = model(PLATE, &CompileOptions::default());
    let exact = (8.0 * 8e-18 / (27.0 * 8.854e-12 * 1e-8f64)).sqrt();
    let found = pull_in(&compiled, None, 20.0).unwrap();
    close(found.pull_in_v, exact, 1e-6);
    let release = found.release_v.unwrap();
    assert!(release < 0.5 * exact, "{release}");
    for volts in [1.0, 4.0, 5.17] {
        let x = node(&balance(&compiled, &[("drive", volts)]), "m").x;
        close(x, 8.854e-12 * 1e-8 * volts * volts / (2.0 * (2e-6 - x).powi(2)), 1e-9);
    }
}

/// Beyond pull-in the static analysis says so and shows the closed gap, not a number on the lost branch.
#[test]
fn beyond_pull_in_the_gap_is_closed() {
    let result = balance(&model(PLATE, &CompileOptions::default()), &[("drive", 5.5)]);
    assert!(result.pulled_in);
    let distance = 2e-6 - node(&result, "m").x;
    assert!((0.05e-6..0.1e-6).contains(&distance), "{distance:e}");
}

/// The bias softens the spring: ω² = (k − εAV²/(g−x)³)/m at 4 V.
#[test]
fn bias_softens_the_resonance() {
    let compiled = model(PLATE, &CompileOptions::default());
    let volts = [("drive".to_owned(), 4.0)];
    let x = node(&balance(&compiled, &[("drive", 4.0)]), "m").x;
    let softened = 1.0 - 8.854e-12 * 1e-8 * 16.0 / (2e-6 - x).powi(3);
    let f = modes(&compiled, 1, &volts).unwrap().frequencies_hz[0];
    close(f, (softened / 1e-10).sqrt() / std::f64::consts::TAU, 1e-9);
}

/// A comb pulls with ½V²·Nεh/g whatever its position while it is engaged.
#[test]
fn comb_force() {
    let text = "
        anchor * [f] [l=1u w=1u h=1u]
        mass2d * [m] [m=1e-10]
        guide2d * [m] []
        spring2d * [f m] [kx=2]
        anchor * [e] [l=1u w=1u h=1u]
        comb2de p1 [m e] [N=50 gap=2u l=10u L=30u h=2u]
        eground * [e] []
        drive port * [m e] []";
    let compiled = model(text, &CompileOptions::default());
    for volts in [10.0, 40.0] {
        let force = 0.5 * volts * volts * 50.0 * 8.854e-12 * 2e-6 / 2e-6;
        let result = balance(&compiled, &[("drive", volts)]);
        let x = node(&result, "m").x;
        close(x, force / 2.0, 1e-9);
        close(result.charges_c[0].1, 50.0 * 8.854e-12 * (10e-6 + x) * volts, 1e-9);
    }
}

/// Facing cantilevers with the voltage on (SUGAR's gap2d between a moving and a fixed beam) pull in, and the parallel start
/// agrees with the work-equivalent load: tip = p·l⁴/8EI for a uniform pressure in the limit of small voltage.
#[test]
fn facing_beams() {
    let text = "
        param V=0.1
        anchor p1 [a] [l=5u w=5u]
        gap2d p1 [a b c d] [l=100u w1=2u w2=2u gap=2u V=V fringe=sugar]
        anchor p1 [c] [l=5u w=5u]
        anchor p1 [d] [l=5u w=5u]";
    let compiled = model(text, &CompileOptions::default());
    let fringe = 1.0 + 1.12 * 2.0 / 2.0;
    let line = fringe * 8.854e-12 * 2e-6 * 0.01 / (2.0 * 4e-12);
    let ei = 165e9 * 2e-6 * 8e-18 / 12.0;
    let tip = node(&balance(&compiled, &[]), "b").y;
    close(tip, -line * 1e-16 / (8.0 * ei), 1e-3);
    let found = pull_in(&compiled, None, 200.0).unwrap();
    // the tip opens below the voltage at which it snapped, however close to the fold the fall began
    let release = found.release_v.unwrap();
    assert!(0.0 < release && release < 0.8 * found.pull_in_v, "{found:?}");
}

/// Two arms of two beams each that face each other across a gap under a voltage.
fn facing_arms(volts: f64) -> String {
    format!(
        "process s = [ Poisson=0.3 Youngsmodulus=165e9 density=2300 viscosity=1.78e-5 fluid=2e-6 permittivity=8.854e-12
           sheetresistance=20 stress=0 straingradient=0 thermalexpansion=2.6e-6 ambienttemperature=0 h=550u ]
         anchor s [A] [l=5u w=10u oz=pi]
         beam2de s [A b] [l=10u w=4u h=40u R=100]
         beam2de s [b c] [l=50u w=4u h=40u R=100]
         beam2de s [D E] [l=50u w=4u h=40u R=100]
         beam2de s [E F] [l=10u w=4u h=40u R=100]
         gap2dforce s [b c D E] [l=50u w1=4u w2=4u gap=4.834u]
         anchor s [F] [l=5u w=10u]
         Vsrc * [A G] [V={volts}]
         eground * [G] []
         eground * [F] []"
    )
}

/// As SUGAR 2 computes, two tilted cantilevers that attract one another stand where it puts them. Source: SUGAR 2 under Octave on
/// its gap-closing actuator (electrodes 550 µm high), at 40 and 100 V: y and rotation of a free end, eleven digits of which hold.
#[test]
fn facing_beams_as_sugar() {
    let as_sugar = CompileOptions { as_sugar: true, ..CompileOptions::default() };
    for (volts, y, rz) in
        [(40.0, -7.7283509311554e-9, -1.71963306618205e-4), (100.0, -4.91847747700838e-8, -1.09440895995529e-3)]
    {
        let c = node(&balance(&model(&facing_arms(volts), &as_sugar), &[]), "c");
        close(c.y, y, 1e-11);
        close(c.rz, rz, 1e-11);
    }
}

/// Their modes under voltage, one cubic element for each beam: the eigenvalues of the matrices that SUGAR 2.0 makes, symmetric part
/// (`cho_mode` itself takes them as they are, and differs from that by up to 2.1e-6), to 5e-9.
#[test]
fn modes_of_facing_beams_as_sugar() {
    let as_sugar = CompileOptions { as_sugar: true, ..CompileOptions::default() };
    for (volts, wanted) in [(40.0, [1522092.33007423, 1523834.83686117]), (100.0, [1508020.75559287, 1519279.55184219])]
    {
        let compiled = model(&facing_arms(volts), &as_sugar);
        let found = frame_modes(&compiled, &frame(&compiled).unwrap(), 2, &[]).unwrap().0;
        for (found, wanted) in found.frequencies_hz.iter().zip(wanted) {
            close(*found, wanted, 5e-9);
        }
    }
}

/// The frame knows the charge of a port as the product's own model does, which has the same plates here: a rigid plate on a spring.
#[test]
fn charge_of_a_frame() {
    let compiled = model(PLATE, &CompileOptions { as_sugar: true, ..CompileOptions::default() });
    let port = [("drive".to_owned(), 2.0)];
    let charge = frame_statics(&compiled, &frame(&compiled).unwrap(), &port).unwrap().0.charges_c[0].clone();
    let wanted = static_equilibrium(&compiled, &port).unwrap().charges_c[0].clone();
    assert_eq!(charge.0, wanted.0);
    assert!(wanted.1 > 8.854e-12 * 1e-8 / 2e-6 * 2.0, "more than at rest");
    close(charge.1, wanted.1, 1e-9);
}

/// SUGAR's modes under voltage differ from ours because of its derivative. A cantilever whose plate stands 1.5 µm from
/// its electrode at 10 V has its lowest mode at 22801.18 Hz with forces and stiffness of one potential. With forces
/// differenced over a nanometre to one side, as in SUGAR's `MF_gap2d`, it is at 22793.556 Hz (demo beamgap2e, symmetric
/// part of its matrices).
#[test]
fn differences_of_a_nanometre() {
    let text = "process s = [ Poisson=0.3 Youngsmodulus=165e9 density=2300 viscosity=1.78e-5 fluid=2e-6 permittivity=8.854e-12 h=2u ]
        anchor s [A] []
        beam2d s [A b] [l=100u w=2u]
        gap2d s [b c D E] [l=100u w1=10u w2=5u gap=2u V=10]
        anchor s [D] []
        anchor s [E] []";
    let compiled = model(text, &CompileOptions { as_sugar: true, ..CompileOptions::default() });
    let frame = frame(&compiled).unwrap();
    let exact = frame_modes(&compiled, &frame, 1, &[]).unwrap().0.frequencies_hz[0];
    close(exact, 22801.18, 1e-6);
    let fine = CompileOptions { as_sugar: true, segments: Some(16), ..CompileOptions::default() };
    close(modes(&model(text, &fine), 1, &[]).unwrap().frequencies_hz[0], exact, 1e-4);

    let (system, rest) = (&frame.system, frame_statics(&compiled, &frame, &[]).unwrap().0);
    let mut q = vec![Pose::zeros(); 2];
    assert_eq!(system.bodies(), q.len());
    for (drawn, point) in compiled.structure.nodes.iter().zip(&frame.nodes) {
        if let Some(MaterialPoint { body: BodyId::Free(k), .. }) = point {
            let moved = node(&rest, &drawn.name);
            q[*k] = Pose::new(moved.x, moved.y, moved.rz);
        }
    }
    let column = |k: usize, step: f64| {
        let mut unit = vec![Pose::zeros(); 2];
        unit[k / 3][k % 3] = step;
        unit
    };
    let flat = |poses: &[Pose]| DVector::from_iterator(6, poses.iter().flat_map(|p| p.iter().copied()));
    let force = |q: &[Pose]| {
        let mut force = vec![Pose::zeros(); 2];
        for gap in &frame.gaps {
            gap.add_force(Configuration { q, linear: true }, 10.0, &mut force);
        }
        flat(&force)
    };
    let dense = |matrix: &BodyMatrix| {
        let columns: Vec<_> = (0..6)
            .map(|k| {
                let mut out = vec![Pose::zeros(); 2];
                matrix.multiply_add(&system.pattern, &column(k, 1.0), &mut out);
                flat(&out)
            })
            .collect();
        DMatrix::from_columns(&columns)
    };
    let step = 1e-9;
    let differenced: Vec<_> = (0..6)
        .map(|k| {
            let back: Vec<Pose> = q.iter().zip(column(k, step)).map(|(q, step)| q - step).collect();
            (force(&q) - force(&back)) / step
        })
        .collect();
    let stiffness = dense(&system.stiffness) + DMatrix::from_columns(&differenced);
    let lower = dense(&system.mass).cholesky().unwrap().l();
    let half = lower.solve_lower_triangular(&(0.5 * (&stiffness + stiffness.transpose()))).unwrap();
    let whole = lower.solve_lower_triangular(&half.transpose()).unwrap();
    close(whole.symmetric_eigenvalues().min().sqrt() / TAU, 22793.5560464522, 1e-9);
}

/// The frame does not detect unstable equilibria. At 20 V, with a load of 4 µN that holds the gap open, Newton's method
/// from the drawing converges to the one between the stable branch (−3.391 µm) and the electrode.
#[test]
fn a_frame_reports_no_unstable_equilibrium() {
    let text = format!("{PLATE}\nf2d * [m] [F=-4u]");
    let compiled = model(&text, &CompileOptions { as_sugar: true, ..CompileOptions::default() });
    let frame = frame(&compiled).unwrap();
    let port = [("drive".to_owned(), 20.0)];
    let error = frame_statics(&compiled, &frame, &port).unwrap_err().to_string();
    assert!(error.contains("unstable") && error.contains("recursion"), "{error}");
    assert!(frame_modes(&compiled, &frame, 1, &port).is_err());
}
