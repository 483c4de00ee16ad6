//! What forces that are already there add to the stiffness of a linear model.
//!
//! Small displacements about the drawing have K of unstressed parts. Vibrations about an equilibrium have more: the forces N, V, M in
//! the joints turn with them (K_σ of [`forces::add_stress_stiffness`]), and so do the points at which loads, voltage and contact act: a
//! body that turns by θ carries the point at its arm r along, and the force F, which keeps its direction, gets the lever
//! −θ·r, a moment of −θ·(r·F). Left out, a beam of N segments under thrust is too stiff by a share that falls with 1/N only.

use super::approach::Approach;
use super::drive::Drive;
use super::facing_ends;
use super::gap::Gap;
use super::system::System;
use crate::multibody::planar::Pose;
use crate::multibody::{BlockMatrix, BodyId, forces};
use nalgebra::Vector2;

impl System {
    /// `tangent +=` what the forces at `q` under `drive` add to the stiffness of a linear model; nothing in any other, whose tangent has it.
    pub fn add_stress_stiffness(&self, q: &[Pose], drive: &Drive, tangent: &mut BlockMatrix<f64, 3>) {
        forces::add_stress_stiffness(&self.model, q, &drive.rest(), tangent);
        self.add_levers(q, drive, tangent);
    }

    /// The share in it of the points at which forces act.
    pub fn add_levers(&self, q: &[Pose], drive: &Drive, tangent: &mut BlockMatrix<f64, 3>) {
        if !self.model.linear {
            return;
        }
        let mut lever = |body: BodyId, arm: Vector2<f64>, force: Vector2<f64>| {
            if let BodyId::Free(k) = body {
                tangent.diagonal[k][(2, 2)] += arm.dot(&force);
            }
        };
        for load in &self.loads {
            lever(load.point.body, load.point.arm, load.force * drive.load);
        }
        // of the potential φ(u): the force on a is −φ'·n, that on b φ'·n
        let mut pair = |approach: &Approach, first: f64| {
            lever(approach.a.body, approach.a.arm, approach.axis * -first);
            lever(approach.b.body, approach.b.arm, approach.axis * first);
        };
        for (gap, &volts) in self.gaps.iter().zip(&drive.volts) {
            let factor = -0.5 * volts * volts;
            match gap {
                Gap::Single { approach, capacitor, contact } => {
                    let u = approach.value(q, true);
                    let touch = contact.as_ref().map_or(0.0, |c| c.force(capacitor.distance(u)).0);
                    pair(approach, factor * capacitor.at(u).slope + touch);
                }
                Gap::Facing { ends, side, facing } => {
                    let z = facing_ends::values(self.model.linear, ends, *side, q);
                    let first = facing.at(&z).gradient * factor + facing.contact(&z).0;
                    pair(&ends[0], first[0]);
                    pair(&ends[1], first[2]);
                }
                Gap::Stop { approach, ways, stop } => pair(approach, stop.bearing(ways, approach.value(q, true)).0),
            }
        }
    }
}
