//! Charges become currents: d/dt q by backward differences over the accepted points.
//!
//! With h the step, h₁ and h₂ those before it, and divided differences over the points t, t₁, t₂, t₃,
//!
//! ```text
//! dq/dt = q[t,t₁] + h·q[t,t₁,t₂] + ½·h·(h + h₁)·q[t,t₁,t₂,t₃]
//! ```
//!
//! is the middle between the variable-step BDF2 and BDF3 formulas. At even steps, with ∇ the backward difference and z = iωh,
//!
//! ```text
//! h·dq/dt = ∇q + ½·∇²q + ⅙·∇³q = (z − z³/6 + z⁶/12 …)·q,   Re = ⅔·(1 − cos ωh)³ ≥ 0.
//! ```
//!
//! It is of second order with half the error of BDF2, A-stable as that is, and strongly damped at long steps; but a swing
//! keeps its height: a tank of an inductor and this charge loses (ωh)⁶/24 a step, where BDF2 takes (ωh)⁴/8 (half of
//! the swing within 76 cycles of 28 points). BDF3 itself would feed it, by as much.
//!
//! Backward Euler starts a transient and follows every sharp cut of the step
//! (h < 0.2·h₁), which is what a breakpoint looks like from here: the slope changes there, and a formula that reaches
//! back over the corner would ring; BDF2 follows it. The trapezoidal rule is not used: it remembers the current before the
//! corner and ngspice does not tell a code model when it drops to first order.
//!
//! Around a source's corner ngspice takes steps of rounding, 10⁻¹⁸ s, over which a charge changes by no more than its own
//! rounding. A point closer than [`shortest`] does not become t₁: the next ones are differentiated across it. Its
//! current is the slope so far, plus what the charge departs from that line over the shortest step.
//!
//! References — Hairer, Nørsett, Wanner, *Solving Ordinary Differential Equations I* (1993), III.5: variable-step BDF2
//! is stable for ρ = h/h₁ < 1 + √2; there the slopes of a charge at rest fall to 0.61 and less from step to step in
//! the formula above, too; V. N. Vatsa, M. H. Carpenter, D. P. Lockard, *Re-evaluation of an optimized second
//! order backward difference (BDF2OPT) scheme for unsteady flow applications*, AIAA 2010-0122: the family between BDF2 and
//! BDF3.

/// A step shorter than this share of the one before it restarts with backward Euler [1].
const RESTART_BELOW: f64 = 0.2;
/// A step longer than this multiple of the one before it does, too: BDF2 is not stable beyond 1 + √2 [1].
const RESTART_ABOVE: f64 = 2.4;

/// Two points closer than this share of the time since the start tell no slope [1]: about 10⁶ roundings of the time.
const RESOLUTION: f64 = 1e-10;

/// The shortest step to differentiate over that ends at `t` [s].
pub fn shortest(t: f64) -> f64 {
    RESOLUTION * t
}

/// dq/dt = `slope`·(q − q₁) + `second`·(q₂ − q₁) + `third`·(q₃ − q₁), for every port of an instance alike.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Companion {
    /// Factor of the new charge [1/s].
    pub slope: f64,
    /// Factor of the charge accepted before the last [1/s]; 0 in backward Euler.
    pub second: f64,
    /// Factor of the charge accepted before that [1/s]; 0 where the slope changed since.
    pub third: f64,
}

impl Companion {
    /// For a step `h` [s] after the steps `before`, the last one first [s]; 0 where there was none since the slope changed.
    pub fn new(h: f64, before: [f64; 2]) -> Self {
        let [h1, h2] = before;
        let even = |ratio: f64| (RESTART_BELOW..=RESTART_ABOVE).contains(&ratio);
        if !even(h / h1) {
            return Self { slope: 1.0 / h, second: 0.0, third: 0.0 };
        }
        let two = h + h1;
        let bdf2 = Self { slope: (two + h) / (two * h), second: h / (two * h1), third: 0.0 };
        if !even(h1 / h2) {
            return bdf2;
        }
        // β·h·(h + h₁)·q[t,t₁,t₂,t₃], by Lagrange's denominators
        let three = two + h2;
        let beta = (h + two) / (h + two + three);
        Self {
            slope: bdf2.slope + beta / three,
            second: bdf2.second + beta * h / (h1 * h2),
            third: -beta * h * two / (three * (h1 + h2) * h2),
        }
    }

    /// Whether nothing before the last point counts: the slope begins anew.
    pub fn restarts(&self) -> bool {
        self.second == 0.0
    }

