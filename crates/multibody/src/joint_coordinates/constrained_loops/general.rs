//! The turn of any body: several coordinates, fronts of any width, any number of rows.
//!
//! The front is assembled from the body's inertia, its couplings and the rows that reach it, [`super::front`] takes its
//! coordinates out, and what is left goes to the bodies of the front. [`super::fast::kernels`] does the same for small fronts.

use super::data::{FrontScratch, ReductionInput, ReductionTask, StageInertia, Workspace};
use super::front::Front;
use super::mechanism::MechanismConstants;
use super::schedule::{BodyElimination, NONE};
use crate::scalar::StoredReal;

impl<T: StoredReal> Workspace<T> {
    /// Assembles a body's front, takes its coordinates out, and hands the rest on.
    #[inline(never)]
    pub(super) fn any_inward(&mut self, given: ReductionInput<'_, T>, body: usize) {
        let mut scratch = FrontScratch {
            m: std::mem::take(&mut self.front.m),
            g: std::mem::take(&mut self.front.g),
            r: std::mem::take(&mut self.front.r),
        };
        self.take_out(given, body, &mut scratch);
        self.front = scratch;
    }

    #[inline(always)]
    fn take_out(&mut self, given: ReductionInput<'_, T>, body: usize, FrontScratch { m, g, r }: &mut FrontScratch<T>) {
        let ReductionInput { task, mechanism, placement, .. } = given;
        let turn = mechanism.schedule.turn(body);
        let (nd, w, h) = (turn.freedom, turn.front, turn.rows);
        let k = nd + 3 * w;
        // several coordinates are combined, so they get one unit first
        let (mut s, mut torque, mut unit) = ([[T::ZERO; 3]; 3], [T::ZERO; 3], [T::ONE; 3]);
        for q in 0..nd {
            let at = turn.first + q;
            let (axis, lever) = (placement.axis(mechanism, body, at), mechanism.units[at]);
            (s[q], torque[q], unit[q]) = (axis, given.torque[at], lever);
            if nd > 1 {
                let inverse = T::ONE / lever;
                (s[q], torque[q], unit[q]) = (axis.map(|x| x * inverse), torque[q] * inverse, T::ONE);
            }
        }
        self.assemble(given, body, (&s, &torque), m, g);
        self.add_joint_inertia(mechanism, body, nd > 1, m);
        let [dx, dy] = placement.hanging[body].shift();
        let bias = if task == ReductionTask::Accelerations { placement.hanging[body].bias } else { [T::ZERO; 2] };
        let source = 3 + 3 * w + 1;
        for l in 0..h {
            let row = &self.rows[turn.row_start + l * source..turn.row_start + (l + 1) * source];
            let own = [row[0], row[1], row[2]];
            for q in 0..nd {
                r[l * (k + 1) + q] = own[0] * s[q][0] + own[1] * s[q][1] + own[2] * s[q][2];
            }
            r[l * (k + 1) + nd..l * (k + 1) + k].copy_from_slice(&row[3..3 + 3 * w]);
            if turn.parent != NONE {
                let p = l * (k + 1) + nd + 3 * turn.parent;
                r[p] += own[0];
                r[p + 1] += own[1];
                r[p + 2] += own[2] + (own[1] * dx - own[0] * dy);
            }
            r[l * (k + 1) + k] = row[source - 1] - (own[0] * bias[0] + own[1] * bias[1]);
        }
        let mut combined = [[T::ONE, T::ZERO, T::ZERO], [T::ZERO, T::ONE, T::ZERO], [T::ZERO, T::ZERO, T::ONE]];
        let mut front = Front { freedom: nd, size: k, rows: h, m, g, r, unit: &unit };
        let near = front.eliminate(
            &mut self.coefficients[turn.coefficient_start..turn.coefficient_start + nd * k],
            &mut self.base[turn.first..turn.first + nd],
            &mut combined,
        );
        self.nearness = self.nearness.max(near);
        if nd > 1 {
            self.combined[body] = combined;
        }
        self.hand_on(mechanism, turn, m, g);
        if turn.next != NONE {
            let next = mechanism.schedule.turn(turn.next);
            let width = 3 + 3 * next.front + 1;
            for (l, from) in (nd.min(h)..h).enumerate() {
                let to = next.row_start + (turn.next_row + l) * width;
                self.rows[to..to + width].fill(T::ZERO);
                for slot in 0..w {
                    let place = mechanism.schedule.map(turn.map_start + slot);
                    if place != NONE {
                        for i in 0..3 {
                            self.rows[to + 3 * place + i] = r[from * (k + 1) + nd + 3 * slot + i];
                        }
                    }
                }
                self.rows[to + width - 1] = r[from * (k + 1) + k];
            }
        }
    }

