//! Elastic forces, tangent, damping and inertia over lanes: [`crate::multibody::forces`].

use super::joint::{LaneKinematics, LanePair, LanePlaced, kinematics};
use super::model::{LaneJoint, LaneModel, Shared};
use super::{LaneMatrix, LanePose, Lanes, Real, add, times, zero};
use crate::multibody::BodyId;
use crate::multibody::section::{NONE, Place};

/// What sets the axial rest offsets, or the change of it.
#[derive(Debug, Clone, Copy)]
pub struct LaneRest<'a, const N: usize> {
    /// Free strain of each group of joints [1].
    pub expansion: &'a [Lanes<N>],
    /// Share of the built-in offsets that acts [1].
    pub built_in: Lanes<N>,
}

/// Puts every body where `q` says; ground stays behind the last.
#[inline(always)]
pub fn place<const N: usize>(q: &[LanePose<N>], placed: &mut [LanePlaced<N>]) {
    for (placed, q) in placed.iter_mut().zip(q) {
        placed.put(q);
    }
}

/// Kinematics of a joint.
#[inline(always)]
fn strained<const N: usize>(joint: &LaneJoint<N>, shared: &Shared<N>, placed: &[LanePlaced<N>]) -> LaneKinematics<N> {
    // ground is the largest index, and stands last
    let at = |body: u32| &placed[(body as usize).min(placed.len() - 1)];
    kinematics(&shared.section, (&joint.arm_a, &joint.arm_b), at(joint.place.a), at(joint.place.b))
}

#[inline(always)]
fn offset<const N: usize>(joint: &LaneJoint<N>, shared: &Shared<N>, rest: &LaneRest<'_, N>) -> Lanes<N> {
    let heat = shared.expansion.map_or(Lanes::ZERO, |(group, length)| length * rest.expansion[group]);
    joint.rest * rest.built_in + heat
}

#[inline(always)]
fn stress<const N: usize>(
    joint: &LaneJoint<N>,
    shared: &Shared<N>,
    k: &LaneKinematics<N>,
    rest: &LaneRest<'_, N>,
) -> LanePose<N> {
    shared.section.stress(&[k.strain[0] - offset(joint, shared, rest), k.strain[1], k.strain[2]])
}

/// `r +=` the elastic forces of bodies at `q`, where they have been placed, from the last joint to the first.
#[inline(always)]
pub fn add_elastic_backwards<const N: usize>(
    model: &LaneModel<N>,
    (q, placed): (&[LanePose<N>], &[LanePlaced<N>]),
    rest: &LaneRest<'_, N>,
    r: &mut [LanePose<N>],
) {
    for joint in model.joints.iter().rev() {
        let shared = &model.sections[joint.section as usize];
        let k = strained(joint, shared, placed);
        scatter(joint.place, &k.forces(&stress(joint, shared, &k, rest)), r);
    }
    add_couplings(model, q, r);
}

/// `tangent +=` that of the elastic forces, and `r +=` the forces.
#[inline(always)]
pub fn add_tangent<const N: usize>(
    model: &LaneModel<N>,
    (q, placed): (&[LanePose<N>], &[LanePlaced<N>]),
    rest: &LaneRest<'_, N>,
    tangent: &mut LaneMatrix<N>,
    r: &mut [LanePose<N>],
) {
    for joint in &model.joints {
        let shared = &model.sections[joint.section as usize];
        let k = strained(joint, shared, placed);
        let stress = stress(joint, shared, &k, rest);
        scatter(joint.place, &k.forces(&stress), r);
        add_pair(joint.place, tangent, &k.tangent(&shared.section, &stress));
    }
    add_couplings(model, q, r);
    add_coupling_tangent(model, tangent);
}

/// `r +=` the forces that a change of the rest offsets brings; lanes without a change stay as they are.
#[inline(always)]
pub fn add_rest_change<const N: usize>(
    model: &LaneModel<N>,
    placed: &[LanePlaced<N>],
    change: &LaneRest<'_, N>,
    r: &mut [LanePose<N>],
) {
    for joint in &model.joints {
        let shared = &model.sections[joint.section as usize];
        let offset = offset(joint, shared, change);
        let acts = offset.0.map(|x| x != 0.0);
        if acts.iter().any(|acts| *acts) {
            let k = strained(joint, shared, placed);
            let (a, b) = k.forces(&shared.section.stress(&[-offset, Lanes::ZERO, Lanes::ZERO]));
            for (body, force) in [(joint.place.a, a), (joint.place.b, b)] {
                if body != NONE {
                    for (r, force) in r[body as usize].iter_mut().zip(force) {
                        for lane in 0..N {
                            r.0[lane] = if acts[lane] { r.0[lane] + force.0[lane] } else { r.0[lane] };
                        }
                    }
                }
            }
        }
    }
}

