//! Elastic forces, strain energy, tangent and damping of a model. One pass over the joints each, no allocation.

use super::joint::Coupling;
use super::model::Model;
use super::planar::factored::FactoredTangent;
use super::planar::vector::dot3;
use super::planar::{Block, HalfTurn, JointKinematics, PairTangent, Pose, Symmetric, Vec3};
use super::section::{JointSection, NONE, PackedJoint, PairSlot};
use super::{BodyId, BodyMatrix};
use nalgebra::{Matrix6, Vector3, Vector6};

/// Half turns of the two bodies that were met last. Along a beam each body is met twice in a row, and a sine and cosine
/// is dearer than everything else that a body costs.
pub(super) struct HalfTurnCache {
    a: (u32, HalfTurn),
    b: (u32, HalfTurn),
}

impl HalfTurnCache {
    pub(super) fn new() -> Self {
        Self { a: (NONE, HalfTurn::REST), b: (NONE, HalfTurn::REST) }
    }

    #[inline(always)]
    fn of(&self, body: u32, pose: &Pose) -> HalfTurn {
        if body == self.b.0 {
            self.b.1
        } else if body == self.a.0 {
            self.a.1
        } else if body == NONE {
            HalfTurn::REST
        } else {
            HalfTurn::new(pose.z)
        }
    }

    /// Kinematics of the next joint.
    #[inline(always)]
    pub(super) fn kinematics(
        &mut self,
        linear: bool,
        joint: &PackedJoint,
        section: &JointSection,
        q: &[Pose],
    ) -> JointKinematics {
        let PairSlot { a, b, .. } = joint.place;
        let (qa, qb) = (pose(q, a), pose(q, b));
        let frame = joint.frame(section);
        if linear {
            return frame.linear(&qa, &qb);
        }
        let (turn_a, turn_b) = (self.of(a, &qa), self.of(b, &qb));
        (self.a, self.b) = ((a, turn_a), (b, turn_b));
        frame.turned((&qa, &turn_a), (&qb, &turn_b), &section.second)
    }
}

#[inline]
fn pose(q: &[Pose], body: u32) -> Pose {
    if body == NONE { Pose::zeros() } else { q[body as usize] }
}

impl PackedJoint {
    /// Axial rest offset (m).
    #[inline]
    fn offset(&self, section: &JointSection, rest: &RestStrain<'_>) -> f64 {
        self.offset_with(section, rest.built_in, |group| rest.expansion[group])
    }

    /// The same with the free strain of a group as a function.
    #[inline]
    fn offset_with(&self, section: &JointSection, built_in: f64, expansion: impl Fn(usize) -> f64) -> f64 {
        self.rest * built_in + section.expansion.map_or(0.0, |(group, length)| length * expansion(group))
    }

    #[inline(always)]
    fn stress(&self, section: &JointSection, k: &JointKinematics, rest: &RestStrain<'_>) -> Vec3<f64> {
        let [u, g, p] = k.strain;
        section.stiffness.times([u - self.offset(section, rest), g, p])
    }
}

/// Axial rest offsets of joints, or their change.
#[derive(Debug, Clone, Copy)]
pub struct RestStrain<'a> {
    /// Free strain of each group of joints (1).
    pub expansion: &'a [f64],
    /// Fraction of the built-in offsets ([`Joint::rest`](crate::Joint::rest)) that acts (1).
    pub built_in: f64,
}

/// Force along the axis of a joint (N), tension positive.
#[inline]
pub fn axial_force(model: &Model, joint: &PackedJoint, q: &[Pose], rest: &RestStrain<'_>) -> f64 {
    resultants(model, joint, q, rest.built_in, |group| rest.expansion[group]).x
}

/// Normal force, shear force and moment of a joint (N, N, N·m), with the fraction of the built-in offsets that acts and the free strain of each
/// group of joints (1).
#[inline]
pub fn resultants(
    model: &Model,
    joint: &PackedJoint,
    q: &[Pose],
    built_in: f64,
    expansion: impl Fn(usize) -> f64,
) -> Vector3<f64> {
    let section = model.section(joint);
    let k = HalfTurnCache::new().kinematics(model.linear, joint, section, q);
    let offset = joint.offset_with(section, built_in, expansion);
    let [u, g, p] = k.strain;
    section.stiffness.times([u - offset, g, p]).into()
}

