//! A beam of the drawing as bodies and joints of a model, cut by a [`Scheme`].
//!
//! At junctions the ends are [`JunctionEnd`]s. The beam proper, which is cut, runs from one offset to the other; the
//! rods outside it belong to the bodies of the nodes. The springs' compliance is added to that of the first and the
//! last joint.

pub use super::bar::{SHEAR_COEFFICIENT, bar};
use super::junction_springs::{JunctionEnd, bar_between, has_springs};
use super::rigid::{Lump, RigidGroups};
use super::scheme::{Bar, BeamSegment, EndExcess, SegmentJoint, SegmentedBeam};
use super::sprung::second_strain;
use super::stressed::SegmentSpan;
use crate::options::{CompileOptions, Scheme};
use bimorph_domains::MaterialPoint;
use bimorph_multibody::{BodyName, Coupling, Joint};
use bimorph_structure::{Beam, Structure};
use nalgebra::{Matrix2, Matrix3, Vector2};
use std::sync::Arc;

/// Joints of the model in the making.
#[derive(Debug, Clone, Default)]
pub struct JointBuilder {
    /// Joints, `Free(k)` being body k of the assembly.
    pub joints: Vec<Joint>,
    /// Pairs of joints whose rotations are coupled.
    pub couplings: Vec<Coupling>,
    /// The bodies of the beam at hand.
    bodies: Vec<MaterialPoint>,
    /// For each beam so far, its joints.
    pub of_beams: Vec<Vec<SegmentSpan>>,
    /// Beams that were cut before: those of a drawing are mostly alike.
    known: Vec<StiffenedBeam>,
}

/// Most cached beams.
const MAX_CACHED_BEAMS: usize = 16;

/// Ends of a beam that meet others.
#[derive(Debug, Clone, Copy)]
pub struct BeamEnds<'a> {
    /// The junctions at its start and its end.
    pub junctions: &'a [JunctionEnd; 2],
    /// Excess of their masses and of their drag.
    pub excess: EndExcess,
}

/// Discretizes a beam: adds its inner bodies, masses and joints. Returns the equally spaced points along it, the drawn
/// ends included.
pub fn lay(
    beam: &Beam,
    segments: usize,
    heater: Option<usize>,
    options: &CompileOptions,
    ends: &BeamEnds<'_>,
    rigid: &mut RigidGroups,
    out: &mut JointBuilder,
) -> Vec<MaterialPoint> {
    let &BeamEnds { junctions: ends, excess } = ends;
    let along = Vector2::new(beam.angle.cos(), beam.angle.sin());
    let drawn = [rigid.point(beam.a.0), rigid.point(beam.b.0)];
    let shift = [along * ends[0].offset, along * -ends[1].offset];
    let (start, end) = (rigid.position(beam.a.0) + shift[0], rigid.position(beam.b.0) + shift[1]);
    let bar = Bar { end_excess: excess.mass, ..bar_between(beam, options, ends) };
    let wall = rigid.grounded(beam.b.0);
    let drawn_as = JointProperties { bar, segments, wall, ends: *ends, drag_excess: excess.drag };
    let JointBuilder { joints, couplings, bodies, of_beams, known } = out;
    let StiffenedBeam { cut, strained, dragged, .. } = sprung(known, drawn_as, options);
    let segments = segments.max(1);
    let last = cut.parts.len() - 1;
    let name = if last > 1 { Arc::from(beam.name.as_str()) } else { Arc::default() };
    let place = |at: f64| start + (end - start) * (at / bar.length);
    bodies.clear();
    bodies.extend((0..=last).map(|k| match k {
        0 => drawn[0].beyond(shift[0]),
        k if k == last => drawn[1].beyond(shift[1]),
        k => rigid.add_segment(BodyName::segment(&name, k), place(cut.parts[k].at)),
    }));
    let drag_per_mass = drag_per_mass(beam, options.undamped);
    for ((part, drag), &point) in cut.parts.iter().zip(dragged).zip(&*bodies) {
        rigid.add_mass(point, &part.lump(along), 0.0);
        rigid.add_drag(point, &drag.lump(along), drag_per_mass);
    }
    let m = &beam.material;
    let strain = beam.temperature.map_or(0.0, |t| m.free_strain(t)) - m.stress / m.youngs_modulus;
    // what is drawn expands, junctions included
    let whole = beam.length / bar.length;
    let mut spans = Vec::with_capacity(cut.pins.len());
    for ((pin, &(stiffness, second)), between) in cut.pins.iter().zip(strained).zip(bodies.windows(2)) {
        let (a, b) = (between[0], between[1]);
        if a.body == b.body {
            continue; // both ends on one rigid body: nothing can strain
        }
        spans.push(SegmentSpan { joint: joints.len(), length: pin.length, rigid: pin.locked != [false; 3] });
        joints.push(Joint {
            a: a.body,
            b: b.body,
            frame: rigid.frame_at(a, b, place(pin.at), along),
            stiffness,
            second,
            expansion: heater.map(|group| (group, whole * pin.length)),
            rest: whole * pin.length * strain,
            locked: pin.locked,
        });
    }
    of_beams.push(spans);
    let pair = |k: usize| (bodies[k].body, bodies[k + 1].body);
    for &(i, j, stiffness) in &cut.couplings {
        couplings.push(Coupling { first: pair(i), second: pair(j), stiffness });
    }
    let mut points: Vec<MaterialPoint> = (cut.nodes.iter().enumerate())
        .map(|(k, &part)| {
            let at = k as f64 * bar.length / segments as f64;
            bodies[part].beyond(place(at) - place(cut.parts[part].at))
        })
        .collect();
    (points[0], points[segments]) = (drawn[0], drawn[1]);
    points
}

