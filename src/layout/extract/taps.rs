//! Where combs and gaps pull at a part: which limb or joint the place belongs to, and the node there.

use super::areas::distance;
use super::boxes::{self, Boxes};
use super::joints::{Kind, Parts};
use super::medial::Medial;
use super::model::Builder;

/// A place on the edge of a part may lie this far outside [database units].
const BESIDE: f64 = 4.0;

/// Where something pulls.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tap {
    /// In coordinates of the part.
    pub(super) at: [f64; 2],
    pub(super) owner: Owner,
    /// On the centreline, not at the end of an arm.
    pub(super) on_axis: bool,
}

/// What a place belongs to, by its index.
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
    pub(super) fn of(axis: &Medial, parts: &Parts) -> Self {
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
        let near = self.boxes.overlapping(&[at.map(|x| x - BESIDE), at.map(|x| x + BESIDE)]);
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

impl Builder<'_> {
    /// What is nearest to a place.
    pub(super) fn tap(&self, place: [f64; 2], on_axis: bool) -> Tap {
        let at = [place[0] - self.origin[0], place[1] - self.origin[1]];
        let mut owner = self.cells.nearest(self.axis, at);
        // the end of a limb is part of it
        if let Owner::Joint(j) = owner
            && let ([port], Kind::Node(_)) = (self.parts.joints[j].ports.as_slice(), &self.parts.joints[j].kind)
        {
            owner = Owner::Limb(port.limb);
        }
        Tap { at, owner, on_axis }
    }

    pub(super) fn tap_joint(&mut self, k: usize, j: usize) {
        let Some(body) = self.bodies[j] else { return };
        let held = self.anchored[body];
        let node = self.node(self.taps[k].at, 0.0, held);
        if !held {
            self.model.links.push([body, node]);
        }
        self.model.taps[k] = node;
        if held && let Some(pad) = self.model.pads.iter_mut().find(|pad| pad.nodes.contains(&body)) {
            pad.nodes.push(node);
        }
    }

    /// A rigid arm from a node to where something pulls.
    pub(super) fn tap_node(&mut self, k: usize, node: usize) {
        if self.taps[k].on_axis {
            self.model.taps[k] = node;
            return;
        }
        let tap = self.node(self.taps[k].at, 0.0, self.anchored[node]);
        if !self.anchored[node] {
            self.model.links.push([node, tap]);
        }
        self.model.taps[k] = tap;
    }
}
