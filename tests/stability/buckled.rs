//! Arms one percent below and above their Euler load: the signs of the pivots distinguish stable from unstable.

use super::frame::cantilever;
use bimorph::domains::System;
use bimorph::multibody::planar::Pose;
use bimorph::multibody::{BodyId, BodyMatrix};
use bimorph::solve::continuation::{Branch, Continuation, ContinuationOptions};
use bimorph::solve::equilibrium::{Equilibrium, EquilibriumOptions};
use bimorph::solve::family::LoadFamily;
use bimorph::solve::path::SourcePath;

/// Euler's load of a clamped–free column, π²EI/(4L²), E = 165 GPa, 2 µm square, L = 200 µm (N).
pub(crate) fn euler() -> f64 {
    std::f64::consts::PI.powi(2) * 165e9 * (2e-6f64.powi(4) / 12.0) / (4.0 * 200e-6f64.powi(2))
}

/// The column of 16 segments under `share` of Euler's load; its tip.
fn column(share: f64) -> (System, usize) {
    let (frame, tip) = cantilever(16, 1.0);
    let (system, place) = frame.system(&[(tip, [-share * euler(), 0.0])]);
    let BodyId::Free(k) = tip else { unreachable!() };
    (system, place[k])
}

/// Result of Newton's iteration alone at a fraction of Euler's load, from the straight column.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Found {
    /// Largest displacement sideways (m).
    pub(crate) sideways: f64,
    /// Largest force left (N).
    pub(crate) residual: f64,
    /// Negative pivots.
    pub(crate) negative: usize,
}

/// Newton's iteration, and the signs of the pivots where it ends.
pub(crate) fn newton(share: f64) -> Found {
    let (system, _) = column(share);
    let mut q = vec![Pose::zeros(); system.bodies()];
    let (mut tangent, mut r) = (BodyMatrix::new(&system.model.pattern), q.clone());
    let drive = system.electrics.drive();
    let mut negative = 0;
    for _ in 0..20 {
        system.tangent(&q, &drive, &mut tangent, &mut r);
        negative = tangent.factor(&system.model.pattern).unwrap().negative;
        tangent.solve(&system.model.pattern, &mut r);
        q.iter_mut().zip(&r).for_each(|(q, d)| *q -= d);
    }
    system.residual(&q, &drive, &mut r);
    let largest = |f: &dyn Fn(&Pose) -> f64, x: &[Pose]| x.iter().map(f).fold(0.0, f64::max);
    Found { sideways: largest(&|p| p.y.abs(), &q), residual: largest(&|p| p.x.hypot(p.y), &r), negative }
}

/// How far aside the equilibrium lies that the search with signs comes to at a share of Euler's load (m); none where it finds none.
pub(crate) fn followed(share: f64) -> Option<f64> {
    let (system, _) = column(share);
    let mut q = vec![Pose::zeros(); system.bodies()];
    let path = SourcePath::new(&system.electrics, &[], &[], [0.0, 1.0]);
    let found = Equilibrium::new(&system, EquilibriumOptions::default()).follow(&system, &path, &mut q);
    found.ok().map(|_| q.iter().map(|p| p.y.abs()).fold(0.0, f64::max))
}

/// The path up to 1.1 of Euler's load, along `branch` where it forks: share, sideways displacement of the tip (m), negative
/// pivots.
pub(crate) fn path(branch: Branch) -> Vec<(f64, f64, usize)> {
    let ((from, tip), (to, _)) = (column(0.0), column(1.1));
    let mut family = LoadFamily::new(&from, &[], &to, &[]).unwrap();
    let options = ContinuationOptions { branch, longest: 0.02, ..ContinuationOptions::default() };
    let q = vec![Pose::zeros(); from.bodies()];
    let traced = Continuation::new(&from, options).trace(&mut family, &q, &mut |_| true).unwrap();
    traced.points.iter().map(|p| (1.1 * p.s, p.q[tip].y, p.negative)).collect()
}

/// One percent below Euler's load and one above it Newton's iteration ends on the straight column with forces balanced
/// to rounding; only a negative pivot identifies the second, unstable one. The search with signs never calls it an
/// equilibrium: it falls to the bent one.
#[test]
fn signs() {
    let (below, above) = (newton(0.99), newton(1.01));
    for found in [below, above] {
        assert!(found.sideways == 0.0 && found.residual < 1e-14 * euler(), "{found:?}");
    }
    assert_eq!((below.negative, above.negative), (0, 1));
    assert!(followed(0.99).is_some_and(|aside| aside < 1e-12));
    // it falls to the bent column, 0.178 of the length aside
    assert!(followed(1.01).is_none_or(|aside| (aside / 200e-6 / 0.178 - 1.0).abs() < 0.01), "{:?}", followed(1.01));
}

/// The fork lies at Euler's load within 0.01 %. Past it the straight path has one negative pivot, and both bent branches have
/// none; one percent above, the tip stands 0.178 of the length aside (elastica, P/P_E = (2K(k)/π)², w/L = 2k/K).
#[test]
fn fork() {
    let straight = path(Branch::Stay);
    let fork = straight.windows(2).find(|w| w[0].2 == 0 && w[1].2 == 1).map(|w| w[0].0).unwrap();
    assert!((fork - 1.0).abs() < 1e-4, "{fork}");
    for (branch, sign) in [(Branch::Plus, 1.0), (Branch::Minus, -1.0)] {
        let bent = path(branch);
        assert!(bent.iter().all(|p| p.2 == 0));
        let after = bent.windows(2).find(|w| w[1].0 >= 1.01).unwrap();
        let x = (1.01 - after[0].0) / (after[1].0 - after[0].0);
        let aside = sign * (after[0].1 + x * (after[1].1 - after[0].1)) / 200e-6;
        assert!((aside / 0.178 - 1.0).abs() < 0.02, "{aside}");
    }
}
