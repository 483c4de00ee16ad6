//! How a trial is made: a static one by following the parent's equilibrium, a transient one by integrating from the parent's
//! state.

mod held;
mod macro_steps;
mod reduced;

use super::contact_steps::MAX_ERROR;
use super::growth::{Bound, rate_along};
use super::session::DeviceSession;
use super::states::Snapshot;
use super::{Status, Trial, TrialReply};
use bimorph_analysis::contact_range::within_contact_range;
use bimorph_analysis::overheating::{check_course, check_heat, thermal_runaway};
use bimorph_domains::{Ramp, System};
use bimorph_model::compile::CompiledModel;
use bimorph_multibody::planar::Pose;
use bimorph_solve::equations::Bodies;
use bimorph_solve::path::SourcePath;
use bimorph_solve::time::adaptive::{Advance, Control};
use reduced::state_of;

/// Internal steps in one circuit step before the device requires a shorter one.
const MAX_INTERNAL_STEPS: usize = 512;
/// Longest circuit step proposed, in internal steps, whatever the circuit sees: a step that has to be taken again shall
/// not cost too much, and a change of pace from one step to the next stay below [`MAX_INTERNAL_STEPS`].
const PROPOSED_STEPS: f64 = 32.0;

/// Fraction of a charge's derivative beyond that of the capacitance at rest from which on the motion may be unstable (1): at λh = 1 the response of a
/// growing motion adds 18 % or more.
const RESPONDS: f64 = 0.1;

/// Remedy for an impact of fingers that were drawn in the middle of their gaps: such models have no inertia of sections.
const NEEDS_INERTIA: &str =
    "; fingers touch there, and sections of beams have no inertia: give the model `rotary_inertia=true`";

impl DeviceSession {
    /// A static trial: from the parent's equilibrium along straight lines in voltage, or from rest.
    pub(super) fn balance(
        &mut self,
        compiled: &CompiledModel,
        request: &Trial<'_>,
        parent: Option<&Snapshot>,
        reply: &mut TrialReply,
    ) {
        let own = self.ports.system.clone();
        let system = Self::system(&own, compiled);
        let electrics = &system.electrics;
        (self.position, self.offset) = (None, None);
        self.fill_sources(electrics, request.voltages);
        if let Err(error) = check_heat(compiled, electrics, &self.sources) {
            reply.status = Status::Fail(error.to_string());
            return;
        }
        let rest = vec![0.0; self.sources.len()];
        let (from, load) = parent.map_or((rest.as_slice(), 0.0), |p| (p.sources.as_slice(), 1.0));
        match parent {
            Some(parent) => self.motion.q.copy_from_slice(&parent.q),
            None => self.motion.q.fill(Pose::zeros()),
        }
        self.motion.v.fill(Pose::zeros());
        let drawn = vec![0.0; self.equilibrium.sticking.anchors().len()];
        self.equilibrium.sticking.set_anchors(system, &self.motion.q, parent.map_or(&drawn, |p| &p.anchors));
        let sources = self.sources.clone();
        let path = SourcePath::new(electrics, from, &sources, [load, 1.0]);
        let energised = |gap: usize| electrics.is_energised(gap, &sources);
        let reduced = self.balance_reduced(compiled, system, parent, &path);
        if !reduced {
            self.stepper.method.take_bodies();
        }
        let followed = (!reduced).then(|| self.equilibrium.follow(system, &path, &mut self.motion.q));
        match followed.transpose() {
            Ok(None) => {}
            Ok(Some(found)) => reply.jumped = !found.passed.is_empty(),
            Err(error) => {
                // a gap pressed beyond its law is the reason where there is one
                let error =
                    within_contact_range(compiled, &self.motion.q, energised).err().unwrap_or_else(|| error.into());
                reply.status = Status::Fail(error.to_string());
                return;
            }
        }
        if let Err(error) = within_contact_range(compiled, &self.motion.q, energised) {
            reply.status = Status::Fail(error.to_string());
            return;
        }
        electrics.steady(&self.sources, &mut self.rise, &mut self.drive);
        if let Some(runaway) = thermal_runaway(compiled, &self.sources, &self.rise) {
            reply.status = Status::Fail(runaway);
            return;
        }
        if reduced {
            self.balance_reduced_ports(system);
            self.answer(compiled, request, None, self.first_step, reply);
            return;
        }
        // ∂q/∂V = −K⁻¹·∂r/∂V with the factor that the last Newton iteration left
        for (p, &port) in self.ports.sources.iter().enumerate() {
            self.unit.fill(0.0);
            self.unit[port] = 1.0;
            electrics.steady_slope((&self.sources, &self.rise), &self.unit, &mut self.change);
            let s = &mut self.stepper.method.sensitivity_mut()[p];
            system.drive_force(&self.motion.q, &self.drive, &self.change, &mut s.q);
            for x in &mut s.q {
                *x = -*x;
            }
            self.equilibrium.solve(system, &mut s.q);
            s.v.fill(Pose::zeros());
        }
        self.answer(compiled, request, None, self.first_step, reply);
    }

