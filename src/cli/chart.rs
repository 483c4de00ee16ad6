//! `bimorph chart`: error against work, and work against size.

mod page;
mod picture;
mod table;

use super::failure::Failure;
use super::model::{Context, JsonMap, ModelArgs};
use super::output::{check_folder, print, write_picture};
use super::{interrupt, progress, value};
use bimorph::analysis::chart::{Chart as Measured, ChartPart, ChartSpec, Formulation, chart};
use bimorph::analysis::integrator::Integrator;
use bimorph::netlist::NetlistSource;
use bimorph::options::OptionValue;
use bimorph::options::analysis::CHART_POINTS;
use bimorph::results::atomic;
use bimorph::results::format::ResultFormat;
use bimorph::solve::baseline::SolverKind;
use clap::Args;
use picture::CostMeasure;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// Error against work for methods, tolerances, formulations and model orders; time of a step against size for solvers.
///
/// Works on any netlist. Three parts run by default. "precision" integrates one model by every method and tolerance and
/// compares with a far tighter run. "order" compares models of growing order with the finest one. "solvers" measures
/// one step of Rodas4 with each solver on them. "defaults", on request, runs the analyses of default commands at each
/// tolerance. Errors are root mean squares over the signals relative to their amplitude. Errors and counters are the
/// same on every run; times are wall-clock times of this machine.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    bimorph chart examples/bank/bank.net --signals yoke.y --port heat=2.2 --stop 20u --parts precision --tols 1e-2,1e-3 --out bank.png --out bank.csv\n  \
    bimorph chart examples/bank/bank.net --signals yoke.y --parts solvers --bands 1M,10M --repeat 3 --json\n  \
    bimorph chart examples/bank/bank.net --signals yoke.y --parts solvers --bands 1M,10M --work counts --out bank.svg     # the same picture on every machine")]
pub(crate) struct ChartCommand {
    #[command(flatten)]
    model: ModelArgs,

    /// Signals whose error counts: a,b or repeated
    #[arg(long, value_name = "NAMES", required = true)]
    signals: Vec<String>,

    /// End time [s] [default: five periods of the lowest mode]
    #[arg(long, value_name = "SECONDS", value_parser = value::number, allow_negative_numbers = true)]
    stop: Option<f64>,

    /// Output times at which errors are taken
    #[arg(long, default_value_t = CHART_POINTS.count())]
    points: usize,

    /// Start from the equilibrium at this parameter's value; the parameter is 0 from t = 0
    #[arg(long, value_name = "NAME")]
    release: Option<String>,

    /// Hold a port at a voltage [V] from t = 0; others are at 0 V. Repeatable
    #[arg(long = "port", short = 'p', value_name = "NAME=VOLTS", value_parser = value::volts)]
    ports: Vec<(String, f64)>,

    /// Parts wanted: precision, order, solvers, defaults (requested against obtained accuracy) [default:
    /// precision,order,solvers]
    #[arg(long, value_name = "NAMES")]
    parts: Vec<String>,

    /// Formulations: compliant, frame (linear), rcr, rcr-elastic (with --methods that reduce constraints too)
    /// [default: compliant,frame,rcr]
    #[arg(long, value_name = "NAMES")]
    formulations: Vec<String>,

    /// Integration methods: a,b [default: rodas4,avf,midpoint,tr-bdf2,generalized-alpha,radau5]
    #[arg(long, value_name = "NAMES")]
    methods: Vec<String>,

    /// Tolerances of the precision part and of defaults
    #[arg(long, value_name = "LIST", default_value = "1e-1,1e-2,1e-3,1e-4")]
    tols: Vec<String>,

    /// Bands of the order and solver parts [Hz]: a,b [default: 2 to 2048 times the lowest frequency]
    #[arg(long, value_name = "LIST")]
    bands: Vec<String>,

    /// Solvers: a,b [default: recursion,dense-unpivoted,dense,sparse]
    #[arg(long, value_name = "NAMES")]
    solvers: Vec<String>,

    /// Runs of which a time is the median
    #[arg(long, default_value_t = 3)]
    repeat: usize,

    /// Measure of work in pictures: time, or counts, which are the same on every machine
    #[arg(long, value_enum, default_value_t)]
    work: CostMeasure,

    /// Print one JSON document: SI, full precision
    #[arg(long)]
    json: bool,

    /// Write the chart to a file; its extension says what: .csv, .svg, .png, .html. Repeatable: one run fills them all
    #[arg(long, value_name = "FILE")]
    out: Vec<PathBuf>,
}

#[derive(Debug, Serialize)]
struct ChartDocument<'a> {
    #[serde(flatten)]
    chart: &'a Measured,
    release: Option<&'a str>,
    repeat: usize,
    port_voltages_v: JsonMap<'a, f64>,
    #[serde(flatten)]
    context: Context<'a>,
}

/// Ways to reduce the cost of a chart.
const CHEAPER: &str = "fewer --tols or --methods, or a shorter --stop, cost less";

