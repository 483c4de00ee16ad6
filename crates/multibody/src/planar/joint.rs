//! Strains of a joint between two bodies, their derivatives, and the 6×6 tangent of the pair.
//!
//! Joint a–b sits at a point that both bodies share at rest. Its frame is drawn at angle β and turns with the mean of the
//! two bodies, ψ = β + (θₐ + θ_b)/2, so that the strains do not depend on which body comes first:
//! ```text
//! d = (q_b + (R_b − 1) arm_b) − (q_a + (R_a − 1) arm_a)      opening between the two material points
//! u = d · e₁(ψ)      axial (type 4, prismatic)
//! g = d · e₂(ψ)      shear
//! p = θ_b − θ_a      rotation (types 1–3, rotary)
//! e_u = u + [g p] Q [g p]ᵀ      second-order axial strain of a bent segment
//! ```
//! With Q = diag(0.6/h, −h/12) for a segment of length h the chord of the bent, uniformly sheared segment keeps the right
//! length to second order, which makes large rotation, stretch stiffening and buckling right at no unknown.
//!
//! Strains depend on translations through the opening alone, so their derivatives with respect to the position of body a
//! are those of body b with the other sign, and ten numbers make up the 6×6 tangent of a pair.

use super::{Block, HalfTurn, PairRow, Pose, perpendicular};
use nalgebra::{Matrix3, Matrix6, Vector2, Vector3, Vector6};

/// Geometry of a joint: where it sits and how its frame is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointFrame {
    /// From the centre of mass of body a to the joint, as drawn (m).
    pub arm_a: Vector2<f64>,
    /// From the centre of mass of body b to the joint, as drawn (m).
    pub arm_b: Vector2<f64>,
    /// Cosine and sine of the drawn angle β of the joint's x axis.
    pub axis: Vector2<f64>,
}

/// A symmetric 3×3 matrix over the strains (u, g, p): uu, ug, up, gg, gp, pp.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Symmetric(pub [f64; 6]);

impl Symmetric {
    /// `factor` times it.
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        Self(self.0.map(|x| factor * x))
    }

    /// A column of it.
    #[inline]
    pub fn column(&self, i: usize) -> Vector3<f64> {
        let [uu, ug, up, gg, gp, pp] = self.0;
        match i {
            0 => Vector3::new(uu, ug, up),
            1 => Vector3::new(ug, gg, gp),
            _ => Vector3::new(up, gp, pp),
        }
    }
}

impl std::ops::Mul<Vector3<f64>> for Symmetric {
    type Output = Vector3<f64>;

    #[inline]
    fn mul(self, x: Vector3<f64>) -> Vector3<f64> {
        let [uu, ug, up, gg, gp, pp] = self.0;
        Vector3::new(uu * x.x + ug * x.y + up * x.z, ug * x.x + gg * x.y + gp * x.z, up * x.x + gp * x.y + pp * x.z)
    }
}

/// Second derivatives of an energy of a pair of bodies that depends on their translations through x_b − x_a alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairTangent {
    /// Translation of b twice: xx, xy, yy.
    shift: [f64; 3],
    /// Translation of b and rotation of a, of b.
    shift_a: Vector2<f64>,
    shift_b: Vector2<f64>,
    /// Rotations: of a twice, of a and b, of b twice.
    turn: [f64; 3],
}

impl PairTangent {
    /// Block of body a twice.
    #[inline]
    pub fn aa(&self) -> Block {
        let ([xx, xy, yy], c) = (self.shift, self.shift_a);
        Matrix3::new(xx, xy, -c.x, xy, yy, -c.y, -c.x, -c.y, self.turn[0])
    }

    /// Block of body b twice.
    #[inline]
    pub fn bb(&self) -> Block {
        let ([xx, xy, yy], c) = (self.shift, self.shift_b);
        Matrix3::new(xx, xy, c.x, xy, yy, c.y, c.x, c.y, self.turn[2])
    }

    /// Block with rows of body a and columns of body b.
    #[inline]
    pub fn ab(&self) -> Block {
        let ([xx, xy, yy], a, b) = (self.shift, self.shift_a, self.shift_b);
        Matrix3::new(-xx, -xy, -b.x, -xy, -yy, -b.y, a.x, a.y, self.turn[1])
    }