    /// A transient trial: the motion over dt, sensitivities along. It is taken again in the full model where the reduced one has none.
    pub(super) fn advance(
        &mut self,
        compiled: &CompiledModel,
        request: &Trial<'_>,
        parent: Option<&Snapshot>,
        reply: &mut TrialReply,
    ) {
        self.takes_bodies = false;
        if !self.try_advance(compiled, request, parent, reply) {
            self.takes_bodies = true;
            self.try_advance(compiled, request, parent, reply);
        }
    }

    /// The same, once. False where the reduced model has no answer.
    fn try_advance(
        &mut self,
        compiled: &CompiledModel,
        request: &Trial<'_>,
        parent: Option<&Snapshot>,
        reply: &mut TrialReply,
    ) -> bool {
        let own = self.ports.system.clone();
        let system = Self::system(&own, compiled);
        self.fill_sources(&system.electrics, request.voltages);
        let (electrics, rest) = (&system.electrics, vec![0.0; self.sources.len()]);
        let from = parent.map_or(rest, |p| p.sources.clone());
        if let Some(shaken) = &mut self.shaken {
            let start = parent.map_or(0.0, |p| p.elapsed);
            if let Err(longest) = shaken.over(compiled, start, request.dt) {
                reply.status = Status::NeedDt(longest);
                return true;
            }
        }
        let (errors, beyond) = (compiled.options.errors(), self.is_beyond(&self.sources));
        let tol = errors.step();
        let next_step;
        (next_step, self.position) = self.in_macro_step(system, (request, parent), errors).unzip();
        let integrated = parent.filter(|_| next_step.is_none());
        let integrated = integrated.and_then(|parent| self.integrated_parent(system, (request, parent), errors));
        let parent = integrated.as_deref().or(parent);
        let states = electrics.heating.states();
        let (to, rise) = (self.sources.clone(), parent.map_or_else(|| vec![0.0; states], |p| p.rise.clone()));
        let ramp = Ramp::new(electrics, &from, &to, &rise, request.dt);
        let held = next_step.or_else(|| self.about_held(system, (request, parent), &ramp, tol));
        if held.is_none() {
            self.begin(parent, beyond);
        }
        let push = self.shaken.as_ref().map_or_else(Vec::new, |shaken| shaken.mean().to_vec());
        let ramp = ramp.pushed(&push);
        if let Err(error) = check_course(compiled, &ramp) {
            reply.status = Status::Fail(error.to_string());
            return true;
        }
        let (mut h, ends) = (held.unwrap_or(self.held.next), &self.held.ends);
        let bodies = &mut Bodies::weighed(system, &ramp, &self.weights);
        let kept = !ends.is_empty();
        if held.is_none() && !(kept && self.stepper.along(bodies, &mut self.motion, ends, (tol, MAX_ERROR))) {
            self.begin(parent, beyond);
            h = parent.map_or(self.first_step, |p| p.next_step);
            let advanced = self.stepper.advance(
                &mut Bodies::weighed(system, &ramp, &self.weights),
                &mut self.motion,
                &mut h,
                Control::Tolerance(tol),
                MAX_INTERNAL_STEPS,
                &mut |_, _, _, _| true,
            );
            match advanced {
                // the observer above never stops it
                Ok(Advance::Done | Advance::Stopped) => {}
                Ok(Advance::OutOfSteps(reached)) => {
                    reply.status = Status::NeedDt(f64::max(0.5 * reached, 1e-3 * request.dt));
                    return true;
                }
                Err(error) => {
                    let near = system.sides_near(&self.motion.q, &self.motion.v, request.dt);
                    let remedy = if near && !compiled.options.rotary_inertia { NEEDS_INERTIA } else { "" };
                    reply.status = Status::Fail(format!("{}{remedy}", error.begun_at(request.t - request.dt)));
                    return !self.went_far(true);
                }
            }
        }
        if next_step.is_none() && self.went_far(false) {
            return false;
        }
        if held.is_none() {
            self.stepper.method.place_sensitivities();
        }
        let energised = |gap: usize| electrics.is_energised(gap, &self.sources);
        if let Err(error) = within_contact_range(compiled, &self.motion.q, energised) {
            reply.status = Status::Fail(error.to_string());
            return true;
        }
        ramp.end_rises(&mut self.rise_slope);
        ramp.at(request.dt, &mut self.drive);
        self.rise.copy_from_slice(&self.rise_slope);
        if let Some(runaway) = thermal_runaway(compiled, &self.sources, &self.rise) {
            reply.status = Status::Fail(runaway);
            return true;
        }
        self.offset = integrated.as_deref().and_then(|state| state.offset.as_ref()?.after(request.dt)).map(Box::new);
        if let Some(offset) = &self.offset {
            offset.add(1.0, &mut self.motion);
        }
        self.answer(compiled, request, Some((&from, parent.unwrap_or(&Snapshot::default()))), h, reply);
        let cell = self.shaken.as_ref().map_or(f64::INFINITY, |shaken| shaken.cell);
        reply.dt_next = reply.dt_next.min(PROPOSED_STEPS * h).min(cell);
        let rate = self.growth_rate(system, reply, next_step.is_some());
        match self.growth.tried(rate, request.dt) {
            Bound::Next(longest) => reply.dt_next = reply.dt_next.min(longest),
            Bound::This(longest) => (reply.status, reply.token) = (Status::NeedDt(longest), None),
        }
        true
    }

