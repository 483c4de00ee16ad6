//! The same reduction where loops come near singular configurations: hard rows, heavy rows, and a front that stays bounded.
//!
//! A straight arm between two pins closes its loop with a pivot of zero. Near it, the reduction hands the base an inertia
//! that grows with 1/ε², and squares what the other directions know away. Here nothing is squared that has grown:
//!
//! - A closure's row is **hard** until a coordinate has been taken out with it.
//! - Taking x_e out by the hard row ε·x_e + n·a = γ leaves, besides the articulated-body step as if the row were not there,
//!   one more row of weighted least squares on the rest, √D·(c/D − n/ε)·a = …, with D the inertia of the coordinate. It is
//!   kept as a row. While it is light (|n/ε| up to [`LIGHT`]) it is squared into the inertia as usual; a **heavy** one
//!   travels on.
//! - Where heavy rows meet a coordinate, a Householder reflection over them and the coordinate's own row √D takes it out.
//! - Where more rows meet at a body than its front has columns, a QR factorization with the longest rows first brings them
//!   down to that number, so a shuttle with any number of straight arms holds three. A row without length is redundant: it
//!   is counted, with what it contradicts the others by.
//!
//! Rows keep their own scale, which is what makes elimination with rows of very different weight stable (A. J. Cox,
//! N. J. Higham, "Stability of Householder QR factorization for weighted least squares problems", 1998; C. C. Paige,
//! "Computer solution and perturbation analysis of generalized linear least squares problems", Math. Comp. 33, 1979).
//! Compressing rows to the rank of the shuttle is wrong when they are taken as equally hard; weighted by how hard they are
//! it loses nothing.

use super::Linkage;
use super::reduction::{Reduction, Task};
use super::tree::Parent;

/// Ratio up to which a row is squared into the inertia: its square times the rounding unit is lost.
const LIGHT: f64 = 30.0;
/// A hard row shorter than this share of a closure's own rows is zero: it is lost in rounding.
const ZERO: f64 = 1e-11;
/// The same in a projection. A gap that only a thousandfold motion could close is left until the mechanism has moved on:
/// at the crossing of two branches such a correction would choose one at random.
const IDLE: f64 = 1e-3;

impl Task {
    fn zero(self) -> f64 {
        if self == Self::Accelerations { ZERO } else { IDLE }
    }
}

/// What a reduction near a singular configuration met.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Singularity {
    /// Constraint rows that no coordinate could take at their own loop, passed inward.
    pub passed: usize,
    /// Largest number of heavy rows that travelled together.
    pub heavy: usize,
    /// Constraints that others imply.
    pub redundant: usize,
    /// Largest contradiction between a redundant constraint and the others [m/s², or the unit of the task].
    pub contradiction: f64,
}

/// A row over the columns of a body's front, a_i first, with its right-hand side last.
#[derive(Debug, Clone)]
struct Row {
    entries: Vec<f64>,
    /// Weight that would make it light: √D per length of the coordinate that it came from. Zero: a hard row.
    base: f64,
}

/// How one coordinate is found on the way out: x = (rhs − row·others)/pivot.
#[derive(Debug, Clone)]
struct Taken {
    coordinate: usize,
    row: Vec<f64>,
}

impl Reduction<f64> {
    /// [`Reduction::reduce`] for any configuration: in a singular one too it gives the accelerations of least constraint.
    /// Slower by a factor, and it allocates; meant for when [`Reduction::nearness`] is large.
    pub fn reduce_singular(&mut self, linkage: &Linkage, task: Task, out: &mut [f64]) -> Singularity {
        if let Some(packs) = &self.packs {
            packs.spread(&mut self.placed, &mut self.hanging, &mut self.axes);
        }
        self.rows_of(task, 0..linkage.closures.len());
        let mut report = Singularity::default();
        let count = linkage.links.len();
        let mut waiting: Vec<Vec<Row>> = self.entering(linkage);
        let mut taken: Vec<Vec<Taken>> = Vec::with_capacity(count);
        for body in 0..count {
            let rows = std::mem::take(&mut waiting[body]);
            taken.push(self.turn_singular(linkage, task, body, rows, &mut waiting, &mut report));
        }
        for body in (0..count).rev() {
            self.outward_singular(linkage, task, body, &taken[body], out);
        }
        report
    }

