//! Elastic forces, tangent, damping and inertia over lanes: [`crate::forces`].

use super::joint::{LanePlaced, LaneSection};
use super::model::{LaneJoint, LaneModel, SharedSections};
use super::{Lane8, LaneBlock, LaneMatrix, LanePose, SimdReal, add, load, load_block, store, times};
use crate::BodyId;
use crate::planar::{JointKinematics, PairTangent};
use crate::section::{NONE, PairSlot};

/// Axial rest offsets, or their change.
#[derive(Debug, Clone, Copy)]
pub struct LaneRestStrain<'a> {
    /// Free strain of each group of joints (1).
    pub expansion: &'a [Lane8],
    /// Fraction of the built-in offsets that acts, the same in every lane (1).
    pub built_in: f64,
}

/// Puts every body where `q` says; ground stays behind the last.
#[inline(always)]
pub fn place<W: SimdReal>(simd: W::Simd, q: &[LanePose], placed: &mut [LanePlaced]) {
    for (placed, q) in placed.iter_mut().zip(q) {
        placed.put::<W>(simd, q);
    }
}

/// A joint at work: what it shares with others, its kinematics, and its axial rest offset.
struct StrainedJoint<W> {
    section: LaneSection<W>,
    k: JointKinematics<W>,
    offset: W,
}

impl<W: SimdReal> StrainedJoint<W> {
    #[inline(always)]
    fn new(
        simd: W::Simd,
        joint: &LaneJoint,
        shared: &SharedSections,
        placed: &[LanePlaced],
        rest: &LaneRestStrain<'_>,
    ) -> Self {
        // ground is the largest index, and stands last
        let at = |body: u32| placed[(body as usize).min(placed.len() - 1)].load::<W>(simd);
        let section = shared.section.load::<W>(simd);
        let arms = [load(simd, &joint.arm_a), load(simd, &joint.arm_b)];
        let k = section.kinematics(arms, &at(joint.place.a), &at(joint.place.b));
        Self { section, k, offset: offset(simd, joint, shared, rest) }
    }

    #[inline(always)]
    fn stress(&self) -> LanePose<W> {
        let [u, g, p] = self.k.strain;
        self.section.stiffness.times([u - self.offset, g, p])
    }
}

#[inline(always)]
fn offset<W: SimdReal>(simd: W::Simd, joint: &LaneJoint, shared: &SharedSections, rest: &LaneRestStrain<'_>) -> W {
    let of = |x: &Lane8| W::load(simd, x);
    let heat = match &shared.expansion {
        Some((group, length)) => of(length) * of(&rest.expansion[*group]),
        None => W::splat(simd, 0.0),
    };
    of(&joint.rest) * rest.built_in + heat
}

/// `r +=` the elastic forces of bodies at `q`, where they have been placed, from the last joint to the first.
#[inline(always)]
pub fn add_elastic_backwards<W: SimdReal>(
    simd: W::Simd,
    model: &LaneModel,
    (q, placed): (&[LanePose], &[LanePlaced]),
    rest: &LaneRestStrain<'_>,
    r: &mut [LanePose],
) {
    for joint in model.joints.iter().rev() {
        let strained = StrainedJoint::<W>::new(simd, joint, &model.sections[joint.section as usize], placed, rest);
        scatter(simd, joint.place, &strained.k.forces(&strained.stress()), r);
    }
    add_couplings::<W>(simd, model, q, r);
}

/// `tangent +=` that of the elastic forces, and `r +=` the forces.
#[inline(always)]
pub fn add_tangent<W: SimdReal>(
    simd: W::Simd,
    model: &LaneModel,
    (q, placed): (&[LanePose], &[LanePlaced]),
    rest: &LaneRestStrain<'_>,
    tangent: &mut LaneMatrix,
    r: &mut [LanePose],
) {
    for joint in &model.joints {
        let strained = StrainedJoint::<W>::new(simd, joint, &model.sections[joint.section as usize], placed, rest);
        let stress = strained.stress();
        scatter(simd, joint.place, &strained.k.forces(&stress), r);
        add_pair(simd, joint.place, tangent, &strained.section.tangent(&strained.k, &stress));
    }
    add_couplings::<W>(simd, model, q, r);
    add_coupling_tangent(model, tangent);
}

