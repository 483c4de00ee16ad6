//! A stop between two bodies, or a body and the ground, without a field: the law of [`super::stop`] along one approach.

use super::approach::{Approach, Point};
use super::contact::TOUCH;
use super::domain::{At, Domain, Law};
use super::drawn::{Drawing, Drawn};
use super::stop::{Stop, nearer};
use crate::multibody::model::locate;
use crate::multibody::planar::Pose;
use crate::multibody::{BlockMatrix, BodyId, Pattern};
use crate::structure::GapVoltage;
use nalgebra::Vector2;

/// A stop.
#[derive(Debug, Clone, PartialEq)]
pub struct StopPair {
    /// What it measures.
    pub approach: Approach,
    /// Way along the approach and against it until they touch [m].
    pub ways: [Option<f64>; 2],
    /// How it bears.
    pub stop: Stop,
}

impl Drawn for StopPair {
    fn lay<'a>(drawing: &Drawing<'a, '_>, mut put: impl FnMut(&'a str, Option<&'a GapVoltage>, Self)) {
        let ground = Point { body: BodyId::Ground, arm: Vector2::zeros() };
        for stop in &drawing.structure.stops {
            let b = stop.b.map_or(ground, drawing.point);
            let axis = Vector2::new(stop.axis[0], stop.axis[1]);
            let approach = Approach { a: (drawing.point)(stop.a), b, axis };
            let law = stop.stiffness.map_or(Stop::Rigid(stop.area), Stop::Elastic);
            put(&stop.name, None, Self { approach, ways: stop.ways, stop: law });
        }
    }

    fn moved(self, to: &dyn Fn(Point) -> Point) -> Self {
        Self { approach: self.approach.moved(to), ..self }
    }
}

impl Domain for StopPair {
    type Given = f64;

    fn bodies(&self, see: impl FnMut(BodyId)) {
        self.approach.bodies().into_iter().for_each(see);
    }

    fn add_force(&self, at: At<'_>, _: f64, r: &mut [Pose]) {
        let m = self.approach.measure(at.q, at.linear);
        let first = self.stop.bearing(&self.ways, m.value).0;
        if first != 0.0 {
            self.approach.add_force(&m, first, r);
        }
    }

    fn add_force_change(&self, _: At<'_>, _: f64, _: f64, _: &mut [Pose]) {}

    fn add_tangent(&self, at: At<'_>, _: f64, pattern: &Pattern, tangent: &mut BlockMatrix<f64, 3>) {
        let m = self.approach.measure(at.q, at.linear);
        let (first, second) = self.stop.bearing(&self.ways, m.value);
        if first != 0.0 {
            let h = m.hessian(first, second);
            locate(pattern, self.approach.a.body, self.approach.b.body).add(tangent, &h);
        }
    }

    fn levers(&self, at: At<'_>, _: f64, lever: impl FnMut(Point, Vector2<f64>)) {
        self.approach.levers(self.stop.bearing(&self.ways, self.approach.value(at.q, true)).0, lever);
    }

    /// The way left to the nearer side.
    fn distance(&self, at: At<'_>) -> f64 {
        nearer(&self.ways, self.approach.value(at.q, at.linear)).0
    }

    fn distance_change(&self, at: At<'_>, dq: &[Pose]) -> f64 {
        let slope = nearer(&self.ways, self.approach.value(at.q, at.linear)).1;
        slope * self.approach.change(&self.approach.measure(at.q, at.linear), dq)
    }

    fn touching(&self) -> Option<[f64; 2]> {
        Some([0.0, self.stop.least()])
    }

    /// The way and, beyond it, what a touch takes.
    fn room(&self, at: At<'_>) -> f64 {
        self.distance(at).max(0.0) + TOUCH
    }

    fn bearing(&self, at: At<'_>) -> f64 {
        self.stop.bearing(&self.ways, self.approach.value(at.q, at.linear)).0.abs()
    }

    fn contact_energy(&self, at: At<'_>) -> f64 {
        let u = self.approach.value(at.q, at.linear);
        let side = |way: Option<f64>, u: f64| way.map_or(0.0, |w| self.stop.energy(w - u));
        side(self.ways[0], u) + side(self.ways[1], -u)
    }

    fn contact_work(&self, at: At<'_>, dq: &[Pose]) -> f64 {
        let force = self.stop.force(self.distance(at)).0;
        if force == 0.0 { 0.0 } else { force * self.distance_change(at, dq) }
    }

    fn law(&self) -> Option<(&Approach, Law)> {
        Some((&self.approach, Law::Stop(self.ways, self.stop)))
    }
}
