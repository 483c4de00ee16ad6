//! Vectors of the plane over lanes.

use crate::scalar::StoredReal;

/// Two components.
pub(super) type LinkageVector<T> = [T; 2];

/// Cosine less one and sine of an angle, from the sine and cosine of its half: nothing cancels.
#[inline(always)]
pub(super) fn turned<T: StoredReal>(half: LinkageVector<T>) -> LinkageVector<T> {
    let twice = half[0] + half[0];
    [-(twice * half[0]), twice * half[1]]
}

#[inline(always)]
pub(super) fn plus<T: StoredReal>(a: LinkageVector<T>, b: LinkageVector<T>) -> LinkageVector<T> {
    [a[0] + b[0], a[1] + b[1]]
}

#[inline(always)]
pub(super) fn minus<T: StoredReal>(a: LinkageVector<T>, b: LinkageVector<T>) -> LinkageVector<T> {
    [a[0] - b[0], a[1] - b[1]]
}

#[inline(always)]
pub(super) fn times<T: StoredReal>(k: T, v: LinkageVector<T>) -> LinkageVector<T> {
    [k * v[0], k * v[1]]
}

/// Rotation by a right angle.
#[inline(always)]
pub(super) fn perpendicular<T: StoredReal>(v: LinkageVector<T>) -> LinkageVector<T> {
    [-v[1], v[0]]
}
