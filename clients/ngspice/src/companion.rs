//! Charges become currents: d/dt q over the accepted points, as ngspice's own integration is set.
//!
//! With h the step, h₁ the one before it, i₁ the current at the point before, and divided differences over the points t, t₁, t₂,
//!
//! ```text
//! i = α·(2·q[t,t₁] − i₁) + (1 − α)·(q[t,t₁] + h·q[t,t₁,t₂]),      α = 0.9
//! ```
//!
//! lies between the trapezoidal rule and the variable-step BDF2, nearer the first. At even steps, with z = iωh,
//!
//! ```text
//! h·dq/dt = (z − z³/10.4 …)·q,   Re = (1 − α)·(1 − cos ωh)²/|1 + α·e⁻ᶻ|² ≥ 0.
//! ```
//!
//! It is of second order with three tenths of the error of BDF2, and A-stable as both its parts are. A swing keeps its height: the
//! trapezoidal rule turns a tank of an inductor and a charge by an angle, whatever the lengths of the steps, and the other
//! part takes (ωh)⁴/290 a step, where BDF2 alone takes (ωh)⁴/8 (half of the swing within 76 cycles of 28 points). A formula of
//! charges alone with less damping than BDF2 (the middle between BDF2 and BDF3 has next to none) feeds a tank where steps are uneven, as any
//! source with corners makes them. What the trapezoidal rule remembers of a current that was wrong, it keeps for good, with the other sign at each
//! step; here it falls to a third within ten steps.
//!
//! **Where ngspice itself drops to first order** (the first step, and after each breakpoint) this is backward Euler as well: the slope changes
//! there, and nothing before the last point counts. `method=gear` takes BDF2 alone (α = 0).
//!
//! Around a source's corner ngspice takes steps of rounding, 10⁻¹⁸ s, over which a charge changes by no more than its own
//! rounding. A point closer than [`shortest`] does not become t₁: the next ones are differentiated across it. Its
//! current is the last one, plus what the charge departs from that line over the shortest step.
//!
//! References — L. W. Nagel, *SPICE2* (ERL-M520, Berkeley 1975), §4: the trapezoidal rule and its restart at breakpoints; Hairer, Nørsett, Wanner,
//! *Solving Ordinary Differential Equations I* (1993), III.5: variable-step BDF2. Its slopes of a charge at rest fall by h/(h + h₁) over
//! 1 + h/(h + h₁) from step to step, with the trapezoidal part to a twentieth at most, for any ratio of steps.

/// Share of the trapezoidal rule [1].
const TRAPEZOIDAL: f64 = 0.9;

/// How a step is differentiated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rule {
    /// Backward Euler: nothing before the last point counts.
    First,
    /// Between the trapezoidal rule and BDF2.
    Trapezoidal,
    /// BDF2.
    Gear,
}

/// Two points closer than this share of the time since the start tell no slope [1]: about 10⁶ roundings of the time.
const RESOLUTION: f64 = 1e-10;

/// The shortest step to differentiate over that ends at `t` [s].
pub fn shortest(t: f64) -> f64 {
    RESOLUTION * t
}

/// dq/dt = `slope`·(q − q₁) + `second`·(q₂ − q₁) − `memory`·i₁, for every port of an instance alike.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Companion {
    /// Factor of the new charge [1/s].
    pub slope: f64,
    /// Factor of the charge accepted before the last [1/s].
    pub second: f64,
    /// Factor of the current at the last point [1].
    pub memory: f64,
}

impl Companion {
    /// For a step `h` [s] by a rule, after a step of `before` [s]; 0 where there was none since the slope changed.
    pub fn new(rule: Rule, h: f64, before: f64) -> Self {
        let alpha = match rule {
            Rule::Trapezoidal => TRAPEZOIDAL,
            Rule::Gear => 0.0,
            Rule::First => return Self::euler(h),
        };
        if before == 0.0 {
            return Self::euler(h);
        }
        let bend = h / (h + before);
        Self {
            slope: ((1.0 - alpha) * (1.0 + bend) + alpha * 2.0) / h,
            second: (1.0 - alpha) * bend / before,
            memory: alpha,
        }
    }

    fn euler(h: f64) -> Self {
        Self { slope: 1.0 / h, second: 0.0, memory: 0.0 }
    }

    /// Displacement current [A] for the charges `q` now and `before` at the last two accepted points, the last first [C], after
    /// a current of `last` [A].
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
        for rule in [Rule::Trapezoidal, Rule::Gear] {
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
        for (rule, before) in [(Rule::First, 1e-9), (Rule::First, 0.0), (Rule::Trapezoidal, 0.0), (Rule::Gear, 0.0)] {
            assert_eq!(Companion::new(rule, 1e-9, before).current(2.0, [1.0, 77.0], 99.0), 1.0 / 1e-9);
        }
    }

