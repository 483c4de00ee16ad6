//! Turns of bodies with one coordinate and a front of one or two bodies, with the rows of loops, in closed form. They do what
//! the turn of any body does (`general.rs`, `front.rs`), in the same order, with nothing left to decide while running.

use super::small::SmallFront;
use crate::joint_coordinates::constrained_loops::data::{ReductionInput, ReductionTask, Workspace};
use crate::joint_coordinates::constrained_loops::schedule::NONE;
use crate::scalar::StoredReal;

impl<T: StoredReal> Workspace<T> {
    /// Takes the coordinate of a body with a small front out.
    #[inline(always)]
    pub(in crate::joint_coordinates::constrained_loops) fn small_inward(
        &mut self,
        given: ReductionInput<'_, T>,
        small: SmallFront,
        body: usize,
    ) {
        match small {
            SmallFront(4) => self.one_inward::<1, 0>(given, body),
            SmallFront(5) => self.one_inward::<1, 1>(given, body),
            SmallFront(6) => self.one_inward::<1, 2>(given, body),
            SmallFront(7) => self.one_inward::<1, 3>(given, body),
            SmallFront(8) => self.one_inward::<2, 0>(given, body),
            SmallFront(9) => self.one_inward::<2, 1>(given, body),
            SmallFront(10) => self.one_inward::<2, 2>(given, body),
            SmallFront(_) => self.one_inward::<2, 3>(given, body),
        }
    }

    /// Acceleration of a body with a small front.
    #[inline(always)]
    pub(in crate::joint_coordinates::constrained_loops) fn small_outward(
        &self,
        given: ReductionInput<'_, T>,
        small: SmallFront,
        body: usize,
        accelerations: &mut [[T; 3]],
        out: &mut [T],
    ) {
        match small {
            SmallFront(4..8) => self.one_outward::<1>(given, body, accelerations, out),
            SmallFront(_) => self.one_outward::<2>(given, body, accelerations, out),
        }
    }

