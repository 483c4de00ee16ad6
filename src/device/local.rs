//! The device in process: a compiled model stepped where the circuit runs.
//!
//! A state is displacement, rate, heater rises and source voltages of one instant. A trial copies its parent, works on the
//! copy, and stores the result under a token that is a hash of the request: the same request always gives the same token
//! and the same bits, whatever was asked in between.

use super::agitation::Shaken;
use super::look;
use super::noise::{Seen, surroundings};
use super::ports::Ports;
use super::saved;
use super::states::{Snapshot, States};
use super::{
    Description, Device, DeviceError, Mode, OpenRequest, PortInfo, PortKind, SignalInfo, SmallSignal, Status, Token,
    Trial, TrialReply,
};
use crate::analysis::signal::Signal;
use crate::analysis::transient::first_step;
use crate::budget;
use crate::compile::Compiled;
use crate::gaps::drive::Electrics;
use crate::gaps::{Drive, System};
use crate::multibody::BlockMatrix;
use crate::multibody::planar::Pose;
use crate::solve::equilibrium::{Equilibrium, EquilibriumOptions};
use crate::solve::harmonic::{ComplexPose, Harmonic};
use crate::solve::time::adaptive::Adaptive;
use crate::solve::time::formulated::Formulated;
use crate::solve::time::method::Motion;
use std::sync::Arc;

/// A [`Device`] over a compiled model.
#[derive(Debug)]
pub struct LocalDevice {
    compiled: Arc<Compiled>,
    session: Option<Session>,
}

/// What is open: the choice of ports and signals, the states, and the storage that every trial reuses.
#[derive(Debug)]
pub(super) struct Session {
    /// What it was opened with.
    opened: OpenRequest,
    pub(super) ports: Ports,
    pub(super) signals: Vec<Signal>,
    pub(super) states: States,
    pub(super) first_step: f64,
    pub(super) equilibrium: Equilibrium,
    /// Thermal agitation, if it was asked for.
    pub(super) shaken: Option<Shaken>,
    /// Carries ∂motion/∂(final voltage), one for each opened port.
    pub(super) stepper: Adaptive<Formulated>,
    pub(super) motion: Motion,
    pub(super) rise: Vec<f64>,
    pub(super) rise_slope: Vec<f64>,
    pub(super) sources: Vec<f64>,
    pub(super) unit: Vec<f64>,
    pub(super) drive: Drive,
    pub(super) change: Drive,
    pub(super) zeros: Vec<Pose>,
    pub(super) linear: Option<(Token, BlockMatrix<f64, 3>)>,
    pub(super) harmonic: Harmonic,
    /// What each answer sees of a displacement, about the state that was asked for its noise last.
    pub(super) seen: Option<(Token, Vec<Seen>)>,
    pub(super) response: Vec<ComplexPose>,
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
        let state = session.about(token, omega)?;
        session.respond(&self.compiled, token, &state, omega, reply)
    }

    fn names(&self) -> Vec<String> {
        look::names(&self.compiled)
    }

    fn look(&mut self, token: Token, name: &str) -> Result<f64, DeviceError> {
        let session = self.session.as_mut().ok_or(DeviceError::NotOpen)?;
        let state = session.states.get(token).ok_or(DeviceError::UnknownToken(token))?;
        session.look(&self.compiled, &state, name)
    }

    fn noise(&mut self, token: Token, omega: f64, reply: &mut Vec<[f64; 2]>) -> Result<(), DeviceError> {
        let session = self.session.as_mut().ok_or(DeviceError::NotOpen)?;
        let state = session.about(token, omega)?;
        session.noise(&self.compiled, (token, &state), omega, reply)
    }

    fn save(&self, only: Option<&[Token]>) -> Result<Vec<u8>, DeviceError> {
        let session = self.session.as_ref().ok_or(DeviceError::NotOpen)?;
        match only {
            Some(tokens) => {
                let alone = session.states.only(tokens).map_err(DeviceError::UnknownToken)?;
                Ok(saved::write(&session.opened, &alone))
            }
            None => Ok(saved::write(&session.opened, &session.states)),
        }
    }

    fn parent(&self, token: Token) -> Option<Token> {
        self.session.as_ref()?.states.parent(token)
    }

    fn load(&mut self, bytes: &[u8]) -> Result<Description, DeviceError> {
        let (opened, states) = saved::read(bytes)?;
        let (mut session, description) = Session::open(&self.compiled, &opened)?;
        if !states.in_order().all(|(_, _, state)| session.fits(state)) {
            return Err(saved::refused("states of this model", "states of another one"));
        }
        session.states = states;
        self.session = Some(session);
        Ok(description)
    }

    fn recover(&mut self) {
        // a state is stored whole or not at all; all else is storage that every trial fills again
        let Some(mut session) = self.session.take() else { return };
        self.session = Session::open(&self.compiled, &session.opened)
            .ok()
            .map(|(fresh, _)| Session { states: std::mem::take(&mut session.states), ..fresh });
    }
}

