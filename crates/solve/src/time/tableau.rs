//! Coefficients of implicit methods: diagonally implicit Runge–Kutta tableaus, and the parameters of the α family.
//!
//! | tableau | order | stages | |
//! |---|---|---|---|
//! | [`MIDPOINT`] | 2 | 1 | keeps quadratic invariants |
//! | [`TR_BDF2`] | 2 | 2 + an evaluation | L-stable, embedded estimate |
//! | [`SDIRK4`] | 4 | 5 | L-stable, embedded estimate of order 3 |
//!
//! References: M. E. Hosea, L. F. Shampine, "Analysis and implementation of TR-BDF2", Appl. Numer. Math. 20 (1996) 21–37;
//! E. Hairer, G. Wanner, "Solving Ordinary Differential Equations II" (1996), §IV.6, table 6.5 (SDIRK4); N. M. Newmark,
//! J. Eng. Mech. 85 (1959) 67–94; J. Chung, G. M. Hulbert, J. Appl. Mech. 60 (1993) 371–375 (generalized-α).

use std::f64::consts::SQRT_2;

/// Coefficients of a diagonally implicit method. Stages with a diagonal coefficient have the same one.
#[derive(Debug, PartialEq)]
pub struct Tableau {
    /// Rows of a, the diagonal included; a diagonal of 0 is an evaluation.
    pub a: &'static [&'static [f64]],
    /// Nodes.
    pub c: &'static [f64],
    /// Weights of the end; none: the last stage is the end.
    pub b: Option<&'static [f64]>,
    /// Weights of the error, taken through (I − h·a_ii·J)⁻¹, so that stiff motions do not count; none: no estimate.
    pub error: Option<&'static [f64]>,
    /// Power of the step with which the (estimated) error falls.
    pub order: f64,
}

/// Implicit midpoint.
pub static MIDPOINT: Tableau = Tableau { a: &[&[0.5]], c: &[0.5], b: Some(&[1.0]), error: None, order: 3.0 };

const D: f64 = 1.0 - 0.5 * SQRT_2;
const W: f64 = 0.25 * SQRT_2;
/// A trapezoidal stage to (2 − √2)·h, then a backward difference over the three points.
pub static TR_BDF2: Tableau = Tableau {
    a: &[&[0.0], &[D, D], &[W, W, D]],
    c: &[0.0, 2.0 * D, 1.0],
    b: None,
    error: Some(&[(1.0 - 4.0 * W) / 3.0, 1.0 / 3.0, -2.0 * D / 3.0]),
    order: 3.0,
};

const GAMMA: f64 = 0.25;
/// Five stages of Hairer and Wanner.
#[rustfmt::skip]
pub static SDIRK4: Tableau = Tableau {
    a: &[
        &[GAMMA],
        &[0.5, GAMMA],
        &[17.0 / 50.0, -1.0 / 25.0, GAMMA],
        &[371.0 / 1360.0, -137.0 / 2720.0, 15.0 / 544.0, GAMMA],
        &[25.0 / 24.0, -49.0 / 48.0, 125.0 / 16.0, -85.0 / 12.0, GAMMA],
    ],
    c: &[0.25, 0.75, 0.55, 0.5, 1.0],
    b: None,
    error: Some(&[-3.0 / 16.0, -27.0 / 32.0, 25.0 / 32.0, 0.0, 0.25]),
    order: 4.0,
};

/// Parameters of generalized-α: α_m, α_f, β and γ.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Alpha {
    /// Fraction of the start's acceleration.
    pub m: f64,
    /// Fraction of the start's forces.
    pub f: f64,
    /// Of displacements by accelerations.
    pub beta: f64,
    /// Of rates by accelerations.
    pub gamma: f64,
}

impl Alpha {
    /// For `rho`, the factor by which an infinitely fast motion shrinks in a step, 0 to 1.
    pub fn damping(rho: f64) -> Self {
        Self::of((2.0 * rho - 1.0) / (rho + 1.0), rho / (rho + 1.0))
    }

    /// Newmark's rule with average acceleration.
    pub fn newmark() -> Self {
        Self::of(0.0, 0.0)
    }

    fn of(m: f64, f: f64) -> Self {
        Self { m, f, beta: 0.25 * (1.0 - m + f).powi(2), gamma: 0.5 - m + f }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The parameters of generalized-α have order 2, γ = ½ − α_m + α_f, and β = ¼(1 − α_m + α_f)² (J. Chung, G. M. Hulbert, J. Appl. Mech. 60
    /// (1993), eqs. 17, 20, 25): for ρ = 1 both α are ½, for ρ = 0 they are −1 and 0. Newmark's rule has β = ¼ and γ = ½.
    #[test]
    fn parameters_of_generalized_alpha() {
        assert_eq!(Alpha::damping(1.0), Alpha { m: 0.5, f: 0.5, beta: 0.25, gamma: 0.5 });
        assert_eq!(Alpha::damping(0.0), Alpha { m: -1.0, f: 0.0, beta: 1.0, gamma: 1.5 });
        let half = Alpha::damping(0.5);
        assert!((half.m, half.f) == (0.0, 0.5 / 1.5) && (half.gamma - 5.0 / 6.0).abs() < 1e-15);
        assert_eq!(Alpha::newmark(), Alpha { m: 0.0, f: 0.0, beta: 0.25, gamma: 0.5 });
    }

    /// Nodes are the sums of their rows; the end fulfils the conditions of its order, and the error weights add to nothing and,
    /// of a method of order p, kill every power below p.
    #[test]
    fn order_conditions() {
        for (tableau, order) in [(&MIDPOINT, 2), (&TR_BDF2, 2), (&SDIRK4, 4)] {
            let Tableau { a, c, b, error, .. } = tableau;
            for (row, c) in a.iter().zip(*c) {
                assert!((row.iter().sum::<f64>() - c).abs() < 1e-14);
            }
            let b = b.unwrap_or(a[a.len() - 1]);
            let moment = |w: &[f64], p: i32| w.iter().zip(*c).map(|(w, c)| w * c.powi(p)).sum::<f64>();
            for p in 0..order {
                assert!((moment(b, p) - 1.0 / f64::from(p + 1)).abs() < 1e-14, "{tableau:?} {p}");
            }
            if let Some(e) = error {
                // the estimate is that of a formula one order higher or lower
                for p in 0..order.min(3) {
                    assert!(moment(e, p).abs() < 1e-14, "{tableau:?} {p}: {}", moment(e, p));
                }
            }
        }
    }
}
