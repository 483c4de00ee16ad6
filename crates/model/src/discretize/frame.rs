//! A linear frame of cubic beam elements: a baseline, and what SUGAR computes.
//!
//! Each beam is one or more Euler–Bernoulli elements with cubic deflection and linear stretch, consistent mass, and gas
//! drag in proportion to it; small displacements about the drawn geometry. One element is exact for static loads at its
//! ends; its first clamped-clamped mode it cannot see at all, so that a frame with one element for each beam misses modes.
//!
//! With `shear` the element is Timoshenko's: shear flexibility with Φ = 12EI/(κGA·h²), κ = 5/6, in stiffness and mass, and the
//! rotary inertia of the section, which wide beams show. SUGAR has neither.
//!
//! Rigid links, plates, supports, springs and loads are those of the drawing. A node that lies at r from the reference
//! point of its rigid group moves as u = q + θ × r. Combs and gaps are omitted, or included with their stiffness.
//!
//! Reference: J. S. Przemieniecki, "Theory of Matrix Structural Analysis" (1968), §5.6 and §11.3, for the element; J. V.
//! Clark et al., "Addressing the needs of complex MEMS design", MEMS 2002, for SUGAR.

use super::bar::bar;
use super::free_rotation::{self, BodyActions};
use super::rigid::PlacedAnchor;
use super::rigid::RigidGroups;
use super::{DiscretizeError, cubic, lay_spring, order};
use bimorph_domains::{Domain, MaterialPoint, Member};
use bimorph_multibody::linear_system::{LinearSystem, add_pair};
use bimorph_multibody::planar::{DOF, JointFrame, Pose};
use bimorph_multibody::{BodyId, BodyName, Joint};
use bimorph_structure::{Beam, Structure};
use nalgebra::{Matrix3, Matrix3x6, Matrix6, Vector2, Vector3, Vector6};
use std::sync::Arc;

/// How many elements a beam gets.
#[derive(Debug, Clone, PartialEq)]
pub enum ElementCount {
    /// The same number for every beam; 1 is what SUGAR does.
    Each(usize),
    /// By the highest frequency to be resolved (Hz) and the relative error: the rule of [`order`], since a cubic element
    /// has the frequency error of a segment, (kh)⁴/1440.
    Band(f64, f64),
    /// As many as given for each beam.
    Beams(Vec<usize>),
}

/// Treatment of combs, plates and facing beams.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameGaps {
    /// They are left out.
    LeftOut,
    /// The field in them is there to be added to the stiffness; `chord`: along straight lines between facing beams, as SUGAR has them.
    Laid {
        /// Along straight lines.
        chord: bool,
    },
}

/// How a drawing is made into a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameOptions {
    /// How many elements a beam gets.
    pub elements: ElementCount,
    /// With shear flexibility and rotary inertia.
    pub shear: bool,
    /// Leave out gas damping.
    pub undamped: bool,
    /// Treatment of gaps.
    pub gaps: FrameGaps,
}

/// A linear frame, and where the drawing's parts went.
#[derive(Debug, Clone)]
pub struct LinearFrame {
    /// K, M, C.
    pub system: LinearSystem,
    /// Forces of the dead loads and of strains that are built in or prescribed.
    pub load: Vec<Pose>,
    /// For each heated beam, the forces per free strain (N, N·m).
    pub expansion: Vec<Vec<Pose>>,
    /// For each node of the structure, its material point; none for purely electrical nodes.
    pub nodes: Vec<Option<MaterialPoint>>,
    /// For each beam, the points along its centreline, ends included.
    pub beams: Vec<Vec<MaterialPoint>>,
    /// Gaps in the order of the product's own; none where they are left out.
    pub gaps: Vec<Member>,
}

