//! `bimorph ac`: what a small sinusoid does at every frequency.

use super::failure::Failure;
use super::model::{Context, ModelArgs, Named, warn_of, warn_of_mesh};
use super::output::OutputArgs;
use super::{progress, report, value};
use bimorph::analysis::harmonic::grid::Spacing;
use bimorph::analysis::harmonic::{HarmonicOptions, HarmonicResult, Root, harmonic_fitted};
use bimorph::options::analysis::{AC_FROM, AC_MODES, AC_POINTS, AC_TO};
use bimorph::options::{Described, Value};
use bimorph::results::plot::Picture;
use bimorph::results::plot::axis::{prefix, quantity};
use bimorph::results::plot::bode::{self, Curve};
use bimorph::results::table::{Column, Samples, Table};
use clap::Args;
use serde::Serialize;
use std::f64::consts::TAU;
use std::fmt::Write;

/// Resonances and zeros of a signal that a report names at most.
const MOST_NAMED: usize = 12;

/// Frequency response about the operating point: magnitude and phase of what a small sinusoid at one place does.
///
/// Drive: NODE.fx, NODE.fy [N], NODE.m [N·m], a port of the netlist [V], BEAM.T (heat) [W], frame.ax, frame.ay [m/s²], frame.wz [rad/s].
/// Signals: those of `tran` over the unit of the drive, and PORT.i [A], the current into a port.
/// JSON: "frequencies_hz"; "signals": by name "re" and "im", null where an undamped resonance has no bound; "units" by name;
/// "at_rest" by name; "poles" and, by name, "zeros": "re", "im" [rad/s], "frequency_hz", "quality" (null: undamped), "width_hz";
/// "points_added" about resonances and zeros; "modes" and "modal_error" with --by-modes.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  \
    bimorph ac stage.net --drive c.fx --signals c.x,c.y --from 10k --to 1M --out stage.png\n  \
    bimorph ac comb.net --drive drive --signals drive.i,shuttle.x --port drive=10 --from 1k --to 100k\n      \
    the current that 1 V of a sinusoid drives into the port on top of 10 V, and the motion\n  \
    bimorph ac comb.net --drive frame.ax --signals shuttle.x --from 1 --to 100k --points 20 --per-decade\n  \
    bimorph ac stage.net --drive c.fx --signals c.x --from 80k --to 90k --points 1001 --linear-scale --even --json")]
pub(crate) struct Ac {
    #[command(flatten)]
    model: ModelArgs,

    /// What is driven: NODE.fx, NODE.fy, NODE.m, a port, BEAM.T, frame.ax, frame.ay or frame.wz
    #[arg(long, short = 'd', value_name = "NAME")]
    drive: String,

    /// Signals wanted, PORT.i among them: a,b or repeated [default: what the driven place itself answers]
    #[arg(long, value_name = "NAMES")]
    signals: Vec<String>,

    /// Lowest frequency [Hz], such as 1k
    #[arg(long, value_name = "HZ", value_parser = value::number, allow_negative_numbers = true)]
    from: f64,

    /// Highest frequency [Hz], such as 1M
    #[arg(long, value_name = "HZ", value_parser = value::number, allow_negative_numbers = true)]
    to: f64,

    /// Frequencies of the even grid, both ends included; more are added about resonances and zeros
    #[arg(long, short = 'n', default_value_t = AC_POINTS.count())]
    points: usize,

    /// --points is the number in a decade
    #[arg(long, conflicts_with = "linear_scale")]
    per_decade: bool,

    /// Equal differences of frequency instead of equal quotients (--linear is about the model: small displacements)
    #[arg(long)]
    linear_scale: bool,

    /// No points about resonances and zeros: exactly those of the even grid
    #[arg(long)]
    even: bool,

    /// As a sum over modes with static correction instead of exactly at each frequency, with its deviation from that
    #[arg(long)]
    by_modes: bool,

    /// Of a sum over modes: how many, from the lowest [default: those to twice the highest frequency]
    #[arg(long, value_name = "N", requires = "by_modes")]
    modes: Option<usize>,

