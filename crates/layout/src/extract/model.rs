//! From limbs and joints to nodes, beams, rigid bodies and anchors.

use super::anchors::AnchorRule;
use super::cells::{Cells, Owner, Tap};
use super::cut::HoleCutouts;
use super::holes::Hole;
use super::joints::{self, JointRole, LimbGraph};
use super::medial::Medial;
use super::moments::Moments;

/// More than this fraction of a limb is no rounding (1).
const ROUNDED: f64 = 1e-2;

/// The model of one part, in database units of the drawing.
#[derive(Debug, Clone, Default)]
pub(super) struct PartModel {
    pub(super) nodes: Vec<[f64; 2]>,
    /// How far from each node a label may stand that names it.
    pub(super) reach: Vec<f64>,
    pub(super) beams: Vec<PartBeam>,
    pub(super) bodies: Vec<PartBody>,
    /// Rigid and massless connections.
    pub(super) links: Vec<[usize; 2]>,
    /// Elastic edges.
    pub(super) roots: Vec<PartRoot>,
    /// Nodes that are held.
    pub(super) anchors: Vec<usize>,
    /// Areas that are held, with their nodes.
    pub(super) pads: Vec<PartPad>,
    /// For each tap its node, and whether it is held.
    pub(super) taps: Vec<usize>,
    /// Area that is held, of the whole part.
    pub(super) held: f64,
    /// Area of beams, bodies and what is held.
    pub(super) area: f64,
}

/// An area that is held.
#[derive(Debug, Clone, Default)]
pub(super) struct PartPad {
    pub(super) nodes: Vec<usize>,
    /// Outlines of what it consists of.
    pub(super) outlines: Vec<Vec<[f64; 2]>>,
}

/// A straight beam, perhaps with a width that changes along it.
#[derive(Debug, Clone)]
pub(super) struct PartBeam {
    pub(super) a: usize,
    pub(super) b: usize,
    pub(super) width: [f64; 2],
    /// Fraction of its area that holes take (1).
    pub(super) porosity: f64,
}

/// An elastic edge between a node of a body and that of a limb in the same place.
#[derive(Debug, Clone)]
pub(super) struct PartRoot {
    pub(super) nodes: [usize; 2],
    /// Direction of the limb.
    pub(super) along: [f64; 2],
    /// Compliance, times Young's modulus and thickness: shift (1), turn [1/square database unit].
    pub(super) compliance: [f64; 2],
}

/// A rigid body.
#[derive(Debug, Clone)]
pub(super) struct PartBody {
    /// Node at its centroid.
    pub(super) node: usize,
    pub(super) moments: Moments,
}

impl PartModel {
    /// Whether anything of it is held, with a node there or without.
    pub(super) fn is_held(&self) -> bool {
        !self.anchors.is_empty() || !self.pads.is_empty()
    }

    /// Builds it from the axis of a part whose box has its lower left corner at `origin`; `taps` are places where
    /// something pulls at it, in coordinates of the drawing: on a centreline, or at the end of an arm.
    pub(super) fn of(
        axis: &Medial,
        origin: [f64; 2],
        parts: &LimbGraph,
        rule: &AnchorRule,
        taps: &[([f64; 2], bool)],
        holes: &[Hole],
    ) -> Self {
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
            holes: HoleCutouts::of(axis, parts, holes, origin),
            led: vec![[0.0; 2]; parts.limbs.len()],
        };
        if !taps.is_empty() {
            build.cells = Cells::of(axis, parts);
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

pub(super) struct Builder<'a> {
    pub(super) model: PartModel,
    pub(super) axis: &'a Medial,
    /// Lower left corner of the part's box.
    pub(super) origin: [f64; 2],
    pub(super) parts: &'a LimbGraph,
    pub(super) rule: &'a AnchorRule,
    /// For each node, whether it is held.
    pub(super) anchored: Vec<bool>,
    /// For each joint, the node that stands for it.
    pub(super) bodies: Vec<Option<usize>>,
    /// For each joint, the pad that it is part of.
    pub(super) pad_of: Vec<Option<usize>>,
    /// Joints and pads that adjoin them.
    pub(super) adjoining: Vec<(usize, usize)>,
    pub(super) taps: Vec<Tap>,
    pub(super) cells: Cells,
    /// Areas that holes remove from limbs and joints.
    pub(super) holes: HoleCutouts,
    /// For each limb, the area of holes where it is led into bodies beyond its cells; less than nothing where it ends before.
    pub(super) led: Vec<[f64; 2]>,
}

impl Builder<'_> {
    pub(super) fn node(&mut self, local: [f64; 2], reach: f64, held: bool) -> usize {
        let origin = self.origin;
        self.model.nodes.push([local[0] + origin[0], local[1] + origin[1]]);
        self.model.reach.push(reach);
        self.anchored.push(held);
        self.model.nodes.len() - 1
    }

    fn holds(&self, local: [f64; 2]) -> bool {
        let origin = self.origin;
        matches!(self.rule, AnchorRule::Drawn(held) if held.holds([local[0] + origin[0], local[1] + origin[1]]))
    }

