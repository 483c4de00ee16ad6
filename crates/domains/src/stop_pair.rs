//! A stop between two bodies, or a body and the ground, without a field: the law of [`super::stop`] along one approach, with adhesion
//! ([`super::attraction`]) and friction across it ([`super::friction`]).

use super::approach::{Approach, ApproachDerivatives, MaterialPoint};
use super::attraction::attraction;
use super::contact::TOUCH;
use super::contact_loss::Loss;
use super::domain::{Chord, Configuration, Domain};
use super::friction;
use super::from_structure::{FromStructure, StructureView};
use super::loss_tangent::LossTangent;
use super::point_law::Law;
use super::quotient::{self, quotient};
use super::stick_point::StickPoint;
use super::stop::{StopKind, lost, nearer};
use bimorph_multibody::model::locate;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyId, BodyMatrix, Pattern};
use bimorph_structure::{Adhesion, Friction, GapVoltage};
use nalgebra::Vector2;

/// A stop.
#[derive(Debug, Clone, PartialEq)]
pub struct StopPair {
    /// The approach that it measures.
    pub approach: Approach,
    /// Way along the approach and against it until they touch (m).
    pub ways: [Option<f64>; 2],
    /// How it bears.
    pub stop: StopKind,
    /// Impact losses.
    pub loss: Loss,
    /// Adhesion, on both sides.
    pub adhesion: Option<Adhesion>,
    /// Friction of what slides along it.
    pub friction: Option<Friction>,
}

impl StopPair {
    /// First and second derivative of the potential with the approach `u` (m): force against it (N), stiffness (N/m).
    fn resisting(&self, u: f64) -> (f64, f64) {
        let (first, second) = self.stop.bearing(&self.ways, u);
        let Some(adhesion) = &self.adhesion else { return (first, second) };
        let side = |way: Option<f64>, u: f64| way.map_or((0.0, 0.0, 0.0), |w| attraction(adhesion, w - u));
        let (ahead, back) = (side(self.ways[0], u), side(self.ways[1], -u));
        (first - ahead.0 + back.0, second + ahead.1 + back.1)
    }

    /// Energy of the adhesion (J), negative.
    fn bound(&self, u: f64) -> f64 {
        let Some(adhesion) = &self.adhesion else { return 0.0 };
        let side = |way: Option<f64>, u: f64| way.map_or(0.0, |w| -attraction(adhesion, w - u).2);
        side(self.ways[0], u) + side(self.ways[1], -u)
    }

    /// Force with which its sides bear on each other while they close at `rate` (m/s) (N).
    fn pressed(&self, u: f64, rate: f64) -> f64 {
        let lost = if self.loss.is_dissipative() { lost(&self.stop, &self.loss, &self.ways, (u, rate)).0 } else { 0.0 };
        (self.stop.bearing(&self.ways, u).0 + lost).abs()
    }

    /// The approach along it, to the left of its axis.
    fn along(&self) -> Approach {
        Approach { axis: Vector2::new(-self.approach.axis.y, self.approach.axis.x), ..self.approach }
    }

    /// The friction of a part that bears on it, with its motion along it and the contact force (N).
    fn sliding(
        &self,
        at: Configuration<'_>,
        rate: &impl Fn(usize) -> Pose,
    ) -> Option<(Friction, Approach, ApproachDerivatives, f64)> {
        let friction = self.friction?;
        let m = self.approach.measure(at.q, at.linear);
        let normal = self.pressed(m.value, self.approach.rate(&m, rate));
        let along = self.along();
        (normal > 0.0).then(|| (friction, along, along.measure(at.q, at.linear), normal))
    }
}

impl FromStructure for StopPair {
    fn lay<'a>(drawing: &StructureView<'a, '_>, mut put: impl FnMut(&'a str, Option<&'a GapVoltage>, Self)) {
        let ground = MaterialPoint { body: BodyId::Ground, arm: Vector2::zeros() };
        for stop in &drawing.structure.stops {
            let b = stop.b.map_or(ground, drawing.point);
            let axis = Vector2::new(stop.axis[0], stop.axis[1]);
            let approach = Approach { a: (drawing.point)(stop.a), b, axis };
            let law = stop.stiffness.map_or(StopKind::Rigid(stop.area), StopKind::Elastic);
            let loss = Loss::new(&stop.impact);
            let (adhesion, friction) = (stop.adhesion, stop.friction);
            put(&stop.name, None, Self { approach, ways: stop.ways, stop: law, loss, adhesion, friction });
        }
    }

    fn moved(self, to: &dyn Fn(MaterialPoint) -> MaterialPoint) -> Self {
        Self { approach: self.approach.moved(to), ..self }
    }
}

