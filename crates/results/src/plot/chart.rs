//! Line charts: panels under each other over one shared axis.

use super::PALETTE;
use super::axis::{Axis, axis};
use super::svg::{Align, Paint, Picture};

/// One curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Values in SI, as many as the chart's `x`.
    pub values: Vec<f64>,
}

/// Curves that share a unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// Title of the panel.
    pub title: String,
    /// Unit in SI; an SI prefix is chosen to fit. A unit in brackets such as "(µm)" is taken as it is.
    pub unit: String,
    /// The curves, in the order of their legend.
    pub series: Vec<Series>,
}

/// Panels over one independent quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct PanelChart {
    /// Line above the panels.
    pub title: String,
    /// Name of the independent quantity.
    pub x_name: String,
    /// Its unit in SI.
    pub x_unit: String,
    /// Its values, ascending.
    pub x: Vec<f64>,
    /// The panels from top to bottom.
    pub panels: Vec<Panel>,
}

/// Width of every chart (px).
pub const WIDTH: f64 = 920.0;
const LEFT: f64 = 92.0;
const RIGHT: f64 = 24.0;
const INK: &str = "#333333";

/// Curves shown in one panel; of more, those that move most.
const MAX_CURVES: usize = 7;

/// Draws a chart.
pub fn draw(chart: &PanelChart) -> Picture {
    let panel_height = if chart.panels.len() <= 2 { 260.0 } else { 150.0 };
    let top = 40.0;
    let pitch = panel_height + 34.0;
    let mut picture = Picture::new(WIDTH, top + pitch * chart.panels.len() as f64 + 26.0);
    picture.text(LEFT, 24.0, 15.0, Align::Start, INK, &chart.title);

    let (low, high) = range(&chart.x);
    let x_axis = axis(low, high, &chart.x_unit, 8, false);
    for (i, panel) in chart.panels.iter().enumerate() {
        let y = top + pitch * i as f64 + 18.0;
        draw_panel(&mut picture, chart, panel, &x_axis, [y, panel_height - 18.0 + 16.0], i + 1 == chart.panels.len());
    }
    picture
}

fn draw_panel(
    picture: &mut Picture,
    chart: &PanelChart,
    panel: &Panel,
    x_axis: &Axis,
    [top, height]: [f64; 2],
    last: bool,
) {
    let width = WIDTH - LEFT - RIGHT;
    let shown = loudest(&panel.series);
    let (low, high) = shown.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), s| {
        let (l, h) = range(&s.values);
        (low.min(l), high.max(h))
    });
    let fixed = panel.unit.strip_prefix('[').and_then(|u| u.strip_suffix(']'));
    let mut y_axis = axis(low, high, if fixed.is_some() { "" } else { &panel.unit }, 6, true);
    if let Some(unit) = fixed {
        y_axis.unit = unit.to_owned() + &y_axis.unit;
    }
    let to_x = |x: f64| LEFT + width * (x - x_axis.low) / (x_axis.high - x_axis.low);
    let to_y = |y: f64| top + height * (y_axis.high - y) / (y_axis.high - y_axis.low);

    for (value, label) in &y_axis.ticks {
        let y = to_y(*value);
        picture.polyline(&[[LEFT, y], [LEFT + width, y]], Paint::line("#e4e4e4", 1.0));
        picture.text(LEFT - 7.0, y + 4.0, 11.0, Align::End, INK, label);
    }
    for (value, label) in &x_axis.ticks {
        let x = to_x(*value);
        picture.polyline(&[[x, top], [x, top + height]], Paint::line("#e4e4e4", 1.0));
        if last {
            picture.text(x, top + height + 16.0, 11.0, Align::Middle, INK, label);
        }
    }
    picture.rectangle(LEFT, top, width, height, Paint::line("#888888", 1.0));
    if last {
        let text = with_unit(&chart.x_name, &x_axis.unit);
        picture.text(LEFT + width / 2.0, top + height + 34.0, 12.0, Align::Middle, INK, &text);
    }
    picture.text(LEFT, top - 6.0, 12.0, Align::Start, INK, &with_unit(&panel.title, &y_axis.unit));

    let mut legend = LEFT + width;
    if shown.len() < panel.series.len() {
        let note = format!("{} of {} curves", shown.len(), panel.series.len());
        picture.text(legend, top - 6.0, 11.0, Align::End, "#888888", &note);
        legend -= 7.0 * note.len() as f64;
    }
    for (i, series) in shown.iter().enumerate().rev() {
        let colour = PALETTE[i % PALETTE.len()];
        picture.text(legend, top - 6.0, 11.0, Align::End, INK, &series.name);
        legend -= 7.0 * series.name.chars().count() as f64 + 6.0;
        picture.polyline(&[[legend - 16.0, top - 10.0], [legend, top - 10.0]], Paint::line(colour, 2.5));
        legend -= 28.0;
    }
    for (i, series) in shown.iter().enumerate() {
        let points = thin_out(&chart.x, &series.values, to_x, to_y);
        picture.polyline(&points, Paint::line(PALETTE[i % PALETTE.len()], 1.5));
    }
}

