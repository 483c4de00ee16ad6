//! Outward pass: from joint coordinates and their rates to the pose and rate of every body.
//!
//! A joint's coordinates are its strains (e_u, g, p). With the mean frame ψ = β + θ_p + s·p/2 of the joint and the
//! opening w = (u, g), u = e_u − [g p] Q [g p]ᵀ, the pose of a body relative to its parent is
//! ```text
//! θ = θ_p + s·p
//! x = x_p + (R_p − 1)·arm_p + s·R(ψ)·w − (R − 1)·arm
//! a = X·a_p + S·q̈ + c          X: rigid shift by d = R_p·arm_p + s·R(ψ)·w − R·arm
//! ```
//! S are the columns ∂(x, y, θ)/∂(e_u, g, p) of the directions that move, and c gathers the centripetal and Coriolis parts,
//! the acceleration when q̈ = 0 and the parent's is zero.

use super::mechanism::{Arms, JointShape, MechanismConstants};
use super::poses::{BodyKinematics, MechanismKinematics, ParentOffset};
use crate::planar::Vec2;
use crate::planar::vector::{minus, plus, right_angle, scaled};
use crate::scalar::StoredReal;
use std::ops::Range;

/// A body that nothing holds: its coordinates are its pose, its axes the directions themselves.
#[inline(always)]
fn place_free<T: StoredReal>(out: &mut BodyKinematics<T>, q: &[T], v: &[T], axes: &mut [[T; 3]]) {
    for (k, axis) in axes.iter_mut().enumerate() {
        *axis = [T::ZERO; 3];
        axis[k] = T::ONE;
    }
    (out.pose[0], out.pose[1]) = (q[0], q[1]);
    (out.rate[0], out.rate[1]) = (v[0], v[1]);
}

/// A pin: rotation alone, no axial second-order strain.
#[inline(always)]
fn place_pin<T: StoredReal>(
    arms: &Arms<T>,
    parent: &BodyKinematics<T>,
    out: &mut BodyKinematics<T>,
) -> ParentOffset<T> {
    let (wp, w) = (parent.rate[2], out.rate[2]);
    let (swung, swung_parent) =
        (out.rotation_minus_identity(arms.arm), parent.rotation_minus_identity(arms.arm_parent));
    let lever = plus(arms.arm, swung);
    let to = plus(arms.arm_parent, swung_parent);
    let (wp2, w2) = (wp * wp, w * w);
    out.pose[0] = parent.pose[0] + (swung_parent[0] - swung[0]);
    out.pose[1] = parent.pose[1] + (swung_parent[1] - swung[1]);
    out.rate[0] = parent.rate[0] + (w * lever[1] - wp * to[1]);
    out.rate[1] = parent.rate[1] + (wp * to[0] - w * lever[0]);
    ParentOffset { lever_parent: to, lever, bias: [w2 * lever[0] - wp2 * to[0], w2 * lever[1] - wp2 * to[1]] }
}

