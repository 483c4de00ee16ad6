//! Initial states off the loops, and loops that close twice.

use super::mechanism::Mechanism;
use bimorph::multibody::joint_coordinates::constrained_loops::{Linkage, Reduction, ReductionTask, Singularity};
use bimorph::multibody::{BodyId, Model};
use bimorph::solve::dormand_prince::{DormandPrince, SecondOrder, Tolerances};
use bimorph::solve::joint_motion::{JointMotion, NotFinite};

/// A coupler on `bars` parallel cranks of 1 m, 1 m apart; two are enough, every further one implies nothing new.
fn parallel(bars: usize) -> (Model, Vec<usize>) {
    let mut m = Mechanism::default();
    let coupler = m.rod([0.3, 1.0], [3.3, 1.0]);
    for k in 0..bars {
        let crank = m.rod([k as f64, 0.0], [k as f64 + 0.3, 1.0]);
        m.pin(BodyId::Ground, crank, [k as f64, 0.0]);
        m.pin(crank, coupler, [k as f64 + 0.3, 1.0]);
    }
    m.model()
}

/// Result of projecting a state with errors of `size` (rad, m): gap before (m), gap after (m), rate of the gap after
/// (m/s).
pub(crate) fn projected(size: f64) -> [f64; 3] {
    let (model, _) = parallel(2);
    let linkage = Linkage::new(&model);
    let n = linkage.coordinates;
    let mut s = super::mechanism::Stream(5);
    let mut q: Vec<f64> = (0..n).map(|_| size * s.next()).collect();
    let mut v: Vec<f64> = (0..n).map(|_| size * s.next()).collect();
    let mut r = Reduction::<f64>::new(&[&linkage]);
    r.place(&q, &v);
    let before = r.largest(ReductionTask::Positions);
    let mut change = vec![0.0; n];
    let after = r.project_positions(&mut q, &v, &mut change);
    r.project_rates(&q, &mut v, &mut change);
    [before, after, r.largest(ReductionTask::Rates)]
}

struct Adrift<P>(P);

impl<P: SecondOrder> SecondOrder for Adrift<P> {
    type Error = P::Error;

    fn dimension(&self) -> usize {
        self.0.dimension()
    }

    fn accelerations(&mut self, t: f64, q: &[f64], v: &[f64], a: &mut [f64]) -> Result<(), P::Error> {
        self.0.accelerations(t, q, v, a)
    }
}

fn integrate<P: SecondOrder<Error = NotFinite>>(problem: &mut P, q: &mut [f64], v: &mut [f64], end: f64) {
    let n = q.len();
    let bounds = Tolerances { rtol: 1e-10, atol_q: vec![1e-10; n], atol_v: vec![1e-10; n] };
    let mut h = 0.0;
    DormandPrince::new(n).integrate(problem, (0.0, end), q, v, &mut h, &bounds, 100_000, &mut |_| true).unwrap();
}

fn gravity(model: &Model, r: &mut Reduction<f64>) {
    for (f, b) in r.force.iter_mut().zip(&model.bodies) {
        f[1] -= 9.81 * b.mass;
    }
}

/// Gap (m) after `end` (s) of a linkage that began 1e-6 rad and 1e-3 rad/s off: never projected, projected.
pub(crate) fn kept(end: f64) -> [f64; 2] {
    let (model, _) = parallel(2);
    let linkage = Linkage::new(&model);
    let n = linkage.coordinates;
    let loads = |_: f64, _: &[f64], _: &[f64], r: &mut Reduction<f64>| gravity(&model, r);
    let mut gaps = [0.0; 2];
    for (k, gap) in gaps.iter_mut().enumerate() {
        let mut s = super::mechanism::Stream(5);
        let mut q: Vec<f64> = (0..n).map(|_| 1e-6 * s.next()).collect();
        let mut v: Vec<f64> = (0..n).map(|_| 1e-3 * s.next()).collect();
        let mut motion = JointMotion::new(&linkage, loads);
        if k == 0 {
            integrate(&mut Adrift(motion), &mut q, &mut v, end);
        } else {
            integrate(&mut motion, &mut q, &mut v, end);
        }
        let mut r = Reduction::<f64>::new(&[&linkage]);
        r.place(&q, &v);
        *gap = r.largest(ReductionTask::Positions);
    }
    gaps
}

