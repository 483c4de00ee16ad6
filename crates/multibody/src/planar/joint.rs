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

use super::vector::{combined, dot, dot3, minus, plus, right_angle};
use super::{HalfTurn, PairRow, Pose, Vec2, Vec3};
use crate::scalar::Real;
use nalgebra::{Matrix6, Vector2, Vector3, Vector6};

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
pub struct Symmetric<T = f64>(pub [T; 6]);

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

impl<T: Real> Symmetric<T> {
    /// Its product with `x`: the stress (N, V, M) of a strain.
    #[inline(always)]
    pub fn times(&self, x: Vec3<T>) -> Vec3<T> {
        let [uu, ug, up, gg, gp, pp] = self.0;
        [uu * x[0] + ug * x[1] + up * x[2], ug * x[0] + gg * x[1] + gp * x[2], up * x[0] + gp * x[1] + pp * x[2]]
    }
}

impl std::ops::Mul<Vector3<f64>> for Symmetric {
    type Output = Vector3<f64>;

    #[inline]
    fn mul(self, x: Vector3<f64>) -> Vector3<f64> {
        self.times(x.into()).into()
    }
}

/// Second derivatives of an energy of a pair of bodies that depends on their translations through x_b − x_a alone. Blocks are given
/// column by column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairTangent<T = f64> {
    /// Translation of b twice: xx, xy, yy.
    shift: [T; 3],
    /// Translation of b and rotation of a, of b.
    shift_a: Vec2<T>,
    shift_b: Vec2<T>,
    /// Rotations: of a twice, of a and b, of b twice.
    turn: [T; 3],
}

impl<T: Real> PairTangent<T> {
    /// Block of body a twice.
    #[inline(always)]
    pub fn aa(&self) -> [Vec3<T>; 3] {
        let ([xx, xy, yy], [x, y]) = (self.shift, self.shift_a);
        [[xx, xy, -x], [xy, yy, -y], [-x, -y, self.turn[0]]]
    }

    /// Block of body b twice.
    #[inline(always)]
    pub fn bb(&self) -> [Vec3<T>; 3] {
        let ([xx, xy, yy], [x, y]) = (self.shift, self.shift_b);
        [[xx, xy, x], [xy, yy, y], [x, y, self.turn[2]]]
    }

    /// Block with rows of body a and columns of body b.
    #[inline(always)]
    pub fn ab(&self) -> [Vec3<T>; 3] {
        let ([xx, xy, yy], [ax, ay], [bx, by]) = (self.shift, self.shift_a, self.shift_b);
        [[-xx, -xy, ax], [-xy, -yy, ay], [-bx, -by, self.turn[1]]]
    }

    /// Block with rows of body b and columns of body a.
    #[inline(always)]
    pub fn ba(&self) -> [Vec3<T>; 3] {
        let ([xx, xy, yy], [ax, ay], [bx, by]) = (self.shift, self.shift_a, self.shift_b);
        [[-xx, -xy, -bx], [-xy, -yy, -by], [ax, ay, self.turn[1]]]
    }
}

impl PairTangent {
    /// The whole, a then b.
    #[inline]
    pub fn matrix(&self) -> Matrix6<f64> {
        let mut h = Matrix6::zeros();
        h.fixed_view_mut::<3, 3>(0, 0).copy_from(&self.aa().into());
        h.fixed_view_mut::<3, 3>(0, 3).copy_from(&self.ab().into());
        h.fixed_view_mut::<3, 3>(3, 0).copy_from(&self.ba().into());
        h.fixed_view_mut::<3, 3>(3, 3).copy_from(&self.bb().into());
        h
    }
}

/// Strains of a joint with what their derivatives need.
#[derive(Debug, Clone, Copy)]
pub struct JointKinematics<T = f64> {
    /// e_u (m), g (m), p (rad).
    pub strain: Vec3<T>,
    /// u and g where the derivatives are taken (m).
    axial: T,
    shear: T,
    /// Q·(g, p), half of ∂e_u/∂(g, p).
    bent: Vec2<T>,
    opening: Vec2<T>,
    radius_a: Vec2<T>,
    radius_b: Vec2<T>,
    e1: Vec2<T>,
}