    /// Fills M (lower triangle) and g of a body's front from its inertia, its couplings and its momentum. `s` are the joint
    /// axes and `torque` the forces along them.
    #[inline(always)]
    pub(super) fn assemble(
        &mut self,
        given: ReductionInput<'_, T>,
        body: usize,
        (s, torque): (&[[T; 3]], &[T]),
        m: &mut [T],
        g: &mut [T],
    ) {
        let ReductionInput { task, mechanism, placement, .. } = given;
        let turn = mechanism.schedule.turn(body);
        let (nd, w) = (turn.freedom, turn.front);
        let k = nd + 3 * w;
        let [a, b, c, d, e, f] = self.take_inertia(mechanism, body);
        let own = [[a, b, d], [b, c, e], [d, e, f]];
        let mut force = self.take_force(given, body);
        let hanging = &placement.hanging[body];
        let bias = if task == ReductionTask::Accelerations { hanging.bias } else { [T::ZERO; 2] };
        for i in 0..3 {
            force[i] -= own[i][0] * bias[0] + own[i][1] * bias[1];
        }
        m[..k * k].fill(T::ZERO);
        g[..k].fill(T::ZERO);
        let mut hs = [[T::ZERO; 3]; 3];
        for q in 0..nd {
            for i in 0..3 {
                hs[q][i] = own[i][0] * s[q][0] + own[i][1] * s[q][1] + own[i][2] * s[q][2];
            }
            let along = if task == ReductionTask::Accelerations { torque[q] } else { T::ZERO };
            g[q] = along + (s[q][0] * force[0] + s[q][1] * force[1] + s[q][2] * force[2]);
            for p in 0..=q {
                m[q * k + p] = s[p][0] * hs[q][0] + s[p][1] * hs[q][1] + s[p][2] * hs[q][2];
            }
        }
        let [dx, dy] = hanging.shift();
        for slot in 0..w {
            let block = self.take_coupling(mechanism, turn.column + slot);
            for i in 0..3 {
                let row = [block[3 * i], block[3 * i + 1], block[3 * i + 2]];
                let at = nd + 3 * slot + i;
                for q in 0..nd {
                    m[at * k + q] += row[0] * s[q][0] + row[1] * s[q][1] + row[2] * s[q][2];
                }
                g[at] -= row[0] * bias[0] + row[1] * bias[1];
                if turn.parent != NONE {
                    // row·X, at the parent's columns
                    let shifted = [row[0], row[1], row[2] + (row[1] * dx - row[0] * dy)];
                    for (j, &x) in shifted.iter().enumerate() {
                        let to = nd + 3 * turn.parent + j;
                        if slot == turn.parent {
                            // B·X + (B·X)ᵀ, lower triangle
                            if j < i {
                                m[at * k + to] += x;
                            } else if j > i {
                                m[to * k + at] += x;
                            } else {
                                m[at * k + at] += x + x;
                            }
                        } else if slot > turn.parent {
                            m[at * k + to] += x;
                        } else {
                            m[to * k + at] += x;
                        }
                    }
                }
            }
        }
        if turn.parent != NONE {
            let p = nd + 3 * turn.parent;
            for q in 0..nd {
                let x = hs[q];
                m[p * k + q] += x[0];
                m[(p + 1) * k + q] += x[1];
                m[(p + 2) * k + q] += x[2] + (x[1] * dx - x[0] * dy);
            }
            // XᵀHX
            let (ux, uy) = (d + (b * dx - a * dy), e + (c * dx - b * dy));
            m[p * k + p] += a;
            m[(p + 1) * k + p] += b;
            m[(p + 1) * k + p + 1] += c;
            m[(p + 2) * k + p] += ux;
            m[(p + 2) * k + p + 1] += uy;
            m[(p + 2) * k + p + 2] += f + (e * dx - d * dy) + (uy * dx - ux * dy);
            g[p] += force[0];
            g[p + 1] += force[1];
            g[p + 2] += force[2] + (force[1] * dx - force[0] * dy);
        }
    }

