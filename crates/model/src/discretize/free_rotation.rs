//! Rotations that no element of the drawing uses, and that are no unknowns therefore: pins.
//!
//! A body without inertia whose joints all meet in one point and resist no rotation (a node that only pinned bars, springs without a
//! rotational stiffness or hinges hold) has a zero row in every stiffness, damping and mass matrix. Its rotation is held as drawn
//! in every analysis, which changes no other displacement. A moment on such a node, a damper of its rotation, or anything
//! that acts away from the point keeps the rotation as an unknown. Springs of different stiffness along x and y have a frame that turns with the
//! mean of both ends; a held end counts as not turned.

use super::rigid::RigidGroups;
use bimorph_domains::{Domain, Member, PlacedMember};
use bimorph_multibody::planar::JointFrame;
use bimorph_multibody::{BodyId, Damper, Joint};
use bimorph_structure::Structure;
use nalgebra::Vector2;

/// Distance below which two points of a body are one, as a fraction of the size of the drawing (1): coordinates are sums of rounded lengths.
const POINT_TOLERANCE: f64 = 1e-9;

/// Elements that use the rotation of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
enum RotationUse {
    /// Nothing acts on the body yet.
    Unknown,
    /// Everything so far acts on this point, given from the reference point (m).
    About(Vector2<f64>),
    /// Something resists the rotation or acts on it.
    Used,
}

/// Elements acting on the bodies of a model under construction.
pub(super) struct BodyActions<'a> {
    pub(super) structure: &'a Structure,
    pub(super) joints: &'a [Joint],
    pub(super) dampers: &'a [Damper],
    pub(super) members: &'a [PlacedMember<'a, Member>],
    /// Ends of beam elements that are no joints.
    pub(super) elements: &'a [BodyId],
}

/// Holds the rotations that nothing uses.
pub(super) fn hold(acting: &BodyActions<'_>, rigid: &mut RigidGroups) {
    let same = POINT_TOLERANCE * acting.structure.extent();
    let mut rotations = vec![RotationUse::Unknown; rigid.bodies.len()];
    let mut see = |id: BodyId, at: Option<Vector2<f64>>| {
        let BodyId::Free(k) = id else { return };
        rotations[k] = match (rotations[k], at) {
            (RotationUse::Unknown, Some(point)) => RotationUse::About(point),
            (RotationUse::About(one), Some(other)) if (one - other).norm() <= same => RotationUse::About(one),
            _ => RotationUse::Used,
        };
    };
    acting.elements.iter().for_each(|body| see(*body, None));
    for joint in acting.joints {
        let k = &joint.stiffness;
        let turns = [k[(2, 2)], k[(0, 2)], k[(1, 2)], joint.rest].iter().any(|k| *k != 0.0)
            || joint.expansion.is_some()
            || joint.second.iter().any(|q| *q != 0.0)
            || joint.locked[2];
        see_pair(&mut see, (joint.a, joint.b), &joint.frame, turns);
    }
    for damper in acting.dampers {
        see_pair(&mut see, (damper.a, damper.b), &damper.frame, damper.coefficients.z != 0.0);
    }
    let structure = acting.structure;
    for load in &structure.loads {
        let point = rigid.point(load.node.0);
        see(point.body, (load.moment == 0.0).then_some(point.arm));
    }
    for mass in &structure.masses {
        let point = rigid.point(mass.node.0);
        see(point.body, (mass.inertia == 0.0 && mass.drag[1] == 0.0).then_some(point.arm));
    }
    for support in &structure.supports {
        let point = rigid.point(support.node.0);
        see(point.body, (!support.held[2]).then_some(point.arm));
    }
    // fields and stops act on points that they alone know; dashpots act by their dampers
    acting.members.iter().for_each(|laid| laid.member.bodies(|body| see(body, None)));
    for (k, body) in rigid.bodies.iter().enumerate() {
        body.lumps_act(same, |at| see(BodyId::Free(k), at));
    }
    for (body, rotation) in rigid.bodies.iter_mut().zip(rotations) {
        if matches!(rotation, RotationUse::About(_)) {
            body.hold_rotation();
        }
    }
}

fn see_pair(
    see: &mut impl FnMut(BodyId, Option<Vector2<f64>>),
    (a, b): (BodyId, BodyId),
    frame: &JointFrame,
    turns: bool,
) {
    see(a, (!turns).then_some(frame.arm_a));
    see(b, (!turns).then_some(frame.arm_b));
}
