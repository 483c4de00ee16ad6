//! Line charts as SVG, with linear or logarithmic axes.

use std::fmt::Write;

/// One axis.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Axis {
    /// Label, with its unit.
    pub(crate) label: &'static str,
    /// Decades instead of equal steps.
    pub(crate) log: bool,
    /// Both ends; none: from the points.
    pub(crate) range: Option<[f64; 2]>,
}

/// A line, or dots.
#[derive(Debug, Clone)]
pub(crate) struct Series {
    /// Name beside it.
    pub(crate) name: String,
    /// Colour of [`COLOURS`].
    pub(crate) colour: usize,
    /// Dots on the line.
    pub(crate) dots: bool,
    /// Dashed.
    pub(crate) dashed: bool,
    /// (x, y).
    pub(crate) points: Vec<[f64; 2]>,
}

/// Ours, failing, third, fourth.
const COLOURS: [&str; 4] = ["#1f6feb", "#d1242f", "#9a6700", "#57606a"];
/// Size of a chart, and its margins.
const WIDTH: f64 = 460.0;
const HEIGHT: f64 = 320.0;
const LEFT: f64 = 68.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 34.0;
const BOTTOM: f64 = 48.0;

/// One chart of a picture.
#[derive(Debug, Clone)]
pub(crate) struct Chart {
    /// Above it.
    pub(crate) title: &'static str,
    /// Across.
    pub(crate) x: Axis,
    /// Up.
    pub(crate) y: Axis,
    /// Lines.
    pub(crate) series: Vec<Series>,
}

/// Values to axis shares and back to labels.
struct Scale {
    low: f64,
    high: f64,
    log: bool,
}

impl Scale {
    fn new(axis: &Axis, values: impl Iterator<Item = f64>) -> Self {
        let wanted = |v: &f64| v.is_finite() && (!axis.log || *v > 0.0);
        let [mut low, mut high] = axis.range.unwrap_or_else(|| {
            values.filter(wanted).fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [a.min(v), b.max(v)])
        });
        if axis.log {
            (low, high) = (low.log10().floor(), high.log10().ceil().max(low.log10().floor() + 1.0));
        } else if axis.range.is_none() {
            let pad = 0.05 * (high - low).max(1e-300);
            (low, high) = (low - pad, high + pad);
        }
        Self { low, high, log: axis.log }
    }

    fn share(&self, v: f64) -> f64 {
        let v = if self.log { v.max(1e-300).log10() } else { v };
        ((v - self.low) / (self.high - self.low)).clamp(-0.02, 1.02)
    }

    fn ticks(&self) -> Vec<(f64, String)> {
        if self.log {
            let step = ((self.high - self.low) / 7.0).ceil().max(1.0);
            let count = ((self.high - self.low) / step).floor() as usize;
            return (0..=count)
                .map(|k| self.low + step * k as f64)
                .map(|e| (10f64.powf(e), format!("10<tspan dy=\"-4\" font-size=\"8\">{e}</tspan>")))
                .collect();
        }
        let raw = (self.high - self.low) / 5.0;
        let ten = 10f64.powf(raw.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * ten).into_iter().find(|&s| s >= raw).unwrap_or(10.0 * ten);
        let digits = (-step.log10().floor()).max(0.0) as usize;
        let first = (self.low / step).ceil() as i64;
        (first..)
            .map(|k| k as f64 * step)
            .take_while(|&v| v <= self.high + 1e-9 * step)
            .map(|v| (v, format!("{:.digits$}", v + 0.0)))
            .collect()
    }
}

/// Charts in a row.
pub(crate) fn picture(charts: &[Chart]) -> String {
    let width = WIDTH * charts.len() as f64;
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {HEIGHT}\" width=\"{width}\" height=\"{HEIGHT}\" \
         font-family=\"DejaVu Sans, Arial, sans-serif\" font-size=\"11\">\n<rect width=\"{width}\" height=\"{HEIGHT}\" fill=\"white\"/>\n"
    );
    for (k, chart) in charts.iter().enumerate() {
        draw(&mut out, chart, WIDTH * k as f64);
    }
    out + "</svg>\n"
}

