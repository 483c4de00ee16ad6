//! Arms that come straight: a star of six two-link arms between a shuttle and ground, against 60-digit references.

use super::mechanism::Mechanism;
use bimorph::multibody::joint_coordinates::constrained_loops::{Linkage, Reduction, ReductionTask, Singularity};
use bimorph::multibody::{BodyId, Model};
use nalgebra::{DMatrix, DVector};

/// Kinks as multiples of one number: equal, or mixed over two orders of magnitude.
pub(crate) const EQUAL: [f64; 6] = [1.0; 6];
pub(crate) const MIXED: [f64; 6] = [1.0, 1.3, 0.1, 7.0, 1.0, 2.0];

/// Acceleration of the shuttle (m/s², rad/s²) for the kinks of [`EQUAL`]; scripts/stability/kinks.py, 60 digits.
#[rustfmt::skip]
pub(crate) const EQUAL_REFERENCE: [(f64, [f64; 3]); 7] = [
    (0.01, [-0.006_259_057_389_088_57, 0.045_159_524_886_230_78, -13.933_398_277_137_213]),
    (0.001, [-0.000_575_872_872_081_283_2, 0.004_361_319_467_636_476, -13.957_316_255_645_464]),
    (0.000_1, [-5.709_123_038_563_269_7e-5, 0.000_434_573_955_950_139_63, -13.959_695_902_849_832]),
    (1.0e-5, [-5.704_166_976_310_232e-6, 4.344_180_451_330_836e-5, -13.959_933_736_464_915]),
    (1.0e-6, [-5.703_671_417_051_975e-7, 4.344_024_529_556_350_5e-6, -13.959_957_518_485_044]),
    (1.0e-7, [-5.703_621_831_860_698e-8, 4.344_008_935_528_011_6e-7, -13.959_959_895_847_271]),
    (1.0e-8, [-5.703_616_742_660_476e-9, 4.344_007_344_482_335e-8, -13.959_960_134_637_303]),
];
/// The same for [`MIXED`].
#[rustfmt::skip]
pub(crate) const MIXED_REFERENCE: [(f64, [f64; 3]); 7] = [
    (0.01, [0.020_396_917_661_978_244, 0.015_700_071_013_542_836, -14.125_354_574_075_502]),
    (0.001, [0.001_991_167_278_558_522, 0.001_541_424_872_524_554_6, -14.132_720_036_388_77]),
    (0.000_1, [0.000_198_600_198_616_306_65, 0.000_153_840_894_485_497_72, -14.133_440_253_733_005]),
    (1.0e-5, [1.985_482_344_801_968_8e-5, 1.538_105_782_661_144e-5, -14.133_512_104_934_251]),
    (1.0e-6, [1.985_430_350_363_983_5e-6, 1.538_075_450_074_428_4e-6, -14.133_519_288_413_689]),
    (1.0e-7, [1.985_425_147_823_804e-7, 1.538_072_409_023_249_5e-7, -14.133_520_007_147_26]),
    (1.0e-8, [1.985_424_609_700_362e-8, 1.538_072_123_452_68e-8, -14.133_520_080_300_084]),
];
/// Rotation of the shuttle with straight arms (rad/s²); the same script.
const STRAIGHT_TURN: f64 = -14.026_564_005_7;

/// Arms in directions that no axis helps; the first stands at 0.6435 rad.
fn star(kinks: &[f64]) -> (Model, Vec<usize>) {
    let mut m = Mechanism::default();
    let hub = m.body([0.0, 0.0], 1.0, 0.3);
    for (k, &kink) in kinks.iter().enumerate() {
        let a = 0.6435 + 0.7 * k as f64;
        let at = [0.2 * a.cos(), 0.2 * a.sin()];
        let knee = [at[0] + 0.5 * a.cos(), at[1] + 0.5 * a.sin()];
        let b = a + kink;
        let foot = [knee[0] + 0.5 * b.cos(), knee[1] + 0.5 * b.sin()];
        let (upper, lower) = (m.rod(at, knee), m.rod(knee, foot));
        m.pin(hub, upper, at);
        m.pin(upper, lower, knee);
        m.pin(lower, BodyId::Ground, foot);
    }
    m.model()
}

/// Acceleration of the shuttle (m/s², rad/s²) by local pivots, by the path for singular configurations, by dense
/// elimination with partial pivoting; and what the second met.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Shuttle {
    pub(crate) local: [f64; 3],
    pub(crate) ours: [f64; 3],
    pub(crate) dense: [f64; 3],
    pub(crate) met: Singularity,
}

fn loaded(kinks: &[f64]) -> (Model, Vec<usize>, Linkage, Reduction<f64>) {
    let (model, place) = star(kinks);
    let linkage = Linkage::new(&model);
    let zeros = vec![0.0; linkage.coordinates];
    let mut r = Reduction::<f64>::new(&[&linkage]);
    r.place(&zeros, &zeros);
    for (k, &p) in place.iter().enumerate() {
        let k = (k % 13) as f64;
        r.force[p] = [0.3 + 0.1 * k, 1.0 - 0.2 * k, 0.5 * (k - 3.0)];
    }
    (model, place, linkage, r)
}

