//! `bimorph static`: where it rests.

use super::failure::Failure;
use super::model::{Context, JsonMap, ModelArgs, warn_of_mesh};
use super::output::OutputArgs;
use super::solver::ModelChoice;
use super::{progress, report, value};
use bimorph::analysis::frame::{frame, frame_statics};
use bimorph::analysis::mesh::static_backbent;
use bimorph::analysis::mesh::static_fitted;
use bimorph::analysis::readout::ReadoutError;
use bimorph::analysis::readout::expression::Expression;
use bimorph::analysis::static_outputs::StaticOutput;
use bimorph::analysis::statics::{AnchorForce, NodeMotion, StaticResult};
use bimorph::analysis::{AnalysisError, BeamMotions};
use bimorph::compile::CompiledModel;
use bimorph::results::plot::axis::quantity;
use bimorph::results::plot::mechanism::{self, DisplacementScale, MechanismFigure};
use bimorph::results::plot::shapes::NodeDisplacement;
use bimorph::results::plot::svg::Picture;
use bimorph::results::table::Table;
use bimorph::solve::equilibrium::StabilityLoss;
use clap::Args;
use serde::Serialize;
use std::fmt::Write;

/// Static equilibrium: displacement of every node, temperatures, port currents and charges.
///
/// The equilibrium is the one reached from rest by raising all loads and voltages together. JSON: "nodes" holds x [m],
/// y [m] and rz [rad] from the drawn place; "temperatures_k" (means), "peak_temperatures_k" (highest along each heated beam),
/// "currents_a", "charges_c" and "permanent_strains" by name. "stresses_pa": largest stress in each beam whose layer has a strength,
/// "nominal_stresses_pa": the same without the concentration at fillets. "anchor_forces": "fx", "fy" [N] and "m" [N·m] of driven anchors.
///
/// The estimated error is of the displacement of each node as a vector, of a thirtieth of the largest where a node
/// moves less. The relative error of a small component, or of a small rotation beside large displacements, may be
/// larger: use a smaller tolerance for it.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    bimorph static examples/bank/bank.net --port heat=2.2\n  \
    bimorph static examples/quarter_stage/quarter_stage.net --set F=100u --json\n  \
    bimorph static examples/bank/bank.net --port heat=2.2 --out bank.svg     # the mechanism, at rest and deflected\n  \
    bimorph static examples/bank/bank.net --backbend heat=2.6                # at rest, after one overload that yields the hot arms")]
pub(crate) struct StaticCommand {
    #[command(flatten)]
    model: ModelArgs,

    /// Hold a port at a voltage [V], or a driven anchor at NODE.ux, .uy [m] or .urz [rad]; others are at 0. Repeatable
    #[arg(long = "port", short = 'p', value_name = "NAME=VOLTS", value_parser = value::volts)]
    ports: Vec<(String, f64)>,

    /// Show these only, in the text and in CSV and raw files (JSON documents are whole): NODE.x, NODE.y, NODE.rz, BEAM.T, BEAM.Tmax, BEAM.stress, BEAM.nominal, ANCHOR.fx|fy|m, PORT.i, PORT.q, or sums such as a.x-0.5*b.x; a,b or repeated
    #[arg(long, value_name = "NAMES")]
    signals: Vec<String>,

    /// First raise a port to a voltage [V] once, so far that hot arms yield and stay shorter. Repeatable
    #[arg(long, value_name = "NAME=VOLTS", value_parser = value::volts)]
    backbend: Vec<(String, f64)>,

    /// Solver: the product's own model, or the baseline to compare with
    #[arg(long, value_enum, default_value_t, help_heading = "Research and comparison", hide_short_help = true)]
    solver: ModelChoice,

    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Debug, Serialize)]
struct StaticDocument<'a> {
    nodes: JsonMap<'a, NodeMotion>,
    temperatures_k: JsonMap<'a, f64>,
    #[serde(skip_serializing_if = "JsonMap::is_empty")]
    stresses_pa: JsonMap<'a, f64>,
    #[serde(skip_serializing_if = "JsonMap::is_empty")]
    nominal_stresses_pa: JsonMap<'a, f64>,
    #[serde(skip_serializing_if = "JsonMap::is_empty")]
    anchor_forces: JsonMap<'a, AnchorForce>,
    #[serde(skip_serializing_if = "JsonMap::is_empty")]
    peak_temperatures_k: JsonMap<'a, f64>,
    currents_a: JsonMap<'a, f64>,
    charges_c: JsonMap<'a, f64>,
    permanent_strains: JsonMap<'a, f64>,
    pulled_in: bool,
    jumped: bool,
    passed: &'a [StabilityLoss],
    free_motions: &'a [String],
    unknowns: usize,
    solver: ModelChoice,
    iterations: usize,
    port_voltages_v: JsonMap<'a, f64>,
    #[serde(flatten)]
    context: Context<'a>,
}

