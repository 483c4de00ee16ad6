//! Tangents of facing beams tile by tile: from derivatives over the ends of stretches to blocks of bodies.

use super::facing_side::Opening;
use super::facing_tiles::{SeenStations, TileSide, following};
use bimorph_multibody::batch::{LANES, Lane8, SimdReal, load, store};
use bimorph_multibody::{BodyMatrix, Pattern};
use nalgebra::{Matrix3, Matrix4};

/// Places in a symmetric matrix of four, row by row from the diagonal.
pub(super) const PLACES: [(usize, usize); 10] =
    [(0, 0), (0, 1), (0, 2), (0, 3), (1, 1), (1, 2), (1, 3), (2, 2), (2, 3), (3, 3)];

/// Derivatives over the ends of a stretch, of those of all stretches.
#[inline(always)]
pub(super) fn matrix(second: &[Lane8; 10], lane: usize) -> Matrix4<f64> {
    let mut matrix = Matrix4::zeros();
    for (sum, (i, j)) in second.iter().zip(PLACES) {
        matrix[(i, j)] = sum.0[lane];
        matrix[(j, i)] = sum.0[lane];
    }
    matrix
}

/// Over the poses of two bodies, what is `h` over the displacements and slopes of two stations with these levers.
#[inline(always)]
pub(super) fn block(frame: &Opening, [a, b]: [f64; 2], [h, h_slope, slope_h, slopes]: [f64; 4]) -> Matrix3<f64> {
    let Opening { axis: n, side } = *frame;
    let (column, row) = (b * h + side * h_slope, a * h + side * slope_h);
    let turned = a * column + side * (b * slope_h + side * slopes);
    let mixed = n.x * n.y * h;
    Matrix3::new(n.x * n.x * h, mixed, n.x * column, mixed, n.y * n.y * h, n.y * column, n.x * row, n.y * row, turned)
}

/// Adds a block of two bodies (row, column) and its transpose, of which the matrix holds what lies on or below the diagonal.
#[inline(always)]
pub(super) fn add_block([a, b]: [usize; 2], block: &Matrix3<f64>, pattern: &Pattern, tangent: &mut BodyMatrix) {
    if a == b {
        tangent.diagonal[a] += block + block.transpose();
    } else if let Some(at) = pattern.block(a.max(b), a.min(b)) {
        tangent.below[at] += if a > b { *block } else { block.transpose() };
    }
}

/// Adds the derivatives of a stretch that couple its two sides.
pub(super) fn couple(
    frame: &Opening,
    lane: usize,
    [(upper, above), (lower, below)]: [(&TileSide, &SeenStations); 2],
    second: &Matrix4<f64>,
    pattern: &Pattern,
    tangent: &mut BodyMatrix,
) {
    let (mut h, mut from) = (-second, [lane; 2]);
    if let Some(cut) = &upper.cut {
        from[0] = cut[lane].from;
        h = cut[lane].weights.as_ref().map_or(h, |weights| weights.tr_mul(&h));
    }
    if let Some(cut) = &lower.cut {
        from[1] = cut[lane].from;
        h = cut[lane].weights.as_ref().map_or(h, |weights| h * **weights);
    }
    for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        let (one, other) = (from[0] + i, from[1] + j);
        let (Some(a), Some(b)) = (upper.body(one), lower.body(other)) else { continue };
        let part = [h[(2 * i, 2 * j)], h[(2 * i, 2 * j + 1)], h[(2 * i + 1, 2 * j)], h[(2 * i + 1, 2 * j + 1)]];
        let block = block(frame, [above.of(2, one), below.of(2, other)], part);
        add_block([a, b], &block, pattern, tangent);
    }
}

/// Adds the blocks of one side whose segments are the stretches: `first` and `second` derivatives over the ends of these, and the sign of the side.
#[inline(always)]
pub(super) fn add_side<W: SimdReal>(
    simd: W::Simd,
    frame: &Opening,
    (own, seen): (&TileSide, &SeenStations),
    (first, second, sign): (&[Lane8; 4], &[Lane8; 10], f64),
    pattern: &Pattern,
    tangent: &mut BodyMatrix,
) {
    if let Some(body) = own.body(0) {
        let [h, mixed, turned] = [0, 1, 4].map(|place: usize| second[place].0[0]);
        let lever = seen.first[2];
        let mut block = block(frame, [lever, lever], [h, mixed, mixed, turned]);
        block[(2, 2)] += sign * first[0].0[0] * seen.first[3];
        tangent.diagonal[body] += block;
    }
    let (n, side) = (frame.axis, frame.side);
    let at = |of: &Lane8| W::load(simd, of);
    // the end of a stretch and the start of the next
    let over = |start: usize, end: usize| at(&second[end]) + at(&following(&second[start]));
    let (levers, bends) = (at(&seen.own[2]), at(&seen.own[3]));
    let (h, mixed, turned) = (over(0, 7), over(1, 8), over(4, 9));
    let column = levers * h + mixed * side;
    let turned = levers * column + (levers * mixed + turned * side) * side;
    let force = (at(&first[2]) + at(&following(&first[0]))) * sign;
    let mut diagonal = [Lane8::NONE; 6];
    let entries =
        [h * (n.x * n.x), h * (n.x * n.y), h * (n.y * n.y), column * n.x, column * n.y, turned + force * bends];
    store(entries, &mut diagonal);
    let [h, h_slope, slope_h, slopes] = load::<W, 4>(simd, &[second[2], second[3], second[5], second[6]]);
    let starts = at(&seen.starts(2));
    let (column, row) = (levers * h + h_slope * side, starts * h + slope_h * side);
    let turned = starts * column + (levers * slope_h + slopes * side) * side;
    let mut below = [Lane8::NONE; 8];
    let entries =
        [h * (n.x * n.x), h * (n.x * n.y), h * (n.y * n.y), column * n.x, column * n.y, row * n.x, row * n.y, turned];
    store(entries, &mut below);
    for lane in 0..LANES {
        let Some(body) = own.body(lane + 1) else { continue };
        if let Some(before) = own.body(lane) {
            let [xx, xy, yy, xz, yz, zx, zy, zz] = below.each_ref().map(|of| of.0[lane]);
            add_block([before, body], &Matrix3::new(xx, xy, xz, xy, yy, yz, zx, zy, zz), pattern, tangent);
        }
        let [xx, xy, yy, xz, yz, zz] = diagonal.each_ref().map(|of| of.0[lane]);
        tangent.diagonal[body] += Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    }
}
