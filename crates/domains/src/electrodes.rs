//! Two lumped plates: a field that depends on one approach, and what bears where plates touch.

use super::approach::{Approach, MaterialPoint};
use super::capacitor::{Capacitance, Capacitor};
use super::contact::{Contact, touching_distance};
use super::contact_loss::{Loss, fall_at_pull_in};
use super::domain::{Chord, Configuration, Domain};
use super::edge_field::EdgeField;
use super::from_structure::{FromStructure, StructureView};
use super::loss_tangent::LossTangent;
use super::point_law::Law;
use super::quotient::{self, quotient};
use bimorph_multibody::model::locate;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyId, BodyMatrix, Pattern};
use bimorph_structure::GapVoltage;
use nalgebra::Vector2;

/// Two electrodes.
#[derive(Debug, Clone, PartialEq)]
pub struct Electrodes {
    /// The approach that they measure.
    pub approach: Approach,
    /// C(u).
    pub capacitor: Capacitor,
    /// How they touch; none: never.
    pub contact: Option<Contact>,
    /// Impact losses.
    pub loss: Loss,
}

impl Electrodes {
    /// The force of contact with the distance left at approach `u` (N), and its derivative (N/m).
    fn pressed(&self, u: f64) -> (f64, f64) {
        self.contact.map_or((0.0, 0.0), |contact| contact.force(self.capacitor.distance(u)))
    }
}

impl Electrodes {
    /// Rate-dependent part of that force at approach `u` that changes at `rate` (m/s), and its derivatives with both.
    fn lost(&self, (u, rate): (f64, f64)) -> (f64, f64, f64) {
        let (force, slope) = self.pressed(u);
        let (added, by_rate) = self.loss.fraction(rate);
        (force * added, -slope * added, force * by_rate)
    }

    /// True where its contact loses energy.
    fn loses(&self, at: Configuration<'_>) -> bool {
        self.loss.is_dissipative() && self.contact.is_some_and(|contact| self.distance(at) < contact.touch)
    }
}

impl FromStructure for Electrodes {
    fn lay<'a>(drawing: &StructureView<'a, '_>, mut put: impl FnMut(&'a str, Option<&'a GapVoltage>, Self)) {
        for plate in &drawing.structure.plate_gaps {
            let approach = drawing.approach(plate.a, plate.b, plate.axis);
            let contact = Contact { touch: plate.touch.unwrap_or(touching_distance(plate.gap)), area: plate.area };
            let strength = plate.permittivity * plate.area;
            let edges = EdgeField::of_plates(plate, drawing.chord);
            let shortening = plate.insulation.map_or(0.0, |layer| layer.shortening());
            let least = plate.insulation.map_or(0.0, |layer| 0.5 * layer.series());
            let closest = (contact.least() - shortening).max(least);
            let capacitor = Capacitor::Plates { strength, edges, gap: plate.gap, shortening, closest };
            let loss = Loss::new(&plate.impact);
            put(&plate.name, Some(&plate.voltage), Self { approach, capacitor, contact: Some(contact), loss });
        }
    }

    fn moved(self, to: &dyn Fn(MaterialPoint) -> MaterialPoint) -> Self {
        Self { approach: self.approach.moved(to), ..self }
    }
}

impl Domain for Electrodes {
    type Given = f64;

    fn bodies(&self, see: impl FnMut(BodyId)) {
        self.approach.bodies().into_iter().for_each(see);
    }

    fn is_active(&self, volts: f64) -> bool {
        volts != 0.0 || self.contact.is_some()
    }

    fn add_force(&self, at: Configuration<'_>, volts: f64, r: &mut [Pose]) {
        let m = self.approach.measure(at.q, at.linear);
        let mut first = -0.5 * volts * volts * self.capacitor.at(m.value).slope;
        if let Some(contact) = self.contact {
            first += contact.force(self.capacitor.distance(m.value)).0;
        }
        self.approach.add_force(&m, first, r);
    }

    fn add_force_change(&self, at: Configuration<'_>, volts: f64, change: f64, r: &mut [Pose]) {
        let m = self.approach.measure(at.q, at.linear);
        self.approach.add_force(&m, -volts * change * self.capacitor.at(m.value).slope, r);
    }

    fn add_tangent(&self, at: Configuration<'_>, volts: f64, pattern: &Pattern, tangent: &mut BodyMatrix) {
        let m = self.approach.measure(at.q, at.linear);
        let Capacitance { slope, curvature, .. } = self.capacitor.at(m.value);
        let factor = -0.5 * volts * volts;
        let (mut first, mut second) = (factor * slope, factor * curvature);
        if let Some(contact) = self.contact {
            let (force, slope) = contact.force(self.capacitor.distance(m.value));
            first += force;
            second -= slope; // the distance shrinks as u grows
        }
        let h = m.hessian(first, second);
        locate(pattern, self.approach.a.body, self.approach.b.body).add(tangent, &h);
    }

