//! `bimorph path`: equilibria along a growing parameter.

use super::failure::Failure;
use super::model::{Context, JsonMap, ModelArgs, warn_of, warn_of_mesh};
use super::output::OutputArgs;
use super::{progress, report, statics, value};
use bimorph::analysis::continuation::{ContinuationResult, CriticalPoint};
use bimorph::analysis::critical_names::{BIFURCATION, critical_points};
use bimorph::analysis::largest_motion::path_with_signals;
use bimorph::analysis::path_parameter::{PathModels, PathOptions, PathParameter, UnknownPathParameter};
use bimorph::analysis::statics::NodeMotion;
use bimorph::compile::CompiledModel;
use bimorph::netlist::NetlistSource;
use bimorph::options::OptionValue;
use bimorph::options::analysis::PATH_POINTS;
use bimorph::results::plot::axis::quantity;
use bimorph::results::plot::mechanism::{self, DisplacementScale, MechanismFigure};
use bimorph::results::plot::plane::{self, PlaneChart, PlaneCurve, PlaneMark, Sign};
use bimorph::results::plot::{chart, stack, svg::Picture};
use bimorph::results::table::Table;
use bimorph::solve::continuation::Branch;
use clap::{Args, ValueEnum};
use serde::Serialize;
use std::fmt::Write;

/// The path of equilibria while a load, voltage, temperature or stress grows: past folds, into buckling.
///
/// The path is followed by arc length, so that it continues where the load must fall: snap-through, and behind pull-in.
/// Where it loses its stability at a bifurcation it continues along the branch that leaves there. JSON: "values" of
/// what grows and "signals" along the path; "negative": eigenvalues below 0 (0: stable under fixed loads and voltages);
/// "folds" and "bifurcations": value and index of the point; "last": displacement of every node at the end.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    bimorph path examples/column/column.net --along F=0:260u --signals middle.y --out column.png\n  \
    bimorph path examples/arch/arch.net --along F=0:10u --signals 'p(20).y' --json\n  \
    bimorph path examples/switch/switch.net --along drive=0:20 --signals 'a(8).y'     # past pull-in, along the unstable branch\n  \
    bimorph path examples/quarter_stage/quarter_stage.net --set F=100u --along loads=0:2 --signals c.x     # a factor on all loads")]
pub(crate) struct PathCommand {
    #[command(flatten)]
    model: ModelArgs,

    /// Path parameter: a port [V], NODE.ux, .uy [m] or .urz [rad] of a driven anchor, a netlist parameter that sets loads, temperatures or stresses, or `loads`, a factor
    /// on all
    #[arg(long, value_name = "NAME=FROM:TO", value_parser = way)]
    along: PathRange,

    /// Signals wanted, or sums such as top.C-0.5*bot.C: a,b or repeated [default: x and y of the node that moves most]
    #[arg(long, value_name = "NAMES")]
    signals: Vec<String>,

    /// Where to go when the path bifurcates and loses its stability
    #[arg(long, value_enum, default_value_t = BranchArg::Plus)]
    branch: BranchArg,

    /// Most points
    #[arg(long, default_value_t = PATH_POINTS.count())]
    points: usize,

    /// Hold another port at a voltage [V]; others are at 0 V. Repeatable
    #[arg(long = "port", short = 'p', value_name = "NAME=VOLTS", value_parser = value::volts)]
    ports: Vec<(String, f64)>,

    #[command(flatten)]
    output: OutputArgs,
}

/// `NAME=FROM:TO`.
#[derive(Debug, Clone, PartialEq)]
struct PathRange {
    name: String,
    from: f64,
    to: f64,
}

