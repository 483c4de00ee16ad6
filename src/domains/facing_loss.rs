//! Loss of the contact between facing beams, [`super::contact_loss`] at each point where they touch; and their discrete forces over a step.

use super::approach::Approach;
use super::contact_loss::Loss;
use super::domain::{At, Chord};
use super::facing::Facing;
use super::facing_ends::{self, add_quad};
use crate::multibody::planar::Pose;
use crate::multibody::{BlockMatrix, BodyId, Pattern};
use nalgebra::{Matrix4, SMatrix, Vector4};

/// Two facing beams.
pub(super) struct Pair<'a> {
    /// Approaches of the ends.
    pub(super) ends: &'a [Approach; 2],
    /// Sign of the slope that a positive rotation makes along the beams.
    pub(super) side: f64,
    /// Constants.
    pub(super) facing: &'a Facing,
    /// What an impact loses.
    pub(super) loss: &'a Loss,
}

impl Pair<'_> {
    fn values(&self, at: At<'_>) -> Vector4<f64> {
        facing_ends::values(at.linear, self.ends, self.side, at.q)
    }
}

/// What rates add to the force over z, at rates `zt` of z.
fn first(beams: &Pair<'_>, z: &Vector4<f64>, zt: &Vector4<f64>) -> Vector4<f64> {
    let one = |sum: Vector4<f64>, (n, force, _): (Vector4<f64>, f64, f64)| {
        sum - n * (force * beams.loss.fraction(-n.dot(zt)).0)
    };
    beams.facing.pressed(z).fold(Vector4::zeros(), one)
}

/// See [`super::domain::Domain::add_loss`].
pub(super) fn add(beams: &Pair<'_>, at: At<'_>, rate: &impl Fn(usize) -> Pose, r: &mut [Pose]) {
    if !beams.loss.acts() {
        return;
    }
    let z = beams.values(at);
    if beams.facing.pressed(&z).next().is_some() {
        let zt = facing_ends::rates(at.linear, beams.ends, beams.side, at.q, rate);
        facing_ends::add(at.linear, beams.ends, beams.side, at.q, first(beams, &z, &zt), r);
    }
}

/// See [`super::domain::Domain::add_loss_tangent`].
pub(super) fn add_tangent(
    beams: &Pair<'_>,
    at: At<'_>,
    rate: &impl Fn(usize) -> Pose,
    pattern: &Pattern,
    stiffness: &mut BlockMatrix<f64, 3>,
    damping: &mut BlockMatrix<f64, 3>,
) -> bool {
    if !beams.loss.acts() {
        return false;
    }
    let z = beams.values(at);
    if beams.facing.pressed(&z).next().is_none() {
        return false;
    }
    let zt = facing_ends::rates(at.linear, beams.ends, beams.side, at.q, rate);
    let (mut by_z, mut by_rate) = (Matrix4::zeros(), Matrix4::zeros());
    for (n, force, slope) in beams.facing.pressed(&z) {
        let (added, by_closing) = beams.loss.fraction(-n.dot(&zt));
        by_z -= n * n.transpose() * (slope * added);
        by_rate += n * n.transpose() * (force * by_closing);
    }
    let first = first(beams, &z, &zt);
    let (rows, bend) = facing_ends::rows(at.linear, beams.ends, beams.side, at.q);
    let ids = facing_ends::bodies(beams.ends);
    let mut k: SMatrix<f64, 12, 12> = rows.transpose() * by_z * rows;
    // ∂ż/∂q has the rotations of the four bodies alone; the symmetric part of what it brings
    let mut turning = SMatrix::<f64, 4, 12>::zeros();
    for (i, id) in ids.into_iter().enumerate() {
        k[(3 * i + 2, 3 * i + 2)] += first[2 * (i % 2)] * bend[i];
        if let BodyId::Free(body) = id {
            turning[(2 * (i % 2), 3 * i + 2)] = bend[i] * rate(body).z;
        }
    }
    let brought: SMatrix<f64, 12, 12> = rows.transpose() * by_rate * turning;
    k += (brought + brought.transpose()) * 0.5;
    let c: SMatrix<f64, 12, 12> = rows.transpose() * by_rate * rows;
    add_quad(pattern, &ids, &k, stiffness);
    add_quad(pattern, &ids, &c, damping);
    true
}

/// See [`super::domain::Domain::add_quotient`].
pub(super) fn add_quotient(
    beams: &Pair<'_>,
    chord: &Chord<'_>,
    volts: f64,
    pattern: &Pattern,
    r: &mut [Pose],
    tangent: &mut BlockMatrix<f64, 3>,
) {
    let [start, middle, end] = chord.at;
    let ends = (&beams.values(start), &beams.values(end));
    let (first, second) = beams.facing.quotient(ends, (volts, chord.h), beams.loss);
    let (mut rows, bend) = facing_ends::rows(middle.linear, beams.ends, beams.side, middle.q);
    let ids = facing_ends::bodies(beams.ends);
    for (i, id) in ids.into_iter().enumerate() {
        rows[(2 * (i % 2), 3 * i + 2)] *= chord.sinc(id);
    }
    let force = rows.transpose() * first;
    let mut h: SMatrix<f64, 12, 12> = rows.transpose() * second * rows;
    for (i, id) in ids.into_iter().enumerate() {
        h[(3 * i + 2, 3 * i + 2)] += 0.5 * first[2 * (i % 2)] * bend[i];
        if let BodyId::Free(k) = id {
            r[k] += force.fixed_rows::<3>(3 * i);
        }
    }
    add_quad(pattern, &ids, &h, tangent);
}