/// Change of [`resultants`] with a change `dq` of the configuration and `expansion` of the free strains.
#[inline]
pub fn resultants_change(
    model: &Model,
    joint: &PackedJoint,
    q: &[Pose],
    dq: &[Pose],
    expansion: impl Fn(usize) -> f64,
) -> Vector3<f64> {
    let section = model.section(joint);
    let k = HalfTurnCache::new().kinematics(model.linear, joint, section, q);
    let (da, db) = (pose(dq, joint.place.a), pose(dq, joint.place.b));
    let [u, g, p]: Vec3<f64> = (k.rows() * Vector6::new(da.x, da.y, da.z, db.x, db.y, db.z)).into();
    section.stiffness.times([u - joint.offset_with(section, 0.0, expansion), g, p]).into()
}

/// Change of [`axial_force`] with a change `dq` of the configuration (N).
#[inline]
pub fn axial_change(model: &Model, joint: &PackedJoint, q: &[Pose], dq: &[Pose]) -> f64 {
    let section = model.section(joint);
    let k = HalfTurnCache::new().kinematics(model.linear, joint, section, q);
    let (da, db) = (pose(dq, joint.place.a), pose(dq, joint.place.b));
    section.stiffness.times((k.rows() * Vector6::new(da.x, da.y, da.z, db.x, db.y, db.z)).into())[0]
}

/// `r +=` the forces that a change `offset` (m) of one joint's rest offset brings.
#[inline]
pub fn add_offset_change(model: &Model, joint: &PackedJoint, q: &[Pose], offset: f64, r: &mut [Pose]) {
    let section = model.section(joint);
    let k = HalfTurnCache::new().kinematics(model.linear, joint, section, q);
    scatter(joint.place, k.forces(&section.stiffness.times([-offset, 0.0, 0.0])), r);
}

/// `r += ∂U/∂q`, the elastic forces at displacement `q`.
#[inline]
pub fn add_elastic(model: &Model, q: &[Pose], rest: &RestStrain<'_>, r: &mut [Pose]) {
    add_joints(model, model.joints.iter(), q, rest, r);
}

/// [`add_elastic`] from the last joint to the first.
#[inline]
pub fn add_elastic_backwards(model: &Model, q: &[Pose], rest: &RestStrain<'_>, r: &mut [Pose]) {
    add_joints(model, model.joints.iter().rev(), q, rest, r);
}

/// [`add_elastic`] of some of the joints, with all couplings.
pub fn add_elastic_of<'a>(
    model: &Model,
    joints: impl Iterator<Item = &'a PackedJoint>,
    q: &[Pose],
    rest: &RestStrain<'_>,
    r: &mut [Pose],
) {
    add_joints(model, joints, q, rest, r);
}

#[inline(always)]
fn add_joints<'a>(
    model: &Model,
    joints: impl Iterator<Item = &'a PackedJoint>,
    q: &[Pose],
    rest: &RestStrain<'_>,
    r: &mut [Pose],
) {
    let mut turns = HalfTurnCache::new();
    for joint in joints {
        let section = model.section(joint);
        let k = turns.kinematics(model.linear, joint, section, q);
        scatter(joint.place, k.forces(&joint.stress(section, &k, rest)), r);
    }
    add_couplings(model, q, r);
}

/// `r +=` the moments of coupled joints.
#[inline]
pub fn add_couplings(model: &Model, q: &[Pose], r: &mut [Pose]) {
    for coupling in &model.couplings {
        let (first, second) = (turn_between(q, coupling.first), turn_between(q, coupling.second));
        for ((a, b), moment) in [(coupling.first, second), (coupling.second, first)] {
            for (id, side) in [(a, -coupling.stiffness), (b, coupling.stiffness)] {
                if let BodyId::Free(k) = id {
                    r[k].z += side * moment;
                }
            }
        }
    }
}

fn turn_between(q: &[Pose], (a, b): (BodyId, BodyId)) -> f64 {
    Model::pose(q, b).z - Model::pose(q, a).z
}

