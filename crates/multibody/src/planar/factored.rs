//! The tangent of a pair of bodies kept as what it is made of: the slopes of the strains, the stiffness between them, and
//! the small rest that a joint's forces bring.
//!
//! Summation to a 6×6 block loses the accuracy that a soft mode needs. A rigid motion of two bodies on a stiff joint
//! causes no strain, but the entries of the block cancel to rounding only. Rounding of the stiffest joint exceeds the
//! whole stiffness of the softest. Strains that are taken first, with digits to spare, are right.

use super::Vec3;
use super::joint::{JointKinematics, Slopes, Symmetric};
use crate::scalar::{Double, Real};

/// Numbers of a pair's tangent.
pub(crate) const NUMBERS: usize = 21;

/// A pair's tangent, rowsᵀ·stiffness·rows + the rest, by its numbers: ∂(e_u, g)/∂(x_b − x_a) as two rows, ∂strain/∂θ of body a and of
/// body b, the stiffness. They end with the rest, first between translation and either rotation, then of the rotations of a twice, of a
/// and b, of b twice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FactoredTangent<T = f64>(pub(crate) [T; NUMBERS]);

/// Reaction to a change of two bodies' poses: the force on body b (on a with the other sign), and both moments.
pub(crate) struct PairForce<T = f64> {
    pub(crate) force: [Double<T>; 2],
    pub(crate) moment_a: Double<T>,
    pub(crate) moment_b: Double<T>,
}

impl<T: Real> JointKinematics<T> {
    /// The tangent of [`JointKinematics::tangent`]: `stress` is (N, V, M), `second` is Q.
    pub(crate) fn factored(&self, stiffness: &Symmetric<T>, stress: &Vec3<T>, second: &[T; 3]) -> FactoredTangent<T> {
        let Slopes { u, g, turn_a: a, turn_b: b } = self.slopes();
        let (Symmetric([uu, ug, up, gg, gp, pp]), half, turn) = self.stressed(stiffness, stress, second);
        #[rustfmt::skip]
        let numbers = [
            u[0], u[1], g[0], g[1],
            a[0], a[1], a[2], b[0], b[1], b[2],
            uu, ug, up, gg, gp, pp,
            half[0], half[1], turn[0], turn[1], turn[2],
        ];
        FactoredTangent(numbers)
    }
}

impl<T: Real> FactoredTangent<T> {
    /// Its product with x_b − x_a and the rotations θ_a, θ_b.
    #[inline(always)]
    pub(crate) fn times(&self, [dx, dy]: [Double<T>; 2], a: Double<T>, b: Double<T>) -> PairForce<T> {
        let [ux, uy, gx, gy, au, ag, ap, bu, bg, bp, uu, ug, up, gg, gp, pp, hx, hy, aa, ab, bb] = self.0;
        let strain = [
            dx * ux + dy * uy + a * au + b * bu, //
            dx * gx + dy * gy + a * ag + b * bg,
            a * ap + b * bp,
        ];
        let stress = [sum(strain, [uu, ug, up]), sum(strain, [ug, gg, gp]), sum(strain, [up, gp, pp])];
        let (both, aside) = (a + b, dx * hx + dy * hy);
        PairForce {
            force: [
                stress[0] * ux + stress[1] * gx + both * hx, //
                stress[0] * uy + stress[1] * gy + both * hy,
            ],
            moment_a: sum(stress, [au, ag, ap]) + aside + a * aa + b * ab,
            moment_b: sum(stress, [bu, bg, bp]) + aside + a * ab + b * bb,
        }
    }
}

/// x·c, which closures over lanes would not always inline.
#[inline(always)]
fn sum<T: Real>(x: [Double<T>; 3], c: Vec3<T>) -> Double<T> {
    x[0] * c[0] + x[1] * c[1] + x[2] * c[2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planar::{JointFrame, Pose};
    use nalgebra::{Vector2, Vector6};

    /// The product with what a tangent is made of is that with its 6×6 matrix, to the rounding of the matrix (1e-14).
    #[test]
    fn the_product_is_that_of_the_matrix() {
        let frame = JointFrame {
            arm_a: Vector2::new(0.7, -0.3),
            arm_b: Vector2::new(-0.4, 0.9),
            axis: Vector2::new(0.4f64.cos(), 0.4f64.sin()),
        };
        let (second, stress) = ([0.6, 0.1, -0.08], [1.3, -0.7, 0.4]);
        let stiffness = Symmetric([1.9, 0.3, -0.2, 1.4, 0.5, 1.1]);
        let k = frame.kinematics(&Pose::new(0.1, -0.2, 0.3), &Pose::new(0.15, 0.1, -0.5), &second);
        let x = Vector6::new(0.3, -0.7, 0.2, 0.5, 0.1, -0.4);
        let at = |i: usize| Double::from(x[i]);
        let pair = k.factored(&stiffness, &stress, &second).times([at(3) - at(0), at(4) - at(1)], at(2), at(5));
        let [fx, fy] = pair.force.map(|f| f.high);
        let found = Vector6::new(-fx, -fy, pair.moment_a.high, fx, fy, pair.moment_b.high);
        let expected = k.tangent(&stiffness, &stress, &second).matrix() * x;
        assert!((found - expected).norm() < 1e-14, "{found} {expected}");
        let twice = k.elastic(&stiffness.scaled(2.0)).matrix() * x;
        assert!((twice - k.elastic(&stiffness).matrix() * x * 2.0).norm() < 1e-14);
    }
}