impl StaticCommand {
    pub(crate) fn run(&self) -> Result<(), Failure> {
        self.output.check()?;
        let drawn = match self.solver {
            ModelChoice::Recursion => self.model.compile()?,
            ModelChoice::Frame => self.model.compile_frame()?,
        };
        if !self.backbend.is_empty() && self.solver == ModelChoice::Frame {
            return Err(Failure::bad("--backbend", "--solver recursion", "--solver frame, which does not yield"));
        }
        let busy = progress::spinner("static equilibrium");
        let unbent = |(fitted, result, curves)| (fitted, result, curves, Vec::new());
        let result = match self.solver {
            ModelChoice::Recursion if self.backbend.is_empty() => static_fitted(&drawn, &self.ports).map(unbent),
            ModelChoice::Recursion => static_backbent(&drawn, &self.backbend, &self.ports),
            ModelChoice::Frame => frame(&drawn)
                .and_then(|frame| frame_statics(&drawn, &frame, &self.ports))
                .map(|(result, curves)| unbent((drawn.clone(), result, curves))),
        };
        busy.finish_and_clear();
        let (compiled, result, curves, permanent_strains) = result?;
        warn_of_mesh(&drawn, &compiled);
        let document = StaticDocument {
            nodes: JsonMap(&result.nodes),
            temperatures_k: JsonMap(&result.temperatures_k),
            stresses_pa: JsonMap(&result.stresses_pa),
            nominal_stresses_pa: JsonMap(&result.nominal_stresses_pa),
            anchor_forces: JsonMap(&result.anchor_forces),
            peak_temperatures_k: JsonMap(&result.peak_temperatures_k),
            currents_a: JsonMap(&result.currents_a),
            charges_c: JsonMap(&result.charges_c),
            permanent_strains: JsonMap(&permanent_strains),
            pulled_in: result.pulled_in,
            jumped: result.jumped,
            passed: &result.passed,
            free_motions: &result.free_motions,
            unknowns: result.unknowns,
            solver: self.solver,
            iterations: result.iterations,
            port_voltages_v: JsonMap(&self.ports),
            context: self.model.context(&compiled),
        };
        let title = self.model.title();
        let shown = match self.signals.as_slice() {
            [] => text(&compiled, &result, &permanent_strains),
            names => {
                chosen(&result, &value::names(names))?
                    + &history(&result)
                    + "\n"
                    + &report::footing(&compiled, result.unknowns)
            }
        };
        self.output.finish(
            || table(&title, &result, &value::names(&self.signals)),
            || Ok(picture(&compiled, &title, &result, &curves)),
            &document,
            &shown,
        )
    }
}

/// One row: every quantity of the operating point in a column of its own, or the requested ones.
fn table(title: &str, result: &StaticResult, names: &[String]) -> Result<Table, Failure> {
    let mut table = Table::new(title, "Operating Point");
    for name in names {
        let found = sum(result, name)?;
        table.push_real(name, found.unit(), vec![found.value()])?;
    }
    if !names.is_empty() {
        return Ok(table);
    }
    for (name, motion) in &result.nodes {
        for (suffix, unit, value) in [("x", "m", motion.x), ("y", "m", motion.y), ("rz", "rad", motion.rz)] {
            table.push_real(&format!("{name}.{suffix}"), unit, vec![value])?;
        }
    }
    let lists = [
        (&result.temperatures_k, "T", "K"),
        (&result.peak_temperatures_k, "Tmax", "K"),
        (&result.stresses_pa, "stress", "Pa"),
        (&result.nominal_stresses_pa, "nominal", "Pa"),
        (&result.currents_a, "i", "A"),
        (&result.charges_c, "q", "C"),
    ];
    for (list, suffix, unit) in lists {
        for (name, value) in list {
            table.push_real(&format!("{name}.{suffix}"), unit, vec![*value])?;
        }
    }
    for (name, force) in &result.anchor_forces {
        for (suffix, unit, value) in [("fx", "N", force.fx), ("fy", "N", force.fy), ("m", "N·m", force.m)] {
            table.push_real(&format!("{name}.{suffix}"), unit, vec![value])?;
        }
    }
    Ok(table)
}

/// The mechanism at rest and in this equilibrium.
pub(crate) fn picture(compiled: &CompiledModel, title: &str, result: &StaticResult, curves: &BeamMotions) -> Picture {
    mechanism::draw(&MechanismFigure {
        structure: &compiled.structure,
        title,
        motion: &motion(compiled, &result.nodes),
        curves: &beams(curves),
        temperatures: &result.temperatures_k,
        scale: DisplacementScale::Visible,
    })
}

