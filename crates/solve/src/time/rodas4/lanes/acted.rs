//! Elements that act on few bodies of a variant and have branches of their own: gaps and dead loads, variant by
//! variant.

use super::super::tableau::IN_PLACE;
use super::super::tableau::{C, GAMMA};
use super::storage::{Lane, LaneRodas4};
use bimorph_multibody::batch::{LANES, LanePose};
use bimorph_multibody::planar::Pose;
use bimorph_multibody::scalar::StoredReal;

impl LaneRodas4 {
    /// Contributions of gaps and dead loads to the forces of stage `i`, and in the first stage to the tangent.
    pub(super) fn act(&mut self, lanes: &[Option<Lane<'_>>; LANES], i: usize) {
        let Self { motion, at, force, w, acted, acted_blocks, drives, q, r, tangent, losses, rates, .. } = self;
        let ([r1_of, rate_of], r1, increments, h) = (rates, &self.r1, &self.increments, &self.h);
        if acted.is_empty() {
            return;
        }
        let from = if i < IN_PLACE { &*at } else { &motion.q };
        let pose = |p: &LanePose, k: usize| Pose::new(p[0].lane(k), p[1].lane(k), p[2].lane(k));
        for (k, (lane, drive)) in lanes.iter().zip(drives).enumerate() {
            let Some(lane) = lane else { continue };
            if !lane.system.is_acted_on(drive) {
                continue;
            }
            for &b in acted.iter() {
                (q[b], r[b]) = (pose(&from[b], k), pose(&force[b], k));
            }
            lane.system.add_body_forces(q, drive, r);
            let loses = !losses.is_empty() && lane.system.loses();
            if loses {
                for &b in acted.iter() {
                    r1_of[b] = pose(&r1[b], k);
                    rate_of[b] =
                        (0..i).fold(r1_of[b], |rate, j| rate - pose(&increments[b][j].q, k) * (C[i][j] / h.0[k]));
                }
                if i == 0 {
                    losses[k].at(lane.system, q, |b| rate_of[b]);
                }
                lane.system.add_loss(q, |b| rate_of[b], r);
                losses[k].add_damping(|b| -r1_of[b], r);
            }
            for &b in acted.iter() {
                (0..3).for_each(|i| force[b][i].set_lane(k, r[b][i]));
            }
            if i == 0 {
                for (blocks, own, which) in [
                    (&mut w.diagonal, &mut tangent.diagonal, &*acted),
                    (&mut w.below, &mut tangent.below, &*acted_blocks),
                ] {
                    for &b in which {
                        (0..9).for_each(|e| own[b][(e % 3, e / 3)] = blocks[b][e / 3][e % 3].lane(k));
                    }
                }
                lane.system.add_body_tangent(q, drive, tangent);
                if loses {
                    losses[k].add_to([1.0, 1.0 / (GAMMA * h.0[k])], tangent);
                }
                for (blocks, own, which) in
                    [(&mut w.diagonal, &tangent.diagonal, &*acted), (&mut w.below, &tangent.below, &*acted_blocks)]
                {
                    for &b in which {
                        (0..9).for_each(|e| blocks[b][e / 3][e % 3].set_lane(k, own[b][(e % 3, e / 3)]));
                    }
                }
            }
        }
    }
}
