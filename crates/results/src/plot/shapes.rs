//! Outlines of drawn parts in metres: a bent beam, a plate, the fingers of a comb.

use bimorph_structure::{Comb, Mass, Structure};

/// Displacement of a node: x, y (m) and rotation (rad).
pub type NodeDisplacement = [f64; 3];

/// A point in the plane (m).
pub type PlanePoint = [f64; 2];

/// Pieces into which a whole bent beam is divided at least.
const PIECES: usize = 14;

/// Displacements to draw, already enlarged.
#[derive(Debug, Clone, Copy, Default)]
pub struct DisplacedShape<'a> {
    /// Of each node by [`bimorph_structure::NodeId`]; empty: at rest.
    pub nodes: &'a [NodeDisplacement],
    /// Of points along each beam, equally spaced, ends included; empty: from the beam's ends alone.
    pub curves: &'a [Vec<NodeDisplacement>],
    /// Displacements are enlarged: slopes grow with them, instead of turning round and round.
    pub enlarged: bool,
}

impl DisplacedShape<'_> {
    fn node(&self, structure: &Structure, node: usize) -> (PlanePoint, f64) {
        let [x, y] = structure.nodes[node].position;
        let [u, v, turn] = self.nodes.get(node).copied().unwrap_or_default();
        ([x + u, y + v], if self.enlarged { turn.atan() } else { turn })
    }
}

/// The outline of the `index`-th beam. Its centreline is the cubic through neighbouring points with their directions, which
/// for small motion is the shape of a beam loaded at these points alone.
pub fn beam_outline(structure: &Structure, index: usize, moved: &DisplacedShape<'_>) -> Vec<PlanePoint> {
    let beam = &structure.beams[index];
    let [a, b] = [beam.a.0, beam.b.0].map(|n| structure.nodes[n].position);
    let ends = [beam.a.0, beam.b.0].map(|n| moved.nodes.get(n).copied().unwrap_or_default());
    let along = moved.curves.get(index).map(Vec::as_slice).filter(|c| c.len() >= 2).unwrap_or(&ends);
    let segments = along.len() - 1;
    let straight = along.iter().all(|m| *m == [0.0; 3]);
    // fine enough for the eye where it turns far
    let turns = along.windows(2).map(|m| (m[1][2] - m[0][2]).abs()).fold(0.0, f64::max);
    let pieces = if straight { 1 } else { PIECES.div_ceil(segments).max(4).max((turns / 0.08).min(60.0) as usize) };
    // Where the drawing does not close, the line through the nodes is shown, not the nominal angle.
    let step = [(b[0] - a[0]) / segments as f64, (b[1] - a[1]) / segments as f64];
    let length = step[0].hypot(step[1]);
    let point = |k: usize| [a[0] + k as f64 * step[0] + along[k][0], a[1] + k as f64 * step[1] + along[k][1]];
    let tangent = |k: usize, chord: f64| {
        let turn = along[k][2];
        if moved.enlarged {
            [step[0] - turn * step[1], step[1] + turn * step[0]]
        } else {
            let (sin, cos) = turn.sin_cos();
            let stretch = chord / length.max(f64::MIN_POSITIVE);
            [stretch * (cos * step[0] - sin * step[1]), stretch * (sin * step[0] + cos * step[1])]
        }
    };
    let (mut left, mut right) = (Vec::new(), Vec::new());
    for segment in 0..if straight { 1 } else { segments } {
        let (p, q) = if straight { (point(0), point(segments)) } else { (point(segment), point(segment + 1)) };
        let chord = (q[0] - p[0]).hypot(q[1] - p[1]);
        let last = if straight { segments } else { segment + 1 };
        let (tp, tq) = (tangent(segment, chord), tangent(last, chord));
        for k in usize::from(segment > 0)..=pieces {
            let s = k as f64 / pieces as f64;
            let (at, slope) = hermite(s, [p, tp, q, tq]);
            let size = slope[0].hypot(slope[1]).max(f64::MIN_POSITIVE);
            let normal = [-slope[1] / size * beam.width / 2.0, slope[0] / size * beam.width / 2.0];
            left.push([at[0] + normal[0], at[1] + normal[1]]);
            right.push([at[0] - normal[0], at[1] - normal[1]]);
        }
    }
    left.extend(right.into_iter().rev());
    left
}