/// Derivatives of the strains.
pub(super) struct Slopes<T> {
    /// ∂(e_u, g)/∂(x, y) of body b; for body a with the other sign; ∂p/∂(x, y) = 0.
    pub(super) u: Vec2<T>,
    pub(super) g: Vec2<T>,
    /// ∂strain/∂θ of the bodies.
    pub(super) turn_a: Vec3<T>,
    pub(super) turn_b: Vec3<T>,
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
        let arms = [self.arm_a.into(), self.arm_b.into()];
        JointKinematics::new(arms, self.axis.into(), second, ((*qa).into(), a), ((*qb).into(), b))
    }

    /// Strains linearized about the drawn geometry: small displacements, as SUGAR.
    #[inline]
    pub fn linear(&self, qa: &Pose, qb: &Pose) -> JointKinematics {
        let rest = (&Pose::zeros(), &HalfTurn::REST);
        let mut k = self.turned(rest, rest, &[0.0; 3]);
        k.strain = (k.rows() * Vector6::new(qa.x, qa.y, qa.z, qb.x, qb.y, qb.z)).into();
        k
    }
}

impl<T: Real> JointKinematics<T> {
    /// Exact strains of a joint with these arms of its bodies, drawn axis and Q, between two bodies at given poses with their turns.
    #[inline(always)]
    pub(crate) fn new(
        [arm_a, arm_b]: [Vec2<T>; 2],
        axis: Vec2<T>,
        second: &[T; 3],
        (qa, a): (Vec3<T>, &HalfTurn<T>),
        (qb, b): (Vec3<T>, &HalfTurn<T>),
    ) -> Self {
        // one sine and cosine of half an angle for each body serve everything: R − 1 of the body, and R of the mean
        let (swing_a, swing_b) = (a.rotation_minus_identity(arm_a), b.rotation_minus_identity(arm_b));
        let (radius_a, radius_b) = (plus(arm_a, swing_a), plus(arm_b, swing_b));
        let opening = minus(plus(minus([qb[0], qb[1]], [qa[0], qa[1]]), swing_b), swing_a);
        let e1 = a.mean(b, axis);
        let (u, g, p) = (dot(opening, e1), dot(opening, right_angle(e1)), qb[2] - qa[2]);
        let bent = [second[0] * g + second[1] * p, second[1] * g + second[2] * p];
        let strain = [u + bent[0] * g + bent[1] * p, g, p];
        Self { strain, axial: u, shear: g, bent, opening, radius_a, radius_b, e1 }
    }

    #[inline(always)]
    pub(super) fn slopes(&self) -> Slopes<T> {
        let (g, half_g, half_u) = (right_angle(self.e1), self.shear * 0.5, self.axial * 0.5);
        let one = self.shear.splat_like(1.0);
        let (ta, tb) = (right_angle(self.radius_a), right_angle(self.radius_b));
        // the frame turns by half (u: +g/2, g: −u/2), the point turns with its body
        let (u_a, u_b) = (half_g - dot(self.e1, ta), half_g + dot(self.e1, tb));
        let (g_a, g_b) = (-half_u - dot(g, ta), -half_u + dot(g, tb));
        let twice = [self.bent[0] * 2.0, self.bent[1] * 2.0];
        Slopes {
            u: [self.e1[0] + g[0] * twice[0], self.e1[1] + g[1] * twice[0]],
            g,
            turn_a: [u_a + g_a * twice[0] - twice[1], g_a, -one],
            turn_b: [u_b + g_b * twice[0] + twice[1], g_b, one],
        }
    }

