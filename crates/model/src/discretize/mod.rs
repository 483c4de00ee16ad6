//! From the drawing to rigid bodies and flexible joints.
//!
//! Nodes become bodies (those that rigid links join become one), beams become segments: rigid bodies at their inner nodes
//! and one joint with three directions at the middle of each segment. Anchored nodes become ground.
//!
//! The paper's four joint types are this one joint: rotary between equal sections (type 1), between different sections
//! (type 2), rotary T (type 3: several joints on one body), prismatic (type 4: the axial direction). A [`Scheme`] says where
//! along a beam they sit and how the mass is shared out.
//!
//! | file | what it holds |
//! |---|---|
//! | [`order`] | model order: how many segments a beam gets |
//! | [`rigid`] | nodes → rigid groups, supports → ground and held directions |
//! | `free_rotation` | rotations that nothing uses, which are held |
//! | `driven_anchors` | anchors whose displacement is an input |
//! | [`anchor_root`] | the compliance of a beam's root at an elastic anchor |
//! | [`junction`] | which beams meet where, and what that does to their ends |
//! | [`junction_limits`] | where a drawing goes beyond the table of junctions |
//! | [`junction_springs`] | offset and spring at the end of a beam |
//! | [`junction_table`] | the springs' numbers, from plane stress |
//! | `sprung` | the second-order strain of segments that end in those springs |
//! | `junction_mass` | mass and drag that junctions have twice, or lack |
//! | [`end_masses`] | how scheme E4 shares the mass of a beam's ends with the bodies of its nodes |
//! | [`overlap`] | mass that is drawn twice where beams meet |
//! | [`scheme`] | ways to cut a beam: places, stiffness and second-order strain of joints, masses |
//! | [`beam`] | a cut beam in the drawing: bodies, masses, joints, points |
//! | [`cubic`] | the cubic beam element, and the next term of its dynamic stiffness |
//! | [`frame`] | the same drawing as a linear frame of cubic beam elements: a baseline |
//! | [`fillet`] | stress concentration at the ends of beams |
//! | [`stressed`] | where the stress along each beam is measured |
//! | `stations` | where along each beam the bodies of its segments measure |
//! | [`ports`] | resistors, heaters, sources and ports → network and quadratic forms of temperature |

pub mod anchor_root;
pub(crate) mod bar;
pub mod beam;
mod contact_mass;
pub mod cubic;
mod driven_anchors;
pub mod end_masses;
mod error;
pub mod fillet;
pub mod frame;
mod free_rotation;
pub mod junction;
pub mod junction_limits;
mod junction_mass;
pub mod junction_springs;
pub mod junction_table;
pub mod order;
pub mod overlap;
pub mod permanent_strain;
pub mod ports;
pub mod rigid;
pub mod scheme;
mod sprung;
mod stations;
pub mod stressed;

pub use crate::options::{Anchors, Junctions, Scheme};
use bimorph_multibody::planar::DOF;
pub use error::{DiscretizeError, MAX_SEGMENTS};
use free_rotation::BodyActions;
use junction_springs::{JunctionEnd, bar_between};
use scheme::Bar;

use crate::options::CompileOptions;
use bimorph_base::budget;
use bimorph_domains::{BeamLine, DeadLoad, Domain, MaterialPoint, Member, PlacedMember, Station, System};
use bimorph_multibody::{BodyId, Coupling, Damper, Joint, Model};
use bimorph_structure::{Beam, Structure};
use nalgebra::{Matrix2, Matrix3, Vector2};
use std::sync::Arc;

/// Of a segment's joint and points, about (byte).
const SEGMENT_BYTES: usize = 600;
/// Of a body, with its share of the tangents and factors that an analysis has, about (byte).
const BODY_BYTES: usize = 1000;

