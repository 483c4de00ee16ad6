//! The mesh for a request: every front asks here before it runs an analysis, so that the same request has the same mesh, and
//! the same numbers, everywhere.
//!
//! | request | what decides | file |
//! |---|---|---|
//! | static | the deformed state, compared with that of twice the segments | `equilibrium` |
//! | modes | the highest mode asked for; about a loaded state, that state and its frequencies too | here |
//! | pull-in | both voltages, compared with those of twice the segments | here |
//! | frequency response | the response itself and the modes within the band, compared with those of twice the segments | `in_band` |
//! | transient | the states it starts from and goes to, and the modes that the difference of the two excites | `excited` |
//!
//! Who gives a number of segments gets them, and the estimate of their error. Who gives a band gets the mesh for that band at
//! least. The estimate is in [`Compiled::order`]; where it is missing or beyond the tolerance, a warning is added.

mod equilibrium;
mod excited;
pub(crate) mod given;
mod in_band;
mod warnings;

use super::linear_stress::left_out;
use super::modes::{ModesResult, modes, modes_with_curves};
use super::pull_in::{PullInResult, pull_in};
use super::statics::{OperatingPoint, operating_point};
use super::transient::TransientOptions;
use super::{AnalysisError, BeamMotions, PortVoltages};
use crate::compile::Compiled;
use crate::discretize::DiscretizeError;
use crate::multibody::planar::Pose;
use crate::netlist::Diagnostic;
use crate::refine::counted;
use crate::refine::doubling::{self, Output};
use crate::refine::model_order::ModelOrder;
use std::borrow::Cow;
use warnings::{of_pieces, of_stress, warn_of_pieces, warn_of_stress, warning};

pub use warnings::warnings;
pub(crate) use warnings::{WARNING, beyond};

/// What a mesh is for.
#[derive(Debug, Clone, Copy)]
pub enum Request<'a> {
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
        /// Largest voltage [V].
        max: f64,
    },
}

/// Modes beyond which none are compared with those of a finer mesh: their own estimates stand.
const MOST_COMPARED: usize = 64;
/// Errors of a deflection and of a pull-in voltage for the share of its distance that a gap along beams leaves out: found on a cantilever
/// of 1 to 8 pieces, where a deflection near the fold is off by 1.8 times that share, release by 2 times, pull-in by a third.
const OF_DEFLECTION: f64 = 2.0;
const OF_PULL_IN: f64 = 1.0 / 3.0;

/// The model on the mesh for a request.
///
/// # Errors
/// What the analysis itself has against the model: see [`AnalysisError`].
pub fn fitted(compiled: &Compiled, request: &Request<'_>) -> Result<Compiled, AnalysisError> {
    on(compiled, order(compiled, request)?)
}

/// The mesh for a request, with the estimate of its error.
///
/// # Errors
/// See [`fitted`].
pub fn order(compiled: &Compiled, request: &Request<'_>) -> Result<ModelOrder, AnalysisError> {
    Ok(match *request {
        Request::Static { voltages } => equilibrium::order(compiled, voltages, compiled.order.segments.clone())?.0,
        Request::Modes { count, voltages } => for_modes(compiled, count, voltages)?.0,
        Request::PullIn { port, max } => for_pull_in(compiled, port, max)?.0,
    })
}

/// The equilibrium on the mesh for it: [`fitted`], and what was found on the way.
///
/// # Errors
/// See [`fitted`].
pub(crate) fn static_fitted(
    compiled: &Compiled,
    voltages: &PortVoltages,
) -> Result<(Compiled, OperatingPoint), AnalysisError> {
    let (order, point) = equilibrium::order(compiled, voltages, compiled.order.segments.clone())?;
    let mut fitted = on(compiled, order)?;
    let (point, told) = told_of_static(&fitted, point);
    fitted.warnings.items.extend(told);
    Ok((fitted, point))
}