impl Domain for StopPair {
    type Given = f64;

    fn bodies(&self, see: impl FnMut(BodyId)) {
        self.approach.bodies().into_iter().for_each(see);
    }

    fn add_force(&self, at: Configuration<'_>, _: f64, r: &mut [Pose]) {
        let m = self.approach.measure(at.q, at.linear);
        let first = self.resisting(m.value).0;
        if first != 0.0 {
            self.approach.add_force(&m, first, r);
        }
    }

    fn add_force_change(&self, _: Configuration<'_>, _: f64, _: f64, _: &mut [Pose]) {}

    fn add_tangent(&self, at: Configuration<'_>, _: f64, pattern: &Pattern, tangent: &mut BodyMatrix) {
        let m = self.approach.measure(at.q, at.linear);
        let (first, second) = self.resisting(m.value);
        if first != 0.0 || second != 0.0 {
            let h = m.hessian(first, second);
            locate(pattern, self.approach.a.body, self.approach.b.body).add(tangent, &h);
        }
    }

    fn load_points(&self, at: Configuration<'_>, _: f64, lever: impl FnMut(MaterialPoint, Vector2<f64>)) {
        self.approach.load_points(self.resisting(self.approach.value(at.q, true)).0, lever);
    }

    /// Of the adhesion.
    fn energy(&self, at: Configuration<'_>, _: f64) -> f64 {
        self.bound(self.approach.value(at.q, at.linear))
    }

    /// The way left to the nearer side.
    fn distance(&self, at: Configuration<'_>) -> f64 {
        nearer(&self.ways, self.approach.value(at.q, at.linear)).0
    }

    fn closing_bound(&self, q: &[Pose]) -> f64 {
        self.approach.bound(q)
    }

    fn distance_change(&self, at: Configuration<'_>, dq: &[Pose]) -> f64 {
        let slope = nearer(&self.ways, self.approach.value(at.q, at.linear)).1;
        slope * self.approach.change(&self.approach.measure(at.q, at.linear), dq)
    }

    fn touching(&self) -> Option<[f64; 2]> {
        Some([0.0, self.stop.least()])
    }

    /// The way and, beyond it, what a touch takes.
    fn clearance(&self, at: Configuration<'_>) -> f64 {
        self.distance(at).max(0.0) + TOUCH
    }

    fn bearing(&self, at: Configuration<'_>) -> f64 {
        self.stop.bearing(&self.ways, self.approach.value(at.q, at.linear)).0.abs()
    }

    fn bearing_change(&self, at: Configuration<'_>, dq: &[Pose]) -> f64 {
        let m = self.approach.measure(at.q, at.linear);
        let (force, stiffness) = self.stop.bearing(&self.ways, m.value);
        if force == 0.0 { 0.0 } else { force.signum() * stiffness * self.approach.change(&m, dq) }
    }

    fn contact_energy(&self, at: Configuration<'_>) -> f64 {
        let u = self.approach.value(at.q, at.linear);
        let side = |way: Option<f64>, u: f64| way.map_or(0.0, |w| self.stop.energy(w - u));
        side(self.ways[0], u) + side(self.ways[1], -u)
    }

    fn contact_work(&self, at: Configuration<'_>, dq: &[Pose]) -> f64 {
        let force = self.stop.force(self.distance(at)).0;
        if force == 0.0 { 0.0 } else { force * self.distance_change(at, dq) }
    }

    fn loss(&self) -> Option<Loss> {
        Some(self.loss)
    }

    fn slides(&self) -> bool {
        self.friction.is_some()
    }

    fn sticks(&self) -> bool {
        self.friction.is_some_and(|friction| friction.stick_stiffness.is_some())
    }

    fn stick_point(&self, at: Configuration<'_>) -> Option<StickPoint> {
        let friction = self.friction?;
        let toward = self.approach.measure(at.q, at.linear);
        let (force, slope) = self.stop.bearing(&self.ways, toward.value);
        let along = self.along();
        Some(StickPoint {
            approach: self.approach,
            toward,
            along,
            slide: along.measure(at.q, at.linear),
            limit: (friction.coefficient * force.abs(), friction.coefficient * slope * force.signum()),
            stiffness: friction.stick_stiffness?,
        })
    }

    fn damps(&self) -> bool {
        self.loss.is_dissipative() || self.friction.is_some()
    }

    fn set_loss(&mut self, loss: Loss) {
        self.loss = loss;
    }

    fn add_closing(&self, at: Configuration<'_>, r: &mut [Pose]) -> f64 {
        let m = self.approach.measure(at.q, at.linear);
        self.approach.add_force(&m, 1.0, r);
        nearer(&self.ways, m.value).0
    }

    fn add_loss(&self, at: Configuration<'_>, rate: &impl Fn(usize) -> Pose, r: &mut [Pose]) {
        if self.loss.is_dissipative() && self.distance(at) < 0.0 {
            let m = self.approach.measure(at.q, at.linear);
            let now = (m.value, self.approach.rate(&m, rate));
            self.approach.add_force(&m, lost(&self.stop, &self.loss, &self.ways, now).0, r);
        }
        if let Some((friction, along, m, normal)) = self.sliding(at, rate) {
            friction::add_force(&friction, (&along, &m), rate, normal, r);
        }
    }

    fn add_loss_tangent(&self, at: Configuration<'_>, rate: &impl Fn(usize) -> Pose, to: &mut LossTangent<'_>) -> bool {
        if !self.damps() || self.distance(at) >= 0.0 {
            return false;
        }
        if self.loss.is_dissipative() {
            self.approach.add_rate_tangent(
                (at.q, at.linear),
                rate,
                |now| lost(&self.stop, &self.loss, &self.ways, now),
                to,
            );
        }
        if let Some((friction, along, m, normal)) = self.sliding(at, rate) {
            friction::add_tangent(&friction, (&along, &m), rate, normal, to);
        }
        true
    }

    fn add_quotient(&self, chord: &Chord<'_>, _: f64, pattern: &Pattern, r: &mut [Pose], tangent: &mut BodyMatrix) {
        let side = |way: Option<f64>, u0: f64, u1: f64| {
            let Some(way) = way.filter(|way| u0.max(u1) > *way) else { return (0.0, 0.0) };
            let pressed = |u: f64| {
                let (force, slope) = self.stop.force(way - u);
                (force, -slope)
            };
            let (mean, by_end) = quotient((u0, self.stop.energy(way - u0)), (u1, self.stop.energy(way - u1)), pressed);
            let (added, by_rate) = self.loss.fraction((u1 - u0) / chord.h);
            (mean * (1.0 + added), by_end * (1.0 + added) + mean * by_rate / chord.h)
        };
        let law = |u0: f64, u1: f64| {
            let (ahead, back) = (side(self.ways[0], u0, u1), side(self.ways[1], -u0, -u1));
            (ahead.0 - back.0, ahead.1 + back.1)
        };
        quotient::add(&self.approach, chord, law, pattern, r, tangent);
        if self.adhesion.is_some() {
            let pulled = |u: f64| {
                let ((with, stiff), (without, plain)) = (self.resisting(u), self.stop.bearing(&self.ways, u));
                (with - without, stiff - plain)
            };
            let law = |u0: f64, u1: f64| quotient((u0, self.bound(u0)), (u1, self.bound(u1)), pulled);
            quotient::add(&self.approach, chord, law, pattern, r, tangent);
        }
        if let Some(friction) = self.friction {
            let [start, middle, end] = chord.at.map(|at| self.approach.value(at.q, at.linear));
            let normal = self.pressed(middle, (end - start) / chord.h);
            friction::add_quotient(&friction, &self.along(), chord, normal, pattern, (r, tangent));
        }
    }

    fn law(&self) -> Option<(&Approach, Law)> {
        Some((&self.approach, Law::Stop(self.ways, self.stop, self.adhesion)))
    }
}
