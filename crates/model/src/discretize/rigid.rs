//! Nodes → rigid bodies. Links and rigid beams join nodes to one body; anchors make it ground; other supports hold
//! directions.
//!
//! Until [`RigidGroups::finish_bodies`] every point is given from its group's reference point (the position of the group's
//! first node); after it, from the centre of mass, in which the mass matrix is diagonal and constant.

use bimorph_base::sets::Sets;
use bimorph_domains::driven_anchor::DrivenAnchor;
use bimorph_domains::plate_film::STATES_OF_BODY;
use bimorph_domains::{MaterialPoint, Member, PlacedMember, Station, StructureView};
use bimorph_multibody::planar::JointFrame;
use bimorph_multibody::{Body, BodyId, BodyName, Drag, Joint};
use bimorph_structure::{AnchorMotion, Beam, Mass, NodeId, Structure, Support};
use nalgebra::{Matrix2, Matrix3, Vector2};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Stiffness of a hinge over that of the stiffest beam or spring.
const HINGE: f64 = 1e6;

/// Second moment about the centre, over that about another point, which a sum of lumps may have by rounding (1).
const ROUNDING: f64 = 1e-13;

/// Mass, first and second moment of something, and the same for its drag.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Lump {
    /// Mass (kg) or drag (N·s/m).
    pub amount: f64,
    /// First moment about the reference point (kg·m).
    pub first: Vector2<f64>,
    /// Second moment about the reference point (kg·m²).
    pub second: f64,
}

impl Lump {
    /// Adds a lump whose own reference point lies at `shift` from this one's.
    pub fn add(&mut self, other: &Self, shift: Vector2<f64>, factor: f64) {
        self.amount += factor * other.amount;
        self.first += (other.first + shift * other.amount) * factor;
        self.second += factor * (other.second + 2.0 * other.first.dot(&shift) + other.amount * shift.norm_squared());
    }

    fn center(&self) -> Vector2<f64> {
        if self.amount > 0.0 { self.first / self.amount } else { Vector2::zeros() }
    }

    /// Second moment about the centre; 0 where rounding leaves no more.
    pub(super) fn central(&self) -> f64 {
        let shifted = self.amount * self.center().norm_squared();
        let central = self.second - shifted;
        if central > ROUNDING * self.second.abs().max(shifted) { central } else { 0.0 }
    }
}

/// A body in the making.
#[derive(Debug, Clone)]
pub struct UnfinishedBody {
    name: BodyName,
    reference: Vector2<f64>,
    mass: Lump,
    drag: Lump,
    held: Vec<Vector2<f64>>,
    fixed_angle: bool,
    /// An anchor that moves: without inertia and drag.
    anchored: bool,
}

/// A driven anchor, with the place of its joint among those of a model under construction.
#[derive(Debug, Clone, PartialEq)]
pub struct PlacedAnchor {
    /// The anchor; its own `joint` is not yet known.
    pub anchor: DrivenAnchor,
    /// Place of its joint to ground.
    pub joint: usize,
}

/// Groups of nodes and the bodies they become.
#[derive(Debug, Clone)]
pub struct RigidGroups {
    /// Bodies so far: node groups, then beam segments.
    pub bodies: Vec<UnfinishedBody>,
    group: Vec<BodyId>,
    position: Vec<Vector2<f64>>,
}

impl RigidGroups {
    /// Groups the nodes of a drawing, of which the beams marked in `rigid` are links too.
    pub fn new(structure: &Structure, rigid: &[bool]) -> Self {
        let count = structure.nodes.len();
        let mut joined = Sets::new(count);
        let stiff = structure.beams.iter().zip(rigid).filter(|(_, rigid)| **rigid).map(|(beam, _)| (beam.a, beam.b));
        for (a, b) in structure.links.iter().map(|link| (link.a, link.b)).chain(stiff) {
            joined.join(a.0, b.0);
        }
        let mut anchored = vec![false; count];
        for support in &structure.supports {
            if support.held == [true; 3] && support.motion.is_none() {
                anchored[joined.first(support.node.0)] = true;
            }
        }
        let position: Vec<_> = structure.nodes.iter().map(|n| Vector2::new(n.position[0], n.position[1])).collect();
        let mut bodies = Vec::new();
        let mut group = vec![BodyId::Ground; count];
        for node in 0..count {
            if !structure.nodes[node].mechanical {
                continue;
            }
            let first = joined.first(node);
            if anchored[first] {
                continue;
            }
            group[node] = if first == node || group[first] == BodyId::Ground {
                bodies.push(UnfinishedBody::new((&structure.nodes[node].name).into(), position[node]));
                BodyId::Free(bodies.len() - 1)
            } else {
                group[first]
            };
            group[first] = group[node];
        }
        let mut assembly = Self { bodies, group, position };
        for support in &structure.supports {
            if let BodyId::Free(k) = assembly.group[support.node.0] {
                match support.motion {
                    Some(motion) => assembly.bodies[k].anchor(may_turn(&motion)),
                    None => assembly.bodies[k].hold(support.held, support.angle),
                }
            }
        }
        assembly
    }