impl Session {
    fn open(compiled: &Compiled, request: &OpenRequest) -> Result<(Self, Description), DeviceError> {
        let ports = Ports::find(compiled, &request.ports)?;
        let own = ports.system.clone();
        let system = own.as_deref().unwrap_or(&compiled.parts.system);
        let electrics = &system.electrics;
        let signals: Vec<Signal> = (request.signals.iter())
            .map(|name| {
                budget::check();
                Signal::find(compiled, name)
                    .map_err(|e| DeviceError::UnknownSignal { name: name.clone(), hint: e.to_string() })
            })
            .collect::<Result<_, _>>()?;
        let description = Description {
            ports: if request.ports.is_empty() {
                let name = |&source: &usize| electrics.names[source].clone();
                ports.sources.iter().map(|p| PortInfo { name: name(p), kind: PortKind::Electrical }).collect()
            } else {
                let kinds = request.ports.iter().zip(&ports.kinds);
                kinds.map(|(name, &kind)| PortInfo { name: name.clone(), kind }).collect()
            },
            signals: (request.signals.iter().zip(&signals))
                .map(|(name, s)| SignalInfo { name: name.clone(), unit: s.unit().into() })
                .collect(),
            unknowns: compiled.unknowns(),
        };
        let n = system.bodies();
        // each port carries its sensitivity, and matrices of ports and signals go with every reply
        budget::lay_out_matrix(ports.len(), 12 * n + 4 * ports.len() + 2 * signals.len());
        let heaters = electrics.heating.heaters.len();
        let first_step = first_step(system, f64::INFINITY);
        let joints = match &compiled.joints {
            Some(Ok(joints)) => Some(ports.joints(joints)),
            Some(Err(unfit)) => {
                return Err(DeviceError::BadRequest {
                    what: "formulation",
                    expected: format!("one that suits this mechanism ({unfit})"),
                    got: compiled.options.formulation.name().into(),
                });
            }
            None => None,
        };
        let shaken = match &request.noise {
            Some(noise) => Some(Shaken::new(noise, compiled, surroundings(compiled))?),
            None => None,
        };
        let session = Self {
            opened: request.clone(),
            shaken,
            stepper: Adaptive::new(system, Formulated::new(system, joints.as_ref(), first_step, &ports.sources)),
            ports,
            signals,
            states: States::default(),
            first_step,
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
            seen: None,
            response: vec![ComplexPose::zeros(); n],
        };
        Ok((session, description))
    }

    /// Whether a state has the sizes and the sense that one of this session has.
    fn fits(&self, state: &Snapshot) -> bool {
        let n = self.zeros.len();
        let poses = |poses: &[Pose]| poses.len() == n && poses.iter().all(|p| p.iter().all(|x| x.is_finite()));
        let numbers = |numbers: &[f64], count: usize| numbers.len() == count && numbers.iter().all(|x| x.is_finite());
        let carried = self.stepper.method.state();
        let alike = |(a, b): (&Motion, &Motion)| a.q.len() == b.q.len() && a.v.len() == b.v.len();
        let followed = state.shown.followed();
        poses(&state.q)
            && poses(&state.v)
            && numbers(&state.rise, self.rise.len())
            && numbers(&state.sources, self.sources.len())
            && state.next_step > 0.0
            && state.elapsed >= 0.0
            && (followed == 0 || followed == self.signals.len() + self.ports.len())
            && (state.carried.is_empty()
                || state.carried.len() == carried.len() && state.carried.iter().zip(carried).all(alike))
    }

    /// The state that a small signal is about.
    fn about(&mut self, token: Token, omega: f64) -> Result<Arc<Snapshot>, DeviceError> {
        if !omega.is_finite() || omega < 0.0 {
            return Err(DeviceError::BadRequest {
                what: "omega",
                expected: "a finite angular frequency of at least 0 rad/s".into(),
                got: omega.to_string(),
            });
        }
        self.states.get(token).ok_or(DeviceError::UnknownToken(token))
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
                expected: "finite numbers".into(),
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

    /// The model as it was opened, with the inputs among its ports.
    pub(super) fn system<'a>(own: &'a Option<Arc<System>>, compiled: &'a Compiled) -> &'a System {
        own.as_deref().unwrap_or(&compiled.parts.system)
    }

    /// Fills in the source vector: opened ports as asked, the others at 0, the netlist's own sources.
    pub(super) fn fill_sources(&mut self, electrics: &Electrics, given: &[f64]) {
        self.sources.fill(0.0);
        self.sources[electrics.ports..electrics.voltages()].copy_from_slice(&electrics.fixed);
        for (&port, &value) in self.ports.sources.iter().zip(given) {
            self.sources[port] = value;
        }
    }
}
