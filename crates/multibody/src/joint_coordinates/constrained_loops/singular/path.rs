//! The path itself: rows enter with the closures, each body's coordinates are taken out, and accelerations come back.

use super::row_pool::RowPool;
use super::{LIGHT, Singularity};
use crate::joint_coordinates::constrained_loops::data::{ReductionInput, ReductionTask, Workspace};
use crate::joint_coordinates::constrained_loops::reduction::{Reduction, Traversal};
use crate::joint_coordinates::constrained_loops::schedule::NONE;

impl Reduction<f64> {
    /// [`Reduction::reduce`] for any configuration: in a singular one too it gives the accelerations of least constraint.
    /// Slower by a factor; meant for when [`Reduction::nearness`] is large. Nothing is allocated.
    pub fn reduce_singular(&mut self, task: ReductionTask, out: &mut [f64]) -> Singularity {
        if let Some(traversal) = &self.traversal {
            traversal.spread(&mut self.placement);
        }
        let Self { mechanism, force, torque, offsets, placement, work, room, accelerations, .. } = self;
        let given = ReductionInput { task, mechanism, offsets, placement, force, torque };
        work.write_rows(given, 0..mechanism.closures.len());
        let mut report = Singularity::default();
        room.enter(given, work);
        for body in 0..mechanism.bodies() {
            room.inward(given, work, body, &mut report);
        }
        for body in (0..mechanism.bodies()).rev() {
            room.outward(given, body, accelerations, out);
        }
        report
    }
}

impl RowPool {
    /// Lets the closures' own rows wait at the bodies where they enter.
    fn enter(&mut self, given: ReductionInput<'_, f64>, work: &Workspace<f64>) {
        let schedule = &given.mechanism.schedule;
        for entry in &schedule.entries {
            let turn = schedule.turn(entry.body);
            let width = 3 + 3 * turn.front + 1;
            for k in 0..entry.count {
                let start = turn.row_start + (entry.row + k) * width;
                let row = self.take(0.0);
                self.row_mut(row)[..width].copy_from_slice(&work.rows[start..start + width]);
                self.wait(row, entry.body);
            }
        }
    }

    /// Takes the coordinates of a body out and passes the rows on.
    fn inward(
        &mut self,
        given: ReductionInput<'_, f64>,
        work: &mut Workspace<f64>,
        body: usize,
        report: &mut Singularity,
    ) {
        let ReductionInput { task, mechanism, placement, .. } = given;
        let turn = mechanism.schedule.turn(body);
        let length = mechanism.levers[body];
        let (nd, w) = (turn.freedom, turn.front);
        let k = nd + 3 * w;
        self.call(body);
        let (mut hard, mut soft) = (std::mem::take(&mut self.hard), std::mem::take(&mut self.soft));
        self.shorten(&mut hard, 3 + 3 * w, (length, task.zero()), report);
        self.shorten(&mut soft, 3 + 3 * w, (length, 0.0), report);
        report.heavy = report.heavy.max(soft.len());
        // coordinates in units of length
        let (mut axes, mut torque) = ([[0.0; 3]; 3], [0.0; 3]);
        for q in 0..nd {
            let (at, unit) = (turn.first + q, mechanism.units[turn.first + q]);
            axes[q] = placement.axis(mechanism, body, at).map(|x| x / unit);
            torque[q] = given.torque[at] / unit;
        }
        self.over_coordinates(given, body, &hard, &axes);
        self.over_coordinates(given, body, &soft, &axes);
        let (mut m, mut g) = (std::mem::take(&mut work.front.m), std::mem::take(&mut work.front.g));
        work.assemble(given, body, (&axes, &torque), &mut m, &mut g);
        work.add_joint_inertia(mechanism, body, true, &mut m);
        self.own_rows((nd, k), &mut m, &mut g, &mut soft);
        self.left.clear();
        self.left.extend(0..nd);
        for at in 0..nd {
            let (coordinate, size) = self.biggest(&hard);
            let (coordinate, pivot) = if size > task.zero() {
                let pivot = self.reflect(&mut hard, coordinate, k + 1);
                self.subtract(&soft, pivot, coordinate, k + 1);
                (coordinate, pivot)
            } else {
                for &row in &hard {
                    for i in 0..self.left.len() {
                        let c = self.left[i];
                        self.row_mut(row)[c] = 0.0;
                    }
                }
                self.longest_first(&mut soft, nd..k, length);
                let (coordinate, _) = self.biggest(&soft);
                (coordinate, self.reflect(&mut soft, coordinate, k + 1))
            };
            self.left.retain(|&c| c != coordinate);
            self.keep((body, turn), at, coordinate, pivot);
        }
        for &row in &soft {
            let heaviest = self.norm(row, nd..k, length);
            if heaviest <= LIGHT * self.base(row) {
                let entries = self.row(row);
                for j in nd..k {
                    g[j] += entries[j] * entries[k];
                    for l in nd..=j {
                        m[j * k + l] += entries[j] * entries[l];
                    }
                }
                self.give_back(row);
            } else {
                self.pass(&mechanism.schedule, turn, row);
            }
        }
        for &row in &hard {
            if self.norm(row, nd..k, length) > task.zero() {
                report.passed += 1;
                self.pass(&mechanism.schedule, turn, row);
            } else {
                report.redundant += 1;
                report.contradiction = report.contradiction.max(self.row(row)[k].abs());
                self.give_back(row);
            }
        }
        work.hand_on(mechanism, turn, &m, &g);
        (work.front.m, work.front.g) = (m, g);
        (self.hard, self.soft) = (hard, soft);
    }

