//! From limbs and joints to nodes, beams, rigid bodies and anchors.

use super::anchors::Rule;
use super::joints::{self, Joint, Kind, Parts};
use super::medial::Medial;
use super::moments::Moments;

/// A free end beyond an anchor shorter than this many widths is part of the anchor [1].
const STUMP: f64 = 1.5;
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
}

/// A rigid body.
#[derive(Debug, Clone)]
pub(super) struct Body {
    /// Node at its centroid.
    pub(super) node: usize,
    pub(super) moments: Moments,
}

impl Model {
    /// Builds it from the axis of a part whose box has its lower left corner at `origin`.
    pub(super) fn of(axis: &Medial, origin: [i32; 2], parts: &Parts, rule: &Rule) -> Self {
        let origin = origin.map(f64::from);
        let mut build = Builder { model: Self::default(), axis, origin, parts, rule, anchored: Vec::new() };
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
        let Builder { mut model, anchored, .. } = build;
        model.anchors = (0..anchored.len()).filter(|n| anchored[*n]).collect();
        model
    }
}

struct Builder<'a> {
    model: Model,
    axis: &'a Medial,
    /// Lower left corner of the part's box.
    origin: [f64; 2],
    parts: &'a Parts,
    rule: &'a Rule,
    /// For each node, whether it is held.
    anchored: Vec<bool>,
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

    /// Makes the nodes of a joint and returns those of its ports.
    fn joint(&mut self, j: usize) -> Vec<usize> {
        let joint = &self.parts.joints[j];
        match &joint.kind {
            Kind::Node(at) => {
                let held = joint.ports.len() > 1 && self.holds(*at);
                self.count(joint.cell.area, held);
                let width = joint.ports.iter().map(|p| self.parts.limbs[p.limb].width[p.end]).fold(0.0, f64::max);
                vec![self.node(*at, width, held); joint.ports.len()]
            }
            Kind::Bar { nodes, width, ends } => {
                self.count(joint.cell.area, false);
                let made: Vec<usize> = nodes.iter().map(|at| self.node(*at, *width, self.holds(*at))).collect();
                for (pair, at) in made.windows(2).zip(nodes.windows(2)) {
                    let length = (at[1][0] - at[0][0]).hypot(at[1][1] - at[0][1]);
                    if joints::stout(length, *width) {
                        self.model.links.push([pair[0], pair[1]]);
                    } else {
                        self.model.beams.push(Beam { a: pair[0], b: pair[1], width: [*width; 2] });
                    }
                }
                ends.iter().map(|k| made[*k]).collect()
            }
            Kind::Body(places) => {
                let held = self.held_body(joint);
                self.count(joint.cell.area, held);
                let size = joint.cell.area.max(0.0).sqrt();
                let ends: Vec<usize> =
                    places.iter().map(|at| self.node(*at, if held { size } else { 0.0 }, held)).collect();
                if !held {
                    let moments = self.without_mouths(joint, places);
                    let node = self.node(moments.centroid(), size, false);
                    self.model.links.extend(ends.iter().map(|end| [node, *end]));
                    self.model.bodies.push(Body { node, moments });
                } else if ends.is_empty() {
                    self.node(joint.cell.centroid(), size, true);
                }
                ends
            }
            Kind::Unset => unreachable!("every joint becomes something"),
        }
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
            moments.area += sign * strip.area;
            moments.second += sign * strip.second;
            (0..2).for_each(|i| moments.first[i] += sign * strip.first[i]);
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

    /// A limb between two nodes, less what lies over anchors.
    fn limb(&mut self, k: usize, a: usize, b: usize) {
        let limb = &self.parts.limbs[k];
        let [p, q] = [a, b].map(|n| self.model.nodes[n]);
        let long = (q[0] - p[0]).hypot(q[1] - p[1]);
        let covered = match self.rule {
            Rule::Drawn(held) => held.over(p, q),
            Rule::Wide(reach) if limb.width[0].min(limb.width[1]) >= 2.0 * reach => vec![[0.0, 1.0]],
            _ => Vec::new(),
        };
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
        let loose = |end: usize| {
            let joint = &self.parts.joints[self.parts.at[k][end]];
            joint.ports.len() == 1 && matches!(joint.kind, Kind::Node(_))
        };
        let mut kept = 0.0;
        let (loose_start, loose_end) = (loose(0), loose(1));
        let cut = !(free.len() == 1 && free[0] == [0.0, 1.0]);
        for [t0, t1] in free {
            let stump =
                cut && (t0 == 0.0 && loose_start || t1 == 1.0 && loose_end) && (t1 - t0) * long < STUMP * widest;
            if stump {
                continue;
            }
            kept += t1 - t0;
            let origin = self.origin;
            let local = |t: f64| {
                let x = at(t);
                [x[0] - origin[0], x[1] - origin[1]]
            };
            let start = if t0 == 0.0 { a } else { self.node(local(t0), widest, true) };
            let end = if t1 == 1.0 { b } else { self.node(local(t1), widest, true) };
            self.model.beams.push(Beam { a: start, b: end, width: [width(t0), width(t1)] });
        }
        self.model.area += limb.cell.area;
        self.model.held += (1.0 - kept) * limb.cell.area;
    }
}
