//! The same reduction for a stage of an implicit method: contributions of damping and stiffness to the inertia.
//!
//! A stage solves for accelerations q̈ that the forces at q + β·q̈, q̇ + γ·q̈ give. Newton's method takes the forces'
//! change along, so that the inertia M becomes
//! ```text
//! W = M + γ·C + β·K
//! ```
//! the effective mass of T. J. R. Hughes, "The Finite Element Method" (1987), §9.1. The springs of the tree's joints
//! contribute to one joint's coordinates alone. All else (compliant closures, gaps, contacts, gas, dampers) contributes
//! to a body or a pair of bodies. The recursion adds these contributions where it adds inertia, and stays O(n + m).
//!
//! W neglects the motion of the axes and levers with the coordinates (geometric stiffness of the reactions, derivatives
//! of Coriolis terms). The iteration therefore converges linearly, at the rate of the neglected terms over W. Its limit
//! does not depend on W.

use super::data::{ReductionTask, StageInertia};
use super::reduction::Reduction;
use super::schedule::Plan;
use super::singular::Singularity;
use super::tree::Linkage;
use crate::BodyMatrix;
use nalgebra::Matrix3;

/// Contribution of an implicit step to the inertia: γ·C + β·K.
#[derive(Debug, Clone)]
pub struct AddedInertia {
    /// Of each body's joint, over the coordinates that move: the lower triangle by rows.
    pub joints: Vec<[f64; 6]>,
    /// Of bodies and pairs of bodies.
    pub bodies: BodyMatrix,
}

impl AddedInertia {
    /// Zero, for `linkage`.
    #[inline]
    pub fn new(linkage: &Linkage) -> Self {
        Self { joints: vec![[0.0; 6]; linkage.links.len()], bodies: BodyMatrix::new(&linkage.pattern) }
    }

    /// Back to zero.
    #[inline]
    pub fn clear(&mut self) {
        self.joints.fill([0.0; 6]);
        self.bodies.clear();
    }

    /// Adds `factor` times the stiffness of the tree's joints.
    #[inline]
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
    #[inline]
    pub fn implicit(linkage: &Linkage) -> Self {
        // springs, gaps and dampers may couple any pair of the pattern
        let mut reduction = Self::planned(&[linkage], Plan { coupled: true, fast: true });
        reduction.work.added.reserve_exact(linkage.links.len());
        reduction.work.added_coupling.reserve_exact(linkage.pattern.off_blocks());
        reduction
    }

    /// Accelerations of the bodies when the coordinates have the accelerations `a`, at the placed configuration.
    pub fn accelerations_of(&self, linkage: &Linkage, a: &[f64], out: &mut [[f64; 3]]) {
        for (body, link) in linkage.links.iter().enumerate().rev() {
            let hanging = &self.placement.hanging[body];
            let ([dx, dy], [cx, cy]) = (hanging.shift(), hanging.bias);
            let mut sum = [cx, cy, 0.0];
            if let Some(parent) = self.mechanism.schedule.steps[body].parent() {
                let up = out[parent];
                sum = [cx + (up[0] - dy * up[2]), cy + (up[1] + dx * up[2]), up[2]];
            }
            for q in link.first..link.first + link.freedom() {
                let axis = self.placement.axis(&self.mechanism, body, q);
                for i in 0..3 {
                    sum[i] += axis[i] * a[q];
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
        self.lay(added);
        let met = self.solve(ReductionTask::Accelerations, out);
        self.work.added.clear();
        self.work.added_coupling.clear();
        met
    }

    /// Stores the added inertia for the elimination of each body.
    fn lay(&mut self, added: &AddedInertia) {
        let own = added.joints.iter().zip(&added.bodies.diagonal);
        self.work.added.extend(own.map(|(&joint, block)| StageInertia {
            joint,
            body: [block[(0, 0)], block[(1, 0)], block[(1, 1)], block[(2, 0)], block[(2, 1)], block[(2, 2)]],
        }));
        let rows = |block: &Matrix3<f64>| std::array::from_fn(|k| block[(k / 3, k % 3)]);
        self.work.added_coupling.extend(added.bodies.below.iter().map(rows));
    }
}
