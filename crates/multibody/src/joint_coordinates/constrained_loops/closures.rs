//! Loop closures: strains of a cut joint, their rows over the accelerations of its two bodies, and what velocities add.
//!
//! With the opening d between the two material points and the mean frame of [`crate::planar`], the strains
//! are e = (u + [g p]Q[g p]ᵀ, g, p). Their second derivative is A·a + b(v). This file forms the rows A and the velocity
//! terms b. A rotation is multiplied by the lever of its body, so that rows of one closure have one unit.

use super::data::{ReductionInput, ReductionTask, Workspace};
use super::mechanism::ClosureShape;
use super::poses::BodyKinematics;
use super::schedule::NONE;
use crate::planar::vector::{dot, minus, plus, right_angle};
use crate::scalar::StoredReal;
use std::ops::Range;

/// One direction of a closure: its value, rate, rows over bodies a and b, and the velocity part of its second derivative.
#[derive(Debug, Clone, Copy)]
pub(super) struct Strain<T> {
    pub value: T,
    pub rate: T,
    pub a: [T; 3],
    pub b: [T; 3],
    pub bias: T,
}

impl<T: StoredReal> ClosureShape<T> {
    /// The constraints of the closure at two placed bodies, its axial offset being `rest`; those beyond their number are not
    /// filled.
    #[inline(always)]
    fn constraints(&self, rest: T, a: &BodyKinematics<T>, b: &BodyKinematics<T>) -> [Strain<T>; 3] {
        let mut out = [Strain::NONE; 3];
        if self.pin {
            [out[0], out[1]] = self.pin_constraints(a, b);
            return out;
        }
        for (out, r) in out.iter_mut().zip(&self.held) {
            let dot = |x: &[T; 3]| r[0] * x[0] + r[1] * x[1] + r[2] * x[2];
            *out = Strain { value: dot(&a.pose), rate: dot(&a.rate), a: *r, b: [T::ZERO; 3], bias: T::ZERO };
        }
        if self.held.is_empty() {
            let [mut axial, shear, rotation] = self.strains(a, b);
            axial.value -= rest;
            let mut count = 0;
            for (strain, locked) in [axial, shear, rotation.scaled(self.lever)].into_iter().zip(self.locked) {
                if locked {
                    out[count] = strain;
                    count += 1;
                }
            }
        }
        out
    }

    /// A pin keeps two material points together: rows along x and y need no joint axes.
    #[inline(always)]
    fn pin_constraints(&self, a: &BodyKinematics<T>, b: &BodyKinematics<T>) -> [Strain<T>; 2] {
        let (sa, sb) = (a.rotation_minus_identity(self.arm_a), b.rotation_minus_identity(self.arm_b));
        let (ra, rb) = (plus(self.arm_a, sa), plus(self.arm_b, sb));
        let (wa, wb) = (a.rate[2], b.rate[2]);
        let (wa2, wb2) = (wa * wa, wb * wb);
        let (one, zero) = (T::ONE, T::ZERO);
        [
            Strain {
                value: (b.pose[0] - a.pose[0]) + (sb[0] - sa[0]),
                rate: (b.rate[0] - a.rate[0]) + (wa * ra[1] - wb * rb[1]),
                a: [-one, zero, ra[1]],
                b: [one, zero, -rb[1]],
                bias: wa2 * ra[0] - wb2 * rb[0],
            },
            Strain {
                value: (b.pose[1] - a.pose[1]) + (sb[1] - sa[1]),
                rate: (b.rate[1] - a.rate[1]) + (wb * rb[0] - wa * ra[0]),
                a: [zero, -one, -ra[0]],
                b: [zero, one, rb[0]],
                bias: wa2 * ra[1] - wb2 * rb[1],
            },
        ]
    }

