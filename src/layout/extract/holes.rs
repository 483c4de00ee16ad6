//! Etch holes: filled for the axis, and kept as what the part lacks.
//!
//! A hole no larger than the process allows for the etch and compact (at least half of its box) is filled; larger openings shape the
//! part. What is missing is taken off bodies with its moments. Along a limb it is a share p of the area: mass and film are 1 − p of the
//! solid's, stiffness that of square holes in a square pitch, stretches with and without holes in series:
//! E′/E = (1 − s)/(1 − s + s²), s = √p.

use super::moments::Moments;
use crate::layout::drawing::{Polygon, twice_area};

/// Least share of its box that a hole fills [1].
const COMPACT: f64 = 0.5;

/// A polygon without its etch holes, and these.
pub(super) fn fill(polygon: Polygon, largest: f64) -> (Polygon, Vec<Moments>) {
    let mut contours = polygon.contours.into_iter();
    let mut kept: Vec<_> = contours.by_ref().take(1).collect();
    let mut holes = Vec::new();
    for contour in contours {
        let points: Vec<[f64; 2]> = contour.iter().map(|p| p.map(f64::from)).collect();
        let [low, high] = super::boxes::around(points.iter().copied());
        let sides = [high[0] - low[0], high[1] - low[1]];
        let area = twice_area(&contour).unsigned_abs() as f64 / 2.0;
        if sides[0].max(sides[1]) <= largest && area >= COMPACT * sides[0] * sides[1] {
            holes.push(Moments::of(&points));
        } else {
            kept.push(contour);
        }
    }
    (Polygon { contours: kept }, holes)
}

/// Stiffness of a strip with a share of holes, over that of a solid one [1].
pub(super) fn stiffness(porosity: f64) -> f64 {
    let s = porosity.clamp(0.0, 0.99).sqrt();
    (1.0 - s) / (1.0 - s + s * s)
}

#[cfg(test)]
mod tests {
    //! Small compact holes are filled, others kept. Stiffness: none missing 1; a quarter (holes half a pitch wide) ½/¾, by hand.
    use super::*;
    use crate::layout::regions::difference;

    #[test]
    fn small_compact_holes() {
        let cut = |a, b| Polygon::rectangle(a, b);
        let plate = difference(
            &[cut([0, 0], [1000, 1000])],
            &[cut([100, 100], [200, 200]), cut([300, 300], [700, 700]), cut([50, 800], [950, 810])],
        );
        let (filled, holes) = fill(plate[0].clone(), 150.0);
        assert_eq!((filled.contours.len(), holes.len()), (3, 1));
        assert_eq!((holes[0].area, holes[0].centroid()), (10_000.0, [150.0, 150.0]));
        assert_eq!(stiffness(0.0), 1.0);
        assert!((stiffness(0.25) - 2.0 / 3.0).abs() < 1e-15);
    }
}
