//! The device in process: a compiled model stepped where the circuit runs.
//!
//! A state is displacement, rate, heater rises and source voltages of one instant. A trial copies its parent, works on the
//! copy, and stores the result under a token that is a hash of the request: the same request always gives the same token
//! and the same bits, whatever was asked in between.

use super::states::{Snapshot, States};
use super::{
    Description, Device, DeviceError, Mode, OpenRequest, PortInfo, SignalInfo, SmallSignal, Status, Token, Trial,
    TrialReply,
};
use crate::analysis::signal::{Signal, View};
use crate::analysis::transient::first_step;
use crate::compile::Compiled;
use crate::gaps::{Drive, Ramp};
use crate::multibody::BlockMatrix;
use crate::multibody::planar::Pose;
use crate::solve::adaptive::{Adaptive, Advance};
use crate::solve::equilibrium::{Equilibrium, EquilibriumOptions};
use crate::solve::harmonic::{ComplexPose, Harmonic};
use crate::solve::path::SourcePath;
use crate::solve::rodas4::Motion;
use std::sync::Arc;

/// Share of the compilation's tolerance that one internal step may use.
const STEP_SHARE: f64 = 1e-2;
/// Internal steps in one circuit step before the device asks for a shorter one.
const MAX_INTERNAL_STEPS: usize = 64;
/// Longest circuit step proposed, in internal steps: the circuit sees the motion only at its own time points, and its
/// formula for the current of a moving charge is of second order.
const PROPOSED_STEPS: f64 = 0.5;

/// A [`Device`] over a compiled model.
#[derive(Debug)]
pub struct LocalDevice {
    compiled: Arc<Compiled>,
    session: Option<Session>,
}

/// What is open: the choice of ports and signals, the states, and the storage that every trial reuses.
#[derive(Debug)]
struct Session {
    /// Source index of each opened port.
    ports: Vec<usize>,
    signals: Vec<Signal>,
    states: States,
    first_step: f64,
    equilibrium: Equilibrium,
    stepper: Adaptive,
    motion: Motion,
    /// ∂motion/∂(final voltage), one for each opened port.
    sensitivity: Vec<Motion>,
    rise: Vec<f64>,
    rise_slope: Vec<f64>,
    sources: Vec<f64>,
    unit: Vec<f64>,
    drive: Drive,
    change: Drive,
    zeros: Vec<Pose>,
    linear: Option<(Token, BlockMatrix<f64, 3>)>,
    harmonic: Harmonic,
    response: Vec<ComplexPose>,
}

impl LocalDevice {
    /// A device over a compiled model, not yet open.
    pub fn new(compiled: Arc<Compiled>) -> Self {
        Self { compiled, session: None }
    }

    /// The model.
    pub fn compiled(&self) -> &Arc<Compiled> {
        &self.compiled
    }

    /// Bytes that the open session's states take, about.
    pub fn state_bytes(&self) -> usize {
        self.session.as_ref().map_or(0, |s| s.states.bytes())
    }
}

impl Device for LocalDevice {
    fn open(&mut self, request: &OpenRequest) -> Result<Description, DeviceError> {
        let (session, description) = Session::open(&self.compiled, request)?;
        self.session = Some(session);
        Ok(description)
    }

    fn trial(&mut self, request: &Trial<'_>, reply: &mut TrialReply) -> Result<(), DeviceError> {
        let session = self.session.as_mut().ok_or(DeviceError::NotOpen)?;
        session.check(request)?;
        let parent = match request.parent {
            Some(token) => Some(session.states.get(token).ok_or(DeviceError::UnknownToken(token))?),
            None => None,
        };
        reply.token = None;
        reply.status = Status::Ok;
        reply.jumped = false;
        reply.dt_next = f64::INFINITY;
        match request.mode {
            Mode::Static => session.balance(&self.compiled, request, parent.as_deref(), reply),
            Mode::Transient => session.advance(&self.compiled, request, parent.as_deref(), reply),
        }
        Ok(())
    }

    fn accept(&mut self, token: Token) {
        if let Some(session) = self.session.as_mut() {
            session.states.accept(token);
        }
    }

