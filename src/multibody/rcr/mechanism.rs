//! A mechanism as the recursion reads it: what its bodies, joints and closures are, over lanes of variants, and the schedule.
//!
//! Nothing of it changes after [`Mechanism::new`], so that all who step one mechanism share it.

use super::closures::ClosureShape;
use super::kinematics::{Arms, Inertia, JointShape, lane};
use super::scalar::Real;
use super::schedule::{Plan, Schedule};
use super::tree::Linkage;

/// What does not move.
#[derive(Debug)]
pub(super) struct Mechanism<T> {
    pub schedule: Schedule,
    /// One a body, in elimination order.
    pub inertias: Vec<Inertia<T>>,
    /// One a body.
    pub arms: Vec<Arms<T>>,
    /// One a body, see [`super::Link::sign`].
    pub signs: Vec<T>,
    /// One for each body on a joint that is no pin.
    pub joints: Vec<JointShape<T>>,
    pub closures: Vec<ClosureShape<T>>,
    /// Unit of each coordinate: what makes it a length [m, or m/m].
    pub units: Vec<T>,
    /// What makes a rotation of each body comparable with a displacement [m].
    pub levers: Vec<T>,
    /// Loop constraints m.
    pub constraints: usize,
}

impl<T: Real> Mechanism<T> {
    /// Lays out one variant per lane; all have the same tree and loops. Fewer variants than lanes are repeated.
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
            inertias: (0..count).map(|b| Inertia::new(&of(b))).collect(),
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
