//! Runs the service: listen, serve, drain, stop.

use super::accounts::Accounts;
use super::admission::counters::AdmissionCounters;
use super::admission::service::AdmissionService;
use super::authentication::Guard;
use super::connection::Connections;
use super::descriptors;
use super::jobs::registry::JobRegistry;
use super::limits::Limits;
use super::models::ModelCache;
use super::monitoring::http;
use super::monitoring::report::{MonitoringState, busy};
pub use super::serve_options::{MakeDevice, Ready, ServeError, ServeOptions};
use super::sessions::SessionRegistry;
use super::shared::{BimorphService, ServerState};
use super::shutdown::{BoxedWait, GRACE, Shutdown};
use super::sockets::Listener;
use super::store::SessionStore;
use super::store::scan::StoreError;
use super::work::ComputePermits;
use bimorph_device::local::LocalDevice;
use bimorph_wire::address::Address;
use bimorph_wire::proto::{DESCRIPTORS, ServerSetting, bimorph_server::BimorphServer};
use std::future::Future;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::TcpListener;
use tokio::sync::{Notify, Semaphore, mpsc};
use tokio_stream::wrappers::ReceiverStream;
use tonic::transport::Server;
use tonic_health::ServingStatus;
use tonic_health::server::HealthReporter;

/// Bytes that a client may send ahead of what was read, over all streams of its connection.
const CONNECTION_WINDOW: u32 = 256 << 10;
/// Name of the readiness state in the health service.
const READY: &str = "ready";
/// Interval of readiness checks.
const LOOK: Duration = Duration::from_millis(250);

/// Serves until `shutdown` resolves, then drains for [`Limits::drain`] and cuts what is left.
///
/// # Errors
/// [`ServeError`]; a clean stop is `Ok`.
pub async fn run(options: ServeOptions, shutdown: impl Future<Output = ()> + Send) -> Result<(), ServeError> {
    serve(options, |compiled| Box::new(LocalDevice::new(compiled)), Box::pin(shutdown)).await
}

/// [`run`] with devices of another make: a measuring or a faulty one, say.
///
/// # Errors
/// [`ServeError`].
pub async fn run_with(
    options: ServeOptions,
    make: MakeDevice,
    shutdown: impl Future<Output = ()> + Send,
) -> Result<(), ServeError> {
    serve(options, make, Box::pin(shutdown)).await
}

/// [`run_with`], compiled once, here: the service of every program that runs one.
fn serve(
    options: ServeOptions,
    make: MakeDevice,
    shutdown: BoxedWait<'_, ()>,
) -> BoxedWait<'_, Result<(), ServeError>> {
    Box::pin(serve_until(options, make, shutdown))
}

