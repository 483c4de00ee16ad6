//! The quadratic element: shape functions and their derivatives at the three Gauss points.

/// Gauss points in the element, from 0 to 1, with their weights.
pub(super) const POINTS: [(f64, f64); 3] =
    [(0.5 - HALF_SPREAD, 5.0 / 18.0), (0.5, 4.0 / 9.0), (0.5 + HALF_SPREAD, 5.0 / 18.0)];

/// √0.15.
const HALF_SPREAD: f64 = 0.387_298_334_620_741_7;

/// Shape functions of first end, middle and second end at the points.
pub(super) const SHAPES: [[f64; 3]; 3] = [shape(POINTS[0].0), shape(POINTS[1].0), shape(POINTS[2].0)];

/// Their derivatives.
pub(super) const DERIVATIVES: [[f64; 3]; 3] = [slope(POINTS[0].0), slope(POINTS[1].0), slope(POINTS[2].0)];

const fn shape(x: f64) -> [f64; 3] {
    [(1.0 - x) * (1.0 - 2.0 * x), 4.0 * x * (1.0 - x), x * (2.0 * x - 1.0)]
}

const fn slope(x: f64) -> [f64; 3] {
    [4.0 * x - 3.0, 4.0 - 8.0 * x, 4.0 * x - 1.0]
}
