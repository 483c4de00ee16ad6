//! A comb drive: the field of its fingers over their overlap and over how far they lie aside of the middle of their gaps ([`super::comb_sides`]).
//!
//! Both displacements are those of the bodies, along fixed directions: the overlap at the nodes, the distance aside in the middle of the overlap as drawn. A rotation
//! therefore moves the fingers aside, and they stay parallel. Where the field pulls fingers to the side faster than springs hold them, the comb loses its stability, and the
//! fingers come to rest on each other's sides. Contact loses energy as [`super::contact_loss`] has it, in its force across.
//!
//! Reference: R. Legtenberg, A. W. Groeneveld, M. Elwenspoek, "Comb-drive actuators for large displacements", J. Micromech. Microeng. 6 (1996) 320–329.

use super::approach::{Approach, ApproachDerivatives, MaterialPoint};
use super::capacitor::Capacitor;
use super::comb_field::{CombField, above_and_below};
use super::comb_sides::{CombLaw, CombSides, substrate_share};
use super::contact::{Contact, touching_distance};
use super::contact_loss::{Loss, snap_aside};
use super::domain::{Chord, Configuration, Domain, SideContact, SideRoom};
use super::from_structure::{FromStructure, StructureView};
use super::jet::Jet;
use super::loss_tangent::LossTangent;
use super::point_law::{Law, PointLaw};
use super::quotient::{SMALL, quotient};
use bimorph_multibody::model::locate;
use bimorph_multibody::planar::Pose;
use bimorph_multibody::{BodyId, BodyMatrix, Pattern};
use bimorph_structure::{Comb, Fringe, GapVoltage};
use nalgebra::Vector2;

/// Distance aside, of the gap, up to which fingers count as in the middle of their gaps (1).
const MIDDLE: f64 = 1e-9;

/// A comb drive.
#[derive(Debug, Clone, PartialEq)]
pub struct CombDrive {
    /// The approach of its sides along the fingers.
    pub approach: Approach,
    /// C(u) of fingers in the middle of their gaps.
    pub capacitor: Capacitor,
    /// The motion across the fingers, and the field with it; none: SUGAR's comb, which has no side force.
    pub sides: Option<(Approach, CombLaw)>,
    /// Impact losses of the sides.
    pub loss: Loss,
}

/// Displacements along and across the fingers at a configuration.
struct Seen {
    along: ApproachDerivatives,
    across: Option<ApproachDerivatives>,
    /// C over both.
    field: Jet,
    /// Energy of the contact at the sides, where they touch.
    pressed: Option<Jet>,
}

impl Seen {
    /// The potential at a voltage.
    fn potential(&self, volts: f64) -> Jet {
        let field = self.field * (-0.5 * volts * volts);
        self.pressed.map_or(field, |pressed| field + pressed)
    }
}

impl CombDrive {
    fn new(comb: &Comb, approach: Approach, sugar: bool) -> Self {
        let strength = comb.gaps * comb.permittivity;
        let [length, width] = comb.finger;
        let exact = comb.law.unwrap_or(if sugar { Fringe::None } else { Fringe::Exact }) == Fringe::Exact;
        let fingers = (exact && comb.finite && width > 0.0)
            .then(|| (width, CombField::new(strength * comb.height, [comb.gap, width, length])));
        let rho = width / comb.gap;
        let substrate = if comb.substrate > 0.0 { substrate_share(rho, comb.substrate / comb.gap) } else { 0.0 };
        let slope = match fingers {
            Some(_) => strength * (above_and_below(rho) - substrate),
            None => strength * comb.height / comb.gap,
        };
        let capacitor = Capacitor::Comb {
            slope,
            overlap: if comb.finite { comb.overlap } else { f64::INFINITY },
            blend: comb.gap,
            parasitic: comb.parasitic,
            fingers: fingers.map(|(_, field)| field),
        };
        let touch = comb.touch.unwrap_or(touching_distance(comb.gap));
        let sides = (comb.finite && !sugar).then(|| {
            // the middle of the overlap as drawn
            let middle = approach.axis * (length - 0.5 * comb.overlap).max(0.0);
            let (a, b) = (approach.a.beyond(middle), approach.b.beyond(-middle));
            let across = Approach { a, b, axis: Vector2::new(-approach.axis.y, approach.axis.x) };
            let sides = CombSides {
                strength,
                height: comb.height,
                gap: comb.gap,
                fingers,
                substrate,
                contact: Contact { touch, area: 0.5 * comb.gaps * comb.height },
                parasitic: comb.parasitic,
            };
            let law = CombLaw { sides, drawn: [comb.overlap, comb.misalignment] };
            (across, law)
        });
        Self { approach, capacitor, sides, loss: Loss::new(&comb.impact) }
    }

