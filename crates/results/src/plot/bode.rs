//! Bode pictures: magnitudes over frequency, a panel for each unit, and phases below them.
//!
//! H. W. Bode, "Network Analysis and Feedback Amplifier Design" (1945): magnitude on a logarithmic axis, phase in
//! degrees, over the logarithm of the frequency. Phases are continuous past half a turn; unbounded values are gaps of a
//! curve.

use super::PALETTE;
use super::axis::{axis, quantity};
use super::chart::{WIDTH, thin_out, word};
use super::labels::LabelPlaces;
use super::log_axis::LogAxis;
use super::svg::{Align, Paint, Picture};

/// A curve.
#[derive(Debug, Clone, PartialEq)]
pub struct BodeCurve {
    /// Name in the legend.
    pub name: String,
    /// Unit over that of the drive.
    pub unit: String,
    /// Values [re, im], as many as there are frequencies.
    pub values: Vec<[f64; 2]>,
}

/// A resonance, which is marked on the curves that show it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodeResonance {
    /// Frequency (Hz).
    pub frequency: f64,
    /// Quality (1); none: undamped.
    pub quality: Option<f64>,
}

/// How magnitudes are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Magnitude {
    /// In their unit, on a logarithmic axis.
    Units,
    /// In decibels of their unit.
    Decibels,
}

/// Content of a Bode picture.
#[derive(Debug, Clone, PartialEq)]
pub struct BodeChart {
    /// Line above the panels.
    pub title: String,
    /// Frequencies (Hz), ascending.
    pub frequencies: Vec<f64>,
    /// The axis of frequencies is linear.
    pub linear: bool,
    /// How magnitudes are drawn.
    pub magnitude: Magnitude,
    /// The curves.
    pub curves: Vec<BodeCurve>,
    /// Resonances to mark.
    pub resonances: Vec<BodeResonance>,
}

const LEFT: f64 = 92.0;
const RIGHT: f64 = 24.0;
const HEIGHT: f64 = 230.0;
const LOW: f64 = 150.0;
const PITCH: f64 = 40.0;
const TOP: f64 = 58.0;
const INK: &str = "#333333";
const FAINT: &str = "#e4e4e4";
/// Curves shown.
const MAX_CURVES: usize = 7;
/// Decades of magnitude shown below the largest.
const DECADES: f64 = 14.0;
/// Resonances marked on a panel.
const MAX_MARKED: usize = 6;
/// Peaks that are closer than this are marked once (px).
const APART: f64 = 8.0;
/// A curve shows a resonance where it exceeds its values at a width to both sides by this factor.
const SHOWS: f64 = 1.05;

/// Ticks of an axis at fractions of its length, with fine lines without labels.
struct AxisScale {
    ticks: Vec<(f64, String)>,
    fine: Vec<f64>,
}

