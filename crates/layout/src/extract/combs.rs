//! Comb fingers: limbs with a free end between opposite ones of another part.
//!
//! Fingers that face each other across equal gaps over equal lengths, neighbour by neighbour, are one comb. They are taken off their
//! parts, so that what carries them is seen as it is without them; their mass stays.

use super::boxes::{self, Boxes, Extent};
use super::joints::JointRole;
use super::moments::Moments;
use super::part::Part;
use crate::drawing::{GridPoint, Polygon};
use bimorph_base::budget;
use bimorph_base::sets::Sets;

/// Length over width of the shortest finger (1).
const SLENDER: f64 = 1.5;
/// Widest gap between fingers, in widths of the wider one (1).
const WIDEST_GAP: f64 = 6.0;
/// Cosine of the angle between opposite fingers.
const OPPOSITE: f64 = -0.9998;
/// Gaps and overlaps of one comb differ by less than this (database units).
const ALIKE: f64 = 3.0;

/// A limb with a free end, in coordinates of the drawing.
#[derive(Debug, Clone)]
pub(super) struct Finger {
    pub(super) part: usize,
    /// Middle of its root, and direction from there to its tip.
    root: [f64; 2],
    along: [f64; 2],
    long: f64,
    width: f64,
    /// Numbers of the points after which and before which it stands on its contour, and points to put there.
    cut: [u32; 2],
    ends: [GridPoint; 2],
    /// An isolated part.
    loose: bool,
}

/// Fingers of two parts with one gap and one overlap.
#[derive(Debug, Clone)]
pub(super) struct FingerArray {
    /// The two parts.
    pub(super) parts: [usize; 2],
    /// Where it pulls: on the line of the roots of each part's fingers.
    pub(super) roots: [[f64; 2]; 2],
    /// Number of gaps.
    pub(super) gaps: usize,
    /// Number of fingers of each part.
    pub(super) fingers: [usize; 2],
    pub(super) gap: f64,
    pub(super) overlap: f64,
    /// Mean width of a finger.
    pub(super) width: f64,
    /// Area of each part's fingers; none where another comb has them already.
    pub(super) masses: [Moments; 2],
    /// Isolated parts in the shape of its fingers.
    pub(super) loose: Vec<usize>,
}

/// All combs of a layer, and the fingers in them.
pub(super) fn combs(parts: &[Part]) -> (Vec<FingerArray>, Vec<Finger>) {
    let all: Vec<Finger> = parts.iter().enumerate().flat_map(|(k, part)| fingers(k, part)).collect();
    let (pairs, apart): (Vec<NeighbourFingers>, Vec<NeighbourFingers>) =
        neighbours(&all).into_iter().partition(|p| p.fingers.iter().all(|k| !all[*k].loose));
    let mut sets = Sets::new(all.len());
    for pair in &pairs {
        sets.join(pair.fingers[0], pair.fingers[1]);
    }
    let mut order: Vec<(usize, &NeighbourFingers)> = pairs.iter().map(|p| (sets.first(p.fingers[0]), p)).collect();
    order.sort_by(|a, b| {
        let keys = |p: &NeighbourFingers| (p.parts.to_owned(), p.fingers.to_owned());
        a.0.cmp(&b.0).then(a.1.gap.total_cmp(&b.1.gap)).then(keys(a.1).cmp(&keys(b.1)))
    });
    let mut groups: Vec<(usize, Vec<&NeighbourFingers>)> = Vec::new();
    for (set, pair) in order {
        let fits = |(s, group): &&mut (usize, Vec<&NeighbourFingers>)| {
            *s == set
                && group[0].parts == pair.parts
                && (group[0].gap - pair.gap).abs() <= ALIKE
                && (group[0].overlap - pair.overlap).abs() <= ALIKE
        };
        // groups of one set stand together at the end
        match groups.iter_mut().rev().take_while(|(s, _)| *s == set).find(fits) {
            Some((_, group)) => group.push(pair),
            None => groups.push((set, vec![pair])),
        }
    }
    let mut taken = vec![false; all.len()];
    let mut combs: Vec<FingerArray> =
        groups.iter().filter(|(_, g)| g.len() >= 2).map(|(_, group)| comb(&all, group, &mut taken)).collect();
    lone(&all, &apart, &mut combs, &mut taken);
    let used = all.into_iter().zip(taken).filter(|(_, taken)| *taken).map(|(finger, _)| finger).collect();
    (combs, used)
}