    fn linearize(&mut self, token: Token, omega: f64, reply: &mut SmallSignal) -> Result<(), DeviceError> {
        let session = self.session.as_mut().ok_or(DeviceError::NotOpen)?;
        if !omega.is_finite() || omega < 0.0 {
            return Err(DeviceError::BadRequest {
                what: "omega",
                expected: "a finite angular frequency of at least 0 rad/s".into(),
                got: omega.to_string(),
            });
        }
        let state = session.states.get(token).ok_or(DeviceError::UnknownToken(token))?;
        session.respond(&self.compiled, token, &state, omega, reply)
    }
}

impl Session {
    fn open(compiled: &Compiled, request: &OpenRequest) -> Result<(Self, Description), DeviceError> {
        let system = &compiled.parts.system;
        let electrics = &system.electrics;
        let available = || electrics.names[..electrics.ports].to_vec();
        let ports: Vec<usize> = if request.ports.is_empty() {
            (0..electrics.ports).collect()
        } else {
            (request.ports.iter())
                .map(|name| {
                    let found = available().iter().position(|n| n == name);
                    found.ok_or_else(|| DeviceError::UnknownPort { name: name.clone(), available: available() })
                })
                .collect::<Result<_, _>>()?
        };
        let signals: Vec<Signal> = (request.signals.iter())
            .map(|name| {
                Signal::find(compiled, name)
                    .map_err(|e| DeviceError::UnknownSignal { name: name.clone(), hint: e.to_string() })
            })
            .collect::<Result<_, _>>()?;
        let description = Description {
            ports: ports.iter().map(|&p| PortInfo { name: electrics.names[p].clone() }).collect(),
            signals: (request.signals.iter().zip(&signals))
                .map(|(name, s)| SignalInfo { name: name.clone(), unit: s.unit().into() })
                .collect(),
            unknowns: system.model.unknowns(),
        };
        let n = system.bodies();
        let heaters = electrics.heating.heaters.len();
        let session = Self {
            sensitivity: vec![Motion::zeros(n); ports.len()],
            stepper: Adaptive::new(system, ports.len()),
            ports,
            signals,
            states: States::default(),
            first_step: first_step(system, f64::INFINITY),
            equilibrium: Equilibrium::new(system, EquilibriumOptions::default()),
            motion: Motion::zeros(n),
            rise: vec![0.0; heaters],
            rise_slope: vec![0.0; heaters],
            sources: vec![0.0; electrics.sources()],
            unit: vec![0.0; electrics.sources()],
            drive: electrics.drive(),
            change: electrics.drive(),
            zeros: vec![Pose::zeros(); n],
            linear: None,
            harmonic: Harmonic::new(system),
            response: vec![ComplexPose::zeros(); n],
        };
        Ok((session, description))
    }

    fn check(&self, request: &Trial<'_>) -> Result<(), DeviceError> {
        if request.voltages.len() != self.ports.len() {
            return Err(DeviceError::BadRequest {
                what: "voltages",
                expected: format!("{} values, one for each opened port", self.ports.len()),
                got: request.voltages.len().to_string(),
            });
        }
        if let Some(v) = request.voltages.iter().find(|v| !v.is_finite()) {
            return Err(DeviceError::BadRequest {
                what: "voltages",
                expected: "finite volts".into(),
                got: v.to_string(),
            });
        }
        if request.mode == Mode::Transient && !(request.dt.is_finite() && request.dt > 0.0) {
            return Err(DeviceError::BadRequest {
                what: "dt",
                expected: "a positive time in seconds".into(),
                got: request.dt.to_string(),
            });
        }
        Ok(())
    }

    /// Fills in the source vector: opened ports as asked, the others at 0 V, the netlist's own sources.
    fn fill_sources(&mut self, compiled: &Compiled, voltages: &[f64]) {
        let electrics = &compiled.parts.system.electrics;
        self.sources[..electrics.ports].fill(0.0);
        for (&port, &v) in self.ports.iter().zip(voltages) {
            self.sources[port] = v;
        }
        self.sources[electrics.ports..].copy_from_slice(&electrics.fixed);
    }

