//! Whether the answers of a session are messages that may be sent.

use super::limits::Limits;
use super::status;
use bimorph_wire::proto;
use tonic::Status;

/// Checks that the answers of a device with these ports (none: the model's `own`) and signals are messages that may be sent.
///
/// # Errors
/// RESOURCE_EXHAUSTED.
pub(super) fn answerable(open: &proto::OpenRequest, own: usize, limits: &Limits) -> Result<(), Status> {
    bounded(if open.ports.is_empty() { own } else { open.ports.len() }, open.signals.len(), limits)
}

/// The same of so many ports and signals: derivatives are as many as the square of the ports.
///
/// # Errors
/// RESOURCE_EXHAUSTED.
pub(super) fn bounded(ports: usize, signals: usize, limits: &Limits) -> Result<(), Status> {
    for (what, got) in [("ports", ports), ("signals", signals)] {
        if got > limits.signals {
            return Err(status::limit(what, limits.signals, got));
        }
    }
    let bytes = size_of::<f64>().saturating_mul(ports).saturating_mul(2 * ports + signals);
    if bytes > limits.message_bytes {
        let got = format!("{bytes} for the derivatives of {ports} ports and {signals} signals");
        return Err(status::limit("message_bytes", limits.message_bytes, got));
    }
    Ok(())
}
