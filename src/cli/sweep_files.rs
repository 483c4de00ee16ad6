//! Output files of a sweep: its table as CSV or Parquet, and its picture. Statistics and yields go to standard error.

use super::failure::Failure;
use super::output::{check_folder, write_picture};
use super::sweep_output;
use bimorph::jobs::sweep::statistics::{self, ColumnStatistics, Fraction, SweepStatistics, YieldLimit};
use bimorph::jobs::sweep::{SweepAnalysis, SweepSpec, SweepTable};
use bimorph::netlist::Setting;
use bimorph::results::atomic;
use bimorph::results::format::ResultFormat;
use bimorph::results::parquet::{self, ParquetColumn, ParquetValues};
use bimorph::results::plot::plane::{PlaneChart, PlaneCurve};
use bimorph::results::plot::{Picture, histogram, plane, stack};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Results that a picture shows.
const MAX_PANELS: usize = 12;
/// Curves whose names stand in a legend.
const MAX_NAMED: usize = 6;

fn is_of(path: &Path, extension: &str) -> bool {
    path.extension().is_some_and(|found| found.eq_ignore_ascii_case(extension))
}

fn is_table(path: &Path) -> bool {
    is_of(path, "csv") || is_of(path, "parquet")
}

/// Rejects files that a sweep is not written to, before anything is computed.
pub(super) fn check(files: &[PathBuf]) -> Result<(), Failure> {
    for file in files {
        let is_picture =
            matches!(ResultFormat::from_path(file), Ok(ResultFormat::Svg | ResultFormat::Png | ResultFormat::Html));
        if !is_table(file) && !is_picture {
            let expected = "a .csv, .parquet, .svg, .png or .html file";
            return Err(Failure::bad("--out", expected, format!("\"{}\"", file.display())));
        }
        check_folder(file)?;
    }
    Ok(())
}

/// The first file of a table; none: pictures alone, or standard output.
pub(super) fn table_file(files: &[PathBuf]) -> Option<&PathBuf> {
    files.iter().find(|file| is_table(file))
}

/// Rejects limits on what this sweep has no column of, as far as its columns are known before it runs.
pub(super) fn check_limits(spec: &SweepSpec, limits: &[YieldLimit]) -> Result<(), Failure> {
    let results: Vec<String> = match &spec.analysis {
        SweepAnalysis::Modes { count, .. } => (1..=*count).map(|k| format!("f{k}")).collect(),
        SweepAnalysis::PullIn { .. } => vec!["pull_in".to_owned(), "release".to_owned()],
        SweepAnalysis::Static { outputs, .. } | SweepAnalysis::Transient { outputs, .. } => outputs.clone(),
    };
    if results.is_empty() {
        return Ok(());
    }
    let axes = spec.parameters.iter().map(|axis| &axis.name);
    let varied = spec.samples.iter().flat_map(|samples| samples.asked.vary.iter().map(|vary| &vary.name));
    let known: Vec<&String> = axes.chain(varied).chain(&results).collect();
    let is_known = |name: &String| known.contains(&name) || name == statistics::ESTIMATED_ERROR;
    match limits.iter().find(|limit| !is_known(&limit.name)) {
        Some(limit) => {
            let names: Vec<&str> = known.iter().map(|name| name.as_str()).collect();
            let expected = format!("a column of the table, one of {}", names.join(", "));
            Err(Failure::bad("--limits", expected, limit.name.clone()))
        }
        None => Ok(()),
    }
}

/// Writes the table to every file, or to standard output without any; whether there was anything to write.
pub(super) fn deliver(
    files: &[PathBuf],
    title: &str,
    table: &SweepTable,
    part: Option<&str>,
    (is_random, limits): (bool, &[YieldLimit]),
) -> Result<bool, Failure> {
    if files.is_empty() {
        return sweep_output::deliver(None, table, part);
    }
    for file in files {
        if is_of(file, "parquet") {
            if !sweep_output::is_result(table, part) {
                return Ok(false);
            }
            atomic::write(file, |out| parquet::write(&columns(table, part), out))
                .map_err(|source| Failure::Write { path: file.clone(), source })?;
        } else if is_table(file) {
            if !sweep_output::deliver(Some(file), table, part)? {
                return Ok(false);
            }
        } else if sweep_output::is_result(table, part) {
            write_picture(file, ResultFormat::from_path(file)?, &picture(title, table, is_random, limits))?;
        } else {
            return Ok(false);
        }
    }
    Ok(true)
}

/// The columns of the CSV table.
fn columns(table: &SweepTable, part: Option<&str>) -> Vec<ParquetColumn> {
    let mut found = vec![ParquetColumn {
        name: "point".to_owned(),
        values: ParquetValues::Integers(table.rows.iter().map(|row| row.point as i64).collect()),
    }];
    for (k, name) in table.parameters.iter().enumerate() {
        let number = |setting: &Setting| match setting {
            Setting::Number(value) => Some(*value),
            Setting::Text(_) => None,
        };
        let text = |setting: &Setting| match setting {
            Setting::Number(value) => format!("{value:e}"),
            Setting::Text(text) => text.clone(),
        };
        let settings = || table.rows.iter().map(|row| &row.parameters[k]);
        let are_numbers = settings().all(|setting| number(setting).is_some());
        let values = if are_numbers {
            ParquetValues::Numbers(settings().map(number).collect())
        } else {
            ParquetValues::Texts(settings().map(text).collect())
        };
        found.push(ParquetColumn { name: name.clone(), values });
    }
    for (k, (name, unit)) in table.results.iter().zip(&table.units).enumerate() {
        let values = table.rows.iter().map(|row| row.values.as_ref().ok().and_then(|values| values[k])).collect();
        found.push(ParquetColumn { name: format!("{name} [{unit}]"), values: ParquetValues::Numbers(values) });
    }
    let estimates = table.rows.iter().map(|row| row.estimated_error).collect();
    found.push(ParquetColumn { name: "estimated_error [1]".to_owned(), values: ParquetValues::Numbers(estimates) });
    let warnings = table.rows.iter().map(|row| row.warning.clone()).collect();
    found.push(ParquetColumn { name: "warning".to_owned(), values: ParquetValues::Texts(warnings) });
    let error = |error: &String| error.trim_end().to_owned();
    let errors = table.rows.iter().map(|row| row.values.as_ref().err().map(error).unwrap_or_default()).collect();
    found.push(ParquetColumn { name: "error".to_owned(), values: ParquetValues::Texts(errors) });
    if let Some(part) = part {
        found.push(ParquetColumn {
            name: "part".to_owned(),
            values: ParquetValues::Texts(vec![part.to_owned(); table.rows.len()]),
        });
    }
    found
}

