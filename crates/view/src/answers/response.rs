//! Frequency responses.

use super::sentences;
use crate::answer::Answer;
use crate::bench::Bench;
use crate::question::{BenchState, ResponseQuestion};
use crate::refusal::Refusal;
use bimorph_analysis::harmonic::grid::Spacing;
use bimorph_analysis::harmonic::{HarmonicOptions, Root};
use bimorph_analysis::mesh::harmonic_fitted;
use serde_json::json;

/// The response about the equilibrium at the state's port voltages.
pub(crate) fn response(
    bench: &Bench,
    state: &BenchState,
    asked: &ResponseQuestion,
    progress: &(dyn Fn(f64) -> bool + Sync),
) -> Result<Answer, Refusal> {
    let options = HarmonicOptions {
        drive: asked.drive.clone(),
        signals: asked.signals.clone(),
        from: asked.from,
        to: asked.to,
        points: asked.points,
        spacing: Spacing::Logarithmic,
        even: false,
        by_modes: false,
        modes: None,
        voltages: state.voltages(),
    };
    options.check()?;
    let drawn = bench.compiled(state)?;
    let (fitted, result) = harmonic_fitted(&drawn, &options, &mut |fraction| progress(fraction))?;
    let mut answer = Answer::default();
    answer.put("drive", &result.drive);
    answer.put("drive_unit", &result.drive_unit);
    answer.put("frequencies_hz", &result.frequencies_hz);
    let signals = result
        .signals
        .iter()
        .map(|signal| json!({ "name": signal.name, "unit": signal.unit, "values": signal.values }));
    answer.put("signals", signals.collect::<Vec<_>>());
    let poles = result.poles.iter().flatten();
    let pole = |root: &Root| json!({ "frequency_hz": root.frequency_hz(), "quality": root.quality() });
    answer.put("poles", poles.map(pole).collect::<Vec<_>>());
    let warnings = sentences(&fitted.warnings.items).into_iter().chain(result.warnings.iter().cloned());
    answer.put("warnings", warnings.collect::<Vec<_>>());
    Ok(answer)
}