    /// The three strains (e_u, g, p) of a joint.
    #[inline(always)]
    pub(super) fn strains(&self, a: &BodyKinematics<T>, b: &BodyKinematics<T>) -> [Strain<T>; 3] {
        let (half, two) = (T::splat(0.5), T::splat(2.0));
        let (sa, sb) = (a.rotation_minus_identity(self.arm_a), b.rotation_minus_identity(self.arm_b));
        let (ra, rb) = (plus(self.arm_a, sa), plus(self.arm_b, sb));
        let (ta, tb) = (right_angle(ra), right_angle(rb));
        let d = [(b.pose[0] - a.pose[0]) + (sb[0] - sa[0]), (b.pose[1] - a.pose[1]) + (sb[1] - sa[1])];
        let e1 = a.mean(b, self.axis);
        let e2 = right_angle(e1);
        let (u, g, p) = (dot(d, e1), dot(d, e2), b.pose[2] - a.pose[2]);
        let (wa, wb) = (a.rate[2], b.rate[2]);
        let dd =
            [(b.rate[0] - a.rate[0]) + (wb * tb[0] - wa * ta[0]), (b.rate[1] - a.rate[1]) + (wb * tb[1] - wa * ta[1])];
        let turning = half * (wa + wb);
        let bend = minus([wa * wa * ra[0], wa * wa * ra[1]], [wb * wb * rb[0], wb * wb * rb[1]]);
        let (along, across) = (dot(dd, e1), dot(dd, e2));
        let axial = Strain {
            value: u,
            rate: along + turning * g,
            a: [-e1[0], -e1[1], half * g - dot(e1, ta)],
            b: [e1[0], e1[1], half * g + dot(e1, tb)],
            bias: dot(bend, e1) + two * turning * across - turning * turning * u,
        };
        let shear = Strain {
            value: g,
            rate: across - turning * u,
            a: [-e2[0], -e2[1], -(half * u) - dot(e2, ta)],
            b: [e2[0], e2[1], dot(e2, tb) - half * u],
            bias: dot(bend, e2) - two * turning * along - turning * turning * g,
        };
        let rotation = Strain {
            value: p,
            rate: wb - wa,
            a: [T::ZERO, T::ZERO, -T::ONE],
            b: [T::ZERO, T::ZERO, T::ONE],
            bias: T::ZERO,
        };
        let [q0, q1, q2] = self.second;
        let bent = [q0 * g + q1 * p, q1 * g + q2 * p];
        let rates = [shear.rate, rotation.rate];
        let bent_rate = [q0 * rates[0] + q1 * rates[1], q1 * rates[0] + q2 * rates[1]];
        let slope = [two * bent[0], two * bent[1]];
        let mix = |x: T, v: T, w: T| x + (slope[0] * v + slope[1] * w);
        let second = Strain {
            value: u + (bent[0] * g + bent[1] * p),
            rate: mix(axial.rate, shear.rate, rotation.rate),
            a: [0, 1, 2].map(|i| mix(axial.a[i], shear.a[i], rotation.a[i])),
            b: [0, 1, 2].map(|i| mix(axial.b[i], shear.b[i], rotation.b[i])),
            bias: mix(axial.bias, shear.bias, T::ZERO) + two * (bent_rate[0] * rates[0] + bent_rate[1] * rates[1]),
        };
        [second, shear, rotation]
    }
}

impl<T: StoredReal> Workspace<T> {
    /// Writes the constraint rows of the closures of `range`. Returns the largest residual of a row.
    #[inline(always)]
    pub(super) fn write_rows(&mut self, given: ReductionInput<'_, T>, range: Range<usize>) -> T {
        let ReductionInput { task, mechanism, offsets, placement, .. } = given;
        let schedule = &mechanism.schedule;
        let mut largest = T::ZERO;
        let ground = BodyKinematics::REST;
        let of = mechanism.closures[range.clone()].iter().zip(&offsets.closures[range.clone()]);
        for ((closure, offset), entry) in of.zip(&schedule.entries[range]) {
            let turn = schedule.turn(entry.body);
            let width = 3 + 3 * turn.front + 1;
            let [a, b] = entry.ends.map(|end| end.map_or(&ground, |body| &placement.placed[body as usize]));
            let first_is_a = entry.ends[0] == Some(entry.body as u32);
            for (k, strain) in closure.constraints(*offset, a, b).iter().enumerate().take(entry.count) {
                let start = turn.row_start + (entry.row + k) * width;
                let row = &mut self.rows[start..start + width];
                row.fill(T::ZERO);
                let (own, other) = if first_is_a { (&strain.a, &strain.b) } else { (&strain.b, &strain.a) };
                row[..3].copy_from_slice(own);
                if entry.other != NONE {
                    let at = 3 + 3 * entry.other;
                    row[at..at + 3].copy_from_slice(other);
                }
                row[width - 1] = -match task {
                    ReductionTask::Accelerations => strain.bias,
                    ReductionTask::Rates => strain.rate,
                    ReductionTask::Positions => strain.value,
                };
                largest = largest.max(row[width - 1].abs());
            }
        }
        largest
    }
}

impl<T: StoredReal> Strain<T> {
    const NONE: Self = Self { value: T::ZERO, rate: T::ZERO, a: [T::ZERO; 3], b: [T::ZERO; 3], bias: T::ZERO };

    #[inline(always)]
    fn scaled(&self, k: T) -> Self {
        Self {
            value: k * self.value,
            rate: k * self.rate,
            a: self.a.map(|x| k * x),
            b: self.b.map(|x| k * x),
            bias: k * self.bias,
        }
    }
}
