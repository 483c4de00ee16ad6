//! Analyses on a server.

use super::link::{ServerLink, is_broken, reason, unexpected};
use super::reply_checks;
use crate::convert::export::{self as exports, ExportReply};
use crate::convert::path::{self as paths, PathReply};
use crate::convert::{analysis as results, harmonic as harmonics, named, pairs};
use crate::credentials::Access;
use crate::proto;
use bimorph_analysis::backbending::Strains;
use bimorph_analysis::harmonic::{HarmonicOptions, HarmonicResult};
use bimorph_analysis::integrator::Integrator;
use bimorph_analysis::modes::ModesResult;
use bimorph_analysis::path_parameter::PathOptions;
use bimorph_analysis::pull_in::PullInResult;
use bimorph_analysis::statics::StaticResult;
use bimorph_analysis::transient::{TransientResult, Until};
use bimorph_analysis::{PortVoltages, ProgressCallback};
use bimorph_base::Bundle;
use bimorph_export::file::FileRequest;
use bimorph_model::compile::CompileOptions;
use proto::transient_event::Kind as EventKind;
use std::future::Future;
use std::time::Duration;
use thiserror::Error;
use tonic::{Code, Response, Status, Streaming};

/// A blocking client of one server, for whole analyses.
#[derive(Debug)]
pub struct Client {
    pub(super) address: String,
    access: Access,
    pub(super) link: ServerLink,
}

/// Error on the connection or on the server.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("server {address}: {message}")]
pub struct ClientError {
    /// Address as given.
    pub address: String,
    /// gRPC status code as text: "InvalidArgument", "Unavailable", ….
    pub code: String,
    /// The message; for a netlist, the rendered diagnostics.
    pub message: String,
}

/// A transient on a server; the fields of [`bimorph_analysis::transient::TransientOptions`], with the initial state
/// named by a model id.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RemoteTransient {
    /// End time (s).
    pub stop: f64,
    /// Names of the signals wanted.
    pub signals: Vec<String>,
    /// Number of equally spaced output times.
    pub points: usize,
    /// Relative error of a step (1).
    pub tol: f64,
    /// Voltages held during the run, by port name (V).
    pub voltages: Vec<(String, f64)>,
    /// Model whose static equilibrium is the initial state; none: at rest as drawn.
    pub release: Option<String>,
    /// The integrator.
    pub method: Integrator,
    /// Length of equal steps (s); none: steps follow `tol`.
    pub step: Option<f64>,
    /// Crossings to find: (signal name, level in the signal's unit).
    pub events: Vec<(String, f64)>,
    /// Condition that ends the run early.
    pub until: Option<Until>,
}

