//! How a trial is answered: a static one by following the parent's equilibrium, a transient one by integrating from the
//! parent's state; then currents, charges, outputs and their partials from what came out.

use super::agitation::Shaken;
use super::local::Session;
use super::ports::Answer;
use super::shown::Shown;
use super::states::Snapshot;
use super::{Status, Trial, TrialReply};
use crate::analysis::contact_range::within_contact_range;
use crate::analysis::signal::{Signal, View};
use crate::compile::Compiled;
use crate::gaps::Ramp;
use crate::multibody::planar::Pose;
use crate::solve::path::SourcePath;
use crate::solve::time::adaptive::{Advance, Control};

/// Share of the compilation's tolerance that one internal step may use.
const STEP_SHARE: f64 = 1e-2;
/// Internal steps in one circuit step before the device asks for a shorter one.
const MAX_INTERNAL_STEPS: usize = 512;
/// Longest circuit step proposed, in internal steps, whatever the circuit sees: a step that has to be taken again shall
/// not cost too much, and a change of pace from one step to the next stay below [`MAX_INTERNAL_STEPS`].
const PROPOSED_STEPS: f64 = 32.0;
/// Share of the length scale that the integrator takes for nothing, in units of its tolerance [1].
const FLOOR: f64 = 1e-4;
/// A temperature that no circuit tells from another [K].
const SAME_TEMPERATURE: f64 = 1e-6;
/// A voltage that no circuit tells from another, and its share of the voltage at the port: what ngspice iterates to [V, 1].
const SAME_VOLTAGE: [f64; 2] = [1e-6, 1e-6];

impl Session {
    /// A static trial: from the parent's equilibrium along straight lines in voltage, or from rest.
    pub(super) fn balance(
        &mut self,
        compiled: &Compiled,
        request: &Trial<'_>,
        parent: Option<&Snapshot>,
        reply: &mut TrialReply,
    ) {
        let own = self.ports.system.clone();
        let system = Self::system(&own, compiled);
        let electrics = &system.electrics;
        self.fill_sources(electrics, request.voltages);
        let rest = vec![0.0; self.sources.len()];
        let (from, load) = parent.map_or((rest.as_slice(), 0.0), |p| (p.sources.as_slice(), 1.0));
        self.motion.q.copy_from_slice(parent.map_or(&self.zeros, |p| &p.q));
        self.motion.v.fill(Pose::zeros());
        let path = SourcePath::new(electrics, from, &self.sources, [load, 1.0]);
        match self.equilibrium.follow(system, &path, &mut self.motion.q) {
            Ok(found) => reply.jumped = found.fold.is_some(),
            Err(error) => {
                reply.status = Status::Fail(error.to_string());
                return;
            }
        }
        if let Err(error) = within_contact_range(compiled, &self.motion.q) {
            reply.status = Status::Fail(error.to_string());
            return;
        }
        electrics.steady(&self.sources, &mut self.rise, &mut self.drive);
        // ∂q/∂V = −K⁻¹·∂r/∂V with the factor that the last Newton iteration left
        for (p, &port) in self.ports.sources.iter().enumerate() {
            self.unit.fill(0.0);
            self.unit[port] = 1.0;
            electrics.steady_slope(&self.sources, &self.unit, &mut self.change);
            let s = &mut self.stepper.method.sensitivity_mut()[p];
            system.drive_force(&self.motion.q, &self.drive, &self.change, &mut s.q);
            for x in &mut s.q {
                *x = -*x;
            }
            self.equilibrium.factor().solve(&system.model.pattern, &mut s.q);
            s.v.fill(Pose::zeros());
        }
        self.answer(compiled, request, None, self.first_step, reply);
    }

