//! The areas of limbs and joints, found by place.

use super::areas::distance;
use super::boxes::{self, Boxes};
use super::joints::LimbGraph;
use super::medial::Medial;

/// A place on the edge of a part may lie this far outside (database units).
const EDGE_TOLERANCE: f64 = 4.0;

/// Where something pulls.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tap {
    /// In coordinates of the part.
    pub(super) at: [f64; 2],
    pub(super) owner: Owner,
    /// On the centreline, not at the end of an arm.
    pub(super) on_axis: bool,
}

/// Limb or joint that contains a point, by index.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Owner {
    Limb(usize),
    Joint(usize),
}

/// The areas of limbs and joints, found by place.
#[derive(Debug, Default)]
pub(super) struct Cells {
    boxes: Boxes,
    edges: Vec<(u32, Owner)>,
}

impl Cells {
    pub(super) fn of(axis: &Medial, parts: &LimbGraph) -> Self {
        let joints = parts
            .joints
            .iter()
            .enumerate()
            .flat_map(|(j, joint)| joint.edges.iter().map(move |e| (*e, Owner::Joint(j))));
        let limbs =
            parts.limbs.iter().enumerate().flat_map(|(k, limb)| limb.edges.iter().map(move |e| (*e, Owner::Limb(k))));
        let edges: Vec<_> = joints.chain(limbs).collect();
        let outline = |e: u32| axis.outline(axis.edges[e as usize].ends, axis.edges[e as usize].sites);
        let extents: Vec<_> = edges.iter().map(|(e, _)| boxes::around(outline(*e))).collect();
        Self { boxes: Boxes::of(&extents), edges }
    }

    /// Whose area is nearest to a place on the part or at its edge.
    pub(super) fn nearest(&self, axis: &Medial, at: [f64; 2]) -> Owner {
        let near = self.boxes.overlapping(&[at.map(|x| x - EDGE_TOLERANCE), at.map(|x| x + EDGE_TOLERANCE)]);
        let all = 0..self.edges.len() as u32;
        let near: Vec<u32> = if near.is_empty() { all.collect() } else { near };
        let away = |k: &u32| {
            let edge = &axis.edges[self.edges[*k as usize].0 as usize];
            distance(&axis.outline(edge.ends, edge.sites), at)
        };
        let found = near.iter().min_by(|a, b| away(a).total_cmp(&away(b)).then(a.cmp(b)));
        found.map_or(Owner::Joint(0), |k| self.edges[*k as usize].1)
    }
}
