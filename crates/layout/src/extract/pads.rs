//! Held areas with the nodes on them, as targets of labels.

use super::model::{Builder, PartPad};
use bimorph_base::sets::Sets;
use std::collections::BTreeMap;
use std::ops::Range;

/// A stretch of a limb as fractions of its length, with nodes on it.
pub(super) type AnchoredStretch = ([f64; 2], Vec<usize>);

impl Builder<'_> {
    /// Adds the pad of a joint: the anchored ones of the nodes made for it, and its whole area.
    pub(super) fn joint_pad(&mut self, j: usize, made: Range<usize>) {
        let held: Vec<usize> = made.filter(|n| self.anchored[*n]).collect();
        if held.is_empty() {
            return;
        }
        let (axis, origin) = (self.axis, self.origin);
        let cells = self.parts.joints[j].edges.iter().map(|e| {
            let edge = &axis.edges[*e as usize];
            axis.outline(edge.ends, edge.sites).map(|p| [p[0] + origin[0], p[1] + origin[1]]).to_vec()
        });
        self.pad_of[j] = Some(self.model.pads.len());
        self.model.pads.push(PartPad { nodes: held, outlines: cells.collect() });
    }

    /// The held stretches of a limb between two nodes, with those of the nodes that are anchored.
    pub(super) fn held(&self, covered: &[[f64; 2]], a: usize, b: usize) -> Vec<AnchoredStretch> {
        let ends = |t: &[f64; 2]| {
            let ends = [(t[0] == 0.0, a), (t[1] == 1.0, b)];
            ends.into_iter().filter(|(there, n)| *there && self.anchored[*n]).map(|(_, n)| n).collect()
        };
        covered.iter().map(|t| (*t, ends(t))).collect()
    }

    /// Makes pads of what is held of limb `k`, whose centreline goes from `p` to `q`.
    pub(super) fn stretches(&mut self, k: usize, [p, q]: [[f64; 2]; 2], held: Vec<AnchoredStretch>) {
        let limb = &self.parts.limbs[k];
        let long = (q[0] - p[0]).hypot(q[1] - p[1]);
        let n = [-(q[1] - p[1]) / long, (q[0] - p[0]) / long];
        let corner = |t: f64, s: f64| {
            let across = s * (limb.width[0] + t * (limb.width[1] - limb.width[0]));
            [0, 1].map(|i| p[i] + t * (q[i] - p[i]) + across * n[i])
        };
        let joints = self.parts.at[k];
        for ([t0, t1], nodes) in held {
            let outline = vec![corner(t0, -0.5), corner(t1, -0.5), corner(t1, 0.5), corner(t0, 0.5)];
            let reached = [(t0 == 0.0, joints[0]), (t1 == 1.0, joints[1])];
            let pad = self.model.pads.len();
            self.adjoining.extend(reached.into_iter().filter(|(there, _)| *there).map(|(_, joint)| (joint, pad)));
            self.model.pads.push(PartPad { nodes, outlines: vec![outline] });
        }
    }

    /// Makes one pad of those that adjoin or share a node.
    pub(super) fn join_pads(&mut self) {
        let mut sets = Sets::new(self.model.pads.len());
        for (joint, pad) in &self.adjoining {
            sets.join(*self.pad_of[*joint].get_or_insert(*pad), *pad);
        }
        let mut of_node = vec![None; self.model.nodes.len()];
        for (k, pad) in self.model.pads.iter().enumerate() {
            pad.nodes.iter().for_each(|n| {
                sets.join(*of_node[*n].get_or_insert(k), k);
            });
        }
        let mut joined: BTreeMap<usize, PartPad> = BTreeMap::new();
        for (k, pad) in std::mem::take(&mut self.model.pads).into_iter().enumerate() {
            let whole = joined.entry(sets.first(k)).or_default();
            whole.nodes.extend(pad.nodes);
            whole.outlines.extend(pad.outlines);
        }
        self.model.pads = joined.into_values().collect();
        for pad in &mut self.model.pads {
            pad.nodes.sort_unstable();
            pad.nodes.dedup();
        }
    }
}
