//! Steps that are too long for the fast motions of a stiff bank: which methods blow up.

use super::frame::{bank, quiet};
use bimorph::analysis::integrator::Integrator;
use bimorph::domains::System;
use bimorph::multibody::BodyId;
use bimorph::multibody::planar::Pose;
use bimorph::solve::adaptive::Control;
use bimorph::solve::baseline::Solver;
use bimorph::solve::equilibrium::{Equilibrium, EquilibriumOptions};
use bimorph::solve::linear::Recursion;
use bimorph::solve::method::Motion;
use bimorph::solve::path::SourcePath;

/// Three bimorphs, bent by `force` (N) on the first yoke, or free.
fn three(force: f64) -> (System, usize) {
    let (frame, node) = bank(3, 4);
    let (system, place) = frame.system(&[(node, [0.0, force])]);
    let BodyId::Free(k) = node else { unreachable!() };
    (system, place[k])
}

/// Energy over time after release, relative to the first, in equal steps of `h` (s) for `count` steps; stops beyond a
/// thousandfold.
pub(crate) fn energies(method: Integrator, force: f64, h: f64, count: usize) -> Vec<[f64; 2]> {
    let (loaded, _) = three(force);
    let mut q = vec![Pose::zeros(); loaded.bodies()];
    let path = SourcePath::new(&loaded.electrics, &[], &[], [0.0, 1.0]);
    Equilibrium::new(&loaded, EquilibriumOptions::default()).follow(&loaded, &path, &mut q).unwrap();
    let (system, _) = three(0.0);
    let drive = system.electrics.drive();
    let mut motion = Motion { v: vec![Pose::zeros(); q.len()], q };
    let first = system.energy(&motion.q, &motion.v, &drive);
    let mut track = vec![[0.0, 1.0]];
    let ramp = quiet(&system, h * count as f64);
    let solver = Solver::Recursion(Recursion);
    let _ = method.advance(&system, solver, &ramp, &mut motion, h, Control::Fixed(h), &mut |s, h, _, m| {
        let energy = system.energy(&m.q, &m.v, &drive) / first;
        track.push([s + h, energy]);
        energy < 1e3
    });
    track
}

/// Largest of the energies.
pub(crate) fn most(track: &[[f64; 2]]) -> f64 {
    track.iter().fold(0.0, |m, e| m.max(e[1]))
}

pub(crate) fn rodas4(force: f64, h: f64, count: usize) -> Vec<[f64; 2]> {
    energies(Integrator::Rodas4, force, h, count)
}

pub(crate) fn avf(force: f64, h: f64, count: usize) -> Vec<[f64; 2]> {
    energies(Integrator::AverageField, force, h, count)
}

pub(crate) fn newmark(force: f64, h: f64, count: usize) -> Vec<[f64; 2]> {
    energies(Integrator::Newmark, force, h, count)
}

pub(crate) fn midpoint(force: f64, h: f64, count: usize) -> Vec<[f64; 2]> {
    energies(Integrator::Midpoint, force, h, count)
}

pub(crate) fn explicit(force: f64, h: f64, count: usize) -> Vec<[f64; 2]> {
    energies(Integrator::Rk45, force, h, count)
}

/// A bank bent by 50 µN and released, steps of 0.1 µs, 200 µs. The midpoint rule gains a fifth of its energy and then
/// finds no step, and so does Newmark's in steps of 0.3 µs, with more than twice the energy. The average vector field
/// keeps it to 1e-5; Rodas4 loses some and stays bounded.
#[test]
fn implicit_methods() {
    let (force, h, count) = (50e-6, 0.1e-6, 2000);
    for (blown, least) in [(midpoint(force, h, count), 1.2), (newmark(force, 3.0 * h, count / 3), 2.0)] {
        assert!(blown.len() < count && most(&blown) > least, "{} {}", blown.len(), most(&blown));
    }
    let kept = avf(force, h, count);
    assert!(kept.len() == count + 1 && kept.iter().all(|e| (e[1] - 1.0).abs() < 1e-5));
    let lost = rodas4(force, h, count);
    assert!(lost.len() == count + 1 && most(&lost) == 1.0 && lost[count][1] > 0.5);
}

/// Explicit steps of 2 ns hold, of 4 ns blow up a thousandfold within 100 steps.
#[test]
fn explicit_steps() {
    let (holds, blows) = (explicit(50e-6, 2e-9, 2000), explicit(50e-6, 4e-9, 2000));
    assert!(holds.len() == 2001 && most(&holds) < 1.0 + 1e-6);
    assert!(blows.len() < 100 && most(&blows) > 1e3);
}
