//! Arms that come straight: the loop's pivot goes to zero.

use crate::mechanism::Mechanism;
use bimorph::multibody::BodyId;
use bimorph::multibody::joint_coordinates::constrained_loops::{Linkage, Reduction, ReductionTask, Singularity};

/// A shuttle on arms of two links; `kinks` are the angles between the links, `turn` the direction of the first arm.
fn star(kinks: &[f64], turn: f64) -> Mechanism {
    let mut m = Mechanism::default();
    let hub = m.body([0.0, 0.0], 1.0, 0.3);
    for (k, &kink) in kinks.iter().enumerate() {
        let a = turn + 0.7 * k as f64;
        let at = [0.2 * a.cos(), 0.2 * a.sin()];
        let knee = [at[0] + 0.5 * a.cos(), at[1] + 0.5 * a.sin()];
        let b = a + kink;
        let foot = [knee[0] + 0.5 * b.cos(), knee[1] + 0.5 * b.sin()];
        let (upper, lower) = (m.rod(at, knee), m.rod(knee, foot));
        m.pin(hub, upper, at);
        m.pin(upper, lower, knee);
        m.pin(lower, BodyId::Ground, foot);
    }
    m
}

/// The shuttle's acceleration by the local pivots alone and by the path for singular configurations, and what that met.
fn shuttle(kinks: &[f64]) -> ([f64; 3], [f64; 3], Singularity) {
    let (model, place) = star(kinks, 0.6435).model();
    let linkage = Linkage::new(&model);
    let mut out = vec![0.0; linkage.coordinates];
    let mut r = Reduction::<f64>::new(&[&linkage]);
    r.place(&out.clone(), &out.clone());
    for (k, &p) in place.iter().enumerate() {
        r.force[p] = [0.3 + 0.1 * k as f64, 1.0 - 0.2 * k as f64, 0.5 * (k as f64 - 3.0)];
    }
    r.reduce(ReductionTask::Accelerations, &mut out);
    let local = r.accelerations[place[0]];
    let met = r.reduce_singular(ReductionTask::Accelerations, &mut out);
    (local, r.accelerations[place[0]], met)
}

/// Six arms with different kinks around 1e-6, in rotated directions. Reference: the same bodies and pins as a dense system
/// solved with 60 digits (mpmath). Local pivots lose 1e-16/ε², the rows that keep their scale 1e-16/ε.
#[test]
fn mixed_kinks_at_1e_6() {
    let kinks = [1.0, 1.3, 0.1, 7.0, 1.0, 2.0].map(|k| k * 1e-6);
    let expected = [1.985_430_350_339_811e-6, 1.538_075_450_125_365e-6, -14.133_519_288_427_03];
    let (local, general, met) = shuttle(&kinks);
    let error = |a: [f64; 3]| (0..3).map(|i| ((a[i] - expected[i]) / expected[i]).abs()).fold(0.0, f64::max);
    assert!(error(general) < 5e-9, "{:e}", error(general));
    assert!(error(local) > 1e-5, "local pivots are no longer worse: {:e}", error(local));
    assert!(met.heavy <= 6, "{met:?}");
}

/// Straight arms exactly: the shuttle can only turn, whatever the number of arms, and never more than six rows travel
/// together. Each arm holds the shuttle along itself; all but two of these constraints are redundant.
#[test]
fn straight_arms() {
    for count in [2, 6, 50] {
        let (_, a, met) = shuttle(&vec![0.0; count]);
        assert!(a[0].abs() < 1e-12 * a[2].abs() && a[1].abs() < 1e-12 * a[2].abs(), "{a:?}");
        assert_eq!((met.redundant, met.passed > 0), (count - 2, true), "{met:?}");
        assert!(met.heavy <= 6, "{met:?}");
    }
}

/// NaN and infinities pass through the path for singular configurations unchanged. (An explicit step that had become
/// unstable once ended the program there.)
#[test]
fn what_is_not_finite_stays_so() {
    for kinks in [[0.0; 3], [0.1; 3]] {
        let (model, place) = star(&kinks, 0.6435).model();
        let linkage = Linkage::new(&model);
        let mut out = vec![0.0; linkage.coordinates];
        let mut r = Reduction::<f64>::new(&[&linkage]);
        for wrong in [f64::NAN, f64::INFINITY] {
            let q = vec![if wrong.is_nan() { wrong } else { 0.0 }; linkage.coordinates];
            r.place(&q, &q);
            r.force[place[0]] = [wrong, 1.0, 0.0];
            r.reduce_singular(ReductionTask::Accelerations, &mut out);
            assert!(!out.iter().all(|x| x.is_finite()));
        }
    }
}
