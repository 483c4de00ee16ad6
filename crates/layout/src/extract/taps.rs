//! Where combs and gaps pull at a part: which limb or joint the place belongs to, and the node there.

use super::cells::{Owner, Tap};
use super::joints::JointRole;
use super::model::Builder;

impl Builder<'_> {
    /// The limb or joint nearest to a point.
    pub(super) fn tap(&self, place: [f64; 2], on_axis: bool) -> Tap {
        let at = [place[0] - self.origin[0], place[1] - self.origin[1]];
        let mut owner = self.cells.nearest(self.axis, at);
        // the end of a limb is part of it
        if let Owner::Joint(j) = owner
            && let ([port], JointRole::Node(_)) = (self.parts.joints[j].ports.as_slice(), &self.parts.joints[j].kind)
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
