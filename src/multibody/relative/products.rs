//! Products with the maps of a joint: S, from its coordinates to the motion of its body, and X, from the motion of its parent.

use super::kinematics::Map;
use super::tree::Link;
use crate::multibody::factor::Scalar;
use nalgebra::{Matrix3, Vector3};

/// A·S.
#[inline(always)]
pub(super) fn right<T: Scalar>(a: &Matrix3<T>, map: &Map<f64>, link: &Link) -> Matrix3<T> {
    let mut out = Matrix3::zeros();
    for (k, column) in map.columns.iter().enumerate() {
        for i in 0..3 {
            out[(i, k)] = a[(i, 0)] * T::from_real(column[0]) + a[(i, 1)] * T::from_real(column[1]);
        }
    }
    for i in 0..3 {
        out[(i, 2)] += a[(i, 2)] * T::from_real(link.sign);
    }
    out
}

/// Sᵀ·A.
#[inline(always)]
pub(super) fn left<T: Scalar>(a: &Matrix3<T>, map: &Map<f64>, link: &Link) -> Matrix3<T> {
    let mut out = Matrix3::zeros();
    for (k, column) in map.columns.iter().enumerate() {
        for i in 0..3 {
            out[(k, i)] = a[(0, i)] * T::from_real(column[0]) + a[(1, i)] * T::from_real(column[1]);
        }
    }
    for i in 0..3 {
        out[(2, i)] += a[(2, i)] * T::from_real(link.sign);
    }
    out
}

/// A·X.
#[inline(always)]
pub(super) fn shift_columns<T: Scalar>(a: &Matrix3<T>, map: &Map<f64>) -> Matrix3<T> {
    let mut out = *a;
    for i in 0..3 {
        out[(i, 2)] += a[(i, 0)] * T::from_real(map.lever[0]) + a[(i, 1)] * T::from_real(map.lever[1]);
    }
    out
}

/// Xᵀ·A.
#[inline(always)]
pub(super) fn shift_rows<T: Scalar>(a: &Matrix3<T>, map: &Map<f64>) -> Matrix3<T> {
    let mut out = *a;
    for i in 0..3 {
        out[(2, i)] += a[(0, i)] * T::from_real(map.lever[0]) + a[(1, i)] * T::from_real(map.lever[1]);
    }
    out
}

/// Sᵀ·f.
#[inline(always)]
pub(super) fn gather<T: Scalar>(map: &Map<f64>, sign: f64, f: &Vector3<T>) -> Vector3<T> {
    let [u, g, p] = map.columns.map(|c| T::from_real(c[0]) * f.x + T::from_real(c[1]) * f.y);
    Vector3::new(u, g, p + T::from_real(sign) * f.z)
}

/// X·V + S·s.
#[inline(always)]
pub(super) fn spread<T: Scalar>(map: &Map<f64>, sign: f64, parent: &Vector3<T>, s: &Vector3<T>) -> Vector3<T> {
    let [u, g, p] = &map.columns;
    let along = |i: usize| {
        parent[i]
            + T::from_real(map.lever[i]) * parent.z
            + (T::from_real(u[i]) * s.x + T::from_real(g[i]) * s.y + T::from_real(p[i]) * s.z)
    };
    Vector3::new(along(0), along(1), parent.z + T::from_real(sign) * s.z)
}