    /// The closures' own rows, at the bodies where they enter.
    fn entering(&self, linkage: &Linkage) -> Vec<Vec<Row>> {
        let mut waiting = vec![Vec::new(); linkage.links.len()];
        for (entry, closure) in self.schedule.entries.iter().zip(&linkage.closures) {
            let turn = self.schedule.turn(entry.body);
            let width = 3 + 3 * turn.front + 1;
            for k in 0..closure.constraints() {
                let start = turn.row_start + (entry.row + k) * width;
                waiting[entry.body].push(Row { entries: self.rows[start..start + width].to_vec(), base: 0.0 });
            }
        }
        waiting
    }

    fn turn_singular(
        &mut self,
        linkage: &Linkage,
        task: Task,
        body: usize,
        rows: Vec<Row>,
        waiting: &mut [Vec<Row>],
        report: &mut Singularity,
    ) -> Vec<Taken> {
        let turn = self.schedule.turn(body);
        let (nd, w) = (turn.freedom, turn.front);
        let k = nd + 3 * w;
        let length = linkage.links[body].lever;
        let (hard, heavy): (Vec<Row>, Vec<Row>) = rows.into_iter().partition(|r| r.base == 0.0);
        let columns = |i: usize| if i % 3 == 2 { 1.0 / length } else { 1.0 };
        let hard = shorten(hard, 3 + 3 * w, &columns, task.zero(), report);
        let heavy = shorten(heavy, 3 + 3 * w, &columns, 0.0, report);
        report.heavy = report.heavy.max(heavy.len());
        let hanging = self.hanging[body];
        let bias = if task == Task::Accelerations { hanging.bias } else { [0.0; 2] };
        // coordinates in units of length
        let units: Vec<f64> = self.units[turn.first..turn.first + nd].to_vec();
        let axes: Vec<[f64; 3]> = (0..nd).map(|q| self.axis(body, turn.first + q).map(|x| x / units[q])).collect();
        let [dx, dy] = hanging.shift();
        let local = |row: &Row| -> Row {
            let own = [row.entries[0], row.entries[1], row.entries[2]];
            let mut entries = vec![0.0; k + 1];
            for q in 0..nd {
                entries[q] = own[0] * axes[q][0] + own[1] * axes[q][1] + own[2] * axes[q][2];
            }
            entries[nd..k].copy_from_slice(&row.entries[3..3 + 3 * w]);
            if turn.parent != super::schedule::NONE {
                let p = nd + 3 * turn.parent;
                entries[p] += own[0];
                entries[p + 1] += own[1];
                entries[p + 2] += own[2] + (own[1] * dx - own[0] * dy);
            }
            entries[k] = row.entries[3 + 3 * w] - (own[0] * bias[0] + own[1] * bias[1]);
            Row { entries, base: row.base }
        };
        let mut hard: Vec<Row> = hard.iter().map(local).collect();
        let mut soft: Vec<Row> = heavy.iter().map(local).collect();
        let (mut m, mut g) = (vec![0.0; k * k], vec![0.0; k]);
        let torque: Vec<f64> = (0..nd).map(|q| self.torque[turn.first + q] / units[q]).collect();
        self.assemble(task, body, turn, &axes, &torque, &mut m, &mut g);
        self.add_joint_inertia(body, turn, true, &mut m);
        // the articulated-body step, whose coordinates' own rows √D·(x + …) join the heavy ones
        let mut own: Vec<Row> = Vec::with_capacity(nd);
        for e in 0..nd {
            let root = m[e * k + e].sqrt();
            let mut entries = vec![0.0; k + 1];
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
            own.push(Row { entries, base: root });
        }
        let mut taken = Vec::with_capacity(nd);
        soft.extend(own);
        let mut left: Vec<usize> = (0..nd).collect();
        while !left.is_empty() {
            let biggest = |rows: &[Row], left: &[usize]| {
                left.iter()
                    .map(|&c| (c, rows.iter().map(|r| r.entries[c] * r.entries[c]).sum::<f64>().sqrt()))
                    // the first where nothing is larger: numbers that are not finite go through
                    .fold((left[0], 0.0), |best, x| if x.1 > best.1 { x } else { best })
            };
            let (coordinate, size) = biggest(&hard, &left);
            if size > task.zero() {
                let pivot = reflect(&mut hard, coordinate);
                for row in &mut soft {
                    let factor = row.entries[coordinate] / pivot.entries[coordinate];
                    for (x, p) in row.entries.iter_mut().zip(&pivot.entries) {
                        *x -= factor * p;
                    }
                    row.entries[coordinate] = 0.0;
                }
                taken.push(Taken { coordinate, row: pivot.entries });
                left.retain(|&c| c != coordinate);
            } else {
                if left.len() + taken.len() == nd {
                    report.passed += hard.len();
                }
                for row in &mut hard {
                    for &c in &left {
                        row.entries[c] = 0.0;
                    }
                }
                soft.sort_by(|a, b| norm(b, nd, &columns).total_cmp(&norm(a, nd, &columns)));
                let (coordinate, _) = biggest(&soft, &left);
                let pivot = reflect(&mut soft, coordinate);
                taken.push(Taken { coordinate, row: pivot.entries });
                left.retain(|&c| c != coordinate);
            }
        }
        for row in soft {
            let heaviest = (nd..k).map(|i| (row.entries[i] * columns(i - nd)).abs()).fold(0.0, f64::max);
            if heaviest <= LIGHT * row.base {
                for j in nd..k {
                    g[j] += row.entries[j] * row.entries[k];
                    for l in nd..=j {
                        m[j * k + l] += row.entries[j] * row.entries[l];
                    }
                }
            } else {
                self.pass(linkage, body, &row, waiting);
            }
        }
        for row in hard {
            let size = norm(&row, nd, &columns);
            if size > task.zero() {
                self.pass(linkage, body, &row, waiting);
            } else {
                report.redundant += 1;
                report.contradiction = report.contradiction.max(row.entries[k].abs());
            }
        }
        self.hand_on(turn, &m, &g);
        taken
    }