/// The modes on the mesh for them: [`fitted`], and what was found on the way.
///
/// # Errors
/// See [`fitted`].
pub(crate) fn modes_fitted(
    compiled: &Compiled,
    count: usize,
    voltages: &PortVoltages,
) -> Result<(Compiled, Shaped), AnalysisError> {
    let (order, found) = for_modes(compiled, count, voltages)?;
    let found = found.filter(|(segments, _)| *segments == order.segments);
    let fitted = on(compiled, order)?;
    let found = match found {
        Some((_, found)) => found,
        None => modes_with_curves(&fitted, count, voltages)?,
    };
    Ok((fitted, found))
}

/// Modes with the shapes of their beams.
type Shaped = (ModesResult, Vec<BeamMotions>);
/// Those of a mesh.
type OfMesh = Option<(Vec<usize>, Shaped)>;

/// A released mechanism and what it was released from, on the mesh for a transient.
///
/// # Errors
/// See [`fitted`].
pub fn fitted_in_time(
    moving: &Compiled,
    options: &TransientOptions<'_>,
) -> Result<(Compiled, Option<Compiled>), AnalysisError> {
    let order = order_in_time(moving, options)?;
    let start = options.release.map(|start| on(start, order.clone())).transpose()?;
    let mut moving = on(moving, order)?;
    if moving.options.linear {
        let share = left_out_in_time(&moving, start.as_ref(), &options.voltages);
        warn_of_stress(&mut moving, share);
    }
    Ok((moving, start))
}

/// The model on the mesh for a frequency response.
///
/// # Errors
/// See [`fitted`].
pub fn fitted_in_band(
    compiled: &Compiled,
    options: &super::harmonic::HarmonicOptions,
) -> Result<Compiled, AnalysisError> {
    in_band::fitted(compiled, options)
}

/// What stress would change in the way that a linear run goes: from its first state to where it would rest.
fn left_out_in_time(moving: &Compiled, start: Option<&Compiled>, voltages: &PortVoltages) -> Option<f64> {
    let end = operating_point(moving, voltages).ok()?;
    let begin = match start {
        Some(start) => operating_point(start, voltages).ok()?,
        None => OperatingPoint::rest(moving, voltages).ok()?,
    };
    let way: Vec<Pose> = begin.q.iter().zip(&end.q).map(|(a, b)| a - b).collect();
    let stressed = [left_out(moving, &end, &way)?, left_out(moving, &begin, &way)?];
    stressed.into_iter().reduce(f64::max)
}

/// The mesh for a transient, with the estimate of its error.
///
/// # Errors
/// See [`fitted`].
pub fn order_in_time(moving: &Compiled, options: &TransientOptions<'_>) -> Result<ModelOrder, AnalysisError> {
    excited::order(moving, options)
}

/// True where the number of segments is the user's.
fn chosen(compiled: &Compiled) -> bool {
    compiled.options.segments.is_some()
}

/// The model on another mesh, with a warning where that does not hold the tolerance.
fn on(compiled: &Compiled, order: ModelOrder) -> Result<Compiled, AnalysisError> {
    let mut fitted = if order.segments == compiled.order.segments {
        Compiled { order, ..compiled.clone() }
    } else {
        let detail = |error: DiscretizeError| AnalysisError::NotConverged { detail: error.to_string() };
        compiled.with_order(order).map_err(detail)?
    };
    let Some(message) = beyond(fitted.options.tol, fitted.order.estimated_error) else { return Ok(fitted) };
    let help =
        if chosen(&fitted) { "leave --segments away, or take more" } else { "compare with --segments of your own" };
    fitted.warnings.items.push(warning(WARNING, message, help));
    Ok(fitted)
}

