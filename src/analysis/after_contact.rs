//! How long single values of a run hold after parts have touched, and statistics where they do not.
//!
//! Impacts multiply differences: bounces that lose nothing are chaotic. A run that touches is therefore compared with a companion, at ten
//! times the tolerance or in steps of twice the length. While both stay within ten tolerances of each other, of the amplitude of
//! each signal, by root mean square over a twentieth of the run, the tolerance holds. From the first window after contact in which they do not, single values hold no more
//! ([`TransientResult::reliable_until`]): the result then has mean, root mean square and range of each signal over what is left
//! ([`Statistics`]). The mean has a 95 % confidence interval, from the means of five windows of equal length by Student's t.

use super::chart::error::{SMALL, half_range};
use super::transient::{Statistics, TransientOptions, TransientResult};
use super::{AnalysisError, Watch};

/// Code of the warning that single values hold no more.
pub const WARNING: &str = "W046";
/// Tolerances between a run and its companion up to which single values hold [1].
const APART: f64 = 10.0;
/// Windows of a run in which it is compared with its companion: an impact that comes a little later makes a peak in the difference of two
/// rates, which says nothing of what follows.
const COMPARED: usize = 20;
/// Windows of the statistics.
const WINDOWS: usize = 5;
/// Student's t for 95 % and four degrees of freedom.
const STUDENT: f64 = 2.776;
/// Samples that are compared, at most about twice as many.
const MOST_SAMPLES: usize = 2000;

/// Samples of a run, evenly spaced ones of many.
pub(super) struct Samples {
    stride: usize,
    seen: usize,
    t: Vec<f64>,
    columns: Vec<Vec<f64>>,
}

impl Samples {
    pub(super) fn new(options: &TransientOptions<'_>) -> Self {
        let stride = (options.points.max(1) - 1) / MOST_SAMPLES;
        Self { stride: stride.max(1), seen: 0, t: Vec::new(), columns: vec![Vec::new(); options.signals.len()] }
    }

    pub(super) fn keep(&mut self, t: f64, values: &[f64]) {
        if self.seen.is_multiple_of(self.stride) {
            crate::budget::lay_out(size_of_val(values) + size_of::<f64>());
            self.t.push(t);
            self.columns.iter_mut().zip(values).for_each(|(column, value)| column.push(*value));
        }
        self.seen += 1;
    }
}

/// When parts first touch in a run [s].
pub(super) fn first_contact(result: &TransientResult) -> Option<f64> {
    result.events.iter().find(|event| event.contact).map(|event| event.t)
}

/// The samples of `run`, one of `stride` output times, up to the contact at `t` [s].
pub(super) fn before(run: &TransientResult, options: &TransientOptions<'_>, t: f64, stride: usize) -> TransientResult {
    let most = (t / options.stop * (options.points - 1) as f64) as usize / stride + 1;
    let cut = |(name, unit, values): &(String, String, Vec<f64>)| {
        (name.clone(), unit.clone(), values[..values.len().min(most)].to_vec())
    };
    TransientResult { signals: run.signals.iter().map(cut).collect(), ..TransientResult::default() }
}

/// Makes a companion: with its options, told of each sample and of its progress.
pub(super) type Companion<'r> =
    &'r mut dyn FnMut(&TransientOptions<'_>, &mut dyn FnMut(f64, &[f64]), Watch<'_>) -> Result<(), AnalysisError>;

