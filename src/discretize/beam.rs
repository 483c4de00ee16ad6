//! The E4 segment: a beam as rigid bodies at N + 1 nodes and N joints at the middle of the segments.
//!
//! Joint of a segment of length h (axial u, shear g, rotation p): stiffness EA/h, 12EI/h³, EI/h, and the second-order axial
//! strain e_u = u − h·p²/12 + 0.6·g²/h. Static deflections under end loads are those of the Euler–Bernoulli beam, for any N.
//!
//! Masses, in units of ρA·h: inner bodies 1; the end bodies 25/48 with a first moment of 5/48·h towards the inside and a
//! second moment of 1/48·h² about the node; their neighbours 47/48 (46/48 when N = 2); for N = 1 two halves at the Gauss
//! points. Mass, first and second moment of the beam are exact, and the frequency error is (kh)⁴/1440.

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
    rigid: &mut Assembly,
    joints: &mut Vec<Joint>,
) -> Vec<Point> {
    let (start, end) = (rigid.position(beam.a.0), rigid.position(beam.b.0));
    let n = segments as f64;
    let mut points = vec![rigid.point(beam.a.0)];
    let name = Arc::from(beam.name.as_str());
    for k in 1..segments {
        let position = start + (end - start) * (k as f64 / n);
        points.push(rigid.add_segment(BodyName::segment(&name, k), position));
    }
    points.push(rigid.point(beam.b.0));
    add_masses(beam, segments, undamped, &points, rigid);
    let h = beam.length / n;
    let area = beam.width * beam.thickness;
    let inertia = beam.thickness * beam.width.powi(3) / 12.0;
    let (ea, ei) = (beam.material.youngs_modulus * area, beam.material.youngs_modulus * inertia);
    let stiffness = Matrix3::from_diagonal(&Vector3::new(ea / h, 12.0 * ei / (h * h * h), ei / h));
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
            stiffness,
            second,
            expansion: heater.map(|group| (group, h)),
            rest: h * strain,
            locked: [false; 3],
        });
    }
    points
}

fn add_masses(beam: &Beam, segments: usize, undamped: bool, points: &[Point], rigid: &mut Assembly) {
    let h = beam.length / segments as f64;
    let unit = beam.material.density * beam.width * beam.thickness * h;
    let m = &beam.material;
    let drag_per_mass =
        if undamped || m.viscosity == 0.0 { 0.0 } else { m.viscosity / (m.fluid * m.density * beam.thickness) };
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
