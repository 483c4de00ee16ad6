//! Output of `bimorph ac`: table, picture, and text with resonances and zeros.

use super::failure::Failure;
use super::report;
use bimorph::analysis::harmonic::{HarmonicResult, Root};
use bimorph::results::plot::Picture;
use bimorph::results::plot::axis::{prefix, quantity};
use bimorph::results::plot::bode::{self, BodeChart, BodeCurve, BodeResonance, Magnitude};
use bimorph::results::table::{Column, ColumnSamples, Table};
use std::f64::consts::TAU;
use std::fmt::Write;

/// Resonances and zeros of a signal that a report names at most.
const MAX_NAMED: usize = 12;

pub(super) fn table(title: &str, result: &HarmonicResult) -> Result<Table, Failure> {
    let mut table = Table::new(title, "AC Analysis");
    table.push_real("frequency", "Hz", result.frequencies_hz.clone())?;
    for signal in &result.signals {
        let (name, unit) = (signal.name.clone(), signal.unit.clone());
        table.push(Column { name, unit, samples: ColumnSamples::Complex(signal.values.clone()) })?;
    }
    Ok(table)
}

pub(super) fn picture(title: &str, result: &HarmonicResult, linear: bool) -> Picture {
    let curve = |s: &bimorph::analysis::harmonic::SignalResponse| BodeCurve {
        name: s.name.clone(),
        unit: s.unit.clone(),
        values: s.values.clone(),
    };
    let curves: Vec<BodeCurve> = result.signals.iter().map(curve).collect();
    let resonance = |pole: &Root| BodeResonance { frequency: pole.frequency_hz(), quality: pole.quality() };
    let ringing = result.poles.iter().flatten().filter(|pole| pole.im > 0.0);
    bode::draw(&BodeChart {
        title: title.to_owned(),
        frequencies: result.frequencies_hz.clone(),
        linear,
        magnitude: Magnitude::Units,
        curves,
        resonances: ringing.map(resonance).collect(),
    })
}

pub(super) fn text(result: &HarmonicResult) -> String {
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
        let named: Vec<String> = zeros.iter().take(MAX_NAMED).map(zero).collect();
        let more = zeros.len().saturating_sub(MAX_NAMED);
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

/// By how much more the nearer of two frequencies has to show for a resonance to be seen.
const SEEN: f64 = 1.01;
/// Fraction of its width within which a resonance is seen by the frequency on the grid next to it.
const ON_TOP: f64 = 0.1;

/// Value of a signal at a resonance at `hertz` of this half-power width [Hz]: that at the frequency on the grid next to it, none where that
/// is on its flank.
fn on_top(result: &HarmonicResult, signal: usize, hertz: f64, width: f64) -> Option<[f64; 2]> {
    let grid = &result.frequencies_hz;
    let after = grid.partition_point(|f| *f < hertz);
    let near = [after.saturating_sub(1), after.min(grid.len() - 1)];
    let k = if hertz - grid[near[0]] <= grid[near[1]] - hertz { near[0] } else { near[1] };
    ((grid[k] - hertz).abs() <= ON_TOP * width).then(|| result.signals[signal].values[k])
}

/// Whether a signal grows towards an undamped resonance at `hertz`. The criterion is the two frequencies of the grid
/// next to it on one side: the value at the nearer one would be several times larger. A signal that a mode does not
/// affect, behind an anchor or at its node, has the same value at both.
fn grows(result: &HarmonicResult, signal: usize, hertz: f64) -> bool {
    let (grid, values) = (&result.frequencies_hz, &result.signals[signal].values);
    let finite = |k: &usize| size(values[*k]).is_finite() && grid[*k] != hertz;
    let after = grid.partition_point(|f| *f < hertz);
    let sides: [Vec<usize>; 2] =
        [(0..after).rev().filter(finite).take(2).collect(), (after..grid.len()).filter(finite).take(2).collect()];
    sides.iter().any(|side| match side[..] {
        [near, far] => size(values[near]) > SEEN * size(values[far]),
        _ => true,
    })
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
        let rows: Vec<Vec<String>> = (ringing.iter().take(MAX_NAMED))
            .map(|pole| {
                let own = pole.im / TAU;
                let q = pole.quality().map_or("undamped".into(), four);
                let (height, phase) = match (pole.quality(), on_top(result, 0, own, pole.width_hz())) {
                    (Some(_), Some(v)) if size(v).is_finite() => (quotient(size(v), &first.unit), degrees(v)),
                    (Some(_), None) => ("–".into(), "–".into()),
                    (None, _) if !grows(result, 0, own) => ("not seen".into(), "–".into()),
                    _ => ("no bound".into(), "–".into()),
                };
                vec![quantity(pole.frequency_hz(), "Hz"), q, quantity(pole.width_hz(), "Hz"), height, phase]
            })
            .collect();
        text += &report::columns(&["resonance", "Q", "-3 dB bandwidth", &first.name, "phase"], &rows);
        if ringing.len() > MAX_NAMED {
            let _ = writeln!(text, "… {} more; --json has all", ringing.len() - MAX_NAMED);
        }
    }
    if !corners.is_empty() {
        let shown: Vec<String> = corners.iter().take(MAX_NAMED).cloned().collect();
        let _ = writeln!(text, "real poles: {}", shown.join(", "));
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
