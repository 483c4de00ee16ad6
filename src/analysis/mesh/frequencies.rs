//! The mesh for modes: the highest one asked for decides, and about a loaded state that state and its frequencies too.

use super::super::modes::{ModesResult, about_equilibrium, modes, modes_with_curves};
use super::super::{AnalysisError, BeamMotions, PortVoltages};
use super::equilibrium;
use super::meshed::{chosen, meshed, on};
use crate::compile::Compiled;
use crate::discretize::DiscretizeError;
use crate::options::{CompileOptions, Junctions};
use crate::refine::counted;
use crate::refine::doubling::{self, Output};
use crate::refine::model_order::ModelOrder;

/// Modes beyond which none are compared with those of a finer mesh: their own estimates stand.
const MOST_COMPARED: usize = 64;

/// Tolerance below which the estimate of modes with calibrated junctions is compared with twice the segments: what it does not know, the mass of
/// half a segment on the wrong side of a junction's spring, falls with the first power of the segments and was found up to 1e-5.
const FINEST_KNOWN: f64 = 3e-5;
/// What is left of an error of the first order over what the comparison, which takes it for one of the second, says.
const FIRST_ORDER: f64 = 1.5;

/// The modes on the mesh for them, which comes with them, and the displacement of points along every beam.
///
/// # Errors
/// See [`fitted`].
pub fn modes_fitted(
    compiled: &Compiled,
    count: usize,
    voltages: &PortVoltages,
) -> Result<(Compiled, ModesResult, Vec<BeamMotions>), AnalysisError> {
    let (order, found) = for_modes(compiled, count, voltages)?;
    let found = found.filter(|(segments, _)| *segments == order.segments);
    let fitted = on(compiled, order)?;
    let (result, curves) = match found {
        Some((_, found)) => found,
        None => modes_with_curves(&fitted, count, voltages)?,
    };
    let (estimated_error, loaded) = (fitted.order.estimated_error, about_equilibrium(compiled, voltages));
    // what a mode says of itself knows nothing of the state that it is about
    let all = |own: &Option<f64>| if loaded { own.zip(estimated_error).map(|(own, all)| own.max(all)) } else { *own };
    let errors = result.errors.iter().map(all).collect();
    // the search has no more use of how they follow the deflection
    Ok((fitted, ModesResult { errors, estimated_error, per_deflection: 0.0, ..result }, curves))
}

/// Modes with the shapes of their beams.
pub(crate) type Shaped = (ModesResult, Vec<BeamMotions>);

/// Those of a mesh.
pub(super) type OfMesh = Option<(Vec<usize>, Shaped)>;

/// The mesh for modes, and those of a mesh that was looked at, which may be another one.
pub(super) fn for_modes(
    compiled: &Compiled,
    count: usize,
    voltages: &PortVoltages,
) -> Result<(ModelOrder, OfMesh), AnalysisError> {
    let loaded = about_equilibrium(compiled, voltages);
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
    let fine = is_fine(compiled);
    let mut fit = |segments: Vec<usize>| {
        if !fine {
            return doubling::fit(&compiled.structure, &compiled.options, segments, &mut analyse);
        }
        let options = CompileOptions { tol: compiled.options.tol / FIRST_ORDER, ..compiled.options.clone() };
        let order = doubling::fit(&compiled.structure, &options, segments, &mut analyse)?;
        Ok(order.with_estimate_times(FIRST_ORDER))
    };
    if !loaded {
        // modes about the drawing know their errors, where the scheme lets them
        let (order, found) = own_estimate(compiled, order, count, &[])?;
        // two modes next to each other may change places from the mesh that was looked at to this one
        let holds = order.estimated_error.is_some_and(|error| error <= compiled.options.tol);
        let known = if given { order.estimated_error.is_some() } else { holds && !fine };
        if known || count > MOST_COMPARED {
            return Ok((order, found));
        }
        let order = match given {
            true => doubling::estimate(&compiled.options, order.segments, &mut analyse),
            false => fit(order.segments),
        };
        return Ok((order?, found));
    }
    if chosen(compiled) {
        return Ok((doubling::estimate(&compiled.options, order.segments, &mut analyse)?, None));
    }
    let (still, _) = equilibrium::order(compiled, voltages, order.segments)?;
    let (own, found) = own_estimate(compiled, still.clone(), count, voltages)?;
    let worst = |a: Option<f64>, b: Option<f64>| Some(a?.max(b?));
    let carried = found.as_ref().is_some_and(|(_, (modes, _))| is_carried(compiled, modes, still.estimated_error));
    let enough = carried && own.estimated_error.is_some_and(|error| error <= counted::SAFETY * compiled.options.tol);
    if (enough && !fine) || count > MOST_COMPARED {
        let faster = found.as_ref().map_or(1.0, |(_, (modes, _))| modes.per_deflection.max(1.0));
        let moved = still.estimated_error.map(|error| if carried { error } else { error * faster });
        let estimated_error = worst(moved, own.estimated_error);
        return Ok((ModelOrder { estimated_error, ..own }, found));
    }
    let moving = fit(own.segments)?;
    Ok((ModelOrder { estimated_error: worst(still.estimated_error, moving.estimated_error), ..moving }, found))
}

/// Whether the tolerance is finer than what modes of the drawing know of their errors.
pub(super) fn is_fine(compiled: &Compiled) -> bool {
    compiled.options.junctions == Junctions::Calibrated && compiled.options.tol < FINEST_KNOWN
}

/// Whether what the mesh leaves uncertain of the equilibrium moves no frequency beyond the tolerance: next to a fold it does.
pub(super) fn is_carried(compiled: &Compiled, found: &ModesResult, still: Option<f64>) -> bool {
    still.is_some_and(|error| error * found.per_deflection.max(1.0) <= doubling::SAFETY * compiled.options.tol)
}

/// Largest of the errors; none where one of them is not known.
pub(super) fn worst(mut errors: impl Iterator<Item = Option<f64>>) -> Option<f64> {
    errors.try_fold(0.0, |worst: f64, error| Some(worst.max(error?.abs())))
}

/// What is compared of modes.
pub(super) fn frequency_outputs(found: &ModesResult, count: usize) -> Vec<Output> {
    let highest = found.frequencies_hz.last().copied().unwrap_or(0.0);
    // rigid motions have no frequency of their own
    let output = |f: &f64| Output { value: *f, scale: f.max(1e-3 * highest).max(f64::MIN_POSITIVE) };
    let mut outputs: Vec<Output> = found.frequencies_hz.iter().map(output).collect();
    outputs.resize(count, Output { value: f64::NAN, scale: 1.0 });
    outputs
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
