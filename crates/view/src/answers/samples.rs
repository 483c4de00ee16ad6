//! Samples of parameters: values of one result, limits, yield, and the parameters of each sample.

use crate::answer::Answer;
use crate::bench::Bench;
use crate::question::{BenchState, YieldQuestion};
use crate::refusal::Refusal;
use bimorph_base::Setting;
use bimorph_jobs::sweep::statistics::{SweepStatistics, YieldLimit};
use bimorph_jobs::sweep::{self, SampleGenerator, Sampling, Shard, SweepAnalysis, SweepError, SweepSpec, Vary};
use bimorph_model::options::analysis::PULL_IN_MAX;
use serde_json::json;

/// Most samples of one request.
const MAX_SAMPLES: usize = 100_000;

/// Runs the samples. Every one is a point of a sweep, in lanes.
pub(crate) fn samples(
    bench: &Bench,
    state: &BenchState,
    asked: &YieldQuestion,
    progress: &(dyn Fn(f64) -> bool + Sync),
) -> Result<Answer, Refusal> {
    if asked.samples == 0 || asked.samples > MAX_SAMPLES {
        return Err(Refusal::of(format!("expected 1 to {MAX_SAMPLES} samples, got {}", asked.samples)));
    }
    let vary = asked.vary.iter().map(|text| text.parse()).collect::<Result<Vec<Vary>, SweepError>>();
    let vary = vary.map_err(Refusal::of)?;
    let names: Vec<String> = vary.iter().map(|vary| vary.name.clone()).collect();
    let sampling = Sampling { vary, count: asked.samples, seed: asked.seed, ..Sampling::default() };
    let mut voltages = state.voltages();
    voltages.retain(|(port, _)| !names.contains(&format!("{port}.v")));
    let analysis = match asked.analysis.as_str() {
        "static" => SweepAnalysis::Static { outputs: vec![asked.signal.clone()], voltages },
        "modes" => SweepAnalysis::Modes { count: 1, voltages },
        "pullin" => SweepAnalysis::PullIn { port: None, max: PULL_IN_MAX.number() },
        other => return Err(Refusal::of(format!("expected static, modes or pullin, got \"{other}\""))),
    };
    let spec = SweepSpec {
        parameters: Vec::new(),
        samples: Some(SampleGenerator::new(sampling).map_err(Refusal::of)?),
        analysis,
        shard: Shard::default(),
        threads: None,
    };
    let limits = asked.limits.iter().map(|text| text.parse()).collect::<Result<Vec<YieldLimit>, SweepError>>();
    let limits = limits.map_err(Refusal::of)?;
    // a parameter that varies is set by its samples
    let options = bench.compile_options(state).without(&names);
    let bundle = bench.bundle(state)?;
    let watch = |done: sweep::SweepProgress| progress(done.done as f64 / done.points.max(1) as f64);
    let table = sweep::run(&spec, &bundle, &options, &watch).map_err(|error| match error {
        SweepError::Cancelled { .. } => Refusal { superseded: true, ..Refusal::of(error) },
        other => Refusal::of(other),
    })?;
    let mut answer = Answer::default();
    answer.put("parameters", &table.parameters);
    answer.put("results", table.results.iter().zip(&table.units).collect::<Vec<_>>());
    let value = |setting: &Setting| match setting {
        Setting::Number(x) => json!(x),
        Setting::Text(text) => json!(text),
    };
    let row = |row: &sweep::SweepRow| {
        let first = row.values.as_ref().ok().and_then(|values| values.first().copied().flatten());
        let error = row.values.as_ref().err();
        json!([row.parameters.iter().map(value).collect::<Vec<_>>(), first, error])
    };
    answer.put("rows", table.rows.iter().map(row).collect::<Vec<_>>());
    if table.failed() < table.rows.len() {
        let statistics = SweepStatistics::of(&table, &limits).map_err(Refusal::of)?;
        let column = |c: &sweep::statistics::ColumnStatistics| {
            json!({ "name": c.name, "unit": c.unit, "mean": c.mean, "deviation": c.deviation,
                "percentiles": c.percentiles, "range": c.range })
        };
        answer.put("columns", statistics.columns.iter().map(column).collect::<Vec<_>>());
        let passed = statistics.passed;
        answer
            .put("passed", json!({ "passed": passed.passed, "points": passed.points, "interval": passed.interval() }));
    }
    Ok(answer)
}
