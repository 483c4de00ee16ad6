//! How wide a region is across a line: distances from a point to the nearest edges.
//!
//! Edges lie in the buckets of a uniform grid, some few in each, so that a query costs only nearby edges.

use super::drawing::Polygon;

/// Edges a bucket, on average.
const EDGES_PER_BUCKET: f64 = 2.0;
/// Most buckets along one side.
const MAX_BUCKETS: f64 = 4096.0;

/// Edges of disjoint polygons, findable by place.
#[derive(Debug)]
pub(crate) struct Chords {
    low: [f64; 2],
    size: f64,
    columns: usize,
    rows: usize,
    buckets: Vec<Vec<u32>>,
    edges: Vec<[[f64; 2]; 2]>,
}

impl Chords {
    /// Sorts the edges of a region.
    pub(crate) fn new(polygons: &[Polygon]) -> Self {
        let mut edges = Vec::new();
        for contour in polygons.iter().flat_map(|p| &p.contours) {
            for (k, p) in contour.iter().enumerate() {
                edges.push([*p, contour[(k + 1) % contour.len()]].map(|[x, y]| [f64::from(x), f64::from(y)]));
            }
        }
        let all = || edges.iter().flatten();
        let low = [0, 1].map(|i| all().map(|p| p[i]).fold(f64::INFINITY, f64::min));
        let high = [0, 1].map(|i| all().map(|p| p[i]).fold(f64::NEG_INFINITY, f64::max));
        let [width, height] =
            [high[0] - low[0], high[1] - low[1]].map(|s| if s.is_finite() { s.max(1.0) } else { 1.0 });
        let wanted = (edges.len() as f64 / EDGES_PER_BUCKET).max(1.0);
        let size = (width * height / wanted).sqrt().max(width.max(height) / MAX_BUCKETS);
        let (columns, rows) = ((width / size) as usize + 1, (height / size) as usize + 1);
        let mut chords =
            Self { low, size, columns, rows, buckets: vec![Vec::new(); columns * rows], edges: Vec::new() };
        for (k, edge) in edges.iter().enumerate() {
            // An edge goes into the buckets that it passes, column by column.
            for bucket in chords.passed(*edge) {
                chords.buckets[bucket].push(k as u32);
            }
        }
        chords.edges = edges;
        chords
    }

    fn column(&self, x: f64) -> usize {
        (((x - self.low[0]) / self.size).max(0.0) as usize).min(self.columns - 1)
    }

    fn row(&self, y: f64) -> usize {
        (((y - self.low[1]) / self.size).max(0.0) as usize).min(self.rows - 1)
    }

    /// Buckets that a segment passes.
    fn passed(&self, [p, q]: [[f64; 2]; 2]) -> Vec<usize> {
        let (p, q) = if p[0] <= q[0] { (p, q) } else { (q, p) };
        let mut all = Vec::new();
        for column in self.column(p[0])..=self.column(q[0]) {
            let (from, to) = (self.low[0] + column as f64 * self.size, self.low[0] + (column + 1) as f64 * self.size);
            let at = |x: f64| {
                if q[0] > p[0] { p[1] + (q[1] - p[1]) * ((x - p[0]) / (q[0] - p[0])).clamp(0.0, 1.0) } else { p[1] }
            };
            let (y0, y1) = if q[0] > p[0] { (at(from), at(to)) } else { (p[1], q[1]) };
            let (y0, y1) = (y0.min(y1), y0.max(y1));
            all.extend((self.row(y0)..=self.row(y1)).map(|row| row * self.columns + column));
        }
        all
    }

    /// Distances from `p` to the nearest edges along `normal` (a unit vector) and against it, up to `reach`; `None`
    /// without an edge within `reach`.
    pub(crate) fn across(&self, p: [f64; 2], normal: [f64; 2], reach: f64) -> [Option<f64>; 2] {
        let end = |s: f64| [p[0] + s * normal[0], p[1] + s * normal[1]];
        let mut nearest = [None::<f64>; 2];
        for bucket in self.passed([end(-reach), end(reach)]) {
            for &k in &self.buckets[bucket] {
                let [a, b] = self.edges[k as usize];
                // p + s·normal = a + t·(b − a)
                let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
                let det = dx * normal[1] - dy * normal[0];
                if det.abs() <= 1e-9 * dx.hypot(dy) {
                    continue;
                }
                let (rx, ry) = (a[0] - p[0], a[1] - p[1]);
                let s = (dx * ry - dy * rx) / det;
                let t = (normal[0] * ry - normal[1] * rx) / det;
                if !(-1e-9..=1.0 + 1e-9).contains(&t) || s.abs() > reach {
                    continue;
                }
                let side = usize::from(s < 0.0);
                nearest[side] = Some(nearest[side].map_or(s.abs(), |n| n.min(s.abs())));
            }
        }
        nearest
    }
}

#[cfg(test)]
mod tests {
    //! Widths across boxes are those of the boxes, straight and turned. Source: by hand.
    use super::*;

    #[test]
    fn across_boxes() {
        let boxes: Vec<Polygon> = (0..50).map(|k| Polygon::rectangle([100 * k, 0], [100 * k + 40, 1000])).collect();
        let chords = Chords::new(&boxes);
        assert_eq!(chords.across([2010.0, 500.0], [1.0, 0.0], 50.0), [Some(30.0), Some(10.0)]);
        assert_eq!(chords.across([2010.0, 500.0], [1.0, 0.0], 20.0), [None, Some(10.0)]);
        assert_eq!(chords.across([2010.0, 999.0], [0.0, 1.0], 20.0), [Some(1.0), None]);
        let turned = Polygon::from_contour(vec![[0, 0], [400, 300], [394, 308], [-6, 8]]);
        let [up, down] = Chords::new(&[turned]).across([197.0, 154.0], [-0.6, 0.8], 100.0);
        assert!((up.unwrap() - 5.0).abs() < 1e-9 && (down.unwrap() - 5.0).abs() < 1e-9);
        assert_eq!(Chords::new(&[]).across([0.0, 0.0], [1.0, 0.0], 9.0), [None, None]);
    }
}
