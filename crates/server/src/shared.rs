//! State that all calls of a server share.

use super::accounts::{Accounts, CountLease};
use super::connection::Connections;
use super::fair_semaphore::client;
use super::jobs::registry::JobRegistry;
use super::limits::Limits;
use super::metrics::Metrics;
use super::models::ModelCache;
use super::server::MakeDevice;
use super::sessions::SessionRegistry;
use super::shutdown::Shutdown;
use super::status;
use super::store::SessionStore;
use super::work::ComputePermits;
use bimorph_wire::proto;
use std::sync::Arc;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tonic::{Response, Status};

/// State that all calls of a server share.
pub(super) struct ServerState {
    pub(super) limits: Limits,
    /// All settings of this server, for Info.
    pub(super) reported: Vec<proto::ServerSetting>,
    pub(super) make: MakeDevice,
    pub(super) models: ModelCache,
    pub(super) sessions: SessionRegistry,
    pub(super) jobs: JobRegistry,
    /// Account of each client.
    pub(super) accounts: Arc<Accounts>,
    pub(super) connections: Arc<Connections>,
    pub(super) metrics: Arc<Metrics>,
    /// States that outlive the server.
    pub(super) store: Option<Arc<SessionStore>>,
    /// Places for analyses, which may take long.
    pub(super) work: ComputePermits,
    /// Places for what a circuit waits for before it can start.
    pub(super) desk: ComputePermits,
    /// Places for trials that take longer than may pass where requests arrive.
    pub(super) trials: ComputePermits,
    /// Places for results that are being sent.
    pub(super) results: Arc<Semaphore>,
    pub(super) shutdown: Shutdown,
}

/// The service.
#[derive(Clone)]
pub(super) struct BimorphService(pub(super) Arc<ServerState>);

/// A place for results that are being sent, until it is dropped.
pub(super) struct SendingPermit {
    _place: OwnedSemaphorePermit,
    _counted: Option<CountLease>,
}

/// The answer of a call.
pub(super) type Reply<T> = Result<Response<T>, Status>;

impl BimorphService {
    /// A place for results that are being sent.
    pub(super) fn sending(&self) -> Result<SendingPermit, Status> {
        let counted = client().account.map(|account| account.stream()).transpose()?;
        let most = self.0.limits.result_streams;
        let place = Arc::clone(&self.0.results).try_acquire_owned();
        let place =
            place.map_err(|_| status::limit("result_streams", most, "one more; read or end those that are open"))?;
        Ok(SendingPermit { _place: place, _counted: counted })
    }
}
