//! `bimorph plot`: pictures of a raw file, ours or ngspice's.

use super::failure::Failure;
use super::output::{check_folder, write};
use super::{interrupt, statics, value};
use bimorph::analysis::mesh::static_fitted;
use bimorph::compile::{CompileOptions, compile};
use bimorph::input::{self, LayoutChoice};
use bimorph::netlist::Setting;
use bimorph::results::format::ResultFormat;
use bimorph::results::plot::bode::{self, BodeChart, BodeCurve, Magnitude};
use bimorph::results::plot::chart::{self, Panel, PanelChart, Series};
use bimorph::results::plot::plane::{self, PlaneChart, PlaneCurve, PlaneMark, Sign};
use bimorph::results::plot::{stack, svg::Picture};
use bimorph::results::raw;
use bimorph::results::table::{Column, ColumnSamples, Table};
use clap::Args;
use std::path::{Path, PathBuf};

/// Draw a raw file: stacked panels over a shared axis, and the mechanism below them.
///
/// Also converts: --out FILE.csv writes the numbers.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    bimorph tran examples/bank/bank.net --port heat=2.2 --stop 200u --signals yoke.x,yoke.y,b1.hot.T --out bank.raw\n  \
    bimorph plot bank.raw --out bank.png\n  \
    bimorph plot bank.raw --panel 'hot arm=b1.hot.T' --panel 'yoke=yoke.y' --out bank.svg\n  \
    bimorph plot bank.raw --mechanism examples/bank/bank.net --port heat=2.2 --out bank.png\n  \
    bimorph plot bank.raw --track yoke.x,yoke.y --out track.png          # one signal against another, to one scale")]
pub(crate) struct PlotCommand {
    /// ngspice raw file, binary or ASCII
    file: PathBuf,

    /// A panel: TITLE=SIGNAL,SIGNAL. "TITLE [UNIT]" states the unit of signals that ngspice takes for volts. Repeatable
    /// [default: one panel for each unit]
    #[arg(long = "panel", value_name = "TITLE=SIGNALS")]
    panels: Vec<String>,

    /// One signal against another, to one scale: X,Y or NAME=X,Y. Repeatable; all share one picture
    #[arg(long = "track", value_name = "NAME=X,Y")]
    tracks: Vec<String>,

    /// Another raw file over the same axis; its signals are called STEM:SIGNAL. Repeatable
    #[arg(long = "with", value_name = "FILE")]
    others: Vec<PathBuf>,

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

impl PlotCommand {
    pub(crate) fn run(&self) -> Result<(), Failure> {
        interrupt::listen();
        let format = ResultFormat::from_path(&self.out)?;
        check_folder(&self.out)?;
        let (mut table, _) = longest(&self.file, self.plot)?;
        for other in &self.others {
            join(&mut table, other)?;
        }
        let mut pictures = Vec::new();
        if self.tracks.is_empty() || !self.panels.is_empty() {
            pictures.push(chart_of(&table, self.title.as_deref(), &self.panels)?);
        }
        if !self.tracks.is_empty() {
            pictures.push(tracks(&table, self.title.as_deref(), &self.tracks)?);
        }
        let mechanism = self.mechanism.as_deref().map(|netlist| self.mechanism(netlist)).transpose()?;
        write(
            &self.out,
            format,
            || Ok(table),
            || {
                pictures.extend(mechanism);
                Ok(stack(&pictures))
            },
        )
    }

