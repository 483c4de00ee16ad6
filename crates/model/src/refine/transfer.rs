//! A state or a shape of one mesh on another of the same drawing.
//!
//! Between two points of a beam the displacement is the cubic through both with the slopes of their rotations, which
//! are not small. At the distance s of a segment of length h, u' = h·((cos(β + θ), sin(β + θ)) − (cos β, sin β)), with
//! β the beam's direction as drawn. Bent beams keep their length to O(h⁴), so that Newton's method settles from there
//! within a few iterations.

use crate::discretize::Assembly;
use bimorph_domains::MaterialPoint;
use bimorph_multibody::BodyId;
use bimorph_multibody::planar::{self, Pose};
use bimorph_structure::Structure;
use nalgebra::Vector2;

/// Displacement and rotation of a point.
#[derive(Clone, Copy)]
struct PointDisplacement {
    u: Vector2<f64>,
    turn: f64,
}

/// Displacements `x` of the bodies of one mesh as those of another; `linear`: about the drawn geometry, as of a mode.
pub fn carried(structure: &Structure, from: &Assembly, to: &Assembly, x: &[Pose], linear: bool) -> Vec<Pose> {
    let mut y = vec![Pose::zeros(); to.system.bodies()];
    let at = |p: &MaterialPoint| PointDisplacement { u: p.displacement(x, linear), turn: p.rotation(x) };
    let mut put = |p: &MaterialPoint, moved: PointDisplacement| {
        if let BodyId::Free(k) = p.body {
            let swung = planar::point(&Pose::new(0.0, 0.0, moved.turn), p.arm, linear);
            let u = moved.u - swung;
            y[k] = Pose::new(u.x, u.y, moved.turn);
        }
    };
    let (mut moved, mut slopes) = (Vec::new(), Vec::new());
    for (beam, (from, to)) in structure.beams.iter().zip(from.beams.iter().zip(&to.beams)) {
        let (last, new) = (from.len() - 1, to.len() - 1);
        let h = beam.length / last as f64;
        let along = Vector2::new(beam.angle.cos(), beam.angle.sin());
        moved.clear();
        moved.extend(from.iter().map(at));
        slopes.clear();
        slopes.extend(moved.iter().map(|moved: &PointDisplacement| slope(along, h, moved.turn, linear)));
        for (k, point) in to.iter().enumerate() {
            // a node that both meshes have
            if (k * last).is_multiple_of(new) {
                put(point, moved[k * last / new]);
                continue;
            }
            let s = (k * last) as f64 / new as f64;
            let first = (s as usize).min(last - 1);
            let (ends, slopes) = ([moved[first], moved[first + 1]], [slopes[first], slopes[first + 1]]);
            put(point, between((along, h), ends, slopes, s - first as f64, linear));
        }
    }
    for (from, to) in from.nodes.iter().zip(&to.nodes) {
        if let (Some(from), Some(to)) = (from, to) {
            put(to, at(from));
        }
    }
    y
}

/// Contribution of a rotation at an end of a segment to the slope there, times its length.
fn slope(along: Vector2<f64>, h: f64, turn: f64, linear: bool) -> Vector2<f64> {
    let (y, x) = if linear { (turn, 0.0) } else { (turn.sin(), turn.cos() - 1.0) };
    Vector2::new(along.x * x - along.y * y, along.y * x + along.x * y) * h
}

/// The cubic between the ends of a segment with these slopes, at its share `s`.
fn between(
    (along, h): (Vector2<f64>, f64),
    [a, b]: [PointDisplacement; 2],
    [ta, tb]: [Vector2<f64>; 2],
    s: f64,
    linear: bool,
) -> PointDisplacement {
    let step = b.u - a.u;
    let u = a.u + step * (s * s * (3.0 - 2.0 * s)) + ta * (s * (1.0 - s) * (1.0 - s)) - tb * (s * s * (1.0 - s));
    let rate = step * (6.0 * s * (1.0 - s)) + ta * ((1.0 - s) * (1.0 - 3.0 * s)) - tb * (s * (2.0 - 3.0 * s));
    let across = (along.x * rate.y - along.y * rate.x) / h;
    // the rotation of the cubic, counted on from that of its start so that whole turns are kept
    let turn = if linear {
        across
    } else {
        let stretched = 1.0 + (along.x * rate.x + along.y * rate.y) / h;
        let local = across.atan2(stretched);
        let mean = a.turn + s * (b.turn - a.turn);
        mean + (local - mean).sin().atan2((local - mean).cos())
    };
    PointDisplacement { u, turn }
}