/// A panel for each result: its histogram where samples were drawn, else its curve over the last parameter of numbers.
fn picture(title: &str, table: &SweepTable, is_random: bool, limits: &[YieldLimit]) -> Picture {
    let over = (0..table.parameters.len()).rev().find(|k| {
        let mut settings = table.rows.iter().map(|row| &row.parameters[*k]);
        settings.all(|setting| matches!(setting, Setting::Number(_)))
    });
    let panels: Vec<Picture> = (0..table.results.len().min(MAX_PANELS))
        .map(|result| match over.filter(|_| !is_random) {
            Some(over) => plane::draw(&curves(title, table, result, over)),
            None => histogram::draw(&bars(title, table, result, limits)),
        })
        .collect();
    stack(&panels)
}

fn bars(title: &str, table: &SweepTable, result: usize, limits: &[YieldLimit]) -> histogram::Histogram {
    let (edges, counts) = statistics::histogram(&statistics::values(table, result));
    let (name, unit) = (&table.results[result], &table.units[result]);
    let of_it = limits.iter().filter(|limit| limit.name == *name).map(|limit| limit.value).collect();
    histogram::Histogram {
        title: format!("{title}: {name}"),
        quantity: [name.clone(), unit.clone()],
        edges,
        counts,
        limits: of_it,
    }
}

fn curves(title: &str, table: &SweepTable, result: usize, over: usize) -> PlaneChart {
    let mut curves: BTreeMap<Vec<String>, (usize, Vec<[f64; 2]>)> = BTreeMap::new();
    for (at, row) in table.rows.iter().enumerate() {
        let others = row.parameters.iter().enumerate().filter(|(k, _)| *k != over);
        let named = others.map(|(k, setting)| match setting {
            Setting::Number(value) => format!("{} = {value:e}", table.parameters[k]),
            Setting::Text(text) => format!("{} = {text}", table.parameters[k]),
        });
        let value = row.values.as_ref().ok().and_then(|values| values[result]);
        if let (Setting::Number(x), Some(y)) = (&row.parameters[over], value) {
            curves.entry(named.collect()).or_insert((at, Vec::new())).1.push([*x, y]);
        }
    }
    let mut ordered: Vec<_> = curves.into_iter().collect();
    ordered.sort_by_key(|(_, (first, _))| *first);
    let is_named = ordered.len() <= MAX_NAMED;
    let curve = |(named, (_, points)): (Vec<String>, (usize, Vec<[f64; 2]>))| PlaneCurve {
        name: if is_named { named.join(", ") } else { String::new() },
        points,
        dashed: Vec::new(),
    };
    let (parameter, name) = (&table.parameters[over], &table.results[result]);
    let units = [(".v", "V"), (".ux", "m"), (".uy", "m"), (".urz", "rad")];
    let unit = units.iter().find(|(end, _)| parameter.ends_with(end)).map_or("", |(_, unit)| unit);
    PlaneChart {
        title: format!("{title}: {name}"),
        x: [parameter.clone(), unit.to_owned()],
        y: [name.clone(), table.units[result].clone()],
        curves: ordered.into_iter().map(curve).collect(),
        marks: Vec::new(),
        equal: false,
        note: String::new(),
    }
}

/// Statistics of every result, and the yield, as text; with its confidence interval where the points are samples.
pub(super) fn report(found: &SweepStatistics, is_random: bool) -> String {
    let mut lines = vec![format!(
        "{:<24}{:>14}{:>14}{:>14}{:>14}{:>14}{:>14}{:>14}",
        "result", "mean", "deviation", "minimum", "5 %", "50 %", "95 %", "maximum"
    )];
    for ColumnStatistics { name, unit, mean, deviation, percentiles: [p5, p50, p95], range: [low, high], .. } in
        &found.columns
    {
        let number = |value: &f64| if value.is_finite() { format!("{value:>14.6e}") } else { format!("{:>14}", "-") };
        let numbers = [mean, deviation, low, p5, p50, p95, high].map(number).concat();
        lines.push(format!("{:<24}{numbers}", format!("{name} [{unit}]")));
    }
    let percent = |fraction: Fraction| format!("{:.2} % of {} points", 100.0 * fraction.value(), fraction.points);
    lines.extend(found.limits.iter().map(|(limit, fraction)| format!("{limit}: {}", percent(*fraction))));
    let [low, high] = found.passed.interval().map(|end| 100.0 * end);
    let interval = if is_random {
        format!(", 95 % confidence {low:.2} % to {high:.2} % (of independent samples)")
    } else {
        String::new()
    };
    lines.push(format!("yield: {}{interval}", percent(found.passed)));
    if found.undecided > 0 {
        lines.push(format!(
            "{} points are closer to a limit than their estimated error: a smaller --tol decides them",
            found.undecided
        ));
    }
    lines.join("\n")
}
