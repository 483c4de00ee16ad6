//! Energy audit: the work of the sources is what is stored and what is dissipated, over a closing and an opening, for each domain with an energy.

use bimorph::compile::{CompileOptions, compile};
use bimorph::domains::{Ramp, System};
use bimorph::equations::bodies::Bodies;
use bimorph::multibody::forces;
use bimorph::multibody::planar::Pose;
use bimorph::netlist::Bundle;
use bimorph::solve::adaptive::{Adaptive, Control};
use bimorph::solve::time::rodas4::{Motion, Rodas4};

/// Points and weights of Gauss' rule of order 6 on [0, 1].
const GAUSS: [(f64, f64); 3] =
    [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

/// Energies of a run (J); `worst` is the largest difference at the end of a pulse.
#[derive(Debug, Default)]
struct Audit {
    work: f64,
    dissipated: f64,
    worst: f64,
    touched: usize,
}

/// Energy that rates of bodies take in a step, by Gauss' rule on its cubic.
fn dissipated(system: &System, h: f64, before: &Motion<Pose>, after: &Motion<Pose>) -> f64 {
    let at = |s: f64| {
        let place = |k: usize| {
            let (q0, q1, v0, v1) = (before.q[k], after.q[k], before.v[k] * h, after.v[k] * h);
            let chord = q1 - q0;
            let bend = v0 + v1 - chord * 2.0;
            let rest = chord * 3.0 - v0 * 2.0 - v1;
            (q0 + v0 * s + rest * (s * s) + bend * (s * s * s), (v0 + rest * (2.0 * s) + bend * (3.0 * s * s)) / h)
        };
        let (q, v): (Vec<Pose>, Vec<Pose>) = (0..before.q.len()).map(place).unzip();
        let mut force = vec![Pose::zeros(); q.len()];
        forces::add_damping(&system.model, &v, &mut force);
        system.add_loss(&q, |k| v[k], &mut force);
        force.iter().zip(&v).map(|(force, v)| force.dot(v)).sum::<f64>()
    };
    GAUSS.iter().map(|(s, weight)| weight * h * at(*s)).sum()
}

/// Runs through pulses (V, s) of the port `drive` from rest.
fn audit(text: &str, pulses: &[(f64, f64)]) -> Audit {
    let compiled =
        compile(&Bundle::from_text("audit.net", text), &CompileOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    let system = &compiled.parts.system;
    let mut motion = Motion::<Pose>::zeros(system.bodies());
    let mut found = Audit::default();
    for &(volts, time) in pulses {
        let given = [volts];
        let ramp = Ramp::new(&system.electrics, &given, &given, &[], time);
        let mut drive = system.electrics.drive();
        ramp.at(0.0, &mut drive);
        // Π has −½CV²: the field stores ½CV², and its charge C·V comes from the source
        let charged = |q: &[Pose]| -> f64 {
            (0..system.members.len()).map(|g| system.capacitance(g, q) * drive.volts[g] * drive.volts[g]).sum()
        };
        let stored = |motion: &Motion<Pose>| system.energy(&motion.q, &motion.v, &drive) + charged(&motion.q);
        let (before, supplied) = (stored(&motion), charged(&motion.q));
        let (mut own, mut h) = (0.0, 1e-9);
        let mut observe = |_: f64, h: f64, before: &Motion<Pose>, after: &Motion<Pose>| {
            own += dissipated(system, h, before, after);
            found.touched += usize::from((0..system.members.len()).any(|g| system.touches(g, &after.q)));
            true
        };
        let mut rodas = Adaptive::new(system.bodies(), Rodas4::new(system, &[]));
        let mut bodies = Bodies::new(system, &ramp);
        rodas.advance(&mut bodies, &mut motion, &mut h, Control::Tolerance(1e-8), 2_000_000, &mut observe).unwrap();
        let work = charged(&motion.q) - supplied;
        found.worst = found.worst.max((work - (stored(&motion) - before) - own).abs());
        found.work += work.abs();
        found.dissipated += own;
        println!("{volts} V: {:?}", rodas.work());
    }
    found
}

/// Asserts that the balance closes within 1e-6 of the work and that something is dissipated.
fn balances(name: &str, text: &str, pulses: &[(f64, f64)], touches: bool) {
    let found = audit(text, pulses);
    println!("{name}: {found:?}, {:e}", found.worst / found.work);
    assert!(found.worst < 1e-6 * found.work, "{name}: {found:?}");
    assert!(found.dissipated > 1e-3 * found.work, "{name}: {found:?}");
    assert_eq!(found.touched > 10, touches, "{name}: {found:?}");
}

/// A plate on a spring in front of its electrode, with gas that compresses or does not, closes against its contact at 9 V and opens.
#[test]
fn plates_with_film_and_contact() {
    for gas in ["filmstates=0", "filmstates=4"] {
        let text = format!(
            "anchor * [f] []
            mass2d * [m] [m=1e-10]
            guide2d * [m] []
            spring2d * [f m] [kx=1]
            anchor * [e] []
            plategap2d * [m e] [A=1e-8 l=100u w=100u gap=2u fringe=none touch=0.1u viscosity=1.83e-5 pressure=2e4 {gas}]
            eground * [e] []
            drive port * [m e] []"
        );
        balances(gas, &text, &[(9.0, 600e-6), (0.0, 600e-6)], true);
    }
}

/// The same plate meets a stop that loses energy, beside a dashpot.
#[test]
fn plates_with_a_stop_and_a_dashpot() {
    let text = "
        anchor * [f] []
        mass2d * [m] [m=1e-10]
        guide2d * [m] []
        spring2d * [f m] [kx=1]
        dashpot2d * [m] [bx=1e-6]
        anchor * [e] []
        plategap2d * [m e] [A=1e-8 l=100u w=100u gap=2u fringe=none]
        stop2d * [m e] [gap=1u restitution=0.4]
        eground * [e] []
        drive port * [m e] []";
    balances("stop", text, &[(6.0, 300e-6), (0.0, 300e-6)], true);
}

/// A comb that gas slides in, over a substrate that gas slides under, pulled in and released.
#[test]
fn combs_in_gas() {
    let text = "
        process p = [ density=2300 h=20u viscosity=1.83e-5 fluid=2u pressure=101325 ]
        anchor p [f] [l=1u w=1u]
        plate2d p [m] [l=100u w=100u]
        guide2d p [m] []
        spring2d * [f m] [kx=1]
        comb2de p [m e] [N=40 gap=2u l=10u L=30u]
        anchor p [e] [l=1u w=1u]
        eground * [e] []
        drive port * [m e] []";
    balances("comb", text, &[(20.0, 300e-6), (0.0, 300e-6)], false);
}

/// Misaligned fingers of a comb snap to the side, bounce on each other with loss, and are released.
#[test]
fn a_comb_at_its_sides() {
    let text = "
        anchor * [f] []
        mass2d * [m] [m=1e-10 J=1e-19]
        spring2d * [f m] [kx=5 ky=20 krz=1e-6]
        anchor * [e] []
        comb2de * [m e] [N=40 gap=2u h=20u l=10u L=30u w=2u misalign=0.1u restitution=0.4]
        eground * [e] []
        drive port * [m e] []";
    balances("sides", text, &[(60.0, 100e-6), (0.0, 100e-6)], true);
}

/// A cantilever that faces an electrode in gas closes on its contact, zips along it, and opens.
#[test]
fn facing_beams_with_film_and_contact() {
    let text = "
        process s = [ Youngsmodulus=160e9 Poisson=0 density=2330 h=20u viscosity=1.83e-5 pressure=101325 ]
        anchor s [a] []
        beam2d s [a b] [l=100u w=2u]
        gap2dforce s [a b c d] [l=100u w1=2u w2=2u gap=2u h=20u touch=0.2u restitution=0.4]
        anchor s [c] []
        anchor s [d] []
        eground * [a] []
        drive port * [c a] []";
    balances("facing beams", text, &[(60.0, 30e-6), (0.0, 30e-6)], true);
}

/// A plate on a spring that stiffens is pulled against a stop that holds it by adhesion, and slides along it with friction under a dead load.
#[test]
fn a_stop_with_adhesion_and_friction() {
    let text = "
        anchor * [f] []
        mass2d * [m] [m=1e-10 J=1e-20]
        spring2d * [f m] [kx=1 ky=0.5 krz=1e-7 kx3=1e11 ky2=1e4]
        dashpot2d * [m] [bx=1e-6 by=1e-6 brz=1e-16]
        f2d * [m] [F=0.2u oz=pi/2]
        anchor * [e] []
        plategap2d * [m e] [A=1e-8 l=100u w=100u gap=2u fringe=none]
        stop2d * [m] [gap=0.8u restitution=0.4 adhesion=0.3u adhesionrange=50n friction=0.3 slipspeed=20m]
        eground * [e] []
        drive port * [m e] []";
    balances("adhesion and friction", text, &[(7.0, 200e-6), (0.0, 200e-6)], true);
}
