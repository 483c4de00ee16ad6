//! Natural frequencies, quality factors and shapes.

use super::sentences;
use crate::answer::Answer;
use crate::bench::Bench;
use crate::figure;
use crate::question::BenchState;
use crate::refusal::Refusal;
use bimorph_analysis::mesh::modes_fitted;
use bimorph_analysis::mode_quality::mode_losses;
use bimorph_model::options::OptionValue;
use bimorph_model::options::analysis::MODES_COUNT;

/// The lowest modes about the equilibrium at the state's port voltages.
pub(crate) fn modes(bench: &Bench, state: &BenchState, count: usize, shapes: bool) -> Result<Answer, Refusal> {
    MODES_COUNT.check(&OptionValue::Count(count)).map_err(Refusal::of)?;
    let voltages = state.voltages();
    let drawn = bench.compiled(state)?;
    let (fitted, result, curves) = modes_fitted(&drawn, count, &voltages)?;
    let mut answer = Answer::default();
    answer.put("frequencies_hz", &result.frequencies_hz);
    answer.put("errors", &result.errors);
    let losses = mode_losses(&fitted, result.frequencies_hz.len(), &voltages);
    let quality = |loss: &bimorph_analysis::mode_quality::ModeLoss| Some(loss.quality()).filter(|q| q.is_finite());
    answer.put("qualities", losses.ok().map(|losses| losses.iter().map(quality).collect::<Vec<_>>()));
    let warnings = sentences(&fitted.warnings.items).into_iter().chain(result.warnings.iter().cloned());
    answer.put("warnings", warnings.collect::<Vec<_>>());
    answer.put("deflection_m", result.deflection_m);
    if shapes && let Some(first) = curves.first() {
        figure::put(&mut answer, &fitted.structure, first, &[]);
        let all = result.shapes.iter().zip(&curves);
        let frames =
            all.flat_map(|(nodes, curves)| figure::motion(&fitted.structure, nodes, curves).collect::<Vec<_>>());
        answer.array("frames", frames);
    }
    Ok(answer)
}