    /// The generalized forces rowsᵀ·stress on bodies a and b: the force n at the joint's two material points, and a moment.
    #[inline(always)]
    pub fn forces(&self, stress: &Vec3<T>) -> (Vec3<T>, Vec3<T>) {
        // the second-order strain passes the axial force on to shear and moment
        let double = stress[0] * 2.0;
        let (shear, moment) = (stress[1] + double * self.bent[0], stress[2] + double * self.bent[1]);
        let n = combined(self.e1, stress[0], right_angle(self.e1), shear);
        // the frame turns by half with each body
        let frame = (self.shear * stress[0] - self.axial * shear) * 0.5;
        let (at_a, at_b) = (dot(right_angle(self.radius_a), n), dot(right_angle(self.radius_b), n));
        ([-n[0], -n[1], frame - at_a - moment], [n[0], n[1], frame + at_b + moment])
    }

    /// rowsᵀ·`stiffness`·rows: the tangent without the joint's stress.
    #[inline(always)]
    pub fn elastic(&self, stiffness: &Symmetric<T>) -> PairTangent<T> {
        let Slopes { u, g, turn_a, turn_b } = self.slopes();
        let [uu, ug, _, gg, ..] = stiffness.0;
        let (to_u, to_g) = (combined(u, uu, g, ug), combined(u, ug, g, gg));
        let (a, b) = (stiffness.times(turn_a), stiffness.times(turn_b));
        PairTangent {
            shift: [u[0] * to_u[0] + g[0] * to_g[0], u[0] * to_u[1] + g[0] * to_g[1], u[1] * to_u[1] + g[1] * to_g[1]],
            shift_a: combined(u, a[0], g, a[1]),
            shift_b: combined(u, b[0], g, b[1]),
            turn: [dot3(turn_a, a), dot3(turn_a, b), dot3(turn_b, b)],
        }
    }

    /// The parts of the tangent under `stress` (N, V, M): the stiffness over the strains, the rest between translation and either
    /// rotation, and the rest over the rotations of a twice, of a and b, of b twice.
    #[inline(always)]
    pub(super) fn stressed(
        &self,
        stiffness: &Symmetric<T>,
        stress: &Vec3<T>,
        second: &[T; 3],
    ) -> (Symmetric<T>, Vec2<T>, [T; 3]) {
        // the axial force bends: 2·N·Q acts between g and p as a stiffness does
        let double = stress[0] * 2.0;
        let [uu, ug, up, gg, gp, pp] = stiffness.0;
        let [q_gg, q_gp, q_pp] = *second;
        let stiffness = [uu, ug, up, gg + double * q_gg, gp + double * q_gp, pp + double * q_pp];
        // the force on b, as in `forces`
        let n = combined(self.e1, stress[0], right_angle(self.e1), stress[1] + double * self.bent[0]);
        let [x, y] = right_angle(n);
        let quarter = dot(n, self.opening) * 0.25;
        let between = (dot(n, self.radius_b) - dot(n, self.radius_a)) * 0.5;
        (Symmetric(stiffness), [x * 0.5, y * 0.5], [-quarter, between - quarter, -quarter])
    }

    /// The whole tangent under `stress` (N, V, M): rowsᵀ·stiffness·rows + ∂²(strain · stress)/∂q². `second` is Q.
    #[inline(always)]
    pub fn tangent(&self, stiffness: &Symmetric<T>, stress: &Vec3<T>, second: &[T; 3]) -> PairTangent<T> {
        let (stiffness, half, turn) = self.stressed(stiffness, stress, second);
        let mut h = self.elastic(&stiffness);
        (h.shift_a, h.shift_b) = (plus(h.shift_a, half), plus(h.shift_b, half));
        for (h, turn) in h.turn.iter_mut().zip(turn) {
            *h += turn;
        }
        h
    }
}

impl JointKinematics {
    /// The same frame and arms, all strains zero.
    pub(crate) fn unstrained(&self) -> Self {
        Self { strain: [0.0; 3], axial: 0.0, shear: 0.0, bent: [0.0; 2], ..*self }
    }

