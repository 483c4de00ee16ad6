//! The turn of a body on a pin that no loop passes: the articulated-body recursion about the pin.
//!
//! A body on a pin transmits only a force to its parent. Its remaining inertia there is translational: three numbers K,
//! a force f, and the reaction moment of the pin's own drive on the parent. With ρ from a body's own pin to the next
//! one outward and ℓ from its centre of mass to its pin,
//! ```text
//! u = (m·ℓ, −m·ℓ) + K·ρ⊥      force at the pin per angular acceleration
//! D = θ + m·ℓ² + ρ⊥·K·ρ⊥      moment about the pin per angular acceleration
//! K ← m + K − u·uᵀ/D
//! ```
//! and outward ω̇ = base − (u/D)·a_pin. Along a chain K and f go from pin to pin, and little of each step waits for the one
//! before: a product, the division, a product.
//!
//! Reference: R. Featherstone, "Rigid Body Dynamics Algorithms" (2008), chapter 7, for the articulated inertia; the choice
//! of the pin as its point of reference is ours.

use super::data::{FrontAccumulator, PinContribution, ReductionInput, Workspace};
use super::mechanism::LaneInertia;
use super::poses::ParentOffset;
use crate::scalar::StoredReal;

/// A body on a pin.
#[derive(Debug, Clone, Copy)]
pub(super) struct PinElimination<'a, T> {
    pub inertia: &'a LaneInertia<T>,
    pub sign: T,
    pub hanging: &'a ParentOffset<T>,
    /// Wrench on it.
    pub force: &'a [T; 3],
    /// Force on its coordinate.
    pub torque: T,
}

impl<T: StoredReal> PinContribution<T> {
    /// Takes the coordinate of the body out, to which this was handed, and what has gathered in `node`. Returns base and
    /// slope of its angular acceleration, and what it hands on. `FORCED`: with forces and velocity parts.
    #[inline(always)]
    pub(super) fn inward<const FORCED: bool>(
        self,
        body: PinElimination<'_, T>,
        node: Option<&mut FrontAccumulator<T>>,
    ) -> (T, [T; 2], Self) {
        let PinElimination { inertia: own, sign, hanging, force, torque } = body;
        let ([px, py], [dx, dy]) = (hanging.lever_parent, hanging.shift());
        let (lx, ly) = (px - dx, py - dy);
        let [cx, cy] = hanging.bias;
        // own mass, and what came by way of memory
        let (mut kxx, mut kxy, mut kyy) = (own.mass, T::ZERO, own.mass);
        let (mut ux, mut uy) = (own.mass * ly, -(own.mass * lx));
        let mut d = (ly * ux - lx * uy) + own.moment;
        let [mut fx, mut fy, mut moment] = if FORCED { *force } else { [T::ZERO; 3] };
        if FORCED {
            fx -= own.mass * cx;
            fy -= own.mass * cy;
        }
        if let Some(node) = node {
            let [a, b, c, d_, e, f] = std::mem::replace(&mut node.inertia, [T::ZERO; 6]);
            let momentum = std::mem::replace(&mut node.momentum, [T::ZERO; 3]);
            let (gx, gy) = ((a * ly - b * lx) + d_, (b * ly - c * lx) + e);
            d += (ly * gx - lx * gy) + ((d_ * ly - e * lx) + f);
            (ux, uy) = (ux + gx, uy + gy);
            (kxx, kxy, kyy) = (kxx + a, kxy + b, kyy + c);
            (fx, fy, moment) = (fx + momentum[0], fy + momentum[1], moment + momentum[2]);
            if FORCED {
                fx -= a * cx + b * cy;
                fy -= b * cx + c * cy;
                moment -= d_ * cx + e * cy;
            }
        }
        // what the body before handed on
        let [hxx, hxy, hyy] = self.inertia;
        let (rx, ry) = (self.lever[0] - lx, self.lever[1] - ly);
        let (hx, hy) = (hxy * rx - hxx * ry, hyy * rx - hxy * ry);
        d += (rx * rx * hyy + ry * ry * hxx) - (rx * ry + rx * ry) * hxy;
        let inverse = T::ONE / d;
        let [mut gx, mut gy] = self.force;
        if FORCED {
            gx -= hxx * cx + hxy * cy;
            gy -= hxy * cx + hyy * cy;
        }
        let drive = if FORCED { sign * torque } else { T::ZERO };
        let push = ((drive + moment) + (ly * fx - lx * fy)) + ((rx * gy - ry * gx) + self.moment);
        let base = push * inverse;
        (ux, uy) = (ux + hx, uy + hy);
        let slope = [ux * inverse, uy * inverse];
        let left = Self {
            inertia: [
                (kxx + hxx) - (ux * ux) * inverse,
                (kxy + hxy) - (ux * uy) * inverse,
                (kyy + hyy) - (uy * uy) * inverse,
            ],
            force: [(fx + gx) - ux * base, (fy + gy) - uy * base],
            moment: -drive,
            lever: [px, py],
        };
        (base, slope, left)
    }