/// `r +=` the forces of dampers, with the rate of each body from `v`.
#[inline(always)]
pub fn add_dampers<const N: usize>(model: &LaneModel<N>, v: impl Fn(usize) -> LanePose<N>, r: &mut [LanePose<N>]) {
    let rate = |id: BodyId| if let BodyId::Free(k) = id { v(k) } else { zero() };
    for damper in &model.dampers {
        let (va, vb) = (rate(damper.bodies.0), rate(damper.bodies.1));
        let pair = [va[0], va[1], va[2], vb[0], vb[1], vb[2]];
        let force = |i: usize| {
            let row = &damper.matrix[i];
            (1..6).fold(row[0] * pair[0], |sum, j| row[j] * pair[j] + sum)
        };
        for (id, from) in [(damper.bodies.0, 0), (damper.bodies.1, 3)] {
            if let BodyId::Free(k) = id {
                add(&mut r[k], &[force(from), force(from + 1), force(from + 2)]);
            }
        }
    }
}

/// `matrix += m·M + c·C`.
#[inline(always)]
pub fn add_inertia<const N: usize>(model: &LaneModel<N>, m: Lanes<N>, c: Lanes<N>, matrix: &mut LaneMatrix<N>) {
    for (block, body) in matrix.diagonal.iter_mut().zip(&model.bodies) {
        let first = [body.first[0] * c, body.first[1] * c];
        let translation = m * body.mass[0] + c * body.drag;
        block[0][0] += translation;
        block[1][1] += translation;
        block[2][2] += m * body.mass[2] + c * body.second;
        for (i, lever) in [(0, -first[1]), (1, first[0])] {
            block[2][i] += lever;
            block[i][2] += lever;
        }
    }
    for damper in &model.dampers {
        let at = |i: usize, j: usize| damper.matrix[i][j] * c;
        let Place { a, b, block } = damper.place;
        for (body, from) in [(a, 0), (b, 3)] {
            if body != NONE {
                add_corner(&mut matrix.diagonal[body as usize], |i, j| at(from + i, from + j));
            }
        }
        if block != NONE {
            let below = &mut matrix.below[block as usize];
            if a > b {
                add_corner(below, |i, j| at(i, 3 + j));
            } else {
                add_corner(below, |i, j| at(3 + i, j));
            }
        }
    }
}

/// Removes the held directions from a vector.
#[inline(always)]
pub fn project<const N: usize>(model: &LaneModel<N>, x: &mut [LanePose<N>]) {
    if model.holds {
        for (x, held) in x.iter_mut().zip(&model.held) {
            if let Some((p, _)) = held {
                *x = times(p, x);
            }
        }
    }
}

#[inline(always)]
fn add_corner<const N: usize>(block: &mut super::LaneBlock<N>, entry: impl Fn(usize, usize) -> Lanes<N>) {
    for (j, column) in block.iter_mut().enumerate() {
        for (i, to) in column.iter_mut().enumerate() {
            *to += entry(i, j);
        }
    }
}

#[inline(always)]
fn scatter<const N: usize>(place: Place, (a, b): &(LanePose<N>, LanePose<N>), r: &mut [LanePose<N>]) {
    if place.a != NONE {
        add(&mut r[place.a as usize], a);
    }
    if place.b != NONE {
        add(&mut r[place.b as usize], b);
    }
}

#[inline(always)]
fn add_pair<const N: usize>(place: Place, matrix: &mut LaneMatrix<N>, h: &LanePair<N>) {
    if place.a != NONE {
        h.add_aa(&mut matrix.diagonal[place.a as usize]);
    }
    if place.b != NONE {
        h.add_bb(&mut matrix.diagonal[place.b as usize]);
    }
    if place.block != NONE {
        h.add_ab(&mut matrix.below[place.block as usize], place.a < place.b);
    }
}

#[inline(always)]
fn turn_between<const N: usize>(q: &[LanePose<N>], (a, b): (BodyId, BodyId)) -> Lanes<N> {
    let at = |id: BodyId| if let BodyId::Free(k) = id { q[k][2] } else { Lanes::ZERO };
    at(b) - at(a)
}

#[inline(always)]
fn add_couplings<const N: usize>(model: &LaneModel<N>, q: &[LanePose<N>], r: &mut [LanePose<N>]) {
    for coupling in &model.couplings {
        let (first, second) = (turn_between(q, coupling.first), turn_between(q, coupling.second));
        for ((a, b), moment) in [(coupling.first, second), (coupling.second, first)] {
            for (id, side) in [(a, -coupling.stiffness), (b, coupling.stiffness)] {
                if let BodyId::Free(k) = id {
                    r[k][2] += side * moment;
                }
            }
        }
    }
}

#[inline(always)]
fn add_coupling_tangent<const N: usize>(model: &LaneModel<N>, tangent: &mut LaneMatrix<N>) {
    for coupling in &model.couplings {
        let (first, second) = (coupling.first, coupling.second);
        for (i, row) in [(first.0, -coupling.stiffness), (first.1, coupling.stiffness)] {
            for (j, side) in [(second.0, -1.0), (second.1, 1.0)] {
                let (BodyId::Free(i), BodyId::Free(j)) = (i, j) else { continue };
                if i == j {
                    tangent.diagonal[i][2][2] += Lanes::splat(2.0) * row * Lanes::splat(side);
                } else if let Some(block) = model.pattern.block(i.max(j), i.min(j)) {
                    tangent.below[block][2][2] += row * Lanes::splat(side);
                }
            }
        }
    }
}
