//! Areas between limbs: intersections of their axes, tips, and rigid bodies.
//!
//! | between limbs | becomes |
//! |---|---|
//! | axes that cross in one point, with no more area than the limbs led up to it have | a node there |
//! | two limbs in line | a node at the edge of the narrower one |
//! | two limbs in line and others across | nodes along the bar |
//! | one limb, and a rectangular end | the end of the limb |
//! | anything else | a rigid body with the area, centroid and second moment of its polygon; each limb ends at its edge |

use super::limbs::Limb;
use super::medial::Medial;
use super::moments::Moments;
use super::skeleton::Skeleton;

/// How far axes may miss their node: grid units, and share of the widest limb.
const MISS: [f64; 2] = [3.0, 0.03];
/// Area of a joint over that of the limbs led up to the node (1).
const FULL: f64 = 1.35;
/// How far a limb may be led on to its node or to a body's edge, in widths (1).
const REACH: f64 = 6.0;
/// A joint between nodes on a bar shorter than this fraction of the bar's width is rigid (1).
const STOUT: f64 = 0.5;
/// Sine of an angle below which axes run in line (1).
const IN_LINE: f64 = 0.02;

/// One end of a limb at a joint.
#[derive(Debug, Clone, Copy)]
pub(super) struct LimbEnd {
    pub(super) limb: usize,
    /// 0 at its start, 1 at its end.
    pub(super) end: usize,
}

/// A joint.
#[derive(Debug, Clone, Default)]
pub(super) struct LimbJoint {
    /// Limb ends in it.
    pub(super) ports: Vec<LimbEnd>,
    /// Its area.
    pub(super) cell: Moments,
    /// Edges of the axis whose areas it has.
    pub(super) edges: Vec<u32>,
    /// Model element of the joint.
    pub(super) kind: JointRole,
    /// Of a body whose edge is elastic, for each port, its compliance: shift (1), turn [1/square database unit]; none: it is rigid there.
    pub(super) roots: Vec<Option<[f64; 2]>>,
}

/// Model elements of a joint.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) enum JointRole {
    /// Limbs end here; for a tip this is where the material ends.
    Node([f64; 2]),
    /// Nodes along a bar, with the width of the bar; for each port the node it ends in.
    Bar { nodes: Vec<[f64; 2]>, width: f64, ends: Vec<usize> },
    /// A rigid body; for each port the place where its limb ends.
    Body(Vec<[f64; 2]>),
    /// Not known yet.
    #[default]
    Unset,
}

/// Limbs and joints of one part.
#[derive(Debug, Clone, Default)]
pub(super) struct LimbGraph {
    pub(super) limbs: Vec<Limb>,
    pub(super) joints: Vec<LimbJoint>,
    /// For each limb the joints at its start and end.
    pub(super) at: Vec<[usize; 2]>,
}

/// Finds the joints between limbs and says what they become.
pub(super) fn joints(skeleton: &Skeleton<'_>, mut limbs: Vec<Limb>) -> LimbGraph {
    let axis = skeleton.axis;
    let mut of_limb = vec![usize::MAX; axis.edges.len()];
    for (k, limb) in limbs.iter().enumerate() {
        limb.edges.iter().for_each(|e| of_limb[*e as usize] = k);
    }
    // vertices between limbs are connected by the edges in no limb
    let mut sets = bimorph_base::sets::Sets::new(axis.vertices.len());
    let mut inner = vec![usize::MAX; axis.vertices.len()];
    for (e, edge) in axis.edges.iter().enumerate().filter(|(e, _)| skeleton.alive[*e]) {
        let [a, b] = edge.ends;
        if of_limb[e] == usize::MAX {
            sets.join(a as usize, b as usize);
        } else {
            [a, b].iter().for_each(|v| inner[*v as usize] = of_limb[e]);
        }
    }
    for v in limbs.iter().flat_map(|l| l.vertices) {
        inner[v as usize] = usize::MAX;
    }
    let mut number = vec![usize::MAX; axis.vertices.len()];
    let mut joints: Vec<LimbJoint> = Vec::new();
    let mut joint = |v: u32, joints: &mut Vec<LimbJoint>, sets: &mut bimorph_base::sets::Sets| {
        let first = sets.first(v as usize);
        if number[first] == usize::MAX {
            number[first] = joints.len();
            joints.push(LimbJoint::default());
        }
        number[first]
    };
    let mut at = vec![[usize::MAX; 2]; limbs.len()];
    for (k, limb) in limbs.iter().enumerate() {
        for end in 0..2 {
            at[k][end] = joint(limb.vertices[end], &mut joints, &mut sets);
            joints[at[k][end]].ports.push(LimbEnd { limb: k, end });
        }
    }
    for (e, edge) in axis.edges.iter().enumerate() {
        let v = if skeleton.alive[e] { edge.ends[0] } else { skeleton.home(e as u32) };
        if of_limb[e] != usize::MAX {
            continue;
        }
        if !skeleton.alive[e] && inner[v as usize] != usize::MAX {
            // a bump on a limb
            let limb = &mut limbs[inner[v as usize]];
            limb.edges.push(e as u32);
            limb.cell += edge.cell;
            continue;
        }
        let j = joint(v, &mut joints, &mut sets);
        joints[j].edges.push(e as u32);
        joints[j].cell += edge.cell;
    }
    for joint in &mut joints {
        joint.kind = kind(skeleton, &limbs, joint);
    }
    LimbGraph { limbs, joints, at }
}