    /// Adds it to the node of the next body, about that one's centre of mass.
    #[inline(always)]
    pub(super) fn give(&self, node: &mut FrontAccumulator<T>) {
        let ([kxx, kxy, kyy], [px, py], [fx, fy]) = (self.inertia, self.lever, self.force);
        let (mx, my) = (kxy * px - kxx * py, kyy * px - kxy * py);
        for (sum, x) in node.inertia.iter_mut().zip([kxx, kxy, kyy, mx, my, my * px - mx * py]) {
            *sum += x;
        }
        for (sum, x) in node.momentum.iter_mut().zip([fx, fy, (fy * px - fx * py) + self.moment]) {
            *sum += x;
        }
    }
}

/// Acceleration of a body on a pin, and of its coordinate, from base, slope and the acceleration `up` of its parent.
#[inline(always)]
pub(super) fn outward<const FORCED: bool, T: StoredReal>(
    (base, slope): (T, [T; 2]),
    sign: T,
    hanging: &ParentOffset<T>,
    up: [T; 3],
) -> ([T; 3], T) {
    let ([px, py], [dx, dy]) = (hanging.lever_parent, hanging.shift());
    let (lx, ly) = (px - dx, py - dy);
    let mut a = [up[0] - py * up[2], up[1] + px * up[2]];
    let angular = (base - slope[0] * a[0]) - slope[1] * a[1];
    let out = sign * (angular - up[2]);
    if FORCED {
        a = [a[0] + hanging.bias[0], a[1] + hanging.bias[1]];
    }
    ([a[0] + ly * angular, a[1] - lx * angular, angular], out)
}

impl<T: StoredReal> Workspace<T> {
    /// Takes the coordinate of one body on a pin out.
    #[inline(always)]
    pub(super) fn pin_inward<const FORCED: bool>(&mut self, given: ReductionInput<'_, T>, body: usize) {
        let (mechanism, schedule) = (given.mechanism, &given.mechanism.schedule);
        let step = &schedule.steps[body];
        let first = step.first as usize;
        let pinned = PinElimination {
            inertia: &mechanism.inertias[body],
            sign: mechanism.signs[body],
            hanging: &given.placement.hanging[body],
            force: &given.force[body],
            torque: given.torque[first],
        };
        let handed = std::mem::replace(&mut self.handed, PinContribution::NOTHING);
        let node = step.gathers.then(|| &mut self.nodes[step.node as usize]);
        let (base, slope, left) = handed.inward::<FORCED>(pinned, node);
        self.base[first] = base;
        let at = step.coefficient_start as usize;
        self.coefficients[at..at + 2].copy_from_slice(&slope);
        if step.hands_on {
            self.handed = left;
        } else if step.parent().is_some() {
            left.give(&mut self.nodes[schedule.nodes[step.column as usize] as usize]);
        }
    }

    /// Acceleration of one body on a pin.
    #[inline(always)]
    pub(super) fn pin_outward<const FORCED: bool>(
        &self,
        given: ReductionInput<'_, T>,
        body: usize,
        accelerations: &mut [[T; 3]],
        out: &mut [T],
    ) {
        let step = &given.mechanism.schedule.steps[body];
        let (first, at) = (step.first as usize, step.coefficient_start as usize);
        let up = step.parent().map_or([T::ZERO; 3], |parent| accelerations[parent]);
        let taken = (self.base[first], [self.coefficients[at], self.coefficients[at + 1]]);
        let (sign, hanging) = (given.mechanism.signs[body], &given.placement.hanging[body]);
        (accelerations[body], out[first]) = outward::<FORCED, T>(taken, sign, hanging, up);
    }
}
