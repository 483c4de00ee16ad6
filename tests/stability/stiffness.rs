//! Stiffness ratios 1e3 … 1e8: beams whose joints are ever stiffer along them.

use super::frame::{cantilever, quiet};
use bimorph::analysis::integrator::Integrator;
use bimorph::domains::System;
use bimorph::multibody::planar::Pose;
use bimorph::solve::adaptive::Control;
use bimorph::solve::baseline::Solver;
use bimorph::solve::equilibrium::{Equilibrium, EquilibriumOptions};
use bimorph::solve::linear::Recursion;
use bimorph::solve::method::{Motion, SolverCounters};
use bimorph::solve::path::SourcePath;

/// Segments of the cantilever.
const SEGMENTS: usize = 6;

/// A cantilever whose joints are `ratio` times as stiff along it, times h², as in bending.
fn stiff(ratio: f64, load: f64) -> (System, usize) {
    let h = 200e-6 / SEGMENTS as f64;
    // EA/h·h² against EI/h
    let natural = 12.0 * h * h / (2e-6 * 2e-6);
    let (frame, tip) = cantilever(SEGMENTS, ratio / natural);
    let (system, place) = frame.system(&[(tip, [0.0, load])]);
    let bimorph::multibody::BodyId::Free(k) = tip else { unreachable!() };
    (system, place[k])
}

/// Bent by 0.2 µN at its tip.
fn bent(system: &System) -> Vec<Pose> {
    let mut q = vec![Pose::zeros(); system.bodies()];
    let path = SourcePath::new(&system.electrics, &[], &[], [0.0, 1.0]);
    Equilibrium::new(system, EquilibriumOptions::default()).follow(system, &path, &mut q).unwrap();
    q
}

/// A released beam: displacement of its tip over time (s, m), and how many forces were evaluated and matrices factored.
#[derive(Debug, Clone, Default)]
pub(crate) struct Released {
    pub(crate) track: Vec<[f64; 2]>,
    pub(crate) work: SolverCounters,
}

/// The tip after release until `end` (s); ends early when it is beyond ten times the first displacement.
fn released(ratio: f64, method: Integrator, control: Control, end: f64) -> Released {
    let (loaded, tip) = stiff(ratio, 0.2e-6);
    let q = bent(&loaded);
    let (system, _) = stiff(ratio, 0.0);
    let first = q[tip].y;
    let mut out = Released { track: vec![[0.0, first]], work: SolverCounters::default() };
    let mut motion = Motion { v: vec![Pose::zeros(); q.len()], q };
    let ramp = quiet(&system, end);
    let solver = Solver::Recursion(Recursion);
    let (_, work) = method.advance(&system, solver, &ramp, &mut motion, 1e-9, control, &mut |s, h, _, m| {
        out.track.push([s + h, m.q[tip].y]);
        (m.q[tip].y / first).abs() < 10.0
    });
    out.work = work;
    out
}

/// About twice the period of the first mode (s).
const END: f64 = 120e-6;

/// Rodas4 with a tolerance.
pub(crate) fn implicit(ratio: f64, tol: f64) -> Released {
    released(ratio, Integrator::Rodas4, Control::Tolerance(tol), END)
}

/// Dormand and Prince's pair with a tolerance, over 2 µs.
pub(crate) fn explicit(ratio: f64, tol: f64) -> Released {
    released(ratio, Integrator::Rk45, Control::Tolerance(tol), 2e-6)
}

/// True when 400 explicit steps of `h` (s) stay bounded.
pub(crate) fn explicit_holds(ratio: f64, h: f64) -> bool {
    let track = released(ratio, Integrator::Rk45, Control::Fixed(h), 400.0 * h).track;
    track.len() > 400 && track.iter().all(|y| (y[1] / track[0][1]).abs() < 2.0)
}

/// Longest explicit step that stays bounded, to 5 % (s).
pub(crate) fn longest_explicit(ratio: f64) -> f64 {
    let (mut low, mut high) = (1e-13, 1e-6);
    while high / low > 1.05 {
        let middle = f64::sqrt(low * high);
        if explicit_holds(ratio, middle) { low = middle } else { high = middle }
    }
    low
}

/// Over five decades of stiffness along the beam Rodas4 at 1e-5 takes three times the steps and puts the tip within 1 %;
/// the longest explicit step shrinks with the square root of the ratio.
#[test]
fn ratios() {
    let soft = implicit(1e3, 1e-5);
    let tip = soft.track[soft.track.len() - 1][1];
    for ratio in [1e5, 1e8] {
        let stiff = implicit(ratio, 1e-5);
        let end = stiff.track[stiff.track.len() - 1];
        assert!(end[0] == END && (end[1] / tip - 1.0).abs() < 0.01, "{ratio:e}: {end:?}");
        assert!(stiff.work.steps < 3 * soft.work.steps, "{ratio:e}: {}", stiff.work.steps);
        let shrunk = longest_explicit(1e3) / longest_explicit(ratio);
        let root = (ratio / 1e3).sqrt();
        assert!((shrunk / root - 1.0).abs() < 0.1, "{ratio:e}: {shrunk}");
        assert!(!explicit_holds(ratio, 2.0 * longest_explicit(ratio)));
    }
}

/// At a tolerance of 1e-5 the explicit pair takes 3.5 times the steps for each decade of stiffness.
#[test]
fn explicit_steps() {
    let steps = [1e3, 1e4, 1e5].map(|r| explicit(r, 1e-5).work.steps as f64);
    assert!(steps[1] > 3.0 * steps[0] && steps[2] > 3.0 * steps[1], "{steps:?}");
}
