//! Edges that pass a corner of another polygon within a grid unit or two are led through it.
//!
//! Polygons that are drawn edge to edge at an angle do not meet on the grid: rounding leaves slits between them, less than a unit wide
//! and as long as the edge. Through their common corners they meet exactly. Cost: n log n for edges of like lengths.

use super::boxes::{self, Boxes, Extent};
use crate::drawing::{GridPoint, Polygon};
use bimorph_base::budget;

/// Corners up to this far from an edge are put on it (database units).
const NEAR: f64 = 1.5;

/// The polygons with corners near their edges put on them; none when nothing is near.
pub(super) fn snap(polygons: &[Polygon]) -> Option<Vec<Polygon>> {
    lead_through(polygons, |off| off != 0.0 && off.abs() <= NEAR)
}

/// A polygon whose edges have a corner wherever another of its corners touches them; none where none does.
pub(super) fn split(polygon: &Polygon) -> Option<Polygon> {
    lead_through(std::slice::from_ref(polygon), |off| off == 0.0)?.pop()
}

/// Edges are led through corners at a distance that `wanted` says yes to.
fn lead_through(polygons: &[Polygon], wanted: impl Fn(f64) -> bool) -> Option<Vec<Polygon>> {
    let float = |p: GridPoint| p.map(f64::from);
    let edges = || {
        let contours = polygons.iter().flat_map(|polygon| &polygon.contours);
        contours.flat_map(|c| c.iter().zip(c.iter().cycle().skip(1)).map(|(p, q)| (*p, *q)))
    };
    let length =
        |(p, q): &(GridPoint, GridPoint)| (f64::from(q[0]) - f64::from(p[0])).hypot(f64::from(q[1]) - f64::from(p[1]));
    let count = edges().count();
    let chunk = 4.0 * edges().map(|e| length(&e)).sum::<f64>() / count.max(1) as f64;
    // long edges at an angle have large boxes: they are tested piece by piece
    let (mut owners, mut extents): (Vec<u32>, Vec<Extent>) = (Vec::new(), Vec::new());
    for (k, edge) in edges().enumerate() {
        let (p, q) = (float(edge.0), float(edge.1));
        let pieces =
            if p[0] == q[0] || p[1] == q[1] { 1 } else { (length(&edge) / chunk).ceil().clamp(1.0, 64.0) as u32 };
        for i in 0..pieces {
            let at = |i: u32| [0, 1].map(|c| p[c] + (q[c] - p[c]) * f64::from(i) / f64::from(pieces));
            let [low, high] = boxes::around([at(i), at(i + 1)]);
            owners.push(k as u32);
            extents.push([low.map(|x| x - NEAR), high.map(|x| x + NEAR)]);
        }
    }
    let tree = Boxes::of(&extents);
    let all: Vec<(GridPoint, GridPoint)> = edges().collect();
    let mut corners: Vec<GridPoint> = all.iter().map(|e| e.0).collect();
    corners.sort_unstable();
    corners.dedup();
    let mut on: Vec<(u32, f64, GridPoint)> = Vec::new();
    for corner in corners {
        budget::check();
        let c = float(corner);
        let mut last = u32::MAX;
        for k in tree.overlapping(&[c, c]).into_iter().map(|k| owners[k as usize]) {
            let edge = all[k as usize];
            if k == last || edge.0 == corner || edge.1 == corner {
                continue;
            }
            let (p, q) = (float(edge.0), float(edge.1));
            let (d, f) = ([q[0] - p[0], q[1] - p[1]], [c[0] - p[0], c[1] - p[1]]);
            let l = d[0].hypot(d[1]);
            let (along, off) = ((f[0] * d[0] + f[1] * d[1]) / l, (f[0] * d[1] - f[1] * d[0]) / l);
            if wanted(off) && along > 0.0 && along < l {
                on.push((k, along, corner));
                last = k;
            }
        }
    }
    if on.is_empty() {
        return None;
    }
    on.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
    let (mut k, mut next) = (0u32, 0usize);
    let through = |contour: &Vec<GridPoint>| {
        let mut led = Vec::with_capacity(contour.len());
        for p in contour {
            led.push(*p);
            while on.get(next).is_some_and(|(edge, ..)| *edge == k) {
                led.push(on[next].2);
                next += 1;
            }
            k += 1;
        }
        led
    };
    let contours: Vec<Vec<GridPoint>> = polygons.iter().flat_map(|p| &p.contours).map(through).collect();
    let mut contours = contours.into_iter();
    Some(polygons.iter().map(|p| Polygon { contours: contours.by_ref().take(p.contours.len()).collect() }).collect())
}

#[cfg(test)]
mod tests {
    //! Two boxes drawn end to end at an angle become one part. Source: drawn at 37°, the joint lies between grid points.
    use super::*;
    use crate::regions;

    #[test]
    fn boxes_end_to_end() {
        let (s, c) = 37f64.to_radians().sin_cos();
        let turned = |[x, y]: [f64; 2]| [(c * x - s * y).round() as i32, (s * x + c * y).round() as i32];
        let box_of = |x: f64, w: f64| {
            let corners = [[x, -w], [x + 9000.0, -w], [x + 9000.0, w], [x, w]];
            Polygon::from_contour(corners.iter().map(|p| turned(*p)).collect())
        };
        for start in [0.0, 311.3, 1234.5] {
            let drawn = [box_of(start, 3000.0), box_of(start + 9000.0, 1000.0)];
            let whole = regions::union(&snap(&drawn).unwrap_or(drawn.to_vec()));
            assert_eq!(whole.len(), 1, "{whole:?}");
            let area = regions::area(&whole);
            assert!((area / 72e6 - 1.0).abs() < 5e-4, "{area}");
        }
        assert_eq!(snap(&[Polygon::rectangle([0, 0], [9, 9]), Polygon::rectangle([9, 3], [20, 6])]), None);
    }
}
