//! Accelerations against dense pivoted elimination.

use crate::dense_reference;
use crate::mechanism::{Mechanism, PIN, Stream, WELD};
use bimorph::multibody::BodyId;
use bimorph::multibody::joint_coordinates::constrained_loops::{Linkage, Reduction, ReductionTask};
use nalgebra::Matrix2;

/// A random tree of `count` bodies with `loops` further joints of random kinds.
fn random(seed: u64, count: usize, loops: usize, kinds: &[[bool; 3]]) -> Mechanism {
    let mut s = Stream(seed);
    let mut m = Mechanism::default();
    let mut ids = vec![BodyId::Ground];
    let mut places = vec![[0.0, 0.0]];
    for k in 0..count {
        let up = s.below(ids.len());
        let at = [places[up][0] + 2.0 * s.next(), places[up][1] + 2.0 * s.next()];
        ids.push(m.body(at, 1.0 + s.next(), 0.2 + 0.2 * s.next()));
        places.push(at);
        let joint = [0.5 * (at[0] + places[up][0]) + 0.3 * s.next(), 0.5 * (at[1] + places[up][1]) + 0.3 * s.next()];
        let kind = kinds[s.below(kinds.len())];
        let (a, b) = if k % 2 == 0 { (ids[up], ids[k + 1]) } else { (ids[k + 1], ids[up]) };
        m.join(a, b, joint, 3.0 * s.next(), kind, [1.0; 3]);
    }
    for _ in 0..loops {
        let (a, b) = (s.below(ids.len()), s.below(ids.len()));
        if a != b {
            let at = [0.5 * (places[a][0] + places[b][0]) + s.next(), 0.5 * (places[a][1] + places[b][1]) + s.next()];
            let kind = if s.next() > 0.2 { WELD } else { PIN };
            // a loop takes freedom away: rigid ones only where enough is left
            let kind = if kinds.contains(&PIN) && kinds.len() == 1 { PIN } else { kind };
            m.join(ids[a], ids[b], at, s.next(), kind, [1.0; 3]);
        }
    }
    m
}

/// Difference from the judge and nearness; none where the judge finds no single answer.
fn compare(m: &Mechanism, seed: u64) -> Option<(f64, f64)> {
    let (model, _) = m.model();
    let linkage = Linkage::new(&model);
    let mut s = Stream(seed);
    let q: Vec<f64> = (0..linkage.coordinates).map(|_| 0.2 * s.next()).collect();
    let v: Vec<f64> = (0..linkage.coordinates).map(|_| s.next()).collect();
    let mut reduction = Reduction::<f64>::new(&[&linkage]);
    reduction.place(&q, &v);
    for f in &mut reduction.force {
        *f = [s.next(), s.next(), s.next()];
    }
    let force = reduction.force.clone();
    let mut a = vec![0.0; linkage.coordinates];
    reduction.reduce(ReductionTask::Accelerations, &mut a);
    let (fast, near) = (reduction.accelerations.clone(), reduction.nearness);
    let judge = dense_reference::accelerations(&model, &dense_reference::joints(&model), &reduction, &force)?;
    reduction.reduce_singular(ReductionTask::Accelerations, &mut a);
    let general = dense_reference::difference(&reduction.accelerations, &judge, 1.0);
    assert!(general < 1e-12, "general path: {general:e}, nearness {near:e}");
    Some((dense_reference::difference(&fast, &judge, 1.0), near))
}

/// Open trees of every kind of joint, second-order axial strain included: 1e-12 of dense pivoted elimination.
#[test]
fn open_trees() {
    let kinds = [PIN, [false; 3], [true, false, true], [false, true, true], [true, false, false], WELD];
    for seed in 0..40 {
        let mut m = random(seed, 12, 0, &kinds);
        m.bend(Matrix2::new(0.3, 0.1, 0.1, -0.2));
        let (apart, _) = compare(&m, seed + 7).unwrap();
        assert!(apart < 1e-12, "tree {seed}: {apart:e}");
    }
}

/// Trees of pins with pin loops, coupled ones too: 1e-12 of dense pivoted elimination by the general path, and by the fast
/// one away from singular configurations (rounding times the square of the nearness).
#[test]
fn trees_with_loops() {
    let mut compared = 0;
    for seed in 0..200 {
        let m = random(seed, 24, 1 + (seed % 6) as usize, &[PIN]);
        if let Some((apart, near)) = compare(&m, seed + 7) {
            assert!(apart < 1e-15 * near * near + 1e-12, "loops {seed}: {apart:e}, nearness {near:e}");
            compared += 1;
        }
    }
    assert!(compared > 100, "{compared}");
}
