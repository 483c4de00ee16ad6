//! Analyses and sweeps on a server.

use crate::analysis::modes::ModesResult;
use crate::analysis::pull_in::PullInResult;
use crate::analysis::statics::StaticResult;
use crate::analysis::transient::TransientResult;
use crate::analysis::{PortVoltages, Watch};
use crate::compile::CompileOptions;
use crate::jobs::sweep::{SweepProgress, SweepSpec, SweepTable};
use crate::netlist::Bundle;
use std::time::Duration;
use thiserror::Error;

/// A blocking client of one server, for whole analyses.
#[derive(Debug)]
pub struct Client {
    address: String,
}

/// What went wrong on the way, or on the server.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("server {address}: {message}")]
pub struct ClientError {
    /// Address as given.
    pub address: String,
    /// gRPC status code as text: "InvalidArgument", "Unavailable", ….
    pub code: String,
    /// What happened; for a netlist, the rendered diagnostics.
    pub message: String,
}

/// A transient on a server; the fields of [`crate::analysis::transient::TransientOptions`], with the initial state
/// named by a model id.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RemoteTransient {
    /// End time [s].
    pub stop: f64,
    /// Names of the signals wanted.
    pub signals: Vec<String>,
    /// Number of equally spaced output times.
    pub points: usize,
    /// Relative error of a step [1].
    pub tol: f64,
    /// Voltages held during the run, by port name [V].
    pub voltages: Vec<(String, f64)>,
    /// Model whose static equilibrium is the initial state; none: at rest as drawn.
    pub release: Option<String>,
}

impl Client {
    /// Connects to `uri`. `deadline` bounds the connection and each unary call.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn connect(uri: &str, deadline: Duration) -> Result<Self, ClientError> {
        let _ = deadline;
        Err(Self { address: uri.to_owned() }.lost())
    }

    /// Compiles a netlist there; returns the model's id.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn compile(&mut self, bundle: &Bundle, options: &CompileOptions) -> Result<String, ClientError> {
        let _ = (bundle, options);
        Err(self.lost())
    }

    /// Static equilibrium.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn statics(&mut self, model: &str, voltages: &PortVoltages) -> Result<StaticResult, ClientError> {
        let _ = (model, voltages);
        Err(self.lost())
    }

    /// Natural frequencies.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn modes(&mut self, model: &str, count: usize, voltages: &PortVoltages) -> Result<ModesResult, ClientError> {
        let _ = (model, count, voltages);
        Err(self.lost())
    }

    /// Pull-in and release.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn pull_in(&mut self, model: &str, port: Option<&str>, max: f64) -> Result<PullInResult, ClientError> {
        let _ = (model, port, max);
        Err(self.lost())
    }

    /// Motion in time; `watch` is told how far it has come and may stop it.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn transient(
        &mut self,
        model: &str,
        options: &RemoteTransient,
        watch: Watch<'_>,
    ) -> Result<TransientResult, ClientError> {
        let _ = (model, options, watch);
        Err(self.lost())
    }

    /// A sweep; `progress` is told how far it has come and may stop it.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn sweep(
        &mut self,
        spec: &SweepSpec,
        bundle: &Bundle,
        options: &CompileOptions,
        progress: &mut dyn FnMut(SweepProgress) -> bool,
    ) -> Result<SweepTable, ClientError> {
        let _ = (spec, bundle, options, progress);
        Err(self.lost())
    }

    fn lost(&self) -> ClientError {
        ClientError { address: self.address.clone(), code: "Unavailable".into(), message: "not connected".into() }
    }
}
