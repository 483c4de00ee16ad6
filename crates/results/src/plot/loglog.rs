//! Log-log charts: markers and lines in adjacent panels, decades as powers of ten, one legend under each title.

use super::PALETTE;
use super::log_axis::LogAxis;
use super::svg::{Align, Paint, Picture};

/// One curve with a mark at each point.
#[derive(Debug, Clone, PartialEq)]
pub struct LogCurve {
    /// Name in the legend.
    pub name: String,
    /// Points (x, y) in SI; those that are not positive and finite are left out.
    pub points: Vec<[f64; 2]>,
    /// A short text beside each point; empty: none.
    pub labels: Vec<String>,
}

/// A line of constant slope for the eye, through the chart's own corner.
#[derive(Debug, Clone, PartialEq)]
pub struct Slope {
    /// Label of the line: "n³".
    pub name: String,
    /// A point on it.
    pub through: [f64; 2],
    /// Its exponent.
    pub exponent: f64,
}

/// One pair of logarithmic axes.
#[derive(Debug, Clone, PartialEq)]
pub struct LogPanel {
    /// Line above the panel.
    pub title: String,
    /// Name of the horizontal quantity, with its unit.
    pub x_name: String,
    /// Name of the vertical quantity, with its unit.
    pub y_name: String,
    /// The curves, in the order of their legend.
    pub curves: Vec<LogCurve>,
    /// A level to mark with its name, such as the error of a reference.
    pub floor: Option<(String, f64)>,
    /// Slopes for the eye.
    pub slopes: Vec<Slope>,
}

/// A picture of panels.
#[derive(Debug, Clone, PartialEq)]
pub struct LogChart {
    /// Line above everything.
    pub title: String,
    /// Panels, two in a row.
    pub panels: Vec<LogPanel>,
    /// Notes on the measurement and the machine; an empty one adds vertical space.
    pub notes: Vec<String>,
}

const PITCH: f64 = 460.0;
const LEFT: f64 = 66.0;
const RIGHT: f64 = 14.0;
const PLOT_HEIGHT: f64 = 270.0;
const LEGEND_LINE: f64 = 17.0;
const NOTE_LINE: f64 = 17.0;
const INK: &str = "#333333";
const GRID: &str = "#dddddd";
const FINE_GRID: &str = "#f1f1f1";
/// Average width of a letter, in sizes of the font: enough room for DejaVu Sans.
const LETTER: f64 = 0.62;

/// Draws a chart.
pub fn draw(chart: &LogChart) -> Picture {
    let rows: Vec<&[LogPanel]> = chart.panels.chunks(2).collect();
    let legends: Vec<f64> =
        (rows.iter()).map(|row| row.iter().map(|p| legend_lines(p) as f64).fold(1.0, f64::max) * LEGEND_LINE).collect();
    let heights: Vec<f64> = legends.iter().map(|legend| 26.0 + legend + PLOT_HEIGHT + 56.0).collect();
    let top = 40.0;
    let columns = chart.panels.len().clamp(1, 2) as f64;
    // notes stand in the free place of an odd number of panels, else below everything
    let beside = chart.panels.len() > 1 && chart.panels.len() % 2 == 1;
    let room = PITCH * if beside { 1.0 } else { columns } - LEFT - RIGHT;
    let notes: Vec<String> = chart.notes.iter().flat_map(|note| wrapped(note, room)).collect();
    let below = if beside { 0.0 } else { NOTE_LINE * notes.len() as f64 };
    let mut picture = Picture::new(PITCH * columns, top + heights.iter().sum::<f64>() + below + 10.0);
    picture.text(16.0, 25.0, 15.0, Align::Start, INK, &chart.title);
    let mut y = top;
    for ((row, legend), height) in rows.iter().zip(&legends).zip(&heights) {
        for (k, panel) in row.iter().enumerate() {
            draw_panel(&mut picture, panel, [PITCH * k as f64, y], *legend);
        }
        y += height;
    }
    let [x, y] = if beside { [PITCH + LEFT, y - heights.last().copied().unwrap_or(0.0) + 44.0] } else { [16.0, y] };
    for (k, line) in notes.iter().enumerate() {
        picture.text(x, y + 10.0 + NOTE_LINE * k as f64, 11.0, Align::Start, "#666666", line);
    }
    picture
}

