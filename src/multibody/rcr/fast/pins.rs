//! Runs of pins without loops: the articulated-body recursion about the pins.
//!
//! A body that hangs on a pin hands its parent a force through the pin, so what is left of its inertia there is
//! translational: three numbers K, a force f, and the moment that the pin's own drive takes from the parent. With ρ from a
//! body's own pin to the next one outward and ℓ from its centre of mass to its pin,
//! ```text
//! u = (m·ℓ, −m·ℓ) + K·ρ⊥      force at the pin per angular acceleration
//! D = θ + m·ℓ² + ρ⊥·K·ρ⊥      moment about the pin per angular acceleration
//! K ← m + K − u·uᵀ/D
//! ```
//! and outward ω̇ = base − (u/D)·a_pin. Along a chain K and f stay in registers, and little of each step waits for the one
//! before: a product, the division, a product.
//!
//! Reference: R. Featherstone, "Rigid Body Dynamics Algorithms" (2008), chapter 7, for the articulated inertia; the choice
//! of the pin as its point of reference is ours.

use crate::multibody::rcr::reduction::{Node, Reduction};
use crate::multibody::rcr::scalar::Real;
use std::ops::Range;

/// What one pin's body hands to the next inward, about the pin between them.
#[derive(Clone, Copy)]
struct Handed<T> {
    /// Inertia left at the pin: xx, xy, yy [kg].
    inertia: [T; 3],
    /// Force through the pin [N].
    force: [T; 2],
    /// Moment of the pin's drive on the next body [N·m].
    moment: T,
    /// From the next body's centre of mass to the pin [m].
    lever: [T; 2],
}

impl<T: Real> Handed<T> {
    const NOTHING: Self = Self { inertia: [T::ZERO; 3], force: [T::ZERO; 2], moment: T::ZERO, lever: [T::ZERO; 2] };
}

impl<T: Real> Reduction<T> {
    /// Takes the coordinates of a run of pins out, from body `first` on and not beyond `end`. Returns the body after the
    /// run. `FORCED`: with forces and velocity parts.
    #[inline(always)]
    pub(in crate::multibody::rcr) fn pins_inward<const FORCED: bool>(&mut self, first: usize, end: usize) -> usize {
        let (mut run, mut handed) = (self.schedule.run(first, end), Handed::NOTHING);
        while !run.is_empty() {
            handed = self.some_pins_inward::<FORCED>(run.clone(), handed);
            run = self.schedule.run(run.end, end);
        }
        run.end
    }