/// The constant tangent of coupled joints.
pub(super) fn add_coupling_tangent(model: &Model, factor: f64, tangent: &mut BodyMatrix) {
    for Coupling { first, second, stiffness } in &model.couplings {
        let stiffness = factor * stiffness;
        for (i, row) in [(first.0, -stiffness), (first.1, stiffness)] {
            for (j, side) in [(second.0, -1.0), (second.1, 1.0)] {
                let (BodyId::Free(i), BodyId::Free(j)) = (i, j) else { continue };
                if i == j {
                    tangent.diagonal[i][(2, 2)] += 2.0 * row * side;
                } else if let Some(block) = model.pattern.block(i.max(j), i.min(j)) {
                    tangent.below[block][(2, 2)] += row * side;
                }
            }
        }
    }
}

/// `tangent += ∂²U/∂q²` and `r += ∂U/∂q`.
pub fn add_tangent(model: &Model, q: &[Pose], rest: &RestStrain<'_>, tangent: &mut BodyMatrix, r: &mut [Pose]) {
    add_tangent_of(model, model.joints.iter(), q, rest, tangent, r);
}

/// [`add_tangent`] of some of the joints, with all couplings.
#[inline(always)]
pub fn add_tangent_of<'a>(
    model: &Model,
    joints: impl Iterator<Item = &'a PackedJoint>,
    q: &[Pose],
    rest: &RestStrain<'_>,
    tangent: &mut BodyMatrix,
    r: &mut [Pose],
) {
    let mut turns = HalfTurnCache::new();
    for joint in joints {
        let section = model.section(joint);
        let k = turns.kinematics(model.linear, joint, section, q);
        let stress = joint.stress(section, &k, rest);
        scatter(joint.place, k.forces(&stress), r);
        let h = if model.linear {
            k.elastic(&section.stiffness)
        } else {
            k.tangent(&section.stiffness, &stress, &section.second)
        };
        joint.place.add_pair(tangent, &h);
    }
    add_couplings(model, q, r);
    add_coupling_tangent(model, 1.0, tangent);
}

/// `tangent +=` the stiffness that the stress of the joints brings to a linear model about the drawn geometry, as stress and
/// heat do. Equilibria of a linear model do not have it; vibrations about them do.
#[inline]
pub fn add_stress_stiffness(model: &Model, q: &[Pose], rest: &RestStrain<'_>, tangent: &mut BodyMatrix) {
    let mut turns = HalfTurnCache::new();
    for joint in model.joints.iter().filter(|_| model.linear) {
        let section = model.section(joint);
        let k = turns.kinematics(true, joint, section, q);
        let h = k.tangent(&Symmetric::default(), &joint.stress(section, &k, rest), &section.second);
        joint.place.add_pair(tangent, &h);
    }
}

/// The tangents of the joints with their stress, unsummed; their sum is that of [`add_tangent`], and for a linear model of
/// [`add_stress_stiffness`], without couplings.
pub(crate) fn factored(model: &Model, q: &[Pose], rest: &RestStrain<'_>) -> Vec<(PairSlot, FactoredTangent)> {
    let mut turns = HalfTurnCache::new();
    let one = |joint: &PackedJoint| {
        let section = model.section(joint);
        let k = turns.kinematics(model.linear, joint, section, q);
        let stress = joint.stress(section, &k, rest);
        (joint.place, k.factored(&section.stiffness, &stress, &section.second))
    };
    model.joints.iter().map(one).collect()
}

/// Strain energy U(q) (J).
#[inline]
pub fn strain_energy(model: &Model, q: &[Pose], rest: &RestStrain<'_>) -> f64 {
    let mut turns = HalfTurnCache::new();
    let energy = |joint: &PackedJoint| {
        let section = model.section(joint);
        let k = turns.kinematics(model.linear, joint, section, q);
        let [u, g, p] = k.strain;
        let strain = [u - joint.offset(section, rest), g, p];
        0.5 * dot3(strain, section.stiffness.times(strain))
    };
    let coupled = |c: &Coupling| c.stiffness * turn_between(q, c.first) * turn_between(q, c.second);
    model.joints.iter().map(energy).sum::<f64>() + model.couplings.iter().map(coupled).sum::<f64>()
}

/// Kinetic energy ½·vᵀMv (J).
#[inline]
pub fn kinetic_energy(model: &Model, v: &[Pose]) -> f64 {
    v.iter().enumerate().map(|(k, v)| 0.5 * v.dot(&model.mass(k).component_mul(v))).sum()
}

