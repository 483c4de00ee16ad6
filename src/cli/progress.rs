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

/// A run is priced once it has taken so long [s], and whenever it has taken twice as long again, if all of it is going to take more than
/// [`DEAR`].
const PRICED: f64 = 3.0;
/// A run that goes this many times as fast as it did has not found its step yet: it has no price.
const SETTLING: f64 = 4.0;
/// A run of more than this is told its price [s].
const DEAR: f64 = 20.0;
/// Where no person watches, a line is written this often [s].
const LINES: f64 = 30.0;

/// What makes a run in time cheaper.
const OF_A_RUN: &str = "a shorter --stop, a larger --tol, or --method generalized-alpha with --step, which damps what is faster than \
                        its steps, cost less";

/// The watch of a run in time: moves the bar, tells the price of a long one, and says whether to go on.
pub(crate) fn watch(bar: &ProgressBar) -> impl FnMut(f64) -> bool + '_ {
    watch_with(bar, OF_A_RUN)
}

/// The same for another analysis, with what makes it cheaper.
pub(crate) fn watch_with<'a>(bar: &'a ProgressBar, advice: &'a str) -> impl FnMut(f64) -> bool + 'a {
    let begun = Instant::now();
    let (mut price, mut line) = (Price::default(), LINES);
    let watched = std::io::stderr().is_terminal();
    move |fraction| {
        bar.set_position((fraction * FINE as f64) as u64);
        let spent = begun.elapsed().as_secs_f64();
        if let Some(all) = price.at(spent, fraction) {
            let price = format!("this run is going to take some {all:.0} s; {advice}");
            bar.suspend(|| eprintln!("{price}"));
        }
        if !watched && spent > line {
            line += LINES;
            eprintln!("{:.1} % after {spent:.0} s", 100.0 * fraction);
        }
        !interrupt::asked()
    }
}

/// What a run is going to take, by how fast it went since it was asked last.
#[derive(Debug, Default)]
struct Price {
    /// Time spent [s] and fraction done when it was asked last, and the rate until then [1/s].
    last: (f64, f64, f64),
    told: Option<f64>,
}

impl Price {
    /// All of the run [s], where that is worth telling: it is dear, and not what was told already.
    fn at(&mut self, spent: f64, fraction: f64) -> Option<f64> {
        let (before, done, rate_before) = self.last;
        if spent < (2.0 * before).max(0.5 * PRICED) || fraction <= done {
            return None;
        }
        let rate = (fraction - done) / (spent - before);
        self.last = (spent, fraction, rate);
        let all = spent + (1.0 - fraction) / rate;
        let known = self.told.is_some_and(|told| (0.5 * told..2.0 * told).contains(&all));
        if before == 0.0 || rate > SETTLING * rate_before || all <= DEAR || known {
            return None;
        }
        self.told = Some(all);
        Some(all)
    }
}

#[cfg(test)]
mod tests {
    use super::Price;

    /// A run whose steps grow has no price until they have grown; then one, and another when it turns out otherwise.
    #[test]
    fn prices() {
        let mut price = Price::default();
        let told: Vec<Option<f64>> = [
            (0.1, 1e-9),
            (1.6, 1e-8),
            (3.3, 1e-3),
            (6.7, 0.01),
            (13.5, 0.03),
            (27.0, 0.07),
            (60.0, 0.4),
            (120.0, 0.51),
        ]
        .map(|(spent, fraction)| price.at(spent, fraction))
        .into();
        let some: Vec<bool> = told.iter().map(Option::is_some).collect();
        assert_eq!(some, [false, false, false, false, true, false, true, true], "{told:?}");
        // 13.5 s spent, 0.02 in 6.8 s
        assert!((told[4].unwrap() - (13.5 + 0.97 * 6.8 / 0.02)).abs() < 1e-9);
        // a short one has none
        let mut price = Price::default();
        assert!([(1.6, 0.1), (3.3, 0.3), (7.0, 0.8)].iter().all(|(s, f)| price.at(*s, *f).is_none()));
    }
}
