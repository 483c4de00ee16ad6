//! Every body's own coordinates: M·q̈ + C·q̇ + r(q, t) = 0 of a system while its sources go along a ramp.
//!
//! **Error norm.** The mass norm ‖e‖² = eᵀMe has one unit for translations and rotations. The error √(‖e_q‖² +
//! h²‖e_v‖²) must stay below tol·(‖q‖ + floor). Here ‖q‖ is the larger of both ends of a step, and the floor is 1e-4 of
//! the model's length scale. Where parts touch, the time of a bounce is nothing beside that of the motion, and a
//! displacement beside its reach: there the error of the energy,
//! |vᵀMe_v| + |work of the contact forces over e_q|, must also stay below tol·(kinetic energy + energy in the contacts), three times that where contact loses
//! energy, and the error of a penetration below a tenth of it. A step that jumps beyond the law of contact is rejected, whatever its error
//! is relative to where it ends. So is one that diverges: its displacement is a thousand times that before and the length scale, or NaN.

use super::{Control, DegreeOfFreedom, Equations, Motion};
use bimorph_base::ErrorBudget;
use bimorph_domains::{Ramp, System};
use bimorph_multibody::planar::{DOF, Pose};
use bimorph_multibody::{BodyId, Model};
use nalgebra::Matrix6;
use std::borrow::Cow;

/// Fraction of the length scale below which a displacement's relative error does not count.
pub const FLOOR: f64 = 1e-4;

/// Displacement after a step, relative to that before and the length scale, beyond which the step has diverged, however small its estimated error is
/// beside it (1). A step is at most 5 times as long as the one before, and a free mass then moves at most 36 times as far.
const DIVERGED: f64 = 1e3;

/// Tolerance that equal steps are taken to have (1).
const EQUAL: f64 = 1e-6;

/// Names of a planar body's directions, for messages.
pub const DIRECTIONS: [&str; 3] = ["along x", "along y", "about z"];

/// Weights of displacements and rates of a system.
#[derive(Debug, Clone)]
pub struct NormWeights {
    /// Of all bodies (kg).
    pub(crate) mass: f64,
    /// Directions that have drag and no mass: body, direction and drag (N·s/m, N·m·s).
    pub(crate) dragged: Vec<(usize, usize, f64)>,
}

impl NormWeights {
    /// Of a model.
    pub fn new(model: &Model) -> Self {
        Self { mass: model.bodies.iter().map(|b| b.mass).sum(), dragged: dragged(model) }
    }

    /// Allowed error of displacements between two ends in the norm of masses; none for a model that has another norm.
    pub fn allowed_error(&self, system: &System, ends: [&Motion; 2], tol: f64) -> Option<f64> {
        let [before, after] = [self.norm(system, &ends[0].q)?, self.norm(system, &ends[1].q)?];
        Some(self.allowed_of_norms(system, [before, after], tol))
    }

    /// Norm of displacements by the masses; none for a model that has another norm.
    fn norm(&self, system: &System, q: &[Pose]) -> Option<f64> {
        (self.mass > 0.0 && self.dragged.is_empty()).then(|| system.model.mass_product(q, q).sqrt())
    }

    /// Norm of displacements of directions without inertia (√kg·m): they weigh as much as the mean of the bodies, rotations at the length scale.
    pub fn norm_without_mass(&self, system: &System, q: &[Pose]) -> f64 {
        let turned = |q: &Pose| (q.z * system.length_scale).powi(2);
        let squared = |(j, q): (usize, &Pose)| match system.model.mass(j) {
            m if m.x == 0.0 => q.x * q.x + q.y * q.y + turned(q),
            m if m.z == 0.0 => turned(q),
            _ => 0.0,
        };
        let sum: f64 = q.iter().enumerate().map(squared).sum();
        (sum * self.mass / q.len() as f64).sqrt()
    }

    fn allowed_of_norms(&self, system: &System, [before, after]: [f64; 2], tol: f64) -> f64 {
        ErrorBudget::of(tol).within(error_scale([before, after], [system.length_scale, self.mass.sqrt()]))
    }
}

/// See the module.
#[derive(Debug, Clone)]
pub struct Bodies<'a> {
    /// The mechanism.
    pub system: &'a System,
    /// Its sources, inputs and heat over time.
    pub ramp: &'a Ramp<'a>,
    weights: Cow<'a, NormWeights>,
    /// Division of the tolerance of the steps; of equal steps [`EQUAL`].
    pub(crate) errors: ErrorBudget,
}

impl<'a> Bodies<'a> {
    /// A system under a ramp.
    pub fn new(system: &'a System, ramp: &'a Ramp<'a>) -> Self {
        Self { system, ramp, weights: Cow::Owned(NormWeights::new(&system.model)), errors: ErrorBudget::of(EQUAL) }
    }

