//! Two beams that face each other: the field and the contact of [`super::facing`], over the four bodies at their ends.

use super::approach::{Approach, Point};
use super::contact::touching_distance;
use super::contact_loss::{Loss, fall_at_pull_in};
use super::domain::{At, Chord, Domain};
use super::drawn::{Drawing, Drawn};
use super::facing::Facing;
use super::facing_ends;
use super::facing_loss::{self, Pair};
use crate::multibody::planar::Pose;
use crate::multibody::{BlockMatrix, BodyId, Pattern};
use crate::structure::GapVoltage;
use nalgebra::{SMatrix, Vector2, Vector4};

/// Two facing beams with ends a–c and b–d.
#[derive(Debug, Clone, PartialEq)]
pub struct FacingBeams {
    /// Approaches of the ends: a against c, b against d, along the direction that opens the gap.
    pub ends: [Approach; 2],
    /// Sign of the slope that a positive rotation makes along the beams.
    pub side: f64,
    /// Constants.
    pub facing: Facing,
    /// What an impact loses.
    pub loss: Loss,
}

impl FacingBeams {
    /// z of [`super::facing`].
    fn values(&self, at: At<'_>) -> Vector4<f64> {
        facing_ends::values(at.linear, &self.ends, self.side, at.q)
    }

    /// Its change.
    fn changes(&self, at: At<'_>, dq: &[Pose]) -> Vector4<f64> {
        facing_ends::changes(at.linear, &self.ends, self.side, at.q, dq)
    }

    /// `r +=` the forces of what is `first` per z.
    fn add(&self, at: At<'_>, first: Vector4<f64>, r: &mut [Pose]) {
        facing_ends::add(at.linear, &self.ends, self.side, at.q, first, r);
    }

    fn pair(&self) -> Pair<'_> {
        Pair { ends: &self.ends, side: self.side, facing: &self.facing, loss: &self.loss }
    }
}

impl Drawn for FacingBeams {
    fn lay<'a>(drawing: &Drawing<'a, '_>, mut put: impl FnMut(&'a str, Option<&'a GapVoltage>, Self)) {
        for pair in &drawing.structure.beam_gaps {
            let normal = pair.angle + pair.side * std::f64::consts::FRAC_PI_2;
            let axis = [normal.cos(), normal.sin()];
            let [a, b, c, d] = pair.nodes;
            let ends = [drawing.approach(a, c, axis), drawing.approach(b, d, axis)];
            let facing = Facing {
                length: pair.length,
                gap: pair.gap,
                strength: pair.permittivity * pair.height * pair.fringe,
                height: pair.height,
                touch: pair.touch.unwrap_or(touching_distance(pair.gap)),
                chord: drawing.chord,
            };
            let loss = Loss::new(&pair.impact);
            put(&pair.name, Some(&pair.voltage), Self { ends, side: pair.side, facing, loss });
        }
    }

    fn moved(self, to: &dyn Fn(Point) -> Point) -> Self {
        Self { ends: self.ends.map(|end| end.moved(to)), ..self }
    }
}

impl Domain for FacingBeams {
    type Given = f64;

    fn bodies(&self, see: impl FnMut(BodyId)) {
        facing_ends::bodies(&self.ends).into_iter().for_each(see);
    }

    fn add_force(&self, at: At<'_>, volts: f64, r: &mut [Pose]) {
        let z = self.values(at);
        let mut first = self.facing.at(&z).gradient * (-0.5 * volts * volts);
        first += self.facing.contact(&z).0;
        self.add(at, first, r);
    }

    fn add_force_change(&self, at: At<'_>, volts: f64, change: f64, r: &mut [Pose]) {
        let first = self.facing.at(&self.values(at)).gradient * (-volts * change);
        self.add(at, first, r);
    }

    fn add_tangent(&self, at: At<'_>, volts: f64, pattern: &Pattern, tangent: &mut BlockMatrix<f64, 3>) {
        let z = self.values(at);
        let (field, (touch, stiffness)) = (self.facing.at(&z), self.facing.contact(&z));
        let factor = -0.5 * volts * volts;
        let first = field.gradient * factor + touch;
        let hz = field.hessian * factor + stiffness;
        let (rows, bend) = facing_ends::rows(at.linear, &self.ends, self.side, at.q);
        let mut h: SMatrix<f64, 12, 12> = rows.transpose() * hz * rows;
        for i in 0..4 {
            // bodies a, b, c, d; ends 0 (a, c) and 1 (b, d)
            h[(3 * i + 2, 3 * i + 2)] += first[2 * (i % 2)] * bend[i];
        }
        facing_ends::add_quad(pattern, &facing_ends::bodies(&self.ends), &h, tangent);
    }

