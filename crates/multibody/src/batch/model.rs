//! Bodies and joints of a batch of variants.

use super::joint::LaneSection;
use super::{BLANK, Lane8, LaneBlock, LanePose, SimdReal, ZERO_POSE, load};
use crate::planar::{Block, Vec2};
use crate::scalar::{Real, StoredReal};
use crate::section::{JointSection, PackedJoint, PairSlot};
use crate::{Body, BodyId, Model, Pattern};
use nalgebra::Matrix3;
use std::sync::Arc;

/// A body in each variant.
#[derive(Debug, Clone, Copy)]
pub struct LaneBody<T = Lane8> {
    /// Mass (kg) and moment of inertia (kg·m²), as the mass matrix' diagonal.
    pub mass: LanePose<T>,
    /// Drag on translation (N·s/m).
    pub drag: T,
    /// Its first moment (N·s).
    pub first: Vec2<T>,
    /// Its second moment (N·m·s).
    pub second: T,
}

/// A joint in each variant.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LaneJoint {
    pub(crate) place: PairSlot,
    pub(crate) section: u32,
    pub(crate) arm_a: Vec2<Lane8>,
    pub(crate) arm_b: Vec2<Lane8>,
    pub(crate) rest: Lane8,
}

/// Properties and elongations shared by joints.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SharedSections {
    pub(crate) section: LaneSection,
    pub(crate) expansion: Option<(usize, Lane8)>,
}

/// Two joints whose moments depend on both rotations.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LaneCoupling {
    pub(crate) first: (BodyId, BodyId),
    pub(crate) second: (BodyId, BodyId),
    pub(crate) stiffness: Lane8,
}

/// A damper.
#[derive(Debug, Clone)]
pub struct LaneDamper {
    pub(crate) bodies: (BodyId, BodyId),
    pub(crate) place: PairSlot,
    /// Rows.
    pub(crate) matrix: [[Lane8; 6]; 6],
}

/// A projector onto what a support leaves free, and the rest of the identity.
pub(crate) type SupportProjector = Option<(LaneBlock, LaneBlock)>;

/// Models of as many variants as there are lanes.
#[derive(Debug, Clone)]
pub struct LaneModel {
    /// Pattern of the tangent.
    pub pattern: Arc<Pattern>,
    /// Bodies in elimination order.
    pub bodies: Vec<LaneBody>,
    pub(crate) joints: Vec<LaneJoint>,
    pub(crate) sections: Vec<SharedSections>,
    pub(crate) couplings: Vec<LaneCoupling>,
    /// Dampers.
    pub dampers: Vec<LaneDamper>,
    /// Bodies with a projector, and their projectors.
    pub held: Vec<SupportProjector>,
    /// Whether any lane has a projector.
    pub holds: bool,
}

impl LaneModel {
    /// Every lane holds `model`; none for a linear one, which has no lanes.
    pub fn new(model: &Model) -> Option<Self> {
        if model.linear {
            return None;
        }
        let none = Lane8::NONE;
        let body = LaneBody { mass: ZERO_POSE, drag: none, first: [none; 2], second: none };
        let section = LaneSection::NONE;
        let joint = |j: &PackedJoint| LaneJoint {
            place: j.place,
            section: j.section() as u32,
            arm_a: [none; 2],
            arm_b: [none; 2],
            rest: none,
        };
        let expansion = |s: &JointSection| s.expansion.map(|(group, _)| (group, none));
        let mut laid = Self {
            pattern: model.pattern.clone(),
            bodies: vec![body; model.bodies.len()],
            joints: model.joints.iter().map(joint).collect(),
            sections: model.sections.iter().map(|s| SharedSections { section, expansion: expansion(s) }).collect(),
            couplings: (model.couplings.iter())
                .map(|c| LaneCoupling { first: c.first, second: c.second, stiffness: none })
                .collect(),
            dampers: (model.dampers.iter().zip(&model.damper_place))
                .map(|(d, place)| LaneDamper { bodies: (d.a, d.b), place: *place, matrix: [[none; 6]; 6] })
                .collect(),
            held: model.bodies.iter().map(|b| b.free.as_ref().map(|_| (BLANK, BLANK))).collect(),
            holds: model.bodies.iter().any(|b| b.free.is_some()),
        };
        for lane in 0..super::LANES {
            laid.set_lane(lane, model);
        }
        Some(laid)
    }

