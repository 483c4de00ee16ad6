//! Joints as a model stores them: the shared properties of one beam's joints are stored once, in a section; a joint
//! stores its arms, its bodies and the offset of its couplings. Fifty-six bytes a joint instead of some two hundred and
//! fifty, most of which every sweep over the joints would have to read.

use super::joint::{BodyId, Joint};
use super::planar::{JointFrame, Symmetric};
use nalgebra::{Matrix2, Matrix3, Vector2};
use rustc_hash::{FxBuildHasher, FxHashMap};

/// Properties shared by the joints that are cut from one beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointSection {
    /// Cosine and sine of the drawn angle of the joints' x axis.
    pub axis: Vector2<f64>,
    /// Stress per strain, see [`Joint::stiffness`].
    pub stiffness: Symmetric,
    /// Q over (g, p) as (gg, gp, pp), see [`Joint::second`].
    pub second: [f64; 3],
    /// See [`Joint::expansion`].
    pub expansion: Option<(usize, f64)>,
    /// See [`Joint::locked`].
    pub locked: [bool; 3],
}

/// A joint of a model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PackedJoint {
    /// From the centre of mass of body a to the joint, as drawn (m).
    pub arm_a: Vector2<f64>,
    /// From the centre of mass of body b to the joint, as drawn (m).
    pub arm_b: Vector2<f64>,
    /// Axial rest offset that does not change (m).
    pub rest: f64,
    /// Where its bodies and their coupling lie.
    pub(crate) place: PairSlot,
    section: u32,
}

impl PackedJoint {
    /// A joint between the centres of mass of two bodies, or of one and the ground.
    pub(super) fn at_center(place: PairSlot, section: u32) -> Self {
        Self { arm_a: Vector2::zeros(), arm_b: Vector2::zeros(), rest: 0.0, place, section }
    }

    /// Index of its section.
    #[inline]
    pub fn section(&self) -> usize {
        self.section as usize
    }

    /// Its bodies a and b.
    #[inline]
    pub fn bodies(&self) -> (BodyId, BodyId) {
        (self.place.a(), self.place.b())
    }

    /// The joint as it was given.
    pub(crate) fn whole(&self, section: &JointSection) -> Joint {
        let ([uu, ug, up, gg, gp, pp], [q_gg, q_gp, q_pp]) = (section.stiffness.0, section.second);
        let (a, b) = self.bodies();
        Joint {
            a,
            b,
            frame: self.frame(section),
            stiffness: Matrix3::new(uu, ug, up, ug, gg, gp, up, gp, pp),
            second: Matrix2::new(q_gg, q_gp, q_gp, q_pp),
            expansion: section.expansion,
            rest: self.rest,
            locked: section.locked,
        }
    }

    #[inline]
    pub(crate) fn frame(&self, section: &JointSection) -> JointFrame {
        JointFrame { arm_a: self.arm_a, arm_b: self.arm_b, axis: section.axis }
    }
}

/// Where a pair of bodies and their coupling lie in the tangent. Indices are 32 bits wide: a model with more bodies or
/// blocks would fill terabytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PairSlot {
    /// Body a, or [`NONE`] for ground.
    pub(crate) a: u32,
    /// Body b, or [`NONE`] for ground.
    pub(crate) b: u32,
    /// Block of their coupling, [`NONE`] where one of them is ground or both are the same.
    pub(crate) block: u32,
}

/// Ground, or no block.
pub(crate) const NONE: u32 = u32::MAX;

impl PairSlot {
    fn id(index: u32) -> BodyId {
        if index == NONE { BodyId::Ground } else { BodyId::Free(index as usize) }
    }

    pub(crate) fn a(self) -> BodyId {
        Self::id(self.a)
    }

    pub(crate) fn b(self) -> BodyId {
        Self::id(self.b)
    }

    /// Sorts pairs along the elimination order of their earlier body, then of their later one.
    pub(crate) fn order(self) -> (u32, u32) {
        // ground is the largest index
        (self.a.min(self.b), self.a.max(self.b))
    }
}

/// Sections that room is made for at first.
const ROOM: usize = 64;

/// Stores joints with one section for all that differ only by position and rest offset.
pub(crate) struct Sections {
    pub(crate) all: Vec<JointSection>,
    /// The last section of each hash.
    known: FxHashMap<u64, u32>,
    /// For each section, the one before it with the same hash.
    before: Vec<u32>,
}

