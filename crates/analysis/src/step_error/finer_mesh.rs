//! A run in which parts touch, compared with a run on twice the segments.
//!
//! The mesh of a run follows from its motion before a contact. An impact sets off modes that this motion does not have, so that the run after the contact may be
//! off by more than the estimate of the mesh.

use super::super::after_contact::{CompanionRuns, MeshOrSteps, first_contact, judge};
use super::super::mesh::remeshed::meshed;
use super::super::transient::{TransientOptions, TransientResult, transient};
use super::super::{AnalysisError, ProgressCallback};
use super::run::MAX_AGAIN;
use super::samples::{SelectedSamples, columns, spacing};
use bimorph_model::compile::CompiledModel;
use bimorph_model::options::Formulation;
use bimorph_model::refine::doubling;

/// Work of a run on twice the segments, of that of the run (1).
const FINER: f64 = 4.0;

/// Compares a run with one on twice the segments where parts touched in it and its steps hold, and sets what `result` reports of the time after the contact. A
/// run that would take long is not compared.
///
/// # Errors
/// [`AnalysisError::Cancelled`].
pub(super) fn judge_mesh(
    options: &TransientOptions<'_>,
    model: &CompiledModel,
    (result, picked): (&mut TransientResult, &TransientResult),
    least: &dyn Fn(&str) -> f64,
    watch: ProgressCallback<'_>,
) -> Result<(), AnalysisError> {
    let work = FINER * result.counters.steps as f64 * model.unknowns() as f64;
    let holds = first_contact(result).is_some() && result.reliable_until.is_none();
    if !holds || work > MAX_AGAIN || model.options.formulation == Formulation::Reduced || options.signals.is_empty() {
        return Ok(());
    }
    let finer = doubling::twice(&model.options, &model.order).filter(|finer| finer.segments != model.order.segments);
    let Some(finer) = finer else { return Ok(()) };
    let start = options.release.map(|start| meshed(start, &finer.segments)).transpose();
    let (Ok(fine), Ok(start)) = (meshed(model, &finer.segments), start) else { return Ok(()) };
    let options = options.with_release(start.as_deref());
    let mut samples = SelectedSamples::new(&options);
    // the run itself has come to its end
    let mut goes_on = |_: f64| watch(1.0);
    match transient(&fine, &options, &mut |_, values| samples.add(values), &mut goes_on) {
        Ok(_) => {}
        Err(AnalysisError::Cancelled) => return Err(AnalysisError::Cancelled),
        Err(_) => return Ok(()),
    }
    let (run, finer) = (columns(&picked.signals), columns(&samples.signals(&result.signals)));
    let pair = CompanionRuns {
        spacing: spacing(&options),
        run: &run,
        companion: Some(&finer),
        differs_in: MeshOrSteps::FinerMesh,
    };
    judge(&pair, &options, least, result);
    Ok(())
}
