//! The quadratic and cubic terms of a lumped spring.
//! ```text
//! U = Σ k₂·d³/3 + k₃·d⁴/4      force k₂·d² + k₃·d³      stiffness 2·k₂·d + 3·k₃·d²
//! ```
//! over the three strains d of the spring: along local x and y, and the rotation. Its linear terms are a joint of the mechanism, whose strains these are.

use super::approach::{Approach, MaterialPoint};
use super::domain::{Configuration, Domain};
use super::from_structure::{FromStructure, StructureView};
use super::point_law::Law;
use bimorph_multibody::model::locate;
use bimorph_multibody::planar::{JointFrame, JointKinematics, Pose, Symmetric, Vec3};
use bimorph_multibody::{BodyId, BodyMatrix, Model, Pattern};
use bimorph_structure::GapVoltage;
use nalgebra::Vector2;

/// k₂ and k₃ along local x (N/m², N/m³), along local y, and about z (N·m/rad², N·m/rad³).
pub type SpringTerms = [[f64; 2]; 3];

/// Terms of one spring.
#[derive(Debug, Clone, PartialEq)]
pub struct PolynomialSpring {
    /// Half way between its nodes as drawn, as a point of the body of the first node.
    pub a: MaterialPoint,
    /// The same as a point of the body of the second node.
    pub b: MaterialPoint,
    /// Its local x axis, a unit vector.
    pub axis: Vector2<f64>,
    /// Its terms.
    pub terms: SpringTerms,
}

impl PolynomialSpring {
    fn strained(&self, at: Configuration<'_>) -> JointKinematics {
        let frame = JointFrame { arm_a: self.a.arm, arm_b: self.b.arm, axis: self.axis };
        let (qa, qb) = (Model::pose(at.q, self.a.body), Model::pose(at.q, self.b.body));
        if at.linear { frame.linear(&qa, &qb) } else { frame.kinematics(&qa, &qb, &[0.0; 3]) }
    }

    /// Forces over the strains.
    fn stress(&self, strain: &Vec3<f64>) -> Vec3<f64> {
        std::array::from_fn(|i| {
            let ([k2, k3], d) = (self.terms[i], strain[i]);
            d * d * (k2 + k3 * d)
        })
    }

    fn stiffness(&self, strain: &Vec3<f64>) -> Symmetric {
        let [u, g, p] = std::array::from_fn(|i| {
            let ([k2, k3], d) = (self.terms[i], strain[i]);
            d * (2.0 * k2 + 3.0 * k3 * d)
        });
        Symmetric([u, 0.0, 0.0, g, 0.0, p])
    }
}

impl FromStructure for PolynomialSpring {
    fn lay<'a>(drawing: &StructureView<'a, '_>, mut put: impl FnMut(&'a str, Option<&'a GapVoltage>, Self)) {
        for spring in &drawing.structure.springs {
            let Some(terms) = spring.polynomial else { continue };
            let (a, b) = ((drawing.point)(spring.a), (drawing.point)(spring.b));
            if a.body == b.body {
                continue;
            }
            let [from, to] = [spring.a, spring.b].map(|node| Vector2::from(drawing.structure.nodes[node.0].position));
            let half = (to - from) * 0.5;
            let axis = Vector2::new(spring.angle.cos(), spring.angle.sin());
            put(&spring.name, None, Self { a: a.beyond(half), b: b.beyond(-half), axis, terms });
        }
    }

    fn moved(self, to: &dyn Fn(MaterialPoint) -> MaterialPoint) -> Self {
        Self { a: to(self.a), b: to(self.b), ..self }
    }
}

impl Domain for PolynomialSpring {
    type Given = f64;

    fn is_gap(&self) -> bool {
        false
    }

    fn bodies(&self, mut see: impl FnMut(BodyId)) {
        see(self.a.body);
        see(self.b.body);
    }

    fn add_force(&self, at: Configuration<'_>, _: f64, r: &mut [Pose]) {
        let strained = self.strained(at);
        let (on_a, on_b) = strained.forces(&self.stress(&strained.strain));
        for (id, part) in [(self.a.body, on_a), (self.b.body, on_b)] {
            if let BodyId::Free(k) = id {
                r[k] += Pose::from(part);
            }
        }
    }

