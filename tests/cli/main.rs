//! The `bimorph` command from outside: what it prints, writes and returns.

mod analyses;
mod batch;
mod bench;
mod chart;
mod configuration;
mod errors;
mod export;
mod layouts;
mod outputs;
mod secure;
mod service;
mod serving;
