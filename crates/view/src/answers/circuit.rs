//! Runs of ngspice on decks beside the file.

use crate::answer::Answer;
use crate::bench::Bench;
use crate::question::BenchState;
use crate::refusal::Refusal;
use bimorph_base::budget;
use bimorph_cosim::{CosimOptions, find_ngspice, run};
use bimorph_results::raw;
use serde_json::json;

/// Rows of a table that the page receives.
const MAX_ROWS: usize = 20_000;

/// Runs a deck that stands beside the file. It simulates the file on disk, with the values that the deck gives.
pub(crate) fn circuit(
    bench: &Bench,
    state: &BenchState,
    deck: &str,
    progress: &(dyn Fn(f64) -> bool + Sync),
) -> Result<Answer, Refusal> {
    let _ = state;
    let known = bench.decks();
    let named = |path: &&std::path::PathBuf| path.file_name().is_some_and(|name| name == deck);
    let Some(path) = known.iter().find(named) else {
        return Err(Refusal::of(format!("no deck \"{deck}\" beside {}", bench.options.file.display())));
    };
    if find_ngspice().is_none() {
        return Err(Refusal::of("ngspice is not installed: install it, or name it in NGSPICE"));
    }
    let scratch = tempfile::tempdir().map_err(Refusal::of)?;
    let out = scratch.path().join("circuit.raw");
    let options = CosimOptions { deck: path.clone(), raw: Some(out.clone()), capture: true, ..CosimOptions::default() };
    let budget = budget::current();
    let continues = || budget.as_ref().is_none_or(|budget| budget::within(budget, || ()).is_ok()) && progress(0.0);
    let report = run(&options, &continues).map_err(Refusal::of)?;
    let bytes = std::fs::read(&out).map_err(Refusal::of)?;
    let tables = raw::read(&bytes).map_err(Refusal::of)?;
    let Some(table) = tables.iter().max_by_key(|table| table.rows()) else {
        return Err(Refusal::of("the deck left no waveforms"));
    };
    let step = table.rows().div_ceil(MAX_ROWS).max(1);
    let column = |c: &bimorph_results::table::Column| {
        let values = if table.is_complex() { c.samples.magnitudes() } else { c.samples.real_parts() };
        let kept: Vec<f64> = values.into_iter().step_by(step).collect();
        json!({ "name": c.name, "unit": c.unit, "values": kept })
    };
    let mut answer = Answer::default();
    answer.put("deck", deck);
    answer.put("text", std::fs::read_to_string(path).unwrap_or_default());
    answer.put("plot", &table.plot_name);
    answer.put("complex", table.is_complex());
    answer.put("columns", table.columns().iter().map(column).collect::<Vec<_>>());
    answer.put("warnings", report.warnings().collect::<Vec<_>>());
    Ok(answer)
}