/// An end of a limb seen from it: place, outward direction, width.
#[derive(Debug, Clone, Copy)]
struct Lead {
    e: [f64; 2],
    u: [f64; 2],
    w: f64,
    vertex: u32,
}

impl Lead {
    fn of(limb: &Limb, end: usize) -> Self {
        let d = limb.direction();
        let u = if end == 1 { d } else { d.map(|x| -x) };
        Self { e: limb.ends[end], u, w: limb.width[end], vertex: limb.vertices[end] }
    }

    /// How far a point lies ahead, and how far to the left.
    fn local(&self, p: [f64; 2]) -> [f64; 2] {
        let d = [p[0] - self.e[0], p[1] - self.e[1]];
        [d[0] * self.u[0] + d[1] * self.u[1], self.u[0] * d[1] - self.u[1] * d[0]]
    }

    fn ahead(&self, t: f64) -> [f64; 2] {
        [self.e[0] + t * self.u[0], self.e[1] + t * self.u[1]]
    }
}

fn kind(skeleton: &Skeleton<'_>, limbs: &[Limb], joint: &LimbJoint) -> JointRole {
    let leads: Vec<Lead> = joint.ports.iter().map(|p| Lead::of(&limbs[p.limb], p.end)).collect();
    let point = match leads.as_slice() {
        [] => None,
        [lead] => tip(lead, &joint.cell),
        _ => crossing(&leads, joint.cell.area),
    };
    let simple = point.map(JointRole::Node).or_else(|| bar(&leads, joint.cell.area));
    simple.unwrap_or_else(|| body(skeleton, limbs, joint))
}

/// Distance of the sides of a limb on a body from its nearest corner; 0 where one of them continues as its edge.
pub(super) fn from_corner(axis: &Medial, limb: &Limb, end: usize) -> f64 {
    let lead = Lead::of(limb, end);
    let room = limb.sides[end].into_iter().enumerate().map(|(k, side)| {
        let next = if (k == 1) == (end == 1) { axis.next[side as usize] } else { axis.before(side) };
        let [p, q] = axis.side(next);
        let shared = if (k == 1) == (end == 1) { p } else { q };
        let length = (q[0] - p[0]).hypot(q[1] - p[1]);
        let across = (lead.u[0] * (q[1] - p[1]) - lead.u[1] * (q[0] - p[0])).abs() / length;
        if lead.local(shared)[0].abs() > 0.5 * lead.w || across < 0.2 { 0.0 } else { length }
    });
    room.fold(f64::INFINITY, f64::min)
}

/// A joint as a rigid body: its limbs end at its edge.
pub(super) fn body(skeleton: &Skeleton<'_>, limbs: &[Limb], joint: &LimbJoint) -> JointRole {
    let place = |p: &LimbEnd| mouth(skeleton, &limbs[p.limb], p.end, &Lead::of(&limbs[p.limb], p.end));
    JointRole::Body(joint.ports.iter().map(place).collect())
}

/// Where a limb with a rectangular end ends.
fn tip(lead: &Lead, cell: &Moments) -> Option<[f64; 2]> {
    let long = cell.area / lead.w;
    let [ahead, left] = lead.local(if cell.area > 0.0 { cell.centroid() } else { lead.e });
    let straight = left.abs() <= 0.05 * lead.w && (ahead - 0.5 * long).abs() <= 0.1 * lead.w;
    (long <= 1.5 * lead.w && straight).then(|| lead.ahead(long))
}

/// Where all axes cross.
fn crossing(leads: &[Lead], area: f64) -> Option<[f64; 2]> {
    if leads.iter().all(|l| l.vertex == leads[0].vertex) {
        return Some(leads[0].e);
    }
    let widest = leads.iter().map(|l| l.w).fold(0.0, f64::max);
    let miss = MISS[0] + MISS[1] * widest;
    let at = least_squares(leads).filter(|at| fits(leads, *at, miss, widest)).or_else(|| {
        // in line: where the narrower one begins; nearly in line: half way
        let [a, b] = leads else { return None };
        if a.u[0] * b.u[0] + a.u[1] * b.u[1] > 0.0 || (a.u[0] * b.u[1] - a.u[1] * b.u[0]).abs() > 5.0 * IN_LINE {
            return None;
        }
        let at = if (a.w - b.w).abs() <= MISS[1] * widest {
            [0.5 * (a.e[0] + b.e[0]), 0.5 * (a.e[1] + b.e[1])]
        } else if a.w < b.w {
            a.e
        } else {
            b.e
        };
        fits(leads, at, miss, widest).then_some(at)
    })?;
    let led: f64 = leads.iter().map(|l| l.w * l.local(at)[0].max(0.0)).sum();
    (area <= FULL * led + miss * widest).then_some(at)
}

