//! How far the frequencies of a model are from those of the beams that it was cut from.
//!
//! The joints of E4 and B are exact for loads at the nodes, so that their stiffness over the nodes' (x, y, θ) is that
//! of the cubic frame on the same mesh, also about a loaded equilibrium. The mass differs: lumps here, and M_r = M_c +
//! λ·M₂ for the beam itself. M_r is the consistent mass with the next term of the exact dynamic stiffness ([`cubic`](crate::discretize::cubic)),
//! whose error is only O((kh)⁸). With y, λ a mode of the model, one inverse iteration
//! ```text
//! K·x = λ·M_r·y
//! ```
//! and Rayleigh–Ritz with K and M_r over the block of all x give the reference λ_r; the estimate is √(λ/λ_r) − 1, signed.
//! K is the model's own tangent. The identity
//! ```text
//! (λ − λ_r)/λ = xᵀ(M_r − M)y / xᵀM_r·y
//! ```
//! splits it into what each beam contributes.
//!
//! The other schemes have another stiffness as well: there K and M_c are those of a cubic frame that is assembled for the
//! purpose, about the drawn geometry, and a beam's contribution is taken as its kinetic energy times (kh)^order.
//!
//! Segments at the ends of beams have the springs of the junctions there (`span`): a spring moves the mass of the segment as well, of which the lumps, which the
//! bodies of the nodes carry, know nothing.
//!
//! Reason for M₂: the cubic element's own error is +(kh)⁴/1440 where that of E4 is −(kh)⁴/1440. The distance of the two
//! is therefore twice the error inside a long beam, and anything between once and many times it where the ends
//! contribute.
//!
//! Under an axial force N the exact dynamic stiffness of a beam has further terms of the second order, N·λ·A and N²·B
//! ([`second_tension`](crate::discretize::cubic::second_tension)), which segments lack. The reference is K − N²B with M_r + N·A. Compression makes the
//! model too stiff; tension may make it too soft or too stiff.
//!
//! Modes of the model and of the reference are paired by shape ([`mac`](bimorph_solve::frequency::mac)), not by place: their frequencies may cross.
//!
//! Directions along and across a beam are those of the drawing, also about an equilibrium: right as long as beams turn by
//! small angles.
//!
//! Valid for modes that the nodes can show: kh < 4.73, which [`mesh_search`](super::mesh_search) ensures.

use super::reference::{Pencil, ReferenceModes, compare};
use super::span::{BeamSpan, spans};
use crate::discretize::bar::bar;
use crate::discretize::frame::{ElementCount, FrameGaps, FrameOptions, LinearFrame, assemble};
use crate::discretize::junction_springs::JunctionEnd;
use crate::discretize::scheme::Bar;
use crate::discretize::{Assembly, order};
use crate::options::{CompileOptions, Scheme};
use bimorph_multibody::linear_system::LinearSystem;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyId, BodyMatrix, Model};
use bimorph_structure::Structure;
use nalgebra::Vector3;

/// Estimated errors of modes.
#[derive(Debug, Clone, PartialEq)]
pub struct ModeErrors {
    /// For each mode, (f − f_beam)/f_beam (1); 0 for a rigid motion.
    pub relative: Vec<f64>,
    /// For each mode, λ = ω² of the beams (rad²/s²).
    pub reference: Vec<f64>,
    /// For each mode, how much of it is in the reference modes of that frequency, 0…1; near 1 where the pairing is sure.
    pub likeness: Vec<f64>,
    /// For each mode, what each beam contributes to it (1).
    pub shares: Vec<Vec<f64>>,
}

impl ModeErrors {
    /// The same with shares that add up to no less than the error of their mode.
    pub(super) fn scaled_to_whole(&self) -> Self {
        let scaled = |(shares, error): (&Vec<f64>, &f64)| {
            let sum: f64 = shares.iter().map(|share| share.abs()).sum();
            let scale = if sum > 0.0 { (error.abs() / sum).max(1.0) } else { 1.0 };
            shares.iter().map(|share| share * scale).collect()
        };
        Self { shares: self.shares.iter().zip(&self.relative).map(scaled).collect(), ..self.clone() }
    }
}

