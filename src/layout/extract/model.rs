//! From limbs and joints to nodes, beams, rigid bodies and anchors.

use super::anchors::Rule;
use super::boxes::Boxes;
use super::joints::{self, Joint, Kind, Parts};
use super::medial::Medial;
use super::moments::Moments;
use super::pads::Pad;

/// A free end beyond an anchor shorter than this many widths is part of the anchor [1].
const STUMP: f64 = 1.5;
/// Nodes nearer to each other than this many widths are one [1].
const ON_AXIS: f64 = 0.01;
/// A place on the edge of a part may lie this far outside [database units].
const BESIDE: f64 = 4.0;
/// A pad is at least this much wider than its limb [1].
const PAD: f64 = 1.5;

/// The model of one part, in database units of the drawing.
#[derive(Debug, Clone, Default)]
pub(super) struct Model {
    pub(super) nodes: Vec<[f64; 2]>,
    /// How far from each node a label may stand that names it.
    pub(super) reach: Vec<f64>,
    pub(super) beams: Vec<Beam>,
    pub(super) bodies: Vec<Body>,
    /// Rigid and massless connections.
    pub(super) links: Vec<[usize; 2]>,
    /// Nodes that are held.
    pub(super) anchors: Vec<usize>,
    /// Areas that are held, with their nodes.
    pub(super) pads: Vec<Pad>,
    /// For each tap its node, and whether it is held.
    pub(super) taps: Vec<usize>,
    /// Area that is held, of the whole part.
    pub(super) held: f64,
    /// Area of beams, bodies and what is held.
    pub(super) area: f64,
}

/// A straight beam, perhaps with a width that changes along it.
#[derive(Debug, Clone)]
pub(super) struct Beam {
    pub(super) a: usize,
    pub(super) b: usize,
    pub(super) width: [f64; 2],
    /// Share of its area that holes take [1].
    pub(super) porosity: f64,
}

/// A rigid body.
#[derive(Debug, Clone)]
pub(super) struct Body {
    /// Node at its centroid.
    pub(super) node: usize,
    pub(super) moments: Moments,
}

impl Model {
    /// Whether anything of it is held, with a node there or without.
    pub(super) fn is_held(&self) -> bool {
        !self.anchors.is_empty() || !self.pads.is_empty()
    }

    /// Builds it from the axis of a part whose box has its lower left corner at `origin`; `taps` are places where
    /// something pulls at it, in coordinates of the drawing: on a centreline, or at the end of an arm.
    pub(super) fn of(
        axis: &Medial,
        origin: [i32; 2],
        parts: &Parts,
        rule: &Rule,
        taps: &[([f64; 2], bool)],
        holes: &[Moments],
    ) -> Self {
        let origin = origin.map(f64::from);
        let mut build = Builder {
            model: Self::default(),
            axis,
            origin,
            parts,
            rule,
            anchored: Vec::new(),
            bodies: vec![None; parts.joints.len()],
            pad_of: vec![None; parts.joints.len()],
            adjoining: Vec::new(),
            taps: Vec::new(),
            cells: Cells::default(),
            limb_holes: vec![0.0; parts.limbs.len()],
            joint_holes: vec![Moments::default(); parts.joints.len()],
        };
        if !holes.is_empty() || !taps.is_empty() {
            build.cells = Cells::of(axis, parts);
        }
        for hole in holes {
            let local = hole.moved(origin.map(|x| -x));
            match build.cells.nearest(axis, local.centroid()) {
                Owner::Limb(k) => build.limb_holes[k] += local.area,
                Owner::Joint(j) => build.joint_holes[j] += local,
            }
        }
        build.model.taps = vec![usize::MAX; taps.len()];
        build.taps = taps.iter().map(|(p, on_axis)| build.tap(*p, *on_axis)).collect();
        let ports: Vec<Vec<usize>> = (0..parts.joints.len()).map(|j| build.joint(j)).collect();
        for (k, at) in parts.at.iter().enumerate() {
            let node = |end: usize| {
                let joint = &parts.joints[at[end]];
                joint.ports.iter().position(|p| p.limb == k && p.end == end).map(|p| ports[at[end]][p])
            };
            if let (Some(a), Some(b)) = (node(0), node(1)) {
                build.limb(k, a, b);
            }
        }
        for k in 0..build.taps.len() {
            if let Owner::Joint(j) = build.taps[k].owner {
                build.tap_joint(k, j);
            }
        }
        build.join_pads();
        let Builder { mut model, anchored, .. } = build;
        model.anchors = (0..anchored.len()).filter(|n| anchored[*n]).collect();
        model
    }
}