    fn mechanism(&self, netlist: &Path) -> Result<Picture, Failure> {
        let bundle = input::read(netlist, &[], &LayoutChoice::default(), &mut |_| (), &mut |_| true)?.bundle;
        let compiled = compile(&bundle, &CompileOptions { set: self.set.clone(), ..CompileOptions::default() })?;
        let (compiled, result, curves) = static_fitted(&compiled, &self.ports)?;
        let volts: Vec<String> = self.ports.iter().map(|(name, v)| format!("{name} = {v} V")).collect();
        let name = netlist.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        let title =
            if volts.is_empty() { name } else { format!("{name} in static equilibrium at {}", volts.join(", ")) };
        Ok(statics::picture(&compiled, &title, &result, &curves))
    }
}

/// One plot of a raw file: that number, from 1, or the longest; and how many the file has.
pub(crate) fn longest(path: &Path, number: Option<usize>) -> Result<(Table, usize), Failure> {
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
    let chosen = chosen.ok_or_else(|| Failure::bad("--plot", "the number of a plot in the file", got()))?;
    Ok((chosen, count))
}

/// The chart of a table; without panels one for each unit.
pub(crate) fn chart_of(table: &Table, title: Option<&str>, panels: &[String]) -> Result<Picture, Failure> {
    let columns = table.columns();
    if panels.is_empty() && columns.iter().skip(1).any(|c| matches!(c.samples, ColumnSamples::Complex(_))) {
        return Ok(frequency_response(table, title));
    }
    let panels = if panels.is_empty() {
        by_unit(columns.get(1..).unwrap_or_default())
    } else {
        panels.iter().map(|text| panel(text, table)).collect::<Result<_, _>>()?
    };
    let first = columns.first();
    Ok(chart::draw(&PanelChart {
        title: title.unwrap_or(&table.title).to_owned(),
        x_name: first.map(|c| c.name.clone()).unwrap_or_default(),
        x_unit: first.map(|c| c.unit.clone()).unwrap_or_default(),
        x: first.map(|c| c.samples.real_parts()).unwrap_or_default(),
        panels,
    }))
}

/// The picture of a small-signal analysis: decibels and degrees over the frequency.
fn frequency_response(table: &Table, title: Option<&str>) -> Picture {
    let columns = table.columns();
    let curve = |column: &Column| match &column.samples {
        ColumnSamples::Complex(values) => {
            Some(BodeCurve { name: column.name.clone(), unit: unit(column), values: values.clone() })
        }
        ColumnSamples::Real(_) => None,
    };
    let frequencies = columns.first().map(|c| c.samples.real_parts()).unwrap_or_default();
    // equal steps: a linear sweep
    let linear = match frequencies.as_slice() {
        [first, second, .., last] => (second - first) * (frequencies.len() - 1) as f64 <= 1.01 * (last - first),
        _ => true,
    };
    bode::draw(&BodeChart {
        title: title.unwrap_or(&table.title).to_owned(),
        linear,
        magnitude: Magnitude::Decibels,
        curves: columns.iter().skip(1).filter_map(curve).collect(),
        frequencies,
        resonances: Vec::new(),
    })
}

/// Adds the signals of another raw file, which must run over the same axis.
fn join(table: &mut Table, path: &Path) -> Result<(), Failure> {
    let (other, _) = longest(path, None)?;
    let axis = |t: &Table| t.columns().first().map(|c| c.samples.real_parts()).unwrap_or_default();
    let (own, its) = (axis(table), axis(&other));
    let end = own.last().map_or(0.0, |x| x.abs());
    let same = own.len() == its.len() && own.iter().zip(&its).all(|(a, b)| (a - b).abs() <= 1e-9 * end);
    if !same {
        let got = format!("{}: {} samples instead of {}, or other ones", path.display(), its.len(), own.len());
        return Err(Failure::bad("--with", "a raw file over the same axis", got));
    }
    let stem = path.file_stem().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    for column in other.columns().iter().skip(1) {
        table.push_real(&format!("{stem}:{}", column.name), &column.unit, column.samples.magnitudes())?;
    }
    Ok(())
}

/// Signals against each other.
fn tracks(table: &Table, title: Option<&str>, tracks: &[String]) -> Result<Picture, Failure> {
    let mut curves = Vec::new();
    let mut names: Option<[[String; 2]; 2]> = None;
    for track in tracks {
        let (name, list) = track.split_once('=').unwrap_or(("", track));
        let signals = value::names(&[list.to_owned()]);
        let [x, y] = signals.as_slice() else {
            return Err(Failure::bad("--track", "NAME=X,Y: two signals", format!("\"{track}\"")));
        };
        let find = |signal: &String| {
            table.column(signal).ok_or_else(|| {
                let known: Vec<&str> = table.columns().iter().map(|c| c.name.as_str()).collect();
                Failure::bad("--track", format!("signals among {known:?}"), format!("\"{signal}\""))
            })
        };
        let (x, y) = (find(x)?, find(y)?);
        let points = x.samples.magnitudes().into_iter().zip(y.samples.magnitudes()).map(|(x, y)| [x, y]).collect();
        names.get_or_insert_with(|| [x, y].map(|c| [c.name.clone(), unit(c)]));
        let name = if name.is_empty() { format!("{}, {}", x.name, y.name) } else { name.trim().to_owned() };
        curves.push(PlaneCurve { name, points, dashed: Vec::new() });
    }
    let [x, y] = names.unwrap_or_default();
    let start = curves.first().and_then(|c| c.points.first().copied()).unwrap_or_default();
    Ok(plane::draw(&PlaneChart {
        title: title.unwrap_or(&table.title).to_owned(),
        x,
        y,
        curves,
        marks: vec![PlaneMark { at: start, sign: Sign::Dot, word: "start".to_owned() }],
        equal: true,
        note: String::new(),
    }))
}

/// One panel for each unit, in order of appearance.
fn by_unit(columns: &[Column]) -> Vec<Panel> {
    let mut panels: Vec<Panel> = Vec::new();
    for column in columns {
        let series = Series { name: column.name.clone(), values: column.samples.magnitudes() };
        let unit = unit(column);
        match panels.iter_mut().find(|p| p.unit == unit) {
            Some(panel) => panel.series.push(series),
            None => {
                let title = chart::word(&unit).to_owned();
                panels.push(Panel { title, unit, series: vec![series] });
            }
        }
    }
    panels
}

/// The unit of a signal; where a raw file has none for it, that of the signal's name.
fn unit(column: &Column) -> String {
    if !column.unit.is_empty() {
        return column.unit.clone();
    }
    let quantity = column.name.rsplit_once('.').map_or("", |(_, quantity)| quantity);
    match quantity {
        "x" | "y" | "gap" => "m",
        "rz" => "rad",
        "vx" | "vy" => "m/s",
        "vrz" => "rad/s",
        "T" => "K",
        "q" => "C",
        _ => "",
    }
    .to_owned()
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
        unit = self::unit(column);
        series.push(Series { name, values: column.samples.magnitudes() });
    }
    match title.trim().strip_suffix(']').and_then(|t| t.split_once('[')) {
        Some((title, unit)) => Ok(Panel { title: title.trim().to_owned(), unit: format!("[{unit}]"), series }),
        None => Ok(Panel { title: title.trim().to_owned(), unit, series }),
    }
}
