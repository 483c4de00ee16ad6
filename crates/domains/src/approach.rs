//! The scalar that a gap measures: how far a point of one body has come along a fixed direction towards another's.

use super::loss_tangent::LossTangent;
use bimorph_multibody::model::locate;
use bimorph_multibody::planar::{self, Pose};
use bimorph_multibody::{BodyId, Model};
use nalgebra::{Matrix6, Vector2, Vector6};

/// A material point of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MaterialPoint {
    /// The body.
    pub body: BodyId,
    /// From its centre of mass to the point, as drawn (m).
    pub arm: Vector2<f64>,
}

impl MaterialPoint {
    /// The point of the same body that lies `shift` further as drawn (m); ground has no places.
    #[inline]
    pub fn beyond(&self, shift: Vector2<f64>) -> Self {
        match self.body {
            BodyId::Ground => *self,
            BodyId::Free(_) => Self { body: self.body, arm: self.arm + shift },
        }
    }

    /// Displacement of the point (m).
    #[inline]
    pub fn displacement(&self, q: &[Pose], linear: bool) -> Vector2<f64> {
        planar::point(&Model::pose(q, self.body), self.arm, linear)
    }

    /// Rotation of its body (rad).
    #[inline]
    pub fn rotation(&self, q: &[Pose]) -> f64 {
        Model::pose(q, self.body).z
    }
}

/// u(q) = (displacement of `a` − displacement of `b`) · axis, zero as drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Approach {
    /// Moving point.
    pub a: MaterialPoint,
    /// Point it approaches.
    pub b: MaterialPoint,
    /// Fixed unit vector.
    pub axis: Vector2<f64>,
}

/// An approach with its derivatives over the pair's six coordinates.
#[derive(Debug, Clone, Copy)]
pub struct ApproachDerivatives {
    /// u (m).
    pub value: f64,
    /// ∂u/∂(q_a, q_b).
    pub gradient: Vector6<f64>,
    /// ∂²u/∂θ_a², ∂²u/∂θ_b² (m); every other second derivative is zero.
    pub bend: [f64; 2],
}

impl Approach {
    /// u at a configuration (m).
    #[inline]
    pub fn value(&self, q: &[Pose], linear: bool) -> f64 {
        (self.a.displacement(q, linear) - self.b.displacement(q, linear)).dot(&self.axis)
    }

    /// Bound of |u| at displacements `q` (m), a norm of `q`. A body that rotates by θ moves a point at the arm r by at most |θ|·|r|.
    pub(super) fn bound(&self, q: &[Pose]) -> f64 {
        let moved = |point: &MaterialPoint| {
            let (pose, arm) = (Model::pose(q, point.body), point.arm);
            (pose.x * self.axis.x + pose.y * self.axis.y).abs() + (arm.x.abs() + arm.y.abs()) * pose.z.abs()
        };
        moved(&self.a) + moved(&self.b)
    }

    /// u with its derivatives.
    #[inline]
    pub fn measure(&self, q: &[Pose], linear: bool) -> ApproachDerivatives {
        let (pa, pb) = (Model::pose(q, self.a.body), Model::pose(q, self.b.body));
        let (ta, sa) = planar::point_turn(&pa, self.a.arm, linear);
        let (tb, sb) = planar::point_turn(&pb, self.b.arm, linear);
        let n = self.axis;
        ApproachDerivatives {
            value: self.value(q, linear),
            gradient: Vector6::new(n.x, n.y, n.dot(&ta), -n.x, -n.y, -n.dot(&tb)),
            bend: [n.dot(&sa), -n.dot(&sb)],
        }
    }

    /// Its two bodies.
    pub(super) fn bodies(&self) -> [BodyId; 2] {
        [self.a.body, self.b.body]
    }

    /// The same with its points where `to` takes them.
    #[must_use]
    pub(super) fn moved(self, to: &dyn Fn(MaterialPoint) -> MaterialPoint) -> Self {
        Self { a: to(self.a), b: to(self.b), ..self }
    }

