//! Lanes of variants against the serial run.

use crate::mechanism::Mechanism;
use bimorph::multibody::BodyId;
use bimorph::multibody::joint_coordinates::constrained_loops::{Linkage, Reduction, ReductionTask};
use bimorph::multibody::scalar::{Lanes, StoredReal};

/// A ladder of `cells` cells whose rungs are `width` wide.
fn ladder(cells: usize, width: f64) -> Linkage {
    let mut m = Mechanism::default();
    let mut below = BodyId::Ground;
    for k in 0..cells {
        let ends = |k: usize| ([0.1 * (k % 2) as f64, k as f64], [width + 0.08 * (k % 3) as f64, k as f64]);
        let ((l0, r0), (l1, r1)) = (ends(k), ends(k + 1));
        let (left, right, rung) = (m.rod(l0, l1), m.rod(r0, r1), m.rod(l1, r1));
        m.pin(below, left, l0);
        m.pin(below, right, r0);
        m.pin(left, rung, l1);
        m.pin(right, rung, r1);
        below = rung;
    }
    Linkage::new(&m.model().0)
}

/// Batched variants of one mechanism are bit-identical to single ones, in any instruction set: nothing is fused and
/// nothing is reordered.
#[test]
fn a_lane_has_the_bits_of_its_variant() {
    let variants: Vec<Linkage> = (0..8).map(|k| ladder(7, 1.0 + 0.1 * k as f64)).collect();
    let n = variants[0].coordinates;
    let wave = |k: usize, lane: usize| 0.05 * (k as f64 * 0.7 + lane as f64).sin();
    let mut q = vec![Lanes::<8>::ZERO; n];
    for (k, q) in q.iter_mut().enumerate() {
        for lane in 0..8 {
            q.set_lane(lane, wave(k, lane));
        }
    }
    let mut lanes = Reduction::<Lanes<8>>::new(&variants.iter().collect::<Vec<_>>());
    lanes.force.fill([Lanes::splat(0.1), Lanes::splat(-1.0), Lanes::ZERO]);
    let mut together = q.clone();
    lanes.accelerate(&q, &q, &mut together);
    for (lane, variant) in variants.iter().enumerate() {
        let q: Vec<f64> = (0..n).map(|k| wave(k, lane)).collect();
        let mut alone = Reduction::<f64>::new(&[variant]);
        alone.force.fill([0.1, -1.0, 0.0]);
        let mut out = vec![0.0; n];
        alone.place(&q, &q);
        alone.reduce(ReductionTask::Accelerations, &mut out);
        for (a, b) in out.iter().zip(&together) {
            assert_eq!(a.to_bits(), b.lane(lane).to_bits());
        }
        assert_eq!(alone.nearness.to_bits(), lanes.nearness.lane(lane).to_bits());
    }
}

/// The multiplications of one reduction grow with the number of cells and nothing else: the same for every further cell.
#[test]
fn work_is_linear_in_the_cells() {
    let work = |cells: usize| Reduction::<f64>::new(&[&ladder(cells, 1.0)]).multiplications();
    let per_cell = work(11) - work(10);
    assert_eq!(work(1000) - work(10), 990 * per_cell);
}
