//! `bimorph plot`: pictures of a raw file, ours or ngspice's.

use super::failure::Failure;
use super::output::{check_folder, write};
use super::{interrupt, statics, value};
use bimorph::analysis::statics::static_equilibrium;
use bimorph::compile::{CompileOptions, compile};
use bimorph::netlist::{Bundle, Setting};
use bimorph::results::format::Format;
use bimorph::results::plot::chart::{self, Chart, Panel, Series};
use bimorph::results::plot::{stack, svg::Picture};
use bimorph::results::raw;
use bimorph::results::table::{Column, Table};
use clap::Args;
use std::path::{Path, PathBuf};

/// Draw a raw file: stacked panels over a shared axis, and the mechanism below them.
///
/// Also converts: --out FILE.csv writes the numbers.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  bimorph plot bank.raw --out bank.png\n  \
    bimorph plot bank.raw --panel 'drive=v(heat)' --panel 'yoke [µm]=v(y)' --out bank.svg\n  \
    bimorph plot bank.raw --mechanism bank.net --port heat=2.2 --out bank.png")]
pub(crate) struct Plot {
    /// ngspice raw file, binary or ASCII
    file: PathBuf,

    /// A panel: TITLE=SIGNAL,SIGNAL. "TITLE [UNIT]" states the unit of signals that ngspice takes for volts. Repeatable
    /// [default: one panel for each unit]
    #[arg(long = "panel", value_name = "TITLE=SIGNALS")]
    panels: Vec<String>,

    /// Which plot of the file, from 1 [default: the longest]
    #[arg(long, value_name = "N")]
    plot: Option<usize>,

    /// Line above the panels [default: the title of the file]
    #[arg(long)]
    title: Option<String>,

    /// Draw the mechanism of this netlist too, at rest and in the equilibrium at --port
    #[arg(long, value_name = "NETLIST")]
    mechanism: Option<PathBuf>,

    /// Mechanism: hold a port at a voltage [V]. Repeatable
    #[arg(long = "port", short = 'p', value_name = "NAME=VOLTS", value_parser = value::volts, requires = "mechanism")]
    ports: Vec<(String, f64)>,

    /// Mechanism: set a netlist parameter. Repeatable
    #[arg(long = "set", short = 's', value_name = "NAME=VALUE", value_parser = value::setting, requires = "mechanism")]
    set: Vec<(String, Setting)>,

    /// Picture (.svg, .png, .html) or numbers (.csv, .raw)
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

impl Plot {
    pub(crate) fn run(&self) -> Result<(), Failure> {
        interrupt::listen();
        let format = Format::from_path(&self.out)?;
        check_folder(&self.out)?;
        let table = longest(&self.file, self.plot)?;
        let chart = chart_of(&table, self.title.as_deref(), &self.panels)?;
        let mechanism = self.mechanism.as_deref().map(|netlist| self.mechanism(netlist)).transpose()?;
        write(&self.out, format, || Ok(table), || Ok(stack(&[vec![chart], mechanism.into_iter().collect()].concat())))
    }

    fn mechanism(&self, netlist: &Path) -> Result<Picture, Failure> {
        let bundle = Bundle::read(netlist, &[]).map_err(|source| Failure::Read { path: netlist.to_owned(), source })?;
        let compiled = compile(&bundle, &CompileOptions { set: self.set.clone(), ..CompileOptions::default() })?;
        let result = static_equilibrium(&compiled, &self.ports)?;
        let volts: Vec<String> = self.ports.iter().map(|(name, v)| format!("{name} = {v} V")).collect();
        let name = netlist.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let title = if volts.is_empty() { name } else { format!("{name} at {}", volts.join(", ")) };
        Ok(statics::picture(&compiled, &title, &result))
    }
}

/// One plot of a raw file: that number, from 1, or the longest.
pub(crate) fn longest(path: &Path, number: Option<usize>) -> Result<Table, Failure> {
    let bytes = std::fs::read(path).map_err(|source| Failure::Read { path: path.to_owned(), source })?;
    let plots = raw::read(&bytes).map_err(|source| Failure::Raw { path: path.to_owned(), source })?;
    let count = plots.len();
    let chosen = match number {
        Some(number) => plots.into_iter().nth(number.wrapping_sub(1)),
        None => plots.into_iter().reduce(|best, next| if next.rows() > best.rows() { next } else { best }),
    };
    let got = || match number {
        Some(number) => format!("{number}; {} holds {count}", path.display()),
        None => format!("none: {} is empty", path.display()),
    };
    chosen.ok_or_else(|| Failure::bad("--plot", "the number of a plot in the file", got()))
}

/// The chart of a table; without panels one for each unit.
pub(crate) fn chart_of(table: &Table, title: Option<&str>, panels: &[String]) -> Result<Picture, Failure> {
    let columns = table.columns();
    let panels = if panels.is_empty() {
        by_unit(columns.get(1..).unwrap_or_default())
    } else {
        panels.iter().map(|text| panel(text, table)).collect::<Result<_, _>>()?
    };
    let first = columns.first();
    Ok(chart::draw(&Chart {
        title: title.unwrap_or(&table.title).to_owned(),
        x_name: first.map(|c| c.name.clone()).unwrap_or_default(),
        x_unit: first.map(|c| c.unit.clone()).unwrap_or_default(),
        x: first.map(|c| c.samples.magnitudes()).unwrap_or_default(),
        panels,
    }))
}

/// One panel for each unit, in order of appearance.
fn by_unit(columns: &[Column]) -> Vec<Panel> {
    let mut panels: Vec<Panel> = Vec::new();
    for column in columns {
        let series = Series { name: column.name.clone(), values: column.samples.magnitudes() };
        match panels.iter_mut().find(|p| p.unit == column.unit) {
            Some(panel) => panel.series.push(series),
            None => {
                let title = chart::word(&column.unit).to_owned();
                panels.push(Panel { title, unit: column.unit.clone(), series: vec![series] });
            }
        }
    }
    panels
}

/// `TITLE=SIGNALS` or `TITLE [UNIT]=SIGNALS`.
fn panel(text: &str, table: &Table) -> Result<Panel, Failure> {
    let (title, list) =
        text.split_once('=').ok_or_else(|| Failure::bad("--panel", "TITLE=SIGNAL,SIGNAL", format!("\"{text}\"")))?;
    let mut series = Vec::new();
    let mut unit = String::new();
    for name in value::names(&[list.to_owned()]) {
        let column = table.column(&name).ok_or_else(|| {
            let known: Vec<&str> = table.columns().iter().map(|c| c.name.as_str()).collect();
            Failure::bad("--panel", format!("signals among {known:?}"), format!("\"{name}\""))
        })?;
        unit.clone_from(&column.unit);
        series.push(Series { name, values: column.samples.magnitudes() });
    }
    match title.trim().strip_suffix(']').and_then(|t| t.split_once('[')) {
        Some((title, unit)) => Ok(Panel { title: title.trim().to_owned(), unit: format!("[{unit}]"), series }),
        None => Ok(Panel { title: title.trim().to_owned(), unit, series }),
    }
}
