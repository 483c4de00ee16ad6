//! Calls from a thread that may block: messages as bytes, and answers for as long as they are wanted.

use prost::Message;
use std::future::Future;
use std::time::Duration;
use tokio::runtime::Handle;
use tonic::{Request, Status};

/// Interval at which a waiting caller is checked for cancellation.
const LOOK: Duration = Duration::from_millis(50);

/// A message of the protocol.
///
/// # Errors
/// INVALID_ARGUMENT for other bytes.
pub fn decoded<T: Message + Default>(request: &[u8]) -> Result<Request<T>, Status> {
    let read = T::decode(request).map(Request::new);
    read.map_err(|error| Status::invalid_argument(format!("expected a message of the protocol: {error}")))
}

/// The caller must be on a thread that may block.
///
/// # Errors
/// FAILED_PRECONDITION within asynchronous code.
pub fn not_asynchronous() -> Result<(), Status> {
    let text = "the service in process was called from asynchronous code; call it on a thread of its own";
    Handle::try_current().map_or(Ok(()), |_| Err(Status::failed_precondition(text)))
}

/// An answer, for as long as it is wanted.
///
/// # Errors
/// Those of the answer; CANCELLED where it is not wanted any more.
pub async fn wanted<T>(answer: impl Future<Output = Result<T, Status>>, waits: &dyn Fn() -> bool) -> Result<T, Status> {
    let mut answer = std::pin::pin!(answer);
    loop {
        match tokio::time::timeout(LOOK, &mut answer).await {
            Ok(answered) => return answered,
            Err(_) if waits() => {}
            Err(_) => return Err(Status::cancelled("stopped here")),
        }
    }
}