    /// C over the approach `u` and the displacement `y` across (m).
    fn field(&self, u: f64, y: f64) -> Jet {
        let Some((_, law)) = &self.sides else {
            let c = self.capacitor.at(u);
            return Jet { value: c.value, first: [c.slope, 0.0], second: [c.curvature, 0.0, 0.0] };
        };
        let found = law.field([u, y]);
        if law.aside(y).abs() > MIDDLE * law.sides.gap {
            return found;
        }
        // the square of such a distance is below rounding: the same number as without it
        let c = self.capacitor.at(u);
        Jet {
            value: c.value,
            first: [c.slope, found.first[1]],
            second: [c.curvature, found.second[1], found.second[2]],
        }
    }

    /// Energy of the contact at the sides over the same (J), where they touch.
    fn pressed(&self, u: f64, y: f64) -> Option<Jet> {
        let (_, law) = self.sides.as_ref()?;
        law.pressed([u, y])
    }

    /// That energy at a configuration.
    fn pressed_at(&self, at: Configuration<'_>) -> Option<Jet> {
        let (across, _) = self.sides.as_ref()?;
        self.pressed(self.approach.value(at.q, at.linear), across.value(at.q, at.linear))
    }

    fn seen(&self, at: Configuration<'_>) -> Seen {
        let along = self.approach.measure(at.q, at.linear);
        let across = self.sides.as_ref().map(|(across, _)| across.measure(at.q, at.linear));
        let y = across.map_or(0.0, |m| m.value);
        Seen { along, across, field: self.field(along.value, y), pressed: self.pressed(along.value, y) }
    }

    /// The same where there is a force.
    fn acting(&self, at: Configuration<'_>, volts: f64) -> Option<Seen> {
        (volts != 0.0 || self.pressed_at(at).is_some()).then(|| self.seen(at))
    }

    /// Rate-dependent part of the contact force across at the rate of y (m/s), and its derivatives with u, y and this rate.
    fn lost(&self, pressed: &Jet, rate: f64) -> (f64, [f64; 2], f64) {
        let force = pressed.first[1];
        let side = force.signum();
        let (added, by_rate) = self.loss.fraction(side * rate);
        (force * added, [pressed.second[1] * added, pressed.second[2] * added], force * by_rate * side)
    }

    /// Rate-dependent part of the mean contact force across over a step of length `h` (s) between two overlaps and distances aside, and its derivative with
    /// the last distance.
    fn quotient_lost(&self, u: [f64; 2], y: [f64; 2], h: f64) -> (f64, f64) {
        let over = |u: f64| {
            let energy = |y: f64| (y, self.pressed(u, y).map_or(0.0, |pressed| pressed.value));
            let law = |y: f64| self.pressed(u, y).map_or((0.0, 0.0), |at| (at.first[1], at.second[2]));
            quotient(energy(y[0]), energy(y[1]), law)
        };
        let (a, b) = (over(u[0]), over(u[1]));
        let (mean, by_end) = (0.5 * (a.0 + b.0), 0.5 * (a.1 + b.1));
        let side = mean.signum();
        let (added, by_rate) = self.loss.fraction(side * (y[1] - y[0]) / h);
        (mean * added, by_end * added + mean * by_rate * side / h)
    }

    /// The contact of the sides where it loses energy, with what is measured there.
    fn losing(&self, at: Configuration<'_>) -> Option<(&Approach, Seen, Jet, ApproachDerivatives)> {
        if !self.loss.is_dissipative() {
            return None;
        }
        self.pressed_at(at)?;
        let seen = self.seen(at);
        let ((across, _), pressed, m) = (self.sides.as_ref()?, seen.pressed?, seen.across?);
        Some((across, seen, pressed, m))
    }

    /// `r +=` the forces of a potential with these derivatives along and across.
    fn add(&self, seen: &Seen, first: [f64; 2], r: &mut [Pose]) {
        self.approach.add_force(&seen.along, first[0], r);
        if let (Some((across, _)), Some(m)) = (&self.sides, &seen.across)
            && first[1] != 0.0
        {
            across.add_force(m, first[1], r);
        }
    }

