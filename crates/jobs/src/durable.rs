//! Records that outlive the program and the machine. A record that is cut off or damaged is noticed, and never taken for another one.
//!
//! | module | what it has | files |
//! |---|---|---|
//! | [`record`] | bytes with their kind and a checksum | sessions and models of a server, requests of jobs |
//! | [`mod@line`] | lines of JSON with a checksum | rows and ends of jobs, journals of sweeps |
//! | [`log`] | a file that grows by whole lines | journals |
//! | [`disk`] | writing, replacing and adding, in an order that a failure of power cannot undo | all files of a server |
//!
//! Results of commands are no records: `results/atomic.rs` writes them, through links and to devices, for any reader.

#[cfg(unix)]
pub mod disk;
pub mod line;
pub mod log;
pub mod record;