    /// Part that a motion between two ends leaves out where a change of the sources is linear in it, over the error that a step of length `h` (s) may have.
    /// Of the motion it is half of the change, as forces are quadratic in the sources; of contact the change times that of the penetration, as forces go with the
    /// third power.
    /// Directions without inertia follow at once ([`NormWeights::norm_without_mass`]). Infinite where nothing has mass.
    pub fn left_out(&self, ends: [&Motion; 2], change: &Motion, h: f64, tol: f64) -> f64 {
        let Some(([q, v], may)) = self.of_masses(ends, Some(change), h, tol).filter(|_| self.weights.mass > 0.0) else {
            return f64::INFINITY;
        };
        let q = q.hypot(self.weights.norm_without_mass(self.system, &change.q));
        let moved = relative_error([q, v], h, may, 0.0);
        let contact = contact_error(self.system, ends.into(), change, tol);
        if contact == 0.0 {
            return 0.5 * moved;
        }
        let pressed = self.system.contact_change(ends.map(|end| &end.q[..]), &change.q, PRESSED.1);
        (0.5 * moved).hypot(1.5 * pressed * contact)
    }

    /// By how much forces that grow from zero over a step of length `h` (s) move the masses where nothing holds these, over the error that the step may have.
    pub fn would_move(&self, motion: &Motion, force: &[Pose], h: f64, tol: f64) -> f64 {
        let Some((_, may)) = self.of_masses([motion; 2], None, h, tol) else { return f64::INFINITY };
        let push = |(j, force): (usize, &Pose)| -> f64 {
            let mass = self.system.model.mass(j);
            force.iter().zip(mass.iter()).filter(|(_, m)| **m > 0.0).map(|(f, m)| f * f / m).sum()
        };
        force.iter().enumerate().map(push).sum::<f64>().sqrt() * h * h / (6.0 * may)
    }

    /// Norms of an error of displacements and of rates, and what they may be; none where nothing moves in time, with neither mass nor drag.
    fn of_masses(
        &self,
        [before, after]: [&Motion; 2],
        error: Option<&Motion>,
        h: f64,
        tol: f64,
    ) -> Option<([f64; 2], f64)> {
        let (system, NormWeights { mass, dragged }) = (self.system, &*self.weights);
        if *mass == 0.0 && dragged.is_empty() {
            return None;
        }
        // what drag holds back and no mass weighs as much as a mass that it would stop in this step
        let drag = |x: &[Pose]| h * dragged.iter().map(|(j, i, c)| c * x[*j][*i] * x[*j][*i]).sum::<f64>();
        let own = |x: &[Pose]| system.model.mass_product(x, x).sqrt();
        let norm = |x: &[Pose]| match dragged.is_empty() {
            true => own(x),
            false => own(x).hypot(drag(x).sqrt()),
        };
        let mass = mass + h * dragged.iter().map(|(_, _, c)| c).sum::<f64>();
        let first = norm(&before.q);
        let last = if std::ptr::eq(before, after) { first } else { norm(&after.q) };
        let scale = error_scale([first, last], [system.length_scale, mass.sqrt()]);
        Some((error.map_or([0.0; 2], |x| [norm(&x.q), norm(&x.v)]), ErrorBudget::of(tol).within(scale)))
    }

    /// The norm of displacements by which errors are measured, where it is that of masses alone.
    pub(crate) fn reach(&self, q: &[Pose]) -> Option<f64> {
        self.weights.norm(self.system, q)
    }

    /// The error of a step of length `h` (s) over what it may be, between displacements of these norms and with an error of these; parts do not touch.
    pub(crate) fn share_of_norms(&self, [before, after]: [f64; 2], error: [f64; 2], h: f64, tol: f64) -> f64 {
        relative_error(error, h, self.weights.allowed_of_norms(self.system, [before, after], tol), 0.0)
    }

    /// The same with weights that have been found before.
    pub fn weighed(system: &'a System, ramp: &'a Ramp<'a>, weights: &'a NormWeights) -> Self {
        Self { system, ramp, weights: Cow::Borrowed(weights), errors: ErrorBudget::of(EQUAL) }
    }
}

impl Equations for Bodies<'_> {
    type Unknown = Pose;

    fn unknowns(&self) -> usize {
        self.system.bodies()
    }

    fn end(&self) -> f64 {
        self.ramp.dt
    }

    fn begin(&mut self, control: Control) {
        self.errors = ErrorBudget::of(match control {
            Control::Tolerance(tol) => tol,
            Control::Fixed(_) => EQUAL,
        });
    }

    fn share(&self, ends: [&Motion; 2], error: &Motion, h: f64, tol: f64) -> f64 {
        let Some((norms, may)) = self.of_masses(ends, Some(error), h, tol) else { return 0.0 };
        relative_error(norms, h, may, contact_error(self.system, ends.into(), error, tol))
    }

    fn worst(&self, error: &[Pose]) -> DegreeOfFreedom {
        let (mut place, mut worst) = ((0, 0), -1.0);
        for (j, e) in error.iter().enumerate() {
            let m = self.system.model.mass(j);
            for i in 0..DOF {
                let share = m[i] * e[i] * e[i];
                if share > worst || share.is_nan() {
                    (place, worst) = ((j, i), share);
                }
            }
        }
        place
    }

    fn named(&self, (body, direction): DegreeOfFreedom) -> (String, &'static str) {
        (self.system.model.bodies[body].name.to_string(), DIRECTIONS[direction])
    }
}