/// `r +=` the forces that a change of the rest offsets brings; lanes without a change stay as they are.
#[inline(always)]
pub fn add_rest_change<W: SimdReal>(
    simd: W::Simd,
    model: &LaneModel,
    placed: &[LanePlaced],
    change: &LaneRestStrain<'_>,
    r: &mut [LanePose],
) {
    for joint in &model.joints {
        let shared = &model.sections[joint.section as usize];
        let offset = offset::<W>(simd, joint, shared, change);
        let mut acts = Lane8::NONE;
        offset.store(&mut acts);
        if acts.0.iter().all(|x| *x == 0.0) {
            continue;
        }
        let strained = StrainedJoint::<W>::new(simd, joint, shared, placed, change);
        let none = W::splat(simd, 0.0);
        let (a, b) = strained.k.forces(&strained.section.stiffness.times([-offset, none, none]));
        for (body, force) in [(joint.place.a, a), (joint.place.b, b)] {
            if body != NONE {
                for (r, force) in r[body as usize].iter_mut().zip(force) {
                    let before = W::load(simd, r);
                    offset.if_zero(before, before + force).store(r);
                }
            }
        }
    }
}

/// `r +=` the forces of dampers at the rates `v`.
#[inline(always)]
pub fn add_dampers<W: SimdReal>(simd: W::Simd, model: &LaneModel, v: &[LanePose], r: &mut [LanePose]) {
    for damper in &model.dampers {
        let mut pair = [W::splat(simd, 0.0); 6];
        for (id, from) in [(damper.bodies.0, 0), (damper.bodies.1, 3)] {
            if let BodyId::Free(k) = id {
                for i in 0..3 {
                    pair[from + i] = W::load(simd, &v[k][i]);
                }
            }
        }
        for (id, from) in [(damper.bodies.0, 0), (damper.bodies.1, 3)] {
            let BodyId::Free(k) = id else { continue };
            for i in 0..3 {
                let row = load::<W, 6>(simd, &damper.matrix[from + i]);
                let mut force = row[0] * pair[0];
                for j in 1..6 {
                    force = row[j] * pair[j] + force;
                }
                (W::load(simd, &r[k][i]) + force).store(&mut r[k][i]);
            }
        }
    }
}

/// `matrix += m·M + c·C`.
#[inline(always)]
pub fn add_inertia<W: SimdReal>(simd: W::Simd, model: &LaneModel, m: W, c: W, matrix: &mut LaneMatrix) {
    let plus = |to: &mut Lane8, x: W| (W::load(simd, to) + x).store(to);
    for (block, body) in matrix.diagonal.iter_mut().zip(&model.bodies) {
        let body = body.load::<W>(simd);
        let first = [body.first[0] * c, body.first[1] * c];
        let translation = m * body.mass[0] + c * body.drag;
        plus(&mut block[0][0], translation);
        plus(&mut block[1][1], translation);
        plus(&mut block[2][2], m * body.mass[2] + c * body.second);
        for (i, lever) in [(0, -first[1]), (1, first[0])] {
            plus(&mut block[2][i], lever);
            plus(&mut block[i][2], lever);
        }
    }
    for damper in &model.dampers {
        let at = |i: usize, j: usize| W::load(simd, &damper.matrix[i][j]) * c;
        let PairSlot { a, b, block } = damper.place;
        for (body, from) in [(a, 0), (b, 3)] {
            if body != NONE {
                add_corner(simd, &mut matrix.diagonal[body as usize], |i, j| at(from + i, from + j));
            }
        }
        if block != NONE {
            let below = &mut matrix.below[block as usize];
            if a > b {
                add_corner(simd, below, |i, j| at(i, 3 + j));
            } else {
                add_corner(simd, below, |i, j| at(3 + i, j));
            }
        }
    }
}

