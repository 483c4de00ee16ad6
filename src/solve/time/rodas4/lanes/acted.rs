//! What acts on few bodies of a variant and has branches of its own: gaps and dead loads, variant by variant.

use super::storage::{IN_PLACE, Lane, LaneRodas4};
use crate::multibody::lanes::Real;
use crate::multibody::lanes::{LANES, LanePose};
use crate::multibody::planar::Pose;

impl LaneRodas4 {
    /// What gaps and dead loads add to the forces of stage `i`, and in the first stage to the tangent.
    pub(super) fn act(&mut self, lanes: &[Option<Lane<'_>>; LANES], i: usize) {
        let Self { motion, at, force, w, acted, acted_blocks, drives, q, r, tangent, .. } = self;
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