    /// A constant charge drives no current, and what was wrong falls to a third within ten steps, of any lengths.
    #[test]
    fn a_constant_charge_drives_no_current() {
        for (h, h1) in [(1e-9, 1e-9), (3e-9, 2e-9), (1e-9, 0.0)] {
            assert_eq!(Companion::new(Rule::Trapezoidal, h, h1).current(1e-3, [1e-3; 2], 0.0), 0.0);
        }
        let steps = [1.0, 7.0, 0.1, 0.1, 30.0, 2.0, 2.0, 2.0, 5.0, 1e-3, 1.0];
        let left = steps
            .windows(2)
            .fold(1.0f64, |i, h| Companion::new(Rule::Trapezoidal, h[1], h[0]).current(1e-3, [1e-3; 2], i));
        assert!(left.abs() < 0.36, "{left}");
    }

    /// A step of a few roundings of the time is too short; a step of a picosecond at 1 ms is not.
    #[test]
    fn steps_of_rounding_are_too_short() {
        assert!(1e-18 < shortest(64e-6) && 1e-12 > shortest(1e-3) && 1e-15 > shortest(1e-15));
    }

    /// Halving the step quarters the error: second order on a smooth charge, with three tenths of the error of BDF2.
    #[test]
    fn second_order_on_a_sine() {
        let error = |n: usize, rule: Rule| {
            let h = 1.0 / n as f64;
            let c = Companion::new(rule, h, h);
            let mut i = h.cos();
            let at = |k: usize| {
                let t = k as f64 * h;
                i = c.current(t.sin(), [(t - h).sin(), (t - 2.0 * h).sin()], i);
                (i - t.cos()).abs()
            };
            // what the first point remembers has gone by then
            (2..=n).map(at).skip(n / 2).fold(0.0, f64::max)
        };
        let ratio = error(128, Rule::Trapezoidal) / error(256, Rule::Trapezoidal);
        assert!((3.8..4.2).contains(&ratio), "{ratio}");
        let less = error(256, Rule::Gear) / error(256, Rule::Trapezoidal);
        assert!((3.3..3.6).contains(&less), "{less}");
    }

    /// 28 points a cycle [rad].
    const EVEN: f64 = std::f64::consts::TAU / 28.0;

    /// A tank at these steps [rad], i = q' by a rule, L·i' = −q by the trapezoidal rule as in ngspice: its energy at the end over
    /// that at the start.
    fn tank(rule: Rule, steps: impl Iterator<Item = f64>) -> f64 {
        let (mut q, mut i, mut last, mut before) = ([1.0, EVEN.cos()], 0.0, 0.0, EVEN);
        for h in steps {
            let c = Companion::new(rule, h, before);
            let rest = c.current(0.0, q, last);
            let next = (i - 0.5 * h * q[0] - rest) / (c.slope + 0.5 * h);
            last = c.current(next, q, last);
            i -= 0.5 * h * (next + q[0]);
            (q, before) = ([next, q[0]], h);
        }
        q[0] * q[0] + i * i
    }

    /// A tank keeps its swing over 76 cycles of 28 points, and is fed by no sequence of uneven steps: steps that breathe twice a cycle, alternate,
    /// or begin short after the corners of a source and double.
    #[test]
    fn a_tank_keeps_its_swing_and_is_never_fed() {
        let kept = tank(Rule::Trapezoidal, (0..28 * 76).map(|_| EVEN)).sqrt();
        assert!((0.98..1.0).contains(&kept), "{kept}");
        let bdf2 = tank(Rule::Gear, (0..28 * 76).map(|_| EVEN)).sqrt();
        assert!((0.5..0.6).contains(&bdf2), "{bdf2}");
        for phase in 0..8 {
            let breathing = |n: u32| EVEN * (1.0 + 0.4 * (2.0 * EVEN * f64::from(n) + f64::from(phase)).sin());
            let alternating = |n: u32| EVEN * [1.4, 0.6][n as usize % 2];
            let doubling =
                |n: u32| EVEN * [0.02, 0.04, 0.08, 0.16, 0.32, 0.64, 1.0, 1.0, 0.3][(n + phase) as usize % 9];
            let uneven: [&dyn Fn(u32) -> f64; 3] = [&breathing, &alternating, &doubling];
            for (k, steps) in uneven.iter().enumerate() {
                let kept = tank(Rule::Trapezoidal, (0..10_000).map(*steps)).sqrt();
                assert!((0.5..1.0).contains(&kept), "{k}, {phase}: {kept}");
            }
        }
    }
}