/// A note in lines that fit into `room` (px).
fn wrapped(note: &str, room: f64) -> Vec<String> {
    let most = (room / (0.56 * 11.0)) as usize;
    let mut lines: Vec<String> = Vec::new();
    for word in note.split(' ') {
        match lines.last_mut() {
            Some(line) if line.chars().count() + word.chars().count() < most => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

fn draw_panel(picture: &mut Picture, panel: &LogPanel, [x0, y0]: [f64; 2], legend: f64) {
    let (left, width) = (x0 + LEFT, PITCH - LEFT - RIGHT);
    let top = y0 + 26.0 + legend;
    picture.text(left, y0 + 12.0, 13.0, Align::Start, INK, &panel.title);
    draw_legend(picture, panel, left, y0 + 31.0);

    let shown = |points: &[[f64; 2]]| -> Vec<[f64; 2]> { points.iter().copied().filter(drawable).collect() };
    let all: Vec<[f64; 2]> = panel.curves.iter().flat_map(|c| shown(&c.points)).collect();
    let floor = panel.floor.as_ref().map(|(_, level)| *level).filter(|f| *f > 0.0);
    let x_axis = LogAxis::new(all.iter().map(|p| p[0]));
    let y_axis = LogAxis::new(all.iter().map(|p| p[1]).chain(floor));
    let to = |p: [f64; 2]| [left + width * x_axis.share(p[0]), top + PLOT_HEIGHT * (1.0 - y_axis.share(p[1]))];
    for value in x_axis.between() {
        let x = left + width * x_axis.share(value);
        picture.polyline(&[[x, top], [x, top + PLOT_HEIGHT]], Paint::line(FINE_GRID, 1.0));
    }
    for value in y_axis.between() {
        let y = top + PLOT_HEIGHT * (1.0 - y_axis.share(value));
        picture.polyline(&[[left, y], [left + width, y]], Paint::line(FINE_GRID, 1.0));
    }
    for (value, label) in x_axis.ticks() {
        let x = left + width * x_axis.share(value);
        picture.polyline(&[[x, top], [x, top + PLOT_HEIGHT]], Paint::line(GRID, 1.0));
        picture.text(x, top + PLOT_HEIGHT + 16.0, 11.0, Align::Middle, INK, &label);
    }
    for (value, label) in y_axis.ticks() {
        let y = top + PLOT_HEIGHT * (1.0 - y_axis.share(value));
        picture.polyline(&[[left, y], [left + width, y]], Paint::line(GRID, 1.0));
        picture.text(left - 7.0, y + 4.0, 11.0, Align::End, INK, &label);
    }
    for slope in &panel.slopes {
        draw_slope(picture, slope, (&x_axis, &y_axis), &to);
    }
    if let Some((name, level)) = panel.floor.as_ref().filter(|(_, level)| *level > 0.0) {
        let y = to([1.0, *level])[1];
        picture.polyline(&[[left, y], [left + width, y]], Paint::line("#999999", 1.0));
        picture.label(left + width - 5.0, y - 5.0, 10.0, Align::End, "#777777", name);
    }
    picture.rectangle(left, top, width, PLOT_HEIGHT, Paint::line("#888888", 1.0));
    for (k, curve) in panel.curves.iter().enumerate() {
        let points: Vec<[f64; 2]> = shown(&curve.points).into_iter().map(to).collect();
        picture.polyline(&points, Paint { opacity: 0.55, ..Paint::line(colour(k), 1.6) });
        for point in &points {
            mark(picture, k, *point, 4.2);
        }
        for (point, label) in curve.points.iter().zip(&curve.labels).filter(|(p, _)| drawable(p)) {
            let [x, y] = to(*point);
            let fits = x + 8.0 + LETTER * 10.0 * label.chars().count() as f64 <= left + width;
            let (x, align) = if fits { (x + 6.0, Align::Start) } else { (x - 6.0, Align::End) };
            picture.label(x, y - 7.0, 10.0, align, colour(k), label);
        }
    }
    picture.text(left + width / 2.0, top + PLOT_HEIGHT + 36.0, 12.0, Align::Middle, INK, &panel.x_name);
    // the vertical quantity stands at the right end of the title's line, where nothing turns heads
    picture.text(left + width, y0 + 12.0, 11.0, Align::End, "#666666", &panel.y_name);
}

fn draw_slope(
    picture: &mut Picture,
    slope: &Slope,
    (x_axis, y_axis): (&LogAxis, &LogAxis),
    to: &impl Fn([f64; 2]) -> [f64; 2],
) {
    let at = |x: f64| slope.through[1] * (x / slope.through[0]).powf(slope.exponent);
    // cut at the frame: the fraction of the way along x where y leaves it
    let inside = |x: f64| (y_axis.low..=y_axis.high).contains(&at(x).log10());
    let steps = 200;
    let xs: Vec<f64> = (0..=steps)
        .map(|k| 10f64.powf(x_axis.low + (x_axis.high - x_axis.low) * f64::from(k) / f64::from(steps)))
        .filter(|&x| inside(x))
        .collect();
    if let (Some(&first), Some(&last)) = (xs.first(), xs.last()) {
        let (a, b) = (to([first, at(first)]), to([last, at(last)]));
        picture.polyline(&[a, b], Paint { opacity: 0.8, ..Paint::line("#bbbbbb", 1.0) });
        picture.label(b[0] - 6.0, b[1] + 13.0, 11.0, Align::End, "#888888", &slope.name);
    }
}

fn draw_legend(picture: &mut Picture, panel: &LogPanel, left: f64, top: f64) {
    for (k, (x, line)) in legend_places(panel).into_iter().enumerate() {
        let (x, y) = (left + x, top + LEGEND_LINE * line as f64);
        picture.polyline(&[[x, y - 4.0], [x + 18.0, y - 4.0]], Paint { opacity: 0.55, ..Paint::line(colour(k), 1.6) });
        mark(picture, k, [x + 9.0, y - 4.0], 4.0);
        picture.text(x + 23.0, y, 11.0, Align::Start, INK, &panel.curves[k].name);
    }
}

/// Where each entry of the legend stands: offset from the left and line.
fn legend_places(panel: &LogPanel) -> Vec<(f64, usize)> {
    let (mut x, mut line) = (0.0, 0);
    let mut places = Vec::with_capacity(panel.curves.len());
    for curve in &panel.curves {
        let width = 23.0 + LETTER * 11.0 * curve.name.chars().count() as f64;
        if x > 0.0 && x + width > PITCH - LEFT - RIGHT {
            (x, line) = (0.0, line + 1);
        }
        places.push((x, line));
        x += width + 12.0;
    }
    places
}

fn legend_lines(panel: &LogPanel) -> usize {
    legend_places(panel).last().map_or(1, |p| p.1 + 1)
}

fn colour(k: usize) -> &'static str {
    PALETTE[k % PALETTE.len()]
}

/// The mark of the k-th curve: circle, square, triangle, diamond, ... in the curve's colour, so that curves can be
/// distinguished in print by shape and colour.
fn mark(picture: &mut Picture, k: usize, [x, y]: [f64; 2], r: f64) {
    let paint = Paint { fill: colour(k), stroke: "#ffffff", width: 0.7, opacity: 1.0 };
    match k % 5 {
        0 => picture.circle(x, y, r, paint),
        1 => picture.rectangle(x - 0.9 * r, y - 0.9 * r, 1.8 * r, 1.8 * r, paint),
        2 => picture.polygon(&[[x, y - 1.2 * r], [x + 1.1 * r, y + 0.8 * r], [x - 1.1 * r, y + 0.8 * r]], paint),
        3 => picture.polygon(&[[x, y - 1.25 * r], [x + 1.25 * r, y], [x, y + 1.25 * r], [x - 1.25 * r, y]], paint),
        _ => picture.polygon(&[[x, y + 1.2 * r], [x + 1.1 * r, y - 0.8 * r], [x - 1.1 * r, y - 0.8 * r]], paint),
    }
}

fn drawable(p: &[f64; 2]) -> bool {
    p.iter().all(|v| v.is_finite() && *v > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values that have no logarithm are left out, and a chart of nothing is still a chart.
    #[test]
    fn nothing_to_draw() {
        let curve =
            LogCurve { name: "<a>".into(), points: vec![[0.0, 1.0], [1.0, f64::NAN], [-1.0, 2.0]], labels: vec![] };
        let panel = LogPanel {
            title: "t".into(),
            x_name: "x".into(),
            y_name: "y".into(),
            curves: vec![curve],
            floor: None,
            slopes: vec![],
        };
        let svg = draw(&LogChart { title: "c".into(), panels: vec![panel], notes: vec!["n".into()] }).to_svg();
        assert!(svg.contains("&lt;a&gt;") && !svg.contains("NaN"));
    }

    /// A legend that is wider than its panel continues in the next line.
    #[test]
    fn long_legends_wrap() {
        let curves = (0..7)
            .map(|k| LogCurve { name: format!("generalized-alpha {k}"), points: vec![], labels: vec![] })
            .collect();
        let panel = LogPanel {
            title: String::new(),
            x_name: String::new(),
            y_name: String::new(),
            curves,
            floor: None,
            slopes: vec![],
        };
        assert!(legend_lines(&panel) >= 3);
        assert!(legend_places(&panel).iter().all(|(x, _)| *x < PITCH - LEFT - RIGHT));
    }
}