async fn serve_until(options: ServeOptions, make: MakeDevice, shutdown: BoxedWait<'_, ()>) -> Result<(), ServeError> {
    let ServeOptions {
        listen,
        guard,
        insecure,
        limits,
        metrics,
        log_json: _,
        state_dir,
        state_unsynced,
        settings,
        ready,
        while_stdin: _,
        reload,
    } = options;
    let limits = descriptors::within(limits);
    if listen.is_empty() {
        return Err(ServeError::NoAddress);
    }
    let guard = Arc::new(Guard::read(&guard)?);
    let open = |folder| SessionStore::open(folder, !state_unsynced, limits.state_bytes);
    let store = state_dir.as_deref().map(open).transpose()?.map(Arc::new);
    let (listeners, overseer, bound) = open_all(&listen, metrics.as_ref(), insecure, &guard).await?;
    let signals = Shutdown::default();
    let (sender, incoming) = mpsc::channel(16);
    let connections = Arc::new(Connections::new(&limits, &signals.cutting));
    let mut accepting = tokio::task::JoinSet::new();
    for listener in listeners {
        accepting.spawn(listener.accept(Arc::clone(&connections), Arc::clone(&guard), signals.clone(), sender.clone()));
    }
    drop(sender);
    let rereading = tokio::spawn(reread(Arc::clone(&guard), reload));

    let reported = settings.map(|settings| settings.reported()).unwrap_or_default();
    let shared = share(limits, reported, (make, store, connections), &signals);
    wake(&shared, state_dir)?;
    let calls = BimorphServer::new(BimorphService(Arc::clone(&shared)))
        .max_decoding_message_size(shared.limits.message_bytes)
        .max_encoding_message_size(shared.limits.message_bytes);
    let (health, health_service) = tonic_health::server::health_reporter();
    health.set_serving::<BimorphServer<BimorphService>>().await;
    let reflection = || {
        tonic_reflection::server::Builder::configure()
            .register_encoded_file_descriptor_set(DESCRIPTORS)
            .register_encoded_file_descriptor_set(tonic_health::pb::FILE_DESCRIPTOR_SET)
    };
    let gate = AdmissionCounters::new(&shared.limits, guard, Arc::clone(&shared.metrics), &shared.accounts);
    let reflection = |error: &dyn Fn(&dyn std::error::Error) -> ServeError| {
        let v1 = reflection().build_v1().map_err(|e| error(&e))?;
        let v1alpha = reflection().build_v1alpha().map_err(|e| error(&e))?;
        Ok::<_, ServeError>((AdmissionService::new(v1, &gate), AdmissionService::new(v1alpha, &gate)))
    };
    let transport = |error: &dyn std::error::Error| ServeError::Transport(with_sources(error));
    let (v1, v1alpha) = reflection(&transport)?;
    let mut serving = std::pin::pin!(
        Server::builder()
            .max_concurrent_streams(u32::try_from(shared.limits.streams_per_connection).unwrap_or(u32::MAX))
            .initial_connection_window_size(CONNECTION_WINDOW)
            .add_service(AdmissionService::new(calls, &gate))
            .add_service(AdmissionService::new(health_service, &gate))
            .add_service(v1)
            .add_service(v1alpha)
            .serve_with_incoming_shutdown(ReceiverStream::new(incoming), signals.draining.clone().cancelled_owned())
    );
    let housekeeping = tokio::spawn(keep_house(Arc::clone(&shared)));
    let overseen = MonitoringState { shared: Arc::clone(&shared), gate };
    let watching = tokio::spawn(watch_over(health.clone(), overseen.clone()));
    let overseer = overseer.map(|listener| tokio::spawn(http::answer(listener, overseen)));
    ready(&bound);

    let served = tokio::select! {
        served = &mut serving => Some(served),
        () = shutdown => None,
    };
    watching.abort();
    health.set_not_serving::<BimorphServer<BimorphService>>().await;
    for name in ["", READY] {
        health.set_service_status(name, ServingStatus::NotServing).await;
    }
    tracing::info!(open = shared.sessions.len(), "stopping");
    signals.draining.cancel();
    shared.jobs.suspend();
    while accepting.join_next().await.is_some() {}
    let mut ended = served;
    for (signal, wait) in [(&signals.ending, shared.limits.drain), (&signals.cutting, GRACE)] {
        if ended.is_none() {
            ended = tokio::time::timeout(wait, &mut serving).await.ok();
        }
        signal.cancel();
    }
    if ended.is_none() {
        tracing::warn!("some clients did not disconnect; their connections are cut");
        ended = tokio::time::timeout(GRACE, &mut serving).await.ok();
    }
    shared.jobs.release(GRACE).await;
    housekeeping.abort();
    rereading.abort();
    overseer.iter().for_each(tokio::task::JoinHandle::abort);
    ended.unwrap_or(Ok(())).map_err(|error| transport(&error))
}

/// Reads tokens and certificates again, on request.
async fn reread(guard: Arc<Guard>, reload: Arc<Notify>) {
    loop {
        reload.notified().await;
        let guard = Arc::clone(&guard);
        match tokio::task::spawn_blocking(move || guard.reload()).await {
            Ok(Ok(())) => tracing::info!("tokens and certificates were read again"),
            Ok(Err(error)) => tracing::error!(%error, "tokens and certificates stay as they were"),
            Err(_) => tracing::error!("tokens and certificates stay as they were: an internal fault"),
        }
    }
}

/// Continues the jobs in the folder, if there is one.
fn wake(shared: &ServerState, folder: Option<PathBuf>) -> Result<(), StoreError> {
    let woken = shared.jobs.wake(&shared.accounts, &shared.limits);
    woken.map_err(|reason| StoreError::Folder { path: folder.unwrap_or_default(), reason })
}

