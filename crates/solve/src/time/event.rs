//! When a quantity crosses zero during a motion: signs are compared at five places of each step, and each change of sign is
//! closed in on to rounding on the continuous motion.
//!
//! The root is found by inverse quadratic interpolation with bisection as its safeguard: T. R. Chandrupatla, Adv. Eng.
//! Software 28 (1997) 145–149.

use serde::Serialize;

/// Which way a quantity crosses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Direction {
    /// From below to above.
    Up,
    /// From above to below.
    Down,
}

/// Points of a step where signs are checked, besides its start.
const PLACES: [f64; 4] = [0.25, 0.5, 0.75, 1.0];

/// Stores the sign of one quantity from step to step.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Detector {
    above: Option<bool>,
}

impl Detector {
    /// A detector whose quantity begins at `value`; one that begins at zero has no sign yet.
    pub fn new(value: f64) -> Self {
        Self { above: (value != 0.0).then_some(value > 0.0) }
    }

    /// True where the quantity was above zero at the end of the last step.
    pub fn is_above(&self) -> bool {
        self.above == Some(true)
    }

    /// Searches one step: `value(x)` is the quantity at the fraction x of it. Each crossing goes to `found` as the
    /// share where it happens and its direction, in order.
    pub fn step(&mut self, mut value: impl FnMut(f64) -> f64, mut found: impl FnMut(f64, Direction)) {
        let mut from = 0.0;
        for to in PLACES {
            let end = value(to);
            if end == 0.0 {
                continue;
            }
            if self.above.is_some_and(|above| above != (end > 0.0)) {
                let start = value(from);
                let x = if start * end < 0.0 { root(&mut value, (from, start), (to, end)) } else { from };
                found(x, if end > 0.0 { Direction::Up } else { Direction::Down });
            }
            self.above = Some(end > 0.0);
            from = to;
        }
    }
}

/// The root of `f` between two points (x, f) of opposite sign, to the rounding of x.
pub fn root(mut f: impl FnMut(f64) -> f64, a: (f64, f64), b: (f64, f64)) -> f64 {
    // the last point, the one before on the other side, and the one before that
    let ((mut x1, mut f1), (mut x2, mut f2)) = (b, a);
    let mut share = 0.5;
    for _ in 0..200 {
        let x = x1 + share * (x2 - x1);
        let fx = f(x);
        let ((x3, f3), opposite) = if (fx > 0.0) == (f1 > 0.0) { ((x1, f1), false) } else { ((x2, f2), true) };
        if opposite {
            (x2, f2) = (x1, f1);
        }
        (x1, f1) = (x, fx);
        let best = if f2.abs() < f1.abs() { x2 } else { x1 };
        let rounding = 2.0 * f64::EPSILON * best.abs() + f64::MIN_POSITIVE;
        let least = rounding / (x2 - x1).abs();
        if least > 0.5 || f1 == 0.0 {
            return best;
        }
        let (xi, phi) = ((x1 - x2) / (x3 - x2), (f1 - f2) / (f3 - f2));
        share = if phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi {
            f1 / (f2 - f1) * f3 / (f2 - f3) + (x3 - x1) / (x2 - x1) * f1 / (f3 - f1) * f2 / (f3 - f2)
        } else {
            0.5
        };
        share = share.clamp(least, 1.0 - least);
    }
    x1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Roots of a cosine and of a steep cubic, to a few units in the last place.
    #[test]
    fn roots_to_rounding() {
        let x = root(f64::cos, (1.0, 1f64.cos()), (2.0, 2f64.cos()));
        assert!((x - std::f64::consts::FRAC_PI_2).abs() < 1e-15, "{x}");
        let cubic = |x: f64| (x - 0.3) * (1.0 + 1e6 * (x - 0.3) * (x - 0.3));
        let x = root(cubic, (0.0, cubic(0.0)), (1.0, cubic(1.0)));
        assert!((x - 0.3).abs() < 1e-15, "{x}");
    }

    /// Inverse interpolation takes far fewer values than bisection, which would take 52: at most 10 for the cosine, whatever the order of the ends.
    #[test]
    fn roots_take_few_values() {
        for (a, b) in [(1.0f64, 2.0f64), (2.0, 1.0)] {
            let mut values = 0;
            let counted = |x: f64| {
                values += 1;
                x.cos()
            };
            root(counted, (a, a.cos()), (b, b.cos()));
            assert!(values <= 10, "{values}");
        }
    }

    /// A quantity that stays at zero over a place of a step crosses once, where it leaves it on the other side.
    #[test]
    fn zero_is_no_sign() {
        let mut found = Vec::new();
        let mut detector = Detector::new(1.0);
        detector.step(|x| if x < 0.6 { 0.5 - x } else { -1.0 }, |x, direction| found.push((x, direction)));
        assert_eq!(found, [(0.5, Direction::Down)]);
    }

    /// A sine over steps of 0.7 crosses at each multiple of π, once, with alternating direction; it begins at zero, which is no
    /// crossing.
    #[test]
    fn crossings_of_a_sine() {
        let mut detector = Detector::new(0.0);
        let mut found = Vec::new();
        for k in 0..10 {
            let t = |x: f64| 0.7 * (f64::from(k) + x);
            detector.step(|x| t(x).sin(), |x, direction| found.push((t(x), direction)));
        }
        let pi = std::f64::consts::PI;
        assert_eq!(found.len(), 2);
        assert!((found[0].0 - pi).abs() < 1e-14 && found[0].1 == Direction::Down, "{found:?}");
        assert!((found[1].0 - 2.0 * pi).abs() < 1e-14 && found[1].1 == Direction::Up, "{found:?}");
    }
}