/// Assembles the frame of a drawing.
///
/// # Errors
/// See [`DiscretizeError`].
pub fn assemble(structure: &Structure, options: &FrameOptions) -> Result<LinearFrame, DiscretizeError> {
    let undamped = options.undamped;
    let mut rigid = RigidGroups::new(structure, &[]);
    let (pieces, beams) = cut(structure, &options.elements, &mut rigid)?;
    if rigid.bodies.is_empty() {
        return Err(DiscretizeError::NothingMoves);
    }
    let (mut joints, mut dampers) = (Vec::new(), Vec::new());
    for spring in &structure.springs {
        lay_spring(spring, undamped, &rigid, &mut joints, &mut dampers);
    }
    let mut gaps = rigid.gaps(structure, options.gaps == FrameGaps::Laid { chord: true }, &[], &[]);
    if options.gaps == FrameGaps::LeftOut {
        gaps.retain(|laid| !laid.member.is_gap());
    }
    super::lay_dampers(&gaps, undamped, &mut dampers);
    let ends: Vec<BodyId> = pieces.iter().flat_map(|piece| [piece.from.body, piece.to.body]).collect();
    let acting = BodyActions { structure, joints: &joints, dampers: &dampers, members: &gaps, elements: &ends };
    free_rotation::hold(&acting, &mut rigid);
    let driven = rigid.hold_hinges(structure, &mut joints);
    let couplings: Vec<(BodyId, BodyId)> = (pieces.iter().map(|p| (p.from.body, p.to.body)))
        .chain(joints.iter().map(|j: &Joint| (j.a, j.b)))
        .chain(dampers.iter().map(|d| (d.a, d.b)))
        .chain(super::couplings(&gaps))
        .collect();
    let bodies = rigid.finish_bodies().into_iter().map(|b| (b.name.to_string(), b.free.map(|p| *p))).collect();
    let (mut system, place) = LinearSystem::new(bodies, &couplings);
    let moved = |id: BodyId| match id {
        BodyId::Ground => id,
        BodyId::Free(k) => BodyId::Free(place[k]),
    };
    let n = system.bodies();
    let mut load = vec![Pose::zeros(); n];
    let heated: Vec<usize> = (0..structure.beams.len()).filter(|&k| structure.beams[k].heater.is_some()).collect();
    let mut expansion = vec![vec![Pose::zeros(); n]; heated.len()];
    let add = |system: &mut LinearSystem, a: BodyId, b: BodyId, k: &Matrix6<f64>, m: &Matrix6<f64>, drag: f64| {
        let (a, b) = (moved(a), moved(b));
        add_pair(&mut system.stiffness, &system.pattern, a, b, k);
        add_pair(&mut system.mass, &system.pattern, a, b, m);
        add_pair(&mut system.damping, &system.pattern, a, b, &(m * drag));
    };
    for piece in &pieces {
        let (k, m, push) = piece.matrices(options.shear);
        add(&mut system, piece.from.body, piece.to.body, &k, &m, if undamped { 0.0 } else { piece.drag_per_mass() });
        let ends = [(moved(piece.from.body), 0), (moved(piece.to.body), 3)];
        let material = &piece.beam.material;
        let strain =
            piece.beam.temperature.map_or(0.0, |t| material.free_strain(t)) - material.stress / material.youngs_modulus;
        let heater = heated.binary_search(&piece.index).ok();
        for (id, row) in ends {
            if let BodyId::Free(body) = id {
                let force: Vector3<f64> = push.fixed_rows::<DOF>(row).into_owned();
                load[body] += force * strain;
                if let Some(heater) = heater {
                    expansion[heater][body] += force;
                }
            }
        }
    }
    for joint in &joints {
        let k = pair_matrix(&joint.frame, &joint.stiffness);
        add(&mut system, joint.a, joint.b, &k, &Matrix6::zeros(), 0.0);
        if joint.rest != 0.0 {
            let push = rows(&joint.frame).transpose() * joint.stiffness * Vector3::new(joint.rest, 0.0, 0.0);
            for (id, row) in [(moved(joint.a), 0), (moved(joint.b), 3)] {
                if let BodyId::Free(body) = id {
                    load[body] += push.fixed_rows::<DOF>(row);
                }
            }
        }
    }
    for damper in &dampers {
        let c = pair_matrix(&damper.frame, &Matrix3::from_diagonal(&damper.coefficients));
        add_pair(&mut system.damping, &system.pattern, moved(damper.a), moved(damper.b), &c);
    }
    for plate in &structure.masses {
        let point = rigid.point(plate.node.0);
        if let BodyId::Free(k) = moved(point.body) {
            let g = carry(point.arm);
            let diagonal = |t: f64, r: f64| g.transpose() * Matrix3::from_diagonal(&Vector3::new(t, t, r)) * g;
            system.mass.diagonal[k] += diagonal(plate.mass, plate.inertia);
            if !undamped {
                system.damping.diagonal[k] += diagonal(plate.drag[0], plate.drag[1]);
            }
        }
    }
    for force in &structure.loads {
        let point = rigid.point(force.node.0);
        if let BodyId::Free(k) = moved(point.body) {
            load[k] += carry(point.arm).transpose() * Vector3::new(force.force[0], force.force[1], force.moment);
        }
    }
    add_anchors(&driven, moved, &mut load);
    let placed = |point: MaterialPoint| MaterialPoint { body: moved(point.body), ..point };
    let nodes =
        (0..structure.nodes.len()).map(|n| structure.nodes[n].mechanical.then(|| placed(rigid.point(n)))).collect();
    let beams = beams.into_iter().map(|points| points.into_iter().map(placed).collect()).collect();
    let gaps = gaps.into_iter().map(|laid| laid.member.moved(&placed)).collect();
    Ok(LinearFrame { system, load, expansion, nodes, beams, gaps })
}

