//! The gRPC service (`bimorph.v1`) and its blocking clients.
//!
//! # Layout
//! [`proto`] is generated from `proto/`, and [`convert`] is the only module that knows both it and the library's own types.
//! [`client`] needs the feature `remote` alone, `tls` serves both ends, and the rest is the feature `server`.
//!
//! | module | what it holds |
//! |---|---|
//! | [`server`], [`until_signal`], `serve_options`, `shutdown` | start, options, drain and stop |
//! | [`settings`], [`limits`], `default_quotas`, [`descriptors`] | settings with their sources, limits, what one client gets by default |
//! | `sockets`, `connection`, `peer`, `framing` | listeners, connections and their peers, ends of messages |
//! | [`authentication`], [`tokens`], [`credentials`] | TLS and tokens of the server; what a client shows |
//! | `admission`, `accounts`, `byte_quota` | counts and limits of calls and bytes, in all and by client |
//! | `rpc`, `analyses`, `runs`, `stream`, `stream_request`, `chunks`, `pace` | handlers of the calls, streams, long replies |
//! | `models`, `sessions`, `session`, `attached_session`, `ids`, `usage` | compiled models, open sessions, their ids and leases |
//! | `session_states`, `small_signals`, `reply_size`, `snapshots` | states, spectra and snapshots of a session |
//! | [`store`], `session_restore`, `disk` | sessions that outlive the server |
//! | `jobs` | analyses that outlive their connection |
//! | `work`, `fair_semaphore` | computations off the event loop, scheduled fairly among clients |
//! | `monitoring`, [`metrics`], [`log`], `status` | endpoints, counters, log lines, errors as gRPC statuses |
//! | [`in_process`] | the service without a network |
//!
//! **Architecture invariant.** Below are [`bimorph_device`], [`bimorph_export`], [`bimorph_jobs`] and [`bimorph_layout`]. Only
//! [`convert`] knows messages and types of the library at once. No crate below knows gRPC.

#[cfg(feature = "server")]
mod accounts;
pub mod address;
pub mod client;
pub mod convert;
pub mod credentials;
mod ids;
pub mod proto;

#[cfg(feature = "server")]
mod admission;
#[cfg(feature = "server")]
mod analyses;
#[cfg(feature = "server")]
mod attached_session;
#[cfg(feature = "server")]
pub mod authentication;
#[cfg(feature = "server")]
mod byte_quota;
#[cfg(feature = "server")]
mod chunks;
#[cfg(feature = "server")]
mod connection;
#[cfg(feature = "server")]
mod default_quotas;
#[cfg(feature = "server")]
pub mod descriptors;
#[cfg(feature = "server")]
mod disk;
#[cfg(feature = "server")]
mod fair_semaphore;
#[cfg(feature = "server")]
mod framing;
#[cfg(feature = "server")]
pub mod in_process;
#[cfg(feature = "server")]
mod jobs;
#[cfg(feature = "server")]
pub mod limits;
#[cfg(feature = "server")]
pub mod log;
#[cfg(feature = "server")]
pub mod metrics;
#[cfg(feature = "server")]
mod models;
#[cfg(feature = "server")]
mod monitoring;
#[cfg(feature = "server")]
mod pace;
#[cfg(feature = "server")]
mod peer;
#[cfg(all(test, feature = "server"))]
mod power_cuts;
#[cfg(feature = "server")]
mod reply_size;
#[cfg(feature = "server")]
mod rpc;
#[cfg(feature = "server")]
mod runs;
#[cfg(feature = "server")]
mod serve_options;
#[cfg(feature = "server")]
pub mod server;
#[cfg(feature = "server")]
mod session;
#[cfg(feature = "server")]
mod session_restore;
#[cfg(feature = "server")]
mod session_states;
#[cfg(feature = "server")]
mod sessions;
#[cfg(feature = "server")]
pub mod settings;
#[cfg(feature = "server")]
mod shared;
#[cfg(feature = "server")]
mod shutdown;
#[cfg(feature = "server")]
mod small_signal;
#[cfg(feature = "server")]
mod small_signals;
#[cfg(feature = "server")]
mod snapshots;
#[cfg(feature = "server")]
mod sockets;
#[cfg(feature = "server")]
mod status;
#[cfg(feature = "server")]
pub mod store;
#[cfg(feature = "server")]
mod stream;
#[cfg(feature = "server")]
mod stream_request;
#[cfg(feature = "tls")]
pub mod tls;
#[cfg(feature = "server")]
pub mod tokens;
#[cfg(feature = "server")]
pub mod until_signal;
#[cfg(feature = "server")]
mod usage;
#[cfg(feature = "server")]
mod work;