/// Compares a run that touches with a companion of `looser` options, and sets what `result` says of the time after it. `least` is the
/// amplitude below which a signal of a unit stands still.
///
/// # Errors
/// [`AnalysisError::Cancelled`]; a companion that fails is none, and leaves the time after the first contact without a claim.
pub(super) fn judge(
    samples: &Samples,
    (options, looser): (&TransientOptions<'_>, &TransientOptions<'_>),
    least: &dyn Fn(&str) -> f64,
    run: Companion<'_>,
    result: &mut TransientResult,
    watch: Watch<'_>,
) -> Result<(), AnalysisError> {
    let Some(contact) = first_contact(result).filter(|_| !options.signals.is_empty()) else { return Ok(()) };
    let first = samples.t.partition_point(|t| *t <= contact);
    if first >= samples.t.len() {
        return Ok(());
    }
    let mut others = Samples::new(options);
    let parted = match run(looser, &mut |t, values| others.keep(t, values), &mut |_| watch(1.0)) {
        Ok(()) => {
            let both = others.t.len().min(samples.t.len());
            let allowed = allowed(samples, options, result, least);
            let window = (samples.t.len() / COMPARED).max(1);
            let starts = (first..both).step_by(window);
            let apart = |from: &usize| {
                let over = *from..(from + window).min(both);
                let within = |((a, b), most): ((&Vec<f64>, &Vec<f64>), &f64)| {
                    let squares: f64 = over.clone().map(|k| (a[k] - b[k]) * (a[k] - b[k])).sum();
                    (squares / over.len() as f64).sqrt() <= *most
                };
                !samples.columns.iter().zip(&others.columns).zip(&allowed).all(within)
            };
            starts.into_iter().find(apart)
        }
        Err(AnalysisError::Cancelled) => return Err(AnalysisError::Cancelled),
        Err(_) => Some(first),
    };
    let Some(parted) = parted else { return Ok(()) };
    let from = if parted == first { contact } else { samples.t[parted - 1] };
    result.reliable_until = Some(from);
    result.after_contact = statistics(samples, parted, result);
    result.warnings.push(format!(
        "{WARNING}: the tolerance {:e} holds up to {from:.4e} s; parts touch at {contact:.4e} s, and from then on rebounds multiply small \
         differences. Use means over the time that is left (after_contact), or a smaller `restitution` or --tol",
        options.tol
    ));
    Ok(())
}

/// How far two runs may be apart, signal by signal.
fn allowed(
    samples: &Samples,
    options: &TransientOptions<'_>,
    result: &TransientResult,
    least: &dyn Fn(&str) -> f64,
) -> Vec<f64> {
    let swings: Vec<(&str, f64)> =
        result.signals.iter().zip(&samples.columns).map(|((_, unit, _), c)| (unit.as_str(), half_range(c))).collect();
    let largest = |of: &str| swings.iter().filter(|(unit, _)| *unit == of).map(|(_, swing)| *swing).fold(0.0, f64::max);
    let one = |(unit, swing): &(&str, f64)| APART * options.tol * swing.max(SMALL * largest(unit)).max(least(unit));
    swings.iter().map(one).collect()
}

/// Statistics of each signal from sample `first` on; none of fewer samples than windows.
fn statistics(samples: &Samples, first: usize, result: &TransientResult) -> Vec<Statistics> {
    let t = &samples.t[first..];
    let each = t.len() / WINDOWS;
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
            from: t[0],
            to: t[t.len() - 1],
            mean,
            mean_error: STUDENT * (spread / WINDOWS as f64).sqrt(),
            rms: square.sqrt(),
            low: values.iter().copied().fold(f64::INFINITY, f64::min),
            high: values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        }
    };
    result.signals.iter().zip(&samples.columns).map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sine of 50 periods about 2, in windows of ten periods each: mean 2 and no spread, rms 1/√2; a line from 0 to 1 has the means 0.1,
    /// 0.3 … 0.9, whose standard error is √0.1/√5, so that the interval is 2.776·0.1414.
    #[test]
    fn statistics_by_hand() {
        let options =
            TransientOptions { signals: vec!["a".into(), "b".into()], points: 1001, ..TransientOptions::default() };
        let mut samples = Samples::new(&options);
        for k in 0..1000 {
            let t = f64::from(k) / 1000.0;
            samples.keep(t, &[2.0 + (100.0 * std::f64::consts::PI * t).sin(), t]);
        }
        let named = |name: &str| (name.to_owned(), "m".to_owned(), Vec::new());
        let result = TransientResult { signals: vec![named("a"), named("b")], ..TransientResult::default() };
        let found = statistics(&samples, 0, &result);
        assert!((found[0].mean - 2.0).abs() < 1e-12 && found[0].mean_error < 1e-12, "{found:?}");
        assert!((found[0].rms - 0.5f64.sqrt()).abs() < 1e-12 && (found[0].high - 3.0).abs() < 1e-3);
        assert!((found[1].mean_error / (2.776 * (0.1f64 / 5.0).sqrt()) - 1.0).abs() < 1e-9, "{found:?}");
    }
}