/// The displacement that the error of a step is relative to, from the norms of the displacements before and after it, a length scale, and the root of the mass.
/// It is 0 for a step that diverges.
pub(crate) fn error_scale([before, after]: [f64; 2], [length, root_mass]: [f64; 2]) -> f64 {
    let size = length * root_mass;
    // false for NaN
    if after <= DIVERGED * (before + size) { before.max(after) + FLOOR * length * root_mass } else { 0.0 }
}

/// The error of a step of length `h` (s) over what it `may` be: of displacements and rates in the norm of masses, and of contact.
pub(crate) fn relative_error([q, v]: [f64; 2], h: f64, may: f64, contact: f64) -> f64 {
    // a sum: the larger of the two would hide what is not a number
    let error = ((q * q + h * h * v * v).sqrt() / may).hypot(contact);
    if error.is_nan() { f64::INFINITY } else { error }
}

/// Fraction of the energy error that counts where contact dissipates energy, since the error decays as well.
const OF_LOSS: f64 = 0.3;
/// Error of a contact's penetration that is allowed, of the penetration (1), and the least one that it is measured by (m): the force grows with its fourth
/// power, and a point without inertia is in no norm of masses.
const PRESSED: (f64, f64) = (0.1, 1e-10);

/// Error of a step that begins or ends in contact: of the energy, and of the penetration; 0 elsewhere.
pub(crate) fn contact_error(system: &System, (before, after): (&Motion, &Motion), error: &Motion, tol: f64) -> f64 {
    let stored = system.contact_energy(&before.q).max(system.contact_energy(&after.q));
    if stored == 0.0 {
        return 0.0;
    }
    let model = &system.model;
    let kinetic = 0.5 * model.mass_product(&after.v, &after.v).max(model.mass_product(&before.v, &before.v));
    let work = system.contact_work(&after.q, &error.q);
    let weight = if system.loses() { OF_LOSS } else { 1.0 };
    let lost = weight * (model.mass_product(&after.v, &error.v).abs() + work);
    let energy = ErrorBudget::of(tol).used(lost, kinetic + stored);
    energy.hypot(system.contact_change([&before.q, &after.q], &error.q, PRESSED.1) / PRESSED.0)
}

/// Directions of bodies without mass that drag holds back, with the drag (N·s/m, N·m·s).
pub(crate) fn dragged(model: &Model) -> Vec<(usize, usize, f64)> {
    if model.bodies.iter().all(|body| body.mass > 0.0) {
        return Vec::new();
    }
    let mut found = Vec::new();
    for (j, body) in model.bodies.iter().enumerate().filter(|(_, body)| body.mass == 0.0) {
        bimorph_base::budget::check();
        let own = body.drag.matrix();
        for i in (0..DOF).filter(|i| *i < 2 || body.inertia == 0.0) {
            let at =
                |id: BodyId, i: usize, matrix: &Matrix6<f64>| if id == BodyId::Free(j) { matrix[(i, i)] } else { 0.0 };
            let dampers = model.dampers.iter().zip(&model.damper_matrix);
            let drag = own[(i, i)] + dampers.map(|(d, m)| at(d.a, i, m) + at(d.b, i + 3, m)).sum::<f64>();
            if drag > 0.0 {
                found.push((j, i, drag));
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Errors are relative to the larger end and a floor. A step that diverges, overflows or ends at NaN has an infinite error, also where its estimate is
    /// small beside its displacement.
    #[test]
    fn steps_that_diverge_are_rejected() {
        assert_eq!(
            [[2.0, 3.0], [3.0, 2.0], [0.0, 0.0]].map(|ends| error_scale(ends, [1.0, 1.0])),
            [3.0001, 3.0001, 1e-4]
        );
        let error =
            |after: f64, error: f64| relative_error([error, 0.0], 1e-9, error_scale([1e-3, after], [1e-3, 1.0]), 0.0);
        assert!(error(1.0, 1e-3) < 1.1e-3);
        for end in [3.0, 1e100, f64::INFINITY, f64::NAN] {
            assert_eq!([error(end, 1e-3), error(end, 0.0)], [f64::INFINITY; 2], "{end}");
        }
    }
}
