//! End masses of scheme E4: the shares of a beam's first and last segment that belong to its nodes.
//!
//! With f = w² the kinetic energy of a beam is ½·ω²·ρA·∫f dx. The Euler–Maclaurin sum over nodes h apart has the term
//! h²/12·f′ at each end, with f′ = 2·w·θ:
//!
//! ```text
//! ∫f dx = h·(½·f₀ + f₁ + f₂ + …) + h²/6·w₀·θ₀ + O(h⁴)
//! ```
//!
//! The lump of such an end has the mass ½, the first moment 1/12 and no second moment about its node (ρA·h, ρA·h², ρA·h³).
//! About its own centre its inertia is −1/72. The body of the node must make up for it: a plate does, and so nearly does the
//! same beam on the other side of the node. A body that cannot takes an excess δ of mass from the next node of the beam:
//!
//! ```text
//! node: mass ½ + δ, first moment 1/12 + δ, second moment δ      next node: mass 1 − δ
//! ```
//!
//! These have the same mass, first and second moment, and leave the error −δ·ρA·h³·w₀·κ₀, of the third order where the end
//! moves and bends. δ = 1/48 ([`POINT_EXCESS`]) is a point mass at h/5, which needs no other inertia. Each body has the
//! least δ that leaves half of its inertia without the beams, and a tenth of that with point masses; one whose rotation is
//! held has 0. Inside a straight beam δ is 0.0021, at a corner of two equal beams at 90° it is 0.0095. A free end has 1/48,
//! where κ₀ = 0. So has an end on ground, where w₀ = θ₀ = 0 and δ takes mass from the next node alone: there 1/48 makes the
//! errors of the fifth order small, too.
//!
//! The drag of a beam has the same shares, with an excess that leaves the drag of each body positive.

use super::beam::drag_per_mass;
use super::junction_springs::{JunctionEnd, bar_between};
use super::rigid::{Lump, RigidGroups, UnfinishedBody};
use super::scheme::{Bar, BeamSegment, EndExcess, POINT_EXCESS, rods};
use crate::options::{CompileOptions, Scheme};
use bimorph_multibody::BodyId;
use bimorph_structure::{Beam, Structure};
use nalgebra::Vector2;

/// Fraction of the inertia of a body without its beams that is left to it (1).
const LEFT: f64 = 0.5;
/// Fraction of its inertia with ends that are point masses, likewise: steps in time resolve rotations whose inertia is next to nothing (1).
const LEFT_OF_POINTS: f64 = 0.1;

/// Mass of a body: that without excess, and what an excess of 1 adds.
#[derive(Debug, Clone, Copy)]
struct NodeMass {
    plain: Lump,
    slope: Lump,
    /// Least inertia about the centre of mass (kg·m²).
    least: f64,
}

impl NodeMass {
    /// That of a body whose other parts have this mass.
    fn beside(other: &Lump) -> Self {
        Self { plain: *other, slope: Lump::default(), least: LEFT * other.central() }
    }

    /// The least excess at which the inertia about the centre of mass is large enough.
    fn least_excess(&self) -> f64 {
        let (p, s) = (&self.plain, &self.slope);
        // mass times what that inertia has to spare, a + b·δ + c·δ²
        let mut points = *p;
        points.add(s, Vector2::zeros(), POINT_EXCESS);
        let second = p.second - self.least.max(LEFT_OF_POINTS * points.central());
        let a = second * p.amount - p.first.norm_squared();
        let b = second * s.amount + s.second * p.amount - 2.0 * p.first.dot(&s.first);
        let c = s.second * s.amount - s.first.norm_squared();
        if a >= 0.0 {
            return 0.0;
        }
        let root = -2.0 * a / (b + (b * b - 4.0 * a * c).sqrt());
        // a body that is lighter than its beams has no root
        if root > 0.0 { root.min(POINT_EXCESS) } else { POINT_EXCESS }
    }
}

/// The excess of each beam. `rigid` has the mass and the drag of everything but the beams between their junctions.
pub(super) fn excess(
    structure: &Structure,
    options: &CompileOptions,
    ends: &[[JunctionEnd; 2]],
    segments: &[usize],
    rigid: &RigidGroups,
) -> Vec<EndExcess> {
    if !matches!(options.scheme, Scheme::E4 | Scheme::Auto) {
        return vec![EndExcess { mass: [POINT_EXCESS; 2], drag: [POINT_EXCESS; 2] }; structure.beams.len()];
    }
    let of = |others: fn(&UnfinishedBody) -> &Lump, per_mass: &dyn Fn(&Beam) -> f64| {
        let mut of_bodies: Vec<NodeMass> = rigid.bodies.iter().map(|body| NodeMass::beside(others(body))).collect();
        for ((beam, ends), &n) in structure.beams.iter().zip(ends).zip(segments) {
            add_ends(beam, options, (ends, n, per_mass(beam)), rigid, &mut of_bodies);
        }
        of_bodies
    };
    let masses = of(UnfinishedBody::mass, &|_| 1.0);
    let drags = of(UnfinishedBody::drag, &|beam| drag_per_mass(beam, options.undamped));
    let of_node = |of_bodies: &[NodeMass], node: usize| match rigid.point(node).body {
        BodyId::Free(_) if rigid.grounded(node) => 0.0,
        BodyId::Free(k) if rigid.bodies[k].turns() => of_bodies[k].least_excess(),
        BodyId::Free(_) => 0.0,
        BodyId::Ground => POINT_EXCESS,
    };
    let of_beam = |beam: &Beam| {
        let [mass, drag] = [&masses, &drags].map(|of| [of_node(of, beam.a.0), of_node(of, beam.b.0)]);
        EndExcess { mass, drag }
    };
    structure.beams.iter().map(of_beam).collect()
}

/// Adds the ends of a beam of `n` segments, times `factor`, to the bodies of its nodes.
fn add_ends(
    beam: &Beam,
    options: &CompileOptions,
    (ends, n, factor): (&[JunctionEnd; 2], usize, f64),
    rigid: &RigidGroups,
    of_bodies: &mut [NodeMass],
) {
    let along = Vector2::new(beam.angle.cos(), beam.angle.sin());
    // what rotary inertia adds is left to the body
    let bar = Bar { rotary: 0.0, ..bar_between(beam, options, ends) };
    for (end, node) in [beam.a.0, beam.b.0].into_iter().enumerate() {
        let point = rigid.point(node);
        let BodyId::Free(k) = point.body else { continue };
        let arm = point.arm + along * if end == 0 { ends[0].offset } else { -ends[1].offset };
        let mut add = |into: fn(&mut NodeMass) -> &mut Lump, part: &BeamSegment, share: f64| {
            into(&mut of_bodies[k]).add(&part.lump(along), arm, share * factor);
        };
        if n == 0 {
            add(|mass| &mut mass.plain, &rods(&bar, &[0.5 * bar.length])[end], 1.0);
            continue;
        }
        let with = |excess: f64| Scheme::E4.point(&Bar { end_excess: [excess; 2], ..bar }, n, end * n);
        let (plain, point) = (with(0.0), with(POINT_EXCESS));
        add(|mass| &mut mass.plain, &plain, 1.0);
        add(|mass| &mut mass.slope, &point, 1.0 / POINT_EXCESS);
        add(|mass| &mut mass.slope, &plain, -1.0 / POINT_EXCESS);
    }
}