    /// A transient trial: the motion over dt, sensitivities along.
    pub(super) fn advance(
        &mut self,
        compiled: &Compiled,
        request: &Trial<'_>,
        parent: Option<&Snapshot>,
        reply: &mut TrialReply,
    ) {
        let own = self.ports.system.clone();
        let system = Self::system(&own, compiled);
        self.fill_sources(&system.electrics, request.voltages);
        let from: Vec<f64> = match parent {
            Some(p) => {
                self.motion.q.copy_from_slice(&p.q);
                self.motion.v.copy_from_slice(&p.v);
                self.rise.copy_from_slice(&p.rise);
                p.sources.clone()
            }
            None => {
                self.motion.q.fill(Pose::zeros());
                self.motion.v.fill(Pose::zeros());
                self.rise.fill(0.0);
                vec![0.0; self.sources.len()]
            }
        };
        self.stepper.method.begin(parent.map_or(&[], |p| &p.carried));
        let electrics = &system.electrics;
        if let Some(shaken) = &mut self.shaken {
            let start = parent.map_or(0.0, |p| p.elapsed);
            if let Err(longest) = shaken.over(compiled, start, request.dt) {
                reply.status = Status::NeedDt(longest);
                return;
            }
        }
        let push = self.shaken.as_ref().map_or(&[][..], Shaken::mean);
        let ramp = Ramp::new(electrics, &from, &self.sources, &self.rise, request.dt).pushed(push);
        let mut h = parent.map_or(self.first_step, |p| p.next_step);
        let advanced = self.stepper.advance(
            system,
            &ramp,
            &mut self.motion,
            &mut h,
            Control::Tolerance(STEP_SHARE * compiled.options.tol),
            MAX_INTERNAL_STEPS,
            &mut |_, _, _, _| true,
        );
        match advanced {
            // the observer below never stops it
            Ok(Advance::Done | Advance::Stopped) => {}
            Ok(Advance::OutOfSteps(reached)) => {
                reply.status = Status::NeedDt(f64::max(0.5 * reached, 1e-3 * request.dt));
                return;
            }
            Err(error) => {
                reply.status = Status::Fail(error.to_string());
                return;
            }
        }
        if let Err(error) = within_contact_range(compiled, &self.motion.q) {
            reply.status = Status::Fail(error.to_string());
            return;
        }
        for k in 0..self.rise_slope.len() {
            self.rise_slope[k] = ramp.rise_at(k, request.dt);
        }
        ramp.at(request.dt, &mut self.drive);
        self.rise.copy_from_slice(&self.rise_slope);
        let rest = Snapshot::default();
        self.answer(compiled, request, Some((&from, parent.unwrap_or(&rest))), h, reply);
        let cell = self.shaken.as_ref().map_or(f64::INFINITY, |shaken| shaken.cell);
        reply.dt_next = reply.dt_next.min(PROPOSED_STEPS * h).min(cell);
    }

