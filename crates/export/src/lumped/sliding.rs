//! The directions in which the parts of a mechanism slide, and the springs and dampers between them; refused where a part can
//! turn or a spring is not linear.

use super::super::ExportError;
use super::model::Coordinate;
use bimorph_domains::{MaterialPoint, System};
use bimorph_multibody::BodyId;
use bimorph_multibody::forces::{add_damping, add_elastic};
use bimorph_multibody::planar::Pose;
use nalgebra::{DMatrix, DVector, Vector2};

/// Most coordinates of a lumped mechanism.
const MAX_COORDINATES: usize = 24;
/// Scale of the rate of a part without a spring (rad/s).
pub(super) const FREE_RATE: f64 = 1e5;
/// Fraction of a spring's force that may be beside a straight line (1).
const STRAIGHT: f64 = 1e-9;

/// x or y.
pub(super) fn axis(direction: usize) -> Vector2<f64> {
    if direction == 0 { Vector2::x() } else { Vector2::y() }
}

/// The directions in which bodies slide.
pub(super) fn coordinates(system: &System) -> Result<Vec<Coordinate>, ExportError> {
    let refused = |why: String| Err(ExportError::NotLumped { why });
    let mut out: Vec<Coordinate> = Vec::new();
    for (body, part) in system.model.bodies.iter().enumerate() {
        let name = part.name.to_string();
        let Some(free) = &part.free else { return refused(format!("part \"{name}\" can turn")) };
        if free.column(2).amax() > 1e-9 {
            return refused(format!("part \"{name}\" can turn"));
        }
        if free.trace().round() > 0.0 && part.mass <= 0.0 {
            return refused(format!("part \"{name}\" has no mass"));
        }
        let directions = match free.trace().round() as usize {
            0 => vec![],
            1 => {
                let column = if free[(0, 0)] >= free[(1, 1)] { 0 } else { 1 };
                vec![Vector2::new(free[(0, column)], free[(1, column)]).normalize()]
            }
            _ => vec![Vector2::x(), Vector2::y()],
        };
        out.extend(directions.into_iter().map(|direction| Coordinate {
            name: name.clone(),
            body,
            direction,
            mass: part.mass,
            omega: 1.0,
        }));
    }
    match out.len() {
        0 => refused("nothing moves".into()),
        n if n > MAX_COORDINATES => {
            refused(format!("{n} directions in which parts slide are more than {MAX_COORDINATES}"))
        }
        _ => Ok(out),
    }
}

/// C over the coordinates (N·s/m).
pub(super) fn dampers(system: &System, coordinates: &[Coordinate]) -> DMatrix<f64> {
    let n = coordinates.len();
    let mut drag = vec![Pose::zeros(); system.bodies()];
    let mut damping = DMatrix::zeros(n, n);
    for k in 0..n {
        drag.fill(Pose::zeros());
        add_damping(&system.model, &moved(system, coordinates, k, 1.0), &mut drag);
        for j in 0..n {
            damping[(j, k)] = drag[coordinates[j].body].xy().dot(&coordinates[j].direction);
        }
    }
    damping
}

/// How far a point goes along an axis with each coordinate (1).
pub(super) fn along(coordinates: &[Coordinate], point: &MaterialPoint, axis: Vector2<f64>) -> DVector<f64> {
    let of = |c: &Coordinate| if point.body == BodyId::Free(c.body) { c.direction.dot(&axis) } else { 0.0 };
    DVector::from_iterator(coordinates.len(), coordinates.iter().map(of))
}

/// K and the force at rest; refused where springs are not linear over the ways that gaps leave. Sets no scale.
pub(super) fn springs(
    system: &System,
    coordinates: &[Coordinate],
) -> Result<(DMatrix<f64>, DVector<f64>), ExportError> {
    let (n, drive) = (coordinates.len(), system.electrics.drive());
    let elastic = |q: &[Pose]| -> DVector<f64> {
        let mut r = vec![Pose::zeros(); q.len()];
        add_elastic(&system.model, q, &drive.rest(), &mut r);
        DVector::from_iterator(n, coordinates.iter().map(|c| r[c.body].xy().dot(&c.direction)))
    };
    let way = 10.0 * system.length_scale;
    let rest = elastic(&vec![Pose::zeros(); system.bodies()]);
    let mut stiffness = DMatrix::zeros(n, n);
    for k in 0..n {
        let there = elastic(&moved(system, coordinates, k, way)) - elastic(&moved(system, coordinates, k, -way));
        stiffness.set_column(k, &(there / (2.0 * way)));
    }
    let stiffness = (&stiffness + stiffness.transpose()) * 0.5;
    // all corners of a few patterns of ways: any coupling of two coordinates shows
    for pattern in 0..n + 2 {
        let ways = DVector::from_fn(n, |k, _| {
            way * (0.3 + ((7 * k + 3 * pattern) % 11) as f64 / 11.0) * if (k + pattern) % 2 == 0 { 1.0 } else { -1.0 }
        });
        let mut q = vec![Pose::zeros(); system.bodies()];
        for k in 0..n {
            for (to, x) in q.iter_mut().zip(moved(system, coordinates, k, ways[k])) {
                *to += x;
            }
        }
        let (found, straight) = (elastic(&q), &rest + &stiffness * &ways);
        let size = stiffness.amax() * way + rest.amax();
        if let Some(k) = (0..n).find(|&k| (found[k] - straight[k]).abs() > STRAIGHT * size) {
            let why = format!("the springs at part \"{}\" are not linear", coordinates[k].name);
            return Err(ExportError::NotLumped { why });
        }
    }
    Ok((stiffness, rest))
}

/// A displacement `way` along coordinate `k`.
fn moved(system: &System, coordinates: &[Coordinate], k: usize, way: f64) -> Vec<Pose> {
    let mut q = vec![Pose::zeros(); system.bodies()];
    let c = &coordinates[k];
    q[c.body] = Pose::new(c.direction.x * way, c.direction.y * way, 0.0);
    q
}
