//! Many areas with holes, found by place: which of them hold a point, which overlap a cell, which stretches of a line lie over them.
//!
//! A query costs the edges near it alone. Inside and outside follow from a ray to the right by the even-odd rule (M.
//! Shimrat, Algorithm 112, CACM 5, 1962), on edges sorted by position.

use super::boxes::{self, Boxes, Extent};
use crate::drawing::Polygon;

/// Bytes of a point: its edge and its box.
pub(super) const BYTES_PER_POINT: usize = 112;

/// An edge of an area.
#[derive(Debug, Clone, Copy)]
struct AreaEdge {
    a: [f64; 2],
    b: [f64; 2],
    of: u32,
}

/// Areas, by number.
#[derive(Debug)]
pub(super) struct AreaIndex {
    extents: Vec<Extent>,
    near: Boxes,
    edges: Vec<AreaEdge>,
    /// Boxes of the edges.
    tree: Boxes,
}

impl AreaIndex {
    /// Of polygons (database units), in their order. Cost: n log n.
    pub(super) fn of<'a>(polygons: impl IntoIterator<Item = &'a Polygon>) -> Self {
        let (mut edges, mut extents) = (Vec::new(), Vec::new());
        for (of, polygon) in polygons.into_iter().enumerate() {
            bimorph_base::budget::check();
            for contour in &polygon.contours {
                let next = contour.iter().cycle().skip(1);
                let edge = |(a, b): (&[i32; 2], &[i32; 2])| AreaEdge {
                    a: a.map(f64::from),
                    b: b.map(f64::from),
                    of: of as u32,
                };
                edges.extend(contour.iter().zip(next).map(edge));
            }
            extents.push(boxes::around(polygon.contours.iter().flatten().map(|p| p.map(f64::from))));
        }
        let boxes: Vec<Extent> = edges.iter().map(|e| boxes::around([e.a, e.b])).collect();
        Self { near: Boxes::of(&extents), tree: Boxes::of(&boxes), extents, edges }
    }

    /// Number of areas.
    pub(super) fn len(&self) -> usize {
        self.extents.len()
    }

    fn edges(&self, window: &Extent) -> impl Iterator<Item = &AreaEdge> {
        self.tree.overlapping(window).into_iter().map(|k| &self.edges[k as usize])
    }

    /// Those in which a point lies, in order.
    pub(super) fn holding(&self, p: [f64; 2]) -> Vec<u32> {
        let mut about = self.near.overlapping(&[p, p]);
        let Some(right) = about.iter().map(|k| self.extents[*k as usize][1][0]).reduce(f64::max) else { return about };
        let crossed = |e: &&AreaEdge| {
            (e.a[1] > p[1]) != (e.b[1] > p[1])
                && p[0] < e.a[0] + (e.b[0] - e.a[0]) * (p[1] - e.a[1]) / (e.b[1] - e.a[1])
        };
        let mut crossed: Vec<u32> = self.edges(&[p, [right, p[1]]]).filter(crossed).map(|e| e.of).collect();
        crossed.sort_unstable();
        let odd = |k: &u32| crossed.partition_point(|of| of <= k) - crossed.partition_point(|of| of < k);
        about.retain(|k| odd(k) % 2 == 1);
        about
    }

    /// Those that share some area with a cell, in order.
    pub(super) fn overlapping(&self, cell: &[[f64; 2]]) -> Vec<u32> {
        let n = cell.len() as f64;
        let middle = [0, 1].map(|i| cell.iter().map(|p| p[i]).sum::<f64>() / n);
        let mut found = self.holding(middle);
        let outline = [cell.to_vec()];
        let sides: Vec<_> = cell.iter().zip(cell.iter().cycle().skip(1)).collect();
        let side =
            |p: &[f64; 2], q: &[f64; 2], r: &[f64; 2]| (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
        let meets = |e: &&AreaEdge| {
            let (p, q) = (&e.a, &e.b);
            inside(&outline, e.a)
                || inside(&outline, e.b)
                || sides.iter().any(|(a, b)| side(p, q, a) * side(p, q, b) < 0.0 && side(a, b, p) * side(a, b, q) < 0.0)
        };
        found.extend(self.edges(&boxes::around(cell.iter().copied())).filter(meets).map(|e| e.of));
        found.sort_unstable();
        found.dedup();
        found
    }

    /// Stretches of the line from `a` to `b` over them, as fractions of its length, in order and disjoint.
    pub(super) fn over(&self, a: [f64; 2], b: [f64; 2]) -> Vec<[f64; 2]> {
        let mut cuts = vec![0.0, 1.0];
        let d = [b[0] - a[0], b[1] - a[1]];
        for AreaEdge { a: p, b: q, .. } in self.edges(&boxes::around([a, b])) {
            let e = [q[0] - p[0], q[1] - p[1]];
            let across = d[0] * e[1] - d[1] * e[0];
            let f = [p[0] - a[0], p[1] - a[1]];
            let (t, s) = ((f[0] * e[1] - f[1] * e[0]) / across, (f[0] * d[1] - f[1] * d[0]) / across);
            if across != 0.0 && (0.0..=1.0).contains(&t) && (0.0..=1.0).contains(&s) {
                cuts.push(t);
            }
        }
        cuts.sort_by(f64::total_cmp);
        let mut covered: Vec<[f64; 2]> = Vec::new();
        for pair in cuts.windows(2).filter(|pair| pair[1] - pair[0] > 1e-9) {
            let t = 0.5 * (pair[0] + pair[1]);
            if !self.holding([a[0] + t * d[0], a[1] + t * d[1]]).is_empty() {
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

/// How far a point lies outside a convex or nearly convex outline; 0 inside.
pub(super) fn distance(outline: &[[f64; 2]], p: [f64; 2]) -> f64 {
    if inside(&[outline.to_vec()], p) {
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

#[cfg(test)]
mod tests {
    //! The same as a search of all edges; a plane with many holes.
    use super::*;

    /// A plane of n × n holes of 4 by 4 in steps of 10.
    fn perforated(n: i32) -> Polygon {
        let mut plane = Polygon::rectangle([0, 0], [10 * n, 10 * n]);
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (10 * i + 3, 10 * j + 3))) {
            plane.contours.push(vec![[i, j], [i, j + 4], [i + 4, j + 4], [i + 4, j]]);
        }
        plane
    }

    /// Points and cells on, in and beside a perforated plane, a box in one of its holes, and a box that overlaps it: as counted by hand.
    #[test]
    fn a_perforated_plane() {
        let others = [Polygon::rectangle([14, 14], [16, 16]), Polygon::rectangle([-5, 1], [2, 2])];
        let areas = AreaIndex::of([perforated(3)].iter().chain(&others));
        assert_eq!(areas.len(), 3);
        let holding = [([1.0, 0.5], vec![0]), ([1.0, 1.5], vec![0, 2]), ([5.0, 5.0], vec![]), ([15.0, 15.0], vec![1])];
        for (p, want) in holding.into_iter().chain([([-1.0, 0.5], vec![]), ([31.0, 5.0], vec![])]) {
            assert_eq!(areas.holding(p), want, "{p:?}");
        }
        let cell = |[x0, y0]: [f64; 2], [x1, y1]: [f64; 2]| vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]];
        assert!(areas.overlapping(&cell([4.0, 4.0], [6.0, 6.0])).is_empty());
        assert_eq!(areas.overlapping(&cell([4.0, 4.0], [8.0, 6.0])), [0]);
        assert_eq!(areas.overlapping(&cell([13.5, 13.5], [16.5, 16.5])), [1]);
        assert_eq!(areas.overlapping(&cell([-9.0, -9.0], [99.0, 99.0])), [0, 1, 2]);
        // over holes 3 to 7 and 23 to 27, and the box in the middle one
        let stretches = [[0.0, 3.0], [7.0, 13.0], [14.0, 16.0], [17.0, 23.0], [27.0, 30.0]];
        let over = areas.over([0.0, 15.0], [30.0, 15.0]);
        let near = |(got, want): (&[f64; 2], &[f64; 2])| (0..2).all(|i| (got[i] * 30.0 - want[i]).abs() < 1e-9);
        assert!(over.len() == 5 && over.iter().zip(&stretches).all(near), "{over:?}");
    }

    /// For any other content of a plane, a query meets few of its edges: on a ray, those of a row of holes; at a cell,
    /// those near it.
    #[test]
    fn questions_meet_few_edges() {
        let areas = AreaIndex::of([&perforated(200)]);
        let all = areas.edges.len();
        let (ray, cell) = ([[995.0, 995.0], [2000.0, 995.0]], [[990.0, 990.0], [1010.0, 1010.0]]);
        assert!(areas.edges(&ray).count() * 200 < all && areas.edges(&cell).count() <= 20, "{all}");
    }
}
