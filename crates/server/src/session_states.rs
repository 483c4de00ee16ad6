//! The states of a session as sealed bytes, and back, and the memory that its device takes.

use super::limits::Limits;
use super::reply_size::bounded;
use super::session::Session;
use super::snapshots;
use super::status;
use bimorph_device::Token;
use bimorph_wire::convert::device as wire;
use bimorph_wire::proto;
use std::sync::PoisonError;
use tonic::Status;

impl Session {
    /// Charges the memory of a device with so many ports to the account of the client that opened it.
    pub(super) fn take_memory(&self, ports: usize) -> Result<(), Status> {
        let mut seat = self.seat.lock().unwrap_or_else(PoisonError::into_inner);
        seat.as_mut().map_or(Ok(()), |seat| seat.open(ports))
    }

    /// Its states as a sealed snapshot.
    pub(super) fn snapshot(&self, only: Option<Token>) -> Result<Vec<u8>, Status> {
        self.usage.touch();
        let states =
            self.lock()?.save(only.as_ref().map(std::slice::from_ref)).map_err(|error| status::device(&error))?;
        Ok(snapshots::seal(self.model().id(), &states))
    }

    /// Starts with the states of a sealed snapshot.
    pub(super) fn restore(&self, sealed: &[u8], limits: &Limits) -> Result<proto::OpenResponse, Status> {
        let states = snapshots::open(self.model().id(), sealed)?;
        let described = self.lock()?.load(states).map_err(|error| status::device(&error))?;
        bounded(described.ports.len(), described.signals.len(), limits)?;
        self.take_memory(described.ports.len())?;
        *self.description.lock().unwrap_or_else(PoisonError::into_inner) = wire::description_to_wire(&described);
        Ok(self.opened())
    }
}
