//! One motion for all trials of a point: that from the parent's state with the sources held at the parent's values, and its change with each source.
//!
//! A circuit requests several trials of a point, and its steps are often far shorter than those of the motion. Changes of the sources within such a
//! step make little beside the tolerance. The motion at other values is then the held one plus its sensitivities times the changes, and its partials
//! are these sensitivities. Currents, charges and signals are exact functions of that motion. It is used where
//!
//! * the step is one that the motion can take at once, or parts touch in it;
//! * no voltage across a gap, and no rise of a heater, changes by more than what is linear in the changes and as much again;
//! * what is left out is at most [`SMALL`] of the error that a step may have, by an estimate.
//!
//! A reduced model moves its coordinates and the bodies alike.
//!
//! Sensitivities may therefore be approximate: where nothing touches they take the tangent at the start of a step for all its stages.
//!
//! Where parts touch, a trial that is not such a one takes the internal steps of the held motion, see [`crate::contact_steps`].
//!
//! All of this follows from the parent, the length and the values given, so that trials stay pure.

use crate::Trial;
use crate::agitation::ThermalForce;
use crate::contact_steps::near;
use crate::held_motion::HeldMotion;
use crate::session::DeviceSession;
use crate::states::Snapshot;
use bimorph_domains::{Domain, Input, Ramp, System};
use bimorph_solve::equations::Bodies;
use bimorph_solve::time::adaptive::{Advance, Control};
use bimorph_solve::time::method::Motion;

/// Part of the motion that may be left out, relative to the error that a step may have (1).
const SMALL: f64 = 1e-4;
/// The same where parts touch. Bounces multiply errors, and their steps are chosen by those of contact.
const SMALL_TOUCHING: f64 = 0.025;
/// How far the motion of free masses may be beyond [`SMALL`] for a held motion to be worth its making (1).
const IN_VAIN: f64 = 30.0;
/// Voltage that moves nothing (V).
const NO_VOLTAGE: f64 = 1e-6;
/// Rise that moves nothing (K).
const NO_RISE: f64 = 1e-6;