/// Parameters that determine the joints of a beam.
#[derive(Debug, Clone, Copy, PartialEq)]
struct JointProperties {
    /// Between the junctions.
    bar: Bar,
    segments: usize,
    /// Its far end is part of the ground.
    wall: bool,
    ends: [JunctionEnd; 2],
    /// [`EndExcess::drag`].
    drag_excess: [f64; 2],
}

/// Stress per strain of a joint, and its second-order axial strain.
type JointStress = (Matrix3<f64>, Matrix2<f64>);

/// A beam that was cut, with the stiffness of its joints and their second-order strain, junctions included.
#[derive(Debug, Clone)]
struct StiffenedBeam {
    drawn: JointProperties,
    cut: SegmentedBeam,
    /// Its parts with the ends of drag, which does positive work on each body.
    dragged: Vec<BeamSegment>,
    strained: Vec<JointStress>,
}

/// The beam cut, or found among those that were.
fn sprung<'a>(
    known: &'a mut Vec<StiffenedBeam>,
    drawn: JointProperties,
    options: &CompileOptions,
) -> &'a StiffenedBeam {
    if let Some(k) = known.iter().position(|other| other.drawn == drawn) {
        return &known[k];
    }
    if known.len() == MAX_CACHED_BEAMS {
        known.clear();
    }
    // a rigid beam is the rods of a single segment, which its one body holds together
    let scheme = if drawn.segments == 0 { Scheme::B } else { options.scheme };
    let cut = scheme.cut(&drawn.bar, drawn.segments.max(1), drawn.wall);
    let strained = if has_springs(options, &drawn.ends) {
        let mut springs = Springs::default();
        (0..cut.pins.len()).map(|k| springs.with(&drawn, &cut, k)).collect()
    } else {
        cut.pins.iter().map(|pin| (pin.stiffness, pin.second)).collect()
    };
    let ends_of_drag = Bar { end_excess: drawn.drag_excess, ..drawn.bar };
    let mut dragged = cut.parts.clone();
    if matches!(scheme, Scheme::E4 | Scheme::Auto) {
        scheme.parts_into(&ends_of_drag, drawn.segments, &mut dragged);
    }
    known.push(StiffenedBeam { drawn, cut, dragged, strained });
    &known[known.len() - 1]
}

/// Springs shared by the joints of one beam, most of which are equal.
#[derive(Default)]
struct Springs {
    /// The last joint away from the ends, and what it is.
    inner: Option<(SegmentJoint, JointStress)>,
    /// The last stiffness, and its inverse.
    own: Option<(Matrix3<f64>, Option<Matrix3<f64>>)>,
}

