//! Charges become currents: d/dt q over the accepted points, by the rule with which ngspice integrates its own capacitors.
//!
//! With h the step, h₁ the one before it, q₁ and q₂ the charges at the last two points, i₁ the current at the last,
//!
//! ```text
//! first order       i = (q − q₁)/h
//! trapezoidal       i = (q − q₁)/(h·(1 − μ)) − μ/(1 − μ)·i₁                                      (μ = ½, `xmu` of the deck)
//! Gear's method     i = (1 + κ)·(q − q₁)/h + κ·(q₂ − q₁)/h₁,     κ = h/(h + h₁)          (BDF2, also where `maxord` is higher)
//! ```
//!
//! **It must be ngspice's rule, step by step.** A node between this charge and a capacitor keeps its charge because
//! both integrate the same current in the same way. With any other rule of the same order, damped or undamped, the
//! residuals of the steps add up: an island of a plate and a capacitor lost nine tenths of its charge in a hundred
//! cycles. So ngspice drops to first order where it does, at the first step and after each breakpoint, and `method` and
//! `xmu` count here, too. The trapezoidal rule turns a tank of an inductor and a charge by an angle, whatever the
//! lengths of the steps: a swing keeps its height. An error of a current persists with alternating sign, as in any
//! capacitor of ngspice; `xmu` below ½ damps it.
//!
//! **Steps of rounding.** Around a source's corner ngspice takes steps of 10⁻¹⁸ s, over which a charge changes by no more than its own rounding, and by
//! which no conductance may be divided. Where [`hidden`] says so the current is the last one, plus what the charge departs from that line over the
//! [`shortest`] step. BDF2, which would divide by such a step again, takes it as one with the step before.
//!
//! References — L. W. Nagel, *SPICE2* (ERL-M520, Berkeley 1975), §4: the trapezoidal rule and its restart at breakpoints; Hairer, Nørsett, Wanner,
//! *Solving Ordinary Differential Equations I* (1993), III.5: variable-step BDF2.

/// How a step is differentiated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DifferentiationRule {
    /// Backward Euler: nothing before the last point counts.
    First,
    /// The trapezoidal rule with this fraction of the current at the last point (1), ½ unless the deck says otherwise.
    Trapezoidal(f64),
    /// BDF2.
    Gear,
}

/// Steps below this fraction of the time since the start may be of rounding (1): about 10⁶ roundings of the time.
const RESOLUTION: f64 = 1e-10;
/// Fraction of the largest current that rounding may make (1).
const SEEN: f64 = 1e-5;

/// The shortest step to differentiate over that ends at `t` (s), where rounding hides the slope.
pub fn shortest(t: f64) -> f64 {
    RESOLUTION * t
}

/// Whether a step `h` (s) that ends at `t` is so short that the rounding of a charge `q` (C) makes a current of its own beside the largest so far, `peak` (A).
pub fn hidden((t, h): (f64, f64), q: f64, peak: f64) -> bool {
    h < shortest(t) && f64::EPSILON * q.abs() > SEEN * peak * h
}

/// dq/dt = `slope`·(q − q₁) + `second`·(q₂ − q₁) − `memory`·i₁, for every port of an instance alike.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Companion {
    /// Factor of the new charge (1/s).
    pub slope: f64,
    /// Factor of the charge accepted before the last (1/s).
    pub second: f64,
    /// Factor of the current at the last point (1).
    pub memory: f64,
}

impl Companion {
    /// For a step `h` (s) by a rule, after a step of `before` (s); 0 without a step since the last change of slope.
    pub fn new(rule: DifferentiationRule, h: f64, before: f64) -> Self {
        match rule {
            DifferentiationRule::Trapezoidal(mu) => {
                Self { slope: 1.0 / h / (1.0 - mu), second: 0.0, memory: mu / (1.0 - mu) }
            }
            DifferentiationRule::Gear if before > 0.0 => {
                let bend = h / (h + before);
                Self { slope: (1.0 + bend) / h, second: bend / before, memory: 0.0 }
            }
            DifferentiationRule::First | DifferentiationRule::Gear => Self { slope: 1.0 / h, second: 0.0, memory: 0.0 },
        }
    }