fn way(text: &str) -> Result<PathRange, String> {
    let wrong = || format!("expected NAME=FROM:TO such as F=0:260u, got \"{text}\"");
    let (name, range) = text.split_once('=').ok_or_else(wrong)?;
    let (from, to) = range.split_once(':').ok_or_else(wrong)?;
    let way = PathRange { name: name.trim().to_owned(), from: value::number(from)?, to: value::number(to)? };
    match way {
        PathRange { name, .. } if name.is_empty() => Err(wrong()),
        PathRange { name, from, to } if from == to => {
            Err(format!("{name} goes nowhere from {from} to {to}: FROM and TO have to differ"))
        }
        way => Ok(way),
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum BranchArg {
    /// along the buckling shape, its largest displacement positive
    Plus,
    /// against it
    Minus,
    /// straight on, unstable
    Stay,
}

#[derive(Debug, Serialize)]
struct PathDocument<'a> {
    along: &'a str,
    values: &'a [f64],
    signals: JsonMap<'a, Vec<f64>>,
    units: JsonMap<'a, String>,
    negative: &'a [usize],
    folds: &'a [CriticalPoint],
    bifurcations: &'a [CriticalPoint],
    end: &'a str,
    last: JsonMap<'a, NodeMotion>,
    unknowns: usize,
    iterations: usize,
    port_voltages_v: JsonMap<'a, f64>,
    #[serde(flatten)]
    context: Context<'a>,
}

/// Ways to reduce the cost of a path.
const CHEAPER: &str = "a shorter --along, a larger --tol or fewer --points cost less";

impl PathCommand {
    pub(crate) fn run(&self) -> Result<(), Failure> {
        self.output.check()?;
        PATH_POINTS.check(&OptionValue::Count(self.points))?;
        let drawn = self.model.compile()?;
        let options = PathOptions {
            along: self.along.name.clone(),
            from: self.along.from,
            to: self.along.to,
            voltages: self.ports.clone(),
            signals: value::names(&self.signals),
            branch: match self.branch {
                BranchArg::Plus => Branch::Plus,
                BranchArg::Minus => Branch::Minus,
                BranchArg::Stay => Branch::Stay,
            },
            points: self.points,
        };
        let parameter = PathParameter::find(&drawn, &options.along)
            .map_err(|unknown| Failure::bad("--along", UnknownPathParameter::EXPECTED, unknown.got()))?;
        let models = PathModels::new(parameter, &drawn, &options, || {
            Ok::<_, Failure>(NetlistSource::new(&self.model.bundle()?))
        })?;
        let (first, input) = models.input(&drawn, &options.along);
        let bar = progress::bar("path");
        let result = path_with_signals(first, &options.request(input), &mut progress::watch(&bar, CHEAPER));
        bar.finish_and_clear();
        let (fitted, result) = result?;
        warn_of_mesh(first, &fitted);
        warn_of(&result.warnings);

        let split = |k: fn(&(String, String, Vec<f64>)) -> String| -> Vec<(String, String)> {
            result.signals.iter().map(|s| (s.0.clone(), k(s))).collect()
        };
        let units = split(|s| s.1.clone());
        let signals: Vec<(String, Vec<f64>)> = result.signals.iter().map(|s| (s.0.clone(), s.2.clone())).collect();
        let document = PathDocument {
            along: &self.along.name,
            values: &result.values,
            signals: JsonMap(&signals),
            units: JsonMap(&units),
            negative: &result.negative,
            folds: &result.folds,
            bifurcations: &result.bifurcations,
            end: result.end,
            last: JsonMap(&result.last),
            unknowns: result.unknowns,
            iterations: result.iterations,
            port_voltages_v: JsonMap(&self.ports),
            context: self.model.context(&fitted).with(&result.warnings),
        };
        let unit = models.unit();
        self.output.finish(
            || self.table(&result, unit),
            || Ok(self.picture(&fitted, &result, unit)),
            &document,
            &self.text(&fitted, &result, unit),
        )
    }

    fn table(&self, result: &ContinuationResult, unit: &str) -> Result<Table, Failure> {
        let mut table = Table::new(self.model.title(), "Equilibrium Path");
        table.push_real(&self.along.name, unit, result.values.clone())?;
        for (name, unit, values) in &result.signals {
            table.push_real(name, unit, values.clone())?;
        }
        table.push_real("negative", "", result.negative.iter().map(|&n| n as f64).collect())?;
        Ok(table)
    }

    /// Limit points and bifurcations with their names.
    fn critical<'r>(
        &self,
        compiled: &CompiledModel,
        result: &'r ContinuationResult,
    ) -> Vec<(&'r CriticalPoint, &'static str)> {
        critical_points(compiled, &self.along.name, (self.along.to - self.along.from).signum(), result)
    }

    fn picture(&self, compiled: &CompiledModel, result: &ContinuationResult, unit: &str) -> Picture {
        let mut units: Vec<&str> = Vec::new();
        for (_, unit, _) in &result.signals {
            if !units.contains(&unit.as_str()) {
                units.push(unit);
            }
        }
        let title = self.model.title();
        let critical = self.critical(compiled, result);
        let mut pictures: Vec<Picture> = units
            .iter()
            .map(|y_unit| {
                let of_unit: Vec<_> = result.signals.iter().filter(|s| s.1 == **y_unit).collect();
                let curves = of_unit.iter().map(|(name, _, values)| PlaneCurve {
                    name: name.clone(),
                    points: result.values.iter().zip(values).map(|(x, y)| [*x, *y]).collect(),
                    dashed: result.negative.iter().map(|n| *n > 0).collect(),
                });
                let of_unit = &of_unit;
                let marks = critical.iter().flat_map(|(point, word)| {
                    of_unit.iter().enumerate().map(move |(k, s)| PlaneMark {
                        at: [point.value, s.2[point.point]],
                        sign: if *word == BIFURCATION { Sign::Square } else { Sign::Dot },
                        word: if k == 0 { plane::word(word, point.value, unit) } else { String::new() },
                    })
                });
                let y_name = match of_unit.as_slice() {
                    [one] => one.0.clone(),
                    _ => chart::word(y_unit).to_owned(),
                };
                plane::draw(&PlaneChart {
                    title: title.clone(),
                    x: [self.along.name.clone(), unit.to_owned()],
                    y: [y_name, (*y_unit).to_owned()],
                    curves: curves.collect(),
                    marks: marks.collect(),
                    equal: false,
                    note: "solid: stable; dashed: unstable under fixed loads and voltages".to_owned(),
                })
            })
            .collect();
        let end = result.values.last().copied().unwrap_or_default();
        pictures.push(mechanism::draw(&MechanismFigure {
            structure: &compiled.structure,
            title: &format!("at the end of the path, {} = {}", self.along.name, quantity(end, unit)),
            motion: &statics::motion(compiled, &result.last),
            curves: &statics::beams(&result.last_curves),
            temperatures: &[],
            scale: DisplacementScale::Visible,
        }));
        stack(&pictures)
    }

    fn text(&self, compiled: &CompiledModel, result: &ContinuationResult, unit: &str) -> String {
        let mut rows: Vec<(usize, Vec<String>)> = Vec::new();
        let mut row = |what: &str, point: usize| {
            let mut cells = vec![what.to_owned(), quantity(result.values[point], unit)];
            cells.extend(result.signals.iter().map(|(_, unit, values)| quantity(values[point], unit)));
            cells.push(match (what, result.negative[point]) {
                ("start" | "end" | BIFURCATION, 0) => "stable".into(),
                ("start" | "end" | BIFURCATION, _) => "unstable".into(),
                // a limit point is the limit of both
                _ => String::new(),
            });
            rows.push((point, cells));
        };
        row("start", 0);
        for (critical, word) in self.critical(compiled, result) {
            row(word, critical.point);
        }
        row("end", result.values.len() - 1);
        rows.sort_by_key(|(point, _)| *point);
        let rows: Vec<Vec<String>> = rows.into_iter().map(|(_, cells)| cells).collect();
        let mut header = vec!["point", self.along.name.as_str()];
        header.extend(result.signals.iter().map(|(name, _, _)| name.as_str()));
        header.push("");
        let mut text = report::columns(&header, &rows);
        let _ = write!(
            text,
            "\n{} points, {} iterations, path {}; {}",
            result.values.len(),
            result.iterations,
            result.end,
            report::footing(compiled, result.unknowns)
        );
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ranges take suffixes; a range without a way is refused.
    #[test]
    fn ways() {
        assert_eq!(way("F=0:260u"), Ok(PathRange { name: "F".into(), from: 0.0, to: 2.6e-4 }));
        assert!(way("F=1").is_err() && way("F=1:1").is_err() && way("=0:1").is_err());
    }
}
