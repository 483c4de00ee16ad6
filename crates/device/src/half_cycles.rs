//! Half cycles of a mode in a quantity, counted by its turning points, and the phase error that adds up over them.

use std::f64::consts::PI;

/// By how much half a swing may be longer or shorter than half a cycle of the mode (1): voltages move its frequency, and a turning point is
/// known to a step.
const ALIKE: f64 = 0.25;

/// The same where the points are so far apart that a turning point is known to no better (1).
const MIN_ALIKE: f64 = 0.4;

/// Phase error of a motion.
#[derive(Debug, Clone, Copy)]
pub(super) struct Phase {
    /// Relative error of its frequency (1).
    pub(super) error: f64,
    /// Quality (1).
    pub(super) quality: f64,
}

impl Phase {
    /// Error after so many half cycles, of the amplitude (1).
    pub(super) fn after(self, halves: u32) -> f64 {
        (self.error.abs() * (PI * f64::from(halves)).min(2.0 * self.quality)).min(2.0)
    }
}

/// One quantity over time.
#[derive(Debug, Clone, Copy)]
pub(super) struct Waveform {
    now: f64,
    low: f64,
    high: f64,
    /// Whether it rises.
    rises: Option<bool>,
    /// The last turning point: time (s), value.
    turned: Option<(f64, f64)>,
    /// Halves of a cycle of the mode so far.
    halves: u32,
}

impl Waveform {
    /// From this value on.
    pub(super) fn at(y: f64) -> Self {
        Self { now: y, low: y, high: y, rises: None, turned: None, halves: 0 }
    }

    /// Between its smallest and its largest value.
    pub(super) fn range(&self) -> f64 {
        self.high - self.low
    }

    /// The next value `y`, at the second of two times (s): the size of the half swing of a mode with half cycles of `half` (s) that ended at the
    /// first, and how many there were.
    pub(super) fn half(&mut self, [before, t]: [f64; 2], y: f64, half: f64) -> Option<(f64, u32)> {
        let last = std::mem::replace(&mut self.now, y);
        (self.low, self.high) = (self.low.min(y), self.high.max(y));
        if y == last || self.rises.replace(y > last).is_none_or(|rose| rose == (y > last)) {
            return None;
        }
        // it turned at the last point, or up to a step beside it
        let (since, from) = self.turned.replace((before, last))?;
        let alike = ALIKE.max((t - before) / half).min(MIN_ALIKE);
        if ((before - since) / half - 1.0).abs() > alike {
            return None;
        }
        self.halves += 1;
        Some(((last - from).abs(), self.halves))
    }
}