/// The loads that hold anchors at the places of the drawing.
fn add_anchors(driven: &[PlacedAnchor], moved: impl Fn(BodyId) -> BodyId, load: &mut [Pose]) {
    for PlacedAnchor { anchor, .. } in driven {
        if let BodyId::Free(k) = moved(anchor.point.body) {
            let pull = Vector3::from(anchor.stiffness).component_mul(&Vector3::from(anchor.drawn));
            load[k] += carry(anchor.point.arm).transpose() * pull;
        }
    }
}

/// The elements of every beam, and the points between them along its centreline, ends included.
fn cut<'a>(
    structure: &'a Structure,
    elements: &ElementCount,
    rigid: &mut RigidGroups,
) -> Result<(Vec<FrameElement<'a>>, Vec<Vec<MaterialPoint>>), DiscretizeError> {
    let mut pieces: Vec<FrameElement<'_>> = Vec::new();
    let mut beams: Vec<Vec<MaterialPoint>> = Vec::with_capacity(structure.beams.len());
    for (index, beam) in structure.beams.iter().enumerate() {
        order::check(beam)?;
        let count = match elements {
            ElementCount::Each(n) => (*n).max(1),
            ElementCount::Band(band, tol) => order::segments(beam, Some(*band), *tol),
            ElementCount::Beams(counts) => counts[index],
        };
        let (start, end) = (rigid.position(beam.a.0), rigid.position(beam.b.0));
        let mut from = rigid.point(beam.a.0);
        let mut points = vec![from];
        let name = Arc::from(beam.name.as_str());
        for k in 1..=count {
            let at = start + (end - start) * (k as f64 / count as f64);
            let to =
                if k == count { rigid.point(beam.b.0) } else { rigid.add_segment(BodyName::segment(&name, k), at) };
            pieces.push(FrameElement { index, beam, from, to, length: beam.length / count as f64 });
            points.push(to);
            from = to;
        }
        beams.push(points);
    }
    Ok((pieces, beams))
}

/// One element.
struct FrameElement<'a> {
    /// Of its beam in the structure.
    index: usize,
    beam: &'a Beam,
    from: MaterialPoint,
    to: MaterialPoint,
    length: f64,
}

impl FrameElement<'_> {
    fn drag_per_mass(&self) -> f64 {
        let m = &self.beam.material;
        if m.viscosity == 0.0 { 0.0 } else { m.viscosity / (m.fluid * m.density * self.beam.thickness) }
    }

    /// Stiffness, mass, and force per free strain, on the coordinates of the two bodies.
    fn matrices(&self, shear: bool) -> (Matrix6<f64>, Matrix6<f64>, Vector6<f64>) {
        let h = self.length;
        let bar = bar(self.beam, shear, shear);
        let (k, m, a) = (cubic::stiffness(&bar, h), cubic::mass(&bar, h), bar.ea / h);
        let (s, c) = self.beam.angle.sin_cos();
        let turn = Matrix3::new(c, s, 0.0, -s, c, 0.0, 0.0, 0.0, 1.0);
        let mut t = Matrix6::zeros();
        t.fixed_view_mut::<DOF, DOF>(0, 0).copy_from(&(turn * carry(self.from.arm)));
        t.fixed_view_mut::<DOF, DOF>(DOF, DOF).copy_from(&(turn * carry(self.to.arm)));
        let push = t.transpose() * Vector6::new(-a * h, 0.0, 0.0, a * h, 0.0, 0.0);
        (t.transpose() * k * t, t.transpose() * m * t, push)
    }
}

/// The displacement of the point at `arm` from that of its body's reference point.
fn carry(arm: Vector2<f64>) -> Matrix3<f64> {
    Matrix3::new(1.0, 0.0, -arm.y, 0.0, 1.0, arm.x, 0.0, 0.0, 1.0)
}

/// Strains of a joint per displacement of its two bodies.
fn rows(frame: &JointFrame) -> Matrix3x6<f64> {
    let rest = Pose::zeros();
    frame.kinematics(&rest, &rest, &[0.0; 3]).rows()
}

fn pair_matrix(frame: &JointFrame, coefficients: &Matrix3<f64>) -> Matrix6<f64> {
    let rows = rows(frame);
    rows.transpose() * coefficients * rows
}