/// The mesh for modes, and those of a mesh that was looked at, which may be another one.
fn for_modes(
    compiled: &Compiled,
    count: usize,
    voltages: &PortVoltages,
) -> Result<(ModelOrder, OfMesh), AnalysisError> {
    let loaded = loaded(compiled, voltages);
    let given = chosen(compiled) || compiled.options.band.is_some();
    let order = if given {
        compiled.order.clone()
    } else {
        let detail = |error: DiscretizeError| AnalysisError::NotConverged { detail: error.to_string() };
        counted::choose(&compiled.structure, &compiled.options, count).map_err(detail)?
    };
    let mut analyse = |segments: &[usize]| {
        let model = meshed(compiled, segments)?;
        Ok::<_, AnalysisError>(frequency_outputs(&modes(&model, count, voltages)?, count))
    };
    if !loaded {
        // modes about the drawing know their errors, where the scheme lets them
        let (order, found) = own_estimate(compiled, order, count, &[])?;
        if order.estimated_error.is_some() || count > MOST_COMPARED {
            return Ok((order, found));
        }
        let order = match given {
            true => doubling::estimate(&compiled.options, order.segments, &mut analyse),
            false => doubling::fit(&compiled.structure, &compiled.options, order.segments, &mut analyse),
        };
        return Ok((order?, found));
    }
    if chosen(compiled) {
        return Ok((doubling::estimate(&compiled.options, order.segments, &mut analyse)?, None));
    }
    let (still, _) = equilibrium::order(compiled, voltages, order.segments)?;
    let (own, found) = own_estimate(compiled, still.clone(), count, voltages)?;
    let worst = |a: Option<f64>, b: Option<f64>| Some(a?.max(b?));
    let enough = own.estimated_error.is_some_and(|error| error <= counted::SAFETY * compiled.options.tol);
    if enough || count > MOST_COMPARED {
        let estimated_error = worst(still.estimated_error, own.estimated_error);
        return Ok((ModelOrder { estimated_error, ..own }, found));
    }
    let moving = doubling::fit(&compiled.structure, &compiled.options, still.segments, &mut analyse)?;
    Ok((ModelOrder { estimated_error: worst(still.estimated_error, moving.estimated_error), ..moving }, found))
}

/// The estimate that the modes themselves make of a mesh.
fn own_estimate(
    compiled: &Compiled,
    order: ModelOrder,
    count: usize,
    voltages: &PortVoltages,
) -> Result<(ModelOrder, OfMesh), AnalysisError> {
    let model = meshed(compiled, &order.segments)?;
    let found = modes_with_curves(&model, count, voltages)?;
    let estimated_error = worst(found.0.errors.iter().copied());
    let found = Some((order.segments.clone(), found));
    Ok((ModelOrder { estimated_error, ..order }, found))
}

/// Largest of the errors; none where one of them is not known.
fn worst(mut errors: impl Iterator<Item = Option<f64>>) -> Option<f64> {
    errors.try_fold(0.0, |worst: f64, error| Some(worst.max(error?.abs())))
}

/// True where modes are about an equilibrium that is not the drawing.
fn loaded(compiled: &Compiled, voltages: &PortVoltages) -> bool {
    let system = &compiled.parts.system;
    !voltages.is_empty()
        || system.electrics.fixed.iter().any(|v| *v != 0.0)
        || system.loads.iter().any(|l| l.moment != 0.0 || l.force.norm() > 0.0)
        || system.model.joints.iter().any(|j| j.rest != 0.0)
}

/// What is compared of modes.
fn frequency_outputs(found: &ModesResult, count: usize) -> Vec<Output> {
    let highest = found.frequencies_hz.last().copied().unwrap_or(0.0);
    // rigid motions have no frequency of their own
    let output = |f: &f64| Output { value: *f, scale: f.max(1e-3 * highest).max(f64::MIN_POSITIVE) };
    let mut outputs: Vec<Output> = found.frequencies_hz.iter().map(output).collect();
    outputs.resize(count, Output { value: f64::NAN, scale: 1.0 });
    outputs
}

