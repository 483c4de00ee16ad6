//! The calls that analyse a model, each bounded before anything is computed.

use super::chunks::{MessageSink, send_transient};
use super::limits::Limits;
use super::models::NamedModel;
use super::reply_size::bounded;
use super::shared::{BimorphService, Reply};
use super::status;
use super::work::{CancellingStream, guarded};
use bimorph_analysis::integrator::Integrator;
use bimorph_analysis::largest_motion::path_with_signals;
use bimorph_analysis::mesh;
use bimorph_analysis::mode_quality::mode_losses;
use bimorph_analysis::path_parameter::{PathModels, PathParameter};
use bimorph_analysis::statics::check_voltages;
use bimorph_analysis::transient::TransientOptions;
use bimorph_model::options::OptionValue;
use bimorph_model::options::analysis::{MODES_COUNT, PULL_IN_MAX, TRAN_POINTS, TRAN_RHO, TRAN_STEP, TRAN_STOP};
use bimorph_netlist::NetlistSource;
use bimorph_wire::convert::export::ExportReply;
use bimorph_wire::convert::path::PathReply;
use bimorph_wire::convert::{self, Violation, analysis as results};
use bimorph_wire::proto;
use std::sync::Arc;
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Response, Status};

/// A transient as it is computed.
pub(super) type TransientStream = CancellingStream<ReceiverStream<Result<proto::TransientEvent, Status>>>;

