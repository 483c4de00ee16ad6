//! Mechanisms of any size, as code: models of the scaling tests and benches.
//!
//! A [`Topology`] names no formulation: bodies with centre, mass and inertia, and joints with place and angle. It can be read
//! as rods with flexible joints between them ([`Topology::model`]) or as rods on pins ([`Topology::pinned`]). All are of 2 µm polysilicon
//! (E = 160 GPa, ρ = 2330 kg/m³), cut into rods 10 µm long and 2 µm wide.
//!
//! | generator | what it is | loops left when ground is taken out |
//! |---|---|---|
//! | [`chain`] | a cantilever | none |
//! | [`ladder`] | two rails from ground, a rung at the end of every cell | one a cell, but for the first |
//! | [`arms`] | a hub held by kinked arms from ground | none |
//! | [`bank`] | bimorphs (hot and cold arm from ground, flexure) on a yoke | none |
//! | [`quarter`] | XY quarter stage: two banks push one stage | none |
//! | [`rotary`] | four quarter stages around a rotor | none |
// Each test and bench uses a part of this.
#![allow(dead_code, unreachable_pub)]

use bimorph::equations::loads::Loads;
use bimorph::multibody::forces::RestStrain;
use bimorph::multibody::joint_coordinates::constrained_loops::{AddedInertia, Linkage, Reduction};
use bimorph::multibody::planar::JointFrame;
use bimorph::multibody::{Body, BodyId, BodyName, Drag, Joint, Model};
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

/// Length of a rod (m).
pub const ROD: f64 = 10e-6;
const WIDTH: f64 = 2e-6;
const THICKNESS: f64 = 2e-6;
const MODULUS: f64 = 160e9;
const DENSITY: f64 = 2330.0;
/// Gas drag per mass (1/s).
const DRAG: f64 = 2e4;
/// Half of the kink of an arm (rad): a straight arm on pins is a singular configuration.
const KINK: f64 = 0.15;

/// A rigid body.
#[derive(Debug, Clone, Copy)]
pub struct Rod {
    /// Centre of mass (m).
    pub centre: Vector2<f64>,
    /// Mass (kg).
    pub mass: f64,
    /// Moment of inertia about the centre of mass (kg·m²).
    pub inertia: f64,
}

/// A connection of two bodies at a point.
#[derive(Debug, Clone, Copy)]
pub struct Pin {
    /// Body a; none: ground.
    pub a: Option<u32>,
    /// Body b.
    pub b: u32,
    /// Where (m).
    pub position: Vector2<f64>,
    /// Angle of the x axis (rad).
    pub angle: f64,
}

/// Bodies and joints.
#[derive(Debug, Clone, Default)]
pub struct Topology {
    /// Bodies.
    pub bodies: Vec<Rod>,
    /// Joints.
    pub joints: Vec<Pin>,
}

/// A point on a body or on ground.
#[derive(Debug, Clone, Copy)]
struct End {
    body: Option<u32>,
    at: Vector2<f64>,
}

impl Topology {
    /// Coordinates n: three a body.
    pub fn coordinates(&self) -> usize {
        3 * self.bodies.len()
    }

    /// Independent loops, those through ground included.
    pub fn loops(&self) -> usize {
        self.joints.len() - self.bodies.len()
    }

    /// Constraints m, were every joint a pin: two a joint.
    pub fn pin_constraints(&self) -> usize {
        2 * self.joints.len()
    }

    /// The mechanism with flexible joints: segments of beams, with gas drag.
    pub fn model(&self) -> Model {
        self.lay([false; 3])
    }

    /// The mechanism on pins: every joint leaves the rotation alone free.
    pub fn pinned(&self) -> Model {
        self.lay([true, true, false])
    }

    fn lay(&self, locked: [bool; 3]) -> Model {
        let name: Arc<str> = Arc::from("rod");
        let (area, second) = (WIDTH * THICKNESS, THICKNESS * WIDTH.powi(3) / 12.0);
        let (ea, ei) = (MODULUS * area, MODULUS * second);
        let mut bodies = Vec::with_capacity(self.bodies.len());
        bodies.extend(self.bodies.iter().enumerate().map(|(k, rod)| Body {
            name: BodyName::segment(&name, k),
            center: rod.centre,
            mass: rod.mass,
            inertia: rod.inertia,
            drag: Drag { amount: DRAG * rod.mass, first: Vector2::zeros(), second: DRAG * rod.inertia },
            free: None,
        }));
        let mut joints = Vec::with_capacity(self.joints.len());
        joints.extend(self.joints.iter().map(|pin| {
            let arm =
                |body: Option<u32>| body.map_or(Vector2::zeros(), |k| pin.position - self.bodies[k as usize].centre);
            let id = |body: Option<u32>| body.map_or(BodyId::Ground, |k| BodyId::Free(k as usize));
            Joint {
                a: id(pin.a),
                b: id(Some(pin.b)),
                frame: JointFrame {
                    arm_a: arm(pin.a),
                    arm_b: arm(Some(pin.b)),
                    axis: Vector2::new(pin.angle.cos(), pin.angle.sin()),
                },
                stiffness: Matrix3::from_diagonal(&Vector3::new(ea / ROD, 12.0 * ei / ROD.powi(3), ei / ROD)),
                second: if locked[0] { Matrix2::zeros() } else { Matrix2::new(0.6 / ROD, 0.0, 0.0, -ROD / 12.0) },
                expansion: None,
                rest: 0.0,
                locked,
            }
        }));
        Model::new(bodies, joints, Vec::new(), &[], false).0
    }