/// Draws the curves.
pub fn draw(chart: &BodeChart) -> Picture {
    let BodeChart { title, frequencies, linear, curves, .. } = chart;
    let (frequencies, linear) = (frequencies.as_slice(), *linear);
    let shown = &curves[..curves.len().min(MAX_CURVES)];
    let mut units: Vec<&str> = Vec::new();
    for curve in shown {
        if !units.contains(&curve.unit.as_str()) {
            units.push(&curve.unit);
        }
    }
    let height = TOP + units.len() as f64 * (HEIGHT + PITCH) + LOW + 46.0;
    let mut picture = Picture::new(WIDTH, height);
    picture.text(LEFT, 24.0, 15.0, Align::Start, INK, title);
    if shown.len() < curves.len() {
        let note = format!("{} of {} curves", shown.len(), curves.len());
        picture.text(WIDTH - RIGHT, 24.0, 11.0, Align::End, "#888888", &note);
    }
    let (low, high) = (frequencies.first().copied().unwrap_or(1.0), frequencies.last().copied().unwrap_or(10.0));
    let decades = !linear && high / low > 3.0;
    let (log, plain) = (LogAxis { low: low.log10(), high: high.log10() }, axis(low, high, "Hz", 8, false));
    let share = |f: f64| if decades { log.share(f) } else { (f - plain.low) / (plain.high - plain.low) };
    let x_scale = match decades {
        true => AxisScale {
            ticks: log.ticks().into_iter().map(|(f, label)| (share(f), label)).collect(),
            fine: log.between().into_iter().map(share).collect(),
        },
        false => {
            AxisScale { ticks: plain.ticks.iter().map(|(f, l)| (share(*f), l.clone())).collect(), fine: Vec::new() }
        }
    };
    let unit = if decades { "Hz" } else { plain.unit.as_str() };
    let width = WIDTH - LEFT - RIGHT;
    let to_x = |f: f64| LEFT + width * share(f);
    let mut top = TOP;
    for unit in units {
        let own: Vec<usize> = (0..shown.len()).filter(|k| shown[*k].unit == unit).collect();
        let size = |[re, im]: &[f64; 2]| re.hypot(*im);
        let all = || own.iter().flat_map(|k| shown[*k].values.iter().map(size)).filter(|v| *v > 0.0 && v.is_finite());
        let most = all().fold(0.0, f64::max);
        let mut y = LogAxis::new(all().filter(|v| *v > most * 10f64.powf(-DECADES)));
        y.low = y.low.max(y.high - DECADES - 1.0);
        let (scale, shown_unit) = match chart.magnitude {
            Magnitude::Units => (units_scale(&y), unit.to_owned()),
            Magnitude::Decibels => (decibel_scale(&y), format!("dB {unit}").trim_end().to_owned()),
        };
        panel(&mut picture, [top, HEIGHT], &x_scale, &scale, None);
        picture.text(LEFT, top - 6.0, 12.0, Align::Start, INK, &format!("{} [{shown_unit}]", named(unit)));
        legend(&mut picture, top, &own.iter().map(|k| (*k, shown[*k].name.as_str())).collect::<Vec<_>>());
        let to_y = |v: f64| top + HEIGHT * (1.0 - y.share(v).clamp(0.0, 1.0));
        for k in own {
            let sizes: Vec<f64> = shown[k].values.iter().map(size).collect();
            let usable: Vec<f64> = sizes.iter().map(|v| if *v > 0.0 { *v } else { f64::NAN }).collect();
            curve(&mut picture, k, frequencies, &usable, to_x, to_y);
        }
        let sizes: Vec<Vec<f64>> =
            (shown.iter().filter(|c| c.unit == unit)).map(|c| c.values.iter().map(size).collect()).collect();
        mark_resonances(&mut picture, chart, &sizes, top, (&to_x, &to_y));
        top += HEIGHT + PITCH;
    }
    let phases: Vec<Vec<f64>> = shown.iter().map(|c| unwrapped(&c.values)).collect();
    let finite = || phases.iter().flatten().copied().filter(|p| p.is_finite());
    let lowest = (finite().fold(0.0, f64::min) / 90.0).floor() * 90.0;
    let highest = (finite().fold(0.0, f64::max) / 90.0).ceil() * 90.0;
    let (lowest, highest) = if lowest < highest { (lowest, highest) } else { (-90.0, 90.0) };
    let step = if highest - lowest > 720.0 { 180.0 * ((highest - lowest) / 1080.0).ceil() } else { 90.0 };
    let count = ((highest - lowest) / step) as usize;
    let ticks = (0..=count).map(|k| lowest + step * k as f64);
    let scale = AxisScale {
        ticks: ticks.map(|p| ((p - lowest) / (highest - lowest), format!("{p:.0}"))).collect(),
        fine: Vec::new(),
    };
    panel(&mut picture, [top, LOW], &x_scale, &scale, Some(&format!("frequency [{unit}]")));
    picture.text(LEFT, top - 6.0, 12.0, Align::Start, INK, "phase [°]");
    let room = 0.03 * (highest - lowest);
    let to_y = |p: f64| top + LOW * (highest + room - p) / (highest - lowest + 2.0 * room);
    for (k, phase) in phases.iter().enumerate() {
        curve(&mut picture, k, frequencies, phase, to_x, to_y);
    }
    picture
}

/// Ticks of a magnitude in its unit.
fn units_scale(y: &LogAxis) -> AxisScale {
    AxisScale { ticks: y.ticks().into_iter().map(|(v, label)| (y.share(v), label)).collect(), fine: Vec::new() }
}

/// Ticks of a magnitude in decibels, at round numbers of them.
fn decibel_scale(y: &LogAxis) -> AxisScale {
    let (low, high) = (20.0 * y.low, 20.0 * y.high);
    let plain = axis(low, high, "", 7, false);
    let ticks = plain.ticks.iter().map(|(v, label)| ((v - low) / (high - low), label.clone())).collect();
    AxisScale { ticks, fine: Vec::new() }
}

