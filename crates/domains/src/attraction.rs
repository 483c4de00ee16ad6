//! Adhesion of surfaces that touch or nearly touch.
//! ```text
//! A(d) = F·(1 − 3x² + 2x³),  x = d/r      F where they touch (d ≤ 0), 0 beyond the range r
//! ```
//! F is the pull-off force: while surfaces touch, the attraction acts beside the contact force, as in the theory of Derjaguin, Muller and Toporov, and the
//! force that tears them apart is F, whatever the law of contact. A has one derivative everywhere.
//!
//! Reference: B. V. Derjaguin, V. M. Muller, Y. P. Toporov, "Effect of contact deformations on the adhesion of particles", J. Colloid Interface Sci. 53 (1975) 314–326.

pub use bimorph_structure::Adhesion;

/// Attraction at the distance `d` (m): force (N), its derivative with the distance (N/m), and the energy that it takes to separate from there (J).
pub fn attraction(adhesion: &Adhesion, d: f64) -> (f64, f64, f64) {
    let &Adhesion { force, range } = adhesion;
    let x = d / range;
    if x >= 1.0 {
        return (0.0, 0.0, 0.0);
    }
    if x <= 0.0 {
        return (force, 0.0, force * range * (0.5 - x));
    }
    let left = 1.0 - x;
    // ∫ from x to 1 of (1 − 3t² + 2t³) = ½ − x + x³ − ½x⁴ = ½·(1 − x)³·(1 + x)
    let value = force * left * left * (1.0 + 2.0 * x);
    (value, -6.0 * force * x * left / range, 0.5 * force * range * left.powi(3) * (1.0 + x))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// F at contact and half of it at half the range; force and stiffness are the derivatives of the energy (differences), which has no jump at either end.
    #[test]
    fn one_potential() {
        let adhesion = Adhesion { force: 2e-6, range: 10e-9 };
        let (force, slope, energy) = attraction(&adhesion, 0.0);
        assert!(force == 2e-6 && slope == 0.0 && (energy / 1e-14 - 1.0).abs() < 1e-12);
        assert_eq!(attraction(&adhesion, -3e-9).0, 2e-6);
        assert!((attraction(&adhesion, 5e-9).0 / 1e-6 - 1.0).abs() < 1e-12);
        assert_eq!(attraction(&adhesion, 10e-9), (0.0, 0.0, 0.0));
        for d in [-2e-9, 1e-10, 3e-9, 9.9e-9] {
            let h = 1e-13;
            let [below, above] = [attraction(&adhesion, d - h), attraction(&adhesion, d + h)];
            let (force, slope, _) = attraction(&adhesion, d);
            assert!(((below.2 - above.2) / (2.0 * h) / 2e-6 - force / 2e-6).abs() < 1e-7, "{d}");
            assert!(((above.0 - below.0) / (2.0 * h) - slope).abs() < 1e-7 * 300.0, "{d}");
        }
    }
}
