//! Where two facing beams measure: the distance and the mutual rotation at both ends, over the four bodies that bear them.

use super::approach::Approach;
use crate::multibody::planar::Pose;
use crate::multibody::{BlockMatrix, BodyId, Model, Pattern};
use nalgebra::{SMatrix, SVector, Vector4};

/// Twelve coordinates of the four bodies of a pair of facing beams.
type Quad = SVector<f64, 12>;

/// The four bodies: a, b, c, d.
pub(super) fn bodies(ends: &[Approach; 2]) -> [BodyId; 4] {
    [ends[0].a.body, ends[1].a.body, ends[0].b.body, ends[1].b.body]
}

/// z = (w, φ) of the first end, then of the second: distances [m] and slopes of one beam against the other [1].
pub(super) fn values(linear: bool, ends: &[Approach; 2], side: f64, q: &[Pose]) -> Vector4<f64> {
    let w = |e: &Approach| e.value(q, linear);
    let turn = |e: &Approach| side * (e.a.rotation(q) - e.b.rotation(q));
    Vector4::new(w(&ends[0]), turn(&ends[0]), w(&ends[1]), turn(&ends[1]))
}

/// Rate of z with the rate of each body.
pub(super) fn rates(
    linear: bool,
    ends: &[Approach; 2],
    side: f64,
    q: &[Pose],
    rate: &impl Fn(usize) -> Pose,
) -> Vector4<f64> {
    let mut d = Quad::zeros();
    for (i, id) in bodies(ends).into_iter().enumerate() {
        if let BodyId::Free(k) = id {
            d.fixed_rows_mut::<3>(3 * i).copy_from(&rate(k));
        }
    }
    rows(linear, ends, side, q).0 * d
}

/// Change of z with a change `dq` of the configuration.
pub(super) fn changes(linear: bool, ends: &[Approach; 2], side: f64, q: &[Pose], dq: &[Pose]) -> Vector4<f64> {
    let mut d = Quad::zeros();
    for (i, id) in bodies(ends).into_iter().enumerate() {
        d.fixed_rows_mut::<3>(3 * i).copy_from(&Model::pose(dq, id));
    }
    rows(linear, ends, side, q).0 * d
}

/// ∂z/∂(bodies a, b, c, d), and ∂²w/∂θ² of each body.
pub(super) fn rows(linear: bool, ends: &[Approach; 2], side: f64, q: &[Pose]) -> (SMatrix<f64, 4, 12>, [f64; 4]) {
    let mut rows = SMatrix::<f64, 4, 12>::zeros();
    let mut bend = [0.0; 4];
    for (e, end) in ends.iter().enumerate() {
        let m = end.measure(q, linear);
        for i in 0..3 {
            rows[(2 * e, 3 * e + i)] = m.gradient[i];
            rows[(2 * e, 6 + 3 * e + i)] = m.gradient[3 + i];
        }
        rows[(2 * e + 1, 3 * e + 2)] = side;
        rows[(2 * e + 1, 6 + 3 * e + 2)] = -side;
        (bend[e], bend[2 + e]) = (m.bend[0], m.bend[1]);
    }
    (rows, bend)
}

/// `r +=` the forces of what is `first` per z.
pub(super) fn add(linear: bool, ends: &[Approach; 2], side: f64, q: &[Pose], first: Vector4<f64>, r: &mut [Pose]) {
    let f = rows(linear, ends, side, q).0.transpose() * first;
    for (i, id) in bodies(ends).into_iter().enumerate() {
        if let BodyId::Free(k) = id {
            r[k] += f.fixed_rows::<3>(3 * i);
        }
    }
}

/// Adds the tangent over four bodies.
pub(super) fn add_quad(
    pattern: &Pattern,
    ids: &[BodyId; 4],
    h: &SMatrix<f64, 12, 12>,
    tangent: &mut BlockMatrix<f64, 3>,
) {
    for (i, &row) in ids.iter().enumerate() {
        for (j, &column) in ids.iter().enumerate() {
            let (BodyId::Free(row), BodyId::Free(column)) = (row, column) else { continue };
            let block = h.fixed_view::<3, 3>(3 * i, 3 * j);
            if row == column {
                tangent.diagonal[row] += block;
            } else if row > column
                && let Some(at) = pattern.block(row, column)
            {
                tangent.below[at] += block;
            }
        }
    }
}
