//! Output of `bimorph tran`: document, table, picture and text.

use super::failure::Failure;
use super::model::{Context, JsonMap};
use super::report;
use super::solver::SolverChoice;
use bimorph::analysis::joint_transient::JointReport;
use bimorph::analysis::transient::{CrossingEvent, Statistics, StressMaximum, TransientResult};
use bimorph::compile::CompiledModel;
use bimorph::results::plot::axis::quantity;
use bimorph::results::plot::chart::{self, Panel, PanelChart, Series};
use bimorph::results::plot::svg::Picture;
use bimorph::results::table::Table;
use bimorph::solve::time::event::Direction;
use bimorph::solve::time::method::SolverCounters;
use serde::Serialize;

/// A half-sine shock: its peak along x and y, and its duration.
#[derive(Debug, Serialize)]
pub(super) struct ShockDocument {
    pub(super) peak_m_s2: [f64; 2],
    pub(super) duration_s: f64,
}

#[derive(Debug, Serialize)]
pub(super) struct TransientDocument<'a> {
    pub(super) t: &'a [f64],
    pub(super) signals: JsonMap<'a, Vec<f64>>,
    pub(super) units: JsonMap<'a, String>,
    pub(super) method: &'a str,
    pub(super) counters: SolverCounters,
    pub(super) events: &'a [CrossingEvent],
    pub(super) joint_coordinates: Option<JointReport>,
    /// The formulation that auto chose, and the reason.
    pub(super) formulation_taken: Option<&'a str>,
    pub(super) unknowns: usize,
    pub(super) step_error: Option<f64>,
    pub(super) stopped_at: Option<f64>,
    pub(super) reliable_until: Option<f64>,
    pub(super) after_contact: &'a [Statistics],
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) shock: Option<ShockDocument>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) largest_stress: Option<&'a StressMaximum>,
    pub(super) solver: SolverChoice,
    pub(super) release: Option<&'a str>,
    pub(super) port_voltages_v: JsonMap<'a, f64>,
    #[serde(flatten)]
    pub(super) context: Context<'a>,
}

pub(super) fn table(title: &str, result: &TransientResult) -> Result<Table, Failure> {
    let mut table = Table::new(title, "Transient Analysis");
    table.push_real("time", "s", result.t.clone())?;
    for (name, unit, values) in &result.signals {
        table.push_real(name, unit, values.clone())?;
    }
    Ok(table)
}

/// One panel for each unit.
pub(super) fn picture(title: &str, result: &TransientResult) -> Picture {
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
    chart::draw(&PanelChart {
        title: title.to_owned(),
        x_name: "time".to_owned(),
        x_unit: "s".to_owned(),
        x: result.t.clone(),
        panels,
    })
}

/// Crossings that are listed: a part that bounces has many.
const MAX_EVENTS: usize = 20;

pub(super) fn text(
    compiled: &CompiledModel,
    result: &TransientResult,
    joints: Option<&JointReport>,
    asked: &[(String, f64)],
) -> String {
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
    let mut events: String = result
        .events
        .iter()
        .take(MAX_EVENTS)
        .map(|e| {
            let what = if e.contact { " (contact)" } else { "" };
            let way = if e.direction == Direction::Up { "up" } else { "down" };
            format!("{} crosses {:e} {way} at {}{what}\n", e.signal, e.level, quantity(e.t, "s"))
        })
        .collect();
    if let Some(more) = result.events.len().checked_sub(MAX_EVENTS).filter(|more| *more > 0) {
        events.push_str(&format!("and {more} crossings more: --json has all\n"));
    }
    let crossed = |name: &str, level: f64| result.events.iter().any(|e| e.signal == name && e.level == level);
    for (name, level) in asked.iter().filter(|(name, level)| !crossed(name, *level)) {
        events.push_str(&format!("{name} does not cross {level:e}\n"));
    }
    if let Some(t) = result.stopped_at {
        events.push_str(&format!("stopped at {}\n", quantity(t, "s")));
    }
    let unit = |name: &str| result.signals.iter().find(|(n, ..)| n == name).map_or("", |(_, unit, _)| unit);
    for s in &result.after_contact {
        let [mean, error, rms] = [s.mean, s.mean_error, s.rms].map(|x| quantity(x, unit(&s.signal)));
        let [from, to] = [s.from, s.to].map(|t| quantity(t, "s"));
        events.push_str(&format!("{} from {from} to {to}: mean {mean} ± {error}, rms about it {rms}\n", s.signal));
    }
    if let Some(StressMaximum { beam, stress_pa, t, strength_pa }) = &result.largest_stress {
        let margin = strength_pa.map_or_else(String::new, |strength| {
            format!(", {:.2} % of its strength {}", 100.0 * stress_pa / strength, quantity(strength, "Pa"))
        });
        let (stress, t) = (quantity(*stress_pa, "Pa"), quantity(*t, "s"));
        events.push_str(&format!("largest stress: {beam} {stress} at {t}{margin}\n"));
    }
    let work = match joints {
        None => format!("{} factorizations, {} solves", c.factorizations, c.solves),
        Some(j) => format!(
            "{} accelerations ({} near singular), n = {}, m = {}, largest gap of a loop {:.1e} m",
            j.accelerations, j.singular_evaluations, j.coordinates, j.constraints, j.largest_gap_m
        ),
    };
    let off = result
        .step_error
        .map_or_else(|| ", not compared".to_owned(), |e| format!(", estimated error of the steps {e:.1e}"));
    format!(
        "{}\n{events}{} samples, {} steps ({} rejected){off}, {work}; {}",
        report::columns(&["signal", "lowest sample", "highest sample", "at the end"], &rows),
        result.t.len(),
        c.steps,
        c.rejected,
        report::footing_of_run(compiled, result.unknowns)
    )
}