    /// Makes the nodes of a joint and returns those of its ports.
    fn joint(&mut self, j: usize) -> Vec<usize> {
        let joint = &self.parts.joints[j];
        let first = self.model.nodes.len();
        let ends = match &joint.kind {
            JointRole::Node(at) => {
                let held = joint.ports.len() > 1 && self.holds(*at);
                self.count(joint.cell.area - self.holes.joints[j].moments.area, held);
                let width = joint.ports.iter().map(|p| self.parts.limbs[p.limb].width[p.end]).fold(0.0, f64::max);
                vec![self.node(*at, width, held); joint.ports.len()]
            }
            JointRole::Bar { nodes, width, ends } => {
                self.count(joint.cell.area - self.holes.joints[j].moments.area, false);
                let made: Vec<usize> = nodes.iter().map(|at| self.node(*at, *width, self.holds(*at))).collect();
                for (pair, at) in made.windows(2).zip(nodes.windows(2)) {
                    let length = (at[1][0] - at[0][0]).hypot(at[1][1] - at[0][1]);
                    if joints::stout(length, *width) {
                        self.model.links.push([pair[0], pair[1]]);
                    } else {
                        self.model.beams.push(PartBeam { a: pair[0], b: pair[1], width: [*width; 2], porosity: 0.0 });
                    }
                }
                ends.iter().map(|k| made[*k]).collect()
            }
            JointRole::Body(places) => {
                let held = self.rule.holds_body(self.axis, self.origin, &self.parts.limbs, joint);
                self.count(joint.cell.area - self.holes.joints[j].moments.area, held);
                let size = joint.cell.area.max(0.0).sqrt();
                let ends: Vec<usize> =
                    places.iter().map(|at| self.node(*at, if held { size } else { 0.0 }, held)).collect();
                if !held {
                    let moments = self.without_mouths(j, places);
                    let node = self.node(moments.centroid(), size, false);
                    for (p, end) in ends.iter().copied().enumerate() {
                        let Some(compliance) = joint.roots.get(p).copied().flatten() else {
                            self.model.links.push([node, end]);
                            continue;
                        };
                        let along = self.parts.limbs[joint.ports[p].limb].direction();
                        let root = self.node(places[p], 0.0, false);
                        self.model.links.push([node, root]);
                        self.model.roots.push(PartRoot { nodes: [root, end], along, compliance });
                    }
                    self.model.bodies.push(PartBody { node, moments });
                } else if ends.is_empty() {
                    self.node(joint.cell.centroid(), size, true);
                }
                ends
            }
            JointRole::Unset => unreachable!("every joint becomes something"),
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

    /// Excess mass of a limb without holes over its beam, at a point, from rounding to the grid; half of it where the
    /// limb ends in two bodies that take it.
    fn rounding(&self, k: usize, at: [f64; 2]) -> Moments {
        let limb = &self.parts.limbs[k];
        let width = 0.5 * (limb.width[0] + limb.width[1]);
        let (mut over, mut takers) = (limb.cell.area - width * limb.length(), 0);
        for end in 0..2 {
            let j = self.parts.at[k][end];
            let joint = &self.parts.joints[j];
            let port = joint.ports.iter().position(|p| p.limb == k && p.end == end);
            let (JointRole::Body(places), Some(p)) = (&joint.kind, port) else { continue };
            let (d, e, place) = (limb.direction(), limb.ends[end], places[p]);
            let ahead = (place[0] - e[0]) * d[0] + (place[1] - e[1]) * d[1];
            let ahead = if end == 1 { ahead } else { -ahead };
            // what is held brings nothing where the beam is led into it
            let held = self.rule.holds_body(self.axis, self.origin, &self.parts.limbs, joint);
            over += ahead * (if held { 0.0 } else { limb.width[end] } - width);
            takers += usize::from(!held && self.holes.joints[j].moments.area > 0.0);
        }
        if self.holes.limbs[k].moments.area > 0.0 || over.abs() > ROUNDED * limb.cell.area {
            return Moments::default();
        }
        let area = over / takers.max(1) as f64;
        Moments { area, first: at.map(|x| x * area), second: (at[0] * at[0] + at[1] * at[1]) * area }
    }

    /// Moments of a body beyond the limbs that end at its edge: a limb led into the body already includes that area.
    fn without_mouths(&mut self, j: usize, places: &[[f64; 2]]) -> Moments {
        let joint = &self.parts.joints[j];
        let mut moments = joint.cell;
        moments -= self.holes.joints[j].moments;
        for (port, place) in joint.ports.iter().zip(places) {
            let limb = &self.parts.limbs[port.limb];
            let (e, w) = (limb.ends[port.end], limb.width[port.end]);
            let d = [place[0] - e[0], place[1] - e[1]];
            let long = d[0].hypot(d[1]);
            if self.holes.joints[j].moments.area > 0.0 {
                moments += self.rounding(port.limb, e);
            }
            if long <= 0.0 || long * w > 0.5 * joint.cell.area {
                continue;
            }
            let n = [-d[1] / long * 0.5 * w, d[0] / long * 0.5 * w];
            let corner = |p: [f64; 2], s: f64| [p[0] + s * n[0], p[1] + s * n[1]];
            let outline = [corner(e, 1.0), corner(e, -1.0), corner(*place, -1.0), corner(*place, 1.0)];
            let mut strip = Moments::of(&outline);
            let out = if port.end == 1 { limb.direction() } else { limb.direction().map(|x| -x) };
            let into = d[0] * out[0] + d[1] * out[1] > 0.0;
            let holes = if into { &self.holes.joints[j] } else { &self.holes.limbs[port.limb] };
            let missing = holes.within(&outline);
            strip -= missing;
            if into {
                moments -= strip;
            } else {
                moments += strip;
            }
            self.led[port.limb][port.end] = if into { missing.area } else { -missing.area };
        }
        // limbs that are led through each other bring their areas twice: the body then keeps all of its own
        let least = moments.area * moments.area / (2.0 * std::f64::consts::PI);
        if moments.area <= 0.0 || moments.polar() < least {
            joint.ports.iter().for_each(|port| self.led[port.limb][port.end] = 0.0);
            let mut whole = joint.cell;
            whole -= self.holes.joints[j].moments;
            return whole;
        }
        moments
    }
}
