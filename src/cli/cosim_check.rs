//! Output of `bimorph cosim --check`: the difference between a run and its finer repetition.

use super::failure::Failure;
use super::output::print;
use super::report::columns;
use bimorph::cosim::check::CosimCheck;
use bimorph::cosim::compare::{Oscillation, PlotComparison, PrintedNumber, VectorComparison};
use bimorph::results::plot::axis::quantity;
use serde::Serialize;
use std::path::Path;

#[derive(Serialize)]
struct CosimDocument<'a> {
    file: String,
    plots: &'a [PlotComparison],
    printed: &'a [PrintedNumber],
    warnings: Vec<&'a str>,
}

/// Prints ngspice's output of the run as it is, unless `quiet`, then a table for each plot; or one document.
pub(crate) fn print_check(deck: &Path, checked: &CosimCheck, json: bool, quiet: bool) -> Result<(), Failure> {
    for note in &checked.notes {
        stderr_line!("warning: {note}");
    }
    if json {
        let file = deck.display().to_string();
        let warnings = checked.notes.iter().map(String::as_str).chain(checked.report.warnings()).collect();
        let document = CosimDocument { file, plots: &checked.plots, printed: &checked.printed, warnings };
        let text = serde_json::to_string(&document).map_err(|e| Failure::Stdout(e.into()))?;
        return print(&format!("{text}\n"));
    }
    let mut text = if quiet { String::new() } else { format!("{}\n", checked.report.output.trim_end()) };
    text += "as it is, against half the steps, a tenth of the tolerances and twice the segments; differences are relative to the range\n";
    for plot in &checked.plots {
        text += &table(plot);
    }
    if !checked.printed.is_empty() {
        let row = |p: &PrintedNumber| {
            vec![p.name.clone(), format!("{:.6e}", p.values[0]), format!("{:.6e}", p.values[1]), share(p.difference)]
        };
        let rows: Vec<Vec<String>> = checked.printed.iter().map(row).collect();
        text += &format!("\n{}", columns(&["printed", "as it is", "finer", "difference"], &rows));
    }
    let worst = (checked.plots.iter().flat_map(|plot| plot.vectors.iter().map(move |v| (plot, v))))
        .max_by(|(_, a), (_, b)| a.counts().total_cmp(&b.counts()));
    if let Some((plot, vector)) = worst {
        text += &format!("\nlargest: {} of {} in {}\n", share(vector.counts()), vector.name, plot.name);
    }
    print(&text)
}

fn table(plot: &PlotComparison) -> String {
    let place = |x: f64| match plot.axis.as_str() {
        "" => String::new(),
        "time" => quantity(x, "s"),
        "frequency" => quantity(x, "Hz"),
        _ => quantity(x, ""),
    };
    let rows: Vec<Vec<String>> = (plot.vectors.iter().filter(|v| v.oscillation.is_none()))
        .map(|v| vec![v.name.clone(), quantity(v.range, &v.unit), share(v.largest), share(v.rms), place(v.at)])
        .collect();
    let [points, finer] = plot.points;
    let header = ["vector", "range", "largest", "rms", if plot.axis.is_empty() { "" } else { "at" }];
    let table = if rows.is_empty() { String::new() } else { columns(&header, &rows) };
    format!("\n{}, {points} points against {finer}\n{table}{}", plot.name, oscillators(plot))
}

/// Oscillating vectors, whose phase is ignored.
fn oscillators(plot: &PlotComparison) -> String {
    let row = |v: &VectorComparison| {
        let Oscillation { frequency: [f, _], amplitude: [a, _], difference } = v.oscillation?;
        let of = |value: f64, unit: &str, off: f64| [quantity(value, unit), share(off)];
        Some(
            [vec![v.name.clone()], of(f, "Hz", difference[0]).to_vec(), of(a, &v.unit, difference[1]).to_vec()]
                .concat(),
        )
    };
    let rows: Vec<Vec<String>> = plot.vectors.iter().filter_map(row).collect();
    if rows.is_empty() {
        return String::new();
    }
    let header = ["oscillates", "frequency", "difference", "amplitude", "difference"];
    format!(
        "of what oscillates over the second half, frequency and amplitude in place of the phase\n{}",
        columns(&header, &rows)
    )
}

fn share(difference: f64) -> String {
    format!("{difference:.1e}")
}