    /// Adds what an implicit step adds to the inertia of a body's joint; `scaled`: to coordinates in units of length.
    #[inline(always)]
    pub(super) fn add_joint_inertia(&self, mechanism: &MechanismConstants<T>, body: usize, scaled: bool, m: &mut [T]) {
        let Some(StageInertia { joint: added, .. }) = self.added.get(body) else { return };
        let turn = mechanism.schedule.turn(body);
        let (nd, k) = (turn.freedom, turn.freedom + 3 * turn.front);
        let mut at = 0;
        for i in 0..nd {
            for j in 0..=i {
                let mut x = added[at];
                if scaled {
                    x = x / (mechanism.units[turn.first + i] * mechanism.units[turn.first + j]);
                }
                m[i * k + j] += x;
                at += 1;
            }
        }
    }

    /// Adds what is left of a front to the bodies in it.
    #[inline(always)]
    pub(super) fn hand_on(&mut self, mechanism: &MechanismConstants<T>, turn: BodyElimination, m: &[T], g: &[T]) {
        let (nd, w) = (turn.freedom, turn.front);
        let k = nd + 3 * w;
        let mut target = mechanism.schedule.targets[turn.targets..].iter();
        for row in 0..w {
            let at = nd + 3 * row;
            let to = mechanism.schedule.nodes[turn.column + row] as usize;
            for column in 0..row {
                let from = nd + 3 * column;
                if let Some(&block) = target.next() {
                    for i in 0..3 {
                        for j in 0..3 {
                            self.coupling[block as usize][3 * i + j] += m[(at + i) * k + from + j];
                        }
                    }
                }
            }
            let inertia = &mut self.nodes[to].inertia;
            inertia[0] += m[at * k + at];
            inertia[1] += m[(at + 1) * k + at];
            inertia[2] += m[(at + 1) * k + at + 1];
            inertia[3] += m[(at + 2) * k + at];
            inertia[4] += m[(at + 2) * k + at + 1];
            inertia[5] += m[(at + 2) * k + at + 2];
            let momentum = &mut self.nodes[to].momentum;
            for i in 0..3 {
                momentum[i] += g[at + i];
            }
        }
    }

    /// Acceleration of the body, from those of its front.
    #[inline(never)]
    pub(super) fn any_outward(
        &self,
        given: ReductionInput<'_, T>,
        body: usize,
        accelerations: &mut [[T; 3]],
        out: &mut [T],
    ) {
        let ReductionInput { task, mechanism, placement, .. } = given;
        let schedule = &mechanism.schedule;
        let turn = schedule.turn(body);
        let hanging = &placement.hanging[body];
        let (nd, k) = (turn.freedom, turn.freedom + 3 * turn.front);
        let mut x = [T::ZERO; 3];
        for e in (0..nd).rev() {
            let coefficients = &self.coefficients[turn.coefficient_start + e * k..turn.coefficient_start + (e + 1) * k];
            let mut value = self.base[turn.first + e];
            for later in e + 1..nd {
                value -= coefficients[later] * x[later];
            }
            for slot in 0..turn.front {
                let other = &accelerations[schedule.fronts[turn.column + slot] as usize];
                let c = &coefficients[nd + 3 * slot..nd + 3 * slot + 3];
                value -= c[0] * other[0] + c[1] * other[1] + c[2] * other[2];
            }
            x[e] = value;
        }
        if nd > 1 {
            let combined = &self.combined[body];
            let mut y = [T::ZERO; 3];
            for (i, y) in y.iter_mut().enumerate().take(nd) {
                for (j, &x) in x.iter().enumerate().take(nd) {
                    *y += combined[i][j] * x;
                }
                *y = *y / mechanism.units[turn.first + i];
            }
            x = y;
        }
        let mut a = [T::ZERO; 3];
        if let Some(p) = schedule.steps[body].parent() {
            let (up, [dx, dy]) = (accelerations[p], hanging.shift());
            a = [up[0] - dy * up[2], up[1] + dx * up[2], up[2]];
        }
        if task == ReductionTask::Accelerations {
            a[0] += hanging.bias[0];
            a[1] += hanging.bias[1];
        }
        for q in 0..nd {
            let axis = placement.axis(mechanism, body, turn.first + q);
            for i in 0..3 {
                a[i] += axis[i] * x[q];
            }
            out[turn.first + q] = x[q];
        }
        accelerations[body] = a;
    }
}
