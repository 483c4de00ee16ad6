//! Buckling that a mesh hides: a straight part that is stable on this mesh and has buckled on a finer one.
//!
//! A mesh of cubic segments bears too much: a column clamped at both ends by 49 % in one segment and by 2.6 % in two,
//! one with a guided end by 1.3 % and 0.8 %. Displacements say nothing, since those of the straight part agree on all
//! meshes. The indicator is the remaining stiffness relative to that of the same geometry without stress,
//! ```text
//! μ = min over x of xᵀ·K·x / xᵀ·K₀·x,      μ < c exactly where K − c·K₀ has a negative pivot (Sylvester),
//! ```
//! with K₀ of [`bimorph_multibody::unstressed`]. μ is about 1 − P/P_c of the mesh. No masses come in, and a slender beam elsewhere, soft as it may
//! be, has its own μ near 1. Where μ is small the pivots are counted on twice and four times the segments, which leaves a window of 5e-4 of the load.

use super::super::PortVoltages;
use super::super::statics::{OperatingPoint, SofteningCause, operating_point_near};
use super::doubled_mesh::{Finer, MAX_NEAR_LIMIT, finer};
use bimorph_domains::{BeamLine, Drive};
use bimorph_model::compile::CompiledModel;
use bimorph_multibody::BodyMatrix;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::unstressed::add_unstressed_tangent;

/// μ below which finer meshes are asked: where a beam has one segment, and where all have more (1).
const SUSPECT: [f64; 2] = [0.35, 0.1];
/// μ of twice the segments below which four times are asked, and the load is within about 1 % of buckling (1).
const NEAR: f64 = 0.02;
/// μ without voltages above which these alone make a part soft (1).
const MOST: f64 = 0.5;
/// Iterations for the softest motion, whose μ is at least 15 times below that of others where needed.
const ROUNDS: usize = 6;

/// Stability of an equilibrium on finer meshes.
#[derive(Debug, Clone)]
pub(super) enum Hidden {
    /// It is stable there, too.
    Nothing,
    /// It is stable there, too, with less than [`NEAR`] of its stiffness; the beam that bends most in the softest motion, and what softens it.
    Near(String, SofteningCause),
    /// It is unstable on a mesh with so many segments.
    Buckled(Vec<usize>),
}

/// Whether an equilibrium is one on finer meshes, where so little of the stiffness is left that it may not be.
pub(super) fn hidden(compiled: &CompiledModel, voltages: &PortVoltages, point: &OperatingPoint) -> Hidden {
    let model = &compiled.parts.system.model;
    if model.linear || model.bodies.is_empty() || !point.free_motions.is_empty() {
        // displacements are small by decree, or a direction is held that is free
        return Hidden::Nothing;
    }
    let coarse = compiled.order.segments.contains(&1);
    if !is_softer(compiled, point, SUSPECT[usize::from(!coarse)]) {
        return Hidden::Nothing;
    }
    let (mut here, mut there): (Option<CompiledModel>, OperatingPoint) = (None, point.clone());
    for round in 0..2 {
        let Some(Finer { model, start }) = finer(here.as_ref().unwrap_or(compiled), &there) else { break };
        if model.order.segments.iter().sum::<usize>() > MAX_NEAR_LIMIT {
            break;
        }
        let Ok((next, from_rest)) = operating_point_near(&model, voltages, start) else { break };
        if from_rest && next.path.passed.len() > there.path.passed.len() {
            return Hidden::Buckled(model.order.segments);
        }
        if round == 0 && !is_softer(&model, &next, NEAR) {
            return Hidden::Nothing;
        }
        (here, there) = (Some(model), next);
    }
    if is_softer(here.as_ref().unwrap_or(compiled), &there, NEAR) {
        let softening = softening(here.as_ref().unwrap_or(compiled), &there);
        return Hidden::Near(softest(compiled, point).unwrap_or_default(), softening);
    }
    Hidden::Nothing
}

/// True where μ < `fraction`.
fn is_softer(compiled: &CompiledModel, point: &OperatingPoint, fraction: f64) -> bool {
    is_softer_under(compiled, point, &point.drive(compiled), fraction)
}

/// Cause of a small μ, by μ at the same place without voltages.
fn softening(compiled: &CompiledModel, point: &OperatingPoint) -> SofteningCause {
    let drive = point.drive(compiled);
    if drive.volts.iter().all(|volts| *volts == 0.0) {
        return SofteningCause::Stress;
    }
    let without = Drive { volts: vec![0.0; drive.volts.len()], ..drive };
    match (is_softer_under(compiled, point, &without, MOST), is_softer_under(compiled, point, &without, NEAR)) {
        (false, _) => SofteningCause::Voltage,
        (true, false) => SofteningCause::Both,
        (true, true) => SofteningCause::Stress,
    }
}

/// True where μ < `fraction` under a drive: one factorization.
fn is_softer_under(compiled: &CompiledModel, point: &OperatingPoint, drive: &Drive, fraction: f64) -> bool {
    let system = &compiled.parts.system;
    let (mut tangent, mut force) = (BodyMatrix::new(&system.model.pattern), vec![Pose::zeros(); system.bodies()]);
    system.tangent(&point.q, drive, &mut tangent, &mut force);
    add_unstressed_tangent(&system.model, &point.q, -fraction, &mut tangent);
    system.model.project_matrix(&mut tangent);
    tangent.factor(&system.model.pattern).is_ok_and(|inertia| inertia.negative > 0)
}

/// The beam that bends most in the motion of the smallest μ, by iteration with K⁻¹·K₀.
fn softest(compiled: &CompiledModel, point: &OperatingPoint) -> Option<String> {
    let (system, model) = (&compiled.parts.system, &compiled.parts.system.model);
    let mut x = vec![Pose::zeros(); system.bodies()];
    let mut loaded = BodyMatrix::new(&model.pattern);
    system.tangent(&point.q, &point.drive(compiled), &mut loaded, &mut x);
    model.project_matrix(&mut loaded);
    loaded.factor(&model.pattern).ok()?;
    let mut unloaded = BodyMatrix::new(&model.pattern);
    add_unstressed_tangent(model, &point.q, 1.0, &mut unloaded);
    model.project_matrix(&mut unloaded);
    system.excite(&point.q, system.length_scale, &mut x);
    for _ in 0..ROUNDS {
        model.project(&mut x);
        loaded.solve(&model.pattern, &mut x);
        let size = x.iter().map(|x| x.norm()).fold(0.0, f64::max);
        let mut force = vec![Pose::zeros(); x.len()];
        unloaded.multiply_add(&model.pattern, &x, &mut force);
        x.iter_mut().zip(force).for_each(|(x, force)| *x = force / size);
    }
    loaded.solve(&model.pattern, &mut x);
    let energy = |beam: &BeamLine| beam.bending(&point.q, &x, model.linear).0;
    let softest = system.beams.iter().max_by(|a, b| energy(a).total_cmp(&energy(b)))?;
    Some(softest.name.to_string())
}
