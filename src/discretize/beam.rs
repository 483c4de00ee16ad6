//! The E4 segment: a beam as rigid bodies at N + 1 nodes and N joints at the middle of the segments.
//!
//! Joint of a segment of length h (axial u, shear g, rotation p): stiffness EA/h, 12EI/h³, EI/h, and the second-order axial
//! strain e_u = u − h·p²/12 + 0.6·g²/h. Static deflections under end loads are those of the Euler–Bernoulli beam, for any N.
//!
//! Masses, in units of ρA·h: inner bodies 1; the end bodies 25/48 with a first moment of 5/48·h towards the inside and a
//! second moment of 1/48·h² about the node; their neighbours 47/48 (46/48 when N = 2); for N = 1 two halves at the Gauss
//! points. Mass, first and second moment of the beam are exact, and the frequency error is (kh)⁴/1440.
//!
//! At junctions the ends are [`End`]s: the beam proper runs from one offset to the other, the rods in between belong to the
//! bodies of the nodes, and the springs' compliance is added to that of the first and the last joint.

use super::junction::Junctions;
use super::junction_springs::End;
use super::rigid::{Assembly, Lump};
use crate::gaps::Point;
use crate::multibody::{BodyId, BodyName, Joint};
use crate::structure::Beam;
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};
use std::sync::Arc;

/// Lays a beam: adds its inner bodies, masses and joints. Returns the points along it, ends included.
pub fn lay(
    beam: &Beam,
    segments: usize,
    heater: Option<usize>,
    undamped: bool,
    (junctions, ends): (Junctions, &[End; 2]),
    rigid: &mut Assembly,
    joints: &mut Vec<Joint>,
) -> Vec<Point> {
    let along = Vector2::new(beam.angle.cos(), beam.angle.sin());
    let drawn = [rigid.point(beam.a.0), rigid.point(beam.b.0)];
    let shift = [along * ends[0].offset, along * -ends[1].offset];
    let (start, end) = (rigid.position(beam.a.0) + shift[0], rigid.position(beam.b.0) + shift[1]);
    let n = segments as f64;
    let mut points = vec![drawn[0].beyond(shift[0])];
    let name = Arc::from(beam.name.as_str());
    for k in 1..segments {
        let position = start + (end - start) * (k as f64 / n);
        points.push(rigid.add_segment(BodyName::segment(&name, k), position));
    }
    points.push(drawn[1].beyond(shift[1]));
    let length = beam.length - ends[0].offset - ends[1].offset;
    add_masses(beam, length, segments, undamped, &points, rigid);
    for (point, end, inwards) in [(drawn[0], &ends[0], 1.0), (drawn[1], &ends[1], -1.0)] {
        add_rod(beam, end.offset, along * inwards, undamped, point, rigid);
    }
    let h = length / n;
    let area = beam.width * beam.thickness;
    let inertia = beam.thickness * beam.width.powi(3) / 12.0;
    let (ea, ei) = (beam.material.youngs_modulus * area, beam.material.youngs_modulus * inertia);
    let straight = Matrix3::from_diagonal(&Vector3::new(ea / h, 12.0 * ei / (h * h * h), ei / h));
    let calibrated = junctions == Junctions::Calibrated;
    let second = Matrix2::new(0.6 / h, 0.0, 0.0, -h / 12.0);
    let m = &beam.material;
    let strain = beam.temperature.map_or(0.0, |t| m.thermal_expansion * (t - m.ambient_temperature))
        - m.stress / m.youngs_modulus;
    for k in 0..segments {
        let (a, b) = (points[k], points[k + 1]);
        if a.body == b.body {
            continue; // both ends on one rigid body: nothing can strain
        }
        let middle = start + (end - start) * ((k as f64 + 0.5) / n);
        joints.push(Joint {
            a: a.body,
            b: b.body,
            frame: rigid.frame_at(a, b, middle, beam.angle),
            stiffness: if calibrated { with_springs(beam, &straight, h, (k, segments), ends) } else { straight },
            second,
            // what is drawn expands, junctions included
            expansion: heater.map(|group| (group, beam.length / n)),
            rest: beam.length / n * strain,
            locked: [false; 3],
        });
    }
    if calibrated {
        add_rotary_inertia(beam, h, ends, drawn, rigid);
    }
    points[0] = drawn[0];
    points[segments] = drawn[1];
    points
}

