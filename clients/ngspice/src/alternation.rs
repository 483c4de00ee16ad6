//! Alternation of currents from point to point: an error of the trapezoidal rule.
//!
//! i = 2·(q − q₁)/h − i₁ keeps an error of i₁ and inverts its sign at each step, as in any capacitor of ngspice. At each accepted point the current is
//! compared with the derivative of the parabola through three charges. Where their difference changes its sign from point to point, half of its
//! deviation from the mean of its neighbours is the alternation. On a smooth curve that is of fourth order in the step.
//!
//! Reference — L. W. Nagel, *SPICE2* (ERL-M520, Berkeley 1975), §4: the oscillation of the trapezoidal rule.

use crate::history::Base;
use bimorph::netlist::Diagnostic;

/// Code of the warning.
const CODE: &str = "W047";
/// Smallest alternation that is reported, as a fraction of the range of the current (1).
const REPORTED: f64 = 3e-3;
/// Points in a row that must alternate: a corner of a source makes few.
const MIN_POINTS: u32 = 12;
/// Relative error of a charge that integrators leave (1).
const NOISE: f64 = 1e-7;
/// By how much an alternation is larger than the one that was reported last, to be reported again (1).
const GROWS: f64 = 3.0;
/// Ratio of a step to the one before it below which a point has no derivative (1).
const MIN_RATIO: f64 = 1e-3;

/// Alternation of an instance's currents at its accepted points.
#[derive(Debug, Clone, Default)]
pub(crate) struct Alternation {
    /// Length of the last step (s); 0 without a step since an equilibrium.
    step: f64,
    ports: Vec<PortAlternation>,
}

#[derive(Debug, Clone, Copy, Default)]
struct PortAlternation {
    /// Charges at the last two points, the last first (C).
    charges: [f64; 2],
    /// Current of the charge at the last point (A).
    current: f64,
    /// Differences between current and derivative, the last first (A).
    off: [f64; 3],
    /// Range of the derivative (A).
    range: [f64; 2],
    /// Points in a row at which the difference changed its sign by as much.
    points: u32,
    /// Largest reported alternation, relative to its range (1).
    reported: f64,
}

impl PortAlternation {
    /// Alternation (A) at the point before the last, where it is one.
    fn add(&mut self, [before, step]: [f64; 2], charge: f64) -> f64 {
        let [last, first] = self.charges;
        let slopes = [(last - first) / before, (charge - last) / step];
        let derivative = (slopes[0] * step + slopes[1] * before) / (step + before);
        self.range = [self.range[0].min(derivative), self.range[1].max(derivative)];
        self.off = [self.current - derivative, self.off[0], self.off[1]];
        let [a, b, c] = self.off;
        let size = (0.5 * (b - 0.5 * (a + c))).abs();
        let least = (REPORTED * (self.range[1] - self.range[0])).max(NOISE * charge.abs() / step);
        if a * b < 0.0 && b * c < 0.0 && size > least {
            self.points += 1;
            size
        } else {
            self.points = 0;
            0.0
        }
    }
}

impl Alternation {
    /// Warnings after an accepted point: `step` (s), 0 at an equilibrium; `names` of the ports. A port is reported again at three times as much.
    pub(crate) fn accepted<'a>(
        &mut self,
        step: f64,
        charges: &[f64],
        base: &Base,
        names: impl Iterator<Item = &'a str>,
    ) -> Vec<Diagnostic> {
        let known = self.step > 0.0 && self.ports.len() == charges.len();
        if step == 0.0 || self.ports.len() != charges.len() {
            self.ports = vec![PortAlternation::default(); charges.len()];
        }
        let even = known && step > MIN_RATIO * self.step;
        let mut warnings = Vec::new();
        for ((port, name), (charge, current)) in
            self.ports.iter_mut().zip(names).zip(charges.iter().zip(&base.currents))
        {
            let size = if even { port.add([self.step, step], *charge) } else { 0.0 };
            if !even {
                port.points = 0;
            }
            port.charges = [*charge, port.charges[0]];
            port.current = *current;
            // a charge that stands still has no range
            let share = size / (port.range[1] - port.range[0]).max(size);
            if port.points >= MIN_POINTS && share > GROWS * port.reported {
                port.reported = share;
                warnings.push(Diagnostic::warning(
                    CODE,
                    format!(
                        "the current of port `{name}` alternates from point to point by {share:.1e} of its range: the trapezoidal rule keeps an \
                         error of a current with the other sign at each step"
                    ),
                    "`.options method=gear` or `xmu=0.4` damps it, and steps half as long make less of it",
                ));
            }
        }
        self.step = step;
        warnings
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reports for a charge q(t) at these times, with an error `wrong` of its current that alternates in sign.
    fn reports(q: impl Fn(f64) -> f64, i: impl Fn(f64) -> f64, wrong: f64, step: impl Fn(u32) -> f64) -> usize {
        let (mut found, mut t) = (Alternation::default(), 0.0);
        let base = |current: f64| Base { currents: vec![current], ..Base::default() };
        let mut count = found.accepted(0.0, &[q(0.0)], &base(0.0), ["p"].into_iter()).len();
        for n in 0..400 {
            t += step(n);
            let alternating = if n % 2 == 0 { wrong } else { -wrong };
            count += found.accepted(step(n), &[q(t)], &base(i(t) + alternating), ["p"].into_iter()).len();
        }
        count
    }

    /// A sine of 28 points a cycle, even or uneven steps, is no alternation by itself; one of 5 % of its range is reported once.
    #[test]
    fn alternation_is_distinguished_from_motion() {
        let even = |_: u32| std::f64::consts::TAU / 28.0;
        let uneven = |n: u32| even(n) * [1.3, 0.7, 1.1, 0.9, 1.0][n as usize % 5];
        assert_eq!(reports(f64::sin, f64::cos, 0.0, even), 0);
        assert_eq!(reports(f64::sin, f64::cos, 0.0, uneven), 0);
        assert_eq!(reports(f64::sin, f64::cos, 0.1, even), 1);
        assert_eq!(reports(f64::sin, f64::cos, 0.1, uneven), 1);
    }

    /// Ramps, constants and an alternation of a quarter of a percent of the range report nothing.
    #[test]
    fn what_is_small_is_not_reported() {
        let even = |_: u32| 0.2;
        assert_eq!(reports(|t| 3.0 * t, |_| 3.0, 0.0, even), 0);
        assert_eq!(reports(|_| 1.0, |_| 0.0, 0.0, even), 0);
        assert_eq!(reports(f64::sin, f64::cos, 0.005, even), 0);
    }
}
