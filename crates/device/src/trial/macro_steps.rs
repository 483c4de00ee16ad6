//! Trials of points that are far shorter than a step of the motion: they take it from a macro step ([`crate::macro_step`]).
//!
//! With q(t) on the macro step that was made with the expected forces, and ΔV² the squared voltages less the expected ones, a trial leaves out
//! ```text
//! e(t) = ∬ M⁻¹·½·∇C·ΔV² dt²
//! ```
//! at most: what holds the bodies makes it smaller. [`DeviceSession::of_macro_step`] gives a motion where
//!
//! * one voltage moves all gaps, and a current of theirs by its own change is larger than that by the motion that is left out;
//! * nothing but that voltage changes: no heaters, no agitation, no input of another kind that is not as it was, every body has its own coordinates and a mass
//!   where a gap pulls;
//! * the step of the motion is as long as six points;
//! * e is within the part of the tolerance that points within a step may leave out;
//! * so is ė, of the largest rate so far, where something shows rates.
//!
//! Where e has grown to half of that, or the step ends, the next one begins at the parent, where the motion has come under the moments of V². The response
//! of the motion within one point is left out of the partials; it is part of e.
//!
//! All of this follows from the parent, the length and the values given, so that trials stay pure. The step is kept for the trials that follow, and made
//! again from what the state holds where it is not the last one.

use crate::macro_step::{InMacroStep, add_fading, moments, on_cubic};
use crate::multirate::Multirate;
use crate::session::DeviceSession;
use crate::states::Snapshot;
use crate::{Token, Trial};
use bimorph_base::ErrorBudget;
use bimorph_domains::System;
use bimorph_solve::time::method::Motion;
use std::sync::Arc;

/// A trial within a macro step.
pub(crate) struct MacroTrial {
    /// The internal step that would come next (s).
    pub(crate) next: f64,
    /// Where its end lies.
    pub(crate) place: InMacroStep,
}

impl DeviceSession {
    /// Makes the motion that of the macro step that the parent lies in, or of one that begins there, and clears its sensitivities. None where the trial
    /// needs steps of its own.
    pub(crate) fn of_macro_step(
        &mut self,
        system: &System,
        (request, parent): (&Trial<'_>, Option<&Snapshot>),
        errors: ErrorBudget,
    ) -> Option<MacroTrial> {
        self.leaves_out_much = false;
        let (parent, token) = (parent?, request.parent?);
        let mut multirate = self.multirate.take()?;
        let found = self.in_macro_step(&mut multirate, system, (request, parent, token), errors);
        self.multirate = Some(multirate);
        if found.is_some() {
            let clear = |motion: &mut Motion| motion.clear();
            self.stepper.method.sensitivity_mut().iter_mut().for_each(clear);
        }
        found
    }

    fn in_macro_step(
        &mut self,
        multirate: &mut Multirate,
        system: &System,
        (request, parent, token): (&Trial<'_>, &Snapshot, Token),
        errors: ErrorBudget,
    ) -> Option<MacroTrial> {
        let first = system.electrics.voltages();
        let places = self.shaken.is_none()
            && !self.takes_bodies
            && self.stepper.method.has_linear_trials(&parent.carried)
            && self.sources[first..] == parent.sources[first..];
        if !places {
            return None;
        }
        let weights = self.weights.clone();
        let about = (system, &weights);
        let goes_on = parent.macro_step.as_deref().and_then(|place| {
            if place.step.sources[first..] != self.sources[first..] {
                return None;
            }
            let flight = multirate.flight(about, &place.step, errors);
            let [length, _] = flight.lengths?;
            let within = place.since + request.dt <= length && flight.left_out(place.since, &place.moments) <= 0.5;
            within.then(|| place.clone())
        });
        let place = match goes_on {
            Some(place) => place,
            None => multirate.begin(about, (request.dt, parent, token), errors)?,
        };
        let since = place.since + request.dt;
        let groups = 0..multirate.pairs();
        let moments: Vec<[f64; 2]> = groups
            .map(|k| {
                let start = multirate.volts(k, &place.step.sources).powi(2);
                let volts = [&parent.sources, &self.sources].map(|sources| multirate.volts(k, sources));
                moments(place.moments[k], request.dt, volts, start)
            })
            .collect();
        let flight = multirate.flight(about, &place.step, errors);
        let [length, next] = flight.lengths?;
        self.leaves_out_much = since <= length && flight.left_out(since, &moments) > 1.0;
        if since > length || self.leaves_out_much {
            return None;
        }
        on_cubic([&place.step.motion, &flight.end], length, since / length, &mut self.motion);
        add_fading(&place.step.offset, length, since / length, &mut self.motion);
        let place = InMacroStep { since, moments, points: place.points.saturating_add(1), step: place.step };
        Some(MacroTrial { next, place })
    }
}

impl DeviceSession {
    /// A state in a macro step as the motion has come there, for steps of its own that follow. None where it lies in no macro step.
    pub(crate) fn leave_macro_step(
        &mut self,
        system: &System,
        (request, parent): (&Trial<'_>, &Snapshot),
        errors: ErrorBudget,
    ) -> Option<Arc<Snapshot>> {
        let (place, token, multirate) = (parent.macro_step.as_deref()?, request.parent?, self.multirate.as_mut()?);
        if let Some((_, left)) = multirate.left.as_ref().filter(|(of, _)| *of == token) {
            return Some(Arc::clone(left));
        }
        let (motion, next_step) = multirate.arrive((system, &self.weights), (place, parent), errors)?;
        let left = Arc::new(Snapshot { q: motion.q, v: motion.v, next_step, ..parent.clone() });
        multirate.left = Some((token, Arc::clone(&left)));
        Some(left)
    }
}
