//! Progress on standard error, when a person is watching.

use super::interrupt;
use indicatif::{ProgressBar, ProgressStyle};
use std::time::Duration;

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

/// The watch of an analysis: moves the bar and says whether to go on.
pub(crate) fn watch(bar: &ProgressBar) -> impl FnMut(f64) -> bool + '_ {
    |fraction| {
        bar.set_position((fraction * FINE as f64) as u64);
        !interrupt::asked()
    }
}
