//! The gRPC service (`bimorph.v1`) and its blocking clients.
//!
//! # Layout
//! [`proto`] is what travels and `convert` the only place that knows both it and the library's own types. [`client`] is
//! built with the feature `remote` alone; the rest is the feature `server`: [`server`] listens and stops, [`limits`]
//! says what clients may ask for.

pub mod address;
pub mod client;
pub mod proto;

pub mod limits;
#[cfg(feature = "server")]
pub mod server;