    /// Adds the Hessian of a potential with these derivatives.
    fn add_hessian(&self, seen: &Seen, first: [f64; 2], second: [f64; 3], pattern: &Pattern, tangent: &mut BodyMatrix) {
        let mut h = seen.along.hessian(first[0], second[0]);
        if let Some(across) = &seen.across {
            h += across.hessian(first[1], second[2]);
            if second[1] != 0.0 {
                let mixed = seen.along.gradient * across.gradient.transpose() * second[1];
                h += mixed + mixed.transpose();
            }
        }
        locate(pattern, self.approach.a.body, self.approach.b.body).add(tangent, &h);
    }

    /// Changes of both displacements with a change of the configuration.
    fn changes(&self, seen: &Seen, dq: &[Pose]) -> [f64; 2] {
        let across = self.sides.as_ref().zip(seen.across.as_ref()).map_or(0.0, |((across, _), m)| across.change(m, dq));
        [self.approach.change(&seen.along, dq), across]
    }
}

/// Room of the sides of fingers.
fn room(law: &CombLaw) -> SideRoom {
    SideRoom { drawn: law.drawn[1], room: law.sides.gap - law.sides.contact.touch }
}

impl FromStructure for CombDrive {
    fn lay<'a>(drawing: &StructureView<'a, '_>, mut put: impl FnMut(&'a str, Option<&'a GapVoltage>, Self)) {
        for comb in &drawing.structure.combs {
            let approach = drawing.approach(comb.a, comb.b, comb.axis);
            put(&comb.name, Some(&comb.voltage), Self::new(comb, approach, drawing.chord));
        }
    }

    fn moved(self, to: &dyn Fn(MaterialPoint) -> MaterialPoint) -> Self {
        let sides = self.sides.map(|(across, law)| (across.moved(to), law));
        Self { approach: self.approach.moved(to), sides, ..self }
    }
}

impl Domain for CombDrive {
    type Given = f64;

    fn bodies(&self, see: impl FnMut(BodyId)) {
        self.approach.bodies().into_iter().for_each(see);
    }

    fn is_active(&self, volts: f64) -> bool {
        volts != 0.0 || self.sides.is_some()
    }

    fn is_active_as_drawn(&self, volts: f64) -> bool {
        volts != 0.0
    }

    fn add_force(&self, at: Configuration<'_>, volts: f64, r: &mut [Pose]) {
        self.add_force_finding_apart(at, volts, r);
    }

    fn add_force_finding_apart(&self, at: Configuration<'_>, volts: f64, r: &mut [Pose]) -> bool {
        let Some(seen) = self.acting(at, volts) else { return true };
        self.add(&seen, seen.potential(volts).first, r);
        seen.pressed.is_none()
    }

    fn add_force_change(&self, at: Configuration<'_>, volts: f64, change: f64, r: &mut [Pose]) {
        let (seen, factor) = (self.seen(at), -volts * change);
        self.add(&seen, seen.field.first.map(|x| factor * x), r);
    }

    fn add_tangent(&self, at: Configuration<'_>, volts: f64, pattern: &Pattern, tangent: &mut BodyMatrix) {
        let Some(seen) = self.acting(at, volts) else { return };
        let Jet { first, second, .. } = seen.potential(volts);
        self.add_hessian(&seen, first, second, pattern, tangent);
    }

    fn add_force_and_tangent(
        &self,
        at: Configuration<'_>,
        volts: f64,
        pattern: &Pattern,
        sums: (&mut [Pose], &mut BodyMatrix),
    ) {
        self.add_force_and_tangent_finding_apart(at, volts, pattern, sums);
    }

    fn add_force_and_tangent_finding_apart(
        &self,
        at: Configuration<'_>,
        volts: f64,
        pattern: &Pattern,
        (r, tangent): (&mut [Pose], &mut BodyMatrix),
    ) -> bool {
        let Some(seen) = self.acting(at, volts) else { return true };
        let Jet { first, second, .. } = seen.potential(volts);
        self.add(&seen, first, r);
        self.add_hessian(&seen, first, second, pattern, tangent);
        seen.pressed.is_none()
    }

    fn load_points(&self, at: Configuration<'_>, volts: f64, mut lever: impl FnMut(MaterialPoint, Vector2<f64>)) {
        let at = Configuration { linear: true, ..at };
        let Some(seen) = self.acting(at, volts) else { return };
        let first = seen.potential(volts).first;
        self.approach.load_points(first[0], &mut lever);
        if let Some((across, _)) = &self.sides {
            across.load_points(first[1], lever);
        }
    }