/// Marks the resonances that a curve shows as peaks, each once, on the curve where it is highest.
fn mark_resonances(
    picture: &mut Picture,
    chart: &BodeChart,
    sizes: &[Vec<f64>],
    top: f64,
    (to_x, to_y): (&impl Fn(f64) -> f64, &impl Fn(f64) -> f64),
) {
    let f = &chart.frequencies;
    let mut places = LabelPlaces::new([LEFT, top, WIDTH - RIGHT, top + HEIGHT]).close();
    for sizes in sizes {
        let line = f.iter().zip(sizes).filter(|(_, s)| s.is_finite() && **s > 0.0);
        places.avoid(&line.map(|(f, s)| [to_x(*f), to_y(*s)]).collect::<Vec<_>>());
    }
    let nearest = |at: f64| {
        let after = f.partition_point(|f| *f < at).min(f.len() - 1);
        if after > 0 && at - f[after - 1] < f[after] - at { after - 1 } else { after }
    };
    let seen = |at: f64, quality: Option<f64>| {
        let (k, width) = (nearest(at), (at / quality.unwrap_or(f64::INFINITY)).max(0.01 * at));
        let sides = [nearest(at - width), nearest(at + width)];
        let peak = |s: &Vec<f64>| {
            let shows = s[k].is_finite() && sides.iter().all(|&side| side != k && s[k] > SHOWS * s[side]);
            shows.then_some((k, s[k]))
        };
        sizes.iter().filter_map(peak).max_by(|a, b| a.1.total_cmp(&b.1))
    };
    let inside = |r: &&BodeResonance| !f.is_empty() && (f[0]..=f[f.len() - 1]).contains(&r.frequency);
    let found = chart.resonances.iter().filter(inside).filter_map(|r| Some((r, seen(r.frequency, r.quality)?)));
    let mut highest: Vec<(&BodeResonance, (usize, f64))> = found.collect();
    highest.sort_by(|a, b| b.1.1.total_cmp(&a.1.1));
    let mut marked: Vec<f64> = Vec::new();
    for (resonance, (k, height)) in highest {
        let at = [to_x(f[k]), to_y(height)];
        if marked.len() == MAX_MARKED || marked.iter().any(|x| (x - at[0]).abs() < APART) {
            continue;
        }
        marked.push(at[0]);
        picture.circle(at[0], at[1], 3.0, Paint { fill: INK, stroke: "#ffffff", width: 1.0, opacity: 1.0 });
        places.keep_free(at, 4.0);
        let q = resonance.quality.map_or(String::new(), |q| format!(", Q {}", quantity(q, "")));
        let text = quantity(resonance.frequency, "Hz") + &q;
        if let Some(place) = places.place(at, 11.0, &text) {
            picture.label(place.x, place.y, 11.0, place.align, INK, &text);
        }
    }
}

/// Name of the quantity of a quotient of units.
fn named(unit: &str) -> String {
    let own = if unit.starts_with("m/s/") {
        "m/s"
    } else if unit.starts_with("rad/s/") {
        "rad/s"
    } else {
        unit.split('/').next().unwrap_or("")
    };
    word(own).to_owned()
}

fn panel(picture: &mut Picture, [top, height]: [f64; 2], x: &AxisScale, y: &AxisScale, below: Option<&str>) {
    let width = WIDTH - LEFT - RIGHT;
    for share in x.fine.iter().filter(|s| (0.0..=1.0).contains(*s)) {
        let x = LEFT + width * share;
        picture.polyline(&[[x, top], [x, top + height]], Paint::line("#f2f2f2", 1.0));
    }
    for (share, label) in x.ticks.iter().filter(|(s, _)| (0.0..=1.0).contains(s)) {
        let x = LEFT + width * share;
        picture.polyline(&[[x, top], [x, top + height]], Paint::line(FAINT, 1.0));
        if below.is_some() {
            picture.text(x, top + height + 16.0, 11.0, Align::Middle, INK, label);
        }
    }
    let inset = if below.is_some() { 0.03 / 1.06 } else { 0.0 };
    for (share, label) in &y.ticks {
        let y = top + height * (1.0 - inset - share * (1.0 - 2.0 * inset));
        picture.polyline(&[[LEFT, y], [LEFT + width, y]], Paint::line(FAINT, 1.0));
        picture.text(LEFT - 7.0, y + 4.0, 11.0, Align::End, INK, label);
    }
    picture.rectangle(LEFT, top, width, height, Paint::line("#888888", 1.0));
    if let Some(text) = below {
        picture.text(LEFT + width / 2.0, top + height + 34.0, 12.0, Align::Middle, INK, text);
    }
}

fn legend(picture: &mut Picture, top: f64, names: &[(usize, &str)]) {
    let mut right = WIDTH - RIGHT;
    for (k, name) in names.iter().rev() {
        picture.text(right, top - 6.0, 11.0, Align::End, INK, name);
        right -= 7.0 * name.chars().count() as f64 + 6.0;
        picture
            .polyline(&[[right - 16.0, top - 10.0], [right, top - 10.0]], Paint::line(PALETTE[k % PALETTE.len()], 2.5));
        right -= 28.0;
    }
}

