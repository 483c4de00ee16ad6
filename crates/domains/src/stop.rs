//! A stop: no force within the travel of a part, then the contact of a rigid stop or the spring of a compliant one.
//!
//! Over the penetration p beyond the way a rigid stop bears with the pressure of [`super::contact`] on its area; one of
//! stiffness k with
//! ```text
//! F = k·p²/(p + w),     w = 1 nm
//! ```
//! which comes to k·(p − w): the start of the stiffness is spread over w, as a first touch is, so that paths have no corner.

use super::contact::{Contact, TOUCH};
use super::contact_loss::Loss;

/// Penetration over which the stiffness of an elastic stop sets in (m).
pub const SOFT: f64 = 1e-9;

/// How a stop bears.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StopKind {
    /// On an area (m²), by the law of contact.
    Rigid(f64),
    /// As a spring (N/m).
    Elastic(f64),
}

impl StopKind {
    /// Way that is left where the law ends (m), negative: how far a rigid stop may be pressed.
    #[inline]
    pub fn least(&self) -> f64 {
        match self {
            Self::Rigid(area) => Contact { touch: TOUCH, area: *area }.least() - TOUCH,
            Self::Elastic(_) => f64::NEG_INFINITY,
        }
    }

    /// Force (N) against the motion and its derivative with the way that is `left` (N/m) (not positive).
    #[inline]
    pub fn force(&self, left: f64) -> (f64, f64) {
        if left >= 0.0 {
            return (0.0, 0.0);
        }
        match *self {
            Self::Rigid(area) => Contact { touch: TOUCH, area }.force(TOUCH + left),
            Self::Elastic(k) => {
                let p = -left;
                let share = p / (p + SOFT);
                (k * p * share, -k * share * (2.0 - share))
            }
        }
    }

    /// Energy stored (J) where the way `left` is negative.
    pub fn energy(&self, left: f64) -> f64 {
        if left >= 0.0 {
            return 0.0;
        }
        match *self {
            Self::Rigid(area) => Contact { touch: TOUCH, area }.energy(TOUCH + left),
            Self::Elastic(k) => {
                let x = -left / SOFT;
                // x²/2 − x + ln(1 + x), by its series where that cancels
                let bent = if x < 0.05 {
                    (0..10).map(|n| (if n % 2 == 0 { 1.0 } else { -1.0 }) * x.powi(n + 3) / f64::from(n + 3)).sum()
                } else {
                    0.5 * x * x - x + x.ln_1p()
                };
                k * SOFT * SOFT * bent
            }
        }
    }

    /// First and second derivative of the potential with the approach `u` (m), for the `ways` ahead and back: force against it (N),
    /// stiffness (N/m).
    pub(super) fn bearing(&self, ways: &[Option<f64>; 2], u: f64) -> (f64, f64) {
        let side = |way: Option<f64>, u: f64| way.map_or((0.0, 0.0), |w| self.force(w - u));
        let (ahead, back) = (side(ways[0], u), side(ways[1], -u));
        (ahead.0 - back.0, -ahead.1 - back.1)
    }
}

/// Rate-dependent part of the force against the approach `u` (m) that changes at `rate` (m/s), and its derivatives with
/// both.
pub(super) fn lost(stop: &StopKind, loss: &Loss, ways: &[Option<f64>; 2], (u, rate): (f64, f64)) -> (f64, f64, f64) {
    let side = |way: Option<f64>, u: f64, closing: f64| {
        let (force, slope) = way.map_or((0.0, 0.0), |w| stop.force(w - u));
        let (added, by_rate) = loss.fraction(closing);
        (force * added, -slope * added, force * by_rate)
    };
    let (ahead, back) = (side(ways[0], u, rate), side(ways[1], -u, -rate));
    (ahead.0 - back.0, ahead.1 + back.1, ahead.2 + back.2)
}

