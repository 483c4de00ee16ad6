//! A conductor of heat along which heat also leaves to its sides: functions of its length.
//!
//! With the conductance K from end to end, the conductance G of all of its length to the surroundings, and the heat P spread evenly
//! along it, the rise θ(s), s from 0 to 1, satisfies K·θ″ − G·θ + P = 0. With μ² = G/K (H. S. Carslaw, J. C. Jaeger, "Conduction of
//! Heat in Solids", §4.10)
//! ```text
//! heat into the node at a   P/2·share − aside·T_a − through·(T_a − T_b)
//! mean rise                 (T_a + T_b)/2·share + P·own
//! share = tanh(μ/2)/(μ/2)   through = K·μ/sinh μ   aside = K·μ·tanh(μ/2)   own = (1 − share)/G
//! ```
//! Without a loss to the sides these are 1, K, 0 and 1/(12·K). Their slopes with G give the delays of `conduction.rs`.

/// Largest μ² at which a difference is summed as a series (1).
const SMALL: f64 = 0.5;

/// Half of μ from which on the middle does not notice the ends, to the last bit of doubles (1).
const FAR: f64 = 300.0;

/// Largest μ² that does not change the highest rise, to the last bits of doubles (1).
const NO_LOSS: f64 = 1e-14;

/// Coefficients of tanh(x)/x in powers of x².
const TANH: [f64; 9] = [
    1.0,
    -1.0 / 3.0,
    2.0 / 15.0,
    -17.0 / 315.0,
    62.0 / 2835.0,
    -1382.0 / 155_925.0,
    21_844.0 / 6_081_075.0,
    -929_569.0 / 638_512_875.0,
    6_404_582.0 / 10_854_718_875.0,
];

/// A conductor of heat with a loss to its sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fin {
    /// Fraction of the rise at its ends in the mean rise, and of its heat that leaves through held ends (1).
    pub(super) share: f64,
    /// Conductance between its ends (W/K).
    pub(super) through: f64,
    /// Conductance from each end to the surroundings (W/K).
    pub(super) aside: f64,
    /// Mean rise between cold ends for each watt (K/W).
    pub(super) own: f64,
    /// μ² (1).
    y: f64,
}

impl Fin {
    /// Of the conductance from end to end and that to the sides (W/K).
    pub(super) fn new(conductance: f64, gas: f64) -> Self {
        if gas == 0.0 {
            return Self { share: 1.0, through: conductance, aside: 0.0, own: 1.0 / (12.0 * conductance), y: 0.0 };
        }
        let y = gas / conductance;
        let x = 0.5 * y.sqrt();
        let share = x.tanh() / x;
        let own = if y < SMALL { -series(y, 1, |_| 1.0) } else { (1.0 - share) / y };
        let mu = 2.0 * x;
        Self {
            share,
            through: conductance * mu / mu.sinh(),
            aside: conductance * 0.5 * y * share,
            own: own / conductance,
            y,
        }
    }

    /// Slopes of its share, its conductances and its own rise with the conductance to the sides.
    pub(super) fn slopes(&self, conductance: f64) -> Self {
        let (y, share) = (self.y, self.share);
        let (d_share, d_own) = if y < SMALL {
            (series(y, 1, |n| n), -series(y, 2, |n| n - 1.0))
        } else {
            let d_share = (1.0 - share - 0.25 * y * share * share) / (2.0 * y);
            (d_share, (-d_share * y - (1.0 - share)) / (y * y))
        };
        let mu = y.sqrt();
        // μ/sinh μ
        let through = self.through / conductance;
        let d_through = if y < SMALL { 0.5 * through * dipped(y) } else { 0.5 * through / y * (1.0 - mu / mu.tanh()) };
        Self {
            share: d_share / conductance,
            through: d_through,
            aside: 0.5 * (share + y * d_share),
            own: d_own / (conductance * conductance),
            y,
        }
    }

    /// Highest rise along it with these rises at its ends for the heat `watts` into it (K).
    pub(super) fn peak(&self, conductance: f64, watts: f64, [a, b]: [f64; 2]) -> f64 {
        let ends = a.max(b);
        if self.y < NO_LOSS {
            let bend = watts / (2.0 * conductance);
            if bend <= 0.0 || (b - a).abs() >= bend {
                return ends;
            }
            return 0.5 * (a + b) + 0.25 * bend + (b - a) * (b - a) / (4.0 * bend);
        }
        // the deficit below the rise far from cold ends is α·cosh σ + β·sinh σ, σ from −μ/2 to μ/2
        let far = watts / (self.y * conductance);
        let half = 0.5 * self.y.sqrt();
        if half > FAR {
            return ends.max(far);
        }
        let mean = 0.5 * (a + b);
        let deficit = far - mean;
        let (alpha, beta) = (deficit / half.cosh(), 0.5 * (a - b) / half.sinh());
        if alpha <= 0.0 || beta.abs() >= alpha * half.tanh() {
            return ends;
        }
        // far − √(α² − β²), without the difference of what a small loss makes large
        let above = (deficit * half.tanh()).powi(2) + beta * beta;
        ends.max(mean + above / (deficit + ((alpha - beta) * (alpha + beta)).sqrt()))
    }
}

