//! What a gap between facing beams bears, as a load along them.

use super::System;
use super::system::Gap;
use crate::multibody::planar::Pose;

impl System {
    /// The mean load with which voltage closes a gap between facing beams, less that of contact [N/m], and the least distance [m]; none for
    /// other gaps.
    pub fn line_load(&self, gap: usize, q: &[Pose], volts: f64) -> Option<(f64, f64)> {
        let Gap::Facing { ends, side, facing } = &self.gaps[gap] else { return None };
        let z = self.ends(ends, *side, q);
        let force = facing.at(&z).gradient * (-0.5 * volts * volts) + facing.contact(&z).0;
        Some(((force[0] + force[2]).abs() / facing.length, facing.closest(&z).0))
    }
}