/// Where something pulls.
#[derive(Debug, Clone, Copy)]
struct Tap {
    /// In coordinates of the part.
    at: [f64; 2],
    owner: Owner,
    /// On the centreline, not at the end of an arm.
    on_axis: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Owner {
    Limb(usize),
    Joint(usize),
}

/// The areas of limbs and joints, found by place.
#[derive(Debug, Default)]
struct Cells {
    boxes: Boxes,
    edges: Vec<(u32, Owner)>,
}

impl Cells {
    fn of(axis: &Medial, parts: &Parts) -> Self {
        let joints = parts
            .joints
            .iter()
            .enumerate()
            .flat_map(|(j, joint)| joint.edges.iter().map(move |e| (*e, Owner::Joint(j))));
        let limbs =
            parts.limbs.iter().enumerate().flat_map(|(k, limb)| limb.edges.iter().map(move |e| (*e, Owner::Limb(k))));
        let edges: Vec<_> = joints.chain(limbs).collect();
        let outline = |e: u32| axis.outline(axis.edges[e as usize].ends, axis.edges[e as usize].sites);
        let extents: Vec<_> = edges.iter().map(|(e, _)| super::boxes::around(outline(*e))).collect();
        Self { boxes: Boxes::of(&extents), edges }
    }

    /// Whose area is nearest to a place on the part or at its edge.
    fn nearest(&self, axis: &Medial, at: [f64; 2]) -> Owner {
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

pub(super) struct Builder<'a> {
    pub(super) model: Model,
    pub(super) axis: &'a Medial,
    /// Lower left corner of the part's box.
    pub(super) origin: [f64; 2],
    pub(super) parts: &'a Parts,
    rule: &'a Rule,
    /// For each node, whether it is held.
    pub(super) anchored: Vec<bool>,
    /// For each joint, the node that stands for it.
    bodies: Vec<Option<usize>>,
    /// For each joint, the pad that it is part of.
    pub(super) pad_of: Vec<Option<usize>>,
    /// Joints and pads that adjoin them.
    pub(super) adjoining: Vec<(usize, usize)>,
    taps: Vec<Tap>,
    cells: Cells,
    /// Area of the holes in each limb, and holes in each joint.
    limb_holes: Vec<f64>,
    joint_holes: Vec<Moments>,
}

impl Builder<'_> {
    fn node(&mut self, local: [f64; 2], reach: f64, held: bool) -> usize {
        let origin = self.origin;
        self.model.nodes.push([local[0] + origin[0], local[1] + origin[1]]);
        self.model.reach.push(reach);
        self.anchored.push(held);
        self.model.nodes.len() - 1
    }

    fn holds(&self, local: [f64; 2]) -> bool {
        let origin = self.origin;
        matches!(self.rule, Rule::Drawn(held) if held.holds([local[0] + origin[0], local[1] + origin[1]]))
    }

