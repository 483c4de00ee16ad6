//! The spanning tree of a model: parents of bodies, and moving directions of the joints between them.
//!
//! The tree is that of `spanning_tree.rs`. **A closure keeps all its springs**, so that a loop of
//! elastic beams brings no constraint: its springs are one more term of the recursion, as a gap is. The couplings of
//! tree and closures are those of the graph, and so the pattern of the factor is that of the model in absolute
//! coordinates.
//!
//! Coordinates are the strains of the joints, (e_u, g, p) of [`planar`](crate::planar), in one slot of three for
//! each body; a locked direction keeps its slot, with the value 0. The slot of a root holds its displacement and rotation.

use super::kinematics::JointGeometry;
use crate::batch::{LANES, Lane8};
use crate::joint_coordinates::TreeParent;
use crate::joint_coordinates::spanning_tree::{Attachment, JointsOfBodies};
use crate::planar::{Block, JointFrame, Pose, Symmetric};
use crate::section::PackedJoint;
use crate::{Body, BodyId, Joint, Model, Pattern};
use nalgebra::Vector2;
use thiserror::Error;

/// Directions (u, g, p) of a joint that are coordinates.
pub type FreeDirections = [bool; 3];

/// A body's joint to its parent.
#[derive(Debug, Clone, PartialEq)]
pub struct TreeJoint {
    /// Its parent.
    pub parent: TreeParent,
    /// −1 where the joint counts its strains from this body to the parent.
    pub sign: f64,
    /// From the parent's centre of mass to the joint, as drawn (m).
    pub arm_parent: Vector2<f64>,
    /// From the body's centre of mass to the joint, as drawn (m).
    pub arm: Vector2<f64>,
    /// Cosine and sine of the drawn angle of the joint's x axis.
    pub axis: Vector2<f64>,
    /// Directions that are coordinates.
    pub moving: FreeDirections,
    /// Stress per strain, zero where a direction is locked.
    pub stiffness: Symmetric,
    /// Q over (g, p) as (gg, gp, pp).
    pub second: [f64; 3],
    /// Group and length of a heated joint.
    pub expansion: Option<(usize, f64)>,
    /// Built-in axial rest offset (m).
    pub rest: f64,
    /// Projector onto the directions that a support leaves free (roots only).
    pub free: Option<Box<Block>>,
}

/// Tree and closures of a model. Immutable.
#[derive(Debug, Clone)]
pub struct Tree {
    /// One link for each body, in elimination order.
    pub links: Vec<TreeJoint>,
    /// The joints that close loops.
    pub closures: Vec<PackedJoint>,
    /// Couplings of the bodies, fill included.
    pub pattern: Pattern,
    /// Coordinates n.
    pub coordinates: usize,
    /// Parent of each body, once more, in a compact array for traversals of the tree.
    pub(super) upward: Vec<Upward>,
    /// The tree's joints, eight per vector: constant data, and springs as (uu, ug, up, gg, gp, pp).
    pub(super) shapes: Vec<JointGeometry<Lane8>>,
    pub(super) springs: Vec<[Lane8; 6]>,
    /// Bodies whose joints have rest offsets.
    pub(super) offset: Vec<u32>,
    /// Those of them whose joints are heated.
    pub heated: Vec<u32>,
}

/// Parent of a body, and the sign of the joint.
#[derive(Debug, Clone, Copy)]
pub(super) struct Upward {
    pub(super) parent: TreeParent,
    pub(super) sign: f64,
}

/// Why a model has no tree whose loops close by springs.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum UnsupportedModel {
    /// Small displacements about the drawn geometry were requested.
    #[error("joint coordinates are not small displacements; leave out --linear or take compliant")]
    Linear,
    /// The displacement or rotation of an anchor is given.
    #[error("an anchor is driven or turned (moves, anchorrz), which joint coordinates do not have; take compliant")]
    DrivenAnchor,
    /// A body rotates without inertia: the residual rotation of a step would leak, with the rotating axes, into
    /// directions with inertia.
    #[error("body \"{body}\" turns without inertia; give it some (J of a lumped mass, --scheme es), or take compliant")]
    NoInertia {
        /// Its name.
        body: String,
    },
    /// A loop closes in a joint that is rigid in some direction.
    #[error(
        "a loop of rigid joints closes at body \"{body}\"; take one of the methods that reduce constraints, or compliant"
    )]
    RigidLoop {
        /// Name of the body at which it closes.
        body: String,
    },
}

impl Tree {
    /// The tree of `model` with everything elastic that is drawn so.
    ///
    /// # Errors
    /// [`UnsupportedModel`].
    pub fn elastic(model: &Model) -> Result<Self, UnsupportedModel> {
        if model.linear {
            return Err(UnsupportedModel::Linear);
        }
        // a supported body keeps its own coordinates
        if let Some(body) = model.bodies.iter().find(|b| b.inertia == 0.0 && b.free.is_none()) {
            return Err(UnsupportedModel::NoInertia { body: body.name.to_string() });
        }
        let tree = Self::new(model, |_| [false; 3]);
        match tree.closures.iter().find(|j| model.section(j).locked != [false; 3]) {
            Some(joint) => {
                let name = |id| match id {
                    BodyId::Free(k) => model.bodies[k].name.to_string(),
                    BodyId::Ground => String::new(),
                };
                let (a, b) = joint.bodies();
                Err(UnsupportedModel::RigidLoop { body: name(if a == BodyId::Ground { b } else { a }) })
            }
            None => Ok(tree),
        }
    }

