//! Description of the device: parameters and ports with their units and ranges, files, signals, decks.

use super::effects::unit_of;
use super::ranges::{PortRange, SliderRange, about_value, about_whole, about_zero, port_range};
use crate::answer::Answer;
use crate::bench::Bench;
use crate::question::BenchState;
use crate::refusal::{LineMessage, Refusal};
use bimorph_analysis::signal::names;
use bimorph_base::Setting;
use bimorph_model::compile::CompiledModel;
use serde_json::{Value, json};

/// Signals offered to choose from.
const MAX_SIGNALS: usize = 4000;

/// The description of the device in a state of the bench.
pub(crate) fn describe(bench: &Bench, state: &BenchState) -> Result<Answer, Refusal> {
    let mut answer = Answer::default();
    answer.put("title", bench.title());
    answer.put("file", bench.options.file.display().to_string());
    answer.put("editable", bench.editable());
    answer.put("has_layout", bench.options.layout.is_some());
    answer.put("root", &bench.options.bundle.root);
    answer.put("files", &bench.options.bundle.files);
    answer.put("version", env!("CARGO_PKG_VERSION"));
    let name = |path: &std::path::PathBuf| path.file_name().map(|name| name.to_string_lossy().into_owned());
    answer.put("decks", bench.decks().iter().filter_map(name).collect::<Vec<_>>());
    answer.put("initial_ports", bench.options.voltages.iter().cloned().collect::<std::collections::BTreeMap<_, _>>());
    // a netlist with errors is shown with them, so that it can be mended
    match bench.compiled(state) {
        Ok(drawn) => {
            let text = state.text.as_deref().unwrap_or(bench.text());
            let described =
                drawn.parameters.iter().map(|(name, value)| parameter(bench, state, &drawn, text, name, value));
            answer.put("parameters", described.collect::<Vec<_>>());
            answer.put("ports", drawn.structure.ports.iter().map(|p| port(&drawn, &p.name)).collect::<Vec<_>>());
            let signals = names(&drawn);
            answer.put("signals", &signals[..signals.len().min(MAX_SIGNALS)]);
            answer.put("diagnostics", drawn.warnings.items.iter().map(LineMessage::from).collect::<Vec<_>>());
        }
        Err(refused) if refused.superseded => return Err(refused),
        Err(refused) => {
            for list in ["parameters", "ports", "signals"] {
                answer.put(list, Value::Array(Vec::new()));
            }
            answer.put("error", &refused.error);
            answer.put("diagnostics", &refused.diagnostics);
        }
    }
    Ok(answer)
}

fn port(drawn: &CompiledModel, name: &str) -> Value {
    let PortRange { interval, pull_in_v, no_pull_in } = port_range(drawn, name);
    json!({
        "name": name, "unit": "V", "low": interval.low, "high": interval.high, "pull_in_v": pull_in_v, "no_pull_in": no_pull_in,
    })
}

/// A parameter with its unit and range: those of its comment, else by its effect and ± 50 %.
fn parameter(
    bench: &Bench,
    state: &BenchState,
    drawn: &CompiledModel,
    text: &str,
    name: &str,
    value: &Setting,
) -> Value {
    let comment = comment(text, name);
    let x = match value {
        Setting::Number(x) => *x,
        Setting::Text(word) => return json!({ "name": name, "text": word, "about": comment.about }),
    };
    let changed = |value: f64| bench.compiled_with(state, name, value).ok();
    let unit = comment.unit.unwrap_or_else(|| unit_of(drawn, x, &changed).to_owned());
    let whole = x.fract() == 0.0 && unit.is_empty() && x.abs() <= 1000.0 && x != 0.0;
    let interval = comment.interval.unwrap_or_else(|| match x {
        0.0 => about_zero(drawn, &changed, &state.voltages()),
        _ if whole => about_whole(x),
        _ => about_value(x),
    });
    json!({
        "name": name, "value": x, "unit": unit, "about": comment.about,
        "low": interval.low.min(x), "high": interval.high.max(x), "whole": whole,
    })
}

/// Content of the comment behind a `param`.
#[derive(Debug, Default, PartialEq)]
struct ParameterComment {
    /// Its words.
    about: String,
    /// A unit in brackets.
    unit: Option<String>,
    /// A range in brackets, LOW:HIGH.
    interval: Option<SliderRange>,
}

/// The comment behind the `param` of that name: `param w = 2u % width of the beams [m] [1.5u:3u]`.
fn comment(text: &str, name: &str) -> ParameterComment {
    let defines = |line: &&str| {
        let code = line.split('%').next().unwrap_or("").trim();
        code.strip_prefix("param ").is_some_and(|rest| rest.split('=').next().is_some_and(|n| n.trim() == name))
    };
    let Some((_, words)) = text.lines().find(defines).and_then(|line| line.split_once('%')) else {
        return ParameterComment::default();
    };
    let mut found = ParameterComment::default();
    let mut rest = words.trim();
    while let Some((before, inside)) = rest.split_once('[') {
        let Some((inside, after)) = inside.split_once(']') else { break };
        found.about += before;
        let number = |text: &str| bimorph_jobs::sweep::number(text.trim()).filter(|x| x.is_finite());
        let ends = inside.split_once(':').and_then(|(low, high)| Some((number(low)?, number(high)?)));
        match ends {
            Some((low, high)) if low < high => found.interval = Some(SliderRange { low, high }),
            _ => found.unit = Some(inside.trim().to_owned()),
        }
        rest = after.trim_start_matches(';');
    }
    found.about += rest;
    found.about = found.about.trim().trim_end_matches('.').trim().to_owned();
    found
}

/// The polygons of the layout.
pub(crate) fn layout(bench: &Bench) -> Answer {
    let mut answer = Answer::default();
    let none = Default::default();
    let ground = bench.options.layout.as_ref().unwrap_or(&none);
    let layers =
        ground.layers.iter().map(|(name, contours)| json!([name, contours.iter().map(Vec::len).collect::<Vec<_>>()]));
    answer.put("layers", layers.collect::<Vec<_>>());
    answer
        .array("contours", ground.layers.iter().flat_map(|(_, contours)| contours.iter().flatten().flatten().copied()));
    answer
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Units and ranges of comments, as the function documents them.
    #[test]
    fn comments_have_units_and_ranges() {
        let text = "param F = 0 % force on the plate [N]\nparam w=2u % width [m] [1.5u:3u].\nparam a=1,b=2\n% param c = 1 % no\n";
        let force = comment(text, "F");
        assert_eq!(
            (force.about.as_str(), force.unit.as_deref(), force.interval),
            ("force on the plate", Some("N"), None)
        );
        let width = comment(text, "w");
        assert_eq!(width.interval, Some(SliderRange { low: 1.5e-6, high: 3e-6 }));
        assert_eq!((width.about.as_str(), width.unit.as_deref()), ("width", Some("m")));
        assert_eq!(comment(text, "c"), ParameterComment::default());
    }
}