    /// The whole, a then b.
    #[inline]
    pub fn matrix(&self) -> Matrix6<f64> {
        let mut h = Matrix6::zeros();
        h.fixed_view_mut::<3, 3>(0, 0).copy_from(&self.aa());
        h.fixed_view_mut::<3, 3>(0, 3).copy_from(&self.ab());
        h.fixed_view_mut::<3, 3>(3, 0).copy_from(&self.ab().transpose());
        h.fixed_view_mut::<3, 3>(3, 3).copy_from(&self.bb());
        h
    }
}

/// Strains of a joint with what their derivatives need.
#[derive(Debug, Clone, Copy)]
pub struct JointKinematics {
    /// e_u (m), g (m), p (rad).
    pub strain: Vector3<f64>,
    /// u and g where the derivatives are taken (m).
    axial: f64,
    shear: f64,
    /// Q·(g, p), half of ∂e_u/∂(g, p).
    pub(super) bent: Vector2<f64>,
    pub(super) opening: Vector2<f64>,
    pub(super) radius_a: Vector2<f64>,
    pub(super) radius_b: Vector2<f64>,
    pub(super) e1: Vector2<f64>,
}

/// Derivatives of the strains.
pub(super) struct Slopes {
    /// ∂(e_u, g)/∂(x, y) of body b; for body a with the other sign; ∂p/∂(x, y) = 0.
    pub(super) u: Vector2<f64>,
    pub(super) g: Vector2<f64>,
    /// ∂strain/∂θ of the bodies.
    pub(super) turn_a: Vector3<f64>,
    pub(super) turn_b: Vector3<f64>,
}

impl JointFrame {
    /// Exact strains at two poses. `second` is Q over (g, p) as (gg, gp, pp).
    #[inline]
    pub fn kinematics(&self, qa: &Pose, qb: &Pose, second: &[f64; 3]) -> JointKinematics {
        self.turned((qa, &HalfTurn::new(qa.z)), (qb, &HalfTurn::new(qb.z)), second)
    }

    /// [`JointFrame::kinematics`] for bodies whose half turns are known.
    #[inline(always)]
    pub(crate) fn turned(
        &self,
        (qa, a): (&Pose, &HalfTurn),
        (qb, b): (&Pose, &HalfTurn),
        second: &[f64; 3],
    ) -> JointKinematics {
        // one sine and cosine of half an angle for each body serve everything: R − 1 of the body, and R of the mean
        let (swing_a, swing_b) = (a.rotation_minus_identity(self.arm_a), b.rotation_minus_identity(self.arm_b));
        let (ra, rb) = (self.arm_a + swing_a, self.arm_b + swing_b);
        let opening = Vector2::new(qb.x - qa.x, qb.y - qa.y) + swing_b - swing_a;
        let e1 = a.mean(b, self.axis);
        let (u, g, p) = (opening.dot(&e1), opening.dot(&perpendicular(e1)), qb.z - qa.z);
        let bent = Vector2::new(second[0] * g + second[1] * p, second[1] * g + second[2] * p);
        let strain = Vector3::new(u + bent.x * g + bent.y * p, g, p);
        JointKinematics { strain, axial: u, shear: g, bent, opening, radius_a: ra, radius_b: rb, e1 }
    }

    /// Strains linearized about the drawn geometry: small displacements, as SUGAR.
    #[inline]
    pub fn linear(&self, qa: &Pose, qb: &Pose) -> JointKinematics {
        let rest = (&Pose::zeros(), &HalfTurn::REST);
        let mut k = self.turned(rest, rest, &[0.0; 3]);
        k.strain = k.rows() * Vector6::new(qa.x, qa.y, qa.z, qb.x, qb.y, qb.z);
        k
    }
}

