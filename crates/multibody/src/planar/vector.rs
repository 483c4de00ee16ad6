//! Vectors of the plane over any scalar, and rotations by their half angle.

use crate::scalar::{Real, StoredReal};

/// Two components of a vector of the plane.
pub type Vec2<T> = [T; 2];
/// Three numbers of a planar body (x, y, θ) or of a joint (u, g, p).
pub type Vec3<T> = [T; 3];

/// a + b.
#[inline(always)]
pub(crate) fn plus<T: Real>(a: Vec2<T>, b: Vec2<T>) -> Vec2<T> {
    [a[0] + b[0], a[1] + b[1]]
}

/// a − b.
#[inline(always)]
pub(crate) fn minus<T: Real>(a: Vec2<T>, b: Vec2<T>) -> Vec2<T> {
    [a[0] - b[0], a[1] - b[1]]
}

/// k·v.
#[inline(always)]
pub(crate) fn scaled<T: Real>(k: T, v: Vec2<T>) -> Vec2<T> {
    [k * v[0], k * v[1]]
}

/// a·x + b·y.
#[inline(always)]
pub(crate) fn combined<T: Real>(a: Vec2<T>, x: T, b: Vec2<T>, y: T) -> Vec2<T> {
    [a[0] * x + b[0] * y, a[1] * x + b[1] * y]
}

/// Rotation of `v` by a right angle.
#[inline(always)]
pub(crate) fn right_angle<T: Real>(v: Vec2<T>) -> Vec2<T> {
    [-v[1], v[0]]
}

/// a·b.
#[inline(always)]
pub(crate) fn dot<T: Real>(a: Vec2<T>, b: Vec2<T>) -> T {
    a[0] * b[0] + a[1] * b[1]
}

/// a·b of three numbers.
#[inline(always)]
pub(crate) fn dot3<T: Real>(a: Vec3<T>, b: Vec3<T>) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Sine and cosine of half of a body's rotation θ, with R(θ) − 1: nothing cancels at small angles.
#[derive(Debug, Clone, Copy)]
pub struct HalfTurn<T = f64> {
    pub(crate) sin: T,
    pub(crate) cos: T,
    /// cos θ − 1.
    pub(crate) less: T,
    /// sin θ.
    pub(crate) whole: T,
}

impl<T: StoredReal> HalfTurn<T> {
    /// Of a body at rest.
    pub const REST: Self = Self { sin: T::ZERO, cos: T::ONE, less: T::ZERO, whole: T::ZERO };
}

impl<T: Real> HalfTurn<T> {
    /// From the sine and cosine of θ/2.
    #[inline(always)]
    pub fn of([sin, cos]: Vec2<T>) -> Self {
        Self { sin, cos, less: sin * -2.0 * sin, whole: sin * 2.0 * cos }
    }

    /// (R(θ) − 1)·v.
    #[inline(always)]
    pub fn rotation_minus_identity(&self, v: Vec2<T>) -> Vec2<T> {
        [self.less * v[0] - self.whole * v[1], self.whole * v[0] + self.less * v[1]]
    }

    /// R((θₐ + θ_b)/2)·v.
    #[inline(always)]
    pub fn mean(&self, other: &Self, v: Vec2<T>) -> Vec2<T> {
        let c = self.cos * other.cos - self.sin * other.sin;
        let s = self.sin * other.cos + self.cos * other.sin;
        [c * v[0] - s * v[1], s * v[0] + c * v[1]]
    }
}