/// Methods that are charted when none are named: all but the explicit one, which needs millions of steps on stiff parts.
const METHODS: [&str; 6] = ["rodas4", "avf", "midpoint", "tr-bdf2", "generalized-alpha", "radau5"];

impl ChartCommand {
    pub(crate) fn run(&self) -> Result<(), Failure> {
        for path in &self.out {
            if ResultFormat::from_path(path)? == ResultFormat::Raw {
                return Err(Failure::bad(
                    "--out",
                    "a .csv, .svg, .png or .html file",
                    format!("\"{}\"", path.display()),
                ));
            }
            check_folder(path)?;
        }
        CHART_POINTS.check(&OptionValue::Count(self.points))?;
        let spec = self.spec()?;
        let compiled = self.model.compile()?;
        let (bundle, options) = (self.model.bundle()?, self.model.options()?);
        let bar = progress::bar("chart");
        let result = chart(&NetlistSource::new(&bundle), &options, &spec, &mut progress::watch(&bar, CHEAPER));
        bar.finish_and_clear();
        let result = result?;
        let first = result.points.iter().find_map(|p| p.failed.as_ref());
        if let (Some(reason), true) = (first, result.points.iter().all(|p| p.failed.is_some())) {
            return Err(Failure::AllRuns(reason.clone()));
        }
        let title = self.model.title();
        interrupt::no_longer_polled();
        for path in &self.out {
            self.write(path, &title, &result)?;
        }
        if self.json {
            let document = ChartDocument {
                chart: &result,
                release: self.release.as_deref(),
                repeat: self.repeat,
                port_voltages_v: JsonMap(&self.ports),
                context: self.model.context(&compiled),
            };
            let mut text = serde_json::to_string(&document).map_err(|e| Failure::Stdout(e.into()))?;
            text.push('\n');
            print(&text)
        } else {
            print(&table::text(&result))
        }
    }

    fn write(&self, path: &Path, title: &str, result: &Measured) -> Result<(), Failure> {
        let failed = |source| Failure::Write { path: path.to_owned(), source };
        match ResultFormat::from_path(path)? {
            ResultFormat::Csv => {
                let text = table::csv(result);
                atomic::write(path, |out| out.write_all(text.as_bytes())).map_err(failed)
            }
            ResultFormat::Html => {
                let text = page::html(title, result, &picture::draw(title, result, self.work));
                atomic::write(path, |out| out.write_all(text.as_bytes())).map_err(failed)
            }
            format => write_picture(path, format, &picture::draw(title, result, self.work)),
        }
    }

    fn spec(&self) -> Result<ChartSpec, Failure> {
        let all = |lists: &[String], all: &[&'static str]| -> Vec<String> {
            let named = value::names(lists);
            if named.is_empty() { all.iter().map(|n| (*n).to_owned()).collect() } else { named }
        };
        let part_names = ChartPart::ALL.map(ChartPart::name);
        let formulation_names = Formulation::ALL.map(Formulation::name);
        let solver_names = SolverKind::ALL.map(SolverKind::name);
        Ok(ChartSpec {
            parts: choose(
                "--parts",
                &all(&self.parts, &ChartPart::DEFAULT.map(ChartPart::name)),
                &part_names,
                &ChartPart::ALL,
            )?,
            signals: value::names(&self.signals),
            stop: self.stop,
            points: self.points,
            voltages: self.ports.clone(),
            release: self.release.clone(),
            formulations: choose(
                "--formulations",
                &all(&self.formulations, &Formulation::DEFAULT.map(Formulation::name)),
                &formulation_names,
                &Formulation::ALL,
            )?,
            methods: all(&self.methods, &METHODS)
                .iter()
                .map(|name| {
                    Integrator::named(name)
                        .ok_or_else(|| Failure::bad("--methods", Integrator::NAMES.join(", "), format!("\"{name}\"")))
                })
                .collect::<Result<_, _>>()?,
            tols: numbers("--tols", &self.tols)?,
            bands: numbers("--bands", &self.bands)?,
            solvers: choose("--solvers", &all(&self.solvers, &solver_names), &solver_names, &SolverKind::ALL)?,
            repeat: self.repeat,
        })
    }
}

/// The values of a list of names.
fn choose<T: Copy>(
    option: &'static str,
    wanted: &[String],
    names: &[&'static str],
    values: &[T],
) -> Result<Vec<T>, Failure> {
    let one = |name: &String| match names.iter().position(|n| n == name) {
        Some(k) => Ok(values[k]),
        None => Err(Failure::bad(option, names.join(", "), format!("\"{name}\""))),
    };
    wanted.iter().map(one).collect()
}

fn numbers(option: &'static str, lists: &[String]) -> Result<Vec<f64>, Failure> {
    let one = |text: &String| value::number(text).map_err(|_| Failure::bad(option, "numbers", format!("\"{text}\"")));
    value::names(lists).iter().map(one).collect()
}