    /// Operating point: hold a port at a voltage [V]; others are at 0 V. Repeatable
    #[arg(long = "port", short = 'p', value_name = "NAME=VOLTS", value_parser = value::volts)]
    ports: Vec<(String, f64)>,

    #[command(flatten)]
    output: OutputArgs,
}

/// Samples of one signal.
#[derive(Debug, Serialize)]
struct Parts {
    re: Vec<f64>,
    im: Vec<f64>,
}

#[derive(Debug, Serialize)]
struct RootShown {
    re: f64,
    im: f64,
    frequency_hz: f64,
    quality: Option<f64>,
    width_hz: f64,
}

impl From<&Root> for RootShown {
    fn from(root: &Root) -> Self {
        Self {
            re: root.re,
            im: root.im,
            frequency_hz: root.frequency_hz(),
            quality: root.quality(),
            width_hz: root.width_hz(),
        }
    }
}

#[derive(Debug, Serialize)]
struct Document<'a> {
    drive: &'a str,
    drive_unit: &'a str,
    frequencies_hz: &'a [f64],
    signals: Named<'a, Parts>,
    units: Named<'a, String>,
    at_rest: Named<'a, Option<f64>>,
    poles: Option<Vec<RootShown>>,
    zeros: Named<'a, Option<Vec<RootShown>>>,
    points_added: usize,
    modes: Option<usize>,
    modal_error: Option<f64>,
    unknowns: usize,
    port_voltages_v: Named<'a, f64>,
    #[serde(flatten)]
    context: Context<'a>,
}

impl Ac {
    pub(crate) fn run(&self) -> Result<(), Failure> {
        self.output.check()?;
        let options = self.request()?;
        let drawn = self.model.compile()?;
        let bar = progress::bar("ac");
        let advice = "fewer --points, a larger --tol, or --by-modes cost less";
        let result = harmonic_fitted(&drawn, &options, &mut progress::watch_with(&bar, advice));
        bar.finish_and_clear();
        let (compiled, result) = result?;
        warn_of_mesh(&drawn, &compiled);
        warn_of(&result.warnings);
        let of = |f: &dyn Fn(&[f64; 2]) -> f64, values: &[[f64; 2]]| values.iter().map(f).collect::<Vec<f64>>();
        let (mut signals, mut units, mut at_rest, mut zeros) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for signal in &result.signals {
            let name = signal.name.clone();
            signals
                .push((name.clone(), Parts { re: of(&|v| v[0], &signal.values), im: of(&|v| v[1], &signal.values) }));
            units.push((name.clone(), signal.unit.clone()));
            at_rest.push((name.clone(), signal.at_rest));
            zeros
                .push((name, signal.zeros.as_ref().map(|zeros| zeros.iter().map(RootShown::from).collect::<Vec<_>>())));
        }
        let document = Document {
            drive: &result.drive,
            drive_unit: &result.drive_unit,
            frequencies_hz: &result.frequencies_hz,
            signals: Named(&signals),
            units: Named(&units),
            at_rest: Named(&at_rest),
            poles: result.poles.as_ref().map(|poles| poles.iter().map(RootShown::from).collect()),
            zeros: Named(&zeros),
            points_added: result.added,
            modes: result.modes,
            modal_error: result.modal_error,
            unknowns: result.unknowns,
            port_voltages_v: Named(&self.ports),
            context: self.model.context(&compiled).with(&result.warnings),
        };
        let title = format!("{}: {} [{}]", self.model.title(), result.drive, result.drive_unit);
        let text = text(&result) + &report::footing(&compiled, result.unknowns);
        self.output.finish(
            || table(&title, &result),
            || Ok(picture(&title, &result, self.linear_scale)),
            &document,
            &text,
        )
    }

