//! `bimorph tran`: motion in time.

use super::failure::Failure;
use super::model::{Context, ModelArgs, Named};
use super::output::OutputArgs;
use super::{progress, report, value};
use bimorph::analysis::transient::{Counters, TransientOptions, TransientResult, transient};
use bimorph::compile::{Compiled, compile};
use bimorph::netlist::Setting;
use bimorph::results::plot::axis::quantity;
use bimorph::results::plot::chart::{self, Chart, Panel, Series};
use bimorph::results::plot::svg::Picture;
use bimorph::results::table::Table;
use clap::Args;
use serde::Serialize;

/// Motion in time, from rest or from a released equilibrium.
///
/// Signals: NODE.x, NODE.y [m], NODE.rz [rad], NODE.vx, NODE.vy [m/s], NODE.vrz [rad/s], BEAM.T [K], GAP.q [C].
/// JSON: "t" [s]; "signals": samples by name in SI; "units" by name; "counters": the work done.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    bimorph tran bank.net --stop 300u --port heat=2.2 --signals yoke.y,b1.hot.T --out heat.svg\n  \
    bimorph tran stage.net --set F=100u --release F --stop 30u --undamped --signals c.x --json\n      \
    starts from the equilibrium under F = 100 µN and lets go at t = 0")]
pub(crate) struct Tran {
    #[command(flatten)]
    model: ModelArgs,

    /// End time [s], such as 30u
    #[arg(long, value_name = "SECONDS", value_parser = value::number, allow_negative_numbers = true)]
    stop: f64,

    /// Number of equally spaced output times, both ends included
    #[arg(long, default_value_t = 1001)]
    points: usize,

    /// Signals wanted: a,b or repeated [default: x and y of every free node]
    #[arg(long, value_name = "NAMES")]
    signals: Vec<String>,

    /// Start from the equilibrium at this parameter's value; the parameter is 0 from t = 0
    #[arg(long, value_name = "NAME")]
    release: Option<String>,

    /// Hold a port at a voltage [V] from t = 0; others are at 0 V. Repeatable
    #[arg(long = "port", short = 'p', value_name = "NAME=VOLTS", value_parser = value::volts)]
    ports: Vec<(String, f64)>,

    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Debug, Serialize)]
struct Document<'a> {
    t: &'a [f64],
    signals: Named<'a, Vec<f64>>,
    units: Named<'a, String>,
    counters: Counters,
    unknowns: usize,
    release: Option<&'a str>,
    port_voltages_v: Named<'a, f64>,
    #[serde(flatten)]
    context: Context<'a>,
}

impl Tran {
    pub(crate) fn run(&self) -> Result<(), Failure> {
        self.output.check()?;
        if self.stop <= 0.0 {
            return Err(Failure::bad("--stop", "a time above 0 s", self.stop.to_string()));
        }
        if !(2..=10_000_000).contains(&self.points) {
            return Err(Failure::bad("--points", "2 to 10000000 output times", self.points.to_string()));
        }
        let initial = self.model.compile()?;
        let released = self.release.as_deref().map(|name| self.without(&initial, name)).transpose()?;
        let compiled = released.as_ref().unwrap_or(&initial);
        let options = TransientOptions {
            stop: self.stop,
            signals: if self.signals.is_empty() { free_nodes(compiled) } else { value::names(&self.signals) },
            points: self.points,
            tol: compiled.options.tol,
            voltages: self.ports.clone(),
            release: released.as_ref().map(|_| &initial),
        };
        let bar = progress::bar("transient");
        let result = transient(compiled, &options, &mut |_, _| (), &mut progress::watch(&bar));
        bar.finish_and_clear();
        let result = result?;

        let (mut signals, mut units) = (Vec::new(), Vec::new());
        for (name, unit, values) in &result.signals {
            signals.push((name.clone(), values.clone()));
            units.push((name.clone(), unit.clone()));
        }
        let document = Document {
            t: &result.t,
            signals: Named(&signals),
            units: Named(&units),
            counters: result.counters,
            unknowns: result.unknowns,
            release: self.release.as_deref(),
            port_voltages_v: Named(&self.ports),
            context: self.model.context(&initial),
        };
        let title = self.model.title();
        self.output.finish(
            || table(&title, &result),
            || Ok(picture(&title, &result)),
            &document,
            &text(compiled, &result),
        )
    }

    /// The same netlist with one parameter at 0.
    fn without(&self, initial: &Compiled, name: &str) -> Result<Compiled, Failure> {
        match initial.parameters.iter().find(|(parameter, _)| parameter == name) {
            Some((_, Setting::Number(_))) => {}
            Some(_) => return Err(Failure::bad("--release", "a numeric parameter", format!("\"{name}\", a text"))),
            None => {
                let known: Vec<&str> = initial.parameters.iter().map(|(p, _)| p.as_str()).collect();
                let got = format!("\"{name}\"; the netlist has {known:?}");
                return Err(Failure::bad("--release", "a parameter of the netlist", got));
            }
        }
        let mut options = initial.options.clone();
        options.set.retain(|(parameter, _)| parameter != name);
        options.set.push((name.to_owned(), Setting::Number(0.0)));
        Ok(compile(&self.model.bundle()?, &options)?)
    }
}

/// x and y of every mechanical node that nothing holds.
fn free_nodes(compiled: &Compiled) -> Vec<String> {
    let structure = &compiled.structure;
    let held = |id: usize| structure.supports.iter().any(|s| s.node.0 == id && s.held == [true; 3]);
    let free = structure.nodes.iter().enumerate().filter(|(id, node)| node.mechanical && !held(*id));
    free.flat_map(|(_, node)| [format!("{}.x", node.name), format!("{}.y", node.name)]).collect()
}

fn table(title: &str, result: &TransientResult) -> Result<Table, Failure> {
    let mut table = Table::new(title, "Transient Analysis");
    table.push_real("time", "s", result.t.clone())?;
    for (name, unit, values) in &result.signals {
        table.push_real(name, unit, values.clone())?;
    }
    Ok(table)
}

/// One panel for each unit.
fn picture(title: &str, result: &TransientResult) -> Picture {
    let mut panels: Vec<Panel> = Vec::new();
    for (name, unit, values) in &result.signals {
        let series = Series { name: name.clone(), values: values.clone() };
        match panels.iter_mut().find(|p| p.unit == *unit) {
            Some(panel) => panel.series.push(series),
            None => {
                panels.push(Panel { title: chart::word(unit).to_owned(), unit: unit.clone(), series: vec![series] })
            }
        }
    }
    chart::draw(&Chart {
        title: title.to_owned(),
        x_name: "time".to_owned(),
        x_unit: "s".to_owned(),
        x: result.t.clone(),
        panels,
    })
}

fn text(compiled: &Compiled, result: &TransientResult) -> String {
    let rows: Vec<Vec<String>> = result
        .signals
        .iter()
        .map(|(name, unit, values)| {
            let low = values.iter().copied().fold(f64::INFINITY, f64::min);
            let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let last = values.last().copied().unwrap_or_default();
            [low, high, last].iter().fold(vec![name.clone()], |mut row, v| {
                row.push(quantity(*v, unit));
                row
            })
        })
        .collect();
    let c = result.counters;
    format!(
        "{}\n{} samples, {} steps ({} rejected), {} factorizations, {} solves; {}",
        report::columns(&["signal", "lowest", "highest", "at the end"], &rows),
        result.t.len(),
        c.steps,
        c.rejected,
        c.factorizations,
        c.solves,
        report::footing(compiled, result.unknowns)
    )
}