    /// `r +=` the forces of a potential φ(u) with the derivative φ′ = `first`.
    #[inline]
    pub(super) fn add_force(&self, m: &ApproachDerivatives, first: f64, r: &mut [Pose]) {
        let f = m.gradient * first;
        for (id, part) in [(self.a.body, f.fixed_rows::<3>(0)), (self.b.body, f.fixed_rows::<3>(3))] {
            if let BodyId::Free(k) = id {
                r[k] += part;
            }
        }
    }

    /// Change of u with a change `dq` of the configuration where it was measured (m).
    pub(super) fn change(&self, m: &ApproachDerivatives, dq: &[Pose]) -> f64 {
        let (da, db) = (Model::pose(dq, self.a.body), Model::pose(dq, self.b.body));
        m.gradient.fixed_rows::<3>(0).dot(&da) + m.gradient.fixed_rows::<3>(3).dot(&db)
    }

    /// Rate of u where it was measured, with the rate of each body (m/s).
    #[inline]
    pub(super) fn rate(&self, m: &ApproachDerivatives, rate: &impl Fn(usize) -> Pose) -> f64 {
        let of = |id: BodyId| if let BodyId::Free(k) = id { rate(k) } else { Pose::zeros() };
        m.gradient.fixed_rows::<3>(0).dot(&of(self.a.body)) + m.gradient.fixed_rows::<3>(3).dot(&of(self.b.body))
    }

    /// Adds the derivatives over the pair of a force along u, of `law`: its value at u and u̇, and its derivatives with both. That with
    /// displacements is the symmetric part.
    pub(super) fn add_rate_tangent(
        &self,
        (q, linear): (&[Pose], bool),
        rate: &impl Fn(usize) -> Pose,
        law: impl Fn((f64, f64)) -> (f64, f64, f64),
        to: &mut LossTangent<'_>,
    ) {
        let m = self.measure(q, linear);
        let found = law((m.value, self.rate(&m, rate)));
        self.add_rates(&m, rate, found, to);
    }

    /// The same of a force with its derivatives with u and u̇.
    #[inline]
    pub(super) fn add_rates(
        &self,
        m: &ApproachDerivatives,
        rate: &impl Fn(usize) -> Pose,
        (value, by_u, by_rate): (f64, f64, f64),
        to: &mut LossTangent<'_>,
    ) {
        let turn = |id: BodyId| if let BodyId::Free(k) = id { rate(k).z } else { 0.0 };
        let mut k = m.hessian(value, by_u);
        // ∂u̇/∂q has the two rotations alone
        for (i, turned) in [(2, m.bend[0] * turn(self.a.body)), (5, m.bend[1] * turn(self.b.body))] {
            let half = m.gradient * (0.5 * by_rate * turned);
            for j in 0..6 {
                k[(j, i)] += half[j];
                k[(i, j)] += half[j];
            }
        }
        let place = locate(to.pattern, self.a.body, self.b.body);
        place.add(to.stiffness, &k);
        place.add(to.damping, &(m.gradient * m.gradient.transpose() * by_rate));
    }

    /// The forces of that potential on its points: −φ′·n on a, φ′·n on b.
    pub(super) fn load_points(&self, first: f64, mut lever: impl FnMut(MaterialPoint, Vector2<f64>)) {
        lever(self.a, self.axis * -first);
        lever(self.b, self.axis * first);
    }
}

impl ApproachDerivatives {
    /// Hessian of a potential φ(u) over the pair: φ″·∇u∇uᵀ + φ′·∇²u.
    #[inline]
    pub fn hessian(&self, first: f64, second: f64) -> Matrix6<f64> {
        let mut h = self.gradient * self.gradient.transpose() * second;
        h[(2, 2)] += first * self.bend[0];
        h[(5, 5)] += first * self.bend[1];
        h
    }
}