    /// Hands a row to the first body of the front that it touches.
    fn pass(&self, linkage: &Linkage, body: usize, row: &Row, waiting: &mut [Vec<Row>]) {
        let turn = self.schedule.turn(body);
        let nd = turn.freedom;
        let k = nd + 3 * turn.front;
        let pattern = &linkage.pattern;
        let column = pattern.column(body);
        let size = row.entries[nd..k].iter().fold(0.0f64, |a, x| a.max(x.abs()));
        let touches = |slot: usize| (0..3).any(|i| row.entries[nd + 3 * slot + i].abs() > 1e-14 * size);
        let Some(first) = (0..turn.front).find(|&slot| touches(slot)) else { return };
        let next = pattern.row(column.start + first);
        let there = pattern.column(next);
        let mut entries = vec![0.0; 3 + 3 * there.len() + 1];
        for slot in first..turn.front {
            let b = pattern.row(column.start + slot);
            let place =
                if b == next { Some(0) } else { there.clone().position(|i| pattern.row(i) == b).map(|p| p + 1) };
            if let Some(place) = place {
                entries[3 * place..3 * place + 3].copy_from_slice(&row.entries[nd + 3 * slot..nd + 3 * slot + 3]);
            }
        }
        let last = entries.len() - 1;
        entries[last] = row.entries[k];
        waiting[next].push(Row { entries, base: row.base });
    }

