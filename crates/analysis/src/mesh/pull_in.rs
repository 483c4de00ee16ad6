//! The mesh for pull-in: both voltages, compared with those of twice the segments.

use super::super::AnalysisError;
use super::super::linear_stress::left_out;
use super::super::pull_in::{PullInResult, pull_in, pull_in_with};
use super::super::reduced::not_reduced;
use super::super::statics::operating_point;
use super::refined::refining;
use super::remeshed::{chosen, meshed, on};
use super::warnings::of_stress;
use bimorph_base::Diagnostic;
use bimorph_model::compile::CompiledModel;
use bimorph_model::refine::doubling::{self, Output};
use bimorph_model::refine::mesh_search::Mesh;

/// Fraction of the pull-in voltage that stands for the fold itself, next to which nothing has an equilibrium for sure.
const NEXT: f64 = 0.98;

/// Compared outputs of pull-in.
pub(super) fn pull_in_outputs(found: &PullInResult) -> Vec<Output> {
    let output = |volts: f64| Output { value: volts, scale: volts.abs().max(f64::MIN_POSITIVE) };
    vec![output(found.pull_in_v), found.release_v.map_or(Output { value: f64::NAN, scale: 1.0 }, output)]
}

/// Pull-in on the mesh for it, which comes with it.
///
/// # Errors
/// See [`super::static_fitted`].
pub fn pull_in_fitted(
    compiled: &CompiledModel,
    port: Option<&str>,
    max: f64,
) -> Result<(CompiledModel, PullInResult), AnalysisError> {
    not_reduced(compiled, "pullin")?;
    let (order, found) = for_pull_in(compiled, port, max)?;
    let mut fitted = on(compiled, order)?;
    let known = found.into_iter().find(|(segments, _)| *segments == fitted.order.segments);
    let result = match known {
        Some((_, result)) => PullInResult { estimated_error: fitted.order.estimated_error, ..result },
        None => pull_in(&fitted, port, max)?,
    };
    let reported = pull_in_warnings(&fitted, &result);
    fitted.warnings.items.extend(reported);
    Ok((fitted, result))
}

/// Warnings about a pull-in beside its mesh: stress stiffening omitted by a linear model at its voltage.
pub(super) fn pull_in_warnings(fitted: &CompiledModel, result: &PullInResult) -> Vec<Diagnostic> {
    let before = || operating_point(fitted, &[(result.port.clone(), NEXT * result.pull_in_v)]).ok();
    let point = if fitted.options.linear { before() } else { None };
    let share = point.and_then(|point| left_out(fitted, &point, &point.q));
    of_stress(fitted, share).into_iter().collect()
}

/// The mesh for pull-in, and the results of every compared mesh.
pub(super) fn for_pull_in(
    compiled: &CompiledModel,
    port: Option<&str>,
    max: f64,
) -> Result<(Mesh, OfMeshes), AnalysisError> {
    refining(compiled, |compiled| pull_in_from(compiled, port, max))
}

fn pull_in_from(compiled: &CompiledModel, port: Option<&str>, max: f64) -> Result<(Mesh, OfMeshes), AnalysisError> {
    let mut known: OfMeshes = Vec::new();
    let mut analyse = |segments: &[usize]| {
        let model = meshed(compiled, segments)?;
        // a coarse mesh snaps where a fine one does, and more often
        let snaps = known.first().is_none_or(|(_, first)| !first.snaps_v.is_empty());
        let found = pull_in_with(&model, port, max, snaps)?;
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

/// Pull-in on some meshes.
pub(super) type OfMeshes = Vec<(Vec<usize>, PullInResult)>;