/// Way left to the nearer side of a stop at an approach `u` (m), and its derivative with the approach.
pub(super) fn nearer(ways: &[Option<f64>; 2], u: f64) -> (f64, f64) {
    let [ahead, back] = [ways[0].map_or(f64::INFINITY, |w| w - u), ways[1].map_or(f64::INFINITY, |w| w + u)];
    if ahead <= back { (ahead, -1.0) } else { (back, 1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An elastic stop gives k·(p − w) far beyond w, a rigid one 0.2 TPa·s³ with s = p/50 nm; nothing before.
    #[test]
    fn follows_its_law() {
        let (f, slope) = StopKind::Elastic(1e3).force(-1e-6);
        assert!((f / (1e3 * (1e-6 - 1e-9)) - 1.0).abs() < 2e-6 && (slope / -1e3 - 1.0).abs() < 2e-6);
        assert!((StopKind::Rigid(1e-10).force(-5e-9).0 / (1e-10 * 2e11 * 1e-3) - 1.0).abs() < 1e-9);
        assert_eq!(StopKind::Elastic(1e3).force(0.0), (0.0, 0.0));
        assert!((StopKind::Rigid(1e-10).least() + 35e-9).abs() < 1e-15);
    }

    /// Energy's slope is the force and the force's slope the stiffness: central differences.
    #[test]
    fn one_potential() {
        for stop in [StopKind::Elastic(2e3), StopKind::Rigid(1e-10)] {
            for p in [2e-11, 4e-10, 3e-9, 20e-9] {
                let e = 1e-4 * p;
                let slope = (stop.energy(-p - e) - stop.energy(-p + e)) / (2.0 * e);
                let (f, k) = stop.force(-p);
                assert!((slope / f - 1.0).abs() < 1e-5, "{stop:?} {p}: {slope} {f}");
                let change = (stop.force(-p + e).0 - stop.force(-p - e).0) / (2.0 * e);
                assert!((change / k - 1.0).abs() < 1e-5, "{stop:?} {p}: {change} {k}");
            }
        }
    }

    /// A stop with two sides: the force is the derivative of the energy of both, the loss has the derivatives of central differences
    /// (1e-6), and the nearer side is the one with less way.
    #[test]
    fn two_sides() {
        let (stop, ways) = (StopKind::Elastic(2e3), [Some(3e-9), Some(5e-9)]);
        let loss = Loss::new(&bimorph_structure::Impact { restitution: Some(0.3), speed: Some(0.1) });
        let energy = |u: f64| stop.energy(3e-9 - u) + stop.energy(5e-9 + u);
        let slope = |f: &dyn Fn(f64) -> f64, x: f64, e: f64| (f(x + e) - f(x - e)) / (2.0 * e);
        for (u, rate) in [(9e-9, 0.02), (9e-9, -0.01), (-9e-9, 0.02), (-9e-9, -0.03)] {
            let (force, stiffness) = stop.bearing(&ways, u);
            assert!((slope(&energy, u, 1e-13) / force - 1.0).abs() < 1e-6);
            assert!((slope(&|u| stop.bearing(&ways, u).0, u, 1e-13) / stiffness - 1.0).abs() < 1e-6);
            let (_, by_u, by_rate) = lost(&stop, &loss, &ways, (u, rate));
            let added = |u: f64, rate: f64| lost(&stop, &loss, &ways, (u, rate)).0;
            assert!((slope(&|u| added(u, rate), u, 1e-13) / by_u - 1.0).abs() < 1e-6, "{u} {rate}");
            assert!((slope(&|rate| added(u, rate), rate, 1e-6) / by_rate - 1.0).abs() < 1e-6, "{u} {rate}");
            // it opposes the motion, on either side
            assert!(added(u, rate) * rate > 0.0);
        }
        assert_eq!(stop.bearing(&ways, 0.0), (0.0, 0.0));
        assert_eq!((nearer(&ways, 0.0), nearer(&ways, -3e-9)), ((3e-9, -1.0), (2e-9, 1.0)));
        assert_eq!((nearer(&[None, ways[1]], 1e-9).1, nearer(&[ways[0], None], -1e-9).1), (1.0, -1.0));
    }
}
