//! Forces, accelerations and heat mean what they say.

use crate::{FORMULATIONS, ask, compiled, opened};
use bimorph::analysis::statics::static_equilibrium;
use bimorph::compile::Formulation;
use bimorph::device::Mode;

/// A lumped mass m on a spring k with a damper c.
const OSCILLATOR: &str = "
anchor * [f] [l=1u w=1u h=1u]
mass2d * [m] [m=1e-10]
guide2d * [m] []
spring2d * [f m] [kx=2]
damper2d * [f m] [bx=1e-7]
";

/// Static: x = F/k and x = −m·a/k to rounding. In time: after a step of the acceleration the closed form of the damped
/// oscillator to the tolerance of 1e-3 and better, with internal steps of its own.
#[test]
fn forces_and_accelerations_move_a_mass() {
    let (m, k, c): (f64, f64, f64) = (1e-10, 2.0, 1e-7);
    for formulation in [Formulation::Compliant] {
        let mut device = opened(&compiled(OSCILLATOR, formulation), &["m.x", "frame.ax"], &["m.vx"]);
        let still = ask(&mut device, Mode::Static, None, 0.0, &[3e-6, 500.0]);
        let exact = (3e-6 - m * 500.0) / k;
        assert!((still.currents[0] / exact - 1.0).abs() < 1e-12, "{:e}", still.currents[0]);
        assert!((still.di_dv[0] * k - 1.0).abs() < 1e-12 && (still.di_dv[1] / (-m / k) - 1.0).abs() < 1e-12);
        assert_eq!(still.currents[1], 0.0, "a frame's port draws nothing");
        // from rest at a = 1e4 m/s², held
        let (omega, zeta) = ((k / m).sqrt(), c / (2.0 * (k * m).sqrt()));
        let mut at = ask(&mut device, Mode::Static, None, 0.0, &[0.0, 0.0]);
        let (a, sag) = (1e4, -m * 1e4 / k);
        at = ask(&mut device, Mode::Transient, at.token, 1e-12, &[0.0, a]);
        let mut t: f64 = 0.0;
        for _ in 0..200 {
            at = ask(&mut device, Mode::Transient, at.token, 2e-7, &[0.0, a]);
            t += 2e-7;
            let turn = omega * (1.0 - zeta * zeta).sqrt();
            let swing = (turn * t).cos() + zeta / (1.0 - zeta * zeta).sqrt() * (turn * t).sin();
            let exact = sag * (1.0 - (-zeta * omega * t).exp() * swing);
            assert!((at.currents[0] - exact).abs() < 1e-4 * sag.abs(), "{t:e}: {:e} {exact:e}", at.currents[0]);
        }
    }
}

/// An arch that a port pushes through snaps to where the same dead load takes it. Before, its equilibrium was lost: the
/// force of a port was no part of the potential in which a fall descends.
#[test]
fn an_arch_snaps_under_a_port_as_under_a_load() {
    let text = |load: &str| {
        format!(
            "process p = [Youngsmodulus=165e9 density=2300 h=20u]\nanchor p [a] []\nb1 beam2d p [a m] [l=200u w=2u oz=0.05]\n\
             b2 beam2d p [m b] [l=200u w=2u oz=-0.05]\nanchor p [b] []\n{load}"
        )
    };
    for force in [0.5e-3, 2e-3] {
        let drawn = compiled(&text(&format!("f2d * [m] [F={force:e} oz=-pi/2]\n")), Formulation::Compliant);
        let found = static_equilibrium(&drawn, &Vec::new()).unwrap();
        let load = found.nodes.iter().find(|(name, _)| name == "m").unwrap().1.y;
        let mut device = opened(&compiled(&text(""), Formulation::Compliant), &["m.y"], &[]);
        let port = ask(&mut device, Mode::Static, None, 0.0, &[-force]).currents[0];
        println!("{force:e} N: {load:e} {port:e} m");
        assert!(found.jumped && load < -15e-6 && (port / load - 1.0).abs() < 1e-9, "{force:e}: {load:e} {port:e}");
    }
}

/// A watt given to a beam acts as a watt of its own current: V²/R through the port's heat and V at its ends leave the same
/// rise, that of V²/(12ρk) (Carslaw & Jaeger §4.9), steady and with its lag.
#[test]
fn heat_given_is_heat_of_a_current() {
    const HEATER: &str = "
    process p = [ Youngsmodulus=165e9 density=2300 h=2u thermalexpansion=2.7e-6 thermcond=34 ambienttemperature=300 ]
    anchor p [a] []
    hot beam2det p [a b] [l=200u w=2u R=1k tau=30u]
    anchor p [b] []
    mass2d * [m] [m=1e-12]
    spring2d * [a m] [kx=1 ky=1 krz=1e-12]
    eground * [b] []
    heat port * [a] []
    ";
    for formulation in FORMULATIONS {
        if formulation == Formulation::Rcr {
            continue;
        }
        let model = compiled(HEATER, formulation);
        let mut device = opened(&model, &["heat", "hot.T"], &["hot.T"]);
        let watts = 1.5f64 * 1.5 / 1e3;
        let by_current = ask(&mut device, Mode::Static, None, 0.0, &[1.5, 0.0]);
        let by_heat = ask(&mut device, Mode::Static, None, 0.0, &[0.0, watts]);
        let exact = watts * 200e-6 / (12.0 * 34.0 * 4e-12);
        for reply in [&by_current, &by_heat] {
            assert!((reply.currents[1] / exact - 1.0).abs() < 1e-12, "{}", reply.currents[1]);
            assert!((reply.outputs[0] - 300.0 - exact).abs() < 1e-9);
        }
        let cold = ask(&mut device, Mode::Static, None, 0.0, &[0.0, 0.0]);
        let on = ask(&mut device, Mode::Transient, cold.token, 1e-15, &[0.0, watts]);
        let later = ask(&mut device, Mode::Transient, on.token, 30e-6, &[0.0, watts]);
        let lag = exact * (1.0 - (-1.0f64).exp());
        assert!((later.currents[1] / lag - 1.0).abs() < 1e-9, "{}", later.currents[1]);
    }
}
