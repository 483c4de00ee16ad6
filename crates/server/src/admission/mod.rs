//! Admission control: calls and request bytes are counted, limited and timed before a handler runs.
//!
//! | file | what it holds |
//! |---|---|
//! | `service` | the layer in front of the generated gRPC service |
//! | `counters` | calls and bytes in progress, by server and by connection, and the check of tokens |
//! | `body` | request and reply bodies that report their bytes and their end |

pub(super) mod body;
pub(super) mod counters;
pub(super) mod service;
