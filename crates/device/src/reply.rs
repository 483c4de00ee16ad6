//! Reply to a trial: currents, charges, outputs and their partials at the resulting state, and the bound of the
//! circuit's next step.

use super::macro_step::PeakMotion;
use super::multirate::{pause_after, peak_after};
use super::session::DeviceSession;
use super::states::Snapshot;
use super::step_history::{StepHistory, SteppingRule};
use super::{Trial, TrialReply};
use bimorph_analysis::readout::ports::PortResponse;
use bimorph_analysis::readout::signal::{Signal, SignalView};
use bimorph_domains::System;
use bimorph_model::compile::CompiledModel;
use std::sync::Arc;

/// Fraction of the length scale that the integrator takes for nothing, in units of its tolerance (1).
const FLOOR: f64 = 1e-4;
/// Temperature difference that is negligible for a circuit (K).
const SAME_TEMPERATURE: f64 = 1e-6;
/// Voltage difference that is negligible for a circuit, and its fraction of the voltage at the port: the tolerances of
/// ngspice's iteration (V, 1).
const SAME_VOLTAGE: [f64; 2] = [1e-6, 1e-6];

/// Values of the sources and rises (K) at the start of a transient step.
type StepStart<'a> = (&'a [f64], &'a [f64]);

impl DeviceSession {
    /// Fills in the reply from `motion`, `rise`, `sources` and `sensitivity`, and stores the state. `from` holds the
    /// sources at the start of a transient step, and what was seen up to there; `dt_next` becomes what is seen now.
    pub(super) fn answer(
        &mut self,
        compiled: &CompiledModel,
        request: &Trial<'_>,
        from: Option<(&[f64], &Snapshot)>,
        next_step: f64,
        reply: &mut TrialReply,
    ) {
        let own = self.ports.system.clone();
        let system = Self::system(&own, compiled);
        let Self { capacitances, motion, .. } = self;
        capacitances.clear();
        capacitances.extend((0..system.electrics.gap_rows.nrows()).map(|gap| system.capacitance(gap, &motion.q)));
        self.values(compiled, system, reply);
        self.partials(compiled, system, from.map(|(from, before)| ((from, before.rise.as_slice()), request.dt)), reply);
        let (shown, bound) = self.seen(compiled, system, request, from.map(|(_, before)| before), reply);
        reply.dt_next = bound;
        let carried = self.carried(from.is_some());
        let (origin, peak) = match (from, &self.multirate) {
            (_, None) => Default::default(),
            (Some((_, before)), _) => (Arc::clone(&before.origin), peak_after(system, before, &self.motion)),
            (None, _) => (self.motion.q.as_slice().into(), PeakMotion::default()),
        };
        let snapshot = Snapshot {
            shown,
            q: self.motion.q.clone(),
            v: self.motion.v.clone(),
            rise: self.rise.clone(),
            sources: self.sources.clone(),
            anchors: if from.is_some() { Vec::new() } else { self.equilibrium.sticking.anchors().to_vec() },
            next_step,
            elapsed: from.map_or(0.0, |(_, before)| before.elapsed + request.dt),
            carried,
            pause: match (&self.position, from) {
                (None, Some((_, before))) => pause_after(before, self.exceeds_bound),
                _ => 0,
            },
            peak,
            origin,
            macro_step: self.position.take(),
            offset: self.offset.take(),
        };
        reply.token = Some(self.states.insert(request, snapshot));
    }