    /// ∂strain/∂(q_a, q_b).
    #[inline]
    pub fn rows(&self) -> PairRow {
        let Slopes { u, g, turn_a: a, turn_b: b } = self.slopes();
        PairRow::from_row_slice(&[
            -u[0], -u[1], a[0], u[0], u[1], b[0], //
            -g[0], -g[1], a[1], g[0], g[1], b[1], //
            0.0, 0.0, a[2], 0.0, 0.0, b[2],
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planar::rotation_minus_identity;
    use crate::scalar::Dual;

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
        let stress = |k: &JointKinematics| stiffness.times((Vector3::from(k.strain) - rest).into());
        let force = |k: &JointKinematics| {
            let (a, b) = k.forces(&stress(k));
            Vector6::new(a[0], a[1], a[2], b[0], b[1], b[2])
        };
        let q = Vector6::new(qa.x, qa.y, qa.z, qb.x, qb.y, qb.z);
        let here = at(&q);
        let stress = stress(&here);
        let by_rows = here.rows().transpose() * Vector3::from(stress);
        assert!((by_rows - force(&here)).norm() < 1e-15 * Vector3::from(stress).norm());
        let tangent = here.tangent(&stiffness, &stress, &second).matrix();
        for i in 0..6 {
            let (mut lo, mut hi) = (q, q);
            lo[i] -= 1e-6;
            hi[i] += 1e-6;
            let (lo, hi) = (at(&lo), at(&hi));
            let d = (Vector3::from(hi.strain) - Vector3::from(lo.strain)) / 2e-6;
            assert!((d - here.rows().column(i)).norm() < 1e-8);
            let h = (force(&hi) - force(&lo)) / 2e-6;
            assert!((h - tangent.column(i)).norm() < 1e-8, "{i}: {h} {}", tangent.column(i));
        }
    }

    /// The law over values with their derivatives: strains change as rows·dq does and forces as tangent·dq does, to rounding
    /// (1e-14).
    #[test]
    fn derivatives_are_exact() {
        let (frame, second, qa, qb) = sample();
        let stiffness = Symmetric([1.9, 0.3, -0.2, 1.4, 0.5, 1.1]);
        let dq = Vector6::new(0.3, -0.7, 0.2, 0.5, 0.1, -0.4);
        let body = |q: &Pose, from: usize| [0, 1, 2].map(|i| Dual { value: q[i], change: dq[from + i] });
        let turn = |theta: Dual| {
            let (sin, cos) = (theta * 0.5).sin_cos();
            HalfTurn::of([sin, cos])
        };
        let still = |v: Vector2<f64>| [v.x, v.y].map(Dual::constant);
        let (a, b) = (body(&qa, 0), body(&qb, 3));
        let arms = [still(frame.arm_a), still(frame.arm_b)];
        let second_order = second.map(Dual::constant);
        let k = JointKinematics::new(arms, still(frame.axis), &second_order, (a, &turn(a[2])), (b, &turn(b[2])));
        let here = frame.kinematics(&qa, &qb, &second);
        assert_eq!(k.strain.map(|e| e.value), here.strain);
        let strain = Vector3::from(k.strain.map(|e| e.change));
        assert!((strain - here.rows() * dq).norm() < 1e-14);
        let stress = Symmetric(stiffness.0.map(Dual::constant)).times(k.strain);
        let (on_a, on_b) = k.forces(&stress);
        let force = Vector6::from_iterator(on_a.into_iter().chain(on_b).map(|f| f.change));
        let tangent = here.tangent(&stiffness, &stress.map(|s| s.value), &second).matrix();
        assert!((force - tangent * dq).norm() < 1e-14, "{force} {}", tangent * dq);
    }

    /// Linearized forces have the derivatives of the drawn place at any displacement: rowsᵀ·stress, in which the opening has
    /// no share.
    #[test]
    fn linear_forces_keep_the_drawn_frame() {
        let (frame, _, qa, qb) = sample();
        let stress = [1.3, -0.7, 0.4];
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
        assert!(Vector3::from(frame.kinematics(&qa, &qb, &second).strain).norm() < 1e-15);
    }
}
