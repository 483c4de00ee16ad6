//! Order and sensitivities of Rodas4, without and with contact.

use bimorph::compile::{CompileOptions, compile};
use bimorph::domains::Ramp;
use bimorph::equations::bodies::Bodies;
use bimorph::multibody::planar::Pose;
use bimorph::netlist::Bundle;
use bimorph::solve::time::method::Method;
use bimorph::solve::time::rodas4::{Motion, Rodas4};

/// A lumped plate that a ramp of 2 V to 4 V pulls at (k = 1 N/m, m = 1e-10 kg, A = 1e-8 m², g = 2 µm).
const PLATE: &str = "
    anchor * [f] [l=1u w=1u h=1u]
    mass2d * [m] [m=1e-10]
    guide2d * [m] []
    spring2d * [f m] [kx=1]
    damper2d * [f m] [bx=2e-6]
    anchor * [e] [l=1u w=1u h=1u]
    plategap2d * [m e] [A=1e-8 gap=2u]
    eground * [e] []
    drive port * [m e] []";

fn run(steps: usize, end: f64) -> (f64, f64) {
    let compiled = compile(&Bundle::from_text("plate", PLATE), &CompileOptions::default()).unwrap();
    let system = &compiled.parts.system;
    let mut rodas = Rodas4::new(system, &[0]);
    let (mut motion, mut error) = (Motion::zeros(1), Motion::zeros(1));
    let (from, to) = ([2.0], [end]);
    let ramp = Ramp::new(&system.electrics, &from, &to, &[], 4e-5);
    let h = ramp.dt / steps as f64;
    for k in 0..steps {
        let s = k as f64 * h;
        rodas.step(&mut Bodies::new(system, &ramp), s, h, &mut motion, &mut error).unwrap();
    }
    assert_eq!((rodas.work().factorizations, rodas.work().solves), (steps as u64, 12 * steps as u64));
    (motion.q[0].x, rodas.sensitivity[0].q[0].x)
}

/// Halving the step divides the error by about 2⁴ on a nonlinear, driven oscillator.
#[test]
fn order_four() {
    let fine = run(3200, 4.0).0;
    let errors: Vec<f64> = [50, 100, 200].map(|n| (run(n, 4.0).0 - fine).abs()).to_vec();
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((3.7..4.6).contains(&order), "{order} of {errors:?}");
    }
}

/// The sensitivity of a single step is the derivative of its result (central difference of 1 mV, 1e-7 relative).
/// Over many steps it neglects the dependence of later Jacobians on the voltage, an effect of the size of the
/// step's own error.
#[test]
fn sensitivities() {
    for (steps, tolerance) in [(1, 1e-7), (200, 1e-4)] {
        let difference = (run(steps, 4.001).0 - run(steps, 3.999).0) / 2e-3;
        let carried = run(steps, 4.0).1;
        assert!((carried / difference - 1.0).abs() < tolerance, "{steps}: {carried:e} {difference:e}");
    }
}

/// From 5 nm within contact at 0.1 m/s: the displacement after `dt` (s) in so many steps, and its derivative with the final voltage.
fn within_contact(steps: usize, dt: f64, end: f64) -> (f64, f64) {
    let compiled = compile(&Bundle::from_text("plate", PLATE), &CompileOptions::default()).unwrap();
    let system = &compiled.parts.system;
    assert!(system.loses());
    let mut rodas = Rodas4::new(system, &[0]);
    let (mut motion, mut error) = (Motion::<Pose>::zeros(1), Motion::zeros(1));
    (motion.q[0].x, motion.v[0].x) = (1.905e-6, 0.1);
    let (from, to) = ([2.0], [end]);
    let ramp = Ramp::new(&system.electrics, &from, &to, &[], dt);
    let h = ramp.dt / steps as f64;
    for k in 0..steps {
        rodas.step(&mut Bodies::new(system, &ramp), k as f64 * h, h, &mut motion, &mut error).unwrap();
    }
    (motion.q[0].x, rodas.sensitivity[0].q[0].x)
}

/// Order four and exact sensitivities of a step hold where contact loses energy, too: halved steps divide the error by about 2⁴, and the
/// derivative of a step is that of central differences of 0.1 V (1e-5). The force has a time constant of 0.03 ns there.
#[test]
fn contact_with_loss() {
    let fine = within_contact(1600, 0.4e-9, 4.0).0;
    let errors: Vec<f64> = [16, 32, 64].map(|n| (within_contact(n, 0.4e-9, 4.0).0 - fine).abs()).to_vec();
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!((3.5..5.0).contains(&order), "{order} of {errors:?}");
    }
    let at = |end: f64| within_contact(1, 2e-9, end);
    let difference = (at(40.1).0 - at(39.9).0) / 0.2;
    assert!((at(40.0).1 / difference - 1.0).abs() < 1e-5, "{:e} {difference:e}", at(40.0).1);
}
