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

/// A run is priced once it has taken so long [s], if all of it is going to take more than [`DEAR`].
const PRICED: f64 = 3.0;
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
    let (mut priced, mut line) = (false, LINES);
    let watched = std::io::stderr().is_terminal();
    move |fraction| {
        bar.set_position((fraction * FINE as f64) as u64);
        let spent = begun.elapsed().as_secs_f64();
        if !priced && spent > PRICED && fraction > 0.0 {
            priced = true;
            let all = spent / fraction;
            if all > DEAR {
                let price = format!("this run is going to take some {all:.0} s; {advice}");
                bar.suspend(|| eprintln!("{price}"));
            }
        }
        if !watched && spent > line {
            line += LINES;
            eprintln!("{:.1} % after {spent:.0} s", 100.0 * fraction);
        }
        !interrupt::asked()
    }
}
