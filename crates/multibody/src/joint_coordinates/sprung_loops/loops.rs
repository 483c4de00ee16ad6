//! Forces of the joints that close loops, eight per vector: the bodies have been placed, and their sines are known.

use super::poses::TreeKinematics;
use crate::Model;
use crate::batch::joint::{LanePlaced, LaneSection};
use crate::batch::{Kernel, LANES, Lane8, LanePose, SimdReal, ZERO_POSE, everywhere, load, store};
use crate::forces::RestStrain;
use crate::planar::{Pose, Vec2};
use crate::section::{NONE, PackedJoint};

/// Up to eight joints. A lane without one lies between ground and ground, and is as soft as nothing.
#[derive(Debug, Clone)]
struct LaneClosures {
    bodies: [[u32; LANES]; 2],
    arms: [Vec2<Lane8>; 2],
    section: LaneSection,
    /// Built-in axial rest offsets (m).
    rest: Lane8,
    /// Lanes that are heated, with group and length.
    expansion: Vec<(usize, usize, f64)>,
}

/// The joints that close loops. Immutable.
#[derive(Debug, Clone)]
pub struct Loops(Vec<LaneClosures>);

impl Loops {
    /// Builds the kernels of `joints` of `model`.
    #[inline]
    pub fn new(model: &Model, joints: &[PackedJoint]) -> Self {
        Self(joints.chunks(LANES).map(|joints| LaneClosures::new(model, joints)).collect())
    }

    /// `r +=` their forces on the bodies.
    #[inline]
    pub fn add_forces(&self, placed: &TreeKinematics, rest: &RestStrain<'_>, r: &mut [Pose]) {
        everywhere(Forces { loops: &self.0, placed, rest, r });
    }
}

impl LaneClosures {
    fn new(model: &Model, joints: &[PackedJoint]) -> Self {
        let (section, arms, rest) = (LaneSection::NONE, [[Lane8::NONE; 2]; 2], Lane8::NONE);
        let bodies = [[NONE; LANES]; 2];
        let mut all = Self { bodies, arms, section, rest, expansion: Vec::new() };
        for (k, joint) in joints.iter().enumerate() {
            let section = model.section(joint);
            (all.bodies[0][k], all.bodies[1][k]) = (joint.place.a, joint.place.b);
            for i in 0..2 {
                (all.arms[0][i].0[k], all.arms[1][i].0[k]) = (joint.arm_a[i], joint.arm_b[i]);
                all.section.axis[i].0[k] = section.axis[i];
            }
            for (to, from) in all.section.stiffness.0.iter_mut().zip(section.stiffness.0) {
                to.0[k] = from;
            }
            for (to, from) in all.section.second.iter_mut().zip(section.second) {
                to.0[k] = from;
            }
            all.rest.0[k] = joint.rest;
            all.expansion.extend(section.expansion.map(|(group, length)| (k, group, length)));
        }
        all
    }
}

struct Forces<'a> {
    loops: &'a [LaneClosures],
    placed: &'a TreeKinematics,
    rest: &'a RestStrain<'a>,
    r: &'a mut [Pose],
}

impl Kernel for Forces<'_> {
    #[inline(always)]
    fn run<W: SimdReal>(self, simd: W::Simd) {
        let Self { loops, placed, rest, r } = self;
        for joints in loops {
            let mut offsets = joints.rest;
            (W::load(simd, &offsets) * rest.built_in).store(&mut offsets);
            for &(k, group, length) in &joints.expansion {
                offsets.0[k] += length * rest.expansion[group];
            }
            let (a, b) = (place::<W>(simd, placed, &joints.bodies[0]), place::<W>(simd, placed, &joints.bodies[1]));
            let section = joints.section.load::<W>(simd);
            let k = section.kinematics([load(simd, &joints.arms[0]), load(simd, &joints.arms[1])], &a, &b);
            let [u, g, p] = k.strain;
            let (force_a, force_b) = k.forces(&section.stiffness.times([u - W::load(simd, &offsets), g, p]));
            add::<W>(force_a, &joints.bodies[0], r);
            add::<W>(force_b, &joints.bodies[1], r);
        }
    }
}

/// Bodies in lanes.
#[inline(always)]
fn place<W: SimdReal>(simd: W::Simd, placed: &TreeKinematics, bodies: &[u32; LANES]) -> LanePlaced<W> {
    let (mut q, mut sin, mut cos) = (ZERO_POSE, Lane8::NONE, Lane8::of(1.0));
    for (k, &body) in bodies.iter().enumerate().filter(|(_, body)| **body != NONE) {
        let at = &placed.at[body as usize];
        (q[0].0[k], q[1].0[k], q[2].0[k]) = (at.x, at.y, at.z);
        [sin.0[k], cos.0[k]] = placed.half(body as usize);
    }
    LanePlaced::turned(load(simd, &q), load(simd, &[sin, cos]))
}

/// Adds forces in lanes to those of their bodies.
#[inline(always)]
fn add<W: SimdReal>(force: LanePose<W>, bodies: &[u32; LANES], r: &mut [Pose]) {
    let mut lanes = ZERO_POSE;
    store(force, &mut lanes);
    for (k, &body) in bodies.iter().enumerate().filter(|(_, body)| **body != NONE) {
        r[body as usize] += Pose::new(lanes[0].0[k], lanes[1].0[k], lanes[2].0[k]);
    }
}