    /// A body without joints: a rod's mass times `scale`.
    fn body(&mut self, centre: Vector2<f64>, scale: f64) -> u32 {
        let mass = DENSITY * WIDTH * THICKNESS * ROD * scale;
        let size = ROD * scale.sqrt();
        self.bodies.push(Rod { centre, mass, inertia: mass * size * size / 12.0 });
        (self.bodies.len() - 1) as u32
    }

    fn join(&mut self, a: Option<u32>, b: u32, position: Vector2<f64>, angle: f64) {
        self.joints.push(Pin { a, b, position, angle });
    }

    /// A row of rods from `from`, the k-th at `angle(k)`. Returns where it ends.
    fn rods(&mut self, from: End, count: usize, angle: impl Fn(usize) -> f64) -> End {
        let mut end = from;
        for k in 0..count {
            let angle = angle(k);
            let along = Vector2::new(angle.cos(), angle.sin()) * ROD;
            let rod = self.body(end.at + along * 0.5, 1.0);
            self.join(end.body, rod, end.at, angle);
            end = End { body: Some(rod), at: end.at + along };
        }
        end
    }

    fn on_ground(x: f64, y: f64) -> End {
        End { body: None, at: Vector2::new(x, y) }
    }

    /// `count` bimorphs of arms of `links` rods that push along `angle`, on one rigid yoke with its middle at `at`.
    fn add_bank(&mut self, count: usize, links: usize, at: Vector2<f64>, angle: f64) -> u32 {
        let (along, across) = (Vector2::new(angle.cos(), angle.sin()), Vector2::new(-angle.sin(), angle.cos()));
        let yoke = self.body(at, 20.0);
        let pitch = 30e-6;
        for k in 0..count {
            let foot = at - along * (ROD * (links + 3) as f64) + across * (pitch * k as f64);
            // the tip: a short body across, which both arms end on and the flexure starts from
            let tip = self.body(foot + along * (ROD * links as f64) + across * (0.4 * ROD), 1.0);
            for (arm, kink) in [(0.0, KINK), (0.8 * ROD, -KINK)] {
                let start = End { body: None, at: foot + across * arm };
                let end = self.rods(start, links, |k| angle + if 2 * k < links { kink } else { -kink });
                self.join(end.body, tip, end.at, angle);
            }
            let start = End { body: Some(tip), at: foot + along * (ROD * links as f64) + across * (0.4 * ROD) };
            let end = self.rods(start, 2, |_| angle);
            self.join(end.body, yoke, end.at, angle);
        }
        yoke
    }

    /// A quarter stage at `at`, turned by `angle`. Returns its stage.
    fn add_quarter(&mut self, count: usize, links: usize, at: Vector2<f64>, angle: f64) -> u32 {
        let stage = self.body(at, 100.0);
        for direction in [angle, angle + FRAC_PI_2] {
            let along = Vector2::new(direction.cos(), direction.sin());
            let yoke = self.add_bank(count, links, at - along * (8.0 * ROD), direction);
            let start = End { body: Some(yoke), at: at - along * (6.0 * ROD) };
            let end = self.rods(start, 4, |_| direction);
            self.join(end.body, stage, end.at, direction);
        }
        stage
    }
}

/// A cantilever of `count` rods.
pub fn chain(count: usize) -> Topology {
    let mut t = Topology::default();
    t.rods(Topology::on_ground(0.0, 0.0), count, |_| 0.0);
    t
}