/// Two neighbours: of the parts with the smaller and the larger number.
#[derive(Debug)]
struct NeighbourFingers {
    fingers: [usize; 2],
    parts: [usize; 2],
    gap: f64,
    overlap: f64,
}

fn fingers(k: usize, part: &Part) -> Vec<Finger> {
    let (axis, found) = (&part.found.0, &part.found.1);
    let origin = part.origin();
    let mut fingers = Vec::new();
    for joint in &found.joints {
        let ([port], JointRole::Node(tip)) = (joint.ports.as_slice(), &joint.kind) else { continue };
        let limb = &found.limbs[port.limb];
        let other = &found.joints[found.at[port.limb][1 - port.end]];
        let width = 0.5 * (limb.width[0] + limb.width[1]);
        let loose = other.ports.len() == 1 && matches!(other.kind, JointRole::Node(_));
        if loose && found.limbs.len() > 1 {
            continue;
        }
        let along = if port.end == 1 { limb.direction() } else { limb.direction().map(|x| -x) };
        // sides seen from the root: the right one runs along it
        let [left, right] = if port.end == 1 { limb.sides[0] } else { [limb.sides[1][1], limb.sides[1][0]] };
        let behind = |p: [f64; 2]| (tip[0] - p[0]) * along[0] + (tip[1] - p[1]) * along[1];
        let corners = [right, axis.next[left as usize]];
        let reach = corners.map(|c| behind(axis.points[c as usize]));
        let long = if loose { limb.length() + width } else { reach[0].min(reach[1]) };
        if long < SLENDER * width || (limb.width[0] - limb.width[1]).abs() > ALIKE {
            continue;
        }
        let root = [tip[0] - long * along[0], tip[1] - long * along[1]];
        // a side that extends beyond the root is cut there
        let ends = [0, 1].map(|i| {
            let p = axis.points[corners[i] as usize];
            let on = reach[i] - long;
            let at = if on > ALIKE { [p[0] + on * along[0], p[1] + on * along[1]] } else { p };
            [0, 1].map(|c| (at[c] + origin[c]).round() as i32)
        });
        let root = [root[0] + origin[0], root[1] + origin[1]];
        fingers.push(Finger { part: k, root, along, long, width, cut: corners, ends, loose });
    }
    fingers
}

/// Nearest opposite fingers on each side, where both are each other's nearest.
fn neighbours(all: &[Finger]) -> Vec<NeighbourFingers> {
    let extents: Vec<Extent> = all
        .iter()
        .map(|f| {
            let tip = [f.root[0] + f.long * f.along[0], f.root[1] + f.long * f.along[1]];
            let far = WIDEST_GAP * f.width + f.width;
            let [low, high] = boxes::around([f.root, tip]);
            [low.map(|x| x - far), high.map(|x| x + far)]
        })
        .collect();
    let tree = Boxes::of(&extents);
    // for each finger the nearest on its right and left: its number, gap, overlap
    let mut nearest: Vec<[Option<(usize, f64, f64)>; 2]> = vec![[None; 2]; all.len()];
    for (i, f) in all.iter().enumerate() {
        budget::check();
        for j in tree.overlapping(&extents[i]).into_iter().map(|j| j as usize) {
            let g = &all[j];
            if g.part == f.part || f.along[0] * g.along[0] + f.along[1] * g.along[1] > OPPOSITE {
                continue;
            }
            let d = [g.root[0] - f.root[0], g.root[1] - f.root[1]];
            let (ahead, left) = (d[0] * f.along[0] + d[1] * f.along[1], f.along[0] * d[1] - f.along[1] * d[0]);
            let (overlap, gap) = (f.long + g.long - ahead, left.abs() - 0.5 * (f.width + g.width));
            let wide = WIDEST_GAP * f.width.max(g.width);
            if overlap <= 0.0 || overlap > f.long.min(g.long) || gap <= 0.0 || gap > wide {
                continue;
            }
            let side = usize::from(left > 0.0);
            if nearest[i][side].is_none_or(|(_, other, _)| gap < other) {
                nearest[i][side] = Some((j, gap, overlap));
            }
        }
    }
    let mut pairs = Vec::new();
    for (i, sides) in nearest.iter().enumerate() {
        for (j, gap, overlap) in sides.iter().flatten() {
            let mutual = nearest[*j].iter().flatten().any(|(k, ..)| *k == i);
            if mutual && all[i].part < all[*j].part {
                let parts = [all[i].part, all[*j].part];
                pairs.push(NeighbourFingers { fingers: [i, *j], parts, gap: *gap, overlap: *overlap });
            }
        }
    }
    pairs
}