impl Client {
    /// Connects to `uri` (`unix:///path`, `host:port`, `http://host:port`, `grpc://host:port`, `https://host:port`), showing
    /// what the environment says ([`Access::from_environment`]). `deadline` bounds the connection, each unary call, and
    /// the silence between two messages of a stream.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn connect(uri: &str, deadline: Duration) -> Result<Self, ClientError> {
        Self::connect_with(uri, &Access::from_environment(), deadline)
    }

    /// The same, showing `access`.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn connect_with(uri: &str, access: &Access, deadline: Duration) -> Result<Self, ClientError> {
        let link = ServerLink::connect(uri, access, deadline).map_err(|status| error(uri, &status))?;
        Ok(Self { address: uri.to_owned(), access: access.clone(), link })
    }

    /// Opens a new connection; a connection without traffic may stay silent for ever.
    pub(super) fn reconnect(&mut self) -> Result<(), ClientError> {
        self.link = ServerLink::connect(&self.address, &self.access, self.link.deadline)
            .map_err(|status| self.error(&status))?;
        Ok(())
    }

    /// Version of the server.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn version(&mut self) -> Result<String, ClientError> {
        let mut rpc = self.link.rpc.clone();
        Ok(self.call(rpc.info(proto::InfoRequest {}))?.version)
    }

    /// Compiles a netlist there; returns the model's id.
    ///
    /// # Errors
    /// [`ClientError`]; for a netlist with errors the message is all of its diagnostics.
    pub fn compile(&mut self, bundle: &Bundle, options: &CompileOptions) -> Result<String, ClientError> {
        self.link.compile(bundle, options).map(|model| model.id).map_err(|status| error(&self.address, &status))
    }

    /// Static equilibrium.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn statics(&mut self, model: &str, voltages: &PortVoltages) -> Result<StaticResult, ClientError> {
        self.statics_backbent(model, &[], voltages).map(|(result, _)| result)
    }

    /// Static equilibrium after the ports were raised once to `raised`, with the permanent strain of each beam that can yield (1).
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn statics_backbent(
        &mut self,
        model: &str,
        raised: &PortVoltages,
        voltages: &PortVoltages,
    ) -> Result<(StaticResult, Strains), ClientError> {
        let (voltages, backbend) = (named(voltages), named(raised));
        let request = proto::StaticRequest { model: model.to_owned(), voltages, backbend };
        let mut rpc = self.link.rpc.clone();
        let mut reply = self.call(rpc.r#static(request))?;
        self.checked(reply_checks::statics(&reply))?;
        let strains = pairs(std::mem::take(&mut reply.permanent_strains));
        Ok((results::static_from_wire(reply), strains))
    }

    /// Natural frequencies; `count` 0: six.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn modes(&mut self, model: &str, count: usize, voltages: &PortVoltages) -> Result<ModesResult, ClientError> {
        let count = u32::try_from(count).unwrap_or(u32::MAX);
        let request = proto::ModesRequest { model: model.to_owned(), count, voltages: named(voltages), quality: false };
        let mut rpc = self.link.rpc.clone();
        let reply = self.call(rpc.modes(request))?;
        self.checked(reply_checks::modes(&reply))?;
        Ok(results::modes_from_wire(reply))
    }

    /// Frequency response.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn frequency_response(
        &mut self,
        model: &str,
        options: &HarmonicOptions,
    ) -> Result<HarmonicResult, ClientError> {
        let request = harmonics::request_to_wire(model, options);
        let mut rpc = self.link.rpc.clone();
        let reply = self.call(rpc.frequency_response(request))?;
        self.checked(reply_checks::response(&options.signals, &reply))?;
        Ok(harmonics::result_from_wire(&options.drive, reply))
    }

    /// Pull-in and release.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn pull_in(&mut self, model: &str, port: Option<&str>, max: f64) -> Result<PullInResult, ClientError> {
        let port = port.unwrap_or_default().to_owned();
        let request = proto::PullInRequest { model: model.to_owned(), port, max_v: max };
        let mut rpc = self.link.rpc.clone();
        self.call(rpc.pull_in(request)).map(results::pull_in_from_wire)
    }

    /// Equilibrium path.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn path(&mut self, model: &str, options: &PathOptions) -> Result<PathReply, ClientError> {
        let mut rpc = self.link.rpc.clone();
        let reply = self.call(rpc.path(paths::request_to_wire(model, options)))?;
        self.checked(reply_checks::path(&options.signals, &reply))?;
        Ok(paths::result_from_wire(reply))
    }

    /// A model for other simulators.
    ///
    /// # Errors
    /// [`ClientError`].
    pub fn export(&mut self, model: &str, request: &FileRequest) -> Result<ExportReply, ClientError> {
        let mut rpc = self.link.rpc.clone();
        let reply = self.call(rpc.export(exports::request_to_wire(model, request)))?;
        self.checked(reply_checks::export(&reply))?;
        exports::reply_from_wire(reply).map_err(|violation| self.error(&unexpected(&violation.description)))
    }

    /// Transient analysis; `watch` receives the progress and may cancel it.
    ///
    /// # Errors
    /// [`ClientError`]; code "Cancelled" when `watch` stopped it.
    pub fn transient(
        &mut self,
        model: &str,
        options: &RemoteTransient,
        watch: ProgressCallback<'_>,
    ) -> Result<TransientResult, ClientError> {
        let request = proto::TransientRequest {
            model: model.to_owned(),
            stop_s: options.stop,
            signals: options.signals.clone(),
            points: u32::try_from(options.points).unwrap_or(u32::MAX),
            tol: options.tol,
            voltages: named(&options.voltages),
            release_model: options.release.clone().unwrap_or_default(),
            method: options.method.name().to_owned(),
            rho: match options.method {
                Integrator::GeneralizedAlpha { rho } => Some(rho),
                _ => None,
            },
            step_s: options.step.unwrap_or_default(),
            events: named(&options.events),
            until: options.until.as_ref().map(results::until_to_wire),
        };
        let mut rpc = self.link.rpc.clone();
        let mut events = self.call(rpc.transient(request))?;
        let (mut t, mut columns) = (Vec::new(), vec![Vec::new(); options.signals.len()]);
        while let Some(event) = self.next(&mut events)? {
            match event.kind {
                Some(EventKind::Samples(samples)) => {
                    let last = t.last().copied().unwrap_or(f64::NEG_INFINITY);
                    self.checked(reply_checks::samples(last, columns.len(), &samples))?;
                    t.extend(samples.t);
                    for (column, more) in columns.iter_mut().zip(samples.signals) {
                        column.extend(more.values);
                    }
                }
                Some(EventKind::Finished(summary)) => {
                    return Ok(results::transient_from_wire(&options.signals, t, columns, summary));
                }
                None => {}
            }
            if !watch(event.progress) {
                return Err(self.error(&Status::cancelled("stopped here")));
            }
        }
        Err(self.error(&Status::unavailable("the stream ended before the run did")))
    }

    /// Content of a checked reply.
    fn checked(&self, found: Result<(), String>) -> Result<(), ClientError> {
        found.map_err(|what| self.error(&unexpected(&what)))
    }

    pub(super) fn call<T>(&self, call: impl Future<Output = Result<Response<T>, Status>>) -> Result<T, ClientError> {
        self.link.call(call).map(Response::into_inner).map_err(|status| self.error(&status))
    }

    pub(super) fn next<T>(&self, stream: &mut Streaming<T>) -> Result<Option<T>, ClientError> {
        self.link.call(stream.message()).map_err(|status| self.error(&status))
    }

    pub(super) fn error(&self, status: &Status) -> ClientError {
        error(&self.address, status)
    }
}

fn error(address: &str, status: &Status) -> ClientError {
    // what a broken connection is called depends on the moment at which it broke
    let code = if is_broken(status) { Code::Unavailable } else { status.code() };
    ClientError { address: address.to_owned(), code: format!("{code:?}"), message: reason(status) }
}