    /// True for a model that differs from those in the batch in numbers alone.
    pub fn fits(&self, model: &Model) -> bool {
        let bodies = |(held, body): (&SupportProjector, &Body)| held.is_some() == body.free.is_some();
        // joints of one section here must be alike in the other model too
        let mut others = vec![u32::MAX; self.sections.len()];
        let joints = |(own, other): (&LaneJoint, &PackedJoint)| {
            let known = &mut others[own.section as usize];
            let section = other.section() as u32;
            let alike = *known == section || *known == u32::MAX;
            *known = section;
            let group = |e: Option<usize>| e.unwrap_or(usize::MAX);
            let own_group = self.sections[own.section as usize].expansion.map(|(g, _)| g);
            let other_group = model.section(other).expansion.map(|(g, _)| g);
            alike && own.place == other.place && group(own_group) == group(other_group)
        };
        !model.linear
            && self.bodies.len() == model.bodies.len()
            && self.joints.len() == model.joints.len()
            && self.dampers.len() == model.dampers.len()
            && self.couplings.len() == model.couplings.len()
            && self.pattern == model.pattern
            && self.held.iter().zip(&model.bodies).all(bodies)
            && self.joints.iter().zip(&model.joints).all(joints)
            && self.dampers.iter().zip(&model.dampers).all(|(a, b)| a.bodies == (b.a, b.b))
            && self.couplings.iter().zip(&model.couplings).all(|(a, b)| (a.first, a.second) == (b.first, b.second))
    }

    /// Puts the numbers of a model that fits into one lane.
    pub fn set_lane(&mut self, lane: usize, model: &Model) {
        for (to, from) in self.bodies.iter_mut().zip(&model.bodies) {
            set(lane, &mut to.mass, from.mass_diagonal().as_slice());
            to.drag.set_lane(lane, from.drag.amount);
            set(lane, &mut to.first, from.drag.first.as_slice());
            to.second.set_lane(lane, from.drag.second);
        }
        for (to, from) in self.joints.iter_mut().zip(&model.joints) {
            set(lane, &mut to.arm_a, from.arm_a.as_slice());
            set(lane, &mut to.arm_b, from.arm_b.as_slice());
            to.rest.set_lane(lane, from.rest);
            let section = model.section(from);
            let shared = &mut self.sections[to.section as usize];
            set(lane, &mut shared.section.axis, section.axis.as_slice());
            set(lane, &mut shared.section.stiffness.0, &section.stiffness.0);
            set(lane, &mut shared.section.second, &section.second);
            if let (Some((_, to)), Some((_, length))) = (&mut shared.expansion, section.expansion) {
                to.set_lane(lane, length);
            }
        }
        for (to, from) in self.couplings.iter_mut().zip(&model.couplings) {
            to.stiffness.set_lane(lane, from.stiffness);
        }
        for (to, from) in self.dampers.iter_mut().zip(&model.damper_matrix) {
            for (i, row) in to.matrix.iter_mut().enumerate() {
                for (j, to) in row.iter_mut().enumerate() {
                    to.set_lane(lane, from[(i, j)]);
                }
            }
        }
        for (to, from) in self.held.iter_mut().zip(&model.bodies) {
            if let (Some((p, rest)), Some(free)) = (to, &from.free) {
                put_block(lane, p, free);
                put_block(lane, rest, &(Matrix3::identity() - **free));
            }
        }
    }
}

fn set(lane: usize, to: &mut [Lane8], from: &[f64]) {
    for (to, from) in to.iter_mut().zip(from) {
        to.set_lane(lane, *from);
    }
}

fn put_block(lane: usize, to: &mut LaneBlock, from: &Block) {
    for (j, column) in to.iter_mut().enumerate() {
        set(lane, column, from.column(j).as_slice());
    }
}

impl LaneBody {
    /// From memory.
    #[inline(always)]
    pub fn load<W: SimdReal>(&self, simd: W::Simd) -> LaneBody<W> {
        LaneBody {
            mass: load(simd, &self.mass),
            drag: W::load(simd, &self.drag),
            first: load(simd, &self.first),
            second: W::load(simd, &self.second),
        }
    }
}

impl<T: Real> LaneBody<T> {
    /// Force of the drag at a rate.
    #[inline(always)]
    pub fn drag_force(&self, v: &LanePose<T>) -> LanePose<T> {
        let (c, [sx, sy]) = (self.drag, self.first);
        [c * v[0] - sy * v[2], c * v[1] + sx * v[2], -sy * v[0] + sx * v[1] + self.second * v[2]]
    }
}