impl JointKinematics {
    #[inline(always)]
    pub(super) fn slopes(&self) -> Slopes {
        let (g, half_g, half_u) = (perpendicular(self.e1), 0.5 * self.shear, 0.5 * self.axial);
        let (ta, tb) = (perpendicular(self.radius_a), perpendicular(self.radius_b));
        // the frame turns by half (u: +g/2, g: −u/2), the point turns with its body
        let (u_a, u_b) = (half_g - self.e1.dot(&ta), half_g + self.e1.dot(&tb));
        let (g_a, g_b) = (-half_u - g.dot(&ta), -half_u + g.dot(&tb));
        let twice = self.bent * 2.0;
        Slopes {
            u: self.e1 + g * twice.x,
            g,
            turn_a: Vector3::new(u_a + g_a * twice.x - twice.y, g_a, -1.0),
            turn_b: Vector3::new(u_b + g_b * twice.x + twice.y, g_b, 1.0),
        }
    }

    /// The same frame and arms, all strains zero.
    pub(crate) fn unstrained(&self) -> Self {
        Self { strain: Vector3::zeros(), axial: 0.0, shear: 0.0, bent: Vector2::zeros(), ..*self }
    }

    /// ∂strain/∂(q_a, q_b).
    #[inline]
    pub fn rows(&self) -> PairRow {
        let Slopes { u, g, turn_a: a, turn_b: b } = self.slopes();
        PairRow::from_row_slice(&[
            -u.x, -u.y, a.x, u.x, u.y, b.x, //
            -g.x, -g.y, a.y, g.x, g.y, b.y, //
            0.0, 0.0, a.z, 0.0, 0.0, b.z,
        ])
    }

    /// The generalized forces rowsᵀ·stress on bodies a and b: the force n at the joint's two material points, and a moment.
    #[inline(always)]
    pub fn forces(&self, stress: &Vector3<f64>) -> (Pose, Pose) {
        // the second-order strain passes the axial force on to shear and moment
        let double = 2.0 * stress.x;
        let (shear, moment) = (stress.y + double * self.bent.x, stress.z + double * self.bent.y);
        let n = self.e1 * stress.x + perpendicular(self.e1) * shear;
        // the frame turns by half with each body
        let frame = 0.5 * (self.shear * stress.x - self.axial * shear);
        let (at_a, at_b) = (perpendicular(self.radius_a).dot(&n), perpendicular(self.radius_b).dot(&n));
        (Pose::new(-n.x, -n.y, frame - at_a - moment), Pose::new(n.x, n.y, frame + at_b + moment))
    }

    /// rowsᵀ·`stiffness`·rows: the tangent without the joint's stress.
    #[inline(always)]
    pub fn elastic(&self, stiffness: &Symmetric) -> PairTangent {
        let s = self.slopes();
        let [uu, ug, _, gg, ..] = stiffness.0;
        let (to_u, to_g) = (s.u * uu + s.g * ug, s.u * ug + s.g * gg);
        let (a, b) = (*stiffness * s.turn_a, *stiffness * s.turn_b);
        PairTangent {
            shift: [s.u.x * to_u.x + s.g.x * to_g.x, s.u.x * to_u.y + s.g.x * to_g.y, s.u.y * to_u.y + s.g.y * to_g.y],
            shift_a: s.u * a.x + s.g * a.y,
            shift_b: s.u * b.x + s.g * b.y,
            turn: [s.turn_a.dot(&a), s.turn_a.dot(&b), s.turn_b.dot(&b)],
        }
    }