/// Removes the held directions from a vector.
#[inline(always)]
pub fn project<W: SimdReal>(simd: W::Simd, model: &LaneModel, x: &mut [LanePose]) {
    if model.holds {
        for (x, held) in x.iter_mut().zip(&model.held) {
            if let Some((p, _)) = held {
                store(times(&load_block::<W>(simd, p), &load(simd, x)), x);
            }
        }
    }
}

#[inline(always)]
fn add_corner<W: SimdReal>(simd: W::Simd, block: &mut LaneBlock, entry: impl Fn(usize, usize) -> W) {
    for (j, column) in block.iter_mut().enumerate() {
        add(simd, column, &[entry(0, j), entry(1, j), entry(2, j)]);
    }
}

#[inline(always)]
fn scatter<W: SimdReal>(simd: W::Simd, place: PairSlot, (a, b): &(LanePose<W>, LanePose<W>), r: &mut [LanePose]) {
    if place.a != NONE {
        add(simd, &mut r[place.a as usize], a);
    }
    if place.b != NONE {
        add(simd, &mut r[place.b as usize], b);
    }
}

/// `block += more`, columns.
#[inline(always)]
fn add_block<W: SimdReal>(simd: W::Simd, block: &mut LaneBlock, more: LaneBlock<W>) {
    for (column, more) in block.iter_mut().zip(&more) {
        add(simd, column, more);
    }
}

#[inline(always)]
fn add_pair<W: SimdReal>(simd: W::Simd, place: PairSlot, matrix: &mut LaneMatrix, h: &PairTangent<W>) {
    if place.a != NONE {
        add_block(simd, &mut matrix.diagonal[place.a as usize], h.aa());
    }
    if place.b != NONE {
        add_block(simd, &mut matrix.diagonal[place.b as usize], h.bb());
    }
    if place.block != NONE {
        let block = if place.a < place.b { h.ba() } else { h.ab() };
        add_block(simd, &mut matrix.below[place.block as usize], block);
    }
}

#[inline(always)]
fn add_couplings<W: SimdReal>(simd: W::Simd, model: &LaneModel, q: &[LanePose], r: &mut [LanePose]) {
    let at = |id: BodyId| if let BodyId::Free(k) = id { W::load(simd, &q[k][2]) } else { W::splat(simd, 0.0) };
    for coupling in &model.couplings {
        let between = |(a, b): (BodyId, BodyId)| at(b) - at(a);
        let (first, second) = (between(coupling.first), between(coupling.second));
        let stiffness = W::load(simd, &coupling.stiffness);
        for ((a, b), moment) in [(coupling.first, second), (coupling.second, first)] {
            for (id, side) in [(a, -stiffness), (b, stiffness)] {
                if let BodyId::Free(k) = id {
                    (W::load(simd, &r[k][2]) + side * moment).store(&mut r[k][2]);
                }
            }
        }
    }
}

/// Rare, and few: lane by lane.
#[inline(always)]
fn add_coupling_tangent(model: &LaneModel, tangent: &mut LaneMatrix) {
    for coupling in &model.couplings {
        let (first, second) = (coupling.first, coupling.second);
        for (i, sign) in [(first.0, -1.0), (first.1, 1.0)] {
            for (j, side) in [(second.0, -1.0), (second.1, 1.0)] {
                let (BodyId::Free(i), BodyId::Free(j)) = (i, j) else { continue };
                let (to, twice) = if i == j {
                    (&mut tangent.diagonal[i][2][2], 2.0)
                } else if let Some(block) = model.pattern.block(i.max(j), i.min(j)) {
                    (&mut tangent.below[block][2][2], 1.0)
                } else {
                    continue;
                };
                for (to, stiffness) in to.0.iter_mut().zip(coupling.stiffness.0) {
                    *to += twice * (sign * stiffness) * side;
                }
            }
        }
    }
}