impl Sections {
    /// For so many joints at most.
    pub(crate) fn new(joints: usize) -> Self {
        let room = joints.min(ROOM);
        Self {
            all: Vec::with_capacity(room),
            known: FxHashMap::with_capacity_and_hasher(room, FxBuildHasher),
            before: Vec::with_capacity(room),
        }
    }

    /// The joint as it is stored, between the bodies of `place`.
    pub(crate) fn lay(&mut self, joint: &Joint, place: PairSlot) -> PackedJoint {
        let (k, q) = (&joint.stiffness, &joint.second);
        let section = JointSection {
            axis: joint.frame.axis,
            stiffness: Symmetric([k[(0, 0)], k[(0, 1)], k[(0, 2)], k[(1, 1)], k[(1, 2)], k[(2, 2)]]),
            second: [q[(0, 0)], q[(0, 1)], q[(1, 1)]],
            expansion: joint.expansion,
            locked: joint.locked,
        };
        // neighbours along a beam are alike: compare with the last one first
        let section = match self.all.last() {
            Some(last) if *last == section => (self.all.len() - 1) as u32,
            _ => self.find(section),
        };
        PackedJoint { arm_a: joint.frame.arm_a, arm_b: joint.frame.arm_b, rest: joint.rest, place, section }
    }

    fn find(&mut self, section: JointSection) -> u32 {
        let last = self.known.entry(section.hash()).or_insert(NONE);
        let mut at = *last;
        while at != NONE {
            if self.all[at as usize].is(&section) {
                return at;
            }
            at = self.before[at as usize];
        }
        self.before.push(std::mem::replace(last, self.all.len() as u32));
        self.all.push(section);
        (self.all.len() - 1) as u32
    }
}

impl JointSection {
    /// True for one that has the same bits.
    fn is(&self, other: &Self) -> bool {
        let same = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits());
        let expansion = |e: Option<(usize, f64)>| e.map(|(group, length)| (group, length.to_bits()));
        same(&self.stiffness.0, &other.stiffness.0)
            && same(self.axis.as_slice(), other.axis.as_slice())
            && same(&self.second, &other.second)
            && expansion(self.expansion) == expansion(other.expansion)
            && self.locked == other.locked
    }

    /// A hash that distinguishes most sections.
    fn hash(&self) -> u64 {
        let [uu, ug, _, gg, gp, pp] = self.stiffness.0;
        let length = self.expansion.map_or(0.0, |(group, length)| length * (group + 1) as f64);
        let mix = |hash: u64, x: f64| (hash.rotate_left(23) ^ x.to_bits()).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        [uu, ug, gg, gp, pp, self.axis.x, self.axis.y, length].into_iter().fold(0, mix)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A stored joint takes 56 bytes; joints of one beam share a section, and each can be had back as it was given.
    #[test]
    fn small_and_whole() {
        assert_eq!(size_of::<PackedJoint>(), 56);
        let axis = Vector2::new(0.6, 0.8);
        let joint = |rest: f64, gp: f64| Joint {
            a: BodyId::Ground,
            b: BodyId::Free(3),
            frame: JointFrame { arm_a: Vector2::new(rest, 1.0), arm_b: Vector2::new(2.0, rest), axis },
            stiffness: Matrix3::new(5.0, 0.0, 0.0, 0.0, 4.0, gp, 0.0, gp, 3.0),
            second: Matrix2::new(0.1, 0.2, 0.2, 0.3),
            expansion: Some((1, 2e-6)),
            rest,
            locked: [false, true, false],
        };
        let given = [joint(1.0, 0.5), joint(2.0, 0.5), joint(3.0, 0.7), joint(4.0, 0.5)];
        let mut sections = Sections::new(4);
        let place = PairSlot { a: NONE, b: 3, block: NONE };
        let laid: Vec<PackedJoint> = given.iter().map(|joint| sections.lay(joint, place)).collect();
        assert_eq!(laid.iter().map(PackedJoint::section).collect::<Vec<_>>(), [0, 0, 1, 0]);
        for (joint, laid) in given.iter().zip(&laid) {
            assert_eq!(laid.whole(&sections.all[laid.section()]), *joint);
        }
    }
}
