//! Stopping in three steps: drain, end, cut.
//!
//! Waiting for clients alone can take forever (a client that never reads also never closes), so each step has its own
//! signal: `draining` refuses new work, `ending` ends open streams with UNAVAILABLE, `cutting` fails the sockets.

use std::future::Future;
use std::pin::Pin;
use std::time::Duration;
use tokio_util::sync::CancellationToken;

/// Time for streams to send their final status on shutdown before connections are cut.
pub(super) const GRACE: Duration = Duration::from_millis(300);

/// Something to wait for, whatever it is.
pub(super) type BoxedWait<'a, T> = Pin<Box<dyn Future<Output = T> + Send + 'a>>;

/// The three signals, shared by everything with the lifetime of the server.
#[derive(Debug, Clone, Default)]
pub(super) struct Shutdown {
    pub(super) draining: CancellationToken,
    pub(super) ending: CancellationToken,
    pub(super) cutting: CancellationToken,
}
