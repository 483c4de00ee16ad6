//! Elastic beams as rigid bodies at nodes with joints between them: the compliant formulation, built by hand.

use bimorph::domains::drive::Electrics;
use bimorph::domains::{DeadLoad, MaterialPoint, Ramp, System};
use bimorph::multibody::planar::JointFrame;
use bimorph::multibody::{Body, BodyId, Joint, Model};
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use std::sync::Arc;

/// Young's modulus (Pa), density (kg/m³) and thickness (m) of polysilicon.
pub(crate) const MODULUS: f64 = 165e9;
pub(crate) const DENSITY: f64 = 2300.0;
pub(crate) const THICK: f64 = 2e-6;

/// Nodes and beams in the making. `axial` multiplies the stiffness of every joint along its beam.
#[derive(Debug, Clone)]
pub(crate) struct Frame {
    bodies: Vec<Body>,
    joints: Vec<Joint>,
    axial: f64,
}

impl Frame {
    /// Nothing yet.
    pub(crate) fn new(axial: f64) -> Self {
        Self { bodies: Vec::new(), joints: Vec::new(), axial }
    }

    /// A node at `at` (m), without mass until beams bring some.
    pub(crate) fn node(&mut self, at: [f64; 2]) -> BodyId {
        self.bodies.push(Body {
            name: format!("n{}", self.bodies.len()).into(),
            center: at.into(),
            mass: 0.0,
            inertia: 0.0,
            drag: Default::default(),
            free: None,
        });
        BodyId::Free(self.bodies.len() - 1)
    }

    /// A beam of `count` segments, `width` wide (m), from body `a` at `from` to body `b` at `to`.
    pub(crate) fn beam(
        &mut self,
        (a, from): (BodyId, [f64; 2]),
        (b, to): (BodyId, [f64; 2]),
        width: f64,
        count: usize,
    ) {
        let (from, to) = (Vector2::from(from), Vector2::from(to));
        let axis = (to - from).normalize();
        let h = (to - from).norm() / count as f64;
        let mut before = (a, from);
        for k in 1..=count {
            let at = from + axis * (h * k as f64);
            let next = if k == count { (b, to) } else { (self.node(at.into()), at) };
            self.segment(before, next, axis, h, width);
            before = next;
        }
    }

    fn segment(
        &mut self,
        a: (BodyId, Vector2<f64>),
        b: (BodyId, Vector2<f64>),
        axis: Vector2<f64>,
        h: f64,
        width: f64,
    ) {
        let area = width * THICK;
        let bending = MODULUS * THICK * width.powi(3) / 12.0;
        let middle = 0.5 * (a.1 + b.1);
        for id in [a.0, b.0] {
            if let BodyId::Free(k) = id {
                // half of the segment at each of its nodes; a rod of half its length turns with it
                let mass = 0.5 * DENSITY * area * h;
                self.bodies[k].mass += mass;
                self.bodies[k].inertia += mass * (0.25 * h * h + width * width) / 12.0;
            }
        }
        let arm = |id: BodyId| match id {
            BodyId::Ground => Vector2::zeros(),
            BodyId::Free(k) => middle - self.bodies[k].center,
        };
        self.joints.push(Joint {
            a: a.0,
            b: b.0,
            frame: JointFrame { arm_a: arm(a.0), arm_b: arm(b.0), axis },
            stiffness: Matrix3::from_diagonal(&Vector3::new(
                self.axial * MODULUS * area / h,
                12.0 * bending / h.powi(3),
                bending / h,
            )),
            second: Matrix2::new(0.6 / h, 0.0, 0.0, -h / 12.0),
            expansion: None,
            rest: 0.0,
            locked: [false; 3],
        });
    }

    /// The system with dead loads (node, force (N)); also says where each node went.
    pub(crate) fn system(self, loads: &[(BodyId, [f64; 2])]) -> (System, Vec<usize>) {
        let (model, place) = Model::new(self.bodies, self.joints, Vec::new(), &[], false);
        let at = |id: BodyId| match id {
            BodyId::Free(k) => MaterialPoint { body: BodyId::Free(place[k]), arm: Vector2::zeros() },
            BodyId::Ground => MaterialPoint { body: BodyId::Ground, arm: Vector2::zeros() },
        };
        let loads = loads.iter().map(|&(id, f)| DeadLoad { point: at(id), force: f.into(), moment: 0.0 }).collect();
        let electrics = Electrics { names: Vec::new(), ..Electrics::default() };
        (System { loads, electrics: Arc::new(electrics), ..System::of_model(model, 1e-6) }, place)
    }
}

/// A time of `dt` (s) in which nothing electrical happens.
pub(crate) fn quiet(system: &System, dt: f64) -> Ramp<'_> {
    Ramp::new(&system.electrics, &[], &[], &[], dt)
}

/// A cantilever of 200 µm × 2 µm along +x with `count` segments; its tip.
pub(crate) fn cantilever(count: usize, axial: f64) -> (Frame, BodyId) {
    let mut f = Frame::new(axial);
    let tip = f.node([200e-6, 0.0]);
    f.beam((BodyId::Ground, [0.0, 0.0]), (tip, [200e-6, 0.0]), 2e-6, count);
    (f, tip)
}

/// A bank of `bimorphs` with elastic beams of `count` segments, pushed sideways; the first yoke's node.
pub(crate) fn bank(bimorphs: usize, count: usize) -> (Frame, BodyId) {
    let mut f = Frame::new(1.0);
    let (length, gap, pitch) = (200e-6, 10e-6, 60e-6);
    let mut yoke: Option<(BodyId, [f64; 2])> = None;
    let mut first = BodyId::Ground;
    for k in 0..bimorphs {
        let y = pitch * k as f64;
        let (t, c, m, l) = ([length, y], [length, y - gap], [0.2 * length, y - gap], [length + 20e-6, y]);
        let (tip, corner, waist, link) = (f.node(t), f.node(c), f.node(m), f.node(l));
        f.beam((BodyId::Ground, [0.0, y]), (tip, t), 2e-6, count);
        f.beam((tip, t), (corner, c), 6e-6, 1);
        f.beam((corner, c), (waist, m), 8e-6, 2);
        f.beam((waist, m), (BodyId::Ground, [0.0, y - gap]), 2e-6, 2);
        f.beam((tip, t), (link, l), 3e-6, 1);
        match yoke {
            Some((before, at)) => f.beam((before, at), (link, l), 10e-6, 1),
            None => first = link,
        }
        yoke = Some((link, l));
    }
    (f, first)
}