impl Springs {
    /// [`Springs::with_ends`] of joint `k`.
    fn with(&mut self, drawn: &JointProperties, cut: &SegmentedBeam, k: usize) -> JointStress {
        let pin = &cut.pins[k];
        if k == 0 || k == cut.pins.len() - 1 {
            return self.with_ends(drawn, cut, k);
        }
        let alike =
            |last: &SegmentJoint| (last.stiffness, last.length, last.locked) == (pin.stiffness, pin.length, pin.locked);
        match &self.inner {
            Some((last, (stiffness, _))) if alike(last) => (*stiffness, pin.second),
            _ => {
                let strained = self.with_ends(drawn, cut, k);
                self.inner = Some((*pin, strained));
                strained
            }
        }
    }

    /// Joint `k` of a cut beam with the shear compliance of its segment and the springs of the ends next to it.
    ///
    /// A joint with rigid directions takes the bending part of the springs alone.
    fn with_ends(&mut self, drawn: &JointProperties, cut: &SegmentedBeam, k: usize) -> JointStress {
        let JointProperties { bar, ends, .. } = drawn;
        let pin = &cut.pins[k];
        // without a spring at an end, its joint equals the others to the last bit
        let next = [(k == 0).then_some(&ends[0]), (k == cut.pins.len() - 1).then_some(&ends[1])];
        let next = next.map(|end| end.filter(|end| end.spring != Matrix3::zeros()));
        let mut springs = Matrix3::zeros();
        if let Some(end) = next[0] {
            springs += end.at_joint(pin.at, true);
        }
        if let Some(end) = next[1] {
            springs += end.at_joint(bar.length - pin.at, false);
        }
        let locked = pin.locked != [false; 3];
        if locked {
            let bent = springs[(2, 2)];
            springs = Matrix3::zeros();
            springs[(2, 2)] = bent;
        }
        let plain = (pin.stiffness, pin.second);
        let Some(own) = self.compliance(&pin.stiffness) else { return plain };
        let Some(whole) = (own + springs).cholesky() else { return plain };
        // what only turns has no second-order strain
        let second = if locked || next == [None; 2] {
            pin.second
        } else {
            second_strain(&pin.second, pin.length, &own.fixed_view::<2, 2>(1, 1).into_owned(), next)
        };
        (whole.inverse(), second)
    }

    /// Inverse of a joint's own stiffness.
    fn compliance(&mut self, stiffness: &Matrix3<f64>) -> Option<Matrix3<f64>> {
        match &self.own {
            Some((last, inverse)) if last == stiffness => *inverse,
            _ => {
                let inverse = stiffness.try_inverse();
                self.own = Some((*stiffness, inverse));
                inverse
            }
        }
    }
}

/// Drag per mass of a beam over a gas film (1/s).
pub fn drag_per_mass(beam: &Beam, undamped: bool) -> f64 {
    let m = &beam.material;
    if undamped || m.viscosity == 0.0 { 0.0 } else { m.viscosity / (m.fluid * m.density * beam.thickness) }
}

/// Adds the rods that junctions make part of their nodes' bodies.
pub(super) fn add_rods(
    structure: &Structure,
    options: &CompileOptions,
    ends: &[[JunctionEnd; 2]],
    rigid: &mut RigidGroups,
) {
    for (beam, ends) in structure.beams.iter().zip(ends) {
        let along = Vector2::new(beam.angle.cos(), beam.angle.sin());
        let drag_per_mass = drag_per_mass(beam, options.undamped);
        for (node, end, inwards) in [(beam.a, &ends[0], 1.0), (beam.b, &ends[1], -1.0)] {
            add_rod(beam, end.offset, along * inwards, drag_per_mass, rigid.point(node.0), rigid);
        }
    }
}

/// The rod of that length that a junction makes part of its node's body.
fn add_rod(
    beam: &Beam,
    length: f64,
    along: Vector2<f64>,
    drag_per_mass: f64,
    node: MaterialPoint,
    rigid: &mut RigidGroups,
) {
    if length > 0.0 {
        let mass = beam.material.density * beam.width * beam.thickness * length;
        let second = mass * (length * length / 3.0 + beam.width * beam.width / 12.0);
        let lump = Lump { amount: mass, first: along * (0.5 * length * mass), second };
        rigid.add_mass(node, &lump, drag_per_mass);
    }
}