    /// The state that a trial starts from.
    fn begin(&mut self, parent: Option<&Snapshot>, beyond: bool) {
        match parent {
            Some(p) => {
                self.motion.q.copy_from_slice(&p.q);
                self.motion.v.copy_from_slice(&p.v);
                self.rise.copy_from_slice(&p.rise);
            }
            None => {
                self.motion.q.fill(Pose::zeros());
                self.motion.v.fill(Pose::zeros());
                self.rise.fill(0.0);
            }
        }
        self.stepper.method.begin(parent.and_then(|p| state_of(p, self.reduction.is_some())));
        if beyond || self.takes_bodies {
            self.stepper.method.take_bodies();
        }
    }

    /// Rate at which the motion at the end of a trial grows at fixed voltages (1/s); 0 where nothing shows that it does.
    fn growth_rate(&mut self, system: &System, reply: &TrialReply, in_macro_step: bool) -> f64 {
        if in_macro_step {
            return 0.0; // it has no response
        }
        let (electrics, ports) = (&system.electrics, self.ports.len());
        let mut fastest = 0.0f64;
        for (p, &source) in self.ports.sources.iter().enumerate() {
            let row: Vec<f64> = (0..self.drive.volts.len()).map(|g| electrics.gap_rows[(g, source)]).collect();
            let unit = system.gap_voltages(&self.motion.q, &row);
            let driven = (0..row.len()).filter(|g| row[*g] != 0.0);
            let fixed: f64 = driven.map(|g| row[g] * unit[g] * self.capacitances[g]).sum();
            let moving = reply.dq_dv[p * (ports + 1)] - fixed;
            if moving.abs() > RESPONDS * fixed.abs() {
                let response = &self.stepper.method.sensitivity()[p].q;
                fastest =
                    fastest.max(rate_along(system, &self.drive, (&self.motion.q, response), &mut self.difference));
            }
        }
        fastest
    }
}