    /// The whole tangent under `stress` (N, V, M): rowsᵀ·stiffness·rows + ∂²(strain · stress)/∂q². `second` is Q.
    #[inline(always)]
    pub fn tangent(&self, stiffness: &Symmetric, stress: &Vector3<f64>, second: &[f64; 3]) -> PairTangent {
        // the axial force bends: 2·N·Q acts between g and p as a stiffness does
        let double = 2.0 * stress.x;
        let [uu, ug, up, gg, gp, pp] = stiffness.0;
        let [bend_gg, bend_gp, bend_pp] = second.map(|q| double * q);
        let mut h = self.elastic(&Symmetric([uu, ug, up, gg + bend_gg, gp + bend_gp, pp + bend_pp]));
        // the force on b, as in `forces`
        let n = self.e1 * stress.x + perpendicular(self.e1) * (stress.y + double * self.bent.x);
        let half = perpendicular(n) * 0.5;
        h.shift_a += half;
        h.shift_b += half;
        let quarter = 0.25 * n.dot(&self.opening);
        h.turn[0] -= quarter;
        h.turn[2] -= quarter;
        h.turn[1] += 0.5 * (n.dot(&self.radius_b) - n.dot(&self.radius_a)) - quarter;
        h
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planar::rotation_minus_identity;

    fn sample() -> (JointFrame, [f64; 3], Pose, Pose) {
        let frame = JointFrame {
            arm_a: Vector2::new(0.7, -0.3),
            arm_b: Vector2::new(-0.4, 0.9),
            axis: Vector2::new(0.4f64.cos(), 0.4f64.sin()),
        };
        let second = [0.6, 0.1, -0.08];
        (frame, second, Pose::new(0.1, -0.2, 0.3), Pose::new(0.15, 0.1, -0.5))
    }

    /// Rows are the derivative of the strains, and `tangent` that of the forces of an elastic joint whose stress follows
    /// its strain: central differences of step 1e-6 agree to 1e-8, which is their own error.
    #[test]
    fn derivatives_match_central_differences() {
        let (frame, second, qa, qb) = sample();
        let stiffness = Symmetric([1.9, 0.3, -0.2, 1.4, 0.5, 1.1]);
        let rest = Vector3::new(-0.4, 0.9, 0.2);
        let at = |q: &Vector6<f64>| {
            frame.kinematics(&q.fixed_rows::<3>(0).into_owned(), &q.fixed_rows::<3>(3).into_owned(), &second)
        };
        let force = |k: &JointKinematics| {
            let (a, b) = k.forces(&(stiffness * (k.strain - rest)));
            Vector6::new(a.x, a.y, a.z, b.x, b.y, b.z)
        };
        let q = Vector6::new(qa.x, qa.y, qa.z, qb.x, qb.y, qb.z);
        let here = at(&q);
        let stress = stiffness * (here.strain - rest);
        assert!((here.rows().transpose() * stress - force(&here)).norm() < 1e-15 * stress.norm());
        let tangent = here.tangent(&stiffness, &stress, &second).matrix();
        for i in 0..6 {
            let (mut lo, mut hi) = (q, q);
            lo[i] -= 1e-6;
            hi[i] += 1e-6;
            let (lo, hi) = (at(&lo), at(&hi));
            let d = (hi.strain - lo.strain) / 2e-6;
            assert!((d - here.rows().column(i)).norm() < 1e-8);
            let h = (force(&hi) - force(&lo)) / 2e-6;
            assert!((h - tangent.column(i)).norm() < 1e-8, "{i}: {h} {}", tangent.column(i));
        }
    }

    /// Linearized forces have the derivatives of the drawn place at any displacement: rowsᵀ·stress, in which the opening has
    /// no share.
    #[test]
    fn linear_forces_keep_the_drawn_frame() {
        let (frame, _, qa, qb) = sample();
        let stress = Vector3::new(1.3, -0.7, 0.4);
        let (at_rest, displaced) = (frame.linear(&Pose::zeros(), &Pose::zeros()), frame.linear(&qa, &qb));
        assert_eq!(displaced.rows(), at_rest.rows());
        assert_eq!(displaced.forces(&stress), at_rest.forces(&stress));
        assert_ne!(displaced.strain, at_rest.strain);
    }

    /// A rigid motion of both bodies strains nothing: to rounding, for a finite rotation.
    #[test]
    fn rigid_motion_is_free() {
        let (frame, second, ..) = sample();
        let (theta, shift) = (0.8, Vector2::new(2.0, -1.0));
        // both centres of mass turn about the origin; the joint lies at arm_a from a at the origin
        let xb = frame.arm_a - frame.arm_b;
        let moved = rotation_minus_identity(theta, xb);
        let qa = Pose::new(shift.x, shift.y, theta);
        let qb = Pose::new(shift.x + moved.x, shift.y + moved.y, theta);
        assert!(frame.kinematics(&qa, &qb, &second).strain.norm() < 1e-15);
    }
}
