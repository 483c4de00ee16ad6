//! The spanning tree of a body graph: the joint of each body to its parent.
//!
//! The tree follows the elimination order of the graph, which [`crate::order`] computes leaf → root. A body's parent is ground or a
//! body that is eliminated later. A body whose neighbours are all eliminated before it (the shuttle of a bank) is a root that
//! moves freely. Of the joints of a body, the tree takes the one with the most locked directions, then the one that moves most
//! bodies together. The others close loops.

use crate::planar::JointFrame;
use crate::{BodyId, Joint, Model};
use nalgebra::Vector2;

/// Parent of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TreeParent {
    /// A joint to ground.
    Ground,
    /// A joint to a body that is eliminated later.
    Body(u32),
    /// Nothing: its own displacement and rotation are its coordinates.
    Free,
}

/// The joints of a model by the body that is eliminated first.
pub(super) struct JointsOfBodies {
    /// Joints in the order of the model.
    pub(super) all: Vec<Joint>,
    /// For each body the joints to ground and to bodies that are eliminated later.
    pub(super) of: Vec<Vec<usize>>,
}

impl JointsOfBodies {
    /// Those of `model`; joints of a body with itself, and of ground with itself, are left out.
    pub(super) fn new(model: &Model) -> Self {
        let mut of: Vec<Vec<usize>> = vec![Vec::new(); model.bodies.len()];
        let all: Vec<Joint> = (0..model.joints.len()).map(|k| model.joint(k)).collect();
        for (k, joint) in all.iter().enumerate() {
            match (joint.a, joint.b) {
                (BodyId::Free(a), BodyId::Free(b)) if a != b => of[a.min(b)].push(k),
                (BodyId::Free(a), BodyId::Ground) | (BodyId::Ground, BodyId::Free(a)) => of[a].push(k),
                _ => {}
            }
        }
        Self { all, of }
    }

    /// The joint of `body` in the tree: fewest coordinates, fewest constraints. `locked` gives the locked directions of a joint.
    pub(super) fn to_parent(&self, body: usize, locked: impl Fn(usize) -> [bool; 3]) -> Option<usize> {
        self.of[body].iter().copied().min_by_key(|&k| {
            let moving = locked(k).iter().filter(|&&l| !l).count();
            let other = match if self.all[k].a == BodyId::Free(body) { self.all[k].b } else { self.all[k].a } {
                BodyId::Free(b) => b,
                BodyId::Ground => usize::MAX,
            };
            (moving, other)
        })
    }
}

/// How a body is attached to its parent.
pub(super) struct Attachment {
    pub(super) parent: TreeParent,
    /// Geometry of the joint, `a` the parent and `b` the body.
    pub(super) frame: JointFrame,
    /// −1 where the joint counts its strains from the body to the parent.
    pub(super) sign: f64,
}

impl Attachment {
    /// No joint: the body moves freely.
    pub(super) fn free() -> Self {
        let frame = JointFrame { arm_a: Vector2::zeros(), arm_b: Vector2::zeros(), axis: Vector2::x() };
        Self { parent: TreeParent::Free, frame, sign: 1.0 }
    }

    /// The body that `joint` connects to `body` becomes its parent.
    pub(super) fn by(joint: &Joint, body: usize) -> Self {
        let JointFrame { arm_a, arm_b, axis } = joint.frame;
        let (parent, frame, sign) = if joint.a == BodyId::Free(body) {
            (joint.b, JointFrame { arm_a: arm_b, arm_b: arm_a, axis }, -1.0)
        } else {
            (joint.a, joint.frame, 1.0)
        };
        let parent = match parent {
            BodyId::Ground => TreeParent::Ground,
            BodyId::Free(p) => TreeParent::Body(p as u32),
        };
        Self { parent, frame, sign }
    }
}