    /// The material point of a node.
    pub fn point(&self, node: usize) -> MaterialPoint {
        match self.group[node] {
            BodyId::Ground => MaterialPoint { body: BodyId::Ground, arm: Vector2::zeros() },
            BodyId::Free(k) => {
                MaterialPoint { body: self.group[node], arm: self.position[node] - self.bodies[k].reference }
            }
        }
    }

    /// True when the node is part of the ground, or of an anchor that moves.
    pub fn grounded(&self, node: usize) -> bool {
        match self.group[node] {
            BodyId::Ground => true,
            BodyId::Free(k) => self.bodies[k].anchored,
        }
    }

    /// Drawn position of a point (m).
    pub fn position(&self, node: usize) -> Vector2<f64> {
        self.position[node]
    }

    /// A new body for an inner node of a beam.
    pub fn add_segment(&mut self, name: BodyName, position: Vector2<f64>) -> MaterialPoint {
        self.bodies.push(UnfinishedBody::new(name, position));
        MaterialPoint { body: BodyId::Free(self.bodies.len() - 1), arm: Vector2::zeros() }
    }

    /// Adds a mass and its drag to the body of a point; `lump` is about that point.
    pub fn add_mass(&mut self, point: MaterialPoint, lump: &Lump, drag_per_mass: f64) {
        if let Some(body) = self.moving(point) {
            body.mass.add(lump, point.arm, 1.0);
            body.drag.add(lump, point.arm, drag_per_mass);
        }
    }

    /// Adds `factor` times a drag to the body of a point; `lump` is about that point.
    pub fn add_drag(&mut self, point: MaterialPoint, lump: &Lump, factor: f64) {
        if let Some(body) = self.moving(point) {
            body.drag.add(lump, point.arm, factor);
        }
    }

    /// The body of a point that is neither ground nor an anchor, whose inertia and drag have no effect.
    fn moving(&mut self, point: MaterialPoint) -> Option<&mut UnfinishedBody> {
        let BodyId::Free(k) = point.body else { return None };
        Some(&mut self.bodies[k]).filter(|body| !body.anchored)
    }

    /// Adds a plate or lumped mass.
    pub fn add_plate(&mut self, plate: &Mass, undamped: bool) {
        let point = self.point(plate.node.0);
        if let Some(body) = self.moving(point) {
            let lump = Lump { amount: plate.mass, first: Vector2::zeros(), second: plate.inertia };
            let drag = Lump { amount: plate.drag[0], first: Vector2::zeros(), second: plate.drag[1] };
            body.mass.add(&lump, point.arm, 1.0);
            if !undamped {
                body.drag.add(&drag, point.arm, 1.0);
            }
        }
    }

    /// The frame of a joint half way between two nodes as drawn.
    pub fn frame(&self, a: usize, b: usize, angle: f64) -> JointFrame {
        let middle = (self.position[a] + self.position[b]) * 0.5;
        self.frame_at(self.point(a), self.point(b), middle, Vector2::new(angle.cos(), angle.sin()))
    }

