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

use super::real::Real;
use super::reduce::{Reduction, Task};
use super::schedule::Kind;

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
    /// Takes the coordinates of a run of pins out, from body `first` on. Returns the body after the run. `FORCED`: with
    /// forces and velocity parts.
    #[inline(always)]
    pub(super) fn pins_inward<const FORCED: bool>(&mut self, first: usize) -> usize {
        let mut handed = Handed::NOTHING;
        let mut body = first;
        while body < self.links.len() && self.schedule.steps[body].kind == Kind::Pin {
            let step = self.schedule.steps[body];
            let (link, placed) = (&self.links[body], &self.placed[body]);
            let [px, py] = placed.lever_parent;
            let (lx, ly) = (px - placed.shift[0], py - placed.shift[1]);
            let own = if FORCED { self.force[body] } else { [T::ZERO; 3] };
            let [cx, cy] = placed.bias;
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
                let node = &mut self.nodes[body];
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
            d += rx * hy - ry * hx;
            let inverse = T::ONE / d;
            let [mut gx, mut gy] = handed.force;
            if FORCED {
                gx -= hxx * cx + hxy * cy;
                gy -= hxy * cx + hyy * cy;
            }
            let drive = if FORCED { link.sign * self.torque[step.first as usize] } else { T::ZERO };
            let push = ((drive + moment) + (ly * fx - lx * fy)) + ((rx * gy - ry * gx) + handed.moment);
            let base = push * inverse;
            (ux, uy) = (ux + hx, uy + hy);
            let (vx, vy) = (ux * inverse, uy * inverse);
            let node = &mut self.nodes[body];
            (node.base, node.slope) = (base, [vx, vy]);
            let left = Handed {
                inertia: [(kxx + hxx) - ux * vx, (kxy + hxy) - ux * vy, (kyy + hyy) - uy * vy],
                force: [(fx + gx) - ux * base, (fy + gy) - uy * base],
                moment: -drive,
                lever: [px, py],
            };
            body += 1;
            handed = match step.parent() {
                None => Handed::NOTHING,
                Some(parent) if parent == body && self.schedule.steps[body].kind == Kind::Pin => left,
                Some(parent) => {
                    self.give(parent, &left);
                    Handed::NOTHING
                }
            };
        }
        body
    }

    /// Adds what a pin hands on to the node of `parent`, about its centre of mass.
    #[inline(always)]
    fn give(&mut self, parent: usize, left: &Handed<T>) {
        let ([kxx, kxy, kyy], [px, py], [fx, fy]) = (left.inertia, left.lever, left.force);
        let (mx, my) = (kxy * px - kxx * py, kyy * px - kxy * py);
        let node = &mut self.nodes[parent];
        for (sum, x) in node.inertia.iter_mut().zip([kxx, kxy, kyy, mx, my, my * px - mx * py]) {
            *sum += x;
        }
        for (sum, x) in node.momentum.iter_mut().zip([fx, fy, (fy * px - fx * py) + left.moment]) {
            *sum += x;
        }
    }

    /// Acceleration of a pin's body.
    #[inline(always)]
    pub(super) fn pin_outward(&mut self, task: Task, body: usize, out: &mut [T]) {
        let step = self.schedule.steps[body];
        let (placed, node) = (&self.placed[body], &self.nodes[body]);
        let [px, py] = placed.lever_parent;
        let (lx, ly) = (px - placed.shift[0], py - placed.shift[1]);
        let (mut a, mut turn) = ([T::ZERO; 2], T::ZERO);
        if let Some(parent) = step.parent() {
            let up = &self.accelerations[parent];
            turn = up[2];
            a = [up[0] - py * turn, up[1] + px * turn];
        }
        let angular = (node.base - node.slope[0] * a[0]) - node.slope[1] * a[1];
        out[step.first as usize] = self.links[body].sign * (angular - turn);
        if task == Task::Accelerations {
            a = [a[0] + placed.bias[0], a[1] + placed.bias[1]];
        }
        self.accelerations[body] = [a[0] + ly * angular, a[1] - lx * angular, angular];
    }
}