    fn load_points(&self, at: Configuration<'_>, volts: f64, lever: impl FnMut(MaterialPoint, Vector2<f64>)) {
        let u = self.approach.value(at.q, true);
        self.approach.load_points(-0.5 * volts * volts * self.capacitor.at(u).slope + self.pressed(u).0, lever);
    }

    fn capacitance(&self, at: Configuration<'_>) -> f64 {
        self.capacitor.at(self.approach.value(at.q, at.linear)).value
    }

    fn capacitance_change(&self, at: Configuration<'_>, dq: &[Pose]) -> f64 {
        let m = self.approach.measure(at.q, at.linear);
        self.capacitor.at(m.value).slope * self.approach.change(&m, dq)
    }

    fn pull(&self, at: Configuration<'_>) -> f64 {
        self.capacitor.at(self.approach.value(at.q, at.linear)).slope
    }

    fn pull_and_change(&self, at: Configuration<'_>, dq: &[Pose]) -> (f64, f64) {
        let m = self.approach.measure(at.q, at.linear);
        let Capacitance { slope, curvature, .. } = self.capacitor.at(m.value);
        (slope, curvature * self.approach.change(&m, dq))
    }

    fn is_electrostatic(&self) -> bool {
        true
    }

    fn distance(&self, at: Configuration<'_>) -> f64 {
        self.capacitor.distance(self.approach.value(at.q, at.linear))
    }

    fn distance_change(&self, at: Configuration<'_>, dq: &[Pose]) -> f64 {
        -self.approach.change(&self.approach.measure(at.q, at.linear), dq)
    }

    fn touching(&self) -> Option<[f64; 2]> {
        self.contact.map(|c| [c.touch, c.least()])
    }

    fn closing_bound(&self, q: &[Pose]) -> f64 {
        self.approach.bound(q)
    }

    fn bearing(&self, at: Configuration<'_>) -> f64 {
        self.pressed(self.approach.value(at.q, at.linear)).0
    }

    fn bearing_change(&self, at: Configuration<'_>, dq: &[Pose]) -> f64 {
        let slope = self.pressed(self.approach.value(at.q, at.linear)).1;
        if slope == 0.0 { 0.0 } else { slope * self.distance_change(at, dq) }
    }

    fn contact_energy(&self, at: Configuration<'_>) -> f64 {
        self.contact.map_or(0.0, |contact| contact.energy(self.distance(at)))
    }

    fn contact_work(&self, at: Configuration<'_>, dq: &[Pose]) -> f64 {
        let force = self.contact.map_or(0.0, |contact| contact.force(self.distance(at)).0);
        if force == 0.0 { 0.0 } else { force * self.distance_change(at, dq) }
    }

    fn loss(&self) -> Option<Loss> {
        self.contact.map(|_| self.loss)
    }

    fn set_loss(&mut self, loss: Loss) {
        self.loss = loss;
    }

    fn add_closing(&self, at: Configuration<'_>, r: &mut [Pose]) -> f64 {
        self.add_force_change(at, 1.0, -1.0, r);
        self.contact.map_or(0.0, |contact| fall_at_pull_in(self.distance(at), contact.touch))
    }

    fn add_loss(&self, at: Configuration<'_>, rate: &impl Fn(usize) -> Pose, r: &mut [Pose]) {
        if self.loses(at) {
            let m = self.approach.measure(at.q, at.linear);
            self.approach.add_force(&m, self.lost((m.value, self.approach.rate(&m, rate))).0, r);
        }
    }

    fn add_loss_tangent(&self, at: Configuration<'_>, rate: &impl Fn(usize) -> Pose, to: &mut LossTangent<'_>) -> bool {
        if !self.loses(at) {
            return false;
        }
        self.approach.add_rate_tangent((at.q, at.linear), rate, |now| self.lost(now), to);
        true
    }

    fn add_quotient(&self, chord: &Chord<'_>, volts: f64, pattern: &Pattern, r: &mut [Pose], tangent: &mut BodyMatrix) {
        let factor = -0.5 * volts * volts;
        let law = |u0: f64, u1: f64| {
            let field = |u: f64| {
                let Capacitance { slope, curvature, .. } = self.capacitor.at(u);
                (factor * slope, factor * curvature)
            };
            let ends = [u0, u1].map(|u| (u, factor * self.capacitor.at(u).value));
            let (mut force, mut slope) = quotient(ends[0], ends[1], field);
            if let Some(contact) = self.contact {
                let pressed = |u: f64| {
                    let (force, slope) = contact.force(self.capacitor.distance(u));
                    (force, -slope)
                };
                let ends = [u0, u1].map(|u| (u, contact.energy(self.capacitor.distance(u))));
                let (mean, by_end) = quotient(ends[0], ends[1], pressed);
                let (added, by_rate) = self.loss.fraction((u1 - u0) / chord.h);
                force += mean * (1.0 + added);
                slope += by_end * (1.0 + added) + mean * by_rate / chord.h;
            }
            (force, slope)
        };
        quotient::add(&self.approach, chord, law, pattern, r, tangent);
    }

    fn law(&self) -> Option<(&Approach, Law)> {
        Some((&self.approach, Law::Field(self.capacitor, self.contact)))
    }
}
