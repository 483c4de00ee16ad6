//! One point of a grid: compile with its parameter values, run the analysis, keep named numbers.

use super::{SweepAnalysis, SweepSpec};
use crate::analysis::{modes, pull_in, statics};
use crate::compile::{CompileError, CompileOptions, Compiled, compile};
use crate::netlist::{Bundle, Setting, Severity};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// A result: its column, its unit, and its value; none: the quantity does not exist at this point.
pub(super) struct Value {
    pub(super) name: String,
    pub(super) unit: &'static str,
    pub(super) value: Option<f64>,
}

/// What came of one point.
pub(super) struct Outcome {
    pub(super) number: usize,
    pub(super) parameters: Vec<Setting>,
    pub(super) values: Result<Vec<Value>, String>,
}

/// Runs point `number`. A fault inside is that point's error: it must not take the other points with it.
pub(super) fn run(spec: &SweepSpec, number: usize, bundle: &Bundle, options: &CompileOptions) -> Outcome {
    let settings = spec.settings(number);
    let values = catch_unwind(AssertUnwindSafe(|| solve(spec, &settings, bundle, options)))
        .unwrap_or_else(|_| Err("internal fault at this point".to_owned()));
    Outcome { number, parameters: settings.into_iter().map(|(_, value)| value).collect(), values }
}

fn solve(
    spec: &SweepSpec,
    settings: &[(String, Setting)],
    bundle: &Bundle,
    options: &CompileOptions,
) -> Result<Vec<Value>, String> {
    let mut options = options.clone();
    options.set.retain(|(name, _)| settings.iter().all(|(swept, _)| swept != name));
    options.set.extend_from_slice(settings);
    let compiled = compile(bundle, &options).map_err(|error| brief(&error))?;
    analyse(&compiled, &spec.analysis)
}

/// A table has one line for an error: of a netlist's, the first with its place.
fn brief(error: &CompileError) -> String {
    let CompileError::Netlist(diagnostics) = error else { return error.to_string() };
    let mut errors = diagnostics.items.iter().filter(|d| d.severity == Severity::Error);
    let Some(first) = errors.next() else { return "the netlist has errors".to_owned() };
    let more = match errors.count() {
        0 => String::new(),
        n => format!(" (and {n} more)"),
    };
    format!("{}:{}:{}: {} {}{more}", first.file, first.line, first.column, first.code, first.message)
}

fn analyse(compiled: &Compiled, analysis: &SweepAnalysis) -> Result<Vec<Value>, String> {
    match analysis {
        SweepAnalysis::Static { outputs, voltages } => {
            let result = statics::static_equilibrium(compiled, voltages).map_err(|error| error.to_string())?;
            static_values(&result, outputs)
        }
        SweepAnalysis::Modes { count, voltages } => {
            let result = modes::modes(compiled, *count, voltages).map_err(|error| error.to_string())?;
            let named = |(i, f): (usize, &f64)| value(format!("f{}", i + 1), "Hz", Some(*f));
            finite(result.frequencies_hz.iter().enumerate().map(named).collect())
        }
        SweepAnalysis::PullIn { port, max } => {
            let result = pull_in::pull_in(compiled, port.as_deref(), *max).map_err(|error| error.to_string())?;
            finite(vec![
                value("pull_in".into(), "V", Some(result.pull_in_v)),
                value("release".into(), "V", result.release_v),
            ])
        }
    }
}

fn static_values(result: &statics::StaticResult, outputs: &[String]) -> Result<Vec<Value>, String> {
    let mut all = Vec::with_capacity(3 * result.nodes.len());
    for (node, motion) in &result.nodes {
        all.push(value(format!("{node}.x"), "m", Some(motion.x)));
        all.push(value(format!("{node}.y"), "m", Some(motion.y)));
        all.push(value(format!("{node}.rz"), "rad", Some(motion.rz)));
    }
    if outputs.is_empty() {
        return finite(all);
    }
    all.extend(result.temperatures_k.iter().map(|(name, t)| value(format!("{name}.T"), "K", Some(*t))));
    all.extend(result.currents_a.iter().map(|(name, i)| value(format!("{name}.i"), "A", Some(*i))));
    all.extend(result.charges_c.iter().map(|(name, q)| value(format!("{name}.q"), "C", Some(*q))));
    let pick = |name: &String| {
        let found = all.iter().find(|v| v.name == *name);
        found.map(|v| value(v.name.clone(), v.unit, v.value)).ok_or_else(|| {
            format!("no output named \"{name}\"; expected NODE.x, NODE.y, NODE.rz, BEAM.T, PORT.i or PORT.q")
        })
    };
    finite(outputs.iter().map(pick).collect::<Result<_, _>>()?)
}

fn value(name: String, unit: &'static str, value: Option<f64>) -> Value {
    Value { name, unit, value }
}

/// A table holds numbers or a reason; an infinity or a NaN is neither.
fn finite(values: Vec<Value>) -> Result<Vec<Value>, String> {
    match values.iter().find(|v| v.value.is_some_and(|x| !x.is_finite())) {
        Some(v) => Err(format!("{} is not finite", v.name)),
        None => Ok(values),
    }
}