/// A joint with any directions; `rest` is the axial offset of a locked one.
fn place_joint<T: StoredReal>(
    (arms, sign, joint, rest): (&Arms<T>, T, &JointShape<T>, T),
    parent: &BodyKinematics<T>,
    out: &mut BodyKinematics<T>,
    q: &[T],
    v: &[T],
    axes: &mut [[T; 3]],
) -> ParentOffset<T> {
    let (mut e, mut de) = ([rest, T::ZERO, T::ZERO], [T::ZERO; 3]);
    let mut next = 0;
    for i in 0..3 {
        if joint.moving[i] {
            (e[i], de[i]) = (q[next], v[next]);
            next += 1;
        }
    }
    let two = T::splat(2.0);
    let [q0, q1, q2] = joint.second;
    let bent = [q0 * e[1] + q1 * e[2], q1 * e[1] + q2 * e[2]];
    let bent_rate = [q0 * de[1] + q1 * de[2], q1 * de[1] + q2 * de[2]];
    // axial opening, its rate, and what is left of its acceleration at constant rates
    let w = [e[0] - (bent[0] * e[1] + bent[1] * e[2]), e[1]];
    let dw = [de[0] - two * (bent[0] * de[1] + bent[1] * de[2]), de[1]];
    let ddw = [-(two * (bent_rate[0] * de[1] + bent_rate[1] * de[2])), T::ZERO];
    let omega = out.rate[2];
    let (swung, swung_parent) =
        (out.rotation_minus_identity(arms.arm), parent.rotation_minus_identity(arms.arm_parent));
    let lever = plus(arms.arm, swung);
    let lever_parent = plus(arms.arm_parent, swung_parent);
    let e1 = out.mean(parent, joint.axis);
    let e2 = right_angle(e1);
    let along = |w: Vec2<T>| plus(scaled(w[0], e1), scaled(w[1], e2));
    let (rw, rdw, rddw) = (along(w), along(dw), along(ddw));
    let opening = scaled(sign, rw);
    let shift = minus(plus(lever_parent, opening), lever);
    let d = minus(plus(swung_parent, opening), swung);
    (out.pose[0], out.pose[1]) = (parent.pose[0] + d[0], parent.pose[1] + d[1]);
    let wp = parent.rate[2];
    let frame_rate = wp + sign * T::splat(0.5) * de[2];
    let (to_joint, from_joint) = (right_angle(lever_parent), right_angle(lever));
    let opening_rate = plus(scaled(frame_rate, right_angle(rw)), rdw);
    let x = minus(plus(scaled(wp, to_joint), scaled(sign, opening_rate)), scaled(omega, from_joint));
    (out.rate[0], out.rate[1]) = (parent.rate[0] + x[0], parent.rate[1] + x[1]);
    let turning = plus(minus(scaled(two * frame_rate, right_angle(rdw)), scaled(frame_rate * frame_rate, rw)), rddw);
    let bias = minus(plus(scaled(omega * omega, lever), scaled(sign, turning)), scaled(wp * wp, lever_parent));
    let slope = [two * bent[0], two * bent[1]];
    let columns = [
        [sign * e1[0], sign * e1[1], T::ZERO],
        [sign * (e2[0] - slope[0] * e1[0]), sign * (e2[1] - slope[0] * e1[1]), T::ZERO],
        {
            let half = scaled(T::splat(0.5), right_angle(rw));
            let x = minus(minus(half, scaled(sign, from_joint)), scaled(sign * slope[1], e1));
            [x[0], x[1], sign]
        },
    ];
    let mut next = 0;
    for i in 0..3 {
        if joint.moving[i] {
            axes[next] = columns[i];
            next += 1;
        }
    }
    ParentOffset { lever_parent: shift, lever: [T::ZERO; 2], bias }
}

/// Bodies whose sines are taken together.
const BLOCK: usize = 16;

impl<T: StoredReal> MechanismKinematics<T> {
    /// Places the bodies of `range`, root → leaf, in blocks: angles first, so that the sines of a block are evaluated
    /// in vector instructions. `rests` are the axial offsets of locked joints.
    #[inline(always)]
    pub(super) fn place(
        &mut self,
        mechanism: &MechanismConstants<T>,
        rests: &[T],
        q: &[T],
        v: &[T],
        range: Range<usize>,
    ) {
        let steps = &mechanism.schedule.steps;
        let Self { placed, hanging, axes } = self;
        let ground = BodyKinematics::REST;
        let mut end = range.end;
        while end > range.start {
            let start = end.saturating_sub(BLOCK).max(range.start);
            let mut halves = [[T::ZERO; BLOCK]; 2];
            let block = start..end;
            let (some, signs) = (&steps[block.clone()], &mechanism.signs[block.clone()]);
            for (k, (step, sign)) in some.iter().zip(signs).enumerate().rev() {
                let (mut theta, mut omega) = match step.parent() {
                    Some(p) => (placed[p].pose[2], placed[p].rate[2]),
                    None => (T::ZERO, T::ZERO),
                };
                if let Some(k) = step.turning() {
                    theta += *sign * q[k];
                    omega += *sign * v[k];
                }
                let out = &mut placed[start + k];
                (out.pose[2], out.rate[2]) = (theta, omega);
                halves[0][k] = T::splat(0.5) * theta;
            }
            let [sin, cos] = &mut halves;
            T::sin_cos_each(&mut sin[..end - start], &mut cos[..end - start]);
            let given = some.iter().zip(signs).zip(mechanism.arms[block.clone()].iter().zip(&mut hanging[block]));
            for (k, ((step, sign), (arms, hanging))) in given.enumerate().rev() {
                let body = start + k;
                let (before, after) = placed.split_at_mut(body + 1);
                let out = &mut before[body];
                out.half = [halves[0][k], halves[1][k]];
                let parent = match step.parent() {
                    Some(p) => &after[p - body - 1],
                    None => &ground,
                };
                if step.pin {
                    *hanging = place_pin(arms, parent, out);
                    continue;
                }
                let first = step.first as usize;
                let range = first..first + step.freedom as usize;
                let (q, v, axes) = (&q[range.clone()], &v[range.clone()], &mut axes[range]);
                let joint = &mechanism.joints[step.joint as usize];
                *hanging = if joint.free {
                    place_free(out, q, v, axes);
                    ParentOffset::REST
                } else {
                    place_joint((arms, *sign, joint, rests[step.joint as usize]), parent, out, q, v, axes)
                };
            }
            end = start;
        }
    }
}
