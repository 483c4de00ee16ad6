//! Paths of drives that an equilibrium follows.

use crate::gaps::Drive;
use crate::gaps::drive::Electrics;

/// A path of drives: fills in the drive, or its rate of change, at s in 0…1.
pub trait LoadPath {
    /// The drive at `s`.
    fn at(&self, s: f64, drive: &mut Drive);
    /// d(drive)/ds at `s`.
    fn slope(&self, s: f64, slope: &mut Drive);
}

/// Source voltages and dead loads that go linearly from one value to another, heaters at their steady temperature.
#[derive(Debug, Clone)]
pub struct SourcePath<'a> {
    electrics: &'a Electrics,
    from: &'a [f64],
    to: &'a [f64],
    load: [f64; 2],
}

impl<'a> SourcePath<'a> {
    /// From source voltages `from` to `to` [V], and the share `load` of dead loads and built-in strains at both ends.
    pub fn new(electrics: &'a Electrics, from: &'a [f64], to: &'a [f64], load: [f64; 2]) -> Self {
        Self { electrics, from, to, load }
    }

    /// Source voltage `i` at `s`.
    fn source(&self, i: usize, s: f64) -> f64 {
        if s >= 1.0 { self.to[i] } else { self.from[i] + s * (self.to[i] - self.from[i]) }
    }
}

impl LoadPath for SourcePath<'_> {
    fn at(&self, s: f64, drive: &mut Drive) {
        let e = self.electrics;
        for (g, v) in drive.volts.iter_mut().enumerate() {
            *v = (0..self.to.len()).map(|i| e.gap_rows[(g, i)] * self.source(i, s)).sum();
        }
        for k in 0..drive.expansion.len() {
            let h = &e.heating;
            let rise = if s >= 1.0 {
                h.steady(k, self.to)
            } else {
                let [a, b, c] = h.between(k, self.from, self.to);
                a + s * (b + s * c)
            };
            drive.expansion[k] = h.heaters[k].expansion * rise;
        }
        drive.load = self.load[0] + s * (self.load[1] - self.load[0]);
        for (k, value) in drive.inputs.iter_mut().enumerate() {
            *value = self.source(e.voltages() + k, s);
        }
        drive.turning = 0.0;
    }

    fn slope(&self, s: f64, slope: &mut Drive) {
        let e = self.electrics;
        for (g, v) in slope.volts.iter_mut().enumerate() {
            *v = (0..self.to.len()).map(|i| e.gap_rows[(g, i)] * (self.to[i] - self.from[i])).sum();
        }
        for k in 0..slope.expansion.len() {
            let h = &e.heating;
            let [_, b, c] = h.between(k, self.from, self.to);
            slope.expansion[k] = h.heaters[k].expansion * (b + 2.0 * s * c);
        }
        slope.load = self.load[1] - self.load[0];
        for (k, value) in slope.inputs.iter_mut().enumerate() {
            *value = self.to[e.voltages() + k] - self.from[e.voltages() + k];
        }
        slope.turning = 0.0;
    }
}