impl BimorphService {
    /// Finds a model, then computes on it.
    async fn analyse<T: Send + 'static>(
        &self,
        id: &str,
        job: impl Fn(&NamedModel) -> Result<T, Status> + Send + Sync + 'static,
    ) -> Reply<T> {
        let model = self.0.models.get(id)?;
        self.0.work.run(move || job(&model)).await.map(Response::new)
    }

    /// Static equilibrium, also of a mechanism with permanent strains after ports were raised once.
    pub(super) async fn statics(&self, request: proto::StaticRequest) -> Reply<proto::StaticResponse> {
        let voltages = voltages(request.voltages)?;
        let raised = convert::voltages("backbend", request.backbend).map_err(status::violation)?;
        let job = move |model: &NamedModel| {
            let compiled = &model.compiled;
            let (fitted, mut result, strains) = if raised.is_empty() {
                let (fitted, result, _) = mesh::static_fitted(compiled, &voltages).map_err(status::analysis)?;
                (fitted, result, Vec::new())
            } else {
                let refused = |error| status::analysis_of("backbend", error);
                check_voltages(compiled, &raised).map_err(refused)?;
                check_voltages(compiled, &voltages).map_err(status::analysis)?;
                let (fitted, result, _, strains) =
                    mesh::static_backbent(compiled, &raised, &voltages).map_err(refused)?;
                (fitted, result, strains)
            };
            result.warnings.extend(mesh::warnings(&fitted));
            Ok(results::static_to_wire(&result, &strains))
        };
        self.analyse(&request.model, job).await
    }

    /// Undamped modes.
    pub(super) async fn frequencies(&self, request: proto::ModesRequest) -> Reply<proto::ModesResponse> {
        let voltages = voltages(request.voltages)?;
        let count = if request.count == 0 { MODES_COUNT.count() } else { request.count as usize };
        if count > self.0.limits.modes {
            return Err(status::limit("modes", self.0.limits.modes, count));
        }
        let (most, quality) = (self.0.limits.mode_work, request.quality);
        let job = move |model: &NamedModel| {
            let work = model.unknowns().saturating_mul(count.saturating_mul(count));
            if work > most {
                return Err(status::limit("mode_work", most, work));
            }
            let (fitted, mut result, _) =
                mesh::modes_fitted(&model.compiled, count, &voltages).map_err(status::analysis)?;
            result.warnings.extend(mesh::warnings(&fitted));
            let mut answer = results::modes_to_wire(&result);
            if quality {
                let losses = mode_losses(&fitted, count, &voltages).map_err(status::analysis)?;
                answer.losses = losses.iter().map(results::mode_loss_to_wire).collect();
            }
            Ok(answer)
        };
        self.analyse(&request.model, job).await
    }

    /// Frequency response about an operating point.
    pub(super) async fn response(
        &self,
        request: proto::FrequencyResponseRequest,
    ) -> Reply<proto::FrequencyResponseReply> {
        let id = request.model.clone();
        count("signals", request.signals.len(), &self.0.limits)?;
        let options = convert::harmonic::request_from_wire(request).map_err(status::violation)?;
        options.check().map_err(status::analysis)?;
        let most = self.0.limits.message_bytes;
        let bytes = options.bytes();
        if bytes > most {
            return Err(status::limit("message_bytes", most, bytes));
        }
        let job = move |model: &NamedModel| {
            let (fitted, mut result) =
                mesh::harmonic_fitted(&model.compiled, &options, &mut |_| true).map_err(status::analysis)?;
            result.warnings.extend(mesh::warnings(&fitted));
            Ok(convert::harmonic::result_to_wire(&result))
        };
        self.analyse(&id, job).await
    }

    /// Pull-in and release.
    pub(super) async fn pulled_in(&self, request: proto::PullInRequest) -> Reply<proto::PullInResponse> {
        let max = request.max_v;
        convert::options::analysis(&PULL_IN_MAX, OptionValue::Number(max)).map_err(status::violation)?;
        let port = (!request.port.is_empty()).then_some(request.port);
        let job = move |model: &NamedModel| {
            let (fitted, mut result) =
                mesh::pull_in_fitted(&model.compiled, port.as_deref(), max).map_err(status::analysis)?;
            result.warnings.extend(mesh::warnings(&fitted));
            Ok(results::pull_in_to_wire(&result))
        };
        self.analyse(&request.model, job).await
    }

    /// Equilibrium path.
    pub(super) async fn traced(&self, request: proto::PathRequest) -> Reply<proto::PathResponse> {
        let id = request.model.clone();
        count("signals", request.signals.len(), &self.0.limits)?;
        let options = convert::path::request_from_wire(request).map_err(status::violation)?;
        let most = self.0.limits.message_bytes;
        let bytes = options.points.saturating_mul((options.signals.len().max(2) + 2) * size_of::<f64>());
        if bytes > most {
            return Err(status::limit("message_bytes", most, bytes));
        }
        let job = move |model: &NamedModel| {
            let compiled = &model.compiled;
            let parameter = PathParameter::find(compiled, &options.along)
                .map_err(|unknown| status::violation(Violation::new("along", unknown.to_string())))?;
            if parameter == PathParameter::Port {
                for (field, volts) in [("from", options.from), ("to", options.to)] {
                    let refused = |error| status::analysis_of(field, error);
                    check_voltages(compiled, &[(options.along.clone(), volts)]).map_err(refused)?;
                }
            }
            let models = PathModels::new(parameter, compiled, &options, || Ok(NetlistSource::new(&model.bundle)))
                .map_err(|error| status::compile(&error))?;
            let (first, input) = models.input(compiled, &options.along);
            let (fitted, mut result) =
                path_with_signals(first, &options.request(input), &mut |_| true).map_err(status::analysis)?;
            result.warnings.extend(mesh::warnings(&fitted));
            let estimated_error = fitted.order.estimated_error;
            let path = PathReply { result, unit: models.unit().to_owned(), estimated_error };
            Ok(convert::path::result_to_wire(&path))
        };
        self.analyse(&id, job).await
    }

    /// A model for other simulators.
    pub(super) async fn exported(&self, request: proto::ExportRequest) -> Reply<proto::ExportResponse> {
        let (id, limits) = (request.model.clone(), self.0.limits.clone());
        let asked = convert::export::request_from_wire(request).map_err(status::violation)?;
        if let Some(count) = asked.model.count.filter(|count| *count > limits.modes) {
            return Err(status::limit("modes", limits.modes, count));
        }
        let job = move |model: &NamedModel| {
            let compiled = &model.in_circuit;
            let ports = match asked.model.ports.len() {
                0 => compiled.parts.system.electrics.ports,
                ports => ports,
            };
            bounded(ports, asked.model.signals.len(), &limits)?;
            let file = asked.write(compiled, model.title()).map_err(status::export)?;
            if file.text.len() > limits.message_bytes {
                return Err(status::limit("message_bytes", limits.message_bytes, file.text.len()));
            }
            let estimated_error = compiled.order.estimated_error;
            Ok(convert::export::reply_to_wire(ExportReply { file, estimated_error }))
        };
        self.analyse(&id, job).await
    }

    /// Motion in time, streamed as it is computed.
    pub(super) async fn motion(&self, request: proto::TransientRequest) -> Reply<TransientStream> {
        let model = self.0.models.get(&request.model)?;
        let release = match request.release_model.as_str() {
            "" => None,
            id => Some(self.0.models.get(id)?),
        };
        let given = |about, value| convert::options::analysis(about, value).map_err(status::violation);
        let stop = request.stop_s;
        given(&TRAN_STOP, OptionValue::Number(stop))?;
        let tol = match request.tol {
            0.0 => model.compiled.options.errors().requested(),
            tol => convert::number("tol", tol, true).map_err(status::violation)?,
        };
        let points = if request.points == 0 { TRAN_POINTS.count() } else { request.points as usize };
        given(&TRAN_POINTS, OptionValue::Count(points))?;
        count("signals", request.signals.len(), &self.0.limits)?;
        count("events", request.events.len(), &self.0.limits)?;
        let values = points.saturating_mul(request.signals.len() + 1);
        if values > self.0.limits.transient_values {
            return Err(status::limit("transient_values", self.0.limits.transient_values, values));
        }
        let method = match request.method.as_str() {
            "" => Integrator::default(),
            name => Integrator::named(name).ok_or_else(|| {
                let expected = format!("expected one of {:?}, got \"{name}\"", Integrator::NAMES);
                status::violation(Violation::new("method", expected))
            })?,
        };
        let method = match (method, request.rho) {
            (Integrator::GeneralizedAlpha { .. }, Some(rho)) => {
                given(&TRAN_RHO, OptionValue::Number(rho))?;
                Integrator::GeneralizedAlpha { rho }
            }
            (_, Some(_)) => {
                return Err(status::violation(Violation::new("rho", "expected only with method generalized-alpha")));
            }
            (method, None) => method,
        };
        let step = match request.step_s {
            0.0 => None,
            step => {
                given(&TRAN_STEP, OptionValue::Number(step))?;
                Some(step)
            }
        };
        let events = convert::pairs(request.events);
        let until = request.until.map(convert::analysis::until).transpose().map_err(status::violation)?;
        let (signals, voltages) = (request.signals, voltages(request.voltages)?);
        let sending = self.sending()?;
        let place = self.0.work.place().await?;
        let budget = self.0.work.budget();
        let (outlet, receiver) = MessageSink::new(Arc::clone(&self.0));
        let outlet = outlet.with_place(place);
        let results = CancellingStream::new(ReceiverStream::new(receiver), budget.clone());
        let mut failed = outlet.also();
        tokio::task::spawn_blocking(move || {
            let _sending = sending;
            let job = || {
                let release = release.as_ref().map(|model| &*model.compiled);
                // the mesh, too, holds the tolerance of the run
                let sharper =
                    (tol < model.compiled.options.errors().requested()).then(|| model.compiled.with_tolerance(tol));
                let options = TransientOptions {
                    stop,
                    signals,
                    points,
                    tol,
                    voltages,
                    release,
                    method,
                    step,
                    events,
                    until,
                    keep: false,
                    ..TransientOptions::default()
                };
                send_transient(sharper.as_ref().unwrap_or(&model.compiled), &options, outlet);
                Ok(())
            };
            if let Err(status) = guarded(&budget, job) {
                failed.send(Err(status));
            }
        });
        Ok(Response::new(results))
    }
}

fn voltages(values: Vec<proto::Named>) -> Result<Vec<(String, f64)>, Status> {
    convert::voltages("voltages", values).map_err(status::violation)
}

/// Refuses a list that is longer than anyone needs, before anything is looked up for it.
pub(super) fn count(what: &str, got: usize, limits: &Limits) -> Result<(), Status> {
    if got > limits.signals { Err(status::limit(what, limits.signals, got)) } else { Ok(()) }
}
