//! The `bimorph` command from outside: what it prints, writes and returns.

mod analyses;
mod bench;
mod errors;
mod outputs;
mod service;