/// Stiffness of joint `k` of `n` with the shear compliance of its segment and the springs of the ends next to it.
///
/// Springs may be negative where a junction is stiffer than what its offset leaves out; on very short segments they are
/// halved until a tenth of the segment's own compliance is left.
fn with_springs(beam: &Beam, straight: &Matrix3<f64>, h: f64, (k, n): (usize, usize), ends: &[End; 2]) -> Matrix3<f64> {
    let mut own = Matrix3::from_diagonal(&straight.diagonal().map(|k| 1.0 / k));
    let shear_modulus = beam.material.youngs_modulus / (2.0 * (1.0 + beam.material.poisson));
    own[(1, 1)] += h / (SHEAR_AREA * shear_modulus * beam.width * beam.thickness);
    let mut springs = Matrix3::zeros();
    if k == 0 {
        springs += ends[0].at_joint(0.5 * h, true);
    }
    if k == n - 1 {
        springs += ends[1].at_joint(0.5 * h, false);
    }
    for _ in 0..8 {
        if let (Some(_), Some(whole)) = ((own * 0.9 + springs).cholesky(), (own + springs).cholesky()) {
            return whole.inverse();
        }
        springs *= 0.5;
    }
    Matrix3::from_diagonal(&own.diagonal().map(|c| 1.0 / c))
}

/// Shear area of a rectangle over its area.
const SHEAR_AREA: f64 = 5.0 / 6.0;

/// Drag per mass of a beam over a gas film [1/s].
pub fn drag_per_mass(beam: &Beam, undamped: bool) -> f64 {
    let m = &beam.material;
    if undamped || m.viscosity == 0.0 { 0.0 } else { m.viscosity / (m.fluid * m.density * beam.thickness) }
}

/// The rod of that length that a junction makes part of its node's body.
fn add_rod(beam: &Beam, length: f64, along: Vector2<f64>, undamped: bool, node: Point, rigid: &mut Assembly) {
    if length > 0.0 {
        let mass = beam.material.density * beam.width * beam.thickness * length;
        let second = mass * (length * length / 3.0 + beam.width * beam.width / 12.0);
        let lump = Lump { amount: mass, first: along * (0.5 * length * mass), second };
        rigid.add_mass(node, &lump, drag_per_mass(beam, undamped));
    }
}

/// Rotary inertia of the sections next to nodes where something else is, ρI for each length: half of the first and the last
/// segment's.
///
/// Inner bodies and those at free ends turn with next to no inertia of their own. A little would let them swing at a
/// frequency that means nothing but costs steps, and what it takes off the frequencies of bending, ½·(k·w)²/12 of each, is
/// small wherever a beam is long enough to have inner bodies.
fn add_rotary_inertia(beam: &Beam, h: f64, ends: &[End; 2], points: [Point; 2], rigid: &mut Assembly) {
    let second = 0.5 * h * beam.material.density * beam.thickness * beam.width.powi(3) / 12.0;
    for (point, _) in points.into_iter().zip(ends).filter(|(_, end)| !end.free) {
        rigid.add_mass(point, &Lump { second, ..Lump::default() }, 0.0);
    }
}

fn add_masses(beam: &Beam, length: f64, segments: usize, undamped: bool, points: &[Point], rigid: &mut Assembly) {
    let h = length / segments as f64;
    let unit = beam.material.density * beam.width * beam.thickness * h;
    let drag_per_mass = drag_per_mass(beam, undamped);
    let along = Vector2::new(beam.angle.cos(), beam.angle.sin());
    for (k, &point) in points.iter().enumerate() {
        if point.body == BodyId::Ground {
            continue;
        }
        let (amount, first, second) = shares(segments, k);
        let lump = Lump { amount: amount * unit, first: along * (first * h * unit), second: second * h * h * unit };
        rigid.add_mass(point, &lump, drag_per_mass);
    }
}

/// Mass, first and second moment about node `k` of `n` segments, in units of ρA·h, ρA·h², ρA·h³.
fn shares(n: usize, k: usize) -> (f64, f64, f64) {
    let inwards = if k == 0 { 1.0 } else { -1.0 };
    let gauss = 0.5 - 0.5 / 3f64.sqrt();
    match (n, k) {
        (1, _) => (0.5, inwards * 0.5 * gauss, 0.5 * gauss * gauss),
        (_, k) if k == 0 || k == n => (25.0 / 48.0, inwards * 5.0 / 48.0, 1.0 / 48.0),
        (2, _) => (46.0 / 48.0, 0.0, 0.0),
        (_, k) if k == 1 || k == n - 1 => (47.0 / 48.0, 0.0, 0.0),
        _ => (1.0, 0.0, 0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mass, first and second moment of the whole beam are exact for every number of segments.
    #[test]
    fn moments_are_exact() {
        for n in 1..12 {
            let (mut mass, mut first, mut second) = (0.0, 0.0, 0.0);
            for k in 0..=n {
                let (m, f, s) = shares(n, k);
                let x = k as f64;
                mass += m;
                first += m * x + f;
                second += m * x * x + 2.0 * f * x + s;
            }
            let l = n as f64;
            assert!((mass - l).abs() < 1e-12);
            assert!((first - l * l / 2.0).abs() < 1e-12 * l * l);
            assert!((second - l * l * l / 3.0).abs() < 1e-12 * l * l * l, "{n}: {second}");
        }
    }
}