/// Name of the quantity of a unit, as a title for a panel.
pub fn word(unit: &str) -> &'static str {
    match unit {
        "m" => "displacement",
        "rad" => "rotation",
        "m/s" => "velocity",
        "rad/s" => "angular velocity",
        "K" => "temperature",
        "V" => "voltage",
        "A" => "current",
        "C" => "charge",
        _ => "signal",
    }
}

fn with_unit(name: &str, unit: &str) -> String {
    if unit.is_empty() { name.to_owned() } else { format!("{name} [{unit}]") }
}

fn range(values: &[f64]) -> (f64, f64) {
    let finite = values.iter().filter(|v| v.is_finite());
    finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(*v), high.max(*v)))
}

/// The curves to show, in their own order: all, or those with the widest range where there are too many.
fn loudest(series: &[Series]) -> Vec<&Series> {
    let mut order: Vec<usize> = (0..series.len()).collect();
    if series.len() > MAX_CURVES {
        let span = |i: &usize| {
            let (low, high) = range(&series[*i].values);
            high - low
        };
        order.sort_by(|a, b| span(b).total_cmp(&span(a)).then(a.cmp(b)));
        order.truncate(MAX_CURVES);
        order.sort_unstable();
    }
    order.into_iter().map(|i| &series[i]).collect()
}

/// At most four points for each column of pixels (first, lowest, highest, last), so that no spike is lost.
pub(super) fn thin_out(x: &[f64], y: &[f64], to_x: impl Fn(f64) -> f64, to_y: impl Fn(f64) -> f64) -> Vec<[f64; 2]> {
    let mut points: Vec<[f64; 2]> = Vec::new();
    let mut column: Vec<[f64; 2]> = Vec::new();
    let flush = |column: &mut Vec<[f64; 2]>, points: &mut Vec<[f64; 2]>| {
        if column.len() <= 4 {
            points.append(column);
            return;
        }
        let by_y = |a: &usize, b: &usize| column[*a][1].total_cmp(&column[*b][1]);
        let low = (0..column.len()).min_by(by_y).unwrap_or(0);
        let high = (0..column.len()).max_by(by_y).unwrap_or(0);
        let mut keep = [0, low.min(high), low.max(high), column.len() - 1];
        keep.sort_unstable();
        points.extend(keep.map(|k| column[k]));
        column.clear();
    };
    for (x, y) in x.iter().zip(y).filter(|(x, y)| x.is_finite() && y.is_finite()) {
        let point = [to_x(*x), to_y(*y)];
        if column.first().is_some_and(|first| first[0].floor() != point[0].floor()) {
            flush(&mut column, &mut points);
        }
        column.push(point);
    }
    flush(&mut column, &mut points);
    points
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A spike of one sample among a million survives the thinning, and the curve keeps a bounded size.
    #[test]
    fn no_spike_is_lost() {
        let n = 100_000;
        let x: Vec<f64> = (0..n).map(f64::from).collect();
        let mut y = vec![0.0; n as usize];
        y[54_321] = 1.0;
        let points = thin_out(&x, &y, |x| x * 800.0 / f64::from(n), |y| 100.0 * y);
        assert!(points.len() <= 4 * 801);
        assert!(points.iter().any(|p| p[1] == 100.0));
    }

    /// Of many curves the ones that move most are drawn, and the panel says so.
    #[test]
    fn too_many_curves() {
        let series = (0..20).map(|k| Series { name: format!("s{k}"), values: vec![0.0, f64::from(k)] }).collect();
        let panel = Panel { title: "Motion".into(), unit: "m".into(), series };
        let chart = PanelChart {
            title: "t".into(),
            x_name: "time".into(),
            x_unit: "s".into(),
            x: vec![0.0, 1.0],
            panels: vec![panel],
        };
        let svg = draw(&chart).to_svg();
        assert!(svg.contains("7 of 20 curves") && svg.contains(">s19<") && !svg.contains(">s12<"));
    }
}