    /// The request, each option within its range.
    fn request(&self) -> Result<HarmonicOptions, Failure> {
        let given: [(&Described, Value); 4] = [
            (&AC_FROM, Value::Number(self.from)),
            (&AC_TO, Value::Number(self.to)),
            (&AC_POINTS, Value::Count(self.points)),
            (&AC_MODES, self.modes.map_or(Value::Unset, Value::Count)),
        ];
        for (option, value) in given {
            option.check(&value)?;
        }
        let spacing = match (self.per_decade, self.linear_scale) {
            (true, _) => Spacing::PerDecade,
            (_, true) => Spacing::Linear,
            _ => Spacing::Logarithmic,
        };
        let options = HarmonicOptions {
            drive: self.drive.clone(),
            signals: value::names(&self.signals),
            from: self.from,
            to: self.to,
            points: self.points,
            spacing,
            even: self.even,
            by_modes: self.by_modes,
            modes: self.modes,
            voltages: self.ports.clone(),
        };
        options.check()?;
        Ok(options)
    }
}

/// A quotient of units for people: four digits and an SI prefix.
fn quotient(value: f64, unit: &str) -> String {
    let (factor, name) = prefix(value);
    let scaled = value / factor;
    if scaled != 0.0 && !(0.1..1e4).contains(&scaled.abs()) {
        return format!("{value:.3e} {unit}");
    }
    let digits = if scaled == 0.0 { 0 } else { (3 - scaled.abs().log10().floor() as i32).clamp(0, 4) as usize };
    format!("{scaled:.digits$} {name}{unit}")
}

/// Four digits.
fn four(x: f64) -> String {
    let digits = (3 - x.abs().max(1e-3).log10().floor() as i32).clamp(0, 6) as usize;
    format!("{x:.digits$}")
}

fn size([re, im]: [f64; 2]) -> f64 {
    re.hypot(im)
}

fn degrees([re, im]: [f64; 2]) -> String {
    let phase = (10.0 * im.atan2(re).to_degrees()).round() / 10.0;
    // −0 is written as 0
    format!("{:.1}°", phase + 0.0)
}

/// Value of a signal at the frequency on the grid next to `hertz`.
fn nearest(result: &HarmonicResult, signal: usize, hertz: f64) -> [f64; 2] {
    let grid = &result.frequencies_hz;
    let after = grid.partition_point(|f| *f < hertz);
    let near = [after.saturating_sub(1), after.min(grid.len() - 1)];
    let k = if hertz - grid[near[0]] <= grid[near[1]] - hertz { near[0] } else { near[1] };
    result.signals[signal].values[k]
}

fn table(title: &str, result: &HarmonicResult) -> Result<Table, Failure> {
    let mut table = Table::new(title, "AC Analysis");
    table.push_real("frequency", "Hz", result.frequencies_hz.clone())?;
    for signal in &result.signals {
        let (name, unit) = (signal.name.clone(), signal.unit.clone());
        table.push(Column { name, unit, samples: Samples::Complex(signal.values.clone()) })?;
    }
    Ok(table)
}

fn picture(title: &str, result: &HarmonicResult, linear: bool) -> Picture {
    let curve = |s: &bimorph::analysis::harmonic::SignalResponse| Curve {
        name: s.name.clone(),
        unit: s.unit.clone(),
        values: s.values.clone(),
    };
    let curves: Vec<Curve> = result.signals.iter().map(curve).collect();
    bode::draw(title, &result.frequencies_hz, linear, &curves)
}

