//! The `bimorph` command from outside: what it prints, writes and returns.

mod analyses;
mod batch;
mod chart;
mod command;
mod configuration;
mod damage;
mod errors;
mod export;
#[cfg(target_os = "linux")]
mod forged_requests;
mod full_disks;
mod health;
mod jobs;
mod killed_clients;
mod killed_jobs;
mod layouts;
mod monitoring;
mod operations;
mod outputs;
mod restored_states;
mod serve_process;
mod service;
mod stepping;
mod stored_sessions;
mod sweep_statistics;
mod tls_and_tokens;