    /// Fills in the reply from `motion`, `rise`, `sources` and `sensitivity`, and stores the state. `from` holds the
    /// sources at the start of a transient step, and what was seen up to there; `dt_next` becomes what is seen now.
    fn answer(
        &mut self,
        compiled: &Compiled,
        request: &Trial<'_>,
        from: Option<(&[f64], &Snapshot)>,
        next_step: f64,
        reply: &mut TrialReply,
    ) {
        let own = self.ports.system.clone();
        let system = Self::system(&own, compiled);
        let electrics = &system.electrics;
        let (ports, gaps) = (self.ports.len(), self.drive.volts.len());
        let view = View { q: &self.motion.q, v: &self.motion.v, rise: &self.rise, volts: &self.drive.volts };
        reply.currents.clear();
        reply.charges.clear();
        reply.di_dv.clear();
        reply.outputs.clear();
        for (&port, answer) in self.ports.sources.iter().zip(&self.ports.answers) {
            let (mut current, mut charge) = (0.0, 0.0);
            match answer {
                Answer::Current => {
                    let row = electrics.conductance.row(port);
                    current = row.iter().zip(&self.sources).map(|(g, u)| g * u).sum();
                    reply.di_dv.extend(self.ports.sources.iter().map(|&other| row[other]));
                    let of = |g: usize| electrics.gap_rows[(g, port)] * system.capacitance(g, view.q) * view.volts[g];
                    charge = (0..gaps).map(of).sum();
                }
                Answer::Motion(signal) => current = signal.value(compiled, &view),
                Answer::Rise(heater) => current = view.rise[*heater],
                Answer::Nothing => {}
            }
            reply.currents.push(current);
            reply.charges.push(charge);
            // what is not electrical is filled in with the sensitivities
            reply.di_dv.resize(reply.currents.len() * ports, 0.0);
        }
        reply.outputs.extend(self.signals.iter().map(|s| s.value(compiled, &view)));
        reply.dq_dv.clear();
        reply.dq_dv.resize(ports * ports, 0.0);
        reply.doutputs_dv.clear();
        reply.doutputs_dv.resize(self.signals.len() * ports, 0.0);
        for (p, &port) in self.ports.sources.iter().enumerate() {
            let s = &self.stepper.method.sensitivity()[p];
            let gap_row: Vec<f64> = (0..gaps).map(|g| electrics.gap_rows[(g, port)]).collect();
            match from {
                None => {
                    self.unit.fill(0.0);
                    self.unit[port] = 1.0;
                    for (k, slope) in self.rise_slope.iter_mut().enumerate() {
                        *slope = electrics.heating.slope(k, &self.sources, &self.unit);
                    }
                }
                Some((from, _)) => {
                    let (dt, slopes) = (request.dt, &mut self.rise_slope);
                    electrics.rise_sensitivities((from, &self.sources), dt, dt, port, |k, slope| slopes[k] = slope);
                }
            }
            for (g, volts) in gap_row.iter().enumerate() {
                let dq =
                    system.capacitance(g, view.q) * volts + system.capacitance_slope(g, view.q, &s.q) * view.volts[g];
                for (row, &other) in self.ports.sources.iter().enumerate() {
                    if self.ports.answers[row] == Answer::Current {
                        reply.dq_dv[row * ports + p] += electrics.gap_rows[(g, other)] * dq;
                    }
                }
            }
            let change = View { q: &s.q, v: &s.v, rise: &self.rise_slope, volts: &gap_row };
            for (row, signal) in self.signals.iter().enumerate() {
                reply.doutputs_dv[row * ports + p] = signal.slope(compiled, &view, &change);
            }
            for (row, answer) in self.ports.answers.iter().enumerate() {
                match answer {
                    Answer::Motion(signal) => reply.di_dv[row * ports + p] = signal.slope(compiled, &view, &change),
                    Answer::Rise(heater) => reply.di_dv[row * ports + p] = change.rise[*heater],
                    Answer::Current | Answer::Nothing => {}
                }
            }
        }
        let electrical = |row: usize| self.ports.answers[row] == Answer::Current;
        let shown = (0..ports).map(|row| if electrical(row) { reply.charges[row] } else { reply.currents[row] });
        let seen = reply.outputs.iter().copied().chain(shown).collect();
        let (shown, bound) = match from {
            None => (Shown::start(seen), f64::INFINITY),
            Some((_, before)) => {
                let (tol, signals) = (compiled.options.tol, self.signals.len());
                let nothing = STEP_SHARE * tol * FLOOR;
                let charge = |capacitance: f64, volts: f64| {
                    capacitance.abs() * (SAME_VOLTAGE[0] + SAME_VOLTAGE[1] * volts.abs())
                };
                let of_signal = |signal: &Signal| match signal {
                    Signal::Displacement(_, 2) => nothing,
                    Signal::Displacement(..) | Signal::Distance(_) => nothing * system.length_scale,
                    Signal::Rate(_, 2) => nothing / self.first_step,
                    Signal::Rate(..) => nothing * system.length_scale / self.first_step,
                    Signal::Temperature(_) | Signal::Prescribed(_) => SAME_TEMPERATURE,
                    Signal::Capacitance(g) => nothing * system.capacitance(*g, view.q).abs(),
                    Signal::Pull(g) => nothing * system.pull(*g, view.q, view.volts[*g]).abs(),
                    Signal::Charge(g) => charge(system.capacitance(*g, view.q), view.volts[*g]),
                };
                before.shown.step(request.dt, seen, tol, |n| match n.checked_sub(signals) {
                    None => of_signal(&self.signals[n]),
                    Some(port) => match &self.ports.answers[port] {
                        Answer::Current => charge(reply.dq_dv[port * (ports + 1)], request.voltages[port]),
                        Answer::Motion(signal) => of_signal(signal),
                        Answer::Rise(_) | Answer::Nothing => SAME_TEMPERATURE,
                    },
                })
            }
        };
        reply.dt_next = bound;
        let snapshot = Snapshot {
            shown,
            q: self.motion.q.clone(),
            v: self.motion.v.clone(),
            rise: self.rise.clone(),
            sources: self.sources.clone(),
            next_step,
            elapsed: from.map_or(0.0, |(_, before)| before.elapsed + request.dt),
            carried: if from.is_some() { self.stepper.method.state().to_vec() } else { Vec::new() },
        };
        reply.token = Some(self.states.insert(request, snapshot));
    }
}
