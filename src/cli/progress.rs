//! Progress on standard error, when a person is watching.

use super::interrupt;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::time::{Duration, Instant};

/// Steps of a bar that counts fractions.
const FINE: u64 = 1000;

/// A bar for work that reports a fraction; hidden when standard error is no terminal.
pub(crate) fn bar(what: &str) -> ProgressBar {
    let bar = ProgressBar::new(FINE).with_message(what.to_owned());
    if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar} {percent:>3} % {elapsed} (left {eta})") {
        bar.set_style(style);
    }
    bar
}

/// A spinner for work that does not report.
pub(crate) fn spinner(what: &str) -> ProgressBar {
    let spinner = ProgressBar::new_spinner().with_message(what.to_owned());
    spinner.enable_steady_tick(Duration::from_millis(120));
    spinner
}

/// A pass of an analysis has a forecast once it has taken so long [s]; the forecast is checked each time that the pass has taken twice as long.
const FIRST_FORECAST: f64 = 3.0;
/// Completed fraction of a pass before which it has no forecast: its steps have yet to find their length.
const MIN_DONE: f64 = 0.01;
/// A pass that goes this many times as fast as before has not settled: it has no forecast.
const SETTLING: f64 = 4.0;
/// Shortest forecast that is printed [s].
const LONG: f64 = 20.0;
/// Where no person watches, a line is written this often [s].
const LINES: f64 = 30.0;

/// The progress callback of a run in time, with the options that make it cheaper, if any: moves the bar, prints the
/// forecast of a long run, and returns whether to continue.
pub(crate) fn watch<'a>(bar: &'a ProgressBar, advice: &'a str) -> impl FnMut(f64) -> bool + 'a {
    let begun = Instant::now();
    let (mut forecast, mut line) = (Forecast::default(), LINES);
    let watched = std::io::stderr().is_terminal();
    move |fraction| {
        bar.set_position((fraction * FINE as f64) as u64);
        let spent = begun.elapsed().as_secs_f64();
        if let Some(all) = forecast.at(spent, fraction) {
            let way = if advice.is_empty() { String::new() } else { format!("; {advice}") };
            let forecast = format!("forecast: {all:.0} s in total{way}");
            bar.suspend(|| stderr_line!("{forecast}"));
        }
        if !watched && spent > line {
            line += LINES;
            stderr_line!("{:.1} % after {spent:.0} s", 100.0 * fraction);
        }
        !interrupt::asked()
    }
}

/// Forecast of the time that an analysis takes, from the second half of the time that its present pass has taken. An analysis that starts
/// over, at a sharper tolerance for instance, begins another pass: its fraction falls.
#[derive(Debug, Default)]
struct Forecast {
    /// Time when the present pass began [s].
    begun: f64,
    /// Fraction at the last call.
    fraction: f64,
    /// Time in the pass [s] and fraction when it was last checked, and the rate until then [1/s].
    checked: (f64, f64, f64),
    printed: Option<f64>,
}

impl Forecast {
    /// The time that the analysis takes in total [s], where it is long, settled and not yet printed.
    fn at(&mut self, spent: f64, fraction: f64) -> Option<f64> {
        if fraction <= 0.0 || fraction < self.fraction {
            *self = Self { begun: spent, fraction, ..Self::default() };
            return None;
        }
        self.fraction = fraction;
        let passed = spent - self.begun;
        let (before, done, rate_before) = self.checked;
        if passed < (2.0 * before).max(0.5 * FIRST_FORECAST) || fraction <= done {
            return None;
        }
        let rate = (fraction - done) / (passed - before);
        self.checked = (passed, fraction, rate);
        let all = spent + (1.0 - fraction) / rate;
        let known = self.printed.is_some_and(|printed| (0.5 * printed..2.0 * printed).contains(&all));
        let settled = before > 0.0 && fraction >= MIN_DONE && rate <= SETTLING * rate_before;
        if !settled || all <= LONG || known {
            return None;
        }
        self.printed = Some(all);
        Some(all)
    }
}

#[cfg(test)]
mod tests {
    use super::Forecast;

    fn forecasts(calls: &[(f64, f64)]) -> Vec<Option<f64>> {
        let mut forecast = Forecast::default();
        calls.iter().map(|(spent, fraction)| forecast.at(*spent, *fraction)).collect()
    }

    /// A run whose steps grow has no forecast until they have grown and 1 % is done; then one, and another when it turns out otherwise.
    #[test]
    fn growing_steps() {
        let calls = [
            (0.1, 1e-9),
            (1.6, 1e-8),
            (3.3, 1e-3),
            (6.7, 0.009),
            (13.5, 0.03),
            (27.0, 0.07),
            (60.0, 0.4),
            (120.0, 0.51),
        ];
        let found = forecasts(&calls);
        let some: Vec<bool> = found.iter().map(Option::is_some).collect();
        assert_eq!(some, [false, false, false, false, true, false, true, true], "{found:?}");
        // 13.5 s spent, 0.021 of the run in the last 6.8 s
        assert!((found[4].unwrap() - (13.5 + 0.97 * 6.8 / 0.021)).abs() < 1e-9);
        // no forecast of a short run
        assert!(forecasts(&[(1.6, 0.1), (3.3, 0.3), (7.0, 0.8)]).iter().all(Option::is_none));
    }

    /// A steady rate of which less than 1 % is done has no forecast, however long it takes; at 1 % it has the right one.
    #[test]
    fn less_than_one_percent() {
        let calls: Vec<(f64, f64)> = (0..200).map(|k| (0.1 * k as f64, 5e-5 * k as f64)).collect();
        assert!(forecasts(&calls).iter().all(Option::is_none));
        let longer: Vec<(f64, f64)> = (0..1000).map(|k| (0.1 * k as f64, 5e-5 * k as f64)).collect();
        let first = forecasts(&longer).into_iter().flatten().next().unwrap();
        assert!((first / 2000.0 - 1.0).abs() < 1e-3, "{first}");
    }

    /// A second pass has a forecast of its own: 20 s of a first pass and one without a fraction say nothing of the 200 s that it takes.
    #[test]
    fn another_pass() {
        let first = (0..=100).map(|k| (0.1 * k as f64, 0.01 * k as f64));
        let without = (0..100).map(|k| (10.0 + 0.1 * k as f64, 0.0));
        let second = (0..=1000).map(|k| (20.0 + 0.2 * k as f64, 1e-3 * k as f64));
        let found: Vec<f64> =
            forecasts(&first.chain(without).chain(second).collect::<Vec<_>>()).into_iter().flatten().collect();
        assert_eq!(found.len(), 1, "{found:?}");
        assert!((found[0] / 220.0 - 1.0).abs() < 0.01, "{found:?}");
    }
}
