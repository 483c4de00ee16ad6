//! Mesh search for a request. Every front end calls it before an analysis, so that the same request has the same mesh,
//! and the same numbers, everywhere.
//!
//! | request | criterion | file |
//! |---|---|---|
//! | static | the deformed state, compared with that of twice the segments | `equilibrium` |
//! | modes | the highest requested mode; about a loaded state, that state and its frequencies too | `frequencies` |
//! | strains that stay | those of heated beams that yield, compared with those of twice the segments | `permanent_strain` |
//! | pull-in | both voltages, compared with those of twice the segments | `pull_in` |
//! | path | its folds, bifurcations and end, compared with those of twice the segments | `path` |
//! | frequency response | the response itself and the modes within the band, compared with those of twice the segments | `in_band` |
//! | transient | the states it starts from and goes to, and the modes that the difference of the two excites | `excited_modes` |
//! | transient with changing stiffness, or with a part in none of the modes | the run itself, compared with that of half the segments | `large_motion` |
//! | transient that closes a gap | the run up to its first contact, compared with that of half the segments | `large_motion`, `to_first_contact` |
//!
//! A given number of segments is used as it is, with the estimate of its error. A given band requires at least the mesh
//! for that band. The estimate is in [`CompiledModel::order`]; where it is missing or beyond the tolerance, a warning
//! is added.

mod doubled_mesh;
mod driven;
mod equilibrium;
mod excited_modes;
mod frequencies;
mod hidden_instability;
mod in_band;
mod in_circuit;
mod large_motion;
mod mode_pairs;
pub mod on_given_mesh;
mod path;
mod permanent_strain;
mod pull_in;
mod refined;
pub(super) mod remeshed;
mod section_inertia;
mod signal_amplitudes;
mod softening;
mod to_first_contact;
mod warnings;

use super::linear_stress::left_out;
use super::statics::{OperatingPoint, operating_point};
use super::transient::TransientOptions;
use super::{AnalysisError, PortVoltages, formulation, step_error};
use crate::readout::expression::Expression;
use bimorph_base::{Diagnostic, ErrorBudget};
use bimorph_model::compile::CompiledModel;
use bimorph_model::refine::mesh_search::Mesh;
use bimorph_multibody::planar::Pose;
pub use equilibrium::{StaticWithBeams, static_fitted, static_with_beams};
use excited_modes::motion_warnings;
use frequencies::for_modes;
pub use frequencies::modes_fitted;
pub use in_band::harmonic_fitted;
pub use path::path_fitted;
use pull_in::for_pull_in;
pub use pull_in::pull_in_fitted;
use remeshed::on;
use section_inertia::with_section_inertia;
use warnings::{of_fingers, of_heat, of_strength, of_stress};

pub use equilibrium::{operating_point_warnings, transient_warnings};
pub use in_circuit::{in_circuit, twice};
use large_motion::{CoarseRun, SearchLimits};
pub use permanent_strain::static_backbent;
pub use warnings::WARNING;
pub use warnings::{beyond, warnings};

/// Work of a step in joint coordinates over that of a step of as many unknowns of the bodies (1): it was measured as 1.0 to 1.35.
const JOINTS: f64 = 1.2;
/// Work of the rest of a search for a mesh after its first coarse run, of the work of that: the finer run has twice the unknowns, and more steps.
const REST_OF_SEARCH: f64 = 3.0;
/// Fraction of the work that bodies still need which a first run in joint coordinates of as much work as theirs may take at most.
const TRIAL: f64 = 0.1;
/// Fractions of that work that the first run in joint coordinates and all runs of the search for its mesh may take at most.
const OF_REST: [f64; 2] = [0.15, 0.75];

/// Request for a mesh.
#[derive(Debug, Clone, Copy)]
pub enum MeshRequest<'a> {
    /// The static equilibrium at these voltages.
    Static {
        /// Port voltages.
        voltages: &'a PortVoltages,
    },
    /// The lowest modes about the equilibrium at these voltages.
    Modes {
        /// How many.
        count: usize,
        /// Port voltages.
        voltages: &'a PortVoltages,
    },
    /// Pull-in and release.
    PullIn {
        /// Port or source; none: the first.
        port: Option<&'a str>,
        /// Largest voltage (V).
        max: f64,
    },
}

/// The model on the mesh for a request.
///
/// # Errors
/// Errors of the analysis itself: see [`AnalysisError`].
pub fn fitted(compiled: &CompiledModel, request: &MeshRequest<'_>) -> Result<CompiledModel, AnalysisError> {
    on(compiled, order(compiled, request)?)
}

/// The mesh for a request, with the estimate of its error.
///
/// # Errors
/// See [`fitted`].
pub fn order(compiled: &CompiledModel, request: &MeshRequest<'_>) -> Result<Mesh, AnalysisError> {
    Ok(match *request {
        MeshRequest::Static { voltages } => equilibrium::order(compiled, voltages, compiled.order.segments.clone())?.0,
        MeshRequest::Modes { count, voltages } => for_modes(compiled, count, voltages)?.0,
        MeshRequest::PullIn { port, max } => for_pull_in(compiled, port, max)?.0,
    })
}

