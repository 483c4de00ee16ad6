//! Kinematics of a body relative to its parent: pose, rate and acceleration, and the map of motion.
//!
//! With m the parent, c the body, σ the sign of the joint, d = u·e₁(ψ) + g·e₂(ψ) the opening at the joint, ψ = β + (θ_m + θ_c)/2,
//! u = e_u − [g p]Q[g p]ᵀ, r the turned arms, and t(·) a right angle's turn:
//! ```text
//! x_c = x_m + (R_m − 1)·arm_m − (R_c − 1)·arm_c + σ·d                 θ_c = θ_m + σ·p
//! ẋ_c = ẋ_m + θ̇_m·t(L) + S_u·ė_u + S_g·ġ + S_p·ṗ                      L = r_m − r_c + σ·d, from centre to centre
//! S_u = σ·e₁       S_g = σ·(e₂ − 2·b_g·e₁)       S_p = −σ·t(r_c) + ½·t(d) − 2σ·b_p·e₁       b = Q·(g, p)
//! ẍ_c = ẍ_m + θ̈_m·t(L) + S·(ë_u, g̈, p̈) + bias
//! bias = −θ̇_m²·r_m + θ̇_c²·r_c + σ·(2ψ̇·(u̇·e₂ − ġ·e₁) − ψ̇²·d − 2·[ġ ṗ]Q[ġ ṗ]ᵀ·e₁)
//! ```
//! The bias is the second derivative of the map from (θ_m, e_u, g, p) to x_c, twice along the rates: [`super::geometric`]
//! takes its coefficients for the stiffness that a force brings.
//!
//! Rotations and their rates are sums along the tree. Once they are known, no body depends on another here, so that
//! eight of them are computed per vector ([`super::poses`]).

use crate::planar::Pose;
use crate::scalar::Real;

/// A pair of numbers.
pub(super) type TreeVector<T> = [T; 2];
/// Three numbers: of the plane, or of a joint.
pub(super) type Triple<T> = [T; 3];

#[inline(always)]
pub(super) fn triple(x: &Pose) -> Triple<f64> {
    [x.x, x.y, x.z]
}

#[inline(always)]
fn perpendicular<T: Real>(v: TreeVector<T>) -> TreeVector<T> {
    [-v[1], v[0]]
}

#[inline(always)]
pub(super) fn dot<T: Real>(a: TreeVector<T>, b: TreeVector<T>) -> T {
    a[0] * b[0] + a[1] * b[1]
}

/// How a body moves with its parent's rotation and with its own coordinates.
#[derive(Debug, Clone, Copy)]
pub struct MotionMap<T> {
    /// t(L): motion with the parent's rotation (m/rad).
    pub(super) lever: TreeVector<T>,
    /// S_u, S_g, S_p.
    pub(super) columns: [TreeVector<T>; 3],
}

impl MotionMap<f64> {
    pub(super) const REST: Self = Self { lever: [0.0; 2], columns: [[0.0; 2]; 3] };
}

impl<T: Real> MotionMap<T> {
    /// The body's motion from the parent's and from the coordinates' motion `s`.
    #[inline(always)]
    pub(super) fn apply(&self, sign: f64, parent: &Triple<T>, s: &Triple<T>) -> Triple<T> {
        let [x, y] = self.along(parent[2], s);
        [parent[0] + x, parent[1] + y, parent[2] + s[2] * sign]
    }

    /// Displacement beyond the parent's with the parent's rotation and the coordinates' motion `s`.
    #[inline(always)]
    fn along(&self, turn: T, s: &Triple<T>) -> TreeVector<T> {
        let [u, g, p] = &self.columns;
        let mut out = self.lever;
        for i in 0..2 {
            out[i] = turn * self.lever[i] + (u[i] * s[0] + g[i] * s[1] + p[i] * s[2]);
        }
        out
    }

    /// Part of a wrench on the body in the coordinates.
    #[inline(always)]
    pub(super) fn gather(&self, sign: f64, wrench: &Triple<T>) -> Triple<T> {
        let f = [wrench[0], wrench[1]];
        let [u, g, p] = self.columns;
        [dot(u, f), dot(g, f), dot(p, f) + wrench[2] * sign]
    }

    /// The wrench as the parent feels it.
    #[inline(always)]
    pub(super) fn pass(&self, wrench: &Triple<T>) -> Triple<T> {
        [wrench[0], wrench[1], wrench[2] + dot(self.lever, [wrench[0], wrench[1]])]
    }
}

/// Constant data of a joint.
#[derive(Debug, Clone, Copy)]
pub(super) struct JointGeometry<T> {
    /// σ.
    pub(super) sign: T,
    /// Arms as drawn, of the parent and of the body (m).
    pub(super) arms: [TreeVector<T>; 2],
    /// Cosine and sine of the drawn angle of the joint's x axis.
    pub(super) axis: TreeVector<T>,
    /// Q over (g, p) as (gg, gp, pp).
    pub(super) second: Triple<T>,
}

