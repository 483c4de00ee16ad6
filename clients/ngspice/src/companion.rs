//! Charges become currents: d/dt q by backward differences over the accepted points.
//!
//! With h the step, h₁ the one before it and ρ = h/h₁, the variable-step BDF2 formula is
//!
//! ```text
//! dq/dt = a·q + r,   a = (1 + 2ρ)/((1 + ρ)·h),   r = [−(1 + ρ)·q₁ + ρ²/(1 + ρ)·q₂]/h
//! ```
//!
//! and backward Euler is a = 1/h, r = −q₁/h. Backward Euler starts a transient and follows every sharp cut of the step
//! (h < 0.2·h₁), which is what a breakpoint looks like from here: the slope changes there, and a formula that reaches
//! back over the corner would ring. The trapezoidal rule is not used: it remembers the current before the corner and
//! ngspice does not tell a code model when it drops to first order.
//!
//! Around a source's corner ngspice takes steps of rounding, 10⁻¹⁸ s, over which a charge changes by no more than its own
//! rounding. A point closer than [`shortest`] does not become q₁ or q₂: the next ones are differentiated across it. Its
//! current is the slope so far, plus what the charge departs from that line over the shortest step.
//!
//! Reference — Hairer, Nørsett, Wanner, *Solving Ordinary Differential Equations I* (1993), III.5: variable-step BDF2
//! is stable for ρ < 1 + √2.

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

/// dq/dt = `slope`·q + `now`·q₁ + `before`·q₂, for every port of an instance alike.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Companion {
    /// Factor of the new charge [1/s].
    pub slope: f64,
    /// Factor of the last accepted charge [1/s].
    pub now: f64,
    /// Factor of the charge accepted before that [1/s].
    pub before: f64,
}

impl Companion {
    /// For a step `h` [s] after a step `h_previous` [s]; 0 where there was none.
    pub fn new(h: f64, h_previous: f64) -> Self {
        let rho = h / h_previous;
        if !(RESTART_BELOW..=RESTART_ABOVE).contains(&rho) {
            return Self { slope: 1.0 / h, now: -1.0 / h, before: 0.0 };
        }
        let sum = 1.0 + rho;
        Self { slope: (sum + rho) / (sum * h), now: -sum / h, before: rho * rho / (sum * h) }
    }

    /// For a point closer than `shortest` [s].
    pub fn unresolved(shortest: f64) -> Self {
        Self { slope: 1.0 / shortest, now: -1.0 / shortest, before: 0.0 }
    }

    /// Displacement current [A] for the charges `q` now, `q1` and `q2` at the last two accepted points [C].
    pub fn current(&self, q: f64, q1: f64, q2: f64) -> f64 {
        // Differences first: the factors sum to zero, and a large constant charge must not leave a residue.
        self.slope * (q - q1) + self.before * (q2 - q1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// BDF2 differentiates a parabola exactly, whatever the ratio of the steps.
    #[test]
    fn bdf2_is_exact_for_parabolas() {
        let q = |t: f64| 3.0 - 2.0 * t + 5.0 * t * t;
        for (h, h1) in [(1.0, 1.0), (0.5, 1.0), (2.0, 1.0), (0.21, 1.0)] {
            let t = 0.7;
            let c = Companion::new(h, h1);
            let got = c.current(q(t), q(t - h), q(t - h - h1));
            assert!((got - (-2.0 + 10.0 * t)).abs() < 1e-12, "h {h} after {h1}: {got}");
        }
    }

    /// The first step, a sharp cut and a jump in length use backward Euler: no memory beyond the last point.
    #[test]
    fn backward_euler_at_start_and_after_a_cut() {
        for (h, h1) in [(1e-9, 0.0), (1e-9, 1e-8), (1e-8, 1e-9)] {
            let c = Companion::new(h, h1);
            assert_eq!(c.before, 0.0);
            assert_eq!(c.current(2.0, 1.0, 77.0), 1.0 / h);
        }
    }

    /// The factors sum to zero: a constant charge drives no current.
    #[test]
    fn a_constant_charge_drives_no_current() {
        for (h, h1) in [(1e-9, 1e-9), (3e-9, 2e-9), (1e-9, 0.0)] {
            let c = Companion::new(h, h1);
            assert!((c.slope + c.now + c.before).abs() * h < 1e-15);
            assert_eq!(c.current(1e-3, 1e-3, 1e-3), 0.0);
        }
    }

    /// A step of a few roundings of the time is too short; a step of a picosecond at 1 ms is not.
    #[test]
    fn steps_of_rounding_are_too_short() {
        assert!(1e-18 < shortest(64e-6) && 1e-12 > shortest(1e-3) && 1e-15 > shortest(1e-15));
    }

    /// Halving the step quarters the error: second order on a smooth charge.
    #[test]
    fn second_order_on_a_sine() {
        let error = |n: usize| {
            let h = 1.0 / n as f64;
            let c = Companion::new(h, h);
            (2..=n)
                .map(|i| {
                    let t = i as f64 * h;
                    (c.current(t.sin(), (t - h).sin(), (t - 2.0 * h).sin()) - t.cos()).abs()
                })
                .fold(0.0, f64::max)
        };
        let ratio = error(64) / error(128);
        assert!((3.8..4.2).contains(&ratio), "{ratio}");
    }
}