/// For each mode, the share of each beam in its strain energy (1): a beam held rigid raises the frequency by about half of
/// it, relatively.
pub fn strain_shares(
    structure: &Structure,
    options: &CompileOptions,
    parts: &Assembly,
    lambda: &[f64],
    shapes: &[Vec<Pose>],
) -> Vec<Vec<f64>> {
    let bars = parts.bars(structure, options);
    let spans = spans(structure, options, (&parts.beams, parts.junctions(), &bars), false);
    let share = |(shape, lambda): (&Vec<Pose>, &f64)| {
        let one = |(span, bar): (&BeamSpan, &Bar)| {
            let x = span.local(shape);
            span.segments(&x, &span.stiffness(bar)).iter().zip(&x).map(|(f, x)| f.dot(x)).sum::<f64>() / lambda
        };
        spans.iter().zip(&bars).map(one).collect()
    };
    shapes.iter().zip(lambda).map(share).collect()
}

/// True where the model's tangent is that of the cubic frame: schemes E4 and B without rigid beams. Only then is the
/// estimate that of a loaded equilibrium too.
pub fn own_stiffness(options: &CompileOptions, parts: &Assembly) -> bool {
    let exact = matches!(options.scheme, Scheme::Auto | Scheme::E4 | Scheme::B);
    exact && parts.beams.iter().all(|points| points.len() > 2 || points[0].body != points[1].body)
}

/// Errors of modes of a model about the drawn geometry. `factor` is that of K − `shift`·M.
pub fn of_modes(
    structure: &Structure,
    options: &CompileOptions,
    parts: &Assembly,
    factor: (&BodyMatrix, f64),
    lambda: &[f64],
    shapes: &[Vec<Pose>],
) -> Option<ModeErrors> {
    of_loaded_modes(structure, options, parts, factor, &[], (lambda, shapes))
}

/// The same at an operating point where the beams carry these axial forces, tension positive (N); none: no beam has any.
pub fn of_loaded_modes(
    structure: &Structure,
    options: &CompileOptions,
    parts: &Assembly,
    factor: (&BodyMatrix, f64),
    axial: &[f64],
    (lambda, shapes): (&[f64], &[Vec<Pose>]),
) -> Option<ModeErrors> {
    if !own_stiffness(options, parts) {
        return by_frame(structure, options, parts, lambda, shapes);
    }
    let (ReferenceModes { reference, likeness, x, norms }, spans) =
        compared(structure, options, parts, factor, axial, (lambda, shapes))?;
    let shares = (shapes.iter().zip(&x).zip(lambda.iter().zip(&norms)))
        .map(|((y, x), (&lambda, norm))| {
            let share = |span: &BeamSpan| {
                let (y, x) = (span.local(y), span.local(x));
                let of = |f: Vec<Vector3<f64>>| f.iter().zip(&x).map(|(f, x)| f.dot(x)).sum::<f64>();
                let softer = if lambda > 0.0 { of(span.segments(&y, &span.softer)) / lambda } else { 0.0 };
                0.5 * (of(span.defect(&y, lambda)) + softer) / norm
            };
            spans.iter().map(share).collect()
        })
        .collect();
    Some(ModeErrors { relative: relative(lambda, &reference), reference, likeness, shares })
}

/// [`ModeErrors::relative`] and [`ModeErrors::likeness`] of each mode alone.
pub fn relative_of_loaded_modes(
    structure: &Structure,
    options: &CompileOptions,
    parts: &Assembly,
    factor: (&BodyMatrix, f64),
    axial: &[f64],
    (lambda, shapes): (&[f64], &[Vec<Pose>]),
) -> Option<Vec<(f64, f64)>> {
    let (reference, likeness) = if own_stiffness(options, parts) {
        let found = compared(structure, options, parts, factor, axial, (lambda, shapes))?.0;
        (found.reference, found.likeness)
    } else {
        let found = by_frame(structure, options, parts, lambda, shapes)?;
        (found.reference, found.likeness)
    };
    Some(relative(lambda, &reference).into_iter().zip(likeness).collect())
}

/// Modes and those of the reference, where the tangent is that of the cubic frame.
fn compared(
    structure: &Structure,
    options: &CompileOptions,
    parts: &Assembly,
    (factor, shift): (&BodyMatrix, f64),
    axial: &[f64],
    (lambda, shapes): (&[f64], &[Vec<Pose>]),
) -> Option<(ReferenceModes, Vec<BeamSpan>)> {
    let model = &parts.system.model;
    let bars = parts.bars(structure, options);
    let mut spans = spans(structure, options, (&parts.beams, parts.junctions(), &bars), true);
    for ((span, bar), force) in spans.iter_mut().zip(&bars).zip(axial) {
        span.tighten(bar, *force);
    }
    let mass = |x: &[Pose]| x.iter().enumerate().map(|(k, x)| model.mass(k).component_mul(x)).collect();
    let project = |x: &mut [Pose]| model.project(x);
    let pencil = Pencil { factor, pattern: &model.pattern, shift, mass: &mass, project: &project };
    let compared = compare(&pencil, &spans, lambda, shapes)?;
    Some((compared, spans))
}

