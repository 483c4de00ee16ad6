//! What holds a layer: where its anchors lie, and which stretches of a line run over them.

use super::boxes::{self, Boxes, Extent};
use super::medial::Medial;
use crate::layout::drawing::{Drawing, Polygon};
use crate::layout::process::{self, Layer};
use crate::layout::regions;

/// What tells which parts are held.
#[derive(Debug)]
pub(super) enum Rule {
    /// Polygons that hold.
    Drawn(Held),
    /// Parts wider than twice this many database units are held.
    Wide(f64),
    /// Nothing is drawn: pads at the end of a single limb, and parts without limbs, are held.
    Pads,
}

/// Polygons that hold, found by place.
#[derive(Debug)]
pub(super) struct Held {
    polygons: Vec<Vec<Vec<[f64; 2]>>>,
    boxes: Boxes,
}

fn drawn(drawing: &Drawing, names: &[String]) -> Vec<Polygon> {
    let of = drawing.layers.iter().filter(|(name, _)| process::names(names, name));
    of.flat_map(|(_, polygons)| polygons.iter().cloned()).collect()
}

/// Everything that is drawn to say what of a layer is held.
pub(super) fn marks(drawing: &Drawing, layer: &Layer) -> Vec<Polygon> {
    [&layer.anchoring.drawn, &layer.anchoring.released].iter().flat_map(|names| drawn(drawing, names)).collect()
}

impl Rule {
    /// The rule for a layer of a drawing, as [`process::Anchoring`] says.
    pub(super) fn of(drawing: &Drawing, layer: &Layer, solid: &[Polygon]) -> Self {
        let anchors = drawn(drawing, &layer.anchoring.drawn);
        if !anchors.is_empty() {
            return Self::Drawn(Held::of(&regions::intersection(solid, &anchors)));
        }
        let released = drawn(drawing, &layer.anchoring.released);
        if !released.is_empty() {
            return Self::Drawn(Held::of(&regions::difference(solid, &released)));
        }
        layer.anchoring.undercut.map_or(Self::Pads, |reach| Self::Wide(reach / drawing.unit_m))
    }
}

impl Held {
    fn of(polygons: &[Polygon]) -> Self {
        let float = |p: &Polygon| -> Vec<Vec<[f64; 2]>> {
            p.contours.iter().map(|c| c.iter().map(|[x, y]| [f64::from(*x), f64::from(*y)]).collect()).collect()
        };
        let polygons: Vec<_> = polygons.iter().map(float).collect();
        let extents: Vec<Extent> = polygons.iter().map(|p| boxes::around(p.iter().flatten().copied())).collect();
        Self { boxes: Boxes::of(&extents), polygons }
    }

    /// Whether a point lies in one of them.
    pub(super) fn holds(&self, p: [f64; 2]) -> bool {
        self.boxes.overlapping(&[p, p]).iter().any(|k| inside(&self.polygons[*k as usize], p))
    }

    /// Whether one of them overlaps an area of the axis.
    pub(super) fn touches(&self, axis: &Medial, origin: [f64; 2], edges: &[u32]) -> bool {
        let cells = edges.iter().map(|e| {
            let edge = &axis.edges[*e as usize];
            axis.outline(edge.ends, edge.sites).map(|p| [p[0] + origin[0], p[1] + origin[1]])
        });
        cells.filter(|cell| cell.iter().any(|p| *p != cell[0])).any(|cell| {
            let near = self.boxes.overlapping(&boxes::around(cell));
            near.iter().any(|k| overlap(&self.polygons[*k as usize], &cell))
        })
    }

    /// Stretches of the line from `a` to `b` over them, as shares of its length, in order and disjoint.
    pub(super) fn over(&self, a: [f64; 2], b: [f64; 2]) -> Vec<[f64; 2]> {
        let mut cuts = vec![0.0, 1.0];
        let near = self.boxes.overlapping(&boxes::around([a, b]));
        for contour in near.iter().flat_map(|k| &self.polygons[*k as usize]) {
            for (p, q) in contour.iter().zip(contour.iter().cycle().skip(1)) {
                let d = [b[0] - a[0], b[1] - a[1]];
                let e = [q[0] - p[0], q[1] - p[1]];
                let across = d[0] * e[1] - d[1] * e[0];
                let f = [p[0] - a[0], p[1] - a[1]];
                let (t, s) = ((f[0] * e[1] - f[1] * e[0]) / across, (f[0] * d[1] - f[1] * d[0]) / across);
                if across != 0.0 && (0.0..=1.0).contains(&t) && (0.0..=1.0).contains(&s) {
                    cuts.push(t);
                }
            }
        }
        cuts.sort_by(f64::total_cmp);
        let mut covered: Vec<[f64; 2]> = Vec::new();
        for pair in cuts.windows(2).filter(|pair| pair[1] - pair[0] > 1e-9) {
            let t = 0.5 * (pair[0] + pair[1]);
            if near
                .iter()
                .any(|k| inside(&self.polygons[*k as usize], [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]))
            {
                match covered.last_mut() {
                    Some(last) if last[1] >= pair[0] - 1e-9 => last[1] = pair[1],
                    _ => covered.push([pair[0], pair[1]]),
                }
            }
        }
        covered
    }
}

/// Whether a point lies inside contours, by the even-odd rule.
pub(super) fn inside(contours: &[Vec<[f64; 2]>], p: [f64; 2]) -> bool {
    let mut odd = false;
    for contour in contours {
        for (a, b) in contour.iter().zip(contour.iter().cycle().skip(1)) {
            if (a[1] > p[1]) != (b[1] > p[1]) && p[0] < a[0] + (b[0] - a[0]) * (p[1] - a[1]) / (b[1] - a[1]) {
                odd = !odd;
            }
        }
    }
    odd
}

/// Whether a polygon and a cell share some area.
pub(super) fn overlap(polygon: &[Vec<[f64; 2]>], cell: &[[f64; 2]]) -> bool {
    let middle = |points: &[[f64; 2]]| {
        let n = points.len() as f64;
        [points.iter().map(|p| p[0]).sum::<f64>() / n, points.iter().map(|p| p[1]).sum::<f64>() / n]
    };
    let outline = [cell.to_vec()];
    inside(polygon, middle(cell))
        || polygon.iter().flatten().any(|p| inside(&outline, *p))
        || polygon.iter().any(|contour| {
            contour.iter().zip(contour.iter().cycle().skip(1)).any(|(p, q)| {
                cell.iter().zip(cell.iter().cycle().skip(1)).any(|(a, b)| {
                    let side = |p: &[f64; 2], q: &[f64; 2], r: &[f64; 2]| {
                        (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
                    };
                    side(p, q, a) * side(p, q, b) < 0.0 && side(a, b, p) * side(a, b, q) < 0.0
                })
            })
        })
}
