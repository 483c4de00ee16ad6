//! The spanning tree and the loops of a model: relative joint coordinates and closures.
//!
//! The tree is that of `spanning_tree.rs`. A root moves freely and has three coordinates of its own. The
//! joints that are left over close loops.
//!
//! A joint has three directions (axial u, shear g, rotation p, see [`crate::planar`]), each free, elastic or
//! locked. On the tree the directions that are not locked are the n generalized coordinates, with the strains of the joint
//! as their values; a closure's locked directions are the m constraints. The paper's joint types 1–3 lock u and g, its
//! type 4 locks g and p.

use crate::joint_coordinates::TreeParent;
use crate::joint_coordinates::spanning_tree::{Attachment, JointsOfBodies};
use crate::planar::JointFrame;
use crate::{BodyId, Joint, Model, Pattern};
use nalgebra::{Matrix2, Matrix3, Vector3};

/// A body with the joint to its parent.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkageBody {
    /// Its parent.
    pub parent: TreeParent,
    /// Geometry of the joint, `a` the parent and `b` this body.
    pub frame: JointFrame,
    /// −1 where the model's joint counts its strains from this body to the parent.
    pub sign: f64,
    /// It turns about a fixed point of its parent.
    pub pin: bool,
    /// Directions of the joint that move.
    pub moving: [bool; 3],
    /// Index of its first coordinate.
    pub first: usize,
    /// Elastic stiffness over the three directions.
    pub stiffness: Matrix3<f64>,
    /// Second-order axial strain Q.
    pub second: Matrix2<f64>,
    /// Group and length of the heated joint.
    pub expansion: Option<(usize, f64)>,
    /// Built-in axial rest offset (m).
    pub rest: f64,
    /// Mass (kg).
    pub mass: f64,
    /// Moment of inertia (kg·m²).
    pub inertia: f64,
    /// Lever that makes a rotation comparable with a displacement (m).
    pub lever: f64,
}

impl LinkageBody {
    /// `body` on the joint to its parent, or free.
    fn new(body: usize, joint: Option<&Joint>) -> Self {
        let Attachment { parent, frame, sign } =
            joint.map_or_else(Attachment::free, |joint| Attachment::by(joint, body));
        Self {
            parent,
            frame,
            sign,
            pin: false,
            moving: joint.map_or([true; 3], |joint| joint.locked.map(|l| !l)),
            first: 0,
            stiffness: joint.map_or_else(Matrix3::zeros, |joint| joint.stiffness),
            second: joint.map_or_else(Matrix2::zeros, |joint| joint.second),
            expansion: joint.and_then(|joint| joint.expansion),
            rest: joint.map_or(0.0, |joint| joint.rest),
            mass: 0.0,
            inertia: 0.0,
            lever: 0.0,
        }
    }

    /// Number of coordinates.
    #[inline]
    pub fn freedom(&self) -> usize {
        self.moving.iter().filter(|&&m| m).count()
    }

    /// True when it turns about a fixed point of its parent.
    fn turns_about_a_point(&self) -> bool {
        self.moving == [false, false, true]
            && self.rest == 0.0
            && self.expansion.is_none()
            && self.second[(1, 1)] == 0.0
    }
}

/// Element that closes a loop, or holds a body.
#[derive(Debug, Clone, PartialEq)]
pub enum Closure {
    /// A joint between two bodies, or a body and ground; its locked directions are constraints, the others may be elastic.
    Joint(Joint),
    /// Directions of a body that supports hold, as unit rows over (x, y, θ).
    Held {
        /// The body.
        body: usize,
        /// Held directions.
        rows: Vec<Vector3<f64>>,
    },
}

impl Closure {
    /// The bodies it touches, the one that is eliminated first in front.
    #[inline]
    pub fn bodies(&self) -> (usize, Option<usize>) {
        match self {
            Self::Held { body, .. } => (*body, None),
            Self::Joint(joint) => match (joint.a, joint.b) {
                (BodyId::Free(a), BodyId::Free(b)) => (a.min(b), Some(a.max(b))),
                (BodyId::Free(a), BodyId::Ground) | (BodyId::Ground, BodyId::Free(a)) => (a, None),
                (BodyId::Ground, BodyId::Ground) => (0, None),
            },
        }
    }

