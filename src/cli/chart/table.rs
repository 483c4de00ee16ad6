//! The points of a chart as CSV, as cells of a page, and as a report.

use crate::cli::report;
use bimorph::analysis::chart::{Chart, ChartPart, ChartPoint, RunMeasurement};
use bimorph::results::csv::field;
use bimorph::results::plot::axis::quantity;
use std::fmt::Write;

/// Columns of the CSV file. Times are wall-clock times of the machine it was made on; everything else is the same on
/// every run.
pub(crate) const HEADER: &str = "part,formulation,method,solver,tol,band [Hz],unknowns,error,wall-clock time [s],\
    steps,rejected,factorizations,solves,force evaluations,multiplications,told,failed";

/// All points, one line each. A point that failed has its reason in the last column and no numbers.
pub(crate) fn csv(chart: &Chart) -> String {
    let mut text = format!("{HEADER}\n");
    for p in &chart.points {
        let band = p.band_hz.map(|b| format!("{b:e}")).unwrap_or_default();
        let _ = write!(
            text,
            "{},{},{},{},{:e},{band},{},",
            p.part.name(),
            p.formulation.name(),
            p.method,
            p.solver,
            p.tol,
            p.unknowns
        );
        match &p.measured {
            Some(m) => {
                let error = m.error.map(|e| format!("{e:e}")).unwrap_or_default();
                let products = m.multiplications.map(|n| n.to_string()).unwrap_or_default();
                let reported = m.told.map(|e| format!("{e:e}")).unwrap_or_default();
                let _ = write!(
                    text,
                    "{error},{:e},{},{},{},{},{},{products},{reported},",
                    m.seconds, m.steps, m.rejected, m.factorizations, m.solves, m.forces
                );
            }
            None => text.push_str(",,,,,,,,,"),
        }
        let _ = writeln!(text, "{}", field(p.failed.as_deref().unwrap_or_default()));
    }
    text
}

/// Heads of the columns for people.
pub(crate) const HEADS: [&str; 8] = ["run", "tolerance", "band", "unknowns", "error", "told", "time", "work"];

/// The cells of a point for people: short, in engineering units; a failure is printed instead of numbers.
pub(crate) fn cells(p: &ChartPoint) -> Vec<String> {
    let run = match p.part {
        ChartPart::Precision => format!("{} {}", p.formulation.name(), p.method),
        ChartPart::Order => p.formulation.name().to_owned(),
        ChartPart::Solvers => p.solver.to_owned(),
        ChartPart::Defaults => p.method.to_owned(),
    };
    let band = p.band_hz.map_or_else(|| "by shape".to_owned(), |b| quantity(b, "Hz"));
    let mut cells = vec![run, format!("{:.0e}", p.tol), band, p.unknowns.to_string()];
    match (&p.measured, &p.failed) {
        (Some(m), _) => {
            let number = |x: Option<f64>| x.map_or_else(|| "-".to_owned(), |e| format!("{e:.1e}"));
            cells.extend([number(m.error), number(m.told)]);
            cells.push(quantity(m.seconds, "s"));
            cells.push(format!("{:.0}", work(p, m)));
        }
        (None, reason) => {
            cells.extend(["failed", "-", "-", "-"].map(str::to_owned));
            let _ = reason;
        }
    }
    cells
}

/// Work without a clock, as the pictures of counts have it.
pub(super) fn work(p: &ChartPoint, m: &RunMeasurement) -> f64 {
    match p.part {
        // models of growing order differ in the cost of a pass, which is linear in the unknowns
        ChartPart::Order => m.work() * p.unknowns as f64,
        _ => m.work(),
    }
}

/// Caption of a part's table, in one line.
pub(crate) fn caption(part: ChartPart) -> &'static str {
    match part {
        ChartPart::Precision => {
            "Methods and tolerances on one model; work: solves, force evaluations and factorizations in force evaluations"
        }
        ChartPart::Order => "Models of growing order against the finest; work: the same times unknowns",
        ChartPart::Solvers => "One step of Rodas4 by solver; work: multiplications of its factorization and solves",
        ChartPart::Defaults => {
            "Default analyses by tolerance, against a tenth of the tightest: requested, obtained and estimated error, and the time"
        }
    }
}

/// A report: one table for each part, and the reasons of what failed.
pub(crate) fn text(chart: &Chart) -> String {
    let mut text = String::new();
    for part in ChartPart::ALL {
        let rows: Vec<Vec<String>> = chart.points.iter().filter(|p| p.part == part).map(cells).collect();
        if !rows.is_empty() {
            let _ = writeln!(text, "{}\n{}", caption(part), report::columns(&HEADS, &rows));
        }
    }
    for p in &chart.points {
        if let Some(reason) = &p.failed {
            let _ = writeln!(text, "failed: {}: {reason}", cells(p)[..4].join(", "));
        }
    }
    if let Some(error) = chart.reference_error {
        let _ = writeln!(text, "errors below {error:.1e} are those of the reference");
    }
    let _ = writeln!(text, "end time {}; times are wall-clock times of this machine", quantity(chart.stop, "s"));
    text
}