/// Displacements by node index, from displacements by name.
pub(crate) fn motion(compiled: &CompiledModel, nodes: &[(String, NodeMotion)]) -> Vec<NodeDisplacement> {
    let mut motion = vec![[0.0; 3]; compiled.structure.nodes.len()];
    for (name, moved) in nodes {
        if let Some(id) = compiled.structure.node(name) {
            motion[id.0] = [moved.x, moved.y, moved.rz];
        }
    }
    motion
}

/// Displacements along beams as pictures take them.
pub(crate) fn beams(curves: &BeamMotions) -> Vec<Vec<NodeDisplacement>> {
    curves.iter().map(|curve| curve.iter().map(|m| [m.x, m.y, m.rz]).collect()).collect()
}

/// The requested signals, one a line.
fn chosen(result: &StaticResult, names: &[String]) -> Result<String, Failure> {
    let row = |signal: &String| {
        let found = sum(result, signal)?;
        Ok(vec![signal.clone(), quantity(found.value(), found.unit())])
    };
    let rows = names.iter().map(row).collect::<Result<Vec<_>, Failure>>()?;
    Ok(report::columns(&["signal", "value"], &rows) + "\n")
}

/// A number of the result, or a sum of such numbers.
fn sum(result: &StaticResult, text: &str) -> Result<Expression<StaticOutput>, Failure> {
    Expression::of_static(result, text).map_err(|error| match error {
        sum @ ReadoutError::BadExpression { .. } => AnalysisError::from(sum).into(),
        ReadoutError::UnknownSignal { name, hint } => {
            Failure::bad("--signals", hint.trim_start_matches("expected "), name)
        }
        other => AnalysisError::from(other).into(),
    })
}

/// How the equilibrium came about.
fn history(result: &StaticResult) -> String {
    result.notes().iter().map(|sentence| format!("\n{sentence}\n")).collect()
}

/// A displacement below this fraction of the largest one is rounding.
const NOISE: f64 = 1e-12;

fn text(compiled: &CompiledModel, result: &StaticResult, strains: &[(String, f64)]) -> String {
    let largest = |of: fn(&NodeMotion) -> f64| result.nodes.iter().map(|(_, m)| of(m)).fold(0.0, f64::max);
    let (far, turned) = (largest(|m| m.x.abs().max(m.y.abs())), largest(|m| m.rz.abs()));
    let cell = |v: f64, most: f64, unit: &str| quantity(if v.abs() < NOISE * most { 0.0 } else { v }, unit);
    let row = |(name, m): &(String, NodeMotion)| {
        vec![name.clone(), cell(m.x, far, "m"), cell(m.y, far, "m"), cell(m.rz, turned, "rad")]
    };
    let rows: Vec<Vec<String>> = result.nodes.iter().map(row).collect();
    let mut text = report::columns(&["node", "x", "y", "rz"], &rows);
    if !result.temperatures_k.is_empty() {
        let peak = |name: &String| result.peak_temperatures_k.iter().find(|(beam, _)| beam == name);
        let rows: Vec<Vec<String>> = (result.temperatures_k.iter())
            .map(|(n, mean)| {
                [n.clone(), quantity(*mean, "K"), quantity(peak(n).map_or(*mean, |(_, t)| *t), "K")].into()
            })
            .collect();
        let _ = write!(text, "\n{}", report::columns(&["beam", "temperature", "highest"], &rows));
    }
    for (list, unit, head) in [
        (&result.stresses_pa, "Pa", ["beam", "stress"]),
        (&result.nominal_stresses_pa, "Pa", ["beam", "nominal stress"]),
        (&result.currents_a, "A", ["port", "current"]),
        (&result.charges_c, "C", ["port", "charge"]),
    ] {
        if !list.is_empty() {
            let rows: Vec<Vec<String>> = list.iter().map(|(n, v)| vec![n.clone(), quantity(*v, unit)]).collect();
            let _ = write!(text, "\n{}", report::columns(&head, &rows));
        }
    }
    if !result.anchor_forces.is_empty() {
        let row = |(node, force): &(String, AnchorForce)| {
            vec![node.clone(), quantity(force.fx, "N"), quantity(force.fy, "N"), quantity(force.m, "N·m")]
        };
        let rows: Vec<Vec<String>> = result.anchor_forces.iter().map(row).collect();
        let _ = write!(text, "\n{}", report::columns(&["anchor", "fx", "fy", "m"], &rows));
    }
    if !strains.is_empty() {
        let rows: Vec<Vec<String>> = strains.iter().map(|(n, e)| vec![n.clone(), format!("{e:.3e}")]).collect();
        let _ = write!(text, "\n{}", report::columns(&["beam", "permanent strain"], &rows));
    }
    text.push_str(&history(result));
    let _ = write!(text, "\n{} Newton iterations, {}", result.iterations, report::footing(compiled, result.unknowns));
    text
}
