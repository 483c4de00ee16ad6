//! A chart as a picture: one panel for each part.

use super::table::work;
use bimorph::analysis::chart::{Chart, ChartPart, ChartPoint, RunMeasurement};
use bimorph::results::plot::Picture;
use bimorph::results::plot::axis::quantity;
use bimorph::results::plot::loglog::{self, LogChart, LogCurve, LogPanel, Slope};
use clap::ValueEnum;

/// Measure of work.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum CostMeasure {
    /// Wall-clock time
    #[default]
    Time,
    /// Factorizations, solves and force evaluations, weighted by their cost; times unknowns where models differ; multiplications of a step
    Counts,
}

/// Draws a chart.
pub(super) fn draw(title: &str, chart: &Chart, work: CostMeasure) -> Picture {
    let mut panels: Vec<LogPanel> = ChartPart::ALL.into_iter().filter_map(|part| panel(chart, part, work)).collect();
    panels.extend((work == CostMeasure::Time).then(|| cost(chart)).flatten());
    let mut notes = vec![format!(
        "Error of {}: root mean square over {}, relative to amplitude.",
        chart.signals.join(", "),
        quantity(chart.stop, "s")
    )];
    let shown = |part: ChartPart| chart.points.iter().any(|p| p.part == part);
    if let (Some(error), true) = (chart.reference_error, shown(ChartPart::Precision)) {
        notes.push(format!("Methods: one model, against Radau5 a hundred times tighter (good to {error:.0e})."));
    }
    if shown(ChartPart::Order) {
        notes.push("Model order: against the finest compliant model; figures are unknowns.".into());
    }
    if shown(ChartPart::Defaults) {
        notes.push("Defaults: commands with a tolerance and nothing else, against a tenth of the tightest; figures are unknowns.".into());
    }
    if shown(ChartPart::Solvers) {
        notes.push("Solvers: one step of Rodas4, a tangent, a factorization and six solves.".into());
    }
    if work == CostMeasure::Counts && (shown(ChartPart::Precision) || shown(ChartPart::Order)) {
        notes.push("Work: a force evaluation counts 1, a factorization with its tangent 2, a solve 0.23.".into());
    }
    if work == CostMeasure::Time {
        notes.push("Times are wall-clock times on one machine, medians.".into());
    }
    let failed = chart.points.iter().filter(|p| p.failed.is_some()).count();
    if failed > 0 {
        notes.push(format!(
            "{failed} of {} runs have no result or were left out; the table says why.",
            chart.points.len()
        ));
    }
    loglog::draw(&LogChart { title: title.to_owned(), panels, notes })
}

fn panel(chart: &Chart, part: ChartPart, work: CostMeasure) -> Option<LogPanel> {
    let points: Vec<&ChartPoint> = chart.points.iter().filter(|p| p.part == part).collect();
    let formulations = points.iter().any(|p| p.formulation != points[0].formulation);
    let mut curves: Vec<LogCurve> = Vec::new();
    for p in &points {
        let name = match part {
            ChartPart::Precision if formulations => format!("{} {}", p.formulation.name(), p.method),
            ChartPart::Precision => p.method.to_owned(),
            ChartPart::Order => match p.formulation.name() {
                "frame" => "linear frame".to_owned(),
                name => name.to_owned(),
            },
            ChartPart::Solvers => p.solver.to_owned(),
            ChartPart::Defaults => p.method.to_owned(),
        };
        let k = curves.iter().position(|c| c.name == name).unwrap_or_else(|| {
            curves.push(LogCurve { name, points: Vec::new(), labels: Vec::new() });
            curves.len() - 1
        });
        if let Some(m) = &p.measured {
            let work = effort(p, m, work);
            match part {
                ChartPart::Solvers => curves[k].points.push([p.unknowns as f64, work]),
                ChartPart::Defaults => curves[k].points.push([p.tol, m.error.unwrap_or(f64::NAN)]),
                _ => curves[k].points.push([work, m.error.unwrap_or(f64::NAN)]),
            }
            if matches!(part, ChartPart::Order | ChartPart::Defaults) {
                curves[k].labels.push(p.unknowns.to_string());
            }
        }
    }
    if curves.is_empty() {
        return None;
    }
    let run = match work {
        CostMeasure::Time => "time of a run [s]",
        CostMeasure::Counts if part == ChartPart::Order => "work [force evaluations × unknowns]",
        CostMeasure::Counts => "work [force evaluations]",
    };
    Some(match part {
        ChartPart::Precision => LogPanel {
            title: "Methods, by tolerance".into(),
            x_name: run.into(),
            y_name: "relative error".into(),
            curves,
            floor: chart.reference_error.map(|e| ("reference".into(), e)),
            slopes: Vec::new(),
        },
        ChartPart::Order => LogPanel {
            title: "Model order, by unknowns".into(),
            x_name: run.into(),
            y_name: "relative error".into(),
            curves,
            floor: None,
            slopes: Vec::new(),
        },
        ChartPart::Solvers => LogPanel {
            title: "Solvers, one step".into(),
            x_name: "unknowns".into(),
            y_name: match work {
                CostMeasure::Time => "time of a step [s]".into(),
                CostMeasure::Counts => "multiplications of a step".into(),
            },
            slopes: slopes(&curves),
            curves,
            floor: None,
        },
        ChartPart::Defaults => {
            let loosest = points.iter().map(|p| p.tol).fold(0.0, f64::max);
            LogPanel {
                title: "Defaults: requested, obtained".into(),
                x_name: "requested tolerance".into(),
                y_name: "true relative error".into(),
                slopes: vec![Slope { name: "requested".into(), through: [loosest, loosest], exponent: 1.0 }],
                curves,
                floor: None,
            }
        }
    })
}

/// Cost of a default analysis against its tolerance.
fn cost(chart: &Chart) -> Option<LogPanel> {
    let mut curves: Vec<LogCurve> = Vec::new();
    for (p, m) in chart.points.iter().filter(|p| p.part == ChartPart::Defaults).filter_map(|p| Some((p, p.measured?))) {
        let k = curves.iter().position(|c| c.name == p.method).unwrap_or_else(|| {
            curves.push(LogCurve { name: p.method.to_owned(), points: Vec::new(), labels: Vec::new() });
            curves.len() - 1
        });
        curves[k].points.push([p.tol, m.seconds]);
    }
    (!curves.is_empty()).then(|| LogPanel {
        title: "Defaults: what it costs".into(),
        x_name: "requested tolerance".into(),
        y_name: "time of a command [s]".into(),
        curves,
        floor: None,
        slopes: Vec::new(),
    })
}

fn effort(p: &ChartPoint, m: &RunMeasurement, cost: CostMeasure) -> f64 {
    match cost {
        CostMeasure::Time => m.seconds,
        CostMeasure::Counts => work(p, m),
    }
}

/// n below the first curve, which is the recursion's where it is there, and n³ above the highest point.
fn slopes(curves: &[LogCurve]) -> Vec<Slope> {
    let largest = |c: &LogCurve| c.points.iter().copied().max_by(|a, b| a[0].total_cmp(&b[0]));
    let mut slopes = Vec::new();
    if let Some(p) = curves.first().and_then(largest) {
        slopes.push(Slope { name: "n".into(), through: [p[0], 0.6 * p[1]], exponent: 1.0 });
    }
    let all = curves.iter().filter_map(largest);
    if let Some(p) = all.max_by(|a, b| a[1].total_cmp(&b[1])).filter(|_| curves.len() > 1) {
        slopes.push(Slope { name: "n³".into(), through: [p[0], 1.6 * p[1]], exponent: 3.0 });
    }
    slopes
}