    /// Spans the tree of `model`. `lock` says of joint `k` (in the order of the model's joints) which directions may be
    /// locked beyond those that are drawn so; they are where the joint goes into the tree.
    pub fn new(model: &Model, lock: impl Fn(usize) -> [bool; 3]) -> Self {
        let joints = JointsOfBodies::new(model);
        let locked = |k: usize| {
            let (drawn, may) = (joints.all[k].locked, lock(k));
            [0, 1, 2].map(|i| drawn[i] || may[i])
        };
        let mut in_tree = vec![false; joints.all.len()];
        let mut link = |(body, of): (usize, &Body)| {
            // supports hold directions of the plane, not of a joint: such a body keeps its own coordinates
            let chosen = if of.free.is_some() { None } else { joints.to_parent(body, locked) };
            let Some(k) = chosen else { return root(of.free.clone()) };
            in_tree[k] = true;
            attach_to_parent(body, &joints.all[k], locked(k).map(|l| !l))
        };
        let links = model.bodies.iter().enumerate().map(&mut link).collect();
        let left = model.joints.iter().zip(&in_tree).filter(|(_, in_tree)| !**in_tree);
        let closures = left.map(|(joint, _)| *joint).collect();
        Self::laid(links, closures, Pattern::clone(&model.pattern))
    }

    fn laid(links: Vec<TreeJoint>, closures: Vec<PackedJoint>, pattern: Pattern) -> Self {
        let upward = links.iter().map(|link| Upward { parent: link.parent, sign: link.sign }).collect();
        let which =
            |is: fn(&TreeJoint) -> bool| (0..links.len()).filter(|&j| is(&links[j])).map(|j| j as u32).collect();
        let tiles = || links.chunks(LANES);
        Self {
            coordinates: links.iter().map(TreeJoint::freedom).sum(),
            upward,
            shapes: tiles().map(shapes).collect(),
            springs: tiles().map(|links| [0, 1, 2, 3, 4, 5].map(|i| lanes(links, |l| l.stiffness.0[i]))).collect(),
            offset: which(|link| link.rest != 0.0 || link.expansion.is_some()),
            heated: which(|link| link.expansion.is_some()),
            links,
            closures,
            pattern,
        }
    }
}

/// A number of each link.
fn lanes(links: &[TreeJoint], of: impl Fn(&TreeJoint) -> f64) -> Lane8 {
    let mut lanes = Lane8::NONE;
    for (lane, link) in lanes.0.iter_mut().zip(links) {
        *lane = of(link);
    }
    lanes
}

/// Constant data of the joints of up to eight links.
fn shapes(links: &[TreeJoint]) -> JointGeometry<Lane8> {
    let pair = |of: fn(&TreeJoint) -> Vector2<f64>| [lanes(links, |l| of(l).x), lanes(links, |l| of(l).y)];
    JointGeometry {
        sign: lanes(links, |l| l.sign),
        arms: [pair(|l| l.arm_parent), pair(|l| l.arm)],
        axis: pair(|l| l.axis),
        second: [0, 1, 2].map(|i| lanes(links, |l| l.second[i])),
    }
}

impl TreeJoint {
    /// Number of coordinates.
    #[inline]
    pub fn freedom(&self) -> usize {
        match &self.free {
            Some(free) => free.trace().round() as usize,
            None => self.moving.iter().filter(|&&m| m).count(),
        }
    }
}

/// `body` on its joint to its parent.
fn attach_to_parent(body: usize, joint: &Joint, moving: FreeDirections) -> TreeJoint {
    let k = |i: usize, j: usize| if moving[i] && moving[j] { joint.stiffness[(i, j)] } else { 0.0 };
    TreeJoint {
        moving,
        stiffness: Symmetric([k(0, 0), k(0, 1), k(0, 2), k(1, 1), k(1, 2), k(2, 2)]),
        second: [joint.second[(0, 0)], joint.second[(0, 1)], joint.second[(1, 1)]],
        expansion: joint.expansion,
        rest: joint.rest,
        ..bare(Attachment::by(joint, body))
    }
}

fn root(free: Option<Box<Block>>) -> TreeJoint {
    TreeJoint { free, ..bare(Attachment::free()) }
}

/// A joint without springs.
fn bare(Attachment { parent, frame, sign }: Attachment) -> TreeJoint {
    let JointFrame { arm_a: arm_parent, arm_b: arm, axis } = frame;
    TreeJoint {
        parent,
        sign,
        arm_parent,
        arm,
        axis,
        moving: [true; 3],
        stiffness: Symmetric::default(),
        second: [0.0; 3],
        expansion: None,
        rest: 0.0,
        free: None,
    }
}

impl Tree {
    /// Removes from a vector of coordinates what is locked or held.
    #[inline]
    pub fn project(&self, x: &mut [Pose]) {
        for (x, link) in x.iter_mut().zip(&self.links) {
            if let Some(free) = &link.free {
                *x = **free * *x;
            } else if link.moving != [true; 3] {
                for i in 0..3 {
                    if !link.moving[i] {
                        x[i] = 0.0;
                    }
                }
            }
        }
    }
}
