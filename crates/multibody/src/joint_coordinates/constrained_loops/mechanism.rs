//! A mechanism as the recursion reads it: what its bodies, joints and closures are, over lanes of variants, and the schedule.
//!
//! It is constant after [`MechanismConstants::new`], so that all users of one mechanism share it.

use super::schedule::{Plan, Schedule};
use super::tree::{Closure, Linkage, LinkageBody};
use crate::Joint;
use crate::joint_coordinates::TreeParent;
use crate::planar::Vec2;
use crate::scalar::StoredReal;

/// Constant data of a mechanism.
#[derive(Debug)]
pub(super) struct MechanismConstants<T> {
    pub schedule: Schedule,
    /// One a body, in elimination order.
    pub inertias: Vec<LaneInertia<T>>,
    /// One a body.
    pub arms: Vec<Arms<T>>,
    /// One a body, see [`super::LinkageBody::sign`].
    pub signs: Vec<T>,
    /// One for each body on a joint that is no pin.
    pub joints: Vec<JointShape<T>>,
    /// One a loop closure.
    pub closures: Vec<ClosureShape<T>>,
    /// Unit of each coordinate, which makes it a length (m, or m/m).
    pub units: Vec<T>,
    /// Length that converts a rotation of each body to a displacement (m).
    pub levers: Vec<T>,
    /// Loop constraints m.
    pub constraints: usize,
}

/// Inertia of one body over lanes.
#[derive(Debug, Clone, Copy)]
pub(super) struct LaneInertia<T> {
    /// (kg)
    pub mass: T,
    /// About the centre of mass (kg·m²).
    pub moment: T,
}

/// From the centres of mass of a link's parent and of itself to their joint, as drawn (m), over lanes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Arms<T> {
    pub arm_parent: Vec2<T>,
    pub arm: Vec2<T>,
}

/// Data of joints other than pins.
#[derive(Debug, Clone, Copy)]
pub(super) struct JointShape<T> {
    /// Its axial direction, as drawn.
    pub axis: Vec2<T>,
    /// Second-order axial strain Q: gg, gp, pp.
    pub second: [T; 3],
    /// Directions that move.
    pub moving: [bool; 3],
    /// No joint at all: the body moves freely.
    pub free: bool,
}

/// Geometry of a closure over lanes.
#[derive(Debug, Clone)]
pub(super) struct ClosureShape<T> {
    /// From the centres of mass of its two bodies to the joint, as drawn (m).
    pub arm_a: Vec2<T>,
    pub arm_b: Vec2<T>,
    /// Its axial direction, as drawn.
    pub axis: Vec2<T>,
    /// Second-order axial strain Q: gg, gp, pp.
    pub second: [T; 3],
    /// Length that converts a rotation to a displacement (m).
    pub lever: T,
    /// Directions of a body that supports hold; none of a joint.
    pub held: Vec<[T; 3]>,
    /// Directions of the joint that are constraints.
    pub locked: [bool; 3],
    /// Two material points coincide, whatever the turn between the bodies.
    pub pin: bool,
}

impl<T: StoredReal> MechanismConstants<T> {
    /// Builds one variant per lane; all have the same tree and loops. Fewer variants than lanes are repeated.
    pub(super) fn new(variants: &[&Linkage], plan: Plan) -> Self {
        let linkage = variants[0];
        let count = linkage.links.len();
        let of = |b: usize| variants.iter().map(|v| &v.links[b]).collect::<Vec<_>>();
        let closures = (0..linkage.closures.len()).map(|c| {
            let of = variants.iter().map(|v| (&v.closures[c], v.links[v.closures[c].bodies().0].lever));
            ClosureShape::new(&of.collect::<Vec<_>>())
        });
        let mut units = vec![T::ONE; linkage.coordinates];
        for (b, link) in linkage.links.iter().enumerate().filter(|(_, link)| link.moving[2]) {
            units[link.first + link.freedom() - 1] = lane(&of(b), &|link| link.lever);
        }
        Self {
            schedule: Schedule::new(linkage, plan),
            inertias: (0..count).map(|b| LaneInertia::new(&of(b))).collect(),
            arms: (0..count).map(|b| Arms::new(&of(b))).collect(),
            signs: (0..count).map(|b| lane(&of(b), &|link| link.sign)).collect(),
            joints: (0..count).filter(|&b| !linkage.links[b].pin).map(|b| JointShape::new(&of(b))).collect(),
            closures: closures.collect(),
            units,
            levers: (0..count).map(|b| lane(&of(b), &|link| link.lever)).collect(),
            constraints: linkage.constraints,
        }
    }