    fn capacitance(&self, at: Configuration<'_>) -> f64 {
        self.seen(at).field.value
    }

    fn capacitance_change(&self, at: Configuration<'_>, dq: &[Pose]) -> f64 {
        let seen = self.seen(at);
        let [u, y] = self.changes(&seen, dq);
        seen.field.first[0] * u + seen.field.first[1] * y
    }

    fn pull(&self, at: Configuration<'_>) -> f64 {
        self.seen(at).field.first[0]
    }

    fn pull_and_change(&self, at: Configuration<'_>, dq: &[Pose]) -> (f64, f64) {
        let seen = self.seen(at);
        let [u, y] = self.changes(&seen, dq);
        (seen.field.first[0], seen.field.second[0] * u + seen.field.second[1] * y)
    }

    /// The overlap.
    fn distance(&self, at: Configuration<'_>) -> f64 {
        self.capacitor.distance(self.approach.value(at.q, at.linear))
    }

    fn distance_change(&self, at: Configuration<'_>, dq: &[Pose]) -> f64 {
        self.approach.change(&self.approach.measure(at.q, at.linear), dq)
    }

    fn side_room(&self) -> Option<(&Approach, SideRoom)> {
        self.sides.as_ref().map(|(across, law)| (across, room(law)))
    }

    fn side_contact(&self, at: Configuration<'_>) -> Option<SideContact> {
        let (across, law) = self.sides.as_ref()?;
        let sides = &law.sides;
        let left = sides.gap - law.aside(across.value(at.q, at.linear)).abs();
        let faces = sides.faces(law.overlap(self.approach.value(at.q, at.linear)));
        faces.then_some(SideContact { left, touch: sides.contact.touch, least: sides.contact.least() })
    }

    fn side_change(&self, at: Configuration<'_>, dq: &[Pose]) -> f64 {
        let Some((across, law)) = &self.sides else { return 0.0 };
        let m = across.measure(at.q, at.linear);
        -law.aside(m.value).signum() * across.change(&m, dq)
    }

    /// Of the way across the fingers.
    fn closing_bound(&self, q: &[Pose]) -> f64 {
        self.sides.as_ref().map_or(f64::INFINITY, |(across, _)| across.bound(q))
    }

    fn bearing(&self, at: Configuration<'_>) -> f64 {
        self.pressed_at(at).map_or(0.0, |pressed| pressed.first[1].abs())
    }

    fn bearing_change(&self, at: Configuration<'_>, dq: &[Pose]) -> f64 {
        let Some(pressed) = self.pressed_at(at) else { return 0.0 };
        let [u, y] = self.changes(&self.seen(at), dq);
        pressed.first[1].signum() * (pressed.second[1] * u + pressed.second[2] * y)
    }

    fn contact_energy(&self, at: Configuration<'_>) -> f64 {
        self.pressed_at(at).map_or(0.0, |pressed| pressed.value)
    }

    fn contact_work(&self, at: Configuration<'_>, dq: &[Pose]) -> f64 {
        let Some(pressed) = self.pressed_at(at) else { return 0.0 };
        let [u, y] = self.changes(&self.seen(at), dq);
        -(pressed.first[0] * u + pressed.first[1] * y)
    }

    fn loss(&self) -> Option<Loss> {
        self.sides.as_ref().map(|_| self.loss)
    }

    fn set_loss(&mut self, loss: Loss) {
        self.loss = loss;
    }

    fn add_closing(&self, at: Configuration<'_>, r: &mut [Pose]) -> f64 {
        let Some((across, law)) = &self.sides else { return 0.0 };
        across.add_force(&across.measure(at.q, at.linear), 1.0, r);
        snap_aside(law.sides.gap, room(law).room)
    }

    fn add_loss(&self, at: Configuration<'_>, rate: &impl Fn(usize) -> Pose, r: &mut [Pose]) {
        if let Some((across, _, pressed, m)) = self.losing(at) {
            across.add_force(&m, self.lost(&pressed, across.rate(&m, rate)).0, r);
        }
    }

