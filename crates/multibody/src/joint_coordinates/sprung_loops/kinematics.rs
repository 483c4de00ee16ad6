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

use crate::planar::vector::{dot, right_angle};
use crate::planar::{HalfTurn, Pose, Vec2, Vec3};
use crate::scalar::Real;

#[inline(always)]
pub(super) fn triple(x: &Pose) -> Vec3<f64> {
    [x.x, x.y, x.z]
}

/// How a body moves with its parent's rotation and with its own coordinates.
#[derive(Debug, Clone, Copy)]
pub struct MotionMap<T> {
    /// t(L): motion with the parent's rotation (m/rad).
    pub(super) lever: Vec2<T>,
    /// S_u, S_g, S_p.
    pub(super) columns: [Vec2<T>; 3],
}

impl MotionMap<f64> {
    pub(super) const REST: Self = Self { lever: [0.0; 2], columns: [[0.0; 2]; 3] };
}

impl<T: Real> MotionMap<T> {
    /// The body's motion from the parent's and from the coordinates' motion `s`.
    #[inline(always)]
    pub(super) fn apply(&self, sign: f64, parent: &Vec3<T>, s: &Vec3<T>) -> Vec3<T> {
        let [x, y] = self.along(parent[2], s);
        [parent[0] + x, parent[1] + y, parent[2] + s[2] * sign]
    }

    /// Displacement beyond the parent's with the parent's rotation and the coordinates' motion `s`.
    #[inline(always)]
    pub(super) fn along(&self, turn: T, s: &Vec3<T>) -> Vec2<T> {
        let [u, g, p] = &self.columns;
        let mut out = self.lever;
        for i in 0..2 {
            out[i] = turn * self.lever[i] + (u[i] * s[0] + g[i] * s[1] + p[i] * s[2]);
        }
        out
    }

    /// Part of a wrench on the body in the coordinates.
    #[inline(always)]
    pub(super) fn gather(&self, sign: f64, wrench: &Vec3<T>) -> Vec3<T> {
        let f = [wrench[0], wrench[1]];
        let [u, g, p] = self.columns;
        [dot(u, f), dot(g, f), dot(p, f) + wrench[2] * sign]
    }

    /// The wrench as the parent feels it.
    #[inline(always)]
    pub(super) fn pass(&self, wrench: &Vec3<T>) -> Vec3<T> {
        [wrench[0], wrench[1], wrench[2] + dot(self.lever, [wrench[0], wrench[1]])]
    }
}

/// Constant data of a joint.
#[derive(Debug, Clone, Copy)]
pub(super) struct JointGeometry<T> {
    /// σ.
    pub(super) sign: T,
    /// Arms as drawn, of the parent and of the body (m).
    pub(super) arms: [Vec2<T>; 2],
    /// Cosine and sine of the drawn angle of the joint's x axis.
    pub(super) axis: Vec2<T>,
    /// Q over (g, p) as (gg, gp, pp).
    pub(super) second: Vec3<T>,
}

/// How a body is turned, and turns.
#[derive(Debug, Clone, Copy)]
pub(super) struct RotationState<T> {
    /// Its rotation.
    pub(super) turn: HalfTurn<T>,
    /// Rate (rad/s).
    pub(super) spin: T,
    /// Rate of that (rad/s²).
    pub(super) spin_rate: T,
}

/// Coordinates, rates and accelerations of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointState<T> {
    /// Coordinates.
    pub q: Vec3<T>,
    /// Their rates.
    pub v: Vec3<T>,
    /// Their accelerations.
    pub z: Vec3<T>,
}

/// A body less its parent, in x and y.
#[derive(Debug, Clone, Copy)]
pub(super) struct RelativeOffset<T> {
    pub(super) map: MotionMap<T>,
    /// Displacement, rate and acceleration.
    pub(super) beyond: [Vec2<T>; 3],
}

/// Geometry of a joint at its coordinates.
struct DeflectedJoint<T> {
    /// Axes of the frame, which turns with the mean of both bodies.
    e1: Vec2<T>,
    e2: Vec2<T>,
    /// Half of the derivative of the shortening by bending.
    bent: Vec2<T>,
    /// The joint's displacement.
    d: Vec2<T>,
    /// Arms on the parent and on the body: turned, and less the undeformed ones.
    r_parent: Vec2<T>,
    r: Vec2<T>,
    swing_parent: Vec2<T>,
    swing: Vec2<T>,
}

impl<T: Real> DeflectedJoint<T> {
    #[inline(always)]
    fn new(shape: &JointGeometry<T>, parent: &RotationState<T>, own: &RotationState<T>, q: Vec3<T>) -> Self {
        let ([stretch, g, p], [arm_parent, arm]) = (q, shape.arms);
        let (swing_parent, swing) =
            (parent.turn.rotation_minus_identity(arm_parent), own.turn.rotation_minus_identity(arm));
        let e1 = own.turn.mean(&parent.turn, shape.axis);
        let e2 = right_angle(e1);
        let [gg, gp, pp] = shape.second;
        let bent = [g * gg + p * gp, g * gp + p * pp];
        let u = stretch - (bent[0] * g + bent[1] * p);
        let d = [e1[0] * u + e2[0] * g, e1[1] * u + e2[1] * g];
        let r_parent = [swing_parent[0] + arm_parent[0], swing_parent[1] + arm_parent[1]];
        let r = [swing[0] + arm[0], swing[1] + arm[1]];
        Self { e1, e2, bent, d, r_parent, r, swing_parent, swing }
    }
}