/// A system, and where the drawing's parts went.
#[derive(Debug, Clone)]
pub struct Assembly {
    /// Bodies, joints, gaps, electrics.
    pub system: System,
    /// For each node of the structure, its material point; none for purely electrical nodes.
    pub nodes: Vec<Option<MaterialPoint>>,
    /// For each beam, the equally spaced points along its centreline, ends included: one more than its segments.
    pub beams: Vec<Arc<[MaterialPoint]>>,
    /// For each beam, what the junctions at its start and its end take of its length (m).
    pub offsets: Vec<[f64; 2]>,
    /// Effects of junctions on the structure.
    ends: Arc<junction::JunctionEnds>,
    /// For each beam, the excess of its ends.
    end_excess: Vec<scheme::EndExcess>,
    /// For each beam, its joints, for the stress along it.
    pub stressed: Vec<stressed::StressedBeam>,
    /// For each heater of the electrics, its beam in the structure.
    pub heaters: Vec<usize>,
    /// Name of each gap of the system, which come before what acts without two sides.
    pub gap_names: Vec<String>,
}

impl Assembly {
    /// The bar of each beam between its junctions, as the model has it.
    pub(crate) fn bars(&self, structure: &Structure, options: &CompileOptions) -> Vec<Bar> {
        let one = |((beam, ends), excess): ((&Beam, &[JunctionEnd; 2]), &scheme::EndExcess)| Bar {
            end_excess: excess.mass,
            ..bar_between(beam, options, ends)
        };
        structure.beams.iter().zip(&self.ends.beams).zip(&self.end_excess).map(one).collect()
    }

    /// For each beam, the junctions at its start and its end.
    pub(crate) fn junctions(&self) -> &[[JunctionEnd; 2]] {
        &self.ends.beams
    }
}

/// Turns a drawing into a system.
///
/// # Errors
/// See [`DiscretizeError`].
pub fn discretize(structure: &Structure, options: &CompileOptions) -> Result<Assembly, DiscretizeError> {
    discretize_with(structure, options, &order::a_priori(structure, options)?)
}

/// The same with the number of segments of each beam; 0: a rigid beam, which makes one body of its two nodes.
///
/// # Errors
/// See [`DiscretizeError`].
pub fn discretize_with(
    structure: &Structure,
    options: &CompileOptions,
    segments: &[usize],
) -> Result<Assembly, DiscretizeError> {
    discretize_like(structure, options, segments, None)
}