impl DeviceSession {
    /// Makes the motion and its sensitivities those about the held motion of the point, and returns the internal step that would come next (s).
    /// None where the trial needs a motion of its own.
    pub(super) fn about_held(
        &mut self,
        system: &System,
        (request, parent): (&Trial<'_>, Option<&Snapshot>),
        ramp: &Ramp<'_>,
        tol: f64,
    ) -> Option<f64> {
        let of = request.parent.map(|token| (token, request.dt.to_bits()));
        if self.held.of != of {
            self.held.forget();
        }
        let (parent, of) = (parent?, of?);
        let touching = near(system, &parent.q, &parent.v, request.dt);
        if !touching && request.dt > parent.next_step {
            return None;
        }
        let most = if touching { SMALL_TOUCHING } else { SMALL };
        // beyond the range of a port the full model makes the trial
        let leaves = self.is_reduced_state(parent) && self.is_beyond(&self.sources);
        let linear = self.shaken.is_none()
            && !self.takes_bodies
            && self.stepper.method.has_linear_trials()
            && !leaves
            && self.changes_little(system, &parent.sources)
            && self.pushes_little(system, (request, parent), ramp, (tol, touching));
        if !(linear || touching) {
            return None;
        }
        if self.held.of.is_none() {
            self.held.of = Some(of);
            self.hold(system, (request, parent), tol, touching);
        }
        if !(linear && self.held.found) {
            return None;
        }
        self.begin(Some(parent), false);
        let held = &mut self.held;
        for (change, &source) in held.changes.iter_mut().zip(&self.ports.sources) {
            *change = self.sources[source] - parent.sources[source];
        }
        if !warms_little(ramp, held, &mut self.rise_slope) {
            return None;
        }
        let end = (&held.motion, &held.sensitivities[..]);
        self.stepper.method.move_by(&held.carried, end, &held.changes, &mut self.motion);
        held.change.copy(&self.motion);
        held.change.add(-1.0, &held.motion);
        let bodies = Bodies::weighed(system, ramp, &self.weights);
        let left_out = bodies.left_out([&held.motion, &self.motion], &held.change, request.dt, tol);
        (left_out <= most).then_some(held.next)
    }

    /// Whether no voltage across a gap, and no rate of a turning frame, differs from the held one by more than that: forces are quadratic in both.
    fn changes_little(&self, system: &System, held: &[f64]) -> bool {
        let electrics = &system.electrics;
        let (rows, first) = (&electrics.gap_rows, electrics.voltages());
        let turns = electrics.inputs.iter().enumerate().filter(|(_, input)| **input == Input::Rate);
        let mut turns = turns.map(|(k, _)| (self.sources[first + k] - held[first + k], held[first + k]));
        let mut gaps = (0..rows.nrows()).map(|gap| {
            let sum = |of: &dyn Fn(usize) -> f64| -> f64 { (0..held.len()).map(|s| rows[(gap, s)] * of(s)).sum() };
            (sum(&|s| self.sources[s] - held[s]), sum(&|s| held[s]).abs().max(NO_VOLTAGE))
        });
        turns.all(|(change, held)| change.abs() <= held.abs()) && gaps.all(|(change, held)| change.abs() <= held)
    }

    /// Whether the forces that the sources change move free masses by little: no held motion is made in vain, and no part that friction holds in it would
    /// slide by more than may be left out. Where parts touch, the motion is made for its steps anyway.
    fn pushes_little(
        &mut self,
        system: &System,
        (request, parent): (&Trial<'_>, &Snapshot),
        ramp: &Ramp<'_>,
        (tol, touching): (f64, bool),
    ) -> bool {
        let slides = || system.members.iter().any(|member| member.slides());
        let most = match touching {
            false => IN_VAIN * SMALL,
            true if slides() => SMALL_TOUCHING,
            true => return true,
        };
        if self.sources == parent.sources {
            return true;
        }
        self.begin(Some(parent), false);
        let held = Ramp::new(&system.electrics, &parent.sources, &parent.sources, &self.rise, request.dt);
        held.at(request.dt, &mut self.change);
        ramp.at(request.dt, &mut self.drive);
        self.change.change_to(&self.drive);
        let force = &mut self.held.change.q;
        system.drive_force(&self.motion.q, &self.drive, &self.change, force);
        let bodies = Bodies::weighed(system, ramp, &self.weights);
        bodies.would_move(&self.motion, force, request.dt, tol) <= most
    }

    /// Steps from the parent at its sources.
    fn hold(&mut self, system: &System, (request, parent): (&Trial<'_>, &Snapshot), tol: f64, touching: bool) {
        self.begin(Some(parent), false);
        let held = &mut self.held;
        let push = self.shaken.as_ref().map_or(&[][..], ThermalForce::mean);
        let ramp = Ramp::new(&system.electrics, &parent.sources, &parent.sources, &self.rise, request.dt).pushed(push);
        let (mut h, mut touches) = (parent.next_step, system.contact_energy(&parent.q) > 0.0);
        self.stepper.method.keep_first_tangent(!touching);
        let advanced = self.stepper.advance(
            &mut Bodies::weighed(system, &ramp, &self.weights),
            &mut self.motion,
            &mut h,
            Control::Tolerance(tol),
            super::MAX_INTERNAL_STEPS,
            &mut |t, step, _, after| {
                held.ends.push(t + step);
                touches |= system.contact_energy(&after.q) > 0.0;
                true
            },
        );
        self.stepper.method.keep_first_tangent(false);
        held.found = matches!(advanced, Ok(Advance::Done));
        held.next = h;
        if !(touching && touches && held.found) {
            held.ends.clear();
        } else if let Some(last) = held.ends.last_mut() {
            *last = request.dt;
        }
        if !held.found {
            return;
        }
        held.motion.copy(&self.motion);
        self.stepper.method.place_sensitivities();
        let keep = |held: &mut Vec<Motion>, now: &[Motion]| {
            held.resize_with(now.len(), || Motion { q: Vec::new(), v: Vec::new() });
            held.iter_mut().zip(now).for_each(|(held, now)| held.clone_from(now));
        };
        keep(&mut held.sensitivities, self.stepper.method.sensitivity());
        keep(&mut held.carried, self.stepper.method.all_carried());
        ramp.end_rises(&mut held.rise);
        let way = ((&parent.sources[..], &parent.sources[..]), &parent.rise[..]);
        for (slopes, &source) in held.rise_slope.iter_mut().zip(&self.ports.sources) {
            system.electrics.rise_sensitivities(way, request.dt, request.dt, source, |k, slope| slopes[k] = slope);
        }
    }
}

/// Whether no mean rise at the end of a ramp differs from what is linear in the changes by more than that, or by what moves nothing.
fn warms_little(ramp: &Ramp<'_>, held: &HeldMotion, rise: &mut [f64]) -> bool {
    let means = ramp.electrics.heating.means();
    if means == 0 {
        return true;
    }
    ramp.end_rises(rise);
    (0..means).all(|k| {
        let change = |(slopes, change): (&Vec<f64>, &f64)| slopes[k] * change;
        let linear: f64 = held.rise_slope.iter().zip(&held.changes).map(change).sum();
        (rise[k] - held.rise[k] - linear).abs() <= linear.abs().max(NO_RISE)
    })
}
