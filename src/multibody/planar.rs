//! Everything that knows a plane from space: poses, points on bodies, joint strains and their derivatives.
//!
//! # Frames
//! A body's pose is its displacement from the drawn place, q = (x, y, θ) of its centre of mass, so that rest is q = 0 and
//! a displacement of 1e-15 m is not lost against a coordinate of 1e-4 m. `arm` is a vector fixed to a body, from its
//! centre of mass to a point, in the global axes as drawn.
//!
//! # Joint strains
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

use nalgebra::{Matrix2, Matrix3, Matrix6, SMatrix, Vector2, Vector3, Vector6};

/// Degrees of freedom of a planar body: x [m], y [m], θ [rad].
pub const DOF: usize = 3;
/// A body's displacement or rate.
pub type Pose = Vector3<f64>;
/// A 3×3 block of the tangent between two bodies.
pub type Block = Matrix3<f64>;
/// Rows over the six coordinates of a pair of bodies, a then b.
pub type PairRow = SMatrix<f64, 3, 6>;

/// Rotation of `v` by a right angle: the derivative of a rotating vector with respect to its angle.
#[inline]
pub fn turn(v: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-v.y, v.x)
}

/// R(θ)·v.
#[inline]
pub fn rotate(theta: f64, v: Vector2<f64>) -> Vector2<f64> {
    let (s, c) = theta.sin_cos();
    Vector2::new(c * v.x - s * v.y, s * v.x + c * v.y)
}

/// (R(θ) − 1)·v without cancellation at small angles.
#[inline]
pub fn swing(theta: f64, v: Vector2<f64>) -> Vector2<f64> {
    HalfTurn::new(theta).swing(v)
}

/// Sine and cosine of half of a body's rotation.
#[derive(Debug, Clone, Copy)]
struct HalfTurn {
    sin: f64,
    cos: f64,
}

impl HalfTurn {
    #[inline]
    fn new(theta: f64) -> Self {
        let (sin, cos) = (0.5 * theta).sin_cos();
        Self { sin, cos }
    }

    /// (R(θ) − 1)·v without cancellation at small angles.
    #[inline]
    fn swing(&self, v: Vector2<f64>) -> Vector2<f64> {
        let (less, s) = (-2.0 * self.sin * self.sin, 2.0 * self.sin * self.cos);
        Vector2::new(less * v.x - s * v.y, s * v.x + less * v.y)
    }

    /// R((θₐ + θ_b)/2)·v.
    #[inline]
    fn mean(&self, other: &Self, v: Vector2<f64>) -> Vector2<f64> {
        let c = self.cos * other.cos - self.sin * other.sin;
        let s = self.sin * other.cos + self.cos * other.sin;
        Vector2::new(c * v.x - s * v.y, s * v.x + c * v.y)
    }
}

/// Displacement of the point at `arm` on a body at pose `q` [m].
#[inline]
pub fn point(q: &Pose, arm: Vector2<f64>, linear: bool) -> Vector2<f64> {
    let moved = if linear { turn(arm) * q.z } else { swing(q.z, arm) };
    Vector2::new(q.x, q.y) + moved
}

/// ∂(point)/∂θ and ∂²(point)/∂θ² at that pose [m/rad].
#[inline]
pub fn point_turn(q: &Pose, arm: Vector2<f64>, linear: bool) -> (Vector2<f64>, Vector2<f64>) {
    if linear {
        (turn(arm), Vector2::zeros())
    } else {
        let r = rotate(q.z, arm);
        (turn(r), -r)
    }
}

/// The generalized force of a force on the point at `arm`: force and its moment about the centre of mass.
#[inline]
pub fn wrench(q: &Pose, arm: Vector2<f64>, force: Vector2<f64>, linear: bool) -> Pose {
    let (lever, _) = point_turn(q, arm, linear);
    Vector3::new(force.x, force.y, lever.dot(&force))
}

/// Geometry of a joint: where it sits and how its frame is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointFrame {
    /// From the centre of mass of body a to the joint, as drawn [m].
    pub arm_a: Vector2<f64>,
    /// From the centre of mass of body b to the joint, as drawn [m].
    pub arm_b: Vector2<f64>,
    /// Cosine and sine of the drawn angle β of the joint's x axis.
    pub axis: Vector2<f64>,
}

/// Strains of a joint with what their derivatives need.
#[derive(Debug, Clone, Copy)]
pub struct JointKinematics {
    /// e_u [m], g [m], p [rad].
    pub strain: Vector3<f64>,
    /// ∂strain/∂(q_a, q_b).
    pub rows: PairRow,
    /// Q·(g, p), half of ∂e_u/∂(g, p).
    bent: Vector2<f64>,
    opening: Vector2<f64>,
    radius_a: Vector2<f64>,
    radius_b: Vector2<f64>,
    e1: Vector2<f64>,
}

