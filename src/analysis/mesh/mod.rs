//! The mesh for a request: every front asks here before it runs an analysis, so that the same request has the same mesh, and
//! the same numbers, everywhere.
//!
//! | request | what decides | file |
//! |---|---|---|
//! | static | the deformed state, compared with that of twice the segments | `equilibrium` |
//! | modes | the highest mode asked for; about a loaded state, that state and its frequencies too | here |
//! | pull-in | both voltages, compared with those of twice the segments | here |
//! | transient | the states it starts from and goes to, and the modes that the difference of the two excites | `excited` |
//!
//! Who gives a number of segments gets them, and the estimate of their error. Who gives a band gets the mesh for that band at
//! least. The estimate is in [`Compiled::order`]; where it is missing or beyond the tolerance, a warning is added.

mod equilibrium;
mod excited;

use super::modes::modes;
use super::pull_in::pull_in;
use super::transient::TransientOptions;
use super::{AnalysisError, PortVoltages};
use crate::compile::Compiled;
use crate::discretize::DiscretizeError;
use crate::netlist::{Diagnostic, Severity};
use crate::refine::counted;
use crate::refine::doubling::{self, Output};
use crate::refine::model_order::ModelOrder;
use std::borrow::Cow;

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
/// Code of the warning that a mesh does not hold the tolerance.
const WARNING: &str = "W040";

/// The model on the mesh for a request.
///
/// # Errors
/// What the analysis itself has against the model: see [`AnalysisError`].
pub fn fitted(compiled: &Compiled, request: &Request<'_>) -> Result<Compiled, AnalysisError> {
    let order = match *request {
        Request::Static { voltages } => equilibrium::order(compiled, voltages, compiled.order.segments.clone())?,
        Request::Modes { count, voltages } => for_modes(compiled, count, voltages)?,
        Request::PullIn { port, max } => for_pull_in(compiled, port, max)?,
    };
    on(compiled, order)
}

/// A released mechanism and what it was released from, on the mesh for a transient.
///
/// # Errors
/// See [`fitted`].
pub fn fitted_in_time(
    moving: &Compiled,
    options: &TransientOptions<'_>,
) -> Result<(Compiled, Option<Compiled>), AnalysisError> {
    let order = excited::order(moving, options)?;
    let start = options.release.map(|start| on(start, order.clone())).transpose()?;
    Ok((on(moving, order)?, start))
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
    let tol = fitted.options.tol;
    let message = match fitted.order.estimated_error {
        Some(error) if error <= 1.05 * tol => return Ok(fitted),
        Some(error) => format!("the mesh may be off by {error:.1e}, more than the tolerance {tol:e}"),
        None => format!("nothing tells how far the mesh is off: the tolerance {tol:e} is not confirmed"),
    };
    let help =
        if chosen(&fitted) { "leave --segments away, or take more" } else { "compare with --segments of your own" };
    fitted.warnings.items.push(Diagnostic {
        code: WARNING.into(),
        severity: Severity::Warning,
        file: String::new(),
        line: 0,
        column: 0,
        width: 0,
        message,
        help: help.into(),
    });
    Ok(fitted)
}

fn for_modes(compiled: &Compiled, count: usize, voltages: &PortVoltages) -> Result<ModelOrder, AnalysisError> {
    let system = &compiled.parts.system;
    let loaded = !voltages.is_empty()
        || system.electrics.fixed.iter().any(|v| *v != 0.0)
        || system.loads.iter().any(|l| l.moment != 0.0 || l.force.norm() > 0.0)
        || system.model.joints.iter().any(|j| j.rest != 0.0);
    let given = chosen(compiled) || compiled.options.band.is_some();
    let order = if given {
        compiled.order.clone()
    } else {
        let detail = |error: DiscretizeError| AnalysisError::NotConverged { detail: error.to_string() };
        counted::choose(&compiled.structure, &compiled.options, count).map_err(detail)?
    };
    let mut analyse = |segments: &[usize]| {
        let model = meshed(compiled, segments)?;
        let found = modes(&model, count, voltages)?;
        let highest = found.frequencies_hz.last().copied().unwrap_or(0.0);
        // rigid motions have no frequency of their own
        let output = |f: &f64| Output { value: *f, scale: f.max(1e-3 * highest).max(f64::MIN_POSITIVE) };
        let mut outputs: Vec<Output> = found.frequencies_hz.iter().map(output).collect();
        outputs.resize(count, Output { value: f64::NAN, scale: 1.0 });
        Ok(outputs)
    };
    if !loaded {
        // modes about the drawing know their errors, where the scheme lets them
        let order = own_estimate(compiled, order, count, &[])?;
        if order.estimated_error.is_some() || count > MOST_COMPARED {
            return Ok(order);
        }
        return match given {
            true => doubling::estimate(&compiled.options, order.segments, &mut analyse),
            false => doubling::fit(&compiled.structure, &compiled.options, order.segments, &mut analyse),
        };
    }
    if chosen(compiled) {
        return doubling::estimate(&compiled.options, order.segments, &mut analyse);
    }
    let still = equilibrium::order(compiled, voltages, order.segments)?;
    let own = own_estimate(compiled, still.clone(), count, voltages)?;
    let worst = |a: Option<f64>, b: Option<f64>| Some(a?.max(b?));
    let enough = own.estimated_error.is_some_and(|error| error <= counted::SAFETY * compiled.options.tol);
    if enough || count > MOST_COMPARED {
        return Ok(ModelOrder { estimated_error: worst(still.estimated_error, own.estimated_error), ..own });
    }
    let moving = doubling::fit(&compiled.structure, &compiled.options, still.segments, &mut analyse)?;
    Ok(ModelOrder { estimated_error: worst(still.estimated_error, moving.estimated_error), ..moving })
}

/// The estimate that the modes themselves make of a mesh.
fn own_estimate(
    compiled: &Compiled,
    order: ModelOrder,
    count: usize,
    voltages: &PortVoltages,
) -> Result<ModelOrder, AnalysisError> {
    let model = meshed(compiled, &order.segments)?;
    let errors = modes(&model, count, voltages)?.errors;
    let told: Option<Vec<f64>> = errors.into_iter().collect();
    let worst = told.map(|errors| errors.iter().fold(0.0, |m: f64, e| m.max(e.abs())));
    Ok(ModelOrder { estimated_error: worst, ..order })
}

fn for_pull_in(compiled: &Compiled, port: Option<&str>, max: f64) -> Result<ModelOrder, AnalysisError> {
    let mut analyse = |segments: &[usize]| {
        let model = meshed(compiled, segments)?;
        let found = pull_in(&model, port, max)?;
        let output = |volts: f64| Output { value: volts, scale: volts.abs().max(f64::MIN_POSITIVE) };
        Ok(vec![output(found.pull_in_v), found.release_v.map_or(Output { value: f64::NAN, scale: 1.0 }, output)])
    };
    if chosen(compiled) {
        return doubling::estimate(&compiled.options, compiled.order.segments.clone(), &mut analyse);
    }
    doubling::fit(&compiled.structure, &compiled.options, compiled.order.segments.clone(), &mut analyse)
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