    /// Force elements across gaps. `chord`: facing beams in SUGAR's model; `stations`: points where the segments of
    /// each beam are joined; `film_states`: see [`RigidGroups::add_film_states`].
    pub fn gaps<'a>(
        &self,
        structure: &'a Structure,
        chord: bool,
        stations: &[Vec<Station>],
        film_states: &[Vec<MaterialPoint>],
    ) -> Vec<PlacedMember<'a, Member>> {
        Member::lay(&StructureView {
            structure,
            point: &|node: NodeId| self.point(node.0),
            chord,
            stations,
            film_states,
        })
    }

    /// Bodies without mass for the states of gas that compresses, for each pair of lumped plates.
    pub fn add_film_states(&mut self, structure: &Structure) -> Vec<Vec<MaterialPoint>> {
        let mut found = Vec::with_capacity(structure.plate_gaps.len());
        for plate in &structure.plate_gaps {
            let count = plate.gas.map_or(0, |gas| gas.states);
            let name: Arc<str> = format!("{}.film", plate.name).into();
            let mut bodies = Vec::with_capacity(count.div_ceil(STATES_OF_BODY));
            for first in (0..count).step_by(STATES_OF_BODY) {
                let mut body = UnfinishedBody::new(BodyName::segment(&name, bodies.len()), self.position[plate.a.0]);
                body.hold([false, first + 1 == count, true], 0.0);
                bodies.push(MaterialPoint { body: BodyId::Free(self.bodies.len()), arm: Vector2::zeros() });
                self.bodies.push(body);
            }
            found.push(bodies);
        }
        found
    }

    /// The frame of a joint at a drawn position, whose x axis lies along `axis`.
    pub fn frame_at(
        &self,
        a: MaterialPoint,
        b: MaterialPoint,
        position: Vector2<f64>,
        axis: Vector2<f64>,
    ) -> JointFrame {
        let arm = |p: MaterialPoint| match p.body {
            BodyId::Ground => Vector2::zeros(),
            BodyId::Free(k) => position - self.bodies[k].reference,
        };
        JointFrame { arm_a: arm(a), arm_b: arm(b), axis }
    }

    /// Supports that hold a translation but let the body turn: a joint to ground a million times stiffer than the stiffest beam
    /// or spring as drawn, whatever the mesh. (Held directions of the centre of mass would be wrong: the node moves when the
    /// body turns.) Anchors that move have such joints, too.
    /// Returns the anchors that are driven.
    pub fn hold_hinges(&self, structure: &Structure, joints: &mut Vec<Joint>) -> Vec<PlacedAnchor> {
        let along = |beam: &Beam| beam.material.youngs_modulus * beam.width * beam.thickness / beam.length;
        let springs = structure.springs.iter().flat_map(|s| [s.stiffness[0].abs(), s.stiffness[1].abs()]);
        let stiffest = structure.beams.iter().map(along).chain(springs).fold(0.0, f64::max);
        let stiffness = if stiffest > 0.0 { HINGE * stiffest } else { 1e10 };
        let mut held: BTreeMap<usize, Vec<&Support>> = BTreeMap::new();
        for support in &structure.supports {
            let point = self.point(support.node.0);
            let BodyId::Free(k) = point.body else { continue };
            if self.bodies[k].fixed_angle || support.motion.is_some() || !(support.held[0] || support.held[1]) {
                continue;
            }
            // a second joint that holds the same would close a loop of rigid joints
            let before = held.entry(support.node.0).or_default();
            if before.iter().any(|one| holds_all_of(one, support)) {
                continue;
            }
            before.push(support);
            let at = |held: bool| if held { stiffness } else { 0.0 };
            joints.push(Joint {
                a: BodyId::Ground,
                b: point.body,
                frame: self.frame_at(
                    MaterialPoint { body: BodyId::Ground, arm: Vector2::zeros() },
                    point,
                    self.position[support.node.0],
                    Vector2::new(support.angle.cos(), support.angle.sin()),
                ),
                stiffness: Matrix3::from_diagonal(&[at(support.held[0]), at(support.held[1]), 0.0].into()),
                second: Matrix2::zeros(),
                expansion: None,
                rest: 0.0,
                locked: [support.held[0], support.held[1], false],
            });
        }
        self.move_anchors(structure, stiffness, joints)
    }

    /// Anchors that move: joints to ground as stiff as hinges, with the displacement as their rest offset, so that it acts as built-in strain does.
    /// Those of one rigid part share its mean displacement. Driven ones have no offset in their joint, and turn ([`bimorph_domains::driven_anchor`]).
    fn move_anchors(&self, structure: &Structure, stiffness: f64, joints: &mut Vec<Joint>) -> Vec<PlacedAnchor> {
        let ground = MaterialPoint { body: BodyId::Ground, arm: Vector2::zeros() };
        let longest = structure.beams.iter().map(|beam| beam.length).fold(0.0, f64::max);
        let lever = if longest > 0.0 { longest } else { structure.extent() };
        let turning = if lever > 0.0 { stiffness * lever * lever } else { stiffness };
        let mut driven = Vec::new();
        for support in &structure.supports {
            let point = self.point(support.node.0);
            let (Some(motion), BodyId::Free(_)) = (support.motion, point.body) else { continue };
            let node = &structure.nodes[support.node.0];
            let displacement = Vector2::from(motion.at(node.position));
            if may_turn(&motion) {
                driven.push(PlacedAnchor {
                    joint: joints.len(),
                    anchor: DrivenAnchor {
                        node: motion.driven.then(|| node.name.clone()),
                        point,
                        joint: 0,
                        stiffness: [stiffness, stiffness, turning],
                        drawn: [displacement.x, displacement.y, motion.rotation],
                    },
                });
                joints.push(Joint {
                    a: BodyId::Ground,
                    b: point.body,
                    frame: self.frame_at(ground, point, self.position[support.node.0], Vector2::x()),
                    stiffness: Matrix3::from_diagonal(&[stiffness, stiffness, turning].into()),
                    second: Matrix2::zeros(),
                    expansion: None,
                    rest: 0.0,
                    locked: [false; 3],
                });
                continue;
            }
            let axis = displacement.try_normalize(0.0).unwrap_or(Vector2::x());
            joints.push(Joint {
                a: BodyId::Ground,
                b: point.body,
                frame: self.frame_at(ground, point, self.position[support.node.0], axis),
                stiffness: Matrix3::from_diagonal(&[stiffness, stiffness, 0.0].into()),
                second: Matrix2::zeros(),
                expansion: None,
                rest: displacement.norm(),
                locked: [false; 3],
            });
        }
        driven
    }

    /// The finished bodies, about their centres of mass.
    pub fn finish_bodies(&self) -> Vec<Body> {
        self.bodies.iter().map(UnfinishedBody::finish).collect()
    }

    /// Moves a frame's arms from reference points to centres of mass.
    pub fn center(&self, a: BodyId, b: BodyId, frame: &mut JointFrame) {
        for (id, arm) in [(a, &mut frame.arm_a), (b, &mut frame.arm_b)] {
            if let BodyId::Free(k) = id {
                *arm -= self.bodies[k].mass.center();
            }
        }
    }

    /// A point about its body's centre of mass, the body renumbered by `place`.
    pub fn centered(&self, point: MaterialPoint, place: &[usize]) -> MaterialPoint {
        match point.body {
            BodyId::Ground => point,
            BodyId::Free(k) => {
                MaterialPoint { body: BodyId::Free(place[k]), arm: point.arm - self.bodies[k].mass.center() }
            }
        }
    }
}

