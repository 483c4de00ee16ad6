//! The tangent of a pair of bodies kept as what it is made of: the slopes of the strains, the stiffness between them, and
//! the small rest that a joint's forces bring.
//!
//! Summation to a 6×6 block loses the accuracy that a soft mode needs. A rigid motion of two bodies on a stiff joint
//! causes no strain, but the entries of the block cancel to rounding only. Rounding of the stiffest joint exceeds the
//! whole stiffness of the softest. Strains that are taken first, with digits to spare, are right.

use super::joint::{JointKinematics, Symmetric};
use super::perpendicular;
use crate::scalar::Double;
use nalgebra::{Vector2, Vector3};

/// A pair's tangent: rowsᵀ·`stiffness`·rows + the rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FactoredTangent {
    /// ∂(e_u, g)/∂(x_b − x_a).
    u: Vector2<f64>,
    g: Vector2<f64>,
    /// ∂strain/∂θ of the bodies.
    turn_a: Vector3<f64>,
    turn_b: Vector3<f64>,
    stiffness: Symmetric,
    /// Rest: translation with either rotation; rotations of a twice, of a and b, of b twice.
    half: Vector2<f64>,
    turn: [f64; 3],
}

/// Reaction to a change of two bodies' poses: the force on body b (on a with the other sign), and both moments.
pub(crate) struct PairForce {
    pub(crate) force: [Double; 2],
    pub(crate) moment_a: Double,
    pub(crate) moment_b: Double,
}

impl JointKinematics {
    /// The tangent of [`JointKinematics::tangent`]: `stress` is (N, V, M), `second` is Q.
    pub(crate) fn factored(&self, stiffness: &Symmetric, stress: &Vector3<f64>, second: &[f64; 3]) -> FactoredTangent {
        let s = self.slopes();
        let double = 2.0 * stress.x;
        let [uu, ug, up, gg, gp, pp] = stiffness.0;
        let [bend_gg, bend_gp, bend_pp] = second.map(|q| double * q);
        let n = self.e1 * stress.x + perpendicular(self.e1) * (stress.y + double * self.bent.x);
        let quarter = 0.25 * n.dot(&self.opening);
        let between = 0.5 * (n.dot(&self.radius_b) - n.dot(&self.radius_a));
        FactoredTangent {
            u: s.u,
            g: s.g,
            turn_a: s.turn_a,
            turn_b: s.turn_b,
            stiffness: Symmetric([uu, ug, up, gg + bend_gg, gp + bend_gp, pp + bend_pp]),
            half: perpendicular(n) * 0.5,
            turn: [-quarter, between - quarter, -quarter],
        }
    }
}

impl FactoredTangent {
    /// All of its numbers: the slopes u, g, of the turns of a and of b, the stiffness, and both parts of the rest.
    pub(crate) fn numbers(&self) -> [f64; 21] {
        let mut numbers = [0.0; 21];
        let all = (self.u.iter().chain(&self.g).chain(&self.turn_a).chain(&self.turn_b))
            .chain(&self.stiffness.0)
            .chain(&self.half)
            .chain(&self.turn);
        for (to, from) in numbers.iter_mut().zip(all) {
            *to = *from;
        }
        numbers
    }

    /// Its product with x_b − x_a and the rotations θ_a, θ_b.
    #[inline]
    pub(crate) fn times(&self, [dx, dy]: [Double; 2], a: Double, b: Double) -> PairForce {
        let strain = [
            dx * self.u.x + dy * self.u.y + a * self.turn_a.x + b * self.turn_b.x,
            dx * self.g.x + dy * self.g.y + a * self.turn_a.y + b * self.turn_b.y,
            a * self.turn_a.z + b * self.turn_b.z,
        ];
        let [uu, ug, up, gg, gp, pp] = self.stiffness.0;
        let row = |c: [f64; 3]| strain[0] * c[0] + strain[1] * c[1] + strain[2] * c[2];
        let stress = [row([uu, ug, up]), row([ug, gg, gp]), row([up, gp, pp])];
        let both = a + b;
        let lever = |t: &Vector3<f64>| stress[0] * t.x + stress[1] * t.y + stress[2] * t.z;
        let aside = dx * self.half.x + dy * self.half.y;
        PairForce {
            force: [
                stress[0] * self.u.x + stress[1] * self.g.x + both * self.half.x,
                stress[0] * self.u.y + stress[1] * self.g.y + both * self.half.y,
            ],
            moment_a: lever(&self.turn_a) + aside + a * self.turn[0] + b * self.turn[1],
            moment_b: lever(&self.turn_b) + aside + a * self.turn[1] + b * self.turn[2],
        }
    }
}
