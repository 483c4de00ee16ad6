//! The device in process: a compiled model stepped where the circuit runs.
use super::{Description, Device, DeviceError, OpenRequest, SmallSignal, Token, Trial, TrialReply};
use crate::compile::Compiled;
use std::sync::Arc;

/// A [`Device`] over a compiled model.
#[derive(Debug)]
pub struct LocalDevice {
    compiled: Arc<Compiled>,
}

impl LocalDevice {
    /// A device over a compiled model, not yet open.
    pub fn new(compiled: Arc<Compiled>) -> Self {
        Self { compiled }
    }

    /// The model.
    pub fn compiled(&self) -> &Arc<Compiled> {
        &self.compiled
    }
}

impl Device for LocalDevice {
    fn open(&mut self, _request: &OpenRequest) -> Result<Description, DeviceError> {
        Err(DeviceError::NotOpen)
    }
    fn trial(&mut self, _request: &Trial<'_>, _reply: &mut TrialReply) -> Result<(), DeviceError> {
        Err(DeviceError::NotOpen)
    }
    fn accept(&mut self, _token: Token) {}
    fn linearize(&mut self, _token: Token, _omega: f64, _reply: &mut SmallSignal) -> Result<(), DeviceError> {
        Err(DeviceError::NotOpen)
    }
}
