//! Request of a frequency response, and its errors.

use super::grid::{self, Spacing};
use crate::AnalysisError;
use bimorph_model::options::OptionValue;
use bimorph_model::options::analysis::{AC_FROM, AC_MODES, AC_POINTS, AC_TO};

/// Frequencies times signals at most: each value is a complex number in doubles.
pub const MAX_VALUES: usize = 50_000_000;

/// Request.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HarmonicOptions {
    /// Input: `NODE.fx`, `NODE.fy`, `NODE.m`, a port, `BEAM.T`, `frame.ax`, `frame.ay`, `frame.wz`.
    pub drive: String,
    /// Output signals, `PORT.i` among them; empty: the output at the driven place itself.
    pub signals: Vec<String>,
    /// Lowest frequency (Hz).
    pub from: f64,
    /// Highest frequency (Hz).
    pub to: f64,
    /// Points of the even grid, or of each decade of it.
    pub points: usize,
    /// How the even grid lies.
    pub spacing: Spacing,
    /// No points about resonances and zeros: the even grid alone.
    pub even: bool,
    /// As a sum over modes with static correction instead of exactly.
    pub by_modes: bool,
    /// Modes of that sum; none: those to twice the highest frequency.
    pub modes: Option<usize>,
    /// Port voltages of the operating point.
    pub voltages: Vec<(String, f64)>,
}

impl HarmonicOptions {
    /// For other output signals.
    #[must_use]
    pub fn with_signals(&self, signals: &[String]) -> Self {
        Self { signals: signals.to_vec(), ..self.clone() }
    }

    /// Refuses what cannot be computed, before anything is laid out for it.
    ///
    /// # Errors
    /// [`AnalysisError::BadRequest`].
    pub fn check(&self) -> Result<(), AnalysisError> {
        let refused = |what: &str, detail: String| Err(AnalysisError::BadRequest { what: what.into(), detail });
        let given = [(&AC_FROM, OptionValue::Number(self.from)), (&AC_TO, OptionValue::Number(self.to))];
        for (option, value) in given.into_iter().chain([(&AC_POINTS, OptionValue::Count(self.points))]) {
            if let Err(e) = option.check(&value) {
                return refused(option.name, format!("expected {}, got {}", e.expected, e.got));
            }
        }
        if let Some(count) = self.modes
            && let Err(e) = AC_MODES.check(&OptionValue::Count(count))
        {
            return refused("modes", format!("expected {}, got {}", e.expected, e.got));
        }
        if self.from >= self.to {
            return refused(
                "to",
                format!("expected a frequency above from ({:e} Hz), got {:e} Hz", self.from, self.to),
            );
        }
        let most = bimorph_model::options::analysis::MAX_FREQUENCIES;
        let count = grid::count(self.spacing, self.points, [self.from, self.to]).filter(|count| *count <= most);
        let Some(count) = count else {
            return refused("points", format!("expected at most {most} in all; take fewer, or a narrower band"));
        };
        if count.saturating_mul(self.signals.len().max(1)) > MAX_VALUES {
            let got = self.signals.len();
            return refused(
                "points",
                format!("{count} for {got} signals are more than {MAX_VALUES} values; take fewer"),
            );
        }
        Ok(())
    }

    /// Bytes that the numbers of the answer take at most, as doubles.
    pub fn bytes(&self) -> usize {
        let even = grid::count(self.spacing, self.points, [self.from, self.to]).unwrap_or(usize::MAX);
        let more = if self.even { 0 } else { grid::MAX_ADDED };
        even.saturating_add(more).saturating_mul(1 + 2 * self.signals.len().max(1)).saturating_mul(8)
    }
}