    /// True for a joint that keeps two material points together and leaves the rotation free.
    #[inline]
    pub fn is_pin(&self) -> bool {
        match self {
            Self::Held { .. } => false,
            Self::Joint(joint) => {
                joint.locked == [true, true, false]
                    && joint.rest == 0.0
                    && joint.expansion.is_none()
                    && joint.second[(1, 1)] == 0.0
            }
        }
    }

    /// Number of constraints.
    #[inline]
    pub fn constraints(&self) -> usize {
        match self {
            Self::Held { rows, .. } => rows.len(),
            Self::Joint(joint) => joint.locked.iter().filter(|&&l| l).count(),
        }
    }
}

/// Tree and loops of a model. Immutable.
#[derive(Debug, Clone)]
pub struct Linkage {
    /// One link per body, in elimination order.
    pub links: Vec<LinkageBody>,
    /// Loop closures, by the body at which they enter the recursion.
    pub closures: Vec<Closure>,
    /// Couplings of the bodies' accelerations, fill included.
    pub pattern: Pattern,
    /// Names of the bodies.
    pub names: Vec<String>,
    /// Generalized coordinates n.
    pub coordinates: usize,
    /// Loop constraints m.
    pub constraints: usize,
}

impl Linkage {
    /// Spans the tree of `model`. Directions are locked where [`Joint::locked`] says so.
    pub fn new(model: &Model) -> Self {
        let count = model.bodies.len();
        let mut lever = vec![0.0f64; count];
        let joints = JointsOfBodies::new(model);
        for joint in joints.of.iter().flatten().map(|&k| &joints.all[k]) {
            for (id, arm) in [(joint.a, joint.frame.arm_a), (joint.b, joint.frame.arm_b)] {
                if let BodyId::Free(b) = id {
                    lever[b] = lever[b].max(arm.norm());
                }
            }
        }
        let far = lever.iter().copied().fold(0.0, f64::max);
        let mut links = Vec::with_capacity(count);
        let mut closures = Vec::new();
        let mut coordinates = 0;
        for (body, of) in joints.of.iter().enumerate() {
            let chosen = joints.to_parent(body, |k| joints.all[k].locked);
            let mut link = LinkageBody::new(body, chosen.map(|k| &joints.all[k]));
            link.pin = link.turns_about_a_point();
            link.first = coordinates;
            link.mass = model.bodies[body].mass;
            link.inertia = model.bodies[body].inertia;
            link.lever = if lever[body] > 0.0 {
                lever[body]
            } else if far > 0.0 {
                far
            } else {
                1.0
            };
            coordinates += link.freedom();
            links.push(link);
            let loops = of.iter().filter(|k| Some(**k) != chosen);
            closures.extend(loops.map(|&k| Closure::Joint(joints.all[k].clone())));
            if let Some(projector) = &model.bodies[body].free {
                closures.push(Closure::Held { body, rows: held_rows(projector) });
            }
        }
        let constraints = closures.iter().map(Closure::constraints).sum();
        Self {
            links,
            closures,
            pattern: Pattern::clone(&model.pattern),
            names: model.bodies.iter().map(|b| b.name.to_string()).collect(),
            coordinates,
            constraints,
        }
    }

    /// The body whose joint has a coordinate.
    #[inline]
    pub fn body_of(&self, coordinate: usize) -> usize {
        self.links.partition_point(|link| link.first <= coordinate).saturating_sub(1)
    }
}

/// Orthonormal rows that span what a projector onto the free directions leaves out.
fn held_rows(projector: &Matrix3<f64>) -> Vec<Vector3<f64>> {
    let mut left = Matrix3::identity() - projector;
    let mut rows = Vec::new();
    for _ in 0..3 {
        let (k, norm) = (0..3).map(|k| (k, left.column(k).norm())).fold((0, 0.0), |a, b| if b.1 > a.1 { b } else { a });
        if norm < 0.1 {
            break;
        }
        let row = left.column(k) / norm;
        left -= row * (row.transpose() * left);
        rows.push(row);
    }
    rows
}