    /// Rows over the motion of a body and its front become rows over its coordinates and its front.
    fn over_coordinates(&mut self, given: ReductionInput<'_, f64>, body: usize, rows: &[u32], axes: &[[f64; 3]; 3]) {
        let ReductionInput { task, mechanism, placement, .. } = given;
        let turn = mechanism.schedule.turn(body);
        let (nd, w) = (turn.freedom, turn.front);
        let hanging = placement.hanging[body];
        let bias = if task == ReductionTask::Accelerations { hanging.bias } else { [0.0; 2] };
        let [dx, dy] = hanging.shift();
        for &row in rows {
            let entries = self.row_mut(row);
            let (own, value) = ([entries[0], entries[1], entries[2]], entries[3 + 3 * w]);
            entries.copy_within(3..3 + 3 * w, nd);
            for q in 0..nd {
                entries[q] = own[0] * axes[q][0] + own[1] * axes[q][1] + own[2] * axes[q][2];
            }
            if turn.parent != NONE {
                let p = nd + 3 * turn.parent;
                entries[p] += own[0];
                entries[p + 1] += own[1];
                entries[p + 2] += own[2] + (own[1] * dx - own[0] * dy);
            }
            entries[nd + 3 * w] = value - (own[0] * bias[0] + own[1] * bias[1]);
        }
    }

    /// The articulated-body step, whose coordinates' own rows √D·(x + …) join the heavy ones.
    fn own_rows(&mut self, (nd, k): (usize, usize), m: &mut [f64], g: &mut [f64], soft: &mut Vec<u32>) {
        for e in 0..nd {
            let root = m[e * k + e].sqrt();
            let row = self.take(root);
            let entries = self.row_mut(row);
            entries[..e].fill(0.0);
            entries[e] = root;
            for j in e + 1..k {
                entries[j] = m[j * k + e] / root;
            }
            entries[k] = g[e] / root;
            for j in e + 1..k {
                g[j] -= entries[j] * entries[k];
                for l in e + 1..=j {
                    m[j * k + l] -= entries[j] * entries[l];
                }
            }
            soft.push(row);
        }
    }

    fn outward(&self, given: ReductionInput<'_, f64>, body: usize, accelerations: &mut [[f64; 3]], out: &mut [f64]) {
        let ReductionInput { task, mechanism, placement, .. } = given;
        let schedule = &mechanism.schedule;
        let turn = schedule.turn(body);
        let (nd, front) = (turn.freedom, &schedule.fronts[turn.column..turn.column + turn.front]);
        let k = nd + 3 * turn.front;
        let mut x = [0.0; 3];
        for at in (0..nd).rev() {
            let (coordinate, row) = self.kept((body, turn), at);
            let mut value = row[k];
            for (c, x) in x.iter().enumerate().take(nd) {
                if c != coordinate {
                    value -= row[c] * x;
                }
            }
            for (slot, &other) in front.iter().enumerate() {
                for i in 0..3 {
                    value -= row[nd + 3 * slot + i] * accelerations[other as usize][i];
                }
            }
            x[coordinate] = value / row[coordinate];
        }
        let hanging = &placement.hanging[body];
        let mut a = [0.0; 3];
        if let Some(parent) = schedule.steps[body].parent() {
            let (up, [dx, dy]) = (accelerations[parent], hanging.shift());
            a = [up[0] - dy * up[2], up[1] + dx * up[2], up[2]];
        }
        if task == ReductionTask::Accelerations {
            a[0] += hanging.bias[0];
            a[1] += hanging.bias[1];
        }
        for q in 0..nd {
            let value = x[q] / mechanism.units[turn.first + q];
            out[turn.first + q] = value;
            let axis = placement.axis(mechanism, body, turn.first + q);
            for i in 0..3 {
                a[i] += axis[i] * value;
            }
        }
        accelerations[body] = a;
    }
}
