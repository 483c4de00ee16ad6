//! The device in process: a compiled model stepped where the circuit runs.
//!
//! A state is displacement, rate, heater rises and source voltages of one instant. A trial copies its parent, works on the
//! copy, and stores the result under a token that is a hash of the request: the same request always gives the same token
//! and the same bits, whatever was asked in between.

use super::contract::refused;
use super::quantities;
use super::session::DeviceSession;
use super::snapshot;
use super::{Description, Device, DeviceError, Mode, OpenRequest, SmallSignal, Status, Token, Trial, TrialReply};
use bimorph_analysis::readout::ports::check_ranges;
use bimorph_base::Diagnostic;
use bimorph_model::compile::CompiledModel;
use std::sync::Arc;

/// A [`Device`] over a compiled model.
#[derive(Debug)]
pub struct LocalDevice {
    compiled: Arc<CompiledModel>,
    session: Option<DeviceSession>,
}

impl LocalDevice {
    /// A device over a compiled model, not yet open.
    pub fn new(compiled: Arc<CompiledModel>) -> Self {
        Self { compiled, session: None }
    }

    /// The model.
    pub fn compiled(&self) -> &Arc<CompiledModel> {
        &self.compiled
    }

    /// Bytes that the open session's states take, about.
    pub fn state_bytes(&self) -> usize {
        self.session.as_ref().map_or(0, |s| s.states.bytes())
    }
}

impl Device for LocalDevice {
    fn open(&mut self, request: &OpenRequest) -> Result<Description, DeviceError> {
        // before a reduced model is trained
        check_ranges(&self.compiled, &request.ports)?;
        let (session, description) = DeviceSession::open(&self.compiled, request, None)?;
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

    fn warns(&mut self, token: Token) -> Vec<Diagnostic> {
        let Some(session) = self.session.as_mut() else { return Vec::new() };
        let Some(state) = session.states.get(token) else { return Vec::new() };
        session.warns(&self.compiled, &state)
    }

    fn linearize(&mut self, token: Token, omega: f64, reply: &mut SmallSignal) -> Result<(), DeviceError> {
        let session = self.session.as_mut().ok_or(DeviceError::NotOpen)?;
        let state = session.about(token, omega)?;
        session.respond(&self.compiled, token, &state, omega, reply)
    }

    fn names(&self) -> Vec<String> {
        quantities::names(&self.compiled)
    }

    fn read_quantity(&mut self, token: Token, name: &str) -> Result<f64, DeviceError> {
        let session = self.session.as_mut().ok_or(DeviceError::NotOpen)?;
        let state = session.states.get(token).ok_or(DeviceError::UnknownToken(token))?;
        session.read_quantity(&self.compiled, &state, name)
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
                Ok(snapshot::write(&session.opened, &alone, session.tag()))
            }
            None => Ok(snapshot::write(&session.opened, &session.states, session.tag())),
        }
    }

    fn parent(&self, token: Token) -> Option<Token> {
        self.session.as_ref()?.states.parent(token)
    }

    fn load(&mut self, bytes: &[u8]) -> Result<Description, DeviceError> {
        let (opened, states, tag) = snapshot::read(bytes)?;
        let known = self.session.as_ref().filter(|session| session.opened.ports == opened.ports);
        let known = known.and_then(DeviceSession::reduced_model).cloned();
        let (mut session, description) = DeviceSession::open(&self.compiled, &opened, known.as_ref())?;
        if session.tag() != tag {
            return Err(refused("states of this formulation", "states of another one, or of another reduced model"));
        }
        if !states.in_order().all(|(_, _, state)| session.fits(state)) {
            return Err(refused("states of this model", "states of another one"));
        }
        session.states = states;
        self.session = Some(session);
        Ok(description)
    }

    fn recover(&mut self) {
        // a state is stored whole or not at all; all else is storage that every trial fills again
        let Some(mut session) = self.session.take() else { return };
        let known = session.reduced_model().cloned();
        self.session =
            DeviceSession::open(&self.compiled, &session.opened, known.as_ref()).ok().map(|(mut fresh, _)| {
                fresh.continues(&mut session);
                DeviceSession { states: std::mem::take(&mut session.states), ..fresh }
            });
    }
}
