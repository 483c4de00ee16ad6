//! Steps that are too long for the fast motions of a stiff bank: which methods blow up.

use super::frame::{bank, quiet};
use bimorph::domains::System;
use bimorph::multibody::BodyId;
use bimorph::multibody::planar::Pose;
use bimorph::solve::adaptive::{Adaptive, Control};
use bimorph::solve::avf::AverageField;
use bimorph::solve::equilibrium::{Equilibrium, EquilibriumOptions};
use bimorph::solve::generalized_alpha::GeneralizedAlpha;
use bimorph::solve::method::{Method, Motion};
use bimorph::solve::path::SourcePath;
use bimorph::solve::rk45::Rk45;
use bimorph::solve::rodas4::Rodas4;

/// Three bimorphs, bent by `force` [N] on the first yoke, or free.
fn three(force: f64) -> (System, usize) {
    let (frame, node) = bank(3, 4);
    let (system, place) = frame.system(&[(node, [0.0, force])]);
    let BodyId::Free(k) = node else { unreachable!() };
    (system, place[k])
}

/// Energy over time after release, relative to the first, in equal steps of `h` [s] for `count` steps; stops beyond a
/// thousandfold.
pub(crate) fn energies<M: Method>(method: impl Fn(&System) -> M, force: f64, h: f64, count: usize) -> Vec<[f64; 2]> {
    let (loaded, _) = three(force);
    let mut q = vec![Pose::zeros(); loaded.bodies()];
    let path = SourcePath::new(&loaded.electrics, &[], &[], [0.0, 1.0]);
    Equilibrium::new(&loaded, EquilibriumOptions::default()).follow(&loaded, &path, &mut q).unwrap();
    let (system, _) = three(0.0);
    let drive = system.electrics.drive();
    let mut motion = Motion { v: vec![Pose::zeros(); q.len()], q };
    let first = system.energy(&motion.q, &motion.v, &drive);
    let mut track = vec![[0.0, 1.0]];
    let mut adaptive = Adaptive::new(&system, method(&system));
    let end = h * count as f64;
    let _ = adaptive.advance(
        &system,
        &quiet(&system, end),
        &mut motion,
        &mut h.clone(),
        Control::Fixed(h),
        usize::MAX,
        &mut |s, h, _, m| {
            let energy = system.energy(&m.q, &m.v, &drive) / first;
            track.push([s + h, energy]);
            energy < 1e3
        },
    );
    track
}

/// Largest of the energies.
pub(crate) fn most(track: &[[f64; 2]]) -> f64 {
    track.iter().fold(0.0, |m, e| m.max(e[1]))
}

pub(crate) fn rodas4(force: f64, h: f64, count: usize) -> Vec<[f64; 2]> {
    energies(|s| Rodas4::new(s, &[]), force, h, count)
}

pub(crate) fn avf(force: f64, h: f64, count: usize) -> Vec<[f64; 2]> {
    energies(AverageField::new, force, h, count)
}

pub(crate) fn newmark(force: f64, h: f64, count: usize) -> Vec<[f64; 2]> {
    energies(|s| GeneralizedAlpha::new(s, 1.0), force, h, count)
}

pub(crate) fn explicit(force: f64, h: f64, count: usize) -> Vec<[f64; 2]> {
    energies(|s| Rk45::new(s).unwrap(), force, h, count)
}

/// A bank bent by 50 µN and let go, steps of 0.1 µs, 200 µs: the undamped rule of Newmark (ρ = 1) gains more than a third of
/// its energy and then finds no step; the average vector field keeps it to 1e-5; Rodas4 loses some and stays bounded.
#[test]
fn implicit_methods() {
    let (force, h, count) = (50e-6, 0.1e-6, 2000);
    let blown = newmark(force, h, count);
    assert!(blown.len() < count && most(&blown) > 1.3, "{} {}", blown.len(), most(&blown));
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
