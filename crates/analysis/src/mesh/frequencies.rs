//! The mesh for modes: the highest requested one decides, and about a loaded state that state and its frequencies too.

use super::super::modes::{ModesResult, about_equilibrium, modes_with_curves};
use super::super::reduced::not_reduced;
use super::super::{AnalysisError, BeamMotions, PortVoltages};
use super::equilibrium;
use super::mode_pairs;
use super::remeshed::{chosen, meshed, on};
use bimorph_base::ErrorBudget;
use bimorph_model::compile::CompiledModel;
use bimorph_model::discretize::DiscretizeError;
use bimorph_model::options::Junctions;
use bimorph_model::refine::doubling::{self, Output};
use bimorph_model::refine::lowest_modes;
use bimorph_model::refine::mesh_search::Mesh;

/// Modes beyond which none are compared with those of a finer mesh: their own estimates stand.
const MAX_COMPARED: usize = 64;

/// Tolerance below which the mode estimate with calibrated junctions is compared with twice the segments. The estimate
/// excludes one effect: half a segment's mass lies on the wrong side of a junction's spring. This error is inversely
/// proportional to the number of segments, and was measured up to 1e-5.
const FINEST_KNOWN: f64 = 3e-5;

/// The modes on the mesh for them, which comes with it, each with the estimate of its own error, and the displacement of points along every beam.
///
/// # Errors
/// See [`fitted`](super::fitted).
pub fn modes_fitted(
    compiled: &CompiledModel,
    count: usize,
    voltages: &PortVoltages,
) -> Result<(CompiledModel, ModesResult, Vec<BeamMotions>), AnalysisError> {
    not_reduced(compiled, "modes")?;
    let (order, (result, curves)) = for_modes(compiled, count, voltages)?;
    let fitted = on(compiled, order)?;
    let estimated_error = fitted.order.estimated_error;
    // the search has no more use of how they follow the deflection
    Ok((fitted, ModesResult { estimated_error, per_deflection: Vec::new(), ..result }, curves))
}

/// Modes with the shapes of their beams.
pub(crate) type ModesWithShapes = (ModesResult, Vec<BeamMotions>);

/// The mesh for modes, and the modes on that mesh with the estimates of their errors.
pub(super) fn for_modes(
    compiled: &CompiledModel,
    count: usize,
    voltages: &PortVoltages,
) -> Result<(Mesh, ModesWithShapes), AnalysisError> {
    let loaded = about_equilibrium(compiled, voltages);
    let given = chosen(compiled) || compiled.options.band.is_some();
    let order = if given {
        compiled.order.clone()
    } else {
        let detail = |error: DiscretizeError| AnalysisError::NotConverged { detail: error.to_string() };
        lowest_modes::choose(&compiled.structure, &compiled.options, count).map_err(detail)?
    };
    let mut compared = ComparedMeshes { compiled, count, voltages, meshes: Vec::new() };
    if !loaded {
        return about_drawing(&mut compared, order, given);
    }
    if chosen(compiled) {
        let order = doubling::estimate(&compiled.options, order.segments, &mut |mesh| compared.outputs(mesh))?;
        return compared.finish(order);
    }
    let (still, _) = equilibrium::order(compiled, voltages, order.segments)?;
    let (own, found) = own_estimate(compiled, still.clone(), count, voltages)?;
    let carried = is_carried(compiled, &found.0, still.estimated_error);
    let enough = carried && own.estimated_error.is_some_and(|error| error <= compiled.options.errors().modes());
    if (enough && !is_fine(compiled)) || count > MAX_COMPARED {
        let (result, curves) = found;
        let faster = result.per_deflection.iter().copied().fold(1.0, f64::max);
        let moved = still.estimated_error.map(|error| if carried { error } else { error * faster });
        // an error of the state moves each frequency as far as that follows the state
        let of_state = |k: usize| Some(still.estimated_error? * result.per_deflection.get(k)?);
        let each = |(k, own): (usize, &Option<f64>)| Some(own.as_ref()?.abs() + of_state(k)?);
        let errors: Vec<Option<f64>> = result.errors.iter().enumerate().map(each).collect();
        let all = [moved, own.estimated_error, worst(errors.iter().copied())];
        let estimated_error = worst(all.into_iter());
        return Ok((Mesh { estimated_error, ..own }, (ModesResult { errors, ..result }, curves)));
    }
    compared.keep(own.segments.clone(), found);
    let moving = compared.fit(own.segments)?;
    let estimated_error = worst([still.estimated_error, moving.estimated_error].into_iter());
    // the comparison includes the states that the modes are about
    compared.finish(Mesh { estimated_error, ..moving })
}

/// The mesh and the modes about the drawing, which know their errors where the scheme lets them.
fn about_drawing(
    compared: &mut ComparedMeshes<'_>,
    order: Mesh,
    given: bool,
) -> Result<(Mesh, ModesWithShapes), AnalysisError> {
    let ComparedMeshes { compiled, count, .. } = *compared;
    let fine = is_fine(compiled);
    let (order, found) = own_estimate(compiled, order, count, &[])?;
    // two neighbouring modes may change places from the compared mesh to this one
    let holds = order.estimated_error.is_some_and(|error| compiled.options.errors().holds(error));
    let known = if given { order.estimated_error.is_some() } else { holds && !fine };
    if known || count > MAX_COMPARED {
        return Ok((order, found));
    }
    compared.keep(order.segments.clone(), found);
    let order = match given {
        true => doubling::estimate(&compiled.options, order.segments, &mut |mesh| compared.outputs(mesh))?,
        false => compared.fit(order.segments)?,
    };
    compared.finish(order)
}

