//! Requests of a stream to its session.

use bimorph_wire::proto;

/// Requests of a stream to its session.
pub(super) enum StreamRequest {
    Open(proto::OpenRequest),
    Trial(proto::TrialRequest),
    /// By the stream of that number.
    Accept(proto::Accept, u64),
    Linearize(proto::SmallSignalRequest),
}

impl StreamRequest {
    /// Whether it accepts a state.
    pub(super) fn is_accept(&self) -> bool {
        matches!(self, Self::Accept(..))
    }

    /// Whether it has no answer.
    pub(super) fn is_silent(&self) -> bool {
        matches!(self, Self::Accept(accept, _) if !accept.answer)
    }
}
