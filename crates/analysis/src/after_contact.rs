//! How long single values of a run hold after parts have touched, and statistics where they do not.
//!
//! Impacts multiply differences: bounces that lose nothing are chaotic. A run that touches is therefore compared with a companion, at ten
//! times the tolerance or in steps of twice the length. While both stay within ten tolerances of each other, of the amplitude of
//! each signal, by root mean square over a twentieth of the run, the tolerance holds. A run on twice the segments may differ by
//! one tolerance, by root mean square over the whole run. From the first window after contact in which they do not, single values hold no more
//! ([`TransientResult::reliable_until`]): the result then has mean, root mean square and range of each signal over what is left
//! ([`Statistics`]). The mean has a 95 % confidence interval, from the means of five windows of equal length by Student's t.

use super::chart::error::{SMALL, half_range};
use super::transient::{Statistics, TransientOptions, TransientResult};
use bimorph_solve::time::event::Direction;
use std::ops::Range;

/// Code of the warning that single values hold no more.
pub const WARNING: &str = "W049";
/// Windows of a run in which it is compared with its companion: an impact that comes a little later makes a peak in the difference of two
/// rates, which says nothing of what follows.
const COMPARED: usize = 20;
/// Windows of the statistics.
const WINDOWS: usize = 5;
/// Student's t for 95 % and four degrees of freedom.
const STUDENT: f64 = 2.776;

/// A run and its companion at the same output times.
pub(super) struct CompanionRuns<'a> {
    /// Distance of the output times, from 0 on (s).
    pub(super) spacing: f64,
    /// Samples of the run, signal by signal.
    pub(super) run: &'a [Vec<f64>],
    /// Those of the companion as far as it came; none where it failed.
    pub(super) companion: Option<&'a [Vec<f64>]>,
    pub(super) differs_in: MeshOrSteps,
}

/// A companion differs from its run in one of these.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum MeshOrSteps {
    /// Its error is ten times as large.
    LooserSteps,
    /// It is on a finer mesh, and the difference is the error of the run.
    FinerMesh,
}

/// When parts first touch in a run (s).
pub(super) fn first_contact(result: &TransientResult) -> Option<f64> {
    result.events.iter().find(|event| event.contact).map(|event| event.t)
}

/// When a gap first closes in a run that did not start with one closed (s).
pub(super) fn first_closing(result: &TransientResult) -> Option<f64> {
    result
        .events
        .iter()
        .find(|event| event.contact)
        .filter(|event| event.direction == Direction::Down)
        .map(|event| event.t)
}

/// Difference of two times of a contact, of the later one (1).
pub(super) fn apart_in_time(a: f64, b: f64) -> f64 {
    if a == b { 0.0 } else { (a - b).abs() / a.max(b) }
}

/// Compares a run that touches with its companion, and sets what `result` reports of the time after the contact. `least` is the
/// amplitude below which a signal of a unit stands still.
pub(super) fn judge(
    pair: &CompanionRuns<'_>,
    options: &TransientOptions<'_>,
    least: &dyn Fn(&str) -> f64,
    result: &mut TransientResult,
) {
    let Some(contact) = first_contact(result) else { return };
    let count = pair.run.first().map_or(0, Vec::len);
    let first = (contact / pair.spacing) as usize + 1;
    if first >= count {
        return;
    }
    let Some(parted) = parted(pair, options, least, (first, count), result) else { return };
    let from = if parted == first { contact } else { (parted - 1) as f64 * pair.spacing };
    result.reliable_until = Some(from);
    result.after_contact = statistics(pair, parted, result);
    let why = match pair.differs_in {
        MeshOrSteps::LooserSteps => {
            "rebounds multiply small differences. Use means over the time that is left (after_contact), or a smaller `restitution` or --tol"
        }
        MeshOrSteps::FinerMesh => {
            "the motion has modes that its mesh does not resolve: one of twice the segments has another. Use means over the time that is left \
             (after_contact), or a smaller --tol"
        }
    };
    result.warnings.push(format!(
        "{WARNING}: the tolerance {:e} holds up to {from:.4e} s; parts touch at {contact:.4e} s, and from then on {why}",
        options.errors().requested()
    ));
}

