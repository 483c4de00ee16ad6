//! The error of a motion in joint coordinates, see [`crate::time::defect`].

use super::JointRodas4;
use super::error::JointDefectEstimate;
use crate::equations::{Bodies, Joints};
use crate::time::defect::{Impulses, MotionError, NODES, Propagates, propagate, quartic};
use crate::time::method::Motion;
use crate::time::rodas4::tableau::GAMMA;
use bimorph_multibody::forces;
use bimorph_multibody::joint_coordinates::sprung_loops::columns::Four;
use bimorph_multibody::joint_coordinates::sprung_loops::poses::place_of;
use bimorph_multibody::planar::Pose;

impl JointRodas4 {
    /// Moments of the residual over a step from the coordinates, rates and accelerations in `start`; returns the energy that it takes (J).
    fn residuals(&mut self, bodies: &Bodies<'_>, (s, h): (f64, f64), start: &[Motion], impulses: &mut Impulses) -> f64 {
        let (work, mut taken) = (self.work, 0.0);
        impulses.clear();
        for node in NODES {
            bodies.ramp.at(s + node.0 * h, &mut self.drive);
            let ends = start[0].q.iter().zip(&self.carried[0].q).zip(start[0].v.iter().zip(&self.carried[0].v));
            for (j, (((q0, q1), (v0, v1)), z0)) in ends.zip(&start[1].q).enumerate() {
                let (tile, lane) = place_of(j);
                let [q, v, z] = quartic(node.0, h, [q0, q1], [v0, v1], z0);
                self.stages.argument[tile].set(lane, [&q, &v, &z]);
            }
            self.is_placed = false;
            self.residual(false, false);
            for (j, right) in self.right.iter().enumerate() {
                let (tile, lane) = place_of(j);
                let [_, rate, _] = self.stages.argument[tile].of(lane);
                taken += node.1 * h * rate.dot(&right.pose());
                impulses.add(j, node, h, -right.pose());
            }
        }
        self.is_placed = false;
        self.work = work;
        taken
    }
}

impl<'s> Propagates<'s> for JointRodas4 {
    fn begin_error(&mut self) {
        self.defect = Some(Box::new(JointDefectEstimate::zeros(self.joints.tree.links.len())));
    }

    fn error(
        &mut self,
        bodies: &mut Bodies<'s>,
        (s, h): (f64, f64),
        _: [&Motion; 2],
        start: &[Motion],
    ) -> MotionError<'_> {
        let count = self.joints.tree.links.len();
        let mut defect = self.defect.take().unwrap_or_else(|| Box::new(JointDefectEstimate::zeros(count)));
        let JointDefectEstimate { error, taken, room, impulses, right, wrench, force } = &mut *defect;
        *taken += self.residuals(bodies, (s, h), start, impulses);
        let gh = GAMMA * h;
        let Joints { tree, closures, inertias, .. } = &*self.joints;
        let [coordinates, moved] = &mut *error;
        self.w.both_motions(tree, (&coordinates.q, &coordinates.v), (&mut moved.q, &mut moved.v));
        propagate(error, room, |number, [x, bodies]| {
            for (j, (wrench, right)) in wrench.iter_mut().zip(right.iter_mut()).enumerate() {
                let drift = bodies.q[j] / gh;
                *wrench = Four::from(inertias[j].force(&((drift + bodies.v[j]) / gh), &drift));
                *right = Four::from(impulses.of(number, j) / gh);
            }
            if !closures.model.dampers.is_empty() {
                force.fill(Pose::zeros());
                forces::add_dampers(&closures.model, |k| bodies.q[k] / gh, force);
                for (wrench, force) in wrench.iter_mut().zip(&*force) {
                    *wrench = Four::from(wrench.pose() + *force);
                }
            }
            wrench[count] = Four::ZERO;
            self.w.solve(wrench, right);
            let lags = (|j: usize| x.q[j] / gh, |j: usize| bodies.q[j].z / gh);
            self.turning.complete(&self.joints, &self.w, gh, lags, (right, wrench));
            for (j, (right, wrench)) in right.iter().zip(&*wrench).enumerate() {
                (x.q[j], x.v[j]) = advanced(right.pose(), &x.q[j], gh);
                (bodies.q[j], bodies.v[j]) = advanced(wrench.pose(), &bodies.q[j], gh);
            }
        });
        let JointDefectEstimate { error: [_, motion], taken, .. } = &**self.defect.insert(defect);
        MotionError { motion, taken: *taken }
    }
}

/// Result of a solve, and its rate; only the rate of the input is omitted.
fn advanced(found: Pose, of: &Pose, gh: f64) -> (Pose, Pose) {
    (found, (found - of) / gh)
}
