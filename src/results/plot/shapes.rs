//! Outlines of drawn parts in metres: a bent beam, a plate, the fingers of a comb.

use crate::structure::{Beam, Comb, Mass, Structure};

/// Displacement of a node: x, y [m] and rotation [rad].
pub type Motion = [f64; 3];

/// A point in the plane [m].
pub type Point = [f64; 2];

/// Pieces into which a bent beam is divided.
const PIECES: usize = 14;

fn moved(structure: &Structure, node: usize, motion: &[Motion]) -> (Point, f64) {
    let [x, y] = structure.nodes[node].position;
    let [u, v, turn] = motion.get(node).copied().unwrap_or_default();
    ([x + u, y + v], turn)
}

/// The outline of a beam whose ends moved. Its centreline is the cubic through both ends with their directions, which
/// for small motion is the shape of a beam loaded at its ends alone.
pub fn beam_outline(structure: &Structure, beam: &Beam, motion: &[Motion]) -> Vec<Point> {
    let (a, turn_a) = moved(structure, beam.a.0, motion);
    let (b, turn_b) = moved(structure, beam.b.0, motion);
    let chord = [b[0] - a[0], b[1] - a[1]];
    let length = chord[0].hypot(chord[1]);
    // Where the drawing does not close, the line through the nodes is shown, not the nominal angle.
    let [ra, rb] = [beam.a.0, beam.b.0].map(|n| structure.nodes[n].position);
    let rest = (rb[1] - ra[1]).atan2(rb[0] - ra[0]);
    let tangent = |turn: f64| [length * (rest + turn).cos(), length * (rest + turn).sin()];
    let (ta, tb) = (tangent(turn_a), tangent(turn_b));
    let straight = turn_a == 0.0 && turn_b == 0.0;
    let pieces = if straight { 1 } else { PIECES };

    let (mut left, mut right) = (Vec::new(), Vec::new());
    for k in 0..=pieces {
        let s = k as f64 / pieces as f64;
        let (s2, s3) = (s * s, s * s * s);
        let at = |i: usize| {
            (2.0 * s3 - 3.0 * s2 + 1.0) * a[i]
                + (s3 - 2.0 * s2 + s) * ta[i]
                + (3.0 * s2 - 2.0 * s3) * b[i]
                + (s3 - s2) * tb[i]
        };
        let slope = |i: usize| {
            (6.0 * s2 - 6.0 * s) * (a[i] - b[i]) + (3.0 * s2 - 4.0 * s + 1.0) * ta[i] + (3.0 * s2 - 2.0 * s) * tb[i]
        };
        let direction = [slope(0), slope(1)];
        let size = direction[0].hypot(direction[1]).max(f64::MIN_POSITIVE);
        let normal = [-direction[1] / size * beam.width / 2.0, direction[0] / size * beam.width / 2.0];
        left.push([at(0) + normal[0], at(1) + normal[1]]);
        right.push([at(0) - normal[0], at(1) - normal[1]]);
    }
    left.extend(right.into_iter().rev());
    left
}

/// The outline of a plate whose node moved; none for a lumped mass.
pub fn plate_outline(structure: &Structure, mass: &Mass, motion: &[Motion]) -> Option<Vec<Point>> {
    let [along, across, angle] = mass.outline;
    if along <= 0.0 || across <= 0.0 {
        return None;
    }
    let (centre, turn) = moved(structure, mass.node.0, motion);
    Some(rectangle(centre, angle + turn, [-along / 2.0, along / 2.0], [-across / 2.0, across / 2.0]))
}

/// A rectangle given in a turned frame at `origin`.
pub fn rectangle(origin: Point, angle: f64, along: [f64; 2], across: [f64; 2]) -> Vec<Point> {
    let (sin, cos) = angle.sin_cos();
    let corners = [[along[0], across[0]], [along[1], across[0]], [along[1], across[1]], [along[0], across[1]]];
    corners.iter().map(|[x, y]| [origin[0] + cos * x - sin * y, origin[1] + sin * x + cos * y]).collect()
}

/// Rectangles of a comb, first those of the rotor, then those of the stator.
///
/// The roots of the two sides are two finger lengths less the overlap apart, which gives the length. How wide a finger
/// is the netlist does not say: it is drawn as wide as its gap.
pub fn comb_outlines(structure: &Structure, comb: &Comb, motion: &[Motion]) -> (Vec<Vec<Point>>, Vec<Vec<Point>>) {
    let (rotor, turn) = moved(structure, comb.a.0, motion);
    let (stator, _) = moved(structure, comb.b.0, &[]);
    let rest = structure.nodes[comb.a.0].position;
    let apart = (stator[0] - rest[0]) * comb.axis[0] + (stator[1] - rest[1]) * comb.axis[1];
    let length = ((apart + comb.overlap) / 2.0).max(comb.gap);
    let angle = comb.axis[1].atan2(comb.axis[0]);
    let width = comb.gap;
    let pitch = 2.0 * (comb.gap + width);
    let fingers = ((comb.gaps / 2.0).ceil().max(1.0) as usize).min(60);
    let half = pitch * fingers as f64 / 2.0;
    let back = 2.0 * width;

    let mut moving = vec![rectangle(rotor, angle + turn, [-back, 0.0], [-half, half])];
    let mut fixed = vec![rectangle(stator, angle, [0.0, back], [-half - width, half + width])];
    for k in 0..=fingers {
        let edge = -half + pitch * k as f64;
        fixed.push(rectangle(stator, angle, [-length, 0.0], [edge - width / 2.0, edge + width / 2.0]));
        if k < fingers {
            let middle = edge + pitch / 2.0;
            moving.push(rectangle(rotor, angle + turn, [0.0, length], [middle - width / 2.0, middle + width / 2.0]));
        }
    }
    (moving, fixed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::structure::{Material, Node, NodeId};

    fn cantilever() -> (Structure, Beam) {
        let material = Material {
            youngs_modulus: 1.0,
            poisson: 0.0,
            density: 1.0,
            viscosity: 0.0,
            fluid: 1.0,
            thermal_expansion: 0.0,
            ambient_temperature: 0.0,
            stress: 0.0,
        };
        let node = |x| Node { name: String::new(), position: [x, 0.0], mechanical: true, electrical: false };
        let structure = Structure { nodes: vec![node(0.0), node(1.0)], ..Structure::default() };
        let beam = Beam {
            name: "b".into(),
            a: NodeId(0),
            b: NodeId(1),
            length: 1.0,
            angle: 0.0,
            width: 0.2,
            thickness: 1.0,
            material,
            temperature: None,
            heater: None,
        };
        (structure, beam)
    }

    /// A beam at rest is its rectangle.
    #[test]
    fn at_rest() {
        let (structure, beam) = cantilever();
        assert_eq!(beam_outline(&structure, &beam, &[]), [[0.0, 0.1], [1.0, 0.1], [1.0, -0.1], [0.0, -0.1]]);
    }

    /// The middle of an end-loaded cantilever moves by 5/16 of its tip: v(s) = (3s² − s³)/2 at s = 1/2.
    #[test]
    fn bent() {
        let (structure, beam) = cantilever();
        let tip = 1e-3;
        let outline = beam_outline(&structure, &beam, &[[0.0; 3], [0.0, tip, 1.5 * tip]]);
        let middle = f64::midpoint(outline[PIECES / 2][1], outline[outline.len() - 1 - PIECES / 2][1]);
        approx::assert_relative_eq!(middle, 5.0 / 16.0 * tip, max_relative = 1e-4);
    }
}
