//! The gRPC service (`bimorph.v1`) and its blocking clients.
//!
//! # Layout
//! [`proto`] is what travels and [`convert`] the only place that knows both it and the library's own types. [`client`]
//! is built with the feature `remote` alone, and shows what [`access`] says; `tls` is for both ends. The rest is the feature `server`: [`server`] listens and stops
//! ([`until_signal`] by signals), [`descriptors`] compares what it may open, `shares` is what one client has of it where nobody says,
//! (`sockets`, `connection`, `shutdown`), [`guard`] and `tokens` ask who comes, `accounts` what each has, `intake` counts what comes in as `bodies`, `rpc` answers calls (`analyses` those that compute), `stream` is the Newton loop, about
//! a session that it has `joined`, [`inside`] is all of it without a network,
//! `models`, `sessions` and `jobs` keep what clients can name, under `ids` that nobody guesses; a `session` answers each `question`, has its `usage` and its
//! `spectra`, `snapshots` puts it into bytes, `store` and `keeper` hold what outlives the server, on a `disk`, which `waking` goes on with and
//! [`survey`] looks at, `work` computes, in the `turns` of clients, `chunks` sends what is long, `runs` takes many steps in one call, `status` says what went wrong, [`log`]
//! says it without waiting, [`limits`] is what clients may ask for, and [`settings`] all
//! that a server is told, in whichever way it is [`written`].

pub mod access;
#[cfg(feature = "server")]
mod accounts;
pub mod address;
pub mod client;
pub mod convert;
mod ids;
pub mod proto;

#[cfg(feature = "server")]
mod analyses;
#[cfg(feature = "server")]
mod answerable;
#[cfg(feature = "server")]
mod bodies;
#[cfg(feature = "server")]
mod chunks;
#[cfg(feature = "server")]
mod connection;
#[cfg(feature = "server")]
pub mod descriptors;
#[cfg(feature = "server")]
mod disk;
#[cfg(feature = "server")]
mod framing;
#[cfg(feature = "server")]
mod gate;
#[cfg(feature = "server")]
pub mod guard;
#[cfg(feature = "server")]
pub mod inside;
#[cfg(feature = "server")]
mod intake;
#[cfg(feature = "server")]
mod jobs;
#[cfg(feature = "server")]
mod joined;
#[cfg(feature = "server")]
mod keeper;
#[cfg(feature = "server")]
mod kept;
#[cfg(feature = "server")]
pub mod limits;
#[cfg(feature = "server")]
pub mod log;
#[cfg(feature = "server")]
pub mod metrics;
#[cfg(feature = "server")]
mod models;
#[cfg(feature = "server")]
mod overseen;
#[cfg(feature = "server")]
mod overseer;
#[cfg(feature = "server")]
mod pace;
#[cfg(all(test, feature = "server"))]
mod power_cuts;
#[cfg(feature = "server")]
mod presence;
#[cfg(feature = "server")]
mod question;
#[cfg(feature = "server")]
mod restored;
#[cfg(feature = "server")]
mod room;
#[cfg(feature = "server")]
mod rpc;
#[cfg(feature = "server")]
mod runs;
#[cfg(feature = "server")]
pub mod server;
#[cfg(feature = "server")]
mod serving;
#[cfg(feature = "server")]
mod session;
#[cfg(feature = "server")]
mod sessions;
#[cfg(feature = "server")]
pub mod settings;
#[cfg(feature = "server")]
mod shared;
#[cfg(feature = "server")]
mod shares;
#[cfg(feature = "server")]
mod shutdown;
#[cfg(feature = "server")]
mod small_signal;
#[cfg(feature = "server")]
mod snapshots;
#[cfg(feature = "server")]
mod sockets;
#[cfg(feature = "server")]
mod spectra;
#[cfg(feature = "server")]
mod status;
#[cfg(feature = "server")]
mod store;
#[cfg(feature = "server")]
mod stream;
#[cfg(feature = "server")]
pub mod survey;
#[cfg(feature = "tls")]
pub mod tls;
#[cfg(feature = "server")]
pub mod tokens;
#[cfg(feature = "server")]
mod turns;
#[cfg(feature = "server")]
pub mod until_signal;
#[cfg(feature = "server")]
mod usage;
#[cfg(feature = "server")]
mod waking;
#[cfg(feature = "server")]
mod work;
#[cfg(feature = "server")]
pub mod written;
