//! The same reduction for a stage of an implicit method: what damping and stiffness add to the inertia.
//!
//! A stage looks for accelerations q̈ that the forces at q + β·q̈, q̇ + γ·q̈ give. Newton's method takes the forces' change
//! along, so that the inertia M becomes
//! ```text
//! W = M + γ·C + β·K
//! ```
//! the effective mass of T. J. R. Hughes, "The Finite Element Method" (1987), §9.1. The springs of the tree's joints add to
//! one joint's coordinates alone, and everything else (closures that give way, gaps, contacts, gas, dampers) to a body or a
//! pair of bodies: the recursion meets them where it meets their inertia, and stays O(n + m).
//!
//! W takes the motion of the axes and levers with the coordinates (geometric stiffness of the reactions, derivatives of
//! Coriolis terms) for zero, so that the iteration converges linearly, at the rate of what is left out over W. What it
//! converges to does not depend on W.

use super::linkage::Linkage;
use super::reduce::{Reduction, Task};
use super::schedule::Kind;
use super::singular::Singularity;
use crate::multibody::BlockMatrix;

/// What an implicit step adds to the inertia: γ·C + β·K.
#[derive(Debug, Clone)]
pub struct AddedInertia {
    /// Of each body's joint, over the coordinates that move: the lower triangle by rows.
    pub joints: Vec<[f64; 6]>,
    /// Of bodies and pairs of bodies.
    pub bodies: BlockMatrix<f64, 3>,
}

impl AddedInertia {
    /// Zero, for `linkage`.
    pub fn new(linkage: &Linkage) -> Self {
        Self { joints: vec![[0.0; 6]; linkage.links.len()], bodies: BlockMatrix::new(&linkage.pattern) }
    }

    /// Back to zero.
    pub fn clear(&mut self) {
        self.joints.fill([0.0; 6]);
        self.bodies.clear();
    }

    /// Adds `factor` times the stiffness of the tree's joints.
    pub fn add_joints(&mut self, linkage: &Linkage, factor: f64) {
        for (sum, link) in self.joints.iter_mut().zip(&linkage.links) {
            let moving = (0..3).filter(|&i| link.moving[i]);
            let mut at = 0;
            for i in moving.clone() {
                for j in moving.clone().take_while(|&j| j <= i) {
                    sum[at] += factor * link.stiffness[(i, j)];
                    at += 1;
                }
            }
        }
    }
}

impl Reduction<f64> {
    /// Storage for [`Reduction::solve_implicit`] on `linkage`.
    pub fn implicit(linkage: &Linkage) -> Self {
        let mut reduction = Self::new(&[linkage]);
        for (step, turn) in reduction.schedule.steps.iter_mut().zip(&mut reduction.schedule.turns) {
            if step.kind == Kind::Pin {
                step.kind = if turn.front == 1 { Kind::One(0) } else { Kind::Any };
            }
            // springs, gaps and dampers may couple any pair of the pattern
            turn.coupled = true;
        }
        reduction.joint_inertia.reserve_exact(linkage.links.len());
        reduction
    }

    /// Accelerations of the bodies when the coordinates have the accelerations `a`, at the placed configuration.
    pub fn accelerations_of(&self, linkage: &Linkage, a: &[f64], out: &mut [[f64; 3]]) {
        for (body, link) in linkage.links.iter().enumerate().rev() {
            let placed = &self.placed[body];
            let mut sum = [placed.bias[0], placed.bias[1], 0.0];
            if let Some(parent) = self.schedule.steps[body].parent() {
                let up = out[parent];
                sum[0] += up[0] - placed.shift[1] * up[2];
                sum[1] += up[1] + placed.shift[0] * up[2];
                sum[2] += up[2];
            }
            for q in link.first..link.first + link.freedom() {
                for i in 0..3 {
                    sum[i] += self.axes[q][i] * a[q];
                }
            }
            out[body] = sum;
        }
    }

    /// One step of Newton's method for q̈ under the forces that [`Reduction::force`] and [`Reduction::torque`] hold: from
    /// accelerations `a` at the placed configuration to the next ones in `out`. `bodies` is scratch of one entry a body.
    /// Says what was met where it was near a singular configuration.
    ///
    /// W·(q̈ − a) + (M·a − forces) = 0 is solved as W·q̈ = forces + (W − M)·a. The forces are changed.
    pub fn solve_implicit(
        &mut self,
        linkage: &Linkage,
        added: &AddedInertia,
        a: &[f64],
        bodies: &mut [[f64; 3]],
        out: &mut [f64],
    ) -> Option<Singularity> {
        self.accelerations_of(linkage, a, bodies);
        for (body, link) in linkage.links.iter().enumerate() {
            let mut at = 0;
            for i in 0..link.freedom() {
                for j in 0..=i {
                    let k = added.joints[body][at];
                    self.torque[link.first + i] += k * a[link.first + j];
                    if j < i {
                        self.torque[link.first + j] += k * a[link.first + i];
                    }
                    at += 1;
                }
            }
            let own = bodies[body];
            let block = &added.bodies.diagonal[body];
            for i in 0..3 {
                self.force[body][i] += block[(i, 0)] * own[0] + block[(i, 1)] * own[1] + block[(i, 2)] * own[2];
            }
            for at in linkage.pattern.column(body) {
                let row = linkage.pattern.row(at);
                let (block, other) = (&added.bodies.below[at], bodies[row]);
                for i in 0..3 {
                    for j in 0..3 {
                        self.force[row][i] += block[(i, j)] * own[j];
                        self.force[body][j] += block[(i, j)] * other[i];
                    }
                }
            }
        }
        self.joint_inertia.extend_from_slice(&added.joints);
        self.seed(added);
        let met = self.solve_with(linkage, Task::Accelerations, out, |reduction| reduction.seed(added));
        self.joint_inertia.clear();
        met
    }

    /// Lays what is added where bodies and couplings gather.
    fn seed(&mut self, added: &AddedInertia) {
        for (node, block) in self.nodes.iter_mut().zip(&added.bodies.diagonal) {
            let lower = [block[(0, 0)], block[(1, 0)], block[(1, 1)], block[(2, 0)], block[(2, 1)], block[(2, 2)]];
            for (sum, x) in node.inertia.iter_mut().zip(lower) {
                *sum += x;
            }
        }
        for (coupling, block) in self.coupling.iter_mut().zip(&added.bodies.below) {
            for i in 0..3 {
                for j in 0..3 {
                    coupling[3 * i + j] += block[(i, j)];
                }
            }
        }
    }
}