/// As [`discretize`], where `other` is the same structure on another mesh; parts independent of the mesh are reused.
///
/// # Errors
/// See [`DiscretizeError`].
pub fn discretize_like(
    structure: &Structure,
    options: &CompileOptions,
    segments: &[usize],
    other: Option<&Assembly>,
) -> Result<Assembly, DiscretizeError> {
    let total = segments.iter().fold(0, |sum: usize, n| sum.saturating_add(*n));
    if total > MAX_SEGMENTS {
        return Err(DiscretizeError::TooFine { segments: total });
    }
    // check the bodies inside beams, a lower bound, before any allocation
    budget::unknowns(DOF * segments.iter().map(|n| n.saturating_sub(1)).sum::<usize>());
    budget::lay_out(total * SEGMENT_BYTES);
    if structure.nodes.is_empty() {
        return Err(DiscretizeError::NothingDrawn);
    }
    let stiff: Vec<bool> = segments.iter().map(|n| *n == 0).collect();
    let mut rigid = rigid::RigidGroups::new(structure, &stiff);
    let mut laid = beam::JointBuilder::default();
    // a joint for each segment and a body between any two; a wall has a joint more
    laid.joints.reserve(total + segments.len() + structure.springs.len() + structure.supports.len());
    rigid.bodies.reserve(total);
    let mut dampers: Vec<Damper> = Vec::new();
    let mut beams = Vec::with_capacity(structure.beams.len());
    let mut heaters = Vec::new();
    let ends = match other {
        Some(other) => Arc::clone(&other.ends),
        None => Arc::new(junction::find(structure, &rigid, options)),
    };
    weigh_nodes(structure, options, &ends, &mut rigid);
    let end_excess = end_masses::excess(structure, options, &ends.beams, segments, &rigid);
    for (index, drawn) in structure.beams.iter().enumerate() {
        budget::check();
        let heater = drawn.heater.is_some().then(|| {
            heaters.push(index);
            heaters.len() - 1
        });
        let ends = beam::BeamEnds { junctions: &ends.beams[index], excess: end_excess[index] };
        beams.push(beam::lay(drawn, segments[index], heater, options, &ends, &mut rigid, &mut laid));
    }
    let beam::JointBuilder { mut joints, couplings: mut coupled, of_beams, .. } = laid;
    for spring in &structure.springs {
        lay_spring(spring, options.undamped, &rigid, &mut joints, &mut dampers);
    }
    let stations = stations::of_beams(structure, &beams, &ends, &rigid);
    let gaps = lay_members(structure, options, &mut rigid, &stations);
    lay_dampers(&gaps, options.undamped, &mut dampers);
    let acting = BodyActions { structure, joints: &joints, dampers: &dampers, members: &gaps, elements: &[] };
    free_rotation::hold(&acting, &mut rigid);
    let driven = rigid.hold_hinges(structure, &mut joints);
    let mut couplings = couplings(&gaps);
    let load = |l: &bimorph_structure::Load| {
        let force = Vector2::new(l.force[0], l.force[1]);
        DeadLoad { point: rigid.point(l.node.0), force, moment: l.moment }
    };
    let loads: Vec<DeadLoad> = structure.loads.iter().map(load).collect();
    let electrics = match other {
        Some(other) => Arc::clone(&other.system.electrics),
        None => Arc::new(driven_anchors::give_inputs(ports::lay(structure, &heaters, &gaps, &rigid)?, &driven)),
    };
    couplings.extend(ports::floating_pairs(&electrics, &gaps));
    if rigid.bodies.is_empty() {
        return Err(DiscretizeError::NothingMoves);
    }
    budget::lay_out(rigid.bodies.len() * BODY_BYTES);
    let bodies = contact_mass::weighed(rigid.finish_bodies(), &gaps, options);
    let of_joints = joints.iter_mut().map(|joint| (joint.a, joint.b, &mut joint.frame));
    let of_dampers = dampers.iter_mut().map(|damper| (damper.a, damper.b, &mut damper.frame));
    of_joints.chain(of_dampers).for_each(|(a, b, frame)| rigid.center(a, b, frame));
    couplings.extend(coupled.iter().flat_map(Coupling::pairs));
    let (model, order) = Model::ordered(bodies, joints, dampers, &couplings, options.linear);
    let (place, stressed) = (order.bodies, stressed::beams(structure, &of_beams, &order.joints));
    for Coupling { first, second, .. } in &mut coupled {
        let placed = |id: BodyId| if let BodyId::Free(k) = id { BodyId::Free(place[k]) } else { id };
        (*first, *second) = ((placed(first.0), placed(first.1)), (placed(second.0), placed(second.1)));
    }
    let model = model.couple(coupled);
    let moved = |p: MaterialPoint| rigid.centered(p, &place);
    let gap_names = gaps.iter().filter(|laid| laid.member.is_gap()).map(|laid| laid.name.to_owned()).collect();
    let beams: Vec<Arc<[MaterialPoint]>> =
        beams.into_iter().map(|points| points.into_iter().map(moved).collect()).collect();
    let mut system = System {
        beams: Arc::new(structure.beams.iter().zip(&beams).map(|(drawn, points)| line(drawn, points)).collect()),
        model,
        members: gaps.into_iter().map(|laid| laid.member.moved(&moved)).collect(),
        loads: loads.into_iter().map(|l| DeadLoad { point: moved(l.point), ..l }).collect(),
        anchors: driven_anchors::placed(driven, &order.joints, &moved),
        electrics,
        length_scale: length_scale(structure),
    };
    system.settle_impacts();
    let nodes =
        (0..structure.nodes.len()).map(|n| structure.nodes[n].mechanical.then(|| moved(rigid.point(n)))).collect();
    let offsets = ends.beams.iter().map(|[a, b]| [a.offset, b.offset]).collect();
    Ok(Assembly { system, nodes, beams, offsets, ends, end_excess, stressed, heaters, gap_names })
}

