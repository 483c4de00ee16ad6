//! The gRPC server (`bimorph.v1`), and the same service in process.
//!
//! # Layout
//! | module | what it holds |
//! |---|---|
//! | [`server`], [`until_signal`], `serve_options`, `shutdown` | start, options, drain and stop |
//! | [`settings`], [`limits`], `default_quotas`, [`descriptors`] | settings with their sources, limits, what one client gets by default |
//! | `sockets`, `connection`, `peer`, `framing` | listeners, connections and their peers, ends of messages |
//! | [`authentication`], [`tokens`] | TLS and tokens of the server |
//! | `admission`, `accounts`, `byte_quota` | counts and limits of calls and bytes, in all and by client |
//! | `rpc`, `analyses`, `runs`, `stream`, `stream_request`, `chunks`, `pace` | handlers of the calls, streams, long replies |
//! | `models`, `sessions`, `session`, `attached_session`, `usage` | compiled models, open sessions and their leases |
//! | `session_states`, `small_signals`, `reply_size`, `snapshots` | states, spectra and snapshots of a session |
//! | [`store`], `session_restore` | sessions that outlive the server |
//! | `jobs` | analyses that outlive their connection |
//! | `work`, `fair_semaphore` | computations off the event loop, scheduled fairly among clients |
//! | `monitoring`, [`metrics`], [`log`], `status` | endpoints, counters, log lines, errors as gRPC statuses |
//! | [`in_process`] | the service without a network |
//!
//! **Architecture invariant.** Below is [`bimorph_wire`], which alone knows messages and types of the library at once. No crate below knows
//! a server.

mod accounts;

mod admission;
mod analyses;
mod attached_session;
pub mod authentication;
mod byte_quota;
mod chunks;
mod connection;
mod default_quotas;
pub mod descriptors;
mod fair_semaphore;
mod framing;
pub mod in_process;
mod jobs;
mod layouts;
pub mod limits;
pub mod log;
pub mod metrics;
mod models;
mod monitoring;
mod pace;
mod peer;
#[cfg(test)]
mod power_cuts;
mod reply_size;
mod rpc;
mod runs;
mod serve_options;
pub mod server;
mod session;
mod session_restore;
mod session_states;
mod sessions;
pub mod settings;
mod shared;
mod shutdown;
mod small_signal;
mod small_signals;
mod snapshots;
mod sockets;
mod status;
pub mod store;
mod stream;
mod stream_request;
pub mod tokens;
pub mod until_signal;
mod usage;
mod work;
