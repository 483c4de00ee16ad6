//! How a temperature rise lags behind its steady value.
//!
//! With a time constant τ the mean rise of a beam follows its steady value, dT̄/dt = (T̄_steady(u(t)) − T̄)/τ. During a step the
//! source voltages u go linearly in time, T̄_steady is a parabola ([`super::thermal`]), and the lag is integrated exactly.

/// 1/(n + 3)!, the series of φ₃. Fifteen terms carry |z| < ½ to 1e-17 of φ₃(0) = 1/6.
const PHI_3: [f64; 15] = {
    let mut terms = [1.0 / 6.0; 15];
    let mut n = 1;
    while n < terms.len() {
        terms[n] = terms[n - 1] / (n + 3) as f64;
        n += 1;
    }
    terms
};

/// φ₁, φ₂, φ₃ of the exponential integrators: φ_k(z) = ∫₀¹ e^{(1−σ)z} σ^{k−1}/(k−1)! dσ (Hochbruck & Ostermann 2010), and
/// exp(z). Near 0 by the series of φ₃ and φ_k = z·φ_{k+1} + 1/k!, which cancels nothing there.
#[inline]
pub fn phi(z: f64) -> ([f64; 3], f64) {
    if z.abs() < 0.5 {
        let three = PHI_3.iter().rev().fold(0.0, |sum, term| sum * z + term);
        let two = z * three + 0.5;
        let one = z * two + 1.0;
        ([one, two, three], z * one + 1.0)
    } else {
        let one = z.exp_m1() / z;
        let two = (one - 1.0) / z;
        ([one, two, (two - 0.5) / z], z.exp())
    }
}

/// The rise at time `t` after it was `start`, while its steady value is p₀ + p₁·s + p₂·s² (K).
#[inline]
pub fn lagged(start: f64, time_constant: f64, t: f64, p: [f64; 3]) -> f64 {
    Lag::new(time_constant, t).rise(start, p)
}

/// Exponentials of a time over a time constant, common to all heaters with this time constant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lag {
    time_constant: f64,
    t: f64,
    x: f64,
    f: [f64; 3],
    decay: f64,
}

impl Lag {
    /// At time `t` after the start (s).
    #[inline]
    pub fn new(time_constant: f64, t: f64) -> Self {
        let x = t / time_constant;
        let (f, decay) = phi(-x);
        Self { time_constant, t, x, f, decay }
    }

    /// Of a rise that goes towards one that stays: start·d + x·(last·f), as d, x and f.
    #[inline]
    pub fn towards(&self) -> [f64; 3] {
        [self.decay, self.x, self.f[0]]
    }

    /// See [`lagged`].
    #[inline]
    pub fn rise(&self, start: f64, p: [f64; 3]) -> f64 {
        let (t, x, [f1, f2, f3], decay) = (self.t, self.x, &self.f, self.decay);
        start * decay + x * (p[0] * f1 + p[1] * t * f2 + 2.0 * p[2] * t * t * f3)
    }
}

/// Time constants whose exponentials are kept.
const CACHED_LAGS: usize = 4;

/// The lags of heaters at one time: those of the last few time constants are not computed again.
#[derive(Debug, Clone)]
pub struct Lags {
    /// Time after the start (s).
    pub t: f64,
    kept: [Option<Lag>; CACHED_LAGS],
    next: usize,
}

impl Lags {
    /// At time `t` after the start (s).
    #[inline]
    pub fn new(t: f64) -> Self {
        Self { t, kept: [None; CACHED_LAGS], next: 0 }
    }

    /// Of a time constant (s), which is not zero.
    #[inline]
    pub fn of(&mut self, time_constant: f64) -> &Lag {
        let has = |kept: &Option<Lag>| kept.as_ref().is_some_and(|lag| lag.time_constant == time_constant);
        let place = self.kept.iter().position(has).unwrap_or_else(|| {
            let place = self.next;
            self.next = (place + 1) % CACHED_LAGS;
            self.kept[place] = None;
            place
        });
        self.kept[place].get_or_insert_with(|| Lag::new(time_constant, self.t))
    }

    /// Change of a rise whose steady value changes by p₁·s + p₂·s² (K) and which follows it at once without a time constant (s).
    #[inline]
    pub fn change(&mut self, time_constant: f64, [p1, p2]: [f64; 2]) -> f64 {
        if time_constant > 0.0 { self.of(time_constant).rise(0.0, [0.0, p1, p2]) } else { self.t * (p1 + self.t * p2) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The exact lag agrees with the closed solution of dT/dt = (a + bt + ct² − T)/τ, for short and long steps.
    #[test]
    fn lag_is_exact() {
        let (a, b, c, tau, start): (f64, f64, f64, f64, f64) = (3.0, -2.0, 5.0, 0.7, 1.5);
        let exact = |t: f64| {
            let (c2, c1) = (c, b - 2.0 * tau * c);
            let c0 = a - tau * c1;
            c0 + c1 * t + c2 * t * t + (start - c0) * (-t / tau).exp()
        };
        for t in [1e-3f64, 0.2, 0.4, 3.0, 30.0] {
            assert!((lagged(start, tau, t, [a, b, c]) - exact(t)).abs() < 1e-12 * exact(t).abs());
        }
        assert!((lagged(start, 1e9, 1e-3, [a, b, c]) - start).abs() < 1e-11);
    }

    /// Lags that are kept are those that are computed, whatever the order of more time constants than are kept.
    #[test]
    fn kept_lags_are_the_same() {
        let mut lags = Lags::new(1.3e-6);
        for k in [0, 1, 2, 0, 3, 4, 5, 1, 0, 5, 5, 2] {
            let tau = 1e-6 * (1.0 + f64::from(k));
            assert_eq!(*lags.of(tau), Lag::new(tau, 1.3e-6));
        }
    }
}