    fn add_loss_tangent(&self, at: Configuration<'_>, rate: &impl Fn(usize) -> Pose, to: &mut LossTangent<'_>) -> bool {
        let Some((across, seen, pressed, m)) = self.losing(at) else { return false };
        let (force, [by_u, by_y], by_rate) = self.lost(&pressed, across.rate(&m, rate));
        across.add_rates(&m, rate, (force, by_y, by_rate), to);
        let mixed = seen.along.gradient * m.gradient.transpose() * (0.5 * by_u);
        locate(to.pattern, across.a.body, across.b.body).add(to.stiffness, &(mixed + mixed.transpose()));
        true
    }

    /// Each displacement has the mean quotient of both orders in which the two can change.
    fn add_quotient(&self, chord: &Chord<'_>, volts: f64, pattern: &Pattern, r: &mut [Pose], tangent: &mut BodyMatrix) {
        let [start, middle, end] = chord.at;
        let factor = -0.5 * volts * volts;
        let [u, y] = [&Some(self.approach), &self.sides.as_ref().map(|(across, _)| *across)].map(|approach| {
            [start, end].map(|at| approach.as_ref().map_or(0.0, |approach| approach.value(at.q, at.linear)))
        });
        let touched = y.iter().any(|y| u.iter().any(|u| self.pressed(*u, *y).is_some()));
        if volts == 0.0 && !touched {
            return;
        }
        let potential = |u: f64, y: f64| {
            let field = self.field(u, y) * factor;
            self.pressed(u, y).map_or(field, |pressed| field + pressed)
        };
        // over (u, y) at both ends of either
        let at = |i: usize, k: usize| potential(u[i], y[k]);
        let [[f00, f01], [f10, f11]] = [[at(0, 0), at(0, 1)], [at(1, 0), at(1, 1)]];
        let along = |k: usize, (a, b): (Jet, Jet)| {
            let law = |u: f64| {
                let at = potential(u, y[k]);
                (at.first[0], at.second[0])
            };
            quotient((u[0], a.value), (u[1], b.value), law)
        };
        let across = |i: usize, (a, b): (Jet, Jet)| {
            let law = |y: f64| {
                let at = potential(u[i], y);
                (at.first[1], at.second[2])
            };
            quotient((y[0], a.value), (y[1], b.value), law)
        };
        let mean = |a: (f64, f64), b: (f64, f64)| (0.5 * (a.0 + b.0), 0.5 * (a.1 + b.1));
        let (force, slope) = mean(along(0, (f00, f10)), along(1, (f01, f11)));
        let (mut aside, mut bend) = mean(across(0, (f00, f01)), across(1, (f10, f11)));
        if touched && self.loss.is_dissipative() {
            let (lost, by_end) = self.quotient_lost(u, y, chord.h);
            (aside, bend) = (aside + lost, bend + by_end);
        }
        let mixed = |by: f64, a: f64, b: f64| if by.abs() < SMALL { 0.5 * f11.second[1] } else { 0.5 * (b - a) / by };
        let mixed =
            0.5 * (mixed(u[1] - u[0], f01.first[1], f11.first[1]) + mixed(y[1] - y[0], f10.first[0], f11.first[0]));
        let own = |approach: &Approach| {
            let mut m = approach.measure(middle.q, middle.linear);
            m.gradient[2] *= chord.sinc(approach.a.body);
            m.gradient[5] *= chord.sinc(approach.b.body);
            m.bend = m.bend.map(|bend| 0.5 * bend);
            m
        };
        let across = self.sides.as_ref().map(|(across, _)| own(across));
        let seen = Seen { along: own(&self.approach), across, field: Jet::default(), pressed: None };
        self.add(&seen, [force, aside], r);
        self.add_hessian(&seen, [force, aside], [slope, mixed, bend], pattern, tangent);
    }

    /// That of both displacements; of SUGAR's comb, which has no side force, that of one.
    fn point_laws(&self) -> Vec<PointLaw> {
        let Some((_, law)) = &self.sides else {
            return vec![PointLaw::of(Law::Field(self.capacitor, None))];
        };
        let of_both = PointLaw { loss: self.loss.coefficient(), ..PointLaw::of(Law::Comb(*law)) };
        vec![of_both, PointLaw::of(Law::Across)]
    }

    fn point_approaches(&self, at: Configuration<'_>, mut put: impl FnMut(f64)) {
        put(self.approach.value(at.q, at.linear));
        if let Some((across, _)) = &self.sides {
            put(across.value(at.q, at.linear));
        }
    }

    /// That of fingers in the middle of their gaps.
    fn law(&self) -> Option<(&Approach, Law)> {
        Some((&self.approach, Law::Field(self.capacitor, None)))
    }
}