/// `r += (∂²U/∂q∂rest)·change`: the forces that a change of the rest offsets brings.
pub fn add_rest_change(model: &Model, q: &[Pose], change: &RestStrain<'_>, r: &mut [Pose]) {
    if change.built_in == 0.0 && change.expansion.iter().all(|&e| e == 0.0) {
        return;
    }
    let mut turns = HalfTurnCache::new();
    for joint in &model.joints {
        let section = model.section(joint);
        let offset = joint.offset(section, change);
        if offset != 0.0 {
            let k = turns.kinematics(model.linear, joint, section, q);
            scatter(joint.place, k.forces(&section.stiffness.times([-offset, 0.0, 0.0])), r);
        }
    }
}

/// `r += C·v`, gas drag and dampers.
#[inline]
pub fn add_damping(model: &Model, v: &[Pose], r: &mut [Pose]) {
    for (body, (v, r)) in model.bodies.iter().zip(v.iter().zip(r.iter_mut())) {
        *r += body.drag.force(v);
    }
    add_dampers(model, |k| v[k], r);
}

/// `r +=` the forces of dampers, with the rate of each body from `v`.
pub fn add_dampers(model: &Model, v: impl Fn(usize) -> Pose, r: &mut [Pose]) {
    let rate = |id: BodyId| match id {
        BodyId::Ground => Pose::zeros(),
        BodyId::Free(k) => v(k),
    };
    for (damper, matrix) in model.dampers.iter().zip(&model.damper_matrix) {
        let (va, vb) = (rate(damper.a), rate(damper.b));
        let pair = Vector6::new(va.x, va.y, va.z, vb.x, vb.y, vb.z);
        let f = matrix * pair;
        for (id, part) in [(damper.a, f.fixed_rows::<3>(0)), (damper.b, f.fixed_rows::<3>(3))] {
            if let BodyId::Free(k) = id {
                r[k] += part;
            }
        }
    }
}

/// `matrix += m·M + c·C`: the inertia and damping share of an implicit step.
pub fn add_inertia(model: &Model, m: f64, c: f64, matrix: &mut BodyMatrix) {
    for (block, body) in matrix.diagonal.iter_mut().zip(&model.bodies) {
        let (drag, first) = (body.drag, body.drag.first * c);
        let translation = m * body.mass + c * drag.amount;
        block[(0, 0)] += translation;
        block[(1, 1)] += translation;
        block[(2, 2)] += m * body.inertia + c * drag.second;
        for (i, lever) in [(0, -first.y), (1, first.x)] {
            block[(i, 2)] += lever;
            block[(2, i)] += lever;
        }
    }
    for (damping, place) in model.damper_matrix.iter().zip(&model.damper_place) {
        place.add(matrix, &(damping * c));
    }
}

#[inline(always)]
pub(super) fn scatter(place: PairSlot, (a, b): (Vec3<f64>, Vec3<f64>), r: &mut [Pose]) {
    if place.a != NONE {
        r[place.a as usize] += Pose::from(a);
    }
    if place.b != NONE {
        r[place.b as usize] += Pose::from(b);
    }
}

impl PairSlot {
    /// Adds the tangent of a pair to `matrix`, in the parts that belong to free bodies.
    #[inline(always)]
    pub(crate) fn add_pair(self, matrix: &mut BodyMatrix, h: &PairTangent) {
        if self.a != NONE {
            matrix.diagonal[self.a as usize] += Block::from(h.aa());
        }
        if self.b != NONE {
            matrix.diagonal[self.b as usize] += Block::from(h.bb());
        }
        if self.block != NONE {
            // the block's row is the body eliminated later
            matrix.below[self.block as usize] += Block::from(if self.a > self.b { h.ab() } else { h.ba() });
        }
    }

    /// Adds a 6×6 pair block (a then b) to `matrix`, in the parts that belong to free bodies.
    #[inline]
    pub fn add(self, matrix: &mut BodyMatrix, h: &Matrix6<f64>) {
        if self.a != NONE {
            matrix.diagonal[self.a as usize] += h.fixed_view::<3, 3>(0, 0);
        }
        if self.b != NONE {
            matrix.diagonal[self.b as usize] += h.fixed_view::<3, 3>(3, 3);
        }
        if self.block != NONE {
            let corner = if self.a > self.b { h.fixed_view::<3, 3>(0, 3) } else { h.fixed_view::<3, 3>(3, 0) };
            matrix.below[self.block as usize] += corner;
        }
    }
}