/// The star with kinks `size`·`shape`.
pub(crate) fn shuttle(size: f64, shape: &[f64; 6]) -> Shuttle {
    let (model, place, linkage, mut r) = loaded(&shape.map(|x| x * size));
    let mut out = vec![0.0; linkage.coordinates];
    r.reduce(ReductionTask::Accelerations, &mut out);
    let local = r.accelerations[place[0]];
    let met = r.reduce_singular(ReductionTask::Accelerations, &mut out);
    Shuttle { local, ours: r.accelerations[place[0]], dense: dense(&model, &r.force, place[0]), met }
}

/// [M Jᵀ; J 0] by LU with partial pivoting, at rest.
fn dense(model: &Model, force: &[[f64; 3]], hub: usize) -> [f64; 3] {
    let (n, m) = (3 * model.bodies.len(), 2 * model.joints.len());
    let (mut a, mut b) = (DMatrix::<f64>::zeros(n + m, n + m), DVector::<f64>::zeros(n + m));
    for (k, body) in model.bodies.iter().enumerate() {
        for (i, x) in [body.mass, body.mass, body.inertia].into_iter().enumerate() {
            a[(3 * k + i, 3 * k + i)] = x;
            b[3 * k + i] = force[k][i];
        }
    }
    for (l, joint) in (0..model.joints.len()).map(|k| model.joint(k)).enumerate() {
        for (id, arm, sign) in [(joint.a, joint.frame.arm_a, -1.0), (joint.b, joint.frame.arm_b, 1.0)] {
            let BodyId::Free(k) = id else { continue };
            for (i, lever) in [-arm.y, arm.x].into_iter().enumerate() {
                let row = n + 2 * l + i;
                for (column, x) in [(3 * k + i, sign), (3 * k + 2, sign * lever)] {
                    a[(row, column)] = x;
                    a[(column, row)] = x;
                }
            }
        }
    }
    let x = a.lu().solve(&b).unwrap_or_else(|| DVector::from_element(n, f64::NAN));
    [x[3 * hub], x[3 * hub + 1], x[3 * hub + 2]]
}

/// Largest relative error of the three components; infinite for NaN.
pub(crate) fn error(got: [f64; 3], want: [f64; 3]) -> f64 {
    (0..3)
        .map(|i| ((got[i] - want[i]) / want[i]).abs())
        .fold(0.0, |m: f64, x| if x.is_nan() { f64::INFINITY } else { m.max(x) })
}

/// A shuttle with `count` straight arms: its diagnostics, and the shortest time of five reductions (s).
pub(crate) fn crowded(count: usize) -> (Singularity, f64) {
    let (_, _, linkage, mut r) = loaded(&vec![1e-7; count]);
    let mut out = vec![0.0; linkage.coordinates];
    let (mut met, mut best) = (Singularity::default(), f64::INFINITY);
    for _ in 0..5 {
        let started = std::time::Instant::now();
        met = r.reduce_singular(ReductionTask::Accelerations, &mut out);
        best = best.min(started.elapsed().as_secs_f64());
    }
    (met, best)
}

/// Rows up to this many travel together whatever the number of arms: as many as a body has directions.
const FRONT: usize = 3;

/// Against 60 digits: the path for singular configurations loses rounding over the kink, where local pivots lose rounding
/// over its square and dense elimination with partial pivoting falls behind too.
#[test]
fn kinks() {
    for (shape, references) in [(&EQUAL, &EQUAL_REFERENCE), (&MIXED, &MIXED_REFERENCE)] {
        for &(size, want) in references {
            let s = shuttle(size, shape);
            let (local, ours, dense) = (error(s.local, want), error(s.ours, want), error(s.dense, want));
            assert!(ours < 1e-12 + 2e-15 / size, "{size:e}: {ours:e}");
            if size <= 1e-4 {
                assert!(local > 1e-17 / (size * size) && dense > 10.0 * ours, "{size:e}: {local:e} {dense:e} {ours:e}");
            }
            if size <= 1e-7 {
                assert!(local > 1e-3 && dense > 1e-4, "{size:e}: {local:e} {dense:e}");
            }
        }
    }
}

/// Exactly straight arms, which all point to the shuttle's centre: it cannot move, it can turn; four of their constraints say
/// nothing new. Local pivots say it cannot turn.
#[test]
fn straight() {
    let s = shuttle(0.0, &EQUAL);
    assert!(s.ours[0].abs() < 1e-13 && s.ours[1].abs() < 1e-13, "{:?}", s.ours);
    assert!((s.ours[2] / STRAIGHT_TURN - 1.0).abs() < 1e-9, "{:?}", s.ours);
    assert_eq!(s.met.redundant, 4);
    assert!(s.local[2].abs() < 1e-3, "{:?}", s.local);
}

/// A shuttle holds three heavy rows however many straight arms meet at it.
#[test]
fn many_arms() {
    for count in [10, 100, 1000] {
        let (met, _) = crowded(count);
        assert_eq!((met.heavy, met.redundant), (FRONT, 0), "{count} arms: {met:?}");
    }
}
