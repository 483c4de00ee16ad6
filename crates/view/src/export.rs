//! Exported pages: the answers to some requests inside one page.

use crate::answers::ranges::port_range;
use crate::bench::Bench;
use crate::page;
use crate::question::{Ask, BenchState, PATH_POINTS, PathQuestion, Question};
use bimorph_model::compile::CompiledModel;
use bimorph_model::options::analysis::PULL_IN_MAX;
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;

/// Modes of an export by the command.
const EXPORTED_MODES: usize = 6;

impl Bench {
    /// A page that needs nothing else, of the device as it was given: statics, modes, and the path along its first port. `compiled` is its model.
    pub fn export(&self, compiled: &CompiledModel) -> String {
        let ports = self.options.voltages.iter().cloned().collect();
        let state = BenchState { ports, ..BenchState::default() };
        let mut asks = BTreeMap::from([
            ("describe".to_owned(), Ask::Describe {}),
            ("layout".to_owned(), Ask::Layout {}),
            ("static".to_owned(), Ask::Static {}),
            ("frequencies".to_owned(), Ask::Modes { count: EXPORTED_MODES, shapes: false }),
            ("modes".to_owned(), Ask::Modes { count: EXPORTED_MODES, shapes: true }),
        ]);
        if let Some(port) = compiled.structure.ports.first() {
            let interval = port_range(compiled, &port.name).interval;
            let path = PathQuestion {
                along: port.name.clone(),
                from: interval.low,
                to: interval.high,
                signals: Vec::new(),
                points: PATH_POINTS,
            };
            asks.insert("curve".to_owned(), Ask::Path(path));
            let pull_in = Ask::Pullin { port: Some(port.name.clone()), max: PULL_IN_MAX.number() };
            asks.insert("pullin".to_owned(), pull_in);
        }
        let view = serde_json::json!({ "ports": state.ports });
        export(self, &state, &asks, &view, &|_| true)
    }
}

/// A page with the answers to `asks`. An analysis without a result is in it with its reason.
pub(crate) fn export(
    bench: &Bench,
    state: &BenchState,
    asks: &BTreeMap<String, Ask>,
    view: &Value,
    progress: &(dyn Fn(f64) -> bool + Sync),
) -> String {
    let mut records = Map::new();
    for (k, (name, ask)) in asks.iter().enumerate() {
        let question = Question { channel: name.clone(), state: state.clone(), ask: ask.clone() };
        let within = |fraction: f64| progress((k as f64 + fraction) / asks.len() as f64);
        let record = match bench.answer(&question, &within) {
            Ok(answer) => json!({ "answer": page::base64(&answer.bytes()) }),
            Err(refusal) => json!({ "refusal": refusal }),
        };
        records.insert(name.clone(), record);
    }
    page::self_contained(&bench.title(), &records, view)
}