/// Point and derivative at `s` of the cubic from p with derivative tp to q with derivative tq.
fn hermite(s: f64, [p, tp, q, tq]: [PlanePoint; 4]) -> (PlanePoint, PlanePoint) {
    let (s2, s3) = (s * s, s * s * s);
    let at = |i: usize| {
        (2.0 * s3 - 3.0 * s2 + 1.0) * p[i]
            + (s3 - 2.0 * s2 + s) * tp[i]
            + (3.0 * s2 - 2.0 * s3) * q[i]
            + (s3 - s2) * tq[i]
    };
    let slope = |i: usize| {
        (6.0 * s2 - 6.0 * s) * (p[i] - q[i]) + (3.0 * s2 - 4.0 * s + 1.0) * tp[i] + (3.0 * s2 - 2.0 * s) * tq[i]
    };
    ([at(0), at(1)], [slope(0), slope(1)])
}

/// The outline of a plate whose node moved; none for a lumped mass.
pub fn plate_outline(structure: &Structure, mass: &Mass, motion: &DisplacedShape<'_>) -> Option<Vec<PlanePoint>> {
    let [along, across, angle] = mass.outline;
    if along <= 0.0 || across <= 0.0 {
        return None;
    }
    let (centre, turn) = motion.node(structure, mass.node.0);
    Some(rectangle(centre, angle + turn, [-along / 2.0, along / 2.0], [-across / 2.0, across / 2.0]))
}

/// A rectangle given in a turned frame at `origin`.
pub fn rectangle(origin: PlanePoint, angle: f64, along: [f64; 2], across: [f64; 2]) -> Vec<PlanePoint> {
    let (sin, cos) = angle.sin_cos();
    let corners = [[along[0], across[0]], [along[1], across[0]], [along[1], across[1]], [along[0], across[1]]];
    corners.iter().map(|[x, y]| [origin[0] + cos * x - sin * y, origin[1] + sin * x + cos * y]).collect()
}

/// Rectangles of a comb, first those of the rotor, then those of the stator.
///
/// The roots of the two sides are two finger lengths less the overlap apart, which gives the length. How wide a finger
/// is the netlist does not say: it is drawn as wide as its gap.
pub fn comb_outlines(
    structure: &Structure,
    comb: &Comb,
    motion: &DisplacedShape<'_>,
) -> (Vec<Vec<PlanePoint>>, Vec<Vec<PlanePoint>>) {
    let (rotor, turn) = motion.node(structure, comb.a.0);
    let (stator, _) = DisplacedShape::default().node(structure, comb.b.0);
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
    use bimorph_structure::{Beam, Material, Node, NodeId};

    fn cantilever() -> Structure {
        let material = Material {
            youngs_modulus: 1.0,
            poisson: 0.0,
            shear_modulus: None,
            density: 1.0,
            viscosity: 0.0,
            fluid: 1.0,
            thermal_expansion: 0.0,
            expansion_curve: None,
            ambient_temperature: 0.0,
            stress: 0.0,
            strength: None,
            fillet: None,
            anchor_quality: None,
            heat: None,
        };
        let node = |x| Node { name: String::new(), position: [x, 0.0], mechanical: true, electrical: false };
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
        Structure { nodes: vec![node(0.0), node(1.0)], beams: vec![beam], ..Structure::default() }
    }

    /// The middle of an outline's sides.
    fn middle(outline: &[PlanePoint]) -> f64 {
        let half = outline.len() / 4;
        f64::midpoint(outline[half][1], outline[outline.len() - 1 - half][1])
    }

    /// A beam at rest is its rectangle.
    #[test]
    fn at_rest() {
        let outline = beam_outline(&cantilever(), 0, &DisplacedShape::default());
        assert_eq!(outline, [[0.0, 0.1], [1.0, 0.1], [1.0, -0.1], [0.0, -0.1]]);
    }

    /// The middle of an end-loaded cantilever moves by 5/16 of its tip: v(s) = (3s² − s³)/2 at s = 1/2, enlarged or not.
    #[test]
    fn bent() {
        let tip = 1e-3;
        for enlarged in [false, true] {
            let moved = DisplacedShape { nodes: &[[0.0; 3], [0.0, tip, 1.5 * tip]], curves: &[], enlarged };
            let outline = beam_outline(&cantilever(), 0, &moved);
            approx::assert_relative_eq!(middle(&outline), 5.0 / 16.0 * tip, max_relative = 1e-4);
        }
    }

    /// A beam that bends between ends at rest shows it where points along it are known.
    #[test]
    fn bent_between_its_ends() {
        let curves = [vec![[0.0; 3], [0.0, 0.1, 0.0], [0.0; 3]]];
        let moved = DisplacedShape { nodes: &[[0.0; 3], [0.0; 3]], curves: &curves, enlarged: true };
        approx::assert_relative_eq!(middle(&beam_outline(&cantilever(), 0, &moved)), 0.1, max_relative = 1e-12);
    }
}
