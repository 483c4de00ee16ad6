//! Pressure of gas in gaps during a run: the equations of films hold while it is small beside the ambient pressure.

use bimorph_domains::System;
use bimorph_solve::time::method::Motion;

/// Code of its warning.
const WARNING: &str = "W050";
/// Fraction of the ambient pressure from which it is reported (1).
const LARGE: f64 = 0.3;

/// The largest pressure so far.
#[derive(Debug)]
pub(super) struct FilmPressure<'a> {
    /// None without gas.
    system: Option<&'a System>,
    /// Of the ambient pressure (1).
    largest: f64,
    /// When (s).
    t: f64,
}

impl<'a> FilmPressure<'a> {
    /// Of a system at the start of a run.
    pub(super) fn new(system: &'a System) -> Self {
        Self { system: system.has_gas().then_some(system), largest: 0.0, t: 0.0 }
    }

    /// The end of a step at the time `t` (s).
    pub(super) fn step(&mut self, t: f64, motion: &Motion) {
        let Some(system) = self.system else { return };
        let pressure = system.film_pressure(&motion.q, |k| motion.v[k]);
        if pressure > self.largest {
            (self.largest, self.t) = (pressure, t);
        }
    }

    /// The warning of a pressure that is too large.
    pub(super) fn warning(&self) -> Option<String> {
        (self.largest > LARGE).then(|| {
            format!(
                "{WARNING}: the gas in a gap reaches {:.2} of its ambient pressure at {:.3e} s, and its equations are for small fractions of it: times \
                 of closing may be off by a tenth and more",
                self.largest, self.t
            )
        })
    }
}