    /// Number of bodies.
    pub(super) fn bodies(&self) -> usize {
        self.inertias.len()
    }
}

/// One lane with a number of each variant.
pub(super) fn lane<T: StoredReal>(of: &[&LinkageBody], f: &dyn Fn(&LinkageBody) -> f64) -> T {
    let mut out = T::ZERO;
    for k in 0..T::LANES {
        out.set_lane(k, f(of[k % of.len()]));
    }
    out
}

impl<T: StoredReal> JointShape<T> {
    fn new(of: &[&LinkageBody]) -> Self {
        let lane = |f: &dyn Fn(&LinkageBody) -> f64| lane(of, f);
        Self {
            axis: [lane(&|l| l.frame.axis.x), lane(&|l| l.frame.axis.y)],
            second: [lane(&|l| l.second[(0, 0)]), lane(&|l| l.second[(0, 1)]), lane(&|l| l.second[(1, 1)])],
            moving: of[0].moving,
            free: of[0].parent == TreeParent::Free,
        }
    }
}

impl<T: StoredReal> LaneInertia<T> {
    fn new(of: &[&LinkageBody]) -> Self {
        Self { mass: lane(of, &|l| l.mass), moment: lane(of, &|l| l.inertia) }
    }
}

impl<T: StoredReal> Arms<T> {
    fn new(of: &[&LinkageBody]) -> Self {
        let lane = |f: &dyn Fn(&LinkageBody) -> f64| lane(of, f);
        Self {
            arm_parent: [lane(&|l| l.frame.arm_a.x), lane(&|l| l.frame.arm_a.y)],
            arm: [lane(&|l| l.frame.arm_b.x), lane(&|l| l.frame.arm_b.y)],
        }
    }
}

impl<T: StoredReal> ClosureShape<T> {
    fn new(of: &[(&Closure, f64)]) -> Self {
        let lane = |f: &dyn Fn(&Closure, f64) -> f64| {
            let mut out = T::ZERO;
            for k in 0..T::LANES {
                let (closure, lever) = of[k % of.len()];
                out.set_lane(k, f(closure, lever));
            }
            out
        };
        let joint = |f: &dyn Fn(&Joint) -> f64| {
            lane(&|c, _| match c {
                Closure::Joint(j) => f(j),
                Closure::Held { .. } => 0.0,
            })
        };
        let (locked, count) = match of[0].0 {
            Closure::Joint(j) => (j.locked, 0),
            Closure::Held { rows, .. } => ([false; 3], rows.len()),
        };
        let held = (0..count)
            .map(|r| {
                [0, 1, 2].map(|i| {
                    lane(&|c, lever| match c {
                        // a row that only turns gets the unit of the others
                        Closure::Held { rows, .. } if rows[r].xy().norm() < 0.5 => rows[r][i] * lever,
                        Closure::Held { rows, .. } => rows[r][i],
                        Closure::Joint(_) => 0.0,
                    })
                })
            })
            .collect();
        Self {
            arm_a: [joint(&|j| j.frame.arm_a.x), joint(&|j| j.frame.arm_a.y)],
            arm_b: [joint(&|j| j.frame.arm_b.x), joint(&|j| j.frame.arm_b.y)],
            axis: [joint(&|j| j.frame.axis.x), joint(&|j| j.frame.axis.y)],
            second: [joint(&|j| j.second[(0, 0)]), joint(&|j| j.second[(0, 1)]), joint(&|j| j.second[(1, 1)])],
            lever: lane(&|_, lever| lever),
            held,
            locked,
            pin: of.iter().all(|(closure, _)| closure.is_pin()),
        }
    }
}