    /// Displacement current [A] for the charges `q` now and `before` at the last three accepted points, the last first [C].
    pub fn current(&self, q: f64, before: [f64; 3]) -> f64 {
        // Differences: the factors sum to zero, and a large constant charge must not leave a residue.
        let [q1, q2, q3] = before;
        self.slope * (q - q1) + self.second * (q2 - q1) + self.third * (q3 - q1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A parabola is differentiated exactly, whatever the ratio of the steps.
    #[test]
    fn parabolas_are_exact() {
        let q = |t: f64| 3.0 - 2.0 * t + 5.0 * t * t;
        for (h, h1, h2) in
            [(1.0, 1.0, 0.0), (0.5, 1.0, 0.0), (1.0, 1.0, 1.0), (2.0, 1.0, 0.5), (0.21, 1.0, 2.0), (0.5, 1.0, 9.0)]
        {
            let t = 0.7;
            let c = Companion::new(h, [h1, h2]);
            let got = c.current(q(t), [q(t - h), q(t - h - h1), q(t - h - h1 - h2)]);
            assert!((got - (-2.0 + 10.0 * t)).abs() < 1e-12, "h {h} after {h1}, {h2}: {got}");
        }
    }

    /// With even steps the factors are ∇ + ½∇² + ⅙∇³: 5/3, −5/2, 1, −1/6.
    #[test]
    fn even_steps_are_the_middle_of_bdf2_and_bdf3() {
        let c = Companion::new(1.0, [1.0, 1.0]);
        let near = |a: f64, b: f64| (a - b).abs() < 1e-15;
        assert!(near(c.slope, 5.0 / 3.0) && near(c.second, 1.0) && near(c.third, -1.0 / 6.0), "{c:?}");
    }

    /// The first step, a sharp cut and a jump in length use backward Euler: no memory beyond the last point. One step
    /// later nothing before the corner counts.
    #[test]
    fn nothing_reaches_back_over_a_corner() {
        for (h, h1) in [(1e-9, 0.0), (1e-9, 1e-8), (1e-8, 1e-9)] {
            let c = Companion::new(h, [h1, 1e-9]);
            assert!(c.restarts());
            assert_eq!(c.current(2.0, [1.0, 77.0, 99.0]), 1.0 / h);
        }
        let c = Companion::new(1e-9, [1e-9, 0.0]);
        assert!(!c.restarts());
        assert_eq!(c.current(2.0, [1.0, 0.5, 99.0]), c.current(2.0, [1.0, 0.5, -99.0]));
    }

    /// The factors sum to zero: a constant charge drives no current.
    #[test]
    fn a_constant_charge_drives_no_current() {
        for (h, h1, h2) in [(1e-9, 1e-9, 1e-9), (3e-9, 2e-9, 0.0), (1e-9, 0.0, 0.0)] {
            assert_eq!(Companion::new(h, [h1, h2]).current(1e-3, [1e-3; 3]), 0.0);
        }
    }

    /// A step of a few roundings of the time is too short; a step of a picosecond at 1 ms is not.
    #[test]
    fn steps_of_rounding_are_too_short() {
        assert!(1e-18 < shortest(64e-6) && 1e-12 > shortest(1e-3) && 1e-15 > shortest(1e-15));
    }

    /// Halving the step quarters the error: second order on a smooth charge, with half the error of BDF2.
    #[test]
    fn second_order_on_a_sine() {
        let error = |n: usize, third: f64| {
            let h = 1.0 / n as f64;
            let c = Companion::new(h, [h, third * h]);
            let at = |t: f64| (c.current(t.sin(), [1.0, 2.0, 3.0].map(|k| (t - k * h).sin())) - t.cos()).abs();
            (3..=n).map(|i| at(i as f64 * h)).fold(0.0, f64::max)
        };
        let ratio = error(64, 1.0) / error(128, 1.0);
        assert!((3.8..4.2).contains(&ratio), "{ratio}");
        let less = error(128, 0.0) / error(128, 1.0);
        assert!((1.9..2.1).contains(&less), "{less}");
    }

    /// A tank keeps its swing: i = q' by this formula, L·i' = −q by the trapezoidal rule as in ngspice, 76 cycles of 28
    /// points. BDF2 takes half of it.
    #[test]
    fn a_tank_keeps_its_swing() {
        let h = std::f64::consts::TAU / 28.0;
        let last_cycle = |third: f64| {
            let c = Companion::new(h, [h, third * h]);
            let (mut q, mut i) = ([1.0, h.cos(), (2.0 * h).cos()], 0.0);
            let mut largest = 0.0f64;
            for n in 0..28 * 76 {
                let rest = c.current(q[0], q);
                let next = ((c.slope - 0.5 * h) * q[0] - rest + i) / (c.slope + 0.5 * h);
                i -= 0.5 * h * (next + q[0]);
                q = [next, q[0], q[1]];
                largest = if n < 28 * 75 { 0.0 } else { largest.max(next.abs()) };
            }
            largest
        };
        let (kept, bdf2) = (last_cycle(1.0), last_cycle(0.0));
        assert!((0.98..1.0).contains(&kept), "{kept}");
        assert!((0.5..0.6).contains(&bdf2), "{bdf2}");
    }
}