/// Place of the coupler (m, m, rad) after 0.5 s under gravity on `bars` cranks, which together weigh as much as two; what
/// the last reduction near a singular configuration met, and how many there were.
pub(crate) fn swung(bars: usize) -> ([f64; 3], Singularity, u64) {
    let (mut model, place) = parallel(bars);
    for k in 0..bars {
        let body = &mut model.bodies[place[k + 1]];
        body.mass *= 2.0 / bars as f64;
        body.inertia *= 2.0 / bars as f64;
    }
    let linkage = Linkage::new(&model);
    let n = linkage.coordinates;
    let (mut q, mut v) = (vec![0.0; n], vec![0.0; n]);
    let loads = |_: f64, _: &[f64], _: &[f64], r: &mut Reduction<f64>| gravity(&model, r);
    let mut motion = JointMotion::new(&linkage, loads);
    integrate(&mut motion, &mut q, &mut v, 0.5);
    let mut r = Reduction::<f64>::new(&[&linkage]);
    r.place(&q, &v);
    (r.pose(place[0]), motion.met, motion.singular)
}

/// Largest acceleration by local pivots alone on `bars` cranks (m/s²); not a number where a pivot is zero.
pub(crate) fn local(bars: usize) -> f64 {
    let (model, _) = parallel(bars);
    let linkage = Linkage::new(&model);
    let zeros = vec![0.0; linkage.coordinates];
    let mut r = Reduction::<f64>::new(&[&linkage]);
    r.place(&zeros, &zeros);
    gravity(&model, &mut r);
    let mut out = zeros.clone();
    r.reduce(ReductionTask::Accelerations, &mut out);
    let all = r.accelerations.iter().flatten();
    all.fold(0.0, |m: f64, x| if x.is_nan() || m.is_nan() { f64::NAN } else { m.max(x.abs()) })
}

/// Gaps up to 0.07 m are closed to rounding, rates too; the remainder is reported.
#[test]
fn projection() {
    for size in [1e-9, 1e-6, 1e-3, 1e-1] {
        let [before, after, rate] = projected(size);
        assert!(before > 0.1 * size && after < 1e-15 && rate < 1e-15, "{size:e}: {before:e} {after:e} {rate:e}");
    }
}

/// A linkage that begins off its loops and is never projected keeps its gap, which grows with its rate: 0.3 mm after 1 s,
/// 3 mm after 10 s. Projected, it has none.
#[test]
fn gaps_grow_unless_closed() {
    let ([early, _], [late, closed]) = (kept(1.0), kept(10.0));
    assert!(early > 1e-4 && late > 5.0 * early && closed < 1e-14, "{early:e} {late:e} {closed:e}");
}

/// Parallel bars: each one past the second closes one constraint that others imply. It is found, counted, contradicts
/// nothing, and the coupler moves as with two. Local pivots alone hold the coupler still.
#[test]
fn redundant_bars() {
    let (two, _, singular) = swung(2);
    assert_eq!(singular, 0);
    for bars in 3..=5 {
        let (place, met, _) = swung(bars);
        assert_eq!(met.redundant, bars - 2);
        assert!(met.contradiction < 1e-13, "{:e}", met.contradiction);
        assert!((0..3).all(|i| (place[i] - two[i]).abs() < 1e-9), "{bars}: {place:?} {two:?}");
        assert!(local(bars).abs() < 1e-3 * local(2), "{bars}: {:e}", local(bars));
    }
}
