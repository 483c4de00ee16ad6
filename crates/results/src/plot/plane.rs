//! Curves in a plane: a load against a displacement, or the track of a point, on request to one scale.

use super::PALETTE;
use super::axis::{Axis, axis, quantity};
use super::chart::WIDTH;
use super::labels::LabelPlaces;
use super::svg::{Align, Paint, Picture};

/// One curve.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaneCurve {
    /// Name in the legend.
    pub name: String,
    /// Points in SI, in the order in which they are joined.
    pub points: Vec<[f64; 2]>,
    /// Which points the curve reaches with a dashed line; empty: none.
    pub dashed: Vec<bool>,
}

/// Meaning of a mark.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sign {
    /// A filled circle.
    Dot,
    /// An open square.
    Square,
}

/// A marked point with a word beside it.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaneMark {
    /// Where, in SI.
    pub at: [f64; 2],
    /// Its shape.
    pub sign: Sign,
    /// The word; empty: none.
    pub word: String,
}

/// Curves over two quantities.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaneChart {
    /// Line above the curves.
    pub title: String,
    /// Name and SI unit of the horizontal quantity.
    pub x: [String; 2],
    /// Name and SI unit of the vertical quantity.
    pub y: [String; 2],
    /// The curves.
    pub curves: Vec<PlaneCurve>,
    /// Marks.
    pub marks: Vec<PlaneMark>,
    /// One scale for both axes.
    pub equal: bool,
    /// A line of explanation below; empty: none.
    pub note: String,
}

const LEFT: f64 = 92.0;
const RIGHT: f64 = 34.0;
const TOP: f64 = 66.0;
const INK: &str = "#333333";
/// Length of a dash and of the space after it (px).
const DASH: [f64; 2] = [7.0, 5.0];

/// Draws the plane.
pub fn draw(plane: &PlaneChart) -> Picture {
    let width = WIDTH - LEFT - RIGHT;
    let (x_axis, y_axis, height) = axes(plane, width);
    let foot = if plane.note.is_empty() { 52.0 } else { 72.0 };
    let mut picture = Picture::new(WIDTH, TOP + height + foot);
    let at = |p: [f64; 2]| {
        let x = LEFT + width * (p[0] - x_axis.low) / (x_axis.high - x_axis.low);
        [x, TOP + height * (y_axis.high - p[1]) / (y_axis.high - y_axis.low)]
    };
    picture.text(LEFT, 24.0, 15.0, Align::Start, INK, &plane.title);
    grid(&mut picture, plane, &x_axis, &y_axis, [width, height]);
    legend(&mut picture, plane, LEFT + width);
    for (i, curve) in plane.curves.iter().enumerate() {
        draw_curve(&mut picture, curve, PALETTE[i % PALETTE.len()], &at);
    }
    let mut places = LabelPlaces::new([LEFT, TOP, LEFT + width, TOP + height]);
    plane.marks.iter().for_each(|mark| places.keep_free(at(mark.at), 6.0));
    for curve in &plane.curves {
        places.avoid(&curve.points.iter().map(|p| at(*p)).collect::<Vec<_>>());
    }
    for mark in &plane.marks {
        let [x, y] = at(mark.at);
        match mark.sign {
            Sign::Dot => picture.circle(x, y, 4.5, Paint { fill: INK, stroke: "#ffffff", width: 1.5, opacity: 1.0 }),
            Sign::Square => picture.rectangle(
                x - 4.5,
                y - 4.5,
                9.0,
                9.0,
                Paint { fill: "#ffffff", stroke: INK, width: 1.8, opacity: 1.0 },
            ),
        }
        if mark.word.is_empty() {
            continue;
        }
        if let Some(place) = places.place([x, y], 12.0, &mark.word) {
            picture.label(place.x, place.y, 12.0, place.align, INK, &mark.word);
        }
    }
    if !plane.note.is_empty() {
        picture.text(LEFT, TOP + height + 58.0, 11.0, Align::Start, "#666666", &plane.note);
    }
    picture
}

/// Both axes, and the height of the frame (px).
fn axes(plane: &PlaneChart, width: f64) -> (Axis, Axis, f64) {
    let range = |i: usize| {
        let all = plane.curves.iter().flat_map(|c| c.points.iter().map(|p| p[i])).filter(|v| v.is_finite());
        all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
    };
    let (x, y) = (range(0), range(1));
    if !plane.equal {
        return (axis(x.0, x.1, &plane.x[1], 8, true), axis(y.0, y.1, &plane.y[1], 6, true), 380.0);
    }
    let span = |(low, high): (f64, f64)| 1.12 * (high - low).max(f64::MIN_POSITIVE);
    let scale = (width / span(x)).min(560.0 / span(y));
    let height = (span(y) * scale).max(160.0);
    let around = |(low, high): (f64, f64), pixels: f64| {
        let (middle, half) = (f64::midpoint(low, high), 0.5 * pixels / scale);
        (middle - half, middle + half)
    };
    let (x, y) = (around(x, width), around(y, height));
    (axis(x.0, x.1, &plane.x[1], 9, false), axis(y.0, y.1, &plane.y[1], (height / 60.0) as usize, false), height)
}

