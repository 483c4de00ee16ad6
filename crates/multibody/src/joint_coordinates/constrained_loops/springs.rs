//! Elastic forces in joint coordinates.
//!
//! The coordinates of the tree are the strains of its joints, so their forces are −K·(e − e₀) as they stand. An elastic
//! direction of a closure acts on its two bodies through its rows.

use super::closures::Strain;
use super::poses::BodyKinematics;
use super::reduction::{Reduction, Traversal};
use super::stages::AddedInertia;
use super::tree::{Closure, Linkage, LinkageBody};
use crate::forces::RestStrain;
use crate::{BodyId, Joint};
use nalgebra::{Matrix3, Vector3};

impl Reduction<f64> {
    /// Sets the offsets of locked directions, which a heated or stressed joint prescribes. Before placing.
    pub fn prescribe(&mut self, linkage: &Linkage, rest: &RestStrain<'_>) {
        let offsets = &mut self.offsets;
        for (link, to) in linkage.links.iter().filter(|link| !link.pin).zip(&mut offsets.joints) {
            if !link.moving[0] {
                *to = offset(link.rest, link.expansion, rest);
            }
        }
        for (closure, to) in linkage.closures.iter().zip(&mut offsets.closures) {
            if let Closure::Joint(joint) = closure {
                *to = offset(joint.rest, joint.expansion, rest);
            }
        }
        if let Some(traversal) = &mut self.traversal {
            traversal.prescribe(offsets);
        }
    }

    /// Adds the elastic forces at the placed configuration to `torque` and `force`.
    pub fn add_elastic(&mut self, linkage: &Linkage, q: &[f64], rest: &RestStrain<'_>) {
        for link in &linkage.links {
            if link.stiffness.iter().all(|&k| k == 0.0) {
                continue;
            }
            let stress = link.stiffness * tree_strain(link, q, rest);
            let mut next = link.first;
            for i in 0..3 {
                if link.moving[i] {
                    self.torque[next] -= stress[i];
                    next += 1;
                }
            }
        }
        for (c, closure) in linkage.closures.iter().enumerate() {
            let Closure::Joint(joint) = closure else { continue };
            if !is_elastic(joint) {
                continue;
            }
            let strains = self.closure_strains(c, joint);
            let stress = joint.stiffness * closure_strain(joint, &strains, rest);
            for (i, strain) in strains.iter().enumerate() {
                if joint.locked[i] {
                    continue;
                }
                for (id, row) in [(joint.a, &strain.a), (joint.b, &strain.b)] {
                    if let BodyId::Free(k) = id {
                        for d in 0..3 {
                            self.force[k][d] -= row[d] * stress[i];
                        }
                    }
                }
            }
        }
    }

    /// Adds `factor` times the stiffness of the springs at the placed configuration, that of the tree's joints and of
    /// closures, to the inertia of an implicit step. How their axes turn is left out.
    pub fn add_stiffness(&self, linkage: &Linkage, factor: f64, added: &mut AddedInertia) {
        added.add_joints(linkage, factor);
        for (c, closure) in linkage.closures.iter().enumerate() {
            let Closure::Joint(joint) = closure else { continue };
            if !is_elastic(joint) {
                continue;
            }
            let strains = self.closure_strains(c, joint);
            let [ra, rb] = [0, 1].map(|side| {
                Matrix3::from_fn(|i, d| match (joint.locked[i], side) {
                    (true, _) => 0.0,
                    (false, 0) => strains[i].a[d],
                    (false, _) => strains[i].b[d],
                })
            });
            let k = joint.stiffness * factor;
            if let BodyId::Free(a) = joint.a {
                added.bodies.diagonal[a] += ra.transpose() * k * ra;
            }
            if let BodyId::Free(b) = joint.b {
                added.bodies.diagonal[b] += rb.transpose() * k * rb;
            }
            if let (BodyId::Free(a), BodyId::Free(b)) = (joint.a, joint.b)
                && let Some(block) = linkage.pattern.block(a.max(b), a.min(b))
            {
                let (row, column) = if a > b { (ra, rb) } else { (rb, ra) };
                added.bodies.below[block] += row.transpose() * k * column;
            }
        }
    }

    /// Strains of closure `c`, a joint, at the placed configuration.
    fn closure_strains(&self, c: usize, joint: &Joint) -> [Strain<f64>; 3] {
        let at = |id| match id {
            BodyId::Free(k) => self.placed(k),
            BodyId::Ground => BodyKinematics::REST,
        };
        self.mechanism.closures[c].strains(&at(joint.a), &at(joint.b))
    }

    /// Elastic energy at the placed configuration (J).
    pub fn strain_energy(&self, linkage: &Linkage, q: &[f64], rest: &RestStrain<'_>) -> f64 {
        let mut energy = 0.0;
        for link in &linkage.links {
            let e = tree_strain(link, q, rest);
            energy += 0.5 * e.dot(&(link.stiffness * e));
        }
        for (c, closure) in linkage.closures.iter().enumerate() {
            let Closure::Joint(joint) = closure else { continue };
            let e = closure_strain(joint, &self.closure_strains(c, joint), rest);
            energy += 0.5 * e.dot(&(joint.stiffness * e));
        }
        energy
    }

    /// Kinetic energy at the placed configuration (J).
    #[inline]
    pub fn kinetic_energy(&self, linkage: &Linkage) -> f64 {
        (linkage.links.iter().enumerate())
            .map(|(body, l)| {
                let [x, y, w] = self.rate(body);
                0.5 * (l.mass * (x * x + y * y) + l.inertia * w * w)
            })
            .sum()
    }
}

/// Elastic strains of a joint of the tree; 0 in locked directions.
fn tree_strain(link: &LinkageBody, q: &[f64], rest: &RestStrain<'_>) -> Vector3<f64> {
    let mut e = Vector3::zeros();
    for (at, i) in (link.first..).zip((0..3).filter(|&i| link.moving[i])) {
        e[i] = q[at];
    }
    if link.moving[0] {
        e.x -= offset(link.rest, link.expansion, rest);
    }
    e
}

/// Elastic strains of a joint that closes a loop; 0 in locked directions.
fn closure_strain(joint: &Joint, strains: &[Strain<f64>; 3], rest: &RestStrain<'_>) -> Vector3<f64> {
    let mut e = Vector3::from_fn(|i, _| if joint.locked[i] { 0.0 } else { strains[i].value });
    if !joint.locked[0] {
        e.x -= offset(joint.rest, joint.expansion, rest);
    }
    e
}

/// True for a joint with a spring in a direction that is not locked.
fn is_elastic(joint: &Joint) -> bool {
    (0..3).any(|i| !joint.locked[i] && joint.stiffness[(i, i)] != 0.0)
}

fn offset(built_in: f64, expansion: Option<(usize, f64)>, rest: &RestStrain<'_>) -> f64 {
    built_in * rest.built_in + expansion.map_or(0.0, |(group, length)| length * rest.expansion[group])
}