fn draw(out: &mut String, chart: &Chart, left: f64) {
    let all = || chart.series.iter().flat_map(|s| &s.points);
    let (sx, sy) = (Scale::new(&chart.x, all().map(|p| p[0])), Scale::new(&chart.y, all().map(|p| p[1])));
    let (w, h) = (WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM);
    let x = |v: f64| left + LEFT + w * sx.share(v);
    let y = |v: f64| TOP + h * (1.0 - sy.share(v));
    let mut put = |text: String| {
        let _ = writeln!(out, "{text}");
    };
    let (x0, y0, x1) = (left + LEFT, TOP + h, left + LEFT + w);
    put(format!(
        "<text x=\"{:.1}\" y=\"18\" font-size=\"13\" text-anchor=\"middle\">{}</text>",
        x0 + 0.5 * w,
        chart.title
    ));
    for (v, label) in sx.ticks() {
        put(format!(
            "<path d=\"M{0:.1} {TOP}V{y0}\" stroke=\"#e5e7eb\"/><text x=\"{0:.1}\" y=\"{1}\" text-anchor=\"middle\">{label}</text>",
            x(v),
            y0 + 16.0
        ));
    }
    for (v, label) in sy.ticks() {
        put(format!(
            "<path d=\"M{x0} {0:.1}H{x1}\" stroke=\"#e5e7eb\"/><text x=\"{1}\" y=\"{2:.1}\" text-anchor=\"end\">{label}</text>",
            y(v),
            x0 - 6.0,
            y(v) + 4.0
        ));
    }
    put(format!("<path d=\"M{x0} {TOP}H{x1}V{y0}H{x0}Z\" fill=\"none\" stroke=\"#57606a\"/>"));
    put(format!(
        "<text x=\"{:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>",
        x0 + 0.5 * w,
        HEIGHT - 10.0,
        chart.x.label
    ));
    let (lx, ly) = (left + 14.0, TOP + 0.5 * h);
    put(format!(
        "<text x=\"{lx}\" y=\"{ly}\" text-anchor=\"middle\" transform=\"rotate(-90 {lx} {ly})\">{}</text>",
        chart.y.label
    ));
    for (k, series) in chart.series.iter().enumerate() {
        let colour = COLOURS[series.colour];
        let dash = if series.dashed { " stroke-dasharray=\"5 4\"" } else { "" };
        let mut path = String::new();
        let mut pen = 'M';
        for p in thinned(&series.points) {
            if p[0].is_finite() && p[1].is_finite() {
                let _ = write!(path, "{pen}{:.1} {:.1}", x(p[0]), y(p[1]));
                pen = 'L';
                if series.dots {
                    put(format!("<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"2.6\" fill=\"{colour}\"/>", x(p[0]), y(p[1])));
                }
            } else {
                pen = 'M';
            }
        }
        put(format!("<path d=\"{path}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.5\"{dash}/>"));
        let ky = TOP + 16.0 + 15.0 * k as f64;
        put(format!(
            "<path d=\"M{} {}h18\" stroke=\"{colour}\" stroke-width=\"2\"{dash}/><text x=\"{}\" y=\"{ky}\" stroke=\"white\" stroke-width=\"3\" paint-order=\"stroke\">{}</text>",
            x0 + 10.0,
            ky - 4.0,
            x0 + 33.0,
            series.name
        ));
    }
}

/// At most about 400 points, the last one kept.
fn thinned(points: &[[f64; 2]]) -> impl Iterator<Item = &[f64; 2]> {
    let step = points.len() / 400 + 1;
    let last = points.len().saturating_sub(1);
    points.iter().enumerate().filter(move |(k, _)| k % step == 0 || *k == last).map(|(_, p)| p)
}