fn grid(picture: &mut Picture, plane: &PlaneChart, x_axis: &Axis, y_axis: &Axis, [width, height]: [f64; 2]) {
    for (value, label) in &y_axis.ticks {
        let y = TOP + height * (y_axis.high - value) / (y_axis.high - y_axis.low);
        let line = if *value == 0.0 { "#b0b0b0" } else { "#e4e4e4" };
        picture.polyline(&[[LEFT, y], [LEFT + width, y]], Paint::line(line, 1.0));
        picture.text(LEFT - 7.0, y + 4.0, 11.0, Align::End, INK, label);
    }
    for (value, label) in &x_axis.ticks {
        let x = LEFT + width * (value - x_axis.low) / (x_axis.high - x_axis.low);
        let line = if *value == 0.0 { "#b0b0b0" } else { "#e4e4e4" };
        picture.polyline(&[[x, TOP], [x, TOP + height]], Paint::line(line, 1.0));
        picture.text(x, TOP + height + 16.0, 11.0, Align::Middle, INK, label);
    }
    picture.rectangle(LEFT, TOP, width, height, Paint::line("#888888", 1.0));
    let named = |name: &str, unit: &str| if unit.is_empty() { name.to_owned() } else { format!("{name} [{unit}]") };
    let (x_name, y_name) = (named(&plane.x[0], &x_axis.unit), named(&plane.y[0], &y_axis.unit));
    picture.text(LEFT + width / 2.0, TOP + height + 36.0, 12.0, Align::Middle, INK, &x_name);
    picture.text(LEFT, TOP - 8.0, 12.0, Align::Start, INK, &y_name);
}

fn legend(picture: &mut Picture, plane: &PlaneChart, right: f64) {
    if plane.curves.len() < 2 {
        return;
    }
    let mut x = right;
    for (i, curve) in plane.curves.iter().enumerate().rev() {
        picture.text(x, TOP - 8.0, 11.0, Align::End, INK, &curve.name);
        x -= 6.2 * curve.name.chars().count() as f64 + 6.0;
        picture.polyline(&[[x - 18.0, TOP - 12.0], [x, TOP - 12.0]], Paint::line(PALETTE[i % PALETTE.len()], 2.5));
        x -= 32.0;
    }
}

/// Solid and dashed runs of a curve.
fn draw_curve(picture: &mut Picture, curve: &PlaneCurve, colour: &str, at: &impl Fn([f64; 2]) -> [f64; 2]) {
    let dashed = |k: usize| curve.dashed.get(k).copied().unwrap_or(false);
    let mut k = 1;
    while k < curve.points.len() {
        let kind = dashed(k);
        let mut run = vec![at(curve.points[k - 1])];
        while k < curve.points.len() && dashed(k) == kind {
            run.push(at(curve.points[k]));
            k += 1;
        }
        if kind {
            for dash in dashes(&run) {
                picture.polyline(&dash, Paint::line(colour, 1.8));
            }
        } else {
            picture.polyline(&run, Paint::line(colour, 1.8));
        }
    }
}

/// Cuts a line into dashes.
fn dashes(line: &[[f64; 2]]) -> Vec<Vec<[f64; 2]>> {
    let (mut list, mut dash) = (Vec::new(), vec![line[0]]);
    let (mut drawn, mut left) = (true, DASH[0]);
    for pair in line.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        let length = (to[0] - from[0]).hypot(to[1] - from[1]);
        let mut done = 0.0;
        while length - done > left {
            done += left;
            let share = done / length;
            let point = [from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1])];
            if drawn {
                dash.push(point);
                list.push(std::mem::take(&mut dash));
            } else {
                dash = vec![point];
            }
            drawn = !drawn;
            left = DASH[usize::from(!drawn)];
        }
        left -= length - done;
        if drawn {
            dash.push(to);
        }
    }
    list.extend((dash.len() > 1).then_some(dash));
    list
}

/// Label of a mark: "pull-in at 17.9 V".
pub fn word(what: &str, value: f64, unit: &str) -> String {
    format!("{what} at {}", quantity(value, unit))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With one scale a square track is drawn as a square.
    #[test]
    fn one_scale() {
        let square = vec![[0.0, 0.0], [1e-6, 0.0], [1e-6, 1e-6], [0.0, 1e-6]];
        let curve = PlaneCurve { name: "a".into(), points: square, dashed: vec![] };
        let names = || ["x".to_owned(), "m".to_owned()];
        let plane = PlaneChart {
            title: "t".into(),
            x: names(),
            y: names(),
            curves: vec![curve],
            marks: vec![],
            equal: true,
            note: String::new(),
        };
        let width = WIDTH - LEFT - RIGHT;
        let (x, y, height) = axes(&plane, width);
        approx::assert_relative_eq!(width / (x.high - x.low), height / (y.high - y.low), max_relative = 1e-12);
    }

    /// Dashes cover 7/12 of a long line, whatever its corners.
    #[test]
    fn dashes_have_their_length() {
        let line: Vec<[f64; 2]> = (0..=100).map(|k| [f64::from(k) * 3.0, if k % 2 == 0 { 0.0 } else { 4.0 }]).collect();
        let length: f64 = dashes(&line)
            .iter()
            .flat_map(|d| d.windows(2).map(|p| (p[1][0] - p[0][0]).hypot(p[1][1] - p[0][1])).collect::<Vec<_>>())
            .sum();
        assert!((length / 500.0 - 7.0 / 12.0).abs() < 0.02, "{length}");
    }
}
