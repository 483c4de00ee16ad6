//! One point of a grid: compile with its parameter values, run the analysis, keep named numbers.

use super::axis::{VOLTS, at, chosen};
use super::error::SweepError;
use super::journal::JournalRow;
use super::point_budget::PointBudget;
use super::point_error::Failed;
use super::shared_meshes::SharedMeshes;
use super::spec::{SweepAnalysis, SweepSpec};
use bimorph_analysis::mesh::on_given_mesh::{AnalysisResult, Assessment, assess, refine_and_assess};
use bimorph_analysis::mesh::{self, MeshRequest};
use bimorph_analysis::readout::ReadoutError;
use bimorph_analysis::readout::expression::Expression;
use bimorph_analysis::static_outputs::{self, OUTPUTS};
use bimorph_analysis::{AnalysisError, statics};
use bimorph_base::budget;
use bimorph_base::{Setting, Severity};
use bimorph_model::compile::{CompileError, CompileOptions, Formulation, draw};
use bimorph_netlist::NetlistSource;
use bimorph_structure::is_anchor_motion;
use std::borrow::Cow;
use std::collections::HashSet;

/// Ports that a refusal names.
const MAX_LISTED_PORTS: usize = 20;
/// The code of the diagnostic for a setting that names no parameter.
const NO_PARAMETER: &str = "E048";

/// A result: its column, its unit, and its value; none: the quantity does not exist at this point.
pub(super) struct PointValue {
    pub(super) name: String,
    pub(super) unit: Cow<'static, str>,
    pub(super) value: Option<f64>,
}

/// Outcome of one point.
pub(super) struct PointOutcome {
    pub(super) number: usize,
    pub(super) parameters: Vec<Setting>,
    pub(super) values: Result<PointResults, Failed>,
}

/// The results of a point.
pub(super) struct PointResults {
    pub(super) values: Vec<PointValue>,
    /// Largest estimated relative error by the mesh (1).
    pub(super) estimated_error: Option<f64>,
    /// Code and message; empty without one.
    pub(super) warning: String,
}

impl PointOutcome {
    /// Bytes that it takes until the table is made, about.
    pub(super) fn bytes(&self) -> usize {
        let parameter = |value: &Setting| if let Setting::Text(text) = value { text.len() } else { 0 };
        let parameters: usize = self.parameters.iter().map(|value| size_of::<Setting>() + parameter(value)).sum();
        let values = match &self.values {
            Ok(found) => {
                let values = found.values.iter().map(|value| size_of::<PointValue>() + value.name.len());
                values.sum::<usize>() + found.warning.len()
            }
            Err(error) => error.to_string().len(),
        };
        // and once more in the table
        2 * (size_of::<Self>() + parameters + values)
    }
}

impl PointOutcome {
    /// Its row in a journal.
    pub(super) fn kept(&self) -> JournalRow {
        let (values, estimated_error, warning, error) = match &self.values {
            Ok(found) => {
                let each = found.values.iter().map(|v| (v.name.clone(), v.unit.clone().into_owned(), v.value));
                (each.collect(), found.estimated_error, found.warning.clone(), None)
            }
            Err(error) => (Vec::new(), None, String::new(), Some(error.to_string())),
        };
        JournalRow { point: self.number, values, estimated_error, warning, error }
    }
}

impl JournalRow {
    /// The point as it was.
    pub(super) fn outcome(self, spec: &SweepSpec) -> PointOutcome {
        let parameters = spec.settings(self.point).into_iter().map(|(_, value)| value).collect();
        self.with(parameters)
    }

    /// The same with the values of its parameters.
    pub(super) fn with(self, parameters: Vec<Setting>) -> PointOutcome {
        let Self { point: number, values, estimated_error, warning, error } = self;
        let value = |(name, unit, value): (String, String, _)| PointValue { name, unit: unit.into(), value };
        let values = match error {
            Some(error) => Err(error.into()),
            None => Ok(PointResults { values: values.into_iter().map(value).collect(), estimated_error, warning }),
        };
        PointOutcome { number, parameters, values }
    }
}

