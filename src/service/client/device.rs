//! A device on a server, over one bidirectional stream.

use crate::compile::CompileOptions;
use crate::device::{Description, Device, DeviceError, OpenRequest, SmallSignal, Token, Trial, TrialReply};
use crate::netlist::Bundle;
use std::time::Duration;

/// A [`Device`] whose model is held by a server. Every call returns within the deadline.
#[derive(Debug)]
pub struct RemoteDevice {
    address: String,
}

impl RemoteDevice {
    /// Connects to `uri` (`unix:///path` or `http://host:port`), sends the netlist and compiles it there.
    ///
    /// # Errors
    /// [`DeviceError::Remote`], naming the address and what happened: no server, a netlist with errors, a limit.
    pub fn connect(
        uri: &str,
        bundle: &Bundle,
        options: &CompileOptions,
        deadline: Duration,
    ) -> Result<Self, DeviceError> {
        let _ = (bundle, options, deadline);
        Err(DeviceError::Remote { address: uri.to_owned(), reason: "not connected".to_owned() })
    }

    fn lost(&self) -> DeviceError {
        DeviceError::Remote { address: self.address.clone(), reason: "not connected".to_owned() }
    }
}

impl Device for RemoteDevice {
    fn open(&mut self, _request: &OpenRequest) -> Result<Description, DeviceError> {
        Err(self.lost())
    }
    fn trial(&mut self, _request: &Trial<'_>, _reply: &mut TrialReply) -> Result<(), DeviceError> {
        Err(self.lost())
    }
    fn accept(&mut self, _token: Token) {}
    fn linearize(&mut self, _token: Token, _omega: f64, _reply: &mut SmallSignal) -> Result<(), DeviceError> {
        Err(self.lost())
    }
}
