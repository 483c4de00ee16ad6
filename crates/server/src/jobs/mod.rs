//! Jobs: analyses that outlive their connections.
//!
//! `job_origin` is the request and its name. A `job` has `rows`, stored in a `folder` that outlives the server and read
//! back by `reading`, a `job_state` and `holders`; `wire` converts it to messages. The `registry` holds all jobs and
//! lists them in `pages`, and `running` schedules them. `calls`, `legacy_calls` and `streams` are the interface for
//! clients.

mod calls;
mod folder;
mod holders;
mod job;
mod job_origin;
mod job_state;
mod legacy_calls;
mod pages;
#[cfg(test)]
mod power_cuts;
mod reading;
pub(super) mod registry;
mod rows;
mod running;
mod streams;
mod wire;

pub(super) use streams::{JobStream, RowStream, SweepStream, TableStream};