impl JointFrame {
    /// Exact strains at two poses. `second` is Q.
    #[inline]
    pub fn kinematics(&self, qa: &Pose, qb: &Pose, second: &Matrix2<f64>) -> JointKinematics {
        // one sine and cosine of half an angle for each body serve everything: R − 1 of the body, and R of the mean
        let (a, b) = (HalfTurn::new(qa.z), HalfTurn::new(qb.z));
        let (swing_a, swing_b) = (a.swing(self.arm_a), b.swing(self.arm_b));
        let (ra, rb) = (self.arm_a + swing_a, self.arm_b + swing_b);
        let opening = Vector2::new(qb.x - qa.x, qb.y - qa.y) + swing_b - swing_a;
        let e1 = a.mean(&b, self.axis);
        let e2 = turn(e1);
        let (g, p) = (opening.dot(&e2), qb.z - qa.z);
        let bent = second * Vector2::new(g, p);
        let strain = Vector3::new(opening.dot(&e1) + bent.x * g + bent.y * p, g, p);
        // ∂u/∂θ: the frame turns by half (+g/2), the point turns with its body
        let (ta, tb) = (turn(ra), turn(rb));
        let u = Vector6::new(-e1.x, -e1.y, 0.5 * g - e1.dot(&ta), e1.x, e1.y, 0.5 * g + e1.dot(&tb));
        let axial = opening.dot(&e1);
        let v = Vector6::new(-e2.x, -e2.y, -0.5 * axial - e2.dot(&ta), e2.x, e2.y, -0.5 * axial + e2.dot(&tb));
        let w = Vector6::new(0.0, 0.0, -1.0, 0.0, 0.0, 1.0);
        let row_u = u + (v * bent.x + w * bent.y) * 2.0;
        let rows = PairRow::from_rows(&[row_u.transpose(), v.transpose(), w.transpose()]);
        JointKinematics { strain, rows, bent, opening, radius_a: ra, radius_b: rb, e1 }
    }

    /// Strains linearized about the drawn geometry: small displacements, as SUGAR.
    #[inline]
    pub fn linear(&self, qa: &Pose, qb: &Pose) -> JointKinematics {
        let rest = Pose::zeros();
        let mut k = self.kinematics(&rest, &rest, &Matrix2::zeros());
        let q = Vector6::new(qa.x, qa.y, qa.z, qb.x, qb.y, qb.z);
        k.strain = k.rows * q;
        k
    }
}

impl JointKinematics {
    /// ∂²(strain · stress)/∂q² : the geometric stiffness of a joint under `stress` (N, V, M), pair coordinates.
    #[inline]
    pub fn geometric(&self, stress: &Vector3<f64>, second: &Matrix2<f64>) -> Matrix6<f64> {
        let bending = self.rows.fixed_rows::<2>(1);
        let mut h = bending.transpose() * (second * (2.0 * stress.x)) * bending;
        // total force conjugate to (u, g): the second-order strain adds to the shear
        let shear = stress.y + 2.0 * stress.x * self.bent.x;
        let e2 = turn(self.e1);
        let n = self.e1 * stress.x + e2 * shear;
        let sn = turn(n);
        let nd = n.dot(&self.opening);
        for t in [2, 5] {
            for i in 0..2 {
                h[(i, t)] -= 0.5 * sn[i];
                h[(t, i)] -= 0.5 * sn[i];
                h[(i + 3, t)] += 0.5 * sn[i];
                h[(t, i + 3)] += 0.5 * sn[i];
            }
            h[(t, t)] -= 0.25 * nd;
        }
        let (na, nb) = (n.dot(&self.radius_a), n.dot(&self.radius_b));
        let cross = -0.25 * nd + 0.5 * nb - 0.5 * na;
        h[(2, 5)] += cross;
        h[(5, 2)] += cross;
        h
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> (JointFrame, Matrix2<f64>, Pose, Pose) {
        let frame = JointFrame {
            arm_a: Vector2::new(0.7, -0.3),
            arm_b: Vector2::new(-0.4, 0.9),
            axis: Vector2::new(0.4f64.cos(), 0.4f64.sin()),
        };
        let second = Matrix2::new(0.6, 0.1, 0.1, -0.08);
        (frame, second, Pose::new(0.1, -0.2, 0.3), Pose::new(0.15, 0.1, -0.5))
    }

    /// Rows are the derivative of the strains, and `geometric` the derivative of rowsᵀ·stress: central differences of
    /// step 1e-6 agree to 1e-8, which is their own error.
    #[test]
    fn derivatives_match_central_differences() {
        let (frame, second, qa, qb) = sample();
        let stress = Vector3::new(1.3, -0.7, 0.4);
        let at = |q: &Vector6<f64>| {
            frame.kinematics(&q.fixed_rows::<3>(0).into_owned(), &q.fixed_rows::<3>(3).into_owned(), &second)
        };
        let q = Vector6::new(qa.x, qa.y, qa.z, qb.x, qb.y, qb.z);
        let here = at(&q);
        let geometric = here.geometric(&stress, &second);
        for i in 0..6 {
            let (mut lo, mut hi) = (q, q);
            lo[i] -= 1e-6;
            hi[i] += 1e-6;
            let (lo, hi) = (at(&lo), at(&hi));
            let d = (hi.strain - lo.strain) / 2e-6;
            assert!((d - here.rows.column(i)).norm() < 1e-8);
            let h = (hi.rows.transpose() * stress - lo.rows.transpose() * stress) / 2e-6;
            assert!((h - geometric.column(i)).norm() < 1e-8, "{i}: {h} {}", geometric.column(i));
        }
    }

    /// A rigid motion of both bodies strains nothing: to rounding, for a finite rotation.
    #[test]
    fn rigid_motion_is_free() {
        let (frame, second, ..) = sample();
        let (theta, shift) = (0.8, Vector2::new(2.0, -1.0));
        // both centres of mass turn about the origin; the joint lies at arm_a from a at the origin
        let xb = frame.arm_a - frame.arm_b;
        let moved = swing(theta, xb);
        let qa = Pose::new(shift.x, shift.y, theta);
        let qb = Pose::new(shift.x + moved.x, shift.y + moved.y, theta);
        assert!(frame.kinematics(&qa, &qb, &second).strain.norm() < 1e-15);
    }
}