/// Meshes whose modes are kept while they are compared, at most: the mesh that holds and its double are the last two but for rounding.
const MAX_CACHED_MESHES: usize = 12;

/// The modes of the meshes that are compared.
struct ComparedMeshes<'a> {
    compiled: &'a CompiledModel,
    count: usize,
    voltages: &'a PortVoltages,
    meshes: Vec<(Vec<usize>, ModesWithShapes)>,
}

impl ComparedMeshes<'_> {
    fn keep(&mut self, segments: Vec<usize>, found: ModesWithShapes) {
        if self.meshes.len() == MAX_CACHED_MESHES {
            self.meshes.remove(0);
        }
        self.meshes.push((segments, found));
    }

    /// The modes of a mesh.
    fn shaped(&mut self, segments: &[usize]) -> Result<&ModesWithShapes, AnalysisError> {
        let at = match self.meshes.iter().position(|(known, _)| known == segments) {
            Some(at) => at,
            None => {
                let model = meshed(self.compiled, segments)?;
                let found = modes_with_curves(&model, self.count, self.voltages)?;
                self.keep(segments.to_vec(), found);
                self.meshes.len() - 1
            }
        };
        Ok(&self.meshes[at].1)
    }

    fn outputs(&mut self, segments: &[usize]) -> Result<Vec<Output>, AnalysisError> {
        let count = self.count;
        Ok(frequency_outputs(&self.shaped(segments)?.0, count))
    }

    fn fit(&mut self, segments: Vec<usize>) -> Result<Mesh, AnalysisError> {
        let compiled = self.compiled;
        let mut analyse = |mesh: &[usize]| self.outputs(mesh);
        if !is_fine(compiled) {
            return doubling::fit(&compiled.structure, &compiled.options, segments, &mut analyse);
        }
        let options = compiled.options.with_tolerance(compiled.options.errors().first_order());
        let order = doubling::fit(&compiled.structure, &options, segments, &mut analyse)?;
        Ok(order.with_estimate_times(ErrorBudget::of_first_order_estimate()))
    }

    /// The modes on the mesh that was chosen, each with the difference that twice its segments make.
    fn finish(&mut self, order: Mesh) -> Result<(Mesh, ModesWithShapes), AnalysisError> {
        let compiled = self.compiled;
        let times = if is_fine(compiled) { ErrorBudget::of_first_order_estimate() } else { 1.0 };
        let (mut result, curves) = self.shaped(&order.segments)?.clone();
        let twice = doubling::twice(&compiled.options, &order).map(|twice| twice.segments);
        // without an estimate there is no finer mesh with modes
        let twice = twice.filter(|twice| order.estimated_error.is_some() && *twice != order.segments);
        if let Some(twice) = twice
            && let Ok(finer) = self.shaped(&twice)
        {
            let (structure, count) = (&compiled.structure, result.frequencies_hz.len());
            let errors = mode_pairs::errors(structure, (&result, &curves), (&finer.0, &finer.1));
            result.errors = errors.into_iter().map(|error| error.map(|error| times * error)).collect();
            result.errors.resize(count, None);
        }
        let of_modes = worst(result.errors.iter().copied()).filter(|_| order.estimated_error.is_some());
        let estimated_error = order.estimated_error.map(|error| error.max(of_modes.unwrap_or(0.0)));
        Ok((Mesh { estimated_error, ..order }, (result, curves)))
    }
}

/// Whether the tolerance is finer than what modes of the drawing know of their errors.
pub(super) fn is_fine(compiled: &CompiledModel) -> bool {
    compiled.options.junctions == Junctions::Calibrated && compiled.options.errors().requested() < FINEST_KNOWN
}

/// Whether what the mesh leaves uncertain of the equilibrium moves no frequency beyond the tolerance: next to a fold it does.
pub(super) fn is_carried(compiled: &CompiledModel, found: &ModesResult, still: Option<f64>) -> bool {
    let faster = found.per_deflection.iter().copied().fold(1.0, f64::max);
    still.is_some_and(|error| error * faster <= compiled.options.errors().comparison())
}

/// Largest of the errors; none where one of them is not known.
pub(super) fn worst(mut errors: impl Iterator<Item = Option<f64>>) -> Option<f64> {
    errors.try_fold(0.0, |worst: f64, error| Some(worst.max(error?.abs())))
}

/// Compared outputs of modes.
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
    compiled: &CompiledModel,
    order: Mesh,
    count: usize,
    voltages: &PortVoltages,
) -> Result<(Mesh, ModesWithShapes), AnalysisError> {
    let model = meshed(compiled, &order.segments)?;
    let found = modes_with_curves(&model, count, voltages)?;
    let estimated_error = worst(found.0.errors.iter().copied());
    Ok((Mesh { estimated_error, ..order }, found))
}