/// Whether an anchor that moves turns, or may.
fn may_turn(motion: &AnchorMotion) -> bool {
    motion.driven || motion.rotation != 0.0
}

/// Whether one support holds every translation that another one holds.
fn holds_all_of(one: &Support, other: &Support) -> bool {
    let translations = |support: &Support| [support.held[0], support.held[1]];
    translations(one) == [true; 2] || (one.angle == other.angle && translations(one) == translations(other))
}

impl UnfinishedBody {
    fn new(name: BodyName, reference: Vector2<f64>) -> Self {
        let (mass, drag) = (Lump::default(), Lump::default());
        Self { name, reference, mass, drag, held: Vec::new(), fixed_angle: false, anchored: false }
    }

    fn hold(&mut self, held: [bool; 3], angle: f64) {
        let (s, c) = angle.sin_cos();
        if held[0] {
            self.held.push(Vector2::new(c, s));
        }
        if held[1] {
            self.held.push(Vector2::new(-s, c));
        }
        self.fixed_angle |= held[2];
    }

    /// Its mass so far, about the reference point.
    pub(super) fn mass(&self) -> &Lump {
        &self.mass
    }

    /// Its drag so far, likewise.
    pub(super) fn drag(&self) -> &Lump {
        &self.drag
    }

    /// Whether its rotation is an unknown.
    pub(super) fn turns(&self) -> bool {
        !self.fixed_angle
    }

    /// Makes it an anchor that moves, and may turn.
    fn anchor(&mut self, turns: bool) {
        self.anchored = true;
        self.fixed_angle |= !turns;
    }

    /// Calls `see` with the point that a mass or a drag acts on, from the reference point (m); `None` where it resists
    /// the rotation. Points nearer than `same` (m) to each other count as one.
    pub(super) fn lumps_act(&self, same: f64, mut see: impl FnMut(Option<Vector2<f64>>)) {
        for lump in [&self.mass, &self.drag].into_iter().filter(|lump| lump.amount != 0.0 || lump.second != 0.0) {
            let center = lump.center();
            let central = lump.second - lump.amount * center.norm_squared();
            see((central <= lump.amount * same * same).then_some(center));
        }
    }

    /// Takes the rotation out of the unknowns.
    pub(super) fn hold_rotation(&mut self) {
        self.fixed_angle = true;
    }

    fn finish(&self) -> Body {
        let center = self.mass.center();
        let mut drag = Lump::default();
        drag.add(&self.drag, -center, 1.0);
        Body {
            name: self.name.clone(),
            center: self.reference + center,
            mass: self.mass.amount,
            inertia: self.mass.central(),
            drag: Drag { amount: drag.amount, first: drag.first, second: drag.second },
            free: self.projector().map(Box::new),
        }
    }

    /// Projector onto the free directions; none when nothing is held rigidly.
    fn projector(&self) -> Option<Matrix3<f64>> {
        if !self.fixed_angle {
            return None;
        }
        let mut p = Matrix3::from_diagonal(&[1.0, 1.0, 0.0].into());
        let mut basis: Vec<Vector2<f64>> = Vec::new();
        for &n in &self.held {
            let rest = basis.iter().fold(n, |v, b| v - b * b.dot(&n));
            if rest.norm() > 1e-9 {
                basis.push(rest.normalize());
            }
        }
        for n in basis {
            let v = nalgebra::Vector3::new(n.x, n.y, 0.0);
            p -= v * v.transpose();
        }
        Some(p)
    }
}
