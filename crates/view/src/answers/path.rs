//! Paths of equilibria, pull-in and release.

use super::sentences;
use crate::answer::Answer;
use crate::bench::Bench;
use crate::question::{BenchState, PathQuestion};
use crate::refusal::Refusal;
use bimorph_analysis::critical_names::critical_points;
use bimorph_analysis::largest_motion::path_with_signals;
use bimorph_analysis::mesh::pull_in_fitted;
use bimorph_analysis::path_parameter::{PathModels, PathOptions, PathParameter};
use bimorph_model::options::OptionValue;
use bimorph_model::options::analysis::PATH_POINTS;
use bimorph_structure::FrontEnd;
use serde_json::json;
use std::sync::Arc;

/// A source that is shared.
#[derive(Debug)]
struct SharedSource(Arc<dyn FrontEnd>);

impl FrontEnd for SharedSource {
    fn load(
        &self,
        set: &[(String, bimorph_base::Setting)],
    ) -> Result<bimorph_structure::LoadedNetlist, bimorph_base::Diagnostics> {
        self.0.load(set)
    }
}

/// The path with its critical points by name.
pub(crate) fn path(
    bench: &Bench,
    state: &BenchState,
    asked: &PathQuestion,
    progress: &(dyn Fn(f64) -> bool + Sync),
) -> Result<Answer, Refusal> {
    PATH_POINTS.check(&OptionValue::Count(asked.points)).map_err(Refusal::of)?;
    let drawn = bench.compiled(state)?;
    let mut voltages = state.voltages();
    voltages.retain(|(port, _)| *port != asked.along);
    let options = PathOptions {
        along: asked.along.clone(),
        from: asked.from,
        to: asked.to,
        voltages,
        signals: asked.signals.clone(),
        points: asked.points,
        ..PathOptions::default()
    };
    let parameter = PathParameter::find(&drawn, &asked.along).map_err(Refusal::of)?;
    let source = bench.source(state)?;
    let models = PathModels::new(parameter, &drawn, &options, || Ok::<_, Refusal>(SharedSource(source)))?;
    let (first, input) = models.input(&drawn, &asked.along);
    let (fitted, result) = path_with_signals(first, &options.request(input), &mut |fraction| progress(fraction))?;
    let mut answer = Answer::default();
    answer.put("along", &asked.along);
    answer.put("unit", models.unit());
    answer.put("values", &result.values);
    answer.put("signals", &result.signals);
    answer.put("stable", result.negative.iter().map(|n| *n == 0).collect::<Vec<_>>());
    let rises = (asked.to - asked.from).signum();
    let named = critical_points(&fitted, &asked.along, rises, &result);
    let critical =
        named.iter().map(|(point, name)| json!({ "name": name, "value": point.value, "point": point.point }));
    answer.put("critical", critical.collect::<Vec<_>>());
    answer.put("end", result.end);
    let warnings = sentences(&fitted.warnings.items).into_iter().chain(result.warnings.iter().cloned());
    answer.put("warnings", warnings.collect::<Vec<_>>());
    Ok(answer)
}

/// Pull-in and release of a port.
pub(crate) fn pull_in(bench: &Bench, state: &BenchState, port: Option<&str>, max: f64) -> Result<Answer, Refusal> {
    let drawn = bench.compiled(state)?;
    let (_, result) = pull_in_fitted(&drawn, port, max)?;
    let mut answer = Answer::default();
    answer.put("pull_in", &result);
    answer.put("notes", result.notes());
    Ok(answer)
}