/// Runs point `number`.
pub(super) fn run(
    spec: &SweepSpec,
    number: usize,
    source: &NetlistSource,
    options: &CompileOptions,
    family: &SharedMeshes<'_>,
    means: &PointBudget,
) -> PointOutcome {
    let settings = spec.settings(number);
    let values = means.guarded(|| solve(spec, &settings, source, options, family));
    PointOutcome { number, parameters: settings.into_iter().map(|(_, value)| value).collect(), values }
}

/// Refuses parameters and outputs that the netlist does not have: at every point they would be an error.
pub(super) fn check_names(
    spec: &SweepSpec,
    source: &NetlistSource,
    options: &CompileOptions,
) -> Result<(), SweepError> {
    let refused =
        |what: &str, expected: String, got: String| Err(SweepError::BadSpec { what: what.into(), expected, got });
    let settings = spec.settings(0);
    let formulation = at(&chosen(options, &settings), &settings).formulation;
    if formulation == Formulation::Reduced && !matches!(spec.analysis, SweepAnalysis::Transient { .. }) {
        let expected = "compliant in sweeps of this analysis; sweeps of tran take reduced models, too".to_owned();
        return refused("formulation", expected, formulation.name().to_owned());
    }
    let drawn = match draw(source, &at(&chosen(options, &settings), &settings)) {
        Ok(drawn) => drawn,
        Err(CompileError::Netlist(diagnostics)) => {
            let Some(d) = diagnostics.items.iter().find(|d| d.code == NO_PARAMETER) else { return Ok(()) };
            let name = d.message.split('`').nth(1).unwrap_or_default();
            return refused("parameters", format!("parameters of the netlist ({})", d.help), format!("\"{name}\""));
        }
        // the points will say it
        Err(_) => return Ok(()),
    };
    let ports = || drawn.structure.ports.iter().map(|port| port.name.as_str());
    let driven: Vec<String> = drawn.structure.driven_inputs().collect();
    let names: HashSet<&str> = ports().chain(driven.iter().map(String::as_str)).collect();
    if let Some(none) = spec.ports().find(|name| !names.contains(name)) {
        let known = ports().map(|port| format!("{port}{VOLTS}")).chain(driven.iter().cloned());
        let known = known.take(MAX_LISTED_PORTS).collect::<Vec<_>>().join(", ");
        let suffix = if is_anchor_motion(none) { "" } else { VOLTS };
        let expected = format!("voltages of ports and motions of driven anchors ({known})");
        return refused("parameters", expected, format!("\"{none}{suffix}\""));
    }
    let outputs = match &spec.analysis {
        SweepAnalysis::Static { outputs, .. } => outputs,
        SweepAnalysis::Transient { outputs, .. } => {
            let Ok(compiled) = drawn.compile() else { return Ok(()) };
            let refusal = outputs.iter().find_map(|name| Expression::of_run(&compiled, name, &[]).err());
            return match refusal {
                Some(error) => refused("outputs", "signals of the netlist".to_owned(), error.to_string()),
                None => Ok(()),
            };
        }
        SweepAnalysis::Modes { .. } | SweepAnalysis::PullIn { .. } => return Ok(()),
    };
    match static_outputs::check(&drawn.structure, outputs) {
        Ok(()) => Ok(()),
        Err(ReadoutError::UnknownSignal { name, .. }) => refused("outputs", OUTPUTS.to_owned(), format!("\"{name}\"")),
        Err(error) => refused("outputs", format!("{OUTPUTS}, or a sum of these"), error.to_string()),
    }
}