/// What is compared of pull-in.
fn pull_in_outputs(found: &PullInResult) -> Vec<Output> {
    let output = |volts: f64| Output { value: volts, scale: volts.abs().max(f64::MIN_POSITIVE) };
    vec![output(found.pull_in_v), found.release_v.map_or(Output { value: f64::NAN, scale: 1.0 }, output)]
}

/// Pull-in on the mesh for it: [`fitted`], and what was found on the way.
///
/// # Errors
/// See [`fitted`].
pub(crate) fn pull_in_fitted(
    compiled: &Compiled,
    port: Option<&str>,
    max: f64,
) -> Result<(Compiled, PullInResult), AnalysisError> {
    let (order, found) = for_pull_in(compiled, port, max)?;
    let mut fitted = on(compiled, order)?;
    let known = found.into_iter().find(|(segments, _)| *segments == fitted.order.segments);
    let result = match known {
        Some((_, result)) => PullInResult { estimated_error: fitted.order.estimated_error, ..result },
        None => pull_in(&fitted, port, max)?,
    };
    let points = points_of_pull_in(&fitted, &result);
    warn_of_pieces(&mut fitted, &points);
    Ok((fitted, result))
}

/// Where gaps along beams may have too few pieces for a pull-in, and how much that counts: next to the fold; and closed, where as
/// much is left out as at release, but for V².
fn points_of_pull_in(fitted: &Compiled, result: &PullInResult) -> Vec<(OperatingPoint, f64)> {
    if fitted.structure.beam_gaps.is_empty() {
        return Vec::new();
    }
    let release = result.release_v.map_or(0.0, |volts| (volts / result.pull_in_v).powi(2));
    let at = |(volts, times): (f64, f64)| {
        let point = operating_point(fitted, &[(result.port.clone(), volts * result.pull_in_v)]);
        point.ok().map(|point| (point, times))
    };
    [(0.98, OF_PULL_IN), (1.02, OF_DEFLECTION * release)].into_iter().filter_map(at).collect()
}

/// What an equilibrium is warned of beside its mesh: what a linear model leaves out, and gaps in too few pieces.
fn told_of_static(fitted: &Compiled, point: OperatingPoint) -> (OperatingPoint, Vec<Diagnostic>) {
    let share = if fitted.options.linear { left_out(fitted, &point, &point.q) } else { None };
    let points = [(point, OF_DEFLECTION)];
    let told = of_stress(fitted, share).into_iter().chain(of_pieces(fitted, &points)).collect();
    let [(point, _)] = points;
    (point, told)
}

/// Pull-in on some meshes.
type OfMeshes = Vec<(Vec<usize>, PullInResult)>;

/// The mesh for pull-in, and the results of every mesh that was looked at.
fn for_pull_in(compiled: &Compiled, port: Option<&str>, max: f64) -> Result<(ModelOrder, OfMeshes), AnalysisError> {
    let mut known = Vec::new();
    let mut analyse = |segments: &[usize]| {
        let model = meshed(compiled, segments)?;
        let found = pull_in(&model, port, max)?;
        let outputs = pull_in_outputs(&found);
        known.push((segments.to_vec(), found));
        Ok::<_, AnalysisError>(outputs)
    };
    let segments = compiled.order.segments.clone();
    let order = match chosen(compiled) {
        true => doubling::estimate(&compiled.options, segments, &mut analyse)?,
        false => doubling::fit(&compiled.structure, &compiled.options, segments, &mut analyse)?,
    };
    Ok((order, known))
}

/// The model with so many segments.
fn meshed<'a>(compiled: &'a Compiled, segments: &[usize]) -> Result<Cow<'a, Compiled>, AnalysisError> {
    if segments == compiled.order.segments {
        return Ok(Cow::Borrowed(compiled));
    }
    let order = ModelOrder { segments: segments.to_vec(), ..compiled.order.clone() };
    let refused = |error: DiscretizeError| AnalysisError::NotConverged { detail: error.to_string() };
    compiled.with_order(order).map(Cow::Owned).map_err(refused)
}