    /// A body with one coordinate, a front of `W` bodies and `H` constraint rows.
    #[inline(always)]
    fn one_inward<const W: usize, const H: usize>(&mut self, given: ReductionInput<'_, T>, body: usize) {
        let ReductionInput { task, mechanism, placement, .. } = given;
        let turn = mechanism.schedule.turn(body);
        let inertia = self.take_inertia(mechanism, body);
        let mut force = self.take_force(given, body);
        let s = placement.axis(mechanism, body, turn.first);
        let [i0, i1, i2, i3, i4, i5] = inertia;
        let u =
            [i0 * s[0] + i1 * s[1] + i3 * s[2], i1 * s[0] + i2 * s[1] + i4 * s[2], i3 * s[0] + i4 * s[1] + i5 * s[2]];
        let mut mass = s[0] * u[0] + s[1] * u[1] + s[2] * u[2];
        if let Some(added) = self.added.get(body) {
            mass += added.joint[0];
        }
        let hanging = &placement.hanging[body];
        let [dx, dy] = hanging.shift();
        let mut bias = [T::ZERO; 2];
        let mut own = T::ZERO;
        if task == ReductionTask::Accelerations {
            bias = hanging.bias;
            own = given.torque[turn.first];
        }
        force[0] -= i0 * bias[0] + i1 * bias[1];
        force[1] -= i1 * bias[0] + i2 * bias[1];
        force[2] -= i3 * bias[0] + i4 * bias[1];
        let push = own + (s[0] * force[0] + s[1] * force[1] + s[2] * force[2]);
        // local front: couplings c of the coordinate, inertia m (lower blocks) and forces g of the bodies
        let (mut c, mut g, mut m) = ([[T::ZERO; 3]; W], [[T::ZERO; 3]; W], [[[T::ZERO; 9]; W]; W]);
        if turn.coupled {
            for slot in 0..W {
                let block = self.take_coupling(mechanism, turn.column + slot);
                for i in 0..3 {
                    let row = [block[3 * i], block[3 * i + 1], block[3 * i + 2]];
                    c[slot][i] = row[0] * s[0] + row[1] * s[1] + row[2] * s[2];
                    g[slot][i] = T::ZERO - (row[0] * bias[0] + row[1] * bias[1]);
                    let shifted = [row[0], row[1], row[2] + (row[1] * dx - row[0] * dy)];
                    for p in 0..W {
                        if p == turn.parent {
                            for (j, &x) in shifted.iter().enumerate() {
                                // row (slot, i), column (parent, j), and its transpose
                                if slot == p {
                                    m[p][p][3 * i + j] += x;
                                    m[p][p][3 * j + i] += x;
                                } else if slot > p {
                                    m[slot][p][3 * i + j] += x;
                                } else {
                                    m[p][slot][3 * j + i] += x;
                                }
                            }
                        }
                    }
                }
            }
        }
        for p in 0..W {
            if p == turn.parent {
                c[p][0] += u[0];
                c[p][1] += u[1];
                c[p][2] += u[2] + (u[1] * dx - u[0] * dy);
                let (ux, uy) = (i3 + (i1 * dx - i0 * dy), i4 + (i2 * dx - i1 * dy));
                let block = &mut m[p][p];
                block[0] += i0;
                block[3] += i1;
                block[4] += i2;
                block[6] += ux;
                block[7] += uy;
                block[8] += i5 + (i4 * dx - i3 * dy) + (uy * dx - ux * dy);
                g[p][0] += force[0];
                g[p][1] += force[1];
                g[p][2] += force[2] + (force[1] * dx - force[0] * dy);
            }
        }
        // rows on (coordinate, bodies, right-hand side)
        let (mut meets, mut on, mut gamma) = ([T::ZERO; H], [[[T::ZERO; 3]; W]; H], [T::ZERO; H]);
        let width = 3 * W + 4;
        for l in 0..H {
            let row = &self.rows[turn.row_start + l * width..turn.row_start + (l + 1) * width];
            let r = [row[0], row[1], row[2]];
            meets[l] = r[0] * s[0] + r[1] * s[1] + r[2] * s[2];
            for slot in 0..W {
                for i in 0..3 {
                    on[l][slot][i] = row[3 + 3 * slot + i];
                }
                if slot == turn.parent {
                    on[l][slot][0] += r[0];
                    on[l][slot][1] += r[1];
                    on[l][slot][2] += r[2] + (r[1] * dx - r[0] * dy);
                }
            }
            gamma[l] = row[width - 1] - (r[0] * bias[0] + r[1] * bias[1]);
        }
        let mut slope = [[T::ZERO; 3]; W];
        if H > 0 {
            if H > 1 {
                let mut norm2 = T::ZERO;
                for x in &meets {
                    norm2 += *x * *x;
                }
                let alpha = -norm2.sqrt().copysign(meets[0]);
                let v0 = meets[0] - alpha;
                let beta = T::ONE / (norm2 - alpha * meets[0]);
                for slot in 0..W {
                    for i in 0..3 {
                        let mut sum = v0 * on[0][slot][i];
                        for l in 1..H {
                            sum += meets[l] * on[l][slot][i];
                        }
                        let sum = sum * beta;
                        on[0][slot][i] -= v0 * sum;
                        for l in 1..H {
                            on[l][slot][i] -= meets[l] * sum;
                        }
                    }
                }
                let mut sum = v0 * gamma[0];
                for l in 1..H {
                    sum += meets[l] * gamma[l];
                }
                let sum = sum * beta;
                gamma[0] -= v0 * sum;
                for l in 1..H {
                    gamma[l] -= meets[l] * sum;
                }
                meets[0] = alpha;
            }
            let inverse = T::ONE / meets[0];
            self.nearness = self.nearness.max((mechanism.units[turn.first] * inverse).abs());
            let value = gamma[0] * inverse;
            let rest = push - mass * value;
            let half = T::splat(0.5) * mass;
            for slot in 0..W {
                for i in 0..3 {
                    let rho = on[0][slot][i] * inverse;
                    slope[slot][i] = rho;
                    g[slot][i] -= rho * rest + c[slot][i] * value;
                    c[slot][i] -= half * rho;
                }
            }
            for r in 0..W {
                for q in 0..=r {
                    for i in 0..3 {
                        for j in 0..3 {
                            if q < r || j <= i {
                                m[r][q][3 * i + j] -= c[r][i] * slope[q][j] + slope[r][i] * c[q][j];
                            }
                        }
                    }
                }
            }
            self.base[turn.first] = value;
        } else {
            let inverse = T::ONE / mass;
            self.base[turn.first] = push * inverse;
            for slot in 0..W {
                for i in 0..3 {
                    slope[slot][i] = c[slot][i] * inverse;
                    g[slot][i] -= slope[slot][i] * push;
                }
            }
            for r in 0..W {
                for q in 0..=r {
                    for i in 0..3 {
                        for j in 0..3 {
                            if q < r || j <= i {
                                m[r][q][3 * i + j] -= slope[r][i] * c[q][j];
                            }
                        }
                    }
                }
            }
        }
        let at = turn.coefficient_start;
        for slot in 0..W {
            for i in 0..3 {
                self.coefficients[at + 3 * slot + i] = slope[slot][i];
            }
        }
        for r in 0..W {
            let to = mechanism.schedule.nodes[turn.column + r] as usize;
            let block = &m[r][r];
            let inertia = &mut self.nodes[to].inertia;
            for (x, k) in inertia.iter_mut().zip([0, 3, 4, 6, 7, 8]) {
                *x += block[k];
            }
            for (x, y) in self.nodes[to].momentum.iter_mut().zip(&g[r]) {
                *x += *y;
            }
            for q in 0..r {
                // of a front of two there is one pair
                let coupling = &mut self.coupling[mechanism.schedule.targets[turn.targets] as usize];
                for (x, y) in coupling.iter_mut().zip(&m[r][q]) {
                    *x += *y;
                }
            }
        }
        if H > 1 && turn.next != NONE {
            let next = mechanism.schedule.turn(turn.next);
            let width = 3 * next.front + 4;
            for l in 1..H {
                let to = next.row_start + (turn.next_row + l - 1) * width;
                let row = &mut self.rows[to..to + width];
                row.fill(T::ZERO);
                for slot in 0..W {
                    let place = mechanism.schedule.map(turn.map_start + slot);
                    if place != NONE {
                        row[3 * place..3 * place + 3].copy_from_slice(&on[l][slot]);
                    }
                }
                row[width - 1] = gamma[l];
            }
        }
    }