fn solve(
    spec: &SweepSpec,
    settings: &[(String, Setting)],
    source: &NetlistSource,
    options: &CompileOptions,
    family: &SharedMeshes<'_>,
) -> Result<PointResults, String> {
    let drawn = draw(source, &at(options, settings)).map_err(|error| brief(&error))?;
    let said = |error: AnalysisError| error.to_string();
    let analysis = spec.analysis_at(settings);
    let request = analysis.request().ok_or("a transient is no request for a mesh")?;
    if let MeshRequest::Modes { count, .. } = request {
        // where it does not compile the point says so below
        budget::modes(count, || drawn.clone().compile().map_or(0, |compiled| compiled.unknowns()));
    }
    let shared = family.solve(&drawn, &request).map_err(said)?;
    let assessed = match shared {
        Some(assessed) => assessed,
        None => {
            let compiled = drawn.compile().map_err(|error| brief(&error))?;
            let judge = if options.segments.is_some() { assess } else { refine_and_assess };
            judge(&compiled, &request).map_err(said)?
        }
    };
    found(assessed, spec, options)
}

/// The stored part of a result.
pub(super) fn found(assessed: Assessment, spec: &SweepSpec, options: &CompileOptions) -> Result<PointResults, String> {
    let estimated_error = assessed.estimated_error;
    let beyond = mesh::beyond(options.errors(), estimated_error).map(|message| format!("{}: {message}", mesh::WARNING));
    let warnings: Vec<String> = beyond.into_iter().chain(assessed.warnings).collect();
    let values = values(&assessed.answer, &spec.analysis)?;
    // its warning contains it; files of JSON have no infinity
    let estimated_error = estimated_error.filter(|error| error.is_finite());
    Ok(PointResults { values, estimated_error, warning: warnings.join("; ") })
}

/// A table has one line for an error: of a netlist's, the first with its place.
pub(super) fn brief(error: &CompileError) -> String {
    let CompileError::Netlist(diagnostics) = error else { return error.to_string() };
    let mut errors = diagnostics.items.iter().filter(|d| d.severity == Severity::Error);
    let Some(first) = errors.next() else { return "the netlist has errors".to_owned() };
    let more = match errors.count() {
        0 => String::new(),
        n => format!(" (and {n} more)"),
    };
    format!("{}:{}:{}: {} {}{more}", first.file, first.line, first.column, first.code, first.message)
}

fn values(answer: &AnalysisResult, analysis: &SweepAnalysis) -> Result<Vec<PointValue>, String> {
    match answer {
        AnalysisResult::Static(result) => {
            let SweepAnalysis::Static { outputs, .. } = analysis else { return Ok(Vec::new()) };
            static_values(result, outputs)
        }
        AnalysisResult::Modes(result) => {
            let named = |(i, f): (usize, &f64)| value(format!("f{}", i + 1), "Hz", Some(*f));
            finite(result.frequencies_hz.iter().enumerate().map(named).collect())
        }
        AnalysisResult::PullIn(result) => finite(vec![
            value("pull_in".into(), "V", Some(result.pull_in_v)),
            value("release".into(), "V", result.release_v),
        ]),
    }
}

fn static_values(result: &statics::StaticResult, outputs: &[String]) -> Result<Vec<PointValue>, String> {
    if outputs.is_empty() {
        let mut all = Vec::with_capacity(3 * result.nodes.len());
        for (node, motion) in &result.nodes {
            all.push(value(format!("{node}.x"), "m", Some(motion.x)));
            all.push(value(format!("{node}.y"), "m", Some(motion.y)));
            all.push(value(format!("{node}.rz"), "rad", Some(motion.rz)));
        }
        return finite(all);
    }
    let pick = |text: &String| {
        let found = Expression::of_static(result, text).map_err(|error| error.to_string())?;
        Ok::<_, String>(value(text.clone(), found.unit(), Some(found.value())))
    };
    finite(outputs.iter().map(pick).collect::<Result<_, _>>()?)
}

fn value(name: String, unit: &'static str, value: Option<f64>) -> PointValue {
    PointValue { name, unit: unit.into(), value }
}

/// A table holds numbers or a reason; an infinity or a NaN is neither.
fn finite(values: Vec<PointValue>) -> Result<Vec<PointValue>, String> {
    match values.iter().find(|v| v.value.is_some_and(|x| !x.is_finite())) {
        Some(v) => Err(format!("{} is not finite", v.name)),
        None => Ok(values),
    }
}
