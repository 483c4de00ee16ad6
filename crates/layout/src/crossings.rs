//! Number of intersections between polygon edges, which bounds the output of a set operation before it runs.
//!
//! Contours are taken in runs of a few edges. A sweep over x keeps the active runs in an interval tree over y. Each run
//! lies at the O(log n) nodes that cover its range. The edges of a new run are tested against those of the active runs
//! with an overlapping range. O(n·log n) where edges are along x or y, and never more than all pairs.
//!
//! Reference: F. P. Preparata, M. I. Shamos, "Computational Geometry" (1985), 8.8 (rectangles that meet, by interval trees).

use super::drawing::{GridPoint, Polygon};
use thiserror::Error;

/// Cuts that set operations take on: some 200 bytes each.
pub const MAX_CUTS: usize = 4_000_000;
const BYTES_PER_CUT: usize = 200;
/// Memory of the counter for each edge (bytes).
const BYTES_PER_EDGE: usize = 200;
/// Sum over slanted edges of the squares of how many cuts each has. Crossings of slanted edges are rounded to the grid,
/// which moves the pieces between them and forces further passes of the set operation. A star of n mutually crossing
/// edges takes n³ (0.1 s at n = 250).
const MAX_DENSE: u64 = 20_000_000;
/// Up to so many edges cannot come to that.
const FEW: usize = 250;
/// Pairs of runs that are tested: parallel long lines on a slope that never intersect can reach this.
const MAX_TRIED: usize = 50_000_000;

/// Polygons whose union could be too large to hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error(
    "its polygons cut one another in more than {MAX_CUTS} places, or slanted ones each in hundreds, or many long slanted ones lie side by \
     side, about point {} {} of its grid", .at[0], .at[1]
)]
pub struct CrossingContours {
    /// Where the counting ended (database units).
    pub at: GridPoint,
}

/// Checks polygons before a set operation on all of them.
///
/// # Errors
/// [`CrossingContours`] beyond [`MAX_CUTS`], or where slanted edges cut one another too often each.
pub(super) fn bounded<'a>(polygons: impl Iterator<Item = &'a Polygon>) -> Result<(), CrossingContours> {
    let edges: Vec<Vec<ContourEdge>> = polygons.flat_map(|p| &p.contours).map(|c| edges_of(c).collect()).collect();
    let all = edges.iter().map(Vec::len).sum::<usize>();
    // fewer pairs than cuts that are taken on
    let slanted = edges.iter().flatten().filter(|e| e.slanted()).count();
    if all.saturating_mul(all) / 2 <= MAX_CUTS && slanted <= FEW {
        return Ok(());
    }
    bimorph_base::budget::lay_out(all.saturating_mul(BYTES_PER_EDGE));
    let cuts = SweepLine::new(runs(&edges)).count(MAX_CUTS)?;
    bimorph_base::budget::lay_out(cuts.saturating_mul(BYTES_PER_CUT));
    Ok(())
}

/// From the lesser end to the greater, by x, then y.
#[derive(Debug, Clone, Copy)]
struct ContourEdge {
    a: GridPoint,
    b: GridPoint,
}

fn edges_of(contour: &[GridPoint]) -> impl Iterator<Item = ContourEdge> {
    let next = contour.iter().cycle().skip(1);
    contour.iter().zip(next).filter(|(a, b)| a != b).map(|(a, b)| ContourEdge { a: *a.min(b), b: *a.max(b) })
}

impl ContourEdge {
    fn low(&self) -> i32 {
        self.a[1].min(self.b[1])
    }

    fn high(&self) -> i32 {
        self.a[1].max(self.b[1])
    }

    fn slanted(&self) -> bool {
        self.a[0] != self.b[0] && self.a[1] != self.b[1]
    }

    fn apart(&self, other: &Self) -> bool {
        self.b[0] < other.a[0] || other.b[0] < self.a[0] || self.high() < other.low() || other.high() < self.low()
    }

    /// On which side of the edge's line a point lies.
    fn side(&self, p: GridPoint) -> i128 {
        let [ux, uy, vx, vy] =
            [self.b[0] - self.a[0], self.b[1] - self.a[1], p[0] - self.a[0], p[1] - self.a[1]].map(i128::from);
        (ux * vy - uy * vx).signum()
    }

    /// True when one of the two is divided where they meet: not for edges that share their ends alone, and not for equal ones.
    fn cuts(&self, other: &Self) -> bool {
        if self.apart(other) {
            return false;
        }
        let (p, q) = (self.side(other.a), self.side(other.b));
        let (r, s) = (other.side(self.a), other.side(self.b));
        if (p, q, r, s) == (0, 0, 0, 0) {
            // on one line: they overlap
            return (self.a, self.b) != (other.a, other.b) && self.a.max(other.a) < self.b.min(other.b);
        }
        let ends = [self.a, self.b].iter().any(|e| *e == other.a || *e == other.b);
        p * q <= 0 && r * s <= 0 && !ends
    }
}

