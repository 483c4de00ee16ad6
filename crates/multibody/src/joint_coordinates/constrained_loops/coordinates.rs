//! Joint coordinates of given poses.

use super::tree::Linkage;
use crate::joint_coordinates::TreeParent;
use crate::planar::{JointFrame, Pose};

impl Linkage {
    /// Writes the strains of the tree's joints at `poses` (one a body, in elimination order) to `q` (length n). Strains in
    /// locked directions and the gaps of loops are lost: project afterwards.
    pub fn coordinates_at(&self, poses: &[Pose], q: &mut [f64]) {
        for (body, link) in self.links.iter().enumerate() {
            let here = poses[body];
            let parent = match link.parent {
                TreeParent::Body(p) => poses[p as usize],
                TreeParent::Ground => Pose::zeros(),
                TreeParent::Free => {
                    q[link.first..link.first + 3].copy_from_slice(here.as_slice());
                    continue;
                }
            };
            let second = [link.second[(0, 0)], link.second[(0, 1)], link.second[(1, 1)]];
            let strain = if link.sign > 0.0 {
                link.frame.kinematics(&parent, &here, &second).strain
            } else {
                let JointFrame { arm_a, arm_b, axis } = link.frame;
                let frame = JointFrame { arm_a: arm_b, arm_b: arm_a, axis };
                frame.kinematics(&here, &parent, &second).strain
            };
            for (at, i) in (link.first..).zip((0..3).filter(|&i| link.moving[i])) {
                q[at] = strain[i];
            }
        }
    }
}