/// A model that moves and what it is released from, on the mesh for a run.
type FittedModels = (CompiledModel, Option<CompiledModel>);

/// A released mechanism and what it was released from, on the mesh for a transient, in the formulation that `auto` takes.
///
/// # Errors
/// See [`fitted`].
pub fn fitted_in_time(moving: &CompiledModel, options: &TransientOptions<'_>) -> Result<FittedModels, AnalysisError> {
    in_suited_formulation(moving, options, &fitted_as_compiled, &|fitted| &fitted.0.order)
}

/// The same in joint coordinates, whatever suits; none where they cannot describe it, or `auto` was not requested.
///
/// # Errors
/// See [`fitted`].
pub fn fitted_in_joints(
    moving: &CompiledModel,
    options: &TransientOptions<'_>,
) -> Result<Option<FittedModels>, AnalysisError> {
    let Some((joints, start)) = formulation::in_possible_joints(moving, options) else { return Ok(None) };
    fitted_as_compiled(&joints, &options.with_release(start.as_ref()), SearchLimits::none())
}

/// The mesh for a transient in the formulation that `auto` takes, and whether this is joint coordinates.
///
/// # Errors
/// See [`fitted`].
pub fn suited_order_in_time(
    moving: &CompiledModel,
    options: &TransientOptions<'_>,
) -> Result<(Mesh, bool), AnalysisError> {
    let order = |model: &CompiledModel, options: &TransientOptions<'_>, limits: SearchLimits<'_>| {
        let found = limited_order_in_time(model, options, limits)?;
        Ok(found.map(|order| (order, model.joints.is_some())))
    };
    in_suited_formulation(moving, options, &order, &|found| &found.0)
}

/// Searches a mesh for a model; none where the limits of the search end it.
type LimitedSearch<'s, T> =
    &'s dyn Fn(&CompiledModel, &TransientOptions<'_>, SearchLimits<'_>) -> Result<Option<T>, AnalysisError>;

/// The mesh that `search` finds in the formulation that `auto` takes: joint coordinates where they suit before there is a mesh, or where the
/// steps of the bodies are unpredictable in the first coarse run.
fn in_suited_formulation<T>(
    moving: &CompiledModel,
    options: &TransientOptions<'_>,
    search: LimitedSearch<'_, T>,
    order: &dyn Fn(&T) -> &Mesh,
) -> Result<T, AnalysisError> {
    let of_bodies = |limits: SearchLimits<'_>| {
        search(moving, options, limits)?.ok_or_else(|| AnalysisError::NotConverged {
            detail: "the search for the mesh of a run ended without a mesh".into(),
        })
    };
    let errors = moving.options.errors();
    if let Some((joints, start)) = formulation::in_joints(moving, options) {
        let mut own = None;
        let mut note = |coarse: &CoarseRun| {
            own = Some(*coarse);
            true
        };
        let limits = SearchLimits { judge: Some(&mut note), ..SearchLimits::none() };
        let mut found = match search(&joints, &options.with_release(start.as_ref()), limits) {
            Ok(Some(found)) if formulation::suits_joints(&order(&found).segments) => return Ok(found),
            Err(AnalysisError::Cancelled) => return Err(AnalysisError::Cancelled),
            // joint coordinates were not requested, and refuse nothing
            found => found.ok().flatten().filter(|found| holds(order(found), errors)),
        };
        let work = own.zip(found.as_ref()).map(|(own, found)| work_on(&own, order(found), errors));
        let Some(work) = work else { return of_bodies(SearchLimits::none()) };
        let mut is_cheaper = false;
        let mut judge = |coarse: &CoarseRun| {
            is_cheaper = JOINTS * work < rest_of(coarse, errors);
            !is_cheaper
        };
        let bodies = of_bodies(SearchLimits { judge: Some(&mut judge), ..SearchLimits::none() });
        return found.take().filter(|_| is_cheaper).map_or(bodies, Ok);
    }
    let early = formulation::takes_joints(moving, options);
    if early || !formulation::may_take_joints(moving, options) || moving.parts.system.may_touch() {
        return of_bodies(SearchLimits::none());
    }
    let mut in_joints = None;
    let mut judge = |coarse: &CoarseRun| {
        let rest = rest_of(coarse, errors);
        if coarse.work <= TRIAL * rest {
            in_joints = cheaper_in_joints(moving, options, rest, search, order);
        }
        in_joints.is_none()
    };
    let found = of_bodies(SearchLimits { judge: Some(&mut judge), ..SearchLimits::none() });
    in_joints.map_or(found, Ok)
}

/// The work of the steps of a run on this mesh, after its first coarse run.
fn work_on(coarse: &CoarseRun, mesh: &Mesh, errors: ErrorBudget) -> f64 {
    let finer = mesh.segments.iter().sum::<usize>() as f64 / coarse.segments.max(1) as f64;
    step_error::predicted_work(finer * coarse.work, [coarse.error, coarse.damped], errors)
}

