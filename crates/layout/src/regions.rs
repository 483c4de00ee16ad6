//! Set operations on polygons of one grid, exact on integers (i_overlay).
//!
//! Input polygons may overlap and touch themselves; results are disjoint polygons in one fixed order, with outer contours
//! counter-clockwise and holes clockwise. Where edges cross between grid points the crossing is rounded to the grid, which moves an
//! edge by at most one unit. Coordinates must stay within [`LARGEST_COORDINATE`](super::drawing::LARGEST_COORDINATE).

use super::drawing::{GridPoint, Polygon, twice_area};
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay::{Overlay, ShapeType};
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::i_float::int::point::IntPoint;
use i_overlay::i_shape::int::shape::IntShapes;

/// All that lies in at least one of the polygons.
pub fn union(polygons: &[Polygon]) -> Vec<Polygon> {
    combine(polygons, &[], OverlayRule::Subject)
}

/// Intersection of the polygons of `a` with those of `b`.
pub fn intersection(a: &[Polygon], b: &[Polygon]) -> Vec<Polygon> {
    combine(a, b, OverlayRule::Intersect)
}

/// Area in a polygon of `a` and in none of `b`.
pub fn difference(a: &[Polygon], b: &[Polygon]) -> Vec<Polygon> {
    combine(a, b, OverlayRule::Difference)
}

/// Twice the area of disjoint polygons (square database units): exact.
pub fn twice_area_of(polygons: &[Polygon]) -> i128 {
    polygons.iter().map(Polygon::twice_area).sum()
}

/// Area of disjoint polygons (square database units).
pub fn area(polygons: &[Polygon]) -> f64 {
    twice_area_of(polygons) as f64 / 2.0
}

/// Area that one contour encloses, for any direction and with self-intersections.
pub(super) fn enclosed(contour: &[GridPoint], rule: FillRule) -> Vec<Polygon> {
    let mut overlay = Overlay::<i32>::new(contour.len());
    overlay.add_path_iter(contour.iter().map(|[x, y]| IntPoint::new(*x, *y)), ShapeType::Subject);
    in_order(overlay.overlay(OverlayRule::Subject, rule))
}

fn combine(a: &[Polygon], b: &[Polygon], rule: OverlayRule) -> Vec<Polygon> {
    let points = a.iter().chain(b).flat_map(|p| &p.contours).map(Vec::len).sum();
    let mut overlay = Overlay::<i32>::new(points);
    add(&mut overlay, a, ShapeType::Subject);
    add(&mut overlay, b, ShapeType::Clip);
    in_order(overlay.overlay(rule, FillRule::NonZero))
}

/// Directions, first points and the order of shapes are made one whatever the order of input.
fn in_order(shapes: IntShapes<i32>) -> Vec<Polygon> {
    let point = |p: &IntPoint<i32>| -> GridPoint { [p.x, p.y] };
    let mut shapes: Vec<Polygon> = shapes
        .into_iter()
        .map(|shape| Polygon { contours: shape.iter().map(|contour| contour.iter().map(point).collect()).collect() })
        .collect();
    for (index, contour) in shapes.iter_mut().flat_map(|shape| shape.contours.iter_mut().enumerate()) {
        if (twice_area(contour) < 0) != (index > 0) {
            contour.reverse();
        }
        let first = (0..contour.len()).min_by_key(|i| contour[*i]).unwrap_or(0);
        contour.rotate_left(first);
    }
    shapes.iter_mut().for_each(|shape| shape.contours[1..].sort());
    shapes.sort();
    shapes
}

fn add(overlay: &mut Overlay<i32>, polygons: &[Polygon], side: ShapeType) {
    for contour in polygons.iter().flat_map(|polygon| &polygon.contours) {
        overlay.add_path_iter(contour.iter().map(|[x, y]| IntPoint::new(*x, *y)), side);
    }
}

#[cfg(test)]
mod tests {
    //! Unions, intersections and differences have the areas counted by hand, and the same bytes whatever the order of input.
    use super::*;
    use crate::drawing::LARGEST_COORDINATE;

    #[test]
    fn two_overlapping_boxes() {
        let (a, b) = ([Polygon::rectangle([0, 0], [10, 10])], [Polygon::rectangle([5, 5], [15, 15])]);
        let both = [a[0].clone(), b[0].clone()];
        assert_eq!(twice_area_of(&union(&both)), 2 * 175);
        assert_eq!(twice_area_of(&intersection(&a, &b)), 2 * 25);
        assert_eq!(twice_area_of(&difference(&a, &b)), 2 * 75);
        assert_eq!(union(&both), union(&[b[0].clone(), a[0].clone()]));
    }

    #[test]
    fn a_frame_keeps_its_hole_and_its_directions() {
        let frame = difference(&[Polygon::rectangle([0, 0], [10, 10])], &[Polygon::rectangle([3, 3], [7, 7])]);
        assert_eq!(frame.len(), 1);
        assert_eq!(
            frame[0].contours,
            [vec![[0, 0], [10, 0], [10, 10], [0, 10]], vec![[3, 3], [3, 7], [7, 7], [7, 3]],]
        );
        // A box over the hole fills it.
        let filled = union(&[frame[0].clone(), Polygon::rectangle([2, 2], [8, 8])]);
        assert_eq!(filled, [Polygon::rectangle([0, 0], [10, 10])]);
    }

    #[test]
    fn the_largest_coordinates_are_exact() {
        let m = LARGEST_COORDINATE;
        let (a, b) = (Polygon::rectangle([-m, -m], [m, m]), Polygon::rectangle([0, 0], [m, m]));
        let rest = difference(std::slice::from_ref(&a), std::slice::from_ref(&b));
        assert_eq!(twice_area_of(&rest), a.twice_area() - b.twice_area());
    }
}
