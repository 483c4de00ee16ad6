//! The stiffness of a model in its present geometry without the stress in its joints, and the forces of given stresses.
//!
//! The tangent of [`forces::add_tangent`](super::forces::add_tangent) less its geometric part is what is left where all
//! section forces and strains vanish while the frames of the joints keep their directions. A part that has only turned has
//! the same stiffness as at rest.

use super::BodyMatrix;
use super::forces::{HalfTurnCache, add_coupling_tangent, scatter};
use super::model::Model;
use super::planar::Pose;
use nalgebra::Vector3;

/// `tangent += factor·K₀`: the stiffness in the geometry `q` with all strains and section forces set to zero.
#[inline]
pub fn add_unstressed_tangent(model: &Model, q: &[Pose], factor: f64, tangent: &mut BodyMatrix) {
    let mut turns = HalfTurnCache::new();
    for joint in &model.joints {
        let section = model.section(joint);
        let k = turns.kinematics(model.linear, joint, section, q).unstrained();
        joint.place.add_pair(tangent, &k.elastic(&section.stiffness.scaled(factor)));
    }
    add_coupling_tangent(model, factor, tangent);
}

/// `r +=` the forces on the bodies of the stress (N (N), V (N), M (N·m)) that `stress` gives for each joint.
#[inline]
pub fn add_stresses(model: &Model, q: &[Pose], mut stress: impl FnMut(usize) -> Vector3<f64>, r: &mut [Pose]) {
    let mut turns = HalfTurnCache::new();
    for (number, joint) in model.joints.iter().enumerate() {
        let section = model.section(joint);
        let k = turns.kinematics(model.linear, joint, section, q).unstrained();
        scatter(joint.place, k.forces(&stress(number).into()), r);
    }
}

/// Strains (u (m), g (m), p (rad)) of the joints of a model.
#[inline]
pub fn strains(model: &Model, q: &[Pose]) -> impl Iterator<Item = Vector3<f64>> {
    let mut turns = HalfTurnCache::new();
    model.joints.iter().map(move |joint| turns.kinematics(model.linear, joint, model.section(joint), q).strain.into())
}