/// The first sample from `first` on at which a run and its companion are apart; none: they never are.
fn parted(
    pair: &CompanionRuns<'_>,
    options: &TransientOptions<'_>,
    least: &dyn Fn(&str) -> f64,
    (first, count): (usize, usize),
    result: &TransientResult,
) -> Option<usize> {
    let Some(companion) = pair.companion else { return Some(first) };
    let both = companion.first().map_or(0, Vec::len).min(count);
    let allowed = allowed(pair, options, result, least);
    let window = (count / COMPARED).max(1);
    let agree = |over: Range<usize>| {
        let within = |((a, b), most): ((&Vec<f64>, &Vec<f64>), &f64)| {
            let squares: f64 = over.clone().map(|k| (a[k] - b[k]) * (a[k] - b[k])).sum();
            (squares / over.len() as f64).sqrt() <= *most
        };
        pair.run.iter().zip(companion).zip(&allowed).all(within)
    };
    let apart = |from: &usize| !agree(*from..(from + window).min(both));
    // a run that ends at an event is a few samples longer or shorter
    let compared_all = result.stopped_at.is_some() || both + window >= count;
    if pair.differs_in == MeshOrSteps::FinerMesh && compared_all && agree(0..both) {
        return None;
    }
    (first..both).step_by(window).find(apart).or_else(|| (!compared_all).then(|| both.max(first)))
}

/// How far two runs may be apart, signal by signal.
fn allowed(
    pair: &CompanionRuns<'_>,
    options: &TransientOptions<'_>,
    result: &TransientResult,
    least: &dyn Fn(&str) -> f64,
) -> Vec<f64> {
    let swings: Vec<(&str, f64)> =
        result.signals.iter().zip(pair.run).map(|((_, unit, _), c)| (unit.as_str(), half_range(c))).collect();
    let largest = |of: &str| swings.iter().filter(|(unit, _)| *unit == of).map(|(_, swing)| *swing).fold(0.0, f64::max);
    let size = |(unit, swing): &(&str, f64)| swing.max(SMALL * largest(unit)).max(least(unit));
    let one = |signal: &(&str, f64)| match pair.differs_in {
        MeshOrSteps::LooserSteps => options.errors().after_contact(size(signal)),
        MeshOrSteps::FinerMesh => options.errors().within(size(signal)),
    };
    swings.iter().map(one).collect()
}

/// Statistics of each signal from sample `first` on; none of fewer samples than windows.
fn statistics(pair: &CompanionRuns<'_>, first: usize, result: &TransientResult) -> Vec<Statistics> {
    let count = pair.run.first().map_or(0, Vec::len);
    let each = count.saturating_sub(first) / WINDOWS;
    if each == 0 {
        return Vec::new();
    }
    let one = |((name, ..), column): (&(String, String, Vec<f64>), &Vec<f64>)| {
        let values = &column[first..];
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let square = values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / values.len() as f64;
        let means: Vec<f64> = values.chunks(each).take(WINDOWS).map(|w| w.iter().sum::<f64>() / each as f64).collect();
        let middle = means.iter().sum::<f64>() / WINDOWS as f64;
        let spread = means.iter().map(|m| (m - middle) * (m - middle)).sum::<f64>() / (WINDOWS - 1) as f64;
        Statistics {
            signal: name.clone(),
            from: first as f64 * pair.spacing,
            to: (count - 1) as f64 * pair.spacing,
            mean,
            mean_error: STUDENT * (spread / WINDOWS as f64).sqrt(),
            rms: square.sqrt(),
            low: values.iter().copied().fold(f64::INFINITY, f64::min),
            high: values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        }
    };
    result.signals.iter().zip(pair.run).map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sine of 50 periods about 2, in windows of ten periods each: mean 2 without spread, rms 1/√2. A line from 0 to
    /// 1 has the means 0.1, 0.3 … 0.9, with the standard error √0.1/√5, so that the interval is 2.776·0.1414.
    #[test]
    fn statistics_by_hand() {
        let t: Vec<f64> = (0..1000).map(|k| f64::from(k) / 1000.0).collect();
        let sine = t.iter().map(|t| 2.0 + (100.0 * std::f64::consts::PI * t).sin()).collect();
        let run = [sine, t];
        let pair = CompanionRuns { spacing: 1e-3, run: &run, companion: None, differs_in: MeshOrSteps::LooserSteps };
        let named = |name: &str| (name.to_owned(), "m".to_owned(), Vec::new());
        let result = TransientResult { signals: vec![named("a"), named("b")], ..TransientResult::default() };
        let found = statistics(&pair, 0, &result);
        assert!((found[0].mean - 2.0).abs() < 1e-12 && found[0].mean_error < 1e-12, "{found:?}");
        assert!((found[0].rms - 0.5f64.sqrt()).abs() < 1e-12 && (found[0].high - 3.0).abs() < 1e-3);
        assert!((found[1].mean_error / (2.776 * (0.1f64 / 5.0).sqrt()) - 1.0).abs() < 1e-9, "{found:?}");
    }
}
