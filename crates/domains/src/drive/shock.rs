//! A shock: a half sine of the acceleration of the frame.

use std::f64::consts::PI;

/// Half sine of the frame's acceleration from the time 0 on: a(t) = peak·sin(π·t/duration) up to `duration`, then 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shock {
    /// Largest acceleration along x and y (m/s²).
    pub peak: [f64; 2],
    /// Length (s).
    pub duration: f64,
}

impl Shock {
    /// Acceleration along an axis at the time `t` (m/s²), and its rate (m/s³).
    pub(super) fn at(&self, axis: usize, t: f64) -> [f64; 2] {
        if !(0.0..self.duration).contains(&t) {
            return [0.0; 2];
        }
        let (sin, cos) = (PI * t / self.duration).sin_cos();
        [self.peak[axis] * sin, self.peak[axis] * PI / self.duration * cos]
    }
}