    /// Acceleration of a body with one coordinate and a front of `W` bodies.
    #[inline(always)]
    fn one_outward<const W: usize>(
        &self,
        given: ReductionInput<'_, T>,
        body: usize,
        accelerations: &mut [[T; 3]],
        out: &mut [T],
    ) {
        let ReductionInput { task, mechanism, placement, .. } = given;
        let step = mechanism.schedule.steps[body];
        let turn = mechanism.schedule.turn(body);
        let first = step.first as usize;
        let hanging = &placement.hanging[body];
        let (s, shift) = (placement.axis(mechanism, body, first), hanging.shift());
        let mut x = self.base[first];
        for slot in 0..W {
            let other = &accelerations[mechanism.schedule.fronts[turn.column + slot] as usize];
            let c = &self.coefficients[turn.coefficient_start + 3 * slot..turn.coefficient_start + 3 + 3 * slot];
            x -= c[0] * other[0] + c[1] * other[1] + c[2] * other[2];
        }
        let mut a = if task == ReductionTask::Accelerations {
            [hanging.bias[0], hanging.bias[1], T::ZERO]
        } else {
            [T::ZERO; 3]
        };
        if let Some(parent) = step.parent() {
            let up = accelerations[parent];
            a[0] += up[0] - shift[1] * up[2];
            a[1] += up[1] + shift[0] * up[2];
            a[2] = up[2];
        }
        out[first] = x;
        accelerations[body] = [a[0] + s[0] * x, a[1] + s[1] * x, a[2] + s[2] * x];
    }
}