    /// The part `run` of a run of pins, to whose first body `handed` comes. Returns what its last one hands to the next.
    #[inline(always)]
    fn some_pins_inward<const FORCED: bool>(&mut self, run: Range<usize>, mut handed: Handed<T>) -> Handed<T> {
        let steps = &self.schedule.steps[run.clone()];
        // a pin has one coordinate, so those of a run follow each other
        let coordinates = steps[0].first as usize..steps[0].first as usize + steps.len();
        let (slopes, _) = self.coefficients[steps[0].coefficient_start as usize..].as_chunks_mut();
        let zipped = (steps.iter().zip(self.links[run.clone()].iter().zip(&self.signs[run.clone()])))
            .zip(self.hanging[run.clone()].iter().zip(&self.force[run]))
            .zip(self.base[coordinates.clone()].iter_mut().zip(slopes).zip(&self.torque[coordinates]));
        for (((step, (link, sign)), (hanging, own)), ((to_base, to_slope), torque)) in zipped {
            let ([px, py], [dx, dy]) = (hanging.lever_parent, hanging.shift());
            let (lx, ly) = (px - dx, py - dy);
            let own = if FORCED { *own } else { [T::ZERO; 3] };
            let [cx, cy] = hanging.bias;
            // own mass, and what came by way of memory
            let (mut kxx, mut kxy, mut kyy) = (link.mass, T::ZERO, link.mass);
            let (mut ux, mut uy) = (link.mass * ly, -(link.mass * lx));
            let mut d = (ly * ux - lx * uy) + link.inertia;
            let [mut fx, mut fy, mut moment] = own;
            if FORCED {
                fx -= link.mass * cx;
                fy -= link.mass * cy;
            }
            if step.gathers {
                let node = &mut self.nodes[step.node as usize];
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
            let [hxx, hxy, hyy] = handed.inertia;
            let (rx, ry) = (handed.lever[0] - lx, handed.lever[1] - ly);
            let (hx, hy) = (hxy * rx - hxx * ry, hyy * rx - hxy * ry);
            d += (rx * rx * hyy + ry * ry * hxx) - (rx * ry + rx * ry) * hxy;
            let inverse = T::ONE / d;
            let [mut gx, mut gy] = handed.force;
            if FORCED {
                gx -= hxx * cx + hxy * cy;
                gy -= hxy * cx + hyy * cy;
            }
            let drive = if FORCED { *sign * *torque } else { T::ZERO };
            let push = ((drive + moment) + (ly * fx - lx * fy)) + ((rx * gy - ry * gx) + handed.moment);
            let base = push * inverse;
            (ux, uy) = (ux + hx, uy + hy);
            let (vx, vy) = (ux * inverse, uy * inverse);
            (*to_base, *to_slope) = (base, [vx, vy]);
            let left = Handed {
                inertia: [
                    (kxx + hxx) - (ux * ux) * inverse,
                    (kxy + hxy) - (ux * uy) * inverse,
                    (kyy + hyy) - (uy * uy) * inverse,
                ],
                force: [(fx + gx) - ux * base, (fy + gy) - uy * base],
                moment: -drive,
                lever: [px, py],
            };
            handed = left;
            if !step.hands_on {
                handed = Handed::NOTHING;
                if step.parent().is_some() {
                    left.give(&mut self.nodes[self.schedule.nodes[step.column as usize] as usize]);
                }
            }
        }
        handed
    }

    /// Accelerations of the bodies of a run of pins that ends with `range`, root → leaf. Returns its first body, which lies
    /// in `range`.
    #[inline(always)]
    pub(in crate::multibody::rcr) fn pins_outward<const FORCED: bool>(
        &mut self,
        range: Range<usize>,
        out: &mut [T],
    ) -> usize {
        // of the body after, which is the parent along a chain
        let (mut run, mut after) = (self.schedule.run_before(range.clone()), [T::ZERO; 3]);
        while !run.is_empty() {
            after = self.some_pins_outward::<FORCED>(run.clone(), after, out);
            run = self.schedule.run_before(range.start..run.start);
        }
        run.start
    }

    /// The part `run` of a run of pins; `after` is the acceleration of the body after it. Returns that of its first one.
    #[inline(always)]
    fn some_pins_outward<const FORCED: bool>(&mut self, run: Range<usize>, mut after: [T; 3], out: &mut [T]) -> [T; 3] {
        let first = run.start;
        let steps = &self.schedule.steps[run.clone()];
        let coordinates = steps[0].first as usize..steps[0].first as usize + steps.len();
        let (slopes, _) = self.coefficients[steps[0].coefficient_start as usize..].as_chunks::<2>();
        let zipped = (steps.iter().zip(&self.signs[run.clone()]))
            .zip(&self.hanging[run])
            .zip(self.base[coordinates.clone()].iter().zip(&slopes[..steps.len()]).zip(&mut out[coordinates]));
        for (k, (((step, sign), hanging), ((base, slope), out))) in zipped.enumerate().rev() {
            let up = match step.parent() {
                _ if step.hands_on => after,
                Some(parent) => self.accelerations[parent],
                None => [T::ZERO; 3],
            };
            let ([px, py], [dx, dy]) = (hanging.lever_parent, hanging.shift());
            let (lx, ly) = (px - dx, py - dy);
            let mut a = [up[0] - py * up[2], up[1] + px * up[2]];
            let angular = (*base - slope[0] * a[0]) - slope[1] * a[1];
            *out = *sign * (angular - up[2]);
            if FORCED {
                a = [a[0] + hanging.bias[0], a[1] + hanging.bias[1]];
            }
            after = [a[0] + ly * angular, a[1] - lx * angular, angular];
            self.accelerations[first + k] = after;
        }
        after
    }
}

impl<T: Real> Handed<T> {
    /// Adds it to the node of the next body, about that one's centre of mass.
    #[inline(always)]
    fn give(&self, node: &mut Node<T>) {
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