impl Assembly {
    /// The beams whose junctions are beyond what the table was made from.
    pub fn beyond_table(&self, structure: &Structure) -> Option<junction_limits::Beyond> {
        junction_limits::beyond(structure, &self.ends)
    }
}

/// The smallest width of a beam, or gap of plates and combs (m); 1 µm without any.
fn length_scale(structure: &Structure) -> f64 {
    let narrowest = structure.beams.iter().map(|b| b.width).fold(f64::INFINITY, f64::min);
    let gaps = structure.plate_gaps.iter().map(|g| g.gap).chain(structure.combs.iter().map(|c| c.gap));
    let scale = gaps.fold(narrowest, f64::min);
    if scale.is_finite() { scale } else { 1e-6 }
}

/// The centreline of a beam.
fn line(drawn: &bimorph_structure::Beam, points: &Arc<[MaterialPoint]>) -> BeamLine {
    BeamLine {
        name: drawn.name.as_str().into(),
        points: Arc::clone(points),
        angle: drawn.angle,
        length: drawn.length,
        rigidity: drawn.material.youngs_modulus * drawn.thickness * drawn.width.powi(3) / 12.0,
        width: drawn.width,
    }
}

/// Adds what the bodies of nodes weigh without the beams between their junctions.
fn weigh_nodes(
    structure: &Structure,
    options: &CompileOptions,
    ends: &junction::JunctionEnds,
    rigid: &mut rigid::RigidGroups,
) {
    beam::add_rods(structure, options, &ends.beams, rigid);
    for excess in &ends.excess {
        excess.add_to(rigid);
    }
    for mass in &structure.masses {
        rigid.add_plate(mass, options.undamped);
    }
}

/// Members of the mechanism, with bodies for their states. An undamped model has none that only damp.
fn lay_members<'a>(
    structure: &'a Structure,
    options: &CompileOptions,
    rigid: &mut rigid::RigidGroups,
    stations: &[Vec<Station>],
) -> Vec<PlacedMember<'a, Member>> {
    let film_states = if options.undamped { Vec::new() } else { rigid.add_film_states(structure) };
    let mut laid = rigid.gaps(structure, options.as_sugar, stations, &film_states);
    laid.retain(|laid| !(options.undamped && laid.member.is_gas()));
    laid
}

/// The pairs of bodies that gaps couple.
fn couplings(gaps: &[PlacedMember<'_, Member>]) -> Vec<(BodyId, BodyId)> {
    let mut pairs = Vec::new();
    gaps.iter().for_each(|laid| laid.member.pairs(|a, b| pairs.push((a, b))));
    pairs
}

/// The dampers that laws have, none of an undamped model.
fn lay_dampers(gaps: &[PlacedMember<'_, Member>], undamped: bool, dampers: &mut Vec<Damper>) {
    if !undamped {
        gaps.iter().for_each(|laid| laid.member.dampers(|damper| dampers.push(damper)));
    }
}

/// A lumped spring and damper: a joint half way between its two nodes.
fn lay_spring(
    spring: &bimorph_structure::SpringDamper,
    undamped: bool,
    rigid: &rigid::RigidGroups,
    joints: &mut Vec<Joint>,
    dampers: &mut Vec<Damper>,
) {
    let (a, b) = (rigid.point(spring.a.0), rigid.point(spring.b.0));
    if a.body == b.body {
        return;
    }
    let frame = rigid.frame(spring.a.0, spring.b.0, spring.angle);
    if spring.stiffness.iter().any(|&k| k != 0.0) {
        joints.push(Joint {
            a: a.body,
            b: b.body,
            frame,
            stiffness: Matrix3::from_diagonal(&spring.stiffness.into()),
            second: Matrix2::zeros(),
            expansion: None,
            rest: 0.0,
            locked: [false; 3],
        });
    }
    if !undamped && spring.damping.iter().any(|&c| c != 0.0) {
        dampers.push(Damper { a: a.body, b: b.body, frame, coefficients: spring.damping.into() });
    }
}