fn fits(leads: &[Lead], at: [f64; 2], miss: f64, widest: f64) -> bool {
    leads.iter().map(|l| l.local(at)).all(|[ahead, left]| left.abs() <= miss && ahead > -miss && ahead < REACH * widest)
}

/// The point nearest to all axes; none where they run in line.
fn least_squares(leads: &[Lead]) -> Option<[f64; 2]> {
    let origin = leads[0].e;
    let (mut m, mut f) = ([0.0; 3], [0.0; 2]);
    for l in leads {
        let n = [-l.u[1], l.u[0]];
        let c = n[0] * (l.e[0] - origin[0]) + n[1] * (l.e[1] - origin[1]);
        m = [m[0] + n[0] * n[0], m[1] + n[0] * n[1], m[2] + n[1] * n[1]];
        f = [f[0] + n[0] * c, f[1] + n[1] * c];
    }
    let determinant = m[0] * m[2] - m[1] * m[1];
    if determinant < IN_LINE * IN_LINE {
        return None;
    }
    let x = (m[2] * f[0] - m[1] * f[1]) / determinant;
    let y = (m[0] * f[1] - m[1] * f[0]) / determinant;
    Some([origin[0] + x, origin[1] + y])
}

/// Two limbs in line, and others across them.
fn bar(leads: &[Lead], area: f64) -> Option<JointRole> {
    let (i, j) = (0..leads.len()).flat_map(|i| (i + 1..leads.len()).map(move |j| (i, j))).find(|&(i, j)| {
        let (a, b) = (&leads[i], &leads[j]);
        let [ahead, left] = a.local(b.e);
        let width = a.w.max(b.w);
        ahead > 0.0
            && a.u[0] * b.u[0] + a.u[1] * b.u[1] < 0.0
            && (a.u[0] * b.u[1] - a.u[1] * b.u[0]).abs() < IN_LINE
            && left.abs() < MISS[0] + MISS[1] * width
            && (a.w - b.w).abs() <= MISS[1] * width
    })?;
    let (one, width) = (&leads[i], 0.5 * (leads[i].w + leads[j].w));
    let long = one.local(leads[j].e)[0];
    let miss = MISS[0] + MISS[1] * width;
    let (mut stems, mut led) = (Vec::new(), width * long);
    for (k, lead) in leads.iter().enumerate().filter(|(k, _)| *k != i && *k != j) {
        let at = least_squares(&[*one, *lead])?;
        let [along, _] = one.local(at);
        let [ahead, _] = lead.local(at);
        if along < -miss || along > long + miss || ahead < -miss || ahead > REACH * width.max(lead.w) {
            return None;
        }
        led += lead.w * ahead.max(0.0);
        stems.push((along, k));
    }
    if area > FULL * led + miss * width || stems.is_empty() {
        return None;
    }
    stems.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let (mut nodes, mut places, mut ends) = (Vec::new(), Vec::new(), vec![0; leads.len()]);
    for (along, k) in stems {
        if places.last().is_none_or(|last| along - last > miss) {
            places.push(along);
            nodes.push(one.ahead(along));
        }
        ends[k] = nodes.len() - 1;
    }
    ends[j] = nodes.len() - 1;
    Some(JointRole::Bar { nodes, width, ends })
}

/// Where a limb ends at the edge of a body: where its centreline crosses the edge next to one of its sides; an edge at right angles
/// to it first.
fn mouth(skeleton: &Skeleton<'_>, limb: &Limb, end: usize, lead: &Lead) -> [f64; 2] {
    let axis = skeleton.axis;
    let mut best: Option<(bool, f64)> = None;
    for (k, side) in limb.sides[end].into_iter().enumerate() {
        // sides[0] runs against the limb, sides[1] along it
        let next = if (k == 1) == (end == 1) { axis.next[side as usize] } else { axis.before(side) };
        let [p, q] = axis.side(next);
        let shared = if (k == 1) == (end == 1) { p } else { q };
        let length = (q[0] - p[0]).hypot(q[1] - p[1]);
        let d = [(q[0] - p[0]) / length, (q[1] - p[1]) / length];
        let (along, across) = (d[0] * lead.u[0] + d[1] * lead.u[1], lead.u[0] * d[1] - lead.u[1] * d[0]);
        let [ahead, left] = lead.local(p);
        let near = lead.local(shared)[0].abs() <= REACH * lead.w;
        if across.abs() < 0.2 || !near {
            continue;
        }
        let t = ahead - left * along / across;
        let square = along.abs() < 0.05;
        let better = best.is_none_or(|(other, s)| (square && !other) || (square == other && t.abs() < f64::abs(s)));
        if t.abs() <= REACH * lead.w && better {
            best = Some((square, t));
        }
    }
    best.map_or(lead.e, |(_, t)| lead.ahead(t))
}

/// Whether a joint between two nodes on a bar is too short to bend.
pub(super) fn stout(length: f64, width: f64) -> bool {
    length < STOUT * width
}