fn text(result: &HarmonicResult) -> String {
    let (from, to) = (result.frequencies_hz[0], result.frequencies_hz[result.frequencies_hz.len() - 1]);
    let rows: Vec<Vec<String>> = (result.signals.iter())
        .map(|signal| {
            let bounded = || signal.values.iter().copied().enumerate().filter(|(_, v)| size(*v).is_finite());
            let peak = bounded().max_by(|a, b| size(a.1).total_cmp(&size(b.1)).then(b.0.cmp(&a.0)));
            let (at, most) = peak.map_or(("–".into(), "–".into()), |(k, v)| {
                (quantity(result.frequencies_hz[k], "Hz"), quotient(size(v), &signal.unit))
            });
            let rest = signal.at_rest.map_or("–".into(), |v| quotient(v, &signal.unit));
            let end = |v: Option<&[f64; 2]>| match v {
                Some(v) if size(*v).is_finite() => format!("{} {}", quotient(size(*v), &signal.unit), degrees(*v)),
                _ => "–".into(),
            };
            vec![signal.name.clone(), rest, end(signal.values.first()), most, at, end(signal.values.last())]
        })
        .collect();
    let (low, high) = (format!("at {}", quantity(from, "Hz")), format!("at {}", quantity(to, "Hz")));
    let mut text = format!("for each {} of {}\n", result.drive_unit, result.drive);
    text += &report::columns(&["signal", "at rest", &low, "largest", "there", &high], &rows);
    if let Some(poles) = &result.poles {
        text.push('\n');
        text += &resonances(result, poles);
    }
    for signal in &result.signals {
        let Some(zeros) = signal.zeros.as_ref().filter(|zeros| !zeros.is_empty()) else { continue };
        let named: Vec<String> = zeros.iter().take(MOST_NAMED).map(zero).collect();
        let more = zeros.len().saturating_sub(MOST_NAMED);
        let more = if more > 0 { format!(", {more} more") } else { String::new() };
        let _ = writeln!(text, "zeros of {}: {}{more}", signal.name, named.join(", "));
    }
    let _ = write!(text, "\n{} frequencies", result.frequencies_hz.len());
    if result.added > 0 {
        let _ = write!(text, ", {} of them added about resonances and zeros", result.added);
    }
    if let (Some(error), Some(modes)) = (result.modal_error, result.modes) {
        let _ = write!(text, "; a sum over {modes} modes, within {error:.1e} of the exact response");
    }
    text.push_str("; ");
    text
}

/// The table of resonances, and what damps without ringing.
fn resonances(result: &HarmonicResult, poles: &[Root]) -> String {
    let ringing: Vec<&Root> = poles.iter().filter(|pole| pole.im > 0.0).collect();
    let corners: Vec<String> =
        poles.iter().filter(|pole| pole.im == 0.0).map(|pole| quantity(pole.frequency_hz(), "Hz")).collect();
    let mut text = String::new();
    if ringing.is_empty() {
        text += "no resonance within the band\n";
    } else {
        let first = &result.signals[0];
        let rows: Vec<Vec<String>> = (ringing.iter().take(MOST_NAMED))
            .map(|pole| {
                let own = pole.im / TAU;
                let q = pole.quality().map_or("undamped".into(), four);
                let (height, phase) = match (pole.quality(), nearest(result, 0, own)) {
                    (Some(_), v) if size(v).is_finite() => (quotient(size(v), &first.unit), degrees(v)),
                    _ => ("no bound".into(), "–".into()),
                };
                vec![quantity(pole.frequency_hz(), "Hz"), q, quantity(pole.width_hz(), "Hz"), height, phase]
            })
            .collect();
        text += &report::columns(&["resonance", "Q", "half-power width", &first.name, "phase"], &rows);
        if ringing.len() > MOST_NAMED {
            let _ = writeln!(text, "… {} more; --json has all", ringing.len() - MOST_NAMED);
        }
    }
    if !corners.is_empty() {
        let shown: Vec<String> = corners.iter().take(MOST_NAMED).cloned().collect();
        let _ = writeln!(text, "corners of what lags without ringing: {}", shown.join(", "));
    }
    text
}

fn zero(root: &Root) -> String {
    let own = quantity(root.frequency_hz(), "Hz");
    match root.quality() {
        None => own,
        Some(_) if root.im == 0.0 => {
            format!("{own} (real, {} half plane)", if root.re > 0.0 { "right" } else { "left" })
        }
        Some(q) => {
            let side = if root.re > 0.0 { ", right half plane" } else { "" };
            format!("{own} (Q {}{side})", four(q))
        }
    }
}
