//! Forces of driven anchors on a mechanism ([`super::driven_anchor`]), with their changes, and the sources that move them.

use super::approach::MaterialPoint;
use super::domain::Domain;
use super::drive::Drive;
use super::driven_anchor::DrivenAnchor;
use super::input::Input;
use super::loss_tangent::LossTangent;
use super::system::System;
use bimorph_multibody::forces;
use bimorph_multibody::planar::{self, Pose};
use bimorph_multibody::section::PackedJoint;
use bimorph_multibody::{BodyId, BodyMatrix, Model};

/// A state that the force of an anchor follows from.
#[derive(Debug, Clone, Copy)]
pub struct AnchorView<'a> {
    /// Displacements.
    pub q: &'a [Pose],
    /// Rates.
    pub v: &'a [Pose],
    /// Voltages of gaps and free strains of beams.
    pub drive: &'a Drive,
}

impl System {
    /// Number of the anchor and its direction that a source is, if it is one.
    pub fn anchor_input(&self, source: usize) -> Option<(usize, usize)> {
        let input = source.checked_sub(self.electrics.voltages())?;
        match self.electrics.inputs.get(input)? {
            Input::Motion { anchor, direction } => Some((*anchor, *direction)),
            _ => None,
        }
    }

    /// Source of that name, `NODE.ux`, `NODE.uy` or `NODE.urz`, if it is the motion of an anchor.
    pub fn anchor_source(&self, name: &str) -> Option<usize> {
        let first = self.electrics.voltages();
        let names = self.electrics.names.get(first..)?;
        names.iter().position(|known| known == name).map(|k| first + k)
    }

    /// The driven anchor at a node of that name.
    pub fn anchor_at(&self, node: &str) -> Option<usize> {
        self.anchors.iter().position(|anchor| anchor.node.as_deref() == Some(node))
    }

    /// Force (N) and moment about its node (N·m) with which an anchor moves the mechanism.
    pub fn anchor_force(&self, anchor: usize, state: &AnchorView<'_>) -> Pose {
        let DrivenAnchor { point, joint, .. } = &self.anchors[anchor];
        let BodyId::Free(body) = point.body else { return Pose::zeros() };
        let r = self.force_on(body, *joint, state);
        self.about(point, &state.q[body], r[body])
    }

    /// Change of [`System::anchor_force`] with a change of the state.
    pub fn anchor_force_change(&self, anchor: usize, state: &AnchorView<'_>, change: &AnchorView<'_>) -> Pose {
        let DrivenAnchor { point, joint, .. } = &self.anchors[anchor];
        let BodyId::Free(body) = point.body else { return Pose::zeros() };
        let (model, at, count) = (&self.model, self.at(state.q), state.q.len());
        let (mut stiffness, mut damping) = (BodyMatrix::new(&model.pattern), BodyMatrix::new(&model.pattern));
        let mut force = vec![Pose::zeros(); count];
        forces::add_tangent_of(
            model,
            joints_of(model, body, *joint),
            state.q,
            &state.drive.rest(),
            &mut stiffness,
            &mut force,
        );
        let volts = self.gap_voltages(state.q, &state.drive.volts);
        for (member, volts) in self.members.iter().zip(&*volts).filter(|(m, volts)| m.is_active(**volts)) {
            member.add_force_and_tangent(at, *volts, &model.pattern, (&mut force, &mut stiffness));
        }
        for load in &self.loads {
            load.add_force_and_tangent(at, state.drive.load, &model.pattern, (&mut force, &mut stiffness));
        }
        let mut loss = LossTangent { pattern: &model.pattern, stiffness: &mut stiffness, damping: &mut damping };
        for member in &self.members {
            member.add_loss(at, &|k| state.v[k], &mut force);
            member.add_loss_tangent(at, &|k| state.v[k], &mut loss);
        }
        let mut r = vec![Pose::zeros(); count];
        stiffness.multiply_add(&model.pattern, change.q, &mut r);
        damping.multiply_add(&model.pattern, change.v, &mut r);
        forces::add_damping(model, change.v, &mut r);
        forces::add_rest_change(model, state.q, &change.drive.rest(), &mut r);
        let changes = self.gap_voltage_slopes((state.q, &state.drive.volts), (change.q, &change.drive.volts));
        for ((member, volts), dv) in self.members.iter().zip(&*volts).zip(&*changes) {
            if *dv != 0.0 {
                member.add_force_change(at, *volts, *dv, &mut r);
            }
        }
        // the lever of the force turns with the body
        let (_, bend) = planar::point_turn(&state.q[body], point.arm, model.linear);
        let mut out = self.about(point, &state.q[body], r[body]);
        out.z -= bend.dot(&force[body].xy()) * change.q[body].z;
        out
    }

    /// Forces that balance all that acts on a body but one of its joints.
    fn force_on(&self, body: usize, but: u32, AnchorView { q, v, drive }: &AnchorView<'_>) -> Vec<Pose> {
        let (model, at) = (&self.model, self.at(q));
        let mut r = vec![Pose::zeros(); q.len()];
        forces::add_elastic_of(model, joints_of(model, body, but), q, &drive.rest(), &mut r);
        let volts = self.gap_voltages(q, &drive.volts);
        for (member, volts) in self.members.iter().zip(&*volts).filter(|(m, volts)| m.is_active(**volts)) {
            member.add_force(at, *volts, &mut r);
        }
        for load in &self.loads {
            load.add_force(at, drive.load, &mut r);
        }
        forces::add_damping(model, v, &mut r);
        self.add_loss(q, |k| v[k], &mut r);
        r
    }

    /// A generalized force on a body as a force and a moment about a point of it.
    fn about(&self, point: &MaterialPoint, pose: &Pose, force: Pose) -> Pose {
        let (lever, _) = planar::point_turn(pose, point.arm, self.model.linear);
        Pose::new(force.x, force.y, force.z - lever.dot(&force.xy()))
    }
}

/// The joints of a body but one.
fn joints_of(model: &Model, body: usize, but: u32) -> impl Iterator<Item = &PackedJoint> {
    let touches = move |joint: &PackedJoint| {
        let (a, b) = joint.bodies();
        a == BodyId::Free(body) || b == BodyId::Free(body)
    };
    model.joints.iter().zip(0..).filter(move |(joint, k)| *k != but && touches(joint)).map(|(joint, _)| joint)
}
