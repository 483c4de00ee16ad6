//! A pole or a zero.

use nalgebra::Complex;
use serde::Serialize;
use std::f64::consts::TAU;

/// Real part that is rounding, as a fraction of |s|.
const UNDAMPED: f64 = 1e-13;

/// A pole or a zero, of each conjugate pair that in the upper half plane.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Root {
    /// Real part (rad/s).
    pub re: f64,
    /// Imaginary part (rad/s).
    pub im: f64,
}

impl Root {
    pub(super) fn new(s: Complex<f64>) -> Self {
        let (re, im) = (if s.re.abs() <= UNDAMPED * s.norm() { 0.0 } else { s.re }, s.im.abs());
        Self { re: re + 0.0, im: if im <= UNDAMPED * s.norm() { 0.0 } else { im } }
    }

    /// |s|/2π (Hz).
    pub fn frequency_hz(&self) -> f64 {
        self.re.hypot(self.im) / TAU
    }

    /// |s|/(2·|Re s|) (1); none where nothing damps it.
    pub fn quality(&self) -> Option<f64> {
        (self.re != 0.0).then(|| self.re.hypot(self.im) / (2.0 * self.re.abs()))
    }

    /// Distance of the half-power points of a lightly damped resonance, |Re s|/π (Hz).
    pub fn width_hz(&self) -> f64 {
        self.re.abs() / (0.5 * TAU)
    }

    /// True where its frequency lies within a band (Hz).
    pub(super) fn within(&self, [from, to]: [f64; 2]) -> bool {
        (from..=to).contains(&self.frequency_hz())
    }
}