fn comb(all: &[Finger], group: &[&NeighbourFingers], taken: &mut [bool]) -> FingerArray {
    let count = group.len() as f64;
    let along = all[group[0].fingers[0]].along;
    let mean = |value: &dyn Fn(&NeighbourFingers) -> f64| group.iter().map(|p| value(p)).sum::<f64>() / count;
    let seen = |p: [f64; 2]| [p[0] * along[0] + p[1] * along[1], along[0] * p[1] - along[1] * p[0]];
    let across = mean(&|p| 0.5 * p.fingers.iter().map(|k| seen(all[*k].root)[1]).sum::<f64>());
    let roots = [0, 1].map(|i| {
        let ahead = mean(&|p| seen(all[p.fingers[i]].root)[0]);
        [ahead * along[0] - across * along[1], ahead * along[1] + across * along[0]]
    });
    let (mut fingers, mut masses) = ([0; 2], [Moments::default(); 2]);
    for i in 0..2 {
        let mut own: Vec<usize> = group.iter().map(|p| p.fingers[i]).collect();
        own.sort_unstable();
        own.dedup();
        fingers[i] = own.len();
        for k in own {
            if !std::mem::replace(&mut taken[k], true) {
                masses[i] += all[k].area();
            }
        }
    }
    FingerArray {
        parts: group[0].parts,
        roots,
        gaps: group.len(),
        fingers,
        gap: mean(&|p| p.gap),
        overlap: mean(&|p| p.overlap),
        width: mean(&|p| 0.5 * p.fingers.iter().map(|k| all[*k].width).sum::<f64>()),
        masses,
        loose: Vec::new(),
    }
}

/// Fingers whose only neighbours are unassigned fingers of one comb belong to it too; the remaining ones are reported.
fn lone(all: &[Finger], apart: &[NeighbourFingers], combs: &mut [FingerArray], taken: &mut [bool]) {
    for pair in apart {
        let [a, b] = pair.fingers;
        let (own, other) = if all[b].loose { (a, b) } else { (b, a) };
        let alike = |c: &&mut FingerArray| {
            (c.gap - pair.gap).abs() <= ALIKE
                && (c.overlap - pair.overlap).abs() <= ALIKE
                && c.parts.contains(&all[own].part)
                && !all[own].loose
        };
        let Some(comb) = combs.iter_mut().find(alike) else { continue };
        let side = usize::from(comb.parts[1] == all[own].part);
        if !std::mem::replace(&mut taken[own], true) {
            comb.fingers[side] += 1;
            comb.masses[side] += all[own].area();
        }
        if !comb.loose.contains(&all[other].part) {
            comb.loose.push(all[other].part);
        }
    }
}

impl Finger {
    fn area(&self) -> Moments {
        let [x, y] = self.along;
        let at = |s: f64, t: f64| {
            let (s, t) = (s * self.long, t * self.width);
            [self.root[0] + s * x - t * y, self.root[1] + s * y + t * x]
        };
        Moments::of(&[at(0.0, -0.5), at(1.0, -0.5), at(1.0, 0.5), at(0.0, 0.5)])
    }
}

/// A part without its fingers.
pub(super) fn without(part: &Part, fingers: &[&Finger]) -> Polygon {
    let axis = &part.found.0;
    let mut drop = vec![false; axis.points.len()];
    let mut ends = vec![None; axis.points.len()];
    for finger in fingers {
        let [from, to] = finger.cut;
        let mut v = axis.next[from as usize];
        while v != to {
            drop[v as usize] = true;
            v = axis.next[v as usize];
        }
        ends[from as usize] = Some(finger.ends[0]);
        ends[to as usize] = Some(finger.ends[1]);
    }
    let mut point = 0;
    let keep = |contour: &Vec<GridPoint>| -> Vec<GridPoint> {
        let mut kept: Vec<GridPoint> = Vec::with_capacity(contour.len());
        for p in contour {
            if !drop[point] {
                kept.push(*p);
                // the cut of an extended side is next to its corner
                if let Some(end) = ends[point].filter(|end| end != p) {
                    let before = fingers.iter().any(|f| f.cut[1] as usize == point);
                    kept.insert(kept.len() - usize::from(before), end);
                }
            }
            point += 1;
        }
        kept.dedup();
        kept
    };
    // the axis counts points as it led edges through them
    let split = super::snap::split(&part.polygon);
    let polygon = split.as_ref().unwrap_or(&part.polygon);
    Polygon { contours: polygon.contours.iter().map(keep).collect() }
}