/// Opens every address: those of calls, that of metrics, and all as bound.
async fn open_all(
    listen: &[Address],
    metrics: Option<&Address>,
    insecure: bool,
    guard: &Guard,
) -> Result<(Vec<Listener>, Option<TcpListener>, Vec<Address>), ServeError> {
    let mut listeners = Vec::with_capacity(listen.len());
    for address in listen {
        listeners.push(Listener::bind(address, insecure, guard).await?);
    }
    let mut bound: Vec<Address> = listeners.iter().map(Listener::address).collect();
    let Some(address) = metrics else { return Ok((listeners, None, bound)) };
    let (overseer, address) = http::bind(address).await?;
    bound.push(address);
    Ok((listeners, Some(overseer), bound))
}

/// State that all calls share. Within a runtime.
pub(super) fn share(
    limits: Limits,
    reported: Vec<ServerSetting>,
    (make, store, connections): (MakeDevice, Option<Arc<SessionStore>>, Arc<Connections>),
    signals: &Shutdown,
) -> Arc<ServerState> {
    Arc::new(ServerState {
        work: ComputePermits::sliced(limits.analyses, &limits, signals.clone()),
        desk: ComputePermits::sliced(limits.analyses, &limits, signals.clone()),
        trials: ComputePermits::new(limits.analyses.saturating_mul(2), &limits, signals.clone()),
        results: Arc::new(Semaphore::new(limits.result_streams.min(Semaphore::MAX_PERMITS))),
        reported,
        make,
        models: ModelCache::default(),
        sessions: SessionRegistry::default(),
        jobs: JobRegistry::new(&limits, store.clone()),
        accounts: Arc::new(Accounts::new(&limits)),
        store,
        connections,
        metrics: Arc::default(),
        shutdown: signals.clone(),
        limits,
    })
}

/// Updates the readiness of this server in the health service.
async fn watch_over(health: HealthReporter, overseen: MonitoringState) {
    let mut ticks = tokio::time::interval(LOOK);
    let mut reported = None;
    loop {
        ticks.tick().await;
        let busy = busy(&overseen.shared, &overseen.gate);
        if reported == Some(busy.is_none()) {
            continue;
        }
        reported = Some(busy.is_none());
        if let Some(why) = &busy {
            tracing::warn!(why, "not ready for more");
        }
        let status = if busy.is_none() { ServingStatus::Serving } else { ServingStatus::NotServing };
        health.set_service_status(READY, status).await;
    }
}

/// Periodic tasks beside the calls, for as long as the server runs.
async fn keep_house(shared: Arc<ServerState>) {
    tokio::join!(expire(Arc::clone(&shared)), check_clients(shared));
}

/// Cancels jobs whose clients are gone, for as long as the server runs.
async fn check_clients(shared: Arc<ServerState>) {
    let mut ticks = tokio::time::interval(LOOK);
    loop {
        ticks.tick().await;
        shared.jobs.check_clients(&shared.connections);
    }
}

/// Drops objects unused for [`Limits::idle`], for as long as the server runs.
async fn expire(shared: Arc<ServerState>) {
    let idle = shared.limits.idle;
    let mut ticks = tokio::time::interval(
        (idle.min(shared.limits.stream_idle) / 4).clamp(Duration::from_millis(10), Duration::from_secs(30)),
    );
    loop {
        ticks.tick().await;
        if let Some(store) = shared.store.clone() {
            let forget = shared.limits.stream_idle;
            let _ = tokio::task::spawn_blocking(move || store.expire(forget)).await;
        }
        let sessions = shared.sessions.expire(&shared.limits);
        let expiring = Arc::clone(&shared);
        let sweeps = tokio::task::spawn_blocking(move || expiring.jobs.expire(&expiring.limits)).await.unwrap_or(0);
        if sessions + sweeps > 0 {
            tracing::info!(sessions, sweeps, open = shared.sessions.len(), "forgot what was idle");
        }
    }
}

fn with_sources(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(inner) = source {
        text = format!("{text}: {inner}");
        source = inner.source();
    }
    text
}