    fn outward_singular(&mut self, linkage: &Linkage, task: Task, body: usize, taken: &[Taken], out: &mut [f64]) {
        let turn = self.schedule.turn(body);
        let (nd, start) = (turn.freedom, linkage.pattern.column(body).start);
        let k = nd + 3 * turn.front;
        let mut x = [0.0; 3];
        for step in taken.iter().rev() {
            let mut value = step.row[k];
            for (c, x) in x.iter().enumerate().take(nd) {
                if c != step.coordinate {
                    value -= step.row[c] * x;
                }
            }
            for slot in 0..turn.front {
                let other = &self.accelerations[linkage.pattern.row(start + slot)];
                for i in 0..3 {
                    value -= step.row[nd + 3 * slot + i] * other[i];
                }
            }
            x[step.coordinate] = value / step.row[step.coordinate];
        }
        let hanging = &self.hanging[body];
        let mut a = [0.0; 3];
        if let Parent::Body(p) = linkage.links[body].parent {
            let (up, [dx, dy]) = (self.accelerations[p], hanging.shift());
            a = [up[0] - dy * up[2], up[1] + dx * up[2], up[2]];
        }
        if task == Task::Accelerations {
            a[0] += hanging.bias[0];
            a[1] += hanging.bias[1];
        }
        for q in 0..nd {
            let value = x[q] / self.units[turn.first + q];
            out[turn.first + q] = value;
            let axis = self.axis(body, turn.first + q);
            for i in 0..3 {
                a[i] += axis[i] * value;
            }
        }
        self.accelerations[body] = a;
    }
}

/// Length of a row over the bodies' columns, which start at `first`.
fn norm(row: &Row, first: usize, columns: &dyn Fn(usize) -> f64) -> f64 {
    let last = row.entries.len() - 1;
    (first..last).map(|i| (row.entries[i] * columns(i - first)).abs()).fold(0.0, f64::max)
}

/// Reflects all rows so that one of them alone meets `column`; that one is taken out and returned.
fn reflect(rows: &mut Vec<Row>, column: usize) -> Row {
    // the longest entry becomes the pivot's row: rows of very different weight keep their digits
    let at = (0..rows.len())
        .max_by(|&a, &b| rows[a].entries[column].abs().total_cmp(&rows[b].entries[column].abs()))
        .unwrap_or(0);
    let mut pivot = rows.remove(at);
    let first = pivot.entries[column];
    let scale = first.abs();
    let sum: f64 = rows.iter().map(|r| (r.entries[column] / scale).powi(2)).sum();
    if sum == 0.0 {
        return pivot;
    }
    let alpha = -(first.signum() * scale * (1.0 + sum).sqrt());
    let v0 = first - alpha;
    // the reflection 1 − v·vᵀ/(v₀·(v₀ − …)), written with ratios so that nothing overflows
    let ratio: Vec<f64> = rows.iter().map(|r| r.entries[column] / v0).collect();
    let beta = 2.0 / (1.0 + ratio.iter().map(|r| r * r).sum::<f64>());
    for j in 0..pivot.entries.len() {
        if j == column {
            continue;
        }
        let sum: f64 = pivot.entries[j] + rows.iter().zip(&ratio).map(|(r, x)| x * r.entries[j]).sum::<f64>();
        let sum = beta * sum;
        pivot.entries[j] -= sum;
        for (row, x) in rows.iter_mut().zip(&ratio) {
            row.entries[j] -= x * sum;
        }
    }
    pivot.entries[column] = alpha;
    for row in rows.iter_mut() {
        row.entries[column] = 0.0;
    }
    pivot
}

/// Brings rows down to at most one per column by QR, longest rows and columns first. Hard rows without length are redundant.
fn shorten(
    mut rows: Vec<Row>,
    count: usize,
    columns: &dyn Fn(usize) -> f64,
    zero: f64,
    report: &mut Singularity,
) -> Vec<Row> {
    if rows.len() <= count {
        return rows;
    }
    let mut kept: Vec<Row> = Vec::with_capacity(count);
    let mut left: Vec<usize> = (0..count).collect();
    while !left.is_empty() && !rows.is_empty() {
        let (mut column, mut size) = (left[0], 0.0);
        for &c in &left {
            let n = rows.iter().map(|r| (r.entries[c] * columns(c)).powi(2)).sum::<f64>().sqrt();
            if n > size {
                (column, size) = (c, n);
            }
        }
        if size <= zero {
            break;
        }
        let base = rows.iter().map(|r| r.base).fold(f64::INFINITY, f64::min);
        let mut pivot = reflect(&mut rows, column);
        pivot.base = base;
        kept.push(pivot);
        left.retain(|&c| c != column);
    }
    for row in rows {
        if row.base == 0.0 {
            report.redundant += 1;
            report.contradiction = report.contradiction.max(row.entries[row.entries.len() - 1].abs());
        }
    }
    kept
}
