//! Two facing beams: C = ∫ ε·h·α/g(s) ds along their length, and SUGAR's contact at their ends.
//!
//! The gap is g(s) = g₀ + w(s), with w the cubic (Hermite) interpolation of the relative displacement and rotation of the
//! two pairs of ends: z = (w₁, φ₁, w₂, φ₂). Parallel beams get exactly SUGAR's nodal forces and moments, pl/2 and pl²/12
//! (its `gap2d`); tilted ones differ in second order, because here forces, stiffness and charge come from one potential.
//! α is SUGAR's fringe factor 1 + 1.12·g₀/h. Quadrature: Gauss–Legendre with six points.

use super::contact;
use nalgebra::{Matrix4, Vector4};

/// Abscissae and weights of six-point Gauss–Legendre quadrature on 0…1.
const GAUSS: [(f64, f64); 6] = [
    (0.033_765_242_898_423_99, 0.085_662_246_189_585_17),
    (0.169_395_306_766_867_74, 0.180_380_786_524_069_3),
    (0.380_690_406_958_401_55, 0.233_956_967_286_345_52),
    (0.619_309_593_041_598_4, 0.233_956_967_286_345_52),
    (0.830_604_693_233_132_3, 0.180_380_786_524_069_3),
    (0.966_234_757_101_576, 0.085_662_246_189_585_17),
];

/// Constants of a pair of facing beams.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Facing {
    /// Length [m].
    pub length: f64,
    /// Gap as drawn [m].
    pub gap: f64,
    /// ε·h·α, capacitance times gap per length [F].
    pub strength: f64,
    /// Electrode height, which scales the contact force [m].
    pub height: f64,
}

/// C(z) with gradient and Hessian.
#[derive(Debug, Clone, Copy)]
pub struct FacingCapacitance {
    /// C [F].
    pub value: f64,
    /// ∂C/∂z [F/m, F/rad].
    pub gradient: Vector4<f64>,
    /// ∂²C/∂z².
    pub hessian: Matrix4<f64>,
}

impl Facing {
    /// Capacitance at the relative end displacements z = (w₁, φ₁, w₂, φ₂); positive w opens the gap.
    pub fn at(&self, z: &Vector4<f64>) -> FacingCapacitance {
        let mut c = FacingCapacitance { value: 0.0, gradient: Vector4::zeros(), hessian: Matrix4::zeros() };
        let l = self.length;
        for (s, weight) in GAUSS {
            let n = Vector4::new(
                1.0 - 3.0 * s * s + 2.0 * s * s * s,
                l * (s - 2.0 * s * s + s * s * s),
                3.0 * s * s - 2.0 * s * s * s,
                l * (s * s * s - s * s),
            );
            let g = self.gap + n.dot(z);
            let k = self.strength * l * weight;
            let d = g.max(contact::FROZEN);
            c.value += k * (1.0 / d + (d - g) / (d * d));
            c.gradient -= n * (k / (d * d));
            if g > contact::FROZEN {
                c.hessian += n * n.transpose() * (2.0 * k / (d * d * d));
            }
        }
        c
    }

    /// Contact force that opens each end [N] and its derivative [N/m].
    pub fn contact(&self, z: &Vector4<f64>) -> [(f64, f64); 2] {
        [contact::repulsion(self.gap + z[0], self.height), contact::repulsion(self.gap + z[2], self.height)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn facing() -> Facing {
        Facing { length: 100e-6, gap: 2e-6, strength: 8.854e-12 * 2e-6, height: 2e-6 }
    }

    /// Parallel beams: C = εhl/g, and the work-equivalent nodal loads of a uniform pressure, l/2 and l²/12 (SUGAR gap2d).
    #[test]
    fn parallel_beams_match_sugar() {
        let f = facing();
        let c = f.at(&Vector4::zeros());
        let line = f.strength / (f.gap * f.gap);
        assert!((c.value / (f.strength * f.length / f.gap) - 1.0).abs() < 1e-14);
        let expected = Vector4::new(0.5, f.length / 12.0, 0.5, -f.length / 12.0) * (-line * f.length);
        assert!((c.gradient - expected).abs().max() < 1e-14 * expected.abs().max());
    }

    /// Gradient and Hessian are the derivatives of C: central differences to their own error.
    #[test]
    fn derivatives_match_central_differences() {
        let f = facing();
        let z = Vector4::new(-0.3e-6, 4e-3, 0.2e-6, -6e-3);
        let c = f.at(&z);
        for i in 0..4 {
            let step = if i % 2 == 0 { 1e-11 } else { 1e-7 };
            let (mut lo, mut hi) = (z, z);
            lo[i] -= step;
            hi[i] += step;
            let (lo, hi) = (f.at(&lo), f.at(&hi));
            let slope = (hi.value - lo.value) / (2.0 * step);
            assert!((slope - c.gradient[i]).abs() < 1e-5 * c.gradient[i].abs());
            let column = (hi.gradient - lo.gradient) / (2.0 * step);
            assert!((column - c.hessian.column(i)).norm() < 1e-6 * c.hessian.column(i).norm());
        }
    }
}