    fn add_force_change(&self, _: Configuration<'_>, _: f64, _: f64, _: &mut [Pose]) {}

    fn add_tangent(&self, at: Configuration<'_>, _: f64, pattern: &Pattern, tangent: &mut BodyMatrix) {
        let strained = self.strained(at);
        let stiffness = self.stiffness(&strained.strain);
        let h = match at.linear {
            true => strained.elastic(&stiffness),
            false => strained.tangent(&stiffness, &self.stress(&strained.strain), &[0.0; 3]),
        };
        locate(pattern, self.a.body, self.b.body).add(tangent, &h.matrix());
    }

    fn energy(&self, at: Configuration<'_>, _: f64) -> f64 {
        let strain = self.strained(at).strain;
        (0..3).map(|i| strain[i].powi(3) * (self.terms[i][0] / 3.0 + self.terms[i][1] * strain[i] / 4.0)).sum()
    }

    /// Of parts that slide.
    fn laws(&self) -> Vec<(Approach, Law)> {
        let across = Vector2::new(-self.axis.y, self.axis.x);
        let along = [(self.axis, self.terms[0]), (across, self.terms[1])];
        let law = |(axis, terms)| (Approach { a: self.a, b: self.b, axis }, Law::Spring(terms));
        along.into_iter().filter(|(_, terms)| *terms != [0.0; 2]).map(law).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Force is the slope of the energy and the tangent that of the force, within 1e-7 of their size by central differences, at 50 random states of two
    /// bodies far from rest, and at small displacements.
    #[test]
    fn one_potential() {
        let point = |body, x, y| MaterialPoint { body, arm: Vector2::new(x, y) };
        let spring = PolynomialSpring {
            a: point(BodyId::Free(0), 0.7, -0.2),
            b: point(BodyId::Free(1), -0.4, 0.3),
            axis: Vector2::new(0.6, 0.8),
            terms: [[1.3, 2.0], [-0.7, 1.1], [0.4, 0.9]],
        };
        let pattern = Pattern::new(2, &[(0, 1)]);
        let mut seed = 7_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 40) as f64 / f64::from(1 << 23) - 1.0
        };
        for k in 0..50 {
            let linear = k % 5 == 0;
            let q: Vec<Pose> = (0..2).map(|_| Pose::new(random(), random(), random())).collect();
            let way: Vec<Pose> = (0..2).map(|_| Pose::new(random(), random(), random())).collect();
            let at = |h: f64| q.iter().zip(&way).map(|(q, w)| q + w * h).collect::<Vec<Pose>>();
            let force = |q: &[Pose]| {
                let mut r = vec![Pose::zeros(); 2];
                spring.add_force(Configuration { q, linear }, 0.0, &mut r);
                r
            };
            let h = 1e-4;
            let energy = |h: f64| spring.energy(Configuration { q: &at(h), linear }, 0.0);
            let slope = (8.0 * (energy(h) - energy(-h)) - energy(2.0 * h) + energy(-2.0 * h)) / (12.0 * h);
            let work: f64 = force(&q).iter().zip(&way).map(|(f, w)| f.dot(w)).sum();
            assert!((slope - work).abs() < 1e-7 * (1.0 + work.abs()), "{k}: {slope} {work}");
            let mut tangent = BodyMatrix::new(&pattern);
            spring.add_tangent(Configuration { q: &q, linear }, 0.0, &pattern, &mut tangent);
            let mut change = vec![Pose::zeros(); 2];
            tangent.multiply_add(&pattern, &way, &mut change);
            let [far, near, back, behind] = [2.0 * h, h, -h, -2.0 * h].map(|h| force(&at(h)));
            for b in 0..2 {
                let found = ((near[b] - back[b]) * 8.0 - far[b] + behind[b]) / (12.0 * h);
                assert!((found - change[b]).norm() < 1e-7 * (1.0 + found.norm()), "{k}: {found} {}", change[b]);
            }
        }
    }
}
