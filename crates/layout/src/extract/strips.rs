//! A limb as beams between nodes: less what is held, divided where something pulls.

use super::anchors::AnchorRule;
use super::cells::{Owner, Tap};
use super::joints::JointRole;
use super::model::{Builder, PartBeam};

/// A free end beyond an anchor shorter than this many widths is part of the anchor (1).
const STUMP: f64 = 1.5;
/// Nodes nearer to each other than this many widths are one (1).
const ON_AXIS: f64 = 0.01;

impl Builder<'_> {
    /// A limb between two nodes, less what lies over anchors.
    pub(super) fn limb(&mut self, k: usize, a: usize, b: usize) {
        let limb = &self.parts.limbs[k];
        let [p, q] = [a, b].map(|n| self.model.nodes[n]);
        let long = (q[0] - p[0]).hypot(q[1] - p[1]);
        let loose = |end: usize| {
            let joint = &self.parts.joints[self.parts.at[k][end]];
            joint.ports.len() == 1 && matches!(joint.kind, JointRole::Node(_))
        };
        let covered = match self.rule {
            AnchorRule::Drawn(held) => held.over(p, q),
            AnchorRule::Wide(reach) if limb.width[0].min(limb.width[1]) >= 2.0 * reach => vec![[0.0, 1.0]],
            AnchorRule::Pads if self.parts.limbs.len() == 1 && loose(0) && loose(1) => vec![[0.0, 1.0]],
            _ => Vec::new(),
        };
        let mut held = self.held(&covered, a, b);
        let mut free = Vec::new();
        let mut from = 0.0;
        for [t0, t1] in covered.into_iter().chain([[1.0, 1.0]]) {
            if (t0 - from) * long > 1e-6 * long {
                free.push([from, t0]);
            }
            from = t1;
        }
        let at = |t: f64| [p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])];
        let width = |t: f64| limb.width[0] + t * (limb.width[1] - limb.width[0]);
        let widest = limb.width[0].max(limb.width[1]);
        let (mut kept, mut free_ends) = (0.0, [false; 2]);
        let porosity = self.porosity(k, [p, q]);
        let (loose_start, loose_end) = (loose(0), loose(1));
        let cut = !(free.len() == 1 && free[0] == [0.0, 1.0]);
        let origin = self.origin;
        let local = |t: f64| [at(t)[0] - origin[0], at(t)[1] - origin[1]];
        let mut taps: Vec<(f64, usize)> = Vec::new();
        for (tap, Tap { at, .. }) in self.taps.iter().enumerate().filter(|(_, tap)| tap.owner == Owner::Limb(k)) {
            let d = [(q[0] - p[0]) / long, (q[1] - p[1]) / long];
            let along = (at[0] + origin[0] - p[0]) * d[0] + (at[1] + origin[1] - p[1]) * d[1];
            taps.push(((along / long).clamp(0.0, 1.0), tap));
        }
        taps.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for [t0, t1] in free {
            let stump =
                cut && (t0 == 0.0 && loose_start || t1 == 1.0 && loose_end) && (t1 - t0) * long < STUMP * widest;
            if stump {
                continue;
            }
            kept += t1 - t0;
            free_ends = [free_ends[0] || t0 == 0.0, free_ends[1] || t1 == 1.0];
            let start = if t0 == 0.0 { a } else { self.node(local(t0), widest, true) };
            let end = if t1 == 1.0 { b } else { self.node(local(t1), widest, true) };
            for (stretch, nodes) in &mut held {
                nodes.extend((stretch[1] == t0).then_some(start));
                nodes.extend((stretch[0] == t1).then_some(end));
            }
            // nodes along it: (share, node)
            let mut along = vec![(t0, start)];
            for (t, tap) in taps.iter().filter(|(t, _)| *t >= t0 && *t <= t1) {
                let last = along[along.len() - 1];
                let node = if (t - last.0) * long < ON_AXIS * widest {
                    last.1
                } else if (t1 - t) * long < ON_AXIS * widest {
                    end
                } else {
                    let node = self.node(local(*t), widest, false);
                    along.push((*t, node));
                    node
                };
                self.tap_node(*tap, node);
            }
            along.push((t1, end));
            for pair in along.windows(2) {
                let width = [width(pair[0].0), width(pair[1].0)];
                self.model.beams.push(PartBeam { a: pair[0].1, b: pair[1].1, width, porosity });
            }
        }
        for (t, tap) in taps {
            if self.model.taps[tap] == usize::MAX {
                let node = self.node(self.taps[tap].at, 0.0, true);
                self.model.taps[tap] = node;
                let over = held.iter_mut().find(|(stretch, _)| stretch[0] <= t && t <= stretch[1]);
                over.into_iter().for_each(|(_, nodes)| nodes.push(node));
            }
        }
        self.stretches(k, [p, q], held);
        let area = limb.cell.area - self.holes.limbs[k].moments.area;
        self.model.area += area;
        self.model.held += (1.0 - kept) * area;
        // a free end of what is held is held
        for end in (0..2).filter(|end| loose(*end) && !free_ends[*end]) {
            let tip = self.parts.at[k][end];
            self.model.held += self.parts.joints[tip].cell.area - self.holes.joints[tip].moments.area;
        }
    }

    /// Fraction of a limb between two points that holes remove, so that its beams have the drawn mass. A free end
    /// belongs to the limb. Where the limb extends into a body or ends before it, the holes there belong to it as well.
    fn porosity(&self, k: usize, [p, q]: [[f64; 2]; 2]) -> f64 {
        let limb = &self.parts.limbs[k];
        let (mut solid, mut missing) = (limb.cell.area, self.holes.limbs[k].moments.area);
        for end in 0..2 {
            let j = self.parts.at[k][end];
            let joint = &self.parts.joints[j];
            if let (1, JointRole::Node(_)) = (joint.ports.len(), &joint.kind) {
                solid += joint.cell.area;
                missing += self.holes.joints[j].moments.area;
                continue;
            }
            let (e, other, place) = (limb.ends[end], limb.ends[1 - end], [p, q][end]);
            let long = limb.length();
            let past = [0, 1].map(|i| (place[i] - self.origin[i] - e[i]) * (e[i] - other[i]) / long);
            solid += (past[0] + past[1]) * limb.width[end];
            missing += self.led[k][end];
        }
        if missing <= 0.0 {
            return 0.0;
        }
        let drawn = 0.5 * (limb.width[0] + limb.width[1]) * (q[0] - p[0]).hypot(q[1] - p[1]);
        (1.0 - (solid - missing) / drawn).clamp(0.0, 1.0)
    }
}