/// Edges of a contour one after the other, and the box around them.
#[derive(Debug, Clone, Copy)]
struct EdgeRun<'a> {
    edges: &'a [ContourEdge],
    low: GridPoint,
    high: GridPoint,
}

/// Most edges of a run.
const RUN: usize = 8;

/// The runs of contours from left to right.
fn runs(contours: &[Vec<ContourEdge>]) -> Vec<EdgeRun<'_>> {
    let run = |edges| {
        let run = EdgeRun { edges, low: [i32::MAX; 2], high: [i32::MIN; 2] };
        edges.iter().fold(run, |run: EdgeRun, e| EdgeRun {
            low: [run.low[0].min(e.a[0]), run.low[1].min(e.low())],
            high: [run.high[0].max(e.b[0]), run.high[1].max(e.high())],
            ..run
        })
    };
    let mut runs: Vec<EdgeRun> = contours.iter().flat_map(|c| c.chunks(RUN)).map(run).collect();
    runs.sort_by_key(|r| r.low);
    runs
}

/// Cuts of each edge of a run with slanted ones, or of a slanted edge with any.
type Each = [u32; RUN];

impl EdgeRun<'_> {
    /// Cuts among its own edges, and by how much they add to [`MAX_DENSE`].
    fn own(&self, each: &mut Each) -> (usize, u64) {
        let (mut cuts, mut dense) = (0, 0);
        for (k, e) in self.edges.iter().enumerate() {
            for (j, f) in self.edges[..k].iter().enumerate().filter(|(_, f)| e.cuts(f)) {
                cuts += 1;
                if e.slanted() || f.slanted() {
                    dense += one_more(&mut each[k]) + one_more(&mut each[j]);
                }
            }
        }
        (cuts, dense)
    }

    /// The same with the edges of another.
    fn cuts(&self, other: &Self, [own, others]: [&mut Each; 2]) -> (usize, u64) {
        let (mut cuts, mut dense) = (0, 0);
        for (k, e) in self.edges.iter().enumerate() {
            for (j, f) in other.edges.iter().enumerate().filter(|(_, f)| e.cuts(f)) {
                cuts += 1;
                if e.slanted() || f.slanted() {
                    dense += one_more(&mut own[k]) + one_more(&mut others[j]);
                }
            }
        }
        (cuts, dense)
    }
}

/// Counts one; answers by how much the square grows.
fn one_more(count: &mut u32) -> u64 {
    *count += 1;
    2 * u64::from(*count) - 1
}

/// Runs in the tree, by the nodes that cover their range of y.
struct SweepLine<'a> {
    runs: Vec<EdgeRun<'a>>,
    /// Ends of ranges, in order.
    places: Vec<i32>,
    /// Leaves, a power of two.
    leaves: usize,
    at: Vec<Vec<u32>>,
    /// Runs at a node and below.
    below: Vec<u32>,
    /// By run, the last one that was tried with it.
    last: Vec<u32>,
    /// Pairs that were tried.
    tried: usize,
    /// By run, the cuts of each of its edges where slanted ones meet, and the sum of their squares.
    each: Vec<Each>,
    dense: u64,
}

impl<'a> SweepLine<'a> {
    fn new(runs: Vec<EdgeRun<'a>>) -> Self {
        let mut places: Vec<i32> = runs.iter().flat_map(|r| [r.low[1], r.high[1]]).collect();
        places.sort_unstable();
        places.dedup();
        let leaves = places.len().next_power_of_two();
        let (at, below) = (vec![Vec::new(); 2 * leaves], vec![0; 2 * leaves]);
        let (last, each) = (vec![u32::MAX; runs.len()], vec![[0; RUN]; runs.len()]);
        Self { runs, places, leaves, at, below, last, tried: 0, each, dense: 0 }
    }

    fn count(&mut self, most: usize) -> Result<usize, CrossingContours> {
        let mut cuts = 0;
        for k in 0..self.runs.len() {
            bimorph_base::budget::check();
            let run = self.runs[k];
            let range = [run.low[1], run.high[1]].map(|y| self.places.partition_point(|p| *p < y));
            let (own, dense) = run.own(&mut self.each[k]);
            self.dense += dense;
            cuts += own + self.meet(k, range, 1, [0, self.leaves - 1]);
            if cuts > most || self.tried > MAX_TRIED || self.dense > MAX_DENSE {
                return Err(CrossingContours { at: run.low });
            }
            self.enter(k, range, 1, [0, self.leaves - 1]);
        }
        Ok(cuts)
    }