/// One curve, in pieces where it has no value.
fn curve(
    picture: &mut Picture,
    k: usize,
    x: &[f64],
    y: &[f64],
    to_x: impl Fn(f64) -> f64 + Copy,
    to_y: impl Fn(f64) -> f64 + Copy,
) {
    let mut begin = 0;
    for end in 0..=y.len() {
        if end < y.len() && y[end].is_finite() {
            continue;
        }
        if end > begin + 1 {
            let points = thin_out(&x[begin..end], &y[begin..end], to_x, to_y);
            picture.polyline(&points, Paint::line(PALETTE[k % PALETTE.len()], 1.5));
        }
        begin = end + 1;
    }
}

/// Phases (°), continuous past half a turn, from between −180 and 180.
fn unwrapped(values: &[[f64; 2]]) -> Vec<f64> {
    let mut last: Option<f64> = None;
    let one = |[re, im]: &[f64; 2]| {
        if !re.is_finite() || !im.is_finite() || (*re == 0.0 && *im == 0.0) {
            return f64::NAN;
        }
        // −0 and 0 are one side of the real axis, that of a lag
        let raw = if *im == 0.0 && *re < 0.0 { -180.0 } else { im.atan2(*re).to_degrees() };
        let phase = match last {
            None => raw,
            // half a turn either way: a lag
            Some(last) => raw + 360.0 * ((last - raw) / 360.0 - 1e-9).round(),
        };
        last = Some(phase);
        phase
    };
    values.iter().map(one).collect()
}

#[cfg(test)]
mod tests {
    //! Phases are continuous past half a turn; unbounded values are gaps; the picture has a panel for each unit.
    use super::*;

    #[test]
    fn phases_go_on() {
        let turn = |degrees: f64| [degrees.to_radians().cos(), degrees.to_radians().sin()];
        let values = [turn(0.0), turn(-90.0), turn(-170.0), turn(-200.0), [f64::NAN; 2], turn(-350.0)];
        let phases = unwrapped(&values);
        for (got, expected) in phases.iter().zip([0.0, -90.0, -170.0, -200.0, f64::NAN, -350.0]) {
            assert!((got - expected).abs() < 1e-9 || (got.is_nan() && expected.is_nan()), "{phases:?}");
        }
        assert_eq!(unwrapped(&[[1.0, 0.0], [-1.0, 0.0], [-1.0, -0.0]]), [0.0, -180.0, -180.0]);
    }

    #[test]
    fn panels_by_unit() {
        let curve = |name: &str, unit: &str| BodeCurve {
            name: name.into(),
            unit: unit.into(),
            values: vec![[1.0, 0.0], [f64::NAN; 2], [1e-3, -1e-3], [1e-6, 0.0]],
        };
        let curves = [curve("a.x", "m/N"), curve("b.x", "m/N"), curve("p.i", "A/N")];
        let chart = BodeChart {
            title: "t".into(),
            frequencies: vec![1.0, 10.0, 100.0, 1e3],
            linear: false,
            magnitude: Magnitude::Units,
            curves: curves.to_vec(),
            resonances: vec![],
        };
        let svg = draw(&chart).to_svg();
        for text in ["displacement [m/N]", "current [A/N]", "phase [°]", "frequency [Hz]", ">a.x<"] {
            assert!(svg.contains(text), "{text}");
        }
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
        let narrow =
            draw(&BodeChart { frequencies: vec![100.0, 101.0, 102.0, 103.0], linear: true, ..chart.clone() }).to_svg();
        assert!(!narrow.contains("NaN") && !narrow.contains("inf"));
        let decibels = draw(&BodeChart { magnitude: Magnitude::Decibels, ..chart }).to_svg();
        assert!(decibels.contains("displacement [dB m/N]") && decibels.contains(">-100<"), "{decibels}");
    }

    /// A peak is marked with its frequency and quality; a resonance that no curve shows is not.
    #[test]
    fn peaks_are_marked() {
        let frequencies: Vec<f64> = (0..400).map(|k| 1e3 * 1.01f64.powi(k)).collect();
        let response = |f: &f64| {
            // 1/(1 − x² + i·x/Q) about 10 kHz with Q = 20
            let x = f / 1e4;
            let (a, b) = (1.0 - x * x, x / 20.0);
            [a / (a * a + b * b), -b / (a * a + b * b)]
        };
        let curve =
            BodeCurve { name: "m.x".into(), unit: "m/N".into(), values: frequencies.iter().map(response).collect() };
        let resonance = |frequency: f64| BodeResonance { frequency, quality: Some(20.0) };
        let chart = BodeChart {
            title: "t".into(),
            frequencies,
            linear: false,
            magnitude: Magnitude::Units,
            curves: vec![curve],
            resonances: vec![resonance(1e4), resonance(2e4)],
        };
        let svg = draw(&chart).to_svg();
        assert!(svg.contains("10.00 kHz, Q 20.00") && !svg.contains("20.00 kHz"), "{svg}");
    }
}
