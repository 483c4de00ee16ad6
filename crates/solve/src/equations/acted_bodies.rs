//! Bodies of a batch that gaps and loads act on. Such elements have branches of their own, so they run variant by variant: a lane is taken
//! out of the vectors, and put back.

use bimorph_domains::System;
use bimorph_multibody::batch::{LaneMatrix, LanePose};
use bimorph_multibody::planar::{DOF, Pose};
use bimorph_multibody::scalar::StoredReal;
use bimorph_multibody::{BodyMatrix, Pattern};

/// These bodies, with what acts on one lane of them.
#[derive(Debug, Clone)]
pub(crate) struct ActedBodies {
    /// In elimination order.
    pub(crate) bodies: Vec<usize>,
    /// Blocks between them.
    blocks: Vec<usize>,
    /// Displacements of the lane at hand.
    pub(crate) q: Vec<Pose>,
    /// Forces on it.
    pub(crate) r: Vec<Pose>,
    /// Its tangent.
    pub(crate) tangent: BodyMatrix,
}

fn block(pattern: &Pattern, row: usize, column: usize) -> Option<usize> {
    if row > column { pattern.block(row, column) } else { None }
}

/// A pose in one lane.
#[inline]
pub(crate) fn pose_in_lane(p: &LanePose, lane: usize) -> Pose {
    Pose::new(p[0].lane(lane), p[1].lane(lane), p[2].lane(lane))
}

impl ActedBodies {
    /// Those of a system.
    pub(crate) fn new(system: &System) -> Self {
        let (n, pattern, bodies) = (system.bodies(), &system.model.pattern, system.acted_on());
        let between = |&row: &usize| bodies.iter().filter_map(move |&column| block(pattern, row, column));
        Self {
            blocks: bodies.iter().flat_map(between).collect(),
            q: vec![Pose::zeros(); n],
            r: vec![Pose::zeros(); n],
            tangent: BodyMatrix::new(pattern),
            bodies,
        }
    }

    /// True where the same bodies of another variant are acted on.
    pub(crate) fn fits(&self, system: &System) -> bool {
        self.bodies == system.acted_on()
    }

    /// Takes displacements and forces of a lane.
    pub(crate) fn take(&mut self, lane: usize, places: &[LanePose], forces: &[LanePose]) {
        for &b in &self.bodies {
            (self.q[b], self.r[b]) = (pose_in_lane(&places[b], lane), pose_in_lane(&forces[b], lane));
        }
    }

    /// Puts the forces back.
    pub(crate) fn give(&self, lane: usize, forces: &mut [LanePose]) {
        for &b in &self.bodies {
            (0..DOF).for_each(|i| forces[b][i].set_lane(lane, self.r[b][i]));
        }
    }

    /// Takes the tangent of a lane.
    pub(crate) fn take_tangent(&mut self, lane: usize, from: &LaneMatrix) {
        let Self { bodies, blocks, tangent, .. } = self;
        for (from, own, which) in
            [(&from.diagonal, &mut tangent.diagonal, &*bodies), (&from.below, &mut tangent.below, &*blocks)]
        {
            for &b in which {
                (0..DOF * DOF).for_each(|e| own[b][(e % DOF, e / DOF)] = from[b][e / DOF][e % DOF].lane(lane));
            }
        }
    }

    /// Puts the tangent back.
    pub(crate) fn give_tangent(&self, lane: usize, to: &mut LaneMatrix) {
        let Self { bodies, blocks, tangent, .. } = self;
        for (to, own, which) in [(&mut to.diagonal, &tangent.diagonal, bodies), (&mut to.below, &tangent.below, blocks)]
        {
            for &b in which {
                (0..DOF * DOF).for_each(|e| to[b][e / DOF][e % DOF].set_lane(lane, own[b][(e % DOF, e / DOF)]));
            }
        }
    }
}