/// How a body is turned, and turns.
#[derive(Debug, Clone, Copy)]
pub(super) struct RotationState<T> {
    /// Sine and cosine of half its rotation.
    pub(super) half: TreeVector<T>,
    /// Rate (rad/s).
    pub(super) spin: T,
    /// Rate of that (rad/s²).
    pub(super) spin_rate: T,
}

impl<T: Real> RotationState<T> {
    /// (R − 1)·v without cancellation.
    #[inline(always)]
    fn rotation_minus_identity(&self, v: TreeVector<T>) -> TreeVector<T> {
        let [sin, cos] = self.half;
        let (less, whole) = (sin * sin * -2.0, sin * cos * 2.0);
        [less * v[0] - whole * v[1], whole * v[0] + less * v[1]]
    }
}

/// Coordinates, rates and accelerations of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointState<T> {
    /// Coordinates.
    pub q: Triple<T>,
    /// Their rates.
    pub v: Triple<T>,
    /// Their accelerations.
    pub z: Triple<T>,
}

/// A body less its parent, in x and y.
#[derive(Debug, Clone, Copy)]
pub(super) struct RelativeOffset<T> {
    pub(super) map: MotionMap<T>,
    /// Displacement, rate and acceleration.
    pub(super) beyond: [TreeVector<T>; 3],
}

/// A body with rotation `own` on a parent with rotation `parent`.
#[inline(always)]
pub(super) fn offset_from_parent<T: Real>(
    shape: &JointGeometry<T>,
    parent: &RotationState<T>,
    own: &RotationState<T>,
    at: &JointState<T>,
) -> RelativeOffset<T> {
    let s = shape.sign;
    let ([stretch, g, p], [arm_parent, arm]) = (at.q, shape.arms);
    let (swing_parent, swing) = (parent.rotation_minus_identity(arm_parent), own.rotation_minus_identity(arm));
    // the frame turns with the mean of both
    let ([sin_m, cos_m], [sin_c, cos_c]) = (parent.half, own.half);
    let cos = cos_c * cos_m - sin_c * sin_m;
    let sin = sin_c * cos_m + cos_c * sin_m;
    let e1 = [cos * shape.axis[0] - sin * shape.axis[1], sin * shape.axis[0] + cos * shape.axis[1]];
    let e2 = perpendicular(e1);
    let [gg, gp, pp] = shape.second;
    let bent = [g * gg + p * gp, g * gp + p * pp];
    let u = stretch - (bent[0] * g + bent[1] * p);
    let d = [e1[0] * u + e2[0] * g, e1[1] * u + e2[1] * g];
    let t = perpendicular(d);
    let r_parent = [swing_parent[0] + arm_parent[0], swing_parent[1] + arm_parent[1]];
    let r = [swing[0] + arm[0], swing[1] + arm[1]];
    let tr = perpendicular(r);
    let lever = perpendicular([r_parent[0] - r[0] + d[0] * s, r_parent[1] - r[1] + d[1] * s]);
    let mut columns = [e1, e2, t];
    let mut displaced = swing;
    for i in 0..2 {
        columns[0][i] = e1[i] * s;
        columns[1][i] = (e2[i] - bent[0] * e1[i] * 2.0) * s;
        columns[2][i] = t[i] * 0.5 - (tr[i] + bent[1] * e1[i] * 2.0) * s;
        displaced[i] = swing_parent[i] - swing[i] + d[i] * s;
    }
    let map = MotionMap { lever, columns };
    let (v, rate) = (at.v, map.along(parent.spin, &at.v));
    let frame = (parent.spin + own.spin) * 0.5;
    let rate_u = v[0] - (bent[0] * v[1] + bent[1] * v[2]) * 2.0;
    let curl = (v[1] * v[1] * gg + v[1] * v[2] * gp * 2.0 + v[2] * v[2] * pp) * 2.0;
    let (mixed_2, mixed_1) = (frame * rate_u * 2.0, frame * v[1] * 2.0 + curl);
    let (squared_parent, squared, squared_frame) = (parent.spin * parent.spin, own.spin * own.spin, frame * frame);
    let mut acceleration = map.along(parent.spin_rate, &at.z);
    for i in 0..2 {
        let joint = (mixed_2 * e2[i] - mixed_1 * e1[i] - squared_frame * d[i]) * s;
        acceleration[i] += squared * r[i] - squared_parent * r_parent[i] + joint;
    }
    RelativeOffset { map, beyond: [displaced, rate, acceleration] }
}