    /// What is nearest to a place.
    fn tap(&self, place: [f64; 2], on_axis: bool) -> Tap {
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

    fn tap_joint(&mut self, k: usize, j: usize) {
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

    /// Makes the nodes of a joint and returns those of its ports.
    fn joint(&mut self, j: usize) -> Vec<usize> {
        let joint = &self.parts.joints[j];
        let first = self.model.nodes.len();
        let ends = match &joint.kind {
            Kind::Node(at) => {
                let held = joint.ports.len() > 1 && self.holds(*at);
                self.count(joint.cell.area - self.joint_holes[j].area, held);
                let width = joint.ports.iter().map(|p| self.parts.limbs[p.limb].width[p.end]).fold(0.0, f64::max);
                vec![self.node(*at, width, held); joint.ports.len()]
            }
            Kind::Bar { nodes, width, ends } => {
                self.count(joint.cell.area - self.joint_holes[j].area, false);
                let made: Vec<usize> = nodes.iter().map(|at| self.node(*at, *width, self.holds(*at))).collect();
                for (pair, at) in made.windows(2).zip(nodes.windows(2)) {
                    let length = (at[1][0] - at[0][0]).hypot(at[1][1] - at[0][1]);
                    if joints::stout(length, *width) {
                        self.model.links.push([pair[0], pair[1]]);
                    } else {
                        self.model.beams.push(Beam { a: pair[0], b: pair[1], width: [*width; 2], porosity: 0.0 });
                    }
                }
                ends.iter().map(|k| made[*k]).collect()
            }
            Kind::Body(places) => {
                let held = self.held_body(joint);
                self.count(joint.cell.area - self.joint_holes[j].area, held);
                let size = joint.cell.area.max(0.0).sqrt();
                let ends: Vec<usize> =
                    places.iter().map(|at| self.node(*at, if held { size } else { 0.0 }, held)).collect();
                if !held {
                    let mut moments = self.without_mouths(joint, places);
                    moments -= self.joint_holes[j];
                    let node = self.node(moments.centroid(), size, false);
                    self.model.links.extend(ends.iter().map(|end| [node, *end]));
                    self.model.bodies.push(Body { node, moments });
                } else if ends.is_empty() {
                    self.node(joint.cell.centroid(), size, true);
                }
                ends
            }
            Kind::Unset => unreachable!("every joint becomes something"),
        };
        // of a free body its own node, made last; else the first made
        let made = self.model.nodes.len();
        self.joint_pad(j, first..made);
        let own = self.model.bodies.last().filter(|b| b.node >= first).map(|b| b.node);
        self.bodies[j] = own.or((made > first).then_some(first));
        ends
    }

    fn count(&mut self, area: f64, held: bool) {
        self.model.area += area;
        if held {
            self.model.held += area;
        }
    }

    /// What a body has beyond the limbs that end at its edge: a limb led into it brings that area itself.
    fn without_mouths(&self, joint: &Joint, places: &[[f64; 2]]) -> Moments {
        let mut moments = joint.cell;
        for (port, place) in joint.ports.iter().zip(places) {
            let limb = &self.parts.limbs[port.limb];
            let (e, w) = (limb.ends[port.end], limb.width[port.end]);
            let d = [place[0] - e[0], place[1] - e[1]];
            let long = d[0].hypot(d[1]);
            if long <= 0.0 || long * w > 0.5 * joint.cell.area {
                continue;
            }
            let n = [-d[1] / long * 0.5 * w, d[0] / long * 0.5 * w];
            let corner = |p: [f64; 2], s: f64| [p[0] + s * n[0], p[1] + s * n[1]];
            let strip = Moments::of(&[corner(e, 1.0), corner(e, -1.0), corner(*place, -1.0), corner(*place, 1.0)]);
            let out = if port.end == 1 { limb.direction() } else { limb.direction().map(|x| -x) };
            let sign = if d[0] * out[0] + d[1] * out[1] > 0.0 { -1.0 } else { 1.0 };
            if sign > 0.0 {
                moments += strip;
            } else {
                moments -= strip;
            }
        }
        moments
    }

    fn held_body(&self, joint: &Joint) -> bool {
        let widest = |edges: &[u32]| {
            let ends = edges.iter().flat_map(|e| self.axis.edges[*e as usize].ends);
            ends.map(|v| self.axis.vertices[v as usize].r).fold(0.0, f64::max)
        };
        match self.rule {
            Rule::Drawn(held) => held.touches(self.axis, self.origin, &joint.edges),
            Rule::Wide(reach) => widest(&joint.edges) >= *reach,
            Rule::Pads => match joint.ports.as_slice() {
                [] => true,
                [port] => {
                    let width = self.parts.limbs[port.limb].width[port.end];
                    2.0 * widest(&joint.edges) >= PAD * width
                }
                _ => false,
            },
        }
    }

    /// A rigid arm from a node to where something pulls.
    fn tap_node(&mut self, k: usize, node: usize) {
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

    /// A limb between two nodes, less what lies over anchors.
    fn limb(&mut self, k: usize, a: usize, b: usize) {
        let limb = &self.parts.limbs[k];
        let [p, q] = [a, b].map(|n| self.model.nodes[n]);
        let long = (q[0] - p[0]).hypot(q[1] - p[1]);
        let loose = |end: usize| {
            let joint = &self.parts.joints[self.parts.at[k][end]];
            joint.ports.len() == 1 && matches!(joint.kind, Kind::Node(_))
        };
        let covered = match self.rule {
            Rule::Drawn(held) => held.over(p, q),
            Rule::Wide(reach) if limb.width[0].min(limb.width[1]) >= 2.0 * reach => vec![[0.0, 1.0]],
            Rule::Pads if self.parts.limbs.len() == 1 && loose(0) && loose(1) => vec![[0.0, 1.0]],
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
        // a free end is a joint of its own, and part of the beam
        let tips = (0..2).filter(|end| loose(*end)).map(|end| self.parts.at[k][end]);
        let (solid, missing) = tips.fold((limb.cell.area, self.limb_holes[k]), |(solid, missing), tip| {
            (solid + self.parts.joints[tip].cell.area, missing + self.joint_holes[tip].area)
        });
        let porosity = missing / solid;
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
                self.model.beams.push(Beam { a: pair[0].1, b: pair[1].1, width, porosity });
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
        let area = limb.cell.area - self.limb_holes[k];
        self.model.area += area;
        self.model.held += (1.0 - kept) * area;
        // a free end of what is held is held
        for end in (0..2).filter(|end| loose(*end) && !free_ends[*end]) {
            let tip = self.parts.at[k][end];
            self.model.held += self.parts.joints[tip].cell.area - self.joint_holes[tip].area;
        }
    }
}

/// How far a point lies outside a convex or nearly convex outline; 0 inside.
pub(super) fn distance(outline: &[[f64; 2]], p: [f64; 2]) -> f64 {
    if super::anchors::inside(&[outline.to_vec()], p) {
        return 0.0;
    }
    let edges = outline.iter().zip(outline.iter().cycle().skip(1));
    edges
        .map(|(a, b)| {
            let d = [b[0] - a[0], b[1] - a[1]];
            let l2 = (d[0] * d[0] + d[1] * d[1]).max(f64::MIN_POSITIVE);
            let t = (((p[0] - a[0]) * d[0] + (p[1] - a[1]) * d[1]) / l2).clamp(0.0, 1.0);
            (p[0] - a[0] - t * d[0]).hypot(p[1] - a[1] - t * d[1])
        })
        .fold(f64::INFINITY, f64::min)
}
