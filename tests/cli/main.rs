//! The `bimorph` command from outside: what it prints, writes and returns.

mod analyses;
mod batch;
mod bench;
mod chart;
mod configuration;
mod damage;
mod errors;
mod export;
#[cfg(target_os = "linux")]
mod forged;
mod full;
mod health;
mod jobs;
mod kept;
mod killed_clients;
mod killed_jobs;
mod layouts;
mod operations;
mod outputs;
mod overseen;
mod secure;
mod service;
mod serving;
mod stepping;
mod survivors;
mod yields;