/// Two rails of `links` rods a cell with a rung of `links` rods at the end of each of `cells` cells.
pub fn ladder(cells: usize, links: usize) -> Topology {
    let mut t = Topology::default();
    let height = ROD * links as f64;
    let mut rails = [Topology::on_ground(0.0, 0.0), Topology::on_ground(0.0, height)];
    for _ in 0..cells {
        rails = rails.map(|rail| t.rods(rail, links, |_| 0.0));
        let rung = t.rods(rails[0], links, |_| FRAC_PI_2);
        if let (Some(a), Some(b)) = (rung.body, rails[1].body) {
            t.join(Some(a), b, rung.at, FRAC_PI_2);
        }
    }
    t
}

/// A hub held by `count` kinked arms of `links` rods from ground.
pub fn arms(count: usize, links: usize) -> Topology {
    bent_arms(count, links, KINK)
}

/// The same with straight arms, as they are drawn.
pub fn straight_arms(count: usize, links: usize) -> Topology {
    bent_arms(count, links, 0.0)
}

fn bent_arms(count: usize, links: usize, kink: f64) -> Topology {
    let mut t = Topology::default();
    let hub = t.body(Vector2::zeros(), 20.0);
    for k in 0..count {
        // arms come from both sides in turn; the whole is turned, since along the axes errors hide
        let angle = 0.6435 + if k % 2 == 0 { 0.0 } else { std::f64::consts::PI };
        let (along, across) = (Vector2::new(angle.cos(), angle.sin()), Vector2::new(-angle.sin(), angle.cos()));
        let foot = -along * (ROD * (links + 1) as f64) + across * (10e-6 * (k / 2) as f64);
        let end = t.rods(End { body: None, at: foot }, links, |k| angle + if 2 * k < links { kink } else { -kink });
        t.join(end.body, hub, end.at, angle);
    }
    t
}

/// `count` bimorphs with arms of `links` rods on a yoke.
pub fn bank(count: usize, links: usize) -> Topology {
    let mut t = Topology::default();
    t.add_bank(count, links, Vector2::zeros(), 0.0);
    t
}

/// A stage with one bank along x and one along y, `count` bimorphs each.
pub fn quarter(count: usize, links: usize) -> Topology {
    let mut t = Topology::default();
    t.add_quarter(count, links, Vector2::zeros(), 0.0);
    t
}

/// Four quarter stages that turn a rotor.
pub fn rotary(count: usize, links: usize) -> Topology {
    let mut t = Topology::default();
    let rotor = t.body(Vector2::zeros(), 400.0);
    for k in 0..4 {
        let angle = FRAC_PI_2 * f64::from(k);
        let (along, across) = (Vector2::new(angle.cos(), angle.sin()), Vector2::new(-angle.sin(), angle.cos()));
        let at = along * (12.0 * ROD) + across * (12.0 * ROD);
        let stage = t.add_quarter(count, links, at, angle);
        let end = t.rods(End { body: Some(stage), at: at - along * ROD }, 3, |_| angle + std::f64::consts::PI);
        t.join(end.body, rotor, end.at, angle);
    }
    t
}

/// The topologies by name.
pub const NAMES: [&str; 6] = ["chain", "ladder", "arms", "bank", "quarter", "rotary"];

/// Rods in an arm, a rail's cell or a rung.
pub const LINKS: usize = 4;

/// Bodies that one more unit (rod, cell, arm, bimorph of each bank) brings.
pub fn bodies_per_unit(name: &str) -> usize {
    let bimorph = 2 * LINKS + 3;
    match name {
        "chain" => 1,
        "ladder" => 3 * LINKS,
        "arms" => LINKS,
        "bank" => bimorph,
        "quarter" => 2 * bimorph,
        _ => 8 * bimorph,
    }
}

/// The named topology of `units` units.
pub fn named(name: &str, units: usize) -> Topology {
    match name {
        "chain" => chain(units),
        "ladder" => ladder(units, LINKS),
        "arms" => arms(units, LINKS),
        "bank" => bank(units, LINKS),
        "quarter" => quarter(units, LINKS),
        _ => rotary(units, LINKS),
    }
}

/// The named topology with about `coordinates` coordinates.
pub fn sized(name: &str, coordinates: usize) -> Topology {
    named(name, (coordinates / (3 * bodies_per_unit(name))).max(1))
}

/// Springs of the joints, and a force on each body.
#[derive(Debug)]
pub struct Springs<'a>(pub &'a Linkage);

impl Loads for Springs<'_> {
    fn add(&mut self, _: f64, q: &[f64], _: &[f64], reduction: &mut Reduction<f64>) {
        reduction.force.fill([1e-9, -1e-8, 0.0]);
        reduction.add_elastic(self.0, q, &RestStrain { expansion: &[], built_in: 0.0 });
    }

    fn stiffen(&mut self, reduction: &Reduction<f64>, (beta, _): (f64, f64), added: &mut AddedInertia) {
        reduction.add_stiffness(self.0, beta, added);
    }
}
