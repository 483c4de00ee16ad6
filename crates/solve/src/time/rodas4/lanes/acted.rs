//! Elements that act on few bodies of a variant and have branches of their own: gaps and dead loads, variant by
//! variant.

use super::super::tableau::IN_PLACE;
use super::super::tableau::{C, GAMMA};
use super::storage::{Lane, LaneRodas4};
use crate::equations::acted_bodies::{ActedBodies, pose_in_lane};
use bimorph_multibody::batch::LANES;

impl LaneRodas4 {
    /// Contributions of gaps and dead loads to the forces of stage `i`, and in the first stage to the tangent.
    pub(super) fn act(&mut self, lanes: &[Option<Lane<'_>>; LANES], i: usize) {
        let Self { motion, at, force, w, acted, drives, losses, rates, .. } = self;
        let ([r1_of, rate_of], r1, increments, h) = (rates, &self.r1, &self.increments, &self.h);
        if acted.bodies.is_empty() {
            return;
        }
        let from = if i < IN_PLACE { &*at } else { &motion.q };
        for (k, (lane, drive)) in lanes.iter().zip(drives).enumerate() {
            let Some(lane) = lane else { continue };
            if !lane.system.is_acted_on(drive) {
                continue;
            }
            acted.take(k, from, force);
            let ActedBodies { bodies, q, r, .. } = &mut *acted;
            let apart = lane.system.add_body_forces(q, drive, r);
            let loses = !losses.is_empty() && lane.system.loses();
            if loses {
                for &b in bodies.iter() {
                    r1_of[b] = pose_in_lane(&r1[b], k);
                    rate_of[b] = (0..i)
                        .fold(r1_of[b], |rate, j| rate - pose_in_lane(&increments[b][j].q, k) * (C[i][j] / h.0[k]));
                }
                if i == 0 {
                    losses[k].near(lane.system, (q, apart), |b| rate_of[b]);
                }
                lane.system.add_loss_near((q, apart), |b| rate_of[b], r);
                losses[k].add_damping(|b| -r1_of[b], r);
            }
            acted.give(k, force);
            if i == 0 {
                acted.take_tangent(k, w);
                let ActedBodies { q, tangent, .. } = &mut *acted;
                lane.system.add_body_tangent(q, drive, tangent);
                if loses {
                    losses[k].add_to([1.0, 1.0 / (GAMMA * h.0[k])], tangent);
                }
                acted.give_tangent(k, w);
            }
        }
    }
}