/// Relative errors of frequencies; 0 for rigid motions.
pub fn relative(lambda: &[f64], reference: &[f64]) -> Vec<f64> {
    // a rigid motion has what rounding leaves of 0
    let rigid = 1e-13 * lambda.last().map_or(0.0, |l| l.abs());
    let error = |(l, r): (&f64, &f64)| if *l <= rigid || *r <= rigid { 0.0 } else { (l / r).sqrt() - 1.0 };
    lambda.iter().zip(reference).map(error).collect()
}

/// Errors against a cubic frame on the same mesh, about the drawn geometry.
fn by_frame(
    structure: &Structure,
    options: &CompileOptions,
    parts: &Assembly,
    lambda: &[f64],
    shapes: &[Vec<Pose>],
) -> Option<ModeErrors> {
    // a frame of centrelines says nothing about other junctions
    if parts.offsets.iter().flatten().any(|o| *o != 0.0) {
        return None;
    }
    let elements = ElementCount::Beams(parts.beams.iter().map(|b| b.len() - 1).collect());
    let gaps = FrameGaps::LeftOut;
    let frame = assemble(structure, &FrameOptions { elements, shear: options.shear, undamped: true, gaps }).ok()?;
    let system = &frame.system;
    let mut shift = 0.0;
    let mut factor = system.combine(1.0, 0.0, 0.0);
    if factor.factor(&system.pattern).is_err() {
        shift = -1e-6 * lambda.last()?.abs();
        factor = system.combine(1.0, -shift, 0.0);
        factor.factor(&system.pattern).ok()?;
    }
    let shapes: Vec<Vec<Pose>> = shapes.iter().map(|x| to_frame(&parts.system.model, parts, &frame, x)).collect();
    // those of the frame, which has no junctions
    let bars: Vec<Bar> = structure.beams.iter().map(|beam| bar(beam, options.shear, options.rotary_inertia)).collect();
    let junctions = vec![<[JunctionEnd; 2]>::default(); bars.len()];
    let spans = spans(structure, options, (&frame.beams, &junctions, &bars), false);
    let mass = |x: &[Pose]| multiply(system, x);
    let project = |x: &mut [Pose]| system.project(x);
    let pencil = Pencil { factor: &factor, pattern: &system.pattern, shift, mass: &mass, project: &project };
    let ReferenceModes { reference, likeness, .. } = compare(&pencil, &spans, lambda, &shapes)?;
    let relative = relative(lambda, &reference);
    let shares = (shapes.iter().zip(lambda).zip(&relative))
        .map(|((y, &lambda), error)| {
            let band = lambda.max(0.0).sqrt() / std::f64::consts::TAU;
            let weights: Vec<f64> = (structure.beams.iter().zip(&spans))
                .map(|(beam, span)| {
                    let kh = order::waves(beam, band) / (span.points.len() - 1) as f64;
                    let moved = span.local(y).iter().map(|p| p.x * p.x + p.y * p.y).sum::<f64>();
                    moved * beam.width * beam.thickness * beam.length * kh.powi(options.scheme.order())
                })
                .collect();
            let sum: f64 = weights.iter().sum();
            weights.iter().map(|w| if sum > 0.0 { error * w / sum } else { 0.0 }).collect()
        })
        .collect();
    Some(ModeErrors { relative, reference, likeness, shares })
}

fn multiply(system: &LinearSystem, x: &[Pose]) -> Vec<Pose> {
    let mut y = vec![Pose::zeros(); x.len()];
    system.mass.multiply_add(&system.pattern, x, &mut y);
    y
}

/// A shape of the model over the bodies of the frame.
fn to_frame(model: &Model, parts: &Assembly, frame: &LinearFrame, x: &[Pose]) -> Vec<Pose> {
    let mut y = vec![Pose::zeros(); frame.system.bodies()];
    let pairs = (frame.nodes.iter().zip(&parts.nodes))
        .filter_map(|(to, from)| Some((*to.as_ref()?, *from.as_ref()?)))
        .chain(frame.beams.iter().flatten().copied().zip(parts.beams.iter().flat_map(|points| points.iter()).copied()));
    for (to, from) in pairs {
        if let BodyId::Free(k) = to.body {
            let pose = Model::pose(x, from.body);
            // from the centre of mass to the point, and on to the reference point of the frame's body
            let arm = from.arm - to.arm;
            y[k] = Pose::new(pose.x - pose.z * arm.y, pose.y + pose.z * arm.x, pose.z);
        }
    }
    debug_assert_eq!(x.len(), model.bodies.len());
    y
}