/// A body with rotation `own` on a parent with rotation `parent`.
#[inline(always)]
pub(super) fn offset_from_parent<T: Real>(
    shape: &JointGeometry<T>,
    parent: &RotationState<T>,
    own: &RotationState<T>,
    at: &JointState<T>,
) -> RelativeOffset<T> {
    let (s, [gg, gp, pp]) = (shape.sign, shape.second);
    let DeflectedJoint { e1, e2, bent, d, r_parent, r, swing_parent, swing } =
        DeflectedJoint::new(shape, parent, own, at.q);
    let t = right_angle(d);
    let tr = right_angle(r);
    let lever = right_angle([r_parent[0] - r[0] + d[0] * s, r_parent[1] - r[1] + d[1] * s]);
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

/// How a body's acceleration less its parent's changes with the parent's rotation and the coordinates, and with their rates.
#[derive(Debug, Clone, Copy)]
pub(super) struct AccelerationMaps<T> {
    pub(super) displacement: MotionMap<T>,
    pub(super) rate: MotionMap<T>,
}

/// The derivatives of the acceleration in [`offset_from_parent`], at held accelerations of the coordinates and of the parent's rotation.
#[inline(always)]
pub(super) fn acceleration_maps<T: Real>(
    shape: &JointGeometry<T>,
    parent: &RotationState<T>,
    own: &RotationState<T>,
    at: &JointState<T>,
) -> AccelerationMaps<T> {
    let (s, [gg, gp, pp], v, z) = (shape.sign, shape.second, at.v, at.z);
    let DeflectedJoint { e1, e2, bent, d, r_parent, r, .. } = DeflectedJoint::new(shape, parent, own, at.q);
    let frame = (parent.spin + own.spin) * 0.5;
    let rate_u = v[0] - (bent[0] * v[1] + bent[1] * v[2]) * 2.0;
    let curls = [(v[1] * gg + v[2] * gp) * 4.0, (v[1] * gp + v[2] * pp) * 4.0];
    let mixed_2 = frame * rate_u * 2.0;
    let mixed_1 = frame * v[1] * 2.0 + (v[1] * curls[0] + v[2] * curls[1]) * 0.5;
    let (squared_parent, squared, squared_frame) = (parent.spin * parent.spin, own.spin * own.spin, frame * frame);
    let push = parent.spin_rate;
    let (none, along) = (s * 0.0, [s * push + z[2] * 0.5, s]);
    let mut maps = [MotionMap { lever: [none; 2], columns: [[none; 2]; 3] }; 2];
    for i in 0..2 {
        // components of arms and of what they become by a right angle's turn
        let turned = |x: Vec2<T>| if i == 0 { -x[1] } else { x[0] };
        let (x, y) = (e1[i], e2[i]);
        // with the rotations of the joint's frame, of the body and of the parent
        let with_frame =
            (z[0] * y - z[1] * (x + bent[0] * y * 2.0) - mixed_2 * x - mixed_1 * y - squared_frame * turned(d)) * s
                - d[i] * along[0]
                - z[2] * bent[1] * y * s * 2.0;
        let with_own = r[i] * (push + z[2] * s) + squared * turned(r);
        let with_parent = -(r_parent[i] * push + squared_parent * turned(r_parent));
        // with the opening along and across, and with the bending's shares of it
        let with_u = y * along[0] - squared_frame * x * along[1];
        let with_g = -(x * along[0] + squared_frame * y * along[1]);
        let shares = [1, 2].map(|k| -(x * z[k] * 2.0 + frame * v[k] * y * 4.0) * s);
        maps[0].lever[i] = with_parent + with_own + with_frame;
        maps[0].columns[0][i] = with_u;
        maps[0].columns[1][i] = with_g - bent[0] * with_u * 2.0 + gg * shares[0] + gp * shares[1];
        maps[0].columns[2][i] =
            (with_own + with_frame * 0.5) * s - bent[1] * with_u * 2.0 + gp * shares[0] + pp * shares[1];
        let (rate_frame, rate_own) = ((rate_u * y - v[1] * x - frame * d[i]) * s * 2.0, own.spin * r[i] * 2.0);
        maps[1].lever[i] = rate_frame + rate_own - parent.spin * r_parent[i] * 2.0;
        maps[1].columns[0][i] = frame * y * s * 2.0;
        maps[1].columns[1][i] = -(frame * (x + bent[0] * y * 2.0) * 2.0 + curls[0] * x) * s;
        maps[1].columns[2][i] = (rate_own + rate_frame * 0.5) * s - (frame * bent[1] * y * 4.0 + curls[1] * x) * s;
    }
    let [displacement, rate] = maps;
    AccelerationMaps { displacement, rate }
}