    fn levers(&self, at: At<'_>, volts: f64, mut lever: impl FnMut(Point, Vector2<f64>)) {
        let z = self.values(at);
        let first = self.facing.at(&z).gradient * (-0.5 * volts * volts) + self.facing.contact(&z).0;
        self.ends[0].levers(first[0], &mut lever);
        self.ends[1].levers(first[2], &mut lever);
    }

    fn capacitance(&self, at: At<'_>) -> f64 {
        self.facing.at(&self.values(at)).value
    }

    fn capacitance_change(&self, at: At<'_>, dq: &[Pose]) -> f64 {
        self.facing.at(&self.values(at)).gradient.dot(&self.changes(at, dq))
    }

    fn pull(&self, at: At<'_>) -> f64 {
        let gradient = self.facing.at(&self.values(at)).gradient;
        -(gradient[0] + gradient[2])
    }

    fn pull_and_change(&self, at: At<'_>, dq: &[Pose]) -> (f64, f64) {
        let c = self.facing.at(&self.values(at));
        let dz = c.hessian * self.changes(at, dq);
        (-(c.gradient[0] + c.gradient[2]), -(dz[0] + dz[2]))
    }

    fn closes(&self) -> bool {
        true
    }

    fn line_load(&self, at: At<'_>, volts: f64) -> Option<(f64, f64)> {
        let z = self.values(at);
        let force = self.facing.at(&z).gradient * (-0.5 * volts * volts) + self.facing.contact(&z).0;
        Some(((force[0] + force[2]).abs() / self.facing.length, self.facing.closest(&z).0))
    }

    /// The smallest along the beams.
    fn distance(&self, at: At<'_>) -> f64 {
        self.facing.closest(&self.values(at)).0
    }

    fn distance_change(&self, at: At<'_>, dq: &[Pose]) -> f64 {
        let (_, weights) = self.facing.closest(&self.values(at));
        weights.dot(&self.changes(at, dq))
    }

    fn touching(&self) -> Option<[f64; 2]> {
        Some([self.facing.touch, self.facing.least()])
    }

    fn contact_energy(&self, at: At<'_>) -> f64 {
        self.facing.contact_energy(&self.values(at))
    }

    fn loss(&self) -> Option<Loss> {
        Some(self.loss)
    }

    fn set_loss(&mut self, loss: Loss) {
        self.loss = loss;
    }

    fn add_closing(&self, at: At<'_>, r: &mut [Pose]) -> f64 {
        self.add_force_change(at, 1.0, -1.0, r);
        fall_at_pull_in(self.facing.gap, self.facing.touch)
    }

    fn add_loss(&self, at: At<'_>, rate: &impl Fn(usize) -> Pose, r: &mut [Pose]) {
        facing_loss::add(&self.pair(), at, rate, r);
    }

    fn add_loss_tangent(
        &self,
        at: At<'_>,
        rate: &impl Fn(usize) -> Pose,
        pattern: &Pattern,
        stiffness: &mut BlockMatrix<f64, 3>,
        damping: &mut BlockMatrix<f64, 3>,
    ) -> bool {
        facing_loss::add_tangent(&self.pair(), at, rate, pattern, stiffness, damping)
    }

    fn add_quotient(
        &self,
        chord: &Chord<'_>,
        volts: f64,
        pattern: &Pattern,
        r: &mut [Pose],
        tangent: &mut BlockMatrix<f64, 3>,
    ) {
        facing_loss::add_quotient(&self.pair(), chord, volts, pattern, r, tangent);
    }

    fn contact_work(&self, at: At<'_>, dq: &[Pose]) -> f64 {
        let force = self.facing.contact(&self.values(at)).0;
        if force.x == 0.0 && force.z == 0.0 { 0.0 } else { force.dot(&self.changes(at, dq)) }
    }
}
