//! The model of the paper: joints of beams that only turn.
//!
//! A beam is then a chain of rigid bodies on pins with springs: one coordinate a joint, and constraints where chains close
//! loops. The axial direction (type 4) is rigid too; heat and residual stress prescribe its offset, a gap function.
//!
//! **Counts.** The paper counts every joint as a coordinate and cuts loops through bodies, three constraints for each.
//! A tree here consists of joints, so that a loop is cut at a joint instead: two constraints, and its rotation is no
//! coordinate. [`CoordinateCounts`] gives the paper's numbers; n − m, the number of degrees of freedom, is the same.
//! With every beam in two segments (its question 1), a bank has 12 joints per bimorph: hot arm, tip bar, cold arm,
//! flexure, link, and its part of yoke and tether. The quarter stage of ten has n = 10·12 + 3 = 123, including the
//! three of the free plate, and m = 20·3 = 60. These are the n and m ≈ n/2 of the paper.

use crate::planar::Symmetric;
use crate::section::JointSection;
use crate::{BodyId, Model};
use bimorph_base::sets::Sets;
use nalgebra::Matrix3;

/// Coordinates and constraints as the paper counts them: loops cut through bodies, the last body free.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CoordinateCounts {
    /// Generalized coordinates: moving directions of joints, and three for each connected part.
    pub coordinates: usize,
    /// Closed loops, those through ground included.
    pub loops: usize,
    /// Constraints: three a loop, and the directions that supports hold.
    pub constraints: usize,
}

impl JointSection {
    /// Removes the couplings of its directions and keeps the compliance of each alone: where the others are rigid, a
    /// spring half a segment away must not stiffen the rotation.
    fn uncouple(&mut self) {
        let [uu, ug, up, gg, gp, pp] = self.stiffness.0;
        if (ug, up, gp) == (0.0, 0.0, 0.0) {
            return;
        }
        if let Some(c) = Matrix3::new(uu, ug, up, ug, gg, gp, up, gp, pp).try_inverse() {
            self.stiffness = Symmetric([1.0 / c[(0, 0)], 0.0, 0.0, 1.0 / c[(1, 1)], 0.0, 1.0 / c[(2, 2)]]);
        }
    }

    /// True for a segment of a beam, which bends; false for a lumped spring or a hinge.
    #[inline]
    pub fn is_segment(&self) -> bool {
        self.stiffness.0[5] > 0.0 && (self.locked[1] || self.second != [0.0; 3])
    }

    /// True for a joint that rotates and is rigid in all other directions.
    #[inline]
    pub fn only_turns(&self) -> bool {
        self.locked == [true, true, false]
    }
}

impl Model {
    /// The same model with joints of beams that only turn.
    #[inline]
    pub fn rotary(&self) -> Self {
        let mut model = self.clone();
        for section in model.sections.iter_mut().filter(|s| s.is_segment()) {
            section.locked = [true, true, false];
            section.uncouple();
        }
        model
    }

    /// The same model with the locked directions of its beams' joints `factor` times as stiff, for what needs a stiffness.
    #[inline]
    pub fn stiffened(&self, factor: f64) -> Self {
        let mut model = self.clone();
        for section in model.sections.iter_mut().filter(|s| s.is_segment()) {
            // uu, gg and pp of the symmetric stiffness
            for (at, _) in [0, 3, 5].into_iter().zip(section.locked).filter(|(_, locked)| *locked) {
                section.stiffness.0[at] *= factor;
            }
        }
        model
    }

    /// Coordinates, loops and constraints as the paper counts them.
    pub fn counts(&self) -> CoordinateCounts {
        let mut joined = Sets::new(self.bodies.len());
        let mut parts = self.bodies.len();
        let mut edges = 0;
        let mut coordinates = 0;
        for joint in (0..self.joints.len()).map(|k| self.joint(k)).filter(|j| j.a != j.b) {
            edges += 1;
            coordinates += joint.locked.iter().filter(|&&l| !l).count();
            if let (BodyId::Free(a), BodyId::Free(b)) = (joint.a, joint.b)
                && joined.join(a, b)
            {
                parts -= 1;
            }
        }
        // every part floats on one body, so that each of its ways to ground closes a loop
        let loops = edges + parts - self.bodies.len();
        let held: usize =
            self.bodies.iter().map(|b| b.free.as_ref().map_or(0, |p| 3 - p.trace().round() as usize)).sum();
        CoordinateCounts { coordinates: coordinates + 3 * parts, loops, constraints: 3 * loops + held }
    }
}