/// Whether a mesh has an estimate within the tolerance.
fn holds(mesh: &Mesh, errors: ErrorBudget) -> bool {
    mesh.estimated_error.is_some_and(|error| errors.holds(error))
}

/// The work that a run still needs after its first coarse run: the rest of the search for its mesh, and the steps.
fn rest_of(coarse: &CoarseRun, errors: ErrorBudget) -> f64 {
    REST_OF_SEARCH * coarse.work + step_error::predicted_work(coarse.work, [coarse.error, coarse.damped], errors)
}

/// The mesh in joint coordinates, where it holds the tolerance and both its search and the steps of the run need less work than the `rest` of that of the
/// bodies.
fn cheaper_in_joints<T>(
    moving: &CompiledModel,
    options: &TransientOptions<'_>,
    rest: f64,
    search: LimitedSearch<'_, T>,
    order: &dyn Fn(&T) -> &Mesh,
) -> Option<T> {
    let (joints, start) = formulation::in_possible_joints(moving, options)?;
    let errors = moving.options.errors();
    let mut judge = |own: &CoarseRun| JOINTS * rest_of(own, errors) < rest;
    let limits = SearchLimits { work: OF_REST.map(|part| part * rest / JOINTS), judge: Some(&mut judge) };
    let found = search(&joints, &options.with_release(start.as_ref()), limits).ok()??;
    holds(order(&found), errors).then_some(found)
}

/// The same in the formulation that the model was compiled for; none where the limits of the search end it.
fn fitted_as_compiled(
    moving: &CompiledModel,
    options: &TransientOptions<'_>,
    limits: SearchLimits<'_>,
) -> Result<Option<FittedModels>, AnalysisError> {
    // reject unknown signal names before the mesh search; points along beams depend on the mesh
    for name in options.signals.iter().filter(|name| !name.contains('[')) {
        Expression::of_run(moving, name, &[])?;
    }
    let closes = large_motion::rests_in_contact(moving, options);
    let moving = &*with_section_inertia(moving, closes)?;
    let Some(order) = limited_order_in_time(moving, options, limits)? else { return Ok(None) };
    let start = options.release.map(|start| on(&*with_section_inertia(start, closes)?, order.clone())).transpose()?;
    let mut moving = on(moving, order)?;
    let reported = run_warnings(&moving, start.as_ref(), &options.voltages);
    moving.warnings.items.extend(reported);
    let reported = motion_warnings(&moving, options);
    moving.warnings.items.extend(reported);
    Ok(Some((moving, start)))
}

/// Warnings about a run: stress stiffening omitted by a linear model, and combs and temperatures beyond their range,
/// evaluated at the final state.
pub fn run_warnings(moving: &CompiledModel, start: Option<&CompiledModel>, voltages: &PortVoltages) -> Vec<Diagnostic> {
    let share = if moving.options.linear { left_out_in_time(moving, start, voltages) } else { None };
    let drawn = &moving.structure;
    let strong = drawn.beams.iter().any(|beam| beam.material.strength.is_some());
    let some = strong || !(drawn.combs.is_empty() && moving.parts.heaters.is_empty());
    let end = if some { operating_point(moving, voltages).ok() } else { None };
    let there = end.as_ref();
    let reported = of_stress(moving, share).into_iter().chain(there.and_then(|end| of_fingers(moving, end)));
    let reported = reported.chain(there.and_then(|end| of_heat(moving, end)));
    reported.chain(there.and_then(|end| of_strength(moving, end))).collect()
}

/// Effect of stress on a linear run, from its first state to its final equilibrium.
fn left_out_in_time(moving: &CompiledModel, start: Option<&CompiledModel>, voltages: &PortVoltages) -> Option<f64> {
    let end = operating_point(moving, voltages).ok()?;
    let begin = match start {
        Some(start) => operating_point(start, voltages).ok()?,
        None => OperatingPoint::rest(moving, voltages).ok()?,
    };
    let way: Vec<Pose> = begin.q.iter().zip(&end.q).map(|(a, b)| a - b).collect();
    let stressed = [left_out(moving, &end, &way)?, left_out(moving, &begin, &way)?];
    stressed.into_iter().reduce(f64::max)
}

/// The mesh for a transient in the formulation of the model, with the estimate of its error.
///
/// # Errors
/// See [`fitted`].
pub fn order_in_time(moving: &CompiledModel, options: &TransientOptions<'_>) -> Result<Mesh, AnalysisError> {
    Ok(limited_order_in_time(moving, options, SearchLimits::none())?.unwrap_or_else(|| moving.order.clone()))
}

/// As above; none where the limits of the search end it.
fn limited_order_in_time(
    moving: &CompiledModel,
    options: &TransientOptions<'_>,
    limits: SearchLimits<'_>,
) -> Result<Option<Mesh>, AnalysisError> {
    // the modes about a closed gap are those of parts that are pressed together, and say nothing of the way there
    let (order, left) = match large_motion::ends_in_contact(moving, options) {
        true => (Mesh { estimated_error: Some(0.0), ..moving.order.clone() }, 0.0),
        false => excited_modes::order(moving, options)?,
    };
    large_motion::order(moving, options, order, left, limits)
}
