//! The protocol (`bimorph.v1`): messages, their conversion to and from the types of the library, and blocking clients.
//!
//! # Layout
//! | module | what it holds |
//! |---|---|
//! | [`proto`] | messages and stubs, generated from `proto/` |
//! | [`convert`] | the only module that knows messages and the library's own types |
//! | [`client`] | blocking clients for circuits and analyses |
//! | [`address`], [`credentials`], [`tls`] | where a server is, what a client shows, and TLS of both ends |
//! | [`ids`], [`waiting`] | unguessable ids, calls from threads that may block |
//!
//! The feature `tls` serves both ends. The feature `server` adds the server's stubs and the channels of other languages.
//!
//! **Architecture invariant.** Below are [`bimorph_device`], [`bimorph_export`] and [`bimorph_jobs`]. No crate
//! below knows gRPC, and nothing here listens.

pub mod address;
pub mod client;
pub mod convert;
pub mod credentials;
pub mod ids;
pub mod proto;
#[cfg(feature = "tls")]
pub mod tls;
#[cfg(feature = "server")]
pub mod waiting;
