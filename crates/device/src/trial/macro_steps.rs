//! Trials within macro steps ([`crate::macro_step`]): points that are far shorter than a step of the motion.
//!
//! With the predicted motion q(t) and the difference ΔV² of each squared voltage from its extrapolation, the error at a point is at most
//! ```text
//! e(t) = Σ |M⁻¹·½·∇C| · |∬ ΔV² dt²|
//! ```
//! in the norm of masses: elastic forces only reduce it. Directions without mass follow their springs at once; what these pass on to masses is part of e
//! ([`crate::condensed_response`]), and so is their own displacement by ΔV². A trial interpolates q(t) if
//!
//! * every body has its own coordinates, or the model is reduced, and there is no thermal agitation;
//! * no heater, floating conductor or input other than voltages exists;
//! * the macro step holds six points of this length, which is three in a step of the integrator;
//! * e is within the tolerance for points within a step, and so is ė where a signal shows a rate, or gaps have different voltages: a current at a constant
//!   voltage is that of the motion.
//!
//! Where e exceeds half of that at the parent, or the macro step ends, the next one begins at the parent. The partials neglect the response of the motion
//! within the point, which is part of e.
//!
//! A reduced model makes its own macro steps, where these end within the trained amplitude and its polynomials hold there. States within them carry no
//! coordinates: steps that follow begin with those of the corrected motion.
//!
//! The decision depends on the parent, the length and the voltages alone: trials are pure. Predictions are cached, and made again from the state where the
//! cache has others.

use crate::macro_step::MacroStepPosition;
use crate::multirate::Multirate;
use crate::session::DeviceSession;
use crate::states::Snapshot;
use crate::{Token, Trial};
use bimorph_base::ErrorBudget;
use bimorph_domains::System;
use bimorph_solve::time::method::Motion;
use std::sync::Arc;

impl DeviceSession {
    /// Sets the motion by a macro step and clears its sensitivities. Returns the proposed next internal step (s) and the position of the new state; none where
    /// the trial integrates.
    pub(crate) fn in_macro_step(
        &mut self,
        system: &System,
        (request, parent): (&Trial<'_>, Option<&Snapshot>),
        errors: ErrorBudget,
    ) -> Option<(f64, Box<MacroStepPosition>)> {
        self.exceeds_bound = false;
        let (parent, token) = (parent?, request.parent?);
        // in a session with a reduced model the full one has none, and takes over beyond the ranges
        let is_left = || !self.is_reduced_state(parent) || self.is_beyond(&self.sources);
        if self.shaken.is_some() || self.reduction.is_some() && is_left() {
            return None;
        }
        let mut multirate = self.multirate.take()?;
        let trial = self.interpolated(&mut multirate, system, (request, parent, token), errors);
        self.multirate = Some(multirate);
        if trial.is_some() {
            self.stepper.method.sensitivity_mut().iter_mut().for_each(Motion::clear);
        }
        trial
    }

    fn interpolated(
        &mut self,
        multirate: &mut Multirate,
        system: &System,
        (request, parent, token): (&Trial<'_>, &Snapshot, Token),
        errors: ErrorBudget,
    ) -> Option<(f64, Box<MacroStepPosition>)> {
        let (about, dt) = ((system, &self.weights), request.dt);
        let continued = parent.macro_step.as_deref().filter(|position| {
            let at = (&position.step, position.elapsed, &position.integrals[..]);
            let (predicted, bound) = multirate.predicted(about, at, &parent.sources, errors);
            let fits = predicted.ends.is_some_and(|([_, length], _)| position.elapsed + dt <= length);
            fits && bound <= 0.5
        });
        let MacroStepPosition { step, elapsed, points, mut integrals } = match continued {
            Some(position) => position.clone(),
            None if !Multirate::may_begin(dt, parent) => return None,
            None => {
                let begun = multirate.begin(about, (dt, parent, token), errors);
                // the prediction would cost as much as the steps of a reduced model that it does not save
                self.exceeds_bound = begun.is_none() && self.reduction.is_some();
                begun?
            }
        };
        multirate.extend(&step, &mut integrals, dt, [&parent.sources, &self.sources]);
        let elapsed = elapsed + dt;
        let (predicted, bound) = multirate.predicted(about, (&step, elapsed, &integrals), &self.sources, errors);
        let (ends, next_step) = predicted.ends?;
        self.exceeds_bound = bound > 1.0;
        // the integrator reports points that are too short for its arithmetic
        if self.exceeds_bound || dt < f64::EPSILON * ends[1] {
            return None;
        }
        predicted.display(ends, elapsed, &mut self.motion);
        let points = points.saturating_add(1);
        Some((next_step, Box::new(MacroStepPosition { step, elapsed, points, integrals })))
    }

    /// The parent with the integrated motion. None where that is the displayed one.
    pub(crate) fn integrated_parent(
        &mut self,
        system: &System,
        (request, parent): (&Trial<'_>, &Snapshot),
        errors: ErrorBudget,
    ) -> Option<Arc<Snapshot>> {
        let multirate = self.multirate.as_mut()?;
        multirate.integrated_state((system, &self.weights), (parent, request.parent?), errors)
    }
}