/// Σ_{n ≥ first} c_n·weight(n)·y^(n − first)/4ⁿ of the coefficients of tanh(x)/x with x² = y/4.
fn series(y: f64, first: usize, weight: impl Fn(f64) -> f64) -> f64 {
    let terms = TANH.iter().enumerate().skip(first).rev();
    terms.fold(0.0, |sum, (n, c)| sum * y + c * weight(n as f64) / 4f64.powi(n as i32))
}

/// (1 − μ·coth μ)/μ² for small y = μ²: minus the positive series of (μ·cosh μ − sinh μ)/(μ³) over that of sinh(μ)/μ.
fn dipped(y: f64) -> f64 {
    let (mut above, mut below, mut power, mut factorial) = (0.0, 0.0, 1.0, 1.0);
    for n in 0..10 {
        let n = f64::from(n);
        // y^n/(2n+1)! and 2(n+1)·y^n/(2n+3)!
        below += power / factorial;
        let next = factorial * (2.0 * n + 2.0) * (2.0 * n + 3.0);
        above += 2.0 * (n + 1.0) * power / next;
        power *= y;
        factorial = next;
    }
    -above / below
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The highest rise tends to that of a parabola as the loss goes to zero, with ends at equal and at different rises: the relative change is
    /// 5·y/48 of the rise between equal ends.
    #[test]
    fn a_small_loss_changes_the_highest_rise_little() {
        for ends in [[0.0, 0.0], [1.0, 1.4]] {
            let parabola = Fin::new(3.0, 0.0).peak(3.0, 24.0, ends);
            for y in [1e-4, 1e-8, 1e-12, 1e-13, 1e-15, 1e-30, 1e-300] {
                let peak = Fin::new(3.0, 3.0 * y).peak(3.0, 24.0, ends);
                assert!(
                    peak <= parabola * (1.0 + 1e-14) && peak > parabola * (1.0 - y - 1e-14),
                    "{y:e}: {peak} {parabola}"
                );
            }
            assert!(parabola > ends[1]);
        }
    }

    /// The values of each function and of its slope agree with those of the closed forms, evaluated by central differences of 5e-4
    /// relative with Richardson's extrapolation, on both sides of the change of formula.
    #[test]
    fn slopes_are_derivatives() {
        let k = 3.0;
        for y in [1e-3, 0.02, 0.3, 0.49, 0.51, 1.0, 7.0, 33.0, 900.0] {
            let g = k * y;
            let of = |g: f64| {
                let fin = Fin::new(k, g);
                [fin.share, fin.through, fin.aside, fin.own]
            };
            let at = Fin::new(k, g).slopes(k);
            for (i, slope) in [at.share, at.through, at.aside, at.own].into_iter().enumerate() {
                let difference = |h: f64| (of(g + h)[i] - of(g - h)[i]) / (2.0 * h);
                let h = 1e-3 * g;
                let best = (4.0 * difference(0.5 * h) - difference(h)) / 3.0;
                let scale = of(g)[i].abs() / g;
                assert!((slope - best).abs() <= 3e-8 * scale + 1e-7 * slope.abs(), "{y} {i}: {slope:e} {best:e}");
            }
        }
    }

    /// Without a loss to the sides a conductor is that of a parabola, and a weak loss tends to it.
    #[test]
    fn weak_losses_tend_to_none() {
        let (none, weak) = (Fin::new(2.0, 0.0), Fin::new(2.0, 2e-9));
        for (a, b) in [(none.share, weak.share), (none.through, weak.through), (none.own, weak.own)] {
            assert!((a / b - 1.0).abs() < 1e-9);
        }
        assert!((weak.aside / 1e-9 - 1.0).abs() < 1e-8);
        let slopes = weak.slopes(2.0);
        assert!((slopes.own * 4.0 * -120.0 - 1.0).abs() < 1e-8 && (slopes.share * 2.0 * -12.0 - 1.0).abs() < 1e-8);
        assert!((slopes.through * -6.0 - 1.0).abs() < 1e-8);
    }

    /// The highest rise is that of a scan along the closed form, with ends of different rises, and at an end where heat flows past.
    #[test]
    fn peaks() {
        for (y, ends, watts) in [
            (0.0, [0.0, 0.0], 1.0),
            (0.0, [0.1, 0.3], 1.0),
            (9.0, [0.0, 0.05], 2.0),
            (9.0, [0.4, 0.0], 2.0),
            (2.0, [5.0, 1.0], 0.5),
        ] {
            let (k, mu) = (1.5f64, f64::sqrt(y));
            let rise = |s: f64| {
                if y == 0.0 {
                    return ends[0] + (ends[1] - ends[0]) * s + watts / (2.0 * k) * s * (1.0 - s);
                }
                let far = watts / (k * y);
                far + ((ends[0] - far) * (mu * (1.0 - s)).sinh() + (ends[1] - far) * (mu * s).sinh()) / mu.sinh()
            };
            let scanned = (0..=20_000).map(|i| rise(f64::from(i) / 2e4)).fold(f64::NEG_INFINITY, f64::max);
            let peak = Fin::new(k, k * y).peak(k, watts, ends);
            assert!((peak - scanned).abs() < 1e-8, "{y} {ends:?}: {peak} {scanned}");
        }
    }
}
