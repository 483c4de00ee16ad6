//! Elastic forces, strain energy, tangent and damping of a model. One pass over the joints each, no allocation.

use super::model::{Joint, Model};
use super::planar::{JointKinematics, Pose};
use super::{BlockMatrix, BodyId};
use nalgebra::Vector3;

impl Joint {
    #[inline]
    fn kinematics(&self, linear: bool, q: &[Pose]) -> JointKinematics {
        let (qa, qb) = (Model::pose(q, self.a), Model::pose(q, self.b));
        if linear { self.frame.linear(&qa, &qb) } else { self.frame.kinematics(&qa, &qb, &self.second) }
    }

    /// Axial rest offset [m].
    #[inline]
    fn offset(&self, rest: &RestStrain<'_>) -> f64 {
        self.rest * rest.built_in + self.expansion.map_or(0.0, |(group, length)| length * rest.expansion[group])
    }

    #[inline]
    fn stress(&self, k: &JointKinematics, rest: &RestStrain<'_>) -> Vector3<f64> {
        self.stiffness * (k.strain - Vector3::new(self.offset(rest), 0.0, 0.0))
    }
}

/// What sets the axial rest offsets of joints, or the change of it.
#[derive(Debug, Clone, Copy)]
pub struct RestStrain<'a> {
    /// Free strain of each group of joints [1].
    pub expansion: &'a [f64],
    /// Share of the built-in offsets ([`Joint::rest`]) that acts [1].
    pub built_in: f64,
}

/// `r += ∂U/∂q`, the elastic forces at displacement `q`.
pub fn add_elastic(model: &Model, q: &[Pose], rest: &RestStrain<'_>, r: &mut [Pose]) {
    for joint in &model.joints {
        let k = joint.kinematics(model.linear, q);
        scatter(joint.a, joint.b, &(k.rows.transpose() * joint.stress(&k, rest)), r);
    }
}

/// `tangent += ∂²U/∂q²` and `r += ∂U/∂q`.
pub fn add_tangent(
    model: &Model,
    q: &[Pose],
    rest: &RestStrain<'_>,
    tangent: &mut BlockMatrix<f64, 3>,
    r: &mut [Pose],
) {
    for (joint, place) in model.joints.iter().zip(&model.joint_place) {
        let k = joint.kinematics(model.linear, q);
        let stress = joint.stress(&k, rest);
        scatter(joint.a, joint.b, &(k.rows.transpose() * stress), r);
        let mut h = k.rows.transpose() * joint.stiffness * k.rows;
        if !model.linear {
            h += k.geometric(&stress, &joint.second);
        }
        place.add(tangent, &h);
    }
}

/// `r += (∂²U/∂q∂rest)·change`: the forces that a change of the rest offsets brings.
pub fn add_rest_change(model: &Model, q: &[Pose], change: &RestStrain<'_>, r: &mut [Pose]) {
    for joint in &model.joints {
        let offset = joint.offset(change);
        if offset != 0.0 {
            let k = joint.kinematics(model.linear, q);
            let stress = joint.stiffness.column(0) * -offset;
            scatter(joint.a, joint.b, &(k.rows.transpose() * stress), r);
        }
    }
}

/// `r += C·v`, gas drag and dampers.
pub fn add_damping(model: &Model, v: &[Pose], r: &mut [Pose]) {
    for (body, (v, r)) in model.bodies.iter().zip(v.iter().zip(r.iter_mut())) {
        *r += body.drag * v;
    }
    for (damper, matrix) in model.dampers.iter().zip(&model.damper_matrix) {
        let (va, vb) = (Model::pose(v, damper.a), Model::pose(v, damper.b));
        let pair = nalgebra::Vector6::new(va.x, va.y, va.z, vb.x, vb.y, vb.z);
        scatter(damper.a, damper.b, &(matrix * pair), r);
    }
}

/// `matrix += m·M + c·C`: the inertia and damping share of an implicit step.
pub fn add_inertia(model: &Model, m: f64, c: f64, matrix: &mut BlockMatrix<f64, 3>) {
    for (j, body) in model.bodies.iter().enumerate() {
        matrix.diagonal[j] += body.drag * c;
        for i in 0..3 {
            matrix.diagonal[j][(i, i)] += m * model.mass(j)[i];
        }
    }
    for (damping, place) in model.damper_matrix.iter().zip(&model.damper_place) {
        place.add(matrix, &(damping * c));
    }
}

#[inline]
fn scatter(a: BodyId, b: BodyId, f: &nalgebra::Vector6<f64>, r: &mut [Pose]) {
    if let BodyId::Free(a) = a {
        r[a] += f.fixed_rows::<3>(0);
    }
    if let BodyId::Free(b) = b {
        r[b] += f.fixed_rows::<3>(3);
    }
}
