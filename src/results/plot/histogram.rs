//! Histograms, with the limits that values must keep to.

use super::PALETTE;
use super::axis::axis;
use super::chart::WIDTH;
use super::svg::{Align, Paint, Picture};

/// A histogram of one quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct Histogram {
    /// Line above it.
    pub title: String,
    /// Name and SI unit of the quantity.
    pub quantity: [String; 2],
    /// Edges of the bins, ascending, one more than bins.
    pub edges: Vec<f64>,
    /// Values in each bin.
    pub counts: Vec<usize>,
    /// Limits, in the unit of the quantity.
    pub limits: Vec<f64>,
}

const LEFT: f64 = 92.0;
const RIGHT: f64 = 34.0;
const TOP: f64 = 42.0;
const HEIGHT: f64 = 220.0;
const INK: &str = "#333333";

/// Draws it.
pub fn draw(histogram: &Histogram) -> Picture {
    let width = WIDTH - LEFT - RIGHT;
    let mut picture = Picture::new(WIDTH, TOP + HEIGHT + 52.0);
    if histogram.edges.is_empty() {
        picture.text(LEFT, 24.0, 15.0, Align::Start, INK, &histogram.title);
        picture.text(LEFT + width / 2.0, TOP + HEIGHT / 2.0, 12.0, Align::Middle, INK, "no point has a value");
        return picture;
    }
    let ends = histogram.edges.iter().chain(&histogram.limits).filter(|value| value.is_finite());
    let (low, high) =
        ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(*value), high.max(*value)));
    let [name, unit] = &histogram.quantity;
    let x_axis = axis(low, high, unit, 8, true);
    let most = histogram.counts.iter().copied().max().unwrap_or(0).max(1) as f64;
    let y_axis = axis(0.0, 1.05 * most, "", 5, false);
    let to_x = |x: f64| LEFT + width * (x - x_axis.low) / (x_axis.high - x_axis.low);
    let to_y = |y: f64| TOP + HEIGHT * (y_axis.high - y) / (y_axis.high - y_axis.low);
    picture.text(LEFT, 24.0, 15.0, Align::Start, INK, &histogram.title);
    for (value, label) in &y_axis.ticks {
        let y = to_y(*value);
        picture.polyline(&[[LEFT, y], [LEFT + width, y]], Paint::line("#e4e4e4", 1.0));
        picture.text(LEFT - 7.0, y + 4.0, 11.0, Align::End, INK, label);
    }
    for (value, label) in &x_axis.ticks {
        picture.text(to_x(*value), TOP + HEIGHT + 16.0, 11.0, Align::Middle, INK, label);
    }
    for (ends, count) in histogram.edges.windows(2).zip(&histogram.counts) {
        let (left, right, top) = (to_x(ends[0]), to_x(ends[1]), to_y(*count as f64));
        let paint = Paint { fill: PALETTE[0], stroke: "#ffffff", width: 0.6, opacity: 0.85 };
        picture.rectangle(left, top, right - left, TOP + HEIGHT - top, paint);
    }
    for limit in &histogram.limits {
        picture.polyline(&[[to_x(*limit), TOP], [to_x(*limit), TOP + HEIGHT]], Paint::line(PALETTE[1], 2.0));
    }
    picture.rectangle(LEFT, TOP, width, HEIGHT, Paint::line("#888888", 1.0));
    let text = if x_axis.unit.is_empty() { name.clone() } else { format!("{name} [{}]", x_axis.unit) };
    picture.text(LEFT + width / 2.0, TOP + HEIGHT + 36.0, 12.0, Align::Middle, INK, &text);
    picture.text(LEFT, TOP - 6.0, 12.0, Align::Start, INK, "points");
    picture
}