    /// Displacement current (A) for the charges `q` now and `before` at the last two accepted points, the last first (C), after
    /// a current of `last` (A).
    pub fn current(&self, q: f64, before: [f64; 2], last: f64) -> f64 {
        // Differences: the factors sum to zero, and a large constant charge must not leave a residue.
        let [q1, q2] = before;
        self.slope * (q - q1) + self.second * (q2 - q1) - self.memory * last
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A parabola is differentiated exactly, whatever the ratio of the steps.
    #[test]
    fn parabolas_are_exact() {
        let (q, i) = (|t: f64| 3.0 - 2.0 * t + 5.0 * t * t, |t: f64| -2.0 + 10.0 * t);
        for rule in [DifferentiationRule::Trapezoidal(0.5), DifferentiationRule::Gear] {
            for (h, h1) in [(1.0, 1.0), (0.5, 1.0), (2.0, 0.5), (0.01, 1.0), (9.0, 1e-3)] {
                let t = 0.7;
                let got = Companion::new(rule, h, h1).current(q(t), [q(t - h), q(t - h - h1)], i(t - h));
                assert!((got - i(t)).abs() < 1e-11 * q(t - h).abs().max(1.0) / h1, "{rule:?}, h {h} after {h1}: {got}");
            }
        }
    }

    /// Where the slope begins anew nothing beyond the last point counts, neither a charge nor a current.
    #[test]
    fn nothing_reaches_back_over_a_corner() {
        for (rule, before) in [
            (DifferentiationRule::First, 1e-9),
            (DifferentiationRule::First, 0.0),
            (DifferentiationRule::Gear, 0.0),
            (DifferentiationRule::Trapezoidal(0.0), 1e-9),
        ] {
            assert_eq!(Companion::new(rule, 1e-9, before).current(2.0, [1.0, 77.0], 99.0), 1.0 / 1e-9);
        }
    }

    /// A constant charge drives no current. A previous error persists as long as the deck's `xmu` permits.
    #[test]
    fn a_constant_charge_drives_no_current() {
        for rule in [DifferentiationRule::First, DifferentiationRule::Trapezoidal(0.5), DifferentiationRule::Gear] {
            assert_eq!(Companion::new(rule, 3e-9, 2e-9).current(1e-3, [1e-3; 2], 0.0), 0.0);
        }
        let after = |mu: f64, n: usize| {
            (0..n).fold(1.0, |i, _| {
                Companion::new(DifferentiationRule::Trapezoidal(mu), 1e-9, 1e-9).current(1e-3, [1e-3; 2], i)
            })
        };
        assert!(after(0.5, 10) == 1.0 && after(0.45, 12).abs() < 0.1);
    }

    /// A step of a few roundings of the time hides the slope of a comb of 0.2 pC and 0.1 nA. A step of a picosecond at
    /// 1 s does not hide a pulse of 1 mA. The first step and an empty charge hide nothing.
    #[test]
    fn steps_of_rounding_are_too_short() {
        assert!(hidden((64e-6, 1e-18), 2e-13, 1e-10) && !hidden((64e-6, 1e-12), 2e-13, 1e-10));
        assert!(
            !hidden((1.0, 1e-12), 4e-12, 1e-3)
                && !hidden((1.0, 1e-12), 0.0, 0.0)
                && !hidden((1e-12, 1e-12), 1e-13, 0.0)
        );
    }

    /// Halving the step quarters the error: second order on a smooth charge.
    #[test]
    fn second_order_on_a_sine() {
        let error = |n: usize, rule: DifferentiationRule| {
            let h = 1.0 / n as f64;
            let c = Companion::new(rule, h, h);
            let mut i = h.cos();
            let at = |k: usize| {
                let t = k as f64 * h;
                i = c.current(t.sin(), [(t - h).sin(), (t - 2.0 * h).sin()], i);
                (i - t.cos()).abs()
            };
            (2..=n).map(at).fold(0.0, f64::max)
        };
        for rule in [DifferentiationRule::Trapezoidal(0.5), DifferentiationRule::Gear] {
            let ratio = error(64, rule) / error(128, rule);
            assert!((3.8..4.2).contains(&ratio), "{rule:?}: {ratio}");
        }
    }

    /// 28 points a cycle (rad).
    const EVEN: f64 = std::f64::consts::TAU / 28.0;

    /// A tank at these steps (rad), i = q' by a rule, L·i' = −q by the trapezoidal rule as in ngspice: its swing at the end over that at the start.
    fn tank(rule: DifferentiationRule, steps: impl Iterator<Item = f64>) -> f64 {
        let (mut q, mut i, mut last, mut before) = ([1.0, EVEN.cos()], 0.0, 0.0, EVEN);
        for h in steps {
            let c = Companion::new(rule, h, before);
            let rest = c.current(0.0, q, last);
            let next = (i - 0.5 * h * q[0] - rest) / (c.slope + 0.5 * h);
            last = c.current(next, q, last);
            i -= 0.5 * h * (next + q[0]);
            (q, before) = ([next, q[0]], h);
        }
        q[0].hypot(i)
    }

    /// A tank keeps its swing, to rounding, at even steps and at uneven ones: such that breathe twice a cycle, alternate, or begin short after the
    /// corners of a source and double. Gear's method takes half of it within 76 cycles of 28 points.
    #[test]
    fn a_tank_keeps_its_swing() {
        let bdf2 = tank(DifferentiationRule::Gear, (0..28 * 76).map(|_| EVEN));
        assert!((0.5..0.6).contains(&bdf2), "{bdf2}");
        let breathing = |n: u32| EVEN * (1.0 + 0.4 * (2.0 * EVEN * f64::from(n)).sin());
        let alternating = |n: u32| EVEN * [1.4, 0.6][n as usize % 2];
        let doubling = |n: u32| EVEN * [0.02, 0.04, 0.08, 0.16, 0.32, 0.64, 1.0, 1.0, 0.3][n as usize % 9];
        let steps: [&dyn Fn(u32) -> f64; 4] = [&|_| EVEN, &breathing, &alternating, &doubling];
        for (k, steps) in steps.iter().enumerate() {
            let kept = tank(DifferentiationRule::Trapezoidal(0.5), (0..10_000).map(*steps));
            assert!((kept - 1.0).abs() < 1e-9, "{k}: {kept}");
        }
    }
}
