//! Repulsion of nearly closed gaps, after SUGAR's gap models.
//!
//! For a distance d ≤ 0.1 µm between electrodes of height h, per contact point (SUGAR 2.0, `gapCont`):
//! ```text
//! f(d) = (1e-9/(d/µm − 0.05)³ − 8e-6) · h/2 µm   [N]
//! ```
//! It starts at zero at 0.1 µm and has a pole at 0.05 µm. SUGAR resets distances below 0.055 µm to 0.057 µm, which makes
//! the force jump back; here the force goes on along its tangent below 0.055 µm, so that every overstep is pushed out.

/// Distance at which the repulsion begins [m].
pub const RANGE: f64 = 0.1e-6;
/// Distance below which the force goes on along its tangent [m].
pub const FROZEN: f64 = 0.055e-6;
const POLE: f64 = 0.05e-6;
const STRENGTH: f64 = 1e-27; // 1e-9 N·µm³
const OFFSET: f64 = 8e-6;
const HEIGHT: f64 = 2e-6;

/// Repulsive force [N] and its derivative with respect to the distance [N/m] (negative) at distance `d` [m].
#[inline]
pub fn repulsion(d: f64, height: f64) -> (f64, f64) {
    if d >= RANGE {
        return (0.0, 0.0);
    }
    let scale = height / HEIGHT;
    let at = d.max(FROZEN) - POLE;
    let slope = -3.0 * STRENGTH / at.powi(4);
    let force = STRENGTH / at.powi(3) - OFFSET + slope * (d - FROZEN).min(0.0);
    (force * scale, slope * scale)
}

/// Energy stored in the repulsion at distance `d` [J]: the integral of [`repulsion`] from there to its beginning.
pub fn energy(d: f64, height: f64) -> f64 {
    if d >= RANGE {
        return 0.0;
    }
    let at = d.max(FROZEN);
    let pole = |d: f64| 0.5 * STRENGTH / ((d - POLE) * (d - POLE));
    let curved = (pole(at) - pole(RANGE) - OFFSET * (RANGE - at)) * height / HEIGHT;
    let below = (FROZEN - d).max(0.0);
    let (force, slope) = repulsion(FROZEN, height);
    curved + force * below - 0.5 * slope * below * below
}

#[cfg(test)]
mod tests {
    use super::*;

    /// SUGAR's law at d = 0.06 µm and h = 2 µm: 1e-9/0.01³ − 8e-6 = 9.92e-4 N; zero at 0.1 µm; the tangent below 0.055 µm.
    #[test]
    fn follows_sugar() {
        let (f, _) = repulsion(0.06e-6, 2e-6);
        assert!((f - 9.92e-4).abs() < 1e-12);
        assert!(repulsion(0.1e-6 - 1e-15, 2e-6).0.abs() < 1e-11);
        let (f0, s0) = repulsion(FROZEN, 2e-6);
        let (f1, s1) = repulsion(FROZEN - 1e-9, 2e-6);
        assert!((f1 - (f0 - s0 * 1e-9)).abs() < 1e-9 * f0 && s0 == s1);
    }
    /// The energy's slope is the force, on both branches: central differences of 1e-12 m.
    #[test]
    fn energy_is_the_integral_of_the_force() {
        for d in [0.09e-6, 0.06e-6, 0.052e-6] {
            let slope = (energy(d - 1e-12, 3e-6) - energy(d + 1e-12, 3e-6)) / 2e-12;
            let force = repulsion(d, 3e-6).0;
            assert!((slope / force - 1.0).abs() < 1e-5, "{d}: {slope} {force}");
        }
        assert_eq!(energy(RANGE, 2e-6), 0.0);
    }
}