    fn view(&self) -> SignalView<'_> {
        SignalView { q: &self.motion.q, v: &self.motion.v, rise: &self.rise, volts: &self.drive.volts }
    }

    /// Currents, charges and outputs; of the partials of currents those that the circuit alone makes.
    fn values(&self, compiled: &CompiledModel, system: &System, reply: &mut TrialReply) {
        let electrics = &system.electrics;
        let (ports, gaps) = (self.ports.len(), self.drive.volts.len());
        let view = self.view();
        let hot = electrics.heating.is_hot().then(|| electrics.port_currents(&self.sources, &self.rise));
        reply.currents.clear();
        reply.charges.clear();
        reply.di_dv.clear();
        reply.outputs.clear();
        for (&port, answer) in self.ports.sources.iter().zip(&self.ports.answers) {
            let (mut current, mut charge) = (0.0, 0.0);
            match answer {
                PortResponse::Current => {
                    let row = electrics.conductance.row(port);
                    current = match &hot {
                        Some(currents) => currents[port],
                        None => row.iter().zip(&self.sources).map(|(g, u)| g * u).sum(),
                    };
                    reply.di_dv.extend(self.ports.sources.iter().map(|&other| row[other]));
                    let of = |g: usize| {
                        let is_floating = electrics.floating.of_gap(g).is_some();
                        let own = || self.capacitances[g] * view.volts[g];
                        electrics.gap_rows[(g, port)]
                            * if is_floating { system.charge(g, view.q, view.volts) } else { own() }
                    };
                    charge = (0..gaps).map(of).sum();
                }
                PortResponse::Motion(signal) => current = signal.value(compiled, &view),
                PortResponse::Rise(heater) => current = view.rise[*heater],
                PortResponse::Nothing => {}
            }
            reply.currents.push(current);
            reply.charges.push(charge);
            // what is not electrical is filled in with the sensitivities
            reply.di_dv.resize(reply.currents.len() * ports, 0.0);
        }
        reply.outputs.extend(self.signals.iter().map(|s| s.value(compiled, &view)));
    }

    /// Partials of charges, outputs and what is not electrical, from the sensitivities. `step` holds the sources and rises at the start
    /// of a transient step and its length (s).
    fn partials(
        &mut self,
        compiled: &CompiledModel,
        system: &System,
        step: Option<(StepStart<'_>, f64)>,
        reply: &mut TrialReply,
    ) {
        let electrics = &system.electrics;
        let (ports, gaps) = (self.ports.len(), self.drive.volts.len());
        let view = SignalView { q: &self.motion.q, v: &self.motion.v, rise: &self.rise, volts: &self.drive.volts };
        // points within a macro step have no sensitivities
        let moves = self.position.is_none();
        reply.dq_dv.clear();
        reply.dq_dv.resize(ports * ports, 0.0);
        reply.doutputs_dv.clear();
        reply.doutputs_dv.resize(self.signals.len() * ports, 0.0);
        for (p, &port) in self.ports.sources.iter().enumerate() {
            let s = &self.stepper.method.sensitivity()[p];
            let gap_row: Vec<f64> = (0..gaps).map(|g| electrics.gap_rows[(g, port)]).collect();
            match step {
                None => {
                    self.unit.fill(0.0);
                    self.unit[port] = 1.0;
                    electrics.heating.slopes(&self.sources, &self.rise, &self.unit, &mut self.rise_slope);
                }
                Some(((from, start), dt)) => {
                    let (slopes, states) = (&mut self.rise_slope, electrics.heating.states());
                    let cold = if start.is_empty() { vec![0.0; states] } else { Vec::new() };
                    let way = ((from, &self.sources[..]), if start.is_empty() { &cold[..] } else { start });
                    electrics.rise_sensitivities(way, dt, dt, port, |k, slope| slopes[k] = slope);
                }
            }
            if electrics.heating.is_hot() {
                self.unit.fill(0.0);
                self.unit[port] = 1.0;
                let about = (&self.sources[..], &self.rise[..]);
                let currents = electrics.port_current_slopes(about, &self.unit, &self.rise_slope);
                for (row, &other) in self.ports.sources.iter().enumerate() {
                    if self.ports.answers[row] == PortResponse::Current {
                        reply.di_dv[row * ports + p] = currents[other];
                    }
                }
            }
            for g in 0..gaps {
                let (about, change) = ((view.q, view.volts), (moves.then_some(&s.q[..]), Some(&gap_row[..])));
                let dq = system.charge_slope_with(|| self.capacitances[g], g, about, change);
                for (row, &other) in self.ports.sources.iter().enumerate() {
                    if self.ports.answers[row] == PortResponse::Current {
                        reply.dq_dv[row * ports + p] += electrics.gap_rows[(g, other)] * dq;
                    }
                }
            }
            let change = SignalView { q: &s.q, v: &s.v, rise: &self.rise_slope, volts: &gap_row };
            for (row, signal) in self.signals.iter().enumerate() {
                reply.doutputs_dv[row * ports + p] = signal.slope(compiled, &view, &change);
            }
            for (row, answer) in self.ports.answers.iter().enumerate() {
                match answer {
                    PortResponse::Motion(signal) => {
                        reply.di_dv[row * ports + p] = signal.slope(compiled, &view, &change)
                    }
                    PortResponse::Rise(heater) => reply.di_dv[row * ports + p] = change.rise[*heater],
                    PortResponse::Current | PortResponse::Nothing => {}
                }
            }
        }
    }

    /// Values of a state for the circuit, and the bound of the step from there (s).
    fn seen(
        &self,
        compiled: &CompiledModel,
        system: &System,
        request: &Trial<'_>,
        before: Option<&Snapshot>,
        reply: &TrialReply,
    ) -> (StepHistory, f64) {
        let (ports, view) = (self.ports.len(), self.view());
        let electrical = |row: usize| self.ports.answers[row] == PortResponse::Current;
        let shown = (0..ports).map(|row| if electrical(row) { reply.charges[row] } else { reply.currents[row] });
        let seen = reply.outputs.iter().copied().chain(shown).collect();
        match before {
            None => (StepHistory::start(seen), f64::INFINITY),
            Some(before) => {
                let (errors, signals) = (compiled.options.errors(), self.signals.len());
                let nothing = errors.step_at_least(FLOOR);
                let charge = |capacitance: f64, volts: f64| {
                    capacitance.abs() * (SAME_VOLTAGE[0] + SAME_VOLTAGE[1] * volts.abs())
                };
                let of_signal = |signal: &Signal| match signal {
                    Signal::Displacement(_, 2) => nothing,
                    Signal::Displacement(..) | Signal::Distance(_) => nothing * system.length_scale,
                    Signal::Rate(_, 2) => nothing / self.first_step,
                    Signal::Rate(..) => nothing * system.length_scale / self.first_step,
                    Signal::Temperature(_) | Signal::Prescribed(_) => SAME_TEMPERATURE,
                    Signal::Stress(_) | Signal::Bearing(_) | Signal::Conductance(..) | Signal::AnchorForce(..) => {
                        nothing * signal.value(compiled, &view)
                    }
                    Signal::Capacitance(g) => nothing * system.capacitance(*g, view.q).abs(),
                    Signal::Pull(_) => nothing * signal.value(compiled, &view).abs(),
                    Signal::Charge(g) => charge(system.capacitance(*g, view.q), view.volts[*g]),
                };
                let follow = |n: usize| match n.checked_sub(signals).map(|port| &self.ports.answers[port]) {
                    Some(PortResponse::Motion(_)) => SteppingRule::Even,
                    Some(PortResponse::Current) => SteppingRule::Differentiated,
                    _ => SteppingRule::Line,
                };
                let floor = |n: usize| match n.checked_sub(signals) {
                    None => self.signals[n].bound(of_signal),
                    Some(port) => match &self.ports.answers[port] {
                        PortResponse::Current => charge(reply.dq_dv[port * (ports + 1)], request.voltages[port]),
                        PortResponse::Motion(signal) => of_signal(signal),
                        PortResponse::Rise(_) | PortResponse::Nothing => SAME_TEMPERATURE,
                    },
                };
                before.shown.step(request.dt, seen, errors, floor, follow)
            }
        }
    }
}
