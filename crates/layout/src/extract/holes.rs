//! Etch holes: filled for the axis, and kept as what the part lacks.
//!
//! A hole no larger than the process allows for the etch and compact (at least half of the smallest rectangle around
//! it, at any angle) is filled; larger openings shape the part. The removed area is cut along the limbs and joints that
//! contain it ([`super::cut`]) and subtracted from bodies with its moments. Along a limb, the fraction p of the area is
//! missing: mass and film are 1 − p of the solid's. Stiffness is that of square holes at a square pitch, with stretches
//! with and without holes in series: E′/E = (1 − s)/(1 − s + s²), s = √p.

use super::boxes::{self, Extent};
use crate::drawing::{GridPoint, Polygon, twice_area};
use std::f64::consts::SQRT_2;

/// Least fraction of the smallest rectangle around it that a hole fills, less what rounding of its corners to the grid takes (1).
const COMPACT: f64 = 0.5 - 1e-3;

/// By how much rounding of its corners may lengthen a side (database units).
const ROUNDED: f64 = 1.5;

/// An etch hole.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Hole {
    /// Its outline, in coordinates of the drawing.
    pub(super) outline: Vec<[f64; 2]>,
    /// Its area (square database units): exact.
    pub(super) area: f64,
}

/// A polygon without its etch holes, and these.
pub(super) fn fill(polygon: Polygon, largest: f64) -> (Polygon, Vec<Hole>) {
    let mut contours = polygon.contours.into_iter();
    let mut kept: Vec<_> = contours.by_ref().take(1).collect();
    let mut holes = Vec::new();
    for contour in contours {
        let outline: Vec<[f64; 2]> = contour.iter().map(|p| p.map(f64::from)).collect();
        let [low, high] = boxes::around(outline.iter().copied());
        let area = twice_area(&contour).unsigned_abs() as f64 / 2.0;
        // a rectangle at an angle has a box up to √2 of its longer side
        let small = (high[0] - low[0]).hypot(high[1] - low[1]) <= 1.01 * SQRT_2 * largest;
        let sides = if small { smallest_rectangle(contour.clone()) } else { [f64::INFINITY; 2] };
        if sides[0].max(sides[1]) <= largest + ROUNDED && area >= COMPACT * sides[0] * sides[1] {
            holes.push(Hole { outline, area });
        } else {
            kept.push(contour);
        }
    }
    (Polygon { contours: kept }, holes)
}

impl Hole {
    /// The box around it.
    pub(super) fn extent(&self) -> Extent {
        boxes::around(self.outline.iter().copied())
    }
}

/// Sides of the rectangle of least area around some points: one of its sides lies along their hull (H. Freeman, R. Shapira, CACM 18,
/// 1975). Cost: n log n.
fn smallest_rectangle(mut points: Vec<GridPoint>) -> [f64; 2] {
    points.sort_unstable();
    points.dedup();
    let turn = |a: GridPoint, b: GridPoint, c: GridPoint| {
        let [ux, uy, vx, vy] = [b[0] - a[0], b[1] - a[1], c[0] - b[0], c[1] - b[1]].map(i128::from);
        ux * vy - uy * vx
    };
    let half = |points: &mut dyn Iterator<Item = GridPoint>| {
        let mut chain: Vec<GridPoint> = Vec::new();
        for p in points {
            while chain.len() > 1 && turn(chain[chain.len() - 2], chain[chain.len() - 1], p) <= 0 {
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut hull = half(&mut points.iter().copied());
    hull.extend(half(&mut points.iter().rev().copied()));
    let hull: Vec<[f64; 2]> = hull.into_iter().map(|p| p.map(f64::from)).collect();
    let n = hull.len();
    // the furthest corners along an edge, across it, and against it go round with the edge
    let (mut ahead, mut across, mut behind) = (0, 0, 0);
    let mut least = [f64::INFINITY; 2];
    for k in 0..n {
        let (p, q) = (hull[k], hull[(k + 1) % n]);
        let long = (q[0] - p[0]).hypot(q[1] - p[1]);
        let u = [(q[0] - p[0]) / long, (q[1] - p[1]) / long];
        let along = |i: usize| (hull[i % n][0] - p[0]) * u[0] + (hull[i % n][1] - p[1]) * u[1];
        let off = |i: usize| (hull[i % n][1] - p[1]) * u[0] - (hull[i % n][0] - p[0]) * u[1];
        ahead = ahead.max(k + 1);
        while ahead < k + n && along(ahead + 1) > along(ahead) {
            ahead += 1;
        }
        across = across.max(ahead);
        while across < k + n && off(across + 1) > off(across) {
            across += 1;
        }
        behind = behind.max(across);
        while behind < k + n && along(behind + 1) < along(behind) {
            behind += 1;
        }
        let sides = [along(ahead) - along(behind), off(across)];
        if sides[0] * sides[1] < least[0] * least[1] {
            least = sides;
        }
    }
    least
}

/// Stiffness of a strip with a fraction of holes, over that of a solid one (1).
pub(super) fn stiffness(porosity: f64) -> f64 {
    let s = porosity.clamp(0.0, 0.99).sqrt();
    (1.0 - s) / (1.0 - s + s * s)
}

#[cfg(test)]
mod tests {
    //! Small compact holes are filled, others kept. Stiffness: none missing 1; a quarter (holes half a pitch wide) ½/¾, by hand.
    use super::*;
    use crate::regions::difference;

    /// A rectangle of 300 by 100 at any angle has these sides, and is a hole of up to 300 as one along the grid is.
    #[test]
    fn holes_at_any_angle() {
        for degrees in [0.0f64, 1.0, 30.0, 45.0, 89.0, 120.0] {
            let (s, c) = degrees.to_radians().sin_cos();
            let turned = [[0.0, 0.0], [3e5, 0.0], [3e5, 1e5], [0.0, 1e5]];
            let corners: Vec<GridPoint> = turned
                .iter()
                .map(|[x, y]: &[f64; 2]| [(c * x - s * y).round() as i32, (s * x + c * y).round() as i32])
                .collect();
            let mut sides = smallest_rectangle(corners.clone());
            sides.sort_by(f64::total_cmp);
            assert!((sides[0] - 1e5).abs() < 2.0 && (sides[1] - 3e5).abs() < 2.0, "{degrees}: {sides:?}");
            let around = Polygon::rectangle([-400_000; 2], [400_000; 2]);
            let plate = difference(&[around], &[Polygon::from_contour(corners)]);
            assert_eq!([3e5, 2.9e5].map(|largest| fill(plate[0].clone(), largest).1.len()), [1, 0], "{degrees}");
        }
    }

    #[test]
    fn small_compact_holes() {
        let cut = |a, b| Polygon::rectangle(a, b);
        let plate = difference(
            &[cut([0, 0], [1000, 1000])],
            &[cut([100, 100], [200, 200]), cut([300, 300], [700, 700]), cut([50, 800], [950, 810])],
        );
        let (filled, holes) = fill(plate[0].clone(), 150.0);
        assert_eq!((filled.contours.len(), holes.len()), (3, 1));
        assert_eq!((holes[0].area, holes[0].extent()), (10_000.0, [[100.0; 2], [200.0; 2]]));
        assert_eq!(stiffness(0.0), 1.0);
        assert!((stiffness(0.25) - 2.0 / 3.0).abs() < 1e-15);
    }
}