    /// A static trial: from the parent's equilibrium along straight lines in voltage, or from rest.
    fn balance(&mut self, compiled: &Compiled, request: &Trial<'_>, parent: Option<&Snapshot>, reply: &mut TrialReply) {
        let system = &compiled.parts.system;
        let electrics = &system.electrics;
        self.fill_sources(compiled, request.voltages);
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
        electrics.steady(&self.sources, &mut self.rise, &mut self.drive);
        // ∂q/∂V = −K⁻¹·∂r/∂V with the factor that the last Newton iteration left
        for (p, &port) in self.ports.iter().enumerate() {
            self.unit.fill(0.0);
            self.unit[port] = 1.0;
            electrics.steady_slope(&self.sources, &self.unit, &mut self.change);
            let s = &mut self.sensitivity[p];
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
    fn advance(&mut self, compiled: &Compiled, request: &Trial<'_>, parent: Option<&Snapshot>, reply: &mut TrialReply) {
        let system = &compiled.parts.system;
        self.fill_sources(compiled, request.voltages);
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
        for s in &mut self.sensitivity {
            s.q.fill(Pose::zeros());
            s.v.fill(Pose::zeros());
        }
        let electrics = &system.electrics;
        let ramp = Ramp { electrics, from: &from, to: &self.sources, rise: &self.rise, dt: request.dt };
        let mut h = parent.map_or(self.first_step, |p| p.next_step);
        let advanced = self.stepper.advance(
            system,
            &ramp,
            &mut self.motion,
            &self.ports,
            &mut self.sensitivity,
            &mut h,
            STEP_SHARE * compiled.options.tol,
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
        for k in 0..self.rise_slope.len() {
            self.rise_slope[k] = ramp.rise_at(k, request.dt);
        }
        ramp.at(request.dt, &mut self.drive);
        self.rise.copy_from_slice(&self.rise_slope);
        self.answer(compiled, request, Some(&from), h, reply);
        reply.dt_next = PROPOSED_STEPS * h;
    }

    /// Fills in the reply from `motion`, `rise`, `sources` and `sensitivity`, and stores the state. `from` holds the
    /// sources at the start of a transient step.
    fn answer(
        &mut self,
        compiled: &Compiled,
        request: &Trial<'_>,
        from: Option<&[f64]>,
        next_step: f64,
        reply: &mut TrialReply,
    ) {
        let system = &compiled.parts.system;
        let electrics = &system.electrics;
        let (ports, gaps) = (self.ports.len(), self.drive.volts.len());
        let view = View { q: &self.motion.q, v: &self.motion.v, rise: &self.rise, volts: &self.drive.volts };
        reply.currents.clear();
        reply.charges.clear();
        reply.di_dv.clear();
        reply.outputs.clear();
        for &port in &self.ports {
            let row = electrics.conductance.row(port);
            reply.currents.push(row.iter().zip(&self.sources).map(|(g, u)| g * u).sum());
            reply.di_dv.extend(self.ports.iter().map(|&other| row[other]));
            reply.charges.push(
                (0..gaps).map(|g| electrics.gap_rows[(g, port)] * system.capacitance(g, view.q) * view.volts[g]).sum(),
            );
        }
        reply.outputs.extend(self.signals.iter().map(|s| s.value(compiled, &view)));
        reply.dq_dv.clear();
        reply.dq_dv.resize(ports * ports, 0.0);
        reply.doutputs_dv.clear();
        reply.doutputs_dv.resize(self.signals.len() * ports, 0.0);
        for (p, &port) in self.ports.iter().enumerate() {
            let s = &self.sensitivity[p];
            let gap_row: Vec<f64> = (0..gaps).map(|g| electrics.gap_rows[(g, port)]).collect();
            for k in 0..self.rise_slope.len() {
                self.rise_slope[k] = match from {
                    None => {
                        self.unit.fill(0.0);
                        self.unit[port] = 1.0;
                        2.0 * electrics.heating.mixed(k, &self.sources, &self.unit)
                    }
                    Some(from) => Ramp { electrics, from, to: &self.sources, rise: &self.rise, dt: request.dt }
                        .rise_sensitivity(k, request.dt, port),
                };
            }
            for g in 0..gaps {
                let dq = system.capacitance(g, view.q) * gap_row[g]
                    + system.capacitance_slope(g, view.q, &s.q) * view.volts[g];
                for (row, &other) in self.ports.iter().enumerate() {
                    reply.dq_dv[row * ports + p] += electrics.gap_rows[(g, other)] * dq;
                }
            }
            let change = View { q: &s.q, v: &s.v, rise: &self.rise_slope, volts: &gap_row };
            for (row, signal) in self.signals.iter().enumerate() {
                reply.doutputs_dv[row * ports + p] = signal.slope(compiled, &view, &change);
            }
        }
        let snapshot = Snapshot {
            q: self.motion.q.clone(),
            v: self.motion.v.clone(),
            rise: self.rise.clone(),
            sources: self.sources.clone(),
            next_step,
        };
        reply.token = Some(self.states.insert(request, snapshot));
    }

    /// Small-signal response about a state.
    fn respond(
        &mut self,
        compiled: &Compiled,
        token: Token,
        state: &Snapshot,
        omega: f64,
        reply: &mut SmallSignal,
    ) -> Result<(), DeviceError> {
        let system = &compiled.parts.system;
        let electrics = &system.electrics;
        electrics.apply(&state.sources, &state.rise, &mut self.drive);
        if self.linear.as_ref().is_none_or(|(t, _)| *t != token) {
            let mut tangent = BlockMatrix::new(&system.model.pattern);
            system.tangent(&state.q, &self.drive, &mut tangent, &mut self.motion.q);
            self.linear = Some((token, tangent));
        }
        let Some((_, tangent)) = &self.linear else { return Err(DeviceError::NotOpen) };
        self.harmonic.factor(system, tangent, omega).map_err(|e| DeviceError::BadRequest {
            what: "omega",
            expected: "a frequency away from an undamped resonance".into(),
            got: format!("{omega:e} rad/s ({e})"),
        })?;
        let (ports, gaps, heaters) = (self.ports.len(), self.drive.volts.len(), state.rise.len());
        reply.admittance.clear();
        reply.admittance.resize(ports * ports, [0.0; 2]);
        reply.outputs.clear();
        reply.outputs.resize(self.signals.len() * ports, [0.0; 2]);
        let view = View { q: &state.q, v: &state.v, rise: &state.rise, volts: &self.drive.volts };
        for (p, &port) in self.ports.iter().enumerate() {
            self.unit.fill(0.0);
            self.unit[port] = 1.0;
            // heaters lag: δT = 2Qu·δV/(1 + iωτ)
            let rise: Vec<[f64; 2]> = (0..heaters)
                .map(|k| {
                    let steady = 2.0 * electrics.heating.mixed(k, &state.sources, &self.unit);
                    let x = omega * electrics.heating.heaters[k].time_constant;
                    [steady / (1.0 + x * x), -steady * x / (1.0 + x * x)]
                })
                .collect();
            let gap_row: Vec<f64> = (0..gaps).map(|g| electrics.gap_rows[(g, port)]).collect();
            let still = vec![0.0; gaps];
            let parts = [0, 1].map(|part| {
                let mut change = electrics.drive();
                change.volts.copy_from_slice(if part == 0 { &gap_row } else { &still });
                for k in 0..heaters {
                    change.expansion[k] = electrics.heating.heaters[k].expansion * rise[k][part];
                }
                change.load = 0.0;
                let mut force = self.zeros.clone();
                system.drive_force(&state.q, &self.drive, &change, &mut force);
                force
            });
            for ((x, re), im) in self.response.iter_mut().zip(&parts[0]).zip(&parts[1]) {
                *x = re.zip_map(im, |re, im| nalgebra::Complex::new(-re, -im));
            }
            self.harmonic.solve(system, &mut self.response);
            for part in 0..2 {
                let q: Vec<Pose> =
                    self.response.iter().map(|x| x.map(|c| if part == 0 { c.re } else { c.im })).collect();
                // rates are iω times displacements
                let v: Vec<Pose> = (self.response.iter())
                    .map(|x| x.map(|c| if part == 0 { -omega * c.im } else { omega * c.re }))
                    .collect();
                let volts = if part == 0 { &gap_row } else { &still };
                let warm: Vec<f64> = rise.iter().map(|r| r[part]).collect();
                for g in 0..gaps {
                    let dq = system.capacitance(g, view.q) * volts[g]
                        + system.capacitance_slope(g, view.q, &q) * view.volts[g];
                    for (row, &other) in self.ports.iter().enumerate() {
                        let y = &mut reply.admittance[row * ports + p];
                        // i = iω·dq
                        let current = omega * electrics.gap_rows[(g, other)] * dq;
                        if part == 0 { y[1] += current } else { y[0] -= current }
                    }
                }
                let change = View { q: &q, v: &v, rise: &warm, volts };
                for (row, signal) in self.signals.iter().enumerate() {
                    reply.outputs[row * ports + p][part] = signal.slope(compiled, &view, &change);
                }
            }
            for (row, &other) in self.ports.iter().enumerate() {
                reply.admittance[row * ports + p][0] += electrics.conductance[(other, port)];
            }
        }
        Ok(())
    }
}