    /// Cuts of a run with those at a node and below whose ranges meet its own; those that the sweep has left are dropped.
    fn meet(&mut self, k: usize, range: [usize; 2], node: usize, [first, last]: [usize; 2]) -> usize {
        if self.below[node] == 0 || range[1] < first || last < range[0] {
            return 0;
        }
        let run = self.runs[k];
        let (mut cuts, mut i) = (0, 0);
        while let Some(&other) = self.at[node].get(i) {
            let found = &self.runs[other as usize];
            if found.high[0] < run.low[0] {
                self.at[node].swap_remove(i);
                let mut up = node;
                while up > 0 {
                    self.below[up] -= 1;
                    up /= 2;
                }
                continue;
            }
            if std::mem::replace(&mut self.last[other as usize], k as u32) != k as u32 {
                self.tried += 1;
                // another run than this one
                if let Ok([own, others]) = self.each.get_disjoint_mut([k, other as usize]) {
                    let (more, dense) = run.cuts(found, [own, others]);
                    cuts += more;
                    self.dense += dense;
                }
            }
            i += 1;
        }
        if first < last {
            let middle = usize::midpoint(first, last);
            cuts += self.meet(k, range, 2 * node, [first, middle]);
            cuts += self.meet(k, range, 2 * node + 1, [middle + 1, last]);
        }
        cuts
    }

    fn enter(&mut self, k: usize, range: [usize; 2], node: usize, [first, last]: [usize; 2]) {
        if range[1] < first || last < range[0] {
            return;
        }
        if range[0] <= first && last <= range[1] {
            self.at[node].push(k as u32);
            let mut up = node;
            while up > 0 {
                self.below[up] += 1;
                up /= 2;
            }
            return;
        }
        let middle = usize::midpoint(first, last);
        self.enter(k, range, 2 * node, [first, middle]);
        self.enter(k, range, 2 * node + 1, [middle + 1, last]);
    }
}

#[cfg(test)]
mod tests {
    //! Intersections of crossing bars, of adjacent boxes, and of random edges against all pairs.
    use super::*;
    use proptest::prelude::*;

    fn count(polygons: &[Polygon]) -> usize {
        let edges: Vec<Vec<ContourEdge>> =
            polygons.iter().flat_map(|p| &p.contours).map(|c| edges_of(c).collect()).collect();
        SweepLine::new(runs(&edges)).count(usize::MAX).unwrap()
    }

    fn bars(n: i32) -> Vec<Polygon> {
        let across = |k| Polygon::rectangle([-5, 10 * k], [10 * n, 10 * k + 4]);
        let along = |k| Polygon::rectangle([10 * k, -5], [10 * k + 4, 10 * n]);
        (0..n).flat_map(|k| [across(k), along(k)]).collect()
    }

    /// n bars across n others: each two cut in four places. Ten thousand of them are refused, in the time of an answer.
    #[test]
    fn bars_that_cross() {
        assert_eq!(count(&bars(20)), 4 * 20 * 20);
        assert_eq!(bounded(bars(900).iter()), Ok(()));
        assert!(bounded(bars(10_000).iter()).is_err());
    }

    /// A star whose edges all cut one another is refused from 273 edges on (the cube root of [`MAX_DENSE`], each cut counts for two edges), one that
    /// each edge crosses a few times is not, however many edges it has.
    #[test]
    fn stars() {
        let star = |n: usize, step: usize| {
            let corner = |k: usize| {
                let angle = std::f64::consts::TAU * (k * step % n) as f64 / n as f64;
                [(1e6 * angle.cos()).round() as i32, (1e6 * angle.sin()).round() as i32]
            };
            Polygon::from_contour((0..n).map(corner).collect())
        };
        assert_eq!(bounded([star(255, 127)].iter()), Ok(()));
        assert!(bounded([star(301, 150)].iter()).is_err() && bounded([star(2001, 1000)].iter()).is_err());
        assert_eq!(bounded([star(2001, 5)].iter()), Ok(()));
    }

    /// Adjacent boxes share edges without an intersection. Shifted boxes intersect once for each end that lies on
    /// another's edge.
    #[test]
    fn adjacent_boxes() {
        let row = |shift: i32| -> Vec<Polygon> {
            (0..100).map(|k| Polygon::rectangle([10 * k + shift, shift / 3], [10 * k + 10 + shift, 10])).collect()
        };
        assert_eq!(count(&row(0)), 0);
        assert_eq!(count(&[row(0), row(0)].concat()), 0);
        assert!(count(&[row(0), row(3)].concat()) > 300);
    }

    proptest! {
        /// Any edges on a small grid: as many cuts as all pairs have.
        #[test]
        fn any_edges(points in prop::collection::vec(prop::array::uniform2(-6i32..6), 3..60)) {
            let edges: Vec<ContourEdge> = edges_of(&points).collect();
            let pairs = (0..edges.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
            let all = pairs.filter(|(i, j)| edges[*i].cuts(&edges[*j])).count();
            prop_assert_eq!(count(&[Polygon { contours: vec![points] }]), all);
        }
    }
}
