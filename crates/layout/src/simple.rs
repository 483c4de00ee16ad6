//! One contour as a drawing program writes it, made into polygons that do not cross themselves.

use super::crossings::{CrossingContours, bounded};
use super::drawing::{GridPoint, Polygon, twice_area};
use super::regions;
use i_overlay::core::fill_rule::FillRule;

/// Area that a contour encloses.
#[derive(Debug, PartialEq)]
pub(super) enum ContourContent {
    /// Itself, turned counter-clockwise.
    Simple(Polygon),
    /// It crosses or touches itself: the parts that it winds around.
    Crossing(Vec<Polygon>),
    /// No area.
    Nothing,
    /// It crosses itself too often to be taken apart.
    Tangled(CrossingContours),
}

/// Contours with more points than this are given to the set operations without looking for crossings.
const FEW: usize = 48;

/// Area that a contour encloses; consecutive points must differ.
pub(super) fn polygons(contour: Vec<GridPoint>) -> ContourContent {
    if contour.len() < 3 {
        return ContourContent::Nothing;
    }
    if convex(&contour) || (contour.len() <= FEW && !crosses(&contour)) {
        return match twice_area(&contour) {
            0 => ContourContent::Nothing,
            _ => ContourContent::Simple(Polygon::from_contour(contour)),
        };
    }
    let before = twice_area(&contour).abs();
    let contour = Polygon { contours: vec![contour] };
    if let Err(tangled) = bounded(std::iter::once(&contour)) {
        return ContourContent::Tangled(tangled);
    }
    let contour = contour.contours.into_iter().next().unwrap_or_default();
    let parts = regions::enclosed(&contour, FillRule::NonZero);
    match parts.as_slice() {
        [] => ContourContent::Nothing,
        [one] if one.contours.len() == 1 && one.twice_area() == before => {
            ContourContent::Simple(Polygon::from_contour(contour))
        }
        _ => ContourContent::Crossing(parts),
    }
}

fn cross(a: GridPoint, b: GridPoint, c: GridPoint) -> i128 {
    let d = |p: GridPoint, q: GridPoint| [i128::from(q[0]) - i128::from(p[0]), i128::from(q[1]) - i128::from(p[1])];
    let ([ux, uy], [vx, vy]) = (d(a, b), d(b, c));
    ux * vy - uy * vx
}

/// True when it turns one way all along, and only once around.
fn convex(contour: &[GridPoint]) -> bool {
    let n = contour.len();
    let (mut left, mut right, mut reversals) = (false, false, 0);
    let sense = |a: GridPoint, b: GridPoint| (b[0], b[1]) > (a[0], a[1]);
    for k in 0..n {
        let (a, b, c) = (contour[k], contour[(k + 1) % n], contour[(k + 2) % n]);
        let turn = cross(a, b, c);
        left |= turn > 0;
        right |= turn < 0;
        if turn == 0 && (sense(a, b) != sense(b, c)) {
            return false;
        }
        // A closed curve that turns once changes between rightwards and leftwards twice.
        reversals += usize::from(sense(a, b) != sense(b, c));
    }
    left != right && reversals <= 2
}

/// True when two edges have a point in common that is not the corner between neighbours. O(n²), for few points.
fn crosses(contour: &[GridPoint]) -> bool {
    let n = contour.len();
    let edge = |k: usize| (contour[k], contour[(k + 1) % n]);
    for i in 0..n {
        let (a, b) = edge(i);
        if cross(a, b, contour[(i + 2) % n]) == 0 && behind(a, b, contour[(i + 2) % n]) {
            return true;
        }
        for j in i + 2..n {
            if i == 0 && j == n - 1 {
                continue;
            }
            let (c, d) = edge(j);
            if touch(a, b, c, d) {
                return true;
            }
        }
    }
    false
}

/// True when c, on the line from a to b, lies back from b towards a.
fn behind(a: GridPoint, b: GridPoint, c: GridPoint) -> bool {
    let d = |p: GridPoint, q: GridPoint| [i128::from(q[0]) - i128::from(p[0]), i128::from(q[1]) - i128::from(p[1])];
    let ([ux, uy], [vx, vy]) = (d(a, b), d(b, c));
    ux * vx + uy * vy < 0
}

fn touch(a: GridPoint, b: GridPoint, c: GridPoint, d: GridPoint) -> bool {
    let apart = |i: usize| a[i].max(b[i]) < c[i].min(d[i]) || c[i].max(d[i]) < a[i].min(b[i]);
    if apart(0) || apart(1) {
        return false;
    }
    let side = |a: GridPoint, b: GridPoint, p: GridPoint| cross(a, b, p).signum();
    side(a, b, c) * side(a, b, d) <= 0 && side(c, d, a) * side(c, d, b) <= 0
}

#[cfg(test)]
mod tests {
    //! A contour that does not cross itself comes back as it is; one that does gives what it winds around. Source: by hand.
    use super::*;

    #[test]
    fn boxes_and_combs_stay() {
        let clockwise = vec![[0, 0], [0, 2], [3, 2], [3, 0]];
        assert_eq!(polygons(clockwise), ContourContent::Simple(Polygon::rectangle([0, 0], [3, 2])));
        let u = vec![[0, 0], [9, 0], [9, 9], [6, 9], [6, 3], [3, 3], [3, 9], [0, 9]];
        assert_eq!(polygons(u.clone()), ContourContent::Simple(Polygon { contours: vec![u] }));
        assert_eq!(polygons(vec![[0, 0], [5, 0], [2, 0]]), ContourContent::Nothing);
    }

    #[test]
    fn a_bow_tie_is_two_triangles_and_a_keyhole_a_ring() {
        let ContourContent::Crossing(parts) = polygons(vec![[0, 0], [4, 4], [4, 0], [0, 4]]) else { panic!() };
        assert_eq!(parts.iter().map(Polygon::twice_area).collect::<Vec<_>>(), [8, 8]);
        // A frame drawn as one contour, in and out along the same cut, as programs without holes write it.
        let keyhole = vec![[0, 0], [9, 0], [9, 9], [0, 9], [0, 3], [3, 3], [3, 6], [6, 6], [6, 3], [0, 3]];
        let ContourContent::Crossing(parts) = polygons(keyhole) else { panic!() };
        assert_eq!((parts.len(), parts[0].contours.len(), parts[0].twice_area()), (1, 2, 2 * (81 - 9)));
        // A star of one line winds twice around its middle, which belongs to it.
        let star = vec![[0, 10], [6, -8], [-10, 3], [10, 3], [-6, -8]];
        let ContourContent::Crossing(parts) = polygons(star) else { panic!() };
        assert_eq!(parts.len(), 1);
    }
}
